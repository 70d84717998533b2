"""What stands on the pilot card and the wheelhouse poster: boxes of labelled values, after IMO A.601(15).

A value that the card does not tell is None: the page then has a line to be filled in by hand. Nothing is guessed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.analysis.practice.bridge import Bridge, ShipTrack, Telegraph, quarter
from tank2sim.report.bridge_drawings import clock, knots, metres
from tank2sim.simulation.manoeuvres import FULL_ASTERN
from tank2sim.units import KNOT_MPS

HEELS_DEG = (2, 4, 8, 12, 16)
"""Heel angles of the poster's table of draught increase."""

ORDERS_AHEAD = ("Full sea speed", "Full ahead", "Half ahead", "Slow ahead", "Dead slow ahead")
ORDERS_ASTERN = ("Dead slow astern", "Slow astern", "Half astern", "Full astern")

Value = str | None


@dataclass(frozen=True)
class Row:
    """A label and its values; None is a blank to be filled in by hand."""

    label: Value
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Box:
    """A titled table; `heads` over the values, `note` under them."""

    title: str
    rows: tuple[Row, ...]
    heads: tuple[str, ...] = ()
    note: str = ""


def _number(value: float | None, unit: str, digits: int = 4) -> Value:
    space = "" if unit == "°" else " "
    return None if value is None else f"{value:.{digits}g}{space}{unit}".strip()


def conditions(bridge: Bridge, other: Bridge | None) -> tuple[str, str]:
    """Heads of the two loading conditions; which one the card is of it does not say, so it is ticked by hand."""
    return ("Loaded", "Ballast") if other else ("☐ loaded  ☐ ballast", "other condition")


def draughts(bridge: Bridge, other: Bridge | None) -> Box:
    """Draughts at which the data were obtained: a card has the mean one alone."""
    means = tuple(_number(one.card.ship.draught_m, "m") if one else None for one in (bridge, other))
    source = tuple("estimated" if one else None for one in (bridge, other))
    rows = (
        Row("Forward", (None, None)),
        Row("Aft", (None, None)),
        Row("Mean", means),
        Row("Trial / estimated", source),
    )
    return Box("Draught of the manoeuvring data", rows, conditions(bridge, other))


def steering(bridge: Bridge) -> Box:
    """Steering particulars."""
    gear = bridge.card.steering_gear
    largest = math.degrees(gear.max_angle_rad) if gear and gear.max_angle_rad else None
    neutral = None
    if bridge.neutral_deg is not None:
        side = "starboard" if bridge.neutral_deg > 0 else "port"
        neutral = f"{abs(bridge.neutral_deg):.2g}° {side}"
    over = None if bridge.hard_over_s is None else f"{bridge.hard_over_s:.3g} s"
    rows = (
        Row("Type of rudder(s)", (None,)),
        Row("Maximum rudder angle", (_number(largest, "°"),)),
        Row("Hard-over to hard-over (gear of the card)", (over,)),
        Row("with one / two power units", (None,)),
        Row("Rudder angle for neutral effect", (neutral,)),
        Row("Minimum speed to keep course, propeller stopped", (None,)),
    )
    return Box("Steering particulars", rows)


def telegraph(bridge: Bridge, other: Bridge | None) -> Box:
    """Engine orders with revolutions and steady speeds straight ahead; astern by hand."""
    rows: list[Row] = []
    named = any(one.order for one in bridge.telegraph)
    for place, one in enumerate(bridge.telegraph):
        speeds = tuple(_speed(side.telegraph, place) if side else None for side in (bridge, other))
        rows.append(Row(one.order or None, (f"{one.rpm:.4g}", *speeds)))
    if not bridge.telegraph:
        rows = [Row(order, (None, None, None)) for order in ORDERS_AHEAD]
        rows[0] = Row(ORDERS_AHEAD[0], (None, f"({knots(bridge.card.model.speed_mps)} approach)", None))
    rows += [Row(order, (None, None, None)) for order in ORDERS_ASTERN]
    first, second = conditions(bridge, other)
    heads = ("Rpm / pitch", f"kn, {first}", f"kn, {second}")
    note = ""
    if bridge.telegraph:
        note = "Steady speed straight ahead in deep calm water."
        note += "" if named else " The ship's own names of these revolutions are to be filled in."
        outside = any(not one.within for one in bridge.telegraph)
        note += " * outside the card's range of speeds." if outside else ""
    return Box("Engine order", tuple(rows), heads, note)


def _speed(rows: Sequence[Telegraph], place: int) -> Value:
    if place >= len(rows) or rows[place].speed_mps is None:
        return None
    speed = rows[place].speed_mps
    assert speed is not None
    return knots(speed) + ("" if rows[place].within else " *")


def engine(bridge: Bridge) -> Box:
    """Propulsion particulars: none of them is on a card."""
    labels = (
        "Type of engine, kW (HP)",
        "Type of propeller",
        "Critical revolutions",
        "Minimum rpm, knots",
        "Time limit astern",
        "Time limit at minimum revolutions",
        "Emergency full ahead to full astern",
        "Stop to full astern",
        "Astern power, % ahead",
        "Maximum number of consecutive starts",
    )
    return Box("Propulsion particulars", tuple(Row(label, (None,)) for label in labels))


def turning(bridge: Bridge, circles: Sequence[ShipTrack]) -> Box:
    """Figures of a pair of turning circles."""
    names = (
        ("Advance", "advance_m"),
        ("Transfer", "transfer_m"),
        ("Tactical diameter", "tactical_diameter_m"),
        ("Final diameter", "steady_diameter_m"),
    )
    rows = [Row(label, tuple(_distance(bridge, one.figures.get(name)) for one in circles)) for label, name in names]
    for heading in (90, 180, 360):
        marks = [quarter(one, heading) for one in circles]
        rows.append(Row(f"Time to {heading}°", tuple(clock(one.time_s) if one else None for one in marks)))
    speeds = [one.figures.get("steady_speed_mps") for one in circles]
    rows.append(Row("Final speed", tuple(None if one is None else f"{knots(one)} kn" for one in speeds)))
    return Box("", tuple(rows), tuple(one.name for one in circles))


def _distance(bridge: Bridge, value: float | None) -> Value:
    if value is None:
        return None
    return f"{metres(value)} m ({value / bridge.card.ship.length_m:.2f} L)"


def stopping(bridge: Bridge) -> Box:
    """Full astern from the speeds of the telegraph, and the engine stopped."""
    rows = [
        Row(
            f"{one.order} ({knots(one.speed_mps)} kn)",
            (_distance(bridge, one.track_reach_m), None if one.time_s is None else clock(one.time_s)),
        )
        for one in bridge.stops_from
    ]
    if not rows:
        rows = [Row(f"{order} to full astern", (None, None)) for order in ORDERS_AHEAD]
    note = ""
    if bridge.stops:
        lag = (
            "with the card's engine lag" if any(one.name == "engine_lag" for one in bridge.card.effects) else "at once"
        )
        note = (
            f"{FULL_ASTERN:.0%} of the nominal revolutions astern, {lag}: an assumption of the simulation, to be "
            "replaced by trials. From orders slower than the card's range of speeds: not told."
        )
    return Box("Full astern from", tuple(rows), ("track reach", "time"), note)


def zigzags(bridge: Bridge) -> Box:
    """Overshoots, and the initial turning distance of the 10/10 zigzag."""
    rows = []
    for name, figures in bridge.zigzags.items():
        overshoots = tuple(_number(figures.get(f"overshoot_{one}_deg"), "°", 3) for one in (1, 2))
        distance = figures.get("initial_turning_distance_m")
        rows.append(Row(name, (*overshoots, _distance(bridge, distance))))
    return Box("Zigzags and initial turning", tuple(rows), ("1st overshoot", "2nd", "to first heading"))


def draught_increase(bridge: Bridge) -> Box:
    """By heel B/2 sin(phi), the geometry of a section with square bilges; squat is not on a card."""
    beam = bridge.card.ship.beam_m
    rows = [
        Row(f"Heel {angle}°", (None if beam is None else f"{beam / 2 * math.sin(math.radians(angle)):.2f} m",))
        for angle in HEELS_DEG
    ]
    rows += [Row("Squat: under-keel clearance, speed, bow", (None,))] * 2
    note = "By heel: half the beam times its sine (square bilges)." if beam else ""
    return Box("Draught increase", tuple(rows), note=note)


def particulars(bridge: Bridge) -> tuple[Row, ...]:
    """What the head of the poster and the pilot card tell of the ship."""
    ship = bridge.card.ship
    tonnes = None if ship.displacement_kg is None else ship.displacement_kg / 1000
    return (
        Row("Call sign", (None,)),
        Row("Gross tonnage", (None,)),
        Row("Net tonnage", (None,)),
        Row("Deadweight", (None,)),
        Row("Displacement", (None if tonnes is None else f"{tonnes:,.4g} t" if tonnes < 100 else f"{tonnes:.0f} t",)),
        Row("Block coefficient", (_number(ship.block_coefficient, ""),)),
        Row("Length between perpendiculars", (_number(ship.length_m, "m", 5),)),
        Row("Breadth", (_number(ship.beam_m, "m"),)),
    )


def approach(bridge: Bridge) -> str:
    """The speed at which trials begin, in words."""
    speed = bridge.card.model.speed_mps
    return f"{knots(speed)} kn ({speed:.3g} m/s)" if speed / KNOT_MPS >= 2 else f"{speed:.3g} m/s"
