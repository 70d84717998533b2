"""The page of influence coefficients: what each number on a card does to the ship's figures, and what tuning did."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.influence.of_card import Influence
from tank2sim.analysis.tuning.result import Tuned
from tank2sim.report.influence_charts import PANELS, influence_charts, moves_chart, side_by_side, variance_chart
from tank2sim.report.page import Cell, Column, Figure, Illustration, Page, Section, Table, Verdict
from tank2sim.units import in_words

Array = NDArray[np.float64]

_COEFFICIENTS = (
    "K is the change of a figure in per cent when one number on the card grows by 10 %. Bars are by exact slopes "
    "(10 c/F dF/dc), points by computing the ship anew with 10 % more; where they differ, the figure is curved.\n\n"
    "Slopes of steady turns and straight courses are by the implicit function theorem, those of manoeuvres by forward "
    "sensitivities through the events, whose times move, too."
)

_ERRORS = (
    "Standard errors of the figures by the delta method, from those of the card's numbers as if they were independent."
)


def influence_page(result: Influence, tuned: Tuned | None = None, after: Array | None = None) -> Page:
    """The page of a result; with the tuning if there was one, and all figures `after` it."""
    sections = []
    if tuned is not None:
        sections.append(_tuning(result, tuned, after))
    sections.append(_coefficients(result))
    sections.append(_uncertainty(result))
    if result.agreed:
        sections.append(_together(result))
    sections.append(_all_coefficients(result))
    if tuned is not None:
        sections.append(_moves(tuned))
    return Page(
        title=f"{result.ship}: influence coefficients",
        subtitle=f"{len(result.parameters)} parameters on {len(result.figures)} figures",
        figures=_key_figures(result, tuned, after),
        sections=sections,
    )


def _key_figures(result: Influence, tuned: Tuned | None, after: Array | None) -> list[Figure]:
    wanted = {} if tuned is None else {wish.figure.text: wish for wish in tuned.wishes}
    told = []
    for row, one in enumerate(result.figures):
        words, unit = in_words(one.kind.name)
        argument = one.text.partition("@")[2]
        label = f"{words}, {argument} deg" if argument else words
        if after is not None and tuned is not None and one.text in wanted:
            verdict = Verdict.PASSED if wanted[one.text] not in tuned.contradiction else Verdict.FAILED
            note = f"was {result.values[row]:.5g}, wished {wanted[one.text].relation} {wanted[one.text].value:g}"
            told.append(Figure(label=label, value=float(after[row]), unit=unit, verdict=verdict, note=note))
        elif after is not None and np.isfinite(after[row]):
            told.append(
                Figure(
                    label=label, value=float(after[row]), unit=unit, note=f"was {result.values[row]:.5g} before tuning"
                )
            )
        else:
            note = f"standard error {result.standard_errors[row]:.2g}"
            told.append(Figure(label=label, value=float(result.values[row]), unit=unit, note=note))
    return told


def _coefficients(result: Influence) -> Section:
    return Section(
        heading="Influence coefficients",
        text=_COEFFICIENTS,
        charts=[Illustration(chart=chart) for chart in influence_charts(result)],
        notes=result.notices,
    )


def _all_coefficients(result: Influence) -> Section:
    tables = [
        _table(caption, result, K, rows)
        for caption, K in (("K by exact slopes", result.exact), ("K by the 10 % difference", result.difference))
        for rows in side_by_side(len(result.figures), PANELS)
    ]
    return Section(heading="Coefficients of all parameters", tables=tables)


def _table(caption: str, result: Influence, K: Array, rows: Sequence[int]) -> Table:
    """K of some figures, as many as are as wide as the page at most."""
    return Table(
        caption=caption,
        columns=[Column(title="parameter"), *(Column(title=result.figures[n].text, unit="%", digits=3) for n in rows)],
        rows=[[one.short, *(_cell(K[n, place]) for n in rows)] for place, one in enumerate(result.parameters)],
    )


def _cell(value: float) -> float | None:
    return float(np.round(value, 3)) + 0.0 if np.isfinite(value) else None


def _uncertainty(result: Influence) -> Section:
    errors = result.standard_errors
    rows: list[Sequence[Cell]] = []
    for row, figure in enumerate(result.figures):
        relative = 100 * abs(errors[row] / result.values[row]) if result.values[row] else np.nan
        rows.append([figure.text, float(result.values[row]), float(errors[row]), _cell(relative)])
    columns = [
        Column(title="figure"),
        Column(title="value"),
        Column(title="standard error", digits=3),
        Column(title="relative", unit="%", digits=3),
    ]
    charts = [Illustration(chart=variance_chart(result))] if np.any(errors > 0) else []
    table = Table(caption="Figures and their standard errors", columns=columns, rows=rows)
    return Section(heading="What is known of the figures", text=_ERRORS, charts=charts, tables=[table])


def _together(result: Influence) -> Section:
    assert result.agreed is not None
    agreed = result.agreed
    changes: list[Sequence[Cell]] = [
        [name.removeprefix("derivatives."), float(value)] for name, value in agreed.percent.items()
    ]
    figures: list[Sequence[Cell]] = [
        [figure.text, *(_cell(value) for value in values)]
        for figure, *values in zip(
            result.figures, agreed.foretold, agreed.foretold_by_difference, agreed.direct, strict=True
        )
    ]
    percent = [Column(title=title, unit="%") for title in ("by exact slopes", "by 10 % differences", "direct")]
    return Section(
        heading="Agreed variation",
        text="All these change together. To first order a figure changes by the sum of Kc K / 10; beside it, what "
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


def _tuning(result: Influence, tuned: Tuned, after: Array | None) -> Section:
    wished = {wish.figure.text: wish for wish in tuned.wishes}
    figures: list[Sequence[Cell]] = []
    for row, one in enumerate(result.figures):
        wish = wished.get(one.text)
        now = float(after[row]) if after is not None and np.isfinite(after[row]) else None
        verdict: Cell = None
        if wish is not None:
            verdict = Verdict.FAILED if wish in tuned.contradiction else Verdict.PASSED
        figures.append(
            [one.text, f"{wish.relation} {wish.value:g}" if wish else "", float(result.values[row]), now, verdict]
        )
    heads = ("figure", "wished", "before", "after", "")
    notes = []
    if not tuned.reached:
        names = [wish.text for wish in tuned.contradiction]
        what = f"{' and '.join(names)} contradict each other" if len(names) > 1 else f"{names[0]} cannot be reached"
        notes.append(f"{what} within the bounds. What is shown is the nearest, in least squares of relative misses.")
    if tuned.agreed_times is not None:
        notes.append(f"The agreed variation was taken {tuned.agreed_times:+.3g} times.")
    return Section(
        heading="Tuning",
        text=f"By the {'fewest' if tuned.means.by == 'fewest' else 'most uncertain'} parameters, each within "
        f"{tuned.means.within:g} standard errors of the card.",
        charts=[Illustration(chart=moves_chart(tuned))] if tuned.moves else [],
        tables=[
            Table(
                caption="Figures before and after",
                columns=[Column(title=head, digits=5) for head in heads],
                rows=figures,
            )
        ],
        notes=notes,
    )


def _moves(tuned: Tuned) -> Section:
    rows: list[Sequence[Cell]] = [
        [move.parameter.key, *(v * move.parameter.factor for v in (move.before, move.after)), move.in_standard_errors]
        for move in tuned.moves
    ]
    columns = [
        Column(title="key"),
        Column(title="before", digits=6),
        Column(title="after", digits=6),
        Column(title="move", unit="standard errors", digits=3),
    ]
    table = Table(caption="Parameters that changed, as the card's file has them", columns=columns, rows=rows)
    return Section(heading="What tuning changed", tables=[table])
