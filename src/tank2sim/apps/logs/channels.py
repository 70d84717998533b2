"""Channels of a voyage: which stream holds which quantity, and how sure that is; and their file ``channels.toml``."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from tank2sim.apps.logs.findings import LogFinding
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.arrays import Array
from tank2sim.cards.reading import parsed_toml
from tank2sim.errors import InputError, close_name
from tank2sim.files import read_text

USED_FROM = 0.7
"""Confidence from which a channel is used. Project choice: a name without a contradiction suffices, content alone only
if it is decisive."""

SURE_FROM = 0.9
"""Confidence from which nobody is asked to confirm a channel. Project choice: two of format, name and content agree."""

CHANNELS_FORMAT = "tank2sim-channels/1"
"""First key of the file."""

CHANNELS_FILE = "channels.toml"
"""Its name in the folder of a voyage."""

_USUAL: dict[str, float] = {"sign": 1, "scale": 1.0, "offset": 0.0, "delay_s": 0.0}
_KEYS = ("quantity", "stream", "unit", "sign", "scale", "offset", "delay_s", "confidence", "why", "use")

_HEAD = """\
Which stream of the log is which quantity. A value is sign * scale * (recorded - offset), in the unit; starboard,
ahead and clockwise are positive; delay_s is by how much the stream is late. Correct what is wrong, set use = true or
false, and run again: what is in this file is taken as it is."""


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
        Numbers of the conversion above; the offset is in the unit of the record.
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

    def because(self, why: str, *, least: float = 0.0, most: float = 1.0) -> LogChannel:
        """The channel with a further reason, its confidence at `least` and at `most` these."""
        reasons = "; ".join(filter(None, (self.why, why)))
        return replace(self, confidence=min(max(self.confidence, least), most), why=reasons)

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


def channels_text(channels: ChannelSet) -> str:
    """Text of the file, all channels, those in use first of each quantity."""
    document = tomlkit.document()
    for line in _HEAD.splitlines():
        document.add(tomlkit.comment(line))
    document["format"] = CHANNELS_FORMAT
    entries = tomlkit.aot()
    for channel in channels.channels:
        entry = tomlkit.table()
        for key in _KEYS:
            value = getattr(channel, key)
            if key == "sign" or value != _USUAL.get(key):
                entry[key] = float(f"{value:.9g}") if isinstance(value, float) else value
        entries.append(entry)
    document["channels"] = entries
    return tomlkit.dumps(document)


def read_channels(path: Path) -> ChannelSet:
    """Read the file; its channels in use are taken as certain.

    Raises
    ------
    InputError
        It is not such a file, a key or quantity is unknown, a unit does not fit its quantity, or two channels in use
        are one quantity.
    """
    content = parsed_toml(read_text(path), path)
    if content.get("format") != CHANNELS_FORMAT:
        raise InputError(path, "format", f"is {content.get('format')!r}", f"write format = {CHANNELS_FORMAT!r}")
    entries = content.get("channels")
    if not isinstance(entries, list) or not entries:
        raise InputError(path, "channels", "is missing", "write [[channels]] with quantity, stream and unit")
    channels = [_channel(path, place, entry) for place, entry in enumerate(entries, start=1)]
    used = [channel.quantity for channel in channels if channel.use and channel.quantity != "ignore"]
    for quantity in used:
        if used.count(quantity) > 1:
            raise InputError(path, f"quantity {quantity}", "is in use twice", "set use = false for all but one")
    return ChannelSet(tuple(channels))


def _channel(path: Path, place: int, entry: Any) -> LogChannel:
    for key, problem, remedy in itertools.chain(_entry_faults(entry), _number_faults(entry)):
        raise InputError(path, ", ".join(filter(None, (f"channel {place}", key))), problem, remedy)
    use = bool(entry.get("use", True))
    numbers = {key: float(entry.get(key, usual)) for key, usual in _USUAL.items()}
    return LogChannel(
        entry["quantity"],
        entry["stream"],
        entry.get("unit", ""),
        sign=int(numbers.pop("sign")),
        **numbers,
        confidence=1.0 if use else float(entry.get("confidence", 0.0)),
        why="by the channels file" if use else str(entry.get("why", "")),
        use=use,
    )


def _entry_faults(entry: Any) -> Iterator[tuple[str, str, str]]:
    """Key, problem and remedy of each fault in the form, quantity and unit of a channel."""
    if not isinstance(entry, dict):
        yield "", "is not a table", "write [[channels]] with quantity, stream and unit"
    for key in sorted(entry.keys() - set(_KEYS), key=list(entry).index):
        yield key, "is not a key", close_name(key, _KEYS)
    for key in ("quantity", "stream"):
        if not isinstance(entry.get(key), str):
            yield key, "is missing", f"write {key} as text"
    quantity, unit = entry["quantity"], entry.get("unit", "")
    if quantity not in QUANTITIES:
        yield "quantity", f"{quantity!r} is not known", close_name(quantity, QUANTITIES)
    units = QUANTITIES[quantity].units
    if entry.get("use", True) and quantity != "ignore" and unit not in units:
        yield "unit", f"{unit!r} is not a unit of {quantity}", f"write one of {', '.join(units)}"


def _number_faults(entry: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Key, problem and remedy of each fault in the numbers of a channel."""
    numbers = {key: entry.get(key, usual) for key, usual in _USUAL.items()}
    for key, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            yield key, f"is {value!r}", "write a number"
    if numbers["sign"] not in (1, -1):
        yield "sign", f"is {numbers['sign']}", "write 1 or -1"
    if numbers["scale"] <= 0:
        yield "scale", f"is {numbers['scale']}", "write a positive number, and the sign as sign"
