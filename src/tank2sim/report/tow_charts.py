"""Charts of tows: speeds with fits and residuals, drag coefficients, joint regions of M and B3, models by AIC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.dynamics.surge_theory import DragPolynomial, TowedBody
from tank2sim.identification.tow.models import FittedModel
from tank2sim.identification.tow.study import TowStudy
from tank2sim.records.tows import Tows
from tank2sim.report.chart_parts import NUMBER, Record, data, pan_zoom, plain, records, series_look
from tank2sim.report.motion_charts import History, Signal, history_chart
from tank2sim.report.thinning import Vector

_SPEEDS = (
    Signal(name="speed", title="speed", unit="m/s"),
    Signal(name="left", title="less the model", unit="m/s"),
)


def speed_chart(tows: Tows, time_s: Vector, fits: Mapping[str, Vector], *, title: str = "") -> alt.VConcatChart:
    """Readings as points and fits as lines; below, all of them less the first fit.

    Parameters
    ----------
    time_s : array, (n,)
        Times of the fits.
    fits : mapping
        Name to speeds, (n,), m/s; not empty.
    """
    reference = next(iter(fits.values()))
    at_readings = np.interp(tows.time_s, time_s, reference)
    runs = [
        History(
            label=f"tow {number}",
            time_s=tows.time_s,
            values={"speed": speed, "left": speed - at_readings},
            measured=True,
        )
        for number, speed in enumerate(tows.speed_mps.T, start=1)
    ]
    for name, speed in fits.items():
        runs.append(History(label=name, time_s=time_s, values={"speed": speed, "left": speed - reference}))
    return history_chart(runs, _SPEEDS, title=title, height_px=230)


def drag_chart(drags: Mapping[str, DragPolynomial], body: TowedBody, top_speed_mps: float) -> alt.HConcatChart:
    """Fig. 2 of paper 1: C referred to L^2 against speed, and C referred to V^(2/3) against Reynolds number."""
    speeds = np.linspace(0.0, top_speed_mps, 121)
    look = series_look(list(drags))
    rows = [
        row
        for name, own in drags.items()
        for row in records(
            name,
            {
                "v": speeds,
                "re": body.reynolds(speeds),
                "c": own.at(speeds),
                "cv": own.times(body.area_ratio).at(speeds),
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
        zero = alt.Chart(data([{"zero": 0.0}])).mark_rule(style="reference").encode(y="zero:Q")
        base = alt.Chart(data(rows)).encode(x=x, y=y, color=look.colour, order="i:Q")
        line = base.mark_line(clip=True).encode(strokeDash=look.dash)
        hover = base.mark_point(opacity=0, filled=True, size=110, clip=True).encode(tooltip=tooltip)
        panels.append(alt.layer(zero, line, hover).properties(width=330, height=300))
    return alt.hconcat(*panels, spacing=28).properties(
        title="Drag coefficient (Fig. 2)",
        description="Drag coefficient referred to length squared over speed, and to volume over Reynolds number.",
    )


def _frame(drags: Mapping[str, DragPolynomial], speeds: Vector, factor: float) -> list[float]:
    """From a little below 0 to above the highest C of the curves that stay above zero; of all, if none does."""
    curves = [own.times(factor).at(speeds) for own in drags.values()]
    kept = [curve for curve in curves if curve.min() >= 0] or curves
    low, high = min(0.0, *(float(curve.min()) for curve in kept)), max(float(curve.max()) for curve in kept)
    margin = 0.08 * (high - low)
    return [low - margin, high + margin]


def ellipse_chart(study: TowStudy, *, width_px: int = 620) -> alt.LayerChart:
    """Joint 95 % regions of M and B3 from all tows, and each tow by itself as a point."""
    lines: list[Record] = []
    points: list[Record] = []
    ellipses = study.ellipses
    for own in ellipses:
        lines += records(f"95 %: {own.label}", {"m": own.mass_kg, "b": own.B3_kgpm})
    for way in study.by_tow:
        if way.unknowns[:2] == ("M", "B3") and way.label.startswith("output error"):
            for number, row in enumerate(way.alone, start=1):
                label = f"each tow: {', '.join(way.unknowns)}"
                points.append({"run": label, "m": plain(row[0]), "b": plain(row[1]), "tow": number})
    labels = [f"95 %: {own.label}" for own in ellipses]
    dots = list(dict.fromkeys(str(row["run"]) for row in points))
    look = series_look([*labels, *dots], as_points=dots)
    x = alt.X("m:Q", title="M (kg)", scale=alt.Scale(zero=False))
    y = alt.Y("b:Q", title="B3 (kg/m)", scale=alt.Scale(zero=False))
    outline = alt.Chart(data(lines)).mark_line(clip=True)
    layers = [outline.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")]
    tooltip = [
        alt.Tooltip("run:N", title="of"),
        alt.Tooltip("tow:O", title="tow"),
        alt.Tooltip("m:Q", title="M (kg)", format=NUMBER),
        alt.Tooltip("b:Q", title="B3 (kg/m)", format=NUMBER),
    ]
    if points:
        shown = alt.Chart(data(points)).mark_point(size=70, strokeWidth=1.8, clip=True)
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
    lowest = min(one.fit.aic for one in models)
    rows: list[Record] = []
    for one in models:
        low, high = one.mass_interval_kg
        rows.append(
            {"name": one.model.label, "run": _verdict(one), "m": plain(float(one.fit.estimates[0]))}
            | {"low": plain(low), "high": plain(high), "aic": plain(one.fit.aic - lowest)}
        )
    shown = [verdict for verdict in _VERDICTS if any(row["run"] == verdict for row in rows)]
    look = series_look(shown, as_points=shown)
    y = alt.Y("name:N", sort=[one.model.label for one in models], axis=alt.Axis(title=None, grid=True, labelLimit=200))
    tooltip = [
        alt.Tooltip("name:N", title="model"),
        alt.Tooltip("run:N", title="it is"),
        alt.Tooltip("m:Q", title="M (kg)", format=NUMBER),
        alt.Tooltip("low:Q", title="from", format=NUMBER),
        alt.Tooltip("high:Q", title="to", format=NUMBER),
        alt.Tooltip("aic:Q", title="AIC above the lowest", format=NUMBER),
    ]
    base = alt.Chart(data(rows)).encode(y=y, tooltip=tooltip)
    scale = alt.Scale(zero=False)
    bars = base.mark_rule(strokeWidth=2).encode(x=alt.X("low:Q", scale=scale), x2="high:Q", color=look.colour)
    marks = base.mark_point(size=70, strokeWidth=2).encode(color=look.colour, shape=look.shape)
    masses = alt.layer(bars, marks.encode(x=alt.X("m:Q", scale=scale, title="M with its 95 % interval (kg)")))
    ranks = marks.encode(
        x=alt.X("aic:Q", title="AIC above the lowest"),
        y=alt.Y("name:N", sort=[one.model.label for one in models], axis=alt.Axis(labels=False, title=None, grid=True)),
    )
    height = 30 * len(models)
    return alt.hconcat(
        masses.properties(width=width_px, height=height), ranks.properties(width=width_px - 60, height=height)
    ).properties(title="Models of different size", description="Mass and AIC of each model fitted by output error.")


def _verdict(one: FittedModel) -> str:
    return _VERDICTS[2] if not one.plausible else _VERDICTS[0] if one.determined else _VERDICTS[1]
