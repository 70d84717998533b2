"""Course changes and course keeping of a ship under autopilot, on the nonlinear model, and their figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.heading.designs import INTEGRAL_BAND_RAD
from tank2sim.arrays import Array
from tank2sim.dynamics.autopilot_loop import closed_loop_model
from tank2sim.dynamics.effects import acting_variable
from tank2sim.dynamics.model import Model
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.trajectory import Trajectory

_SETTLED = 0.02
"""Share of a course change within which it counts as settled, as in textbooks."""


class HeadingLoop:
    """A ship and its autopilot as one model, ready to run. `autopilot`: input ``heading.command`` stays free."""

    def __init__(self, ship: Model, autopilot: Model):
        self.model = closed_loop_model(ship, autopilot)
        self._integrator = Integrator(self.model)

    def start(self, parameters: Mapping[str, float] | None = None) -> Array:
        """State (nx,) at the beginning."""
        return np.asarray(self.model.initial(self.model.parameter_values(parameters)), dtype=float).ravel()

    def advance(
        self, state: Array, inputs: Mapping[str, float | Array], steps: int, parameters: Mapping[str, float] | None
    ) -> tuple[Array, Array]:
        """States (steps + 1, nx) and inputs (steps, nu); an input is constant, or an array (steps,)."""
        u = np.tile(self.model.input_values(), (steps, 1))
        for name, values in inputs.items():
            u[:, self.model.input_names.index(name)] = values
        p = self.model.parameter_values(parameters)
        return self._integrator.rollout(state, u, p, self.model.step_s, steps), u

    def run(
        self,
        inputs: Mapping[str, float | Array],
        duration_s: float,
        *,
        parameters: Mapping[str, float] | None = None,
        begin: Array | None = None,
    ) -> Trajectory:
        """Simulate from the model's start, or from the state `begin` (nx,), classical Runge-Kutta at the model's step.

        Raises InputError: the motion leaves all bounds.
        """
        steps = round(duration_s / self.model.step_s)
        x, u = self.advance(self.start(parameters) if begin is None else begin, inputs, steps, parameters)
        return self.trajectory(x, u, parameters)

    def kept_course(
        self, inputs: Mapping[str, float | Array], duration_s: float, parameters: Mapping[str, float] | None = None
    ) -> Array:
        """State (nx,) of a ship that has kept course 0 for a time, at the speed and position of the model's start.

        The controller has then found the rudder that an asymmetric ship needs, so that it is not part of a later run.
        """
        start = self.start(parameters)
        x, _ = self.advance(
            start, {**inputs, "heading.command": 0.0}, round(duration_s / self.model.step_s), parameters
        )
        again = [self.model.state_names.index(f"motion.{name}") for name in ("u", "x", "y")]
        state: Array = x[-1].copy()
        state[again] = start[again]
        return state

    def trajectory(self, x: Array, u: Array, parameters: Mapping[str, float] | None = None) -> Trajectory:
        """States (n + 1, nx) and inputs (n, nu) with their times and outputs. Raises as :meth:`run`."""
        u = np.vstack([u, u[-1]])
        y = self._integrator.outputs(x, u, self.model.parameter_values(parameters))
        time = np.asarray(self.model.step_s * np.arange(len(x)), dtype=np.float64)
        made = Trajectory(self.model, time, x, u, y)
        if not made.is_finite():
            remedy = "choose another design, or a smaller course change"
            raise self.model.fault("", "the motion leaves all bounds", remedy)
        return made


@dataclass(frozen=True, kw_only=True)
class CourseChange:
    """Figures of a change of course.

    `rise_time_s`: from 10 to 90 % of the change; None if not reached; `settling_time_s`: time after which it stays
    within :data:`_SETTLED` of the change; None if it does not; `rate_limited_s`: time of rudder motion at the largest
    rate; None if the card states none.
    """

    ordered_deg: float
    rise_time_s: float | None
    overshoot_deg: float
    settling_time_s: float | None
    largest_rudder_deg: float
    rate_limited_s: float | None


@dataclass(frozen=True, kw_only=True)
class CourseKeeping:
    """Figures of keeping a course, over `duration_s`.

    `heading_error_deg2s`, `rudder_deg2s`: integrals of the square of the heading error and of the rudder angle about
    its mean; `heading_error_rms_deg`, `heading_error_mean_deg`, `rudder_rms_deg`: the same as root mean squares (the
    rudder about its mean), and the remaining mean error; `rudder_travel_degps`: mean absolute rudder rate: the wear of
    the gear; `rate_limited_percent`: share of the time of rudder motion at the largest rate; None
    if the card states none.
    """

    duration_s: float
    heading_error_deg2s: float
    rudder_deg2s: float
    heading_error_rms_deg: float
    heading_error_mean_deg: float
    rudder_rms_deg: float
    rudder_travel_degps: float
    rate_limited_percent: float | None


@dataclass(frozen=True, kw_only=True)
class CraftKeeping:
    """Figures of keeping a course and a speed through the water, over `duration_s`.

    `heading_error_rms_deg`, `heading_error_mean_deg`, `speed_error_rms_mps`: root mean squares, and the mean error of
    heading that remains.
    """

    duration_s: float
    heading_error_rms_deg: float
    heading_error_mean_deg: float
    speed_error_rms_mps: float


def without_anti_windup(autopilot: Model) -> dict[str, float]:
    """Parameters without anti-windup: the integral continues at the limit and over a course change; none for a PD."""
    starts = autopilot.defaults
    if "autopilot.anti_windup_time" not in starts:
        return {}
    changed = {"autopilot.anti_windup_time": 1e6, "autopilot.integral_band": math.pi}
    if "autopilot.integral_limit" in starts:
        changed["autopilot.integral_limit"] = starts["autopilot.integral_limit"] * math.pi / INTEGRAL_BAND_RAD
    return {name: value for name, value in changed.items() if name in starts}


def course_change(run: Trajectory, ordered_rad: float) -> CourseChange:
    """Figures of a run in which ``heading.command`` steps from the heading at the start by `ordered_rad` at t = 0."""
    heading, at_limit = step_figures(run.t, run["motion.psi"], ordered_rad), _rate_limited(run)
    return CourseChange(
        ordered_deg=math.degrees(ordered_rad),
        rise_time_s=heading.rise_time_s,
        overshoot_deg=math.degrees(heading.overshoot),
        settling_time_s=heading.settling_time_s,
        largest_rudder_deg=float(np.degrees(np.abs(run["rudder.angle"]).max())),
        rate_limited_s=None if at_limit is None else float(at_limit.sum() * run.model.step_s),
    )


@dataclass(frozen=True, kw_only=True)
class StepFigures:
    """Figures of the response to an order that steps.

    `ordered`: size of the step, in the unit of the signal; `rise_time_s`: from 10 to 90 % of the step; None if not
    reached; `overshoot`: beyond the step, not negative, in the unit of the signal; `settling_time_s`: time after which
    it stays within :data:`_SETTLED` of the step; None if it does not.
    """

    ordered: float
    rise_time_s: float | None
    overshoot: float
    settling_time_s: float | None


def step_figures(time: Array, values: Array, ordered: float) -> StepFigures:
    """Figures of a signal (n,) whose order steps by `ordered` from its first value at the first instant."""
    share = (values - values[0]) / ordered
    outside = np.flatnonzero(np.abs(share - 1) > _SETTLED)
    settled = len(outside) and outside[-1] + 1 < len(share)
    first, last = (_reached(time, share, level) for level in (0.1, 0.9))
    return StepFigures(
        ordered=ordered,
        rise_time_s=None if first is None or last is None else last - first,
        overshoot=abs(ordered) * max(0.0, float(share.max()) - 1),
        settling_time_s=float(time[outside[-1] + 1]) if settled else None,
    )


def course_keeping(run: Trajectory, course_rad: float, from_s: float) -> CourseKeeping:
    """Figures of a run on a constant course after `from_s`, when transients of the start have decayed."""
    part = run.t >= from_s
    error = np.degrees(run["motion.psi"][part] - course_rad)
    rudder = np.degrees(run["rudder.angle"][part])
    rudder = rudder - rudder.mean()
    duration = float(run.t[-1] - run.t[part][0])
    moved, at_limit = np.abs(np.diff(rudder)).sum(), _rate_limited(run)
    return CourseKeeping(
        duration_s=duration,
        heading_error_deg2s=float(np.mean(error**2) * duration),
        rudder_deg2s=float(np.mean(rudder**2) * duration),
        heading_error_rms_deg=_rms(error),
        heading_error_mean_deg=float(error.mean()),
        rudder_rms_deg=_rms(rudder),
        rudder_travel_degps=float(moved / duration),
        rate_limited_percent=None if at_limit is None else float(100 * at_limit[part[1:]].mean()),
    )


def craft_keeping(run: Trajectory, speed_mps: float) -> CraftKeeping:
    """Figures of the later half of a run on course 0 at an ordered speed."""
    later = slice(len(run.t) // 2, None)
    error = np.degrees(run["motion.psi"][later])
    return CraftKeeping(
        duration_s=float(run.t[-1] - run.t[later][0]),
        heading_error_rms_deg=_rms(error),
        heading_error_mean_deg=float(error.mean()),
        speed_error_rms_mps=_rms(run["motion.u"][later] - speed_mps),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _reached(time: Array, values: Array, level: float) -> float | None:
    """Time at which a signal first reaches a level, linear between samples."""
    over = np.flatnonzero(values >= level)
    if not over.size or over[0] == 0:
        return None
    k = int(over[0])
    share = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))


def largest_rudder_rate(ship: Model) -> float | None:
    """Largest rate of the steering gear, rad/s; None if the card states none."""
    largest = ship.defaults.get(acting_variable(ship, "steering.max_rate"), math.inf)
    return largest if math.isfinite(largest) else None


def _rate_limited(run: Trajectory) -> Array | None:
    """True for each step (n - 1,) in which the rudder moved at its largest rate; None if none is stated."""
    largest = largest_rudder_rate(run.model)
    if largest is None:
        return None
    moved = np.abs(np.diff(run["rudder.angle"])) / run.model.step_s
    return np.asarray(moved > 0.999 * largest)
