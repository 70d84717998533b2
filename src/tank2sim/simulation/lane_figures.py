"""Figures of turns, zigzags, stops and spirals of many ships, from what their runs in lanes keep.

They equal :mod:`tank2sim.simulation.figures` for a trajectory with a sample at each step, to rounding: the same
Hermite cubics at crossings, the same cubics through four samples, for all ships at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
from tank2sim.simulation.figures import STEADY_SHARE, Events, KeptRuns, run_figures, spiral_figures, unsteadiness
from tank2sim.simulation.lane_runs import CROSSINGS, FINE, UNKNOWN, LaneKeeping, LaneResults, LaneRunner
from tank2sim.simulation.manoeuvres import (
    SPIRAL_HOLD,
    STEADY_AFTER,
    Manoeuvre,
    SpiralManoeuvre,
    Stop,
    Turn,
    Zigzag,
    is_steady,
)
from tank2sim.simulation.rows import ArrayFunction, RowFunction
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import SwitchingPlan
from tank2sim.simulation.trajectory import EventSamples

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

    `figures`: Name with unit to the figure of each ship (n,), nan where its run does not show it; entries of lists by
    their own names (``overshoot_1_deg``). `states` (n, times, nx): States at the requested times; nan after the end.
    `fine` (n,): False for a ship whose motion left all bounds. `left_s` (n,): Time at which a ship first left the range
    of its card, s; inf if it did not, nan if it is not `fine`. `doubtful` (n,): True for a ship whose figures another
    :class:`Pace` may turn into none, or none into a figure: one is none, the turn is near the limit of a steady one
    (:data:`NEAR_STEADY`), or the ship left the range of its card.
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
        """These figures with m ships, by their `numbers` (m,), taken from `others`; `doubtful` is not changed."""
        figures = {name: values.copy() for name, values in self.figures.items()}
        for name in figures | dict(others.figures):
            values = figures.setdefault(name, np.full(len(self.fine), np.nan))
            values[numbers] = others.figures.get(name, np.nan)
        states, fine, left = self.states.copy(), self.fine.copy(), self.left_s.copy()
        states[numbers], fine[numbers], left[numbers] = others.states, others.fine, others.left_s
        return LaneFigures(figures, states, fine, left, self.doubtful)


LaneManoeuvre = Turn | Zigzag | Stop | SpiralManoeuvre
"""Manoeuvres that lanes have."""


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

    `model`: A ship that begins where its parameters say, without a trim. `lanes`, optional: As for
    :class:`tank2sim.simulation.lane_runs.LaneRunner`. `longest`, optional: Longest run without a given duration, L/u0;
    by default the manoeuvre's.

    Raises NoLanesError: The model cannot be run in lanes.
    """

    def __init__(self, model: Model, lanes: int | None = None, longest: float | None = None):
        self.model, self._longest = model, longest
        if model.defaults.get("initial.trim"):
            raise NoLanesError("a ship that is trimmed first is not run in lanes")
        if not {*_BEGINS, "motion.u", "motion.v", "motion.r"} <= set(model.state_names):
            raise NoLanesError("the model does not describe a ship")
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

        `manoeuvre`: One of those for which :func:`runs_in_lanes` is true. `p` (n, np): Parameters of the model.
        `duration_s`, optional: As for :func:`tank2sim.simulation.run.simulate`. `times` (m,): Times at which states are
        kept, s. `inputs`, optional: Values in place of the model's, by name. `pace`: Step and precision. Ships that are
        `doubtful` are run again with the model's step in double precision, and so are all spirals.
        """
        p, model = np.ascontiguousarray(p, dtype=float), self.model
        (starts,) = self._start(p)
        ship_time = self._parameter(p, "ship.length") / self._parameter(p, "ship.speed")
        if isinstance(manoeuvre, SpiralManoeuvre):
            ships, hold = (p, starts, model.input_values(inputs)), _lasts(SPIRAL_HOLD, ship_time, duration_s)
            return self._spirals(manoeuvre, ships, ship_time, hold, np.asarray(times, dtype=float))
        plan = manoeuvre.plan(model, duration_s)
        u = model.input_values({**(inputs or {}), **plan.orders[0]})
        ends = _lasts(self._longest or plan.longest, ship_time, duration_s)
        keeping = LaneKeeping(*self._watched(manoeuvre, starts), times, pace.step_factor)
        runner = self._single if pace.single else self._runner
        found = runner.runs(plan, p, starts, ends, u, keeping)
        kept = self._kept(found, plan, (p, starts, u))
        figures = _columns(run_figures(manoeuvre, kept))
        if isinstance(manoeuvre, Stop):
            found.ended[kept.first("motion.u") <= manoeuvre.final_speed(kept.first("motion.u"))] = UNKNOWN  # at rest
        fine = (found.ended == FINE) & np.isfinite(found.last).all(axis=1)
        left = np.where(fine, found.left, np.nan)
        for number in np.flatnonzero(found.ended == UNKNOWN).tolist():
            fine[number], left[number] = self._by_itself((manoeuvre, duration_s, inputs), p[number], figures, number)
        for values in figures.values():
            values[~fine] = np.nan
        doubtful = np.isfinite(left) | np.isnan([*figures.values()]).any(axis=0) | _nearly_steady(manoeuvre, kept)
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
        parameters = model.parameters_by_name(p)
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

    def _watched(self, manoeuvre: LaneManoeuvre, starts: Array) -> tuple[list[tuple[str, Array]], int]:
        """States with levels (n,) whose crossings the figures need, and how many of each."""
        course = self._column(starts, "motion.psi")
        if isinstance(manoeuvre, Turn):
            side = math.copysign(1.0, manoeuvre.rudder)
            return [("motion.psi", course + side * angle) for angle in (math.pi / 2, math.pi)], 1
        if isinstance(manoeuvre, Zigzag):
            return [("motion.psi", course), ("motion.r", np.zeros_like(course))], CROSSINGS
        return [], 0

    def _parameter(self, p: Array, name: str) -> Array:
        values: Array = p[:, self.model.parameter_names.index(name)]
        return values

    def _column(self, rows: Array, name: str) -> Array:
        values: Array = rows[..., self.model.state_names.index(name)]
        return values

    def _kept(self, found: LaneResults, plan: SwitchingPlan, ships: tuple[Array, Array, Array]) -> KeptRuns:
        """What is kept of runs with parameters (n, np), starts (n, nx) and inputs (nu,)."""
        p, starts, u = ships
        rudder = plan.orders[0].get("rudder.command", 0.0)
        numbers = np.arange(found.order_times.shape[1])
        # The change at which a run ends is of no order any more.
        changes = found.orders - (found.orders == plan.changes)
        shown = int(np.minimum(changes, len(numbers)).max(initial=1))
        executes = np.where(numbers < changes[:, None], found.order_times, np.nan)[:, : max(shown, 1)]

        def last(name: str) -> Array:
            if name in self.model.state_names:
                return self._column(found.last, name)
            return self._read_off(name, found.last, np.full(len(p), rudder), (u, p))

        def crossings(name: str, rate: str, level: Array, number: int) -> Events:
            windows = found.windows[:, number]

            def signal(name: str) -> Array:
                states = name in self.model.state_names
                return self._column(windows[..., 2:], name) if states else self._slopes(name, windows, (u, p))

            samples = EventSamples(windows[..., 0], signal)
            times = samples.crossing(name, rate, level[:, None])
            return Events(times, lambda name: samples.at(name, times))

        return KeptRuns(
            length=self._parameter(p, "ship.length"),
            end=found.end,
            way=found.way,
            speeds=found.speeds,
            then=found.then,
            first=lambda name: self._column(starts, name),
            last=last,
            crossings=crossings,
            executes=lambda _: Events(executes, lambda name: self._column(found.order_states, name)),
        )

    def _read_off(self, name: str, x: Array, rudder: Array, others: tuple[Array, Array]) -> Array:
        """An output (m,) at states `x` (m, nx) with rudder orders (m,), other inputs (nu,) and parameters (m, np)."""
        u = np.tile(others[0], (len(x), 1))
        u[:, self.model.input_names.index("rudder.command")] = rudder
        (found,) = self._read[name](x, u, others[1])
        return found[:, 0]

    def _slopes(self, name: str, windows: Array, others: tuple[Array, Array]) -> Array:
        """An output (n, crossings, samples) at the two samples between which each crossing is."""
        slopes = np.full(windows.shape[:-1], np.nan)
        member, number = np.nonzero(np.isfinite(windows[:, :, 1, 0]))
        for sample in (1, 2):
            rows = windows[member, number, sample]
            if len(rows):
                inputs = others[0], others[1][member]
                slopes[member, number, sample] = self._read_off(name, rows[:, 2:], rows[:, 1], inputs)
        return slopes

    def _spirals(
        self,
        spiral: SpiralManoeuvre,
        ships: tuple[Array, Array, Array],
        ship_times: Array,
        longest: Array,
        at: Array,
    ) -> LaneFigures:
        """Direct spirals: each rudder is held for at most `longest` (n,), s, by each ship until its turn is steady."""
        (p, starts, u), count, yaw_rate = ships, len(ship_times), self.model.state_names.index("motion.r")
        x, elapsed, left, fine = starts.copy(), np.zeros(count), np.full(count, np.inf), np.ones(count, dtype=np.bool_)
        rates = np.full((count, len(spiral.rudders)), np.nan)
        states = np.full((count, len(at), starts.shape[1]), np.nan)
        for place, rudder in enumerate(spiral.rudders):
            plan = Turn(rudder).plan(self.model, math.inf)
            held, before, turning = np.zeros(count), np.full(count, np.inf), np.flatnonzero(fine)
            while len(turning):
                lengths = np.minimum(STEADY_AFTER * ship_times[turning], longest[turning] - held[turning])
                due, places = _due(at, elapsed[turning], elapsed[turning] + lengths)
                found = self._runner.runs(plan, p[turning], x[turning], lengths, u, LaneKeeping(times=due))
                fine[turning] = (found.ended == FINE) & np.isfinite(found.last).all(axis=1)
                left[turning] = np.minimum(left[turning], found.left + elapsed[turning])
                rows, columns = np.nonzero(places >= 0)
                states[turning[rows], places[rows, columns]] = found.states[rows, columns]
                x[turning] = found.last
                held[turning] += lengths
                elapsed[turning] += lengths
                rate = found.last[:, yaw_rate]
                over = longest[turning] - held[turning] <= 1e-6 * ship_times[turning]  # apart from rounding
                steady = is_steady(before[turning], rate, ship_times[turning])
                before[turning] = rate
                turning = turning[fine[turning] & ~over & ~steady]
            rates[:, place] = np.where(fine, x[:, yaw_rate], np.nan)
        figures = _columns(spiral_figures(spiral.rudders, rates))
        return LaneFigures(figures, states, fine, np.where(fine, left, np.nan), np.zeros(count, dtype=np.bool_))


def _columns(figures: Mapping[str, Array]) -> dict[str, Array]:
    """Figures (n,) by name, the entries of lists (n, m) by their own."""
    lists = {name: values for name, values in figures.items() if values.ndim == 2}
    places = range(max((values.shape[1] for values in lists.values()), default=0))
    entries = {entry_name(name, place): values[:, place] for place in places for name, values in lists.items()}
    numbers = {name: values for name, values in figures.items() if values.ndim == 1}
    return {name: np.array(values) for name, values in (entries | numbers).items()}


def _due(times: Array, since: Array, until: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times (n, m), s after `since` (n,) up to `until` (n,), and their places among all; inf and -1 after the last."""
    first, last = np.searchsorted(times, since), np.searchsorted(times, until, side="right")
    places = first[:, None] + np.arange(int(np.max(last - first, initial=0)))
    inside = places < last[:, None]
    due = np.where(inside, times[np.minimum(places, len(times) - 1)] - since[:, None], np.inf) if len(times) else places
    return np.asarray(due, dtype=float), np.where(inside, places, -1)


def _lasts(longest: float, ship_time: Array, duration_s: float | None) -> Array:
    """Durations of runs (n,), s: the stated one, else the longest in L/u0."""
    return longest * ship_time if duration_s is None else np.full(len(ship_time), duration_s)


def _nearly_steady(manoeuvre: LaneManoeuvre, kept: KeptRuns) -> NDArray[np.bool_] | bool:
    """Whether a turn is near the limit beyond which it counts as steady (n,)."""
    return isinstance(manoeuvre, Turn) and unsteadiness(kept) >= NEAR_STEADY * STEADY_SHARE
