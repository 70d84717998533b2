"""Charts of bands over the members of an ensemble: steady turns by rudder, Bode diagram, step of the rudder."""

from __future__ import annotations

import altair as alt
import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.ensemble.steering import BodeBands, CurveBand, SteeringBands, StepBands, TurningBands
from tank2sim.answer.charts.parts import (
    NUMBER,
    Chart,
    ChartRecord,
    SeriesLook,
    axis_above,
    data,
    pan_zoom,
    records,
    series_look,
    stacked,
)
from tank2sim.answer.charts.theme import BAND_OPACITY
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array

_WIDTH = 680
_APART = 1e-6
"""Share of the largest yaw rate by which the two branches of a steering diagram are apart at least."""


def curve_charts(curves: SteeringBands) -> list[Illustration]:
    """Stable turns, Bode diagram and step of the rudder, each with its band."""
    turning, bode, step = curves.steady_turning, curves.bode, curves.step
    shaded = f"Line: this ship. Shaded: nine of ten of {curves.members} members."
    loop, with_loop, turns = turning.loop_width_deg, turning.with_loop, shaded
    if with_loop and loop:
        none = "" if with_loop == curves.members else " (none counted as 0)"
        turns += (
            f" {with_loop} of them have a hysteresis loop, {loop.p5:.3g} to {loop.p95:.3g} deg of rudder wide{none}; "
            "in the loop a ship keeps turning to the side that it comes from."
        )
    return [
        Illustration(chart=turns_chart(turning, title="Stable turns over the ensemble"), caption=turns),
        Illustration(chart=bode_band_chart(bode, title="Bode diagram over the ensemble"), caption=shaded),
        Illustration(chart=step_band_chart(step, title="Step of the rudder over the ensemble"), caption=shaded),
    ]


def turns_chart(turning: TurningBands, *, title: str = "") -> alt.LayerChart:
    """Yaw rate of stable turns against the rudder, coming from starboard turn and, where it differs, from port."""
    rudder = turning.rudder_deg
    starboard, port = turning.yaw_rate_from_starboard_degps, turning.yaw_rate_from_port_degps
    apart = np.zeros(len(rudder), dtype=bool)
    for key in ("p5", "p50", "p95", "own"):
        from_starboard, from_port = getattr(starboard, key), getattr(port, key)
        apart |= np.abs(from_starboard - from_port) > _APART * np.nanmax(np.abs(from_starboard), initial=0.0)
    # With their neighbours, so that the branches meet.
    apart = apart | np.roll(apart, 1) | np.roll(apart, -1)
    names = {"from starboard turn": (starboard, np.ones(len(rudder), dtype=bool)), "from port turn": (port, apart)}
    if not apart.any():
        names = {"stable turns": names["from starboard turn"]}
    rows = [
        row
        for label, (from_starboard, shown) in names.items()
        for row in _band_rows(label, rudder, from_starboard, shown)
    ]
    y = alt.Axis(title="yaw rate (deg/s)")
    x = alt.X("x:Q", title="rudder angle, starboard positive (deg)", scale=alt.Scale(nice=False))
    chart = _panel(rows, series_look(list(names)), x, y, height=300)
    return _by_itself(chart, title, "Yaw rate of stable turns against the rudder, with its band over an ensemble.")


def bode_band_chart(bode: BodeBands, *, title: str = "") -> alt.VConcatChart:
    """Magnitude and phase of the yaw rate by the rudder angle."""
    panels = []
    look = series_look(["yaw rate by rudder angle"])
    for name, band in (("magnitude (dB)", bode.magnitude_dB), ("phase (deg)", bode.phase_deg)):
        rows = _band_rows("yaw rate by rudder angle", bode.omega_radps, band)
        last = name.startswith("phase")
        axis = alt.Axis(title="angular frequency (rad/s)" if last else None, labels=last, ticks=last, format="~g")
        x = alt.X("x:Q", scale=alt.Scale(type="log", nice=False), axis=axis)
        panels.append(_panel(rows, look, x, axis_above(name), height=180))
    described = "Bode diagram of yaw rate by rudder angle, with its band over an ensemble."
    return stacked(panels, title=title, description=described)


def step_band_chart(step: StepBands, *, title: str = "") -> alt.LayerChart:
    """Yaw rate after a step of one degree of rudder."""
    rows = _band_rows("yaw rate", step.time_s, step.step_per_s)
    x = alt.X("x:Q", title="time after the step (s)", scale=alt.Scale(nice=False))
    chart = _panel(rows, series_look(["yaw rate"]), x, alt.Axis(title="yaw rate per degree of rudder (deg/s)"))
    return _by_itself(chart, title, "Yaw rate after a step of the rudder, with its band over an ensemble.")


def _band_rows(label: str, x: Array, band: CurveBand, shown: NDArray[np.bool_] | None = None) -> list[ChartRecord]:
    """Rows of the ship itself and of the 5 and 95 % quantiles; `part` numbers stretches without a gap, `band` those of
    the band."""
    columns = {"x": x, "v": band.own, "low": band.p5, "high": band.p95}
    rows = records(label, columns)
    kept = np.ones(len(rows), dtype=bool) if shown is None else shown
    parts, bands = (
        np.cumsum(np.diff(shown_there.astype(int), prepend=0) > 0).tolist()
        for shown_there in (kept & np.isfinite(columns["v"]), kept & np.isfinite(columns["low"]))
    )
    ends = zip(rows, parts, bands, kept, strict=True)
    return [row | {"part": part, "band": number} for row, part, number, is_shown in ends if is_shown]


def _panel(rows: list[ChartRecord], look: SeriesLook, x: alt.X, y: alt.Axis, *, height: int = 240) -> alt.LayerChart:
    up = alt.Y("v:Q", axis=y, scale=alt.Scale(zero=False))
    tooltip = [
        alt.Tooltip("run:N", title="series"),
        alt.Tooltip("x:Q", title=str(x.to_dict().get("title") or "at"), format=NUMBER),
        alt.Tooltip("v:Q", title="this ship", format=NUMBER),
        alt.Tooltip("low:Q", title="5 %", format=NUMBER),
        alt.Tooltip("high:Q", title="95 %", format=NUMBER),
    ]
    banded = [row for row in rows if row["low"] is not None]
    area = Chart(data(banded)).mark_area(opacity=BAND_OPACITY, clip=True)
    line = Chart(data(rows)).mark_line(clip=True)
    unseen = Chart(data(rows)).mark_point(opacity=0, filled=True, size=90, clip=True)
    layers = [
        line.encode(x=x, y=up, color=look.colour, strokeDash=look.dash, detail="part:N", order="i:Q"),
        area.encode(x=x, y=alt.Y("low:Q"), y2="high:Q", color=look.colour, detail="band:N"),
        unseen.encode(x=x, y=up, tooltip=tooltip),
    ]
    return alt.layer(*layers).properties(width=_WIDTH, height=height)


def _by_itself(chart: alt.LayerChart, title: str, described: str) -> alt.LayerChart:
    chart.layer[0].name = "plot"
    window = [pan_zoom("x", views=["plot"])]
    found: alt.LayerChart = alt.layer(*chart.layer, params=window).properties(
        width=chart.width, height=chart.height, title=title, description=described
    )
    return found
