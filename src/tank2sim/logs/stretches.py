"""Manoeuvres and steady legs of a voyage, found by its orders and what the vessel did.

Orders are taken apart where they jump into pieces; a piece is known by its rudder (or the difference of two thrusters),
its propulsion and the speed; pieces that belong together are one stretch: a zigzag is a row of opposite rudders.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.ndimage import median_filter

from tank2sim.arrays import Array
from tank2sim.logs.clock import usual_step
from tank2sim.logs.content import steering_evidence
from tank2sim.logs.reference import differenced, held, interpolated
from tank2sim.logs.voyage import QuantitySeries, Voyage

HELD_RUDDER_RAD = math.radians(4.0)
"""Rudder from which on a vessel is steered to turn. Project choice: course keeping in fair weather stays below, and the
smallest standard manoeuvre, the 5/5 zigzag, is above."""

HELD_SHARE = 0.1
"""Difference of two thrusters, as a share of full, that counts as :data:`HELD_RUDDER_RAD` does: 4 of 35 deg."""

JUMP_S = 2.0
"""Time in which an order changes by more than a half of its threshold where it jumps, s. Project choice: steering gear
turns by 2.3 deg/s and more (SOLAS II-1, regulation 29.3.2), helmsmen's corrections are slower or smaller."""

PROPULSION_STEP = 0.1
"""Change of propulsion, as a share of its largest, that is an order. Project choice: governors hold 2 %."""

STOPPED_SHARE = 0.05
"""Propulsion below this share of its largest is stopped. Project choice: idling and dead bands are below."""

RESTING_MPS = 0.25
"""Speed below which a vessel rests, m/s: drifting with wind and current."""

SPEED_CHANGE = 0.15
"""Relative change of speed in a piece without steering from which it is an acceleration. Project choice."""

LEAST_TURN_RAD = math.radians(15.0)
"""Change of heading of a piece from which it is a turn. Project choice: below, a correction of the course."""

LEAST_TURN_S = 5.0
"""Shortest turn, s. Project choice: what is shorter checks the swing after another manoeuvre."""

LEAST_TRIAL_ROWS = 30
"""Samples of the heading in a stretch from which it becomes a trial. Project choice."""


class StretchKind(StrEnum):
    """What a stretch is."""

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
    heading: Array
    rate: Array
    rest_s: float


@dataclass(frozen=True)
class _Piece:
    begin: int
    end: int  # one past the last sample
    kind: StretchKind
    level: float
    propulsion: float


def find_stretches(voyage: Voyage) -> tuple[Stretch, ...]:
    """Find all stretches of a voyage in the order of time; empty where neither rudder nor thrusters are known."""
    signals = _signals(voyage)
    if signals is None:
        return ()
    pieces = _merged(signals, [_piece(signals, begin, end) for begin, end in _cuts(signals)])
    return tuple(_stretch(signals, piece) for piece in pieces)


def _signals(voyage: Voyage) -> _Signals | None:
    series = voyage.series
    steering = _steering(series)
    if steering is None or len(steering[0].time_s) < LEAST_TRIAL_ROWS:
        return None
    entry, threshold = steering
    step = float(np.clip(usual_step(entry.time_s), 0.2, 1.0))
    time = np.arange(entry.time_s[0], entry.time_s[-1], step)
    steer = median_filter(_on_grid(time, entry), size=3, mode="nearest")
    propulsion, full = _propulsion(series, time)
    heading = series.get("heading", series.get("magnetic_heading"))
    at_heading = np.full(len(time), np.nan) if heading is None else np.interp(time, heading.time_s, heading.values)
    rate = _rate(series)
    at_rate = np.full(len(time), np.nan) if rate is None else np.interp(time, rate.time_s, rate.values)
    _, lag = steering_evidence(time, steer, *((rate.time_s, rate.values) if rate else (time, at_rate)))
    speed = _speed(series, time)
    return _Signals(
        time, steer, threshold, propulsion, full, speed, at_heading, at_rate, float(np.clip(2 * lag, 2.0, 30.0))
    )


def _steering(series: Mapping[str, QuantitySeries]) -> tuple[QuantitySeries, float] | None:
    """The order of the rudder, or its angle, or the difference of two thrusters; and the threshold of steering."""
    for name in ("rudder_order", "rudder_angle"):
        if name in series:
            return series[name], HELD_RUDDER_RAD
    for stem in ("thrust_order", "rpm"):
        port, starboard = series.get(f"{stem}_port"), series.get(f"{stem}_starboard")
        if port and starboard:
            other = np.interp(port.time_s, starboard.time_s, starboard.values)
            full = 1.0 if stem == "thrust_order" else max(float(np.percentile(np.abs(port.values), 99)), 1e-9)
            return QuantitySeries(port.time_s, (port.values - other) / full / 2), HELD_SHARE / 2
    return None


def _propulsion(series: Mapping[str, QuantitySeries], time: Array) -> tuple[Array, float]:
    """Order of the propulsion (n,), or revolutions, and its largest; nan without."""
    if (entry := series.get("rpm_order", series.get("rpm"))) is not None:
        values = median_filter(_on_grid(time, entry), size=5, mode="nearest")
    else:
        parts = []
        for stem in ("thrust_order", "rpm"):
            pair = [series.get(f"{stem}_{side}") for side in ("port", "starboard")]
            if all(part is not None for part in pair):
                parts = [_on_grid(time, part) for part in pair if part is not None]
                break
        if not parts:
            return np.full(len(time), np.nan), 1.0
        values = median_filter(0.5 * (parts[0] + parts[1]), size=3, mode="nearest")
    return values, max(float(np.nanpercentile(np.abs(values), 99)), 1e-9)


def _on_grid(time: Array, entry: QuantitySeries) -> Array:
    """Values of an order or a measured signal (n,), held, for orders are."""
    values = held(time, entry.time_s, entry.values)
    return np.where(np.isfinite(values), values, entry.values[0])


def _speed(series: Mapping[str, QuantitySeries], time: Array) -> Array:
    for name in ("u_water", "sog", "u_ground"):
        if name in series:
            values = interpolated(time, series[name].time_s, series[name].values, 30.0)
            return np.abs(values)
    if "x" in series:
        at, north = differenced(series["x"].time_s, series["x"].values, 4.0)
        _, east = differenced(series["y"].time_s, series["y"].values, 4.0)
        return interpolated(time, at, np.hypot(north, east), 30.0)
    return np.full(len(time), np.nan)


def _rate(series: Mapping[str, QuantitySeries]) -> QuantitySeries | None:
    if "yaw_rate" in series:
        return series["yaw_rate"]
    heading = series.get("heading", series.get("magnetic_heading"))
    if heading is None:
        return None
    return QuantitySeries(*differenced(heading.time_s, heading.values, 2.0))


def _cuts(signals: _Signals) -> list[tuple[int, int]]:
    """Begin and end of pieces between jumps of the orders; a piece begins where its jump does."""
    step = signals.time[1] - signals.time[0]
    reach = max(1, round(JUMP_S / step))
    jumping = np.zeros(len(signals.time), dtype=bool)
    for values, least in (
        (signals.steering, 0.75 * signals.threshold),
        (signals.propulsion, PROPULSION_STEP * signals.full),
    ):
        moved = np.abs(values[reach:] - values[:-reach]) > least
        for place in np.flatnonzero(moved & ~np.concatenate([[False], moved[:-1]])):
            window = np.abs(np.diff(values[place : place + reach + 1]))
            jumping[place + int(np.argmax(window > 0.2 * least)) + 1] = True
        # Within a long movement there may be another order: a reversal of the movement itself.
        slope = np.sign(values[reach:] - values[:-reach]) * moved
        for place in np.flatnonzero(slope[1:] * slope[:-1] < 0):
            jumping[place + reach // 2 + 1] = True
    inactive = np.abs(signals.steering) < signals.threshold
    turns = np.flatnonzero(np.diff(inactive.astype(int))) + 1
    for begin, end in zip([0, *turns], [*turns, len(inactive)], strict=True):
        settling = round(signals.rest_s / step)
        if (
            begin > settling
            and inactive[begin]
            and end - begin >= settling
            and not jumping[begin - settling : begin].any()
        ):
            jumping[begin] = True  # a rudder that was brought back slowly
    starts = np.flatnonzero(jumping)
    edges = np.unique(np.concatenate([[0], starts, [len(signals.time)]]))
    least = max(2, round(1.5 / step))
    kept = [int(edges[0])]
    kept += [int(edge) for edge in edges[1:-1] if edge - kept[-1] >= least and len(signals.time) - edge >= least]
    return list(zip(kept, [*kept[1:], len(signals.time)], strict=True))


def _piece(signals: _Signals, begin: int, end: int) -> _Piece:
    # The second half is free of the movement to the new order.
    late = slice(begin + (end - begin) // 3, end)
    level = float(np.median(signals.steering[late]))
    early = signals.steering[begin : begin + max(2, (end - begin) // 3)]
    if abs(level) < signals.threshold and abs(np.median(early)) > signals.threshold and end - begin > 4:
        level = float(np.median(early)) if abs(_turned(signals, begin, end)) > LEAST_TURN_RAD else level
    propulsion = float(np.median(signals.propulsion[late]))
    share = propulsion / signals.full
    speed = signals.speed[begin:end]
    known = speed[np.isfinite(speed)]
    first, last = (
        float(np.median(part)) if len(part) else math.nan
        for part in (known[: max(1, len(known) // 10)], known[-max(1, len(known) // 10) :])
    )
    change = abs(last - first) / max(first, last, 1e-9)
    turning = abs(level) > signals.threshold
    moved = len(known) > 0 and float(np.max(known)) > RESTING_MPS
    if not math.isnan(share) and share < -STOPPED_SHARE:
        kind = StretchKind.STOP if first > 2 * RESTING_MPS and last < first else StretchKind.ASTERN
    elif not math.isnan(share) and abs(share) <= STOPPED_SHARE:
        if turning:
            kind = StretchKind.PIVOT if signals.threshold != HELD_RUDDER_RAD else StretchKind.TURN
        else:
            kind = StretchKind.COAST if moved and change > SPEED_CHANGE else StretchKind.REST
    elif turning:
        kind = StretchKind.TURN
    elif moved and change > SPEED_CHANGE:
        kind = StretchKind.ACCELERATE
    else:
        kind = StretchKind.STEADY if moved or not len(known) else StretchKind.REST
    return _Piece(begin, end, kind, level, propulsion)


def _turned(signals: _Signals, begin: int, end: int) -> float:
    heading = signals.heading[begin:end]
    return float(heading[-1] - heading[0]) if len(heading) else 0.0


_UNSTEERED = (StretchKind.STEADY, StretchKind.ACCELERATE, StretchKind.COAST, StretchKind.REST, StretchKind.ASTERN)

_JOINABLE = (StretchKind.STEADY, StretchKind.REST, StretchKind.ASTERN)

_STEPS_LEAST = 4
"""Short stretches in a row that are one of steps. Project choice: fewer are an approach and a manoeuvre."""

_STEPS_LONGEST = 2.5
"""Longest of them, as a multiple of the time that the vessel needs to settle. Project choice."""


def _merged(signals: _Signals, pieces: list[_Piece]) -> list[_Piece]:
    """Pieces that belong together as one: zigzags, steps, slow changes of propulsion, short corrections between."""
    step = float(signals.time[1] - signals.time[0])
    joined: list[_Piece] = []
    for piece in pieces:
        last = joined[-1] if joined else None
        lasted = (last.end - last.begin) * step if last else math.inf
        moving = last is not None and lasted < signals.rest_s and _changes_power(signals, last)
        movement = lasted < JUMP_S or (moving and _straight(signals, piece))
        if last is not None and last.kind in _UNSTEERED and movement:
            joined[-1] = _piece(signals, last.begin, piece.end)
        else:
            joined.append(piece)
    groups: list[list[_Piece]] = []
    for piece in joined:
        brief = (piece.end - piece.begin) * step < signals.rest_s
        if groups and _belongs(signals, groups[-1], piece, brief):
            groups[-1].append(piece)
        else:
            groups.append([piece])
    out: list[_Piece] = []
    for piece in _steps(signals, [_joined(signals, group) for group in groups]):
        same = out and out[-1].kind == piece.kind and piece.kind in _JOINABLE
        settled = out and out[-1].kind is StretchKind.ACCELERATE and piece.kind is StretchKind.STEADY
        if same or (settled and (piece.end - piece.begin) * step < 2 * signals.rest_s):
            out[-1] = replace(out[-1], end=piece.end)
        else:
            out.append(piece)
    return out


def _changes_power(signals: _Signals, piece: _Piece) -> bool:
    """Whether the propulsion moves to another order throughout a piece."""
    values = signals.propulsion[piece.begin : piece.end]
    return bool(np.ptp(values) > PROPULSION_STEP * signals.full)


def _straight(signals: _Signals, piece: _Piece) -> bool:
    """Whether a piece is not steered."""
    return piece.kind in (*_UNSTEERED, StretchKind.STOP) and abs(piece.level) < signals.threshold


def _steps(signals: _Signals, pieces: list[_Piece]) -> list[_Piece]:
    """Rows of at least :data:`_STEPS_LEAST` short stretches as one of steps each."""
    step = float(signals.time[1] - signals.time[0])
    longest = _STEPS_LONGEST * signals.rest_s
    short = [
        (piece.end - piece.begin) * step < longest and piece.kind not in (StretchKind.ZIGZAG, StretchKind.REST)
        for piece in pieces
    ]
    out: list[_Piece] = []
    place = 0
    while place < len(pieces):
        length = next((n for n, is_short in enumerate(short[place:]) if not is_short), len(pieces) - place)
        steered = sum(abs(piece.level) > signals.threshold for piece in pieces[place : place + length])
        if length >= _STEPS_LEAST and steered > 1:
            out.append(replace(pieces[place], end=pieces[place + length - 1].end, kind=StretchKind.STEPS))
            place += length
        else:
            out.append(pieces[place])
            place += 1
    return out


def _belongs(signals: _Signals, group: Sequence[_Piece], piece: _Piece, brief: bool) -> bool:
    last = group[-1]
    same_power = abs(piece.propulsion - last.propulsion) <= PROPULSION_STEP * signals.full or math.isnan(
        piece.propulsion
    )
    steered = (StretchKind.TURN, StretchKind.PIVOT)
    if last.kind in steered and piece.kind in steered:
        if last.kind == piece.kind is StretchKind.PIVOT and not brief:
            return False
        return same_power
    return brief and same_power and last.kind in steered and piece.kind in (StretchKind.STEADY, StretchKind.ACCELERATE)


def _joined(signals: _Signals, group: Sequence[_Piece]) -> _Piece:
    while len(group) > 1 and group[-1].kind in (StretchKind.STEADY, StretchKind.ACCELERATE):
        group = [*group[:-2], replace(group[-2], end=group[-1].end)]
    begin, end, first = group[0].begin, group[-1].end, group[0]
    if len(group) == 1:
        kind = first.kind
        lasted = (end - begin) * float(signals.time[1] - signals.time[0])
        if kind is StretchKind.TURN and (abs(_turned(signals, begin, end)) < LEAST_TURN_RAD or lasted < LEAST_TURN_S):
            kind = StretchKind.STEADY
        return replace(first, kind=kind)
    levels = np.array([piece.level for piece in group if abs(piece.level) > signals.threshold])
    powers = np.array([piece.propulsion for piece in group])
    alternating = len(levels) > 2 and bool((levels[1:] * levels[:-1] < 0).mean() > 0.7)
    alike = float(np.ptp(np.abs(levels))) < 0.4 * float(np.max(np.abs(levels))) if len(levels) else False
    constant = np.isnan(powers).any() or np.ptp(powers) < 2 * PROPULSION_STEP * signals.full
    if alternating and alike and constant:
        kind = StretchKind.ZIGZAG
    elif len(levels) <= 2 and _main_share(group) > 0.8:
        kind = StretchKind.TURN if first.kind is not StretchKind.PIVOT else StretchKind.PIVOT
    else:
        kind = StretchKind.STEPS
    return replace(first, begin=begin, end=end, kind=kind)


def _main_share(group: Sequence[_Piece]) -> float:
    """Share of a group that its first piece and others of the same side last: what remains checks the swing."""
    same = sum(piece.end - piece.begin for piece in group if piece.level * group[0].level > 0)
    return same / (group[-1].end - group[0].begin)


def _stretch(signals: _Signals, piece: _Piece) -> Stretch:
    part = slice(piece.begin, piece.end)
    rate, speed = signals.rate[part], signals.speed[part]
    steering = signals.steering[part]
    sides = np.sign(steering[np.abs(steering) > signals.threshold])
    reversals = int((sides[1:] != sides[:-1]).sum())
    known = speed[np.isfinite(speed)]
    speeds = (float(known[0]), float(known.min()), float(known.max())) if len(known) else (math.nan,) * 3
    return Stretch(
        kind=piece.kind,
        begin_s=float(signals.time[piece.begin]),
        end_s=float(signals.time[min(piece.end, len(signals.time) - 1)]),
        rudder_rad=piece.level if piece.kind not in (StretchKind.STEADY, StretchKind.REST) else math.nan,
        heading_change_rad=_turned(signals, piece.begin, piece.end),
        reversals=reversals,
        speed_mps=(speeds[0], speeds[1], speeds[2]),
        yaw_rate_radps=float(np.sqrt(np.nanmean(rate**2))) if np.isfinite(rate).any() else math.nan,
    )
