"""The page of a fleet: all ships in one table, each with the way to its own page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import altair as alt

from tank2sim.answer.charts.parts import NUMBER, Chart, data, series_look
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Link, Section, Table, Verdict
from tank2sim.gap.fleet.summary import REPORT_FILE, FleetSummary, ShipSummary
from tank2sim.gap.result import AMBIGUOUS, GAP_VERDICTS, MISSING
from tank2sim.report.gap.text import effect_in_words, parameter_in_words, with_error
from tank2sim.report.json_values import Json

_SHIPS = (
    "Misfit is the root mean square of simulated less measured, in standard deviations of the measurement noise: 1 is "
    "the noise floor. It is that of the trials held out, which took no part in naming the effect, or of the fitted "
    "ones where none was held out. Before is the card as given, after the one with what was found."
)
_CHART = "The line is the noise; the scale is logarithmic. Where nothing was added, one point lies upon the other."
_BEFORE, _AFTER = "card as given", "card found"


def fleet_page(fleet: FleetSummary) -> Page:
    """Return the page, for the folder in which each ship has a page of its own."""
    found = [ship for ship in fleet.ships if not ship.fault]
    sections = []
    if found:
        chart = _misfit_chart(found)
        charts = [Illustration(chart=chart, caption=_CHART)]
        sections.append(
            Section(heading="Ships", text=_SHIPS, tables=[_ships(found)], charts=charts if chart is not None else [])
        )
    if fleet.faults:
        rows: list[list[Cell]] = [[fault.folder, fault.fault] for fault in fleet.faults]
        columns = [Column(title="ship"), Column(title="why")]
        table = Table(caption="Ships that could not be judged", columns=columns, rows=rows)
        sections.append(Section(heading="Without a result", tables=[table]))
    if fleet.notices:
        sections.append(Section(heading="Notices", notes=fleet.notices))
    return Page(
        title=f"Fleet: {fleet.name}",
        subtitle=f"What the models of {len(fleet.ships)} ships lack",
        figures=_figures(fleet),
        sections=sections,
    )


def _figures(fleet: FleetSummary) -> list[KeyFigure]:
    counts = fleet.verdicts
    figures = [KeyFigure(label="Ships", value=str(len(fleet.ships)))]
    figures += [
        KeyFigure(label=f"{word[0].upper()}{word[1:]}", value=str(counts[word]))
        for word in GAP_VERDICTS
        if word in counts
    ]
    if fleet.faults:
        figures.append(KeyFigure(label="Without a result", value=str(len(fleet.faults)), verdict=Verdict.FAILED))
    return figures


def _ships(found: list[ShipSummary]) -> Table:
    rows: list[list[Cell]] = [
        [
            Link(text=ship.folder, path=f"{ship.folder}/{REPORT_FILE}"),
            ship.name,
            ship.verdict,
            _effects(ship),
            *map(_hundredths, ship.misfits()),
            "held out" if ship.judged_by == "holdout" else "fitted",
        ]
        for ship in found
    ]
    heads = ("ship", "name", "verdict", "what is missing", "misfit before", "misfit after", "of trials")
    # Misfits are rounded to hundredths: nothing more is cut off.
    return Table(caption="What was found", columns=[Column(title=head, digits=7) for head in heads], rows=rows)


def _effects(ship: ShipSummary) -> str:
    """Effects with their parameters, ± one standard error; or all that it may be."""
    named = "; ".join(_effect(effect) for effect in ship.effects)
    if ship.verdict == AMBIGUOUS:
        return " or ".join([named, *(effect_in_words(alternative) for alternative in ship.alternatives)])
    return named if ship.verdict == MISSING else ""


def _effect(effect: Mapping[str, Any]) -> str:
    values = []
    for parameter, value in effect["parameters"].items():
        words, unit = parameter_in_words(effect["name"], parameter)
        error = effect["standard_errors"].get(parameter)
        shown = "?" if value is None else with_error(value, math.nan if error is None else error)
        values.append(f"{words} {shown}{f' {unit}' if unit else ''}")
    return f"{effect_in_words(effect['name'])} ({', '.join(values)})" if values else effect_in_words(effect["name"])


def _hundredths(misfit: float | None) -> float | None:
    return None if misfit is None else round(misfit, 2)


def _misfit_chart(found: list[ShipSummary]) -> alt.LayerChart | None:
    """Misfit of each ship before and after, a row each; None where no simulation came to its end."""
    rows = [
        {"ship": ship.folder, "run": label, "misfit": _hundredths(misfit)}
        for ship in found
        for label, misfit in zip((_BEFORE, _AFTER), ship.misfits(), strict=True)
        if misfit
    ]
    if not rows:
        return None
    look = series_look([_BEFORE, _AFTER], as_points=[_BEFORE, _AFTER])
    y = alt.Y("ship:N", sort=[ship.folder for ship in found], title=None)
    points = (
        Chart(data(rows))
        .mark_point(filled=True, size=70)
        .encode(
            x=alt.X("misfit:Q", title="misfit (standard deviations of the noise)", scale=alt.Scale(type="log")),
            y=y,
            color=look.colour,
            shape=look.shape,
            tooltip=[
                alt.Tooltip("ship:N", title="ship"),
                alt.Tooltip("run:N", title="model"),
                alt.Tooltip("misfit:Q", title="misfit", format=NUMBER),
            ],
        )
    )
    noise = Chart(data([{"misfit": 1.0}])).mark_rule(style="limit").encode(x="misfit:Q")
    chart: alt.LayerChart = alt.layer(noise, points).properties(
        title="Misfit before and after",
        width=620,
        height=alt.Step(22),
        description=f"Misfit of {len(found)} ships by the cards as given and by those found.",
    )
    return chart


_LINKS = f"Each ship has a page of its own, {REPORT_FILE}, in the folder of its name next to fleet.json."


def fleet_page_of_json(found: Json) -> Page:
    """Return the page of ``fleet.json`` alone: ships by the names of their folders, without links to their pages."""
    names = ("name", "verdict", "misfit", "trials", "fault")
    ships = tuple(
        ShipSummary(
            folder=ship["folder"],
            effects=tuple(ship.get("effects") or ()),
            alternatives=tuple(ship.get("alternatives") or ()),
            **{name: ship[name] for name in names if name in ship},
        )
        for ship in found["ships"]
    )
    page = fleet_page(FleetSummary(name=str(found["fleet"]), ships=ships, notices=tuple(found.get("notices") or ())))
    return replace(page, sections=[_without_links(section) for section in page.sections])


def _without_links(section: Section) -> Section:
    tables = [_plain(table) for table in section.tables]
    linked = any(isinstance(cell, Link) for table in section.tables for row in table.rows for cell in row)
    text = f"{section.text} {_LINKS}".strip() if linked else section.text
    return replace(section, text=text, tables=tables)


def _plain(table: Table) -> Table:
    rows = [[cell.text if isinstance(cell, Link) else cell for cell in row] for row in table.rows]
    return replace(table, rows=rows)
