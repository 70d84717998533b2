"""Pictures of the passport of an FMU: track of the turning circle, the zigzag, and the validity in both, as SVG.

They are written here and not by a charting library, which takes longer to load than the manoeuvres to simulate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.simulation.run import Run
from tank2sim.units import rounded_up

_POINTS = 300
"""Most points of a line: a picture is hardly wider in pixels (project choice)."""

_WIDE, _HIGH, _LEFT, _BOTTOM, _TOP, _RIGHT = 420.0, 190.0, 62.0, 42.0, 24.0, 14.0
"""Size of the frame of a picture and of the room around it, px (project choice)."""

_COLOURS, _DASHES = ("#0072B2", "#D55E00"), ("", "6 3")

_PARTS = 5
"""Parts of an axis at least about so many: a label has room between two (project choice)."""


@dataclass(frozen=True, eq=False)
class PictureLine:
    """A line of a picture: its name, and the values across and up, (n,) each."""

    name: str
    across: Array
    up: Array


def passport_pictures(manoeuvres: Mapping[str, Run]) -> dict[str, str]:
    """Caption to SVG, of the manoeuvres that there are (``turn_35``, ``zigzag_20_20``); empty without any."""
    found = {}
    turn, zigzag = manoeuvres.get("turn_35"), manoeuvres.get("zigzag_20_20")
    if turn is not None:
        track = PictureLine("track", turn.trajectory["motion.y"], turn.trajectory["motion.x"])
        caption = "Track of the turning circle, to scale; north is the heading at the execute"
        found[caption] = picture([track], "y, east (m)", "x, north (m)", to_scale=True)
    if zigzag is not None:
        lines = [
            PictureLine(name, zigzag.trajectory.t, np.degrees(zigzag.trajectory[signal]))
            for name, signal in (("heading", "motion.psi"), ("rudder", "rudder.angle"))
        ]
        found["Heading and rudder angle in the zigzag, positive to starboard"] = picture(lines, "t (s)", "angle (deg)")
    with_validity = [
        PictureLine(name, run.trajectory.t, run.trajectory["validity"])
        for name, run in (("turn", turn), ("zigzag", zigzag))
        if run is not None and "validity" in run.trajectory.model.outputs
    ]
    if with_validity:
        caption = "Validity in both: 1 inside the range of the card, falling to 0 outside"
        found[caption] = picture(with_validity, "t (s)", "validity", least=(0.0, 1.0))
    return found


def picture(
    lines: Sequence[PictureLine],
    across_title: str,
    up_title: str,
    *,
    to_scale: bool = False,
    least: tuple[float, float] | None = None,
) -> str:
    """Lines in a frame with axes, as SVG.

    `lines`: two at most; with a legend if there are two. `to_scale`: a unit is as long across as up. `least`: values
    that the upward axis holds at least.

    Examples
    --------
    >>> svg = picture([PictureLine("a", np.array([0.0, 10.0]), np.array([1.0, 2.0]))], "t (s)", "value")
    >>> svg.count("<polyline"), ">10</text>" in svg
    (1, True)
    """
    x_low, x_high = _range([line.across for line in lines], None)
    y_low, y_high = _range([line.up for line in lines], least)
    wide, high = _WIDE, _HIGH
    if to_scale:
        high = 1.5 * _HIGH
        wide = high * (x_high - x_low) / (y_high - y_low)
        if wide > 1.5 * _WIDE:
            wide, high = 1.5 * _WIDE, high * 1.5 * _WIDE / wide
    right, bottom = _LEFT + wide, _TOP + high

    def x_of(value: float) -> float:
        return _LEFT + (value - x_low) / (x_high - x_low) * wide

    def y_of(value: float) -> float:
        return bottom - (value - y_low) / (y_high - y_low) * high

    parts = []
    for value in _ticks(x_low, x_high):
        x = x_of(value)
        parts.append(f'<path d="M{x:.1f} {_TOP:.1f}V{bottom:.1f}" stroke="#ddd"/>')
        parts.append(f'<text x="{x:.1f}" y="{bottom + 16:.1f}" text-anchor="middle">{_label(value)}</text>')
    for value in _ticks(y_low, y_high):
        y = y_of(value)
        parts.append(f'<path d="M{_LEFT:.1f} {y:.1f}H{right:.1f}" stroke="#ddd"/>')
        parts.append(f'<text x="{_LEFT - 6:.1f}" y="{y + 4:.1f}" text-anchor="end">{_label(value)}</text>')
    middle = (_TOP + bottom) / 2
    parts.append(
        f'<text x="{(_LEFT + right) / 2:.1f}" y="{bottom + 34:.1f}" text-anchor="middle">{across_title}</text>'
    )
    turned = f'transform="rotate(-90 14 {middle:.1f})"'
    parts.append(f'<text x="14" y="{middle:.1f}" text-anchor="middle" {turned}>{up_title}</text>')
    parts.append(f'<rect x="{_LEFT}" y="{_TOP}" width="{wide:.1f}" height="{high:.1f}" fill="none" stroke="#999"/>')
    for number, line in enumerate(lines):
        look = f'fill="none" stroke="{_COLOURS[number]}" stroke-width="2" stroke-dasharray="{_DASHES[number]}"'
        rows = np.unique(np.linspace(0, len(line.up) - 1, min(len(line.up), _POINTS)).astype(int))
        points = " ".join(f"{x_of(line.across[row]):.1f},{y_of(line.up[row]):.1f}" for row in rows)
        parts.append(f'<polyline points="{points}" {look}/>')
        if len(lines) > 1:
            at = _LEFT + 110.0 * number
            parts.append(f'<path d="M{at:.1f} 10h26" {look}/><text x="{at + 32:.1f}" y="14">{line.name}</text>')
    across, down = f"{right + _RIGHT:.0f}", f"{bottom + _BOTTOM:.0f}"
    size = f'width="{across}" height="{down}" viewBox="0 0 {across} {down}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-size="12" fill="#222" role="img">{"".join(parts)}</svg>'
    )


def _range(values: Sequence[Array], least: tuple[float, float] | None) -> tuple[float, float]:
    every = np.concatenate([*values, np.array(least or [])])
    low, high = float(np.min(every)), float(np.max(every))
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _ticks(low: float, high: float) -> list[float]:
    """Round values from `low` to `high`, 1, 2 or 5 times a power of ten apart."""
    step = rounded_up((high - low) / _PARTS)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [number * step for number in range(first, last + 1)]


def _label(value: float) -> str:
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
