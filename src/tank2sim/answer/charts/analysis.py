"""Charts of linear systems and of a check: Bode and Nyquist diagrams, poles and zeros, errors next to their limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.parts import equal_frame, extent, plain, series_look, vector
from tank2sim.answer.charts.theme import CROSS
from tank2sim.answer.charts.vega import (
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    bare_layer,
    channel,
    layer,
    layered,
    tooltips,
)

_FREQUENCY = PlotAxis("angular frequency (rad/s)", log=True, nice=False, form="~g")
_SHOWN = {"run:N": "system", "x:Q": "frequency (rad/s)"}

_HALF = 2.5
"""Half of the height of a Nyquist chart: what lies farther from the critical point endangers nothing (project
choice)."""


@dataclass(frozen=True)
class FrequencyResponse:
    """Response of one system: `omega_radps` (n,) in rad/s, above 0, and `response` (n,), complex."""

    label: str
    omega_radps: ArrayLike
    response: ArrayLike

    @property
    def decibel(self) -> NDArray[np.float64]:
        """Magnitude, dB."""
        found: NDArray[np.float64] = 20 * np.log10(np.abs(np.asarray(self.response, dtype=complex)))
        return found


@dataclass(frozen=True)
class PolesZeros:
    """Poles and zeros of one system, complex, 1/s."""

    label: str
    poles: ArrayLike
    zeros: ArrayLike = ()


@dataclass(frozen=True, kw_only=True)
class OutputError:
    """Largest error of one output in one kind of check (``FMI 2 CS``), and the limit it is held against.

    Both are relative, or both in the unit of the output.
    """

    kind: str
    output: str
    error: float
    limit: float

    @property
    def within(self) -> bool:
        """True if the error is a number not above the limit."""
        return self.error <= self.limit


def bode_chart(responses: Sequence[FrequencyResponse], *, title: str = "") -> ChartSpec:
    """Magnitude (dB) and phase (deg, unwrapped) against angular frequency (rad/s, logarithmic)."""
    phases = [np.rad2deg(np.unwrap(np.angle(np.asarray(one.response, dtype=complex)))) for one in responses]
    phase_axis = PlotAxis("phase (deg)", ticks=_phase_ticks(np.concatenate(phases)))
    plots = []
    for up, curves in ((PlotAxis("magnitude (dB)"), [one.decibel for one in responses]), (phase_axis, phases)):
        series = [PlotSeries(one.label, x=one.omega_radps, y=y) for one, y in zip(responses, curves, strict=True)]
        plots.append(Plot(series, up=up, height_px=200))
    names = ", ".join(response.label for response in responses)
    described = f"Bode diagram of {names}: magnitude and phase."
    return curve_panels(plots, _FREQUENCY, title=title, described=described, shown=_SHOWN)


def sensitivity_chart(responses: Sequence[FrequencyResponse], *, title: str = "") -> ChartSpec:
    """Magnitudes (dB) against angular frequency, logarithmic: S and T of a loop, at one speed or several."""
    series = []
    for one in responses:
        shown = one.decibel > -60
        series.append(PlotSeries(one.label, x=vector(one.omega_radps)[shown], y=one.decibel[shown]))
    plot = Plot(series, up=PlotAxis("magnitude (dB)"), rules=[Rule([0.0])])
    described = f"Magnitude over frequency of {', '.join(response.label for response in responses)}."
    shown_as = {**_SHOWN, "run:N": "function"}
    return curve_chart(plot, _FREQUENCY, title=title, window=["x"], described=described, shown=shown_as)


def nyquist_chart(loops: Sequence[FrequencyResponse], sensitivity_peak: float, *, title: str = "") -> ChartSpec:
    """Nyquist curves near the critical point (cross), with the circle of radius 1/Ms that the first one touches.

    `loops`: loop transfer L; 1 + L is what feedback divides by; `sensitivity_peak`: Ms of the first.
    """
    series = []
    for loop in loops:
        value = np.asarray(loop.response, dtype=complex)
        near = np.abs(value + 1) < 3 * _HALF
        value, omega = value[near], vector(loop.omega_radps)[near]
        series.append(PlotSeries(loop.label, x=value.real, y=value.imag, closed=True, more={"w": omega}))
    across = PlotAxis("real part of L (-)", domain=(-1 - _HALF, -1 + _HALF), nice=False, ticks=6)
    up = PlotAxis("imaginary part of L (-)", domain=(-_HALF, _HALF), nice=False, ticks=6)
    turn = np.linspace(0, 2 * math.pi, 121)
    circle = PlotSeries("", x=-1 + np.cos(turn) / sensitivity_peak, y=np.sin(turn) / sensitivity_peak, closed=True).rows
    place = {"x": across.channel("x"), "y": up.channel("v")}
    over = [
        layer("line", circle, {**place, "order": "i:Q"}, style="limit", clip=True, strokeWidth=1.2),
        layer("point", [{"x": -1.0, "v": 0.0}], place, style="limit", shape=CROSS, size=90, strokeWidth=2, clip=True),
    ]
    return curve_chart(
        Plot(series, up=up, height_px=460, rules=[Rule([0.0], upright=True), Rule([0.0])], over=over),
        across,
        title=title,
        width_px=460,
        described=f"Nyquist curves of {', '.join(loop.label for loop in loops)} near -1.",
        usermeta={"equal_scales": True},
        shown={"run:N": "loop", "w:Q": "frequency (rad/s)", "x:Q": "real part", "v:Q": "imaginary part"},
    )


def pole_zero_chart(systems: Sequence[PolesZeros], *, title: str = "") -> ChartSpec:
    """Poles (crosses) and zeros (circles) in the complex plane, both axes in one scale, the unstable half tinted."""
    rows = [row for system in systems for row in _pole_zero_rows(system)]
    real, imaginary = (np.array([row[key] for row in rows] + [0.0]) for key in ("re", "im"))
    frame = equal_frame(real, np.concatenate([imaginary, -imaginary]), width_px=560, height_px=420)
    place = frame.axes(across=("re", "real part (1/s)"), up=("im", "imaginary part (1/s)"))
    names = [system.label for system in systems]
    kinds = {"scale": {"domain": ["pole", "zero"], "range": [CROSS, "circle"]}, "legend": {}}
    marks = place | {"color": series_look(names, as_points=names).colour, "shape": channel("kind:N", **kinds)}
    marks["tooltip"] = tooltips({"run:N": "system", "kind:N": "kind", **_POLE_TOOLTIP})
    edge = {"value": frame.width_px}
    return layered(
        [
            layer("rect", [{"re": 0.0}], {"x": place["x"], "x2": edge}, style="region", clip=True),
            Rule([0.0], upright=True).layer(place["x"]),
            Rule([0.0]).layer(place["y"]),
            layer("point", rows, marks, size=110, strokeWidth=2, clip=True),
        ],
        size=(frame.width_px, frame.height_px),
        window=["x", "y"],
        title=title,
        description=f"Poles and zeros in the complex plane of {', '.join(names)}.",
        usermeta={"equal_scales": True},
    )


def error_chart(errors: Sequence[OutputError], *, title: str = "") -> ChartSpec:
    """Largest error of every output on a logarithmic scale next to its limit, one panel a kind of check.

    An error of exactly 0 (or one that is not finite) has no place on a logarithmic scale: it is drawn at the left
    (right) edge, and its tooltip says what it is.
    """
    kinds = list(dict.fromkeys(error.kind for error in errors))
    outputs = list(dict.fromkeys(error.output for error in errors))
    sizes = [size for error in errors for size in (error.error, error.limit) if math.isfinite(size) and size > 0]
    low, high = 10.0 ** math.floor(math.log10(min(sizes)) - 0.01), 10.0 ** math.ceil(math.log10(max(sizes)) + 0.01)
    decades = round(math.log10(high / low))
    powers = [float(f"{low * 10.0**power:.6g}") for power in range(0, decades + 1, 1 + decades // 5)]
    across = PlotAxis("largest error (line: limit)", log=True, domain=(low, high), nice=False, ticks=powers, form=".0e")
    y = channel("output:N", title=None, sort=outputs, axis={"grid": True, "labelLimit": 220})
    verdict = channel("verdict:N", scale={"domain": _VERDICTS})
    shape = channel("verdict:N", scale={"domain": _VERDICTS, "range": ["circle", CROSS]})
    shown: dict[str, str | tuple[str, str]] = {
        "kind:N": "check",
        "output:N": "output",
        "error:N": "largest error",
        "limit:Q": ("limit", ".2~e"),
    }
    point = {"x": across.channel("e"), "y": y, "color": verdict, "shape": shape}
    tick = {"orient": "vertical", "height": {"band": 1.0}, "thickness": 2}
    panel = [
        bare_layer("rule", {"x": across.channel("e"), "x2": {"value": 0}, "y": y, "color": verdict}, style="stem"),
        bare_layer("tick", {"x": across.channel("limit"), "y": y}, style="limit", **tick),
        bare_layer("point", {**point, "tooltip": tooltips(shown)}, size=70, strokeWidth=2),
    ]
    exceeded = sorted({error.output for error in errors if not error.within})
    over = f"Above the limit: {', '.join(exceeded)}." if exceeded else "All are within their limits."
    return {
        "data": {"values": [_error_row(error, low, high) for error in errors]},
        "facet": channel("kind:N", sort=kinds, header={"title": None, "labelAnchor": "start"}),
        "columns": len(kinds),
        "spacing": 20,
        "spec": {"layer": panel, "width": max(110, 720 // len(kinds) - 20), "height": {"step": 19}},
        "title": title,
        "description": f"Largest error of {len(outputs)} outputs in {', '.join(kinds)}. {over}",
    }


_VERDICTS = ["within the limit", "above the limit"]

_POLE_TOOLTIP = {
    "re:Q": "real part (1/s)",
    "im:Q": "imaginary part (1/s)",
    "wn:Q": "natural frequency (rad/s)",
    "zeta:Q": "damping ratio",
}


def _phase_ticks(phase: NDArray[np.float64]) -> list[float]:
    # Engineers read phase in parts of a right angle, which no automatic ticks give.
    low, high = extent(phase)
    step = next((step for step in (5, 15, 30, 45, 90) if high - low <= 7 * step), 180)
    return [float(tick) for tick in range(step * math.floor(low / step), step * math.ceil(high / step) + 1, step)]


def _pole_zero_rows(system: PolesZeros) -> list[ChartRecord]:
    rows = []
    for kind, places in (("pole", system.poles), ("zero", system.zeros)):
        values: NDArray[np.complex128] = np.atleast_1d(np.asarray(places, dtype=complex))
        for value in values:
            natural = abs(value)
            rows.append(
                {"run": system.label, "kind": kind, "re": plain(value.real), "im": plain(value.imag)}
                | {"wn": plain(natural), "zeta": plain(-value.real / natural) if natural > 0 else None}
            )
    return rows


def _error_row(error: OutputError, low: float, high: float) -> ChartRecord:
    drawn = min(max(error.error, low), high) if math.isfinite(error.error) else high
    return {
        "kind": error.kind,
        "output": error.output,
        "e": plain(drawn),
        "limit": plain(error.limit),
        "error": "0 (exactly)" if error.error == 0 else f"{error.error:.2e}",
        "verdict": _VERDICTS[0 if error.within else 1],
    }
