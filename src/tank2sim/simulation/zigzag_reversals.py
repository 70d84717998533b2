"""The heading at which a recorded zigzag was reversed, the course it is counted from, and the lag of the reversals.

They are fitted to all reversals together by least squares. Headings that differ from side to side, by more than their
scatter and the error of the course, are estimated for each side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.manoeuvres import Zigzag
from tank2sim.simulation.rudder_record import HeldAngle

NOMINAL_HEADINGS_DEG = (1, 2, 5, 10, 15, 20, 25, 30, 35)
"""Headings at which zigzags are reversed (ITTC 7.5-04-02-01, and the modified ones of SIMMAN)."""

COURSE_ERROR = math.radians(0.25)
"""Standard error of a zigzag's course from the heading of its approach, in addition to the scatter of that heading: the
courses of MARIN's zigzags differ by 0.1 to 0.2 deg from the first headings of their records (project choice)."""

LAG = 0.1
"""Prior scale of the lags of helmsmen and controllers, in L/u0: HSVA's are 0.06, MARIN's 0.02, those
of the 3 m Esso Osaka 0.03. It matters only with too few reversals for the lag (project choice)."""

CONFIDENT = 0.975
"""Level of agreement of a nominal heading with the reversals: their two-sided interval of 95 %."""

NO_LAG = 1e-6
"""Share of its scale below which a lag counts as zero: the residual of a search that ends at its bound."""

ASTRAY = 0.2
"""Largest scatter of the reversal headings of a zigzag, as a share of the nominal heading: some 10 % by helmsmen of the
3 m Esso Osaka in wind (project choice)."""


@dataclass(frozen=True, eq=False)
class FittedZigzag:
    """A zigzag as it fits the reversals of a record."""

    manoeuvre: Zigzag
    errors: dict[str, float]  # Standard errors of the fit: ``heading_rad``, ``course_rad``, ``lag_s``
    # Standard errors of figures by the errors of course and reversals: rad for overshoots, s for times.
    reading_errors: dict[str, float]
    # (k,): Heading beyond the manoeuvre's at which each reversal was made, rad: 0 for a controller, a helmsman's
    # scatter.
    late_by: Array

    def from_reversals(self, figures: Figures) -> Figures:
        """Figures with overshoots beyond the heading of their reversal in place of the manoeuvre's.

        `figures`: Overshoots in deg.
        """
        overshoots = figures["overshoots_deg"]
        assert isinstance(overshoots, list)
        late = np.degrees(self.late_by).tolist()
        return figures | {"overshoots_deg": [size - by for size, by in zip(overshoots, late, strict=False)]}


def fitted_zigzag(
    time: Array, held: list[HeldAngle], smooth: dict[str, Array], noise: float, ship_time: float
) -> FittedZigzag | None:
    """Rudder, nominal heading, course and lag of a zigzag, and their standard errors; None if it is not a zigzag.

    At each reversal k, ordered at t_k, the heading `lag` s earlier was that of the reversal: psi(t_k - lag) = course +
    s_k nominal, s_k = 1 while the rudder was to starboard. Course, nominal heading and lag are fitted to all reversals
    together by least squares, with the approach's heading as another reading of the course, and :data:`LAG` as prior of
    the lag. The nominal heading is then that of a usual zigzag, if one agrees. Sides that disagree (:func:`_sides`)
    have a heading each, counted from the course of the approach.

    `time` (n,): s. `held`: Angles of the rudder, to alternating sides. `smooth`: Smoothed ``psi_rad`` and ``r_radps``
    (n,). `noise`: Standard deviation of the smoothed heading, rad. `ship_time`: L/u0, s.
    """
    times = np.array([each_angle.execute_s for each_angle in held[1:]])
    sides = np.array([math.copysign(1.0, each_angle.angle) for each_angle in held[:-1]])
    if np.min(sides * np.interp(times, time, smooth["r_radps"])) <= 0:
        return None
    approach = _approach(time, held[0], smooth)
    reversals = _Reversals(time, smooth["psi_rad"], times, sides, approach, LAG * ship_time)
    noise = math.hypot(noise, _dating_noise(time, times, smooth))
    first, second = (float(np.median([held_angle.angle for held_angle in held[side::2]])) for side in (0, 1))
    by_side = _sides(reversals, noise)
    if by_side is not None:
        (heading, opposite), error = by_side
        manoeuvre = Zigzag(first, heading, 0.0, approach[0], opposite=second, opposite_heading=opposite)
        errors = {"heading_rad": error, "course_rad": approach[1]}
    else:
        found = _usual(reversals, noise, round(_degrees(held)))
        if found is None:
            return None
        free, fitted = found
        manoeuvre = Zigzag(first, fitted.nominal, fitted.lag, fitted.course, opposite=second)
        errors = {"heading_rad": free.errors[1], "course_rad": fitted.errors[0], "lag_s": fitted.errors[-1]}
    late, share = reversals.late_by(manoeuvre, noise)
    crossing = errors["course_rad"] / _yaw_rate(time, times, smooth)
    overshoot = math.hypot((1 - share) * errors["course_rad"], share * noise)
    reading = {"overshoot_1_deg": overshoot, "overshoot_2_deg": overshoot}
    reading |= {"initial_turning_time_s": crossing, "reach_s": crossing}
    return FittedZigzag(manoeuvre, errors, reading, late)


def _degrees(held: list[HeldAngle]) -> float:
    """Rudder of a zigzag, deg."""
    return math.degrees(float(np.median([abs(held_angle.angle) for held_angle in held])))


@dataclass(frozen=True)
class _Fit:
    """Course, nominal heading, lag; their standard errors; squares weighted, and of the reversals alone (rad2)."""

    course: float
    nominal: float
    lag: float
    errors: tuple[float, ...]
    cost: float
    squares: float


@dataclass(frozen=True, eq=False)
class _Reversals:
    """Least-squares problem of the reversals of a zigzag."""

    # `time`, `heading` (n,): Instants, s, and headings, rad.
    time: Array
    heading: Array
    # `times`, `sides` (k,): Time of each reversal's order, and the side of the rudder before it.
    times: Array
    sides: Array
    approach: tuple[float, float]  # Course by the approach, and its standard error, rad
    lag_scale: float  # Prior scale of lags, s

    def late_by(self, manoeuvre: Zigzag, noise: float) -> tuple[Array, float]:
        """Headings beyond a zigzag's at which the reversals were made (k,), rad, and their share of what was read.

        They are read with an error `noise` (rad); the part of their scatter above it is the helmsman's.
        """
        assert manoeuvre.course is not None
        before = np.interp(self.times - manoeuvre.lag_s, self.time, self.heading)
        nominal = np.resize(manoeuvre.headings, len(self.times))
        off: Array = self.sides * (before - manoeuvre.course) - nominal
        scatter = float(np.mean(off**2))
        share = max(0.0, 1 - noise**2 / scatter) if scatter > 0 else 0.0
        return share * off, share

    def fit(self, noise: float, nominal: float | None = None) -> _Fit:
        """The least-squares fit for a standard deviation of the reversal headings, rad; with a given `nominal` one."""
        course, error = self.approach

        def off(at: Array, heading: float) -> Array:
            before = np.interp(self.times - at[-1], self.time, self.heading)
            return np.asarray(before - at[0] - self.sides * heading, dtype=np.float64)

        def residuals(at: Array) -> Array:
            heading = at[1] if nominal is None else nominal
            return np.concatenate([off(at, heading) / noise, [(at[0] - course) / error, at[-1] / self.lag_scale]])

        reached = float(np.mean(self.sides * (np.interp(self.times, self.time, self.heading) - course)))
        start, scale = np.array([course, reached, 0.1 * self.lag_scale]), np.array([0.01, 0.01, 1.0])
        lowest = np.array([-np.inf, -np.inf, 0.0])
        keep = [0, 1, 2] if nominal is None else [0, 2]
        found = least_squares(residuals, start[keep], bounds=(lowest[keep], np.inf), x_scale=scale[keep])
        heading = float(found.x[1]) if nominal is None else nominal
        errors = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
        lag = float(found.x[-1])
        lag = lag if lag > NO_LAG * self.lag_scale else 0.0
        squares = float(np.sum(off(found.x, heading) ** 2))
        return _Fit(float(found.x[0]), heading, lag, tuple(map(float, errors)), 2 * float(found.cost), squares)


def _sides(reversals: _Reversals, noise: float) -> tuple[tuple[float, float], float] | None:
    """Heading changes of the two sides, rad, and their standard error; None unless the sides differ significantly.

    One side must have been reversed twice, so that the scatter is known; `noise` is its least value, rad.
    """
    course, course_error = reversals.approach
    reached = reversals.sides * (np.interp(reversals.times, reversals.time, reversals.heading) - course)
    spare = len(reached) - 2
    if spare < 1:
        return None
    sides = reached[0::2], reached[1::2]
    means = float(np.mean(sides[0])), float(np.mean(sides[1]))
    scatter = math.sqrt(sum(float(np.sum((side - np.mean(side)) ** 2)) for side in sides) / spare)
    if min(means) <= 0 or scatter > ASTRAY * min(means):
        return None
    error = max(scatter, noise) * math.sqrt(sum(1 / len(side) for side in sides))
    # A course that is off makes one side's changes larger and the other's smaller by as much.
    if abs(means[0] - means[1]) <= float(stdtrit(spare, CONFIDENT)) * math.hypot(error, 2 * course_error):
        return None
    return means, error


def _usual(reversals: _Reversals, noise: float, rudder_deg: int) -> tuple[_Fit, _Fit] | None:
    """The free fit, and that with the nominal heading of an agreeing usual zigzag; None if it is not a zigzag.

    The candidates are, in this order, the rudder's angle (10/10, 20/20), the usual headings, and whole degrees; if none
    agrees, the free fit is kept. With more than three reversals their scatter gives the tolerance (Student's t); with
    three or fewer it is the residual with the nominal heading.
    """
    count = len(reversals.times)
    spare = count - 3
    free = reversals.fit(noise)
    freedom = math.inf
    if spare > 0:
        noise, freedom = max(noise, math.sqrt(free.squares / spare)), spare
        free = reversals.fit(noise)
    limit = float(stdtrit(freedom, CONFIDENT)) ** 2
    whole = math.floor(math.degrees(free.nominal))
    choices: tuple[tuple[int, ...], ...] = (
        (rudder_deg,),
        NOMINAL_HEADINGS_DEG,
        (whole, whole + 1) if count > 1 else (),
    )
    for angles in choices:
        agreeing = [fitted for fitted in _nominal_fits(reversals, noise, angles) if fitted.cost - free.cost <= limit]
        if agreeing:
            return free, min(agreeing, key=lambda agreed: agreed.cost)
    return (free, free) if count > 1 and _keeps_to(reversals, free) else None


def _nominal_fits(reversals: _Reversals, noise: float, angles: tuple[int, ...]) -> Iterator[_Fit]:
    """Fits with nominal headings, deg, that make a zigzag; the residual of three reversals is their noise if larger."""
    for angle in (math.radians(angle) for angle in angles if angle > 0):
        fitted = reversals.fit(noise, angle)
        if len(reversals.times) == 3:
            fitted = reversals.fit(max(noise, math.sqrt(fitted.squares)), angle)
        if _keeps_to(reversals, fitted):
            yield fitted


def _keeps_to(reversals: _Reversals, fitted: _Fit) -> bool:
    """True if the reversals fit a zigzag (:data:`ASTRAY`); a single one needs a known course."""
    scatter = math.sqrt(fitted.squares / len(reversals.times))
    if len(reversals.times) == 1:
        scatter = reversals.approach[1]
    return scatter <= ASTRAY * fitted.nominal


def _approach(time: Array, first: HeldAngle, smooth: dict[str, Array]) -> tuple[float, float]:
    """Mean heading before the first execute, and its standard error as the course, rad."""
    until = max(2, int(np.searchsorted(time, first.execute_s)))
    heading = smooth["psi_rad"][:until]
    wandered = max(float(np.std(heading)), 0.5 * abs(float(heading[-1] - heading[0])))
    return float(np.mean(heading)), math.hypot(COURSE_ERROR, wandered)


def _dating_noise(time: Array, times: Array, smooth: dict[str, Array]) -> float:
    """Standard deviation of the headings at reversals because of their time resolution of a sample, rad."""
    return _yaw_rate(time, times, smooth) * usual_step(time) / math.sqrt(12)


def _yaw_rate(time: Array, times: Array, smooth: dict[str, Array]) -> float:
    """Root mean square of the yaw rate at the reversals, rad/s."""
    return float(np.sqrt(np.mean(np.interp(times, time, smooth["r_radps"]) ** 2)))
