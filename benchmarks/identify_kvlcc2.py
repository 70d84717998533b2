"""KVLCC2 from free-running trials: each structure fitted to HSVA's zigzags, held against what was not fitted; and the
cross-flow structure fitted to the zigzags together with HMRI's captive tests.

HSVA's seven zigzags are split three ways: each time some are held out. Then a fit of all seven is held against MARIN's
runs, which are of another basin and never fitted. Overshoots and turns are simulated in closed loop, with the delay of
the controller as the trial shows it; yaw-rate errors are over windows of 5 ship lengths (30 s of the 7 m model). Errors
of figures over their standard errors (e/s) are to be 1 in the root mean square: smaller, and intervals are too wide.
"""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from tank2sim.api.identification import captive_runs
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.identification.trials.assessment.evaluation import Comparison, FigureComparison, pooled
from tank2sim.identification.trials.identify import identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data"
ZIGZAGS = ("05_01", "10_05", "10_10_P", "10_10_S", "20_10_S", "25_05", "35_05")
HELD_OUT = (("10_10_S", "25_05"), ("10_10_P", "35_05"), ("10_05", "20_10_S"))
TURN_FIGURES = ("advance_m", "transfer_m", "tactical_diameter_m")
STRUCTURES = ("linear", "card", "third_order", "cross_flow")


def main() -> None:
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    zigzags = {name: _read(card, DATA / "kvlcc2_hsva" / f"HSVA_CPMC_KVLCC2_Z_{name}.dat") for name in ZIGZAGS}
    marin = _read(card, *sorted((DATA / "kvlcc2_marin").glob("*.dat")))
    print(f"{'':24s}{'HSVA held out':>26s}{'MARIN, never fitted':>44s}{'HSVA':>29s}{'MARIN':>8s}")
    heads = (
        "OS1 deg",
        "OS2 deg",
        "r %",
        "OS1 deg",
        "OS2 deg",
        "r %",
        "advance %",
        "transfer %",
        "t.diam. %",
        "in 95 %",
        "e/s",
        "e/s",
    )
    print(f"{'root mean square error':24s}" + "".join(f"{head:>10s}" for head in heads))
    everything = _together(*zigzags.values())
    captive = captive_runs(DATA / "kvlcc2_captive_hmri" / "campaign.toml")
    cases = [(structure, structure, None) for structure in STRUCTURES]
    for label, structure, tank in (*cases, ("cross_flow, with tank", "cross_flow", captive)):
        options = IdentificationOptions(
            structure=structure, force=True
        )  # a card is to be judged even where it fits badly
        held = []
        for names in HELD_OUT:
            fitted = _together(*(one for name, one in zigzags.items() if name not in names))
            unseen = _together(*(zigzags[name] for name in names))
            result = identify_trials(card, replace(fitted, captive=tank), unseen, options)
            assert result.holdout is not None
            held.append(result.holdout)
        final = identify_trials(card, replace(everything, captive=tank), marin, options)
        assert final.holdout is not None
        _row(label, held, final.holdout)
        if tank is not None:
            assert final.before_holdout is not None
            _row("card, not fitted", [final.before], final.before_holdout)


def _read(card: ManoeuvringCard, *paths: Path) -> Measured:
    return measured(paths, card)


def _together(*groups: Measured) -> Measured:
    return Measured(tuple(trial for group in groups for trial in group.trials), groups[0].driven_by, ())


def _row(name: str, held: list[Comparison], marin: Comparison) -> None:
    cells = []
    for comparisons in (held, [marin]):
        figures = [figure for comparison in comparisons for figure in comparison.figures]
        runs = [run for comparison in comparisons for run in comparison.following]
        cells += [_overshoot(figures, 1), _overshoot(figures, 2), 100 * pooled(runs, "motion.r")]
    turn = [100 * figure.error for figure in marin.figures if figure.name in TURN_FIGURES]
    inside = [
        one.interval[0] <= one.measured <= one.interval[1]
        for comparison in (*held, marin)
        for one in comparison.figures
        if one.interval is not None
    ]
    covered = f"{sum(inside):6d} of {len(inside)}" if inside else ""
    covered += "".join(f"{_over_standard_errors(group):10.2f}" for group in (held, [marin])) if inside else ""
    print(f"{name:24s}" + "".join(f"{cell:10.2f}" for cell in [*cells, *turn]) + covered, flush=True)


def _over_standard_errors(comparisons: list[Comparison]) -> float:
    """Root mean square of the errors of figures over the standard errors that their 95 % intervals state."""
    ratios = [
        3.92 * (one.predicted - one.measured) / (one.interval[1] - one.interval[0])
        for comparison in comparisons
        for one in comparison.figures
        if one.interval is not None and one.predicted is not None
    ]
    return float(np.sqrt(np.mean(np.square(ratios))))


def _overshoot(figures: list[FigureComparison], number: int) -> float:
    errors = [figure.error for figure in figures if figure.name == f"overshoot_{number}_deg"]
    return float(np.sqrt(np.nanmean(np.square(errors))))  # of those that the simulation reached


if __name__ == "__main__":
    main()
