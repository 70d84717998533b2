"""Which manoeuvre of five minutes would determine what the trials of a craft do not.

Each candidate is simulated with the estimates, and its information added to that of the trials, at their noise levels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.errors import InputError
from tank2sim.identification.craft.fit import (
    IDENTIFIED_SHARE,
    TRIALS_SHARE,
    CoefficientVerdict,
    CraftFit,
    information,
)
from tank2sim.identification.craft.problem import COMPASS_SPREADS
from tank2sim.simulation.sensitivity import Sensitivity

TRIAL_S = 300.0
"""Length of a candidate, s: five minutes."""


@dataclass(frozen=True, eq=False)
class CandidateTrial:
    """A manoeuvre of five minutes."""

    words: str  # Orders in words, revolutions in % of the largest: port/starboard
    t_s: tuple[float, ...]
    # `order_port`, `order_starboard`: Orders of the thrusters at these times, shares of their largest
    # revolutions
    order_port: tuple[float, ...]
    order_starboard: tuple[float, ...]
    determines: tuple[str, ...]  # Coefficients that the trials so far do not determine and that it would


def _patterns() -> dict[str, list[tuple[float, float, float]]]:
    """Candidate in words to (seconds, port, starboard) of its steps, which are repeated. Project choices."""
    return {
        "straight runs and coasting: 25 s each of 40/40, 0/0, 80/80, 0/0, 100/100, 0/0": [
            (25.0, level, level) for level in (0.4, 0.0, 0.8, 0.0, 1.0, 0.0)
        ],
        "going astern and ahead: 20 s each of -40/-40, 40/40, -80/-80, 80/80": [
            (20.0, level, level) for level in (-0.4, 0.4, -0.8, 0.8)
        ],
        "spins: 25 s each of 30/-30, -30/30, 60/-60, -60/60": [
            (25.0, level, -level) for level in (0.3, -0.3, 0.6, -0.6)
        ],
        "turns out of speed: 20 s each of 70/70, 90/50, 70/70, 40/80, 100/20, 20/100": [
            (20.0, port, starboard)
            for port, starboard in ((0.7, 0.7), (0.9, 0.5), (0.7, 0.7), (0.4, 0.8), (1.0, 0.2), (0.2, 1.0))
        ],
        "random steps: 6 s each of 80/20, -30/40, 60/60, 100/-50, 0/70, 30/90, -60/-20, 90/0": [
            (6.0, port, starboard)
            for port, starboard in (
                *((0.8, 0.2), (-0.3, 0.4), (0.6, 0.6), (1.0, -0.5)),
                *((0.0, 0.7), (0.3, 0.9), (-0.6, -0.2), (0.9, 0.0)),
            )
        ],
    }


def next_trials(card: SteeredCard, fit: CraftFit) -> list[CandidateTrial]:
    """The candidates, the one first that determines most of the coefficients that the trials do not.

    Empty for a craft whose thrusters are not two.
    """
    if len(card.thrusters) != 2:
        return []
    open_places = [
        place
        for place, (name, verdict) in enumerate(zip(fit.problem.free, fit.verdicts, strict=True))
        if verdict is CoefficientVerdict.PRIOR and name not in COMPASS_SPREADS
    ]
    problem = fit.problem
    # The reported errors allow for residuals unlike the noise model: a candidate narrows both alike.
    so_far = fit.by_run.sum(axis=0) + problem.prior_precision(problem.prior_error)
    now = np.minimum(fit.estimate.standard_errors, problem.prior_error)
    found = []
    for words, steps in _patterns().items():
        orders, inputs = _orders(card, fit, steps)
        added = _added_information(fit, inputs)
        errors = now.copy()
        if added is not None:
            errors *= np.sqrt(np.diag(np.linalg.inv(so_far + added)) / np.diag(np.linalg.inv(so_far)))
        determined = [
            problem.free[place].removeprefix("derivatives.").removeprefix("thrusters.")
            for place in open_places
            if errors[place] <= TRIALS_SHARE * problem.prior_error[place]
            or errors[place] <= IDENTIFIED_SHARE * abs(fit.estimate.values[place])
        ]
        times, port, starboard = zip(*orders, strict=True)
        found.append(CandidateTrial(words, times, port, starboard, tuple(determined)))
    return sorted(found, key=lambda candidate: -len(candidate.determines))


def _orders(
    card: SteeredCard, fit: CraftFit, steps: list[tuple[float, float, float]]
) -> tuple[tuple[tuple[float, float, float], ...], Array]:
    """Orders over five minutes, and the inputs of the model (n, nu)."""
    model, step = fit.problem.model, fit.problem.runs[0].step_s
    left, right = sorted(card.thrusters, key=lambda thruster: thruster.y_m)
    places = [model.input_names.index(f"thrusters.{thruster.name}.command") for thruster in (left, right)]
    inputs = np.tile(model.input_values(), (round(TRIAL_S / step), 1))
    orders, begin, number = [], 0.0, 0
    while begin < TRIAL_S:
        length, port, starboard = steps[number % len(steps)]
        orders.append((begin, port, starboard))
        rows = slice(round(begin / step), round((begin + length) / step))
        for place, share, thruster in ((places[0], port, left), (places[1], starboard, right)):
            inputs[rows, place] = share * (thruster.max_radps if share >= 0 else -thruster.lowest_radps)
        begin, number = begin + length, number + 1
    return tuple(orders), inputs


def _added_information(fit: CraftFit, inputs: Array) -> Array | None:
    """Information of a simulated trial (k, k); None if the motion or the covariance of its filter leaves all bounds."""
    problem = fit.problem
    run = problem.runs[0]
    model = problem.model
    sensitivity = Sensitivity(model, problem.free, problem.seen)
    p = problem.parameters(fit.estimate.values)
    start = np.zeros(len(model.state_names))
    states = sensitivity.motion(start, inputs[:-1], p, run.step_s)
    if not np.isfinite(states).all() or np.abs(states).max() > 1e6:
        return None
    shown = sensitivity.shown(states, inputs, p)
    made = replace(run, name="candidate", begin_s=0.0, inputs=inputs, measured=shown)
    try:
        return np.asarray(information(problem.with_runs((made,)), fit.estimate.values, fit.levels)[0])
    except InputError:  # the filter loses the motion
        return None
