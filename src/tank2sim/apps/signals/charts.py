"""Charts of measured signals: density, correlation, spectrum, yaw rate after rudder, what a filter does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.parts import LINE_SAMPLES, POINT_SAMPLES, with_unit
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis, Rule
from tank2sim.arrays import Array
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.filtering import FilterEffect
from tank2sim.records.signals.spectra import Spectrum, Transfer
from tank2sim.records.signals.statistics import Autocorrelation, Correlation, Density
from tank2sim.records.thinning import thin_line, thin_points

_LEAST_DECIBEL = -120.0
_PHASE = "phase (deg), below zero: later"
_DOTTED = (2, 3)


def density_chart(name: SignalName, density: Density, *, title: str = "") -> ChartSpec:
    """Probability density of a signal next to the normal one."""
    curves = {"estimated": density.density, "normal": density.normal}
    series = [PlotSeries(label=label, x=density.values, y=curve) for label, curve in curves.items()]
    up = PlotAxis(title=with_unit("probability density", f"1/({name.unit})"), zero=True)
    return curve_chart(
        Plot(series=series, up=up), PlotAxis(title=with_unit(name.words, name.unit), nice=False), title=title
    )


def autocorrelation_chart(name: SignalName, found: Autocorrelation, *, title: str = "") -> ChartSpec:
    """Autocorrelation against the lag, the correlation time marked."""
    described = f"Autocorrelation of {name.words}; the upright line is the correlation time."
    return _correlation(found, f"{name.words} with itself", [0.0], found.correlation_time_s, title, described)


def cross_correlation_chart(first: SignalName, second: SignalName, found: Correlation, *, title: str) -> ChartSpec:
    """Cross-correlation against the lag, with its largest value and the bound of two independent signals."""
    bound = found.bound_if_independent
    described = f"Correlation of {second.words} with {first.words} against the lag."
    label = f"{second.words} after {first.words}"
    return _correlation(found, label, [-bound, 0.0, bound], found.lag_of_largest_s, title, described)


def _correlation(
    found: Autocorrelation | Correlation, label: str, levels: Sequence[float], mark_s: float, title: str, described: str
) -> ChartSpec:
    rules = [
        Rule(at=levels, dash=_DOTTED),
        Rule(at=[mark_s], upright=True, style="limit", dash=_DOTTED),
    ]
    series = [PlotSeries(label=label, x=found.lag_s, y=found.coefficient)]
    up = PlotAxis(title="correlation coefficient", domain=(-1.0, 1.0))
    across = PlotAxis(title="lag (s)", nice=False)
    return curve_chart(Plot(series=series, up=up, rules=rules), across, title=title, described=described)


def spectrum_chart(name: SignalName, spectrum: Spectrum, *, title: str = "") -> ChartSpec:
    """Power spectral density with its 95 % confidence band, both axes logarithmic."""
    kept = thin_line([np.log10(np.maximum(spectrum.density, np.finfo(float).tiny))], LINE_SAMPLES)
    kept = kept[spectrum.low[kept] > 0]  # what is exactly zero has no place on a logarithmic scale
    series = PlotSeries(
        label=name.words,
        x=spectrum.frequency_hz[kept],
        y=spectrum.density[kept],
        low=spectrum.low[kept],
        high=spectrum.high[kept],
    )
    up = PlotAxis(title=f"power density (({name.unit})²/Hz)", log=True, form=".0e", ticks=8)
    return curve_chart(
        Plot(series=[series], up=up),
        PlotAxis(title="frequency (Hz)", log=True, nice=False, form="~g"),
        title=title,
        described=f"Power spectral density of {name.words} with its 95 % confidence band.",
    )


def transfer_chart(source: SignalName, result: SignalName, transfer: Transfer, *, title: str = "") -> ChartSpec:
    """Gain (1/s), phase and coherence against frequency; gain and phase with 95 % intervals, where coherence is
    above chance."""
    frequency, gain, phase, coherence = transfer.frequency_hz, transfer.gain, transfer.phase_rad, transfer.coherence
    sure = np.flatnonzero(transfer.sure)
    kept = sure[thin_points([np.log10(gain[sure]), phase[sure]], POINT_SAMPLES)]
    # A wider interval than a whole gain only stretches the axis.
    error = np.minimum(transfer.half_width_95[kept], 1.0)
    gain, phase, half = gain[kept], np.rad2deg(phase[kept]), np.rad2deg(error)
    label = f"{source.words} to {result.words}"

    def points(values: Array, low: Array, high: Array) -> list[PlotSeries]:
        return [PlotSeries(label=label, x=frequency[kept], y=values, low=low, high=high, points=True)]

    plots = [
        Plot(
            series=points(gain, gain * np.exp(-error), gain * np.exp(error)),
            up=PlotAxis(title=with_unit("gain", "1/s"), log=True, form="~g"),
            height_px=150,
        ),
        Plot(
            series=points(phase, phase - half, phase + half),
            up=PlotAxis(title=_PHASE, domain=(-180.0, 180.0), ticks=[-180, -90, 0, 90, 180]),
            height_px=150,
        ),
        Plot(
            series=[PlotSeries(label=label, x=frequency, y=coherence)],
            up=PlotAxis(title="coherence; dotted: by chance", domain=(0.0, 1.0)),
            height_px=150,
            rules=[Rule(at=[transfer.coherence_by_chance], style="limit", dash=_DOTTED)],
        ),
    ]
    described = f"Transfer function from {label}: gain and phase with 95 % intervals, and coherence."
    return curve_panels(plots, _frequency(frequency), title=title, described=described)


def effect_chart(label: str, effect: FilterEffect, *, title: str = "") -> ChartSpec:
    """Gain (dB), phase (deg) and group delay (s) of a filter against frequency."""
    frequency, gain, phase, delay = effect.frequency_hz, effect.gain, effect.phase_rad, effect.group_delay_s
    decibel = np.maximum(20.0 * np.log10(np.maximum(gain, 1e-30)), _LEAST_DECIBEL)
    # Where nothing passes, the phase is that of rounding.
    phase = np.where(decibel > _LEAST_DECIBEL, np.rad2deg(phase), np.nan)
    plots = [
        Plot(series=[PlotSeries(label=label, x=frequency, y=curve)], up=PlotAxis(title=up), height_px=130)
        for up, curve in {"gain (dB)": decibel, _PHASE: phase, "group delay (s)": delay}.items()
    ]
    described = f"Gain, phase and group delay of {label}."
    return curve_panels(plots, _frequency(frequency), title=title, described=described)


def _frequency(values: Array) -> PlotAxis:
    span = float(values[0]), float(values[-1])
    return PlotAxis(title="frequency (Hz)", log=True, domain=span, nice=False, form="~g")
