"""The search for the channels of a voyage: by format, names, units and content; here positions, headings, speeds."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.apps.logs.candidates import REFUTED, STATED, ChannelSearch, Judgement
from tank2sim.apps.logs.channels import ChannelSet
from tank2sim.apps.logs.content import (
    AGREES,
    DIFFERS,
    FEW_SAMPLES,
    ContentEvidence,
    angle_unit,
    component_evidence,
    direction_evidence,
    rate_evidence,
    speed_evidence,
)
from tank2sim.apps.logs.quantities import QUANTITIES, names_another
from tank2sim.apps.logs.reference import (
    HEADING_WINDOW_S,
    POSITION_WINDOW_S,
    ReferenceMotion,
    differenced,
    interpolated,
    local_metres,
    rounded_origin,
)
from tank2sim.apps.logs.steering_channels import find_steering
from tank2sim.apps.logs.streams import LogStream, fault, note
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

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

_PAIRED = 0.5
"""Share of the samples of a latitude that have a longitude at the same time, from which they are a pair (project
choice)."""

_LONGEST_VOYAGE_DEG, _MOST_TRIED = 5.0, 8
"""Change of latitude or longitude in a log, deg, up to which a stream without a name may be one, and the number of such
streams that are tried. Project choice: 300 nautical miles of latitude, a day of sailing; 56 pairs."""

_MUCH_LESS = 0.7
"""Ratio of deviations from which the lesser one decides (project choice)."""

# Quantities that are the components of one velocity
_VECTORS = (("u_ground", "v_ground"), ("u_water", "v_water"), ("v_north", "v_east"))

_Pair = tuple[LogStream, LogStream]


def find_channels(streams: Iterable[LogStream]) -> ChannelSet:
    """Find the channel of each quantity.

    The position gives the motion against which headings, courses and speeds are tested; the heading gives the rate of
    turn; the rate of turn gives rudders and thrusters. A stream whose content contradicts its name or format is not
    used, and is a fault in the findings; the one of several that agrees best is used.
    """
    search = ChannelSearch([stream for stream in streams if len(stream.values) >= 2])
    _find_positions(search)
    _find_directions(search)
    _find_rates(search)
    _find_speeds(search)
    _find_components(search)
    _refuse_odd_vectors(search)
    _find_unnamed(search)
    find_steering(search)
    return search.result()


# Position -------------------------------------------------------------------------------------------------------


def _find_positions(search: ChannelSearch) -> None:
    tracks = []
    for pair in _position_pairs(search) or _unnamed_positions(search):
        if (track := _track(*pair)) is not None:
            tracks.append((pair, track))
            continue
        for stream in pair:
            search.add(Judgement(stream, REFUTED, "its values are no position, or leap", stream.unit or "deg"))
        search.fault(pair[0].name, "holds no position, or leaps")
    if not tracks:
        return
    tracks.sort(key=lambda entry: (entry[0][0].quantity != "latitude", -search.coverage(entry[0][0].name)))
    main, search.motion = tracks[0]
    wrong = _wrong_axes(search)
    for pair, _ in tracks:
        for stream in pair:
            confidence = {"format": STATED["format"], "name": 0.9, "": STATED["name"]}[stream.stated_by]
            confidence -= 0.0 if pair is main else 0.02
            unit = stream.unit or ("deg" if stream.quantity in ("latitude", "longitude") else "m")
            found = Judgement(stream, confidence, "a track of a plausible speed", unit)
            if wrong:
                found.refuse(f"its track {wrong[0]}")
            search.add(found)
    _report_two_receivers(search, [pair for pair, _ in tracks if pair[0].quantity == "latitude"])
    if wrong:
        search.fault(main[0].name, f"with {main[1].name}, its track {wrong[0]}, by headings and courses")
        search.motion = wrong[1]


def _position_pairs(search: ChannelSearch) -> list[_Pair]:
    """Each stream to north with the one to east whose name is most like its own, at their common times."""
    pairs = []
    for north, east in (("latitude", "longitude"), ("x", "y")):
        others = search.named(east)
        for first in search.named(north):
            fitting = [(other, pair) for other in others if (pair := _paired(first, other))]
            if fitting:
                second, pair = max(fitting, key=lambda entry: _common_beginning(first.name, entry[0].name))
                others.remove(second)
                pairs.append(pair)
    return pairs


def _paired(first: LogStream, second: LogStream) -> _Pair | None:
    """Two streams at the times that both have, for cells of either may be missing; None if these are few."""
    time, mine, other = np.intersect1d(first.time_s, second.time_s, return_indices=True)
    if len(time) <= _PAIRED * len(first.values):
        return None
    return (
        replace(first, time_s=time, values=first.values[mine]),
        replace(second, time_s=time, values=second.values[other]),
    )


def _common_beginning(first: str, second: str) -> int:
    """Letters with which both names begin."""
    return next((place for place, (a, b) in enumerate(zip(first, second, strict=False)) if a != b), len(first))


def _unnamed_positions(search: ChannelSearch) -> list[_Pair]:
    """The only two streams without a name whose track, as latitude and longitude, a heading or a course follows."""
    slow = [stream for stream in search.streams if not stream.quantity and _could_be_position(stream)]
    angles = [s for s in search.streams if s.quantity in ("heading", "cog") or (not s.quantity and _circular(s))]
    found = []
    for first, second in itertools.permutations(slow[:_MOST_TRIED], 2):
        pair = _paired(replace(first, quantity="latitude"), replace(second, quantity="longitude"))
        track = _track(*pair) if pair else None
        if pair is None or track is None:
            continue
        if _is_followed(search, track, [angle for angle in angles[:_MOST_TRIED] if angle not in (first, second)]):
            found.append(pair)
    if len(found) != 1:
        return []
    for stream in found[0]:
        search.rename(search.stream(stream.name), stream.quantity)
    return found


def _is_followed(search: ChannelSearch, track: ReferenceMotion, angles: Iterable[LogStream]) -> bool:
    """Whether one of the angles follows a track as a heading or a course does."""
    followed = [direction_evidence(*search.angle(angle), track) for angle in angles]
    return any(evidence.known > AGREES and evidence.sign > 0 for evidence in followed)


def _could_be_position(stream: LogStream) -> bool:
    if stream.unit not in ("", "deg") or len(stream.values) < FEW_SAMPLES:
        return False
    return 0 < float(np.ptp(stream.values)) < _LONGEST_VOYAGE_DEG and float(np.abs(stream.values).max()) <= 180


def _track(first: LogStream, second: LogStream) -> ReferenceMotion | None:
    """The motion of two streams of one time; None if they are no position, or leap."""
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
    return ReferenceMotion(at, v_north, v_east, np.zeros(0), np.zeros(0))


def _degrees(stream: LogStream) -> Array:
    """Latitude or longitude (n,) in degrees."""
    return np.asarray(stream.values * QUANTITIES["latitude"].units.get(stream.unit or "deg", 1.0))


def _wrong_axes(search: ChannelSearch) -> tuple[str, ReferenceMotion] | None:
    """Fault in the axes of a track, and the motion without it; None unless all directions show it."""
    track, angles = search.motion, [search.angle(stream) for stream in search.named("heading", "cog")]
    north, east = track.v_north_mps, track.v_east_mps

    def agreements(motion: ReferenceMotion) -> list[float | None]:
        return [direction_evidence(*angle, motion).agreement for angle in angles]

    if len(angles) < 2 or any(agreement is None or agreement > DIFFERS for agreement in agreements(track)):
        return None
    others = {
        "has its axes exchanged": replace(track, v_north_mps=east, v_east_mps=north),
        "is mirrored, as by a wrong sign of the second": replace(track, v_east_mps=-east),
        "is mirrored, as by a wrong sign of the first": replace(track, v_north_mps=-north),
    }
    shown = ((text, motion) for text, motion in others.items() if all((a or 0.0) > AGREES for a in agreements(motion)))
    return next(shown, None)


def _report_two_receivers(search: ChannelSearch, tracks: Sequence[_Pair]) -> None:
    for north, east in tracks[1:]:
        first, second = tracks[0]
        step, origin = 2 * usual_step(first.time_s), rounded_origin(_degrees(first), _degrees(second))
        here = local_metres(_degrees(first), _degrees(second), origin)
        there = local_metres(_degrees(north), _degrees(east), origin)
        dx, dy = (interpolated(north.time_s, first.time_s, a, step) - b for a, b in zip(here, there, strict=True))
        apart = float(np.nanmedian(np.hypot(dx, dy))) if np.isfinite(dx).any() else 0.0
        if apart > RECEIVERS_APART_M:
            text = f"{north.name} is {apart:.3g} m from {first.name} (median): two receivers; {first.name} is used"
            search.findings.append(fault(text, north.name, apart_m=apart))


# Heading and course ---------------------------------------------------------------------------------------------


def _find_directions(search: ChannelSearch) -> None:
    for stream in search.named("heading", "cog", "magnetic_heading"):
        evidence = direction_evidence(*search.angle(stream), search.motion)
        found = search.judged(stream, evidence)
        found.unit = angle_unit(stream.values, stream.unit)
        astray = abs(evidence.offset_rad) > LARGEST_OFFSET_RAD or evidence.sign < 0
        if stream.quantity == "heading" and evidence.agreement is not None and astray:
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


# Rates and speeds -----------------------------------------------------------------------------------------------


def _find_rates(search: ChannelSearch) -> None:
    for stream in search.named("yaw_rate"):
        evidence = rate_evidence(*search.thin(stream), search.motion)
        found = search.judged(stream, evidence)
        found.unit = stream.unit or evidence.unit
        if evidence.known >= AGREES:
            _refuse_other_unit(found, evidence)
            if not evidence.unit:
                found.doubt(0.6, ", but with a scale of no unit")
            if evidence.sign < 0:
                found.turn(min(found.confidence, 0.9), "its sign is the other one")
            if found.sign < 0:
                search.findings.append(note(f"{stream.name} is positive to port", stream.name))
        search.take(found)
    best = search.best("yaw_rate")
    if best is not None:
        time, values = search.thin(search.stream(best.stream))
        search.rate = time, best.si(values)
    else:
        _take_rate_of_heading(search)


def _take_rate_of_heading(search: ChannelSearch) -> None:
    if not len(search.rate[0]) and len(search.motion.heading_time_s):
        search.rate = differenced(search.motion.heading_time_s, search.motion.heading_rad, 2.0)


def _refuse_other_unit(found: Judgement, evidence: ContentEvidence) -> None:
    stated = found.stream.unit
    if evidence.unit and stated and evidence.unit != stated:
        found.refuse(f"states {stated}, but its values are in {evidence.unit}")


def _find_speeds(search: ChannelSearch) -> None:
    for stream in search.named("sog", "u_water", "u_ground"):
        evidence = speed_evidence(*search.thin(stream), search.motion, stream.quantity)
        found = search.judged(stream, evidence, agrees=AGREES - 0.1)
        found.unit = stream.unit or evidence.unit
        if evidence.known > DIFFERS:
            _refuse_other_unit(found, evidence)
            if evidence.sign < 0 and stream.quantity != "sog":
                found.refuse(f"{found.why}, and is negative")
        search.take(found)


def _find_components(search: ChannelSearch) -> None:
    """Velocities to north and east, and transverse ones, which the drift of a vessel hardly shows."""
    motion = search.motion
    north, east, heading = motion.v_north_mps, motion.v_east_mps, search.heading_at(motion.time_s)
    lateral = east * np.cos(heading) - north * np.sin(heading)
    references = {"v_north": north, "v_east": east, "v_ground": lateral, "v_water": lateral}
    for stream in search.named(*references):
        factor = QUANTITIES[stream.quantity].units.get(stream.unit or "m/s", 1.0)
        time, values = search.thin(stream)
        evidence = component_evidence(time, factor * values, references[stream.quantity], motion)
        transverse = stream.quantity in ("v_ground", "v_water")
        if transverse and evidence.known < DIFFERS:
            evidence = replace(evidence, agreement=None)
        found = search.judged(stream, evidence, agrees=DIFFERS if transverse else AGREES)
        if evidence.known >= DIFFERS and evidence.sign < 0:
            found.turn(0.8, "its sign is the other one")
        if not stream.unit:
            found.doubt(0.6, "")
        search.take(found)


def _refuse_odd_vectors(search: ChannelSearch) -> None:
    """Refuse both components of a velocity where the motion contradicts one: their frame is another."""
    for pair in _VECTORS:
        both = [channel for channel in search.found if channel.quantity in pair]
        refused = {(c.quantity, _source(c.stream)) for c in both if c.confidence < DIFFERS}
        for channel in both:
            other = pair[1 - pair.index(channel.quantity)], _source(channel.stream)
            if channel.confidence >= DIFFERS and other in refused:
                text = "the other component of its velocity is contradicted, so neither is used"
                search.fault(channel.stream, text)
                search.doubt("the other component is contradicted", channel.stream)


def _source(name: str) -> str:
    """The message of a stream without the name of its field: ``130578 from 5`` of ``130578.speed from 5``."""
    return re.sub(r"\.\S*", "", name) if "." in name else ""


# Streams whose names say nothing --------------------------------------------------------------------------------


def _find_unnamed(search: ChannelSearch) -> None:
    """Find rates of turn, headings, courses and speeds among streams without a quantity, by content alone."""
    nameless = [
        stream
        for stream in search.streams
        if not stream.quantity
        and len(stream.values) >= FEW_SAMPLES
        and np.ptp(stream.values) > 0
        and not names_another(stream.name)
    ]
    if search.best("heading") is None or search.best("cog") is None:
        _find_unnamed_directions(search, [stream for stream in nameless if _circular(stream)])
    for stream in nameless:
        known = any(channel.stream == stream.name for channel in search.found)
        if not known and not _find_unnamed_rate(search, stream):
            _find_unnamed_speed(search, stream)
    _take_rate_of_heading(search)


def _find_unnamed_rate(search: ChannelSearch, stream: LogStream) -> bool:
    """Whether a stream is the rate of turn of a log that has no other."""
    if search.best("yaw_rate") or search.named("yaw_rate") or stream.unit not in ("", *QUANTITIES["yaw_rate"].units):
        return False
    time, values = search.thin(stream)
    evidence = rate_evidence(time, values, search.motion)
    if evidence.known <= 0.97 or not evidence.unit:
        return False
    unit, why = stream.unit or evidence.unit, f"by content alone: {evidence.text}"
    search.add(Judgement(stream, 0.85, why, unit, evidence.sign), "yaw_rate")
    search.rate = time, search.found[-1].si(values)
    return True


def _find_unnamed_speed(search: ChannelSearch, stream: LogStream) -> None:
    """Take a stream for the speed over ground of a log that has none, if it follows the positions."""
    known = any(search.best(name) for name in ("sog", "u_ground", "v_north"))
    if known or stream.unit not in ("", *QUANTITIES["sog"].units):
        return
    time, values = search.thin(stream)
    evidence = speed_evidence(time, values, search.motion, "sog")
    follows = component_evidence(time, values, search.motion.speed_mps, search.motion).known
    unit = stream.unit or evidence.unit
    if min(evidence.known, follows) <= 0.9 or not evidence.unit or values.min() < 0:
        return
    if _closer_than_water(search, time, values * QUANTITIES["sog"].units[unit]):
        search.add(Judgement(stream, 0.75, f"by content alone: {evidence.text}", unit), "sog")


def _closer_than_water(search: ChannelSearch, time: Array, speed: Array) -> bool:
    """Whether a speed (m/s) follows the speed by the positions more closely than the one through the water does."""
    water = search.best("u_water")
    if water is None:
        return True
    at, motion = search.motion.time_s, search.motion
    errors = [
        float(np.nanmedian(np.abs(interpolated(at, *series, 5.0) - motion.speed_mps)))
        for series in ((time, speed), search.series(water))
    ]
    return errors[0] < _MUCH_LESS * errors[1]


def _find_unnamed_directions(search: ChannelSearch, streams: list[LogStream]) -> None:
    """A course and a heading by content: both follow the track, and the course more closely."""
    known = [channel for channel in (search.best("heading"), search.best("cog")) if channel is not None]
    candidates = []
    for stream in [*streams, *(search.stream(channel.stream) for channel in known)]:
        evidence = direction_evidence(*search.angle(stream), search.motion)
        if evidence.known > AGREES and evidence.sign > 0 and abs(evidence.offset_rad) < LARGEST_OFFSET_RAD:
            candidates.append((stream, evidence))
    candidates.sort(key=lambda entry: entry[1].spread_rad)
    distinct = len(candidates) == 2 and candidates[1][1].spread_rad > 1.5 * candidates[0][1].spread_rad
    if not distinct and (known or len(candidates) != 1):
        return
    for place, (stream, evidence) in enumerate(candidates):
        quantity = "cog" if distinct and place == 0 else "heading"
        if any(stream.name == channel.stream or quantity == channel.quantity for channel in known):
            continue
        why = f"by content alone: {evidence.text}" + ("" if distinct else "; it may be the course over ground")
        unit = angle_unit(stream.values, stream.unit)
        search.add(Judgement(stream, 0.85 if distinct else 0.7, why, unit), quantity)
    _take_heading(search)


def _circular(stream: LogStream) -> bool:
    most, least = float(stream.values.max()), float(stream.values.min())
    return stream.unit in ("", "deg", "rad") and (most > 1.0 or least < -1.0) and least >= -181 and most <= 361
