"""Numbers that stand for missing values: -999, 511 deg, position 0, 0."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from tank2sim.apps.logs.content import FEW_SAMPLES
from tank2sim.apps.logs.streams import LogFinding, LogStream, wrapped_angle
from tank2sim.arrays import Array

_MARK = re.compile(r"-?(9{2,}(\.9+)?|32767|32768|65535|2147483647|2147483648|1023|4095)")
"""Numbers that recorders write for no value: nines, and the bounds of their integers."""

_NOT_AVAILABLE = {"sog": (102.3,), "cog": (360.0,), "heading": (511.0,), "yaw_rate": (128.0, -128.0)}
"""Numbers that AIS sends for no value (ITU-R M.1371-5, table 47), if the values around are others."""

_NO_PLACE = {"latitude": (0.0, 91.0), "longitude": (0.0, 181.0)}
"""The same of a position (AIS), and what receivers send before the first fix."""

_CIRCULAR = ("cog", "heading")

_BOUNDS = {"heading": 361.0, "magnetic_heading": 361.0, "cog": 361.0, "latitude": 90.0, "longitude": 360.0}
"""Largest size of a quantity in deg."""

_JUMP, _LEAST_JUMP = 10.0, 0.05
"""Jump to such a number, as a multiple of the 90th percentile of the steps of the others, and as a share of their range
(of a radian for angles). Project choice."""


def without_missing(stream: LogStream) -> tuple[LogStream, list[LogFinding]]:
    """The stream with nan for numbers that stand for none, and a note of them; streams defined by a format stay.

    A number means no value if it is beyond the bounds of its quantity, or if it is one that recorders write so and is
    further from all others than these are from each other; headings, rates and speeds do not jump to it either.
    """
    if stream.stated_by == "format":
        return stream, []
    values = np.array(stream.values, dtype=float)
    bound = _BOUNDS.get(stream.quantity)
    if bound is not None and stream.unit in ("", "deg") and np.isfinite(values).any():
        inside = np.nanmedian(np.abs(values)) <= bound
        values[inside & (np.abs(values) > bound)] = np.nan
    while (mark := _lone_mark(values, _NO_PLACE.get(stream.quantity, ()))) is not None:
        values[values == mark] = np.nan
    if stream.quantity in _NOT_AVAILABLE:
        extremes = {float(known(values)) for known in (np.nanmin, np.nanmax) if np.isfinite(values).any()}
        marks = [extreme for extreme in extremes if _MARK.fullmatch(f"{extreme:.10g}")]
        for number in (*_NOT_AVAILABLE[stream.quantity], *marks):
            values[_jumps(values, number, stream.quantity in _CIRCULAR)] = np.nan
    lost = np.isnan(values) & np.isfinite(stream.values)
    if not lost.any():
        return stream, []
    shown = ", ".join(f"{number:g}" for number in np.unique(stream.values[lost])[:3])
    text = f"{stream.name}: {lost.sum()} values of {shown} are taken for missing ones"
    return replace(stream, values=values), [LogFinding("note", text, stream.name, {"values": float(lost.sum())})]


def _lone_mark(values: Array, more: tuple[float, ...]) -> float | None:
    """The least or largest value, if it is a mark that is far from all others; None if neither is."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    for extreme in (float(known.min()), float(known.max())):
        others = known[known != extreme]
        if not (_MARK.fullmatch(f"{extreme:.10g}") or extreme in more) or len(others) < FEW_SAMPLES:
            continue
        if min(abs(others.min() - extreme), abs(others.max() - extreme)) > np.ptp(others):
            return extreme
    return None


def _jumps(values: Array, number: float, circular: bool) -> np.ndarray:
    """Where a series (n,) has a number and jumps to it from the values around."""
    at = values == number
    others = np.isfinite(values) & ~at
    if not at.any() or others.sum() < FEW_SAMPLES:
        return np.zeros(len(values), dtype=bool)
    if circular and number < 0 <= values[others].min():
        return np.asarray(at)
    place = np.arange(len(values))
    series = np.unwrap(np.radians(values[others])) if circular else values[others]
    difference = np.interp(place, place[others], series) - (np.radians(values) if circular else values)
    difference = wrapped_angle(difference) if circular else difference
    least = _LEAST_JUMP * (1.0 if circular else float(np.ptp(series)))
    return np.asarray(at & (np.abs(difference) > max(_JUMP * float(np.percentile(np.abs(np.diff(series)), 90)), least)))
