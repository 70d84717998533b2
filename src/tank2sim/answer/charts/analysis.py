"""Charts of what was worked out: frequency responses, poles and zeros, the errors of a check."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    NUMBER,
    Chart,
    ChartRecord,
    SeriesLook,
    axis_above,
    data,
    equal_frame,
    every,
    extent,
    pan_zoom,
    plain,
    records,
    series_look,
    stacked,
    vector,
)
from tank2sim.answer.charts.theme import CROSS
from tank2sim.records.thinning import thin_line


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse:
    """Response of one system: `omega_radps` (n,) in rad/s, above 0, and `response` (n,), complex."""

    label: str
    omega_radps: ArrayLike
    response: ArrayLike


@dataclass(frozen=True, kw_only=True)
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


def bode_chart(
    responses: Sequence[FrequencyResponse], *, title: str = "", width_px: int = 720, height_px: int = 200
) -> alt.VConcatChart:
    """Magnitude (dB) and phase (deg, unwrapped) against angular frequency (rad/s, logarithmic); sizes of one panel."""
    look = series_look([response.label for response in responses])
    magnitude: list[ChartRecord] = []
    phase: list[ChartRecord] = []
    for response in responses:
        omega, value = vector(response.omega_radps), np.asarray(response.response, dtype=complex)
        decibel, degree = 20 * np.log10(np.abs(value)), np.rad2deg(np.unwrap(np.angle(value)))
        kept = thin_line([decibel, degree], LINE_SAMPLES)
        magnitude += records(response.label, {"w": omega[kept], "v": decibel[kept]})
        phase += records(response.label, {"w": omega[kept], "v": degree[kept]})
    panels = [
        _bode_panel(magnitude, look, axis_above("magnitude (dB)"), None),
        _bode_panel(phase, look, axis_above("phase (deg)", values=_phase_ticks(phase)), "angular frequency (rad/s)"),
    ]
    names = ", ".join(response.label for response in responses)
    return stacked(
        [panel.properties(width=width_px, height=height_px) for panel in panels],
        title=title,
        description=f"Bode diagram of {names}: magnitude and phase.",
    )


def pole_zero_chart(
    systems: Sequence[PolesZeros], *, title: str = "", width_px: int = 560, height_px: int = 420
) -> alt.LayerChart:
    """Poles (crosses) and zeros (circles) in the complex plane, both axes in one scale, the unstable half tinted."""
    rows = [row for system in systems for row in _pole_zero_rows(system)]
    real, imaginary = (np.array([row[key] for row in rows] + [0.0]) for key in ("re", "im"))
    frame = equal_frame(real, np.concatenate([imaginary, -imaginary]), width_px=width_px, height_px=height_px)
    position = frame.axes(across=("re:Q", "real part (1/s)"), up=("im:Q", "imaginary part (1/s)"))
    x, y = position["x"], position["y"]
    look = series_look([system.label for system in systems], as_points=[system.label for system in systems])
    kind = alt.Shape("kind:N", scale=alt.Scale(domain=["pole", "zero"], range=[CROSS, "circle"]), legend=alt.Legend())
    tooltip = [
        alt.Tooltip("run:N", title="system"),
        alt.Tooltip("kind:N", title="kind"),
        *(alt.Tooltip(f"{key}:Q", title=name, format=NUMBER) for key, name in _POLE_TOOLTIP.items()),
    ]
    edge = alt.value(frame.width_px)
    unstable = Chart(data([{"re": 0.0}])).mark_rect(style="region", clip=True).encode(x=x, x2=edge)
    axes = [
        Chart(data([{"re": 0.0}])).mark_rule(style="reference", clip=True).encode(x=x),
        Chart(data([{"im": 0.0}])).mark_rule(style="reference", clip=True).encode(y=y),
    ]
    points = (
        Chart(data(rows))
        .mark_point(size=110, strokeWidth=2, clip=True)
        .encode(x=x, y=y, color=look.colour, shape=kind, tooltip=tooltip)
    )
    layers = [unstable, *axes, points.properties(name="plot")]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title,
        width=frame.width_px,
        height=frame.height_px,
        description="Poles and zeros in the complex plane of " + ", ".join(system.label for system in systems) + ".",
        usermeta={"equal_scales": True},
    )


def error_chart(errors: Sequence[OutputError], *, title: str = "", width_px: int = 720) -> alt.FacetChart:
    """Largest error of every output on a logarithmic scale next to its limit, one panel a kind of check.

    An error of exactly 0 (or one that is not finite) has no place on a logarithmic scale: it is drawn at the left
    (right) edge, and its tooltip says what it is.
    """
    kinds = list(dict.fromkeys(error.kind for error in errors))
    outputs = list(dict.fromkeys(error.output for error in errors))
    sizes = [size for error in errors for size in (error.error, error.limit) if math.isfinite(size) and size > 0]
    low, high = 10.0 ** math.floor(math.log10(min(sizes)) - 0.01), 10.0 ** math.ceil(math.log10(max(sizes)) + 0.01)
    rows = [_error_row(error, low, high) for error in errors]
    decades = round(math.log10(high / low))
    powers = [plain(low * 10.0**power) for power in range(0, decades + 1, 1 + decades // 5)]
    scale = alt.Scale(type="log", domain=[low, high], nice=False)
    x = alt.X("e:Q", title="largest error (line: limit)", scale=scale, axis=alt.Axis(values=powers, format=".0e"))
    y = alt.Y("output:N", title=None, sort=outputs, axis=alt.Axis(grid=True, labelLimit=220))
    verdict = alt.Color("verdict:N", scale=alt.Scale(domain=_VERDICTS))
    shape = alt.Shape("verdict:N", scale=alt.Scale(domain=_VERDICTS, range=["circle", CROSS]))
    tooltip = [
        alt.Tooltip("kind:N", title="check"),
        alt.Tooltip("output:N", title="output"),
        alt.Tooltip("error:N", title="largest error"),
        alt.Tooltip("limit:Q", title="limit", format=".2~e"),
    ]
    base = Chart().encode(y=y)
    stem = base.mark_rule(style="stem").encode(x=x, x2=alt.value(0), color=verdict)
    point = base.mark_point(size=70, strokeWidth=2).encode(x=x, color=verdict, shape=shape, tooltip=tooltip)
    limit = base.mark_tick(style="limit", orient="vertical", height=alt.RelativeBandSize(1.0), thickness=2)
    limit = limit.encode(x="limit:Q")
    exceeded = sorted({error.output for error in errors if not error.within})
    panels = alt.layer(stem, limit, point).properties(width=max(110, width_px // len(kinds) - 20), height=alt.Step(19))
    header = alt.Header(title=None, labelAnchor="start")
    facet = alt.Facet("kind:N", sort=kinds, header=header)
    return panels.facet(facet, data=data(rows), columns=len(kinds), spacing=20).properties(
        title=title,
        description=f"Largest error of {len(outputs)} outputs in {', '.join(kinds)}. "
        + (f"Above the limit: {', '.join(exceeded)}." if exceeded else "All are within their limits."),
    )


_VERDICTS = ["within the limit", "above the limit"]

_POLE_TOOLTIP = {
    "re": "real part (1/s)",
    "im": "imaginary part (1/s)",
    "wn": "natural frequency (rad/s)",
    "zeta": "damping ratio",
}


def _bode_panel(rows: list[ChartRecord], look: SeriesLook, y: alt.Axis, frequency: str | None) -> alt.LayerChart:
    shown = frequency is not None
    position = {
        "x": alt.X(
            "w:Q",
            scale=alt.Scale(type="log", nice=False),
            axis=alt.Axis(title=frequency, labels=shown, ticks=shown, format="~g"),
        ),
        "y": alt.Y("v:Q", axis=y, scale=alt.Scale(zero=False)),
    }
    tooltip = [
        alt.Tooltip("run:N", title="system"),
        alt.Tooltip("w:Q", title="frequency (rad/s)", format=NUMBER),
        alt.Tooltip("v:Q", title=y.title, format=NUMBER),
    ]
    line = Chart(data(rows)).mark_line(clip=True)
    unseen = Chart(data(every(rows, 200))).mark_point(opacity=0, filled=True, size=110, clip=True)
    return alt.layer(
        line.encode(**position, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(**position, tooltip=tooltip),
    )


def _phase_ticks(rows: list[ChartRecord]) -> list[float]:
    # Engineers read phase in parts of a right angle, which no automatic ticks give.
    low, high = extent(np.array([row["v"] for row in rows], dtype=float))
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
