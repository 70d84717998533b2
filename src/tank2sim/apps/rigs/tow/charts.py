"""Charts of tows: speeds with fits and residuals, drag coefficients, joint regions of M and B3, models by AIC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_layers, look_of
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import STACKS, ChartRecord, ChartSpec, PlotAxis, Rule, layered
from tank2sim.apps.rigs.tow.model_selection import FittedModel, TowByTow
from tank2sim.apps.rigs.tow.study import Ellipse, TowSpeeds
from tank2sim.apps.rigs.tow.theory import DragPolynomial, TowedBody
from tank2sim.arrays import Array

_SPEEDS = (
    Signal(name="speed", title="speed", unit="m/s"),
    Signal(name="left", title="less the model", unit="m/s"),
)


def tow_speed_chart(speeds: TowSpeeds, *, title: str = "") -> ChartSpec:
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


def drag_chart(drags: Mapping[str, DragPolynomial], body: TowedBody, top_speed_mps: float) -> ChartSpec:
    """C referred to L^2 against speed, and C referred to V^(2/3) against Reynolds number."""
    speeds = np.linspace(0.0, top_speed_mps, 121)
    panels = []
    shown: dict[str, str | tuple[str, str]] = {
        "run:N": "by",
        "speed:Q": "v (m/s)",
        "re:Q": ("Re", ",.3~s"),
        "c:Q": "C by L²",
        "cv:Q": "C by V^(2/3)",
    }
    for across, values, name, factor in (
        (PlotAxis(title="speed (m/s)", nice=False), speeds, "C referred to L²", 1.0),
        (
            PlotAxis(title="Reynolds number v L / ν", nice=False, form="~s"),
            body.reynolds(speeds),
            "C referred to V^(2/3)",
            body.area_ratio,
        ),
    ):
        series = []
        for label, drag in drags.items():
            both = {"c": drag.at(speeds), "cv": drag.times(body.area_ratio).at(speeds)}
            more = {"speed": speeds, "re": body.reynolds(speeds), **both}
            series.append(PlotSeries(label=label, x=values, y=drag.times(factor).at(speeds), more=more))
        up = PlotAxis(title=name, domain=_frame(drags, speeds, factor))
        plot = Plot(series=series, up=up, rules=[Rule(at=[0.0])])
        layers = curve_layers(plot, across, look_of(series), shown=shown)
        panels.append(layered(layers, size=(330, 300)))
    return {
        "hconcat": panels,
        "spacing": 28,
        "title": "Drag coefficient",
        "description": "Drag coefficient referred to length squared over speed, and to volume over Reynolds number.",
        "usermeta": STACKS,
    }


def _frame(drags: Mapping[str, DragPolynomial], speeds: Array, factor: float) -> tuple[float, float]:
    """From a little below 0 to above the highest C of the curves that stay above zero; of all, if none does."""
    curves = [drag.times(factor).at(speeds) for drag in drags.values()]
    kept = [curve for curve in curves if curve.min() >= 0] or curves
    low, high = min(0.0, *(float(curve.min()) for curve in kept)), max(float(curve.max()) for curve in kept)
    margin = 0.08 * (high - low)
    return low - margin, high + margin


def ellipse_chart(ellipses: Sequence[Ellipse], by_tow: Mapping[str, TowByTow]) -> ChartSpec:
    """Joint 95 % regions of M and B3 from all tows, and each tow by itself as a point."""
    series = [
        PlotSeries(label=f"95 %: {ellipse.label}", x=ellipse.mass_kg, y=ellipse.B3_kgpm, closed=True)
        for ellipse in ellipses
    ]
    for name, way in by_tow.items():
        if way.unknowns[:2] == ("M", "B3") and name.startswith("output error"):
            known = np.flatnonzero(np.isfinite(np.asarray(way.alone)[:, :2]).all(axis=1))
            if len(known):
                mass, drag = np.asarray(way.alone)[known, :2].T
                label, more = f"each tow: {', '.join(way.unknowns)}", {"tow": known + 1.0}
                series.append(PlotSeries(label=label, x=mass, y=drag, points=True, more=more))
    return curve_chart(
        Plot(series=series, up=PlotAxis(title="B3 (kg/m)"), height_px=360),
        PlotAxis(title="M (kg)"),
        title="M and B3 together",
        width_px=620,
        described="Joint 95 % regions of M and B3 with and without a start delay, and the estimates of each tow.",
        shown={"run:N": "of", "tow:O": "tow"},
        point_px=70,
    )


_VERDICTS = ("usable", "not determined", "drag negative somewhere")


def model_chart(models: Sequence[FittedModel]) -> ChartSpec:
    """M with its 95 % interval, and AIC above the lowest, of each model."""
    lowest = min(model.aic for model in models)
    rows: list[ChartRecord] = []
    for model in models:
        mass, half = model.estimates["M"], model.half_widths_95["M"]
        rows.append(
            {"name": model.label, "run": _verdict(model), "v": plain(mass), "m": plain(mass)}
            | {"low": plain(mass - half), "high": plain(mass + half)}
            | {"least": plain(mass - half), "most": plain(mass + half), "aic": plain(model.aic - lowest)}
        )
    verdicts = [verdict for verdict in _VERDICTS if any(row["run"] == verdict for row in rows)]
    shown = {
        "name:N": "model",
        "run:N": "it is",
        "m:Q": "M (kg)",
        "least:Q": "from",
        "most:Q": "to",
        "aic:Q": "AIC above the lowest",
    }
    mass_rows = RowPlot(
        rows=rows,
        across=PlotAxis(title="M with its 95 % interval (kg)"),
        shown=shown,
        look=series_look(verdicts, as_points=verdicts),
    )
    rank_rows = replace(
        mass_rows,
        rows=[row | {"v": row["aic"], "low": None} for row in rows],
        across=PlotAxis(title="AIC above the lowest", zero=True),
        side={"labels": False},
    )
    masses, ranks = (row_layers(each, span_px=2, size=70, strokeWidth=2) for each in (mass_rows, rank_rows))
    height = 30 * len(models)
    return {
        "hconcat": [layered(masses, size=(340, height)), layered(ranks, size=(280, height))],
        "title": "Models of different size",
        "description": "Mass and AIC of each model fitted by output error.",
        "usermeta": STACKS,
    }


def _verdict(model: FittedModel) -> str:
    return _VERDICTS[0] if model.usable else _VERDICTS[1] if model.drag_nowhere_negative else _VERDICTS[2]
