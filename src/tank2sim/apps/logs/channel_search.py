"""The search for the channels of a voyage: by format, names, units and content; here rates of turn and speeds."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from tank2sim.apps.logs.candidates import ChannelSearch, Judgement
from tank2sim.apps.logs.channels import ChannelSet
from tank2sim.apps.logs.content import (
    AGREES,
    DIFFERS,
    FEW_SAMPLES,
    ContentEvidence,
    component_evidence,
    rate_evidence,
    speed_evidence,
)
from tank2sim.apps.logs.direction_channels import find_directions, find_unnamed_directions
from tank2sim.apps.logs.position_channels import find_positions
from tank2sim.apps.logs.quantities import QUANTITIES, names_another
from tank2sim.apps.logs.reference import differenced, interpolated
from tank2sim.apps.logs.steering_channels import find_steering
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array

_MUCH_LESS = 0.7
"""Ratio of deviations from which the lesser one decides (project choice)."""

# Quantities that are the components of one velocity
_VECTORS = (("u_ground", "v_ground"), ("u_water", "v_water"), ("v_north", "v_east"))
_TRANSVERSE = ("v_ground", "v_water")


def find_channels(streams: Iterable[LogStream]) -> ChannelSet:
    """Find the channel of each quantity.

    The position gives the motion against which headings, courses and speeds are tested; the heading gives the rate of
    turn; the rate of turn gives rudders and thrusters. A stream whose content contradicts its name or format is not
    used, and is a fault in the findings; the one of several that agrees best is used.
    """
    search = ChannelSearch([stream for stream in streams if len(stream.values) >= 2])
    find_positions(search)
    find_directions(search)
    _find_rates(search)
    _find_speeds(search)
    _find_components(search)
    _refuse_odd_vectors(search)
    _find_unnamed(search)
    find_steering(search)
    return search.result()


def _find_rates(search: ChannelSearch) -> None:
    for stream in search.named("yaw_rate"):
        evidence = rate_evidence(*search.thin(stream), search.motion)
        found = search.judged(stream, evidence)
        if evidence.known >= AGREES:
            _refuse_other_unit(found, evidence)
            if not evidence.unit:
                found.doubt(0.6, ", but with a scale of no unit")
            if evidence.sign < 0:
                found.turn(min(found.confidence, 0.9), "its sign is the other one")
            if found.sign < 0:
                search.note(stream.name, "is positive to port")
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
        time, values = search.thin(stream)
        ahead = values if stream.quantity == "sog" else values * search.way_at(time)
        evidence = speed_evidence(time, ahead, search.motion, stream.quantity)
        found = search.judged(stream, evidence, agrees=AGREES - 0.1)
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
    references = {"v_north": north, "v_east": east} | dict.fromkeys(_TRANSVERSE, lateral)
    for stream in search.named(*references):
        factor = QUANTITIES[stream.quantity].units.get(stream.unit or "m/s", 1.0)
        time, values = search.thin(stream)
        evidence = component_evidence(time, factor * values, references[stream.quantity], motion)
        transverse = stream.quantity in _TRANSVERSE
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
    nameless = [stream for stream in search.streams if _says_nothing(stream)]
    if search.best("heading") is None or search.best("cog") is None:
        find_unnamed_directions(search, nameless)
    for stream in nameless:
        known = any(channel.stream == stream.name for channel in search.found)
        if not known and not _find_unnamed_rate(search, stream):
            _find_unnamed_speed(search, stream)
    _take_rate_of_heading(search)


def _says_nothing(stream: LogStream) -> bool:
    """Whether a stream varies and its name says no quantity, known here or not."""
    varies = len(stream.values) >= FEW_SAMPLES and np.ptp(stream.values) > 0
    return bool(varies) and not stream.quantity and not names_another(stream.name)


def _find_unnamed_rate(search: ChannelSearch, stream: LogStream) -> bool:
    """Whether a stream is the rate of turn of a log that has no other."""
    if search.best("yaw_rate") or search.named("yaw_rate") or stream.unit not in ("", *QUANTITIES["yaw_rate"].units):
        return False
    time, values = search.thin(stream)
    evidence = rate_evidence(time, values, search.motion)
    if evidence.known <= 0.97 or not evidence.unit:
        return False
    search.add_unnamed(stream, "yaw_rate", 0.85, evidence)
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
    if min(evidence.known, follows) <= 0.9 or not evidence.unit or values.min() < 0:
        return
    if _closer_than_water(search, time, values * QUANTITIES["sog"].units[stream.unit or evidence.unit]):
        search.add_unnamed(stream, "sog", 0.75, evidence)


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
