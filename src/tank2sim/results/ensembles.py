"""Parts of results that show an ensemble: bands of figures, and the probabilities of the IMO criteria."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.ensemble.results import ChanceOfAll, DrawnShips, FigureBands, Members, StabilityBands
from tank2sim.analysis.ensemble.steering import BodeBands, CurveBand, SteeringBands, StepBands, TurningBands
from tank2sim.analysis.ensemble.tails import Tail
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis
from tank2sim.answer.parts import Cell, Illustration, Section, Table, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.arrays import Array
from tank2sim.errors import ArgumentError
from tank2sim.memory import refuse_beyond_memory
from tank2sim.notices import Notice
from tank2sim.results.imo import BEYOND_THE_CARD
from tank2sim.results.stability_charts import steering_curves
from tank2sim.simulation.bands import Band
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_WIDTH = 680
_APART = 1e-6
"""Share of the largest yaw rate by which the two branches of a steering diagram are apart at least."""
_SHOWN = {"v:Q": "this ship", "low:Q": "5 %", "high:Q": "95 %"}


MEMBERS_TEXT = (
    "Members of the ensemble are this ship with numbers drawn from the standard errors of its card, and from their "
    "covariance where the card has one. Nine of ten lie between the 5 and the 95 % quantile. Each member has a random "
    "stream of its own, so that the same seed gives the same members everywhere."
)
_CHANCES = (
    "The probability that a criterion is met is the share of all usable members that meet it, with the 95 % "
    "interval that their number leaves (Wilson). A member whose trial does not show the figure counts as one that "
    "does not meet it. Where the trial of the card itself leaves the card's range no probability is reported."
)

_RARE = (
    "Where few members fail, another table has the probability of not meeting the criterion from members drawn "
    "about the ships that fail, each with its weight (importance sampling). Its effective size is the number of "
    "failing members of the card's own errors that would be as accurate; without enough there is no probability. "
    "Distance and linear probability hold for a figure that changes in proportion to the card's numbers; compare the "
    "linear figure with the figure there."
)


def ensemble_heading(found: Members) -> str:
    """Return the heading of the section of an ensemble."""
    return f"Ensemble of {found.members}{', standard errors assumed' * found.assumed_errors}"


_S = TypeVar("_S")


class EnsembleResult(Result[_S]):
    """A result whose study may have an ensemble."""

    study: Any

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices of the study and of its ensemble."""
        drawn: tuple[Notice, ...] = self.study.ensemble.notices if self.study.ensemble else ()
        return tuple(dict.fromkeys([*self.study.notices, *drawn]))

    @cached_property
    def members(self) -> pd.DataFrame:
        """The ships of the ensemble, one row each: the numbers drawn, by the dotted keys of the card and as its file
        has them; the figures (of a manoeuvre, of the straight course, or those asked for); the value of each IMO
        criterion, if it was judged; and whether the ship is ``usable``.

        A column "...: beyond the card" is 1 where the trial of a criterion left the card's range before its value.

        Raises
        ------
        InputError
            The result has no ensemble, was read from its JSON, which has only the bands, or the frame does not fit
            into the memory.
        """
        found: Members | None = self.study.ensemble
        return members_frame(found.drawn if found else None, found.members if found else 0)


def members_frame(drawn: DrawnShips | None, members: int) -> pd.DataFrame:
    """The ships of an ensemble, one row each: numbers drawn, figures, and whether the ship is usable.

    Parameters
    ----------
    drawn : DrawnShips or None
        None if the result was read from its JSON.
    members : int
        Size of the ensemble.

    Raises
    ------
    InputError
        There are no members, or the frame does not fit into the memory.
    """
    if not members:
        raise ArgumentError("members", "", "is 0: this result has no ensemble", "give members=100 or more")
    if drawn is None:
        remedy = "compute the result again with the same members and seed"
        raise ArgumentError("members", "", "the JSON of a result has the bands, not the members", remedy)
    refuse_beyond_memory("members", members, 2 * 8 * (len(drawn.draws.names) + len(drawn.figures)))
    return data_frame({**drawn.coefficients(), **drawn.figures, "usable": drawn.usable}).rename_axis("member")


def band_table(found: Members, figures: Mapping[str, Band]) -> Table:
    """Quantiles (5, 50, 95 %) of figures over the members of an ensemble.

    `figures`: name of each figure to its band.
    """
    rows: list[list[Cell]] = []
    for name, band in figures.items():
        kind, at, argument = name.partition("@")
        words, unit = in_words(kind)
        rows.append([words + at + argument, unit, band.p5, band.p50, band.p95, band.shown_by])
    caption = f"Ensemble of {found.members}, seed {found.seed}: 90 % of the members lie between 5 and 95 %"
    return table(caption, ("figure", "unit", "5 %", "50 %", "95 %", "shown by"), rows)


def figures_section(found: FigureBands | StabilityBands) -> Section:
    """Return the section with bands of figures by name."""
    return Section(ensemble_heading(found), text=MEMBERS_TEXT, tables=[band_table(found, found.figures)])


def stability_section(found: StabilityBands, criteria: Sequence[ImoCriterion]) -> Section:
    """Return the section of an ensemble judged by IMO criteria. `criteria`: of the card's own ship."""
    rare = {chance.name: chance.tail for chance in found.imo if chance.tail}
    if found.imo_all and found.imo_all.tail:
        rare["any of these"] = found.imo_all.tail
    text = [MEMBERS_TEXT, _CHANCES, *([_RARE] if rare else [])]
    return Section(
        ensemble_heading(found),
        text="\n\n".join(text),
        tables=[
            _chances(found, {criterion.name for criterion in criteria if criterion.beyond_card}),
            _criteria(found),
            *(_tails(rare) if rare else []),
            band_table(found, found.figures),
        ],
        charts=curve_charts(found.curves) if found.curves else (),
    )


def chance_sentences(found: StabilityBands | None) -> list[str]:
    """Return sentences on the probabilities of stability and of meeting all criteria together."""
    sentences: list[str] = []
    if found is None:
        return sentences
    if found.probability_stable is not None and found.probability_stable_interval_95:
        interval = _interval(found.probability_stable_interval_95)
        probability = f"probability {found.probability_stable:.3g} (95 % interval {interval})"
        sentences.append(f"The ship is stable on a straight course with {probability}.")
    if found.imo_all:
        sentences.append(_together(found.imo_all))
    return sentences


def _together(found: ChanceOfAll) -> str:
    probability = f"probability {found.probability_met:.3g} (95 % interval {_interval(found.interval_95)})"
    text = f"{len(found.criteria)} IMO criteria together are met with {probability}"
    tail = found.tail
    if tail and tail.probability is not None:
        text += f", not met with probability {tail.probability:.2e} (standard error {tail.standard_error:.1e})"
    return f"{text}."


def _interval(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.3f} to {ends[1]:.3f}"


def _chances(found: StabilityBands, beyond: set[str]) -> Table:
    """Probability of each IMO criterion; `beyond` names those whose trial leaves the card's range."""
    rows: list[list[Cell]] = []
    for chance in found.imo:
        known = chance.name not in beyond
        met: Cell = chance.probability_met
        if met is not None and not known:
            met = BEYOND_THE_CARD
        low, high = chance.interval_95 if chance.interval_95 and known else (None, None)
        rows.append([chance.name, met, low, high, chance.not_shown, chance.beyond_card])
    heads = ("criterion", "P(met)", "at least", "at most", "not shown by", "beyond the card")
    return table("Probability of each IMO criterion, with its 95 % interval", heads, rows)


def _criteria(found: StabilityBands) -> Table:
    rows: list[list[Cell]] = [
        [
            one.name,
            *((one.band.p5, one.band.p50, one.band.p95) if one.band else (None, None, None)),
            one.allowed,
            one.unit,
        ]
        for one in found.imo
    ]
    heads = ("criterion", "5 %", "50 %", "95 %", "allowed", "unit")
    return table("IMO MSC.137(76), worse side, over the ensemble", heads, rows, on_screen=False)


def _tails(rare: Mapping[str, Tail]) -> list[Table]:
    """Small probabilities of not meeting a criterion, and linear figures to compare them with."""
    remarks: dict[str, list[str]] = {}
    notes = []
    for name, tail in rare.items():
        if tail.remark:
            remarks.setdefault(tail.remark, []).append(name)
            continue
        moved = ", ".join(f"{number} {errors:+.1f}" for number, errors in tail.failing_ships.items())
        notes.append(
            f"{name}: {tail.failing} of {tail.members} members drawn about the failing ships fail; {tail.not_shown} of "
            f"them do not show the figure and {tail.beyond_card} left the card's range before; {tail.unusable} members "
            f"cannot be used; the mean of failing ships, in standard errors: {moved}"
        )
    notes += [f"{'; '.join(names)}: {remark}" for remark, names in remarks.items()]
    rows: list[list[Cell]] = [
        [name, tail.probability, tail.standard_error, round(tail.effective_size)] for name, tail in rare.items()
    ]
    linear: list[list[Cell]] = [
        [name, tail.distance, tail.linear_probability, tail.linear_figure, tail.figure] for name, tail in rare.items()
    ]
    heads = ("criterion", "P(not met)", "standard error", "effective size")
    linear_heads = ("criterion", "distance (sd)", "P if linear", "linear figure there", "figure there")
    return [
        table("Criteria that few members fail: by importance sampling", heads, rows, *notes),
        table("The same for a figure linear in the card's numbers", linear_heads, linear, on_screen=False),
    ]


def curve_charts(curves: SteeringBands) -> list[Illustration]:
    """Stable turns, Bode diagram and step of the rudder, each with its band."""
    turning, bode, step = curves.steady_turning, curves.bode, curves.step
    shaded = f"Line: this ship. Shaded: nine of ten of {curves.members} members."
    loop, with_loop, turns = turning.loop_width_deg, turning.with_loop, shaded
    if with_loop and loop:
        none = "" if with_loop == curves.members else " (none counted as 0)"
        turns += (
            f" {with_loop} of them have a hysteresis loop, {loop.p5:.3g} to {loop.p95:.3g} deg of rudder wide{none}; "
            "in the loop a ship keeps turning to the side that it comes from."
        )
    return [
        Illustration(turns_chart(turning, title="Stable turns over the ensemble"), caption=turns),
        Illustration(_bode_chart(bode, title="Bode diagram over the ensemble"), caption=shaded),
        Illustration(_step_chart(step, title="Step of the rudder over the ensemble"), caption=shaded),
    ]


def turns_chart(turning: TurningBands, *, title: str = "") -> ChartSpec:
    """Yaw rate of stable turns against the rudder, coming from starboard turn and, where it differs, from port."""
    rudder = turning.rudder_deg
    starboard, port = turning.yaw_rate_from_starboard_degps, turning.yaw_rate_from_port_degps
    apart = np.zeros(len(rudder), dtype=bool)
    for key in ("p5", "p50", "p95", "own"):
        from_starboard, from_port = getattr(starboard, key), getattr(port, key)
        apart |= np.abs(from_starboard - from_port) > _APART * np.nanmax(np.abs(from_starboard), initial=0.0)
    # With their neighbours, so that the branches meet.
    apart = apart | np.roll(apart, 1) | np.roll(apart, -1)
    series = [_banded("from starboard turn", rudder, starboard), _banded("from port turn", rudder, port, apart)]
    if not apart.any():
        series = [_banded("stable turns", rudder, starboard)]
    return curve_chart(
        Plot(series, up=PlotAxis("yaw rate (deg/s)")),
        PlotAxis("rudder angle, starboard positive (deg)", nice=False, zero=True),
        title=title,
        width_px=_WIDTH,
        window=["x"],
        described="Yaw rate of stable turns against the rudder, with its band over an ensemble.",
        shown=_SHOWN,
    )


def _bode_chart(bode: BodeBands, *, title: str) -> ChartSpec:
    """Magnitude and phase of the yaw rate by the rudder angle."""
    plots = [
        Plot([_banded("yaw rate by rudder angle", bode.omega_radps, band)], up=PlotAxis(name), height_px=180)
        for name, band in (("magnitude (dB)", bode.magnitude_dB), ("phase (deg)", bode.phase_deg))
    ]
    across = PlotAxis("angular frequency (rad/s)", log=True, nice=False, form="~g")
    described = "Bode diagram of yaw rate by rudder angle, with its band over an ensemble."
    return curve_panels(plots, across, title=title, width_px=_WIDTH, described=described, shown=_SHOWN)


def _step_chart(step: StepBands, *, title: str) -> ChartSpec:
    """Yaw rate after a step of one degree of rudder."""
    return steering_curves(
        [_banded("yaw rate", step.time_s, step.step_per_s)],
        ("time after the step (s)", "yaw rate per degree of rudder (deg/s)"),
        title=title,
        described="Yaw rate after a step of the rudder, with its band over an ensemble.",
        height=240,
        zero=False,
        shown=_SHOWN,
    )


def _banded(label: str, x: Array, band: CurveBand, shown: NDArray[np.bool_] | None = None) -> PlotSeries:
    """The line of the ship itself, in the band of the 5 and 95 % quantiles; gaps where it is not shown."""
    own, low, high = (
        values if shown is None else np.where(shown, values, np.nan) for values in (band.own, band.p5, band.p95)
    )
    return PlotSeries(label, x=x, y=own, low=low, high=high)
