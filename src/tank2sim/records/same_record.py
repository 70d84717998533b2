"""Whether two trials are one record: renamed, cut, thinned, rounded, turned, moved, mirrored, or recorded twice."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from tank2sim.arrays import Array
from tank2sim.notices import Notice, caution
from tank2sim.records.audit.noise import resolution, rounding, white_noise
from tank2sim.records.trials import MEASURED_COLUMNS, Trial, usual_step

PRINTED = 1e-3
"""Share of a signal's spread by which printing it with other digits may change it; two runs of one manoeuvre differ by
some per cent (HSVA's zigzags by 2 to 12 % in yaw rate). Project choice."""

NOISE = 0.5
"""Two runs differ by sqrt(2) times the noise of their sensors at least, one record from itself by nothing: half the
noise lies between."""

_ROUNDED = 1.2
"""Times what rounding to the coarser of two units leaves that is put down to it (project choice)."""

_FAR = 0.3
"""Signals farther apart than this share of their spread are not looked at any closer (project choice)."""

COMMON = 0.5
"""Share of the shorter record that must lie at the same times to be compared (project choice)."""

LEAST_ROWS = 4
"""Rows at the same times below which records are not compared. Project choice: three numbers may agree by chance."""

SIGNED = ("psi_rad", "x_m", "y_m", "r_radps", "u_mps", "sog_mps", "v_mps", "u_ground_mps", "v_ground_mps", "phi_rad")
"""Signals of a signature, the first of them first. Project choice: heading and position are in most copies."""

MOST_SIGNED, LEAST_SIGNED_ROWS = 4, 16
"""Signals of a signature, and rows; below twice as many. Project choice: a few lines on a card, and half of the rows
are still enough to compare."""

STRIDES = (60, 12, 1)
"""The rows of a signature are a multiple of one of these apart, where the record is long enough. Project choice: a copy
with every second, third, ... row still has them all."""

_BLOCKS = 16
"""Parts of a record over which the difference of two recordings is averaged. Project choice: some swings of a zigzag,
and enough rows in each for a mean that shows a disturbance below the noise."""

_BY_CHANCE = 1.5
"""Times the noise of two sensors that their difference may have. Project choice: the noise is known to some 10 %, and
the mean square of 16 block means exceeds twice its expectation by chance once in a hundred records."""

_SHOWS = 0.01
"""Share of a signal's spread that its block means must resolve, to distinguish a second recorder from a second run.
Project choice: half of the least difference between runs of one manoeuvre (HSVA's zigzags: 2 to 12 % in yaw rate)."""

_DIRECTIONS = ("psi_rad", "cog_rad", "angle_rad")  # Signals whose zero is arbitrary: the run may be turned
# Signals that change sign in a mirror
_MIRRORED = (
    *("v_mps", "v_ground_mps", "r_radps", "psi_rad", "cog_rad", "y_m", "phi_rad", "Y_N", "N_Nm"),
    *("angle_rad", "current_A"),
)

_TRACK = ("x_m", "y_m")
_COMPARED = (
    *(name for name in MEASURED_COLUMNS if not name.startswith(("wind", "current"))),
    "X_N",
    "Y_N",
    "N_Nm",
    "angle_rad",
    "current_A",
)
# Signals by which two records are shifted onto each other, the first one that both have
_TIMING = ("r_radps", "N_Nm", "Y_N", "current_A", "psi_rad", "cog_rad", "u_mps", "sog_mps", "x_m", "y_m")

_FINEST = 1 << 16
"""Rows of a record in the search for the shift. Project choice: it takes some hundredths of a second."""
_IN_STEP = 0.25
"""Correlation of the timing signal below which no shift is tried. Project choice: a copy has 1, and 0.4 with every
third row of a signal that is noise alone."""
_MORE_THAN_DIGITS = 1.5
"""Times the noise of its rounding from which a signal has noise of its own (project choice)."""
_STEPS_TO_SHOW = 50
"""Units from zero to the largest reading below which columns may agree by chance. Project choice: readings of five tows
of one body by the same weight (Wilinski & Zellman 1984), 170 units up to the fastest, differ by ten units."""
_NEIGHBOURHOOD = 0.02
"""Share of a record by which the timing signal may be wrong, with noise (project choice)."""
_LEAST_VALUES = 8
"""Different values of a signal that must be multiples of a unit for it to count as its rounding (project choice)."""


class TimedSignals(Protocol):
    """Data by which two records are compared: a trial, a captive run, a record of a rig."""

    @property
    def time_s(self) -> Array:
        """Rising times (n,)."""

    @property
    def signals(self) -> Mapping[str, Array]:
        """Name to values (n,), SI."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A record other than a trial: times (n,) and signals (n,)."""

    time_s: Array
    signals: Mapping[str, Array]


class Likeness(StrEnum):
    """The part that two records have in common."""

    COPY = "copy"
    MIRROR = "mirror image"
    TWICE = "recorded twice"


def refuse_copies(trials: Sequence[Trial], others: Sequence[Trial] | None = None) -> tuple[Notice, ...]:
    """Refuse trials that are one record: among themselves, or fitted and held out if others are given.

    Returns
    -------
    tuple of str
        Notices of mirror images and of runs that seem to be recorded twice.

    Raises
    ------
    InputError
        Names the second file, and which one it is again.
    """
    if others is None:
        pairs = [(trial, before) for number, trial in enumerate(trials) for before in trials[:number]]
        problem, remedy = "is the record of {} again", "give each record once: a copy is not a second run"
        proves = "it is not a second run"
    else:
        pairs = [(held, trial) for held in others for trial in trials]
        problem, remedy = "is both fitted and held out: it is the record of {}", "hold out what is not fitted"
        proves = "as a hold-out it proves nothing"
    notices = []
    for trial, before in pairs:
        alike = likeness(trial, before)
        if alike is Likeness.COPY:
            raise trial.fault("", problem.format(before.path.name), remedy)
        if alike is not None:
            notices.append(caution(f"{trial.path.name} {_SAID[alike].format(before.path.name)}: {proves}."))
    return tuple(notices)


_SAID = {
    Likeness.MIRROR: "is the mirror image of {}, noise included",
    Likeness.TWICE: "differs from {} by the noise of the sensors alone, as a second recording of the same run does",
}


def same_record(first: TimedSignals, second: TimedSignals) -> bool:
    """True if one of two records is a copy of the other, see :func:`likeness`."""
    return likeness(first, second, (Likeness.COPY,)) is Likeness.COPY


def likeness(
    first: TimedSignals, second: TimedSignals, among: Collection[Likeness] = tuple(Likeness)
) -> Likeness | None:
    """The part that two records have in common, whatever their clock, heading, origin, digits and rows; None for two
    runs.

    A copy has in all signals that both measured the same values at the same times, except for printed digits. A mirror
    image has them with port and starboard exchanged. A run recorded twice differs by no more than the white noise of
    the sensors, also in means over a sixteenth of the record, where a second run shows its own disturbances. Both are
    at the size of one ship. A signal that does not move says nothing. Only what is in `among` is looked for.
    """
    records = _Records.of(first, second)
    for alike, sign in ((Likeness.COPY, 1.0), (Likeness.MIRROR, -1.0)):
        if alike in among and any(_copied(records.together(shift, sign)) for shift in records.shifts(sign)):
            return alike
    if Likeness.TWICE not in among:
        return None
    shifts = records.shifts(1.0)
    tried = (*shifts, _nearest(records, shifts[-1]))
    return Likeness.TWICE if any(_recorded_twice(records.together(shift)) for shift in tried) else None


def _nearest(records: _Records, shift: float) -> float:
    """The shift (s) at which all signals together are nearest, in the neighbourhood of one by the timing signal."""
    if any(pair.apart > pair.spread for pair in records.together(shift)):
        return shift

    def apart(tried: float) -> float:
        return sum(math.log(max(pair.apart / pair.spread, 1e-12)) for pair in records.together(tried))

    time = records.first.time_s
    reach = max(usual_step(time), _NEIGHBOURHOOD * float(time[-1] - time[0]))
    bounds, options = (shift - reach, shift + reach), {"xatol": 0.01 * usual_step(time)}
    return float(minimize_scalar(apart, bounds=bounds, method="bounded", options=options).x)


def has_noise(record: TimedSignals) -> bool:
    """Whether a signal has noise that is not its rounding: mirror images without it may be computed, not copied."""

    def noisy(values: Array) -> bool:
        least = max(PRINTED * float(np.std(values)), _MORE_THAN_DIGITS * resolution(values) / math.sqrt(12.0))
        return white_noise(values) > least

    return any(map(noisy, record.signals.values()))


def same_readings(first: Array, second: Array) -> bool:
    """True if two columns of one table agree in all rows that both have, to half a unit of the coarser digits.

    `first`, `second` (n,): nan where nothing was read.
    """
    known = ~np.isnan(first + second)
    size = float(np.nanmax(np.abs(first), initial=0.0))
    units = [_divisor(np.unique(np.append(values[np.isfinite(values)], 0.0)), size) for values in (first, second)]
    if np.count_nonzero(known) < LEAST_ROWS or min(units) > size / _STEPS_TO_SHOW:
        return False
    return float(np.max(np.abs(first - second)[known])) <= 0.5001 * max(units)


def signature(trial: Trial) -> tuple[list[float], dict[str, list[float]]]:
    """Some rows of a trial by which :func:`same_record` knows it: times (s), and up to four signals, SI.

    Of the rows in which all of these are known, evenly spread; times to a thousandth of the step between rows, values
    to 1e-5 of their range. Empty if no signal moves.
    """
    signals = trial.signals
    ranges = {name: float(np.nanmax(signals[name]) - np.nanmin(signals[name])) for name in SIGNED if name in signals}
    names = [name for name, size in ranges.items() if size > 0][:MOST_SIGNED]
    if not names:
        return [], {}
    rows = np.flatnonzero(np.all([np.isfinite(signals[name]) for name in names], axis=0))
    if len(rows) < LEAST_SIGNED_ROWS:  # signals that are never known at once
        names = names[:1]
        rows = np.flatnonzero(np.isfinite(signals[names[0]]))
    rows = rows[:: _stride(len(rows))]
    time = _rounded(trial.time_s[rows], 1e-3 * usual_step(trial.time_s))
    return time, {name: _rounded(signals[name][rows], 1e-5 * ranges[name]) for name in names}


def _stride(rows: int) -> int:
    """Rows from one of a signature to the next."""
    unit = next((unit for unit in STRIDES if rows >= unit * LEAST_SIGNED_ROWS), 1)
    return unit * max(1, rows // (unit * LEAST_SIGNED_ROWS))


def _rounded(values: Array, unit: float) -> list[float]:
    places = math.ceil(-math.log10(unit))
    return [round(float(value), places) for value in values]


@dataclass(frozen=True, eq=False)
class _Pair:
    """One signal of two records at common times (m,), the noise of each, and the coarser unit of their digits."""

    first: Array
    second: Array
    noises: tuple[float, float]
    unit: float
    evidence: bool = True

    @property
    def spread(self) -> float:
        return float(np.std(self.first))

    @property
    def apart(self) -> float:
        return float(np.sqrt(np.mean((self.first - self.second) ** 2)))

    @property
    def too_coarse(self) -> bool:
        """Whether rounding alone could make two runs so alike."""
        return _FAR * self.spread < self.apart <= _ROUNDED * self.unit / math.sqrt(12)

    @property
    def copied(self) -> bool:
        tolerance = max(PRINTED * self.spread, NOISE * min(self.noises), _ROUNDED * self.unit / math.sqrt(12))
        return self.apart <= min(tolerance, _FAR * self.spread)

    def by_noise(self) -> tuple[bool, bool]:
        """Whether the noise explains the difference, its means over parts included, and whether a run would show."""
        apart = self.first - self.second
        means = [float(np.mean(part)) for part in np.array_split(apart - np.mean(apart), _BLOCKS)]
        noise = math.sqrt(self.noises[0] ** 2 + self.noises[1] ** 2 + self.unit**2 / 12)
        of_mean = _BY_CHANCE * noise / math.sqrt(len(apart) / _BLOCKS)
        small = PRINTED * self.spread
        explained = float(np.std(apart)) <= max(_BY_CHANCE * noise, small)
        return explained and float(np.std(means)) <= max(of_mean, small), of_mean <= _SHOWS * self.spread


def _copied(pairs: Iterable[_Pair]) -> bool:
    evidence = False
    for pair in pairs:
        if not pair.copied:
            return False
        evidence = evidence or pair.evidence
    return evidence


def _recorded_twice(pairs: Iterable[_Pair]) -> bool:
    shown = False
    for pair in pairs:
        if len(pair.first) < _BLOCKS * LEAST_ROWS:
            return False
        by_noise, shows = pair.by_noise()
        if not by_noise:
            return False
        shown = shown or (shows and pair.evidence)
    return shown


@dataclass(frozen=True, eq=False)
class _Records:
    """Two records in one frame, at the rows of the coarser one, between which nothing is drawn."""

    first: TimedSignals
    second: TimedSignals
    names: tuple[str, ...]  # Signals that are compared
    _precisions: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    _shifts: dict[float, tuple[float, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, first: TimedSignals, second: TimedSignals) -> _Records:
        if usual_step(first.time_s) < usual_step(second.time_s):
            first, second = second, first
        names = [name for name in _COMPARED if name in first.signals and name in second.signals]
        if len(names) > 1 and sum(name in _TRACK for name in names) == 1:  # turned, it would be another
            names = [name for name in names if name not in _TRACK]
        return cls(first, second, tuple(names))

    def precision(self, name: str) -> tuple[float, float, float]:
        """Noise of a signal in each record, and the coarser unit of their digits."""
        if name not in self._precisions:
            pair = self.first.signals[name], self.second.signals[name]
            self._precisions[name] = white_noise(pair[0]), white_noise(pair[1]), max(map(_unit, pair))
        return self._precisions[name]

    def shifts(self, sign: float) -> tuple[float, ...]:
        """Shifts of the second record to try, s, as it is (1) or mirrored (-1)."""
        if sign not in self._shifts:
            self._shifts[sign] = tuple(_shifts(self.first, self.second, sign))
        return self._shifts[sign]

    def together(self, shift: float, sign: float = 1.0) -> Iterator[_Pair]:
        """The signals of both, the second shifted and mirrored; empty if too few are at the same times."""
        first, time = self.first, self.second.time_s + shift
        inside = (first.time_s >= time[0]) & (first.time_s <= time[-1])
        common = first.time_s[inside]
        if len(common) < LEAST_ROWS or np.ptp(common) < COMMON * min(np.ptp(first.time_s), np.ptp(time)):
            return
        tracks = _TRACK if set(_TRACK) <= set(self.names) else ()
        whole = {name: (first.signals[name], _mirrored(name, self.second, sign)) for name in self.names}
        whole |= _tracks(whole, inside, common, time)
        for name, (values, others) in whole.items():
            aligned = _aligned(name, values[inside], _at(common, time, others))
            if aligned is None:
                continue
            precisions = [self.precision(each) for each in (tracks if name in tracks else (name,))]
            *noises, unit = np.max(precisions, axis=0).tolist()
            pair = _Pair(*aligned, (noises[0], noises[1]), unit, evidence=name not in tracks[:1])
            if not pair.too_coarse:
                yield pair


def _mirrored(name: str, record: TimedSignals, sign: float) -> Array:
    """A signal as it is (1), or of the manoeuvre with port and starboard exchanged (-1)."""
    return record.signals[name] * (sign if name in _MIRRORED else 1.0)


def _aligned(name: str, values: Array, others: Array) -> tuple[Array, Array] | None:
    """One signal (m,) of two records where both are known, less its arbitrary zero; None if it does not move."""
    known = ~np.isnan(values + others)
    if np.count_nonzero(known) < 2:
        return None
    values, others = values[known], others[known]
    if name in _DIRECTIONS:
        turned = np.exp(1j * (values - others))
        others = values - np.angle(turned * np.conj(np.mean(turned)))
    elif name in _TRACK:
        others = others + np.mean(values) - np.mean(others)
    return (values, others) if np.std(values) > 0 else None


def _tracks(
    whole: Mapping[str, tuple[Array, Array]], inside: NDArray[np.bool_], common: Array, time: Array
) -> dict[str, tuple[Array, Array]]:
    """Both tracks along and across the main direction of the first, the second turned onto it; empty without both."""
    if not set(_TRACK) <= whole.keys():
        return {}
    (x, other_x), (y, other_y) = (whole[name] for name in _TRACK)
    first, second = x + 1j * y, other_x + 1j * other_y
    there = first[inside], _at(common, time, other_x) + 1j * _at(common, time, other_y)
    known = ~np.isnan(there[0] + there[1])
    if not known.any():
        return {}
    a, b = (track[known] - np.mean(track[known]) for track in there)
    axis = np.exp(-0.5j * np.angle(np.sum(a**2)))
    onto = np.exp(1j * np.angle(np.sum(a * np.conj(b))))
    tracks = first * axis, second * onto * axis
    return {"x_m": (tracks[0].real, tracks[1].real), "y_m": (tracks[0].imag, tracks[1].imag)}


def _shifts(first: TimedSignals, other: TimedSignals, sign: float) -> Iterator[float]:
    """Shifts (s) of the second record's times to try: none, by the first rows, and as the timing signal fits best."""
    time = other.time_s
    yield from dict.fromkeys((0.0, float(first.time_s[0] - time[0])))
    name = next((name for name in _TIMING if name in first.signals and name in other.signals), None)
    if name is None:
        return
    step = min(usual_step(first.time_s), usual_step(time))
    step = max(step, max(float(times[-1] - times[0]) for times in (first.time_s, time)) / _FINEST)
    grids = [np.arange(times[0], times[-1] + step / 2, step) for times in (first.time_s, time)]
    a = _rate(name, grids[0], first.time_s, first.signals[name])
    b = _rate(name, grids[1], time, _mirrored(name, other, sign))
    behind = _best_lag(a, b)
    if behind is None:
        return
    shift = float(grids[0][0] - grids[1][0]) + behind * step

    def apart(near: float) -> float:
        inside = (grids[0] >= grids[1][0] + near) & (grids[0] <= grids[1][-1] + near)
        return float(np.mean((a[inside] - np.interp(grids[0][inside], grids[1] + near, b)) ** 2))

    near = minimize_scalar(apart, bounds=(shift - step, shift + step), method="bounded", options={"xatol": 1e-4 * step})
    yield shift
    yield float(near.x)


def _best_lag(a: Array, b: Array) -> int | None:
    """Rows of `a` before `b` begins, where both are most alike; None if they are nowhere alike, or do not change."""
    from scipy.signal import correlate  # slow to import

    if min(len(a), len(b)) < LEAST_ROWS or not min(np.ptp(a), np.ptp(b)) > 0:
        return None
    a, b = a - np.mean(a), b - np.mean(a)
    behind = np.arange(len(a) + len(b) - 1) - (len(b) - 1)
    begin, end = np.maximum(behind, 0), np.minimum(behind + len(b), len(a))
    sums = [np.append(0.0, np.cumsum(each**2)) for each in (a, b)]
    energy = sums[0][end] - sums[0][begin] + sums[1][end - behind] - sums[1][begin - behind]
    enough = end - begin >= max(COMMON * min(len(a), len(b)), LEAST_ROWS)
    match = np.where(enough, 2 * correlate(a, b, method="fft") / np.maximum(energy, 1e-12 * np.max(energy)), -1.0)
    best = int(np.argmax(match))
    return None if match[best] < _IN_STEP else int(behind[best])


def _rate(name: str, grid: Array, time: Array, values: Array) -> Array:
    """The timing signal (n,) on an even grid, the rate of change of one that has no zero of its own."""
    even = _at(grid, time, np.unwrap(values) if name in _DIRECTIONS and not np.isnan(values).any() else values)
    return even if name in ("r_radps", "N_Nm", "Y_N", "current_A") or len(even) < LEAST_ROWS else np.gradient(even)


def _at(common: Array, time: Array, values: Array) -> Array:
    known = ~np.isnan(values)
    if np.count_nonzero(known) < 2:
        return np.full(len(common), np.nan)
    return np.interp(common, time[known], values[known])


def _unit(values: Array) -> float:
    """Coarsest unit of a signal (n,): by its steps, or the greatest common divisor of its larger values."""
    known = values[np.isfinite(values)]
    size = float(np.max(np.abs(known), initial=0.0))
    different = np.unique(known[np.abs(known) >= size / 2])
    if len(different) < _LEAST_VALUES:
        return rounding(values)
    return max(rounding(values), _divisor(different, size))


def _divisor(different: Array, size: float) -> float:
    """Greatest common divisor of the differences of rising values, by Euclid; it ends at a millionth of their size."""
    unit, least = 0.0, 1e-6 * size
    for step in np.diff(different).tolist():
        rest = step
        while rest > least:
            unit, rest = rest, unit % rest
            rest = 0.0 if unit - rest < least else rest
        if 0 < unit < 10 * least:
            break
    return unit
