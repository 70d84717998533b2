"""Charts of a ship's stability and turning: the steering diagram with its spirals, what moves C', the step response."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.margin import CriterionBySpeed, Margin, TrimEffect
from tank2sim.analysis.stability.response import SteeringResponse
from tank2sim.analysis.stability.study import Spirals
from tank2sim.analysis.turning.characteristic import SteeringCharacteristic
from tank2sim.analysis.turning.diagram import TurningDiagram
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels, gapped
from tank2sim.answer.charts.parts import plain
from tank2sim.answer.charts.rows import RowPlot, row_chart, row_layers
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layered
from tank2sim.answer.numbers import format_number
from tank2sim.arrays import Array

STABLE, UNSTABLE, DIRECT, REVERSE = "stable turns", "unstable turns", "spiral", "reverse spiral"
_FEW = 14
"""Coefficients in the chart of influences; the table has all."""

_WIDTH = 680
_RUDDER = "rudder angle, starboard positive (deg)"


def steering_diagram(turning: TurningDiagram, spirals: Spirals, *, title: str = "") -> ChartSpec:
    """Yaw rate, speed, drift and heel of steady turns against the rudder; unstable turns dashed, spirals as points."""
    points = turning.points
    runs = [
        PlotSeries(name, x=spiral.rudder_deg, y=spiral.yaw_rate_degps, points=True)
        for name, spiral in ((DIRECT, spirals.direct), (REVERSE, spirals.reverse))
        if spiral
    ]
    shown = {
        "yaw rate (deg/s)": (points.yaw_rate_degps, 300),
        "speed (m/s)": (points.speed_mps, 110),
        "drift angle (deg)": (points.drift_deg, 110),
    }
    if points.heel_deg is not None:
        shown["heel (deg)"] = (points.heel_deg, 110)
    plots = [
        Plot(
            [*_branches(turning, values), *(runs if place == 0 else [])],
            up=PlotAxis(name),
            height_px=height,
            rules=[Rule([0.0], upright=True)],
        )
        for place, (name, (values, height)) in enumerate(shown.items())
    ]
    described = "Steady yaw rate, speed and drift against the rudder angle."
    across = PlotAxis(_RUDDER, nice=False, padding=8)
    said = {"run:N": "branch", "x:Q": "rudder (deg)"}
    return curve_panels(plots, across, title=title, width_px=_WIDTH, described=described, shown=said)


def _branches(turning: TurningDiagram, values: Array) -> list[PlotSeries]:
    """Stable and unstable turns; between two folds (or changes of stability) a branch is one line."""
    points, stable = turning.points, turning.points.stable
    rudder, rate = points.rudder_deg, points.yaw_rate_degps
    # Folds are listed among the turns.
    folds = {
        int(np.argmin(np.abs(rudder - fold.rudder_deg) + np.abs(rate - fold.yaw_rate_degps))) for fold in turning.folds
    }
    changes = {int(row) for row in np.flatnonzero(np.diff(np.asarray(stable, dtype=int)))}
    at_folds = folds | {row - 1 for row in folds}
    ends = sorted({0, len(rudder) - 1} | {row for row in folds | (changes - at_folds) if 0 < row < len(rudder) - 1})
    parts: dict[str, list[slice]] = {STABLE: [], UNSTABLE: []}
    for first, last in itertools.pairwise(ends):
        parts[STABLE if stable[(first + last + 1) // 2] else UNSTABLE].append(slice(first, last + 1))
    return [
        PlotSeries(label, x=gapped([rudder[kept] for kept in slices]), y=gapped([values[kept] for kept in slices]))
        for label, slices in parts.items()
        if slices
    ]


def steering_curves(
    series: Sequence[PlotSeries], axes: tuple[str, str], *, height: int = 260, zero: bool = True, **options: Any
) -> ChartSpec:
    """Lines, with a line at zero below them if `zero`; `axes`: titles across and up; **options: of `curve_chart`."""
    plot = Plot(series, up=PlotAxis(axes[1]), height_px=height, rules=[Rule([0.0])] if zero else [])
    return curve_chart(plot, PlotAxis(axes[0], nice=False), width_px=_WIDTH, window=["x"], **options)


def step_chart(responses: Sequence[SteeringResponse], *, title: str = "") -> ChartSpec:
    """Yaw rate after a step of one degree of rudder (or of its order), deg/s."""
    series = [PlotSeries(one.label, x=one.time_s, y=one.step_per_s) for one in responses]
    up, described = "yaw rate per degree of rudder (deg/s)", "Yaw rate over time after a step of the rudder."
    return steering_curves(series, ("time after the step (s)", up), title=title, described=described, zero=False)


def influence_chart(margins: Margin, *, title: str = "") -> ChartSpec:
    """Change of C' by ten per cent more of each coefficient, as bars, the strongest at the top."""
    strongest = margins.derivatives[:_FEW]
    rows: list[ChartRecord] = [{"name": one.short_name, "v": plain(one.percent)} for one in strongest]
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis("change of C′ when the coefficient grows by 10 % (% of |C′|)", zero=True),
            rules=[Rule([0.0])],
            shown={"name:N": "coefficient", "v:Q": "change of C′ (%)"},
        ),
        title=title,
        described=f"Change of the stability criterion by {', '.join(one.short_name for one in strongest)}.",
        width_px=_WIDTH - 60,
        step_px=22,
        mark="bar",
        height=16,
        opacity=0.8,
    )


def criterion_by_speed_chart(speed: CriterionBySpeed, *, title: str = "") -> ChartSpec:
    """C' over speed."""
    series = [PlotSeries("C′", x=speed.speed_mps, y=1e5 * speed.C_prime)]
    described = "Stability criterion over speed."
    return steering_curves(series, ("speed (m/s)", "C′ · 10⁵"), title=title, described=described, height=200)


def _short(criterion: str) -> str:
    """A criterion without the words that a narrow chart has no room for."""
    return criterion.partition(", 10 deg")[0].replace(" zigzag,", "").replace(", full astern,", ":")


_TWO_LINES = {"labelExpr": "split(datum.label, '|')", "labelLineHeight": 14, "grid": False}
"""Labels of an axis in two lines, divided at a bar."""


def criteria_chart(criteria: Sequence[ImoCriterion], *, title: str = "") -> ChartSpec:
    """Figures of the criteria as bars, in per cent of their limits; pale beyond the range of the card."""
    rows: list[ChartRecord] = [
        {
            "name": f"{_short(one.name)}|{format_number(one.found, 3)} of {format_number(one.allowed, 3)} {one.unit}",
            "v": plain(100 * one.found / one.allowed),
            "beyond": one.beyond_card,
        }
        for one in criteria
        if one.found is not None
    ]
    longest = max([*(row["v"] for row in rows), 100.0])
    bars, limit = row_layers(
        RowPlot(
            rows,
            across=PlotAxis("per cent of the limit", domain=(0.0, 1.05 * longest), nice=False),
            shown={"name:N": "criterion"},
            rules=[Rule([100.0], style="limit")],
            side=_TWO_LINES,
        ),
        mark="bar",
        height=16,
    )[::-1]
    bars["encoding"]["opacity"] = {"condition": {"test": "datum.beyond", "value": 0.3}, "value": 0.85}
    return layered(
        [bars, limit],
        size=(480, {"step": 36}),
        title=title,
        description="; ".join(str(row["name"]).replace("|", " ") for row in rows),
    )


def trim_chart(trim: TrimEffect, *, title: str = "") -> ChartSpec:
    """C' over trim after Inoue et al., with the two readings of Krezelewski and Misiag."""
    inoue = trim.inoue_1981
    per_cent, criteria = 100 * inoue.trim_by_stern_over_length, inoue.C_prime
    base = float(criteria[len(criteria) // 2])
    values = {"Inoue et al.": criteria}
    for name, reading in trim.paper_7_5_percent.items():
        values[f"7.5 % of {name}"] = base + per_cent * (reading.more - reading.less) / 2
    series = [PlotSeries(label, x=per_cent, y=1e5 * value) for label, value in values.items()]
    across, described = "trim by the stern (% of length)", "Stability criterion over trim, estimated."
    return steering_curves(series, (across, "C′ · 10⁵"), title=title, described=described, height=220)


def characteristic_chart(found: SteeringCharacteristic, *, title: str = "") -> ChartSpec:
    """Rudder angle against steady yaw rate: the diagram, Bech's cubic and Norrbin's, where they were fitted."""
    rate = found.curve.yaw_rate_degps
    kept = np.abs(rate) <= found.fitted_up_to_degps * (1 + 1e-9)
    rate, rudder = rate[kept], found.curve.rudder_deg[kept]

    def cubic(coefficients: Sequence[float]) -> Array:
        return np.asarray(np.degrees(np.polynomial.polynomial.polyval(np.radians(rate), coefficients)))

    values = {
        "steady turns": rudder,
        "Bech, nearest cubic": cubic(found.bech.coefficients),
        "Norrbin, slope kept": cubic(found.norrbin.coefficients) / found.norrbin.K_per_s,
    }
    series = [PlotSeries(label, x=rate, y=value) for label, value in values.items()]
    across, described = "yaw rate, starboard positive (deg/s)", "Rudder angle against steady yaw rate."
    return steering_curves(series, (across, "rudder angle (deg)"), title=title, described=described)
