"""Tests of what a stream holds, by its consistency with the motion: courses, rates, speeds, rudders, delays."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.reference import (
    HEADING_WINDOW_S,
    ReferenceMotion,
    differenced,
    interpolated,
    interpolated_angle,
    thinned_series,
)
from tank2sim.apps.logs.streams import wrapped_angle
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

NEAR_RAD = math.radians(35.0)
"""Largest difference of course and heading that counts as agreement: drift angles of ships in the tightest turns are
below it (Crane, Eda and Landsburg 1989, PNA vol. III, IX.5: 10 to 20 deg)."""

AGREES = 0.8
"""Correlation, or share of samples, from which content agrees. Project choice: astern motion and pivoting of small
craft leave it above, an exchanged channel is below 0.5."""

DIFFERS = 0.5
"""Correlation or share below which content contradicts a name. Project choice: halfway to nothing."""

_SIDEWAYS = 0.35
"""Sideways speed (rms) as a share of the speed below which a heading is one. Project choice: half of the 0.71 of an
angle that has nothing to do with the motion; small craft in turns reach 0.3."""

# Senses of rotation and quarters of a turn by which a compass may be mounted; the first is as it should be
_ORIENTATIONS = tuple(itertools.product((1, -1), range(4)))
_UPRIGHT, _LIKELIER = _ORIENTATIONS[0], 0.02

UNIT_SLACK = 0.2
"""Relative difference of a scale from the unit that is taken for it. Project choice: units are factors of 1.85
and more apart, scales of sensors are off by some per cent."""

FEW_SAMPLES = 30
"""Samples that a test needs. Project choice: correlations of fewer are chance."""

LEAST_TURNED_RAD = math.radians(60.0)
"""Change of heading in a log below which signs of headings are not judged. Project choice: on one course, a mirrored
heading differs by a constant alone."""

RATE_WINDOWS_S = (HEADING_WINDOW_S, 8.0, 30.0)
"""Times over which heading and rate of turn are compared, s, one after the other until they agree. Project choice: a
large ship turns so slowly that the noise of a compass hides it within seconds."""

_DECISIVE = 0.97
"""Correlation from which no longer time is tried (project choice)."""

_LAGS_S = np.arange(-3.0, 3.01, 0.25)
# Time constants of yaw from craft to tanker, s (Nomoto 1957: T' of 0.3 to 3 at 1 to 10 m/s and 2 to 300 m)
_NOMOTO_T_S = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0)


@dataclass(frozen=True)
class ContentEvidence:
    """Evidence in a stream's content of what it is.

    - `agreement`: 0 to 1; None where the log cannot show it.
    - `sign`: Sign of the values against the convention of trials; 0 where the log cannot show it.
    - `unit`: Unit by the size of the values; empty where the log cannot show it.
    - `offset_rad`, `spread_rad`: Mean difference of an angle from what it should be, and the median difference without
      this mean.
    - `lag_s`: Time constant with which the turn follows a rudder.
    - `text`: The finding in a few words.
    """

    agreement: float | None = None
    sign: int = 0
    unit: str = ""
    offset_rad: float = 0.0
    spread_rad: float = 0.0
    lag_s: float = 0.0
    text: str = ""

    @property
    def known(self) -> float:
        """The agreement, 0 where the log cannot show it."""
        return self.agreement or 0.0


UNTESTED = ContentEvidence(text="not to be tested in this log")


def direction_evidence(time_s: Array, angle_rad: Array, motion: ReferenceMotion) -> ContentEvidence:
    """Compare a heading or a course (n,), rad, with the course of the positions, where the vessel moves.

    All four right angles between them and both senses of rotation are tried; the agreement is the share of samples
    that differ by less than :data:`NEAR_RAD`.
    """
    moving = motion.moving
    at, north, east = (part[moving] for part in (motion.time_s, motion.v_north_mps, motion.v_east_mps))
    angle = interpolated_angle(at, time_s, angle_rad, _longest_gap_s(time_s))
    good = np.isfinite(angle)
    if good.sum() < FEW_SAMPLES:
        return UNTESTED
    angle, north, east = angle[good], north[good], east[good]
    course = np.arctan2(east, north)
    differences = {key: wrapped_angle(key[0] * angle + key[1] * math.pi / 2 - course) for key in _ORIENTATIONS}
    shares = {key: float((np.abs(each) < NEAR_RAD).mean()) for key, each in differences.items()}
    best = max(shares, key=lambda key: shares[key] + _LIKELIER * (key == _UPRIGHT))
    (sign, quarter), agreement = best, shares[_UPRIGHT]
    turned = np.ptp(np.unwrap(course)) > LEAST_TURNED_RAD
    middle = float(np.median(differences[best]))
    offset = float(wrapped_angle(np.array([middle - quarter * math.pi / 2]))[0])
    if best != _UPRIGHT and turned:
        mirrored = {1: "", -1: "mirrored and "}
        words = f"is {mirrored[sign]}off by {math.degrees(offset):.0f} deg against the course of the positions"
        return ContentEvidence(agreement, sign, offset_rad=offset, text=words)
    text = f"follows the course of the positions in {100 * agreement:.0f} % of the time"
    if turned and DIFFERS <= agreement < AGREES and (share := _sideways_share(angle, north, east)) < _SIDEWAYS:
        agreement = AGREES
        text += f", and moves sideways by {100 * share:.0f} % of its speed in a steady current"
    spread = float(np.median(np.abs(differences[best] - middle)))
    return ContentEvidence(agreement, int(turned), offset_rad=offset, spread_rad=spread, text=text)


def _longest_gap_s(time_s: Array) -> float:
    """Longest gap of a stream that a comparison bridges, s."""
    return 5 * max(usual_step(time_s), 1.0)


def _sideways_share(heading: Array, north: Array, east: Array) -> float:
    """Sideways over whole speed (rms), -n sin(psi) + e cos(psi), in the steady current that makes it least."""
    sideways = np.column_stack([-np.sin(heading), np.cos(heading)])
    across = np.sum(sideways * np.column_stack([north, east]), axis=1)
    current = np.linalg.lstsq(sideways, across, rcond=None)[0]
    speed = np.hypot(north - current[0], east - current[1])
    return float(np.sqrt(np.mean((across - sideways @ current) ** 2) / np.mean(speed**2)))


def rate_evidence(
    time_s: Array, values: Array, motion: ReferenceMotion, windows_s: Sequence[float] = RATE_WINDOWS_S
) -> ContentEvidence:
    """Compare a rate of turn (n,), in an unknown unit, with the derivative of the heading: unit and sign.

    The windows of the comparison, s, are tried until one is decisive.
    """
    if len(motion.heading_time_s) < FEW_SAMPLES or len(time_s) < FEW_SAMPLES or np.ptp(values) == 0:
        return UNTESTED
    area = cumulative_trapezoid(values, time_s, initial=0.0)
    best, slope, other = 0.0, np.zeros(0), np.zeros(0)
    for window in windows_s:
        at, slopes = differenced(motion.heading_time_s, motion.heading_rad, window)
        rate_at, smooth = differenced(time_s, area, max(window, usual_step(motion.heading_time_s)))
        for lag in _LAGS_S:
            shifted = interpolated(at + lag, rate_at, smooth, 5.0)
            found = _correlation(shifted, slopes)
            if abs(found) > abs(best) + 1e-4:
                good = np.isfinite(shifted)
                best, slope, other = found, slopes[good], shifted[good]
        if abs(best) > _DECISIVE:
            break
    if len(other) < FEW_SAMPLES:
        return UNTESTED
    unit = _nearest_unit(float(np.std(slope) / np.std(other)), "yaw_rate")  # either may have the noise
    text = f"correlates with the derivative of the heading by {best:.3f}"
    return ContentEvidence(abs(best), 1 if best > 0 else -1, unit, text=text)


def speed_evidence(time_s: Array, values: Array, motion: ReferenceMotion, quantity: str) -> ContentEvidence:
    """Compare a speed (n,), in an unknown unit, with the speed of the positions: its unit, and whether it follows."""
    speed = motion.speed_mps
    other = interpolated(motion.time_s, time_s, values, _longest_gap_s(time_s))
    good = np.isfinite(other) & motion.moving
    if good.sum() < FEW_SAMPLES:
        return UNTESTED
    if not other[good].any():
        return ContentEvidence(0.0, text="it stays at 0 while the positions move")
    ratio = speed[good] / np.where(np.abs(other[good]) > 1e-9, np.abs(other[good]), np.nan)
    scale = float(np.nanmedian(ratio))
    spread = float(np.nanmedian(np.abs(ratio / scale - 1))) if np.isfinite(scale) and scale > 0 else math.inf
    unit = _nearest_unit(scale, quantity)
    # A spread of a tenth is agreement (current, leeway), one of a half is another quantity.
    agreement = float(np.clip(1.0 - 2.0 * max(spread - 0.05, 0.0), 0.0, 1.0)) if unit else 0.0
    sign = 1 if np.nanmedian(other[good]) > 0 else -1
    varies = float(np.std(speed)) > 0.1 * float(np.mean(speed))
    follows = _correlation(other, speed) if varies else 1.0
    text = f"the speed of the positions is {scale:.3g} times its values, with a correlation of {follows:.2f}"
    return ContentEvidence(min(agreement, abs(follows)) if follows < DIFFERS else agreement, sign, unit, text=text)


def component_evidence(time_s: Array, values: Array, reference: Array, motion: ReferenceMotion) -> ContentEvidence:
    """Compare a velocity (n,), m/s, with one of the positions at the times of the motion, without their means."""
    other = interpolated(motion.time_s, time_s, values, _longest_gap_s(time_s))
    if np.count_nonzero(np.isfinite(other) & np.isfinite(reference)) < FEW_SAMPLES:
        return UNTESTED
    found = _correlation(other, reference)
    return ContentEvidence(abs(found), 1 if found > 0 else -1, text=f"correlates with the positions by {found:.2f}")


def steering_evidence(time_s: Array, values: Array, rate_time_s: Array, rate: Array) -> ContentEvidence:
    """Compare a rudder (n,) with the rate of turn (m,) that follows it: agreement, sign, and the best time constant.

    The rate is compared with the rudder behind a first-order lag (Nomoto 1957), over a range of time constants; a
    rudder leads the turn, and what has no lag (an acceleration, another rate) is none.
    """
    if len(time_s) < FEW_SAMPLES or len(rate_time_s) < FEW_SAMPLES or np.ptp(values) == 0:
        return UNTESTED
    step = float(np.clip(usual_step(rate_time_s), 0.1, 1.0))
    grid = np.arange(max(time_s[0], rate_time_s[0]), min(time_s[-1], rate_time_s[-1]), step)
    if len(grid) <= FEW_SAMPLES:
        return UNTESTED
    rudder, turn = np.interp(grid, time_s, values), np.interp(grid, rate_time_s, rate)
    found: dict[float, float] = {}
    for constant in _NOMOTO_T_S:
        share = math.exp(-step / constant) if constant else 0.0
        lagged = lfilter([1 - share], [1, -share], rudder - rudder[0]) + rudder[0]
        found[constant] = _correlation(lagged, turn)
    best = max(found, key=lambda constant: abs(found[constant]))
    text = f"the rate of turn follows it by {found[best]:.2f} with a lag of {best:g} s"
    return ContentEvidence(abs(found[best]), 1 if found[best] > 0 else -1, lag_s=best, text=text)


def _nearest_unit(scale: float, quantity: str) -> str:
    if not math.isfinite(scale) or scale <= 0:
        return ""
    units = QUANTITIES[quantity].units
    unit = min(units, key=lambda name: abs(math.log(scale / units[name])))
    return unit if abs(math.log(scale / units[unit])) < math.log(1 + UNIT_SLACK) else ""


def _correlation(first: Array, second: Array) -> float:
    good = np.isfinite(first) & np.isfinite(second)
    if good.sum() < FEW_SAMPLES:
        return 0.0
    a, b = first[good] - first[good].mean(), second[good] - second[good].mean()
    size = math.sqrt(float(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0 else 0.0


SEGMENT_S = 60.0
"""Length of the segments, each with an offset and a drift of its own, s: gyros drift over minutes (project choice)."""

LEAST_SEGMENTS = 6
"""Segments from which a scatter between them means something (project choice)."""

LEAST_DELAY_S, SURE_ERRORS = 0.1, 5.0
"""Delay below which a channel is left as it is, s, and standard errors by which it differs from 0 (project choices: a
ship turns by 0.2 deg at most in it)."""

_LARGEST_DELAY_S, _STEPS = 3.0, 6
_LEAST_ROWS = 10  # Samples that a segment has more than


@dataclass(frozen=True)
class RateDelay:
    """By how much a rate of turn is late against the heading, s (negative: the heading is late), and its error."""

    delay_s: float
    standard_error_s: float

    @property
    def certain(self) -> bool:
        """Whether it is large and sure enough to be applied."""
        return abs(self.delay_s) > max(LEAST_DELAY_S, SURE_ERRORS * self.standard_error_s)


def rate_delay(heading_time_s: Array, heading_rad: Array, rate_time_s: Array, rate_radps: Array) -> RateDelay | None:
    """Delay of a rate of turn (m,), rad/s, against a continuous heading (n,), rad; None where too little overlaps.

    The heading is the integral of the rate a delay d later, which to first order in each segment is

        psi(t) = s A(t) + d r(t) + a + b t,  A the integral of r,

    solved by least squares, with the rate moved by d until it no longer changes. The standard error is that of the
    scatter between segments (Liang and Zeger 1986, Biometrika 73), so that drift of the sensors is in it.
    """
    rate_at, rate = thinned_series(rate_time_s, rate_radps, 0.2)
    if min(len(rate_at), len(heading_time_s)) < 3:
        return None
    area = cumulative_trapezoid(rate, rate_at, initial=0.0)
    at, heading = thinned_series(heading_time_s, heading_rad, 0.2)
    longest = 5 * max(usual_step(rate_at), usual_step(at))
    segment = np.floor((at - at[0]) / SEGMENT_S).astype(np.int64)
    delay, error = 0.0, np.inf
    for _ in range(_STEPS):
        columns = [interpolated(at + delay, rate_at, values, longest) for values in (area, rate)]
        rows = [np.flatnonzero((segment == number) & np.isfinite(columns[0])) for number in np.unique(segment)]
        table = np.column_stack([heading, *columns])
        found = _scale_and_step([_without_line(at[part], table[part]) for part in rows if len(part) > _LEAST_ROWS])
        if found is None:
            return None
        scale, step, step_error = found
        change, error = step / scale, step_error / abs(scale)
        delay += change
        if abs(delay) > _LARGEST_DELAY_S:
            return None
        if abs(change) < 0.01:
            break
    return RateDelay(delay, error)


def _scale_and_step(parts: Sequence[Array]) -> tuple[float, float, float] | None:
    """Scale, delay and its standard error by segments of heading, area and rate (k, 3); None where undetermined."""
    if len(parts) < LEAST_SEGMENTS:
        return None
    table = np.concatenate(parts)
    normal = table[:, 1:].T @ table[:, 1:]
    if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e8:
        return None
    found = np.linalg.lstsq(table[:, 1:], table[:, 0], rcond=None)[0]
    scores = np.array([part[:, 1:].T @ (part[:, 0] - part[:, 1:] @ found) for part in parts])
    inverse = np.linalg.inv(normal)
    spread = np.sqrt((inverse @ (scores.T @ scores) @ inverse)[1, 1] * len(parts) / (len(parts) - 1))
    return float(found[0]), float(found[1]), float(spread)


def _without_line(time_s: Array, columns: Array) -> Array:
    """Columns (n, k) less their straight lines in time."""
    line = np.column_stack([np.ones(len(time_s)), time_s - time_s.mean()])
    return np.asarray(columns - line @ np.linalg.lstsq(line, columns, rcond=None)[0])
