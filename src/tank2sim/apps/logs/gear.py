"""Steering gear of a log: rate, lag and dead band by the rudder orders that it followed, and the angles it reached.

The gear follows an order d(t - T), T late, at a constant rate R: it starts when the rudder is further off than its dead
band b, and stops on the order (the drive of an autopilot that switches a pump or motor). R, T, b and a constant offset
are those with the least squares of simulated less recorded angles, found by grids that narrow. Standard errors are
from the jackknife that leaves out one of :data:`_BLOCKS` parts of the record after another (Efron and Tibshirani
1993, An Introduction to the Bootstrap, chapter 11).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.logs.voyage import Voyage
from tank2sim.arrays import Array, Number, true_runs

_BLOCKS = 8
"""Parts of a record for the jackknife (project choice: each has movements of its own in a minute or two)."""

_FEWEST_MOVES = 4
"""Changes of the order's direction of :data:`_MOVE` from which a gear is judged (project choice)."""

_MOVE = math.radians(1.0)
"""Least change of the order that counts as one (project choice: twice a usual dead band)."""

_STEP_S = 0.1
"""Step of the simulated gear, s (project choice: half the step of rudder messages)."""

_LONGEST_S = 120.0
"""Longest part of a record that is simulated, s: the one in which the order moves most (project choice)."""

_POINTS, _ROUNDS, _NARROWER = 7, 6, 0.45
"""Points of a grid along each of three axes, number of grids, and share of the axes that is kept (project choices)."""

_AGAIN = 3
"""Number of grids of the fits without a part, which begin near the fit of all (project choice)."""

_RATES, _LAGS, _BANDS = (math.radians(0.5), math.radians(60.0)), (0.0, 4.0), (0.0, math.radians(4.0))
"""Rates (rad/s), lags (s) and dead bands (rad) that are searched: wider than any gear needs (project choice)."""

_KNOWN = 1.2
"""Mean square at the largest rate over the least one from which the rate is determined: below, the order never left the
rudder behind (project choice)."""

_FOLLOWS = 0.5
"""Residual over the spread of the angle from which the rudder does not follow the order (project choice)."""

_STOP = math.radians(0.3)
"""Width of the angles that count as one stop (project choice: above the resolution of rudder sensors)."""

_FASTEST_S = 1.0
"""Time over which the fastest movement is taken, s (project choice: five readings of a usual sensor)."""

_STOP_S = 1.0
"""Time for which an angle was held at a stop, s (project choice)."""


@dataclass(frozen=True, kw_only=True)
class GearLimit:
    """The largest angle to one side, held for a second, with the scatter of its readings; both in deg."""

    angle_deg: Number
    standard_error_deg: Number


@dataclass(frozen=True, kw_only=True)
class LoggedGear:
    """Steering gear by a log.

    - `angle`, `order`: Streams of the rudder's angle and of its order.
    - `duration_s`: Time for which both were recorded.
    - `moves`: Movements of the order of a degree or more, counted from one change of side to the next.
    - `rate_degps`, `rate_error_degps`: Rate with its standard error; None where the order never left the rudder behind.
    - `lag_s`, `lag_error_s`: From the order to the first movement.
    - `dead_band_deg`, `dead_band_error_deg`: Difference from which the rudder moves.
    - `offset_deg`: Recorded angle less order at rest.
    - `fastest_degps`: Fastest movement over :data:`_FASTEST_S` in the whole record, also by hand: the gear's rate at
      least.
    - `residual_deg`: Root mean square of simulated less recorded angle.
    - `port`, `starboard`: Largest angles that were held, in the whole record; the gear may go further.
    """

    angle: str
    order: str
    duration_s: Number
    moves: int
    rate_degps: float | None
    rate_error_degps: float | None
    lag_s: Number
    lag_error_s: Number
    dead_band_deg: Number
    dead_band_error_deg: Number
    offset_deg: Number
    fastest_degps: Number
    residual_deg: Number
    port: GearLimit | None
    starboard: GearLimit | None

    @property
    def words(self) -> str:
        """The gear in a sentence."""
        rate = f"the orders do not show its rate (fastest movement {self.fastest_degps:.3g} deg/s)"
        if self.rate_degps is not None and self.rate_error_degps is not None:
            rate = f"{self.rate_degps:.3g} ± {self.rate_error_degps:.1g} deg/s"
        limits = [
            f"{abs(limit.angle_deg):.3g} ± {limit.standard_error_deg:.1g} deg to {side}"
            for side, limit in (("port", self.port), ("starboard", self.starboard))
            if limit
        ]
        held = f"; held at up to {' and '.join(limits)}" if limits else ""
        return (
            f"Steering gear by {self.moves} movements of the order: {rate}, {self.lag_s:.2g} ± {self.lag_error_s:.1g} "
            f"s late, dead band {self.dead_band_deg:.2g} ± {self.dead_band_error_deg:.1g} deg{held}."
        )


def logged_gear(voyage: Voyage) -> LoggedGear | None:
    """The steering gear by the rudder's angle and order of a voyage; None without both, or with too few movements.

    A rudder that the turn of the vessel does not confirm is taken, too: at the dock nothing follows it.
    """
    of_angle, of_order = (_rudder(voyage, quantity) for quantity in ("rudder_angle", "rudder_order"))
    if of_angle is None or of_order is None:
        return None
    (angle_name, time_s, angle), (order_name, order_s, order) = of_angle, of_order
    begin, end = _busiest(max(time_s[0], order_s[0]), min(time_s[-1], order_s[-1]), order_s, order)
    inside = (time_s >= begin) & (time_s <= end)
    asked = order[(order_s >= begin) & (order_s <= end)]
    moves = _moves(asked)
    if np.count_nonzero(inside) < 10 * _BLOCKS or moves < _FEWEST_MOVES:
        return None
    record = _Record(time_s[inside], angle[inside], order_s, order)
    best, squares = record.fit(np.ones(len(record.time_s)))
    if math.sqrt(squares) > _FOLLOWS * float(np.std(record.angle)):
        return None
    clocks = math.hypot(*(float(np.median(np.diff(times))) for times in (record.time_s, order_s)))
    least = [0.0, clocks / math.sqrt(12), math.radians(_resolution_deg(angle)), 0.0]
    errors = np.maximum(record.jackknife(best), least)
    at_once = record.simulate(np.array([_RATES[1]]), best[1:2], best[2:3])[:, 0] + best[3]
    known = float(np.mean((at_once - record.angle) ** 2)) > _KNOWN * squares
    degrees, errors_deg = np.degrees(best).tolist(), np.degrees(errors).tolist()
    return LoggedGear(
        angle=angle_name,
        order=order_name,
        duration_s=float(end - begin),
        moves=moves,
        rate_degps=degrees[0] if known else None,
        rate_error_degps=errors_deg[0] if known else None,
        lag_s=float(best[1]),
        lag_error_s=float(errors[1]),
        dead_band_deg=degrees[2],
        dead_band_error_deg=errors_deg[2],
        offset_deg=degrees[3],
        fastest_degps=_fastest_degps(time_s, angle),
        residual_deg=math.degrees(math.sqrt(squares)),
        port=_limit(time_s, angle, -1.0),
        starboard=_limit(time_s, angle, 1.0),
    )


def _rudder(voyage: Voyage, quantity: str) -> tuple[str, Array, Array] | None:
    """Stream, times and angles (rad) of a rudder: the channel in use, else the likeliest by its format."""
    streams = {stream.name: stream for log in voyage.logs for stream in log.streams}
    channels = [c for c in voyage.channels.channels if c.quantity == quantity and c.stream in streams]
    chosen = min(channels, key=lambda channel: (not channel.use, -channel.confidence), default=None)
    if chosen is None or (not chosen.use and not streams[chosen.stream].quantity):
        return None
    stream = streams[chosen.stream]
    time_s, values = stream.time_s - chosen.delay_s, chosen.si(stream.values)
    if chosen.use and quantity in voyage.series:
        time_s, values = voyage.series[quantity].time_s, voyage.series[quantity].values
    good = np.isfinite(time_s) & (np.abs(values) < math.pi)  # nan is not
    time_s, first = np.unique(time_s[good], return_index=True)
    return (chosen.stream, time_s, values[good][first]) if len(time_s) > 1 else None


def _moves(order: Array) -> int:
    """Movements of an order by :data:`_MOVE` or more to alternating sides."""
    count, low, high, side = 0, math.inf, -math.inf, 0
    for value in order:
        low, high = min(low, value), max(high, value)
        if value - low >= _MOVE and side <= 0:
            count, side, high = count + 1, 1, value
        elif high - value >= _MOVE and side >= 0:
            count, side, low = count + 1, -1, value
        if side > 0:
            low = max(low, value - _MOVE)
        elif side < 0:
            high = min(high, value + _MOVE)
    return count


def _busiest(begin_s: float, end_s: float, order_s: Array, order: Array) -> tuple[float, float]:
    """Begin and end of the part of a record, of :data:`_LONGEST_S` at most, in which the order moves most."""
    if end_s - begin_s <= _LONGEST_S:
        return begin_s, end_s
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(order)))])
    begins = order_s[(order_s >= begin_s) & (order_s <= end_s - _LONGEST_S)]
    if not len(begins):
        return begin_s, begin_s + _LONGEST_S
    moved = np.interp(begins + _LONGEST_S, order_s, way) - np.interp(begins, order_s, way)
    first = float(begins[int(np.argmax(moved))])
    return first, first + _LONGEST_S


def _fastest_degps(time_s: Array, angle: Array) -> float:
    """Largest change of the angle over :data:`_FASTEST_S` of readings without a gap, by this time, deg/s."""
    later = np.searchsorted(time_s, time_s + _FASTEST_S)
    begins = np.flatnonzero(later < len(time_s))
    lasts = time_s[later[begins]] - time_s[begins]
    usual = lasts < 2 * _FASTEST_S
    rates = np.abs(angle[later[begins]] - angle[begins])[usual] / lasts[usual]
    return math.degrees(float(np.max(rates, initial=0.0)))


def _limit(time_s: Array, angle: Array, side: float) -> GearLimit | None:
    """The largest angle of a side that was held; None where the rudder was never over to it."""
    sided = side * angle
    for largest in np.unique(np.round(sided / _STOP))[::-1] * _STOP:
        if largest <= _MOVE:
            return None
        there = np.abs(sided - largest) <= _STOP
        for run in true_runs(there):
            if time_s[run.stop - 1] - time_s[run.start] >= _STOP_S:
                held = angle[run]
                return GearLimit(
                    angle_deg=math.degrees(float(np.median(held))),
                    standard_error_deg=max(math.degrees(float(np.std(held))), _resolution_deg(angle)),
                )
    return None


def _resolution_deg(angle: Array) -> float:
    """Standard error of a reading by the least step between the values of a sensor, deg."""
    steps = np.diff(np.unique(np.round(angle, 7)))
    return math.degrees(float(np.min(steps))) / math.sqrt(12) if len(steps) else 0.0


@dataclass(frozen=True, eq=False)
class _Record:
    """Angles (rad) at times (s), and the order (rad) at its own times."""

    time_s: Array
    angle: Array
    order_s: Array
    order: Array

    def fit(self, weights: Array, near: Array | None = None) -> tuple[Array, float]:
        """Rate, lag, dead band and offset (4,) of the least weighted mean square, and this; sought `near` a fit."""
        bounds = np.array([np.log(_RATES), _LAGS, _BANDS]).T
        low, high, rounds = *bounds, _ROUNDS
        best, least = np.zeros(4), math.inf

        def about(found: Array, width: Array) -> Array:
            """Ends of the axes about a fit, within their bounds (2, 3)."""
            centre = np.array([math.log(found[0]), found[1], found[2]])
            return np.asarray(np.clip([centre - width / 2, centre + width / 2], *bounds))

        if near is not None:
            (low, high), rounds = about(near, _NARROWER ** (_ROUNDS - _AGAIN) * (high - low)), _AGAIN
        for _ in range(rounds):
            axes = [np.linspace(*ends, _POINTS) for ends in zip(low, high, strict=True)]
            points = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
            off = self.simulate(np.exp(points[0]), points[1], points[2]) - self.angle[:, None]
            offset = -weights @ off / weights.sum()
            squares = weights @ (off + offset) ** 2 / weights.sum()
            place = int(np.argmin(squares))
            if squares[place] < least:
                least = float(squares[place])
                best = np.array([math.exp(points[0, place]), *points[1:, place], offset[place]])
            low, high = about(best, _NARROWER * (high - low))
        return best, least

    def jackknife(self, best: Array) -> Array:
        """Standard errors (4,) of a fit, by the fits without one part of the record after another."""
        parts = []
        for block in np.array_split(np.arange(len(self.time_s)), _BLOCKS):
            weights = np.ones(len(self.time_s))
            weights[block] = 0.0
            parts.append(self.fit(weights, near=best)[0])
        return np.asarray(np.sqrt((_BLOCKS - 1) * np.var(parts, axis=0)))

    def simulate(self, rate: Array, lag: Array, band: Array) -> Array:
        """Angles (n, m) of gears with rates (rad/s), lags (s) and dead bands (rad), each (m,)."""
        steps = np.arange(self.time_s[0], self.time_s[-1] + _STEP_S, _STEP_S)
        found = np.empty((len(steps), len(rate)))
        lags, of_lag = np.unique(lag, return_inverse=True)
        rows = np.searchsorted(self.order_s, steps[:, None] - lags, side="right") - 1
        orders = self.order[np.clip(rows, 0, None)]
        angle = np.full(len(rate), self.angle[0])
        moving = np.zeros(len(rate), dtype=bool)
        for row in range(len(steps)):
            found[row] = angle
            off = orders[row, of_lag] - angle
            moving = (np.abs(off) > band) | (moving & (np.abs(off) > 0))
            angle = angle + np.where(moving, np.clip(off, -rate * _STEP_S, rate * _STEP_S), 0.0)
        place = np.clip((self.time_s - steps[0]) / _STEP_S, 0.0, len(steps) - 1.0)
        below = np.minimum(place.astype(int), len(steps) - 2)
        share = (place - below)[:, None]
        return np.asarray((1 - share) * found[below] + share * found[below + 1], dtype=np.float64)
