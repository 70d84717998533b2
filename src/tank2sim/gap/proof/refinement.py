"""Coefficients refined by free-running simulations of the fitted trials, once the missing effects are named.

The filter finds coefficients from instant to instant, where random forces explain a part of what they miss. A card that
is wrong by much more than it says is then followed to some noises only. Here the coefficients minimise, by Gauss and
Newton, the misfit of the simulations and their distance from the given card,

    sum ((simulated - measured)/noise)^2 + sum ((c - c_card)/(width sigma_card))^2,

with the common width of the card's errors that the filter found, and the initial states and instants of orders of each
trial found again at each step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.ship import mass_fault
from tank2sim.gap.inference.likelihood import least_in_box
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, first_state, input_record
from tank2sim.gap.proof.replay import replayer_of
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.records.trials import Trial

_ROUNDS = 2
"""The instants of the orders are found so often, the second time with coefficients that follow the trials."""

_STEPS = 5
"""Steps of coefficients and initial states together at most, in each round."""

_SETTLED = 0.02
"""A step that lowers the cost by less than this share is the last (project choice)."""

_HALVES = 4
"""A step that does not lower the cost is halved so often at most."""


@dataclass(frozen=True, eq=False)
class CoefficientPrior:
    """Coefficients of a card and how far they may be from it.

    Parameters
    ----------
    names : tuple of str
        Derivatives, as on the card.
    values, spread : array (k,)
        Values of the card and prior standard deviations, prime.
    highest : array (k,) or float
        Values that are not exceeded.
    """

    names: tuple[str, ...]
    values: Array
    spread: Array
    highest: Array | float = math.inf


def refined_coefficients(
    card: SteeredCard,
    prior: CoefficientPrior,
    measured: Measured,
    noise: Mapping[str, float],
    executor: Executor | None = None,
) -> Array:
    """Return the coefficients (k,) of least cost.

    Parameters
    ----------
    card : SteeredCard
        With the named effects; its coefficients are the first values.
    prior : CoefficientPrior
    measured : Measured
        The fitted trials, without faults of sensors.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    executor : Executor, optional
        Linearises several trials at once; the result does not depend on it.

    Raises
    ------
    InputError
        A trial is too short, or has none of the signals in `noise`.
    """
    each = map if executor is None else executor.map
    count, trials = len(measured.trials), measured.trials
    shared = [card] * count, [measured.driven_by] * count, [dict(noise)] * count, [prior] * count

    def normal(values: Array, begun: Sequence[_Begun]) -> tuple[float, list[_Linearised]]:
        """Cost, and the linearised trials."""
        parts = list(each(_linearised, *shared, begun, [values] * count))
        return sum(part.cost for part in parts) + float(np.sum(((values - prior.values) / prior.spread) ** 2)), parts

    at = np.array([card.derivatives[name] for name in prior.names])
    for _ in range(_ROUNDS):
        begun = list(each(_begin, *shared, trials, [at] * count))
        cost, parts = normal(at, begun)
        for _ in range(_STEPS):
            if not np.isfinite(cost):
                break
            slope = sum((part.slope for part in parts), (at - prior.values) / prior.spread**2)
            whole = sum((part.matrix for part in parts), np.diag(prior.spread**-2.0))
            step: Array = np.linalg.solve(whole, slope).astype(np.float64)
            if np.any(at - step > prior.highest):
                step = least_in_box(whole, slope, at - prior.highest, np.full(len(at), np.inf))
            for share in 0.5 ** np.arange(_HALVES):
                starts = [one.moved(share, part, step) for one, part in zip(begun, parts, strict=True)]
                then = normal(at - share * step, starts)
                if then[0] < cost:
                    break
            else:
                break
            lowered = 1 - then[0] / cost
            at, begun, (cost, parts) = at - share * step, starts, then
            if lowered < _SETTLED:
                break
    return at


@dataclass(frozen=True, eq=False)
class _Begun:
    """A record with the instants of its orders, its initial state (nx,), and that state's prior."""

    record: InputRecord
    start: Array
    guess: Array
    spread: Array

    def moved(self, share: float, part: _Linearised, step: Array) -> _Begun:
        """The same with the initial state after a share of a step of the coefficients (k,)."""
        return replace(self, start=self.start - share * (part.away - part.follows @ step))


@dataclass(frozen=True, eq=False)
class _Linearised:
    """A trial's cost, half slope (k,) and matrix (k, k) without its initial state, which moves by minus `away` (nx,)
    and by `follows` (nx, k) times a step of the coefficients."""

    cost: float
    slope: Array
    matrix: Array
    away: Array
    follows: Array


def _begin(
    card: SteeredCard,
    driven_by: str,
    noise: Mapping[str, float],
    prior: CoefficientPrior,
    trial: Trial,
    values: Array,
) -> _Begun:
    """A trial with the instants of orders and the initial state that fit it with these coefficients."""
    replayer = replayer_of(card, driven_by, noise)
    p = _parameters(replayer, prior, values)
    record, start = replayer.fit_record(input_record(replayer, trial), p)
    return _Begun(record, start, *first_state(replayer, record, p))


def _linearised(
    card: SteeredCard,
    driven_by: str,
    noise: Mapping[str, float],
    prior: CoefficientPrior,
    begun: _Begun,
    values: Array,
) -> _Linearised:
    """A trial about its present initial state and coefficients; of infinite cost without a positive mass."""
    replayer = replayer_of(card, driven_by, noise)
    p = _parameters(replayer, prior, values)
    if mass_fault(replayer.model, replayer.model.parameters_by_name(p)):
        nothing, count = np.zeros((len(begun.start), len(values))), len(values)
        return _Linearised(math.inf, np.zeros(count), np.zeros((count, count)), np.zeros(len(begun.start)), nothing)
    record, start = begun.record, begun.start
    free = tuple(f"derivatives.{name}" for name in prior.names)
    residual = replayer.away(record, start, p)
    from_guess = (start - begun.guess) / begun.spread
    slopes = (replayer.slopes_of_motion(record, start, p, free=free) / replayer.sigma[:, None])[record.known]
    by_start, by_value = slopes[:, : len(start)], slopes[:, len(start) :]
    both = by_start.T @ by_value
    right = np.column_stack([np.nan_to_num(by_start.T @ residual) + from_guess / begun.spread, both])
    solved: Array = np.linalg.solve(by_start.T @ by_start + np.diag(begun.spread**-2.0), right).astype(np.float64)
    away, follows = solved[:, 0], solved[:, 1:]
    return _Linearised(
        float(residual @ residual + from_guess @ from_guess),
        np.nan_to_num(by_value.T @ residual) - both.T @ away,
        by_value.T @ by_value - both.T @ follows,
        away,
        follows,
    )


def _parameters(replayer: Replayer, prior: CoefficientPrior, values: Array) -> Array:
    """Parameters of the model with coefficients (k,)."""
    variables = (f"derivatives.{name}" for name in prior.names)
    return replayer.model.parameter_values(dict(zip(variables, map(float, values), strict=True)))
