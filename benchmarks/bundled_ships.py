"""Bundled ships next to the trials that were measured of them: figures of turns and zigzags, simulated in closed loop.

Each manoeuvre is simulated from its measured start with the rudder rate and lag of its record, the mean of the measured
wind where the card has wind. Trials marked as fitted are among those that the card was identified from.
"""

from __future__ import annotations

import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.identification.trials.assessment.evaluation import FigureComparison, predicted_figures
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data"


@dataclass(frozen=True)
class Comparison:
    """A bundled ship, trials of it by a pattern in the data folder, and whether the card was fitted to them."""

    ship: str
    pattern: str
    fitted: bool


COMPARISONS = (
    Comparison("kvlcc2", "kvlcc2_hsva/*.dat", fitted=True),
    Comparison("kvlcc2", "kvlcc2_marin/*.dat", fitted=False),
    Comparison("kvlcc2-captive", "kvlcc2_hsva/*.dat", fitted=False),
    Comparison("kvlcc2-captive", "kvlcc2_marin/*.dat", fitted=False),
    Comparison("esso-osaka", "esso_osaka/turning/*.csv", fitted=True),
    Comparison("esso-osaka", "esso_osaka/zigzag/*.csv", fitted=True),
    Comparison("esso-osaka-estimated", "esso_osaka/turning/*.csv", fitted=False),
)


MARIN_TO_STARBOARD = {"advance_m": 3.08, "transfer_m": 1.36, "tactical_diameter_m": 3.34}
"""The other turn of MARIN at 35 deg, to starboard, in lengths: evaluated from its record of SIMMAN 2008, the advance
from the rudder's first movement. The record is not among the trials."""

MARIN_SPEED_MPS, MARIN_RPM = 8.01, 91.4
"""Approach and revolutions of that turn at full scale."""


def marin_to_starboard(ship: str) -> tuple[FigureComparison, ...]:
    """Figures of that turn and of a bundled ship from the same speed and revolutions, m."""
    card = read_card(ship)
    assert isinstance(card, ManoeuvringCard)
    model, length = build(card), card.ship.length_m
    revolutions = {"propeller.speed": MARIN_RPM * math.pi / 30} if "propeller.speed" in model.input_names else {}
    turn = Turn(math.radians(35))
    found = simulate(model, turn, inputs=revolutions, parameters={"initial.u": MARIN_SPEED_MPS}).figures
    simulated = {name: value if isinstance(value := found[name], float) else None for name in MARIN_TO_STARBOARD}
    return tuple(
        FigureComparison("MARIN, 35 deg to starboard", name, lengths * length, simulated[name])
        for name, lengths in MARIN_TO_STARBOARD.items()
    )


def figures(comparison: Comparison) -> tuple[FigureComparison, ...]:
    """Measured figures and those of the bundled ship."""
    card = read_card(comparison.ship)
    assert isinstance(card, ManoeuvringCard)
    return predicted_figures(card, measured(sorted(DATA.glob(comparison.pattern)), card).trials)


def main() -> int:
    if not DATA.is_dir():
        print(f"no trials: there is no folder {DATA} (set TANK2SIM_DATA)")
        return 0
    print(f"{'trial':34s}{'figure':20s}{'measured':>10s}{'simulated':>10s}{'error':>10s}")
    for comparison in COMPARISONS:
        print(f"{comparison.ship}, {'fitted to' if comparison.fitted else 'not fitted to'} {comparison.pattern}")
        found = figures(comparison)
        if comparison.pattern.startswith("kvlcc2_marin"):
            found = (*found, *marin_to_starboard(comparison.ship))
        for figure in found:
            share = 100 * figure.error if figure.name.endswith("_m") else figure.error
            unit = "%" if figure.name.endswith("_m") else "deg"
            predicted = np.nan if figure.predicted is None else figure.predicted
            trial, name = figure.trial[-32:], figure.name.rpartition("_")[0].replace("_", " ")
            print(f"{trial:34s}{name:20s}{figure.measured:10.4g}{predicted:10.4g}{share:+9.2f} {unit}")
        for name in dict.fromkeys(figure.name for figure in found):
            errors = np.array([figure.error for figure in found if figure.name == name], dtype=float)
            factor, unit = (100, "%") if name.endswith("_m") else (1, "deg")
            words = name.rpartition("_")[0].replace("_", " ")
            rms = factor * np.sqrt(np.nanmean(errors**2))
            print(f"  {words}: mean {factor * np.nanmean(errors):+.2f} {unit}, rms {rms:.2f} {unit}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
