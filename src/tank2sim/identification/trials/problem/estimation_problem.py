"""The problem that an estimator of free-running trials solves, and its estimate: the same for every method.

Standard errors of estimates with correlated residuals, and the width of the prior by its evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from scipy.linalg import eigh

from tank2sim.arrays import Array
from tank2sim.cards import SteeredCard, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Quantity, same_symbol
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.notices import Notice

if TYPE_CHECKING:
    from tank2sim.identification.trials.problem.captive_tests import CaptiveTests

LITTLE_KNOWN = 0.25
"""A standard error of at least this share of the value is not widened (project choice)."""

AND_DIRECTIONS = " and directions"
"""Ending of what drives a craft's model where the directions of its thrusters were measured and not ordered."""


def driven_model(card: SteeredCard, driven_by: str) -> Model:
    """The card's model, driven by the measured angle of the rudder (`driven_by` is ``angle``) or by its order; of a
    craft, by the measured ``revolutions`` of its thrusters or by their ``orders``, followed by
    :data:`AND_DIRECTIONS` where the directions of thrusters that turn were measured."""
    if driven_by.startswith("revolutions"):
        card = without_order_response(card)
    if driven_by.endswith(AND_DIRECTIONS):
        card = without_turning_lag(card)
    return _driven(build(card), driven_by)


def without_order_response(card: SteeredCard) -> SteeredCard:
    """The card of a craft without what lies between orders and revolutions: lag, dead band and exponent."""
    none = {"time_constant_s": None, "dead_band_radps": 0.0, "order_exponent": None}
    return replace(card, thrusters=tuple(thruster.model_copy(update=none) for thruster in card.thrusters))


def without_turning_lag(card: SteeredCard) -> SteeredCard:
    """The card of a craft whose thrusters turn to their ordered direction at once."""
    none = {"azimuth_time_constant_s": None}
    return replace(card, thrusters=tuple(thruster.model_copy(update=none) for thruster in card.thrusters))


@lru_cache(maxsize=KEPT_MODELS)
def _driven(ship: Model, driven_by: str) -> Model:
    model = with_ground_velocities(ship)
    return driven_by_angle(model) if driven_by == "angle" else model


def driven_by_angle(model: Model) -> Model:
    """The model without its steering gear: ``rudder.command`` is the angle of the rudder.

    For trials in which the angle was measured: the record contains the action of the gear.
    """
    angle, order = model.symbol("rudder.angle"), model.symbol("rudder.command")
    removed = {"rudder.rate", "rudder.angle"}
    quantities = []
    for quantity in model.quantities:
        if quantity.name in removed:
            continue
        copy = replace(quantity, value=ca.substitute(quantity.value, angle, order))
        quantities.append(same_symbol(quantity, copy))
    return replace(
        model,
        states=tuple(state for state in model.states if state.name != "rudder.angle"),
        quantities=tuple(quantities),
        outputs=tuple(name for name in model.outputs if name not in removed),
    )


def with_ground_velocities(model: Model) -> Model:
    """The model with ``motion.u_ground`` and ``motion.v_ground``, the velocity over the ground in body axes, m/s."""
    north, east, psi = (model.symbol(name) for name in ("motion.xdot", "motion.ydot", "motion.psi"))
    forward, starboard = earth_velocity(north, east, -psi)
    return model.extend(
        Quantity(name="motion.u_ground", unit="m/s", description="Velocity ahead over the ground", value=forward),
        Quantity(
            name="motion.v_ground", unit="m/s", description="Velocity to starboard over the ground", value=starboard
        ),
    )


@dataclass(frozen=True)
class DrivenShip:
    """The text of a card, and the rudder signal that drives its model, ``angle`` or ``order``: a model cannot be sent
    to other processes, because of its symbols, and is built there from its card."""

    card: str
    driven_by: str

    @property
    def model(self) -> Model:
        """The model; built once in each process."""
        return _model_of(self)


@lru_cache(maxsize=8)
def _model_of(ship: DrivenShip) -> Model:
    card = parse_card(ship.card, "card")
    assert isinstance(card, SteeredCard)
    return driven_model(card, ship.driven_by)


def model_bounds(model: Model, names: Sequence[str]) -> tuple[Array, Array]:
    """Least and largest value of parameters `names` (k,), infinite where the `model` states none."""
    pairs = [(model[name].minimum, model[name].maximum) for name in names]
    infinite = ((-np.inf if low is None else low, np.inf if high is None else high) for low, high in pairs)
    lowest, highest = np.array(list(infinite), dtype=float).reshape(-1, 2).T
    return lowest, highest


@dataclass(frozen=True, eq=False)
class Problem:
    """Free parameters of a model, their prior, and the runs that determine them."""

    model: Model  # Driven by the input that the runs recorded (:func:`driven_model`)
    free: tuple[str, ...]  # Names of the k parameters to estimate
    # `prior_mean`, `prior_error`: (k,): Value and standard error before the trials, in the parameter's own unit; the
    # error is positive
    prior_mean: Array
    prior_error: Array
    runs: tuple[SampledRun, ...]  # Each with the same `seen`
    captive: CaptiveTests | None = None  # Captive tests of the ship, which output error fits together with the runs
    # (k, k): Inverse of the correlations before the trials; None where the parameters are independent
    prior_inverse: Array | None = None
    ship: DrivenShip | None = None  # Whose model it is: needed in other processes

    def __getstate__(self) -> dict[str, object]:
        """All but the model, which is built again."""
        if self.ship is None:
            raise TypeError("a problem without its ship is not for other processes")
        return {**self.__dict__, "model": None}

    def __setstate__(self, state: dict[str, object]) -> None:
        """The same problem, with a model of this process."""
        ship = state["ship"]
        assert isinstance(ship, DrivenShip)
        self.__dict__.update(state, model=ship.model)

    @property
    def known(self) -> Array:
        """Information before the trials (k, k), in units of `prior_error`."""
        return np.eye(len(self.free)) if self.prior_inverse is None else self.prior_inverse

    def prior_precision(self, errors: Array) -> Array:
        """Information before the trials (k, k), with standard errors `errors` (k,)."""
        return np.asarray(self.known / np.outer(errors, errors), dtype=np.float64)

    def before(self, values: Array, errors: Array) -> tuple[Array, Array, float]:
        """Information (k, k), half the gradient (k,) and cost at `values` (k,) of what is known before the trials: the
        prior with standard errors `errors` (k,), and captive tests."""
        prior, away = self.prior_precision(errors), values - self.prior_mean
        gradient, cost = prior @ away, float(away @ prior @ away)
        if self.captive is None:
            return prior, gradient, cost
        tank, pull, tank_cost = self.captive.normal(self.parameters(values))
        return prior + tank, gradient + pull, cost + tank_cost

    @property
    def groups(self) -> tuple[str, ...]:
        """Group of each parameter whose error may be too small (k,): its equation, X, Y or N; "" for every other
        parameter.

        A card's standard errors describe the tests behind it; another basin, Reynolds number or ship differs by more.
        An error of the size of the value already states that little is known.
        """
        return tuple(
            name.partition(".")[2][0] if name.startswith("derivatives.") and error < LITTLE_KNOWN * abs(mean) else ""
            for name, mean, error in zip(self.free, self.prior_mean, self.prior_error, strict=True)
        )

    @property
    def seen(self) -> tuple[str, ...]:
        """Variables that are compared with measurements, in the order of the columns of each run."""
        return self.runs[0].seen

    @property
    def ship_time(self) -> float:
        """L/u0, s."""
        p = self.model.parameter_values()
        names = self.model.parameter_names
        return float(p[names.index("ship.length")] / p[names.index("ship.speed")])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of each free parameter (k,), infinite where the model states none."""
        return model_bounds(self.model, self.free)

    def parameters(self, values: Array) -> Array:
        """The model's parameter vector with the free ones at `values` (k,)."""
        return self.model.parameter_values(dict(zip(self.free, map(float, values), strict=True)))

    def without(self, names: Collection[str]) -> Problem:
        """The problem with the free parameters in `names` held at their prior means."""
        kept = [place for place, name in enumerate(self.free) if name not in names]
        free = tuple(self.free[place] for place in kept)
        captive = self.captive and self.captive.of(kept)
        mean, error = self.prior_mean[kept], self.prior_error[kept]
        # Of a normal distribution given some of its variables, the inverse covariance is a block of the whole one.
        inverse = None if self.prior_inverse is None else self.prior_inverse[np.ix_(kept, kept)]
        return replace(self, free=free, prior_mean=mean, prior_error=error, captive=captive, prior_inverse=inverse)

    def with_runs(self, runs: tuple[SampledRun, ...]) -> Problem:
        """The problem with other runs."""
        return replace(self, runs=runs)


@dataclass(frozen=True, eq=False)
class FittedMotion:
    """Initial states and noise of a fit by output error."""

    piece_s: float | None  # Length of the pieces, s; None for whole runs
    starts: tuple[Array, ...]  # each (pieces, nx): Initial states of the pieces of each run
    noise: tuple[ColouredNoise, ...]  # Noise of each seen variable


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimate of the free parameters by one method."""

    method: str  # Name of the method
    free: tuple[str, ...]  # The k parameters
    values: Array  # (k,): Estimates
    # (k, k): Covariance of the estimates, for the residuals as they are (coloured, with model error), not as white
    # noise
    covariance: Array
    information: Array  # (k, k): Information of the trials alone: the inverse covariance without the prior
    noise: Mapping[str, float] = field(default_factory=dict)  # Standard deviation of the residual by variable
    cost: tuple[float, ...] = ()  # Minimised function after each iteration
    # Chosen factor on the prior's standard errors by group (:attr:`Problem.groups`)
    prior_scale: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()  # Messages for the user
    motion: FittedMotion | None = None  # What output error fitted in addition to the parameters
    # (draws, k): Samples of the posterior, where it was sampled: `values` and `covariance` are then theirs
    samples: Array | None = None

    def draw(self, generator: np.random.Generator) -> Array:
        """Random parameters (k,) from a numpy `generator`: one of the samples, or normal without any."""
        if self.samples is not None:
            return np.asarray(self.samples[generator.integers(len(self.samples))])
        return generator.multivariate_normal(self.values, self.covariance)

    @property
    def standard_errors(self) -> Array:
        """Standard errors of the estimates (k,)."""
        return np.sqrt(np.diag(self.covariance))


SearchReport = Callable[[str, Array, float], None]
"""Called as ``progress(stage, values, cost)`` whenever a better estimate is found; it may raise to stop."""


def silent(stage: str, values: Array, cost: float) -> None:
    """Ignore progress."""


BLOCK = 5.0
"""Residuals farther apart than this many ship lengths count as independent in standard errors (project choice: the
memory of the flow and of a slow model error are of that order)."""

MOST_FITTED = 2 / 3
"""Largest assumed share of the residuals' variance that the fit absorbed: beyond it the blocks hardly outnumber the
parameters, and the correction of their scatter would itself be scatter (project choice)."""


def scaled_prior(problem: Problem, scale: Mapping[str, float]) -> Array:
    """Standard errors before the trials (k,), with :attr:`Problem.groups` times the scale of their group."""
    return np.array([scale.get(group, 1.0) for group in problem.groups]) * problem.prior_error


def evidence_scale(problem: Problem, information: Array, values: Array, scale: Mapping[str, float]) -> dict[str, float]:
    """Factor on the prior's errors of each group that has the largest evidence, at least 1 (MacKay 1992, Neural
    Computation 4): distance from the prior's mean over the number of parameters that the trials determine.

    `problem`: k free parameters. `information` (k, k): Information of the trials alone. `values` (k,): Estimates.
    `scale`: The factors of these estimates.
    """
    prior = scaled_prior(problem, scale)
    scaled = information * np.outer(prior, prior)
    fixed = 1 - np.diag(np.linalg.solve(scaled + problem.known, problem.known))
    distance = (values - problem.prior_mean) / problem.prior_error
    groups = np.array(problem.groups)
    factors = {}
    for group in sorted(set(problem.groups) - {""}):
        rows = np.flatnonzero(groups == group)
        squares = float(distance[rows] @ problem.known[np.ix_(rows, rows)] @ distance[rows])
        factors[group] = max(1.0, float(np.sqrt(squares / max(fixed[rows].sum(), 1.0))))
    return factors


def sandwich(information: Array, unit: Array, scores: Sequence[Array], before: Array) -> Array:
    """Covariance (k, k) of estimates, robust to the true correlation of the residuals (Huber 1967; Newey and West
    1987).

    `information` (k, k): Information of the trials alone, under the noise model. `unit` (k,): Sizes of the parameters,
    which scale the matrices: the prior's errors. `scores` each (blocks, k): Gradient of each run by blocks of
    :data:`BLOCK` ship lengths, in the order of time. `before` (k, k): Information before the trials: of the prior, and
    of captive tests that were fitted with them.
    """
    # In units of the prior's errors the matrices are well scaled: a parameter without trials has information 0 against
    # 1.
    size = np.outer(unit, unit)
    scaled, known = information * size, before * size
    bread = np.linalg.inv(scaled + known)
    determined = float(np.trace(bread @ scaled))
    spread = bread @ (_meat(scaled, [score * unit for score in scores], determined) + known) @ bread
    return spread * size


def _meat(information: Array, scores: Sequence[Array], determined: float) -> Array:
    """Covariance of the gradient (k, k) from blocks of time and their neighbours (Newey and West 1987, one lag).

    Model error correlates residuals far longer than the noise model; white-noise theory would make the intervals
    several times too narrow. The result is at least that theory's `information` in every direction. The fit of the
    `determined` parameters absorbs a share of the residuals: determined/B with B blocks of equal weight (Bell and
    McCaffrey 2002, Survey Methodology 28).
    """
    total = np.zeros_like(information)
    for score in scores:
        lagged = score[1:].T @ score[:-1]
        total += score.T @ score + 0.5 * (lagged + lagged.T)
    count = sum(len(score) for score in scores)
    total *= 1 / (1 - min(determined / max(count, 1), MOST_FITTED))
    # To a diagonal of 1 at most: trials with hardly any noise have an information so large that the rounding of one
    # parameter's exceeds all of another's. What is added is negligible: 1e-9 of the prior's, 1e-10 of its own.
    size = 1 / np.sqrt(np.diag(information) + 1.0)
    square = np.outer(size, size)
    scaled = 0.5 * (information + information.T) * square
    values, vectors = eigh(total * square, scaled + np.diag(1e-9 * size**2 + 1e-10))
    root = scaled @ vectors
    meat: Array = (root * np.maximum(values, 1.0)) @ root.T
    return meat / square
