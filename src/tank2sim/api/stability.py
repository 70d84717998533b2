"""Stability, steady turning and the IMO criteria of a ship as a result."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from tank2sim.analysis.ensemble.results import EnsembleRequest, StabilityBands, stability_bands
from tank2sim.analysis.ensemble.steering import Grid
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.study import StabilityStudy, stability_study
from tank2sim.answer.parts import Table
from tank2sim.api.ensemble import EnsembleOptions, band_table
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.ship import Ship

STRONGEST = 5
"""Coefficients whose influence on C' the table shows; JSON and page have all. Project choice."""


class StabilityResult(PagedResult):
    """Stability, steady turning and IMO criteria of a ship.

    Parameters
    ----------
    ship : Ship
    study : StabilityStudy
        SI and radians.
    bands : StabilityBands, optional
        Of an ensemble.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").stability(spirals=False)
    >>> found.stable
    True
    """

    command = "stability"

    def __init__(self, ship: Ship, study: StabilityStudy, bands: StabilityBands | None = None) -> None:
        self.ship, self.bands = ship, bands
        self.study: StabilityStudy = study
        compiler = [] if find_compiler() else [NO_COMPILER]
        members = bands.asked.notices if bands else ()
        self.notices = tuple(dict.fromkeys([*ship.model.notices, *study.notices, *compiler, *members]))

    @property
    def stable(self) -> bool:
        """True if the ship holds a straight course with the rudder fixed: no eigenvalue has a positive real part."""
        return self.study.stability.stable

    @property
    def criterion(self) -> float:
        """C' (prime): the ship is stable on a straight course if it is positive and no effect adds a growing mode."""
        return self.study.stability.criterion

    @property
    def imo(self) -> pd.DataFrame:
        """The IMO criteria (MSC.137(76)), worse side: found, allowed, unit, met, margin (%)."""
        import pandas as pd

        rows = [
            (
                criterion.name,
                criterion.found,
                criterion.allowed,
                criterion.unit,
                criterion.passed,
                criterion.margin_percent,
            )
            for criterion in self.study.imo
        ]
        columns = ["criterion", "found", "allowed", "unit", "met", "margin_percent"]
        return pd.DataFrame(rows, columns=columns).set_index("criterion")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        ensemble = {"ensemble": self.bands.as_json()} if self.bands else {}
        members = self.bands.asked.notices if self.bands else ()
        notices = [notice for notice in self.notices if notice not in members or notice in self.study.notices]
        return {**self.study.as_json(), "notices": notices, **ensemble}

    @property
    def headline(self) -> tuple[str, ...]:
        """Stability on a straight course, and the range of steady turns."""
        found = self.study.stability
        verdict = "stable" if found.stable else "unstable"
        course = (
            f"{found.name} at {found.speed_mps:.4g} m/s (drift {found.drift_deg:.3g} deg, rudder "
            f"{found.rudder_deg:.3g} deg) is {verdict} on a straight course: {_margin_text(self.study)}"
        )
        check = [notice for notice in self.study.notices if notice.startswith("CHECK")]
        return (
            *check,
            course,
            *_turning_text(self.study),
            *_stable_text(self.bands),
            *_together_text(self.bands),
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Eigenvalues, Nomoto's models, what moves C' most, IMO criteria; bands of an ensemble."""
        found, margin = self.study.stability, self.study.margin
        eigenvalues = screen_table(
            f"Eigenvalues of surge, sway and yaw{''.join(f', {name}' for name in found.effect_states)}",
            ("real (1/s)", "imaginary (1/s)", "time constant (s)"),
            four_digits(
                [value.real, value.imag, -1 / value.real if value.real else None] for value in found.eigenvalues
            ),
        )
        nomoto = screen_table(
            f"Nomoto{' (slow motions)' if found.effect_states else ''}",
            ("", "K", "T", "T1", "T2", "T3"),
            four_digits([["1/s and s", *vars(found.nomoto).values()], ["prime", *vars(found.nomoto_prime).values()]]),
        )
        influences = screen_table(
            "Largest influences on C'",
            ("coefficient", "C' for 10 % more (%)", "change to neutral (%)"),
            four_digits(
                [influence.short_name, influence.percent, influence.neutral_percent]
                for influence in margin.influences[:STRONGEST]
            ),
        )
        tables = (eigenvalues, nomoto, influences, _criteria(self.study.imo))
        if self.bands is None:
            return tables
        found_tails = [_tails(self.bands)] if any(one.tail for one in self.bands.chances) else []
        return *tables, band_table(self.bands.figures, self.bands.asked), _chances(self.bands), *found_tails


def judge_stability(
    ship: Ship, speed_mps: float | None, *, spirals: bool, ensemble: EnsembleOptions
) -> StabilityResult:
    """Stability of a ship, with an ensemble if it has members. Raises as :meth:`.Ship.stability`."""
    study = stability_study(ship.model, speed_mps, spirals=spirals)
    bands = None
    if ensemble.members:
        curves = (speed_mps, Grid.of(ship.model, study.responses[0])) if study.responses else None
        request = EnsembleRequest(ensemble.members, ensemble.seed)
        with ensemble.computing() as executor:
            bands = stability_bands(ship.manoeuvring(), study.imo, request, executor, curves)
    return StabilityResult(ship, study, bands)


def _chances(found: StabilityBands) -> Table:
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
    together = found.all_met
    if together:
        interval = f"{together.between[0]:.3f} to {together.between[1]:.3f}"
        name = f"the {len(together.names)} within the card's range together"
        rows.append([name, None, None, None, f"{together.met:.3g}", interval])
    columns = ("criterion", "5 %", "95 %", "allowed", "P(met)", "interval of P")
    return screen_table("IMO MSC.137(76), worse side, over the ensemble", columns, rows)


def _tails(found: StabilityBands) -> Table:
    """Small probabilities of not meeting a criterion, by importance sampling."""
    named = [(one.criterion.name, one.tail) for one in found.chances if one.tail]
    if found.all_met and found.all_met.tail:
        named.append(("any of these", found.all_met.tail))
    remarks = list(dict.fromkeys(tail.remark for _, tail in named if tail.remark))
    rows: list[list[object]] = []
    for name, tail in named:
        number = f" ({remarks.index(tail.remark) + 1})" if tail.remark else ""
        found_texts = [None if value is None else f"{value:.2e}" for value in (tail.probability, tail.standard_error)]
        rows.append([name + number, *found_texts, f"{tail.effective_size:.0f}", f"{tail.distance:.3g}"])
    columns = ("criterion", "P(not met)", "standard error", "effective size", "distance (sd)")
    notes = tuple(f"({number}) {text}" for number, text in enumerate(remarks, 1))
    return screen_table("Too rare for the ensemble: by importance sampling", columns, rows, notes)


def _stable_text(found: StabilityBands | None) -> list[str]:
    if found is None or found.stable is None or found.stable_between is None:
        return []
    low, high = found.stable_between
    return [f"Stable on a straight course with probability {found.stable:.3g} (95 % interval {low:.3f} to {high:.3f})"]


def _together_text(found: StabilityBands | None) -> list[str]:
    together = found.all_met if found else None
    if together is None:
        return []
    rare = together.tail
    low, high = together.between
    probability = f"probability {together.met:.3g} ({low:.3f} to {high:.3f})"
    text = f"{len(together.names)} IMO criteria together are met with {probability}"
    if rare and rare.probability is not None:
        text += f"; not met {rare.probability:.2e} (standard error {rare.standard_error:.1e})"
    return [text]


def _criteria(criteria: Sequence[ImoCriterion]) -> Table:
    remarks = list(dict.fromkeys(criterion.remark for criterion in criteria if criterion.remark))
    rows: list[list[object]] = []
    for criterion in criteria:
        number = f" ({remarks.index(criterion.remark) + 1})" if criterion.remark else ""
        # A verdict on a figure that the card does not hold for would be taken for one.
        beyond = criterion.beyond_card and criterion.found is not None
        met, margin = ("beyond card", None) if beyond else (criterion.passed, criterion.margin_percent)
        rows.append([criterion.name + number, criterion.found, criterion.allowed, criterion.unit, met, margin])
    columns = ("criterion", "found", "allowed", "unit", "met", "margin (%)")
    notes = tuple(f"({number}) {text}" for number, text in enumerate(remarks, 1))
    return screen_table("IMO MSC.137(76), worse side", columns, four_digits(rows), notes)


def four_digits(rows: Iterable[Sequence[object]]) -> list[list[object]]:
    """Numbers of four digits, for which the tables have room on a screen of 80 columns.

    Parameters
    ----------
    rows : iterable of sequences
        Cells of each row; what is not a number stays.
    """
    return [[float(f"{cell:.4g}") if isinstance(cell, float) else cell for cell in row] for row in rows]


def _margin_text(study: StabilityStudy) -> str:
    found, margin = study.stability, study.margin
    if not found.criterion_decides:
        return (
            f"a mode grows at {found.growth_per_s:.3g} 1/s, which C' = {found.criterion:.4g} does not show, so the "
            "margin is not defined"
        )
    return f"C' = {found.criterion:.4g}, margin {margin.percent:.3g} %, levers {margin.lever:.3g} L apart"


def _turning_text(study: StabilityStudy) -> list[str]:
    turning = study.turning
    if turning is None:
        return []
    rudders = [f"{math.degrees(turning.rudder_rad[row]):.3g}" for row in (0, -1)]
    rates = [f"{math.degrees(turning.yaw_rate_radps[row]):.3g}" for row in (0, -1)]
    text = f"Steady turns: {rates[0]} to {rates[1]} deg/s at {rudders[0]} to {rudders[1]} deg of rudder"
    if turning.loop is None:
        return [f"{text}; no hysteresis loop"]
    height = turning.loop.height_radps
    high = "" if height is None else f", {math.degrees(height):.3g} deg/s high"
    return [f"{text}; hysteresis loop {math.degrees(turning.loop.width_rad):.3g} deg of rudder wide{high}"]
