"""Manoeuvres of many ships at once, each in a lane of vector registers, without their tracks.

The runs take the steps of :mod:`tank2sim.simulation.running`: a grid of whole steps, and a sample at each change of the
rudder order. Only the parts of the motion that figures need are kept: the samples around crossings of watched levels,
the changes of order, the ends, the way, and on request the states at given times.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.native.generate import c_loop
from tank2sim.native.lanes import FLAGS_OF_LANES, NoLanesError, lane_function, widest_lanes
from tank2sim.native.library import cached_library
from tank2sim.simulation.card_range import INSIDE
from tank2sim.simulation.running import SwitchingPlan
from tank2sim.simulation.scheme import step_and_constants
from tank2sim.simulation.trajectory import TIMES_BEYOND
from tank2sim.units import UNITS

FINE, RUNAWAY_LANE, UNKNOWN = 0, 1, 2
"""How a run of a lane ended: well; beyond all bounds; with more events than are kept."""

CROSSINGS = 12
"""Most crossings of a watched level, and most changes of order, that are kept: a zigzag to its fifth execute has seven
(project choice)."""

SAMPLES = 4
"""Samples about a crossing: two before it and two after it, for a cubic."""

_REMEMBERED = 4096
"""Steps of yaw rate and speed that are remembered for the judgement of a steady turn: with 200 in a length at the
approach speed, two lengths at a tenth of it (project choice)."""


class _Plan(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_double) for name in ("h", "first", "second", "side")),
        *((name, ctypes.c_long) for name in ("changing", "limit", "kept", "watches", "most", "times", "stride")),
        *((name, ctypes.c_void_p) for name in ("inputs", "limits", "at")),
    )


_FOUND = (
    "end",
    "last",
    "way",
    "then",
    "speeds",
    "left",
    "order_times",
    "order_states",
    "windows",
    "states",
    "ended",
    "orders",
    "crossings",
)


class _Found(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in _FOUND)


@dataclass(frozen=True, eq=False)
class LaneKeeping:
    """What is kept of runs, and their step.

    `watched`: at most two states with levels (n,), whose crossings are kept; `most`: how many of each, 1, with the
    motion two lengths before the end, or up to :data:`CROSSINGS`. `times` (m,) or (n, m): times at which states are
    kept, s, rising; of all ships, or of each. `step_factor`: length of an integration step over the model's.
    """

    watched: Sequence[tuple[str, Array]] = ()
    most: int = 0
    times: Sequence[float] | Array = ()
    step_factor: int = 1


@dataclass(frozen=True, eq=False)
class LaneResults:
    """What is kept of the runs of n ships; nan where there is none.

    `end`, `last` (n,), (n, nx): time, s, and states at the end; `way` (n,): length of the track, m. `then` (n, 2): yaw
    rate (rad/s) and speed (m/s) two lengths before the end; `speeds` (n, 4): first, lowest, highest and last, m/s.
    `left` (n,): time at which the card's range (the output ``validity``) was first left, s; inf if it was not.
    `order_times`, `order_states` (n, orders), (n, orders, nx): at the changes of order, at most :data:`CROSSINGS`.
    `windows` (n, watches, most, :data:`SAMPLES`, 2 + nx): time, rudder order from then on, and states about each
    crossing. `states` (n, times, nx): at the requested times. `ended` (n,): :data:`FINE`, :data:`RUNAWAY_LANE` or
    :data:`UNKNOWN`; `orders` (n,), `crossings` (n, watches): numbers of changes of order and of crossings.
    """

    end: Array
    last: Array
    way: Array
    then: Array
    speeds: Array
    left: Array
    order_times: Array
    order_states: Array
    windows: Array
    states: Array
    ended: NDArray[np.int32]
    orders: NDArray[np.int32]
    crossings: NDArray[np.int32]


class LaneRunner:
    """Runs manoeuvres of a model for many ships at once.

    `model`: A ship. `lanes`, optional: Numbers of double precision in a vector: 8, 4, 2 or 1; by default what this
    machine's vectors hold. No result depends on it. `single`: In single precision, with compensated sums of the states.

    Raises NoLanesError: The model cannot be run in lanes: there is no C compiler, an operation has no lanes, or the
    model lacks one of the states of a ship.
    """

    def __init__(self, model: Model, lanes: int | None = None, *, single: bool = False):
        self.model, self.single = model, single
        self.lanes = widest_lanes() if lanes is None else lanes
        needed = {"motion.x", "motion.y", "motion.r", "rudder.angle"} - set(model.state_names)
        if not self.lanes or needed or "rudder.command" not in model.input_names:
            raise NoLanesError("there is no C compiler, or the model does not describe a ship")
        self._run = self._compiled()

    def runs(
        self, plan: SwitchingPlan, p: Array, starts: Array, ends: Array, inputs: Array, kept: LaneKeeping
    ) -> LaneResults:
        """Runs of n ships by a plan of rudder orders: parameters (n, np), initial states (n, nx), longest times (n,).

        `inputs` (nu,) are the model's; a rudder order among them holds if the plan has none.
        """
        model, n, nx = self.model, len(starts), len(self.model.states)
        at = np.ascontiguousarray(kept.times, dtype=float)
        u = np.ascontiguousarray(inputs, dtype=float)
        limits = TIMES_BEYOND * np.array([UNITS[state.unit].extent for state in model.states])
        amidships = float(u[model.input_names.index("rudder.command")])
        first, second = (orders.get("rudder.command", amidships) for orders in plan.orders)
        changing = model.state_names.index(plan.state)
        goals = plan.of_start * starts[:, [changing]] + np.array(plan.levels)
        places = np.array([model.state_names.index(name) for name, _ in kept.watched], dtype=np.int32)
        levels = np.column_stack([np.zeros((n, 0)), *(level for _, level in kept.watched)])
        limit = np.iinfo(np.int32).max if plan.changes is None else plan.changes
        shape, changes = (n, len(places)), min(limit, CROSSINGS)
        found = LaneResults(
            end=np.full(n, np.nan),
            last=np.full((n, nx), np.nan),
            way=np.full(n, np.nan),
            then=np.full((n, 2), np.nan),
            speeds=np.full((n, 4), np.nan),
            left=np.full(n, np.nan),
            order_times=np.full((n, changes), np.nan),
            order_states=np.full((n, changes, nx), np.nan),
            windows=np.full((*shape, kept.most, SAMPLES, 2 + nx), np.nan),
            states=np.full((n, at.shape[-1], nx), np.nan),
            ended=np.zeros(n, dtype=np.int32),
            orders=np.zeros(n, dtype=np.int32),
            crossings=np.zeros(shape, dtype=np.int32),
        )
        lengths = p[:, model.parameter_names.index("ship.length")]
        numbers = [np.ascontiguousarray(values, dtype=float) for values in (p, starts, ends, goals, levels, lengths)]
        lasting = at.shape[-1], at.shape[-1] if at.ndim == 2 else 0
        step = kept.step_factor * model.step_s
        asked = _Plan(step, first, second, plan.side, changing, limit, changes, len(places), kept.most, *lasting)
        asked.inputs, asked.limits, asked.at = u.ctypes.data, limits.ctypes.data, at.ctypes.data
        results = _Found(*(getattr(found, name).ctypes.data for name in _FOUND))
        self._run(n, asked, *(values.ctypes.data for values in numbers), places.ctypes.data, results)
        return found

    def _compiled(self) -> ctypes._NamedFuncPointer:
        model = self.model
        step, constants = step_and_constants(model, change=self.single)
        arguments = [model.x, model.u, model.p]
        valid = model.expand(model.symbol("validity")) if "validity" in model else ca.SX(1.0)
        seen = [model.expand(model.symbol("motion.speed")), valid]
        looked = ca.Function("looked", arguments, seen, {"cse": True})
        codes = [
            lane_function(function, name)
            for function, name in ((step, "step"), (constants, "constants"), (looked, "speed_and_validity"))
        ]
        runs = c_loop(
            "lane_runs.c",
            nx=step.size1_in(0),
            nu=step.size1_in(1),
            np=step.size1_in(2),
            nc=max(1, constants.size1_out(0)),
            x=model.state_names.index("motion.x"),
            y=model.state_names.index("motion.y"),
            r=model.state_names.index("motion.r"),
            rudder=model.input_names.index("rudder.command"),
            samples=SAMPLES,
            remembered=_REMEMBERED,
            runaway=RUNAWAY_LANE,
            unknown=UNKNOWN,
            inside=repr(INSIDE),
        )
        try:
            library = _library([c_loop("vectors.h"), *codes, runs], self.lanes, single=self.single)
        except (InputError, OSError) as error:  # a compiler that does not work, or compiles for another machine
            raise NoLanesError(str(error)) from error
        pointers = [ctypes.c_void_p] * 6
        structures = ctypes.POINTER(_Plan), ctypes.POINTER(_Found)
        library.run_lanes.argtypes = [ctypes.c_long, structures[0], *pointers, ctypes.c_void_p, structures[1]]
        library.run_lanes.restype = None
        function: ctypes._NamedFuncPointer = library.run_lanes
        return function


def _library(parts: Sequence[str], lanes: int, *, single: bool) -> ctypes.CDLL:
    """The compiled library for vectors of `lanes` doubles; plain C where the compiler has no vectors."""
    try:
        numbers = 2 * lanes if single and lanes > 1 else lanes
        source = "\n".join([f"#define LANES {numbers}", f"#define SINGLE {int(single)}", *parts])
        return ctypes.CDLL(str(cached_library({"lanes.c": source}, flags=FLAGS_OF_LANES[lanes])))
    except RuntimeError:
        if lanes == 1:
            raise
        return _library(parts, 1, single=single)
