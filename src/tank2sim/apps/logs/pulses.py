"""Orders that are recorded as pulses for servos and speed controllers, 1000 to 2000 us."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.quantities import names_rest, plain_words
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array

SHORTEST_US, LONGEST_US = 750.0, 2250.0
"""Bounds of pulses: radio control has 1000 to 2000 us, and controllers take some more (project choice)."""

MIDDLE_US, SPAN_US, WIDE_SPAN_US = 1500.0, 400.0, 500.0
"""Rest of a rudder or of a thruster that turns both ways, and full order from there: the defaults of ArduPilot
(SERVOn_MIN, _TRIM, _MAX; ardupilot.org), or the whole of 1000 to 2000 us where a pulse is beyond those."""

_BEYOND_US = 10.0
_IDLE_US = 1150.0
"""Longest pulse of a controller at rest that turns one way (project choice)."""

_REST_OFF_US = 100.0
"""Largest distance of a rest from :data:`MIDDLE_US` (project choice: trims are some tens of us)."""

_WORDS = re.compile(
    r"\b(pwm|pulse|servo\d*|output|outputs|rcou|rcout|rc|esc\d*|ch\d*|chan\d*|channels?|ch ?\d* ?out|c\d+)\b"
)
_UNITS = ("us", "\u00b5s", "\u03bcs", "pwm")
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
    """A stream of pulses without those of 0, which are none, and their scale; any other as it is, and None.

    Pulses are within :data:`SHORTEST_US` and :data:`LONGEST_US`, and the unit or the name says so (``pwm_left``,
    ``servo1_raw``), or its quantity is an order.

    Parameters
    ----------
    stream : LogStream

    Examples
    --------
    >>> import numpy as np
    >>> from tank2sim.apps.logs.streams import LogStream
    >>> pulses, scale = pulses_of(LogStream("pwm_left", np.arange(3.0), np.array([1500.0, 1700.0, 1100.0])))
    >>> scale.share(pulses.values).tolist()
    [0.0, 0.5, -1.0]
    """
    unit = stream.unit.lower()
    other = unit not in ("", *_UNITS) or (stream.quantity and stream.quantity not in _ORDERS)
    if other or stream.stated_by == "format":
        return stream, None
    if not (unit or stream.quantity or _WORDS.search(plain_words(stream.name))):
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
