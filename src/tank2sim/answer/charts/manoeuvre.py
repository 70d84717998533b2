"""The chart of each standard manoeuvre, with its figures drawn where they are read off.

Distances are measured as in the manoeuvre: ahead along the course at the order, and to starboard of it. An ensemble
is a shaded band of the motion, and a bar from the 5 to the 95 % quantile of each figure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.labels import label_layers, spots_about, spots_along
from tank2sim.answer.charts.parts import LINE_SAMPLES, Frame, equal_frame, every, free_frame, plain, records, vector
from tank2sim.answer.charts.vega import (
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    channel,
    heading,
    layer,
    layered,
    tooltips,
)
from tank2sim.answer.numbers import format_number
from tank2sim.arrays import Array
from tank2sim.records.thinning import thin_line
from tank2sim.simulation.bands import Band

MOST_HULLS = 14
"""Outlines of the ship along a track at most: more would hide it. Project choice."""

HULL_SPACING = 1.2
"""Least distance between two outlines, ship lengths: they do not touch. Project choice."""

_STEPS_S = (1, 2, 5, 10, 15, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600)
"""Times between two outlines that a reader can count in."""

_FULL_TURN = 360.0
_ROUND = 3
"""Significant digits of the figures on a chart; the tables have more."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Motion of a ship in a manoeuvre, from the order on: arrays (n,), turns and offsets positive to starboard.

    `time_s`, `ahead_m`, `starboard_m`: distances along and across the course at the order; `heading_deg`, `rudder_deg`,
    `rate_degps`: heading from that course, rudder angle and yaw rate; `speed_mps`: through the water; `length_m`,
    `beam_m`: of the ship, for its outlines.
    """

    time_s: Array
    ahead_m: Array
    starboard_m: Array
    heading_deg: Array
    rudder_deg: Array
    rate_degps: Array
    speed_mps: Array
    revolutions_rpm: Array | None = None
    length_m: float | None = None
    beam_m: float | None = None

    def until(self, time_s: float) -> Motion:
        """The motion up to a time, in s."""
        kept = self.time_s <= time_s
        values: dict[str, Any] = {name: all_of[kept] for name, all_of in vars(self).items() if np.ndim(all_of)}
        return replace(self, **values)

    def place(self, time_s: float) -> tuple[float, float]:
        """Distance to starboard and ahead at a time, m."""
        return (
            float(np.interp(time_s, self.time_s, self.starboard_m)),
            float(np.interp(time_s, self.time_s, self.ahead_m)),
        )

    @property
    def way_m(self) -> Array:
        """Distance along the track, m."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(self.ahead_m), np.diff(self.starboard_m)))])


def motion_of(columns: Mapping[str, Any], length_m: float | None = None, beam_m: float | None = None) -> Motion:
    """Return the motion from columns of the trial format: ``t_s``, ``x_m``, ``y_m``, ``psi_deg``, ``u_mps``, ...

    Raises KeyError: a column is missing.
    """
    way = along_course(columns, np.column_stack([vector(columns["x_m"]), vector(columns["y_m"])]))
    psi = vector(columns["psi_deg"])
    rudder = columns.get("delta_deg", columns.get("delta_order_deg"))
    revolutions = columns.get("n_rpm")
    return Motion(
        time_s=vector(columns["t_s"]),
        ahead_m=way[:, 0],
        starboard_m=way[:, 1],
        heading_deg=psi - psi[0],
        rudder_deg=np.full(len(psi), np.nan) if rudder is None else vector(rudder),
        rate_degps=vector(columns["r_degps"]),
        speed_mps=np.hypot(vector(columns["u_mps"]), vector(columns.get("v_mps", 0.0))),
        revolutions_rpm=None if revolutions is None else vector(revolutions),
        length_m=length_m,
        beam_m=beam_m,
    )


def along_course(columns: Mapping[str, Any], points_m: Array) -> Array:
    """Return points (n, 2), north and east in m, as distances ahead and to starboard of the begin of a motion."""
    begin = np.array([columns["x_m"][0], columns["y_m"][0]], dtype=float)
    course = math.radians(float(columns["psi_deg"][0] or 0.0))
    north, east = (points_m.reshape(-1, 2) - begin).T
    cos, sin = math.cos(course), math.sin(course)
    return np.column_stack([north * cos + east * sin, east * cos - north * sin])


@dataclass(frozen=True)
class Dimension:
    """A figure drawn on a track: a line from `begin` to `end`, each (to starboard, ahead) in m, with its words.

    `low` and `high` are the ends of a bar on the same line, of the 5 and 95 % quantiles over an ensemble.
    """

    text: str
    begin: tuple[float, float]
    end: tuple[float, float]
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None


NamedBands = Mapping[str, Band]
"""Figure by name to its band over an ensemble."""


def turn_dimensions(motion: Motion, figures: Mapping[str, float | None], bands: NamedBands) -> list[Dimension]:
    """Return advance, transfer and tactical diameter of a turning circle, as far as the run shows them."""
    side = math.copysign(1.0, float(motion.heading_deg[-1]))
    advance, transfer = figures.get("advance_m"), figures.get("transfer_m")
    tactical, half = figures.get("tactical_diameter_m"), figures.get("time_180_s")

    def dimension(name: str, size_m: float, point: Callable[[float], tuple[float, float]]) -> Dimension:
        band = bands.get(f"{name.replace(' ', '_')}_m")
        low, high = (point(band.p5), point(band.p95)) if band else (None, None)
        text = _sized(name, size_m, motion.length_m)
        return Dimension(text, point(0.0), point(size_m), low=low, high=high)

    found: list[Dimension] = []
    if advance is not None and transfer is not None:
        found.append(dimension("advance", advance, lambda size: (side * transfer, size)))
        found.append(dimension("transfer", transfer, lambda size: (side * size, advance)))
    if tactical is not None and half is not None:
        ahead = motion.place(half)[1]
        found.append(dimension("tactical diameter", tactical, lambda size: (side * size, ahead)))
    return found


def turn_chart(
    motion: Motion,
    figures: Mapping[str, float | None],
    *,
    bands: NamedBands | None = None,
    edges_m: tuple[Array, Array] | None = None,
    title: str = "",
) -> ChartSpec:
    """A turning circle with advance, transfer and tactical diameter, and the ship at equal times.

    `figures`: ``advance_m``, ``transfer_m``, ``tactical_diameter_m``, ``time_180_s``; `bands`: bands of the
    figures over an ensemble; `edges_m` (n, 2): edges of the band of the track: distance ahead and to starboard, m.
    """
    turned = np.abs(motion.heading_deg) <= _FULL_TURN
    dimensions = turn_dimensions(motion, figures, bands or {})
    return way_chart(motion, dimensions, motion.until(float(motion.time_s[turned][-1])), edges_m=edges_m, title=title)


def way_chart(
    motion: Motion,
    dimensions: Sequence[Dimension],
    hulls_until: Motion | None = None,
    *,
    edges_m: tuple[Array, Array] | None = None,
    title: str = "",
) -> ChartSpec:
    """The track of a manoeuvre, both axes in one scale, with figures on it and the ship at equal times.

    `hulls_until`: the part of the motion with outlines of the ship; by default all of it; `edges_m`, `title`: as of
    :func:`turn_chart`.
    """
    polygon = _polygon(edges_m)
    step, outlines = hull_rows(hulls_until or motion)
    ends = [point[::-1] for dimension in dimensions for point in (dimension.begin, dimension.end)]
    shown = [*ends, *((row["x"], row["y"]) for row in outlines)]
    track = np.column_stack([motion.ahead_m, motion.starboard_m])
    up, across = np.concatenate([track, polygon, np.array(shown, dtype=float).reshape(-1, 2)]).T
    frame = equal_frame(across, up, width_px=640, height_px=540)
    place = frame.axes(across=("y", "to starboard (m)"), up=("x", "ahead (m)"))
    kept = thin_line([motion.ahead_m, motion.starboard_m], LINE_SAMPLES)
    rows = records("track", {"x": motion.ahead_m[kept], "y": motion.starboard_m[kept], "t": motion.time_s[kept]})
    tooltip = tooltips({"t:Q": "time (s)", "x:Q": "ahead (m)", "y:Q": "to starboard (m)"})
    layers = [layer("line", rows, {**place, "color": _ONE, "order": "i:Q"}, clip=True)]
    closed = {"interpolate": "linear-closed", "clip": True}
    if len(polygon):
        edge = records("band", {"x": polygon[:, 0], "y": polygon[:, 1]})
        layers.append(layer("line", edge, {**place, "order": "i:Q"}, style="band", strokeWidth=0, **closed))
    if outlines:
        layers.append(layer("line", outlines, {**place, "order": "i:Q", "detail": "hull:N"}, style="hull", **closed))
    lines = [(motion.starboard_m, motion.ahead_m), *_outline_lines(outlines)]
    layers += _dimension_layers(dimensions, place, frame, lines)
    hover = {**place, "tooltip": tooltip}
    layers.append(layer("point", every(rows, 90), hover, opacity=0, filled=True, size=110, clip=True))
    described = "; ".join(dimension.text for dimension in dimensions)
    outlined = f" The ship every {step:g} s." if outlines else ""
    return layered(
        layers,
        size=(frame.width_px, frame.height_px),
        window=["x", "y"],
        title=heading(title, outlined.strip()) if title else "",
        description=f"Track of the manoeuvre, the first course up the page. {described}.{outlined}",
        usermeta={"equal_scales": True},
    )


def zigzag_chart(
    motion: Motion,
    figures: Mapping[str, Sequence[float]],
    heading_deg: float,
    *,
    bands: NamedBands | None = None,
    edges_deg: tuple[Array, Array, Array] | None = None,
    title: str = "",
) -> ChartSpec:
    """Heading and rudder of a zigzag over time, each overshoot marked from the heading of the order to the peak.

    `figures`: ``overshoots_deg``, ``execute_times_s`` and ``overshoot_times_s``, each a list; `heading_deg`: heading at
    which the rudder is reversed, positive; `bands`: bands over an ensemble of ``overshoot_1_deg``, ...; `edges_deg`
    (n,): times (s), and the edges of the band of the heading (deg).
    """
    peaks = overshoot_marks(motion, figures, heading_deg, bands or {})
    beyond = [peak[name] for peak in peaks for name in ("v", "low", "high") if name in peak]
    edges = [vector(edge) for edge in edges_deg] if edges_deg is not None else []
    angles = [motion.heading_deg, motion.rudder_deg, np.array([-heading_deg, heading_deg]), vector(beyond), *edges[1:]]
    times = np.concatenate([motion.time_s, *edges[:1]])
    frame = free_frame(times, np.concatenate(angles), width_px=680, height_px=340, margins_px=(0.0, 22.0))
    across = PlotAxis("time (s)", domain=frame.across, nice=False)
    up = PlotAxis("heading and rudder, + to starboard (deg)", domain=frame.up, nice=False)
    place, over = {"x": across.channel("x"), "y": up.channel("v")}, []
    if edges:
        area = records("heading", dict(zip(("x", "low", "high"), edges, strict=True)))
        over.append(
            layer("area", area, {"x": place["x"], "y": up.channel("low"), "y2": "high"}, style="band", clip=True)
        )
    if peaks:
        if intervals := [peak for peak in peaks if "low" in peak]:
            bar = {"x": place["x"], "y": up.channel("low"), "y2": "high"}
            over.append(layer("rule", intervals, bar, style="interval", clip=True))
        rise = {"x": place["x"], "y": up.channel("from"), "y2": "v"}
        over.append(layer("rule", peaks, rise, style="overshoot", clip=True))
        labels = [(str(peak["text"]), spots_about((peak["x"], peak["v"]), up=peak["v"] > 0)) for peak in peaks]
        drawn = [(motion.time_s, motion.heading_deg), (motion.time_s, motion.rudder_deg)]
        over += label_layers(labels, frame, place, drawn)
    series = [
        PlotSeries("heading", x=motion.time_s, y=motion.heading_deg),
        PlotSeries("rudder", x=motion.time_s, y=motion.rudder_deg),
    ]
    rules = [Rule([heading_deg, -heading_deg], style="dimension")]
    sizes = ", ".join(str(peak["text"]) for peak in peaks)
    return curve_chart(
        Plot(series, up=up, height_px=frame.height_px, rules=rules, over=over),
        across,
        title=title,
        width_px=frame.width_px,
        window=["x"],
        described=f"Heading and rudder over time. Overshoots: {sizes or 'none'}.",
        shown={"run:N": "", "v:Q": "angle (deg)"},
    )


def overshoot_marks(
    motion: Motion, figures: Mapping[str, Sequence[float]], heading_deg: float, bands: NamedBands
) -> list[ChartRecord]:
    """Return a mark for each overshoot: from the heading of the order to the peak of the heading, with its size."""
    marks: list[ChartRecord] = []
    lists = [figures.get(name) or [] for name in ("overshoots_deg", "execute_times_s", "overshoot_times_s")]
    for number, (overshoot, execute, later) in enumerate(zip(*lists, strict=False), start=1):
        at = execute + later
        side = math.copysign(1.0, float(np.interp(at, motion.time_s, motion.heading_deg)))
        mark = {"x": plain(at), "from": side * heading_deg, "v": plain(side * (heading_deg + overshoot))}
        if band := bands.get(f"overshoot_{number}_deg"):
            mark |= {"low": plain(side * (heading_deg + band.p5)), "high": plain(side * (heading_deg + band.p95))}
        marks.append(mark | {"text": f"{format_number(overshoot, _ROUND)}°"})
    return marks


def pull_out_chart(sides: Mapping[str, Motion], neutral_deg: float, *, title: str = "") -> ChartSpec:
    """Yaw rate of pull-outs over the time from the order of the neutral rudder; both sides of a stable ship meet.

    `sides`: label to motion, of the pull-out from each side.
    """
    series = [
        PlotSeries(label, x=motion.time_s - pull_out_time(motion, neutral_deg), y=motion.rate_degps)
        for label, motion in sides.items()
    ]
    longest = max(float(np.max(one.x)) for one in series)
    rules = [Rule([0.0]), Rule([0.0], upright=True, style="dimension")]
    return curve_chart(
        Plot(series, up=PlotAxis("yaw rate, + to starboard (deg/s)", zero=True), height_px=320, rules=rules),
        PlotAxis(
            f"time from the order of the neutral rudder, {format_number(neutral_deg, _ROUND)}° (s)",
            domain=(-0.1 * longest, longest),
            nice=False,
        ),
        title=title,
        width_px=680,
        window=["x"],
        described=f"Yaw rate after the rudder is put to neutral, of {', '.join(sides)}.",
        shown={"run:N": "", "x:Q": "time (s)", "v:Q": "yaw rate (deg/s)"},
    )


def pull_out_time(motion: Motion, neutral_deg: float) -> float:
    """Return the time at which the rudder begins to move from its turn to the neutral angle, s."""
    away = np.abs(motion.rudder_deg - neutral_deg)
    held = np.flatnonzero(away >= (1 - 1e-6) * away.max())
    return float(motion.time_s[held[-1]])


def stop_speed_chart(motion: Motion, *, title: str = "") -> ChartSpec:
    """Speed, and revolutions where they change, over the distance along the track of a stop."""
    panels = {"speed (m/s)": motion.speed_mps}
    if motion.revolutions_rpm is not None and np.ptp(motion.revolutions_rpm) > 0:
        panels["revolutions (rpm)"] = motion.revolutions_rpm
    plots = [
        Plot(
            [PlotSeries("run", x=motion.way_m, y=values, closed=True, more={"t": motion.time_s})],
            up=PlotAxis(name, zero=True),
            height_px=200 if not place else 110,
        )
        for place, (name, values) in enumerate(panels.items())
    ]
    across = PlotAxis("distance along the track (m)", nice=False)
    described = "Speed over the distance along the track of the stop."
    return curve_panels(plots, across, title=title, width_px=640, described=described, shown={"t:Q": "time (s)"})


def stop_dimensions(motion: Motion, figures: Mapping[str, float | None]) -> list[Dimension]:
    """Return head reach and side reach of a stop."""
    head, side = figures.get("head_reach_m"), figures.get("side_reach_m")
    if head is None or side is None:
        return []
    head_words, side_words = (
        _sized(name, abs(size), motion.length_m) for name, size in (("head reach", head), ("side reach", side))
    )
    return [Dimension(head_words, (0.0, 0.0), (0.0, head)), Dimension(side_words, (0.0, head), (side, head))]


def hull_outline(length_m: float, beam_m: float) -> tuple[Array, Array]:
    """Return the outline of a ship about its midship point: distances to starboard and ahead of it, m."""
    half, bow, shoulder = beam_m / 2, length_m / 2, 0.3 * length_m
    return np.array([0.0, half, half, -half, -half]), np.array([bow, shoulder, -bow, -bow, shoulder])


def hull_rows(motion: Motion) -> tuple[float, list[ChartRecord]]:
    """Return the time between two outlines of the ship (s), and their corners; none without its dimensions."""
    length_m, beam_m = motion.length_m, motion.beam_m
    if not (length_m and beam_m) or len(motion.time_s) < 2:
        return 0.0, []
    duration, way = float(motion.time_s[-1]), float(motion.way_m[-1])
    least = max(duration / MOST_HULLS, HULL_SPACING * length_m * duration / way if way > 0 else duration)
    step = float(next((size for size in _STEPS_S if size >= least), _STEPS_S[-1] * math.ceil(least / _STEPS_S[-1])))
    across, up = hull_outline(length_m, beam_m)
    rows: list[ChartRecord] = []
    for number, time in enumerate(np.arange(0.0, duration + 1e-9, step)):
        starboard, ahead = motion.place(float(time))
        heading = math.radians(float(np.interp(time, motion.time_s, motion.heading_deg)))
        cos, sin = math.cos(heading), math.sin(heading)
        corners = {"x": ahead + up * cos - across * sin, "y": starboard + up * sin + across * cos}
        rows += [row | {"hull": number, "t": plain(float(time))} for row in records("ship", corners)]
    return step, rows


# One series takes the first colour of the palette, which is another on a dark screen.
_ONE = channel("run:N", legend=None)


def _sized(name: str, size_m: float, length_m: float | None) -> str:
    lengths = f" ({format_number(size_m / length_m, _ROUND)} L)" if length_m else ""
    return f"{name} {format_number(size_m, _ROUND)} m{lengths}"


def _polygon(edges: tuple[Array, Array] | None) -> Array:
    if edges is None:
        return np.empty((0, 2))
    low, high = (np.asarray(edge, dtype=float).reshape(-1, 2) for edge in edges)
    known = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
    return np.concatenate([low[known], high[known][::-1]])


def _dimension_layers(
    dimensions: Sequence[Dimension], place: Mapping[str, ChartSpec], frame: Frame, lines: Sequence[tuple[Array, Array]]
) -> list[ChartSpec]:
    """Lines from end to end of each figure, bars of an ensemble, and their words."""
    found = []
    bars = [(one.low, one.high, "") for one in dimensions if one.low and one.high]
    rules = [(one.begin, one.end, one.text) for one in dimensions]
    for style, ends in (("interval", bars), ("dimension", rules)):
        rows = [
            {"y": plain(y), "x": plain(x), "y2": plain(y2), "x2": plain(x2), "text": text}
            for (y, x), (y2, x2), text in ends
        ]
        if rows:
            found.append(layer("rule", rows, {**place, "x2": "y2", "y2": "x2"}, style=style, clip=True))
    labels = [(one.text, spots_along(one.begin, one.end, frame)) for one in dimensions]
    drawn = [np.array([one.begin, one.end]).T for one in dimensions]
    return [*found, *label_layers(labels, frame, place, [*lines, *((line[0], line[1]) for line in drawn)])]


def _outline_lines(outlines: Sequence[ChartRecord]) -> list[tuple[Array, Array]]:
    """The outlines of the ship as lines, to starboard and ahead."""
    corners: dict[int, list[tuple[float, float]]] = {}
    for row in outlines:
        corners.setdefault(row["hull"], []).append((row["y"], row["x"]))
    return [(closed[:, 0], closed[:, 1]) for hull in corners.values() if len(closed := np.array([*hull, hull[0]]))]
