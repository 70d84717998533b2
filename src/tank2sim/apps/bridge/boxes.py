"""Content of the pilot card and the wheelhouse poster: boxes of labelled values, after IMO A.601(15).

A value that the card does not state is None: the page then has a line to be filled in by hand. A figure whose manoeuvre
leaves the card's range is OUTSIDE, and not printed: on a bridge a wrong number is worse than a blank.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from tank2sim.apps.bridge.drawings import clock, knots, metres
from tank2sim.apps.bridge.ship_track import ShipTrack, quarter
from tank2sim.apps.bridge.study import ORDERS_AHEAD, Bridge, Telegraph
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.loading import mean_draught
from tank2sim.simulation.card_range import CardRangeReading
from tank2sim.simulation.manoeuvres import FULL_ASTERN
from tank2sim.units import KNOT_MPS

HEELS_DEG = (2, 4, 8, 12, 16)
"""Heel angles of the poster's table of draught increase."""

ORDERS_ASTERN = ("Dead slow astern", "Slow astern", "Half astern", "Full astern")


class Blank(Enum):
    """The mark in place of a value."""

    OUTSIDE = "outside the range of the card"


OUTSIDE = Blank.OUTSIDE
_Value = str | Blank | None

NOT_FOR_USE = "Hatched: outside the range of the card, which is not for use there. Fill in from trials."
"""The words under a table with such figures."""


@dataclass(frozen=True)
class Row:
    """A label and its values; None is a blank to be filled in by hand."""

    label: str | None
    values: tuple[_Value, ...]


@dataclass(frozen=True)
class Box:
    """A titled table; `heads` over the values, `note` under them."""

    title: str
    rows: tuple[Row, ...]
    heads: tuple[str, ...] = ()
    note: str = ""

    @property
    def known(self) -> bool:
        """Whether any value is known to the model."""
        return any(value is not None for row in self.rows for value in row.values)

    @property
    def caution(self) -> str:
        """Warnings for the reader."""
        return NOT_FOR_USE if any(OUTSIDE in row.values for row in self.rows) else ""


def _number(value: float | None, unit: str, digits: int = 4) -> str | None:
    space = "" if unit == "°" else " "
    return None if value is None else f"{value:.{digits}g}{space}{unit}".strip()


def conditions(bridge: Bridge, ballast: Bridge | None) -> tuple[str, str]:
    """Heads of the two loading conditions; which one the card is of it does not say, so it is ticked by hand."""
    return ("Loaded", "Ballast") if ballast else ("☐ loaded  ☐ ballast", "other condition")


def draughts(bridge: Bridge, ballast: Bridge | None) -> Box:
    """Draughts at which the data were obtained, and what else is of those draughts: a card has the mean one alone."""
    labels = ("Forward", "Aft", "Mean", "Displacement", "Block coefficient", "Trial / estimated")
    columns = zip(_draught_values(bridge), _draught_values(ballast), strict=True)
    rows = tuple(Row(label, values) for label, values in zip(labels, columns, strict=True))
    return Box("Draught of the manoeuvring data", rows, conditions(bridge, ballast))


def _draught_values(condition: Bridge | None) -> tuple[str | None, ...]:
    """Values of a condition in the order of the box."""
    if condition is None:
        return (None,) * 6
    basis, ship, mean = condition.basis, condition.card.ship, mean_draught(condition.card)
    ends = (_number(basis.forward_m, "m"), _number(basis.aft_m, "m")) if basis else (None, None)
    # Displacement and block coefficient of a card hold at its own draught.
    own = mean == ship.draught_m
    form = (_tonnes(ship.displacement_kg), _number(ship.block_coefficient, "")) if own else (None, None)
    return (*ends, _number(mean, "m"), *form, basis.words if basis else "estimated")


def _tonnes(kilograms: float | None) -> str | None:
    if kilograms is None:
        return None
    tonnes = kilograms / 1000
    return f"{tonnes:.4g} t" if tonnes < 100 else f"{tonnes:.0f} t"


def present_condition() -> Box:
    """The ship as it is today: the pilot card is of that, and no card knows it."""
    return Box("Present draught", tuple(Row(label, (None,)) for label in ("Forward", "Aft", "Displacement")))


def anchors(*words: str) -> Box:
    """Anchor chain; `more` are heads next to the number of shackles."""
    blanks = (None,) * (1 + len(words))
    rows = tuple(Row(where, blanks) for where in ("Port", "Starboard", "Stern"))
    last = Row("1 shackle, m", (None,))
    return Box("Anchor chain", (*rows, last), ("shackles", *words))


def steering(bridge: Bridge, *, units: bool = True) -> Box:
    """Steering particulars; with `units` the times with one and two power units are asked for."""
    gear = bridge.card.steering_gear
    largest = math.degrees(gear.max_angle_rad) if gear and gear.max_angle_rad else None
    neutral = None
    if bridge.study.rudder_neutral_deg is not None:
        side = "starboard" if bridge.study.rudder_neutral_deg > 0 else "port"
        neutral = f"{abs(bridge.study.rudder_neutral_deg):.2g}° {side}"
    over = None if bridge.study.hard_over_to_hard_over_s is None else f"{bridge.study.hard_over_to_hard_over_s:.3g} s"
    rows = (
        Row("Type of rudder(s)", (None,)),
        Row("Maximum rudder angle", (_number(largest, "°"),)),
        Row("Hard-over to hard-over (card's gear)", (over,)),
        *(Row(f"with {count} power unit{end}", (None,)) for count, end in (("one", ""), ("two", "s")) if units),
        Row("Rudder angle for neutral effect", (neutral,)),
        Row("Least speed to keep course, propeller stopped", (None,)),
    )
    return Box("Steering particulars", rows)


def telegraph(bridge: Bridge, ballast: Bridge | None) -> Box:
    """Engine orders with revolutions and steady speeds straight ahead; astern by hand."""
    unnamed = [Row(None, _speeds(entry, ballast)) for entry in bridge.study.telegraph if not entry.order]
    given = {
        entry.order.casefold(): Row(_name_on_form(entry.order), _speeds(entry, ballast))
        for entry in bridge.study.telegraph
        if entry.order
    }
    rows = unnamed or _orders_ahead(given, blanks=3)
    rows += [Row(order, (None, None, None)) for order in ORDERS_ASTERN]
    first, second = conditions(bridge, ballast)
    note = ""
    if any(entry.speed_mps is not None for entry in bridge.study.telegraph):
        note = "Steady speed straight ahead in deep calm water."
        note += "" if given else " The ship's own names of these revolutions are to be filled in."
    return Box("Engine order", tuple(rows), ("Rpm / pitch", f"kn, {first}", f"kn, {second}"), note)


def _name_on_form(order: str) -> str:
    """The form's spelling of an order, or the ship's own."""
    return next((name for name in ORDERS_AHEAD if name.casefold() == order.casefold()), order)


def _orders_ahead(given: Mapping[str, Row], *, blanks: int) -> list[Row]:
    """Rows of the form's orders, blank where none is given, and of the ship's further orders; keys are casefolded."""
    on_form = {order.casefold(): Row(order, (None,) * blanks) for order in ORDERS_AHEAD}
    return list({**on_form, **given}.values())


def _speeds(order: Telegraph, ballast: Bridge | None) -> tuple[_Value, ...]:
    """Revolutions, speed, and the other condition's speed at the same revolutions."""
    same = (row for row in ballast.study.telegraph if math.isclose(row.rpm, order.rpm)) if ballast else ()
    rpm = f"{order.rpm:.0f}" if order.rpm >= 100 else f"{order.rpm:.3g}"
    return (rpm, _speed(order), _speed(next(iter(same), None)))


def _speed(order: Telegraph | None) -> _Value:
    if order is None or order.speed_mps is None:
        return None
    return knots(order.speed_mps) if order.within else OUTSIDE


def engine(*, poster: bool) -> Box:
    """Propulsion particulars as the form of the poster or of the pilot card asks: none of them is on a card."""
    labels = (
        "Type of engine, kW (HP)" if poster else "Type of engine, maximum kW (HP)",
        "Type of propeller",
        "Critical revolutions",
        "Minimum rpm, knots",
        "Time limit astern",
        *(("Time limit at minimum revolutions", "Emergency full ahead to full astern") if poster else ()),
        "Stop to full astern" if poster else "Full ahead to full astern",
        "Astern power, % ahead",
        "Maximum of consecutive starts",
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
    length = bridge.card.ship.length_m
    rows = [
        Row(
            label,
            tuple(_figure_value(circle.reading, name, lambda value: _distance(value, length)) for circle in circles),
        )
        for label, name in names
    ]
    rows += [
        Row(f"Time to {heading}°", tuple(_time_to(circle, heading) for circle in circles)) for heading in (90, 180, 360)
    ]
    speeds = (
        _figure_value(circle.reading, "steady_speed_mps", lambda value: f"{knots(value)} kn") for circle in circles
    )
    rows.append(Row("Final speed", tuple(speeds)))
    return Box("", tuple(rows), tuple(circle.name for circle in circles))


def _figure_value(reading: CardRangeReading, name: str, words: Callable[[float], str]) -> _Value:
    """A figure in words, if the card holds for it."""
    if reading.outside(name):
        return OUTSIDE
    return words(reading.figures[name]) if name in reading.figures else None


def _time_to(circle: ShipTrack, heading_deg: float) -> _Value:
    mark = quarter(circle, heading_deg)
    if mark is None:
        return OUTSIDE if circle.range_exit else None
    return OUTSIDE if circle.outside(mark) else clock(mark.time_s)


def _distance(value: float, length: float) -> str:
    return f"{metres(value)} m ({value / length:.2f} L)"


def stopping(bridge: Bridge) -> Box:
    """Full astern from the speeds of the telegraph."""
    given: dict[str, Row] = {}
    for stop in bridge.study.full_astern_from:
        reach = None if stop.track_reach_m is None else _distance(stop.track_reach_m, bridge.card.ship.length_m)
        time = None if stop.time_s is None else clock(stop.time_s)
        values = (reach, time) if stop.within else (OUTSIDE, OUTSIDE)
        given[stop.order.casefold()] = Row(f"{_name_on_form(stop.order)} ({knots(stop.speed_mps)} kn)", values)
    named = not given or any(stop.order for stop in bridge.study.telegraph)
    rows = _orders_ahead(given, blanks=2) if named else list(given.values())
    note = _assumed(bridge) if bridge.stops else ""
    return Box("Full astern from", tuple(rows), ("track reach", "time"), note)


def _assumed(bridge: Bridge) -> str:
    """How the stops were simulated."""
    effects = [EFFECTS[entry.name] for entry in bridge.card.effects]
    lags = any("propeller.speed" in effect.states_behind.values() for effect in effects)
    lag = "with the card's engine lag" if lags else "at once"
    share = f"{FULL_ASTERN:.0%} of the nominal revolutions astern"
    return f"Simulated with {share}, {lag}: an assumption, to be replaced by trials."


def zigzags(bridge: Bridge) -> Box:
    """Overshoots, and the initial turning distance of the zigzags."""
    length = bridge.card.ship.length_m
    rows = [
        Row(
            name,
            (
                *(_figure_value(zigzag, f"overshoot_{place}_deg", lambda value: f"{value:.3g}°") for place in (1, 2)),
                _figure_value(zigzag, "initial_turning_distance_m", lambda value: _distance(value, length)),
            ),
        )
        for name, zigzag in bridge.zigzags.items()
    ]
    return Box("Zigzags and initial turning", tuple(rows), ("1st overshoot", "2nd", "to first heading"))


def draught_increase(bridge: Bridge) -> Box:
    """By heel B/2 sin(phi), the geometry of a section with square bilges."""
    beam = bridge.card.ship.beam_m
    values = tuple(None if beam is None else f"{beam / 2 * math.sin(math.radians(heel)):.3g} m" for heel in HEELS_DEG)
    note = "Half the beam times the sine of the heel (square bilges)." if beam else ""
    return Box("Draught increase by heel", (Row("Heel", values),), tuple(f"{heel}°" for heel in HEELS_DEG), note)


def squat(bridge: Bridge) -> Box:
    """Estimated squat, as A.601(15) allows it, with the formulas it is from; blank without the ship's form."""
    heads = ("under-keel clearance", "speed, kn", "largest squat")
    rows = tuple(
        Row("", (_number(row.clearance_m, "m", 3), knots(row.speed_mps), _number(row.squat_m, "m", 2)))
        for row in bridge.study.squat
    )
    note = "Larger of Barrass and ICORELS." if rows else ""
    return Box("Draught increase by squat, estimated", rows or (Row("", (None,) * 3),) * 2, heads, note)


def thrusters() -> Box:
    """Boxes of the poster that no card fills."""
    heads = ("kW (HP)", "delay to full thrust", "turning rate at zero speed", "delay to reverse", "no effect above, kn")
    rows = tuple(Row(where, (None,) * len(heads)) for where in ("Bow", "Stern", "Combined"))
    return Box("Thruster effect at trial conditions", rows, heads)


def overboard() -> Box:
    """The sequence of actions of the poster."""
    actions = (
        "Cast a buoy",
        "Give the helm order",
        "Sound the alarm",
        "Keep the look-out",
        "Recovery turn, rudder reversed at",
    )
    rows = tuple(Row(f"{place}. {action}", (None,)) for place, action in enumerate(actions, start=1))
    return Box("Man overboard rescue manoeuvre", rows)


def visibility() -> Box:
    """The poster's data of the wheelhouse, which no card has."""
    labels = ("Blind distance ahead, loaded", "Blind distance ahead, ballast", "Height of eye")
    return Box("Visibility", tuple(Row(label, (None,)) for label in labels))


def particulars(bridge: Bridge) -> tuple[Row, ...]:
    """The head of the poster. Whether the card is of the summer draught it does not say: those are left blank."""
    ship = bridge.card.ship
    return (
        Row("Call sign", (None,)),
        Row("Gross tonnage", (None,)),
        Row("Net tonnage", (None,)),
        Row("Length between perpendiculars", (_number(ship.length_m, "m", 5),)),
        Row("Max. displacement, summer draught", (None,)),
        Row("Deadweight, summer draught", (None,)),
        Row("Block coefficient, summer draught", (None,)),
        Row("Breadth", (_number(ship.beam_m, "m"),)),
    )


def of_the_ship(bridge: Bridge) -> Box:
    """Particulars of the pilot card."""
    ship = bridge.card.ship
    rows = (
        Row("Length overall", (None,)),
        Row("Length between perpendiculars", (_number(ship.length_m, "m", 5),)),
        Row("Breadth", (_number(ship.beam_m, "m"),)),
        Row("Bulbous bow", ("☐ yes  ☐ no",)),
        Row("Air draught", (None,)),
        Row("Bow to bridge / bridge to stern", (None,)),
        Row("Parallel waterline loaded / ballast", (None,)),
    )
    return Box("Ship's particulars", rows)


def approach(bridge: Bridge) -> str:
    """The speed at which trials begin, in words."""
    speed = bridge.card.model.speed_mps
    return f"{knots(speed)} kn ({speed:.3g} m/s)" if speed / KNOT_MPS >= 2 else f"{speed:.3g} m/s"
