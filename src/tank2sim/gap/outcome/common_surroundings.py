"""A wind or current that acts in all trials, in each with a speed and direction of its own, found by simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.outcome.surrounded_trial import STEP_SHARE, SurroundedTrial, typical_speed
from tank2sim.gap.result import Surroundings
from tank2sim.identification.trials.problem.prepare_trials import Measured

_TURNS = 15
"""Turns of initial state and surroundings, each at the last of the other, at most (project choice)."""

_SETTLED = 3e-3
"""A turn that moves the surroundings by less than this share of the typical speed is the last (project choice)."""

_CONVERGED = 1e-3
"""Share by which a step lowers the sum of squares of all trials together when it is the last (project choice: initial
states are found again after it)."""


@dataclass(frozen=True, eq=False)
class CommonSurroundings:
    """A wind or current that acts in all trials, in each with a speed and direction of its own, found by simulation.

    Parameters
    ----------
    effect : str
        Its name.
    values, errors : mapping
        Coefficients of its forces, which hold in all trials, by the names of the parameters, SI, with standard errors.
    by_trial : mapping
        Name of each trial to its wind or current.
    predicted : array (trials,)
        Root mean square of simulated less measured over the second half of each trial, with the wind or current fitted
        to the first half, over that without any.
    """

    effect: str
    values: Mapping[str, float]
    errors: Mapping[str, float]
    by_trial: Mapping[str, Surroundings]
    predicted: Array


def fit_common_surroundings(
    card: ManoeuvringCard, measured: Measured, effect: str, noise: Mapping[str, float]
) -> CommonSurroundings | None:
    """One effect of the surroundings with the coefficients of its forces, which are the same in all trials.

    None where, with the usual coefficients, what is fitted to the first half of a trial makes the second half worse in
    most of them: that would not be a wind or current.

    By least squares of the free-running simulations of all trials together. A trial weighs as many independent
    readings as its errors hold, in units of their own size; the coefficients are normal beforehand with the spreads of
    the effect.

    Parameters
    ----------
    card : ManoeuvringCard
        With the effect, whose wind or current is an input of its model.
    measured : Measured
        The trials.
    effect : str
        Its name.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    """
    trials = [SurroundedTrial(card, measured.driven_by, trial, (effect,), noise) for trial in measured.trials]
    together = _AllTrials(card, effect, trials)
    at = together.begin()
    if np.median(together.predicted(at)) >= 1:
        return None
    return together.fit(at)


class _AllTrials:
    """Least squares of all trials; unknowns (k + 2 trials,): k coefficients, currents north and east, m/s."""

    def __init__(self, card: ManoeuvringCard, effect: str, trials: Sequence[SurroundedTrial]):
        self.effect, self.trials, self._card = effect, trials, card
        self._shared = [parameter for parameter in EFFECTS[effect].parameters if parameter.spread_value(card)]
        self._centre = np.array([parameter.value({}, card) for parameter in self._shared])
        self._spread = np.array([parameter.spread_value(card) for parameter in self._shared])
        self._weights = np.ones(len(trials))

    def _parameters(self, at: Array) -> Array:
        """Parameters of the model with the coefficients (k, or more of which the first k)."""
        names = EFFECTS[self.effect].model_names()
        values = {names[parameter.name]: float(value) for parameter, value in zip(self._shared, at, strict=False)}
        return self.trials[0].replayer.model.parameter_values(values)

    def _parts(self, at: Array, place: int) -> Array:
        return at[len(self._shared) + 2 * place :][:2]

    def begin(self) -> Array:
        """The usual coefficients, and the wind or current of each trial that fits it best with these."""
        p = self._parameters(self._centre)
        return np.concatenate([self._centre, *(trial.parts(p) for trial in self.trials)])

    def predicted(self, at: Array) -> Array:
        """:attr:`CommonSurroundings.predicted`."""
        absent = np.array(
            [
                value if parameter.absent is None else parameter.absent
                for parameter, value in zip(self._shared, self._centre, strict=True)
            ]
        )
        with_effect, without = self._parameters(at), self._parameters(absent)
        return np.array(
            [trial.predicted(self._parts(at, place), with_effect, without) for place, trial in enumerate(self.trials)]
        )

    def residuals(self, at: Array) -> Array:
        """Weighted errors of all trials, and the coefficients' distance from the usual ones."""
        p = self._parameters(at)
        away = [
            weight * trial.away(self._parts(at, place), p)
            for place, (trial, weight) in enumerate(zip(self.trials, self._weights, strict=True))
        ]
        return np.concatenate([*away, (at[: len(self._shared)] - self._centre) / self._spread])

    def slopes(self, at: Array) -> Array:
        """Derivatives of :meth:`residuals` by the unknowns: a trial's wind moves this trial alone."""
        p, k = self._parameters(at), len(self._shared)
        blocks = np.zeros((sum(trial.count for trial in self.trials) + k, len(at)))
        row = 0
        for place, (trial, weight) in enumerate(zip(self.trials, self._weights, strict=True)):
            rows, parts = slice(row, row + trial.count), self._parts(at, place)
            now = trial.away(parts, p)
            blocks[rows, k + 2 * place : k + 2 * place + 2] = weight * trial.slopes(parts, p, now)
            for column, step in enumerate(STEP_SHARE * self._spread):
                moved = at[:k].copy()
                moved[column] += step
                blocks[rows, column] = weight * (trial.away(parts, self._parameters(moved)) - now) / step
            row += trial.count
        blocks[row:, :k] = np.diag(1 / self._spread)
        return blocks

    def fit(self, at: Array) -> CommonSurroundings:
        """From first values: weights and initial states in turn with the unknowns, until these settle."""
        anywhere = np.full(2 * len(self.trials), np.inf)
        low = np.concatenate([[parameter.lowest(self._card) for parameter in self._shared], -anywhere])
        high = np.concatenate([[parameter.maximum for parameter in self._shared], anywhere])
        typical = typical_speed(self._card, self.effect)
        scale = np.concatenate([self._spread, np.full(2 * len(self.trials), typical)])
        for _ in range(_TURNS):
            p = self._parameters(at)
            self._weights = np.array(
                [trial.weight(self._parts(at, place), p) for place, trial in enumerate(self.trials)]
            )
            solved = least_squares(self.residuals, at, self.slopes, bounds=(low, high), x_scale=scale, ftol=_CONVERGED)
            moved, at = float(np.max(np.abs(solved.x - at) / scale)), solved.x
            for place, trial in enumerate(self.trials):
                trial.begin(self._parts(at, place), self._parameters(at))
            if moved < _SETTLED:
                break
        errors = np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))
        names = [parameter.name for parameter in self._shared]
        return CommonSurroundings(
            self.effect,
            dict(zip(names, map(float, at), strict=False)),
            dict(zip(names, map(float, errors), strict=False)),
            {
                trial.name: Surroundings.of_parts(self._parts(at, place), self._parts(errors, place))
                for place, trial in enumerate(self.trials)
            },
            self.predicted(at),
        )
