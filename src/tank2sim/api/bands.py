"""Tables of the bands of an ensemble."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.analysis.ensemble.results import Members, StabilityBands
from tank2sim.api.result import ResultTable
from tank2sim.simulation.bands import Band
from tank2sim.units import in_words


def band_table(bands: Mapping[str, Band], members: Members) -> ResultTable:
    """Quantiles (5, 50, 95 %) of figures over the members of an ensemble."""
    rows: list[list[object]] = []
    for name, band in bands.items():
        kind, at, argument = name.partition("@")
        words, unit = in_words(kind)
        rows.append([words + at + argument, unit, band.low, band.median, band.high, band.shown])
    title = f"Ensemble of {members.members}, seed {members.seed}: 90 % of the members lie between 5 and 95 %"
    return ResultTable(title, ("figure", "unit", "5 %", "50 %", "95 %", "shown by"), rows)


def criteria_table(found: StabilityBands) -> ResultTable:
    """Probability of each IMO criterion, with the 95 % interval that the number of members leaves."""
    rows: list[list[object]] = []
    for chance in found.chances:
        beyond = chance.criterion.beyond_card
        rows.append(
            [
                chance.criterion.name,
                *((f"{value:.4g}" for value in (chance.band.low, chance.band.high)) if chance.band else (None, None)),
                f"{chance.criterion.allowed:.4g} {chance.criterion.unit}",
                None if chance.met is None else "beyond card" if beyond else f"{chance.met:.3g}",
                None if beyond or not chance.between else f"{chance.between[0]:.3f} to {chance.between[1]:.3f}",
            ]
        )
    columns = ("criterion", "5 %", "95 %", "allowed", "P(met)", "interval of P")
    return ResultTable("IMO MSC.137(76), worse side, over the ensemble", columns, rows)
