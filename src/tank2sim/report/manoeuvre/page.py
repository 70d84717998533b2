"""The page of a simulated manoeuvre, from its JSON: its figures next to their limits, its chart, histories, tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.answer.charts.columns import varying_histories
from tank2sim.answer.charts.manoeuvre import (
    Motion,
    Quantiles,
    along_course,
    motion_of,
    pull_out_chart,
    stop_dimensions,
    stop_speed_chart,
    turn_chart,
    way_chart,
    zigzag_chart,
)
from tank2sim.answer.charts.motion import SpiralData, spiral_chart
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.marks import assumed_words
from tank2sim.report.json_values import Json, is_number_value, words
from tank2sim.simulation.card_range import entry_name, single_figures
from tank2sim.simulation.figures import zero_rate_rudders

_FIRST = {
    "turn": ("advance_m", "transfer_m", "tactical_diameter_m"),
    "difference": ("advance_m", "transfer_m", "tactical_diameter_m"),
    "zigzag": ("overshoot_1_deg", "overshoot_2_deg", "initial_turning_distance_m"),
    "pullout": ("steady_rate_degps", "residual_rate_degps", "time_to_half_rate_s"),
    "spiral": ("loop_width_deg", "loop_height_degps"),
    "stop": ("track_reach_m", "side_reach_m", "time_to_stop_s"),
}
"""The figures at the top of the page of each manoeuvre."""

_IN_LENGTHS = {"initial_turning_distance_m": "initial_turning_lengths"}
"""Figures in ship lengths whose name is not that in m."""

_OTHERS = 4
"""Figures at the top of the page of any other manoeuvre. Project choice."""

_SIDES = {1: "starboard", -1: "port"}


def manoeuvre_page(result: Json) -> Page:
    """Return the page of a simulated manoeuvre, from its JSON."""
    figures = {name: value for name, value in single_figures(result["figures"]).items() if is_number_value(value)}
    ensemble = result.get("ensemble") or {}
    names = _FIRST.get(_kind(result), tuple(figures)[:_OTHERS])
    sections = [
        Section(heading="The manoeuvre", text=_explanation(result), charts=_charts(result, figures, ensemble)),
        *_history_section(result, ensemble),
        Section(heading="Figures", tables=_tables(result, ensemble)),
        *notices_section([*result.get("notices", []), *ensemble.get("notices", [])]),
    ]
    tiles = [_key_figure(name, figures[name], result, ensemble) for name in names if name in figures]
    return Page(
        title=f"{result['ship']}: {_title(result)}",
        subtitle=f"Simulated manoeuvre {result['manoeuvre']}" + (f", {_members(ensemble)}" if ensemble else ""),
        verdict=_verdict(result, tiles),
        figures=tiles,
        sections=[section for section in sections if section.charts or section.tables or section.notes],
    )


def _kind(result: Json) -> str:
    return str(result["manoeuvre"]).partition(":")[0]


def _argument(result: Json) -> str:
    return str(result["manoeuvre"]).partition(":")[2]


def _title(result: Json) -> str:
    kind, argument = _kind(result), _argument(result)
    side = _SIDES[-1 if argument.startswith("-") else 1]
    size = argument.lstrip("+-")
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
    return titles.get(kind, str(result["manoeuvre"]))


def _members(ensemble: Json) -> str:
    errors = "assumed errors" if _assumed(ensemble) else "the errors of the card"
    return f"{ensemble.get('usable', ensemble.get('members'))} ships within {errors}"


def _assumed(ensemble: Json) -> str:
    return assumed_words(ensemble.get("notices") or ())


def _in_lengths(name: str) -> str:
    return _IN_LENGTHS.get(name, f"{name.removesuffix('_m')}_lengths")


def _key_figure(name: str, value: float, result: Json, ensemble: Json) -> KeyFigure:
    """A figure with its limit, where there is one, and with its interval over the ensemble."""
    label, unit = words(name)
    limit, length = _limit(result, name), result.get("length_m")
    notes = []
    if length and _in_lengths(name) in single_figures(result["figures"]):
        notes.append(f"{format_number(value / length, 3)} L")
    if limit is not None:
        notes.append(f"IMO: at most {format_number(limit, 4)} {unit}")
    band = (ensemble.get("figures") or {}).get(name) or {}
    if is_number_value(band.get("p5")) and is_number_value(band.get("p95")):
        notes.append(f"{format_number(band['p5'], 3)} to {format_number(band['p95'], 3)} {unit} (90 %)")
    verdict = Verdict.NONE
    if name in (result.get("outside_card_range") or ()):
        verdict = Verdict.CAUTION
        notes.append("outside the range of the card")
    elif limit is not None:
        verdict = Verdict.PASSED if value <= limit else Verdict.FAILED
    if name == "side_reach_m":
        notes.append(f"to {_SIDES[-1 if value < 0 else 1]}")
        value = abs(value)
    return KeyFigure(
        label=label[:1].upper() + label[1:], value=value, unit=unit, verdict=verdict, note="; ".join(notes), limit=limit
    )


_MEET = 0.05
"""Yaw rates at the end of the pull-outs from both sides that differ by less than this share of those at their begin
have met. Project choice: what is left of a stable ship's after three of its time constants."""


def _verdict(result: Json, tiles: Sequence[KeyFigure]) -> str:
    """The result in a sentence, where IMO or a pull-out has one."""
    if _kind(result) == "pullout" and result.get("other_side"):
        pairs = [(side["steady_rate_degps"], side["residual_rate_degps"]) for side in _both_sides(result)]
        (first, first_left), (second, second_left) = pairs
        if abs(first_left - second_left) <= _MEET * abs(first - second):
            return "The ship is stable on a straight course: the yaw rates from both sides meet."
        return "The yaw rates from both sides stay apart: the ship is unstable on a straight course, or very slow."
    judged = [tile for tile in tiles if tile.limit is not None]
    if not judged:
        return (_loop_words(result) if _kind(result) == "spiral" else "") or _first_figures(tiles)
    if failed := [tile.label.lower() for tile in judged if tile.verdict is Verdict.FAILED]:
        return f"Beyond the limit of IMO MSC.137(76): {' and '.join(failed)}."
    if any(tile.verdict is Verdict.CAUTION for tile in judged):
        return "The run leaves the range of the card: figures that were settled there have no verdict."
    names = " and ".join(tile.label.lower() for tile in judged)
    return f"Within the limits of IMO MSC.137(76): {names}."


def _first_figures(tiles: Sequence[KeyFigure]) -> str:
    """The first three figures as a sentence; empty without any."""
    shown = [f"{tile.label.lower()}: {format_number(float(tile.value), 3)} {tile.unit}".strip() for tile in tiles[:3]]
    text = "; ".join(shown)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _both_sides(result: Json) -> tuple[Json, Json]:
    return result["figures"], result["other_side"]["figures"]


def _limit(result: Json, name: str) -> float | None:
    """The largest value that IMO MSC.137(76) allows, in the unit of the figure."""
    limits, length = result.get("limits") or {}, result.get("length_m")
    if name in limits:
        return float(limits[name])
    of_length = limits.get(_in_lengths(name)) if name.endswith("_m") else None
    return float(of_length * length) if of_length is not None and length else None


def _loop_words(result: Json) -> str:
    """What a spiral says of the ship."""
    width = result["figures"].get("loop_width_deg")
    if not is_number_value(width):
        return ""
    if width > 0:
        return "Within the loop the ship turns to the side that it comes from: it is unstable on a straight course."
    return "The curve has no loop: at each rudder angle the ship has one steady turn."


def _explanation(result: Json) -> str:
    """What the chart of a pull-out shows."""
    if _kind(result) == "pullout" and result.get("other_side"):
        return (
            "On a ship that is stable on a straight course the yaw rates from both sides decay to one value, which is "
            "zero at the neutral rudder; on an unstable ship they remain apart."
        )
    return ""


def _charts(result: Json, figures: Mapping[str, float], ensemble: Json) -> list[Illustration]:
    try:
        motion = motion_of(result["histories"], result.get("length_m"), result.get("beam_m"))
    except KeyError:  # a craft or a file without a position or a yaw rate
        return []
    kind, title = _kind(result), _title(result)
    title = title[:1].upper() + title[1:] + _assumed(ensemble)
    bands: Quantiles = ensemble.get("figures") or {}
    shaded = f"Shaded: nine of ten of {_members(ensemble)}. Bars: nine of ten of each figure." if ensemble else ""
    if kind in ("turn", "difference"):
        edges = _track_edges(result, ensemble)
        chart = turn_chart(motion, figures, bands=bands, edges_m=edges, title=title)
        return [Illustration(chart=chart, caption=shaded)]
    if kind == "zigzag":
        heading = float(_argument(result).partition("/")[2])
        edges_deg = _heading_edges(result, ensemble)
        chart = zigzag_chart(motion, result["figures"], heading, bands=bands, edges_deg=edges_deg, title=title)
        return [Illustration(chart=chart, caption=f"Red: the overshoots. {shaded}".strip())]
    if kind == "pullout":
        return [_pull_out(result, motion, title)]
    if kind == "spiral":
        return [_spiral(result, title)]
    if kind == "stop":
        constant = motion.revolutions_rpm
        said = (
            f"Revolutions: {format_number(float(constant[-1]), 4)} rpm from the order on."
            if constant is not None and np.ptp(constant) == 0
            else ""
        )
        way = way_chart(motion, stop_dimensions(motion, figures), title="Track of the stop")
        return [
            Illustration(chart=stop_speed_chart(motion, title="Speed over distance"), caption=said),
            Illustration(chart=way, caption=shaded),
        ]
    return [Illustration(chart=way_chart(motion, [], title="Track"), caption=shaded)]


def _pull_out(result: Json, motion: Motion, title: str) -> Illustration:
    neutral = result["figures"]["neutral_rudder_deg"]
    sides = {1 if motion.rudder_deg[1] > neutral else -1: motion}
    if other := result.get("other_side"):
        sides[-next(iter(sides))] = motion_of(other["histories"])
    named = {f"from a turn to {_SIDES[side]}": sides[side] for side in sorted(sides, reverse=True)}
    return Illustration(chart=pull_out_chart(named, neutral, title=title))


def _spiral(result: Json, title: str) -> Illustration:
    figures = result["figures"]
    rudder, rate = np.radians(figures["rudder_deg"]), np.radians(figures["rate_degps"])
    spiral = SpiralData(label="spiral", rudder_rad=rudder, yaw_rate_radps=rate)
    loop = zero_rate_rudders(rudder, rate) if figures.get("loop_width_deg") else None
    return Illustration(chart=spiral_chart([spiral], loop_rad=loop, title=title))


def _track_edges(result: Json, ensemble: Json) -> tuple[np.ndarray, np.ndarray] | None:
    track = ensemble.get("track") or {}
    if not (track.get("low_m") and track.get("high_m")):
        return None
    low, high = (along_course(result["histories"], np.array(track[edge], dtype=float)) for edge in ("low_m", "high_m"))
    return low, high


def _heading_edges(result: Json, ensemble: Json) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    heading = (ensemble.get("histories") or {}).get("psi_deg")
    if not heading:
        return None
    course = result["histories"]["psi_deg"][0]
    low, high = (np.array(heading[edge], dtype=float) - course for edge in ("p5", "p95"))
    return np.array(ensemble["t_s"], dtype=float), low, high


def _history_section(result: Json, ensemble: Json) -> list[Section]:
    drawn = varying_histories(result["histories"], ensemble)
    return [Section(heading="Time histories", charts=[drawn])] if drawn else []


def _tables(result: Json, ensemble: Json) -> list[Table]:
    figures = {
        name: value
        for name, value in result["figures"].items()
        if not isinstance(value, list) and value is not None and not name.endswith("_lengths")
    }
    lists = {name: value for name, value in result["figures"].items() if isinstance(value, list) and value}
    tables = [_figure_table(result, figures)] if figures else []
    if lists:
        tables.append(_list_table(result, lists))
    if ensemble.get("figures"):
        tables.append(_ensemble_table(ensemble))
    return tables


def _figure_table(result: Json, figures: Mapping[str, float]) -> Table:
    """One row a figure, its size in ship lengths and its limit next to it."""
    every, outside = single_figures(result["figures"]), result.get("outside_card_range") or ()
    rows: list[list[Cell]] = []
    for name, value in figures.items():
        label, unit = words(name)
        allowed = _limit(result, name)
        row: list[Cell] = [label, format_number(value), unit, every.get(_in_lengths(name))]
        row.append("" if allowed is None else format_number(allowed))
        rows.append([*row, "outside" if name in outside else ""])
    heads = [Column(title="figure"), Column(title="value"), Column(title="unit"), Column(title="ship lengths")]
    heads += [Column(title="IMO: at most"), Column(title="range of the card")]
    kept = [place for place in range(len(heads)) if any(row[place] not in (None, "") for row in rows)]
    return Table(
        caption="Figures of the manoeuvre.",
        columns=[heads[place] for place in kept],
        rows=[[row[place] for place in kept] for row in rows],
        folded=True,
    )


def _list_table(result: Json, lists: Mapping[str, Sequence[float]]) -> Table:
    """Figures that a manoeuvre has several of, such as overshoots, by number."""
    columns = [Column(title="no."), *(Column(title=words(name)[0], unit=words(name)[1]) for name in lists)]
    longest = max(len(values) for values in lists.values())
    rows: list[list[Cell]] = [
        [place + 1, *(values[place] if place < len(values) else None for values in lists.values())]
        for place in range(longest)
    ]
    outside = set(result.get("outside_card_range") or ())
    beyond = [any(entry_name(name, place) in outside for name in lists) for place in range(longest)]
    if any(beyond):
        columns.append(Column(title="range of the card"))
        rows = [[*row, "outside" if is_outside else ""] for row, is_outside in zip(rows, beyond, strict=True)]
    return Table(caption="Figures by number.", columns=columns, rows=rows, folded=True)


def _ensemble_table(ensemble: Json) -> Table:
    rows: list[list[Cell]] = [
        [*words(name), *(band.get(key) for key in ("p5", "p50", "p95", "shown_by"))]
        for name, band in ensemble["figures"].items()
        if not name.endswith("_lengths")
    ]
    rows = [[*row[:2], *(format_number(v) if is_number_value(v) else v for v in row[2:5]), row[5]] for row in rows]
    heads = ("figure", "unit", "5 %", "50 %", "95 %", "shown by")
    caption = f"Quantiles over {_members(ensemble)}."
    return Table(caption=caption, columns=[Column(title=head) for head in heads], rows=rows, folded=True)
