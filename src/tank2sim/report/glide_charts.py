"""Charts of a glider: polar, paths from above, from the side and in isometric projection, quasi-steady errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.analysis.glide.path import GlidePath
from tank2sim.analysis.glide.steady import SteadyGlide
from tank2sim.analysis.glide.swing import SwingError
from tank2sim.analysis.glide.transient import Compared, ProgrammeError
from tank2sim.report.chart_parts import (
    HOVER_SAMPLES,
    LINE_SAMPLES,
    NUMBER,
    Record,
    data,
    equal_frame,
    every,
    pan_zoom,
    records,
    series_look,
    vector,
)
from tank2sim.report.motion_charts import History, Signal, history_chart
from tank2sim.report.thinning import Vector, thin_line
from tank2sim.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class SpacePath:
    """A path in space, m, in the order of time: north, east, height."""

    label: str
    north_m: ArrayLike
    east_m: ArrayLike
    height_m: ArrayLike


def space_path(label: str, path: GlidePath) -> SpacePath:
    """A path of steady glides."""
    points = path.sampled()
    return SpacePath(label=label, north_m=points[:, 1], east_m=points[:, 2], height_m=points[:, 3])


def corners_of(path: GlidePath) -> SpacePath:
    """The start and the ends of its steps."""
    points = np.array(path.places)
    return SpacePath(label="steps", north_m=points[:, 1], east_m=points[:, 2], height_m=points[:, 3])


def space_path_of(label: str, run: Trajectory) -> SpacePath:
    """The path of the transient model."""
    return SpacePath(label=label, north_m=run["motion.x"], east_m=run["motion.y"], height_m=-run["motion.z"])


def plan_chart(paths: Sequence[SpacePath], *, title: str = "") -> alt.LayerChart:
    """Paths from above: north up, east to the right, one scale."""
    drawn = [(one.label, vector(one.east_m), vector(one.north_m)) for one in paths]
    return _plane(drawn, ("east y (m)", "north x (m)"), title=title, height_px=480)


def elevation_chart(paths: Sequence[SpacePath], *, title: str = "") -> alt.LayerChart:
    """Paths from the side, rolled out: height above the start against the way over the ground, one scale."""
    drawn = [(one.label, _way(one), vector(one.height_m)) for one in paths]
    return _plane(drawn, ("way over the ground (m)", "height (m)"), title=title, height_px=360)


def isometric_chart(path: SpacePath, corners: SpacePath, *, title: str = "") -> alt.LayerChart:
    """A path in isometric projection: north to the upper right, east to the lower right, height up, one scale.

    Its shadow is drawn at the height of the start, and plumb lines from there to the `corners` of the path.
    """
    drawn = []
    for label, flat in ((path.label, False), ("seen from above", True)):
        drawn.append((label, *_projected(path.north_m, path.east_m, path.height_m, flat=flat)))
    arms = _arms(0.25 * max(1.0, *(float(np.abs(vector(one)).max()) for one in (path.north_m, path.east_m))))
    ends = (corners.north_m, corners.east_m, corners.height_m)
    for place, points in enumerate(zip(_points(*ends, flat=True), _points(*ends, flat=False), strict=True)):
        arms += [{"axis": f"plumb {place}", "name": "", "a": a, "b": b, "i": i} for i, (a, b) in enumerate(points)]
    return _plane(drawn, ("", ""), title=title, height_px=480, arms=arms)


def _projected(north: ArrayLike, east: ArrayLike, height: ArrayLike, *, flat: bool) -> tuple[Vector, Vector]:
    """Across and up in isometric projection."""
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    x, y, z = vector(north), vector(east), vector(height)
    return cos * (x + y), sin * (x - y) + (0 * z if flat else z)


def _points(north: ArrayLike, east: ArrayLike, height: ArrayLike, *, flat: bool) -> list[tuple[float, float]]:
    across, up = _projected(north, east, height, flat=flat)
    return list(zip(across.tolist(), up.tolist(), strict=True))


def _arms(length: float) -> list[Record]:
    """The three axes, as arms from the origin."""
    rows: list[Record] = []
    for name, end in (("north", (length, 0, 0)), ("east", (0, length, 0)), ("up", (0, 0, length))):
        points = [(0.0, 0.0), *_points(*([one] for one in end), flat=False)]
        rows += [{"axis": name, "name": name if i else "", "a": a, "b": b, "i": i} for i, (a, b) in enumerate(points)]
    return rows


def polar_chart(
    polar: Sequence[SteadyGlide], marked: Sequence[tuple[str, SteadyGlide]], *, title: str = ""
) -> alt.LayerChart:
    """The polar: speed down against speed over the ground, both in one scale, with marked glides."""
    across = np.array([glide.horizontal_speed_mps for glide in polar])
    down = np.array([-glide.climb_mps for glide in polar])
    angle = np.degrees(np.array([abs(glide.path_angle_rad) for glide in polar]))
    x = alt.X("x:Q", title="speed over the ground (m/s)", scale=alt.Scale(zero=True))
    y = alt.Y("y:Q", title="speed down (m/s)", scale=alt.Scale(zero=True, reverse=True))
    tooltip = [
        alt.Tooltip("x:Q", title="over the ground (m/s)", format=NUMBER),
        alt.Tooltip("y:Q", title="down (m/s)", format=NUMBER),
        alt.Tooltip("angle:Q", title="path angle (deg)", format=NUMBER),
    ]
    rows = records("polar", {"x": across, "y": down, "angle": angle})
    line = alt.Chart(data(rows)).mark_line(clip=True).encode(x=x, y=y, order="i:Q").properties(name="plot")
    hover = alt.Chart(data(every(rows, HOVER_SAMPLES))).mark_point(opacity=0, filled=True, size=110)
    points = [
        {
            "run": label,
            "x": glide.horizontal_speed_mps,
            "y": -glide.climb_mps,
            "angle": math.degrees(abs(glide.path_angle_rad)),
        }
        for label, glide in marked
    ]
    look = series_look([label for label, _ in marked], as_points=[label for label, _ in marked])
    dots = alt.Chart(data(points)).mark_point(size=90, strokeWidth=2)
    layers = [
        line,
        hover.encode(x=x, y=y, tooltip=tooltip),
        dots.encode(
            x=x, y=y, color=look.colour, shape=look.shape, tooltip=[alt.Tooltip("run:N", title="glide"), *tooltip]
        ),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title, width=620, height=380, description="Glide polar: speed down against speed over the ground."
    )


def programme_chart(compared: Compared, *, title: str = "") -> alt.VConcatChart:
    """Orders and what the transient model makes of them over time."""
    run = compared.motion
    signals = {
        "buoyancy": ("net buoyancy, + light (kg)", "1", "buoyancy.mass", "buoyancy.command"),
        "pitch": ("pitch, + up", "rad", "pitch.angle", "pitch.command"),
        "roll": ("roll, + to starboard", "rad", "roll.angle", "roll.command"),
        "incidence": ("incidence", "rad", "motion.incidence", None),
        "speed": ("speed", "m/s", "motion.speed", None),
    }
    ends = np.array([place.time_s for place in compared.path.places])
    times = np.repeat(ends, 2)[1:-1]
    steady = {
        "incidence": np.repeat([glide.incidence_rad for glide in compared.path.glides], 2),
        "speed": np.repeat([glide.speed_mps for glide in compared.path.glides], 2),
    }
    orders = {
        key: np.repeat([order[name] for order in compared.path.orders()], 2)
        for key, (_, _, _, name) in signals.items()
        if name
    }
    transient = History(label="transient", time_s=run.t, values={key: run[one[2]] for key, one in signals.items()})
    quasi = History(label="orders and steady glides", time_s=times, values={**orders, **steady})
    panels = [Signal(name=key, title=words, unit=unit) for key, (words, unit, _, _) in signals.items()]
    return history_chart([quasi, transient], panels, title=title, height_px=90)


def quasi_steady_chart(errors: Sequence[ProgrammeError], *, title: str = "") -> alt.LayerChart:
    """Largest distance from the transient path, per cent of the way, against the length of a step."""
    series = [(one.label, one.duration_s, one.share) for one in errors]
    return _errors(series, ("length of a step (s)", "distance of the paths (% of the way)"), title=title)


def swing_chart(errors: Sequence[SwingError], *, title: str = "") -> alt.LayerChart:
    """Error of velocity or rate of turn, per cent, against the period of a swing."""
    series = [(one.label, one.period_s, one.share) for one in errors]
    return _errors(series, ("period of the swing (s)", "error (%)"), title=title)


def _errors(series: Sequence[tuple[str, Vector, Vector]], titles: tuple[str, str], *, title: str) -> alt.LayerChart:
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
    base = alt.Chart(data(rows)).encode(x=x, y=y, color=look.colour)
    line = base.mark_line(clip=True).encode(strokeDash=look.dash, order="i:Q").properties(name="plot")
    dots = base.mark_point(clip=True, filled=True).encode(tooltip=tooltip)
    told = ", ".join(label for label, _, _ in series)
    return alt.layer(line, dots, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title=title, width=680, height=340, description=f"{titles[1]} against {titles[0]} of {told}."
    )


def _way(path: SpacePath) -> Vector:
    steps = np.hypot(np.diff(vector(path.north_m)), np.diff(vector(path.east_m)))
    way: Vector = np.concatenate([[0.0], np.cumsum(steps)])
    return way


def _plane(
    drawn: Sequence[tuple[str, Vector, Vector]],
    titles: tuple[str, str],
    *,
    title: str,
    height_px: int,
    arms: Sequence[Record] = (),
) -> alt.LayerChart:
    """Lines in a plane with one scale; with `arms`, lines of reference with a name at their end, there are no axes."""
    across = np.concatenate([*(one[1] for one in drawn), vector([arm["a"] for arm in arms])])
    up = np.concatenate([*(one[2] for one in drawn), vector([arm["b"] for arm in arms])])
    frame = equal_frame(across, up, width_px=680, height_px=height_px)
    position = frame.axes(across=("a:Q", titles[0]), up=("b:Q", titles[1]))
    if arms:
        position = {key: axis.axis(None) for key, axis in position.items()}
    look = series_look([label for label, _, _ in drawn])
    rows = []
    for label, x, y in drawn:
        kept = thin_line([x, y], LINE_SAMPLES)
        rows += records(label, {"a": x[kept], "b": y[kept]})
    line = alt.Chart(data(rows)).mark_line(clip=True)
    layers = [line.encode(**position, color=look.colour, strokeDash=look.dash, order="i:Q").properties(name="plot")]
    if arms:
        base = alt.Chart(data(list(arms))).encode(**position)
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
