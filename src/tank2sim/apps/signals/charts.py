"""Charts of measured signals: density, correlation, spectrum, yaw rate after rudder, what a filter does."""

from __future__ import annotations

from collections.abc import Sequence

import altair as alt
import numpy as np

from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    NUMBER,
    POINT_SAMPLES,
    Chart,
    ChartRecord,
    axis_above,
    data,
    every,
    pan_zoom,
    plain,
    records,
    series_look,
    stacked,
    with_unit,
)
from tank2sim.answer.charts.theme import BAND_OPACITY
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.filtering import FilterEffect
from tank2sim.records.signals.spectra import Spectrum, Transfer
from tank2sim.records.signals.statistics import Autocorrelation, Correlation, Density
from tank2sim.records.thinning import thin_line, thin_points

_SIZE_PX = (720, 300)
_LEAST_DECIBEL = -120.0
_PHASE = "phase (deg), below zero: later"


def density_chart(name: SignalName, density: Density, *, title: str = "") -> alt.LayerChart:
    """Probability density of a signal next to the normal one."""
    x = alt.X("x:Q", title=with_unit(name.words, name.unit), scale=alt.Scale(zero=False, nice=False))
    up = with_unit("probability density", f"1/({name.unit})")
    curves = {"estimated": density.density, "normal": density.normal}
    rows = [row for label, curve in curves.items() for row in records(label, {"x": density.values, "v": curve})]
    return _lines(rows, list(curves), x, alt.Y("v:Q", title=up), title)


def autocorrelation_chart(name: SignalName, found: Autocorrelation, *, title: str = "") -> alt.LayerChart:
    """Autocorrelation against the lag, the correlation time marked."""
    label = f"{name.words} with itself"
    rows = _thinned(label, found)
    chart = _correlation_layers(rows, label, marks_s=[found.correlation_time_s], levels=[0.0], title=title)
    return chart.properties(description=f"Autocorrelation of {name.words}; the upright line is the correlation time.")


def cross_correlation_chart(first: SignalName, second: SignalName, found: Correlation, *, title: str) -> alt.LayerChart:
    """Cross-correlation against the lag, with its largest value and the bound of two independent signals."""
    label = f"{second.words} after {first.words}"
    bound = found.bound_if_independent
    levels, marks = [-bound, 0.0, bound], [found.lag_of_largest_s]
    chart = _correlation_layers(_thinned(label, found), label, marks_s=marks, levels=levels, title=title)
    return chart.properties(description=f"Correlation of {second.words} with {first.words} against the lag.")


def spectrum_chart(name: SignalName, spectrum: Spectrum, *, title: str = "") -> alt.LayerChart:
    """Power spectral density with its 95 % confidence band, both axes logarithmic."""
    keys = {"x": "frequency_hz", "v": "density", "low": "low", "high": "high"}
    columns = {name: getattr(spectrum, key) for name, key in keys.items()}
    kept = thin_line([np.log10(np.maximum(columns["v"], np.finfo(float).tiny))], LINE_SAMPLES)
    label = name.words
    rows = records(label, {name: values[kept] for name, values in columns.items()})
    rows = [row for row in rows if row["low"]]  # what is exactly zero has no place on a logarithmic scale
    x = alt.X("x:Q", title="frequency (Hz)", scale=alt.Scale(type="log", nice=False), axis=alt.Axis(format="~g"))
    up = f"power density (({name.unit})²/Hz)"
    scale = alt.Scale(type="log")
    y = alt.Y("v:Q", title=up, scale=scale, axis=alt.Axis(format=".0e", tickCount=8))
    area = Chart(data(rows)).mark_area(opacity=BAND_OPACITY, clip=True)
    band = area.encode(x=x, y=alt.Y("low:Q", scale=scale), y2="high:Q", color=series_look([label]).colour)
    return _lines(rows, [label], x, y, title, below=[band]).properties(
        description=f"Power spectral density of {name.words} with its 95 % confidence band."
    )


def transfer_chart(source: SignalName, result: SignalName, transfer: Transfer, *, title: str = "") -> alt.VConcatChart:
    """Gain (1/s), phase and coherence against frequency; gain and phase with 95 % intervals, where coherence is
    above chance."""
    frequency, gain, phase, coherence_of = transfer.frequency_hz, transfer.gain, transfer.phase_rad, transfer.coherence
    sure = np.flatnonzero(transfer.sure)
    kept = sure[thin_points([np.log10(gain[sure]), phase[sure]], POINT_SAMPLES)]
    # A wider interval than a whole gain only stretches the axis.
    error = np.minimum(transfer.half_width_95[kept], 1.0)
    gain, phase, half = gain[kept], np.rad2deg(phase[kept]), np.rad2deg(error)
    label = f"{source.words} to {result.words}"
    gains = records(
        label, {"x": frequency[kept], "v": gain, "low": gain * np.exp(-error), "high": gain * np.exp(error)}
    )
    phases = records(label, {"x": frequency[kept], "v": phase, "low": phase - half, "high": phase + half})
    shown = thin_line([coherence_of], LINE_SAMPLES)
    coherence = records(label, {"x": frequency[shown], "v": coherence_of[shown]})
    span = [float(frequency[0]), float(frequency[-1])]
    panels = [
        _points_panel(gains, span, axis_above(with_unit("gain", "1/s"), format="~g"), alt.Scale(type="log")),
        _points_panel(phases, span, axis_above(_PHASE, values=[-180, -90, 0, 90, 180]), alt.Scale(domain=[-180, 180])),
        _coherence_panel(coherence, span, transfer.coherence_by_chance),
    ]
    return stacked(
        [panel.properties(width=_SIZE_PX[0], height=150) for panel in panels],
        title=title,
        description=f"Transfer function from {label}: gain and phase with 95 % intervals, and coherence.",
    )


def effect_chart(label: str, effect: FilterEffect, *, title: str = "") -> alt.VConcatChart:
    """Gain (dB), phase (deg) and group delay (s) of a filter against frequency."""
    frequency, gain, phase, delay = effect.frequency_hz, effect.gain, effect.phase_rad, effect.group_delay_s
    decibel = np.maximum(20.0 * np.log10(np.maximum(gain, 1e-30)), _LEAST_DECIBEL)
    # Where nothing passes, the phase is that of rounding.
    phase = np.where(decibel > _LEAST_DECIBEL, np.rad2deg(phase), np.nan)
    span = [float(frequency[0]), float(frequency[-1])]
    curves = {"gain (dB)": decibel, _PHASE: phase, "group delay (s)": delay}
    panels = []
    for place, (up, curve) in enumerate(curves.items()):
        rows = records(label, {"x": frequency, "v": curve})
        x = _frequency_axis(span, named=place == len(curves) - 1)
        y = alt.Y("v:Q", axis=axis_above(up), scale=alt.Scale(zero=False))
        panels.append(alt.layer(*_curve(rows, [label], x, y)).properties(width=_SIZE_PX[0], height=130))
    return stacked(panels, title=title, description=f"Gain, phase and group delay of {label}.")


def _thinned(label: str, correlation: Autocorrelation | Correlation) -> list[ChartRecord]:
    lag, coefficient = correlation.lag_s, correlation.coefficient
    kept = thin_line([coefficient], LINE_SAMPLES)
    return records(label, {"x": lag[kept], "v": coefficient[kept]})


def _correlation_layers(
    rows: list[ChartRecord], label: str, *, marks_s: Sequence[float], levels: Sequence[float], title: str
) -> alt.LayerChart:
    x = alt.X("x:Q", title="lag (s)", scale=alt.Scale(nice=False, zero=False))
    y = alt.Y("v:Q", title="correlation coefficient", scale=alt.Scale(domain=[-1, 1]))
    dashes = [2, 3]
    level_rows, mark_rows = [{"v": plain(level)} for level in levels], [{"x": plain(mark)} for mark in marks_s]
    rules = Chart(data(level_rows)).mark_rule(style="reference", strokeDash=dashes, clip=True).encode(y="v:Q")
    marks = Chart(data(mark_rows)).mark_rule(style="limit", strokeDash=dashes, clip=True).encode(x="x:Q")
    return _lines(rows, [label], x, y, title, below=[rules, marks])


def _lines(
    rows: list[ChartRecord], labels: Sequence[str], x: alt.X, y: alt.Y, title: str, below: Sequence[alt.Chart] = ()
) -> alt.LayerChart:
    curve, unseen = _curve(rows, labels, x, y)
    layers = [*below, curve.properties(name="plot"), unseen]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title,
        width=_SIZE_PX[0],
        height=_SIZE_PX[1],
        description=f"{_words(y)} against {_words(x)} of {', '.join(labels)}.",
    )


def _curve(rows: list[ChartRecord], labels: Sequence[str], x: alt.X, y: alt.Y) -> tuple[alt.Chart, alt.Chart]:
    """The lines of these series, and points that answer to the pointer."""
    look = series_look(labels)
    line = Chart(data(rows)).mark_line(clip=True)
    unseen = Chart(data(every(rows, 200))).mark_point(opacity=0, filled=True, size=110, clip=True)
    return (
        line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=_tooltip(_words(x), _words(y))),
    )


def _words(channel: alt.X | alt.Y) -> str:
    """Title of a channel, or of its axis; panels above the last have none across."""
    for owner in (channel, channel["axis"]):
        if owner is not alt.Undefined and isinstance(owner["title"], str):
            return str(owner["title"])
    return "frequency (Hz)"


def _tooltip(across: str, up: str) -> list[alt.Tooltip]:
    names = {"x:Q": across, "v:Q": up}
    shown = [alt.Tooltip(field, title=title, format=NUMBER) for field, title in names.items()]
    return [alt.Tooltip("run:N", title="series"), *shown]


def _frequency_axis(span: list[float], *, named: bool) -> alt.X:
    axis = alt.Axis(title="frequency (Hz)" if named else None, labels=named, ticks=named, format="~g")
    return alt.X("x:Q", scale=alt.Scale(type="log", domain=span, nice=False), axis=axis)


def _points_panel(rows: list[ChartRecord], span: list[float], axis: alt.Axis, scale: alt.Scale) -> alt.LayerChart:
    x, y = _frequency_axis(span, named=False), alt.Y("v:Q", axis=axis, scale=scale)
    # The rows of one panel are one series, the same in all panels.
    colour = series_look([row["run"] for row in rows[:1]]).colour
    base = Chart(data(rows)).encode(color=colour)
    intervals = base.mark_rule(style="stem", clip=True).encode(x=x, y=alt.Y("low:Q", scale=scale), y2="high:Q")
    points = base.mark_point(clip=True).encode(x=x, y=y, tooltip=_tooltip("frequency (Hz)", _words(y)))
    return alt.layer(points, intervals)


def _coherence_panel(rows: list[ChartRecord], span: list[float], significant: float) -> alt.LayerChart:
    x = _frequency_axis(span, named=True)
    y = alt.Y("v:Q", axis=axis_above("coherence; dotted: by chance"), scale=alt.Scale(domain=[0, 1]))
    line = Chart(data(rows)).mark_line(clip=True)
    line = line.encode(x=x, y=y, color=series_look([rows[0]["run"]]).colour, order="i:Q")
    level = Chart(data([{"v": plain(significant)}])).mark_rule(style="limit", strokeDash=[2, 3]).encode(y="v:Q")
    return alt.layer(line, level)
