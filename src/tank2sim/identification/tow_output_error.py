"""Surge mass and drag from tows by the error of the output: the speeds of (1.5), integrated, against all readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from tank2sim.dynamics.surge import DRAG_POWERS, SurgeCoefficients, surge_model
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import Matrix, Vector, column_norms
from tank2sim.records.tows import Tows
from tank2sim.simulation.scheme import runge_kutta_step

Predictor = Callable[[Vector], tuple[Vector, Matrix]]


@dataclass(frozen=True, eq=False)
class OutputErrorFit:
    """The least-squares fit of the integrated speeds.

    Parameters
    ----------
    estimates : array, (1 + terms,)
        M and the drag coefficients, SI.
    design : array, (readings, 1 + terms)
        Sensitivities of the speeds at the readings to the estimates.
    scatter_mps : float
        Standard deviation of a reading about the fitted speed.
    """

    estimates: Vector
    design: Matrix
    scatter_mps: float

    @property
    def covariance(self) -> Matrix:
        """Covariance of the estimates, for readings that err independently and alike and a model that is true."""
        norms = column_norms(self.design)
        inverse = np.linalg.pinv(self.design / norms) / norms[:, None]
        covariance: Matrix = self.scatter_mps**2 * inverse @ inverse.T
        return covariance


def speed_predictor(times_s: Vector, force_N: float, terms: tuple[str, ...]) -> Predictor:
    """Speeds of (1.5) from rest at t = 0 under a constant force, and their sensitivities.

    Returns
    -------
    callable
        ``predict(estimates) -> (speeds (times,), sensitivities (times, 1 + terms))`` with estimates = (M, B...), SI.
    """
    model = surge_model("towed body", SurgeCoefficients(total_mass_kg=1.0), force_N)
    step = runge_kutta_step(model)
    x, u, p, h = step.sx_in()
    following = step(x, u, p, h)
    chosen = [model.parameter_names.index(f"surge.{name}") for name in ("total_mass", *terms)]
    sensitivity = ca.SX.sym("S", len(model.states), len(chosen))
    moved = ca.jacobian(following, x) @ sensitivity + ca.jacobian(following, p)[:, chosen]
    augmented = ca.Function(
        "augmented", [ca.horzcat(x, sensitivity), h, u, p], [ca.horzcat(following, moved)], {"cse": True}
    )
    intervals = np.diff(times_s, prepend=0.0)
    counts = np.ceil(intervals / model.step_s - 1e-9).astype(int)
    steps = np.repeat(intervals / np.maximum(counts, 1), counts)
    along = augmented.mapaccum(len(steps))
    start = ca.DM.zeros(len(model.states), 1 + len(chosen))
    row, width, places = model.state_names.index("motion.u"), 1 + len(chosen), np.cumsum(counts)

    def predict(estimates: Vector) -> tuple[Vector, Matrix]:
        parameters = model.parameter_values()
        parameters[chosen] = estimates
        path = np.asarray(along(start, steps[None, :], model.input_values(), parameters))[row].reshape(-1, width)
        at_times = np.vstack([np.zeros(width), path])[places]
        return at_times[:, 0], at_times[:, 1:]

    return predict


def simulated_speeds(coefficients: SurgeCoefficients, force_N: float, times_s: Vector) -> Vector:
    """Speed (times,) in m/s of (1.5) from rest at t = 0, at times >= 0 that rise."""
    values = [coefficients.total_mass_kg, coefficients.B1_kgs2pm3, coefficients.B2_kgspm2, coefficients.B3_kgpm]
    return speed_predictor(times_s, force_N, tuple(DRAG_POWERS))(np.array(values))[0]


def fit_speeds(tows: Tows, force_N: float, terms: tuple[str, ...]) -> OutputErrorFit | None:
    """Least squares of the integrated speeds against all readings after the release; None if it does not converge.

    Raises
    ------
    InputError
        There are no more readings after the release than estimates.
    """
    read = ~np.isnan(tows.speed_mps) & (tows.time_s > 0)[:, None]
    row_of_reading = np.nonzero(read)[0]
    readings = tows.speed_mps[read]
    freedom = len(readings) - (1 + len(terms))
    if freedom < 1:
        problem = f"{len(readings)} readings after the release do not test {1 + len(terms)} estimates"
        raise InputError(tows.path, "", problem, "give more readings, or take fewer terms (--terms B3)")
    predict = speed_predictor(tows.time_s, force_N, terms)
    # The mass that gives the last mean speed without drag, and drag terms as large as the force at the top speed.
    mass = force_N * tows.time_s[-1] / max(tows.mean_speed_mps[-1], 1e-3 * tows.top_speed_mps)
    scale = np.array([mass, *(force_N / tows.top_speed_mps ** DRAG_POWERS[term] for term in terms)])

    def residuals(scaled: Vector) -> Vector:
        return predict(scaled * scale)[0][row_of_reading] - readings

    def jacobian(scaled: Vector) -> Matrix:
        scaled_design: Matrix = predict(scaled * scale)[1][row_of_reading] * scale
        return scaled_design

    start = np.array([1.0, *(0.0 for _ in terms)])
    found = least_squares(residuals, start, jacobian, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    if not found.success or not np.isfinite(found.x).all():
        return None
    scatter = float(np.sqrt(np.sum(found.fun**2) / freedom))
    return OutputErrorFit(found.x * scale, jacobian(found.x) / scale, scatter)
