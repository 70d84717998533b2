"""Manoeuvres and steady legs of a voyage, found by its orders and what the vessel did.

Orders are taken apart where they jump into pieces; a piece is known by its rudder (or the difference of two thrusters),
its propulsion and the speed; pieces that belong together are one stretch: a zigzag is a row of opposite rudders.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

from tank2sim.apps.logs.content import steering_evidence
from tank2sim.apps.logs.reference import differenced, held, interpolated
from tank2sim.apps.logs.voyage import QuantitySeries, Voyage, ground_velocity
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

HELD_RUDDER_RAD = math.radians(4.0)
"""Rudder from which on a vessel is steered to turn. Project choice: course keeping in fair weather stays below, and the
smallest standard manoeuvre, the 5/5 zigzag, is above."""

HELD_SHARE = 0.1
"""Difference of two thrusters, as a share of full, that counts as :data:`HELD_RUDDER_RAD` does: 4 of 35 deg."""

JUMP_S = 2.0
"""Time in which an order changes by more than a half of its threshold where it jumps, s. Project choice: steering gear
turns by 2.3 deg/s and more (SOLAS II-1, regulation 29.3.2), helmsmen's corrections are slower or smaller."""

SPLINTER_S = 5.0
"""Stretches of a craft that are shorter go with their neighbour, s. Project choice: the time before the execute, with
which a trial begins, would be most of theirs."""

PROPULSION_STEP = 0.1
"""Change of propulsion, as a share of its largest, that is an order. Project choice: governors hold 2 %."""

STOPPED_SHARE = 0.05
"""Propulsion below this share of its largest is stopped. Project choice: idling and dead bands are below."""

RESTING_MPS = 0.25
"""Speed below which a vessel rests, m/s: drifting with wind and current."""

UNDER_WAY_MPS = 1.0
"""Steady speed from which a vessel does not rest though its propulsion is stopped, m/s. Project choice: twice what
currents usually are; sails or an engine that is not in the log drive it."""

SPEED_CHANGE = 0.15
"""Relative change of speed in a piece without steering from which it is an acceleration. Project choice."""

LEAST_TURN_RAD = math.radians(15.0)
"""Change of heading of a piece from which it is a turn. Project choice: below, a correction of the course."""

LEAST_TURN_S = 5.0
"""Shortest turn, s. Project choice: what is shorter checks the swing after another manoeuvre."""

LEAST_TRIAL_ROWS = 30
"""Samples of the heading in a stretch from which it becomes a trial. Project choice."""


class StretchKind(StrEnum):
    """Kinds of a stretch."""

    ZIGZAG = "zigzag"
    TURN = "turn"
    STEPS = "steps"
    PIVOT = "pivot"
    ACCELERATE = "accelerate"
    COAST = "coast"
    STOP = "stop"
    ASTERN = "astern"
    STEADY = "steady"
    REST = "rest"

    @property
    def excites(self) -> bool:
        """Whether it reveals more of the vessel than a straight course does."""
        return self not in (StretchKind.STEADY, StretchKind.REST)


@dataclass(frozen=True)
class Stretch:
    """A part of a voyage.

    Parameters
    ----------
    kind : StretchKind
    begin_s, end_s : float
        In the time of the voyage; the begin is the execute.
    rudder_rad : float
        First held rudder, rad, positive to starboard; of thrusters their difference (port - starboard) as a share; nan
        without.
    heading_change_rad : float
    reversals : int
        Changes of the side of the rudder.
    speed_mps : tuple of float
        At the begin, the least and the largest; nan where no speed is known.
    yaw_rate_radps : float
        Root mean square.
    """

    kind: StretchKind
    begin_s: float
    end_s: float
    rudder_rad: float
    heading_change_rad: float
    reversals: int
    speed_mps: tuple[float, float, float]
    yaw_rate_radps: float

    @property
    def duration_s(self) -> float:
        """How long it lasts."""
        return self.end_s - self.begin_s


@dataclass(frozen=True, eq=False)
class _Signals:
    """Orders and motion on one grid; steering and propulsion as multiples of their thresholds' units."""

    time: Array
    steering: Array
    threshold: float
    propulsion: Array
    full: float
    speed: Array
    ahead: Array
    heading: Array
    rate: Array
    rest_s: float

    @property
    def step(self) -> float:
        """s."""
        return float(self.time[1] - self.time[0])

    @property
    def ship(self) -> bool:
        """Whether it has a rudder."""
        return self.threshold == HELD_RUDDER_RAD

    def held(self, begin: int, end: int) -> Array:
        """Steering where it does not move to another order."""
        values = self.steering[begin:end]
        reach = max(1, round(JUMP_S / self.step))
        still = np.abs(values[reach:] - values[:-reach]) < 0.5 * self.threshold
        return values[reach:][still] if len(values) > reach else values[:0]

    def lasted(self, piece: _Piece) -> float:
        """Duration of a piece, s."""
        return (piece.end - piece.begin) * self.step

    def turned(self, piece: _Piece) -> float:
        """Change of heading in a piece, rad."""
        heading = self.heading[piece.begin : piece.end]
        return float(heading[-1] - heading[0]) if len(heading) else 0.0

    def steered(self, piece: _Piece) -> bool:
        """Whether a piece has a rudder order."""
        return abs(piece.level) > self.threshold

    def same_power(self, first: _Piece, second: _Piece, steps: float = 1.0) -> bool:
        """Whether two pieces have the same propulsion; also if it is not known."""
        return not abs(second.propulsion - first.propulsion) > steps * PROPULSION_STEP * self.full


@dataclass(frozen=True)
class _Piece:
    begin: int
    end: int  # one past the last sample
    kind: StretchKind = StretchKind.STEADY
    level: float = 0.0
    propulsion: float = math.nan


def find_stretches(voyage: Voyage) -> tuple[Stretch, ...]:
    """Find all stretches of a voyage in the order of time; empty where neither rudder nor thrusters are known."""
    signals = _signals(voyage)
    if signals is None:
        return ()
    pieces = [_piece(signals, begin, end) for begin, end in _cuts(signals)]
    pieces = _folded(pieces, partial(_with_movement, signals))
    groups = _grouped(pieces, partial(_belongs, signals))
    pieces = _steps(signals, [piece for group in groups for piece in _manoeuvres(signals, group)])
    pieces = _folded(pieces, partial(_continued, signals))
    if not signals.ship:
        pieces = _folded(pieces, partial(_with_splinter, signals))
    return tuple(_stretch(signals, piece) for piece in pieces)


def _folded(pieces: Iterable[_Piece], join: Callable[[_Piece, _Piece], _Piece | None]) -> list[_Piece]:
    """Pieces, each joined with the one before where `join` gives their whole."""
    out: list[_Piece] = []
    for piece in pieces:
        whole = join(out[-1], piece) if out else None
        out[-1:] = [*out[-1:], piece] if whole is None else [whole]
    return out


def _grouped(pieces: Iterable[_Piece], belongs: Callable[[Sequence[_Piece], _Piece], bool]) -> list[list[_Piece]]:
    """Pieces in groups; each `belongs` to the group before it."""
    groups: list[list[_Piece]] = []
    for piece in pieces:
        if groups and belongs(groups[-1], piece):
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return groups


def _signals(voyage: Voyage) -> _Signals | None:
    series = voyage.series
    steering = _steering(series)
    if steering is None or len(steering[0].time_s) < LEAST_TRIAL_ROWS:
        return None
    entry, threshold = steering
    step = float(np.clip(usual_step(entry.time_s), 0.2, 1.0))
    time = np.arange(entry.time_s[0], entry.time_s[-1], step)
    if len(time) < LEAST_TRIAL_ROWS:  # many samples of a few instants
        return None
    steer = median_filter(_on_grid(time, entry), size=3, mode="nearest")
    propulsion = _propulsion(series, time)
    full = max(float(np.nanpercentile(np.abs(propulsion), 99)), 1e-9) if np.isfinite(propulsion).any() else 1.0
    unknown = QuantitySeries(time, np.full(len(time), np.nan))
    heading = series.get("heading", series.get("magnetic_heading", unknown))
    rate = series.get("yaw_rate", QuantitySeries(*differenced(heading.time_s, heading.values, 2.0)))
    rate = rate if len(rate.time_s) else unknown
    lag = steering_evidence(time, steer, rate.time_s, rate.values).lag_s
    at_heading, at_rate = (np.interp(time, entry.time_s, entry.values) for entry in (heading, rate))
    rest = float(np.clip(2 * lag, 2.0, 30.0))
    speeds = _speed(series, time), _speed_ahead(series, time)
    return _Signals(time, steer, threshold, propulsion, full, *speeds, at_heading, at_rate, rest)


def _thrusters(series: Mapping[str, QuantitySeries]) -> tuple[str, QuantitySeries, QuantitySeries] | None:
    """Orders of two thrusters, else their revolutions, and which of these they are."""
    for stem in ("thrust_order", "rpm"):
        port, starboard = series.get(f"{stem}_port"), series.get(f"{stem}_starboard")
        if port and starboard:
            return stem, port, starboard
    return None


def _steering(series: Mapping[str, QuantitySeries]) -> tuple[QuantitySeries, float] | None:
    """The order of the rudder, or its angle, or the difference of two thrusters; and the threshold of steering."""
    rudder = series.get("rudder_order", series.get("rudder_angle"))
    if rudder is not None:
        return rudder, HELD_RUDDER_RAD
    if (pair := _thrusters(series)) is None:
        return None
    stem, port, starboard = pair
    full = 1.0 if stem == "thrust_order" else max(float(np.percentile(np.abs(port.values), 99)), 1e-9)
    other = np.interp(port.time_s, starboard.time_s, starboard.values)
    return QuantitySeries(port.time_s, (port.values - other) / full / 2), HELD_SHARE / 2


def _propulsion(series: Mapping[str, QuantitySeries], time: Array) -> Array:
    """Order of the propulsion (n,), or revolutions; nan without."""
    entry = series.get("rpm_order", series.get("rpm"))
    if entry is not None:
        return np.asarray(median_filter(_on_grid(time, entry), size=5, mode="nearest"))
    if (pair := _thrusters(series)) is None:
        return np.full(len(time), np.nan)
    return np.asarray(median_filter(0.5 * (_on_grid(time, pair[1]) + _on_grid(time, pair[2])), size=3, mode="nearest"))


def _on_grid(time: Array, entry: QuantitySeries) -> Array:
    """Values of an order or a measured signal (n,), held, for orders are."""
    values = held(time, entry.time_s, entry.values)
    return np.where(np.isfinite(values), values, entry.values[0])


def _speed(series: Mapping[str, QuantitySeries], time: Array) -> Array:
    """Speed (n,), through the water where it is known, m/s; nan without."""
    entry = next((series[name] for name in ("u_water", "sog", "u_ground") if name in series), None)
    if entry is not None:
        return np.abs(interpolated(time, entry.time_s, entry.values, 30.0))
    if (ground := ground_velocity(series)) is None:
        return np.full(len(time), np.nan)
    return interpolated(time, ground[0], np.hypot(*ground[1:]), 30.0)


def _speed_ahead(series: Mapping[str, QuantitySeries], time: Array) -> Array:
    """Speed ahead over the ground (n,), m/s, negative astern; nan without a heading."""
    heading, ground = series.get("heading"), ground_velocity(series)
    if heading is None or ground is None:
        return np.full(len(time), np.nan)
    angle = interpolated(ground[0], heading.time_s, heading.values, 10.0)
    return interpolated(time, ground[0], ground[1] * np.cos(angle) + ground[2] * np.sin(angle), 30.0)


def _cuts(signals: _Signals) -> list[tuple[int, int]]:
    """Begin and end of pieces between jumps of the orders; a piece begins where its jump does."""
    count, jumping = len(signals.time), np.zeros(len(signals.time), dtype=bool)
    jumping[_jumps(signals, signals.steering, 0.75 * signals.threshold)] = True
    jumping[_jumps(signals, signals.propulsion, PROPULSION_STEP * signals.full)] = True
    _mark_slow_returns(signals, jumping)
    least = max(2, round(1.5 / signals.step))
    kept = [0]
    kept += [int(edge) for edge in np.flatnonzero(jumping) if edge - kept[-1] >= least and count - edge >= least]
    return list(pairwise([*kept, count]))


def _jumps(signals: _Signals, values: Array, least: float) -> list[int]:
    """Samples at which an order begins to change by more than `least` within :data:`JUMP_S`."""
    reach = max(1, round(JUMP_S / signals.step))
    change = values[reach:] - values[:-reach]
    moved = np.abs(change) > least
    begins = np.flatnonzero(moved & ~np.concatenate([[False], moved[:-1]]))
    steps = [np.abs(np.diff(values[place : place + reach + 1])) > 0.2 * least for place in begins]
    jumps = [int(place + np.argmax(step)) + 1 for place, step in zip(begins, steps, strict=True)]
    # Within a long movement there may be another order: a reversal of the movement itself.
    slope = np.sign(change) * moved
    return [*jumps, *(np.flatnonzero(slope[1:] * slope[:-1] < 0) + reach // 2 + 1)]


def _mark_slow_returns(signals: _Signals, jumping: np.ndarray) -> None:
    """Mark where a rudder rests after it was brought back slowly, without a jump."""
    settling = round(signals.rest_s / signals.step)
    inactive = np.abs(signals.steering) < signals.threshold
    turns = [0, *(np.flatnonzero(np.diff(inactive.astype(int))) + 1), len(inactive)]
    for begin, end in pairwise(turns):
        rests = inactive[begin] and begin > settling and end - begin >= settling
        if rests and not jumping[begin - settling : begin].any():
            jumping[begin] = True


def _piece(signals: _Signals, begin: int, end: int) -> _Piece:
    third = (end - begin) // 3
    late = slice(begin + third, end)  # free of the movement to the new order
    level = float(np.median(signals.steering[late]))
    early = float(np.median(signals.steering[begin : begin + max(2, third)]))
    back = abs(level) < signals.threshold < abs(early) and end - begin > 4
    if back and abs(signals.turned(_Piece(begin, end))) > LEAST_TURN_RAD:
        level = early
    piece = _Piece(begin, end, level=level, propulsion=float(np.median(signals.propulsion[late])))
    return replace(piece, kind=_kind(signals, piece))


def _kind(signals: _Signals, piece: _Piece) -> StretchKind:
    """Kind of a piece by its orders and the speed: the first that applies."""
    first, last, usual, most = _speeds(signals.speed[piece.begin : piece.end])
    share = piece.propulsion / signals.full
    stopped, moved, unknown = abs(share) <= STOPPED_SHARE, most > RESTING_MPS, math.isnan(most)
    if share < -STOPPED_SHARE:
        way_on = first > 2 * RESTING_MPS and not _speeds(signals.ahead[piece.begin : piece.end])[0] < 0
        return StretchKind.STOP if way_on and last < first else StretchKind.ASTERN
    if signals.steered(piece):
        return StretchKind.PIVOT if stopped and not signals.ship else StretchKind.TURN
    if moved and abs(last - first) / max(first, last, 1e-9) > SPEED_CHANGE:
        return StretchKind.COAST if stopped else StretchKind.ACCELERATE
    steady = usual > UNDER_WAY_MPS if stopped else moved or unknown
    return StretchKind.STEADY if steady else StretchKind.REST


def _speeds(speed: Array) -> tuple[float, float, float, float]:
    """Speed at the begin and at the end of a piece, its median and its largest, m/s; nan where none is known."""
    known = speed[np.isfinite(speed)]
    if not len(known):
        return (math.nan,) * 4
    tenth = max(1, len(known) // 10)
    first, last, usual = (float(np.median(part)) for part in (known[:tenth], known[-tenth:], known))
    return first, last, usual, float(np.max(known))


_UNSTEERED = (StretchKind.STEADY, StretchKind.ACCELERATE, StretchKind.COAST, StretchKind.REST, StretchKind.ASTERN)

_JOINABLE = (StretchKind.STEADY, StretchKind.REST, StretchKind.ASTERN)

FAR_TURN_RAD = math.radians(100.0)
"""Change of heading under one order from which it is a turn, and not a leg of a zigzag. Project choice: a leg of the
20/20 zigzag changes it by 40 deg, and an overshoot comes back."""

CHANGED_COURSE_RAD = math.radians(45.0)
"""Change of heading from which a rudder's order is a turn, and not a step. Project choice: steps leave the course as
it is in the mean."""

_OTHER_ORDER = 0.3
"""Relative difference from which two rudders to one side are two orders. Project choice: corrections of a helmsman are
smaller in the mean, the step from 20 to 35 deg is larger."""

# Least change between samples, over the threshold, of a rudder on its way: a fifth of what gear turns in 0.2 s
_MOVING = 0.1

_ALIKE = 0.4
"""Relative difference of the orders of a zigzag. Project choice: ITTC's are equal; angles differ by the gear."""

_FOLLOWING = 0.7
"""Share of the legs of a zigzag in which the heading follows the order (project choice)."""

_STEPS_LEAST = 4
"""Short stretches in a row that are one of steps. Project choice: fewer are an approach and a manoeuvre."""

_STEPS_LONGEST = 2.5
"""Longest of them, as a multiple of the time that the vessel needs to settle. Project choice."""


def _with_movement(signals: _Signals, last: _Piece, piece: _Piece) -> _Piece | None:
    """A piece with the one before, if that is the way to its order: short, or a change of propulsion throughout."""
    lasted, power = signals.lasted(last), signals.propulsion[last.begin : last.end]
    changes = lasted < signals.rest_s and bool(np.ptp(power) > PROPULSION_STEP * signals.full)
    straight = piece.kind in (*_UNSTEERED, StretchKind.STOP) and abs(piece.level) < signals.threshold
    way = last.kind in _UNSTEERED and (lasted < JUMP_S or (changes and straight))
    return _piece(signals, last.begin, piece.end) if way else None


def _continued(signals: _Signals, last: _Piece, piece: _Piece) -> _Piece | None:
    """A piece that is the same as the one before, or the end of its acceleration, with it."""
    same = last.kind == piece.kind and piece.kind in _JOINABLE
    settled = (last.kind, piece.kind) == (StretchKind.ACCELERATE, StretchKind.STEADY)
    brief = signals.lasted(piece) < 2 * signals.rest_s
    return replace(last, end=piece.end) if same or (settled and brief) else None


def _with_splinter(signals: _Signals, last: _Piece, piece: _Piece) -> _Piece | None:
    """Two pieces of a craft that excite it, of which one is short: steps."""
    if not (last.kind.excites and piece.kind.excites) or min(map(signals.lasted, (last, piece))) >= SPLINTER_S:
        return None
    return replace(last, end=piece.end, kind=StretchKind.STEPS)


def _steps(signals: _Signals, pieces: list[_Piece]) -> list[_Piece]:
    """Rows of at least :data:`_STEPS_LEAST` short stretches as one of steps each."""

    def short(piece: _Piece) -> bool:
        far = signals.ship and abs(signals.turned(piece)) > CHANGED_COURSE_RAD
        brief = signals.lasted(piece) < _STEPS_LONGEST * signals.rest_s
        return brief and piece.kind not in (StretchKind.ZIGZAG, StretchKind.REST) and not far

    out: list[_Piece] = []
    for is_short, members in itertools.groupby(pieces, short):
        row = list(members)
        if is_short and len(row) >= _STEPS_LEAST and sum(map(signals.steered, row)) > 1:
            row = [_whole(row, StretchKind.STEPS)]
        out += row
    return out


def _belongs(signals: _Signals, group: Sequence[_Piece], piece: _Piece) -> bool:
    """Whether a piece belongs to the manoeuvre of those before."""
    last = group[-1]
    turning = (StretchKind.TURN, StretchKind.PIVOT)
    brief = signals.lasted(piece) < signals.rest_s
    if last.kind not in turning or not signals.same_power(last, piece):
        return False
    if piece.kind in turning:
        pivots = last.kind == piece.kind is StretchKind.PIVOT
        return not _amidships(signals, last) and (brief or not pivots)
    return brief and piece.kind in (StretchKind.STEADY, StretchKind.ACCELERATE)


def _manoeuvres(signals: _Signals, group: Sequence[_Piece]) -> list[_Piece]:
    """The manoeuvres of a group: zigzags, turns, and what is left, as one of steps each."""
    if len(group) == 1:
        return [_single(signals, group[0])]
    legs = _legs(signals, group)
    out: list[_Piece] = []
    others: list[_Piece] = []
    place = 0
    while place < len(legs):
        count, kind = _zigzag_length(signals, legs[place:]), StretchKind.ZIGZAG
        if not count and _turns_far(signals, legs[place]):
            checked = place + 1 < len(legs) and _checks_swing(signals, *legs[place : place + 2])
            count, kind = 1 + checked, legs[place].kind
        if count:
            out += [*_remaining(signals, others), _whole(legs[place : place + count], kind)]
            others, place = [], place + count
        else:
            others.append(legs[place])
            place += 1
    if out and len(others) == 1 and _checks_swing(signals, legs[-2], others[0]):
        out[-1], others = replace(out[-1], end=others[0].end), []
    return out + _remaining(signals, others)


def _single(signals: _Signals, piece: _Piece) -> _Piece:
    """A piece alone: without a change of heading it is not a turn."""
    little = abs(signals.turned(piece)) < LEAST_TURN_RAD or signals.lasted(piece) < LEAST_TURN_S
    return replace(piece, kind=StretchKind.STEADY) if piece.kind is StretchKind.TURN and little else piece


def _legs(signals: _Signals, group: Sequence[_Piece]) -> list[_Piece]:
    """Pieces of a group to one side as one each: a helmsman's corrections of an order belong to it."""
    sides = _grouped(group, partial(_is_to_one_side, signals))
    legs = [leg for pieces in sides for leg in _levels(signals, pieces)]
    for place, (last, leg) in enumerate(pairwise(legs)):
        begin = _movement_begin(signals, leg, last.begin)
        legs[place : place + 2] = replace(legs[place], end=begin), replace(leg, begin=begin)
    return legs


def _is_to_one_side(signals: _Signals, leg: Sequence[_Piece], piece: _Piece) -> bool:
    """Whether a piece has the power of a leg, and its side or none."""
    same = signals.same_power(leg[0], piece)
    return same and (_amidships(signals, piece) or leg[0].level * piece.level > 0)


def _amidships(signals: _Signals, piece: _Piece) -> bool:
    """Whether the rudder is amidships at the end of a piece: for a moment, or brought back slowly."""
    late = signals.steering[(piece.begin + piece.end) // 2 : piece.end]
    return bool(abs(np.median(late)) <= signals.threshold)


def _levels(signals: _Signals, pieces: Sequence[_Piece]) -> list[_Piece]:
    """Pieces to one side as one leg, or as several where an order goes over into another for long."""
    steered = [piece.end for piece in pieces if not _amidships(signals, piece)]
    begin, end = pieces[0].begin, steered[-1] if steered else pieces[-1].end
    settled = signals.rest_s / signals.step
    costs: dict[int, float] = {}
    for place, piece in enumerate(pieces):
        parts = signals.held(begin, piece.begin), signals.held(piece.begin, end)
        if min(map(len, parts)) > settled:
            before, after = map(np.median, parts)
            if abs(after - before) > max(_OTHER_ORDER * max(abs(before), abs(after)), signals.threshold):
                costs[place] = float(np.abs(parts[0] - before).sum() + np.abs(parts[1] - after).sum())
    if costs:
        place = min(costs, key=costs.__getitem__)
        return [*_levels(signals, pieces[:place]), *_levels(signals, pieces[place:])]
    held_orders = signals.held(begin, end)
    level = float(np.median(held_orders)) if len(pieces) > 1 and len(held_orders) else pieces[0].level
    return [replace(pieces[0], end=pieces[-1].end, level=level)]


def _movement_begin(signals: _Signals, leg: _Piece, least: int) -> int:
    """The sample from which the rudder moves to the order of a leg, after sample `least`."""
    begin, towards = leg.begin, math.copysign(1.0, leg.level) * np.diff(signals.steering)
    while begin - 1 > least and towards[begin - 1] > _MOVING * signals.threshold:
        begin -= 1
    return begin


def _zigzag_length(signals: _Signals, legs: Sequence[_Piece]) -> int:
    """How many of the first legs are a zigzag: opposite orders of one size that each turn the vessel; 0 for none."""
    count = 0
    while count < len(legs) and _is_next_leg(signals, legs[:count], legs[count]):
        count += 1
    following = sum(signals.turned(leg) * leg.level >= 0 for leg in legs[:count])
    return count if count > 2 and following > _FOLLOWING * count else 0


def _is_next_leg(signals: _Signals, legs: Sequence[_Piece], leg: _Piece) -> bool:
    """Whether a leg continues the legs of a zigzag: to the other side, of one size, with one power, and not far."""
    if legs and (leg.level * legs[-1].level >= 0 or not signals.same_power(legs[0], leg, 2.0)):
        return False
    sizes = [abs(each.level) for each in (*legs, leg)]
    return max(sizes) - min(sizes) < _ALIKE * max(sizes) and not _turns_far(signals, leg)


def _turns_far(signals: _Signals, leg: _Piece) -> bool:
    """Whether a leg turns farther than one of a zigzag does."""
    return leg.kind is StretchKind.TURN and signals.steered(leg) and abs(signals.turned(leg)) > FAR_TURN_RAD


def _checks_swing(signals: _Signals, turn: _Piece, check: _Piece) -> bool:
    """Whether the second of two legs checks the swing of the first: short and small, or the heading does not follow."""
    small = signals.lasted(check) < signals.rest_s and abs(check.level) < 0.5 * abs(turn.level)
    follows = signals.turned(check) * check.level > 0
    return turn.level * check.level < 0 and (not follows or small)


def _remaining(signals: _Signals, legs: Sequence[_Piece]) -> list[_Piece]:
    """Legs that are neither a zigzag nor far turns."""
    if len(legs) < 2:
        return [_single(signals, leg) for leg in legs]
    # What its first piece and others of the same side do not last checks the swing.
    main = sum(leg.end - leg.begin for leg in legs if leg.level * legs[0].level > 0)
    share = main / (legs[-1].end - legs[0].begin)
    if sum(map(signals.steered, legs)) <= 2 and share > 0.8:
        return [_whole(legs, StretchKind.PIVOT if legs[0].kind is StretchKind.PIVOT else StretchKind.TURN)]
    return [_whole(legs, StretchKind.STEPS)]


def _whole(legs: Sequence[_Piece], kind: StretchKind) -> _Piece:
    return replace(legs[0], end=legs[-1].end, kind=kind)


def _stretch(signals: _Signals, piece: _Piece) -> Stretch:
    part = slice(piece.begin, piece.end)
    rate, speed, steering = signals.rate[part], signals.speed[part], signals.steering[part]
    sides = np.sign(steering[np.abs(steering) > signals.threshold])
    known = speed[np.isfinite(speed)]
    speeds = (float(known[0]), float(known.min()), float(known.max())) if len(known) else (math.nan,) * 3
    return Stretch(
        kind=piece.kind,
        begin_s=float(signals.time[piece.begin]),
        end_s=float(signals.time[min(piece.end, len(signals.time) - 1)]),
        rudder_rad=piece.level if piece.kind not in (StretchKind.STEADY, StretchKind.REST) else math.nan,
        heading_change_rad=signals.turned(piece),
        reversals=int((sides[1:] != sides[:-1]).sum()),
        speed_mps=(speeds[0], speeds[1], speeds[2]),
        yaw_rate_radps=float(np.sqrt(np.nanmean(rate**2))) if np.isfinite(rate).any() else math.nan,
    )
