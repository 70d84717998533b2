"""Channels of positions: pairs of streams whose track has a plausible speed, and the motion that follows from them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.candidates import REFUTED, STATED, ChannelSearch, Judgement
from tank2sim.apps.logs.content import AGREES, DIFFERS, FEW_SAMPLES, direction_evidence
from tank2sim.apps.logs.direction_channels import could_be_direction
from tank2sim.apps.logs.findings import fault
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.reference import (
    POSITION_WINDOW_S,
    ReferenceMotion,
    differenced,
    interpolated,
    local_metres,
    rounded_origin,
)
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

RECEIVERS_APART_M = 10.0
"""Median distance of two tracks from which they are reported as of two receivers, m. Project choice: beyond the errors
of a receiver; antennas of a ship may be as far apart, which a track has to know too."""

FASTEST_TRACK_MPS = 60.0
"""Speed that no track of a vessel has, m/s: the record on water is 142, of vessels in service below 50."""

_PAIRED = 0.5
"""Share of the samples of a latitude that have a longitude at the same time, from which they are a pair (project
choice)."""

_LONGEST_VOYAGE_DEG, _MOST_TRIED = 5.0, 8
"""Change of latitude or longitude in a log, deg, up to which a stream without a name may be one, and the number of such
streams that are tried. Project choice: 300 nautical miles of latitude, a day of sailing; 56 pairs."""

_LARGEST_DEG = {"latitude": 90, "longitude": 360}
_AXES = (("latitude", "longitude"), ("x", "y"))  # To north and to east
_CONFIDENCE = {"format": STATED["format"], "name": 0.9, "": STATED["name"]}

# Faults of a track, and the factors of its velocities to north and east that undo them, behind an exchange of the two
_FAULTY_AXES = (
    ("has its axes exchanged", True, 1, 1),
    ("is mirrored, as by a wrong sign of the second", False, 1, -1),
    ("is mirrored, as by a wrong sign of the first", False, -1, 1),
)

_Pair = tuple[LogStream, LogStream]


@dataclass(frozen=True, eq=False)
class _Track:
    """Streams to north and east at their common times, and their motion."""

    pair: _Pair
    motion: ReferenceMotion

    @property
    def degrees(self) -> tuple[Array, Array]:
        """Latitude and longitude (n,), deg."""
        return _degrees(self.pair[0]), _degrees(self.pair[1])


def find_positions(search: ChannelSearch) -> None:
    """Find the tracks of a log, the longest one first, which gives the motion of the search."""
    pairs = _named_pairs(search) or _unnamed_pair(search)
    tracks = [track for pair in pairs if (track := _track(search, pair)) is not None]
    if not tracks:
        return
    tracks.sort(key=lambda track: (track.pair[0].quantity != "latitude", -search.coverage(track.pair[0].name)))
    search.motion = tracks[0].motion
    wrong, corrected = _wrong_axes(search)
    for track in tracks:
        _take_track(search, track, 0.0 if track is tracks[0] else 0.02, wrong)
    _report_two_receivers(search, [track for track in tracks if track.pair[0].quantity == "latitude"])
    if wrong:
        first, second = tracks[0].pair
        search.fault(first.name, f"with {second.name}, its track {wrong}, by headings and courses")
        search.motion = corrected


def _track(search: ChannelSearch, pair: _Pair) -> _Track | None:
    """The track of two streams; None, and a fault, where they hold no position."""
    if (motion := _motion_of(*pair)) is not None:
        return _Track(pair, motion)
    for stream in pair:
        search.add(Judgement(stream, REFUTED, "its values are no position, or leap", stream.unit or "deg"))
    search.fault(pair[0].name, "holds no position, or leaps")
    return None


def _take_track(search: ChannelSearch, track: _Track, less: float, wrong: str) -> None:
    """Add both streams of a track, with a little `less` confidence, or with what is `wrong` with their axes."""
    for stream in track.pair:
        unit = stream.unit or ("deg" if stream.quantity in _LARGEST_DEG else "m")
        found = Judgement(stream, _CONFIDENCE[stream.stated_by] - less, "a track of a plausible speed", unit)
        if wrong:
            found.refuse(f"its track {wrong}")
        search.add(found)


def _named_pairs(search: ChannelSearch) -> list[_Pair]:
    """Each stream to north with the one to east whose name is most like its own, at their common times."""
    pairs = []
    for north, east in _AXES:
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


def _unnamed_pair(search: ChannelSearch) -> list[_Pair]:
    """The only two streams without a name whose track, as latitude and longitude, a heading or a course follows."""
    slow = [stream for stream in search.streams if not stream.quantity and _could_be_position(stream)]
    angles = [stream for stream in search.streams if could_be_direction(stream)][:_MOST_TRIED]
    found = []
    for first, second in itertools.permutations(slow[:_MOST_TRIED], 2):
        pair = _paired(replace(first, quantity="latitude"), replace(second, quantity="longitude"))
        if pair and _is_followed(search, pair, [angle for angle in angles if angle not in (first, second)]):
            found.append(pair)
    if len(found) != 1:
        return []
    for stream in found[0]:
        search.rename(search.stream(stream.name), stream.quantity)
    return found


def _is_followed(search: ChannelSearch, pair: _Pair, angles: Iterable[LogStream]) -> bool:
    """Whether one of the angles follows the motion of two streams as a heading or a course does."""
    if (motion := _motion_of(*pair)) is None:
        return False
    followed = [direction_evidence(*search.angle(angle), motion) for angle in angles]
    return any(evidence.known > AGREES and evidence.sign > 0 for evidence in followed)


def _could_be_position(stream: LogStream) -> bool:
    if stream.unit not in ("", "deg") or len(stream.values) < FEW_SAMPLES:
        return False
    return 0 < float(np.ptp(stream.values)) < _LONGEST_VOYAGE_DEG and float(np.abs(stream.values).max()) <= 180


def _motion_of(first: LogStream, second: LogStream) -> ReferenceMotion | None:
    """The motion of two streams of one time; None if they are no position, or leap."""
    time, a, b = first.time_s, first.values, second.values
    if len(time) < 3:
        return None
    if first.quantity == "latitude":
        a, b = _degrees(first), _degrees(second)
        if any(np.abs(angle).max() > most for angle, most in zip((a, b), _LARGEST_DEG.values(), strict=True)):
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


def _wrong_axes(search: ChannelSearch) -> tuple[str, ReferenceMotion]:
    """Fault in the axes of the track, and its motion without it; empty unless all directions show it."""
    motion, angles = search.motion, [search.angle(stream) for stream in search.named("heading", "cog")]
    if len(angles) > 1 and all(_agreement(angle, motion, 1.0) <= DIFFERS for angle in angles):
        for text, exchanged, to_north, to_east in _FAULTY_AXES:
            velocities = motion.v_north_mps, motion.v_east_mps
            north, east = velocities[::-1] if exchanged else velocities
            other = replace(motion, v_north_mps=to_north * north, v_east_mps=to_east * east)
            if all(_agreement(angle, other, 0.0) > AGREES for angle in angles):
                return text, other
    return "", motion


def _agreement(angle: tuple[Array, Array], motion: ReferenceMotion, untested: float) -> float:
    """Agreement of a direction (times, rad) with a motion; `untested` where the log cannot show it."""
    agreement = direction_evidence(*angle, motion).agreement
    return untested if agreement is None else agreement


def _report_two_receivers(search: ChannelSearch, tracks: Sequence[_Track]) -> None:
    for other in tracks[1:]:
        first = tracks[0]
        time, name = first.pair[0].time_s, first.pair[0].name
        step, origin = 2 * usual_step(time), rounded_origin(*first.degrees)
        here, there = local_metres(*first.degrees, origin), local_metres(*other.degrees, origin)
        dx, dy = (interpolated(time, other.pair[0].time_s, b, step) - a for a, b in zip(here, there, strict=True))
        apart = float(np.nanmedian(np.hypot(dx, dy))) if np.isfinite(dx).any() else 0.0
        if apart > RECEIVERS_APART_M:
            text = f"{other.pair[0].name} is {apart:.3g} m from {name} (median): two receivers; {name} is used"
            search.findings.append(fault(text, other.pair[0].name, apart_m=apart))
