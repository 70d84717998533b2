"""The section on the criteria of IMO MSC.137(76), of a ship and of a validation."""

from __future__ import annotations

from collections.abc import Sequence

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.answer.parts import Cell, Illustration, Section, Verdict, table
from tank2sim.notices import Level, Notice
from tank2sim.results.stability_charts import criteria_chart

BEYOND_THE_CARD = "beyond the card"
"""In place of a verdict, where the trial left the range of the card."""

_IMO = (
    "The worse of starboard and port, at the card's speed in calm water. The margin is the distance to the limit; "
    "below zero the criterion is not met."
)
_BARS = "Bars: the worse of both sides, over the limit (red). Pale: beyond the range of the card, and no verdict."


def imo_section(criteria: Sequence[ImoCriterion], *, heading: str = "IMO criteria", text: str = _IMO) -> Section:
    """Return the criteria of IMO MSC.137(76): bars, a table with verdicts, and remarks.

    `heading`, `text`: of the section.
    """
    remarks: dict[Notice, list[str]] = {}
    for criterion in criteria:
        if criterion.remark:
            level = Level.CAUTION if criterion.beyond_card else Level.INFO
            remarks.setdefault(Notice(criterion.remark, level), []).append(criterion.name)
    rows: list[list[Cell]] = [
        [*(one.name, one.found, one.allowed, one.unit, _verdict(one)), None if one.beyond_card else one.margin_percent]
        for one in criteria
    ]
    heads = ("criterion", "found", "allowed", "unit", "verdict", "margin (%)")
    notes = [remark.of("; ".join(names)) for remark, names in remarks.items()]
    charts = []
    if any(criterion.found is not None for criterion in criteria):
        charts.append(Illustration(criteria_chart(criteria, title="IMO MSC.137(76)"), caption=_BARS))
    tables = [table("IMO MSC.137(76), worse side", heads, rows, *notes)]
    return Section(heading, text=text, tables=tables, charts=charts)


def _verdict(criterion: ImoCriterion) -> Cell:
    if criterion.beyond_card and criterion.found is not None:
        return BEYOND_THE_CARD
    return "open" if criterion.passed is None else Verdict.PASSED if criterion.passed else Verdict.FAILED
