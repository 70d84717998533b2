"""The problem that an estimator of free-running trials solves, and its estimate: the same for every method."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise
from tank2sim.identification.trials.problem.captive_tests import CaptiveTests
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.notices import Notice

LITTLE_KNOWN = 0.25
"""A standard error of at least this share of the value is not widened (project choice)."""

LOOSE = 30.0
"""Factor on the standard errors before the trials in the fit of the captive tests alone, from which their noise comes:
the tests then determine all that they show (project choice)."""

ROUNDS, STEPS = 6, 6
"""Rounds of noise, and Gauss-Newton steps in each, of the fit of the captive tests alone: the noise of the KVLCC2's
changes by less than 1 % in the last (project choice)."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Free parameters of a model, their prior, and the runs that determine them."""

    model: Model  # Driven by the input that the runs recorded (:func:`.problem_from_card.driven_model`)
    free: tuple[str, ...]  # Names of the k parameters to estimate
    # `prior_mean`, `prior_error`: (k,): Value and standard error before the trials, in the parameter's own
    # unit; the error is positive
    prior_mean: Array
    prior_error: Array
    runs: tuple[SampledRun, ...]  # Each with the same `seen`
    captive: CaptiveTests | None = None  # Captive tests of the ship, which output error fits together with the runs
    # (k, k): Inverse of the correlations before the trials; None where the parameters are independent
    prior_inverse: Array | None = None

    @property
    def known(self) -> Array:
        """Information before the trials (k, k), in units of `prior_error`."""
        return np.eye(len(self.free)) if self.prior_inverse is None else self.prior_inverse

    def prior_precision(self, errors: Array) -> Array:
        """Information before the trials (k, k), with standard errors `errors` (k,)."""
        return np.asarray(self.known / np.outer(errors, errors), dtype=np.float64)

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
        parameters = [self.model[name] for name in self.free]
        lowest = np.array([-np.inf if parameter.minimum is None else parameter.minimum for parameter in parameters])
        return lowest, np.array(
            [np.inf if parameter.maximum is None else parameter.maximum for parameter in parameters]
        )

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
    # (k, k): Covariance of the estimates, for the residuals as they are (coloured, with model error), not as
    # white noise
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


def noise_alone(tests: CaptiveTests, problem: Problem) -> CaptiveTests:
    """The equations with the noise that they have at the best fit of the captive tests alone.

    Fitted together with trials, the noise must not grow until tank and trials agree: it is what the tank's own scatter
    and the structure of the model leave, with standard errors before the trials :data:`LOOSE` times those of `problem`.
    Within one tank the uncertain parameters between tank and ship are none.
    """
    values, prior = problem.prior_mean.copy(), problem.prior_precision(LOOSE * problem.prior_error)
    for _ in range(ROUNDS):
        for _ in range(STEPS):
            residual, slopes = tests.residuals(problem.parameters(values))
            weighted = slopes / tests.noise[tests.force][:, None] ** 2
            gradient = weighted.T @ residual + prior @ (values - problem.prior_mean)
            step = np.linalg.solve(weighted.T @ slopes + prior, gradient)
            values = np.clip(values - step, *problem.bounds)
        tests = tests.with_noise_at(problem.parameters(values))
    return tests
