"""The page of influence coefficients: what each number on a card does to the ship's figures, and what tuning did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.analysis.ensemble.results import FigureBands
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.answer.study import read_study
from tank2sim.arrays import Array
from tank2sim.marks import assumed_words
from tank2sim.report.influence.charts import (
    InfluenceData,
    figure_label,
    influence_charts,
    most_influential,
    moves_chart,
    short_name,
    variance_chart,
)
from tank2sim.report.json_values import Json
from tank2sim.results.ensembles import figures_section
from tank2sim.units import in_words

_COEFFICIENTS = (
    "K is the change of a figure in per cent when one number on the card grows by 10 %. Bars are by exact slopes "
    "(10 c/F dF/dc), points by computing the ship again with 10 % more; where they differ, the figure is curved.\n\n"
    "Slopes of steady turns and straight courses are by the implicit function theorem, those of manoeuvres by forward "
    "sensitivities through the events, whose times move, too."
)

_ERRORS = (
    "By the delta method, {}. The share of a number is the part of the variance that would go if it were known "
    "exactly; of numbers whose errors go together each has what it shares with the others, too."
)


def influence_page(found: Json) -> Page:
    """The page, from the JSON of a result: that of :class:`.CardInfluence`, ``tuned`` and ``ensemble``."""
    coefficients = InfluenceData.of(found)
    sections = []
    tuned = found.get("tuned")
    if tuned:
        sections.append(_tuning(found, tuned))
    drawn = influence_charts(coefficients)
    charts = [Illustration(chart=chart, half=len(drawn) > 1) for chart in drawn]
    heading = "Influence coefficients"
    sections.append(Section(heading=heading, text=_COEFFICIENTS, charts=charts, notes=found["notices"]))
    sections.append(_uncertainty(found, coefficients))
    if "agreed" in found:
        sections.append(_together(found["agreed"]))
    sections.append(_all_coefficients(coefficients))
    if tuned:
        sections.append(_moves(tuned["parameters"]))
    if "ensemble" in found:
        sections.append(figures_section(read_study(FigureBands, found["ensemble"], "")))
    return Page(
        title=f"{found['ship']}: influence coefficients",
        subtitle=f"Parameters: {len(coefficients.names)}. Figures: {len(coefficients.figures)}.",
        verdict=_verdict(coefficients, tuned),
        figures=[_key_figure(text, figure, tuned or {}) for text, figure in found["figures"].items()],
        sections=sections,
    )


def _verdict(result: InfluenceData, tuned: Mapping[str, Json] | None) -> str:
    """Which number moves each of the first three figures most, or how many targets tuning has met."""
    if tuned and tuned.get("targets"):
        count, missed = len(tuned["targets"]), len(tuned["contradiction"])
        if missed:
            return f"Of {count} targets {missed} cannot be met within the bounds; the nearest is shown."
        return f"Every target is met by {len(tuned['parameters'])} numbers within the bounds."
    parts = []
    for row, text in list(enumerate(result.figures))[:3]:
        if order := most_influential(result, row):
            parts.append(
                f"{figure_label(text)} by {result.names[order[0]]} ({result.exact[row][order[0]]:+.2g} %)".replace(
                    "-", "−"
                )
            )
    return f"What 10 % more of one number moves most: {'; '.join(parts)}." if parts else ""


def _targets_of(tuned: Mapping[str, Json]) -> dict[str, tuple[Mapping[str, Json], Verdict]]:
    """Figure to its target, and whether that is met."""
    return {
        target["figure"]: (target, Verdict.FAILED if text in tuned["contradiction"] else Verdict.PASSED)
        for text, target in tuned.get("targets", {}).items()
    }


def _unit(text: str) -> str:
    return in_words(text.partition("@")[0])[1]


def _key_figure(text: str, figure: Mapping[str, Json], tuned: Mapping[str, Json]) -> KeyFigure:
    unit, label = _unit(text), figure_label(text)
    after, (target, verdict) = tuned.get("figures", {}).get(text), _targets_of(tuned).get(text, ({}, Verdict.NONE))
    if after is None:
        note = f"standard error {format_number(figure['standard_error'], 2)}"
        return KeyFigure(label=label, value=figure["value"], unit=unit, note=note)
    note = f"was {figure['value']:.5g} before tuning"
    if target:
        note = f"was {figure['value']:.5g}, target {target['relation']} {target['wanted']:g}"
    return KeyFigure(label=label, value=after, unit=unit, verdict=verdict, note=note)


_COLUMNS = 4
"""Figures in a table of coefficients: as many as a sheet of paper is wide."""


def _all_coefficients(result: InfluenceData) -> Section:
    count = len(result.figures)
    tables = []
    for caption, K in (("K by exact slopes", result.exact), ("K by the 10 % difference", result.difference)):
        for first in range(0, count, _COLUMNS):
            rows = range(first, min(first + _COLUMNS, count))
            part = f", from {figure_label(result.figures[first])} on" if count > _COLUMNS else ""
            tables.append(_table(f"{caption}{part}", result, K, rows))
    return Section(heading="Coefficients of all parameters", tables=tables)


def _table(caption: str, result: InfluenceData, K: Array, rows: Sequence[int]) -> Table:
    labels = [figure_label(result.figures[row]) for row in rows]
    return Table(
        caption=caption,
        columns=[Column(title="parameter"), *(Column(title=label, unit="%", digits=3) for label in labels)],
        rows=[[name, *(_cell(K[row, place]) for row in rows)] for place, name in enumerate(result.names)],
    )


def _cell(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(np.round(value, 3)) + 0.0


def _uncertainty(found: Json, coefficients: InfluenceData) -> Section:
    figures: Mapping[str, Mapping[str, Json]] = found["figures"]
    text = _ERRORS.format(found.get("standard_errors", "from the card's standard errors"))
    rows: list[Sequence[Cell]] = []
    for name, figure in figures.items():
        relative = 100 * abs(figure["standard_error"] / figure["value"]) if figure["value"] else None
        rows.append([figure_label(name), figure["value"], figure["standard_error"], _unit(name), _cell(relative)])
    columns = [
        Column(title="figure"),
        Column(title="value"),
        Column(title="standard error", digits=3),
        Column(title="unit"),
        Column(title="relative", unit="%", digits=3),
    ]
    known = any(figure["standard_error"] > 0 for figure in figures.values())
    charts = [Illustration(chart=variance_chart(coefficients))] if known else []
    assumed = assumed_words(found["notices"])
    table = Table(caption="Figures and their standard errors", columns=columns, rows=rows)
    return Section(heading=f"What is known of the figures{assumed}", text=text, charts=charts, tables=[table])


def _together(agreed: Mapping[str, Json]) -> Section:
    changes: list[Sequence[Cell]] = [
        [key.removeprefix("derivatives."), value] for key, value in agreed["percent"].items()
    ]
    ways = {
        "foretold_exact": "by exact slopes",
        "foretold_difference": "by 10 % differences",
        "direct": "direct",
    }
    figures: list[Sequence[Cell]] = [
        [figure_label(text), *(_cell(figure[way]) for way in ways)] for text, figure in agreed["figures"].items()
    ]
    percent = [Column(title=title, unit="%") for title in ways.values()]
    return Section(
        heading="Agreed variation",
        text="All these change together. To first order a figure changes by the sum of Kc K / 10; next to it, what "
        "computing the changed ship gives.",
        tables=[
            Table(
                caption="Agreed changes",
                columns=[Column(title="parameter"), Column(title="Kc", unit="%")],
                rows=changes,
            ),
            Table(caption="Change of the figures", columns=[Column(title="figure"), *percent], rows=figures),
        ],
    )


def _tuning(found: Json, tuned: Mapping[str, Json]) -> Section:
    targets = _targets_of(tuned)
    figures: list[Sequence[Cell]] = []
    for text, figure in found["figures"].items():
        target, verdict = targets.get(text, ({}, None))
        wanted = f"{target['relation']} {target['wanted']:g}" if target else ""
        after = tuned["figures"].get(text)
        figures.append([figure_label(text), wanted, figure["value"], after, _unit(text), verdict])
    heads = ("figure", "target", "before", "after", "unit", "")
    notes = []
    if contradiction := tuned["contradiction"]:
        several = len(contradiction) > 1
        what = (
            f"{' and '.join(contradiction)} contradict each other"
            if several
            else f"{contradiction[0]} cannot be reached"
        )
        notes.append(f"{what} within the bounds. What is shown is the nearest, in least squares of relative misses.")
    if tuned["agreed_times"] is not None:
        notes.append(f"The agreed variation was taken {tuned['agreed_times']:+.3g} times.")
    names = {key: short_name(key, figure) for key, figure in found["parameters"].items()}
    return Section(
        heading="Tuning",
        text=f"By the {'fewest' if tuned['by'] == 'fewest' else 'most uncertain'} parameters, each within "
        f"{tuned['within_standard_errors']:g} standard errors of the card.",
        charts=[Illustration(chart=moves_chart(tuned, names))] if tuned["parameters"] else [],
        tables=[
            Table(
                caption="Figures before and after",
                columns=[Column(title=head, digits=5) for head in heads],
                rows=figures,
            )
        ],
        notes=notes,
    )


def _moves(parameters: Mapping[str, Mapping[str, Json]]) -> Section:
    rows: list[Sequence[Cell]] = [
        [key, parameter["before"], parameter["after"], parameter["standard_errors"]]
        for key, parameter in parameters.items()
    ]
    columns = [
        Column(title="key"),
        Column(title="before", digits=6),
        Column(title="after", digits=6),
        Column(title="move", unit="standard errors", digits=3),
    ]
    table = Table(caption="Parameters that changed, as the card's file has them", columns=columns, rows=rows)
    return Section(heading="What tuning changed", tables=[table])
