"""Charts of a ship's stability and turning: the steering diagram with its spirals, what moves C', the step response."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.margin import CriterionBySpeed, Margin, TrimEffect
from tank2sim.analysis.stability.response import FIRST_ORDER, SteeringResponse
from tank2sim.analysis.stability.study import Spirals
from tank2sim.analysis.turning.characteristic import SteeringCharacteristic
from tank2sim.analysis.turning.diagram import TurningDiagram
from tank2sim.analysis.turning.spirals import SpiralPoints
from tank2sim.answer.charts.analysis import FrequencyResponse, PolesZeros, bode_chart, pole_zero_chart
from tank2sim.answer.charts.parts import (
    NUMBER,
    Chart,
    ChartRecord,
    SeriesLook,
    axis_above,
    data,
    pan_zoom,
    plain,
    records,
    series_look,
)
from tank2sim.answer.charts.parts import stacked as stacked_panels
from tank2sim.answer.numbers import format_number
from tank2sim.arrays import Array

STABLE, UNSTABLE, DIRECT, REVERSE = "stable turns", "unstable turns", "spiral", "reverse spiral"
_FEW = 14
"""Coefficients in the chart of influences; the table has all."""

_WIDTH = 680
_RUDDER = "rudder angle, starboard positive (deg)"


def steering_diagram(turning: TurningDiagram, spirals: Spirals, *, title: str = "") -> alt.VConcatChart:
    """Yaw rate, speed, drift and heel of steady turns against the rudder; unstable turns dashed, spirals as points."""
    points = turning.points
    run = {name: spiral for name, spiral in ((DIRECT, spirals.direct), (REVERSE, spirals.reverse)) if spiral}
    lines = [STABLE, *([UNSTABLE] if not all(points.stable) else [])]
    look = series_look([*lines, *run], as_points=list(run))
    shown = {
        "yaw rate (deg/s)": (points.yaw_rate_degps, 300),
        "speed (m/s)": (points.speed_mps, 110),
        "drift angle (deg)": (points.drift_deg, 110),
    }
    if points.heel_deg is not None:
        shown["heel (deg)"] = (points.heel_deg, 110)
    panels = []
    for name, (values, height) in shown.items():
        last = name == list(shown)[-1]
        run_shown = run if name.startswith("yaw") else {}
        panel = _turning_panel(_branches(turning, values), run_shown, look, (name, _RUDDER if last else None))
        panels.append(panel.properties(width=_WIDTH, height=height))
    return stacked_panels(panels, title=title, description="Steady yaw rate, speed and drift against the rudder angle.")


def _branches(turning: TurningDiagram, values: Array) -> list[ChartRecord]:
    """Rows of the branches: between two folds (or changes of stability) one line."""
    points, stable = turning.points, turning.points.stable
    rudder, rate = points.rudder_deg, points.yaw_rate_degps
    # Folds are listed among the turns.
    folds = {
        int(np.argmin(np.abs(rudder - fold.rudder_deg) + np.abs(rate - fold.yaw_rate_degps))) for fold in turning.folds
    }
    ends, rows = [0], []
    for place in range(1, len(rudder) - 1):
        changes = stable[place] != stable[place + 1] and place + 1 not in folds and place not in folds
        if place in folds or changes:
            ends.append(place)
    ends.append(len(rudder) - 1)
    for part, (first, last) in enumerate(itertools.pairwise(ends)):
        kept = slice(first, last + 1)
        label = STABLE if stable[(first + last + 1) // 2] else UNSTABLE
        found = records(label, {"d": rudder[kept], "v": values[kept]})
        rows += [{**row, "part": part} for row in found]
    return rows


def _turning_panel(
    rows: list[ChartRecord], spirals: Mapping[str, SpiralPoints], look: SeriesLook, titles: tuple[str, str | None]
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
    line = Chart(data(rows)).mark_line(clip=True)
    unseen = Chart(data(rows)).mark_point(opacity=0, filled=True, size=90, clip=True)
    layers = [
        line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, detail="part:N", order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=tooltip),
        Chart(data([{"d": 0.0}])).mark_rule(style="reference", clip=True).encode(x=x),
    ]
    points = [
        row
        for label, spiral in spirals.items()
        for row in records(label, {"d": spiral.rudder_deg, "v": spiral.yaw_rate_degps})
    ]
    if points:
        layers.append(
            Chart(data(points))
            .mark_point(clip=True)
            .encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        )
    return alt.layer(*layers)


def _curves(
    rows: list[ChartRecord],
    look: SeriesLook,
    *,
    across: str,
    up: str,
    marks: Sequence[alt.Chart] = (),
    height: int = 260,
) -> alt.LayerChart:
    """Lines of `x` and `y` with what they are, and reference marks under them."""
    x = alt.X("x:Q", title=across, scale=alt.Scale(zero=False, nice=False))
    y = alt.Y("y:Q", title=up, scale=alt.Scale(zero=False))
    tooltip = [
        alt.Tooltip("run:N", title="series"),
        alt.Tooltip("x:Q", title=across, format=NUMBER),
        alt.Tooltip("y:Q", title=up, format=NUMBER),
    ]
    line = Chart(data(rows)).mark_line(clip=True)
    unseen = Chart(data(rows)).mark_point(opacity=0, filled=True, size=90, clip=True)
    lines = line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")
    chart = alt.layer(*marks, lines, unseen.encode(x=x, y=y, tooltip=tooltip), params=[pan_zoom("x", views=["plot"])])
    return chart.properties(width=_WIDTH, height=height)


def _level(value: float) -> alt.Chart:
    return Chart(data([{"y": value}])).mark_rule(style="reference", clip=True).encode(y="y:Q")


def step_chart(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.LayerChart:
    """Yaw rate after a step of one degree of rudder (or of its order), deg/s."""
    rows = [row for one in responses for row in records(one.label, {"x": one.time_s, "y": one.step_per_s})]
    look = series_look([response.label for response in responses])
    chart = _curves(rows, look, across="time after the step (s)", up="yaw rate per degree of rudder (deg/s)")
    return chart.properties(title=title, description="Yaw rate over time after a step of the rudder.")


def steering_bode(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.VConcatChart:
    """Bode diagram of the yaw rate by the rudder."""
    drawn = [
        FrequencyResponse(label=one.label, omega_radps=one.omega_radps, response=one.response) for one in responses
    ]
    return bode_chart(drawn, title=title)


def steering_poles(responses: Sequence[SteeringResponse], *, title: str = "") -> alt.LayerChart:
    """Poles and zeros of the hull, and of Nomoto's first order; those of the gear lie far out and are left out."""
    shown = [response for response in responses if response.label in (responses[0].label, FIRST_ORDER)]
    systems = [PolesZeros(label=one.label, poles=one.poles.tolist(), zeros=one.zeros.tolist()) for one in shown]
    return pole_zero_chart(systems, title=title)


def influence_chart(margins: Margin, *, title: str = "") -> alt.LayerChart:
    """Change of C' by ten per cent more of each coefficient, as bars, the strongest at the top."""
    strongest = margins.derivatives[:_FEW]
    names = [influence.short_name for influence in strongest]
    rows: list[ChartRecord] = [{"name": one.short_name, "y": plain(one.percent)} for one in strongest]
    y = alt.Y("name:N", title=None, sort=names)
    x = alt.X("y:Q", title="change of C′ when the coefficient grows by 10 % (% of |C′|)")
    tooltip = [alt.Tooltip("name:N", title="coefficient"), alt.Tooltip("y:Q", title="change of C′ (%)", format=NUMBER)]
    bars = Chart(data(rows)).mark_bar(opacity=0.8).encode(x=x, y=y, tooltip=tooltip)
    zero = Chart(data([{"y": 0.0}])).mark_rule(style="reference").encode(x="y:Q")
    return alt.layer(bars, zero).properties(
        title=title,
        width=_WIDTH - 60,
        height=alt.Step(22),
        description=f"Change of the stability criterion by {', '.join(names)}.",
    )


def criterion_by_speed_chart(speed: CriterionBySpeed, *, title: str = "") -> alt.LayerChart:
    """C' over speed."""
    rows = records("C′", {"x": speed.speed_mps, "y": 1e5 * speed.C_prime})
    look = series_look(["C′"])
    chart = _curves(rows, look, across="speed (m/s)", up="C′ · 10⁵", marks=[_level(0.0)], height=200)
    return chart.properties(title=title, description="Stability criterion over speed.")


def _short(criterion: str) -> str:
    """A criterion without the words that a narrow chart has no room for."""
    return criterion.partition(", 10 deg")[0].replace(" zigzag,", "").replace(", full astern,", ":")


_TWO_LINES = "split(datum.label, '|')"
"""Labels of an axis in two lines, divided at a bar."""


def criteria_chart(criteria: Sequence[ImoCriterion], *, title: str = "") -> alt.LayerChart:
    """Figures of the criteria as bars, in per cent of their limits; pale beyond the range of the card."""
    rows: list[ChartRecord] = [
        {
            "name": f"{_short(one.name)}|{format_number(one.found, 3)} of {format_number(one.allowed, 3)} {one.unit}",
            "percent": plain(100 * one.found / one.allowed),
            "beyond": one.beyond_card,
        }
        for one in criteria
        if one.found is not None
    ]
    longest = max([*(row["percent"] for row in rows), 100.0])
    x = alt.X("percent:Q", title="per cent of the limit", scale=alt.Scale(domain=[0, 1.05 * longest], nice=False))
    y = alt.Y(
        "name:N",
        sort=[row["name"] for row in rows],
        title=None,
        axis=alt.Axis(labelExpr=_TWO_LINES, labelLineHeight=14),
    )
    base = Chart(data(rows)).encode(y=y)
    opacity = alt.condition("datum.beyond", alt.value(0.3), alt.value(0.85))
    bars = base.mark_bar(height=16).encode(x=x, opacity=opacity, tooltip=["name:N"])
    limit = Chart(data([{"percent": 100.0}])).mark_rule(style="limit", strokeWidth=2).encode(x="percent:Q")
    return alt.layer(bars, limit).properties(
        title=title,
        width=480,
        height=alt.Step(36),
        description="; ".join(str(row["name"]).replace("|", " ") for row in rows),
    )


def trim_chart(trim: TrimEffect, *, title: str = "") -> alt.LayerChart:
    """C' over trim after Inoue et al., with the two readings of Krezelewski and Misiag."""
    inoue = trim.inoue_1981
    per_cent, criteria = 100 * inoue.trim_by_stern_over_length, inoue.C_prime
    base = float(criteria[len(criteria) // 2])
    series = {"Inoue et al.": criteria}
    for name, reading in trim.paper_7_5_percent.items():
        series[f"7.5 % of {name}"] = base + per_cent * (reading.more - reading.less) / 2
    rows = [row for label, values in series.items() for row in records(label, {"x": per_cent, "y": 1e5 * values})]
    across = "trim by the stern (% of length)"
    chart = _curves(rows, series_look(list(series)), across=across, up="C′ · 10⁵", marks=[_level(0.0)], height=220)
    return chart.properties(title=title, description="Stability criterion over trim, estimated.")


def characteristic_chart(found: SteeringCharacteristic, *, title: str = "") -> alt.LayerChart:
    """Rudder angle against steady yaw rate: the diagram, Bech's cubic and Norrbin's, where they were fitted."""
    rate = found.curve.yaw_rate_degps
    kept = np.abs(rate) <= found.fitted_up_to_degps * (1 + 1e-9)
    rate, rudder = rate[kept], found.curve.rudder_deg[kept]

    def cubic(coefficients: Sequence[float]) -> Array:
        return np.asarray(np.degrees(np.polynomial.polynomial.polyval(np.radians(rate), coefficients)))

    series = {
        "steady turns": rudder,
        "Bech, nearest cubic": cubic(found.bech.coefficients),
        "Norrbin, slope kept": cubic(found.norrbin.coefficients) / found.norrbin.K_per_s,
    }
    rows = [row for label, values in series.items() for row in records(label, {"x": rate, "y": values})]
    across = "yaw rate, starboard positive (deg/s)"
    chart = _curves(rows, series_look(list(series)), across=across, up="rudder angle (deg)", marks=[_level(0.0)])
    return chart.properties(title=title, description="Rudder angle against steady yaw rate.")
