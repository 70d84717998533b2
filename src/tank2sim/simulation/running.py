"""A running simulation, the only object with state. Manoeuvres drive it and take its trajectory at the end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.straight_course import steady_motion, straight_course
from tank2sim.simulation.trajectory import Trajectory, bracketed_root

RUNAWAY = "the motion leaves all bounds"
"""The message about a motion that is not finite."""

_CHUNK = 256  # steps between searches for an event: long enough for efficient machine code, short against a manoeuvre


@dataclass(frozen=True)
class SwitchingPlan:
    """Two orders that take turns, each until a state reaches its level."""

    # Inputs by name at the execute, and after the first change.
    orders: tuple[Mapping[str, float], Mapping[str, float]]
    state: str  # The state at a level of which the order changes
    levels: tuple[float, float]  # Levels at which the orders end, beyond `of_start` times the state at the start
    # 1 or -1: whether the state rises or falls to its first level; then it falls or rises to the other, and so on.
    side: float
    changes: int | None  # Changes of order at which a run ends; 0: the first order is held to the end; None: no limit
    longest: float  # Longest run without a given duration, L/u0
    of_start: float = 1.0
    # `wait_s`, `lag_s`: Time from each order to the movement of the rudder, and from reaching a level to the order.
    wait_s: float = 0.0
    lag_s: float = 0.0


class Running:
    """A running simulation.

    Samples are on a grid of whole steps from the start; an event between two of them is an additional sample, after
    which the grid continues.

    `integrator`: Integrator of the model. `inputs`, `parameters`, optional: Values by name that replace the model's
    start values.

    Raises InputError: ``initial.trim`` is set and no steady motion exists near the start.
    """

    def __init__(
        self,
        integrator: Integrator,
        inputs: Mapping[str, float] | None = None,
        parameters: Mapping[str, float] | None = None,
    ):
        self._integrator = integrator
        self.model = integrator.model
        self._p = self.model.parameter_values(parameters)
        self._u = self.model.input_values(inputs)
        self._time = 0.0
        self._steps_done = 0
        self._x: Array = np.array(self.model.initial(self._p)).ravel()
        if "initial.trim" in self.model and self._p[self.model.parameter_names.index("initial.trim")]:
            self._x = steady_motion(self.model, self._x, self._u, self._p)
        self._t_parts: list[Array] = []
        self._x_parts: list[Array] = []
        self._u_parts: list[Array] = []

    @property
    def _tolerance(self) -> float:
        """Times that differ by less count as equal: rounding, far below a step."""
        return 1e-9 * self.model.step_s

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._time

    def state(self, name: str) -> float:
        """Present value of a state."""
        return float(self._x[self.model.state_names.index(name)])

    def neutral_rudder(self) -> float:
        """Rudder angle (rad) of a straight course at the present speed; 0 without one below 45 deg."""
        speed = self.state("motion.u")
        try:
            course = straight_course(self.model, speed, inputs=self._u, parameters=self._p)
        except InputError:
            return 0.0
        return float(course.u[self.model.input_names.index("rudder.command")])

    def order(self, inputs: Mapping[str, float]) -> None:
        """Set inputs, by name, from now on.

        Raises InputError: A value is beyond the bounds of its input.
        """
        self.model.check_inputs(inputs)
        self._u = self._u.copy()
        for name, value in inputs.items():
            self._u[self.model.input_names.index(name)] = value

    def run(self, duration: float) -> None:
        """Advance by `duration` s with the inputs held."""
        self._advance_to(self._time + duration)

    def run_until(self, state: str, level: float, *, rising: bool, at_most: float) -> bool:
        """Advance until a state crosses a level in the given direction, to the exact time of the crossing.

        Returns False, after `at_most` s, if it does not. A state already beyond the level counts as crossed.
        """
        place, sign = self.model.state_names.index(state), 1.0 if rising else -1.0

        def beyond(x: Array) -> Array:
            return np.asarray(sign * (x[..., place] - level))

        return bool(beyond(self._x) >= 0) or self._advance_to(self._time + at_most, beyond)

    def follow(self, plan: SwitchingPlan, duration: float) -> None:
        """Follow a plan to its end, for at most `duration` s."""
        begin, end, side = plan.of_start * self.state(plan.state), self._time + duration, plan.side
        self.run(min(plan.wait_s, duration))
        for number, (orders, level) in enumerate(cycle(zip(plan.orders, plan.levels, strict=True))):
            if (number == plan.changes and number) or self._time >= end:
                return
            self.order(orders)
            if plan.changes == 0:
                self.run(end - self._time)
                return
            at_most = end - self._time
            if not self.run_until(plan.state, begin + level, rising=side > 0, at_most=at_most):
                return
            self.run(max(0.0, min(plan.lag_s + plan.wait_s, end - self._time)))
            side = -side

    def trajectory(self) -> Trajectory:
        """The trajectory up to the present time.

        Raises InputError: The motion left all bounds.
        """
        t = np.append(np.concatenate([*self._t_parts, []]), self._time)
        x = np.concatenate([*self._x_parts, self._x[None, :]])
        u = np.concatenate([*self._u_parts, self._u[None, :]])
        result = Trajectory(self.model, t, x, u, self._integrator.outputs(x, u, self._p))
        if not result.is_finite():
            bad = ~(np.isfinite(x).all(axis=1) & np.isfinite(result.y).all(axis=1))
            when = f"t = {t[int(np.argmax(bad))]:.1f} s"
            remedy = "check the card's derivatives, or order less rudder: the model is not valid there"
            raise self.model.fault(when, RUNAWAY, remedy)
        return result

    def _advance_to(self, end: float, beyond: Callable[[Array], Array] | None = None) -> bool:
        """Advance to a time, or until what is `beyond` a level (of states (..., nx)) is zero; True in that case."""
        while end - self._time > self._tolerance:
            h = self.model.step_s
            to_grid = (self._steps_done + 1) * h - self._time
            length, count, passed = end - self._time, 1, 0
            if self._time > self._steps_done * h + self._tolerance:
                if to_grid <= length + self._tolerance:
                    length, passed = to_grid, 1
            elif whole := int(np.floor(length / h + 1e-9)):
                count = whole if beyond is None else min(whole, _CHUNK)
                length, passed = h, count
            times: Array = np.asarray((self._steps_done + np.arange(count + 1)) * h, dtype=float)
            times[0] = self._time
            if length is not h:
                times[1] = self._time + length
            if length > 0.0 and self._take(times, length, beyond):
                return True
            self._steps_done += passed
        return False

    def _take(self, times: Array, length: float, beyond: Callable[[Array], Array] | None) -> bool:
        """Take steps of a length to `times` (n + 1,), or the steps before an event and one to it."""
        states = self._integrator.rollout(self._x, self._u, self._p, length, len(times) - 1)
        over = [] if beyond is None else np.flatnonzero(beyond(states[1:]) >= 0).tolist()
        last = over[0] if over else len(times) - 2
        self._t_parts.append(times[: last + 1])
        self._x_parts.append(states[: last + 1])
        self._u_parts.append(np.repeat(self._u[None, :], last + 1, axis=0))
        self._time, self._x = float(times[last + 1]), states[last + 1]
        if not over or beyond is None:
            return False
        before = states[last]

        def after(h: float) -> float:
            return float(beyond(self._integrator.step(before, self._u, self._p, h)))

        h = bracketed_root(after, 0.0, float(times[last + 1] - times[last]))
        self._time, self._x = float(times[last]) + h, self._integrator.step(before, self._u, self._p, h)
        self._steps_done += last
        return True


class SwitchedManoeuvre:
    """A manoeuvre by a :class:`SwitchingPlan`."""

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """The plan for a model, with or without a given duration."""
        raise NotImplementedError

    def drive(self, running: Running, ship_time: float, duration: float | None) -> None:
        """Run for `duration` s, or to the end of the plan."""
        plan = self.plan(running.model, duration)
        running.follow(plan, plan.longest * ship_time if duration is None else duration)
