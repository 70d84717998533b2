"""What a bridge wants to know of a ship (IMO A.601(15)): circles, stops, speeds by revolutions, zigzags, from her card.

Only what the card tells is here; what it does not tell is None, and stays a blank on the pilot card and the poster.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.practice.standard_trials import Numbers, Ship, numbers, ship_of
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.model import Vector
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import COASTING_END, FULL_ASTERN, Stop, Turn, Zigzag
from tank2sim.simulation.trajectory import Trajectory

SHALLOW = 1.2
"""Depth over draught in shallow water (A.601(15), appendix 2)."""

DEEP = 20.0
"""Depth over draught in deep water: a choice of ours, far beyond the 4 that MSC.137(76) asks for."""

SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Revolutions over nominal ones at which speeds are told where no telegraph orders are given: a choice of ours."""

_RADIANS_PER_S = 2 * math.pi / 60


@dataclass(frozen=True)
class Mark:
    """A point of a track: time, heading change (deg, to the side of the turn), place (m), speed."""

    time_s: float
    heading_deg: float
    ahead_m: float
    starboard_m: float
    speed_mps: float


@dataclass(frozen=True, eq=False)
class ShipTrack:
    """A track from the order on, in axes of the first course: ahead and to starboard, m.

    Parameters
    ----------
    name : str
    ahead_m, starboard_m : array (n,)
    marks : tuple of Mark
        At each quarter of a turn (turns), or at equal times (stops).
    figures : mapping
    """

    name: str
    ahead_m: Vector
    starboard_m: Vector
    marks: tuple[Mark, ...]
    figures: Numbers


@dataclass(frozen=True)
class Telegraph:
    """One order: its name (empty if it has none), revolutions, steady speed straight ahead (None if not known).

    `within` is False where that speed is outside the card's range.
    """

    order: str
    rpm: float
    speed_mps: float | None
    within: bool = True


@dataclass(frozen=True)
class StopFrom:
    """Full astern from the speed of an order: track reach and time; None where the run did not show them."""

    order: str
    speed_mps: float
    track_reach_m: float | None
    time_s: float | None


@dataclass(frozen=True, eq=False)
class Bridge:
    """One loading condition of a ship, as far as her card tells it.

    Parameters
    ----------
    card : ManoeuvringCard
    rudder_deg : float
        Of the turning circles.
    deep, shallow : tuple of ShipTrack
        Circles to starboard and port; `shallow` at :data:`SHALLOW` times the draught, empty without the effect.
    stops : tuple of ShipTrack
        Full astern, and the engine stopped; empty without propulsion.
    zigzags : mapping
        Name to figures.
    telegraph : tuple of Telegraph
        Empty without propulsion.
    stops_from : tuple of StopFrom
        Full astern from each speed of the telegraph.
    hard_over_s : float or None
        From hard over to hard over, by the gear's rate.
    neutral_deg : float or None
        Rudder that keeps a straight course, + to starboard; None where none does.
    notices : tuple of str
    """

    card: ManoeuvringCard
    rudder_deg: float
    deep: tuple[ShipTrack, ...]
    shallow: tuple[ShipTrack, ...]
    stops: tuple[ShipTrack, ...]
    zigzags: Mapping[str, Numbers]
    telegraph: tuple[Telegraph, ...]
    stops_from: tuple[StopFrom, ...]
    hard_over_s: float | None
    neutral_deg: float | None
    notices: tuple[str, ...] = ()

    def as_json(self) -> dict[str, object]:
        """All of it, tracks thinned to 200 points."""
        return {
            "ship": self.card.ship.name,
            "source": self.card.ship.source,
            "rudder_deg": self.rudder_deg,
            "turning_circles_deep": [_path_json(one) for one in self.deep],
            "turning_circles_shallow": [_path_json(one) for one in self.shallow],
            "stops": [_path_json(one) for one in self.stops],
            "zigzags": dict(self.zigzags),
            "telegraph": [vars(one) for one in self.telegraph],
            "full_astern_from": [vars(one) for one in self.stops_from],
            "hard_over_to_hard_over_s": self.hard_over_s,
            "rudder_neutral_deg": self.neutral_deg,
            "notices": list(self.notices),
        }


def bridge_of(card: ManoeuvringCard, orders: Mapping[str, float] | None = None) -> Bridge:
    """Run what a bridge wants to know.

    Parameters
    ----------
    card : ManoeuvringCard
    orders : mapping, optional
        Order of the telegraph to its revolutions, rpm; by default some shares of the nominal ones, without names.
    """
    ship = ship_of(card)
    told: list[str] = []
    depths = _depths(ship)
    sides = (("starboard", 1.0), ("port", -1.0))
    circles: dict[str, list[ShipTrack]] = {}
    for where, inputs in depths.items():
        for side, sign in sides:
            run = ship.run(Turn(sign * ship.largest_rudder), inputs=inputs)
            if isinstance(run, str):
                told.append(f"turn to {side}, {where} water: {run}")
                continue
            told += [f"turn to {side}, {where} water: {one}" for one in run.notices if "outside the card" in one]
            circles.setdefault(where, []).append(_circle(side, sign, run.trajectory, numbers(run.figures)))
    deep = depths["deep"]
    stops, troubles = _stops(ship, deep)
    telegraph = _telegraph(ship, orders)
    gear = card.steering_gear
    largest, rate = (gear.max_angle_rad, gear.max_rate_radps) if gear else (None, None)
    return Bridge(
        card=card,
        rudder_deg=math.degrees(ship.largest_rudder),
        deep=tuple(circles.get("deep", ())),
        shallow=tuple(circles.get("shallow", ())),
        stops=stops,
        zigzags=_zigzags(ship, deep),
        telegraph=telegraph,
        stops_from=_stops_from(ship, telegraph, deep),
        hard_over_s=2 * largest / rate if largest and rate else None,
        neutral_deg=_neutral(ship),
        notices=tuple(dict.fromkeys((*told, *troubles))),
    )


def steady_speed(ship: Ship, revolutions_radps: float) -> float | None:
    """Speed (m/s) that the ship keeps straight ahead at these revolutions; None if there is none.

    The highest at which the surge acceleration without drift, turn and rudder falls through zero. A ship that is
    unstable on her course, or asymmetric, is held on it by a rudder whose drag is left out.
    """
    model = ship.model
    p, x0 = model.parameter_values(), np.array(model.initial(model.parameter_values())).ravel()
    inputs = {name: 0.0 for name in model.input_names if name in ("current.speed", "wind.speed", "rudder.command")}
    u = model.input_values({**inputs, "propeller.speed": revolutions_radps})
    place, out = model.state_names.index("motion.u"), model.outputs.index("motion.udot")

    def pushed(speed: float) -> float:
        x = x0.copy()
        x[place] = speed
        return float(np.array(model.output(x, u, p)).ravel()[out])

    speeds = np.linspace(0.01, 1.5, 150) * ship.card.model.speed_mps
    pushes = np.array([pushed(speed) for speed in speeds])
    falls = np.flatnonzero((pushes[:-1] > 0) & (pushes[1:] <= 0))
    if not len(falls):
        return None
    last = int(falls[-1])
    return float(brentq(pushed, speeds[last], speeds[last + 1], xtol=1e-9))


def _telegraph(ship: Ship, orders: Mapping[str, float] | None) -> tuple[Telegraph, ...]:
    if ship.card.propulsion is None:
        return ()
    nominal = ship.card.propulsion.nominal_radps / _RADIANS_PER_S
    asked = list(orders.items()) if orders else [("", share * nominal) for share in SHARES]
    slowest, fastest = ship.card.model.speed_range_mps
    rows = []
    for order, rpm in asked:
        speed = steady_speed(ship, rpm * _RADIANS_PER_S) if rpm > 0 else None
        rows.append(Telegraph(order, rpm, speed, speed is None or slowest <= speed <= fastest))
    return tuple(rows)


def _depths(ship: Ship) -> dict[str, dict[str, float]]:
    """Inputs in deep and in shallow water; shallow only where the card has the effect and a draught."""
    draught = ship.card.ship.draught_m
    if "water.depth" not in ship.model.input_names or draught is None:
        return {"deep": {}}
    return {"deep": {"water.depth": DEEP * draught}, "shallow": {"water.depth": SHALLOW * draught}}


def _circle(side: str, sign: float, run: Trajectory, figures: Numbers) -> ShipTrack:
    ahead, starboard = _in_first_axes(run)
    change = sign * np.degrees(run["motion.psi"] - run["motion.psi"][0])
    end = _first_over(change, 360.0)
    marks = [
        _mark(run, change, row)
        for quarter in (90.0, 180.0, 270.0, 360.0)
        if (row := _first_over(change, quarter)) < len(change)
    ]
    end = min(end + 1, len(change))
    return ShipTrack(side, ahead[:end], starboard[:end], tuple(marks), figures)


def _stops(ship: Ship, inputs: Mapping[str, float]) -> tuple[tuple[ShipTrack, ...], list[str]]:
    if not ship.has_engine:
        return (), []
    found, told = [], []
    for name, manoeuvre in (
        (f"full astern ({FULL_ASTERN:.0%} of nominal)", Stop()),
        (f"engine stopped, to {COASTING_END:.0%} of speed", Stop(0.0)),
    ):
        run = ship.run(manoeuvre, inputs=inputs)
        if isinstance(run, str):
            told.append(f"{name}: {run}")
            continue
        told += [f"{name}: {one}" for one in run.notices if "not show" in one]
        ahead, starboard = _in_first_axes(run.trajectory)
        change = np.degrees(run.trajectory["motion.psi"] - run.trajectory["motion.psi"][0])
        rows = np.unique(np.linspace(0, len(change) - 1, 7).astype(int))[1:]
        marks = tuple(_mark(run.trajectory, change, int(row)) for row in rows)
        found.append(ShipTrack(name, ahead, starboard, marks, numbers(run.figures)))
    return tuple(found), told


def _stops_from(ship: Ship, telegraph: Sequence[Telegraph], inputs: Mapping[str, float]) -> tuple[StopFrom, ...]:
    found = []
    for one in telegraph:
        if one.speed_mps is None or not one.within:
            continue
        run = ship.run(Stop(), {"initial.u": one.speed_mps}, inputs)
        figures = {} if isinstance(run, str) else numbers(run.figures)
        order = one.order or f"{one.rpm:.4g} rpm"
        found.append(StopFrom(order, one.speed_mps, figures.get("track_reach_m"), figures.get("time_to_stop_s")))
    return tuple(found)


def _neutral(ship: Ship) -> float | None:
    try:
        course = straight_course(ship.model, ship.card.model.speed_mps)
    except InputError:
        return None
    angle = math.degrees(course.x[ship.model.state_names.index("rudder.angle")])
    # A card without any asymmetry does not say that the ship has none.
    return angle if abs(angle) > 1e-6 else None


def _zigzags(ship: Ship, inputs: Mapping[str, float]) -> dict[str, Numbers]:
    found = {}
    for angle in (10.0, 20.0):
        for name, sign in (("starboard", 1.0), ("port", -1.0)):
            run = ship.run(Zigzag(sign * math.radians(angle), math.radians(angle)), inputs=inputs)
            found[f"{angle:g}/{angle:g} first to {name}"] = {} if isinstance(run, str) else numbers(run.figures)
    return found


def _in_first_axes(run: Trajectory) -> tuple[Vector, Vector]:
    north, east = run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0]
    cos, sin = math.cos(run["motion.psi"][0]), math.sin(run["motion.psi"][0])
    return north * cos + east * sin, east * cos - north * sin


def _first_over(values: Vector, level: float) -> int:
    over = np.flatnonzero(values >= level)
    return int(over[0]) if len(over) else len(values)


def _mark(run: Trajectory, change: Vector, row: int) -> Mark:
    ahead, starboard = _in_first_axes(run)
    return Mark(
        float(run.t[row]), float(change[row]), float(ahead[row]), float(starboard[row]), float(run["motion.speed"][row])
    )


def _path_json(path: ShipTrack) -> dict[str, object]:
    every = max(1, len(path.ahead_m) // 200)
    return {
        "name": path.name,
        "figures": dict(path.figures),
        "marks": [vars(one) for one in path.marks],
        "ahead_m": path.ahead_m[::every],
        "starboard_m": path.starboard_m[::every],
    }


def quarter(path: ShipTrack, heading_deg: float) -> Mark | None:
    """The mark at a change of heading; None if the turn does not reach it."""
    return next((one for one in path.marks if one.heading_deg >= heading_deg), None)
