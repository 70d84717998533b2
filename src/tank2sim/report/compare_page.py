"""The page of cards compared: coefficients in standard errors, figures side by side, tracks on one chart."""

from __future__ import annotations

from collections.abc import Sequence

import altair as alt

from tank2sim.analysis.practice.coefficients import BEYOND, CoefficientRow
from tank2sim.analysis.practice.comparison import CardComparison, TrialComparison
from tank2sim.report.chart_parts import NUMBER, data, series_look
from tank2sim.report.motion_charts import Track, track_chart
from tank2sim.report.numbers import format_number
from tank2sim.report.page import Cell, Column, Figure, Illustration, Page, Section, Table, Verdict
from tank2sim.units import in_words

_COEFFICIENTS = (
    "Prime system, rudder positive to starboard, in the convention of the first card. A coefficient belongs to the "
    "speed about which forces are expanded, to the speed that makes them non-dimensional and to what of the inertia is "
    "in it; where cards differ in these, the forces are expanded anew to the third order, and the standard errors go "
    "with them. A difference is divided by the root of both variances: beyond 2 it is unlikely to be chance."
)
_ASSUMED = "An asterisk marks a standard error that the card does not state: 2 % of the value."
_TRIALS = (
    "Simulated in calm water from the same approach speed, at the size of the first card's ship. In brackets the "
    "standard deviation of each figure when the card's coefficients are drawn within their errors; z is the "
    "difference over the root of both variances."
)


def compare_page(found: CardComparison) -> Page:
    """The page."""
    sections = [_cards(found), _coefficients(found)]
    sections += [_trial(trial, found, first=place == 0) for place, trial in enumerate(found.trials)]
    if found.notices:
        rows: list[list[Cell]] = [[one] for one in found.notices]
        table = Table(caption="What the reader should know.", columns=[Column(title="")], rows=rows)
        sections.append(Section(heading="Notices", tables=[table]))
    return Page(
        title=found.ships[0],
        subtitle=f"Comparison of cards: {', '.join(found.labels)}",
        figures=_figures(found),
        sections=sections,
    )


def _figures(found: CardComparison) -> list[Figure]:
    shown = []
    for place, label in enumerate(found.labels[1:], start=1):
        compared, beyond = len(found.in_errors(place)), found.beyond(place)
        # One in twenty differs by more by chance alone.
        verdict = Verdict.PASSED if beyond <= 0.05 * compared + 1 else Verdict.CAUTION
        rms = found.rms(place)
        note = "no standard errors" if rms is None else f"rms {rms:.3g} standard errors"
        value = f"{beyond} of {compared}"
        shown.append(Figure(label=f"{label}: coefficients beyond {BEYOND:g}", value=value, verdict=verdict, note=note))
    return shown


def _cards(found: CardComparison) -> Section:
    rows: list[list[Cell]] = [
        [label + (" (reference)" if place == 0 else ""), ship, source]
        for place, (label, ship, source) in enumerate(zip(found.labels, found.ships, found.sources, strict=True))
    ]
    columns = [Column(title="card"), Column(title="ship"), Column(title="source")]
    return Section(heading="Cards", tables=[Table(caption="What is compared.", columns=columns, rows=rows)])


def _coefficients(found: CardComparison) -> Section:
    others = found.labels[1:]
    columns = [Column(title="coefficient")]
    for label in found.labels:
        columns += [Column(title=label, digits=6), Column(title="s.e.", digits=3)]
    for label in others:
        columns += [Column(title=f"{label}: difference", unit="%", digits=3), Column(title="z", digits=3)]
    columns.append(Column(title="remark"))
    rows = [_coefficient_row(row) for row in found.coefficients]
    table = Table(caption="Coefficient by coefficient (values and errors times 1000).", columns=columns, rows=rows)
    charts = []
    if any(found.in_errors(place) for place in range(1, len(found.labels))):
        caption = f"Lines at {BEYOND:g} standard errors."
        charts.append(Illustration(chart=_errors_chart(found), caption=caption))
    return Section(heading="Coefficients", text=f"{_COEFFICIENTS}\n\n{_ASSUMED}", tables=[table], charts=charts)


def _coefficient_row(row: CoefficientRow) -> list[Cell]:
    cells: list[Cell] = [row.name]
    for one in row.cards:
        error = None if one.standard_error is None else 1000 * one.standard_error
        shown: Cell = error if one.stated or error is None else f"{error:.3g}*"
        cells += [None if one.value is None else 1000 * one.value, shown]
    for difference in row.differences:
        cells += [difference.percent, difference.standard_errors]
    return [*cells, "; ".join(dict.fromkeys(one.why for one in row.differences if one.why))]


def _errors_chart(found: CardComparison) -> alt.LayerChart:
    """Differences of all coefficients in standard errors, a row each, a shape and colour for each card."""
    rows = [
        {"name": row.name, "z": difference.standard_errors, "run": label}
        for row in found.coefficients
        for label, difference in zip(found.labels[1:], row.differences, strict=True)
        if difference.standard_errors is not None
    ]
    names = list(dict.fromkeys(str(row["name"]) for row in rows))
    look = series_look(found.labels[1:], as_points=found.labels[1:])
    y = alt.Y("name:N", sort=names, title=None)
    points = (
        alt.Chart(data(rows))
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
    limits = alt.Chart(data([{"z": -BEYOND}, {"z": BEYOND}])).mark_rule(style="limit").encode(x="z:Q")
    described = f"Differences of {len(names)} coefficients from {found.labels[0]} in standard errors."
    chart: alt.LayerChart = alt.layer(limits, points).properties(
        title="Differences in standard errors", width=620, height=alt.Step(15), description=described
    )
    return chart


def _trial(trial: TrialComparison, found: CardComparison, *, first: bool) -> Section:
    columns = [Column(title="figure"), Column(title="unit")]
    columns += [Column(title=label) for label in found.labels]
    for label in found.labels[1:]:
        columns += [Column(title=f"{label}: difference", digits=3), Column(title="z", digits=3)]
    rows: list[list[Cell]] = []
    for row in trial.figures:
        cells: list[Cell] = [*in_words(row.name)]
        cells += [_with_error(value, error) for value, error in zip(row.values, row.deviations, strict=True)]
        for place in range(1, len(found.labels)):
            apart = row.difference(place)
            cells += [None if apart is None else format_number(apart, 3), row.in_errors(place)]
        rows.append(cells)
    charts: Sequence[Illustration] = ()
    if trial.tracks:
        tracks = [Track(label=one.label, x_m=one.x_m, y_m=one.y_m, time_s=one.time_s) for one in trial.tracks]
        charts = [Illustration(chart=track_chart(tracks, title=f"Tracks: {trial.name}"))]
    table = Table(caption=f"Figures of the {trial.name}.", columns=columns, rows=rows)
    return Section(
        heading=trial.name[:1].upper() + trial.name[1:], text=_TRIALS if first else "", tables=[table], charts=charts
    )


def _with_error(value: float | None, error: float | None) -> str | None:
    if value is None:
        return None
    return format_number(value) if error is None else f"{format_number(value)} ({format_number(error, 2)})"
