"""Manoeuvring data for the bridge (IMO A.601(15)) from a ship's card: circles, stops, speeds by revolutions, zigzags.

Data that the card does not state are None, and blank on the pilot card and the poster. A figure outside the card's
range is marked, and not printed in bridge documents.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.stability.imo import TRIAL_RUDDER
from tank2sim.analysis.validation.standard_trials import TrialShip
from tank2sim.apps.bridge.ship_track import ShipTrack, TrackMark, TrackStudy, circle_track, stop_track
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.examination import doubts
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.effects.depth import LARGEST_DEPTH_FROUDE, barrass_squat, icorels_squat
from tank2sim.dynamics.effects.loading import mean_draught
from tank2sim.dynamics.hull import VALIDITY_FACTOR
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice
from tank2sim.simulation.card_range import NOTHING_READ, CardRangeReading
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import COASTING_END, FULL_ASTERN, Stop, Turn, Zigzag
from tank2sim.simulation.run import Run

SHALLOW = 1.2
"""Depth over draught in shallow water (A.601(15), appendix 2)."""

DEEP = 20.0
"""Depth over draught in deep water: project choice, far above the 4 that MSC.137(76) requires."""

SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Revolutions over nominal ones of the reported speeds without given telegraph orders: project choice."""

UNDER_KEEL, SQUAT_SPEED = (0.2, 0.5), 0.75
"""Water under the keel over the draught, and speed over the card's, in the table of squat: project choice, about
what a channel has, and a speed that a ship makes in one; more rows leave no room on the poster."""

ORDERS_AHEAD = ("Full sea speed", "Full ahead", "Half ahead", "Slow ahead", "Dead slow ahead")
"""Orders ahead of the wheelhouse poster's form (A.601(15), appendix 2)."""

FOLLOWS = 0.15
"""Largest deviation of a steady speed from the revolutions' share of the card's speed, over that share: the resistance
goes with the square of the speed (ITTC 7.5-04-01-01.1), speed is nearly proportional to revolutions, and a card whose
speed does not follow them does not hold there. Project choice: wave resistance bends the line by less."""

_LARGEST_SHARE = 2.0
"""Largest revolutions of an order over the nominal ones: engines trip far below. Project choice."""

LARGEST_RPM = 10_000.0
"""The same without nominal revolutions on the card: propellers of the smallest models turn slower."""

_RADIANS_PER_S = 2 * math.pi / 60


@dataclass(frozen=True)
class Telegraph:
    """An order: its name (may be empty), revolutions, steady speed straight ahead (None if unknown).

    `within` is False where that speed is outside the card's range, or does not follow the revolutions
    (:data:`FOLLOWS`).
    """

    order: str
    rpm: float
    speed_mps: float | None
    within: bool = True


@dataclass(frozen=True)
class StopFrom:
    """Full astern from the speed of an order: track reach and time; None where the run did not show them.

    `within` is False where the run left the card's range before the ship was at rest.
    """

    order: str
    speed_mps: float
    track_reach_m: float | None
    time_s: float | None
    within: bool = True


@dataclass(frozen=True)
class Squat:
    """Estimated largest sinkage by squat at a speed, with the water under the keel of the ship at rest."""

    clearance_m: float
    speed_mps: float
    squat_m: float


@dataclass(frozen=True)
class DataBasis:
    """Where the data of a loading condition are from: draughts (m), and words for "Trial / estimated".

    A trial has shown the effects `checked` to hold in this condition, whatever their ``validity`` says.
    """

    forward_m: float
    aft_m: float
    words: str
    checked: tuple[str, ...] = ()


@dataclass(frozen=True)
class ZigzagStudy:
    """Figures of a zigzag, the end of the card's range, and the figures outside it."""

    figures: dict[str, float]
    left_card_range_s: float | None
    left_card_range_by: str
    outside_card_range: tuple[str, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class BridgeStudy:
    """Data of a bridge as numbers.

    Parameters
    ----------
    rudder_deg : float
        Rudder of the turning circles: the largest that the gear allows (A.601(15)), or 35 deg without one on the card.
    turning_circles_deep, turning_circles_shallow : tuple of TrackStudy
        Circles to starboard and port; `shallow` at :data:`SHALLOW` times the draught, empty without the effect.
    stops : tuple of TrackStudy
        Full astern, and the engine stopped; empty without propulsion.
    zigzags : dict
        Name to figures; empty for a zigzag that could not be run.
    telegraph : tuple of Telegraph
        Empty without propulsion and without given orders.
    full_astern_from : tuple of StopFrom
        Full astern from each speed of the telegraph.
    hard_over_to_hard_over_s : float or None
        By the gear's rate.
    rudder_neutral_deg : float or None
        Rudder that keeps a straight course, + to starboard; None without one.
    squat : tuple of Squat
        Empty without block coefficient, beam and draught.
    notices : tuple of Notice
    ballast : BridgeStudy, optional
        The other condition.
    """

    ship: str
    source: str
    rudder_deg: float
    turning_circles_deep: tuple[TrackStudy, ...]
    turning_circles_shallow: tuple[TrackStudy, ...]
    stops: tuple[TrackStudy, ...]
    zigzags: dict[str, ZigzagStudy]
    telegraph: tuple[Telegraph, ...]
    full_astern_from: tuple[StopFrom, ...]
    hard_over_to_hard_over_s: float | None
    rudder_neutral_deg: float | None
    squat: tuple[Squat, ...]
    notices: tuple[Notice, ...]
    ballast: BridgeStudy | None = None


@dataclass(frozen=True, eq=False)
class Bridge:
    """Data of a ship in the loading condition of its card, with the runs that its sheets draw.

    Parameters
    ----------
    card : ManoeuvringCard
    study : BridgeStudy
    deep, shallow, stops : tuple of ShipTrack
        Runs of the circles and stops of the study.
    zigzags : mapping
        Name to what was read in a zigzag.
    basis : DataBasis, optional
        By default the data are estimated, and the form's draughts stay blank.
    """

    card: ManoeuvringCard
    study: BridgeStudy
    deep: tuple[ShipTrack, ...]
    shallow: tuple[ShipTrack, ...]
    stops: tuple[ShipTrack, ...]
    zigzags: Mapping[str, CardRangeReading]
    basis: DataBasis | None = None


def bridge_of(
    card: ManoeuvringCard, orders: Mapping[str, float] | None = None, basis: DataBasis | None = None
) -> Bridge:
    """Run the manoeuvres of the bridge data.

    Parameters
    ----------
    card : ManoeuvringCard
    orders : mapping, optional
        Order of the telegraph to its revolutions, rpm; by default shares of the nominal ones, without names.
    basis : DataBasis, optional
        Where the data are from.

    Raises
    ------
    InputError
        The revolutions of an order are beyond :data:`_LARGEST_SHARE` of the nominal ones.
    """
    _check_orders(card, orders or {})
    ship = _checked_ship(card, basis.checked if basis else ())
    depths = _depths(ship)
    rudder = _rudder(card)
    circles, circle_notes = _circles(ship, rudder, depths)
    deep, shallow = (tuple(circles.get(where, ())) for where in ("deep", "shallow"))
    stops, troubles = _stops(ship, depths["deep"])
    zigzags = _zigzags(ship, depths["deep"])
    telegraph = _telegraph(ship, orders)
    study = BridgeStudy(
        ship=card.ship.name,
        source=card.ship.source,
        rudder_deg=math.degrees(rudder),
        turning_circles_deep=tuple(track.study for track in deep),
        turning_circles_shallow=tuple(track.study for track in shallow),
        stops=tuple(stop.study for stop in stops),
        zigzags={
            name: ZigzagStudy(one.figures, one.exit_s, one.how, one.outside_names) for name, one in zigzags.items()
        },
        telegraph=telegraph,
        full_astern_from=_stops_from(ship, telegraph, depths["deep"]),
        hard_over_to_hard_over_s=_hard_over_s(card),
        rudder_neutral_deg=_neutral(ship),
        squat=squat_of(card),
        notices=tuple(dict.fromkeys((*doubts(card), *circle_notes, *troubles))),
    )
    return Bridge(card, study, deep, shallow, stops, zigzags, basis)


def _checked_ship(card: ManoeuvringCard, checked: Sequence[str]) -> TrialShip:
    """The ship ready to run, its range without the limits of effects that a trial has shown to hold."""
    model = build(card)
    for name in (f"{VALIDITY_FACTOR}{effect}" for effect in checked):
        if name in model.outputs:
            model = model.redefine(name, lambda _: ca.SX(1.0))
    return TrialShip(card, model, Integrator(model))


def squat_of(card: ManoeuvringCard) -> tuple[Squat, ...]:
    """Return the larger squat by Barrass and ICORELS at a share of the speed, with shares of the draught below.

    Speeds of a depth Froude number above 0.7, for which the formulas are not made, are left out.
    """
    ship, gravity = card.ship, card.environment.gravity_mps2
    draught = mean_draught(card)
    if draught is None or ship.beam_m is None or ship.block_coefficient is None:
        return ()
    volume = ship.block_coefficient * ship.length_m * ship.beam_m * draught
    speed = SQUAT_SPEED * card.model.speed_mps
    found = []
    for under_keel in UNDER_KEEL:
        clearance = under_keel * draught
        square = speed**2 / (gravity * (draught + clearance))
        if square <= LARGEST_DEPTH_FROUDE**2:
            sizes = barrass_squat(ship.block_coefficient, speed), icorels_squat(volume, ship.length_m, square)
            found.append(Squat(clearance, speed, max(sizes)))
    return tuple(found)


def _check_orders(card: ManoeuvringCard, orders: Mapping[str, float]) -> None:
    engine = card.propulsion
    largest = _LARGEST_SHARE * engine.nominal_radps / _RADIANS_PER_S if engine else LARGEST_RPM
    for order, rpm in orders.items():
        if rpm > largest:
            nominal = f" (the card's nominal ones are {largest / _LARGEST_SHARE:.4g})" if engine else ""
            problem = f"is beyond {largest:,.0f} revolutions a minute{nominal}"
            raise ArgumentError("order", f"{order}={rpm:g}", problem, "give the propeller's revolutions, rpm")


def _hard_over_s(card: ManoeuvringCard) -> float | None:
    """Time from hard over to hard over, by the rate of the gear."""
    gear = card.steering_gear
    if gear is None or not gear.max_angle_rad or not gear.max_rate_radps:
        return None
    return 2 * gear.max_angle_rad / gear.max_rate_radps


def _rudder(card: ManoeuvringCard) -> float:
    """Rudder of the turning circles, rad."""
    gear = card.steering_gear
    return gear.max_angle_rad if gear and gear.max_angle_rad else TRIAL_RUDDER


def steady_speed(ship: TrialShip, revolutions_radps: float) -> float | None:
    """Steady speed (m/s) straight ahead at these revolutions; None if there is none.

    The highest at which the surge acceleration without drift, turn and rudder falls through zero. The drag of the
    rudder that keeps an unstable or asymmetric ship on its course is neglected.
    """
    model = ship.model
    p, x0 = model.parameter_values(), np.array(model.initial(model.parameter_values())).ravel()
    inputs = {**undisturbed_inputs(model), "rudder.command": 0.0, "propeller.speed": revolutions_radps}
    u = model.input_values(inputs)
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


def _telegraph(ship: TrialShip, orders: Mapping[str, float] | None) -> tuple[Telegraph, ...]:
    if ship.card.propulsion is None:
        return tuple(Telegraph(order, rpm, None) for order, rpm in (orders or {}).items())
    nominal = ship.card.propulsion.nominal_radps / _RADIANS_PER_S
    orders_and_rpm = list(orders.items()) if orders else [("", share * nominal) for share in SHARES]
    slowest, fastest = ship.card.model.speed_range_mps
    rows = []
    for order, rpm in orders_and_rpm:
        speed = steady_speed(ship, rpm * _RADIANS_PER_S) if rpm > 0 else None
        proportional = ship.card.model.speed_mps * rpm / nominal
        within = speed is None or (slowest <= speed <= fastest and abs(speed / proportional - 1) <= FOLLOWS)
        rows.append(Telegraph(order, rpm, speed, within))
    return tuple(rows)


def _depths(ship: TrialShip) -> dict[str, dict[str, float]]:
    """Inputs in deep and in shallow water; shallow only where the card has the effect and a draught."""
    draught = mean_draught(ship.card)
    if "water.depth" not in ship.model.input_names or draught is None:
        return {"deep": {}}
    return {"deep": {"water.depth": DEEP * draught}, "shallow": {"water.depth": SHALLOW * draught}}


def _circles(
    ship: TrialShip, rudder: float, depths: Mapping[str, Mapping[str, float]]
) -> tuple[dict[str, list[ShipTrack]], list[Notice]]:
    """Circles by depth, to starboard and port, with notices."""
    found: dict[str, list[ShipTrack]] = {}
    messages = []
    if rudder > TRIAL_RUDDER * (1 + 1e-9):
        shown = f"{math.degrees(rudder):.3g} deg, the largest of the gear"
        messages.append(Notice(f"turning circles with {shown}: the card does not say how far its rudder was tested"))
    for where, inputs in depths.items():
        for side, sign in (("starboard", 1.0), ("port", -1.0)):
            name = f"turn to {side}, {where} water"
            run = ship.run(Turn(sign * rudder), inputs=inputs)
            if isinstance(run, str):
                messages.append(Notice(f"{name}: {run}"))
                continue
            track = circle_track(side, run)
            found.setdefault(where, []).append(track)
            messages += _range_exit_notice(name, track.range_exit)
    return found, messages


def _range_exit_notice(name: str, exit_mark: TrackMark | None) -> list[Notice]:
    """Notice on the point where a run leaves the card's range."""
    if exit_mark is None:
        return []
    turned = f" and {exit_mark.heading_change_deg:.0f}° of heading" if abs(exit_mark.heading_change_deg) >= 1 else ""
    place = f"after {exit_mark.time_s:.0f} s{turned}, at {exit_mark.speed_mps:.3g} m/s"
    return [Notice(f"{name}: leaves the card's range {place}: later values are omitted")]


def _stops(ship: TrialShip, inputs: Mapping[str, float]) -> tuple[tuple[ShipTrack, ...], list[Notice]]:
    if not ship.has_engine:
        return (), []
    found, messages = [], []
    for name, manoeuvre in (
        (f"full astern ({FULL_ASTERN:.0%} of nominal)", Stop()),
        (f"engine stopped, to {COASTING_END:.0%} of speed", Stop(0.0)),
    ):
        run = ship.run(manoeuvre, inputs=inputs)
        if isinstance(run, str):
            messages.append(Notice(f"{name}: {run}"))
            continue
        messages += [notice.of(name) for notice in run.missing]
        track = stop_track(name, run)
        found.append(track)
        messages += _range_exit_notice(name, track.range_exit)
    return tuple(found), messages


def _stops_from(ship: TrialShip, telegraph: Sequence[Telegraph], inputs: Mapping[str, float]) -> tuple[StopFrom, ...]:
    found = []
    for entry in telegraph:
        if entry.speed_mps is None or not entry.within:
            continue
        run = ship.run(Stop(), {"initial.u": entry.speed_mps}, inputs)
        read = _read(run)
        reach, time = (read.figures.get(name) for name in ("track_reach_m", "time_to_stop_s"))
        order = entry.order or f"{entry.rpm:.4g} rpm"
        found.append(StopFrom(order, entry.speed_mps, reach, time, not read.outside("track_reach_m")))
    return tuple(found)


def _read(run: Run | str) -> CardRangeReading:
    return NOTHING_READ if isinstance(run, str) else run.reading


def _neutral(ship: TrialShip) -> float | None:
    try:
        course = straight_course(ship.model, ship.card.model.speed_mps)
    except InputError:
        return None
    angle = math.degrees(course.x[ship.model.state_names.index("rudder.angle")])
    # A card without any asymmetry does not say that the ship has none.
    return angle if abs(angle) > 1e-6 else None


def _zigzags(ship: TrialShip, inputs: Mapping[str, float]) -> dict[str, CardRangeReading]:
    found = {}
    for angle in (10.0, 20.0):
        for name, sign in (("starboard", 1.0), ("port", -1.0)):
            run = ship.run(Zigzag(sign * math.radians(angle), math.radians(angle)), inputs=inputs)
            found[f"{angle:g}/{angle:g} first to {name}"] = _read(run)
    return found
