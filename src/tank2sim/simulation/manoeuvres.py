"""Standard manoeuvres (ITTC 7.5-04-02-01, IMO MSC.137(76)): rudder orders and their times.

Each manoeuvre drives a :class:`Running` simulation; the order is executed at t = 0. Angles are in rad, rudder and turns
positive to starboard. Figures of the result are in :mod:`tank2sim.simulation.figures`.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Input, Model
from tank2sim.errors import ArgumentError, InputError
from tank2sim.quantities import LONGEST_RUN_S
from tank2sim.records.csv_table import read_table
from tank2sim.simulation.running import Running, SwitchedManoeuvre, SwitchingPlan
from tank2sim.simulation.thruster_manoeuvres import (
    DifferenceTurn,
    Spin,
    StraightRun,
    ThrusterManoeuvre,
    thruster_commands,
)

MANOEUVRE_FORMS = (
    "turn:35, turn:-35, zigzag:20/20, zigzag:-10/10, pullout:20, spiral, spiral:20, stop, stop:-60 (rpm), "
    "file:orders.csv"
)

THRUSTER_FORMS = "straight:600, difference:200, difference:-200, spin:400 (rpm), stop, stop:-600, file:orders.csv"
"""Manoeuvres of a craft with thrusters."""

TURN_HEADING = math.radians(540.0)
"""Heading change of a turning circle: 1.5 turns, so that its last half turn is steady (ITTC 7.5-04-02-01)."""

ZIGZAG_EXECUTES = 5
"""Number of executes of a zigzag (ITTC 7.5-04-02-01), for four overshoots."""

SPIRAL_RUDDERS_DEG = (20, 15, 10, 7, 5, 4, 3, 2, 1, 0, -1, -2, -3, -4, -5, -7, -10, -15, -20)
"""Rudder angles of a direct spiral on its way to port, deg; it returns through the same angles."""

LONGEST_LENGTHS = 150.0
"""Longest run of a turning circle or zigzag without a given duration, L/u0. Project choice: some three times what slow
ships need."""

LONGEST_STOP = 300.0
"""The same of a stopping ship: it coasts (project choice: twice that)."""

FULL_ASTERN = 0.7
"""Full astern, as a share of the nominal revolutions: about what a diesel reaches against the stream. Project choice;
``stop:RPM`` states another."""

COASTING_END = 0.2
"""Share of the approach speed at which the run of a coasting ship ends, because coasting has no end: the rudder has
then lost most of its effect. Project choice."""

STEADY_CHANGE = 1e-3
"""Largest change of a steady yaw rate over :data:`STEADY_AFTER`, relative to itself, or to 0.01 u0/L if larger."""

STEADY_AFTER = 2.0
"""Time after which the yaw rate is judged again, L/u0. Project choice."""

SPIRAL_HOLD = 100.0
"""Longest time for which a spiral holds a rudder, L/u0. Project choice: slow ships near neutral stability need it."""


def _degrees(angle: float) -> str:
    """An angle (rad) in deg, without rounding errors of the conversion."""
    return f"{math.degrees(angle):.10g}"


def _check_angles(name: str, **angles: float) -> None:
    """Refuse an angle of 90 deg (in rad) or more, as an angle in degrees is."""
    for key, angle in angles.items():
        if not abs(angle) < math.pi / 2:
            problem = f"is {angle:g} rad, and angles are below 90 deg (1.57 rad)"
            raise InputError(name, key, problem, f"angles are in rad: give math.radians({angle:g}) for {angle:g} deg")


@dataclass(frozen=True)
class Turn(SwitchedManoeuvre):
    """Turning circle: the rudder (rad, positive to starboard) is put over and held.

    It begins to move `wait_s` after the order (a gear's dead time).

    Raises
    ------
    InputError
        The rudder is 90 deg or more, as an angle in degrees is.
    """

    rudder: float
    wait_s: float = 0.0

    def __post_init__(self) -> None:
        _check_angles("Turn", rudder=self.rudder)

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`, in deg."""
        return f"turn:{_degrees(self.rudder)}"

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """Held, or until the heading has changed by :data:`TURN_HEADING` (at most 150 L/u0)."""
        order, side = {"rudder.command": self.rudder}, math.copysign(1.0, self.rudder)
        ends = 2 * (side * TURN_HEADING,)
        changes = 1 if duration_s is None else 0
        return SwitchingPlan((order, order), "motion.psi", ends, side, changes, LONGEST_LENGTHS, wait_s=self.wait_s)


@dataclass(frozen=True)
class Zigzag(SwitchedManoeuvre):
    """Zigzag: rudder `rudder` until the heading has changed by `heading`, then the other way, and so on.

    A negative rudder begins to port; `heading` is positive. The order comes `lag_s` after the heading is reached: the
    delay of a helmsman or of a model basin's controller (0.1 to 0.6 s at model scale), and the rudder begins to move
    `wait_s` after each order (a gear's dead time). Headings count from `course` (rad), by default from that at the
    execute. On the other side the rudder is held at `opposite` (rad, of the other sign), by default at -`rudder`: the
    two angles of a measured zigzag differ where the zero of its rudder is off. The rudder's second side is reversed
    at a change of `opposite_heading` (positive), by default `heading`: a helmsman's differ from side to side.

    Raises
    ------
    InputError
        An angle is 90 deg or more, as one in degrees is.
    """

    rudder: float
    heading: float
    lag_s: float = 0.0
    course: float | None = None
    wait_s: float = 0.0
    opposite: float | None = None
    opposite_heading: float | None = None

    def __post_init__(self) -> None:
        _check_angles("Zigzag", rudder=self.rudder, heading=self.heading)

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`, in deg."""
        return f"zigzag:{_degrees(self.rudder)}/{_degrees(self.heading)}"

    @property
    def headings(self) -> tuple[float, float]:
        """Changes of heading at which the first and the second side of the rudder are reversed, rad."""
        return self.heading, self.heading if self.opposite_heading is None else self.opposite_heading

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """Without a duration to the heading's return after the fifth execute (at most 150 L/u0)."""
        side, (first, second) = math.copysign(1.0, self.rudder), self.headings
        course = 0.0 if self.course is None else self.course
        opposite = -self.rudder if self.opposite is None else self.opposite
        return SwitchingPlan(
            ({"rudder.command": self.rudder}, {"rudder.command": opposite}),
            "motion.psi",
            (course + side * first, course - side * second),
            side,
            ZIGZAG_EXECUTES if duration_s is None else None,
            LONGEST_LENGTHS,
            of_start=1.0 if self.course is None else 0.0,
            wait_s=self.wait_s,
            lag_s=self.lag_s,
        )


@dataclass(frozen=True)
class PullOut:
    """Pull-out: a steady turn, then the neutral rudder; a stable ship returns to a straight course.

    The neutral rudder is the angle that holds a straight course at the speed of the approach: not zero on an asymmetric
    ship (ITTC 7.5-04-02-01), which with the rudder at zero would keep a yaw rate that says nothing of its stability.
    Where no rudder below 45 deg holds a straight course, it is amidships.

    Raises
    ------
    InputError
        The rudder is 90 deg or more, as an angle in degrees is.
    """

    rudder: float

    def __post_init__(self) -> None:
        _check_angles("PullOut", rudder=self.rudder)

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`, in deg."""
        return f"pullout:{_degrees(self.rudder)}"

    def drive(self, running: Running, ship_time: float, duration: float | None) -> None:
        """Turn until steady (at most 60 L/u0), then `duration` s (by default 40 L/u0) with the neutral rudder."""
        neutral = running.neutral_rudder()
        running.order({"rudder.command": self.rudder})
        _until_steady(running, ship_time, at_most=60 * ship_time)
        running.order({"rudder.command": neutral})
        running.run(40 * ship_time if duration is None else duration)


@dataclass(frozen=True)
class SpiralManoeuvre:
    """Direct (Dieudonne) spiral: a series of rudder angles to port and back to starboard, each held until steady."""

    rudders: tuple[float, ...]

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`, in deg."""
        return f"spiral:{_degrees(self.rudders[0])}"

    def drive(self, running: Running, ship_time: float, duration: float | None) -> None:
        """Hold each rudder until steady, at most `duration` s (by default :data:`SPIRAL_HOLD` L/u0)."""
        for rudder in self.rudders:
            running.order({"rudder.command": rudder})
            _until_steady(running, ship_time, at_most=SPIRAL_HOLD * ship_time if duration is None else duration)


@dataclass(frozen=True)
class Stop(SwitchedManoeuvre):
    """Crash stop (full astern stopping test), or coasting with the engine stopped, rudder amidships.

    Parameters
    ----------
    revolutions : float, optional
        Order, rad/s: negative (astern) or 0; by default :data:`FULL_ASTERN` of the nominal ones. They are reached at
        once, for a card states no time to reverse the engine.
    """

    revolutions: float | None = None

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`, in rpm."""
        return "stop" if self.revolutions is None else f"stop:{self.revolutions * 60 / math.tau:.10g}"

    def final_speed(self, approach: Array) -> Array:
        """Surge velocity (m/s) at which the ship has stopped: 0, or :data:`COASTING_END` of the approach speed."""
        return (COASTING_END if self.revolutions == 0 else 0.0) * approach

    def orders(self, model: Model) -> dict[str, float]:
        """Revolutions (rad/s) ordered from the propeller of a ship, or from the thrusters of a craft that push ahead.

        Raises InputError: The ship has no propulsion.
        """
        engines = [command for command in thruster_commands(model) if command.start]
        if not thruster_commands(model):
            if "propeller.speed" not in model.input_names:
                problem = "is missing: the ship's engine cannot be stopped or reversed"
                raise model.fault("propulsion", problem, "add [propulsion] to the card")
            propeller = model["propeller.speed"]
            assert isinstance(propeller, Input)
            engines = [propeller]
        ordered = self.revolutions
        return {engine.name: -FULL_ASTERN * engine.start if ordered is None else ordered for engine in engines}

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """Without a duration until the ship is dead in the water (at most :data:`LONGEST_STOP` L/u0)."""
        orders, share = self.orders(model), float(self.final_speed(np.ones(())))
        changes = 1 if duration_s is None else 0
        return SwitchingPlan((orders, orders), "motion.u", (0.0, 0.0), -1.0, changes, LONGEST_STOP, of_start=share)


@dataclass(frozen=True)
class Orders:
    """Orders from a file, each held until the next.

    Parameters
    ----------
    times : array (n,)
        s, rising from 0.
    inputs : dict
        Input of the model to its orders (n,), SI, rudder positive to starboard.
    source : str
        The file, for messages.
    """

    times: Array
    inputs: dict[str, Array]
    source: str

    @property
    def words(self) -> str:
        """The text form of :func:`parse_manoeuvre`."""
        return f"file:{self.source}"

    def drive(self, running: Running, ship_time: float, duration: float | None) -> None:
        """Run to the last order's time, or for `duration` s (needed if there is only one order)."""
        for name in self.inputs:
            if name not in running.model.input_names:
                remedy = "add [propulsion] to the card, or leave the column out"
                if commands := thruster_commands(running.model):
                    remedy = f"its inputs are {', '.join(command.name for command in commands)}"
                raise InputError(self.source, name, "is not an input of this ship", remedy)
        end = float(self.times[-1]) if duration is None else duration
        if end <= 0:
            raise InputError(self.source, "column t_s", "ends at 0 s", "add the time to which to run, or a duration")
        # Repeated equal orders are merged: fewer, longer calls into machine code.
        table = np.column_stack(list(self.inputs.values()))
        new = np.concatenate([[True], np.any(np.diff(table, axis=0) != 0, axis=1)])
        for row in np.flatnonzero(new):
            if self.times[row] >= end:
                break
            running.run(self.times[row] - running.time)
            running.order({name: values[row] for name, values in self.inputs.items()})
        running.run(end - running.time)


Manoeuvre = Turn | Zigzag | PullOut | SpiralManoeuvre | Stop | Orders | ThrusterManoeuvre


def parse_manoeuvre(text: str) -> Manoeuvre:
    """Parse a manoeuvre: one of :data:`MANOEUVRE_FORMS` or of :data:`THRUSTER_FORMS`.

    Angles are in deg, revolutions in rpm, turns positive to starboard.

    Raises InputError: It is none of them, or an angle or a number of revolutions is out of bounds.
    """
    kind, _, argument = text.partition(":")
    if kind == "file" and argument:
        return read_orders(Path(argument))
    if kind == "stop":
        return _parse_stop(text)
    if kind in _BY_THRUSTERS:
        return _parse_thrusters(kind, re.fullmatch(_NUMBER, argument), text)
    found = re.fullmatch(_BY_ANGLES[kind][0], argument) if kind in _BY_ANGLES else None
    if found is None:
        close = difflib.get_close_matches(kind, [*_BY_ANGLES, *_BY_THRUSTERS, "stop", "file"], n=1)
        hint = f"did you mean {close[0]}? " if close and close[0] != kind else ""
        remedy = f"{hint}one of: {MANOEUVRE_FORMS}; with thrusters {THRUSTER_FORMS}"
        raise ArgumentError("manoeuvre", "", f"{text!r} is not a manoeuvre", remedy)
    return _parse_angles(kind, found, text)


_NUMBER = r"([+-]?\d+(?:\.\d+)?)"

_BY_ANGLES: dict[str, tuple[str, Callable[[list[float]], Manoeuvre]]] = {
    "turn": (_NUMBER, lambda a: Turn(math.radians(a[0]))),
    "zigzag": (f"{_NUMBER}/{_NUMBER}", lambda a: Zigzag(math.radians(a[0]), math.radians(a[1]))),
    "pullout": (_NUMBER, lambda a: PullOut(math.radians(a[0]))),
    "spiral": (f"(?:{_NUMBER})?", lambda a: SpiralManoeuvre(_spiral_rudders(a[0] if a else SPIRAL_RUDDERS_DEG[0]))),
}
"""Manoeuvres by angles of rudder and heading, deg: form of the angles, and what makes the manoeuvre of them."""


def _parse_angles(kind: str, found: re.Match[str], text: str) -> Manoeuvre:
    angles = [float(group) for group in found.groups() if group is not None]
    if any(not 0 < abs(angle) < 90 for angle in angles) or (kind == "zigzag" and angles[1] < 0):
        remedy = (
            "angles lie between 0 and 90 deg; the heading of a zigzag is positive, its rudder begins to its own side"
        )
        raise ArgumentError("manoeuvre", "", f"{text!r} has an angle out of bounds", remedy)
    return _BY_ANGLES[kind][1](angles)


_BY_THRUSTERS: dict[str, Callable[[float], ThrusterManoeuvre]] = {
    "straight": StraightRun,
    "difference": DifferenceTurn,
    "spin": Spin,
}


def _parse_thrusters(kind: str, found: re.Match[str] | None, text: str) -> Manoeuvre:
    rpm = float(found[1]) if found else 0.0
    if rpm == 0:
        raise ArgumentError("manoeuvre", "", f"{text!r} has no revolutions", f"give them in rpm: {THRUSTER_FORMS}")
    return _BY_THRUSTERS[kind](rpm * math.tau / 60)


def read_orders(path: Path) -> Orders:
    """Orders from a CSV with ``t_s`` and ``delta_order_deg`` (and ``n_rpm``); ``# rudder_sign: port`` is honoured.

    Raises InputError: A column is missing or unknown, time does not rise from 0, or a value is missing.
    """
    table = read_table(path)
    found = orders_from_columns(table.si().columns, path)
    if not any(key.lower() == "rudder_sign" for key in table.comments):
        table.refuse_misspelt_keys(("rudder_sign",))
    if "rudder.command" in found.inputs and _rudder_sign(path, table.comments) == "port":
        found.inputs["rudder.command"] = -found.inputs["rudder.command"]
    return found


def orders_from_columns(columns: Mapping[str, Array], source: Path | str) -> Orders:
    """Orders from columns (n,) in SI: ``t_s``, ``delta_order_rad`` to starboard, ``n_radps``; `source` is for messages.

    A craft with thrusters has ``n_<name>_radps`` and ``azimuth_<name>_rad`` in place of these.

    Raises InputError: A column is missing or unknown, time does not rise from 0, or a value is missing.
    """
    ordered = {name: order for name in columns if (order := _order_of(name))}
    kinds = "orders are t_s, delta_order_deg and n_rpm, or of thrusters n_port_rpm, n_starboard_rpm and so on"
    if unknown := columns.keys() - ordered.keys() - {"t_s"}:
        raise InputError(source, f"column {min(unknown)}", "is not an order", kinds)
    if "t_s" not in columns or not set(ordered.values()) - {"propeller.speed"}:
        raise InputError(source, "header", "lacks t_s or delta_order_deg", kinds)
    if {"delta_order_rad", "delta_rad"} <= columns.keys():
        raise InputError(source, "header", "has two rudder columns", "give delta_order_deg alone")
    _refuse_times(columns["t_s"], source)
    for name, values in columns.items():
        if np.isnan(values).any():
            raise InputError(source, f"column {name}", "has an empty cell", "give every order")
    return Orders(columns["t_s"], {order: columns[name] for name, order in ordered.items()}, str(source))


_ORDERS = {"delta_order_rad": "rudder.command", "delta_rad": "rudder.command", "n_radps": "propeller.speed"}


def _order_of(column: str) -> str:
    """The input of a model that a column orders; empty if none."""
    if found := re.fullmatch(r"(n|azimuth)_([a-z][a-z0-9_]*)_(radps|rad)", column):
        return f"thrusters.{found[2]}.{'command' if found[1] == 'n' else 'azimuth_command'}"
    return _ORDERS.get(column, "")


def _refuse_times(times: Array, source: Path | str) -> None:
    """Refuse times of orders that do not rise from 0, or end beyond the longest run."""
    if not len(times):
        raise InputError(source, "column t_s", "has no rows", "give one row for each order, the first at 0 s")
    if times[0] != 0 or np.any(np.diff(times) <= 0):
        raise InputError(source, "column t_s", "does not rise from 0", "begin at 0 and give each time once")
    if times[-1] > LONGEST_RUN_S:
        raise InputError(
            source, "column t_s", f"ends at {times[-1]:g} s", f"at most {LONGEST_RUN_S:g} s can be simulated"
        )


def _rudder_sign(path: Path, comments: Mapping[str, str]) -> str:
    """``port`` or ``starboard``, by the file's comment; starboard without one."""
    signs = [text.strip().lower() for key, text in comments.items() if key.strip().lower() == "rudder_sign"]
    sign = signs[0] if signs else "starboard"
    if sign not in ("port", "starboard"):
        raise InputError(path, "comment rudder_sign", f"is {sign!r}", "port or starboard was expected")
    return sign


def _parse_stop(text: str) -> Stop:
    found = re.fullmatch(f"stop(?::{_NUMBER})?", text)
    if found is None:
        raise ArgumentError("manoeuvre", "", f"{text!r} is not a manoeuvre", f"one of: {MANOEUVRE_FORMS}")
    if found[1] is None:
        return Stop()
    revolutions = float(found[1]) * math.tau / 60
    if revolutions > 0:
        remedy = "revolutions to stop with are negative (astern) or 0, in rpm"
        raise ArgumentError("manoeuvre", "", f"{text!r} orders the engine ahead", remedy)
    return Stop(revolutions)


def _spiral_rudders(largest: float) -> tuple[float, ...]:
    """Rudder angles of a spiral to the opposite side and back, from `largest` (deg) by :data:`SPIRAL_RUDDERS_DEG`."""
    inner = [angle for angle in SPIRAL_RUDDERS_DEG if abs(angle) < abs(largest)]
    outward = [largest, *(math.copysign(1.0, largest) * angle for angle in inner), -largest]
    return tuple(math.radians(angle) for angle in (*outward, *outward[-2::-1]))


def is_steady(before: Array, rate: Array, ship_time: Array) -> NDArray[np.bool_]:
    """Whether the yaw rate (rad/s) has not changed since :data:`STEADY_AFTER` before, by :data:`STEADY_CHANGE`.

    `before`, `rate` (n,): Yaw rate then and now, rad/s. `ship_time` (n,): L/u0, s.
    """
    near: NDArray[np.bool_] = np.abs(rate - before) < STEADY_CHANGE * np.maximum(np.abs(rate), 0.01 / ship_time)
    return near


def _until_steady(running: Running, ship_time: float, at_most: float) -> None:
    """Run until the yaw rate is steady (:func:`is_steady`), for `at_most` s."""
    end = running.time + at_most
    before = math.inf
    while end - running.time > 1e-6 * ship_time:  # ignore a remainder by rounding
        running.run(min(STEADY_AFTER * ship_time, end - running.time))
        rate = running.state("motion.r")
        if is_steady(np.array([before]), np.array([rate]), np.array([ship_time])).all():
            return
        before = rate
