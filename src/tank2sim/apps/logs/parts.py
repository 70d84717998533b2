"""Several files of a vessel: parts of one log, other instruments of the same time, or records one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tank2sim.apps.logs.findings import note
from tank2sim.apps.logs.streams import LogStream, VesselLog
from tank2sim.errors import InputError

OVERLAP_S = 2.0
"""Most that a file may reach into the next one, s. Project choice: what a message is late by, recorded."""

RECORDS_SET_APART_S = 60.0
"""Time between two records that have clocks of their own, s. Project choice: no filter or window reaches across it."""

_SAME_COLUMNS = 0.8
"""Share of the columns of two files that both have, from which they are the same instruments. Project choice: a column
that is empty in one file is left out; a second instrument shares its time and position at most."""


def on_one_clock(logs: Sequence[VesselLog]) -> list[VesselLog]:
    """The logs, with undated records whose clocks overlap or start again moved one behind the other.

    Undated logs of one format with the same columns are records of their own: the same instruments do not record twice
    at one time. Records that follow each other on one clock stay where they are.

    Raises
    ------
    InputError
        A further undated log has other columns: nothing shows to which of the records it belongs.
    """
    out = list(logs)
    for group in _groups_of_records(logs):
        spans = [log_span_s(logs[place]) for place in group]
        if all(before[1] <= after[0] + OVERLAP_S for before, after in pairwise(sorted(spans))):
            continue
        if len(group) < len(logs):
            odd = next(log for place, log in enumerate(logs) if place not in group)
            problem = f"has other columns than {logs[group[0]].path.name}: "
            problem += "to which of several records it belongs is not clear"
            raise InputError(odd.path, "", problem, "give the files of each record in a command of their own")
        end, moved = spans[0][1], []
        for place, (begin, last) in zip(group[1:], spans[1:], strict=True):
            by_s = end + RECORDS_SET_APART_S - begin
            out[place] = _moved(logs[place], by_s)
            moved.append(f"{logs[place].path.name} (its times + {by_s:.6g} s)")
            end = last + by_s
        text = f"records with a clock of their own are put behind {logs[group[0]].path.name}: {', '.join(moved)}"
        out[group[0]] = replace(logs[group[0]], findings=(*logs[group[0]].findings, note(text, records=len(group))))
    return out


def _groups_of_records(logs: Sequence[VesselLog]) -> list[list[int]]:
    """Places of undated logs with the same columns, two or more in each group."""
    groups: list[list[int]] = []
    for place, log in enumerate(logs):
        group = next((group for group in groups if _same_columns(logs[group[0]], log)), None)
        if group is None:
            groups.append([place])
        else:
            group.append(place)
    return [group for group in groups if len(group) > 1]


def _same_columns(first: VesselLog, second: VesselLog) -> bool:
    """Whether two logs are undated and have the same columns except a few."""
    one, other = ({stream.name for stream in log.streams} for log in (first, second))
    undated = not first.dated and not second.dated and first.format == second.format
    return undated and bool(one) and len(one & other) >= _SAME_COLUMNS * len(one | other)


def _moved(log: VesselLog, by_s: float) -> VesselLog:
    """A log with all its times moved."""
    return replace(log, streams=tuple(replace(stream, time_s=stream.time_s + by_s) for stream in log.streams))


def joined_parts(logs: Sequence[VesselLog]) -> list[VesselLog]:
    """The logs, with files of one format that follow each other as one, each at the place of its first file.

    Streams of one name become one stream. A file that holds only streams that the others lack, or that lies in their
    time, is another instrument's and stays a log of its own; so does an undated one with other columns.
    """
    found: list[tuple[int, list[VesselLog]]] = []
    for given in sorted(range(len(logs)), key=lambda number: log_span_s(logs[number])[0]):
        log = logs[given]
        place = next((place for place, (_, before) in enumerate(found) if _follows(before, log)), None)
        if place is None:
            found.append((given, [log]))
        else:
            first, before = found[place]
            found[place] = min(first, given), [*before, log]
    return [_joined(parts) for _, parts in sorted(found, key=lambda entry: entry[0])]


def log_span_s(log: VesselLog) -> tuple[float, float]:
    """First and last time of all streams, s; infinite without any."""
    times = [stream.time_s[np.isfinite(stream.time_s)] for stream in log.streams]
    begins, ends = ([float(bound(time)) for time in times if len(time)] for bound in (np.min, np.max))
    return min(begins, default=np.inf), max(ends, default=np.inf)


def _follows(parts: Sequence[VesselLog], log: VesselLog) -> bool:
    """Whether a log goes on where the parts of another end."""
    if max(log_span_s(part)[1] for part in parts) > log_span_s(log)[0] + OVERLAP_S:
        return False
    if not log.dated:
        return any(_same_columns(part, log) for part in parts)
    names = {stream.name for stream in log.streams}
    alike = parts[0].dated and parts[0].format == log.format
    return alike and any(stream.name in names for part in parts for stream in part.streams)


def _joined(parts: Sequence[VesselLog]) -> VesselLog:
    """Parts, in the order of time, as one log."""
    if len(parts) == 1:
        return parts[0]
    streams: dict[str, LogStream] = {}
    for log in parts:
        for stream in log.streams:
            before = streams.get(stream.name)
            streams[stream.name] = _continued(before, stream) if before else stream
    names = [log.path.name for log in parts]
    continued = note(f"{', '.join(names[1:])} continue{'s' * (len(names) == 2)} {names[0]}")
    findings = (*(finding for log in parts for finding in log.findings), continued)
    return replace(parts[0], path=parts[-1].path, streams=tuple(streams.values()), findings=findings)


def _continued(stream: LogStream, later: LogStream) -> LogStream:
    if not len(later.time_s):
        return stream
    if not len(stream.time_s):
        return later
    new = ~(later.time_s <= np.nanmax(stream.time_s))
    time_s, values = np.append(stream.time_s, later.time_s[new]), np.append(stream.values, later.values[new])
    return replace(stream, time_s=time_s, values=values)
