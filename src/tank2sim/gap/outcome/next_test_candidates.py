"""Candidate manoeuvres of the next test, each as a helmsman who orders rudder and revolutions from the motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.cards.card import SteeredCard

RUDDER, REVOLUTIONS = "rudder.command", "propeller.speed"
"""Inputs of a ship's model that a helmsman orders."""

_LARGEST_RUDDER = math.radians(35.0)
"""Largest rudder of a standard manoeuvre (IMO MSC.137(76)), where the gear does not stop before."""

SMALL_RUDDER = math.radians(5.0)
"""Largest rudder of course keeping (project choice)."""

SLOW = 0.6
"""Share of the nominal revolutions to which a slow-down goes: u falls to about this share, inside any card's range."""

BEFORE_EXECUTE = 1.0
"""Straight run before a manoeuvre whose record is to show the execute, L/u0 (project choice)."""

Helmsman = Callable[[float, float, float], float]
"""``rudder = helmsman(time, heading, rate)``: in L/u0, rad from the first heading, and rad per L/u0; + to starboard."""


@dataclass(frozen=True)
class Candidate:
    """A manoeuvre to be compared."""

    name: str  # Display name, and the key of its score in the report
    manoeuvre: str  # As ``simulate --manoeuvre`` takes it; "" for those that only a file can state
    helmsman: Callable[[], Helmsman]  # ``helmsman()`` gives a new :data:`Helmsman`
    revolutions: Callable[[float], float] = lambda time: 1.0  # Share of the nominal revolutions at a time in L/u0
    heading: float = 0.0  # First heading, rad
    on_course: bool = False  # It keeps near its first heading, so that another heading may give other information


def candidate_manoeuvres(card: SteeredCard, length: float) -> tuple[Candidate, ...]:
    """Turns, zigzags, pull-outs, straight runs, course keeping, random steps, and with propulsion a slow-down.

    Parameters
    ----------
    card : SteeredCard
    length : float
        Length of each, L/u0.
    """
    gear = card.steering_gear
    largest = (
        _LARGEST_RUDDER if gear is None or gear.max_angle_rad is None else min(_LARGEST_RUDDER, gear.max_angle_rad)
    )
    rudders = sorted({min(math.radians(angle), largest) for angle in (10, 20, 35)})
    zigzags = ((5, 5), (10, 10), (20, 20), (20, 10))
    of = [
        _named(f"turn:{math.degrees(side * rudder):.4g}", _held(side * rudder))
        for rudder in rudders
        for side in (1, -1)
    ]
    of += [
        replace(
            _named(f"zigzag:{rudder}/{heading}", _zigzag(math.radians(rudder), math.radians(heading))), on_course=True
        )
        for rudder, heading in zigzags
    ]
    pull = min(math.radians(20.0), largest)
    of += [_named(f"pullout:{math.degrees(side * pull):.4g}", _pull_out(side * pull, length / 2)) for side in (1, -1)]
    of += [
        Candidate("straight run", "", _straight, on_course=True),
        Candidate("straight run on two headings", "", _two_headings(pull, length / 3)),
        Candidate("course keeping", "", _keeping_course, on_course=True),
        Candidate("random steps of the rudder", "", _random_steps(pull, length)),
    ]
    if card.propulsion is not None:
        of.append(
            Candidate(
                "slow-down and acceleration", "", _straight, lambda t: SLOW if t < length / 2 else 1.0, on_course=True
            )
        )
        of.append(Candidate("turn at slow revolutions", "", _held(pull), lambda time: SLOW))
    return tuple(of)


def _named(manoeuvre: str, helmsman: Callable[[], Helmsman]) -> Candidate:
    return Candidate(manoeuvre, manoeuvre, helmsman)


def _held(rudder: float) -> Callable[[], Helmsman]:
    return lambda: lambda time, heading, rate: rudder


def _zigzag(rudder: float, goal: float) -> Callable[[], Helmsman]:
    def new() -> Helmsman:
        side = 1.0

        def helmsman(time: float, heading: float, rate: float) -> float:
            nonlocal side
            if side * heading >= goal:
                side = -side
            return side * rudder

        return helmsman

    return new


def _pull_out(rudder: float, end: float) -> Callable[[], Helmsman]:
    return lambda: lambda time, heading, rate: rudder if time < end else 0.0


def _steered(course: float, heading: float, rate: float, largest: float) -> float:
    """Rudder of an autopilot: gain 1 on the error, and 1 on the rate in rad per L/u0 (project choice: well damped)."""
    return float(np.clip(course - heading - rate, -largest, largest))


def _two_headings(rudder: float, leg: float) -> Callable[[], Helmsman]:
    """Straight for a leg, then onto a course 90 deg to starboard and along it."""
    return lambda: lambda time, heading, rate: _steered(math.pi / 2 if time > leg else 0.0, heading, rate, rudder)


def _straight() -> Helmsman:
    return lambda time, heading, rate: _steered(0.0, heading, rate, SMALL_RUDDER)


def _keeping_course() -> Helmsman:
    """Changes of course by 2 deg to and fro every 2 L/u0: the small rudder angles of course keeping."""

    def helmsman(time: float, heading: float, rate: float) -> float:
        side = 1.0 if int(time / 2) % 2 == 0 else -1.0
        return _steered(side * math.radians(1.0), heading, rate, SMALL_RUDDER)

    return helmsman


def _random_steps(largest: float, length: float) -> Callable[[], Helmsman]:
    """Rudders of any size to either side, each held 0.5 to 2 L/u0, and reversed when the heading is too far off."""
    rng = np.random.default_rng(0)
    ends = np.cumsum(rng.uniform(0.5, 2.0, int(2 * length) + 2))
    sizes = rng.uniform(-largest, largest, len(ends))

    def helmsman(time: float, heading: float, rate: float) -> float:
        rudder = float(sizes[int(np.searchsorted(ends, time, side="right"))])
        return -math.copysign(rudder, heading) if abs(heading) > math.pi / 4 else rudder

    return lambda: helmsman


def after_approach(candidate: Candidate) -> Candidate:
    """The candidate after :data:`BEFORE_EXECUTE` with the rudder amidships, so that a record shows the execute."""

    def new() -> Helmsman:
        helmsman = candidate.helmsman()
        return lambda time, heading, rate: (
            helmsman(time - BEFORE_EXECUTE, heading, rate) if time >= BEFORE_EXECUTE else 0.0
        )

    return replace(candidate, helmsman=new)


def on_heading(candidate: Candidate, heading: float) -> Candidate:
    """The candidate on another first heading, rad."""
    return replace(candidate, name=f"{candidate.name} on heading {math.degrees(heading):03.0f}", heading=heading)


_COLUMNS = {RUDDER: ("delta_order_deg", 180 / math.pi), REVOLUTIONS: ("n_rpm", 30 / math.pi)}


def orders_csv(step_s: float, orders: Mapping[str, np.ndarray], comment: str) -> str:
    """Text of an orders file: ``t_s,delta_order_deg`` and, where they are ordered, ``n_rpm``; a row for each change.

    Parameters
    ----------
    step_s : float
        s.
    orders : mapping
        :data:`RUDDER` (rad, + to starboard) and perhaps :data:`REVOLUTIONS` (rad/s) to values (n,), each held a step.
    comment : str
    """
    table = np.column_stack([np.round(orders[name] * _COLUMNS[name][1], 6) for name in orders])
    changes = np.flatnonzero(np.concatenate([[True], np.any(np.diff(table, axis=0) != 0, axis=1)]))
    times = [*(float(row) * step_s for row in changes), len(table) * step_s]
    lines = [f"# {' '.join(comment.split())}", ",".join(["t_s", *(_COLUMNS[name][0] for name in orders)])]
    for time, row in zip(times, [*table[changes], table[-1]], strict=True):
        lines.append(",".join(f"{value + 0.0:.8g}" for value in (time, *row)))
    return "\n".join(lines) + "\n"
