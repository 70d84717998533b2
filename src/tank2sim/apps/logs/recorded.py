"""Substitutes that recorders write for values: marks for missing ones (-999, 511 deg), and pulses (1000 to 2000 us)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.content import FEW_SAMPLES
from tank2sim.apps.logs.findings import LogFinding, note
from tank2sim.apps.logs.quantities import QUANTITIES, names_rest, plain_words
from tank2sim.apps.logs.streams import LogStream, wrapped_angle
from tank2sim.arrays import Array
from tank2sim.records.csv_table import LARGEST

# Numbers that recorders write for no value: nines, and the bounds of their integers
_MARK = re.compile(r"-?(9{2,}(\.9+)?|32767|32768|65535|2147483647|2147483648|1023|4095)")
_CIRCULAR = ("cog", "heading")

_JUMP, _LEAST_JUMP = 10.0, 0.05
"""Jump to such a number, as a multiple of the 90th percentile of the steps of the others, and as a share of their range
(of a radian for angles). Project choice."""


def without_missing(stream: LogStream) -> tuple[LogStream, list[LogFinding]]:
    """The stream with nan for numbers that stand for none, and a note of them; streams defined by a format stay.

    A number means no value if it is beyond the bounds of its quantity, or if it is one that recorders write so and is
    further from all others than these are from each other; headings, rates and speeds do not jump to it either.
    """
    if stream.stated_by == "format":
        return stream, []
    values = np.array(stream.values, dtype=float)
    quantity = QUANTITIES.get(stream.quantity, QUANTITIES["ignore"])
    if stream.unit in ("", "deg"):
        values[_beyond(values, quantity.largest_deg)] = np.nan
    while (mark := _lone_mark(values, quantity.nowhere)) is not None:
        values[values == mark] = np.nan
    if quantity.unknown:
        for number in (*quantity.unknown, *filter(_is_mark, _extremes(values))):
            values[_jumps(values, number, stream.quantity in _CIRCULAR)] = np.nan
    lost = np.isnan(values) & np.isfinite(stream.values)
    if not lost.any():
        return stream, []
    shown = ", ".join(f"{number:g}" for number in np.unique(stream.values[lost])[:3])
    text = f"{stream.name}: {lost.sum()} values of {shown} are taken for missing ones"
    return replace(stream, values=values), [note(text, stream.name, values=float(lost.sum()))]


def _beyond(values: Array, bound: float) -> np.ndarray:
    """Which values (n,) are beyond a bound of which most keep within."""
    sizes = np.minimum(np.abs(values), LARGEST)
    usual = np.isfinite(sizes).any() and np.nanmedian(sizes) <= bound
    return np.asarray((sizes > bound) & usual)


def _extremes(values: Array) -> list[float]:
    """The least and the largest of the known values (n,)."""
    known = values[np.isfinite(values)]
    return [float(known.min()), float(known.max())] if len(known) else []


def _is_mark(number: float) -> bool:
    """Whether recorders write this number for no value."""
    return bool(_MARK.fullmatch(f"{number:.10g}"))


def _lone_mark(values: Array, more: Sequence[float]) -> float | None:
    """The least or largest value, if it is a mark that is far from all others; None if neither is."""
    known = values[np.isfinite(values)]
    for extreme in _extremes(values):
        others = known[known != extreme]
        far = len(others) >= FEW_SAMPLES and np.abs(others - extreme).min() > np.ptp(others)
        if far and (_is_mark(extreme) or extreme in more):
            return extreme
    return None


def _jumps(values: Array, number: float, circular: bool) -> np.ndarray:
    """Where a series (n,) has a number and jumps to it from the values around."""
    at = values == number
    others = np.isfinite(values) & ~at
    if not at.any() or others.sum() < FEW_SAMPLES:
        return np.zeros(len(values), dtype=bool)
    if circular and number < 0 <= values[others].min():
        return np.asarray(at)
    place = np.arange(len(values))
    series = np.unwrap(np.radians(values[others])) if circular else values[others]
    difference = np.interp(place, place[others], series) - (np.radians(values) if circular else values)
    difference = wrapped_angle(difference) if circular else difference
    least = _LEAST_JUMP * (1.0 if circular else float(np.ptp(series)))
    return np.asarray(at & (np.abs(difference) > max(_JUMP * float(np.percentile(np.abs(np.diff(series)), 90)), least)))


SHORTEST_US, LONGEST_US = 750.0, 2250.0
"""Bounds of pulses: radio control has 1000 to 2000 us, and controllers take some more (project choice)."""

MIDDLE_US, SPAN_US, WIDE_SPAN_US = 1500.0, 400.0, 500.0
"""Rest of a rudder or of a thruster that turns both ways, and full order from there: the defaults of ArduPilot
(SERVOn_MIN, _TRIM, _MAX; ardupilot.org), or the whole of 1000 to 2000 us where a pulse is beyond those."""

_BEYOND_US, _IDLE_US, _REST_OFF_US = 10.0, 1150.0, 100.0
"""Least excess of a pulse beyond the usual range, longest pulse of a controller at rest that turns one way, and largest
distance of a rest from :data:`MIDDLE_US` (project choices: trims are some tens of us)."""

_PULSE_WORDS = re.compile(
    r"\b(pwm|pulse|servo\d*|output|outputs|rcou|rcout|rc|esc\d*|ch\d*|chan\d*|channels?|ch ?\d* ?out|c\d+)\b"
)
_PULSE_UNITS = ("us", "\u00b5s", "\u03bcs", "pwm")
_ORDERS = ("thrust_order_port", "thrust_order_starboard", "rudder_order", "rudder_angle", "rpm_order")


@dataclass(frozen=True)
class PulseScale:
    """Pulses of rest and of full order: share = (pulse - `rest_us`) / `span_us`."""

    rest_us: float
    span_us: float

    def resting_at(self, rest_us: float, pulses: Array) -> PulseScale:
        """The scale with another rest; the farther end of the pulses (n,), or of the usual range, is the full order."""
        ends = self.rest_us - self.span_us, self.rest_us + self.span_us
        reach = max(abs(end - rest_us) for end in (*ends, float(np.nanmin(pulses)), float(np.nanmax(pulses))))
        return PulseScale(rest_us, reach)

    @property
    def two_way(self) -> PulseScale:
        """The scale with rest in the middle, as of a rudder that lay hard over for most of a log."""
        return PulseScale(MIDDLE_US, self.rest_us + self.span_us - MIDDLE_US)

    def share(self, pulses: Array) -> Array:
        """Shares of the full order (n,) of pulses (n,), us."""
        return (pulses - self.rest_us) / self.span_us


def rest_of(stream: LogStream) -> float | None:
    """Pulse of rest (us) of a stream that holds it, by its name and its steady value; None of any other stream."""
    values = stream.values[np.isfinite(stream.values)]
    if not len(values) or not names_rest(stream.name):
        return None
    middle = float(np.median(values))
    return middle if abs(middle - MIDDLE_US) < _REST_OFF_US and np.ptp(values) < _REST_OFF_US else None


def pulses_of(stream: LogStream) -> tuple[LogStream, PulseScale | None]:
    """A stream of pulses without zeros, which are no pulses, and its scale; any other as it is, and None.

    Pulses are within :data:`SHORTEST_US` and :data:`LONGEST_US`, and the unit or the name says so (``pwm_left``,
    ``servo1_raw``), or its quantity is an order.

    Examples
    --------
    >>> import numpy as np
    >>> from tank2sim.apps.logs.streams import LogStream
    >>> pulses, scale = pulses_of(LogStream("pwm_left", np.arange(4.0), np.array([1500.0, 1500.0, 1700.0, 1100.0])))
    >>> scale.share(pulses.values).tolist()
    [0.0, 0.0, 0.5, -1.0]
    """
    if not _may_be_pulses(stream):
        return stream, None
    values = np.where(stream.values > 0, stream.values, np.nan)
    known = values[np.isfinite(values)]
    if not len(known) or known.min() < SHORTEST_US or known.max() > LONGEST_US or np.ptp(known) == 0:
        return stream, None
    beyond = max(known.max() - MIDDLE_US, MIDDLE_US - known.min()) > SPAN_US + _BEYOND_US
    full = MIDDLE_US + (WIDE_SPAN_US if beyond else SPAN_US)
    levels, counts = np.unique(known.round(), return_counts=True)
    one_way = levels[0] <= _IDLE_US and counts[0] == counts.max() and not stream.quantity.startswith("rudder")
    rest = float(levels[0]) if one_way else MIDDLE_US
    return replace(stream, values=values), PulseScale(rest, full - rest)


def _may_be_pulses(stream: LogStream) -> bool:
    """Whether the unit, the quantity or the name of a stream says pulses or an order, and none of them another."""
    if stream.stated_by == "format" or (stream.quantity and stream.quantity not in _ORDERS):
        return False
    if stream.unit:
        return stream.unit.lower() in _PULSE_UNITS
    return bool(stream.quantity or _PULSE_WORDS.search(plain_words(stream.name)))
