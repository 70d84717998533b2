"""Figures of simulated manoeuvres with their exact slopes by the parameters, through events.

Between events the slopes S = dx/dp of the states are integrated by the derivative of each Runge-Kutta step
(:class:`tank2sim.simulation.sensitivity.Sensitivity`). An event at which a state c crosses a level moves in time by

    dt/dp = -S_c / f_c,

so that a state at the event changes by S + f dt/dp; and where a rudder order is given at an event, the motion after it
begins with S + (f_before - f_after) dt/dp (Rozenwasser and Yusupov 2000, Sensitivity of Automatic Control Systems). At
kinks of the right-hand side (a rate limit is reached) f and S are continuous; steps end there, because a step across a
kink would mix the slopes of both sides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tank2sim.analysis.influence.figures import FigureManoeuvre
from tank2sim.arrays import Array
from tank2sim.dynamics.event_indicators import kinks
from tank2sim.dynamics.model import Model
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.rows import RowFunction
from tank2sim.simulation.sensitivity import Sensitivity
from tank2sim.simulation.thruster_manoeuvres import Spin, StraightRun
from tank2sim.simulation.trajectory import Trajectory

Sloped = tuple[float, Array]
"""A value and its slopes (k,) by the parameters."""

KINK_MARGIN = 1e-4
"""Steps end this share of a step before a kink and begin the same distance behind it, so that no stage of a step is at
the kink, where rounding would determine the side of its slopes."""

HALF_TURN = ("tactical", "time_180")
"""Beginnings of names of figures of a turn at 180 deg; all other figures are at 90 deg."""

_CHUNK = 1000  # steps whose tangents are held at a time


def overshoots_in(names: Collection[str]) -> int:
    """Number of the last named overshoot (``overshoot_2_deg``); 0 without any."""
    return max((int(name.split("_")[1]) for name in names if name.startswith("overshoot_")), default=0)


@dataclass(frozen=True)
class Event:
    """Event of a state that crosses a level: time (s) and states (nx,), and their slopes (k,) and (nx, k)."""

    time: float
    x: Array
    time_by: Array
    x_by: Array


class MotionSlopes:
    """Slopes of the figures of turning circles, zigzags and manoeuvres by thrusters.

    `integrator`: integrator of the model of the simulations; `free`: names of the k parameters.
    """

    def __init__(self, integrator: Integrator, free: Sequence[str]):
        self.model: Model = integrator.model
        self._integrator = integrator
        self._sensitivity = Sensitivity(self.model, free, [])
        arguments = [self.model.x, self.model.u, self.model.p]
        theta = ca.vcat([self.model.symbol(name) for name in free])
        start = ca.jacobian(ca.vcat([ca.SX(state.start) for state in self.model.states]), theta)
        self._start = ca.Function("start_by", [self.model.p], [ca.densify(start)])
        found = [quantity.value for quantity in kinks(self.model)]
        # A comparison of parameters alone cannot change sign on the way.
        self._kinks = RowFunction(ca.Function("indicators", arguments, [ca.densify(ca.vcat(found))])) if found else None

    def figures(
        self, run: Trajectory, manoeuvre: FigureManoeuvre, p: Array, length: float, names: Collection[str]
    ) -> dict[str, Sloped]:
        """Figures by their names in :mod:`tank2sim.analysis.influence.figures`, as far as the run shows them.

        The run is not evaluated after the last event of the figures in `names`.
        """
        if isinstance(manoeuvre, StraightRun):
            end, place = len(run.t) - 1, self.model.state_names.index("motion.u")
            slopes = self._forward(_Course(run.t, run.x, run.u), {end: None}, p)[end]
            return {"final_speed_mps": (float(run.x[end][place]), slopes[place])}
        axes = _Axes(run.x[0], self.model, manoeuvre.plan(self.model).side, length)
        if isinstance(manoeuvre, Zigzag):
            return self._zigzag(run, manoeuvre, axes, p, overshoots_in(names))
        changes = {"time_90_s": math.pi / 2, "time_180_s": math.pi}
        if isinstance(manoeuvre, Spin):
            changes = {"time_180_s": math.pi, "time_360_s": 2 * math.pi}
        elif isinstance(manoeuvre, Turn) and not any(name.startswith(HALF_TURN) for name in names):
            del changes["time_180_s"]
        at_end = [name for name in names if name.startswith(("steady", "final"))]
        found = self._turned(run, axes, p, changes) if len(at_end) < len(names) else {}
        return found | self._last(run, p) if at_end else found

    def _turned(self, run: Trajectory, axes: _Axes, p: Array, changes: Mapping[str, float]) -> dict[str, Sloped]:
        """Figures at changes of heading, rad, by the names of their times."""
        crossings = [
            run.crossings("motion.psi", "motion.r", axes.heading + axes.side * change) for change in changes.values()
        ]
        events = self.events(run, [("motion.psi", float(times[0])) for times in crossings if len(times)], p)
        shown = dict(zip(changes, events, strict=False))
        found = {name: (event.time, event.time_by) for name, event in shown.items()}
        if quarter := shown.get("time_90_s"):
            found |= {"advance_m": axes.ahead(quarter), "transfer_m": axes.aside(quarter)}
            found["advance_lengths"] = axes.over_length(found["advance_m"])
            if half := shown.get("time_180_s"):
                found["tactical_diameter_m"] = axes.aside(half)
                found["tactical_diameter_lengths"] = axes.over_length(found["tactical_diameter_m"])
        return found

    def _last(self, run: Trajectory, p: Array) -> dict[str, Sloped]:
        """Figures at the end of a turn by thrusters."""
        places = [self.model.state_names.index(f"motion.{letter}") for letter in "uvr"]
        (last,) = self.events(run, [("motion.psi", float(run.t[-1]))], p)
        (u, v, r), (u_by, v_by, r_by) = last.x[places], last.x_by[places]
        speed = math.hypot(u, v)
        speed_by = (u * u_by + v * v_by) / speed
        rate = math.degrees(r), np.degrees(r_by)
        diameter = 2 * speed / abs(r)
        return {
            "steady_diameter_m": (diameter, diameter * (speed_by / speed - r_by / r)),
            "steady_rate_degps": rate,
            "steady_speed_mps": (speed, speed_by),
            "final_rate_degps": rate,
        }

    def _zigzag(self, run: Trajectory, zigzag: Zigzag, axes: _Axes, p: Array, overshoots: int) -> dict[str, Sloped]:
        executes = run.t[_orders(run)]
        turns = run.crossings("motion.r", "motion.rdot", 0.0)
        peaks = [float(later[0]) for time in executes[:overshoots] if len(later := turns[turns > time])]
        crossings = [*(("motion.psi", float(time)) for time in executes[:1]), *(("motion.r", time) for time in peaks)]
        events = self.events(run, crossings, p)
        if not events:
            return {}
        first = events[0]
        distance = axes.distance(first)
        found: dict[str, Sloped] = {
            "initial_turning_distance_m": distance,
            "initial_turning_lengths": axes.over_length(distance),
            "initial_turning_time_s": (first.time, first.time_by),
        }
        psi = self.model.state_names.index("motion.psi")
        for number, event in enumerate(events[1:]):
            to_side = axes.side * (-1) ** number
            beyond = to_side * (float(event.x[psi]) - axes.heading) - zigzag.heading
            found[f"overshoot_{number + 1}_deg"] = (math.degrees(beyond), to_side * np.degrees(event.x_by[psi]))
        return found

    def events(self, run: Trajectory, places: Sequence[tuple[str, float]], p: Array) -> list[Event]:
        """Events of a run, each given by the crossing state and its time."""
        if not places:
            return []
        last = max(time for _, time in places)
        rows = int(np.searchsorted(run.t, last)) + 2
        course = _Course(run.t[:rows], run.x[:rows], run.u[:rows])
        times = [time for _, time in places]
        margin = KINK_MARGIN * self.model.step_s
        sides = [time + step for time in self._kink_times(course, p) for step in (-margin, margin)]
        course = self._with_samples(course, [*times, *(time for time in sides if 0 < time < last)], p)
        wanted = {int(np.argmin(np.abs(course.t - time))): None for time in times}
        slopes = self._forward(course, wanted, p)
        found = []
        for name, time in places:
            row = int(np.argmin(np.abs(course.t - time)))
            before = course.u[max(row - 1, 0)]
            rate = self._rate(course.x[row], before, p)
            place = self.model.state_names.index(name)
            time_by = -slopes[row][place] / rate[place]
            found.append(Event(time, course.x[row], time_by, slopes[row] + np.outer(rate, time_by)))
        return found

    def _forward(self, course: _Course, wanted: dict[int, None], p: Array) -> dict[int, Array]:
        """S (nx, k) at the given rows, before the orders there."""
        nx = self.model.x.numel()
        psi = self.model.state_names.index("motion.psi")
        S = np.array(self._start(p))
        orders = set(_orders(course).tolist())
        last = max(wanted)
        found: dict[int, Array] = {0: S} if 0 in wanted else {}
        for begin in range(0, last, _CHUNK):
            rows = slice(begin, min(begin + _CHUNK, last))
            h = np.diff(course.t)[rows]
            tangents = self._sensitivity.tangents(course.x[rows], course.u[rows], p, h)
            A, B = tangents[..., :nx], tangents[..., nx:]
            for place in range(len(h)):
                row = begin + place
                if row in orders:
                    before, after = (self._rate(course.x[row], course.u[at], p) for at in (row - 1, row))
                    S = S + np.outer(before - after, -S[psi] / before[psi])
                S = A[place] @ S + B[place]
                if row + 1 in wanted:
                    found[row + 1] = S
        return found

    def _rate(self, x: Array, u: Array, p: Array) -> Array:
        return np.array(self.model.rhs(x, u, p)).ravel()

    def _with_samples(self, course: _Course, times: Sequence[float], p: Array) -> _Course:
        """The course with samples at further times, each one step from the previous sample."""
        near = 1e-7 * self.model.step_s
        new = [time for time in sorted(set(times)) if np.min(np.abs(course.t - time)) > near]
        before = np.searchsorted(course.t, new) - 1
        states = [
            self._integrator.step(course.x[row], course.u[row], p, time - course.t[row])
            for row, time in zip(before, new, strict=True)
        ]
        if not new:
            return course
        return _Course(
            np.insert(course.t, before + 1, new),
            np.insert(course.x, before + 1, states, axis=0),
            np.insert(course.u, before + 1, course.u[before], axis=0),
        )

    def _kink_times(self, course: _Course, p: Array) -> list[float]:
        """Times at which the right-hand side has a kink, within steps."""
        if self._kinks is None:
            return []
        (before,) = self._kinks(course.x[:-1], course.u[:-1], p)
        (right,) = self._kinks(course.x[1:], course.u[:-1], p)
        found = []
        for row, column in np.argwhere((before < 0) != (right < 0)):
            gap = float(course.t[row + 1] - course.t[row])
            indicator = self._indicator(course, int(row), int(column), p)
            if (indicator(0.0) < 0) != (indicator(gap) < 0):  # not where rounding alone has changed the sign
                found.append(float(course.t[row]) + brentq(indicator, 0.0, gap, xtol=1e-9 * gap))
        return found

    def _indicator(self, course: _Course, row: int, column: int, p: Array) -> Callable[[float], float]:
        assert self._kinks is not None
        function, x, u = self._kinks.function, course.x[row], course.u[row]

        def value(h: float) -> float:
            after = x if h == 0 else self._integrator.step(x, u, p, h)
            return float(function(after, u, p)[column])

        return value


@dataclass(frozen=True)
class _Course:
    """Times (n,), states (n, nx) and inputs (n, nu) of a motion; an input holds from its time until the next."""

    t: Array
    x: Array
    u: Array


def _orders(course: Trajectory | _Course) -> NDArray[np.int64]:
    """Rows at which new inputs are given, except for the first."""
    return np.flatnonzero(np.any(np.diff(course.u, axis=0) != 0, axis=1)) + 1


class _Axes:
    """Axes at the execute, mirrored so that the first turn goes to starboard, and distances in them with slopes."""

    def __init__(self, start: Array, model: Model, side: float, length: float):
        names = model.state_names
        self._places = [names.index("motion.x"), names.index("motion.y")]
        self._origin = start[self._places]
        self.heading = float(start[names.index("motion.psi")])
        self.side, self._length = side, length
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        self._ahead = np.array([cos, sin])
        self._aside = side * np.array([-sin, cos])

    def ahead(self, event: Event) -> Sloped:
        return self._along(event, self._ahead)

    def aside(self, event: Event) -> Sloped:
        return self._along(event, self._aside)

    def distance(self, event: Event) -> Sloped:
        way = event.x[self._places] - self._origin
        return self._along(event, way / np.linalg.norm(way))

    def over_length(self, sloped: Sloped) -> Sloped:
        return sloped[0] / self._length, sloped[1] / self._length

    def _along(self, event: Event, direction: Array) -> Sloped:
        way = event.x[self._places] - self._origin
        return float(direction @ way), direction @ event.x_by[self._places]
