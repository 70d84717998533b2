"""Channels of a voyage: which stream holds which quantity, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.logs.quantities import QUANTITIES
from tank2sim.logs.streams import LogFinding

USED_FROM = 0.7
"""Confidence from which a channel is used. Project choice: a name without a contradiction suffices, content alone only
if it is decisive."""

SURE_FROM = 0.9
"""Confidence from which nobody is asked to confirm a channel. Project choice: two of format, name and content agree."""


@dataclass(frozen=True)
class LogChannel:
    """A quantity and the stream that holds it: value in `unit` is ``sign * scale * (recorded - offset)``.

    Parameters
    ----------
    quantity : str
        A key of :data:`.quantities.QUANTITIES`.
    stream : str
        Name of the stream.
    unit : str
        Unit of the value; a key of the quantity's units.
    sign, scale, offset : float
        Of the conversion above; the offset is in the unit of the record.
    delay_s : float
        By how much the stream is late, s; its times are set back by it.
    confidence : float
        0 to 1.
    why : str
        What the confidence rests on.
    use : bool
    """

    quantity: str
    stream: str
    unit: str
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0
    delay_s: float = 0.0
    confidence: float = 1.0
    why: str = ""
    use: bool = True

    def si(self, values: Array) -> Array:
        """Recorded values (n,) in SI: rad, m/s, rad/s; degrees for latitude and longitude, shares for orders."""
        factor = QUANTITIES[self.quantity].units.get(self.unit, 1.0)
        return np.asarray(factor * self.sign * self.scale * (values - self.offset))


@dataclass(frozen=True)
class ChannelSet:
    """Channels of a voyage, each quantity at most once among those in use, and what was found on the way."""

    channels: tuple[LogChannel, ...]
    findings: tuple[LogFinding, ...] = ()

    def used(self, quantity: str) -> LogChannel | None:
        """The channel in use for a quantity; None without one."""
        return next((channel for channel in self.channels if channel.use and channel.quantity == quantity), None)
