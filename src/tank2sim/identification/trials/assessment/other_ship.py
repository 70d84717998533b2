"""Test whether trials are of the ship of the card, by the yaw moment of the rudder, which every manoeuvre shows.

A derivative in the prime system depends on the length and the inertia that scale it. Trials of another ship than the
card's give a rudder moment ``Nd`` that is several times too large or too small, however well a fit of all coefficients
follows them. Equation error estimates it with the linear derivatives of sway and yaw alone, each with its own value as
prior standard error, from each trial alone (the trials may be of two ships) and as the mean of all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

_LINEAR = tuple(f"derivatives.{name}" for name in ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd"))
RUDDER = "derivatives.Nd"

_FACTOR = 2.0
"""Least ratio, either way, of the rudder's moment by all trials to that of the card. Ratios are 0.8 to 1.3 on HSVA's
and MARIN's KVLCC2, the Esso Osaka in wind and ships with an unknown effect, 3 and more (or a quarter) where a Mariner's
trials meet the card of the KVLCC2 (or the other way). Project choice."""

FACTOR_ALONE = 2.5
"""The same by one trial alone, which a gust can distort: 0.5 to 2.8 +- 0.4 on those runs. Project choice."""

ERRORS = 2.0
"""Standard errors either way: an interval of 95 %."""

_LEAST_RUDDER = np.deg2rad(1.0)
"""Standard deviation of the rudder below which a run does not show its moment (project choice)."""


def other_ship(problem: Problem) -> tuple[str, ...]:
    """Evidence that the runs are not of the card's ship, in sentences; empty if there is none."""
    if RUDDER not in problem.free or not problem.prior_mean[problem.free.index(RUDDER)]:
        return ()
    rudder = problem.model.input_names.index("rudder.command")
    trials: dict[str, list[SampledRun]] = {}
    for run in problem.runs:  # parts of one trial are reported by their times
        if run.inputs[:, rudder].std() > _LEAST_RUDDER:
            trials.setdefault(run.name.partition(" at ")[0], []).append(run)
    found = {name: ratio for name, runs in trials.items() if (ratio := _ratio(problem, runs)) is not None}
    messages = [_ratio_text(name, ratio) for name, ratio in found.items() if _beyond(*ratio, FACTOR_ALONE)]
    if found and _beyond(*(whole := _mean(list(found.values()))), _FACTOR):
        messages.insert(0, _ratio_text("the mean of all trials", whole))
    return tuple(messages)


def _ratio_text(name: str, ratio: tuple[float, float]) -> str:
    return f"{name} shows {ratio[0]:.2g} ± {ERRORS * ratio[1]:.2g} times the rudder's yaw moment of the card"


def _mean(ratios: list[tuple[float, float]]) -> tuple[float, float]:
    """Weighted mean of values with standard errors, and its standard error widened by excess scatter (Birge 1932)."""
    values, errors = np.array(ratios).T
    weights = 1 / errors**2
    mean = float(np.sum(weights * values) / np.sum(weights))
    birge = float(np.sum(weights * (values - mean) ** 2)) / max(len(values) - 1, 1)
    return mean, float(np.sqrt(max(birge, 1.0) / np.sum(weights)))


def _beyond(value: float, error: float, factor: float) -> bool:
    """True if the whole interval of a ratio is beyond a factor or its inverse."""
    return value - ERRORS * error > factor or value + ERRORS * error < 1 / factor


def _ratio(problem: Problem, runs: Sequence[SampledRun]) -> tuple[float, float] | None:
    """The rudder's yaw moment by runs over that of the card, and its standard error; None for short runs."""
    means = dict(zip(problem.free, problem.prior_mean, strict=True))
    linear = tuple(name for name in _LINEAR if means.get(name))
    mean = np.array([means[name] for name in linear])
    linear_problem = Problem(problem.model, linear, mean, np.abs(mean), tuple(runs))
    try:
        estimate = equation_error(linear_problem, settings=EquationErrorSettings(scale_prior=False))
    except (InputError, np.linalg.LinAlgError):
        return None
    place = linear.index(RUDDER)
    return float(estimate.values[place] / mean[place]), float(estimate.standard_errors[place] / abs(mean[place]))
