"""Charts of a glider: polar, paths from above, from the side and in isometric projection, quasi-steady errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, look_of
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import equal_frame, vector
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, layer, layered
from tank2sim.apps.rigs.glider.quasi_steady_error import SwingError
from tank2sim.apps.rigs.glider.study import GlideState, PathPlace, TransientPath
from tank2sim.apps.rigs.glider.transient import ProgrammeError
from tank2sim.arrays import Array, Columns
from tank2sim.units import to_si


@dataclass(frozen=True, kw_only=True)
class SpacePath:
    """A path in space, m, in the order of time: north, east, height."""

    label: str
    north_m: ArrayLike
    east_m: ArrayLike
    height_m: ArrayLike


def space_path(label: str, columns: Columns) -> SpacePath:
    """A path from columns ``x_m``, ``y_m``, ``height_m``."""
    return SpacePath(label=label, north_m=columns["x_m"], east_m=columns["y_m"], height_m=columns["height_m"])


def corners_of(places: Sequence[PathPlace]) -> SpacePath:
    """The start and the ends of the steps."""
    north, east, height = zip(*((place.x_m, place.y_m, place.height_m) for place in places), strict=True)
    return SpacePath(label="steps", north_m=north, east_m=east, height_m=height)


def plan_chart(paths: Sequence[SpacePath], *, title: str = "") -> ChartSpec:
    """Paths from above: north up, east to the right, one scale."""
    drawn = [(path.label, vector(path.east_m), vector(path.north_m)) for path in paths]
    return _plane(drawn, ("east y (m)", "north x (m)"), title=title, height_px=480)


def elevation_chart(paths: Sequence[SpacePath], *, title: str = "") -> ChartSpec:
    """Paths from the side, rolled out: height above the start against the way over the ground, one scale."""
    drawn = [(path.label, _way(path), vector(path.height_m)) for path in paths]
    return _plane(drawn, ("way over the ground (m)", "height (m)"), title=title, height_px=360)


def isometric_chart(path: SpacePath, corners: SpacePath, *, title: str = "") -> ChartSpec:
    """A path in isometric projection: north to the upper right, east to the lower right, height up, one scale.

    Its shadow is drawn at the height of the start, and plumb lines from there to the `corners` of the path.
    """
    drawn = []
    for label, flat in ((path.label, False), ("seen from above", True)):
        drawn.append((label, *_projected(path.north_m, path.east_m, path.height_m, flat=flat)))
    arms = _arms(0.25 * max(1.0, *(float(np.abs(vector(values)).max()) for values in (path.north_m, path.east_m))))
    ends = (corners.north_m, corners.east_m, corners.height_m)
    for place, points in enumerate(zip(_points(*ends, flat=True), _points(*ends, flat=False), strict=True)):
        arms += [{"axis": f"plumb {place}", "name": "", "x": a, "v": b, "i": i} for i, (a, b) in enumerate(points)]
    return _plane(drawn, ("", ""), title=title, height_px=480, arms=arms)


def _projected(north: ArrayLike, east: ArrayLike, height: ArrayLike, *, flat: bool) -> tuple[Array, Array]:
    """Across and up in isometric projection."""
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    x, y, z = vector(north), vector(east), vector(height)
    return cos * (x + y), sin * (x - y) + (0 * z if flat else z)


def _points(north: ArrayLike, east: ArrayLike, height: ArrayLike, *, flat: bool) -> list[tuple[float, float]]:
    across, up = _projected(north, east, height, flat=flat)
    return list(zip(across.tolist(), up.tolist(), strict=True))


def _arms(length: float) -> list[ChartRecord]:
    """The three axes, as arms from the origin."""
    rows: list[ChartRecord] = []
    for name, end in (("north", (length, 0, 0)), ("east", (0, length, 0)), ("up", (0, 0, length))):
        points = [(0.0, 0.0), *_points(*([point] for point in end), flat=False)]
        rows += [{"axis": name, "name": name if i else "", "x": a, "v": b, "i": i} for i, (a, b) in enumerate(points)]
    return rows


def polar_chart(polar: Columns, marked: Mapping[str, GlideState], *, title: str = "") -> ChartSpec:
    """The polar: speed down against speed over the ground, with marked glides."""
    line = PlotSeries(
        label="polar",
        x=polar["horizontal_speed_mps"],
        y=-polar["climb_mps"],
        closed=True,
        more={"angle": np.abs(polar["path_angle_deg"])},
    )
    glides = [
        PlotSeries(
            label=label,
            x=[glide.horizontal_speed_mps],
            y=[-glide.climb_mps],
            points=True,
            more={"angle": [abs(glide.path_angle_deg)]},
        )
        for label, glide in marked.items()
    ]
    best = max(marked.values(), key=lambda glide: glide.horizontal_speed_mps / -glide.climb_mps)
    across = PlotAxis(title="speed over the ground (m/s)", zero=True)
    up = PlotAxis(title="speed down (m/s)", zero=True, scale={"reverse": True})
    tangent = [{"x": 0.0, "v": 0.0}, {"x": best.horizontal_speed_mps, "v": -best.climb_mps}]
    over = [layer("line", tangent, {"x": across.channel("x"), "y": up.channel("v")}, style="reference")]
    return curve_chart(
        Plot(series=[line, *glides], up=up, height_px=380, over=over),
        across,
        title=title,
        width_px=620,
        described="Glide polar: speed down against speed over the ground.",
        shown={"run:N": "glide", "x:Q": "over the ground (m/s)", "v:Q": "down (m/s)", "angle:Q": "path angle (deg)"},
        point_px=90,
    )


_PROGRAMME = {
    "buoyancy_kg": ("net buoyancy, + light (kg)", "1"),
    "pitch_deg": ("pitch, + up", "rad"),
    "roll_deg": ("roll, + to starboard", "rad"),
    "incidence_deg": ("incidence", "rad"),
    "speed_mps": ("speed", "m/s"),
}


def programme_chart(transient: TransientPath, *, title: str = "") -> ChartSpec:
    """Orders and the motion of the transient model over time."""
    histories = []
    for label, columns in (("orders and steady glides", transient.orders), ("transient", transient.histories)):
        values = {name: to_si(name, 1.0)[1] * columns[name] for name in _PROGRAMME}
        histories.append(History(label=label, time_s=columns["t_s"], values=values))
    panels = [Signal(name=name, title=words, unit=unit) for name, (words, unit) in _PROGRAMME.items()]
    return history_chart(histories, panels, title=title, height_px=90)


def quasi_steady_chart(errors: Sequence[ProgrammeError], *, title: str = "") -> ChartSpec:
    """Largest distance from the transient path, per cent of the way, against the length of a step."""
    series = [(error.label, error.duration_s, error.share) for error in errors]
    return _errors(series, ("length of a step (s)", "distance of the paths (% of the way)"), title=title)


def swing_chart(errors: Sequence[SwingError], *, title: str = "") -> ChartSpec:
    """Error of velocity or rate of turn, per cent, against the period of a swing."""
    series = [(error.label, error.period_s, error.share) for error in errors]
    return _errors(series, ("period of the swing (s)", "error (%)"), title=title)


def _errors(series: Sequence[tuple[str, Array, Array]], titles: tuple[str, str], *, title: str) -> ChartSpec:
    """Shares in per cent against times, both logarithmic."""
    curves = [PlotSeries(label=label, x=time, y=100 * share) for label, time, share in series]
    across = PlotAxis(title=titles[0], log=True, nice=False, padding=12, form="~g")
    up = PlotAxis(title=titles[1], log=True, form="~g")
    text = ", ".join(label for label, _, _ in series)
    place = {"x": across.channel("x"), "y": up.channel("v"), "color": look_of(curves).colour}
    dots = layer("point", [row for curve in curves for row in curve.rows], place, clip=True, filled=True)
    return curve_chart(
        Plot(series=curves, up=up, height_px=340, over=[dots]),
        across,
        title=title,
        width_px=680,
        described=f"{titles[1]} against {titles[0]} of {text}.",
        shown={"run:N": "programme"},
    )


def _way(path: SpacePath) -> Array:
    steps = np.hypot(np.diff(vector(path.north_m)), np.diff(vector(path.east_m)))
    way: Array = np.concatenate([[0.0], np.cumsum(steps)])
    return way


def _plane(
    drawn: Sequence[tuple[str, Array, Array]],
    titles: tuple[str, str],
    *,
    title: str,
    height_px: int,
    arms: Sequence[ChartRecord] = (),
) -> ChartSpec:
    """Lines in a plane with one scale; with `arms`, lines of reference with a name at their end, there are no axes."""
    across = np.concatenate([*(outline[1] for outline in drawn), vector([arm["x"] for arm in arms])])
    up = np.concatenate([*(outline[2] for outline in drawn), vector([arm["v"] for arm in arms])])
    frame = equal_frame(across, up, width_px=680, height_px=height_px)
    place = frame.axes(across=("x", titles[0]), up=("v", titles[1]))
    if arms:
        place = {name: axis | {"axis": None} for name, axis in place.items()}
    series = [PlotSeries(label=label, x=x, y=y, closed=True) for label, x, y in drawn]
    look = look_of(series)
    rows = [row for each in series for row in each.rows]
    marks = {**place, "color": look.colour, "strokeDash": look.dash, "order": "i:Q"}
    layers = [layer("line", rows, marks, clip=True)]
    if arms:
        along = {**place, "detail": "axis:N", "order": "i:Q"}
        layers.append(layer("line", arms, along, style="reference", strokeWidth=0.8, clip=True))
        text = {**place, "text": "name:N"}
        layers.append(layer("text", arms, text, style="reference", dx=5, align="left", clip=True))
    return layered(
        layers,
        size=(frame.width_px, frame.height_px),
        window=["x", "y"],
        title=title,
        description="Paths of " + ", ".join(label for label, _, _ in drawn) + "; both axes have one scale.",
        usermeta={"equal_scales": True},
    )
