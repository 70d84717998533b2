"""Charts of a glider: polar, paths from above, from the side and in isometric projection, quasi-steady errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import (
    HOVER_SAMPLES,
    LINE_SAMPLES,
    NUMBER,
    Chart,
    ChartRecord,
    data,
    equal_frame,
    every,
    pan_zoom,
    records,
    series_look,
    vector,
)
from tank2sim.apps.rigs.glider.quasi_steady_error import SwingError
from tank2sim.apps.rigs.glider.study import GlideState, PathPlace, TransientPath
from tank2sim.apps.rigs.glider.transient import ProgrammeError
from tank2sim.arrays import Array, Columns
from tank2sim.records.thinning import thin_line
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


def plan_chart(paths: Sequence[SpacePath], *, title: str = "") -> alt.LayerChart:
    """Paths from above: north up, east to the right, one scale."""
    drawn = [(path.label, vector(path.east_m), vector(path.north_m)) for path in paths]
    return _plane(drawn, ("east y (m)", "north x (m)"), title=title, height_px=480)


def elevation_chart(paths: Sequence[SpacePath], *, title: str = "") -> alt.LayerChart:
    """Paths from the side, rolled out: height above the start against the way over the ground, one scale."""
    drawn = [(path.label, _way(path), vector(path.height_m)) for path in paths]
    return _plane(drawn, ("way over the ground (m)", "height (m)"), title=title, height_px=360)


def isometric_chart(path: SpacePath, corners: SpacePath, *, title: str = "") -> alt.LayerChart:
    """A path in isometric projection: north to the upper right, east to the lower right, height up, one scale.

    Its shadow is drawn at the height of the start, and plumb lines from there to the `corners` of the path.
    """
    drawn = []
    for label, flat in ((path.label, False), ("seen from above", True)):
        drawn.append((label, *_projected(path.north_m, path.east_m, path.height_m, flat=flat)))
    arms = _arms(0.25 * max(1.0, *(float(np.abs(vector(values)).max()) for values in (path.north_m, path.east_m))))
    ends = (corners.north_m, corners.east_m, corners.height_m)
    for place, points in enumerate(zip(_points(*ends, flat=True), _points(*ends, flat=False), strict=True)):
        arms += [{"axis": f"plumb {place}", "name": "", "a": a, "b": b, "i": i} for i, (a, b) in enumerate(points)]
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
        rows += [{"axis": name, "name": name if i else "", "a": a, "b": b, "i": i} for i, (a, b) in enumerate(points)]
    return rows


def polar_chart(polar: Columns, marked: Mapping[str, GlideState], *, title: str = "") -> alt.LayerChart:
    """The polar: speed down against speed over the ground, with marked glides."""
    across, down, angle = polar["horizontal_speed_mps"], -polar["climb_mps"], np.abs(polar["path_angle_deg"])
    x = alt.X("x:Q", title="speed over the ground (m/s)", scale=alt.Scale(zero=True))
    y = alt.Y("y:Q", title="speed down (m/s)", scale=alt.Scale(zero=True, reverse=True))
    tooltip = [
        alt.Tooltip("x:Q", title="over the ground (m/s)", format=NUMBER),
        alt.Tooltip("y:Q", title="down (m/s)", format=NUMBER),
        alt.Tooltip("angle:Q", title="path angle (deg)", format=NUMBER),
    ]
    rows = records("polar", {"x": across, "y": down, "angle": angle})
    line = Chart(data(rows)).mark_line(clip=True).encode(x=x, y=y, order="i:Q").properties(name="plot")
    hover = Chart(data(every(rows, HOVER_SAMPLES))).mark_point(opacity=0, filled=True, size=110)
    points: list[ChartRecord] = [
        {
            "run": label,
            "x": glide.horizontal_speed_mps,
            "y": -glide.climb_mps,
            "angle": abs(glide.path_angle_deg),
        }
        for label, glide in marked.items()
    ]
    best = max(points, key=lambda point: point["x"] / point["y"])
    tangent = Chart(data([{"x": 0.0, "y": 0.0}, best])).mark_line(style="reference")
    look = series_look(list(marked), as_points=list(marked))
    dots = Chart(data(points)).mark_point(size=90, strokeWidth=2)
    layers = [
        line,
        tangent.encode(x=x, y=y),
        hover.encode(x=x, y=y, tooltip=tooltip),
        dots.encode(
            x=x, y=y, color=look.colour, shape=look.shape, tooltip=[alt.Tooltip("run:N", title="glide"), *tooltip]
        ),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title, width=620, height=380, description="Glide polar: speed down against speed over the ground."
    )


_PROGRAMME = {
    "buoyancy_kg": ("net buoyancy, + light (kg)", "1"),
    "pitch_deg": ("pitch, + up", "rad"),
    "roll_deg": ("roll, + to starboard", "rad"),
    "incidence_deg": ("incidence", "rad"),
    "speed_mps": ("speed", "m/s"),
}


def programme_chart(transient: TransientPath, *, title: str = "") -> alt.VConcatChart:
    """Orders and the motion of the transient model over time."""
    histories = []
    for label, columns in (("orders and steady glides", transient.orders), ("transient", transient.histories)):
        values = {name: to_si(name, 1.0)[1] * columns[name] for name in _PROGRAMME}
        histories.append(History(label=label, time_s=columns["t_s"], values=values))
    panels = [Signal(name=name, title=words, unit=unit) for name, (words, unit) in _PROGRAMME.items()]
    return history_chart(histories, panels, title=title, height_px=90)


def quasi_steady_chart(errors: Sequence[ProgrammeError], *, title: str = "") -> alt.LayerChart:
    """Largest distance from the transient path, per cent of the way, against the length of a step."""
    series = [(error.label, error.duration_s, error.share) for error in errors]
    return _errors(series, ("length of a step (s)", "distance of the paths (% of the way)"), title=title)


def swing_chart(errors: Sequence[SwingError], *, title: str = "") -> alt.LayerChart:
    """Error of velocity or rate of turn, per cent, against the period of a swing."""
    series = [(error.label, error.period_s, error.share) for error in errors]
    return _errors(series, ("period of the swing (s)", "error (%)"), title=title)


def _errors(series: Sequence[tuple[str, Array, Array]], titles: tuple[str, str], *, title: str) -> alt.LayerChart:
    """Shares in per cent against times, both logarithmic."""
    look = series_look([label for label, _, _ in series])
    rows = [row for label, time, share in series for row in records(label, {"t": time, "e": 100 * share})]
    x = alt.X("t:Q", title=titles[0], scale=alt.Scale(type="log", nice=False, padding=12), axis=alt.Axis(format="~g"))
    y = alt.Y("e:Q", title=titles[1], scale=alt.Scale(type="log"), axis=alt.Axis(format="~g"))
    tooltip = [
        alt.Tooltip("run:N", title="programme"),
        alt.Tooltip("t:Q", title=titles[0], format=NUMBER),
        alt.Tooltip("e:Q", title=titles[1], format=NUMBER),
    ]
    base = Chart(data(rows)).encode(x=x, y=y, color=look.colour)
    line = base.mark_line(clip=True).encode(strokeDash=look.dash, order="i:Q").properties(name="plot")
    dots = base.mark_point(clip=True, filled=True).encode(tooltip=tooltip)
    text = ", ".join(label for label, _, _ in series)
    return alt.layer(line, dots, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title, width=680, height=340, description=f"{titles[1]} against {titles[0]} of {text}."
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
) -> alt.LayerChart:
    """Lines in a plane with one scale; with `arms`, lines of reference with a name at their end, there are no axes."""
    across = np.concatenate([*(outline[1] for outline in drawn), vector([arm["a"] for arm in arms])])
    up = np.concatenate([*(outline[2] for outline in drawn), vector([arm["b"] for arm in arms])])
    frame = equal_frame(across, up, width_px=680, height_px=height_px)
    position = frame.axes(across=("a:Q", titles[0]), up=("b:Q", titles[1]))
    if arms:
        position = {key: axis.axis(None) for key, axis in position.items()}
    look = series_look([label for label, _, _ in drawn])
    rows = []
    for label, x, y in drawn:
        kept = thin_line([x, y], LINE_SAMPLES)
        rows += records(label, {"a": x[kept], "b": y[kept]})
    line = Chart(data(rows)).mark_line(clip=True)
    layers = [line.encode(**position, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")]
    if arms:
        base = Chart(data(list(arms))).encode(**position)
        layers.append(
            base.mark_line(style="reference", strokeWidth=0.8, clip=True).encode(detail="axis:N", order="i:Q")
        )
        layers.append(base.mark_text(style="reference", dx=5, align="left", clip=True).encode(text="name:N"))
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title,
        width=frame.width_px,
        height=frame.height_px,
        description="Paths of " + ", ".join(label for label, _, _ in drawn) + "; both axes have one scale.",
        usermeta={"equal_scales": True},
    )
