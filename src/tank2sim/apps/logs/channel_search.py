"""The search for the channels of a voyage: by format, names, units and content, with a confidence."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.apps.logs.channels import SURE_FROM, USED_FROM, ChannelSet, LogChannel
from tank2sim.apps.logs.clock import usual_step, utc_text
from tank2sim.apps.logs.content import (
    AGREES,
    DIFFERS,
    FEW_SAMPLES,
    UNIT_SLACK,
    UNTESTED,
    ContentEvidence,
    angle_unit,
    component_evidence,
    direction_evidence,
    rate_evidence,
    rudder_unit,
    speed_evidence,
    steering_evidence,
)
from tank2sim.apps.logs.delays import rate_delay
from tank2sim.apps.logs.pulses import PulseScale, pulses_of, rest_of
from tank2sim.apps.logs.quantities import QUANTITIES, names_another, names_thrust, plain_words, sign_of_name
from tank2sim.apps.logs.reference import (
    HEADING_WINDOW_S,
    LEAST_SPEED_MPS,
    POSITION_WINDOW_S,
    ReferenceMotion,
    differenced,
    interpolated,
    local_metres,
    rounded_origin,
    thinned_series,
)
from tank2sim.apps.logs.streams import LogFinding, LogStream
from tank2sim.arrays import Array

FULL_RUDDER_DEG = 35.0
"""Rudder angle at full order where a log has shares alone: 35 deg on either side (SOLAS II-1, regulation 29.3.1)."""

LARGEST_OFFSET_RAD = math.radians(30.0)
"""Mean difference of heading and course beyond which a heading is doubtful. Project choice: leeway and current of a
third of the speed turn a course by 20 deg; compasses mounted askew are off by 90 or 180."""

RECEIVERS_APART_M = 10.0
"""Median distance of two tracks from which they are reported as of two receivers, m. Project choice: beyond the errors
of a receiver; antennas of a ship may be as far apart, which a track has to know too."""

FASTEST_TRACK_MPS = 60.0
"""Speed that no track of a vessel has, m/s: the record on water is 142, of vessels in service below 50."""

_DERIVATIVE = 0.95
"""Correlation of a rate of turn with the derivative of its heading. Project choice: sensors reach 0.99, and a course
over ground, which is noisier and has the drift in it, does not."""

_TESTED_STEP_S = 0.2
"""Streams are thinned to this step for the tests, s. Project choice: yaw of small craft lasts a second or more."""

ALONE_LESS = 0.1
"""A pair of orders is one of thrusters if either alone agrees with the turn by so much less than their difference
(project choice)."""

_PAIRED = 0.5
"""Share of the samples of a latitude that have a longitude at the same time, from which they are a pair (project
choice)."""

_LONGEST_VOYAGE_DEG = 5.0
"""Change of latitude or longitude in a log, deg, up to which a stream without a name may be one. Project choice: 300
nautical miles of latitude, a day of sailing."""

_MOST_TRIED = 8
"""Streams without a name of which positions are tried (project choice: 56 pairs)."""

_HOLDS, _MOVES = 0.5, 0.2
"""Share of samples equal to the one before of a stream that holds its values, as an order does, and of one that moves
(project choice)."""

_CLEARLY = 0.05
"""By how much the agreement of a rudder with the turn is above that of all other streams (project choice)."""

_CLEARLY_REVERSED = 0.2
"""By how much the agreement of the speed with the difference of two orders is above that with their sum, where one
controller is reversed (project choice)."""

_LITTLE, _TURNED_RAD = 0.4, math.pi / 2
"""Size of the sum of two orders over that of their difference, and change of heading, rad, below which a vessel goes
straight although its orders are opposite (project choice)."""

_DOUBTED = 0.85
"""Largest confidence of a stream of which one thing is open: whether it is measured or ordered, or its unit."""

_ASTERN_SHARE, _ASTERN_S = 0.15, 8.0
"""Shares of the usual speed and of the usual revolutions, and a time, s, from which a vessel goes astern against them.
Project choice: beyond what a current or a coasting propeller does."""

HEADINGS_APART_DEG = 5.0
"""Mean difference of two headings, deg, from which they contradict each other (project choice: beyond the deviation of
a compass that was swung)."""

_MUCH_LESS = 0.7
"""Ratio of deviations from which the lesser one decides (project choice)."""

_FASTEST_SHAFT_HZ = 100.0
"""Revolutions beyond which a record without a unit is in rpm, 1/s: small thrusters reach 80 (project choice)."""

_LARGEST_HEEL_RAD = 0.8
"""Heel beyond which a record without a unit is in deg: 46 deg in rad (project choice)."""

_VECTORS = (("u_ground", "v_ground"), ("u_water", "v_water"), ("v_north", "v_east"))
"""Quantities that are the components of one velocity."""

_STEERING = ("rudder_angle", "rudder_order", "rpm", "rpm_order")
"""Quantities of which a vessel may have two, each of its own."""

_LEAST_ZERO = 10.0
"""Rudder on straight legs, deg or %, from which a zero of the record is taken out. Project choice: wind and a single
propeller ask for some degrees (SNAME, PNA vol. III, IX.17); servos rest at 90 deg, sensors amid their range."""

_LEAST_HELM = 4.0
"""Rudder on straight legs, deg, that is doubted. Project choice: from here on a held rudder is taken to turn."""

LARGEST_LOGGED_RUDDER_RAD = math.radians(75.0)
"""Angle that no rudder goes beyond: Schilling rudders go to 70 or 75 deg."""

_SHOWN = 0.6
"""Agreement of a rudder with the turn from which its sign and zero are shown. Project choice: waves and currents turn
a ship too."""

_STRAIGHT_S = 10.0
"""Time before and after for which a straight leg has been one, s. Project choice: rudders cross their zero faster."""

_LEAST_ZERO_SHARE = 0.4
"""The same of a rudder of unknown unit, as a share of its range (project choice): it hardly crosses its zero."""

_SERVO_DEG = 90.0
"""Servos rest at 90 deg of 180, or at 180 of 360."""

_STRAIGHT_SHARE = 0.1
"""Rate of turn on straight legs, as a share of its 99th percentile (project choice)."""

_LEAST_STRAIGHT = 0.02
"""Share of a log that must be straight legs to show the zero of a rudder (project choice)."""

_BASE = {"format": 0.95, "name": 0.75, "": 0.6}
_AGREED = {"format": 0.99, "name": 0.96, "": 0.9}
_CONTRADICTED = 0.2


def find_channels(streams: Iterable[LogStream]) -> ChannelSet:
    """Find the channel of each quantity.

    The position gives the motion against which headings, courses and speeds are tested; the heading gives the rate of
    turn; the rate of turn gives rudders and thrusters. A stream whose content contradicts its name or format is not
    used, and is a fault in the findings; the one of several that agrees best is used.
    """
    search = _Search([stream for stream in streams if len(stream.values) >= 2])
    search.pulses()
    search.positions()
    search.headings()
    search.rates()
    search.speeds()
    search.vectors()
    search.unnamed()
    search.unnamed_thrusters()
    search.steering()
    search.thrusters()
    search.others()
    search.lost_signs()
    return search.result()


class _Search:
    """The search in its steps; each leaves channels and what later steps compare with."""

    def __init__(self, streams: Sequence[LogStream]) -> None:
        self.streams = list(streams)
        self.found: list[LogChannel] = []
        self.findings: list[LogFinding] = []
        empty = np.zeros(0)
        self.motion = ReferenceMotion(empty, empty, empty, empty, empty)
        self.rate: tuple[Array, Array] = (empty, empty)
        self.pulse_scales: dict[str, PulseScale] = {}

    def pulses(self) -> None:
        """Search among the shares that pulses are of full order; streams that hold their rest are no orders."""
        rests = {stream.name: rest for stream in self.streams if (rest := rest_of(stream)) is not None}
        self.streams = [replace(stream, quantity="") if stream.name in rests else stream for stream in self.streams]
        for place, stream in enumerate(self.streams):
            if stream.name in rests:
                continue
            pulses, scale = pulses_of(stream)
            if scale is not None:
                # The rest of an order is in the column whose name begins with its own.
                own = [rest for name, rest in rests.items() if name.startswith(stream.name)]
                scale = scale.resting_at(own[0] if own else scale.rest_us, pulses.values)
                self.pulse_scales[stream.name] = scale
                self.streams[place] = replace(stream, values=scale.share(pulses.values), unit="1")

    def _of_pulses(self, channel: LogChannel) -> LogChannel:
        """The channel by what was recorded, if that was pulses."""
        scale = self.pulse_scales.get(channel.stream)
        if scale is None:
            return channel
        if channel.quantity.startswith("rudder"):
            scale = scale.two_way
        if channel.use:
            full = scale.rest_us + scale.span_us
            text = f"{channel.stream} holds pulses: {scale.rest_us:g} us is taken as rest and {full:g} us as full order"
            self.findings.append(LogFinding("note", text, channel.stream))
        offset = scale.rest_us + channel.offset * scale.span_us
        return replace(channel, scale=channel.scale / scale.span_us, offset=offset)

    def named(self, *quantities: str) -> list[LogStream]:
        return [stream for stream in self.streams if stream.quantity in quantities]

    def thin(self, stream: LogStream) -> tuple[Array, Array]:
        return thinned_series(stream.time_s, stream.values, _TESTED_STEP_S)

    def add(self, stream: LogStream, confidence: float, why: str, **changes: object) -> None:
        quantity = str(changes.pop("quantity", stream.quantity))
        unit = str(changes.pop("unit", stream.unit))
        if unit not in QUANTITIES[quantity].units:
            unit, confidence, why = "", min(confidence, 0.6), f"{why}; its unit is unknown"
        values: dict[str, object] = {"confidence": round(confidence, 2), "why": why, "use": False, **changes}
        self.found.append(LogChannel(quantity, stream.name, unit, **values))  # type: ignore[arg-type]

    def fault(self, stream: LogStream, text: str) -> None:
        self.findings.append(LogFinding("fault", f"{stream.name}: {text}", stream.name))

    def judged(self, stream: LogStream, evidence: ContentEvidence, *, agrees: float = AGREES) -> tuple[float, str]:
        """Confidence of a stream in its quantity by content, and why."""
        basis = {"format": "by its format", "name": "by its name", "": "by its place"}[stream.stated_by]
        if evidence.agreement is None:
            stated = 0.1 if stream.stated_by == "name" and stream.unit else 0.0
            return _BASE[stream.stated_by] + stated, f"{basis}{' and unit' if stated else ''}; {evidence.text}"
        if evidence.agreement >= agrees:
            return _AGREED[stream.stated_by], f"{basis}; {evidence.text}"
        if evidence.agreement < DIFFERS:
            return _CONTRADICTED, f"{basis}, but {evidence.text}"
        return _BASE[stream.stated_by] - 0.1, f"{basis}; {evidence.text}, which is weak"

    # Position ---------------------------------------------------------------------------------------------------

    def positions(self) -> None:
        pairs = []
        for north, east in (("latitude", "longitude"), ("x", "y")):
            others = self.named(east)
            for first in self.named(north):
                fitting = [
                    (other, pair)
                    for other in others
                    if len((pair := _paired(first, other))[0].values) > _PAIRED * len(first.values)
                ]
                if fitting:
                    second, pair = max(fitting, key=lambda entry: _common_beginning(first.name, entry[0].name))
                    others.remove(second)
                    pairs.append(pair)
        tracks = []
        if not pairs and (unnamed := self._unnamed_position()) is not None:
            pairs.append(unnamed)
        for first, second in pairs:
            track = self._track(first, second)
            if track is None:
                self.add(first, _CONTRADICTED, "its values are no position, or leap", unit=first.unit or "deg")
                self.add(second, _CONTRADICTED, "its values are no position, or leap", unit=second.unit or "deg")
                self.fault(first, "holds no position, or leaps")
                continue
            tracks.append((first, second, track))
        if not tracks:
            return
        tracks.sort(key=lambda entry: (entry[0].quantity != "latitude", -self._coverage(entry[0].name)))
        first, second, track = tracks[0]
        self.motion = track
        wrong = self._wrong_axes(track)
        for north_stream, east_stream, _ in tracks:
            for stream in (north_stream, east_stream):
                confidence = {"format": _BASE["format"], "name": 0.9, "": _BASE["name"]}[stream.stated_by]
                confidence -= 0.0 if stream in (first, second) else 0.02
                why = f"its track {wrong[0]}" if wrong else "a track of a plausible speed"
                unit = stream.unit or ("deg" if stream.quantity in ("latitude", "longitude") else "m")
                self.add(stream, _CONTRADICTED if wrong else confidence, why, unit=unit)
        self._two_receivers([entry for entry in tracks if entry[0].quantity == "latitude"])
        if wrong:
            self.fault(first, f"with {second.name}, its track {wrong[0]}, by headings and courses")
            self.motion = wrong[1]

    def _unnamed_position(self) -> tuple[LogStream, LogStream] | None:
        """The only two streams without a name whose track, as latitude and longitude, a heading or a course follows."""
        slow = [
            stream
            for stream in self.streams
            if not stream.quantity
            and stream.unit in ("", "deg")
            and len(stream.values) >= FEW_SAMPLES
            and 0 < np.ptp(stream.values) < _LONGEST_VOYAGE_DEG
            and np.abs(stream.values).max() <= 180
        ]
        angles = [s for s in self.streams if s.quantity in ("heading", "cog") or (not s.quantity and self._circular(s))]
        found = []
        for first, second in itertools.permutations(slow[:_MOST_TRIED], 2):
            pair = _paired(replace(first, quantity="latitude"), replace(second, quantity="longitude"))
            track = self._track(*pair) if len(pair[0].values) > _PAIRED * len(first.values) else None
            if track is None:
                continue
            followed = [
                direction_evidence(*self._angle(angle), track)
                for angle in angles[:_MOST_TRIED]
                if angle not in (first, second)
            ]
            if any((evidence.agreement or 0.0) > AGREES and evidence.sign > 0 for evidence in followed):
                found.append((first, second, pair))
        if len(found) != 1:
            return None
        first, second, pair = found[0]
        for stream, other in zip((first, second), pair, strict=True):
            self.streams[self.streams.index(stream)] = replace(stream, quantity=other.quantity)
        return pair

    def _track(self, first: LogStream, second: LogStream) -> ReferenceMotion | None:
        time, a, b = first.time_s, first.values, second.values
        if len(time) < 3:
            return None
        if first.quantity == "latitude":
            a, b = _degrees(first), _degrees(second)
            if np.abs(a).max() > 90 or np.abs(b).max() > 360:
                return None
            a, b = local_metres(a, b, rounded_origin(a, b))
        at, v_north = differenced(time, a, POSITION_WINDOW_S)
        _, v_east = differenced(time, b, POSITION_WINDOW_S)
        if not len(at) or np.percentile(np.hypot(v_north, v_east), 90) > FASTEST_TRACK_MPS:
            return None
        empty = np.zeros(0)
        return ReferenceMotion(at, v_north, v_east, empty, empty)

    def _wrong_axes(self, track: ReferenceMotion) -> tuple[str, ReferenceMotion] | None:
        """What is wrong with the axes of a track, and the motion without it; None unless all directions show it."""
        north, east = track.v_north_mps, track.v_east_mps
        others = {
            "has its axes exchanged": replace(track, v_north_mps=east, v_east_mps=north),
            "is mirrored, as by a wrong sign of the second": replace(track, v_east_mps=-east),
            "is mirrored, as by a wrong sign of the first": replace(track, v_north_mps=-north),
        }
        angles = [self._angle(stream) for stream in self.named("heading", "cog")]
        as_it_is = [direction_evidence(*angle, track).agreement for angle in angles]
        if len(angles) < 2 or any(agreement is None or agreement > DIFFERS for agreement in as_it_is):
            return None
        for text, motion in others.items():
            agreements = [direction_evidence(*angle, motion).agreement for angle in angles]
            if all(agreement is not None and agreement > AGREES for agreement in agreements):
                return text, motion
        return None

    def _two_receivers(self, tracks: list[tuple[LogStream, LogStream, ReferenceMotion]]) -> None:
        for north, east, _ in tracks[1:]:
            first, second = tracks[0][:2]
            step = 2 * usual_step(first.time_s)
            origin = rounded_origin(_degrees(first), _degrees(second))
            a, b = local_metres(_degrees(first), _degrees(second), origin)
            c, d = local_metres(_degrees(north), _degrees(east), origin)
            dx = interpolated(north.time_s, first.time_s, a, step) - c
            dy = interpolated(north.time_s, first.time_s, b, step) - d
            if not np.isfinite(dx).any():
                continue
            apart = float(np.nanmedian(np.hypot(dx, dy)))
            if apart > RECEIVERS_APART_M:
                text = f"{north.name} is {apart:.3g} m from {first.name} (median): two receivers; {first.name} is used"
                self.findings.append(LogFinding("fault", text, north.name, {"apart_m": apart}))

    # Heading and course -----------------------------------------------------------------------------------------

    def _angle(self, stream: LogStream) -> tuple[Array, Array]:
        """Time and angle of a direction, rad, thinned by picking."""
        stride = max(1, round(_TESTED_STEP_S / usual_step(stream.time_s)))
        unit = angle_unit(stream.values, stream.unit)
        return stream.time_s[::stride], stream.values[::stride] * QUANTITIES["heading"].units[unit]

    def headings(self) -> None:
        for stream in self.named("heading", "cog", "magnetic_heading"):
            time, angle = self._angle(stream)
            evidence = direction_evidence(time, angle, self.motion)
            confidence, why = self.judged(stream, evidence)
            astray = abs(evidence.offset_rad) > LARGEST_OFFSET_RAD
            if stream.quantity == "heading" and evidence.agreement is not None and (astray or evidence.sign < 0):
                confidence = _CONTRADICTED
                degrees = math.degrees(evidence.offset_rad)
                why = f"{evidence.text}; mean difference {degrees:.0f} deg"
            if confidence < DIFFERS:
                self.fault(stream, why)
            self.add(stream, confidence, why, unit=angle_unit(stream.values, stream.unit))
        self._exchanged_directions()
        self._take_heading()

    def _exchanged_directions(self) -> None:
        """Refuse a heading and a course where the rate of turn is the derivative of the course alone."""
        rates, heading, course = self.named("yaw_rate"), self._best("heading"), self._best("cog")
        if not rates or heading is None or course is None:
            return
        agreements = []
        for channel in (heading, course):
            time, angle = self._angle(self._stream(channel.stream))
            motion = replace(self.motion, heading_time_s=time, heading_rad=np.unwrap(angle))
            evidence = rate_evidence(*self.thin(rates[0]), motion, (HEADING_WINDOW_S,))  # drift is slow
            agreements.append(evidence.agreement or 0.0)
        if agreements[1] > _DERIVATIVE and agreements[0] < agreements[1] - (1 - _DERIVATIVE):
            text = f"{rates[0].name} is the derivative of the course {course.stream}, and not of it: exchanged"
            self.fault(self._stream(heading.stream), text)
            self._doubt((heading.stream, course.stream), "heading and course seem exchanged")

    def _doubt(self, streams: Iterable[str], why: str) -> None:
        """Let no channel of these streams be used."""
        names = set(streams)
        for place, channel in enumerate(self.found):
            if channel.stream in names:
                self.found[place] = replace(channel, confidence=_CONTRADICTED, why=f"{channel.why}, but {why}")

    def _take_heading(self) -> None:
        best = self._best("heading") or self._best("magnetic_heading")
        if best is not None:
            time, angle = self._angle(self._stream(best.stream))
            self.motion = replace(self.motion, heading_time_s=time, heading_rad=np.unwrap(angle))

    def _best(self, quantity: str) -> LogChannel | None:
        good = [channel for channel in self.found if channel.quantity == quantity and channel.confidence >= USED_FROM]
        order = {stream.name: place for place, stream in enumerate(self.streams)}
        return max(good, key=lambda c: (c.confidence, self._coverage(c.stream), -order[c.stream]), default=None)

    def _coverage(self, name: str) -> float:
        """Samples of a stream, to a factor of two: a slower one is not better for a few gaps fewer."""
        return round(math.log2(max(len(self._stream(name).values), 1)))

    def _stream(self, name: str) -> LogStream:
        return next(stream for stream in self.streams if stream.name == name)

    # Rates and speeds -------------------------------------------------------------------------------------------

    def rates(self) -> None:
        for stream in self.named("yaw_rate"):
            evidence = rate_evidence(*self.thin(stream), self.motion)
            self._rate(stream, evidence)
        best = self._best("yaw_rate")
        if best is not None:
            time, values = self.thin(self._stream(best.stream))
            self.rate = time, best.si(values)
        elif len(self.motion.heading_time_s):
            self.rate = differenced(self.motion.heading_time_s, self.motion.heading_rad, 2.0)

    def _rate(self, stream: LogStream, evidence: ContentEvidence) -> None:
        confidence, why = self.judged(stream, evidence)
        unit = stream.unit or evidence.unit
        agrees = evidence.agreement is not None and evidence.agreement >= AGREES
        sign = 1
        if agrees and evidence.unit and stream.unit and evidence.unit != stream.unit:
            confidence, why = _CONTRADICTED, f"states {stream.unit}, but its values are in {evidence.unit}"
        elif agrees and not evidence.unit:
            confidence, why = min(confidence, 0.6), f"{why}, but with a scale of no unit"
        if agrees and evidence.sign < 0:
            if stream.stated_by == "format":
                confidence, why = _CONTRADICTED, f"{why}: its sign is the other one"
            else:
                sign, confidence, why = -1, min(confidence, 0.9), f"{why}: positive to port"
                self.findings.append(LogFinding("note", f"{stream.name} is positive to port", stream.name))
        if confidence < DIFFERS:
            self.fault(stream, why)
        self.add(stream, confidence, why, unit=unit, sign=sign, quantity="yaw_rate")

    def speeds(self) -> None:
        for stream in self.named("sog", "u_water", "u_ground"):
            evidence = speed_evidence(*self.thin(stream), self.motion, stream.quantity)
            confidence, why = self.judged(stream, evidence, agrees=AGREES - 0.1)
            unit = stream.unit or evidence.unit
            known = evidence.agreement is not None and evidence.agreement > DIFFERS
            if known and evidence.unit and stream.unit and evidence.unit != stream.unit:
                confidence, why = _CONTRADICTED, f"states {stream.unit}, but its values are in {evidence.unit}"
            if known and evidence.sign < 0 and stream.quantity != "sog":
                confidence, why = _CONTRADICTED, f"{why}, and is negative"
            if confidence < DIFFERS:
                self.fault(stream, why)
            self.add(stream, confidence, why, unit=unit)
        at, north, east = self.motion.time_s, self.motion.v_north_mps, self.motion.v_east_mps
        heading = self._heading_at(at)
        lateral = east * np.cos(heading) - north * np.sin(heading)
        references: Mapping[str, Array] = {"v_north": north, "v_east": east, "v_ground": lateral, "v_water": lateral}
        for stream in self.named(*references):
            unit = stream.unit or "m/s"
            factor = QUANTITIES[stream.quantity].units.get(unit, 1.0)
            time, values = self.thin(stream)
            evidence = component_evidence(time, factor * values, references[stream.quantity], self.motion)
            transverse = stream.quantity in ("v_ground", "v_water")
            if transverse and evidence.agreement is not None and evidence.agreement < AGREES:
                evidence = replace(evidence, agreement=None if evidence.agreement < DIFFERS else evidence.agreement)
            confidence, why = self.judged(stream, evidence, agrees=DIFFERS if transverse else AGREES)
            sign = 1
            if evidence.agreement is not None and evidence.agreement >= DIFFERS and evidence.sign < 0:
                if stream.stated_by == "name":
                    sign, confidence, why = -1, 0.8, f"{why}: positive to port"
                else:
                    confidence, why = _CONTRADICTED, f"{why}: its sign is the other one"
            if not stream.unit:
                confidence = min(confidence, 0.6)
            if confidence < DIFFERS:
                self.fault(stream, why)
            self.add(stream, confidence, why, unit=stream.unit, sign=sign)

    def vectors(self) -> None:
        """Refuse both components of a velocity where the motion contradicts one: their frame is another."""
        for pair in _VECTORS:
            both = [channel for channel in self.found if channel.quantity in pair]
            refused = {(c.quantity, _source(c.stream)) for c in both if c.confidence < DIFFERS}
            for channel in both:
                other = pair[1 - pair.index(channel.quantity)], _source(channel.stream)
                if channel.confidence >= DIFFERS and other in refused:
                    text = "the other component of its velocity is contradicted, so neither is used"
                    self.fault(self._stream(channel.stream), text)
                    self._doubt([channel.stream], "the other component is contradicted")

    def _heading_at(self, at: Array) -> Array:
        if not len(self.motion.heading_time_s):
            return np.full(len(at), np.nan)
        return interpolated(at, self.motion.heading_time_s, self.motion.heading_rad, 10.0)

    # Streams whose names say nothing ----------------------------------------------------------------------------

    def unnamed(self) -> None:
        """Find rates of turn, headings, courses and speeds among streams without a quantity, by content alone."""
        nameless = [
            stream
            for stream in self.streams
            if not stream.quantity
            and len(stream.values) >= FEW_SAMPLES
            and np.ptp(stream.values) > 0
            and not names_another(stream.name)
        ]
        if self._best("heading") is None or self._best("cog") is None:
            self._unnamed_directions([stream for stream in nameless if self._circular(stream)])
        for stream in nameless:
            if any(channel.stream == stream.name for channel in self.found):
                continue
            time, values = self.thin(stream)
            unknown = self._best("yaw_rate") is None and not self.named("yaw_rate")
            if unknown and stream.unit in ("", *QUANTITIES["yaw_rate"].units):
                evidence = rate_evidence(time, values, self.motion)
                if evidence.agreement is not None and evidence.agreement > 0.97 and evidence.unit:
                    unit, text = stream.unit or evidence.unit, f"by content alone: {evidence.text}"
                    self.add(stream, 0.85, text, quantity="yaw_rate", unit=unit, sign=evidence.sign)
                    self.rate = time, self.found[-1].si(values)
                    continue
            speeds = ("sog", "u_ground", "v_north")
            if any(self._best(name) for name in speeds) or stream.unit not in ("", *QUANTITIES["sog"].units):
                continue
            evidence = speed_evidence(time, values, self.motion, "sog")
            follows = component_evidence(time, values, self.motion.speed_mps, self.motion).agreement or 0.0
            agreement = min(evidence.agreement or 0.0, follows)
            unit = stream.unit or evidence.unit
            if agreement > 0.9 and evidence.unit and values.min() >= 0:
                if not self._closer_than_water(time, values * QUANTITIES["sog"].units[unit]):
                    continue
                text = f"by content alone: {evidence.text}"
                self.add(stream, 0.75, text, quantity="sog", unit=unit)
        if not len(self.rate[0]) and len(self.motion.heading_time_s):
            self.rate = differenced(self.motion.heading_time_s, self.motion.heading_rad, 2.0)

    def _closer_than_water(self, time: Array, speed: Array) -> bool:
        """Whether a speed (m/s) follows that of the positions more closely than the one through the water does."""
        water = self._best("u_water")
        if water is None:
            return True
        other = self._stream(water.stream)
        errors = [
            float(np.nanmedian(np.abs(interpolated(self.motion.time_s, at, values, 5.0) - self.motion.speed_mps)))
            for at, values in ((time, speed), (other.time_s, water.si(other.values)))
        ]
        return errors[0] < _MUCH_LESS * errors[1]

    def _unnamed_directions(self, streams: list[LogStream]) -> None:
        """A course and a heading by content: both follow the track, and the course more closely."""
        known = [channel for channel in (self._best("heading"), self._best("cog")) if channel is not None]
        candidates = []
        for stream in [*streams, *(self._stream(channel.stream) for channel in known)]:
            evidence = direction_evidence(*self._angle(stream), self.motion)
            near = abs(evidence.offset_rad) < LARGEST_OFFSET_RAD
            if evidence.agreement is not None and evidence.agreement > AGREES and evidence.sign > 0 and near:
                candidates.append((evidence.spread_rad, stream, evidence))
        candidates.sort(key=lambda entry: entry[0])
        distinct = len(candidates) == 2 and candidates[1][0] > 1.5 * candidates[0][0]
        if not distinct and (known or len(candidates) != 1):
            return
        for place, (_, stream, evidence) in enumerate(candidates):
            quantity = "cog" if distinct and place == 0 else "heading"
            if any(stream.name == channel.stream or quantity == channel.quantity for channel in known):
                continue
            text = f"by content alone: {evidence.text}" + ("" if distinct else "; it may be the course over ground")
            unit = angle_unit(stream.values, stream.unit)
            self.add(stream, 0.85 if distinct else 0.7, text, quantity=quantity, unit=unit)
        self._take_heading()

    @staticmethod
    def _circular(stream: LogStream) -> bool:
        most, least = float(stream.values.max()), float(stream.values.min())
        return stream.unit in ("", "deg", "rad") and (most > 1.0 or least < -1.0) and least >= -181 and most <= 361

    # Rudders and thrusters --------------------------------------------------------------------------------------

    def steering(self) -> None:
        self._held_rudders()
        for stream in self.named("rudder_angle", "rudder_order", "port_rudder_angle"):
            time, values = self.thin(stream)
            evidence, _ = steering_evidence(time, values, *self.rate)
            self._rudder(stream, evidence)
        self._exchanged_rudders()
        if not self.named("rudder_angle", "rudder_order") and not self.named("thrust_order_port", "rpm_port"):
            self._unnamed_rudder()
        self._rudder_shares()

    def _held_rudders(self) -> None:
        """If several streams are a rudder by their names, the one that holds its values is the order."""
        angles = self.named("rudder_angle")
        held = [stream for stream in angles if stream.stated_by == "name" and _held_share(stream) > _HOLDS]
        if not self.named("rudder_order") and len(held) == 1 and any(_held_share(other) < _MOVES for other in angles):
            self.streams[self.streams.index(held[0])] = replace(held[0], quantity="rudder_order")

    def _exchanged_rudders(self) -> None:
        """Refuse an angle that stays at its values and an order that never does: an order holds until the next."""
        angle, order = self._best("rudder_angle"), self._best("rudder_order")
        if angle is None or order is None:
            return
        held = [_held_share(self._stream(channel.stream)) for channel in (angle, order)]
        if held[0] > _HOLDS and held[1] < _MOVES:
            self.fault(self._stream(angle.stream), f"holds its values as an order does, and {order.stream} does not")
            self._doubt((angle.stream, order.stream), "order and angle seem exchanged")

    def _zero(self, stream: LogStream, evidence: ContentEvidence) -> float:
        """Rudder reading on straight legs (slow turn, also a time before); 0 if that is near its zero or unknown."""
        time, rate = self.rate
        if stream.unit == "1" or not len(rate) or (evidence.agreement or 0.0) < _SHOWN:
            return 0.0
        values = interpolated(time, stream.time_s, stream.values, 10.0)
        small = np.abs(rate) < _STRAIGHT_SHARE * float(np.percentile(np.abs(rate), 99))
        reach = max(1, round(_STRAIGHT_S / usual_step(time)))
        straight = np.convolve(small, np.ones(2 * reach + 1), "same") > 2 * reach
        straight &= np.isfinite(values)
        if straight.sum() < max(FEW_SAMPLES, _LEAST_STRAIGHT * len(time)):
            return 0.0
        zero = float(np.median(values[straight]))
        span = float(np.ptp(values[np.isfinite(values)]))
        size = abs(zero) * math.degrees(QUANTITIES["rudder_angle"].units.get(stream.unit or "deg", 1.0))
        words = f"{stream.name} is at {zero:.4g} {stream.unit}".strip() + " on straight legs"
        if size >= _LEAST_ZERO if stream.unit else abs(zero) > _LEAST_ZERO_SHARE * span:
            text = f"{words}, which is taken as its zero (offset in channels.toml)"
            self.findings.append(LogFinding("note", text, stream.name, {"zero": zero}))
            return zero
        if size > _LEAST_HELM:
            self.fault(stream, f"at {zero:.3g} {stream.unit or 'deg'} on straight legs: helm against wind, or its zero")
        return 0.0

    def _rudder(self, stream: LogStream, evidence: ContentEvidence) -> None:
        zero = self._zero(stream, evidence)
        if evidence.agreement is not None and evidence.agreement < DIFFERS and np.ptp(stream.values) == 0:
            evidence = UNTESTED
        confidence, why = self.judged(stream, evidence, agrees=_SHOWN)
        unit = stream.unit or rudder_unit(stream.values - zero)
        stated, sign = sign_of_name(stream.name), 1
        shown = evidence.agreement is not None and evidence.agreement >= _SHOWN
        if stated:
            sign = stated
            if shown and evidence.sign != stated:
                confidence, why = _CONTRADICTED, f"{why}: the turn contradicts the sign in its name"
        elif shown and evidence.sign < 0:
            if stream.stated_by == "format":
                confidence, why = _CONTRADICTED, f"{why}: it is positive to port, against its format"
            else:
                sign, confidence, why = -1, 0.9, f"{why}: positive to port"
                self.findings.append(LogFinding("note", f"{stream.name} is positive to port", stream.name))
        if confidence < DIFFERS:
            self.fault(stream, why)
        if stream.quantity == "rudder_order" and not stream.unit and unit == "deg":
            confidence, why = min(confidence, _DOUBTED), f"{why}; deg by its size, and it may be in %"
        if stream.quantity == "rudder_angle" and stream.stated_by == "name" and _held_share(stream) > _HOLDS:
            confidence, why = min(confidence, _DOUBTED), f"{why}; it holds its values as an order does"
        most = float(np.nanpercentile(np.abs(stream.values - zero), 99.9)) * QUANTITIES["rudder_angle"].units.get(
            unit, 0
        )
        if unit in ("deg", "rad") and most > LARGEST_LOGGED_RUDDER_RAD:
            confidence, why = min(confidence, 0.6), f"{why}; it goes to {math.degrees(most):.3g} deg, as no rudder does"
        if zero and not stream.unit and abs(zero / _SERVO_DEG - round(zero / _SERVO_DEG)) > 0.01:
            confidence, why = min(confidence, 0.6), f"{why}; its unit is known by its size alone"
        if zero:
            confidence, why = min(confidence, _BASE["name"]), f"{why}; {zero:.4g} on straight legs is taken as its zero"
        self.add(stream, confidence, why, unit=unit, sign=sign, offset=zero)

    def _unnamed_rudder(self) -> None:
        """The stream without a name that leads the turn as a rudder does; none where no rate of turn is known."""
        rates = [best.confidence for name in ("yaw_rate", "heading") if (best := self._best(name)) is not None]
        if not rates:
            return
        taken = {channel.stream for channel in self.found if channel.confidence >= USED_FROM}
        candidates = []
        for stream in self.streams:
            if stream.name in taken or stream.quantity or np.ptp(stream.values) == 0 or names_another(stream.name):
                continue
            time, values = self.thin(stream)
            evidence, lag = steering_evidence(time, values, *self.rate)
            unit = stream.unit or rudder_unit(stream.values)
            if evidence.agreement is not None and evidence.agreement > AGREES and lag >= 1.0 and unit:
                candidates.append((evidence.agreement, stream, evidence, unit))
        candidates.sort(key=lambda entry: -entry[0])
        for place, (agreement, stream, evidence, unit) in enumerate(candidates):
            quantity = "rudder_order" if _held_share(stream) > _HOLDS else "rudder_angle"
            others = [entry for entry in candidates if not self._alike(candidates[0][1], entry[1])]
            clear = not others or (place == 0 and agreement > others[0][0] + _CLEARLY)
            text = f"by content alone: {evidence.text}"
            if not clear:
                text += f"; the same is true of {', '.join(e[1].name for e in candidates if e[1] is not stream)}"
            confidence = (0.75 if max(rates) > 0.8 else 0.7) if clear else 0.7 if place == 0 else 0.5
            self.add(stream, confidence, text, quantity=quantity, unit=unit, sign=evidence.sign)

    @staticmethod
    def _alike(first: LogStream, second: LogStream) -> bool:
        """Whether two streams are the order and the angle of one rudder."""
        other = np.interp(first.time_s, second.time_s, second.values)
        return abs(float(np.corrcoef(first.values, other)[0, 1])) > 0.95

    def _rudder_shares(self) -> None:
        """Orders in shares of the full rudder, scaled by the angle where it is known, else by the usual full rudder."""
        for place, given in enumerate(self.found):
            channel = self._by_angle(given) if given.quantity == "rudder_order" and given.unit == "deg" else given
            self.found[place] = channel
            if channel.quantity not in ("rudder_order", "rudder_angle") or channel.unit not in ("1", "%"):
                continue
            share = QUANTITIES["rudder_order"].units[channel.unit]
            angle = next((c for c in self.found if c.quantity == "rudder_angle" and c.unit in ("deg", "rad")), None)
            full = FULL_RUDDER_DEG / max(1 - abs(share * channel.offset), 0.5)  # 50 of 0 to 100 % leaves 50 to a side
            scale, confidence, why = full * share, min(channel.confidence, 0.75), channel.why
            if angle is not None and angle.confidence >= USED_FROM:
                ratio = self._ratio(angle, channel)
                if ratio is not None:
                    scale, confidence = math.degrees(ratio) * share, channel.confidence
                    why += f"; full order is {math.degrees(ratio):.3g} deg by {angle.stream}"
            else:
                why += f"; full order is taken as {FULL_RUDDER_DEG:g} deg"
            self.found[place] = replace(channel, unit="deg", scale=scale, confidence=confidence, why=why)

    def _by_angle(self, order: LogChannel) -> LogChannel:
        """An order without a unit that is deg by its size: sure, or in %, by the angle that follows it."""
        angle = next((c for c in self.found if c.quantity == "rudder_angle" and c.unit in ("deg", "rad")), None)
        if self._stream(order.stream).unit or angle is None or angle.confidence < USED_FROM:
            return order
        ratio = self._ratio(angle, order, least_share=0.0)
        if ratio is None:
            return order
        if abs(ratio - 1) < UNIT_SLACK:
            return replace(
                order, confidence=max(order.confidence, SURE_FROM), why=f"{order.why}; {angle.stream} shows deg"
            )
        return replace(order, unit="%")

    def _ratio(self, measured: LogChannel, order: LogChannel, least_share: float = 0.3) -> float | None:
        """Measured value (SI) over ordered share, where the order is held and not small; None where it never is."""
        given, shown = self._stream(order.stream), self._stream(measured.stream)
        share = order.si(given.values)
        value = interpolated(given.time_s, shown.time_s, measured.si(shown.values), 10.0)
        good = np.isfinite(value) & (np.abs(share) > (least_share or 0.3 * np.abs(share).max()))
        if good.sum() < FEW_SAMPLES:
            return None
        ratio = value[good] / share[good]
        middle = float(np.median(ratio))
        return middle if np.median(np.abs(ratio - middle)) < 0.1 * abs(middle) and middle > 0 else None

    def unnamed_thrusters(self) -> None:
        """Two streams of orders without a name whose difference turns the vessel, which neither does alone."""
        if self.named("thrust_order_port", "thrust_order_starboard", "rudder_order", "rudder_angle"):
            return
        orders = [
            stream
            for stream in self.streams
            if not stream.quantity
            and (stream.unit == "1" or (not stream.unit and names_thrust(stream.name)))
            and np.ptp(stream.values) > 0.1
            and np.nanmax(np.abs(stream.values)) < 2
        ]
        if len(orders) != 2:
            return
        (time, port), starboard = self.thin(orders[0]), self.thin(orders[1])
        tried = [port - np.interp(time, *starboard), port, np.interp(time, *starboard)]
        found = [steering_evidence(time, values, *self.rate)[0].agreement or 0.0 for values in tried]
        if found[0] > 0.6 and found[0] > max(found[1:]) + ALONE_LESS:
            for stream, quantity in zip(orders, ("thrust_order_port", "thrust_order_starboard"), strict=True):
                self.streams[self.streams.index(stream)] = replace(stream, quantity=quantity)

    def thrusters(self) -> None:
        pairs = (("thrust_order_port", "thrust_order_starboard"), ("rpm_port", "rpm_starboard"))
        for port_name, starboard_name in pairs:
            ports, starboards = self.named(port_name), self.named(starboard_name)
            for port, starboard in zip(ports, starboards, strict=False):
                signs, reversal = self._reversed(port, starboard)
                time, values = self.thin(port)
                other = np.interp(time, *self.thin(starboard))
                evidence, _ = steering_evidence(time, signs[0] * values - signs[1] * other, *self.rate)
                swap = evidence.agreement is not None and evidence.agreement > _SHOWN and evidence.sign < 0
                for stream, name, sign in zip((port, starboard), (port_name, starboard_name), signs, strict=True):
                    confidence, why = self.judged(stream, evidence, agrees=_SHOWN)
                    quantity = name
                    # A reversed controller is found by the speed, and then the turn shows the sides, or nothing.
                    if swap and (stream.stated_by == "" or -1 in signs):
                        quantity = starboard_name if name == port_name else port_name
                        confidence, why = 0.9, f"{evidence.text} with the sides exchanged"
                    elif swap:
                        confidence, why = _CONTRADICTED, f"{why}: the turn contradicts its side"
                        self.fault(stream, why)
                    if reversal and signs == (1, 1):
                        confidence = _CONTRADICTED
                        self.fault(stream, reversal)
                    elif reversal:
                        confidence = _DOUBTED if swap or (evidence.agreement or 1.0) >= _SHOWN else _BASE["name"]
                        why = f"{why}; {reversal}"
                    unit = _share_unit(stream, quantity)
                    shown = "rpm" in plain_words(stream.name).split() or np.abs(stream.values).max() > _FASTEST_SHAFT_HZ
                    if unit == "rpm" != stream.unit and not shown:
                        confidence, why = min(confidence, _DOUBTED), f"{why}; rpm by their size"
                    self.add(stream, confidence, why, quantity=quantity, unit=unit, sign=sign)
                    if quantity != name and stream.stated_by == "name":
                        self.fault(stream, f"is {QUANTITIES[quantity].words}, against its name: {evidence.text}")
                    if sign < 0:
                        self.fault(stream, f"is positive astern: {reversal}")
            for stream in ports[len(starboards) :] + starboards[len(ports) :]:
                self.add(stream, 0.6, "the other side is missing", unit=_share_unit(stream, stream.quantity))

    def _reversed(self, port: LogStream, starboard: LogStream) -> tuple[tuple[int, int], str]:
        """Signs of two orders by the speed ahead, which follows their sum, and why one is reversed.

        1, 1 without a reason where none is, and with one where it is not known which of the two.
        """
        heading = self._best("heading")
        at = self.motion.time_s
        if heading is None or len(at) < FEW_SAMPLES or port.stated_by == "format":
            return (1, 1), ""
        angle = self._heading_at(at)
        ahead = self.motion.v_north_mps * np.cos(angle) + self.motion.v_east_mps * np.sin(angle)
        good = np.isfinite(ahead)
        if good.sum() < FEW_SAMPLES or np.percentile(np.abs(ahead[good]), 95) < 2 * LEAST_SPEED_MPS:
            return (1, 1), ""
        time, first = self.thin(port)
        second = np.interp(time, *self.thin(starboard))
        total, difference = (
            steering_evidence(time, values, at[good], ahead[good])[0] for values in (first + second, first - second)
        )
        by_total, by_difference = total.agreement or 0.0, difference.agreement or 0.0
        # A pair that pulls apart for long turns the vessel about, unless one of it is reversed.
        straight = np.std(first + second) < _LITTLE * np.std(first - second) and np.ptp(angle[good]) < _TURNED_RAD
        if by_difference >= max(_SHOWN, 0.0 if straight else by_total + _CLEARLY_REVERSED):
            way = difference.sign
            return (way, -way), f"the speed ahead follows the difference of the orders by {by_difference:.2f}"
        if by_total >= _SHOWN and total.sign < 0:
            return (1, 1), "the speed falls with the orders: one or both are reversed"
        return (1, 1), ""

    def others(self) -> None:
        done = {channel.stream for channel in self.found}
        for stream in self.streams:
            if stream.name in done or not stream.quantity:
                continue
            unit = stream.unit
            if stream.quantity in ("rpm", "rpm_order") and unit not in QUANTITIES[stream.quantity].units:
                unit = _share_unit(stream, stream.quantity)
            if stream.quantity in ("wind_rel_direction", "wind_direction", "wind_theoretical_direction") and not unit:
                unit = angle_unit(stream.values, "")
            if (
                stream.quantity == "heel"
                and not unit
                and np.percentile(np.abs(stream.values), 99.9) > _LARGEST_HEEL_RAD
            ):
                unit = "deg"
            confidence, why = self.judged(stream, UNTESTED)
            self.add(stream, confidence, why, unit=unit)
        self._engine_shares()

    def _engine_shares(self) -> None:
        for place, channel in enumerate(self.found):
            if channel.quantity != "rpm_order" or channel.unit not in ("1", "%"):
                continue
            measured = next((c for c in self.found if c.quantity == "rpm" and c.unit), None)
            ratio = None if measured is None else self._ratio(measured, channel)
            if ratio is None:
                why = f"{channel.why}; the revolutions at full order are not known"
                self.found[place] = replace(channel, confidence=min(channel.confidence, 0.6), why=why)
                continue
            share = QUANTITIES["rpm_order"].units[channel.unit]
            rpm = ratio * 60 / (2 * math.pi)
            why = f"{channel.why}; full order is {rpm:.4g} rpm by the measured revolutions"
            confidence = max(channel.confidence, 0.9)
            self.found[place] = replace(channel, unit="rpm", scale=rpm * share, confidence=confidence, why=why)

    def lost_signs(self) -> None:
        """Report revolutions that stay ahead while the vessel goes astern, for many engines count without a sign, and
        refuse revolutions astern while it goes ahead."""
        heading = self._best("heading")
        if heading is None or heading.confidence < SURE_FROM:
            return
        at, motion = self.motion.time_s, self.motion
        angle = self._heading_at(at)
        ahead = motion.v_north_mps * np.cos(angle) + motion.v_east_mps * np.sin(angle)
        fast = _ASTERN_SHARE * float(np.percentile(motion.speed_mps, 95)) if len(at) else 0.0
        for stream in self.named("rpm", "rpm_port", "rpm_starboard", "rpm_order"):
            values = interpolated(at, stream.time_s, stream.values, 10.0)
            turning = values > _ASTERN_SHARE * float(np.percentile(stream.values, 95))
            shown = values[(ahead > max(fast, LEAST_SPEED_MPS)) & np.isfinite(values)]
            if len(shown) > FEW_SAMPLES and (shown < 0).mean() > AGREES:
                self.fault(stream, "is negative while the vessel goes ahead: its sign is the other one")
                self._doubt([stream.name], "the motion contradicts its sign")
                continue
            astern = (ahead < -max(fast, LEAST_SPEED_MPS)) & turning & (stream.values.min() >= 0)
            if astern.sum() * usual_step(at) > _ASTERN_S:
                text = (
                    f"stays ahead while the vessel goes astern ({utc_text(at[np.argmax(astern)])}): its sign is lost, "
                )
                self.fault(stream, f"{text}or the pitch is astern; leave out the trials that go astern")

    # The result -------------------------------------------------------------------------------------------------

    def result(self) -> ChannelSet:
        used = {best.stream + best.quantity for name in QUANTITIES if (best := self._best(name)) is not None}
        channels = []
        for channel in self.found:
            use = channel.stream + channel.quantity in used
            if use:
                used.discard(channel.stream + channel.quantity)
            channels.append(self._of_pulses(replace(channel, use=use)))
        self._twins(channels)
        self._headings_apart(channels)
        self._set_back(channels)
        order = {name: place for place, name in enumerate(QUANTITIES)}
        channels.sort(key=lambda c: (order[c.quantity], not c.use, -c.confidence))
        return ChannelSet(tuple(channels), tuple(self.findings))

    def _twins(self, channels: list[LogChannel]) -> None:
        """Name the second rudder, order or shaft that is as good and not used."""
        for used in channels:
            for other in channels:
                same = used.use and used.quantity in _STEERING and other.quantity == used.quantity
                if not same or other.use or other.confidence < USED_FROM:
                    continue
                first, second = self._stream(used.stream), self._stream(other.stream)
                values = np.interp(first.time_s, second.time_s, other.si(second.values))
                factor = QUANTITIES[used.quantity].units[used.unit]
                apart = float(np.median(np.abs(used.si(first.values) - values))) / factor
                text = f"{used.stream} is used, and not {other.stream}, another {QUANTITIES[used.quantity].words}, "
                text += f"{apart:.3g} {used.unit} apart (median)"
                self.findings.append(LogFinding("note", text, other.stream, {"apart": apart}))

    def _headings_apart(self, channels: list[LogChannel]) -> None:
        """Name a second heading that differs from the one in use: one of the two is off, or looks elsewhere."""
        used = next((channel for channel in channels if channel.use and channel.quantity == "heading"), None)
        if used is None:
            return
        first = self._stream(used.stream)
        for other in channels:
            if other.quantity != "heading" or other.use or other.confidence < USED_FROM:
                continue
            second = self._stream(other.stream)
            nearest = np.clip(np.searchsorted(second.time_s, first.time_s), 0, len(second.time_s) - 1)
            apart = np.angle(np.exp(1j * (other.si(second.values[nearest]) - used.si(first.values))))
            size = float(np.degrees(np.angle(np.mean(np.exp(1j * apart)))))
            if abs(size) > HEADINGS_APART_DEG:
                text = (
                    f"{used.stream} is used, and {other.stream}, another heading, is {size:+.0f} deg from it: state "
                    "the right one (a fault of one source, or it is mounted at an angle)"
                )
                self.findings.append(LogFinding("fault", text, other.stream, {"apart_deg": size}))

    def _set_back(self, channels: list[LogChannel]) -> None:
        """Give the later of heading and rate of turn its delay, where it is certain: neither can be early."""
        used = {channel.quantity: place for place, channel in enumerate(channels) if channel.use}
        if not {"heading", "yaw_rate"} <= used.keys():
            return
        heading, rate = (channels[used[name]] for name in ("heading", "yaw_rate"))
        rated = self._stream(rate.stream)
        time, angle = self._angle(self._stream(heading.stream))
        found = rate_delay(time, np.unwrap(angle), rated.time_s, rate.si(rated.values))
        if found is None or not found.certain:
            return
        late, other = (rate, heading) if found.delay_s > 0 else (heading, rate)
        delay = round(abs(found.delay_s), 2)
        words = f"{delay:g} ± {found.standard_error_s:.1g} s behind {other.stream}"
        channels[used[late.quantity]] = replace(late, delay_s=delay, why=f"{late.why}; {words}, and set back by it")
        text = f"{late.stream} is {words} and is set back by it (delay_s in channels.toml)"
        self.findings.append(LogFinding("note", text, late.stream, {"delay_s": delay}))


def _paired(first: LogStream, second: LogStream) -> tuple[LogStream, LogStream]:
    """Two streams at the times that both have: cells of either may be missing."""
    _, mine, other = np.intersect1d(first.time_s, second.time_s, return_indices=True)
    return (
        replace(first, time_s=first.time_s[mine], values=first.values[mine]),
        replace(second, time_s=second.time_s[other], values=second.values[other]),
    )


def _common_beginning(first: str, second: str) -> int:
    """Letters with which both names begin."""
    return next((place for place, (a, b) in enumerate(zip(first, second, strict=False)) if a != b), len(first))


def _source(name: str) -> str:
    """The message of a stream without the name of its field: ``130578 from 5`` of ``130578.speed from 5``."""
    return re.sub(r"\.\S*", "", name) if "." in name else ""


def _held_share(stream: LogStream) -> float:
    return float((np.diff(stream.values) == 0).mean())


def _degrees(stream: LogStream) -> Array:
    """Latitude or longitude (n,) in degrees."""
    return np.asarray(stream.values * QUANTITIES["latitude"].units.get(stream.unit or "deg", 1.0))


def _share_unit(stream: LogStream, quantity: str) -> str:
    """Unit of an order or of revolutions by size, where nothing states it."""
    units = QUANTITIES[quantity].units
    if stream.unit in units:
        return stream.unit
    most = float(np.nanpercentile(np.abs(stream.values), 99.9))
    if "1" in units and most <= 1.05:
        return "1"
    if "%" in units and most <= 105:
        return "%"
    if "rpm" in units and most > 30:  # slower shafts turn at 60 rpm and more at full ahead; above 30 per second none do
        return "rpm"
    return ""
