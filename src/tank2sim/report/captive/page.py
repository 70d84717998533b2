"""The page of a captive campaign: derivatives, how they were found, and every chart of the reduction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.identification.captive.reduction import Reduction
from tank2sim.identification.captive.result_card import Contents
from tank2sim.identification.captive.tables import derivative_rows, prediction_rows, terms_left_out
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict

_FORCES = {"X": "surge force", "Y": "sway force", "N": "yaw moment"}


def reduction_page(
    reduction: Reduction, card: Contents, warnings: Sequence[str], charts: Mapping[str, alt.TopLevelMixin]
) -> Page:
    """The page; `charts` as :func:`tank2sim.report.captive.results.reduction_charts` gives them."""
    model = reduction.campaign.model
    measured = len(card.entries) - len(card.estimated)
    figures = [
        KeyFigure(label="Runs reduced", value=len(reduction.runs), note=f"{len(reduction.not_used)} left out"),
        KeyFigure(label="Derivatives measured", value=measured, note="prime system, rudder to starboard"),
        KeyFigure(
            label="Derivatives estimated",
            value=len(card.estimated),
            verdict=Verdict.CAUTION if card.estimated else Verdict.NONE,
            note=", ".join(card.estimated) or "none",
        ),
    ]
    sections = [
        PageSection(
            heading="Derivatives",
            text="One weighted regression over the whole campaign, and next to it the paper's order of tests.",
            tables=[_derivatives(reduction, card)],
            notes=warnings,
        ),
        PageSection(
            heading="Which terms, and why",
            text="Terms that the runs excite and that are not in the card.",
            tables=[_left_out(reduction)],
        ),
        PageSection(
            heading="Leave one run out",
            text="How well each run is predicted from the others: root mean square error, % of the force's range.",
            tables=[_predictions(reduction)],
        ),
        *_chart_sections(charts),
    ]
    return Page(title=model.name, subtitle="Captive model tests, reduced", figures=figures, sections=sections)


def _derivatives(reduction: Reduction, card: Contents) -> PageTable:
    rows: list[list[Cell]] = []
    for row in derivative_rows(reduction, card):
        stepwise: list[Cell] = [None, None, ""]
        if steps := row.stepped:
            stepwise = [1e5 * steps.value, 1e5 * steps.standard_error, steps.found_in.replace("_", " ")]
        rows.append([row.name, 1e5 * row.value, 1e5 * row.standard_error, *stepwise, row.origin])
    heads = ("", "regression", "±", "paper's order", "±", "from tests", "origin")
    return PageTable(caption="Prime system, times 10⁵", columns=[Column(title=head) for head in heads], rows=rows)


def _left_out(reduction: Reduction) -> PageTable:
    rows: list[list[Cell]] = [[choice.name, choice.reason, choice.told] for choice in terms_left_out(reduction)]
    return PageTable(caption="Left out", columns=[Column(title=head) for head in ("term", "reason", "why")], rows=rows)


def _predictions(reduction: Reduction) -> PageTable:
    rows: list[list[Cell]] = [
        [kind.replace("_", " "), *(errors.get(force) for force in _FORCES)]
        for kind, errors in prediction_rows(reduction).items()
    ]
    columns = [Column(title="runs of type"), *(Column(title=force, unit="%", digits=2) for force in _FORCES)]
    return PageTable(caption="Prediction errors", columns=columns, rows=rows)


_AGAINST_MOTION = "Points: measured, bars: their 95 % intervals. Lines: the fit; shaded: its 95 % band."


def _chart_sections(charts: Mapping[str, alt.TopLevelMixin]) -> list[PageSection]:
    """A section for each force and its angles and amplitudes, one for what concerns all."""
    groups: dict[str, list[Illustration]] = {}
    for stem, chart in charts.items():
        words = _FORCES.get(stem.rpartition("_")[2])
        heading = f"{words.capitalize()} against motion" if words else "Loops and residuals"
        groups.setdefault(heading, []).append(Illustration(chart=chart, caption=_AGAINST_MOTION if words else ""))
    return [PageSection(heading=heading, charts=illustrations) for heading, illustrations in groups.items()]
