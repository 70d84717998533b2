"""Result of ``simulate``: a simulated manoeuvre with its figures, its motion, and the bands of an ensemble."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from tank2sim.analysis.ensemble.results import ManoeuvreBands
from tank2sim.analysis.manoeuvre import ManoeuvreStudy, OtherSide
from tank2sim.answer.charts.manoeuvre import (
    Motion,
    along_course,
    motion_of,
    pull_out_chart,
    stop_dimensions,
    stop_speed_chart,
    turn_chart,
    way_chart,
    zigzag_chart,
)
from tank2sim.answer.charts.motion import spiral_chart, varying_histories
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, data_frame, table
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.results.ensembles import EnsembleResult, band_table
from tank2sim.simulation.card_range import entry_name, single_figures
from tank2sim.simulation.figures import zero_rate_rudders
from tank2sim.simulation.run import Run
from tank2sim.simulation.trial_file import trial_columns, trial_csv
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_T = TypeVar("_T")

_SIDE_NAMES: Mapping[float, str] = {1: "starboard", -1: "port"}


_FIRST: Mapping[str, tuple[str, ...]] = {
    "turn": ("advance_m", "transfer_m", "tactical_diameter_m"),
    "difference": ("advance_m", "transfer_m", "tactical_diameter_m"),
    "zigzag": ("overshoot_1_deg", "overshoot_2_deg", "initial_turning_distance_m"),
    "pullout": ("steady_rate_degps", "residual_rate_degps", "time_to_half_rate_s"),
    "spiral": ("loop_width_deg", "loop_height_degps"),
    "stop": ("track_reach_m", "side_reach_m", "time_to_stop_s"),
}
"""Figures at the top of the page of each manoeuvre."""

_IN_LENGTHS = {"initial_turning_distance_m": "initial_turning_lengths"}
"""Figures in ship lengths whose name does not follow from the figure in m."""

_OTHERS = 4
"""Figures at the top of the page of any other manoeuvre. Project choice."""

_MEET = 0.05
"""Yaw rates at the end of the pull-outs from both sides that differ by less than this share of those at their begin
have met. Project choice: what is left of a stable ship's after three of its time constants."""

_OUTSIDE = "outside"
_NO_LOOP = ("The curve has no loop: at each rudder angle the ship has one steady turn.",)
_LOOP = (
    "Within the loop the ship keeps turning to its side: it is unstable on a straight course.",
    "Its width is read between the rudder angles of the spiral; the command stability is exact.",
)


@dataclass(frozen=True, eq=False, repr=False)
class ManoeuvreResult(EnsembleResult[ManoeuvreStudy]):
    """A simulated manoeuvre.

    Parameters
    ----------
    study : ManoeuvreStudy
    run : Run, optional
        Motion and figures, SI and radians; None if the result was read from its JSON.
    ship : Ship, optional
        The ship (:class:`tank2sim.Ship`).

    Examples
    --------
    >>> import tank2sim as t2s
    >>> run = t2s.load("mariner").zigzag(20, 20)
    >>> round(run.figures["overshoot_1_deg"])
    8
    >>> list(run.df.columns)[:3]
    ['t_s', 'delta_order_deg', 'delta_deg']
    """

    study: ManoeuvreStudy
    run: Run | None = None
    ship: Any = None
    command: ClassVar[str] = "simulate"

    @property
    def title(self) -> str:
        """The ship, and the manoeuvre in words."""
        return f"{self.study.ship}: {_manoeuvre_title(self.study)}"

    @property
    def subtitle(self) -> str:
        """The manoeuvre as it was ordered, and the ensemble."""
        members = f", {_members_text(self.study.ensemble)}" if self.study.ensemble else ""
        return f"Simulated manoeuvre {self.study.manoeuvre}{members}"

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The file of the orders."""
        kind, _, file = self.study.manoeuvre.partition(":")
        return (Path(file),) if kind == "file" else ()

    @cached_property
    def figures(self) -> dict[str, float]:
        """Manoeuvring figures (ITTC 7.5-04-02-01) by name with unit; entries of lists as ``overshoot_1_deg``."""
        return single_figures(self.study.figures)

    @property
    def limits(self) -> dict[str, float]:
        """Largest figures that IMO MSC.137(76) allows, by name with unit; empty for manoeuvres without any."""
        return self.study.limits

    @property
    def other_side(self) -> OtherSide | None:
        """Figures and motion of a pull-out from the other side."""
        return self.study.other_side

    @cached_property
    def df(self) -> pd.DataFrame:
        """The motion, one row a step: ``t_s``, ``u_mps``, ``r_degps``, ``psi_deg``, ``x_m`` (north), ``y_m`` (east).

        Of a result that was read from its JSON only some steps are known.
        """
        return data_frame(trial_columns(self.run.trajectory) if self.run else self.study.histories)

    def to_csv(self, path: str | Path | None = None) -> str:
        """The motion as text of a trial CSV, also written to `path`: readable wherever a measured trial is.

        Raises
        ------
        InputError
            The file cannot be written, or the result was read from its JSON, which has not the whole motion.
        """
        if self.run is None:
            problem = "the JSON of a result has not the whole motion"
            raise InputError(path or "the result", "", problem, "simulate the manoeuvre again")
        source = f"tank2sim simulation of {self.study.ship}: {self.study.manoeuvre}"
        text = trial_csv(self.run.trajectory, source)
        if path is not None:
            write_together({Path(path): text})
        return text

    @property
    def headline(self) -> tuple[str, ...]:
        """The limits of IMO, or the behaviour that a pull-out or a spiral shows, or the first figures."""
        study = self.study
        if study.kind == "pullout" and study.other_side:
            return (_pull_outs(study.figures, study.other_side.figures),)
        if judged := [figure for figure in self.key_figures if figure.limit is not None]:
            return (_judged(judged),)
        width = study.figures.get("loop_width_deg")
        if isinstance(width, float):
            return _LOOP if width > 0 else _NO_LOOP
        shown = [
            f"{each.label.lower()} {format_number(float(each.value), 3)} {each.unit}".strip()
            for each in self.key_figures[:3]
        ]
        return (f"{self.title}: {', '.join(shown)}.",) if shown else ()

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The main figures of the manoeuvre, with limits and intervals over the ensemble."""
        names = _FIRST.get(self.study.kind, tuple(self.figures)[:_OTHERS])
        return [self._key_figure(name, self.figures[name]) for name in names if name in self.figures]

    def _key_figure(self, name: str, value: float) -> KeyFigure:
        study, (label, unit) = self.study, in_words(name)
        limit, notes = self._limit(name), []
        if study.length_m and _in_lengths(name) in self.figures:
            notes.append(f"{format_number(value / study.length_m, 3)} L")
        if limit is not None:
            notes.append(f"IMO: at most {format_number(limit, 4)} {unit}")
        if study.ensemble and (band := study.ensemble.figures.get(name)):
            notes.append(f"{format_number(band.p5, 3)} to {format_number(band.p95, 3)} {unit} (90 %)")
        verdict = Verdict.NONE
        if name in study.outside_card_range:
            verdict = Verdict.CAUTION
            notes.append("outside the range of the card")
        elif limit is not None:
            verdict = Verdict.PASSED if value <= limit else Verdict.FAILED
        if name == "side_reach_m":
            notes.append(f"to {_SIDE_NAMES[math.copysign(1, value)]}")
            value = abs(value)
        label = label[:1].upper() + label[1:]
        return KeyFigure(label, value, unit, verdict=verdict, note="; ".join(notes), limit=limit)

    def _limit(self, name: str) -> float | None:
        """The largest value that IMO MSC.137(76) allows, in the unit of the figure."""
        limits, length = self.study.limits, self.study.length_m
        if name in limits:
            return limits[name]
        in_lengths = limits.get(_in_lengths(name)) if name.endswith("_m") else None
        return in_lengths * length if in_lengths is not None and length else None

    @property
    def sections(self) -> Sequence[Section]:
        """The manoeuvre, its time histories and its figures."""
        text = ""
        if self.study.kind == "pullout" and self.study.other_side:
            text = (
                "On a ship that is stable on a straight course the yaw rates from both sides decay to one value, which "
                "is zero at the neutral rudder; on an unstable ship they remain apart."
            )
        sections = [
            Section("The manoeuvre", text=text, charts=_manoeuvre_charts(self.study)),
            Section("Time histories", charts=_history_charts(self.study)),
            Section("Figures", tables=self._tables()),
        ]
        return [section for section in sections if section.charts or section.tables]

    def _tables(self) -> list[Table]:
        figures = _without_lengths(self.study.figures)
        numbers = {name: value for name, value in figures.items() if isinstance(value, float | int)}
        lists = {name: value for name, value in figures.items() if isinstance(value, list) and value}
        missing = list(dict.fromkeys(in_words(name)[0] for name, value in figures.items() if value is None))
        tables = [self._figure_table(numbers, missing)] if numbers or missing else []
        tables += [self._list_table(lists)] if lists else []
        ensemble = self.study.ensemble
        return [*tables, band_table(ensemble, _without_lengths(ensemble.figures))] if ensemble else tables

    def _figure_table(self, figures: Mapping[str, float], missing: Sequence[str]) -> Table:
        """One row a figure, its size in ship lengths and its limit next to it; empty columns are left out."""
        outside = dict.fromkeys(self.study.outside_card_range, _OUTSIDE)
        rows: list[list[Cell]] = [
            [
                *in_words(name),
                value,
                self.figures.get(_in_lengths(name)),
                self._limit(name),
                outside.get(name),
            ]
            for name, value in figures.items()
        ]
        heads = ["figure", "unit", "value", "ship lengths", "IMO: at most", "range of the card"]
        shown = [place for place in range(len(heads)) if place < 3 or any(row[place] is not None for row in rows)]
        notes = [f"The run is too short to show: {', '.join(missing)}."] if missing else []
        return table(
            f"Figures of {self.study.ship}, {self.study.manoeuvre}",
            [heads[place] for place in shown],
            [[row[place] for place in shown] for row in rows],
            *notes,
        )

    def _list_table(self, lists: Mapping[str, Sequence[float]]) -> Table:
        """Figures that a manoeuvre has several of, such as overshoots, by number."""
        longest, outside = max(map(len, lists.values())), self.study.outside_card_range
        rows: list[list[Cell]] = [
            [place + 1, *(values[place] if place < len(values) else None for values in lists.values())]
            for place in range(longest)
        ]
        heads = [Column("no.")]
        for name in lists:
            title, unit = in_words(name)
            heads.append(Column(title, unit))
        beyond = [any(entry_name(name, place) in outside for name in lists) for place in range(longest)]
        if any(beyond):
            heads.append(Column("range of the card"))
            rows = [[*row, _OUTSIDE if each else None] for row, each in zip(rows, beyond, strict=True)]
        return table("Figures by number", heads, rows)


def _judged(judged: Sequence[KeyFigure]) -> str:
    """Whether figures with a limit of IMO MSC.137(76) keep it."""
    failed = [figure.label.lower() for figure in judged if figure.verdict is Verdict.FAILED]
    if failed:
        return f"These figures exceed their limits of IMO MSC.137(76): {', '.join(failed)}."
    if any(figure.verdict is Verdict.CAUTION for figure in judged):
        return "The run leaves the card's valid range: figures outside it are not judged against IMO MSC.137(76)."
    names = ", ".join(figure.label.lower() for figure in judged)
    return f"These figures are within the limits of IMO MSC.137(76): {names}."


def _without_lengths(figures: Mapping[str, _T]) -> dict[str, _T]:
    """Figures that are not in ship lengths."""
    return {name: value for name, value in figures.items() if not name.endswith("_lengths")}


def _in_lengths(name: str) -> str:
    return _IN_LENGTHS.get(name, f"{name.removesuffix('_m')}_lengths")


def _pull_outs(*sides: Mapping[str, Any]) -> str:
    """Finding on the ship's stability from pull-outs to both sides."""
    (first, first_left), (second, second_left) = (
        (side["steady_rate_degps"], side["residual_rate_degps"]) for side in sides
    )
    if abs(first_left - second_left) <= _MEET * abs(first - second):
        return "The ship is stable on a straight course: the yaw rates from both sides meet."
    return "The yaw rates from both sides stay apart: the ship is unstable on a straight course, or very slow."


def _manoeuvre_title(study: ManoeuvreStudy) -> str:
    """Return the manoeuvre in words: ``turning circle, 35° of rudder to starboard``."""
    argument = study.argument
    side, size = _SIDE_NAMES[-1 if argument.startswith("-") else 1], argument.lstrip("+-")
    titles = {
        "turn": f"turning circle, {size}° of rudder to {side}",
        "zigzag": f"zigzag {size}, first to {side}",
        "pullout": f"pull-out from {size}° of rudder",
        "spiral": "direct spiral",
        "difference": f"turning circle to {side}, {size} rpm between the sides",
        "spin": f"turn on the spot to {side}, {size} rpm",
        "straight": f"straight course from rest, {argument} rpm",
        "stop": f"stop with {argument} rpm" if argument else "full astern stop",
    }
    return titles.get(study.kind, study.manoeuvre)


def _members_text(ensemble: ManoeuvreBands) -> str:
    """Return the members in words: how many ships, and with which errors."""
    errors = "assumed errors" if ensemble.assumed_errors else "the errors of the card"
    return f"{ensemble.usable} ships within {errors}"


def _manoeuvre_charts(study: ManoeuvreStudy) -> list[Illustration]:
    """Return the charts special to the manoeuvre, empty without a position or a yaw rate."""
    try:
        motion = motion_of(study.histories, study.length_m, study.beam_m)
    except KeyError:  # a craft or a file without a position or a yaw rate
        return []
    figures = single_figures(study.figures)
    title = _manoeuvre_title(study)
    title = title[:1].upper() + title[1:]
    bands, shaded = {}, ""
    if study.ensemble:
        title += ", standard errors assumed" * study.ensemble.assumed_errors
        bands = study.ensemble.figures
        shaded = f"Shaded: nine of ten of {_members_text(study.ensemble)}. Bars: nine of ten of each figure."
    match study.kind:
        case "turn" | "difference":
            chart = turn_chart(motion, figures, bands=bands, edges_m=_track_edges(study), title=title)
            return [Illustration(chart, caption=shaded)]
        case "zigzag":
            heading = float(study.argument.partition("/")[2])
            overshoots = {name: value for name, value in study.figures.items() if isinstance(value, list)}
            edges = _heading_edges(study)
            chart = zigzag_chart(motion, overshoots, heading, bands=bands, edges_deg=edges, title=title)
            return [Illustration(chart, caption=f"Red: the overshoots. {shaded}".strip())]
        case "pullout":
            return [_pull_out(study, motion, title)]
        case "spiral":
            return [_spiral(study, title)]
        case "stop":
            way = way_chart(motion, stop_dimensions(motion, figures), title="Track of the stop")
            return [_stop_speed(motion), Illustration(way, caption=shaded)]
    return [Illustration(way_chart(motion, [], title="Track"), caption=shaded)]


def _stop_speed(motion: Motion) -> Illustration:
    revolutions, held = motion.revolutions_rpm, ""
    if revolutions is not None and np.ptp(revolutions) == 0:
        held = f"Revolutions: {format_number(float(revolutions[-1]), 4)} rpm from the order on."
    return Illustration(stop_speed_chart(motion, title="Speed over distance"), caption=held)


def _history_charts(study: ManoeuvreStudy) -> list[Illustration]:
    """Return the chart of the signals that change over time, with the bands of an ensemble; empty without any."""
    bands = study.ensemble.histories if study.ensemble else {}
    drawn = varying_histories(study.histories, bands, study.ensemble.t_s if study.ensemble else np.zeros(0))
    return [drawn] if drawn else []


def _pull_out(study: ManoeuvreStudy, motion: Motion, title: str) -> Illustration:
    neutral = study.figures["neutral_rudder_deg"]
    assert isinstance(neutral, float)
    sides = {1 if motion.rudder_deg[1] > neutral else -1: motion}
    if study.other_side:
        sides[-next(iter(sides))] = motion_of(study.other_side.histories)
    named = {f"from a turn to {_SIDE_NAMES[side]}": sides[side] for side in sorted(sides, reverse=True)}
    return Illustration(pull_out_chart(named, neutral, title=title))


def _spiral(study: ManoeuvreStudy, title: str) -> Illustration:
    figures = study.figures
    rudder, rate = (np.asarray(figures[name], dtype=float) for name in ("rudder_deg", "rate_degps"))
    loop = zero_rate_rudders(rudder, rate) if figures.get("loop_width_deg") else None
    return Illustration(spiral_chart(rudder, rate, loop_deg=loop, title=title))


def _track_edges(study: ManoeuvreStudy) -> tuple[Array, Array] | None:
    track = study.ensemble.track if study.ensemble else None
    if track is None:
        return None
    return along_course(study.histories, track.low_m), along_course(study.histories, track.high_m)


def _heading_edges(study: ManoeuvreStudy) -> tuple[Array, Array, Array] | None:
    heading = study.ensemble.histories.get("psi_deg") if study.ensemble else None
    if study.ensemble is None or heading is None:
        return None
    course = study.histories["psi_deg"][0]
    return study.ensemble.t_s, heading.p5 - course, heading.p95 - course
