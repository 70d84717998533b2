"""Data of the search for channels: streams, the channels found among them, their confidence, and the motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.channels import USED_FROM, ChannelSet, LogChannel
from tank2sim.apps.logs.content import AGREES, DIFFERS, ContentEvidence, rate_delay
from tank2sim.apps.logs.findings import LogFinding, fault, note
from tank2sim.apps.logs.quantities import QUANTITIES, unit_by_size
from tank2sim.apps.logs.recorded import PulseScale, pulses_of, rest_of
from tank2sim.apps.logs.reference import ReferenceMotion, held, interpolated, thinned_series
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

_TESTED_STEP_S = 0.2
"""Streams are thinned to this step for the tests, s. Project choice: yaw of small craft lasts a second or more."""

HEADINGS_APART_DEG = 5.0
"""Mean difference of two headings, deg, from which they contradict each other (project choice: beyond the deviation of
a compass that was swung)."""

# Quantities that a vessel may have twice, each with a name of its own
_TWINS = ("rudder_angle", "rudder_order", "rpm", "rpm_order")

STATED = {"format": 0.95, "name": 0.75, "": 0.6}
"""Confidence by what states a quantity, before its content is tested."""

_AGREED = {"format": 0.99, "name": 0.96, "": 0.9}
REFUTED = 0.2
"""Confidence of a stream whose content contradicts its name."""


@dataclass
class Judgement:
    """A stream's interpretation: confidence and its reason, unit, sign and zero of the record."""

    stream: LogStream
    confidence: float
    why: str
    unit: str
    sign: int = 1
    offset: float = 0.0

    def refuse(self, why: str) -> None:
        """Take it for contradicted."""
        self.confidence, self.why = REFUTED, why

    def doubt(self, most: float, text: str) -> None:
        """Bound the confidence, and say why."""
        self.confidence, self.why = min(self.confidence, most), f"{self.why}{text}"

    def turn(self, confidence: float, against: str) -> None:
        """Take it for positive to port, unless its format says that it is not."""
        if self.stream.stated_by == "format":
            self.refuse(f"{self.why}: {against}")
        else:
            self.sign, self.confidence, self.why = -1, confidence, f"{self.why}: positive to port"


class ChannelSearch:
    """Streams, the channels found among them, and the motion and rate of turn that later steps compare with."""

    def __init__(self, streams: Sequence[LogStream]) -> None:
        empty = np.zeros(0)
        self.streams = list(streams)
        self.place = {stream.name: place for place, stream in enumerate(streams)}
        self.found: list[LogChannel] = []
        self.findings: list[LogFinding] = []
        self.motion = ReferenceMotion(empty, empty, empty, empty, empty)
        self.rate: tuple[Array, Array] = (empty, empty)
        self.way: tuple[Array, Array] = (empty, empty)  # 1 ahead, -1 astern; empty of a vessel that goes ahead
        self.pulse_scales: dict[str, PulseScale] = {}
        # Pulses are searched as shares of full order; streams that hold their rest are no orders.
        rests = {stream.name: rest for stream in self.streams if (rest := rest_of(stream)) is not None}
        for place, stream in enumerate(self.streams):
            pulses, scale = pulses_of(stream)
            if stream.name in rests:
                self.streams[place] = replace(stream, quantity="")
            elif scale is not None:
                # The rest of an order is in the column whose name begins with its own.
                rest = next((rest for name, rest in rests.items() if name.startswith(stream.name)), scale.rest_us)
                scale = self.pulse_scales[stream.name] = scale.resting_at(rest, pulses.values)
                self.streams[place] = replace(stream, values=scale.share(pulses.values), unit="1")

    # What is known ----------------------------------------------------------------------------------------------

    def named(self, *quantities: str) -> list[LogStream]:
        """Streams of these quantities by format or name."""
        return [stream for stream in self.streams if stream.quantity in quantities]

    def stream(self, name: str) -> LogStream:
        """The stream of a name."""
        return self.streams[self.place[name]]

    def coverage(self, name: str) -> float:
        """Samples of a stream, to a factor of two: a slower one is not better for a few gaps fewer."""
        return round(math.log2(max(len(self.stream(name).values), 1)))

    def best(self, quantity: str) -> LogChannel | None:
        """The likeliest channel of a quantity; None where none is likely enough."""
        good = [channel for channel in self.found if channel.quantity == quantity and channel.confidence >= USED_FROM]
        return max(good, key=lambda c: (c.confidence, self.coverage(c.stream), -self.place[c.stream]), default=None)

    def thin(self, stream: LogStream) -> tuple[Array, Array]:
        """Times and values of a stream for the tests."""
        return thinned_series(stream.time_s, stream.values, _TESTED_STEP_S)

    def angle(self, stream: LogStream) -> tuple[Array, Array]:
        """Time and angle of a direction, rad, thinned by picking."""
        stride = max(1, round(_TESTED_STEP_S / usual_step(stream.time_s)))
        unit = stream.unit or unit_by_size("heading", stream.values)
        return stream.time_s[::stride], stream.values[::stride] * QUANTITIES["heading"].units[unit]

    def series(self, channel: LogChannel) -> tuple[Array, Array]:
        """Times and SI values of a channel."""
        stream = self.stream(channel.stream)
        return stream.time_s, channel.si(stream.values)

    def heading_at(self, at: Array) -> Array:
        """Heading (n,), rad; nan where it is not known."""
        return interpolated(at, self.motion.heading_time_s, self.motion.heading_rad, 10.0)

    def way_at(self, at: Array) -> Array:
        """Sign of the speed ahead (n,) at other times: 1, or -1 where a vessel was found to go astern."""
        time, way = self.way
        return np.nan_to_num(held(at, time, way), nan=way[0]) if len(way) else np.ones(len(at))

    # What is found ----------------------------------------------------------------------------------------------

    def rename(self, stream: LogStream, quantity: str) -> None:
        """Take a stream for another quantity."""
        self.streams[self.place[stream.name]] = replace(stream, quantity=quantity)

    def fault(self, stream: str, text: str) -> None:
        """Say what is wrong with a stream."""
        self.findings.append(fault(f"{stream}: {text}", stream))

    def note(self, stream: str, text: str, **evidence: float) -> None:
        """Say what is found of a stream."""
        self.findings.append(note(f"{stream} {text}", stream, **evidence))

    def judged(self, stream: LogStream, evidence: ContentEvidence, agrees: float = AGREES) -> Judgement:
        """Confidence of a stream in its quantity by content, and why."""
        by, agreement = stream.stated_by, evidence.agreement
        why = {"format": "by its format", "name": "by its name", "": "by its place"}[by]
        if agreement is None:
            stated, words = (0.1, " and unit") if by == "name" and stream.unit else (0.0, "")
            confidence, why = STATED[by] + stated, f"{why}{words}; {evidence.text}"
        elif agreement >= agrees:
            confidence, why = _AGREED[by], f"{why}; {evidence.text}"
        elif agreement < DIFFERS:
            confidence, why = REFUTED, f"{why}, but {evidence.text}"
        else:
            confidence, why = STATED[by] - 0.1, f"{why}; {evidence.text}, which is weak"
        return Judgement(stream, confidence, why, stream.unit or evidence.unit)

    def take(self, found: Judgement, quantity: str = "") -> None:
        """Add a judged stream; one that is contradicted is a fault."""
        if found.confidence < DIFFERS:
            self.fault(found.stream.name, found.why)
        self.add(found, quantity)

    def add(self, found: Judgement, quantity: str = "") -> None:
        """Add the channel of a stream, of its own or another quantity."""
        quantity = quantity or found.stream.quantity
        if found.unit not in QUANTITIES[quantity].units:
            found.unit = ""
            found.doubt(0.6, "; its unit is unknown")
        self.found.append(
            LogChannel(
                quantity,
                found.stream.name,
                found.unit,
                sign=found.sign,
                offset=found.offset,
                confidence=round(found.confidence, 2),
                why=found.why,
                use=False,
            )
        )

    def add_unnamed(
        self,
        stream: LogStream,
        quantity: str,
        confidence: float,
        evidence: ContentEvidence,
        more: str = "",
        unit: str = "",
    ) -> None:
        """Add a stream whose name says nothing, by its content; `more` is said of it, and a `unit` by its size."""
        why = f"by content alone: {evidence.text}{more}"
        self.add(Judgement(stream, confidence, why, unit or stream.unit or evidence.unit, evidence.sign), quantity)

    def doubt(self, why: str, *streams: str) -> None:
        """Let no channel of these streams be used."""
        for place, channel in enumerate(self.found):
            if channel.stream in streams:
                self.found[place] = replace(channel, confidence=REFUTED, why=f"{channel.why}, but {why}")

    # The result -------------------------------------------------------------------------------------------------

    def result(self) -> ChannelSet:
        """Channels in the order of quantities, the best of each in use, and all findings."""
        used = {id(best) for name in QUANTITIES if (best := self.best(name)) is not None}
        channels = [self._of_pulses(replace(channel, use=id(channel) in used)) for channel in self.found]
        self._twins(channels)
        self._headings_apart(channels)
        self._set_back(channels)
        order = {name: place for place, name in enumerate(QUANTITIES)}
        channels.sort(key=lambda c: (order[c.quantity], not c.use, -c.confidence))
        return ChannelSet(tuple(channels), tuple(self.findings))

    def _of_pulses(self, channel: LogChannel) -> LogChannel:
        """The channel by what was recorded, if that was pulses."""
        scale = self.pulse_scales.get(channel.stream)
        if scale is None:
            return channel
        if channel.quantity.startswith("rudder"):
            scale = scale.two_way
        if channel.use:
            full = scale.rest_us + scale.span_us
            text = f"holds pulses: {scale.rest_us:g} us is taken as rest and {full:g} us as full order"
            self.note(channel.stream, text)
        offset = scale.rest_us + channel.offset * scale.span_us
        return replace(channel, scale=channel.scale / scale.span_us, offset=offset)

    def _twins(self, channels: Sequence[LogChannel]) -> None:
        """Name the second rudder, order or shaft that is as good and not used."""
        for used, other in _seconds(channels, *_TWINS):
            time, values = self.series(other)
            at, first = self.series(used)
            factor = QUANTITIES[used.quantity].units[used.unit]
            apart = float(np.median(np.abs(first - np.interp(at, time, values)))) / factor
            text = f"{used.stream} is used, and not {other.stream}, another {QUANTITIES[used.quantity].words}, "
            self.findings.append(note(f"{text}{apart:.3g} {used.unit} apart (median)", other.stream, apart=apart))

    def _headings_apart(self, channels: Sequence[LogChannel]) -> None:
        """Name a second heading that differs from the one in use: one of the two is off, or looks elsewhere."""
        for used, other in _seconds(channels, "heading"):
            (at, first), (time, second) = self.series(used), self.series(other)
            nearest = np.clip(np.searchsorted(time, at), 0, len(time) - 1)
            size = float(np.degrees(np.angle(np.mean(np.exp(1j * (second[nearest] - first))))))
            if abs(size) > HEADINGS_APART_DEG:
                text = (
                    f"{used.stream} is used, and {other.stream}, another heading, is {size:+.0f} deg from it: state "
                    "the right one (a fault of one source, or it is mounted at an angle)"
                )
                self.findings.append(fault(text, other.stream, apart_deg=size))

    def _set_back(self, channels: list[LogChannel]) -> None:
        """Give the later of heading and rate of turn its delay, where it is certain: neither can be early."""
        used = {channel.quantity: place for place, channel in enumerate(channels) if channel.use}
        if not {"heading", "yaw_rate"} <= used.keys():
            return
        heading, rate = (channels[used[name]] for name in ("heading", "yaw_rate"))
        time, angle = self.angle(self.stream(heading.stream))
        found = rate_delay(time, np.unwrap(angle), *self.series(rate))
        if found is None or not found.certain:
            return
        late, other = (rate, heading) if found.delay_s > 0 else (heading, rate)
        delay = round(abs(found.delay_s), 2)
        words = f"{delay:g} ± {found.standard_error_s:.1g} s behind {other.stream}"
        channels[used[late.quantity]] = replace(late.because(f"{words}, and set back by it"), delay_s=delay)
        self.note(late.stream, f"is {words} and is set back by it (delay_s in channels.toml)", delay_s=delay)


def _seconds(channels: Sequence[LogChannel], *quantities: str) -> list[tuple[LogChannel, LogChannel]]:
    """Channels in use, each with another of its quantity that is as good."""
    return [
        (used, other)
        for used in channels
        if used.use and used.quantity in quantities
        for other in channels
        if other.quantity == used.quantity and not other.use and other.confidence >= USED_FROM
    ]
