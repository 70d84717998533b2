"""Times of streams: clocks set back, repeated samples, gaps."""

from __future__ import annotations

import datetime as dt
from dataclasses import replace

import numpy as np

from tank2sim.apps.logs.findings import LogFinding, fault, note
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array
from tank2sim.records.csv_table import LARGEST
from tank2sim.records.signals.sampling import GAP_STEPS

_DOUBLED = 0.2
"""Share of samples at the time of another from which two instruments are suspected. Project choice."""

DOUBLED_STEPS = 3.0
"""Their difference, as a multiple of the change from sample to sample, from which they are. Project choice: noise alone
differs by one to two."""

_ROLLOVER_S = 1024 * 604800.0  # Time after which the week number of GPS starts again, s (IS-GPS-200, 20.3.3.3.1.1)
_LATEST_S = 253402300800.0  # The year 10000, s since 1970, which ISO 8601 does not write
_DAY_S = 86400.0  # Difference of two clocks, s, from which one is wrong by more than a time zone

TWO_DIGITS_FROM = 80
"""Years of two digits from here on are of the 20th century: GPS time begins in 1980 (IS-GPS-200, 3.3.4)."""

FALL_STEPS = 1.5
"""Steps by which a clock falls where it was set back. Project choice: two samples that changed places fall by one."""


def stamp_s(text: str) -> float:
    """A time stamp, s: ISO 8601, or a number that counts s, ms, us or ns since 1970, or s since the beginning."""
    if "-" in text:
        return dt.datetime.fromisoformat(text.rstrip("Z")).replace(tzinfo=dt.UTC).timestamp()
    value = float(text)
    return value / next((counts for least, counts in ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3)) if value > least), 1.0)


def full_year(year: int) -> int:
    """The year of a year of two digits."""
    return year + (1900 if year >= TWO_DIGITS_FROM else 2000)


def rollover_s(ahead_s: float) -> tuple[float, list[LogFinding]]:
    """Correction of a receiver's clock that is ahead of the recorder's by `ahead_s`, and its notice.

    Whole multiples of 1024 weeks are the receiver's fault, for its week number has ten bits; of any other difference
    the receiver is right.
    """
    turns = round(-ahead_s / _ROLLOVER_S)
    if turns and abs(ahead_s + turns * _ROLLOVER_S) < _DAY_S:
        text = f"the receiver's date is {1024 * abs(turns)} weeks off the date of the recorder, which is taken"
        return turns * _ROLLOVER_S, [note(text, weeks=1024 * turns)]
    days = ahead_s / _DAY_S
    text = f"the recorder's clock is {abs(days):.4g} days off the receiver's clock, which is used"
    return 0.0, [note(text, days=days)] if abs(days) > 1 else []


def board_start(lag_s: Array, receiver: str, findings: list[LogFinding]) -> float:
    """Time of a board at UTC 0, s, by its clock less UTC at each fix (n,); leaps of the receiver are a fault."""
    if (spread := float(np.ptp(lag_s))) > 1.0:
        text = f"the receiver's clock leaps by {spread:.3g} s against the board's clock, which is used"
        findings.append(fault(text, receiver))
        return float(np.median(lag_s))
    # The message is written after the fix was measured: the least difference has the least delay.
    return float(lag_s.min())


def continued_clock(time_s: Array, name: str) -> tuple[Array, list[LogFinding]]:
    """Times (n,) of a clock in the order of recording, continued over places where it was set back.

    A clock that falls by more than :data:`FALL_STEPS` steps is taken to continue from where it was; a later leap
    forward by the same amount ends the shift. A leap forward that a fall of the same size follows is taken back. Each
    is a fault in the findings. Smaller falls are samples out of order.
    """
    steps = np.diff(time_s)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    if not (steps < -FALL_STEPS * usual).any():
        return time_s, []
    times, findings, shift = time_s.copy(), [], 0.0
    leaps: list[int] = []
    for place in np.flatnonzero((steps < -FALL_STEPS * usual) | (steps > GAP_STEPS * usual)):
        step = float(steps[place])
        if step > 0:
            if shift > 0 and abs(step - usual - shift) < 2 * usual:
                times[place + 1 :] -= shift
                shift = 0.0
            else:
                leaps.append(int(place))
            continue
        undone = [leap for leap in leaps if abs(steps[leap] + step - 2 * usual) < 2 * usual]
        if undone:
            leaps.remove(ahead := undone[-1])
            times[ahead + 1 : place + 1] -= float(steps[ahead]) - usual
            text = f"{name}: the clock is {-step + usual:.4g} s ahead from {utc_text(time_s[ahead])} on for a while"
            findings.append(fault(f"{text}; that is taken back", name, leap_s=-step + usual))
        else:
            shift += usual - step
            times[place + 1 :] += usual - step
            text = f"{name}: the clock falls by {-step:.4g} s at {utc_text(time_s[place])}; it is taken to run on"
            findings.append(fault(text, name, fall_s=-step))
    return times, findings


def tidied(stream: LogStream) -> tuple[LogStream, int, list[LogFinding]]:
    """The stream with rising times and finite values, how many repeated samples were left out, and faults of its clock.

    Of samples with one time the first stays; where many of them differ, two instruments share the name, and that is a
    fault.
    """
    good = (np.abs(stream.time_s) < _LATEST_S) & (np.abs(stream.values) < LARGEST)  # nan is not
    time, findings = continued_clock(stream.time_s[good], stream.name)
    order = np.argsort(time, kind="stable")
    time, values = time[order], stream.values[good][order]
    new = np.diff(time, prepend=-np.inf) > 0
    repeated = int(len(time) - new.sum())
    if repeated > _DOUBLED * len(time):
        apart = np.abs(np.diff(values))[~new[1:]]
        steps = np.abs(np.diff(values[new]))
        usual = float(np.median(steps)) if len(steps) else 0.0
        if np.median(apart) > DOUBLED_STEPS * max(usual, 1e-12):
            text = f"two values at one time, {np.median(apart):.3g} apart (median): two instruments in one"
            findings.append(fault(f"{stream.name}: {text}", stream.name))
        elif apart.any():
            text = f"{100 * repeated / len(time):.0f} % of its samples have the time of another, and are left out"
            findings.append(note(f"{stream.name}: {text}", stream.name))
    return replace(stream, time_s=time[new], values=values[new]), repeated, findings


def over_midnight(clock_s: Array) -> Array:
    """Times of day (n,), s, that go on over midnight; nan stays."""
    known, out = np.isfinite(clock_s), np.array(clock_s)
    out[known] += 86400 * np.cumsum(np.diff(clock_s[known], prepend=clock_s[known][:1]) < -43200)
    return out


def gaps_of(time_s: Array, longest_s: float) -> list[tuple[float, float]]:
    """Begin and end of each time without samples for longer than `longest_s`, s."""
    wide = np.flatnonzero(np.diff(time_s) > longest_s)
    return [(float(time_s[place]), float(time_s[place + 1])) for place in wide]


def utc_text(time_s: float) -> str:
    """ISO 8601 text of a UTC time, to the millisecond: ``2023-08-06T23:50:06.000Z``."""
    moment = dt.datetime.fromtimestamp(round(time_s, 3), dt.UTC)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")
