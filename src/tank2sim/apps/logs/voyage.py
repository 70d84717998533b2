"""A voyage: the channels of its logs in SI on one clock, and its current."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from tank2sim.apps.logs.channel_search import find_channels
from tank2sim.apps.logs.channels import SURE_FROM, ChannelSet, LogChannel
from tank2sim.apps.logs.clock import gaps_of, tidied, utc_text
from tank2sim.apps.logs.content import AGREES
from tank2sim.apps.logs.findings import LogFinding, fault, merged_findings, note
from tank2sim.apps.logs.parts import joined_parts, log_span_s, on_one_clock
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.recorded import pulses_of, without_missing
from tank2sim.apps.logs.reference import (
    HEADING_WINDOW_S,
    POSITION_WINDOW_S,
    differenced,
    interpolated,
    interpolated_angle,
    local_metres,
    rounded_origin,
    thinned_series,
)
from tank2sim.apps.logs.streams import LogStream, VesselLog
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

RECORDS_APART_S = 10.0
"""Time without any log, s, from which a voyage goes on with another record. Project choice: recorders start a new file
within a second; what a vessel does in more time is not known."""

_GAPS_LISTED = 5
"""Gaps of a channel that are listed one by one. Project choice: more are a rate of loss."""


_CONTINUOUS_HEADINGS = ("heading", "magnetic_heading")


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

    Records with clocks of their own are put one behind the other, and have their channels together.

    Raises
    ------
    InputError
        A channel names a stream that no log has, nothing in the logs is understood, or it is not clear to which of
        several records a log belongs.
    """
    logs = on_one_clock(logs)
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
    findings += _gap_findings(series, _spans_of_records(logs))
    begin = min(float(entry.time_s[0]) for entry in series.values())
    end = max(float(entry.time_s[-1]) for entry in series.values())
    return Voyage(tuple(logs), found, series, origin, begin, end, tuple(findings), counts)


def records_of(voyage: Voyage) -> list[Voyage]:
    """The voyage in records, each as a voyage with its logs: between them no log runs for :data:`RECORDS_APART_S`."""
    records = _spans_of_records(voyage.logs)
    if len(records) == 1:
        return [voyage]
    middles = [0.5 * (before.end_s + after.begin_s) for before, after in pairwise(records)]
    edges = pairwise([-math.inf, *middles, math.inf])
    cut = [_between(voyage, record.logs, *edge) for record, edge in zip(records, edges, strict=True)]
    return [record for record in cut if record.series]


@dataclass(frozen=True)
class _RecordSpan:
    """Logs of a record, and its begin and end, s."""

    logs: tuple[VesselLog, ...]
    begin_s: float
    end_s: float


def _spans_of_records(logs: Sequence[VesselLog]) -> list[_RecordSpan]:
    """Logs in the order of time, together where less than :data:`RECORDS_APART_S` is between them."""
    records: list[_RecordSpan] = []
    for log in sorted(logs, key=log_span_s):
        begin, end = log_span_s(log)
        if records and begin <= records[-1].end_s + RECORDS_APART_S:
            last = records[-1]
            records[-1] = _RecordSpan((*last.logs, log), last.begin_s, max(last.end_s, end))
        else:
            records.append(_RecordSpan((log,), begin, end))
    return records


def _between(voyage: Voyage, logs: tuple[VesselLog, ...], begin_s: float, end_s: float) -> Voyage:
    """The part of a voyage between two times, as the record of some of its logs."""
    series = {}
    for name, entry in voyage.series.items():
        inside = (entry.time_s >= begin_s) & (entry.time_s < end_s)
        if inside.any():
            values = entry.values[inside]
            if name in _CONTINUOUS_HEADINGS:
                values = values - 2 * math.pi * math.floor(values[0] / (2 * math.pi))
            series[name] = QuantitySeries(entry.time_s[inside], values)
    ends = [(entry.time_s[0], entry.time_s[-1]) for entry in series.values()]
    begin, end = min((first for first, _ in ends), default=begin_s), max((last for _, last in ends), default=end_s)
    return replace(voyage, logs=logs, series=series, begin_s=float(begin), end_s=float(end))


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
        prefix = "" if len(parts) == 1 else f"{log.path.stem}: "
        counts[log.path.name]["repeated_samples"] = 0
        for stream in log.streams:
            known, missing = without_missing(stream)
            tidy, repeated, found_in_time = tidied(known)
            counts[log.path.name]["repeated_samples"] += repeated
            findings += [*missing, *found_in_time]
            tidy, _ = pulses_of(tidy)
            if len(tidy.values):
                streams.append(replace(tidy, name=prefix + stream.name))
            elif stream.quantity and len(stream.values):
                findings.append(note(f"{stream.name}: holds no valid value", stream.name))
    return streams, merged_findings(findings)


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
    rates = {name: rate for name in names if (rate := _rate_of_turn(name, found, streams)) is not None}
    findings, first = [], names[0]
    for name in names[1:]:
        shift = _shift(rates[first], rates[name]) if {first, name} <= rates.keys() else None
        if shift is not None and abs(shift) > _CLOCKS_AGREE_S:
            side = "ahead of" if shift > 0 else "behind"
            text = f"the clock of {name} is {abs(shift):.3g} s {side} the clock of {first} by the rate of turn"
            findings.append(fault(f"{text}: give its channels delay_s = {shift:.3g}", shift_s=shift))
    return findings


def _rate_of_turn(name: str, found: ChannelSet, streams: list[LogStream]) -> tuple[Array, Array] | None:
    """Times and values of the rate of turn of a log, or of the slope of its heading; None where neither is sure."""
    named = {stream.name: stream for stream in streams if stream.name.startswith(f"{name}: ")}
    sure = [each for each in found.channels if each.stream in named and each.confidence >= SURE_FROM]
    for channel in sorted(sure, key=lambda each: each.quantity != "yaw_rate"):
        time, values = named[channel.stream].time_s, channel.si(named[channel.stream].values)
        if channel.quantity == "yaw_rate":
            return time, values
        if channel.quantity == "heading":
            return differenced(time, np.unwrap(values), HEADING_WINDOW_S)
    return None


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

_MAGNETIC_ALONE = (
    "{} is a magnetic heading, and there is no true one: the trials have no heading; make it one in channels.toml "
    '(quantity = "heading", offset = less the variation in deg, + east, and the deviation)'
)


def _to_confirm(found: ChannelSet) -> list[LogFinding]:
    """Findings of channels in use that are not sure, and of quantities whose only streams are not used."""
    used = {channel.quantity: channel for channel in found.channels if channel.use}
    findings = _unsure([channel for channel in used.values() if channel.confidence < SURE_FROM])
    for quantity in _ESSENTIAL:
        best = next((channel for channel in found.channels if channel.quantity == quantity), None)
        if best and quantity not in used and best.confidence >= 0.5:
            text = f"{QUANTITIES[quantity].words} may be {best.stream} ({best.why}), and is not used"
            findings.append(fault(text, best.stream))
    if "magnetic_heading" in used and "heading" not in used:
        name = used["magnetic_heading"].stream
        findings.append(fault(_MAGNETIC_ALONE.format(name), name))
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
    for name in _CONTINUOUS_HEADINGS:
        if name in out:
            out[name] = QuantitySeries(out[name].time_s, np.unwrap(out[name].values))
    return out, origin


def _gap_findings(series: Mapping[str, QuantitySeries], records: Sequence[_RecordSpan]) -> list[LogFinding]:
    """A note of the gaps of each set of channels that share them; the time between undated records is none."""
    between = [(before.end_s, after.begin_s) for before, after in pairwise(records) if not before.logs[0].dated]
    words = {name: "position" if name == "x" else QUANTITIES[name].words for name in series if name != "y"}
    groups: dict[tuple[str, ...], tuple[list[tuple[float, float]], list[str]]] = {}
    for name, word in words.items():
        gaps = _gaps_within(series[name].time_s, between)
        groups.setdefault(tuple(utc_text(begin)[:19] for begin, _ in gaps), (gaps, []))[1].append(word)
    return [_gap_note(gaps, names) for gaps, names in groups.values() if gaps]


def _gaps_within(time_s: Array, between: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Gaps that are reported, without the times `between` records."""
    gaps = gaps_of(time_s, max(_GAP_LEAST_S, GAP_STEPS * usual_step(time_s))) if len(time_s) > 2 else []
    return [(begin, end) for begin, end in gaps if not any(begin <= a and b <= end for a, b in between)]


def _gap_note(gaps: list[tuple[float, float]], names: list[str]) -> LogFinding:
    shown = ", ".join(f"{end - begin:.3g} s from {utc_text(begin)[11:19]}" for begin, end in gaps[:_GAPS_LISTED])
    more = f" and {len(gaps) - _GAPS_LISTED} more" if len(gaps) > _GAPS_LISTED else ""
    text = f"nothing for {shown}{more}: {'; '.join(names)}"
    return note(text, total_s=sum(end - begin for begin, end in gaps))


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
    series, ground = voyage.series, ground_velocity(voyage.series)
    if "heading" not in series or "u_water" not in series or ground is None:
        return None
    inside = (ground[0] >= begin_s) & (ground[0] <= end_s)
    time, north, east = (part[inside] for part in ground)
    names = [name for name in ("heading", "u_water", "v_water") if name in series]
    heading, ahead, *side = (interpolated(time, series[name].time_s, series[name].values, 5.0) for name in names)
    cosine, sine = np.cos(heading), np.sin(heading)
    if side:
        water = np.column_stack([ahead * cosine - side[0] * sine, ahead * sine + side[0] * cosine])
        return _mean_difference(time, np.column_stack([north, east]) - water)
    return _fitted_ahead(np.column_stack([cosine, sine]), north * cosine + east * sine - ahead)


def _mean_difference(time: Array, difference: Array) -> DriftCurrent | None:
    """Current by the velocities over the ground less those through the water (n, 2), to north and east."""
    good = np.isfinite(difference).all(axis=1)
    if good.sum() < _FEWEST:
        return None
    averages = [thinned_series(time[good], part, AVERAGED_S)[1] for part in difference[good].T]
    spread = math.hypot(*(float(np.std(part)) for part in averages))
    return _current(difference[good].mean(axis=0), spread, "velocities over the ground and through the water")


def _fitted_ahead(toward: Array, difference: Array) -> DriftCurrent | None:
    """Current by the speed ahead over the ground less the speed through the water (n,), for heading vectors (n, 2)."""
    good = np.isfinite(difference)
    matrix, known = toward[good], difference[good]
    if len(known) < _FEWEST or np.linalg.eigvalsh(matrix.T @ matrix / len(known))[0] < _LEAST_TURN:
        return None
    mean = np.asarray(np.linalg.lstsq(matrix, known, rcond=None)[0], dtype=np.float64)
    spread = float(np.std(known - matrix @ mean))
    return _current(mean, spread, "speeds ahead over the ground and through the water")


def _current(mean: Array, spread: float, by: str) -> DriftCurrent:
    north, east = mean.tolist()
    return DriftCurrent(math.hypot(north, east), math.degrees(math.atan2(east, north)) % 360, spread, by)


def ground_velocity(series: Mapping[str, QuantitySeries]) -> tuple[Array, Array, Array] | None:
    """Times and velocity to north and east over the ground (n,), m/s; None where it is not known."""
    if "v_north" in series and "v_east" in series:
        north, east = series["v_north"], series["v_east"]
        return north.time_s, north.values, np.interp(north.time_s, east.time_s, east.values)
    if "sog" in series and "cog" in series:
        sog, cog = series["sog"], series["cog"]
        course = interpolated_angle(sog.time_s, cog.time_s, cog.values, 3 * max(usual_step(cog.time_s), 1.0))
        return sog.time_s, sog.values * np.cos(course), sog.values * np.sin(course)
    if "x" in series and "y" in series:
        time, v_north = differenced(series["x"].time_s, series["x"].values, POSITION_WINDOW_S)
        return time, v_north, differenced(series["y"].time_s, series["y"].values, POSITION_WINDOW_S)[1]
    return None
