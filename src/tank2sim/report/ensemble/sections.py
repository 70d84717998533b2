"""Bands of an ensemble: next to the run of the card itself in a picture, and as a section of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.answer.charts.columns import HIGH, LOW, MIDDLE
from tank2sim.answer.parts import Cell, Column, Section, Table
from tank2sim.marks import assumed_words
from tank2sim.report.ensemble.charts import curve_charts
from tank2sim.report.json_values import Json
from tank2sim.units import in_words

BEYOND_CARD_TEXT = "beyond the card"
"""In place of a verdict, where the trial left the range of the card."""

_TEXT = (
    "Members of the ensemble are this ship with numbers drawn from the standard errors of its card, and from their "
    "covariance where the card has one. Nine of ten lie between the 5 and the 95 % quantile. Each member has a random "
    "stream of its own, so that the same seed gives the same members everywhere."
)
_CHANCES = (
    " The probability that a criterion is met is the share of all usable members that meet it, with the 95 % "
    "interval that their number leaves (Wilson). A member whose trial does not show the figure counts as one that "
    "does not meet it. Where the trial of the card itself leaves the card's range no probability is reported."
)

_RARE = (
    " Where fewer members fail than their share can be read from, the second table has the probability of not meeting "
    "the criterion from members drawn about the ships that fail, each with its weight (importance sampling). Its "
    "effective size is the number of failing members of the card's own errors that would say as much; without enough "
    "there is no probability. Distance, and the probability if linear, are those of a figure that changes in "
    "proportion to the card's numbers; the figure there shows whether it does."
)


def _tail_table(rare: Sequence[tuple[str, Json]]) -> Table:
    """Small probabilities of not meeting a criterion, each with what it rests on."""
    rows: list[list[Cell]] = []
    for name, tail in rare:
        keys = ("distance", "linear_probability", "linear_figure", "figure")
        sizes = [tail["probability"], tail["standard_error"], round(tail["effective_size"])]
        rows.append([name, *sizes, *(tail[key] for key in keys)])
    heads = ["criterion", "probability not met", "standard error", "effective size", "distance", "if linear"]
    heads += ["linear figure there", "figure there"]
    caption = "Too rare for the ensemble: by importance sampling."
    return Table(caption=caption, columns=[Column(title=head) for head in heads], rows=rows)


def _tail_notes(rare: Sequence[tuple[str, Json]]) -> list[str]:
    """Why the probability is missing; where the failing ships are, and what of the members drawn there."""
    remarks: dict[str, list[str]] = {}
    notes = []
    for name, tail in rare:
        if tail["remark"]:
            remarks.setdefault(tail["remark"], []).append(name)
            continue
        moved = ", ".join(f"{number} {errors:+.1f}" for number, errors in tail["failing_ships"].items())
        notes.append(
            f"{name}: of {tail['members']} members drawn about the failing ships {tail['failing']} fail, of these "
            f"{tail['not_shown']} do not show the figure and {tail['beyond_card']} left the card's range before; "
            f"{tail['unusable']} cannot be used; the mean of failing ships, in standard errors: {moved}"
        )
    return notes + [f"{'; '.join(names)}: {remark}" for remark, names in remarks.items()]


def stability_section(found: Json, criteria: Sequence[Mapping[str, Json]]) -> Section:
    """Return the section of the page of stability: from ``ensemble`` and ``imo`` of the JSON."""
    beyond_card = {criterion["name"]: criterion["beyond_card"] for criterion in criteria}
    rows: list[list[Cell]] = []
    for chance in found["imo"]:
        beyond, met, interval = beyond_card[chance["name"]], chance["probability_met"], chance["interval_95"]
        band = chance["band"] or {}
        rows.append(
            [
                chance["name"],
                *(band.get(key) for key in ("p5", "p50", "p95")),
                chance["allowed"],
                chance["unit"],
                BEYOND_CARD_TEXT if beyond and met is not None else met,
                f"{interval[0]:.3f} to {interval[1]:.3f}" if interval and not beyond else None,
                chance["not_shown"],
                chance.get("beyond_card"),
            ]
        )
    heads = ["criterion", LOW, MIDDLE, HIGH, "allowed", "unit", "probability met", "95 % interval"]
    heads += ["not shown by", "beyond the card"]
    columns = [Column(title=head) for head in heads]
    probability = found["probability_stable"]
    stable, between = "", found.get("probability_stable_interval_95")
    if probability is not None:
        interval = f" (95 % interval {between[0]:.3f} to {between[1]:.3f})" if between else ""
        stable = f" It is stable on a straight course with probability {probability:.3g}{interval}."
    criteria_table = Table(caption="IMO MSC.137(76), worse side, over the ensemble.", columns=columns, rows=rows)
    together = found.get("imo_all")
    if together:
        low, high = together["interval_95"]
        stable += (
            f" The {len(together['criteria'])} criteria judged within the card's range are met together with "
            f"probability {together['probability_met']:.3g} (95 % interval {low:.3f} to {high:.3f})."
        )
    rare = [(chance["name"], chance["tail"]) for chance in found["imo"] if chance.get("tail")]
    if together and together["tail"]:
        rare.append(("any of these", together["tail"]))
    return Section(
        heading=f"Ensemble of {found['members']}{assumed_words(found['notices'])}",
        text=_TEXT + _CHANCES + stable + (_RARE if rare else ""),
        tables=[
            criteria_table,
            *([_tail_table(rare)] if rare else []),
            _table("The straight course at the card's speed.", found["figures"]),
        ],
        charts=curve_charts(found["curves"]) if found["curves"] else (),
        notes=[*found["notices"], *_tail_notes(rare)],
    )


def figures_section(found: Json) -> Section:
    """Return the section of a page of influence coefficients, from ``ensemble`` of the JSON."""
    return Section(
        heading=f"Ensemble of {found['members']}{assumed_words(found['notices'])}",
        text=_TEXT,
        tables=[_table("Figures over the ensemble.", found["figures"])],
        notes=found["notices"],
    )


def _table(caption: str, bands: Mapping[str, Json]) -> Table:
    columns = [Column(title=head) for head in ("figure", "unit", LOW, MIDDLE, HIGH, "shown by")]
    rows: list[list[Cell]] = []
    for name, band in bands.items():
        kind, at, argument = name.partition("@")
        words, unit = in_words(kind)
        rows.append([words + at + argument, unit, *(band[key] for key in ("p5", "p50", "p95", "shown_by"))])
    return Table(caption=caption, columns=columns, rows=rows)
