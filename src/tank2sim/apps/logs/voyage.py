"""A voyage: the channels of its logs in SI on one clock, and its current."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tank2sim.apps.logs.channel_search import find_channels
from tank2sim.apps.logs.channels import SURE_FROM, ChannelSet, LogChannel
from tank2sim.apps.logs.clock import gaps_of, tidied, utc_text
from tank2sim.apps.logs.content import AGREES
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.recorded import pulses_of, without_missing
from tank2sim.apps.logs.reference import (
    HEADING_WINDOW_S,
    POSITION_WINDOW_S,
    differenced,
    interpolated,
    local_metres,
    rounded_origin,
    thinned_series,
)
from tank2sim.apps.logs.streams import LogFinding, LogStream, VesselLog, fault, joined_parts, note
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice, caution
from tank2sim.records.signals.sampling import GAP_STEPS
from tank2sim.records.trials import usual_step

_GAP_LEAST_S = 3.0
"""Gaps shorter than this are not reported, s. Project choice: they are bridged without harm at ship's speeds."""

LONGEST_VOYAGE_S = 1e7
"""Longest time that a log may span, s. Project choice: four months; more is a clock that was not set, and the even
grids of so long a time would exhaust the memory."""

_GAPS_LISTED = 5
"""Gaps of a channel that are listed one by one. Project choice: more are a rate of loss."""


@dataclass(frozen=True, eq=False)
class QuantitySeries:
    """A quantity over time: `time_s` (n,), UTC s or from the beginning of the log, rising; `values` (n,), SI."""

    time_s: Array
    values: Array


@dataclass(frozen=True, eq=False)
class Voyage:
    """Record of a vessel, in SI.

    Parameters
    ----------
    logs : tuple of VesselLog
    channels : ChannelSet
    series : mapping
        Quantity to its values; ``x`` and ``y`` are m to north and east of the origin, the heading is continuous.
    origin_deg : tuple or None
        Latitude and longitude of x = y = 0.
    begin_s, end_s : float
        Beginning and end of the voyage, in the time of the series.
    findings : tuple of LogFinding
    counts : mapping
        Log to what was read and lost.
    """

    logs: tuple[VesselLog, ...]
    channels: ChannelSet
    series: Mapping[str, QuantitySeries]
    origin_deg: tuple[float, float] | None
    begin_s: float
    end_s: float
    findings: tuple[LogFinding, ...]
    counts: Mapping[str, Mapping[str, int]]

    @property
    def dated(self) -> bool:
        """Whether times are UTC."""
        return all(log.dated for log in self.logs)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Findings on the logs, faults first: somebody must confirm or correct these."""
        others = [Notice(finding.text) for finding in self.findings if finding.kind != "fault"]
        return (*self.faults, *others)

    @property
    def faults(self) -> list[Notice]:
        """Cautions on channels and clocks that are not as they seem."""
        return [caution(f"UNCONFIRMED: {finding.text}") for finding in self.findings if finding.kind == "fault"]


def make_voyage(logs: Sequence[VesselLog], channels: ChannelSet | None = None) -> Voyage:
    """Join logs, files that follow each other as one: find or take their channels, convert them to SI, and bring
    positions to local metres.

    Raises
    ------
    InputError
        A channel names a stream that no log has, or nothing in the logs is understood.
    """
    parts = joined_parts(logs)
    counts: dict[str, dict[str, int]] = {log.path.name: dict(log.counts) for log in logs}
    streams, findings = _tidied_streams(parts, counts)
    _refuse_odd_times(logs, streams)
    found = channels or find_channels(streams)
    findings += found.findings
    if len(parts) > 1 and channels is None:
        findings += _clock_findings([log.path.stem for log in parts], found, streams)
    series = _series(logs[0].path, found, streams)
    findings += _to_confirm(found)
    if channels is None:
        findings += _not_understood(found, streams)
    series, origin = _derived(series)
    findings += _gap_findings(series)
    begin = min(float(entry.time_s[0]) for entry in series.values())
    end = max(float(entry.time_s[-1]) for entry in series.values())
    return Voyage(tuple(logs), found, series, origin, begin, end, tuple(findings), counts)


def _refuse_odd_times(logs: Sequence[VesselLog], streams: Sequence[LogStream]) -> None:
    """Refuse times in another unit, and logs with and without a date."""
    begins, ends = ([float(stream.time_s[place]) for stream in streams] for place in (0, -1))
    span = max(ends, default=0.0) - min(begins, default=0.0)
    if span > LONGEST_VOYAGE_S:
        problem = f"its times span {span:.3g} s: they are in another unit, or some are wrong"
        raise InputError(logs[0].path, "", problem, "name the unit in the column of time, or remove the wrong rows")
    if len({log.dated for log in logs}) > 1:
        odd = next(log for log in logs if not log.dated)
        raise InputError(odd.path, "", "has no date, and other logs have", "give logs that all have UTC, or one alone")


def _tidied_streams(
    parts: Sequence[VesselLog], counts: dict[str, dict[str, int]]
) -> tuple[list[LogStream], list[LogFinding]]:
    """Streams of all logs, tidied, and findings (one for all streams alike); what was left out is counted."""
    streams: list[LogStream] = []
    findings = [finding for log in parts for finding in log.findings]
    for log in parts:
        repeated = 0
        for stream in log.streams:
            known, missing = without_missing(stream)
            tidy, doubled, found_in_time = tidied(known)
            repeated += doubled
            findings += [*missing, *found_in_time]
            tidy, _ = pulses_of(tidy)
            if len(tidy.values):
                name = stream.name if len(parts) == 1 else f"{log.path.stem}: {stream.name}"
                streams.append(replace(tidy, name=name))
            elif stream.quantity and len(stream.values):
                findings.append(note(f"{stream.name}: holds no valid value", stream.name))
        counts[log.path.name]["repeated_samples"] = repeated
    groups: dict[str, list[LogFinding]] = {}
    for finding in findings:
        key = finding.text.removeprefix(f"{finding.stream}: ") if finding.stream else finding.text
        groups.setdefault(key, []).append(finding)
    return streams, [
        group[0] if len(group) == 1 else replace(group[0], text=f"{len(group)} streams: {key}", stream="")
        for key, group in groups.items()
    ]


def _series(path: Path, found: ChannelSet, streams: Sequence[LogStream]) -> dict[str, QuantitySeries]:
    """The channels in use in SI, at their times less their delays."""
    named = {stream.name: stream for stream in streams}
    listed = f"streams are {', '.join(list(named)[:12])}{', ...' if len(named) > 12 else ''}"
    series: dict[str, QuantitySeries] = {}
    for channel in found.channels:
        if not channel.use or channel.quantity == "ignore":
            continue
        if channel.stream not in named:
            problem = f"no stream is called {channel.stream}"
            remedy = f"{listed}; correct the channels file, or delete it"
            raise InputError(path, f"channel {channel.quantity}", problem, remedy)
        stream = named[channel.stream]
        series[channel.quantity] = QuantitySeries(stream.time_s - channel.delay_s, channel.si(stream.values))
    if not any(len(stream.values) > 1 for stream in streams):
        remedy = "give a log with values at several times, that rise"
        raise InputError(path, "", "has values at one time alone, or none", remedy)
    if not series:
        remedy = f'say which is what with channels="channels.toml", as docs/logs.md shows: {listed}'
        raise InputError(path, "", "no channel of it is understood", remedy)
    return series


MOST_NAMED = 20
"""Streams that a note lists by name (project choice: logs of boards hold hundreds)."""

_CLOCKS_AGREE_S = 0.5
"""Difference of the clocks of two logs that is reported, s. Project choice: a ship turns by a degree at most."""

_LARGEST_SHIFT_S = 120.0
"""Largest difference that is looked for, s. Project choice: clocks that nobody set are off by years, and then the logs
do not overlap."""


def _clock_findings(names: list[str], found: ChannelSet, streams: list[LogStream]) -> list[LogFinding]:
    """Differences of the clocks of several logs, by rates of turn or headings that two of them hold."""
    named = {stream.name: stream for stream in streams}
    rates: dict[str, tuple[Array, Array]] = {}
    for quantity in ("yaw_rate", "heading"):
        for channel in found.channels:
            name = next((name for name in names if channel.stream.startswith(f"{name}: ")), "")
            if channel.quantity == quantity and channel.confidence >= SURE_FROM and name not in rates:
                time, values = named[channel.stream].time_s, channel.si(named[channel.stream].values)
                turned = quantity == "heading"
                rates[name] = differenced(time, np.unwrap(values), HEADING_WINDOW_S) if turned else (time, values)
    findings = []
    for name in names[1:]:
        shift = _shift(rates[names[0]], rates[name]) if names[0] in rates and name in rates else None
        if shift is not None and abs(shift) > _CLOCKS_AGREE_S:
            side = "ahead of" if shift > 0 else "behind"
            text = f"the clock of {name} is {abs(shift):.3g} s {side} the clock of {names[0]} by the rate of turn"
            findings.append(fault(f"{text}: give its channels delay_s = {shift:.3g}", shift_s=shift))
    return findings


def _shift(first: tuple[Array, Array], second: tuple[Array, Array]) -> float | None:
    """By how much the second of two rates of turn is late, s, where they correlate well; else None."""
    step = 0.25
    begin, end = max(first[0][0], second[0][0]), min(first[0][-1], second[0][-1])
    if end - begin < 4 * _LARGEST_SHIFT_S:
        return None
    grid = np.arange(begin + _LARGEST_SHIFT_S, end - _LARGEST_SHIFT_S, step)
    reference = np.interp(grid, *first)
    lags = np.arange(-_LARGEST_SHIFT_S, _LARGEST_SHIFT_S + step, step)
    if np.ptp(reference) == 0 or np.ptp(second[1]) == 0:
        return None
    correlations = [float(np.corrcoef(reference, np.interp(grid + lag, *second))[0, 1]) for lag in lags]
    best = int(np.nanargmax(correlations))
    return float(lags[best]) if correlations[best] > AGREES else None


def _not_understood(found: ChannelSet, streams: list[LogStream]) -> list[LogFinding]:
    """The streams that vary and are no channel, neither by name nor by content, as one note."""
    known = {channel.stream for channel in found.channels}
    names = [stream.name for stream in streams if stream.name not in known and np.ptp(stream.values) > 0]
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    listed = f"columns that were not understood: {', '.join(names[:MOST_NAMED])}{more}"
    text = f"{listed}; add them to channels.toml if they are quantities of it"
    return [note(text, streams=len(names))] if names else []


# Quantities without which no manoeuvre is understood
_ESSENTIAL = ("rudder_angle", "rudder_order", "heading", "yaw_rate")


def _to_confirm(found: ChannelSet) -> list[LogFinding]:
    """Findings of channels in use that are not sure, and of quantities whose only streams are not used."""
    findings = _unsure([channel for channel in found.channels if channel.use and channel.confidence < SURE_FROM])
    used = {channel.quantity: channel.stream for channel in found.channels if channel.use}
    for quantity in _ESSENTIAL:
        best = next((channel for channel in found.channels if channel.quantity == quantity), None)
        if best and quantity not in used and best.confidence >= 0.5:
            text = f"{QUANTITIES[quantity].words} may be {best.stream} ({best.why}), and is not used"
            findings.append(fault(text, best.stream))
    if "magnetic_heading" in used and "heading" not in used:
        name = used["magnetic_heading"]
        text = f"{name} is a magnetic heading, and there is no true one: the trials have no heading; make it one in "
        text += 'channels.toml (quantity = "heading", offset = less the variation in deg, + east, and the deviation)'
        findings.append(fault(text, name))
    return findings


def _unsure(channels: Iterable[LogChannel]) -> list[LogFinding]:
    """Faults of doubtful channels without which no manoeuvre is understood, and one note of all others."""
    findings, others = [], []
    for channel in channels:
        words = QUANTITIES[channel.quantity].words
        if channel.confidence < 0.8 and channel.quantity in _ESSENTIAL:
            text = f"{words} is taken from {channel.stream} ({channel.why}): to be confirmed"
            findings.append(fault(text, channel.stream))
        else:
            others.append(f"{words} ({channel.stream})")
    return [*findings, note(f"to be confirmed in channels.toml: {', '.join(others)}")] if others else findings


def _derived(series: dict[str, QuantitySeries]) -> tuple[dict[str, QuantitySeries], tuple[float, float] | None]:
    """Local metres, continuous headings, and speed and course of velocities to north and east."""
    origin, out = None, dict(series)

    def on(first: str, second: str) -> tuple[Array, Array, Array]:
        """Times and values of a series, and of another at these times."""
        time = out[first].time_s
        return time, out[first].values, np.interp(time, out[second].time_s, out[second].values)

    if {"latitude", "longitude"} <= out.keys():
        at, latitude, longitude = on("latitude", "longitude")
        origin = rounded_origin(latitude, out.pop("longitude").values)
        x, y = local_metres(latitude, longitude, origin)
        out["x"], out["y"] = QuantitySeries(at, x), QuantitySeries(at, y)
        del out["latitude"]
    if ("x" in out) != ("y" in out):
        out.pop("x", None)
        out.pop("y", None)
    if {"v_north", "v_east"} <= out.keys():
        at, north, east = on("v_north", "v_east")
        out.setdefault("sog", QuantitySeries(at, np.hypot(north, east)))
        out.setdefault("cog", QuantitySeries(at, np.arctan2(east, north) % (2 * math.pi)))
    for name in ("heading", "magnetic_heading"):
        if name in out:
            out[name] = QuantitySeries(out[name].time_s, np.unwrap(out[name].values))
    return out, origin


def _gap_findings(series: Mapping[str, QuantitySeries]) -> list[LogFinding]:
    """A note of the gaps of each set of channels that share them."""
    groups: dict[tuple[str, ...], tuple[list[tuple[float, float]], list[str]]] = {}
    for name, entry in series.items():
        gaps = gaps_of(entry.time_s, max(_GAP_LEAST_S, GAP_STEPS * usual_step(entry.time_s)))
        if name != "y" and len(entry.time_s) > 2 and gaps:
            words = "position" if name == "x" else QUANTITIES[name].words
            key = tuple(utc_text(begin)[:19] for begin, _ in gaps)
            groups.setdefault(key, (gaps, []))[1].append(words)
    findings = []
    for gaps, names in groups.values():
        shown = ", ".join(f"{end - begin:.3g} s from {utc_text(begin)[11:19]}" for begin, end in gaps[:_GAPS_LISTED])
        more = f" and {len(gaps) - _GAPS_LISTED} more" if len(gaps) > _GAPS_LISTED else ""
        text = f"nothing for {shown}{more}: {'; '.join(names)}"
        findings.append(note(text, total_s=sum(end - begin for begin, end in gaps)))
    return findings


AVERAGED_S = 60.0
"""Time over which the current is averaged for its spread, s. Project choice: receivers wander over minutes."""

_FEWEST = 10
"""Samples below which no current is determined (project choice)."""

_LEAST_TURN = 0.15
"""Least eigenvalue, of at most 0.5, of the mean square of heading vectors for which the speed ahead alone determines a
current: headings spread over about 90 deg. Project choice."""


@dataclass(frozen=True)
class DriftCurrent:
    """A current: speed (m/s), direction towards which it sets (deg from north), and how much it varies.

    - `spread_mps`: Standard deviation of its averages over :data:`AVERAGED_S`, m/s.
    - `by`: What it follows from.
    """

    speed_mps: float
    direction_deg: float
    spread_mps: float
    by: str


def drift_current(voyage: Voyage, begin_s: float, end_s: float) -> DriftCurrent | None:
    """Current between two times of a voyage; None where its log does not determine it.

    With both components of the velocity through the water it is the mean difference of the velocities over ground and
    water. With the speed ahead alone the difference of the speeds ahead is fitted by the current's component on the
    heading, for which the heading must have changed. A scale error of the log through the water is part of it.
    """
    series = voyage.series
    ground = _ground(voyage)
    if "heading" not in series or "u_water" not in series or ground is None:
        return None
    inside = (ground[0] >= begin_s) & (ground[0] <= end_s)
    time, north, east = (part[inside] for part in ground)
    if len(time) < _FEWEST:
        return None
    heading, ahead, side = (
        interpolated(time, series[name].time_s, series[name].values, 5.0) if name in series else np.zeros(0)
        for name in ("heading", "u_water", "v_water")
    )
    cosine, sine = np.cos(heading), np.sin(heading)
    if "v_water" in series:
        x, y = north - (ahead * cosine - side * sine), east - (ahead * sine + side * cosine)
        good = np.isfinite(x) & np.isfinite(y)
        if good.sum() < _FEWEST:
            return None
        time, x, y = time[good], x[good], y[good]
        spread = math.hypot(*(float(np.std(thinned_series(time, part, AVERAGED_S)[1])) for part in (x, y)))
        return _current(float(x.mean()), float(y.mean()), spread, "velocities over the ground and through the water")
    difference = north * cosine + east * sine - ahead
    good = np.isfinite(difference)
    matrix = np.column_stack([cosine[good], sine[good]])
    if good.sum() < _FEWEST or np.linalg.eigvalsh(matrix.T @ matrix / good.sum())[0] < _LEAST_TURN:
        return None
    mean, *_ = np.linalg.lstsq(matrix, difference[good], rcond=None)
    spread = float(np.std(difference[good] - matrix @ mean))
    return _current(float(mean[0]), float(mean[1]), spread, "speeds ahead over the ground and through the water")


def _current(north: float, east: float, spread: float, by: str) -> DriftCurrent:
    return DriftCurrent(math.hypot(north, east), math.degrees(math.atan2(east, north)) % 360, spread, by)


def _ground(voyage: Voyage) -> tuple[Array, Array, Array] | None:
    """Times and velocity to north and east over the ground."""
    series = voyage.series
    if "v_north" in series and "v_east" in series:
        north, east = series["v_north"], series["v_east"]
        return north.time_s, north.values, np.interp(north.time_s, east.time_s, east.values)
    if "sog" in series and "cog" in series:
        sog, cog = series["sog"], series["cog"]
        longest = 3 * max(usual_step(cog.time_s), 1.0)
        cosine, sine = (
            interpolated(sog.time_s, cog.time_s, part, longest) for part in (np.cos(cog.values), np.sin(cog.values))
        )
        course = np.arctan2(sine, cosine)
        return sog.time_s, sog.values * np.cos(course), sog.values * np.sin(course)
    if "x" in series and "y" in series:
        time, v_north = differenced(series["x"].time_s, series["x"].values, POSITION_WINDOW_S)
        return time, v_north, differenced(series["y"].time_s, series["y"].values, POSITION_WINDOW_S)[1]
    return None
