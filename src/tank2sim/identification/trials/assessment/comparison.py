"""Comparison of a card's model with trials, in units of sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.identification.trials.assessment.evaluation import (
    FigureComparison,
    Following,
    predicted_figures,
    replay_error,
)
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.audit import record_noise

_LEAST_NOISE = 1e-3
"""Noise of a signal without stated noise is taken as this share of its standard deviation at least (project choice)."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of a model with trials: over windows and whole runs, and in the figures of manoeuvres."""

    following: tuple[Following, ...]
    figures: tuple[FigureComparison, ...]


def compare_card(
    card: ManoeuvringCard, trials: Measured, residual: Mapping[str, float], *, whole: bool = False
) -> Comparison:
    """Compare a card's model with trials.

    Parameters
    ----------
    card, trials
        Of the same size.
    residual : mapping
        Expected standard deviation of each variable's error: it weighs the signals in the fit of a window's initial
        state. With weights of sensor noise alone, the state would follow a single signal.
    whole : bool
        Compare also outside the card's range of speeds.
    """
    posed = problem_from_card(card, trials.trials, trials.driven_by, whole=whole)
    # Without estimation a single free parameter is enough; the sensitivities of the others need not be compiled.
    problem = posed.without(posed.free[1:])
    weights = {name: residual.get(name) or 1.0 for name in problem.seen}
    return Comparison(
        replay_error(problem, problem.prior_mean, weights),
        predicted_figures(card, trials.trials),
    )


def noise_of(trials: Measured, problem: Problem) -> dict[str, float]:
    """Measurement noise of each variable, SI: as stated in the files, else estimated; the largest of all trials.

    At least :data:`_LEAST_NOISE`: a smoothed record shows no noise, but is not exact.
    """
    noise: dict[str, float] = {}
    for trial in trials.trials:
        levels = {**record_noise(trial), **trial.noise}
        for signal, variable in OBSERVED_SIGNALS.items():
            if variable in problem.seen and levels.get(signal):
                least = _LEAST_NOISE * float(np.nanstd(trial.signals[signal])) if signal not in trial.noise else 0.0
                noise[variable] = max(noise.get(variable, 0.0), least, float(levels[signal]))
    return noise


def misfit(comparison: Comparison, noise: Mapping[str, float]) -> float:
    """Root mean square over runs and signals of (simulated - measured)/noise, each run from one initial state."""
    ratios = [
        error / noise[name]
        for result in comparison.following
        for name, error in result.whole.items()
        if noise.get(name)
    ]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else np.nan
