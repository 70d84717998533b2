"""Bundled ships next to the trials that were measured of them: figures of turns and zigzags, simulated in closed loop.

Each manoeuvre is simulated from its measured start with the rudder rate and lag of its record, the mean of the measured
wind where the card has wind. Trials marked as fitted are among those that the card was identified from.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.identification.trials.assessment.evaluation import FigureComparison, predicted_figures
from tank2sim.identification.trials.problem.prepare_trials import measured

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
