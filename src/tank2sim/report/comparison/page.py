"""The page of cards compared: coefficients in standard errors, figures side by side, tracks on one chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS
from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, SeriesLook, data, plain, series_look, stacked
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.marks import assumed_words
from tank2sim.report.json_values import Json
from tank2sim.units import in_words

_COEFFICIENTS = (
    "Prime system, in the convention of the first card, the sign of its rudder included. A coefficient belongs to the "
    "speed about which forces are expanded, to the speed that makes them non-dimensional and to what of the inertia is "
    "in it; where cards differ in these, the forces are expanded again to the third order, and the standard errors go "
    "with them. A difference is divided by the root of both variances: beyond 2 it is unlikely to be chance. A number "
    "that is the reference's own to the last digit was taken over, and is not compared."
)
_ASSUMED = "An asterisk marks a standard error that the card does not state: 2 % of the value."
_TRIALS = (
    "Simulated in calm water from the same approach speed, at the size of the first card's ship. In brackets the "
    "standard deviation of each figure when the card's coefficients are drawn within their errors; z is the "
    "difference over the root of both variances."
)


def compare_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim compare``."""
    labels = [card["label"] for card in found["cards"]]
    sections = [
        *_tracks(found["trials"]),
        *_figure_differences(found["trials"], labels, assumed_words(found["notices"])),
        _coefficients(found["coefficients"], found.get("effects", []), labels),
        _cards(found["cards"]),
    ]
    sections += notices_section(found["notices"])
    return Page(
        title=found["cards"][0]["ship"],
        subtitle=f"Comparison of cards: {', '.join(labels)}",
        verdict=_verdict(found, labels),
        figures=[*_largest(found["trials"], labels), *(_figure(card) for card in found["summary"])],
        sections=sections,
    )


def _verdict(found: Json, labels: Sequence[str]) -> str:
    """What differs most between the reference and the card that is farthest from it."""
    percents = _percents(found["trials"], labels)
    if not percents:
        return ""
    label, name, percent, _ = max(percents, key=lambda row: abs(row[2]))
    sure = [z for *_, z in percents if z is not None]
    beyond = sum(abs(z) > BEYOND_STANDARD_ERRORS for z in sure)
    trial, _, figure = name.partition(": ")
    text = f"{label} differs from {labels[0]} most in the {figure} of the {trial}: {percent:+.3g} %."
    if not sure:
        return text
    return f"{text} {beyond} of {len(sure)} figures differ by more than {BEYOND_STANDARD_ERRORS:g} standard deviations."


def _percents(
    trials: Sequence[Mapping[str, Json]], labels: Sequence[str]
) -> list[tuple[str, str, float, float | None]]:
    """Card, figure, difference from the reference in per cent, and in standard errors, where both cards show it."""
    return [
        (label, f"{trial['name'].replace(' deg to', '')}: {in_words(name)[0]}", 100 * apart / abs(row["values"][0]), z)
        for trial in trials
        for name, row in trial["figures"].items()
        for label, apart, z in zip(labels[1:], row["differences"], row["differences_standard_errors"], strict=True)
        if apart is not None and row["values"][0] and not name.endswith("_lengths")
    ]


def _largest(trials: Sequence[Mapping[str, Json]], labels: Sequence[str]) -> list[KeyFigure]:
    """The figure of each card that differs most from the reference."""
    found = _percents(trials, labels)
    cards = [
        max((row for row in found if row[0] == label), key=lambda row: abs(row[2]), default=None)
        for label in labels[1:]
    ]
    return [
        KeyFigure(label=f"{card[0]}: largest difference", value=float(f"{card[2]:.3g}"), unit="%", note=card[1])
        for card in cards
        if card
    ]


def _figure(summary: Mapping[str, Json]) -> KeyFigure:
    compared, beyond, rms = summary["compared"], summary["beyond_two_standard_errors"], summary["rms_standard_errors"]
    # One in twenty differs by more by chance alone.
    verdict = Verdict.PASSED if beyond <= 0.05 * compared + 1 else Verdict.CAUTION
    note = "no standard errors" if rms is None else f"rms {rms:.3g} standard errors"
    note += f"; {same} more taken over" if (same := summary.get("same_number")) else ""
    label = f"{summary['card']}: coefficients beyond {BEYOND_STANDARD_ERRORS:g}"
    return KeyFigure(label=label, value=f"{beyond} of {compared}", verdict=verdict, note=note)


def _cards(cards: Sequence[Mapping[str, Json]]) -> Section:
    rows: list[list[Cell]] = [
        [card["label"] + (" (reference)" if place == 0 else ""), card["ship"], card["source"]]
        for place, card in enumerate(cards)
    ]
    columns = [Column(title="card"), Column(title="ship"), Column(title="source")]
    return Section(heading="Cards", tables=[Table(caption="What is compared.", columns=columns, rows=rows)])


def _coefficients(
    coefficients: Sequence[Mapping[str, Json]], effects: Sequence[Mapping[str, Json]], labels: Sequence[str]
) -> Section:
    tables, alike, alone = [], 0, []
    for caption, rows, factor in (
        ("Coefficients that differ (values and errors times 1000).", coefficients, 1000.0),
        ("Parameters of effects that differ, SI.", effects, 1.0),
    ):
        shared = [row for row in rows if all(card["value"] is not None for card in row["cards"])]
        differing = [row for row in shared if any(apart["percent"] for apart in row["differences"])]
        alike += len(shared) - len(differing)
        alone += [row["name"] for row in rows if row not in shared]
        if differing:
            tables.append(_coefficient_table(caption, differing, labels, factor))
    omitted = [f"{alike} numbers are the same on all cards."] if alike else []
    omitted += [f"Not on all cards: {', '.join(alone)}."] if alone else []
    charts, both = [], [*coefficients, *effects]
    if any(difference["standard_errors"] is not None for row in both for difference in row["differences"]):
        caption = f"Lines at {BEYOND_STANDARD_ERRORS:g} standard errors."
        charts.append(Illustration(chart=_errors_chart(both, labels), caption=caption))
    return Section(
        heading="Coefficients", text="\n\n".join([_COEFFICIENTS, _ASSUMED, *omitted]), tables=tables, charts=charts
    )


def _coefficient_table(caption: str, rows: Sequence[Mapping[str, Json]], labels: Sequence[str], factor: float) -> Table:
    columns = [Column(title="coefficient")]
    for label in labels:
        columns += [Column(title=label, digits=6), Column(title="s.e.", digits=3)]
    for label in labels[1:]:
        columns += [Column(title=f"{label}: difference", unit="%", digits=3), Column(title="z", digits=3)]
    columns.append(Column(title="remark"))
    return Table(caption=caption, columns=columns, rows=[_coefficient_row(row, factor) for row in rows])


def _coefficient_row(row: Mapping[str, Json], factor: float) -> list[Cell]:
    cells: list[Cell] = [row["name"]]
    for card in row["cards"]:
        error = None if card["standard_error"] is None else factor * card["standard_error"]
        shown: Cell = error if card["stated"] or error is None else f"{error:.3g}*"
        cells += [None if card["value"] is None else factor * card["value"], shown]
    for difference in row["differences"]:
        cells += [difference["percent"], difference["standard_errors"]]
    return [*cells, "; ".join(dict.fromkeys(card["why"] for card in row["differences"] if card["why"]))]


def _errors_chart(coefficients: Sequence[Mapping[str, Json]], labels: Sequence[str]) -> alt.LayerChart:
    """Differences of all coefficients in standard errors, a row each, a shape and colour for each card."""
    rows = [
        {"name": row["name"], "z": difference["standard_errors"], "run": label}
        for row in coefficients
        for label, difference in zip(labels[1:], row["differences"], strict=True)
        if difference["standard_errors"] is not None
    ]
    names = list(dict.fromkeys(str(row["name"]) for row in rows))
    look = series_look(labels[1:], as_points=labels[1:])
    y = alt.Y("name:N", sort=names, title=None)
    points = (
        Chart(data(rows))
        .mark_point(filled=True, size=60)
        .encode(
            x=alt.X("z:Q", title="difference (standard errors)"),
            y=y,
            color=look.colour,
            shape=look.shape,
            tooltip=[
                alt.Tooltip("run:N", title="card"),
                alt.Tooltip("name:N", title="coefficient"),
                alt.Tooltip("z:Q", title="standard errors", format=NUMBER),
            ],
        )
    )
    limits = (
        Chart(data([{"z": -BEYOND_STANDARD_ERRORS}, {"z": BEYOND_STANDARD_ERRORS}]))
        .mark_rule(style="limit")
        .encode(x="z:Q")
    )
    described = f"Differences of {len(names)} coefficients from {labels[0]} in standard errors."
    chart: alt.LayerChart = alt.layer(limits, points).properties(
        title="Differences in standard errors", width=620, height=alt.Step(15), description=described
    )
    return chart


def _figure_differences(trials: Sequence[Mapping[str, Json]], labels: Sequence[str], assumed: str) -> list[Section]:
    """Differences of the figures from those of the reference, all manoeuvres in one chart."""
    rows = [
        {"run": label, "name": name, "percent": plain(percent)}
        | ({"low": plain(percent * (1 - 2 / abs(z))), "high": plain(percent * (1 + 2 / abs(z)))} if z else {})
        for label, name, percent, z in _percents(trials, labels)
    ]
    if not rows:
        return []
    chart = Illustration(chart=_percent_chart(rows, labels, assumed), caption=_PERCENT)
    tables = [_trial_table(trial, labels) for trial in trials]
    return [Section(heading="Figures of manoeuvres", text=_TRIALS, charts=[chart], tables=tables)]


_PERCENT = (
    "Points: difference from the reference. Bars: plus and minus two standard deviations, by the errors of both cards."
)


def _percent_chart(rows: Sequence[ChartRecord], labels: Sequence[str], assumed: str) -> alt.VConcatChart:
    """Differences in per cent of the reference's figure: a panel a manoeuvre, a row a figure, a shape and colour for
    each card."""
    panels: dict[str, list[ChartRecord]] = {}
    for row in rows:
        trial, _, figure = str(row["name"]).partition(": ")
        panels.setdefault(trial, []).append(row | {"figure": figure})
    ends = [float(row[key]) for row in rows for key in ("percent", "low", "high") if row.get(key) is not None]
    scale = alt.Scale(domain=[min(ends), max(ends)], zero=True, nice=True)
    look = series_look(labels[1:], as_points=labels[1:])
    charts = [
        _percent_panel(panel, trial, alt.X("percent:Q", scale=scale, title=None), look)
        for trial, panel in panels.items()
    ]
    return stacked(
        charts,
        title=f"Difference of the figures from {labels[0]}, %{assumed}",
        description=f"Differences of {len(rows)} figures from {labels[0]} in per cent.",
    )


def _percent_panel(rows: Sequence[ChartRecord], trial: str, x: alt.X, look: SeriesLook) -> alt.LayerChart:
    y = alt.Y("figure:N", sort=None, title=None, axis=alt.Axis(grid=True))
    base = Chart(data(list(rows))).encode(y=y, color=look.colour)
    tooltip = ["run:N", "name:N", alt.Tooltip("percent:Q", title="difference (%)", format=NUMBER)]
    points = base.mark_point(filled=True, size=60).encode(x=x, shape=look.shape, tooltip=tooltip)
    bars = base.mark_rule(strokeWidth=2, opacity=0.6).encode(x="low:Q", x2="high:Q")
    zero = Chart(data([{"percent": 0.0}])).mark_rule(style="reference").encode(x="percent:Q")
    chart: alt.LayerChart = alt.layer(zero, bars, points).properties(
        title=alt.Title(trial, anchor="start", fontSize=11), width=560, height=alt.Step(16)
    )
    return chart


def _tracks(trials: Sequence[Mapping[str, Json]]) -> list[Section]:
    charts = []
    for trial in trials:
        tracks = [
            TrackData(label=track["card"], x_m=track["x_m"], y_m=track["y_m"], time_s=track["t_s"])
            for track in trial["tracks"]
        ]
        if tracks:
            name = trial["name"][:1].upper() + trial["name"][1:]
            charts.append(Illustration(chart=track_chart(tracks, title=name, height_px=400), half=True))
    return [Section(heading="Tracks", charts=charts)] if charts else []


def _trial_table(trial: Mapping[str, Json], labels: Sequence[str]) -> Table:
    columns = [Column(title="figure"), Column(title="unit")]
    columns += [Column(title=label) for label in labels]
    for label in labels[1:]:
        columns += [Column(title=f"{label}: difference", digits=3), Column(title="z", digits=3)]
    rows: list[list[Cell]] = []
    for name, row in trial["figures"].items():
        if name.endswith("_lengths"):  # the figure in m has the same differences
            continue
        cells: list[Cell] = [*in_words(name)]
        cells += [_with_error(*pair) for pair in zip(row["values"], row["standard_deviations"], strict=True)]
        for apart, z in zip(row["differences"], row["differences_standard_errors"], strict=True):
            cells += [None if apart is None else format_number(apart, 3), z]
        rows.append(cells)
    return Table(caption=f"Figures of the {trial['name']}.", columns=columns, rows=rows, folded=True)


def _with_error(value: float | None, error: float | None) -> str | None:
    if value is None:
        return None
    return format_number(value) if error is None else f"{format_number(value)} ({format_number(error, 2)})"
