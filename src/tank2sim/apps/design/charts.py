"""Charts of a designed campaign or trial: where its runs are, and how certain the figures become over the time."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence

import altair as alt

from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, data, plain, series_look
from tank2sim.apps.design.study import CampaignStudy, Certainty
from tank2sim.units import in_words

_WIDTH = 320
_HEIGHT = 240
DESIGN, USUAL = "design", "usual"


def run_planes(study: CampaignStudy) -> list[alt.TopLevelMixin]:
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
    planes: list[alt.TopLevelMixin] = []
    if swinging:
        rows = [{"run": kind, "x": x, "y": y, "runs": count} for (kind, x, y), count in swinging.items()]
        title = "Oscillations: amplitude and frequency"
        planes.append(_plane(rows, title, "frequency (rad/s)", "amplitude of v/U or r L/U"))
    if steady:
        rows = [{"run": "steady", "x": x, "y": y, "runs": count} for (x, y), count in steady.items()]
        planes.append(_plane(rows, "Steady runs: drift and rudder", "drift (deg)", "rudder (deg)"))
    return planes


def _plane(rows: Sequence[ChartRecord], title: str, across: str, up: str) -> alt.Chart:
    kinds = list(dict.fromkeys(str(row["run"]) for row in rows))
    look = series_look(kinds, as_points=kinds)
    most = max(int(row["runs"]) for row in rows)
    counts = sorted({1, max(1, most // 2), most})
    scale = alt.Scale(domain=[0, most], range=[0, 500])  # from no area for no runs: the legend has only numbers of runs
    size = alt.Size("runs:Q", scale=scale, legend=alt.Legend(title="runs", values=counts, format="d"))
    return (
        Chart(data(rows))
        .mark_point(filled=True, opacity=0.7)
        .encode(
            x=alt.X("x:Q", title=across, scale=alt.Scale(zero=False, padding=20)),
            y=alt.Y("y:Q", title=up, scale=alt.Scale(padding=20)),
            size=size,
            color=look.colour,
            shape=look.shape,
            tooltip=[
                alt.Tooltip("run:N", title="type"),
                alt.Tooltip("x:Q", title=across, format=NUMBER),
                alt.Tooltip("y:Q", title=up, format=NUMBER),
                alt.Tooltip("runs:Q", title="runs"),
            ],
        )
        .properties(width=2 * _WIDTH, height=_HEIGHT, title=title, description=f"{title}, by number of runs.")
    )


def figure_words(figure: str) -> str:
    """A figure as a reader sees it: ``advance_m@35`` is ``advance, 35 deg``."""
    kind, _, argument = figure.partition("@")
    words = re.sub(r"(?<=[a-z])(?=\d)", " ", in_words(kind)[0])
    return f"{words}, {argument}{'' if '/' in argument else ' deg'}" if argument else words


def certainty_charts(curve: Certainty, seconds: float, unit: str) -> list[alt.TopLevelMixin]:
    """Standard error of each figure over the time in a unit of so many `seconds`, by both programmes."""
    charts: list[alt.TopLevelMixin] = []
    for figure in curve.design:
        rows = [
            {"run": kind, "x": plain(time / seconds), "y": plain(error)}
            for kind, times, errors in (
                (DESIGN, curve.time_s, curve.design[figure]),
                (USUAL, curve.usual_time_s, curve.usual[figure]),
            )
            for time, error in zip(times, errors, strict=True)
            if math.isfinite(error)
        ]
        look = series_look([DESIGN, USUAL])
        base = Chart(data(rows)).encode(
            x=alt.X("x:Q", title=f"time ({unit})", scale=alt.Scale(zero=False)),
            y=alt.Y(
                "y:Q", title=f"standard error ({in_words(figure.partition('@')[0])[1]})", scale=alt.Scale(zero=True)
            ),
        )
        lines = base.mark_line().encode(color=look.colour, strokeDash=look.dash)
        points = base.mark_point(filled=True, size=36).encode(
            color=look.colour,
            tooltip=[
                alt.Tooltip("run:N", title="plan"),
                alt.Tooltip("x:Q", title=unit, format=NUMBER),
                alt.Tooltip("y:Q", title="standard error", format=NUMBER),
            ],
        )
        charts.append(
            alt.layer(lines, points).properties(
                width=2 * _WIDTH,
                height=160,
                title=f"Certainty of the {figure_words(figure)}",
                description=f"Standard error of the {figure_words(figure)} over the time, by both programmes.",
            )
        )
    return charts
