"""Charts of a designed campaign or trial: where its runs are, and how certain the figures become over the time."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import runs_of
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, channel, layer, layered, tooltips
from tank2sim.apps.design.study import CampaignStudy, Certainty
from tank2sim.units import in_words

_WIDTH = 320
_HEIGHT = 240
DESIGN, USUAL = "design", "usual"


def run_planes(study: CampaignStudy) -> list[ChartSpec]:
    """Runs in the plane of drift and rudder, and oscillations in that of frequency and amplitude; areas are numbers of
    runs."""
    steady, swinging = Counter[tuple[float, ...]](), Counter[tuple[object, ...]]()
    for run in study.runs:
        if run.frequency_radps is None:
            steady[run.drift_deg, run.rudder_deg] += 1
            continue
        kind, ratio = "pure sway (v')", (run.sway_amplitude_m or 0.0) * run.frequency_radps / run.speed_mps
        if run.type != "pure_sway":
            kind = f"{run.type.replace('_', ' ')} (r')"
            ratio = math.radians(run.yaw_rate_amplitude_degps or 0.0) * study.model.length_m / run.speed_mps
        swinging[kind, plain(run.frequency_radps), plain(ratio)] += 1
    planes: list[ChartSpec] = []
    if swinging:
        rows = [{"run": kind, "x": x, "y": y, "runs": count} for (kind, x, y), count in swinging.items()]
        title = "Oscillations: amplitude and frequency"
        planes.append(_plane(rows, title, "frequency (rad/s)", "amplitude of v/U or r L/U"))
    if steady:
        rows = [{"run": "steady", "x": x, "y": y, "runs": count} for (x, y), count in steady.items()]
        planes.append(_plane(rows, "Steady runs: drift and rudder", "drift (deg)", "rudder (deg)"))
    return planes


def _plane(rows: Sequence[ChartRecord], title: str, across: str, up: str) -> ChartSpec:
    kinds = runs_of(rows)
    look = series_look(kinds, as_points=kinds)
    most = max(int(row["runs"]) for row in rows)
    counts = sorted({1, max(1, most // 2), most})
    scale = {"domain": [0, most], "range": [0, 500]}  # from no area for no runs: the legend has only numbers of runs
    place = {
        "x": PlotAxis(title=across, padding=20).channel("x"),
        "y": PlotAxis(title=up, padding=20, zero=True).channel("y"),
        "size": channel("runs:Q", scale=scale, legend={"title": "runs", "values": counts, "format": "d"}),
        "color": look.colour,
        "shape": look.shape,
        "tooltip": tooltips({"run:N": "type", "x:Q": across, "y:Q": up, "runs:Q": "runs"}),
    }
    return layered(
        [layer("point", rows, place, filled=True, opacity=0.7)],
        size=(2 * _WIDTH, _HEIGHT),
        title=title,
        description=f"{title}, by number of runs.",
    )


def figure_words(figure: str) -> str:
    """A figure as a reader sees it: ``advance_m@35`` is ``advance, 35 deg``."""
    kind, _, argument = figure.partition("@")
    words = re.sub(r"(?<=[a-z])(?=\d)", " ", in_words(kind)[0])
    return f"{words}, {argument}{'' if '/' in argument else ' deg'}" if argument else words


def certainty_charts(curve: Certainty, seconds: float, unit: str) -> list[ChartSpec]:
    """Standard error of each figure over the time in a unit of so many `seconds`, by both programmes."""
    charts: list[ChartSpec] = []
    for figure in curve.design:
        plans = {DESIGN: (curve.time_s, curve.design), USUAL: (curve.usual_time_s, curve.usual)}
        series = []
        for kind, (times, errors) in plans.items():
            known = np.isfinite(errors[figure])
            time, error = np.asarray(times)[known] / seconds, np.asarray(errors[figure])[known]
            series.append(PlotSeries(label=kind, x=time, y=error))
        up = PlotAxis(title=f"standard error ({in_words(figure.partition('@')[0])[1]})", zero=True)
        across = PlotAxis(title=f"time ({unit})")
        dots = [row for each in series for row in each.rows]
        place = {"x": across.channel("x"), "y": up.channel("v")}
        place["color"] = series_look([DESIGN, USUAL]).colour
        charts.append(
            curve_chart(
                Plot(series=series, up=up, height_px=160, over=[layer("point", dots, place, filled=True, size=36)]),
                across,
                title=f"Certainty of the {figure_words(figure)}",
                width_px=2 * _WIDTH,
                window=[],
                described=f"Standard error of the {figure_words(figure)} over the time, by both programmes.",
                shown={"run:N": "plan", "x:Q": unit, "v:Q": "standard error"},
            )
        )
    return charts
