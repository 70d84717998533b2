"""Equations of motion multiplied by test functions and integrated, without numerical accelerations.

For window w and equation i, with bump functions phi_w = (1 - s^2)^2 that half overlap,

    e_wi = -integral(phi_w' q_i) dt - integral(phi_w a_i(q, inputs; theta)) dt,  q = (u, v, r), a = dq/dt of the model,

over integral(phi_w) dt: a mean acceleration. Summation by parts makes the first term a sum of phi_w times the
differences of q (Messenger and Bortz 2021, Multiscale Model. Simul. 19; the modulating functions of Shinbrot 1957).

The measured motion of a run for equation error: velocities as measured, and smoothed states as regressors.

Missing signals are derived where the measured ones determine them: yaw rate from heading, velocities through the water
from positions or from velocities over the ground.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array, true_runs
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Input, Model, same_symbol
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.sampled_runs import LONGEST_GAP, SampledRun, rudder_at_start
from tank2sim.notices import Notice
from tank2sim.records.trials import straight_over_gaps
from tank2sim.simulation.recorded import earth_components, smoothing_window, velocities_through_water
from tank2sim.simulation.rows import RowFunction
from tank2sim.simulation.sensitivity import Sensitivity

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

    # (n, 3): u, v (m/s), r (rad/s) as measured or derived, nan where they are unknown; straight lines between the
    # samples of a signal that is slower than the run
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
    columns, notices = _measured_often(run, window)
    missing = {name for name, column in columns.items() if np.isnan(column).all()}
    if len(run.measured) <= window:
        raise InputError(run.origin, "", f"has only {len(run.measured)} steps", f"at least {window + 1} are needed")
    if "motion.r" in missing:
        if "motion.psi" in missing:
            raise InputError(run.origin, "header", "has neither yaw rate nor heading", "give r_degps or psi_deg")
        columns["motion.r"] = _slope(columns["motion.psi"], window, run.step_s)
        notices.append(Notice(f"{run.name}: the yaw rate is the slope of the smoothed heading"))
    if "motion.psi" in missing:
        columns["motion.psi"] = cumulative_trapezoid(_filled(columns["motion.r"]), dx=run.step_s, initial=0.0)
    if derived := missing & {"motion.u", "motion.v"}:
        velocities_of_track, source = _velocities(model, run, columns, window)
        columns |= {name: velocities_of_track[name] for name in derived}
        notices.append(Notice(f"{run.name}: {' and '.join(name[7:] for name in sorted(derived))} {source}"))
    _complete_positions(columns, missing, run.step_s)
    measured = [columns[name] for name in VELOCITIES]
    velocities = np.column_stack(list(map(_bridged, measured)))
    smooth, noise, remaining = zip(*(_smoothed(column, window) for column in measured), strict=True)
    every = np.column_stack([*smooth, *(_filled(columns[name]) for name in POSITION)])
    return MeasuredMotion(velocities, every, np.array(noise), np.array(remaining), tuple(notices))


def _measured_often(run: SampledRun, window: int) -> tuple[dict[str, Array], list[Notice]]:
    """Signals of the motion (n,), nan for one whose readings are too far apart, and a notice of these."""
    columns = {name: run.column(name) for name in MEASURED_STATES}
    seldom = _seldom(columns, _LEAST_STRETCH * window)
    if not seldom:
        return columns, []
    names = ", ".join(name[7:] for name in VELOCITIES if name in seldom)
    notice = Notice(f"{run.name}: the readings of {names} are too far apart, and heading and positions are not")
    return columns | dict.fromkeys(seldom, np.full(len(run.measured), np.nan)), [notice]


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
    lengths = [int(rows.stop - rows.start) for rows in true_runs(~np.isnan(_bridged(column)))]
    return max(lengths)


def sensor_noise(problem: Problem, run: SampledRun) -> Array:
    """Standard deviation of the part of each signal that is too fast for a ship (ny,), 0 for an unmeasured signal."""
    window = _window(problem, run)
    columns = [run.column(name) for name in run.seen]
    return np.array([0.0 if np.isnan(column).all() else _smoothed(column, window)[1] for column in columns])


def _window(problem: Problem, run: SampledRun) -> int:
    return max(5, smoothing_window(run.step_s, problem.ship_time))


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
        north, east = earth_components(*ground, psi)
        source = "from the velocities over the ground"
    u, v = velocities_through_water(model, run.inputs, psi, north, east)
    return {"motion.u": u, "motion.v": v}, source


def _complete_positions(columns: dict[str, Array], missing: set[str], step: float) -> None:
    """Add unmeasured positions from the velocities: wind and banks need only their rough course."""
    if missing & {"motion.x", "motion.y"}:
        rates = earth_components(*(_filled(columns[name]) for name in ("motion.u", "motion.v", "motion.psi")))
        for name in missing & {"motion.x", "motion.y"}:
            columns[name] = cumulative_trapezoid(rates[name == "motion.y"], dx=step, initial=0.0)


def _slope(column: Array, window: int, step: float) -> Array:
    """Time derivative of a smoothed signal (Savitzky and Golay 1964), nan in gaps of more than its own step."""
    from scipy.signal import savgol_filter  # slow to import

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
    from scipy.signal import savgol_coeffs, savgol_filter  # slow to import

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
    gain = float(savgol_coeffs(window, 3)[window // 2])  # the sample's own weight: var(raw - smooth) = (1 - gain) var
    noise = float(np.std(whole - smooth)) / np.sqrt(1 - gain)
    if noise**2 < SMALL_NOISE * float(np.var(whole)):
        return whole, noise, noise
    return smooth, noise, noise * float(np.sqrt(gain))  # sum of squared weights = gain, for a projection


def _filled(column: Array) -> Array:
    return straight_over_gaps(np.arange(len(column), dtype=float), column)


WIDTH = 0.7
"""Width of a window in L/u0 (project choice): short against a manoeuvre, long against noise and smoothing."""

WEAK_EQUATIONS = ("motion.udot", "motion.vdot", "motion.rdot")


@dataclass(frozen=True, eq=False)
class WeakWindows:
    """The weak form of all runs, one after the other, at given parameters."""

    residuals: Array  # (windows, 3): Measured less modelled mean acceleration, m/s2, m/s2, rad/s2
    jacobian: Array  # (windows, 3, k): Derivative of the *modelled* acceleration by the free parameters


@dataclass(frozen=True, eq=False)
class _Prepared:
    """The part of a run's weak form that does not depend on the parameters."""

    run: SampledRun
    motion: MeasuredMotion
    inputs: Array  # of each step, with MEASURED_STATES in its middle
    averaging: sparse.csr_matrix  # (windows, steps)
    change: Array  # mean measured acceleration of each window
    hidden: Array | None  # unmeasured states in the middle of each step, if no free parameter moves them

    @property
    def middle(self) -> Array:
        """MEASURED_STATES in the middle of each step."""
        return self.inputs[:, self.run.inputs.shape[1] :]

    pieces: tuple[slice, ...]  # windows that follow each other without a gap


class WeakForm:
    """Weak-form residuals of a problem's runs.

    `problem`: k free parameters. `width`: Width of a window, in L/u0. Raises InputError: A run lacks velocities and
    signals that determine them.
    """

    def __init__(self, problem: Problem, width: float = WIDTH):
        self.problem = problem
        self._hidden, self._moves_hidden, self.seen, self._accelerations = _functions(problem.model, problem.free)
        states = self._hidden.state_names
        self._sensitivity = Sensitivity(self._hidden, problem.free, states) if states else None
        self.half = width * problem.ship_time / 2
        self.runs = tuple(self._prepared(run) for run in problem.runs)
        self.change = np.concatenate([run.change for run in self.runs])
        ends = np.cumsum([0, *(len(run.change) for run in self.runs)]).tolist()
        self.spans = tuple(slice(begin, end) for begin, end in pairwise(ends))  # windows of each run
        # Windows that follow each other without a gap.
        self.pieces = tuple(
            slice(begin + piece.start, begin + piece.stop)
            for begin, run in zip(ends, self.runs, strict=False)
            for piece in run.pieces
        )

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices of derived signals."""
        return tuple(notice for run in self.runs for notice in run.motion.notices)

    def at(self, values: Array) -> WeakWindows:
        """The windows at the free parameters `values` (k,)."""
        p = self.problem.parameters(values)
        modelled, jacobian = map(np.concatenate, zip(*(self._windows(run, p) for run in self.runs), strict=True))
        return WeakWindows(self.change - modelled, jacobian)

    def _windows(self, run: _Prepared, p: Array) -> tuple[Array, Array]:
        """Modelled accelerations (windows, 3) of a run, and their derivatives (windows, 3, k)."""
        k = len(self.problem.free)
        hidden, by_theta = (run.hidden, None) if run.hidden is not None else self._hidden_states(run.run, run.inputs, p)
        values, by_parameters, by_hidden = self._accelerations(hidden, run.inputs, p)
        jacobian = by_parameters.reshape(-1, k, 3)
        if by_theta is not None:
            jacobian = jacobian + by_theta.transpose(0, 2, 1) @ by_hidden.reshape(len(by_parameters), -1, 3)
        mean = run.averaging @ jacobian.reshape(len(jacobian), -1)
        return run.averaging @ values, mean.reshape(-1, k, 3).transpose(0, 2, 1)

    def _hidden_states(self, run: SampledRun, inputs: Array, p: Array) -> tuple[Array, Array | None]:
        """Simulated unmeasured states in the middle of steps (n, nz), and slopes by the parameters (n, nz, k)."""
        if self._sensitivity is None:
            return np.zeros((len(inputs), 0)), None
        start = np.array(self.problem.model.initial(p)).ravel()
        names = self.problem.model.state_names
        first = start[[names.index(name) for name in self._hidden.state_names]]
        if "rudder.angle" in self._hidden.state_names:
            order = run.inputs[:, self.problem.model.input_names.index("rudder.command")]
            angle = rudder_at_start(run, order, self.problem.ship_time)
            first[self._hidden.state_names.index("rudder.angle")] = angle
        states = self._sensitivity.motion(first, inputs, p, run.step_s)
        middle = 0.5 * (states[:-1] + states[1:])
        if not self._moves_hidden:
            return middle, None
        full = np.vstack([inputs, inputs[-1:]])
        _, by, _ = self._sensitivity.derivatives(states[None], full[None], p, run.step_s)
        by_theta = by[0, :, :, states.shape[1] :]
        return middle, 0.5 * (by_theta[:-1] + by_theta[1:])

    def _prepared(self, run: SampledRun) -> _Prepared:
        motion = measured_motion(self.problem, run)
        steps = np.diff(motion.velocities, axis=0)
        half = max(2, round(self.half / run.step_s))
        starts = np.arange(0, max(len(steps) - 2 * half + 1, 0), half)
        bump = (1 - ((np.arange(2 * half) + 0.5) / half - 1) ** 2) ** 2
        bump /= bump.sum()
        bad = np.concatenate([[0], np.cumsum(np.isnan(steps).any(axis=1))])
        starts = starts[bad[starts + 2 * half] == bad[starts]]
        rows = np.repeat(np.arange(len(starts)), 2 * half)
        columns = (starts[:, None] + np.arange(2 * half)).ravel()
        averaging = sparse.csr_matrix((np.tile(bump, len(starts)), (rows, columns)), (len(starts), len(steps)))
        breaks = np.flatnonzero(np.diff(starts) > half) + 1
        edges = [0, *breaks.tolist(), len(starts)]
        inputs = np.hstack([run.inputs[:-1], 0.5 * (motion.smooth[:-1] + motion.smooth[1:])])
        p = self.problem.parameters(self.problem.prior_mean)
        return _Prepared(
            run=run,
            motion=motion,
            inputs=inputs,
            hidden=None if self._moves_hidden else self._hidden_states(run, inputs, p)[0],
            averaging=averaging,
            change=averaging @ np.nan_to_num(steps) / run.step_s,
            pieces=tuple(slice(a, b) for a, b in pairwise(edges) if b > a),
        )


def _hidden_model(model: Model) -> Model:
    """The model of the unmeasured states, with the measured ones among its inputs."""
    known = []
    for state in (model[name] for name in MEASURED_STATES):
        copy = Input(name=state.name, unit=state.unit, description=state.description, display_unit=state.display_unit)
        known.append(same_symbol(state, copy))
    hidden = tuple(state for state in model.states if state.name not in MEASURED_STATES)
    return replace(model, states=hidden, inputs=(*model.inputs, *known), outputs=())


@lru_cache(maxsize=KEPT_MODELS)
def _functions(model: Model, free: tuple[str, ...]) -> tuple[Model, bool, tuple[bool, ...], RowFunction]:
    """The model of the unmeasured states; whether free parameters move these; which of them show in the accelerations;
    the accelerations with their derivatives by free parameters and unmeasured states."""
    hidden = _hidden_model(model)
    theta = ca.vcat([model.symbol(name) for name in free])
    accelerations = model.expand(ca.vcat([model.symbol(name) for name in WEAK_EQUATIONS]))
    derivatives = [ca.jacobian(accelerations, theta), ca.jacobian(accelerations, hidden.x)]
    moves = bool(len(hidden.states)) and bool(ca.depends_on(hidden.rates, theta))
    seen = tuple(moves or not derivatives[0][:, place].is_zero() for place in range(len(free)))
    values = [ca.densify(value) for value in (accelerations, *derivatives)]
    function = ca.Function("accelerations", [hidden.x, hidden.u, hidden.p], values, {"cse": True})
    return hidden, moves, seen, RowFunction(function)
