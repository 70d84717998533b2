"""The measured motion of a run for equation error: velocities as measured, and smoothed states as regressors.

Missing signals are derived where the measured ones determine them: yaw rate from heading, velocities through the water
from positions or from velocities over the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import savgol_coeffs, savgol_filter

from tank2sim.arrays import Array
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.sampled_runs import LONGEST_GAP, SampledRun
from tank2sim.notices import Notice
from tank2sim.simulation.recorded import SMOOTHING, drift_over_ground

VELOCITIES = ("motion.u", "motion.v", "motion.r")
POSITION = ("motion.psi", "motion.x", "motion.y")
MEASURED_STATES = (*VELOCITIES, *POSITION)
"""States that equation error takes from the record."""

SMALL_NOISE = 1e-4
"""A signal whose noise has less than this share of its variance is not smoothed: the noise pulls coefficients towards
zero by that share (Fuller 1987, Measurement Error Models), and smoothing might do more harm."""

_SPARSE = 0.5
"""Share of known samples below which a signal is smoothed by its samples alone: straight lines between them would hide
their noise (project choice)."""


_LEAST_STRETCH = 2.4
"""Stretch without gaps, in smoothing windows, below which a velocity is derived from heading and positions, if these
have it: a window of the weak form is 2.33 of them."""


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """Measured motion of a run."""

    # (n, 3): u, v (m/s), r (rad/s) as measured or derived, nan where they are unknown; straight lines between
    # the samples of a signal that is slower than the run
    velocities: Array
    smooth: Array  # (n, 6): :data:`MEASURED_STATES`, smoothed against noise in the regressors, without gaps
    noise: Array  # (3,): Standard deviation of the measurement of u, v, r
    remaining_noise: Array  # (3,): The same after smoothing
    notices: tuple[Notice, ...]  # One for each derived signal


def measured_motion(problem: Problem, run: SampledRun) -> MeasuredMotion:
    """Velocities and position of a run.

    Raises InputError: Velocities are neither measured nor determined by heading and positions.
    """
    return _measured_motion(problem.model, _window(problem, run), run)


@lru_cache(maxsize=16)  # the folds of a cross-validation share their runs
def _measured_motion(model: Model, window: int, run: SampledRun) -> MeasuredMotion:
    columns = {name: run.column(name) for name in MEASURED_STATES}
    missing = {name for name, column in columns.items() if np.isnan(column).all()}
    seldom = _seldom(columns, _LEAST_STRETCH * window)
    missing |= seldom
    columns |= {name: np.full(len(run.measured), np.nan) for name in seldom}
    if len(run.measured) <= window:
        raise InputError(run.origin, "", f"has only {len(run.measured)} steps", f"at least {window + 1} are needed")
    notices = []
    if seldom:
        names = ", ".join(name[7:] for name in VELOCITIES if name in seldom)
        notices.append(
            Notice(f"{run.name}: the readings of {names} are too far apart, and heading and positions are not")
        )
    if "motion.r" in missing:
        if "motion.psi" in missing:
            raise InputError(run.origin, "header", "has neither yaw rate nor heading", "give r_degps or psi_deg")
        columns["motion.r"] = _slope(columns["motion.psi"], window, run.step_s)
        notices.append(Notice(f"{run.name}: the yaw rate is the slope of the smoothed heading"))
    if "motion.psi" in missing:
        columns["motion.psi"] = cumulative_trapezoid(_filled(columns["motion.r"]), dx=run.step_s, initial=0.0)
    derived = missing & {"motion.u", "motion.v"}
    if derived:
        derived_columns, source = _velocities(model, run, columns, window)
        columns |= {name: derived_columns[name] for name in derived}
        notices.append(Notice(f"{run.name}: {' and '.join(name[7:] for name in sorted(derived))} {source}"))
    _complete_positions(columns, missing, run.step_s)
    velocities = np.column_stack([_bridged(columns[name]) for name in VELOCITIES])
    smooth, noise, remaining = zip(*(_smoothed(columns[name], window) for name in VELOCITIES), strict=True)
    position = [_filled(columns[name]) for name in POSITION]
    every = np.column_stack([*smooth, *position])
    return MeasuredMotion(velocities, every, np.array(noise), np.array(remaining), tuple(notices))


def _seldom(columns: dict[str, Array], least: float) -> set[str]:
    """Velocities with readings that nowhere last for `least` steps, where heading and positions have them."""
    lasting = {name for name, column in columns.items() if _longest(column) >= least}
    seldom = {name for name in VELOCITIES if name not in lasting and not np.isnan(columns[name]).all()}
    if "motion.psi" not in lasting:
        return set()
    return seldom if {"motion.x", "motion.y"} <= lasting else seldom & {"motion.r"}


def _longest(column: Array) -> int:
    """Steps of the longest stretch of a signal without gaps."""
    if np.isnan(column).all():
        return 0
    known = np.concatenate([[0], (~np.isnan(_bridged(column))).astype(int), [0]])
    edges = np.flatnonzero(np.diff(known))
    return int(np.max(edges[1::2] - edges[::2]))


def sensor_noise(problem: Problem, run: SampledRun) -> Array:
    """Standard deviation of the part of each signal that is too fast for a ship (ny,), 0 for an unmeasured signal."""
    window = _window(problem, run)
    columns = [run.column(name) for name in run.seen]
    return np.array([0.0 if np.isnan(column).all() else _smoothed(column, window)[1] for column in columns])


def _window(problem: Problem, run: SampledRun) -> int:
    return max(5, int(SMOOTHING * problem.ship_time / run.step_s) // 2 * 2 + 1)


def _velocities(model: Model, run: SampledRun, columns: dict[str, Array], window: int) -> tuple[dict[str, Array], str]:
    """u and v through the water from the motion over the ground, less the current of the model."""
    psi = columns["motion.psi"]
    ground = run.column("motion.u_ground"), run.column("motion.v_ground")
    if np.isnan(ground[0]).all() or np.isnan(ground[1]).all():
        if any(np.isnan(columns[name]).all() for name in ("motion.x", "motion.y")):
            remedy = "give u_mps and v_mps, or x_m, y_m and psi_deg"
            raise InputError(run.origin, "header", "has neither velocities nor positions", remedy)
        north, east = (_slope(columns[name], window, run.step_s) for name in ("motion.x", "motion.y"))
        source = "from the slope of the smoothed positions"
    else:
        north, east = _turned(*ground, psi)
        source = "from the velocities over the ground"
    drift = drift_over_ground(model, run.inputs, _filled(psi))
    u, v = _turned(north - drift[:, 0], east - drift[:, 1], -psi)
    return {"motion.u": u, "motion.v": v}, source


def _complete_positions(columns: dict[str, Array], missing: set[str], step: float) -> None:
    """Add unmeasured positions from the velocities: wind and banks need only their rough course."""
    if not missing & {"motion.x", "motion.y"}:
        return
    u, v, psi = (_filled(columns[name]) for name in ("motion.u", "motion.v", "motion.psi"))
    for name, rate in zip(("motion.x", "motion.y"), _turned(u, v, psi), strict=True):
        if name in missing:
            columns[name] = cumulative_trapezoid(rate, dx=step, initial=0.0)


def _turned(forward: Array, starboard: Array, angle: Array) -> tuple[Array, Array]:
    """Components (n,) each after turning the axes back by `angle` (n,): those of the earth from those of the body."""
    north, east = earth_velocity(*(ca.DM(values) for values in (forward, starboard, angle)))  # type: ignore[arg-type]
    return np.array(north).ravel(), np.array(east).ravel()


def _slope(column: Array, window: int, step: float) -> Array:
    """Time derivative of a smoothed signal (Savitzky and Golay 1964), nan in gaps of more than its own step."""
    slope: Array = savgol_filter(_filled(column), window, 3, deriv=1, delta=step)
    slope[_in_gaps(column)] = np.nan
    return slope


def _bridged(column: Array) -> Array:
    """A signal with straight lines between its samples, nan in gaps of more than its own step."""
    bridged = _filled(column)
    bridged[_in_gaps(column)] = np.nan
    return bridged


def _in_gaps(column: Array) -> NDArray[np.bool_]:
    """Mask (n,) of the rows without a sample that lie in gaps longer than the usual distance between samples."""
    known, missing = np.flatnonzero(~np.isnan(column)), np.isnan(column)
    usual = np.median(np.diff(known)) if len(known) > 1 else 1.0
    if usual <= 1:
        return missing
    rows = np.arange(len(column))
    after = np.clip(np.searchsorted(known, rows), 1, len(known) - 1)
    distance = known[after] - known[after - 1]
    in_gaps: NDArray[np.bool_] = missing & ((distance > LONGEST_GAP * usual) | (rows < known[0]) | (rows > known[-1]))
    return in_gaps


def _smoothed(column: Array, window: int) -> tuple[Array, float, float]:
    """A signal without gaps and noise; standard deviation of its noise before and after."""
    known = ~np.isnan(column)
    share = float(known.mean())
    if share < _SPARSE:
        fewer = max(5, int(share * window) // 2 * 2 + 1)
        if known.sum() > fewer:
            smooth_known, before, after = _smoothed(column[known], fewer)
            spread = np.full(len(column), np.nan)
            spread[known] = smooth_known
            return _filled(spread), before, after
    whole = _filled(column)
    smooth: Array = savgol_filter(whole, window, 3)
    gain = float(
        savgol_coeffs(window, 3)[window // 2]
    )  # weight of the sample itself: var(raw - smooth) = (1 - gain) var
    noise = float(np.std(whole - smooth)) / np.sqrt(1 - gain)
    if noise**2 < SMALL_NOISE * float(np.var(whole)):
        return whole, noise, noise
    return smooth, noise, noise * float(np.sqrt(gain))  # sum of squared weights = gain, for a projection


def _filled(column: Array) -> Array:
    known = np.flatnonzero(~np.isnan(column))
    return np.interp(np.arange(len(column)), known, column[known])
