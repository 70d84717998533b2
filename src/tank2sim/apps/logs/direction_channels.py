"""Channels of headings and courses, by the course of the positions; and the way of a vessel, ahead or astern."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.candidates import ChannelSearch, Judgement
from tank2sim.apps.logs.content import (
    AGREES,
    DIFFERS,
    NEAR_RAD,
    ContentEvidence,
    direction_evidence,
    rate_evidence,
    steering_evidence,
)
from tank2sim.apps.logs.quantities import sign_of_name, unit_by_size
from tank2sim.apps.logs.reference import HEADING_WINDOW_S, differenced, interpolated
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array

LARGEST_OFFSET_RAD = math.radians(30.0)
"""Mean difference of heading and course beyond which a heading is doubtful. Project choice: leeway and current of a
third of the speed turn a course by 20 deg; compasses mounted askew are off by 90 or 180."""

_DERIVATIVE = 0.95
"""Correlation of a rate of turn with the derivative of its heading. Project choice: sensors reach 0.99, and a course
over ground, which is noisier and has the drift in it, does not."""

_CLOSER = 1.5
"""Ratio of the deviations of two directions from which the closer one is the course (project choice)."""

_STEERS = 0.6
"""Agreement of a rudder with the turn from which it shows the way of a vessel (project choice: as for its sign)."""

_TO_CONFIRM = 0.75  # Confidence of a heading that may be the other way round

_PROPULSION = ("rpm", "rpm_port", "rpm_starboard", "rpm_order", "thrust_order_port", "thrust_order_starboard")
_EITHER_WAY = (
    "its compass is mounted back to front (then offset = 180 in channels.toml), or the vessel goes astern throughout"
)


def find_directions(search: ChannelSearch) -> None:
    """Find headings and courses by their names; the best heading becomes a part of the motion."""
    for stream in search.named("heading", "cog", "magnetic_heading"):
        evidence = direction_evidence(*search.angle(stream), search.motion)
        found = search.judged(stream, evidence)
        found.unit = found.unit or unit_by_size("heading", stream.values)
        astray = abs(evidence.offset_rad) > LARGEST_OFFSET_RAD or evidence.sign < 0
        if stream.quantity != "cog" and _is_opposed(evidence):
            found = _opposed(search, found)
        elif stream.quantity == "heading" and evidence.agreement is not None and astray:
            found.refuse(f"{evidence.text}; mean difference {math.degrees(evidence.offset_rad):.0f} deg")
        search.take(found)
    _refuse_exchanged_directions(search)
    _take_heading(search)


def _refuse_exchanged_directions(search: ChannelSearch) -> None:
    """Refuse a heading and a course where the rate of turn is the derivative of the course alone."""
    rates, heading, course = search.named("yaw_rate"), search.best("heading"), search.best("cog")
    if not rates or heading is None or course is None:
        return
    agreements = []
    for channel in (heading, course):
        time, angle = search.angle(search.stream(channel.stream))
        motion = replace(search.motion, heading_time_s=time, heading_rad=np.unwrap(angle))
        evidence = rate_evidence(*search.thin(rates[0]), motion, (HEADING_WINDOW_S,))  # drift is slow
        agreements.append(evidence.known)
    if agreements[1] > _DERIVATIVE and agreements[0] < agreements[1] - (1 - _DERIVATIVE):
        text = f"{rates[0].name} is the derivative of the course {course.stream}, and not of it: exchanged"
        search.fault(heading.stream, text)
        search.doubt("heading and course seem exchanged", heading.stream, course.stream)


def _take_heading(search: ChannelSearch) -> None:
    best = search.best("heading") or search.best("magnetic_heading")
    if best is not None:
        time, angle = search.angle(search.stream(best.stream))
        search.motion = replace(search.motion, heading_time_s=time, heading_rad=np.unwrap(angle))


# Ahead or astern ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Witness:
    """What shows the way of a vessel: words for it, and its sign at the times of the motion (n,), below 0 astern.

    It is `sure` unless it is nothing, or a rudder that may be positive to port.
    """

    words: str
    way: Array
    sure: bool = True


def _is_opposed(evidence: ContentEvidence) -> bool:
    """Whether a heading that contradicts the course points against it, and is not mirrored."""
    against = abs(evidence.offset_rad) > math.pi - NEAR_RAD
    return evidence.agreement is not None and evidence.agreement < DIFFERS and against and evidence.sign >= 0


def _opposed(search: ChannelSearch, found: Judgement) -> Judgement:
    """Judge a heading against the course: the vessel goes astern, or its compass is mounted back to front.

    Course and heading turn alike in both cases, so that others decide: a second heading, propulsion, speed, rudder.
    """
    stream, (time, angle) = found.stream, search.angle(found.stream)
    nothing = _Witness("nothing shows its way", -np.ones(len(search.motion.time_s)), sure=False)
    witnesses = list(_witnesses(search, time, angle)) or [nothing]
    for witness in [witness for witness in witnesses if witness.sure] or witnesses:
        evidence = direction_evidence(time, angle, search.motion.going(witness.way))
        turns_alike = evidence.sign > 0
        if evidence.known < AGREES or not (witness.sure or turns_alike):
            continue
        search.way = search.motion.time_s, np.where(witness.way < 0, -1.0, 1.0)
        taken = replace(search.judged(stream, evidence), unit=found.unit)
        if witness.sure:
            taken.why += f" astern, as {witness.words}"
            search.note(stream.name, f"points against the course, and {witness.words}: the vessel goes astern")
        else:
            taken.doubt(_TO_CONFIRM, f" astern, but {witness.words}: {_EITHER_WAY}, which is taken")
        return taken
    shown = " and ".join(witness.words for witness in witnesses)
    found.refuse(f"{found.why}; it points against the course, and {shown}: {_EITHER_WAY}")
    return found


def _witnesses(search: ChannelSearch, time: Array, angle: Array) -> Iterator[_Witness]:
    """Propulsion, speed ahead and rudders, as far as the log has them, for a heading (n,), rad; or a second heading."""
    for other in search.named("heading", "magnetic_heading"):
        if direction_evidence(*search.angle(other), search.motion).known >= AGREES:
            yield _Witness(f"{other.name} follows it", np.ones(len(search.motion.time_s)))
            return
    for quantities in (_PROPULSION, ("u_water", "u_ground")):
        streams = [stream for stream in search.named(*quantities) if np.any(stream.values)]
        if streams:
            yield _signed_witness(search, streams)
    rate = differenced(time, np.unwrap(angle), HEADING_WINDOW_S)
    for stream in search.named("rudder_angle", "rudder_order"):
        evidence = steering_evidence(*search.thin(stream), *rate)
        if evidence.known >= _STEERS:
            yield _rudder_witness(search, stream, evidence.sign)


def _signed_witness(search: ChannelSearch, streams: list[LogStream]) -> _Witness:
    """Streams that are negative astern: the sum of their shares."""
    at, way = search.motion.time_s, np.zeros(len(search.motion.time_s))
    for stream in streams:
        shares = stream.values / np.nanmax(np.abs(stream.values))
        way += np.nan_to_num(interpolated(at, stream.time_s, shares, 10.0))
    verb, state = "are" if len(streams) > 1 else "is", "negative" if np.mean(way < 0) > DIFFERS else "positive"
    return _Witness(f"{', '.join(stream.name for stream in streams)} {verb} {state}", way)


def _rudder_witness(search: ChannelSearch, stream: LogStream, turn: int) -> _Witness:
    """A rudder that the `turn` follows, or opposes (-1); sure if its positive side is stated."""
    stated = sign_of_name(stream.name)
    sign = turn * (stated or 1)
    words = f"the bow turns {'to' if sign > 0 else 'against'} the side of {stream.name}"
    sure = bool(stated) or stream.stated_by == "format"
    way = np.full(len(search.motion.time_s), float(sign))
    return _Witness(words if sure else f"{words} if it is positive to starboard", way, sure)


# Streams whose names say nothing --------------------------------------------------------------------------------


def find_unnamed_directions(search: ChannelSearch, streams: list[LogStream]) -> None:
    """Find a course and a heading by content: both follow the track, and the course more closely."""
    known = {name: best.stream for name in ("heading", "cog") if (best := search.best(name)) is not None}
    followers = _followers(search, [*filter(_circular, streams), *map(search.stream, known.values())])
    spreads = [evidence.spread_rad for _, evidence in followers]
    distinct = len(spreads) == 2 and spreads[1] > _CLOSER * spreads[0]
    if not distinct and (known or len(followers) != 1):
        return
    quantities = ("cog", "heading") if distinct else ("heading",)
    confidence, more = (0.85, "") if distinct else (0.7, "; it may be the course over ground")
    for (stream, evidence), quantity in zip(followers, quantities, strict=True):
        if quantity not in known and stream.name not in known.values():
            unit = stream.unit or unit_by_size("heading", stream.values)
            search.add_unnamed(stream, quantity, confidence, evidence, more, unit)
    _take_heading(search)


def _followers(search: ChannelSearch, streams: list[LogStream]) -> list[tuple[LogStream, ContentEvidence]]:
    """Streams that follow the course of the positions as they are, the closest first."""
    tested = [(stream, direction_evidence(*search.angle(stream), search.motion)) for stream in streams]
    following = [
        (stream, evidence)
        for stream, evidence in tested
        if evidence.known > AGREES and evidence.sign > 0 and abs(evidence.offset_rad) < LARGEST_OFFSET_RAD
    ]
    return sorted(following, key=lambda entry: entry[1].spread_rad)


def could_be_direction(stream: LogStream) -> bool:
    """Whether a stream is a heading or a course by its name, or may be one without a name."""
    return stream.quantity in ("heading", "cog") or (not stream.quantity and _circular(stream))


def _circular(stream: LogStream) -> bool:
    """Whether the values may be angles of the full circle."""
    most, least = float(stream.values.max()), float(stream.values.min())
    return stream.unit in ("", "deg", "rad") and max(most, -least) > 1.0 and least >= -181 and most <= 361
