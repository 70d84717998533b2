"""Equations of motion multiplied by test functions and integrated, without numerical accelerations.

For window w and equation i, with bump functions phi_w = (1 - s^2)^2 that half overlap,

    e_wi = -integral(phi_w' q_i) dt - integral(phi_w a_i(q, inputs; theta)) dt,  q = (u, v, r), a = dq/dt of the model,

over integral(phi_w) dt: a mean acceleration. Summation by parts makes the first term a sum of phi_w times the
differences of q (Messenger and Bortz 2021, Multiscale Model. Simul. 19; the modulating functions of Shinbrot 1957).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy import sparse

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Input, Model, same_symbol
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.measured_motion import MEASURED_STATES, MeasuredMotion, measured_motion
from tank2sim.identification.trials.problem.sampled_runs import SampledRun, rudder_at_start
from tank2sim.notices import Notice
from tank2sim.simulation.rows import RowFunction
from tank2sim.simulation.sensitivity import Sensitivity

WIDTH = 0.7
"""Width of a window in L/u0 (project choice): short against a manoeuvre, long against noise and smoothing."""

WEAK_EQUATIONS = ("motion.udot", "motion.vdot", "motion.rdot")


@dataclass(frozen=True, eq=False)
class WeakWindows:
    """The weak form of one run at given parameters."""

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

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices of derived signals."""
        return tuple(notice for run in self.runs for notice in run.motion.notices)

    def at(self, values: Array) -> list[WeakWindows]:
        """The windows of each run at the free parameters `values` (k,)."""
        p = self.problem.parameters(values)
        return [self._windows(run, p) for run in self.runs]

    def _windows(self, run: _Prepared, p: Array) -> WeakWindows:
        k = len(self.problem.free)
        hidden, by_theta = (run.hidden, None) if run.hidden is not None else self._hidden_states(run.run, run.inputs, p)
        values, by_parameters, by_hidden = self._accelerations(hidden, run.inputs, p)
        jacobian = by_parameters.reshape(-1, k, 3)
        if by_theta is not None:
            jacobian = jacobian + by_theta.transpose(0, 2, 1) @ by_hidden.reshape(len(by_parameters), -1, 3)
        mean = run.averaging @ jacobian.reshape(len(jacobian), -1)
        return WeakWindows(
            residuals=run.change - run.averaging @ values,
            jacobian=mean.reshape(-1, k, 3).transpose(0, 2, 1),
        )

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
