"""Surge mass and drag from tows by output error: comparison of the integrated speeds of (1.5) with all readings."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.search import WithSlopes, least_misfit, pseudo_inverse
from tank2sim.apps.rigs.tow.records import Tows, as_force, mean_force
from tank2sim.apps.rigs.tow.surge import DELAY, DRAG_POWERS, SurgeCoefficients, surge_model
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.simulation.sensitivity import augmented_step

MOST_STEPS = 5000
"""Most steps of the integration over a record; a longer record has longer steps than the model's, because its body is
slower in proportion. Project choice: a thousandth of the rise of the speed is far below any reading error, and a time
in milliseconds under t_s would otherwise compute for hours."""
_LATEST_START = 0.5
"""Upper bound of the start delay as a share of the record: a later start leaves too few readings."""


@dataclass(frozen=True)
class TowModel:
    """Unknowns: M unless it is known, drag terms in order of (1.5), a start delay after t = 0, one for all tows."""

    terms: tuple[str, ...] = tuple(DRAG_POWERS)
    start_delay: bool = False
    total_mass_kg: float | None = None

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of M, also of a known one, of the drag terms, and of the delay."""
        return ("M", *self.terms, *([DELAY] if self.start_delay else []))


WHOLE_EQUATION = TowModel()
"""As in the paper."""


@dataclass(frozen=True, eq=False)
class OutputErrorFit:
    """The least-squares fit of the integrated speeds.

    Estimates (unknowns,) are in the order of the model, SI; `design` (readings, estimated) has the sensitivities of the
    speeds to all but a known M; residuals (readings,) are the fitted speed less the reading.
    """

    estimates: Array
    design: Array
    residuals_mps: Array

    @property
    def scatter_mps(self) -> float:
        """Standard deviation of a reading about the fitted speed."""
        return float(np.linalg.norm(self.residuals_mps)) / math.sqrt(self.freedom)

    @property
    def freedom(self) -> int:
        """Readings less estimates."""
        return len(self.residuals_mps) - int(self.design.shape[1])

    @property
    def covariance(self) -> Array:
        """Covariance of the estimates, for independent readings of equal variance and a true model; 0 of a known M."""
        inverse = pseudo_inverse(self.design)
        known = len(self.estimates) - len(inverse)
        covariance: Array = np.pad(self.scatter_mps**2 * inverse @ inverse.T, (known, 0))
        return covariance


def speed_predictor(times_s: Array, force: float | Polynomial, model: TowModel) -> WithSlopes:
    """Speeds of (1.5) from rest (times,), and their sensitivities (times, estimated), as a function of the estimates.

    Estimates are (M, B..., delay), SI; without M if it is known, without delay (>= 0) if it is not estimated. The body
    is at rest until t = 0, or until the start delay, and then moves under T(t) of the same clock. The force of each
    integration step is the mean of T over the step, which preserves the impulse.
    """
    pull = as_force(force)
    equation = _unit_model()
    names = [*(["total_mass"] if model.total_mass_kg is None else []), *model.terms]
    chosen = [equation.parameter_names.index(f"surge.{name}") for name in names]
    width = len(chosen) + model.start_delay
    intervals = np.diff(times_s, prepend=0.0)
    step = max(equation.step_s, float(times_s[-1]) / MOST_STEPS)
    counts = np.ceil(intervals / step - 1e-9).astype(int)
    along = _sensitive_step(tuple(names), width).mapaccum(int(counts.sum()))
    mass, row = equation.parameter_names.index("surge.total_mass"), equation.state_names.index("motion.u")
    places = np.cumsum(counts)

    def predict(estimates: Array) -> tuple[Array, Array]:
        parameters = equation.parameter_values()
        if model.total_mass_kg is not None:
            parameters[mass] = model.total_mass_kg
        parameters[chosen] = estimates[: len(chosen)]
        begin = float(estimates[-1]) if model.start_delay else 0.0
        # The steps between two readings are shorter if the start is between them, and zero before the start.
        moving = np.diff(np.maximum(times_s, begin), prepend=begin)
        steps = np.repeat(moving / np.maximum(counts, 1), counts)
        at = begin + np.cumsum(steps) - steps
        pulls = (pull(at) + 4 * pull(at + steps / 2) + pull(at + steps)) / 6
        start = np.zeros((len(equation.states), 1 + width))
        if model.start_delay:
            start[row, -1] = -float(pull(begin)) / parameters[mass]
        path = np.asarray(along(start, steps[None, :], pulls[None, :], parameters))[row].reshape(-1, 1 + width)
        at_times = np.vstack([np.zeros(1 + width), path])[places]
        at_times[times_s <= begin] = 0.0
        return at_times[:, 0], at_times[:, 1:]

    return predict


@functools.cache
def _unit_model() -> Model:
    return surge_model("towed body", SurgeCoefficients(total_mass_kg=1.0), 1.0)


@functools.cache
def _sensitive_step(names: tuple[str, ...], width: int) -> ca.Function:
    """A step of the states and of their sensitivities to parameters ``surge.*`` and to the start state."""
    model = _unit_model()
    chosen = [model.parameter_names.index(f"surge.{name}") for name in names]
    step = runge_kutta_step(model)
    x, u, p, h = step.sx_in()
    return augmented_step(step(x, u, p, h), x, p[chosen], (h, u, p), of_starts=width - len(chosen))


def simulated_speeds(
    coefficients: SurgeCoefficients, force: float | Polynomial, times_s: Array, start_delay_s: float = 0.0
) -> Array:
    """Speed (times,) in m/s of (1.5) from rest, at times >= 0 that rise."""
    predict = speed_predictor(times_s, force, TowModel(start_delay=True))
    return predict(np.array([*vars(coefficients).values(), start_delay_s]))[0]


def fit_speeds(tows: Tows, force: float | Polynomial, model: TowModel) -> OutputErrorFit | None:
    """Least squares of the integrated speeds against all readings after the release; None if it does not converge.

    InputError if the readings after the release do not outnumber the estimates.
    """
    read = ~np.isnan(tows.speed_mps) & (tows.time_s > 0)[:, None]
    row_of_reading = np.nonzero(read)[0]
    readings = tows.speed_mps[read]
    predict = speed_predictor(tows.time_s, force, model)
    scale, start, highest = _search(tows, mean_force(as_force(force), tows.time_s), model)
    if len(readings) <= len(scale):
        problem = f"{len(readings)} readings after the release do not test {len(scale)} estimates"
        raise InputError(tows.path, "", problem, 'give more readings, or take fewer terms (terms="B3")')

    def misfit(scaled: Array) -> tuple[Array, Array]:
        speeds, sensitivities = predict(scaled * scale)
        return speeds[row_of_reading] - readings, sensitivities[row_of_reading] * scale

    lowest = np.where(np.isinf(highest), -np.inf, 0.0)
    found = least_misfit(misfit, start, (lowest, highest), tolerances=(1e-12, 1e-12, 1e-12))
    if found is None:
        return None
    best = np.where(found.active_mask < 0, 0.0, found.x)
    residuals, design = misfit(best)
    known = [] if model.total_mass_kg is None else [model.total_mass_kg]
    return OutputErrorFit(np.concatenate([known, best * scale]), design / scale, residuals)


def _search(tows: Tows, force_N: float, model: TowModel) -> tuple[Array, Array, Array]:
    """Scale of each unknown, and start and upper bound in that scale; the lower bound of a bounded unknown is 0."""
    # The mass that gives the last mean speed without drag, and drag terms as large as the force at the top speed.
    mass = force_N * tows.time_s[-1] / max(tows.mean_speed_mps[-1], 1e-3 * tows.top_speed_mps)
    rows = [(mass, 1.0, np.inf)] if model.total_mass_kg is None else []
    rows += [(force_N / tows.top_speed_mps ** DRAG_POWERS[term], 0.0, np.inf) for term in model.terms]
    if model.start_delay:
        delay = 0.1 * tows.time_s[-1]
        rows.append((delay, 0.1, _LATEST_START * tows.time_s[-1] / delay))
    scale, start, highest = np.array(rows).T
    return scale, start, highest
