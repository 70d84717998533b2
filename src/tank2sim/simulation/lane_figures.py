"""Figures of turns, zigzags, stops and spirals of many ships, from what their runs in lanes keep.

They are those of :mod:`tank2sim.simulation.figures` for a trajectory with a sample at each step, to rounding: the same
Hermite cubics at crossings, the same cubics through four samples, for all ships at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeGuard

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.native.lanes import NoLanesError
from tank2sim.simulation.card_range import entry_name, read_with, single_figures
from tank2sim.simulation.figures import REST_SPEED, STEADY_SHARE
from tank2sim.simulation.lane_runs import CROSSINGS, FINE, UNKNOWN, LanePlan, LaneResults, LaneRunner
from tank2sim.simulation.lane_spirals import LaneSpirals, spiral_figures
from tank2sim.simulation.manoeuvres import (
    LONGEST_LENGTHS,
    LONGEST_STOP,
    TURN_HEADING,
    ZIGZAG_EXECUTES,
    Manoeuvre,
    SpiralManoeuvre,
    Stop,
    Turn,
    Zigzag,
)
from tank2sim.simulation.rows import ArrayFunction, RowFunction
from tank2sim.simulation.run import simulate

_TRIES, _ROUNDED = 60, 1e-14
"""Most tries in the search of a crossing, by Newton's method or by halving where that leaves the step; and the change,
in steps, below which it ends, less than the rounding of times (project choices)."""

NEAR_STEADY = 0.9
"""Share of :data:`tank2sim.simulation.figures.STEADY_SHARE` above which a turn is near the limit of a steady one: with
steps three times as long, the sample two lengths before the end is at most two of some 400 steps later, and the change
from it half a percent smaller (project choice)."""

_BEGINS = "motion.x", "motion.y", "motion.psi"


@dataclass(frozen=True)
class Pace:
    """How ships are integrated: length of a step over the model's, and whether in single precision."""

    step_factor: int = 1
    single: bool = False


USUAL_PACE = Pace()
"""The model's step in double precision."""


@dataclass(frozen=True, eq=False)
class LaneFigures:
    """Figures of n ships in a manoeuvre.

    Parameters
    ----------
    figures : mapping
        Name with unit to the figure of each ship (n,), nan where its run does not show it; entries of lists by their
        own names (``overshoot_1_deg``).
    states : array (n, times, nx)
        States at the requested times; nan after the end.
    fine : array (n,)
        False for a ship whose motion left all bounds.
    left_s : array (n,)
        Time at which a ship first left the range of its card, s; inf if it did not, nan if it is not `fine`.
    doubtful : array (n,)
        True for a ship whose figures another :class:`Pace` may turn into none, or none into a figure: one is none,
        the turn is near the limit of a steady one (:data:`NEAR_STEADY`), or the ship left the range of its card.
    """

    figures: Mapping[str, Array]
    states: Array
    fine: NDArray[np.bool_]
    left_s: Array
    doubtful: NDArray[np.bool_]

    def outside(self, name: str) -> NDArray[np.bool_]:
        """True (n,) for ships that had left the card's range before this figure was known, as
        :meth:`tank2sim.simulation.card_range.CardRangeReading.outside`."""
        times = [self.figures[time] for time in read_with(name) if time in self.figures]
        known = np.sum(times, axis=0) if times else np.full(len(self.left_s), np.nan)
        return np.isfinite(self.left_s) & (np.where(np.isnan(known), np.inf, known) >= self.left_s)

    def replaced(self, numbers: NDArray[np.intp], others: LaneFigures) -> LaneFigures:
        """These figures with those of m ships, by their `numbers` (m,), from `others`; `doubtful` is not changed."""
        figures = {name: values.copy() for name, values in self.figures.items()}
        for name in figures | dict(others.figures):
            values = figures.setdefault(name, np.full(len(self.fine), np.nan))
            values[numbers] = others.figures.get(name, np.nan)
        states, fine, left = self.states.copy(), self.fine.copy(), self.left_s.copy()
        states[numbers], fine[numbers], left[numbers] = others.states, others.fine, others.left_s
        return LaneFigures(figures, states, fine, left, self.doubtful)


LaneManoeuvre = Turn | Zigzag | Stop | SpiralManoeuvre
"""Manoeuvres that lanes have."""

_Switched = Turn | Zigzag | Stop


def runs_in_lanes(manoeuvre: Manoeuvre, duration_s: float | None = None) -> TypeGuard[LaneManoeuvre]:
    """Whether lanes have this manoeuvre: a turn or a zigzag without delays of helm and gear, a stop to its end, or a
    direct spiral."""
    if isinstance(manoeuvre, SpiralManoeuvre):
        return True
    if isinstance(manoeuvre, Stop):
        return duration_s is None
    if isinstance(manoeuvre, Turn):
        return manoeuvre.wait_s == 0
    if not isinstance(manoeuvre, Zigzag):
        return False
    plain = manoeuvre.course is None and manoeuvre.opposite_heading is None
    return plain and manoeuvre.lag_s == manoeuvre.wait_s == 0 and manoeuvre.heading > 0


class LaneManoeuvres:
    """Runs turns, zigzags, stops and spirals of a model in lanes.

    Parameters
    ----------
    model : Model
        A ship that begins where its parameters say, without a trim.
    lanes : int, optional
        As for :class:`tank2sim.simulation.lane_runs.LaneRunner`.
    longest : float
        Longest turn or zigzag without a given duration, L/u0.

    Raises
    ------
    NoLanesError
        The model cannot be run in lanes.
    """

    def __init__(self, model: Model, lanes: int | None = None, longest: float = LONGEST_LENGTHS):
        self.model, self._longest = model, longest
        if "initial.trim" in model and model.parameter_values()[model.parameter_names.index("initial.trim")]:
            raise NoLanesError("a ship that is trimmed first is not run in lanes")
        if not {*_BEGINS, "motion.u", "motion.v", "motion.r"} <= set(model.state_names):
            raise NoLanesError("the model is not that of a ship")
        if "motion.phi" in model.state_names:
            raise NoLanesError("the heel of a ship that rolls is not a figure of lanes")
        self._lanes, self._runner, self._start = lanes, LaneRunner(model, lanes), ArrayFunction(model.initial)
        arguments = [model.x, model.u, model.p]
        self._read = {
            name: RowFunction(ca.Function("read", arguments, [model.expand(model.symbol(name))], {"cse": True}))
            for name in ("motion.beta", "motion.rdot")
        }

    @cached_property
    def _single(self) -> LaneRunner:
        return LaneRunner(self.model, self._lanes, single=True)

    def run(
        self,
        manoeuvre: LaneManoeuvre,
        p: Array,
        duration_s: float | None = None,
        times: Sequence[float] | Array = (),
        inputs: Mapping[str, float] | None = None,
        pace: Pace = USUAL_PACE,
    ) -> LaneFigures:
        """Figures of ships with parameters `p` (n, np), and their states at `times`.

        Parameters
        ----------
        manoeuvre : Turn, Zigzag, Stop or SpiralManoeuvre
            One of those for which :func:`runs_in_lanes` is true.
        p : array (n, np)
            Parameters of the model.
        duration_s : float, optional
            As for :func:`tank2sim.simulation.run.simulate`.
        times : array (m,)
            Times at which states are kept, s.
        inputs : mapping, optional
            Values in place of the model's, by name.
        pace : Pace
            Step and precision. Ships that are `doubtful` are run again with the model's step in double precision, and
            so are all spirals.
        """
        u = self.model.input_values(inputs)
        if isinstance(manoeuvre, Stop):
            u[self.model.input_names.index("propeller.speed")] = manoeuvre.order(self.model)
        p = np.ascontiguousarray(p, dtype=float)
        (starts,) = self._start(p)
        place = self.model.parameter_names.index
        if isinstance(manoeuvre, SpiralManoeuvre):
            runs = LaneSpirals(self._runner).run(manoeuvre, p, starts, u, duration_s, times)
            doubtful = np.zeros(len(p), dtype=np.bool_)
            return LaneFigures(spiral_figures(manoeuvre, runs.rates), runs.states, runs.fine, runs.left, doubtful)
        ship_times = p[:, place("ship.length")] / p[:, place("ship.speed")]
        longest = LONGEST_STOP if isinstance(manoeuvre, Stop) else self._longest
        ends = longest * ship_times if duration_s is None else np.full(len(p), duration_s)
        plan, goals = self._plan(manoeuvre, u, starts, timed=duration_s is not None)
        plan = replace(plan, times=times, step_factor=pace.step_factor)
        levels = self._levels(manoeuvre, starts)
        found = (self._single if pace.single else self._runner).runs(plan, p, starts, ends, levels, goals)
        if isinstance(manoeuvre, Turn):
            figures = self._turn(found, (u, p), starts, manoeuvre)
        elif isinstance(manoeuvre, Zigzag):
            figures = self._zigzag(found, (u, p), starts, (manoeuvre, plan.limit))
        else:
            figures = self._stop(found, p, starts, goals[:, 0])
            found.ended[self._column(starts, "motion.u") <= goals[:, 0]] = UNKNOWN  # stopped as it begins
        fine = (found.ended == FINE) & np.isfinite(found.last).all(axis=1)
        left = np.where(fine, found.left, np.nan)
        for number in np.flatnonzero(found.ended == UNKNOWN).tolist():
            fine[number], left[number] = self._by_itself((manoeuvre, duration_s, inputs), p[number], figures, number)
        for values in figures.values():
            values[~fine] = np.nan
        doubtful = np.isfinite(left) | np.any([np.isnan(values) for values in figures.values()], axis=0)
        if isinstance(manoeuvre, Turn):
            doubtful |= self._unsteadiness(found) >= NEAR_STEADY * STEADY_SHARE
        result = LaneFigures(figures, found.states, fine, left, doubtful)
        if pace == USUAL_PACE or not doubtful.any():
            return result
        return result.replaced(np.flatnonzero(doubtful), self.run(manoeuvre, p[doubtful], duration_s, times, inputs))

    def _by_itself(
        self,
        asked: tuple[LaneManoeuvre, float | None, Mapping[str, float] | None],
        p: Array,
        figures: dict[str, Array],
        number: int,
    ) -> tuple[bool, float]:
        """Figures of one ship with more events than lanes keep; if it could be run; when it left the range, s."""
        (manoeuvre, duration, inputs), model = asked, self.model
        parameters = dict(zip(model.parameter_names, p.tolist(), strict=True))
        count = len(next(iter(figures.values())))
        for values in figures.values():
            values[number] = np.nan
        try:
            run = simulate(model, manoeuvre, duration_s=duration, inputs=inputs, parameters=parameters)
        except InputError:
            return False, math.nan
        for name, value in single_figures(run.figures).items():
            figures.setdefault(name, np.full(count, np.nan))[number] = value
        return True, math.inf if run.reading.exit_s is None else run.reading.exit_s

    def _plan(self, manoeuvre: _Switched, inputs: Array, starts: Array, *, timed: bool) -> tuple[LanePlan, Array]:
        """The plan of a manoeuvre, and the levels (n, 2) at which its order changes."""
        if isinstance(manoeuvre, Stop):
            amidships = float(inputs[self.model.input_names.index("rudder.command")])
            speeds = self._column(starts, "motion.u")
            goals = np.array([2 * [manoeuvre.final_speed(speed)] for speed in speeds.tolist()])
            return LanePlan((amidships, amidships), "motion.u", -1.0, 1, (), 0, inputs), goals
        side, course = math.copysign(1.0, manoeuvre.rudder), self._column(starts, "motion.psi")[:, None]
        if isinstance(manoeuvre, Turn):
            orders, change, limit = (manoeuvre.rudder, manoeuvre.rudder), TURN_HEADING, 0 if timed else 1
            watched, most = ("motion.psi", "motion.psi"), 1
        else:
            opposite = -manoeuvre.rudder if manoeuvre.opposite is None else manoeuvre.opposite
            orders, change, limit = (manoeuvre.rudder, opposite), manoeuvre.heading, -1 if timed else ZIGZAG_EXECUTES
            watched, most = ("motion.psi", "motion.r"), CROSSINGS
        goals = course + side * np.array([change, -change])
        return LanePlan(orders, "motion.psi", side, limit, watched, most, inputs), goals

    def _levels(self, manoeuvre: _Switched, starts: Array) -> Array:
        """Levels (n, watches) of the watched states."""
        course = self._column(starts, "motion.psi")[:, None]
        if isinstance(manoeuvre, Turn):
            return course + math.copysign(1.0, manoeuvre.rudder) * np.array([math.pi / 2, math.pi])
        if isinstance(manoeuvre, Zigzag):
            return np.hstack([course, np.zeros_like(course)])
        return np.zeros((len(starts), 0))

    def _column(self, rows: Array, name: str) -> Array:
        values: Array = rows[..., self.model.state_names.index(name)]
        return values

    def _reading(self, name: str, x: Array, rudder: Array, others: tuple[Array, Array]) -> Array:
        """An output (m,) at states `x` (m, nx) with rudder orders (m,), other inputs (nu,) and parameters (m, np)."""
        inputs, p = others
        u = np.tile(inputs, (len(x), 1))
        u[:, self.model.input_names.index("rudder.command")] = rudder
        (found,) = self._read[name](x, u, p)
        return found[:, 0]

    def _turn(self, found: LaneResults, others: tuple[Array, Array], starts: Array, turn: Turn) -> dict[str, Array]:
        p = others[1]
        side, length = math.copysign(1.0, turn.rudder), p[:, self.model.parameter_names.index("ship.length")]
        places = []
        for watch, change in enumerate((math.pi / 2, math.pi)):
            window = found.windows[:, watch, 0]
            level = self._column(starts, "motion.psi") + side * change
            states = window[..., 2:]
            offset = self._column(states, "motion.psi") - level[:, None]
            time = _crossing(window[..., 0], offset, self._column(states, "motion.r"))
            places.append((time, *self._ahead_and_aside(_through(window, time), starts, side)))
        (quarter, advance, transfer), (half, _, tactical) = places
        speed, rate = found.speeds[:, 3], self._column(found.last, "motion.r")
        drift = self._reading("motion.beta", found.last, np.full(len(p), turn.rudder), others)
        steady = np.isfinite(half) & (self._unsteadiness(found) < STEADY_SHARE)
        with np.errstate(invalid="ignore", divide="ignore"):
            at_last = {
                "steady_diameter_m": 2 * speed / np.abs(rate),
                "steady_drift_deg": np.degrees(drift),
                "steady_rate_degps": np.degrees(rate),
                "steady_speed_mps": speed,
                "speed_loss_percent": _speed_loss(found, speed),
            }
        return {
            "advance_m": advance,
            "transfer_m": transfer,
            "tactical_diameter_m": tactical,
            "advance_lengths": advance / length,
            "tactical_diameter_lengths": tactical / length,
            "time_90_s": quarter,
            "time_180_s": half,
        } | {name: np.where(steady, values, np.nan) for name, values in at_last.items()}

    def _unsteadiness(self, found: LaneResults) -> Array:
        """Larger relative change (n,) of yaw rate and speed over the last two lengths; nan without them."""
        now = np.column_stack([self._column(found.last, "motion.r"), found.speeds[:, 3]])
        with np.errstate(invalid="ignore", divide="ignore"):
            changes: Array = np.max(np.abs(now - found.then) / np.abs(now), axis=1)
        return changes

    def _zigzag(
        self, found: LaneResults, others: tuple[Array, Array], starts: Array, asked: tuple[Zigzag, int]
    ) -> dict[str, Array]:
        (zigzag, limit), p, count = asked, others[1], len(starts)
        side, length = math.copysign(1.0, zigzag.rudder), p[:, self.model.parameter_names.index("ship.length")]
        course = self._column(starts, "motion.psi")
        # The change at which a run ends is of no order any more.
        kept = found.order_times.shape[1]
        changes = np.minimum(found.orders - (found.orders == limit), kept)
        executes = np.where(np.arange(kept) < changes[:, None], found.order_times, np.nan)
        windows = found.windows[..., 2:]
        offset = self._column(windows[:, 0], "motion.psi") - course[:, None, None]
        returns = _crossing(found.windows[:, 0, ..., 0], offset, self._column(windows[:, 0], "motion.r"))
        returns = _sorted_after(returns, executes[:, 0])
        turns = _crossing(
            found.windows[:, 1, ..., 0], self._column(windows[:, 1], "motion.r"), self._yaw_accelerations(found, others)
        )
        headings = self._column(_through(found.windows[:, 1], turns), "motion.psi")
        figures: dict[str, Array] = {}
        for number in range(int(changes.max(initial=0))):
            after = np.where(turns > executes[:, [number]], turns, np.inf)
            first = np.argmin(after, axis=1)
            peak = after[np.arange(count), first]
            shown = np.isfinite(peak)
            swung = side * (-1) ** number * (headings[np.arange(count), first] - course) - zigzag.heading
            figures[entry_name("overshoots_deg", number)] = np.where(shown, np.degrees(swung), np.nan)
            figures[entry_name("overshoot_times_s", number)] = np.where(shown, peak - executes[:, number], np.nan)
            figures[entry_name("execute_times_s", number)] = executes[:, number].copy()
        ahead, aside = self._ahead_and_aside(found.order_states[:, 0], starts, 1.0)
        distance = np.where(np.isfinite(executes[:, 0]), np.hypot(ahead, aside), np.nan)
        return figures | {
            "initial_turning_time_s": executes[:, 0].copy(),
            "initial_turning_distance_m": distance,
            "initial_turning_lengths": distance / length,
            "reach_s": returns[:, 0].copy(),
            "period_s": returns[:, 2] - returns[:, 0],
            "speed_loss_percent": _speed_loss(found, found.speeds[:, 1]),
        }

    def _stop(self, found: LaneResults, p: Array, starts: Array, final: Array) -> dict[str, Array]:
        """Figures of stopping ships (n,), which end at the surge velocity `final` (n,), m/s."""
        slow = self._column(found.last, "motion.u") <= final + REST_SPEED * found.speeds[:, 0]
        stopped = (found.orders > 0) | slow
        length = p[:, self.model.parameter_names.index("ship.length")]
        ahead, aside = self._ahead_and_aside(found.last, starts, 1.0)
        turned = self._column(found.last, "motion.psi") - self._column(starts, "motion.psi")
        figures = {
            "track_reach_m": found.way,
            "head_reach_m": ahead,
            "side_reach_m": aside,
            "time_to_stop_s": found.end,
            "stopped_at_mps": final,
            "track_reach_lengths": found.way / length,
            "head_reach_lengths": ahead / length,
            "heading_change_deg": np.degrees(turned),
        }
        return {name: np.where(stopped, values, np.nan) for name, values in figures.items()}

    def _yaw_accelerations(self, found: LaneResults, others: tuple[Array, Array]) -> Array:
        """dr/dt (n, crossings, samples) about the crossings of zero rate, at the two samples between which they are."""
        windows = found.windows[:, 1]
        slopes = np.full(windows.shape[:-1], np.nan)
        member, number = np.nonzero(np.isfinite(windows[:, :, 1, 0]))
        for sample in (1, 2):
            rows = windows[member, number, sample]
            if len(rows):
                slopes[member, number, sample] = self._reading(
                    "motion.rdot", rows[:, 2:], rows[:, 1], (others[0], others[1][member])
                )
        return slopes

    def _ahead_and_aside(self, states: Array, starts: Array, side: float) -> tuple[Array, Array]:
        """Distances ahead and to the side of the turn of states (n, nx) from those at the execute, m."""
        x, y, heading = (self._column(starts, name) for name in _BEGINS)
        north, east = self._column(states, "motion.x") - x, self._column(states, "motion.y") - y
        cos, sin = np.cos(heading), np.sin(heading)
        with np.errstate(invalid="ignore"):  # ships beyond all bounds, which are left out later
            return north * cos + east * sin, side * (east * cos - north * sin)


def _crossing(times: Array, offset: Array, slope: Array) -> Array:
    """Times (...) at which the Hermite cubics between the middle two of four samples (..., 4) cross zero."""
    begin, step = times[..., 1], times[..., 2] - times[..., 1]
    low, high = offset[..., 1], offset[..., 2]
    rise = (high - low) / step
    square = (3 * rise - 2 * slope[..., 1] - slope[..., 2]) / step
    cube = (slope[..., 1] + slope[..., 2] - 2 * rise) / step**2
    before, after = np.zeros_like(step), step.copy()
    below, near = low < 0, _ROUNDED * step
    with np.errstate(invalid="ignore", divide="ignore"):
        root = low * step / (low - high)
        for _ in range(_TRIES):
            value = low + root * (slope[..., 1] + root * (square + root * cube))
            same = (value < 0) == below
            before, after = np.where(same, root, before), np.where(same, after, root)
            moved = root - value / (slope[..., 1] + root * (2 * square + 3 * root * cube))
            moved = np.where((moved > before) & (moved < after) | (value == 0), moved, (before + after) / 2)
            change, root = np.abs(moved - root), moved
            if not (change > near).any():
                break
    found: Array = begin + root
    return found


def _through(windows: Array, times: Array) -> Array:
    """States (..., nx) at `times` (...) of the polynomials through the samples (..., 4, 2 + nx) that are not nan."""
    at = windows[..., 0]
    known = np.isfinite(at)
    found = np.zeros((*at.shape[:-1], windows.shape[-1] - 2))
    for k in range(at.shape[-1]):
        weight = np.ones(at.shape[:-1])
        for other in range(at.shape[-1]):
            if other != k:
                with np.errstate(invalid="ignore", divide="ignore"):
                    factor = (times - at[..., other]) / (at[..., k] - at[..., other])
                weight = weight * np.where(known[..., other], factor, 1.0)
        part = weight[..., None] * windows[..., k, 2:]
        found += np.where(known[..., k, None], part, 0.0)
    found[~np.isfinite(times)] = np.nan
    return found


def _sorted_after(times: Array, begin: Array) -> Array:
    """Times (n, m) after `begin` (n,) in their order, then nan."""
    with np.errstate(invalid="ignore"):
        kept = np.where(times > begin[:, None], times, np.nan)
    return np.sort(kept, axis=1)


def _speed_loss(found: LaneResults, speed: Array) -> Array:
    before, largest = found.speeds[:, 0], found.speeds[:, 2]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(before > REST_SPEED * largest, 100 * (1 - speed / before), np.nan)
