"""Charts of tows: speeds with fits and residuals, drag coefficients, joint regions of M and B3, models by AIC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import (
    NUMBER,
    STACKS,
    Chart,
    ChartRecord,
    data,
    pan_zoom,
    plain,
    records,
    series_look,
)
from tank2sim.apps.rigs.tow.model_selection import FittedModel, TowByTow
from tank2sim.apps.rigs.tow.study import Ellipse, TowSpeeds
from tank2sim.apps.rigs.tow.theory import DragPolynomial, TowedBody
from tank2sim.arrays import Array

_SPEEDS = (
    Signal(name="speed", title="speed", unit="m/s"),
    Signal(name="left", title="less the model", unit="m/s"),
)


def tow_speed_chart(speeds: TowSpeeds, *, title: str = "") -> alt.VConcatChart:
    """Readings as points and simulated speeds as lines; below, all of them less the first simulation.

    Parameters
    ----------
    speeds : TowSpeeds
        With at least one simulation.
    """
    time, simulated = speeds.t_s, speeds.simulated_mps
    reference = next(iter(simulated.values()))
    at_readings = np.interp(time, speeds.simulated_t_s, reference)
    runs = []
    for label, speed in speeds.measured_mps.items():
        signals = {"speed": speed, "left": speed - at_readings}
        runs.append(History(label=label, time_s=time, values=signals, measured=True))
    for name, speed in simulated.items():
        runs.append(
            History(label=name, time_s=speeds.simulated_t_s, values={"speed": speed, "left": speed - reference})
        )
    return history_chart(runs, _SPEEDS, title=title, height_px=230)


def drag_chart(drags: Mapping[str, DragPolynomial], body: TowedBody, top_speed_mps: float) -> alt.HConcatChart:
    """C referred to L^2 against speed, and C referred to V^(2/3) against Reynolds number."""
    speeds = np.linspace(0.0, top_speed_mps, 121)
    look = series_look(list(drags))
    rows = [
        row
        for name, drag in drags.items()
        for row in records(
            name,
            {
                "v": speeds,
                "re": body.reynolds(speeds),
                "c": drag.at(speeds),
                "cv": drag.times(body.area_ratio).at(speeds),
            },
        )
    ]
    tooltip = [
        alt.Tooltip("run:N", title="by"),
        alt.Tooltip("v:Q", title="v (m/s)", format=NUMBER),
        alt.Tooltip("re:Q", title="Re", format=",.3~s"),
        alt.Tooltip("c:Q", title="C by L²", format=NUMBER),
        alt.Tooltip("cv:Q", title="C by V^(2/3)", format=NUMBER),
    ]
    panels = []
    factors = {"c:Q": 1.0, "cv:Q": body.area_ratio}
    for across, words, up, name in (
        ("v:Q", "speed (m/s)", "c:Q", "C referred to L²"),
        ("re:Q", "Reynolds number v L / ν", "cv:Q", "C referred to V^(2/3)"),
    ):
        axis = alt.Axis(format="~s") if across == "re:Q" else alt.Axis()
        x = alt.X(across, title=words, axis=axis, scale=alt.Scale(nice=False))
        y = alt.Y(up, title=name, scale=alt.Scale(domain=_frame(drags, speeds, factors[up]), nice=True))
        zero = Chart(data([{"zero": 0.0}])).mark_rule(style="reference").encode(y="zero:Q")
        base = Chart(data(rows)).encode(x=x, y=y, color=look.colour, order="i:Q")
        line = base.mark_line(clip=True).encode(strokeDash=look.dash)
        hover = base.mark_point(opacity=0, filled=True, size=110, clip=True).encode(tooltip=tooltip)
        panels.append(alt.layer(zero, line, hover).properties(width=330, height=300))
    return alt.hconcat(*panels, spacing=28).properties(
        title="Drag coefficient",
        description="Drag coefficient referred to length squared over speed, and to volume over Reynolds number.",
        usermeta=STACKS,
    )


def _frame(drags: Mapping[str, DragPolynomial], speeds: Array, factor: float) -> list[float]:
    """From a little below 0 to above the highest C of the curves that stay above zero; of all, if none does."""
    curves = [drag.times(factor).at(speeds) for drag in drags.values()]
    kept = [curve for curve in curves if curve.min() >= 0] or curves
    low, high = min(0.0, *(float(curve.min()) for curve in kept)), max(float(curve.max()) for curve in kept)
    margin = 0.08 * (high - low)
    return [low - margin, high + margin]


def ellipse_chart(
    ellipses: Sequence[Ellipse], by_tow: Mapping[str, TowByTow], *, width_px: int = 620
) -> alt.LayerChart:
    """Joint 95 % regions of M and B3 from all tows, and each tow by itself as a point."""
    lines: list[ChartRecord] = []
    points: list[ChartRecord] = []
    for ellipse in ellipses:
        lines += records(f"95 %: {ellipse.label}", {"m": ellipse.mass_kg, "b": ellipse.B3_kgpm})
    for name, way in by_tow.items():
        if way.unknowns[:2] == ("M", "B3") and name.startswith("output error"):
            for number, row in enumerate(way.alone, start=1):
                if np.isfinite(row[:2]).all():
                    label = f"each tow: {', '.join(way.unknowns)}"
                    points.append({"run": label, "m": plain(row[0]), "b": plain(row[1]), "tow": number})
    labels = [f"95 %: {ellipse.label}" for ellipse in ellipses]
    dots = list(dict.fromkeys(str(row["run"]) for row in points))
    look = series_look([*labels, *dots], as_points=dots)
    x = alt.X("m:Q", title="M (kg)", scale=alt.Scale(zero=False))
    y = alt.Y("b:Q", title="B3 (kg/m)", scale=alt.Scale(zero=False))
    outline = Chart(data(lines)).mark_line(clip=True)
    layers = [outline.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")]
    tooltip = [
        alt.Tooltip("run:N", title="of"),
        alt.Tooltip("tow:O", title="tow"),
        alt.Tooltip("m:Q", title="M (kg)", format=NUMBER),
        alt.Tooltip("b:Q", title="B3 (kg/m)", format=NUMBER),
    ]
    if points:
        shown = Chart(data(points)).mark_point(size=70, strokeWidth=1.8, clip=True)
        layers.append(shown.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip))
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title="M and B3 together",
        width=width_px,
        height=360,
        description="Joint 95 % regions of M and B3 with and without a start delay, and the estimates of each tow.",
    )


_VERDICTS = ("usable", "not determined", "drag negative somewhere")


def model_chart(models: Sequence[FittedModel], *, width_px: int = 340) -> alt.HConcatChart:
    """M with its 95 % interval, and AIC above the lowest, of each model."""
    lowest = min(model.aic for model in models)
    names = [model.label for model in models]
    rows: list[ChartRecord] = []
    for name, model in zip(names, models, strict=True):
        mass, half = model.estimates["M"], model.half_widths_95["M"]
        rows.append(
            {"name": name, "run": _verdict(model), "m": plain(mass)}
            | {"low": plain(mass - half), "high": plain(mass + half), "aic": plain(model.aic - lowest)}
        )
    shown = [verdict for verdict in _VERDICTS if any(row["run"] == verdict for row in rows)]
    look = series_look(shown, as_points=shown)
    y = alt.Y("name:N", sort=names, axis=alt.Axis(title=None, grid=True, labelLimit=200))
    tooltip = [
        alt.Tooltip("name:N", title="model"),
        alt.Tooltip("run:N", title="it is"),
        alt.Tooltip("m:Q", title="M (kg)", format=NUMBER),
        alt.Tooltip("low:Q", title="from", format=NUMBER),
        alt.Tooltip("high:Q", title="to", format=NUMBER),
        alt.Tooltip("aic:Q", title="AIC above the lowest", format=NUMBER),
    ]
    base = Chart(data(rows)).encode(y=y, tooltip=tooltip)
    scale = alt.Scale(zero=False)
    bars = base.mark_rule(strokeWidth=2).encode(x=alt.X("low:Q", scale=scale), x2="high:Q", color=look.colour)
    marks = base.mark_point(size=70, strokeWidth=2).encode(color=look.colour, shape=look.shape)
    masses = alt.layer(bars, marks.encode(x=alt.X("m:Q", scale=scale, title="M with its 95 % interval (kg)")))
    ranks = marks.encode(
        x=alt.X("aic:Q", title="AIC above the lowest"),
        y=alt.Y("name:N", sort=names, axis=alt.Axis(labels=False, title=None, grid=True)),
    )
    height = 30 * len(models)
    return alt.hconcat(
        masses.properties(width=width_px, height=height), ranks.properties(width=width_px - 60, height=height)
    ).properties(
        title="Models of different size",
        description="Mass and AIC of each model fitted by output error.",
        usermeta=STACKS,
    )


def _verdict(model: FittedModel) -> str:
    return _VERDICTS[0] if model.usable else _VERDICTS[1] if model.drag_nowhere_negative else _VERDICTS[2]
