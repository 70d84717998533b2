"""Charts of captive tests: force against angle or amplitude, loops over the motion, harmonics and residuals by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    NUMBER,
    POINT_SAMPLES,
    Chart,
    ChartRecord,
    Position,
    SeriesLook,
    axis_above,
    data,
    extent,
    pan_zoom,
    plain,
    records,
    series_look,
    shown_unit,
    stacked,
    vector,
    with_unit,
)
from tank2sim.answer.charts.theme import BAND_OPACITY
from tank2sim.identification.captive.plot_data import (
    ForceLoop,
    ForcePlot,
    ForceSeries,
    HarmonicsPlot,
    LoopPlot,
)
from tank2sim.records.thinning import thin_line, thin_points

_CROWDED = 40
_USUAL_LIMIT = 2.0


@dataclass(frozen=True, kw_only=True)
class Residual:
    """What a fit leaves of one force in one run, over its standard error; `kind` is the type of run."""

    run: str
    kind: str
    force: str
    value: float


def force_chart(plot: ForcePlot, *, size_px: tuple[int, int] = (620, 380)) -> alt.LayerChart:
    """A force against angle or amplitude: measured points with their intervals, the fits as lines in their bands.

    Parameters
    ----------
    plot : ForcePlot
        Its series have one colour each; angles are shown in degrees.
    size_px : (int, int)
        Width and height.
    """
    series, up = plot.series, plot.up
    unit, factor = shown_unit(plot.unit)
    name = with_unit(plot.across, unit)
    look = series_look([run.label for run in series], as_points=[run.label for run in series])
    x = alt.X("x:Q", title=name, scale=alt.Scale(zero=False, padding=10))
    y = alt.Y("v:Q", title=up, scale=alt.Scale(zero=False))
    points = _rows(series, factor, fit=False)
    lines = _rows(series, factor, fit=True)
    low, high = extent(np.array([row["v"] for row in (*points, *lines)], dtype=float))
    # A line at zero far from the values would squeeze them into an edge of the chart.
    zero = [{"v": 0.0}] if low <= 0 <= high else []
    layers = [Chart(data(zero)).mark_rule(style="reference", clip=True).encode(y="v:Q")] if zero else []
    layers += _bands(lines, x, look)
    if lines:
        line = Chart(data(lines)).mark_line(clip=True)
        layers.append(line.encode(x=x, y=y, color=look.colour, order="i:Q"))
    layers += _intervals(points, x, look)
    tooltip = [
        alt.Tooltip("run:N", title="series"),
        alt.Tooltip("x:Q", title=name, format=NUMBER),
        alt.Tooltip("v:Q", title=up, format=NUMBER),
    ]
    mark = Chart(data(points), name="plot").mark_point(clip=True)
    layers.append(mark.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip))
    labels = ", ".join(run.label for run in series)
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=plot.title,
        width=size_px[0],
        height=size_px[1],
        description=f"{up} against {plot.across} of {labels}; points were measured, lines are the fit with its band.",
    )


def loop_chart(plot: LoopPlot, forces: Mapping[str, str], *, height_px: int = 260) -> alt.VConcatChart:
    """Hysteresis loops: forces over the motion, one panel a force; measured as points, the fit as a line.

    Parameters
    ----------
    plot : LoopPlot
        Its loops have one colour each.
    forces : mapping
        Name of a force in the loops to its title with unit; the panels from top to bottom.
    height_px : int
        Height of one panel.
    """
    loops = plot.loops
    unit, factor = shown_unit(plot.unit)
    name = with_unit(plot.across, unit)
    look = series_look([loop.label for loop in loops], as_points=[loop.label for loop in loops])
    panels = []
    for place, (force, up) in enumerate(forces.items()):
        last = place == len(forces) - 1
        axis = alt.Axis(title=name) if last else alt.Axis(title=None, labels=False, ticks=False)
        position: Position = {
            "x": alt.X("x:Q", scale=alt.Scale(zero=False), axis=axis),
            "y": alt.Y("v:Q", scale=alt.Scale(zero=False), axis=axis_above(up)),
        }
        panels.append(
            alt.layer(*_loop_layers(loops, force, factor, position, look)).properties(width=560, height=height_px)
        )
    labels = ", ".join(loop.label for loop in loops)
    return stacked(panels, title=plot.title, description=f"Forces over {plot.across} of {labels}.")


def harmonic_chart(plot: HarmonicsPlot, *, width_px: int = 720, height_px: int = 110) -> alt.VConcatChart:
    """Amplitudes of a force's harmonics as bars, one panel a harmonic, the runs side by side; strokes are the fit.

    Parameters
    ----------
    plot : HarmonicsPlot
    width_px, height_px : int
        Size of one panel.
    """
    runs, up = plot.runs, plot.up
    count = max(len(vector(run.amplitude)) for run in runs)
    panels = []
    for order in range(1, count + 1):
        x = _runs_axis("run:N", [run.run for run in runs], named=order == count, bars=True)
        rows = [{"run": run.run, "v": _at(run.amplitude, order)} for run in runs]
        fits = [{"run": run.run, "v": _at(run.fitted, order)} for run in runs if run.fitted is not None]
        y = alt.Y("v:Q", axis=axis_above(f"harmonic {order} of {up}", tickCount=4), scale=alt.Scale(zero=True))
        tooltip = [alt.Tooltip("run:N", title="run"), alt.Tooltip("v:Q", title=up, format=NUMBER)]
        bars = Chart(data(rows)).mark_bar(opacity=0.7).encode(x=x, y=y, tooltip=tooltip)
        layers = [bars]
        if fits:
            layers.append(Chart(data(fits)).mark_tick(style="limit", thickness=2).encode(x=x, y=y))
        panels.append(alt.layer(*layers).properties(width=width_px, height=height_px))
    subtitle = "Bars: measured. Red strokes: fit." if any(run.fitted is not None for run in runs) else ""
    return alt.vconcat(*panels, spacing=14).properties(
        title=alt.Title(plot.title, subtitle=subtitle) if plot.title and subtitle else plot.title,
        description=f"Amplitudes of the harmonics of {up} in {len(runs)} runs.",
    )


def residual_chart(
    residuals: Sequence[Residual], *, title: str = "", width_px: int = 720, height_px: int = 140
) -> alt.VConcatChart:
    """What the fit leaves, over its standard error, by run: one panel a force, a colour a type of run.

    Dotted lines mark two standard errors, within which nineteen of twenty should lie.

    Parameters
    ----------
    residuals : sequence of Residual
        Runs are in the order of their first appearance.
    title : str
        Title of the chart.
    width_px, height_px : int
        Size of one panel.
    """
    runs = list(dict.fromkeys(residual.run for residual in residuals))
    kinds = list(dict.fromkeys(residual.kind for residual in residuals))
    forces = list(dict.fromkeys(residual.force for residual in residuals))
    look = series_look(kinds, as_points=kinds)
    low, high = extent(vector([residual.value for residual in residuals]))
    reach = 1.1 * max(_USUAL_LIMIT, -low, high)
    panels = []
    for force in forces:
        x = _runs_axis("name:N", runs, named=force == forces[-1])
        scale = alt.Scale(domain=[-reach, reach], nice=False)
        y = alt.Y("v:Q", axis=axis_above(f"{force}: residual / standard error", tickCount=5), scale=scale)
        rows = [
            {"run": residual.kind, "name": residual.run, "v": plain(residual.value)}
            for residual in residuals
            if residual.force == force
        ]
        tooltip = [alt.Tooltip("name:N", title="run"), alt.Tooltip("v:Q", title="residual", format=NUMBER)]
        limits = [{"v": -_USUAL_LIMIT}, {"v": 0.0}, {"v": _USUAL_LIMIT}]
        rules = Chart(data(limits)).mark_rule(style="reference", strokeDash=[2, 3]).encode(y="v:Q")
        points = Chart(data(rows)).mark_point()
        marks = points.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        panels.append(alt.layer(rules, marks).properties(width=width_px, height=height_px))
    chart = alt.vconcat(*panels, spacing=14).resolve_scale(color="shared", shape="shared")
    return chart.properties(title=title, description=f"Residuals of {', '.join(forces)} in {len(runs)} runs.")


def _rows(series: Sequence[ForceSeries], factor: float, *, fit: bool) -> list[ChartRecord]:
    rows: list[ChartRecord] = []
    for run in series:
        x, value, half = (run.fit_x, run.fit_value, run.fit_half_width) if fit else (run.x, run.value, run.half_width)
        columns = {"x": factor * vector(x), "v": vector(value)}
        if half is not None:
            columns |= {"low": columns["v"] - vector(half), "high": columns["v"] + vector(half)}
        order = np.argsort(columns["x"], kind="stable") if fit else np.arange(len(columns["x"]))
        kept = order[thin_line([columns["v"][order]], LINE_SAMPLES)] if fit else order
        rows += records(run.label, {name: column[kept] for name, column in columns.items()})
    return rows


def _bands(lines: Sequence[ChartRecord], x: alt.X, look: SeriesLook) -> list[alt.Chart]:
    rows = [row for row in lines if "low" in row]
    if not rows:
        return []
    colour = look.colour.copy()
    if colour["legend"] is not None:
        # The legend is shared with the points, and would be as faint as the band.
        colour.legend = alt.Legend(title=None, symbolOpacity=1)
    area = Chart(data(rows)).mark_area(opacity=BAND_OPACITY, clip=True)
    return [area.encode(x=x, y=alt.Y("low:Q"), y2="high:Q", color=colour)]


def _intervals(points: Sequence[ChartRecord], x: alt.X, look: SeriesLook) -> list[alt.Chart]:
    rows = [row for row in points if "low" in row]
    if not rows:
        return []
    rule = Chart(data(rows)).mark_rule(style="stem", clip=True)
    return [rule.encode(x=x, y=alt.Y("low:Q"), y2="high:Q", color=look.colour)]


def _loop_layers(
    loops: Sequence[ForceLoop], force: str, factor: float, position: Position, look: SeriesLook
) -> list[alt.Chart]:
    points: list[ChartRecord] = []
    lines: list[ChartRecord] = []
    for loop in loops:
        if force in loop.forces:
            x, value = factor * vector(loop.motion), vector(loop.forces[force])
            kept = thin_points([value], POINT_SAMPLES)
            points += records(loop.label, {"x": x[kept], "v": value[kept]})
        if force in loop.fitted:
            x, value = factor * vector(loop.fitted_motion), vector(loop.fitted[force])
            kept = thin_line([x, value], LINE_SAMPLES)
            lines += records(loop.label, {"x": x[kept], "v": value[kept]})
    if not points and not lines:
        raise ValueError(f"no loop has the force {force}")
    layers = []
    if points:
        mark = Chart(data(points)).mark_point(clip=True, size=14)
        layers.append(mark.encode(**position, color=look.colour, shape=look.shape))
    if lines:
        mark = Chart(data(lines)).mark_line(clip=True)
        layers.append(mark.encode(**position, color=look.colour, order="i:Q"))
    return layers


def _runs_axis(place: str, runs: Sequence[str], *, named: bool, bars: bool = False) -> alt.X:
    size = 8 if len(runs) > _CROWDED else 11
    axis = alt.Axis(
        title=None, labels=named, ticks=named, grid=False,
        labelAngle=-90, labelFontSize=size, labelLimit=140, labelOverlap=True,
    )  # fmt: skip
    apart = {"paddingInner": 0.25} if bars else {}
    return alt.X(place, scale=alt.Scale(domain=list(runs), **apart), axis=axis)


def _at(amplitudes: ArrayLike | None, order: int) -> float | None:
    values = vector(() if amplitudes is None else amplitudes)
    return plain(abs(float(values[order - 1]))) if order <= len(values) else None


class _Estimated(Protocol):
    @property
    def value(self) -> float: ...
    @property
    def standard_error(self) -> float: ...
    @property
    def origin(self) -> str: ...


def derivative_certainty_chart(found: Mapping[str, _Estimated], *, title: str) -> alt.LayerChart:
    """Standard error of each number in % of its value, on a logarithmic scale, those without one left out.

    Parameters
    ----------
    found : mapping
        Name to an object with ``value``, ``standard_error`` and ``origin``.
    title : str
        Title of the chart.
    """
    rows: list[ChartRecord] = [
        {"name": name, "run": entry.origin, "v": plain(100 * abs(entry.standard_error / entry.value))}
        for name, entry in found.items()
        if entry.standard_error and entry.value
    ]
    origins = list(dict.fromkeys(str(row["run"]) for row in rows))
    look = series_look(origins, as_points=origins)
    x = alt.X("v:Q", title="standard error (% of the value)", scale=alt.Scale(type="log"), axis=alt.Axis(format="~g"))
    y = alt.Y("name:N", sort=None, axis=alt.Axis(title=None, grid=True))
    tooltip = [
        alt.Tooltip("name:N", title="number"),
        alt.Tooltip("run:N", title="origin"),
        alt.Tooltip("v:Q", title="standard error (%)", format=NUMBER),
    ]
    points = Chart(data(rows)).mark_point(size=55, filled=True)
    points = points.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
    whole = Chart(data([{"v": 100.0}])).mark_rule(style="limit").encode(x="v:Q")
    return alt.layer(whole, points).properties(
        title=title,
        width=640,
        height=alt.Step(16),
        description=f"Standard errors of {len(rows)} numbers in per cent of their values.",
    )
