"""Random forces that the model does not explain: their size in trials, and their simulation in manoeuvres.

First-order Gauss-Markov forces X, Y, N: covariance P exp(-|tau|/T). In simulation each is a sum of harmonics,

    F(t) = sum over j of a_j cos(w_j t) + b_j sin(w_j t),    a_j, b_j ~ N(0, P/m),    j = 1 ... m,

whose frequencies are drawn from the spectrum, which is Cauchy's distribution of scale 1/T (the spectral representation
of Shinozuka and Jan 1972, J. Sound Vib. 25): a function of time, so that integration and events stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model, Parameter, Quantity, State
from tank2sim.identification.trials.methods.weak_form import WeakForm, WeakWindows
from tank2sim.identification.trials.problem.estimation_problem import Problem

HARMONICS = 16
"""Harmonics of a force (project choice): one in each sixteenth of its power, from slow drift to shaking."""

LAGS = 12
"""Residuals up to this many half windows apart determine the correlation time (project choice: 4 L/u0)."""

FORCES = {"X": "N", "Y": "N", "N": "N.m"}


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Gauss-Markov forces."""

    covariance: Array  # (3, 3): Covariance of X, Y (N) and N (N m)
    correlation_s: float  # Time in which their correlation falls to 1/e, s

    @property
    def deviations(self) -> Array:
        """Standard deviations of X, Y, N (3,)."""
        return np.sqrt(np.diag(self.covariance))


def disturbances_of(problem: Problem, values: Array) -> Disturbances:
    """Forces in the trials beyond the model with its free parameters at `values` (k,).

    From the covariances of the weak form's residuals from window to window, less the part of sensor noise. They include
    model error, which looks like a force.
    """
    form = WeakForm(problem)
    acceleration, correlation_s = gauss_markov(form, form.at(values))
    masses = _mass_matrix(problem.model, problem.parameters(values))
    return Disturbances(masses @ acceleration @ masses.T, correlation_s)


def gauss_markov(form: WeakForm, windows: list[WeakWindows]) -> tuple[Array, float]:
    """Covariance (3, 3) and correlation time, s, of the random accelerations that fit the residuals best.

    Least squares over the covariances at lags 0 to :data:`LAGS`.
    """
    step = form.runs[0].run.step_s
    bump = form.runs[0].averaging[0].toarray().ravel()
    bump = bump[bump > 0]
    noise = np.mean([run.motion.noise**2 for run in form.runs], axis=0)
    count, lag = len(bump), len(bump) // 2
    covariances = _lagged(form, windows)
    size = np.sqrt(np.maximum(np.diag(covariances[0]), 1e-100))
    slopes = np.diff(np.concatenate([[0.0], bump, [0.0]])) / step
    for place in range(min(3, len(covariances))):  # noise of a sample is in every window that contains it
        shared = slopes[place * lag :] @ slopes[: len(slopes) - place * lag]
        covariances[place] -= np.diag(noise) * shared
    traces = np.array([np.trace(lagged / np.outer(size, size)) for lagged in covariances])
    overlap = np.correlate(bump, bump, "full")
    apart = np.arange(-count + 1, count) * step

    def theory(correlation_s: float) -> Array:
        distances = np.abs(apart[None, :] - np.arange(len(covariances))[:, None] * lag * step)
        return np.asarray(np.exp(-distances / correlation_s) @ overlap)

    def misfit(logarithm: float) -> float:
        shape = theory(float(np.exp(logarithm)))
        height = max(float(shape @ traces / (shape @ shape)), 0.0)
        return float(np.sum((traces - height * shape) ** 2))

    half = lag * step
    best = minimize_scalar(misfit, bounds=(np.log(0.1 * half), np.log(30 * half)), method="bounded")
    correlation_s = float(np.exp(best.x))
    shape = theory(correlation_s)
    covariance = np.einsum("l,lij->ij", shape, covariances) / (shape @ shape)
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2 / np.outer(size, size))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(size, size), correlation_s


def disturbed(model: Model) -> Model:
    """The model with random forces; their parameters, 0 by default, are those of :func:`draw_disturbances`."""
    clock = State(
        name="disturbance.clock",
        unit="s",
        description="Time since the start",
        derivative="disturbance.pace",
        start=0.0,
    )
    pace = Quantity(name="disturbance.pace", unit="1", description="1: time passes", value=ca.SX(1.0))
    rates = [_parameter(f"disturbance.rate_{j}", "rad/s") for j in range(HARMONICS)]
    model = model.extend(clock, pace, *rates)
    angles = [rate.symbol * clock.symbol for rate in rates]
    for force, unit in FORCES.items():
        waves = [
            (_parameter(f"disturbance.{force}_{wave}_{j}", unit), function(angle))
            for j, angle in enumerate(angles)
            for wave, function in (("cos", ca.cos), ("sin", ca.sin))
        ]
        total = sum((parameter.symbol * value for parameter, value in waves), start=ca.SX(0.0))
        model = model.extend(*(parameter for parameter, _ in waves))
        model = model.redefine(f"force.{force}", lambda old, total=total: old + total)  # type: ignore[misc]
    return model


def draw_disturbances(disturbances: Disturbances, fastest: float, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of a :func:`disturbed` model for one course of the forces, drawn by `rng`.

    `disturbances`: Their covariance and correlation time. `fastest`: Highest frequency that integration resolves,
    rad/s: higher frequencies are set to it.
    """
    share = (np.arange(HARMONICS) + rng.random(HARMONICS)) / HARMONICS  # one in each part of equal power
    rates = np.minimum(np.tan(np.pi / 2 * share) / disturbances.correlation_s, fastest)
    values, vectors = np.linalg.eigh(disturbances.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0) / HARMONICS)
    parameters = {f"disturbance.rate_{j}": float(rate) for j, rate in enumerate(rates)}
    for wave in ("cos", "sin"):
        heights = root @ rng.standard_normal((3, HARMONICS))
        for force, row in zip(FORCES, heights, strict=True):
            parameters |= {f"disturbance.{force}_{wave}_{j}": float(height) for j, height in enumerate(row)}
    return parameters


def fastest_rate(model: Model) -> float:
    """Highest frequency that a model's step resolves, rad/s: ten steps in a period (project choice)."""
    return 2 * np.pi / (10 * model.step_s)


def _parameter(name: str, unit: str) -> Parameter:
    return Parameter(name=name, unit=unit, description="Of a random force", start=0.0)


def _lagged(form: WeakForm, windows: list[WeakWindows]) -> Array:
    """Covariances (lags, 3, 3) of residuals at lags of half windows."""
    pieces = [window.residuals[part] for window, run in zip(windows, form.runs, strict=True) for part in run.pieces]
    lags = min(LAGS + 1, max(len(piece) for piece in pieces))
    sums, counts = np.zeros((lags, 3, 3)), np.zeros(lags)
    for piece in pieces:
        for lag in range(min(lags, len(piece))):
            early, late = piece[: len(piece) - lag], piece[lag:]
            sums[lag] += (late.T @ early + early.T @ late) / 2
            counts[lag] += len(early)
    return sums / counts[:, None, None]


def _mass_matrix(model: Model, p: Array) -> Array:
    """Mass matrix (3, 3) at rest, SI."""
    names = ("surge", "sway", "sway_yaw", "yaw_sway", "yaw")
    expression = model.expand(ca.vcat([model.symbol(f"inertia.{name}") for name in names]))
    function = ca.Function("masses", [model.x, model.u, model.p], [expression])
    start = np.array(model.initial(p)).ravel()
    surge, sway, sway_yaw, yaw_sway, yaw = np.array(function(start, model.input_values(), p)).ravel()
    return np.array([[surge, 0.0, 0.0], [0.0, sway, sway_yaw], [0.0, yaw_sway, yaw]])
