"""Files that follow each other in time: parts of one log, as recorders begin a new file each hour or at a size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tank2sim.logs.streams import LogFinding, LogStream, VesselLog

OVERLAP_S = 2.0
"""Most that a file may reach into the next one, s. Project choice: what a message is late by, recorded."""


def joined_parts(logs: Sequence[VesselLog]) -> list[VesselLog]:
    """The logs, with dated files of one format that follow each other as one.

    Streams of one name become one stream. A file that holds only streams that the others lack, or that lies in their
    time, is another instrument's and stays a log of its own.

    Parameters
    ----------
    logs : sequence of VesselLog
        In any order, in which they stay: that of the first that was given of each.
    """
    found: list[tuple[int, VesselLog]] = []
    for given in sorted(range(len(logs)), key=lambda one: _span(logs[one])[0]):
        log = logs[given]
        place = next((place for place, (_, before) in enumerate(found) if _follows(before, log)), None)
        if place is None:
            found.append((given, log))
        else:
            first, before = found[place]
            found[place] = min(first, given), _joined(before, log)
    return [log for _, log in sorted(found, key=lambda one: one[0])]


def _span(log: VesselLog) -> tuple[float, float]:
    times = [stream.time_s[np.isfinite(stream.time_s)] for stream in log.streams]
    times = [time for time in times if len(time)]
    if not times:
        return np.inf, np.inf
    return min(float(time.min()) for time in times), max(float(time.max()) for time in times)


def _follows(before: VesselLog, log: VesselLog) -> bool:
    names = {stream.name for stream in before.streams}
    return (
        before.dated
        and log.dated
        and before.format == log.format
        and any(stream.name in names for stream in log.streams)
        and _span(before)[1] <= _span(log)[0] + OVERLAP_S
    )


def _joined(before: VesselLog, log: VesselLog) -> VesselLog:
    later = {stream.name: stream for stream in log.streams}
    streams = [_continued(stream, later.pop(stream.name, None)) for stream in before.streams]
    text = f"{log.path.name} continues {before.path.name}"
    findings = (*before.findings, *log.findings, LogFinding("note", text))
    return replace(before, path=log.path, streams=(*streams, *later.values()), findings=findings)


def _continued(stream: LogStream, later: LogStream | None) -> LogStream:
    if later is None or not len(later.time_s):
        return stream
    if not len(stream.time_s):
        return later
    new = ~(later.time_s <= np.nanmax(stream.time_s))
    return replace(
        stream,
        time_s=np.concatenate([stream.time_s, later.time_s[new]]),
        values=np.concatenate([stream.values, later.values[new]]),
    )
