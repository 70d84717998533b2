"""Charts of captive tests: force against angle or amplitude, loops over the motion, harmonics and residuals by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.parts import POINT_SAMPLES, extent, plain, series_look, shown_unit, vector, with_unit
from tank2sim.answer.charts.rows import RowPlot, row_chart
from tank2sim.answer.charts.vega import (
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    channel,
    heading,
    layer,
    layered,
    stacked,
    tooltips,
)
from tank2sim.identification.captive.plot_data import ForceLoop, ForcePlot, ForceSeries, HarmonicsPlot, LoopPlot
from tank2sim.records.thinning import thin_points

_CROWDED = 40
_USUAL_LIMIT = 2.0


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Residual of a force in one run, over its standard error; `kind` is the type of run."""

    run: str
    kind: str
    force: str
    value: float


def force_chart(plot: ForcePlot) -> ChartSpec:
    """A force against angle or amplitude: measured points with their intervals, the fits as lines in their bands.

    `plot`: its series have one colour each; angles are shown in degrees.
    """
    unit, factor = shown_unit(plot.unit)
    lines = [_force_series(each, factor, fit=True) for each in plot.series if len(vector(each.fit_x))]
    points = [_force_series(each, factor, fit=False) for each in plot.series]
    low, high = extent(np.concatenate([vector(each.y) for each in (*lines, *points)]))
    # A line at zero far from the values would squeeze them into an edge of the chart.
    rules = [Rule([0.0])] if low <= 0 <= high else []
    labels = ", ".join(each.label for each in plot.series)
    return curve_chart(
        Plot([*lines, *points], up=PlotAxis(plot.up), height_px=380, rules=rules),
        PlotAxis(with_unit(plot.across, unit), padding=10),
        title=plot.title,
        width_px=620,
        described=f"{plot.up} against {plot.across} of {labels}; points: measured, lines: the fit with its band.",
    )


def _force_series(each: ForceSeries, factor: float, *, fit: bool) -> PlotSeries:
    """The measured values of a series, or its fit from left to right."""
    x, value, half = (each.fit_x, each.fit_value, each.fit_half_width) if fit else (each.x, each.value, each.half_width)
    order = np.argsort(vector(x), kind="stable") if fit else np.arange(len(vector(x)))
    y, width = vector(value)[order], None if half is None else vector(half)[order]
    return PlotSeries(
        each.label,
        x=factor * vector(x)[order],
        y=y,
        low=None if width is None else y - width,
        high=None if width is None else y + width,
        points=not fit,
    )


def loop_chart(plot: LoopPlot, forces: Mapping[str, str]) -> ChartSpec:
    """Hysteresis loops: forces over the motion, one panel a force; measured as points, the fit as a line.

    `plot`: its loops have one colour each; `forces`: name of a force in the loops to its title with unit; the panels
    from top to bottom.
    """
    unit, factor = shown_unit(plot.unit)
    plots = [Plot(_loops(plot.loops, force, factor), up=PlotAxis(up), height_px=260) for force, up in forces.items()]
    labels = [loop.label for loop in plot.loops]
    return curve_panels(
        plots,
        PlotAxis(with_unit(plot.across, unit)),
        title=plot.title,
        width_px=560,
        described=f"Forces over {plot.across} of {', '.join(labels)}.",
        look=series_look(labels, as_points=labels),
        point_px=14,
    )


def _loops(loops: Sequence[ForceLoop], force: str, factor: float) -> list[PlotSeries]:
    found = []
    for loop in loops:
        if force in loop.forces:
            x, value = factor * vector(loop.motion), vector(loop.forces[force])
            kept = thin_points([value], POINT_SAMPLES)
            found.append(PlotSeries(loop.label, x=x[kept], y=value[kept], points=True))
        if force in loop.fitted:
            found.append(
                PlotSeries(loop.label, x=factor * vector(loop.fitted_motion), y=loop.fitted[force], closed=True)
            )
    if not found:
        raise ValueError(f"no loop has the force {force}")
    return found


def harmonic_chart(plot: HarmonicsPlot) -> ChartSpec:
    """Amplitudes of a force's harmonics as bars, one panel a harmonic, the runs side by side; strokes are the fit."""
    up, names = plot.up, [run.run for run in plot.runs]
    count = max(len(vector(run.amplitude)) for run in plot.runs)
    fitted = [run for run in plot.runs if run.fitted is not None]
    panels = []
    for order in range(1, count + 1):
        x = _runs_axis("run:N", names, named=order == count, bars=True)
        size = PlotAxis(f"harmonic {order} of {up}", above=True, ticks=4, zero=True)
        place: ChartSpec = {"x": x, "y": size.channel("v")}
        said = place | {"tooltip": tooltips({"run:N": "run", "v:Q": up})}
        bars = [{"run": run.run, "v": _at(run.amplitude, order)} for run in plot.runs]
        fits = [{"run": run.run, "v": _at(run.fitted, order)} for run in fitted]
        layers = [layer("bar", bars, said, opacity=0.7), layer("tick", fits, place, style="limit", thickness=2)]
        panels.append(layered(layers if fitted else layers[:1], size=(720, 110)))
    subtitle = "Bars: measured. Red strokes: fit."
    return stacked(
        panels,
        window=False,
        title=heading(plot.title, subtitle) if plot.title and fitted else plot.title,
        description=f"Amplitudes of the harmonics of {up} in {len(names)} runs.",
    )


def residual_chart(residuals: Sequence[Residual], *, title: str = "") -> ChartSpec:
    """Residuals over their standard errors, by run: one panel a force, a colour a type of run.

    Dotted lines mark two standard errors, within which nineteen of twenty should lie.

    `residuals`: runs are in the order of their first appearance.
    """
    runs = list(dict.fromkeys(residual.run for residual in residuals))
    kinds = list(dict.fromkeys(residual.kind for residual in residuals))
    forces = list(dict.fromkeys(residual.force for residual in residuals))
    look = series_look(kinds, as_points=kinds)
    low, high = extent(vector([residual.value for residual in residuals]))
    reach = 1.1 * max(_USUAL_LIMIT, -low, high)
    panels = []
    for force in forces:
        up = PlotAxis(
            f"{force}: residual / standard error", domain=(-reach, reach), nice=False, ticks=5, above=True
        ).channel("v")
        rows = [
            {"run": residual.kind, "name": residual.run, "v": plain(residual.value)}
            for residual in residuals
            if residual.force == force
        ]
        marks: ChartSpec = {"x": _runs_axis("name:N", runs, named=force == forces[-1]), "y": up}
        marks |= {"color": look.colour, "shape": look.shape, "tooltip": tooltips({"name:N": "run", "v:Q": "residual"})}
        limits = Rule([-_USUAL_LIMIT, 0.0, _USUAL_LIMIT], dash=(2, 3))
        panels.append(layered([limits.layer(up), layer("point", rows, marks)], size=(720, 140)))
    described = f"Residuals of {', '.join(forces)} in {len(runs)} runs."
    return stacked(panels, window=False, title=title, description=described)


def _runs_axis(place: str, runs: Sequence[str], *, named: bool, bars: bool = False) -> ChartSpec:
    size = 8 if len(runs) > _CROWDED else 11
    axis = {"labels": named, "ticks": named, "grid": False, "labelAngle": -90, "labelFontSize": size}
    axis |= {"labelLimit": 140, "labelOverlap": True}
    apart = {"paddingInner": 0.25} if bars else {}
    return channel(place, title=None, scale={"domain": list(runs), **apart}, axis=axis)


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


def derivative_certainty_chart(found: Mapping[str, _Estimated], *, title: str) -> ChartSpec:
    """Standard error of each number in % of its value, on a logarithmic scale, those without one left out.

    `found`: name to an object with ``value``, ``standard_error`` and ``origin``.
    """
    rows: list[ChartRecord] = [
        {"name": name, "run": entry.origin, "v": plain(100 * abs(entry.standard_error / entry.value))}
        for name, entry in found.items()
        if entry.standard_error and entry.value
    ]
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis("standard error (% of the value)", log=True, form="~g"),
            shown={"name:N": "number", "run:N": "origin", "v:Q": "standard error (%)"},
            rules=[Rule([100.0], style="limit")],
        ),
        title=title,
        described=f"Standard errors of {len(rows)} numbers in per cent of their values.",
        width_px=640,
        step_px=16,
        size=55,
        filled=True,
    )
