"""Charts of a control loop: its Nyquist curve near the critical point, sensitivities, cross-track errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.analysis import FrequencyResponse
from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    NUMBER,
    Chart,
    data,
    every,
    pan_zoom,
    records,
    series_look,
    vector,
)
from tank2sim.answer.charts.theme import CROSS
from tank2sim.records.thinning import thin_line

_HALF = 2.5
"""Half of the height of a Nyquist chart: what lies farther from the critical point endangers nothing (project
choice)."""

_NYQUIST_TOOLTIP = [
    alt.Tooltip("run:N", title="loop"),
    alt.Tooltip("w:Q", title="frequency (rad/s)", format=NUMBER),
    alt.Tooltip("re:Q", title="real part", format=NUMBER),
    alt.Tooltip("im:Q", title="imaginary part", format=NUMBER),
]


def nyquist_chart(
    loops: Sequence[FrequencyResponse], sensitivity_peak: float, *, title: str = "", size_px: int = 460
) -> alt.LayerChart:
    """Nyquist curves near the critical point (cross), with the circle of radius 1/Ms that the first one touches.

    Parameters
    ----------
    loops : sequence of FrequencyResponse
        Loop transfer L; 1 + L is what feedback divides by.
    sensitivity_peak : float
        Ms of the first.
    """
    look = series_look([loop.label for loop in loops])
    rows = []
    for loop in loops:
        value = np.asarray(loop.response, dtype=complex)
        near = np.abs(value + 1) < 3 * _HALF
        value, omega = value[near], vector(loop.omega_radps)[near]
        kept = thin_line([value.real, value.imag], LINE_SAMPLES)
        rows += records(loop.label, {"re": value.real[kept], "im": value.imag[kept], "w": omega[kept]})
    x = _axis("re:Q", "real part of L (-)", (-1 - _HALF, -1 + _HALF))
    y = _axis("im:Q", "imaginary part of L (-)", (-_HALF, _HALF))
    turn = np.linspace(0, 2 * math.pi, 121)
    circle = records("", {"re": -1 + np.cos(turn) / sensitivity_peak, "im": np.sin(turn) / sensitivity_peak})
    zero = [
        Chart(data([{key: 0.0}])).mark_rule(style="reference", clip=True).encode(**{axis: scale})
        for key, axis, scale in (("re", "x", x), ("im", "y", y))
    ]
    lines = Chart(data(rows), name="plot").mark_line(clip=True)
    unseen = Chart(data(every(rows, 300))).mark_point(opacity=0, filled=True, size=110, clip=True)
    critical = Chart(data([{"re": -1.0, "im": 0.0}])).mark_point(
        style="limit", shape=CROSS, size=90, strokeWidth=2, clip=True
    )
    layers = [
        *zero,
        Chart(data(circle)).mark_line(style="limit", clip=True, strokeWidth=1.2).encode(x=x, y=y, order="i:Q"),
        lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=_NYQUIST_TOOLTIP),
        critical.encode(x=x, y=y),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title,
        width=size_px,
        height=size_px,
        description=f"Nyquist curves of {', '.join(loop.label for loop in loops)} near -1.",
        usermeta={"equal_scales": True},
    )


def sensitivity_chart(
    responses: Sequence[FrequencyResponse], *, title: str = "", width_px: int = 720, height_px: int = 300
) -> alt.LayerChart:
    """Magnitudes (dB) against angular frequency, logarithmic: S and T of a loop, at one speed or several."""
    look = series_look([response.label for response in responses])
    rows = []
    for response in responses:
        omega = vector(response.omega_radps)
        decibel = 20 * np.log10(np.abs(np.asarray(response.response, dtype=complex)))
        shown = decibel > -60
        kept = thin_line([decibel[shown]], LINE_SAMPLES)
        rows += records(response.label, {"w": omega[shown][kept], "v": decibel[shown][kept]})
    x = alt.X(
        "w:Q", title="angular frequency (rad/s)", scale=alt.Scale(type="log", nice=False), axis=alt.Axis(format="~g")
    )
    y = alt.Y("v:Q", title="magnitude (dB)", scale=alt.Scale(zero=False))
    tooltip = [
        alt.Tooltip("run:N", title="function"),
        alt.Tooltip("w:Q", title="frequency (rad/s)", format=NUMBER),
        alt.Tooltip("v:Q", title="magnitude (dB)", format=NUMBER),
    ]
    zero = Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(y="v:Q")
    lines = Chart(data(rows), name="plot").mark_line(clip=True)
    unseen = Chart(data(every(rows, 300))).mark_point(opacity=0, filled=True, size=110, clip=True)
    layers = [
        zero,
        lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=tooltip),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", views=["plot"])]).properties(
        title=title,
        width=width_px,
        height=height_px,
        description=f"Magnitude over frequency of {', '.join(response.label for response in responses)}.",
    )


@dataclass(frozen=True, kw_only=True)
class CrossTrack:
    """Cross-track error of one run: `time_s` (n,) and `error_m` (n,), positive to starboard of the track."""

    label: str
    time_s: ArrayLike
    error_m: ArrayLike


def cross_track_chart(
    runs: Sequence[CrossTrack], *, title: str = "", width_px: int = 720, height_px: int = 220
) -> alt.LayerChart:
    """Cross-track errors over time."""
    look = series_look([run.label for run in runs])
    rows = []
    for run in runs:
        time, error = vector(run.time_s), vector(run.error_m)
        kept = thin_line([error], LINE_SAMPLES)
        rows += records(run.label, {"t": time[kept], "v": error[kept]})
    x = alt.X("t:Q", title="time (s)", scale=alt.Scale(nice=False))
    y = alt.Y("v:Q", title="cross-track error (m)")
    zero = Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(y="v:Q")
    lines = Chart(data(rows), name="plot").mark_line(clip=True)
    layers = [zero, lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q")]
    return alt.layer(*layers, params=[pan_zoom("x", views=["plot"])]).properties(
        title=title,
        width=width_px,
        height=height_px,
        description=f"Cross-track error over time of {', '.join(run.label for run in runs)}.",
    )


def _axis(field: str, title: str, domain: tuple[float, float]) -> alt.X | alt.Y:
    scale = alt.Scale(domain=list(domain), nice=False, zero=False)
    kind = alt.X if field.startswith("re") else alt.Y
    return kind(field, title=title, scale=scale, axis=alt.Axis(tickCount=6))
