"""What an answer predicts: intervals of the figures of trials held out, scatter of the estimates, criteria."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.comparison import Comparison, compare_card
from tank2sim.identification.trials.assessment.model_selection import Criteria, criteria
from tank2sim.identification.trials.assessment.monte_carlo import PredictionSettings as BandSettings
from tank2sim.identification.trials.assessment.monte_carlo import bands, bootstrap
from tank2sim.identification.trials.assessment.residual_forces import Disturbances, disturbances_of
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.picklable import PicklableShip, portable
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.simulation.recorded import recorded, steerable

IN_BANDS = {f"overshoots_deg.{number}": f"overshoot_{number}_deg" for number in (1, 2)}
"""Name of a figure in :mod:`.prediction` to its name here, where they differ."""


@dataclass(frozen=True, eq=False)
class FittedProblem:
    """A problem, what was found, and the card with it; `whole` if it is compared with runs at all their speeds."""

    problem: Problem
    estimate: Estimate
    card: ManoeuvringCard
    whole: bool = False


def held_out(answer: FittedProblem, held: Measured, members: int, executor: Executor | None = None) -> Comparison:
    """The new card against trials held out, with the interval in which each figure was to be expected.

    The interval is that of simulations with coefficients drawn from their covariance, under random forces as large and
    as slow as those that the fit left unexplained (:mod:`.prediction`).
    """
    plain = compare_card(answer.card, held, answer.estimate.noise, whole=answer.whole)
    if not members or not plain.figures:
        return plain
    card = steerable(answer.card)
    ship, model = PicklableShip(card.text, "order"), build(card)
    left = _disturbances(answer)
    intervals: dict[tuple[str, str], tuple[float, float]] = {}
    for trial in held.trials:
        what = recorded(trial, model)
        if what is None:
            continue
        try:
            found = bands(ship, answer.estimate, what, left, BandSettings(members=members), executor).quantiles
        except InputError:  # every member ran away: no interval can be told
            continue
        for name, (lowest, *_, highest) in found.items():
            intervals[trial.name, IN_BANDS.get(name, name)] = (lowest, highest)
    figures = tuple(replace(figure, interval=intervals.get((figure.trial, figure.name))) for figure in plain.figures)
    return replace(plain, figures=figures)


def criteria_or_none(answer: FittedProblem) -> Criteria | None:
    """Information criteria of the fit; None where the velocities for them were not measured."""
    try:
        return criteria(answer.problem, answer.estimate)
    except InputError:
        return None


def bootstrapped(
    answer: FittedProblem,
    driven_by: str,
    estimator: Callable[[Problem], Estimate],
    members: int,
    executor: Executor | None,
) -> Array | None:
    """Estimates from trials simulated again; None where they were not asked for, or the residual forces are unknown."""
    if not members:
        return None
    left = _disturbances(answer)
    if left is None:  # no velocities: nothing tells how large the forces are that the model leaves out
        return None
    # Simulated trials are as wide awake as the estimate says: the prior stays what it was when that was found.
    asked = portable(answer.problem, answer.card, driven_by)
    settings = BandSettings(members=members)
    return bootstrap(asked, answer.estimate, estimator, left, settings, executor)


def _disturbances(answer: FittedProblem) -> Disturbances | None:
    """What the fit left unexplained, as random forces; None where the velocities for it were not measured."""
    try:
        return disturbances_of(answer.problem, answer.estimate.values)
    except InputError:
        return None
