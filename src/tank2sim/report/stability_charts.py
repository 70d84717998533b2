"""Charts of a ship's stability and turning: the steering diagram with its spirals, what moves C', the step response."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.analysis.stability.margin import Margin
from tank2sim.analysis.stability.response import FIRST_ORDER, SteeringResponse
from tank2sim.analysis.stability.trim import TrimEffect
from tank2sim.analysis.turning.characteristic import SteeringCharacteristic
from tank2sim.analysis.turning.diagram import SteadyTurning
from tank2sim.analysis.turning.spirals import SpiralPoints
from tank2sim.report.analysis_charts import FrequencyResponse, PolesZeros, bode_chart, pole_zero_chart
from tank2sim.report.chart_parts import NUMBER, Record, SeriesLook, axis_above, data, pan_zoom, records, series_look
from tank2sim.report.chart_parts import stacked as stacked_panels

STABLE, UNSTABLE, DIRECT, REVERSE = "stable turns", "unstable turns", "spiral", "reverse spiral"
FEW = 14
"""Coefficients in the chart of influences; the table has all."""

_WIDTH = 680
_RUDDER = "rudder angle, starboard positive (deg)"


def steering_diagram(
    turning: SteadyTurning, direct: SpiralPoints | None, reverse: SpiralPoints | None, *, title: str = ""
) -> alt.VConcatChart:
    """Yaw rate, speed, drift and heel of steady turns against the rudder; unstable turns dashed, spirals as points."""
    spirals = {name: points for name, points in ((DIRECT, direct), (REVERSE, reverse)) if points is not None}
    lines = [STABLE, *([UNSTABLE] if not turning.stable.all() else [])]
    look = series_look([*lines, *spirals], as_points=list(spirals))
    shown = {
        "yaw rate (deg/s)": (np.degrees(turning.yaw_rate_radps), 300),
        "speed (m/s)": (turning.speed_mps, 110),
        "drift angle (deg)": (np.degrees(turning.drift_rad), 110),
    }
    if turning.heel_rad is not None:
        shown["heel (deg)"] = (np.degrees(turning.heel_rad), 110)
    panels = []
    for name, (values, height) in shown.items():
        last = name == list(shown)[-1]
        own = spirals if name.startswith("yaw") else {}
        panel = _turning_panel(_branches(turning, values), own, look, (name, _RUDDER if last else None))
        panels.append(panel.properties(width=_WIDTH, height=height))
    return stacked_panels(panels, title=title, description="Steady yaw rate, speed and drift against the rudder angle.")


def _branches(turning: SteadyTurning, values: ArrayLike) -> list[Record]:
    """Rows of the branches: between two folds (or changes of stability) one line."""
    rudder, column = np.degrees(turning.rudder_rad), np.asarray(values, dtype=float)
    stable, folds = turning.stable, {fold.place for fold in turning.folds}
    ends, rows = [0], []
    for place in range(1, len(rudder) - 1):
        changes = stable[place] != stable[place + 1] and place + 1 not in folds and place not in folds
        if place in folds or changes:
            ends.append(place)
    ends.append(len(rudder) - 1)
    for part, (first, last) in enumerate(itertools.pairwise(ends)):
        kept = slice(first, last + 1)
        label = STABLE if stable[(first + last + 1) // 2] else UNSTABLE
        found = records(label, {"d": rudder[kept], "v": column[kept]})
        rows += [{**row, "part": part} for row in found]
    return rows


def _turning_panel(
    rows: list[Record], spirals: dict[str, SpiralPoints], look: SeriesLook, titles: tuple[str, str | None]
) -> alt.LayerChart:
    name, across = titles
    labelled = across is not None
    x = alt.X(
        "d:Q", scale=alt.Scale(nice=False, padding=8), axis=alt.Axis(title=across, labels=labelled, ticks=labelled)
    )
    y = alt.Y("v:Q", axis=axis_above(name), scale=alt.Scale(zero=False))
    tooltip = [
        alt.Tooltip("run:N", title="branch"),
        alt.Tooltip("d:Q", title="rudder (deg)", format=NUMBER),
        alt.Tooltip("v:Q", title=name, format=NUMBER),
    ]
    line = alt.Chart(data(rows)).mark_line(clip=True)
    unseen = alt.Chart(data(rows)).mark_point(opacity=0, filled=True, size=90, clip=True)
    layers = [
        line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, detail="part:N", order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=tooltip),
        alt.Chart(data([{"d": 0.0}])).mark_rule(style="reference", clip=True).encode(x=x),
    ]
    points = [
        row
        for label, one in spirals.items()
        for row in records(label, {"d": np.degrees(one.rudder_rad), "v": np.degrees(one.yaw_rate_radps)})
    ]
    if points:
        layers.append(
            alt.Chart(data(points))
            .mark_point(clip=True)
            .encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        )
    return alt.layer(*layers)


def _curves(
    rows: list[Record], look: SeriesLook, *, across: str, up: str, marks: Sequence[alt.Chart] = (), height: int = 260
) -> alt.LayerChart:
    """Lines of `x` and `y` with what they are, and reference marks under them."""
    x = alt.X("x:Q", title=across, scale=alt.Scale(zero=False, nice=False))
    y = alt.Y("y:Q", title=up, scale=alt.Scale(zero=False))
    tooltip = [
        alt.Tooltip("run:N", title="series"),
        alt.Tooltip("x:Q", title=across, format=NUMBER),
        alt.Tooltip("y:Q", title=up, format=NUMBER),
    ]
    line = alt.Chart(data(rows)).mark_line(clip=True)
    unseen = alt.Chart(data(rows)).mark_point(opacity=0, filled=True, size=90, clip=True)
    lines = line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")
    chart = alt.layer(*marks, lines, unseen.encode(x=x, y=y, tooltip=tooltip), params=[pan_zoom("x", views=["plot"])])
    return chart.properties(width=_WIDTH, height=height)


def _level(value: float) -> alt.Chart:
    return alt.Chart(data([{"y": value}])).mark_rule(style="reference", clip=True).encode(y="y:Q")


def step_chart(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.LayerChart:
    """Yaw rate after a step of one degree of rudder (or of its order), deg/s."""
    rows = [row for one in responses for row in records(one.label, {"x": one.time_s, "y": one.step_per_s})]
    look = series_look([one.label for one in responses])
    chart = _curves(rows, look, across="time after the step (s)", up="yaw rate per degree of rudder (deg/s)")
    return chart.properties(title=title, description="Yaw rate over time after a step of the rudder.")


def steering_bode(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.VConcatChart:
    """Bode diagram of the yaw rate by the rudder."""
    return bode_chart(
        [FrequencyResponse(label=one.label, omega_radps=one.omega_radps, response=one.response) for one in responses],
        title=title,
    )


def steering_poles(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.LayerChart:
    """Poles and zeros of the hull, and of Nomoto's first order; those of the gear lie far out and are left out."""
    shown = [one for one in responses if one.label == responses[0].label or one.label == FIRST_ORDER]
    systems = [PolesZeros(label=one.label, poles=one.poles, zeros=one.zeros) for one in shown]
    return pole_zero_chart(systems, title=title)


def influence_chart(margin: Margin, *, title: str = "") -> alt.LayerChart:
    """Change of C' by ten per cent more of each coefficient, as bars, the strongest at the top."""
    rows = [{"name": one.short_name, "y": float(f"{one.percent:.6g}")} for one in margin.influences[:FEW]]
    names = [one.short_name for one in margin.influences[:FEW]]
    y = alt.Y("name:N", title=None, sort=names)
    x = alt.X("y:Q", title="change of C′ when the coefficient grows by 10 % (% of |C′|)")
    tooltip = [alt.Tooltip("name:N", title="coefficient"), alt.Tooltip("y:Q", title="change of C′ (%)", format=NUMBER)]
    bars = alt.Chart(data(rows)).mark_bar(opacity=0.8).encode(x=x, y=y, tooltip=tooltip)
    zero = alt.Chart(data([{"y": 0.0}])).mark_rule(style="reference").encode(x="y:Q")
    return alt.layer(bars, zero).properties(
        title=title,
        width=_WIDTH - 60,
        height=alt.Step(22),
        description=f"Change of the stability criterion by {', '.join(names)}.",
    )


def speed_chart(margin: Margin, *, title: str = "") -> alt.LayerChart:
    """C' over speed."""
    rows = records("C′", {"x": margin.speeds_mps, "y": 1e5 * margin.criteria})
    look = series_look(["C′"])
    chart = _curves(rows, look, across="speed (m/s)", up="C′ · 10⁵", marks=[_level(0.0)], height=200)
    return chart.properties(title=title, description="Stability criterion over speed.")


def trim_chart(trim: TrimEffect, *, title: str = "") -> alt.LayerChart:
    """C' over trim after Inoue et al., and the two readings of paper 2 as levels around it."""
    per_cent = 100 * trim.trims
    base = float(trim.criteria[len(trim.criteria) // 2])
    series = {"Inoue et al. 1981": trim.criteria}
    for name, (less, more) in trim.readings.items():
        series[f"paper 2, read as {name}: ±7.5 % for 1 %"] = base + per_cent * (more - less) / 2
    rows = [row for label, values in series.items() for row in records(label, {"x": per_cent, "y": 1e5 * values})]
    across = "trim by the stern (% of length)"
    chart = _curves(rows, series_look(list(series)), across=across, up="C′ · 10⁵", marks=[_level(0.0)], height=220)
    return chart.properties(title=title, description="Stability criterion over trim, estimated.")


def characteristic_chart(found: SteeringCharacteristic, *, title: str = "") -> alt.LayerChart:
    """Rudder angle against steady yaw rate: the diagram, Bech's cubic and Norrbin's, where they were fitted."""
    kept = np.abs(found.yaw_rate_radps) <= found.fitted_radps * (1 + 1e-9)
    rate = found.yaw_rate_radps[kept]
    series = {
        "steady turns": found.rudder_rad[kept],
        "Bech, nearest cubic": found.bech(rate),
        "Norrbin, slope kept": found.norrbin(rate),
    }
    rows = [
        row
        for label, values in series.items()
        for row in records(label, {"x": np.degrees(rate), "y": np.degrees(values)})
    ]
    across = "yaw rate, starboard positive (deg/s)"
    chart = _curves(rows, series_look(list(series)), across=across, up="rudder angle (deg)", marks=[_level(0.0)])
    return chart.properties(title=title, description="Rudder angle against steady yaw rate.")
