"""Result of ``glide``: steady glides, paths and ranges of an underwater glider."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, look_of
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import equal_frame, vector
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, layer, layered
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    records_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.apps.rigs.glider.study import (
    BalancedGlide,
    GlideState,
    GlideStudy,
    PathPlace,
    QuasiSteadyErrors,
    Range,
    TransientPath,
)
from tank2sim.apps.rigs.glider.transient import ProgrammeError, SwingError
from tank2sim.arrays import Array, Columns
from tank2sim.units import to_si

if TYPE_CHECKING:
    import pandas as pd


_ROUNDING_N = 1e-9
"""Forces below this are rounding of an equilibrium. Project choice: a millionth of the smallest net buoyancy."""

_STATE = {
    "path_angle_deg": "path angle",
    "incidence_deg": "α",
    "pitch_deg": "",
    "speed_mps": "",
    "lift_coefficient": "C_L",
    "drag_coefficient": "C_D",
}
"""Columns of steady glides, with their words."""

_SIGNS = "Angles + up, incidence α + when the flow comes from below"
_TURNS = (
    ", roll + starboard side down: it turns a dive to starboard and a climb to port. The turning radius neglects the "
    "added mass, as published; the transient model gives the radius with added mass"
)
_SWINGS = (
    "Root mean square over a period, against the steady glide of the controls as they are at each moment: of the "
    "velocity by the speed; where roll swings, of the rate of turn by its own. The effect of inertia falls with the "
    "period. Roll keeps the share by which the added mass widens every turn. Swings quicker than the controls follow "
    "are small."
)
_STEPS = (
    "Farthest distance of the path of steady glides in four steps, the delay of the controls included. On straight "
    "paths each change costs a fixed distance, so that the error falls with the length of a step. In turns the added "
    "mass adds to it for as long as they last."
)


@dataclass(frozen=True, eq=False, repr=False)
class GlideResult(Result[GlideStudy]):
    """Steady glides, paths and ranges of an underwater glider.

    Parameters
    ----------
    study : GlideStudy

    Examples
    --------
    >>> import tank2sim as t2s
    >>> glider = t2s.load("kulikovsky-velikanov")
    >>> found = glider.glide([-25, -30, -45], views=False)
    >>> found.glides["speed_mps"].round(3).tolist()
    [0.203, 0.244, 0.312]
    >>> round(found.smallest_angle_deg, 1)
    23.4
    """

    study: GlideStudy
    command: ClassVar[str] = "glide"

    @property
    def smallest_angle_deg(self) -> float:
        """The smallest angle of a path that can be flown without roll, deg."""
        return self.study.design.smallest_angle_deg

    @property
    def best(self) -> dict[str, object]:
        """The dive that goes farthest for each metre of depth, with the net buoyancy of the card."""
        return asdict(self.study.design.best_glide)

    @property
    def fastest(self) -> dict[str, object]:
        """The dive that is fastest over the ground, with the net buoyancy of the card."""
        return asdict(self.study.design.fastest_glide)

    @property
    def glides(self) -> pd.DataFrame:
        """The steady glides at the angles that were given: deg, m/s, m, kg; + up, and starboard side down."""
        return records_frame(self.study.states, GlideState)

    @property
    def path(self) -> pd.DataFrame:
        """The path of the programme by steady glides, at the ends of its steps; empty without a programme."""
        return records_frame(self.study.path, PathPlace)

    @property
    def ranges(self) -> pd.DataFrame:
        """How far the ballast carries, for the best and the fastest glide and those given; empty without ballast."""
        return records_frame(self.study.design.ranges, Range)

    @property
    def title(self) -> str:
        """The glider."""
        return self.study.glider

    @property
    def subtitle(self) -> str:
        """Source of its numbers."""
        return f"Underwater glider; {self.study.source}"

    @property
    def headline(self) -> tuple[str, ...]:
        """The limits of gliding, and how far the transient model ends from the path of steady glides."""
        least, fastest = self.study.design.smallest_angle_deg, self.study.design.fastest_glide
        lines = [
            f"{self.study.glider}: no glide below {least:.3f} deg. There it goes "
            f"{1 / math.tan(math.radians(least)):.3f} m over the ground for 1 m of depth, at "
            f"{self.study.design.best_glide.speed_mps:.4g} m/s. It is fastest over the ground at "
            f"{-fastest.path_angle_deg:.2f} deg, {fastest.horizontal_speed_mps:.4g} m/s (net buoyancy "
            f"{self.study.buoyancy_kg:g} kg)."
        ]
        if transient := self.study.transient:
            far = transient.distance_m
            lines.append(
                f"The transient model, with mass and added mass, ends {far[-1]:.3g} m from the path of steady glides; "
                f"at most {far.max():.3g} m, {100 * transient.distance_by_length:.2g} % of the way."
            )
        return tuple(lines)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Smallest angle, distance for its depth, fastest glide, distance of the transient model."""
        least, fastest = self.study.design.smallest_angle_deg, self.study.design.fastest_glide
        distance, fast = 1 / math.tan(math.radians(least)), f"{fastest.horizontal_speed_mps:.4g} m/s"
        figures = [
            KeyFigure("Smallest path angle", least, "deg", note="the best glide"),
            KeyFigure("Distance for each metre of depth", distance, "m", note="at this angle"),
            KeyFigure("Fastest over the ground", -fastest.path_angle_deg, "deg", note=fast),
        ]
        if transient := self.study.transient:
            label, far = "Programme flown by the transient model", float(transient.distance_m.max())
            note = "farthest from the path of steady glides"
            figures.append(KeyFigure(label, far, "m", note=note))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """Design glides and polar, steady glides, the path of a programme, quasi-steady errors."""
        study = self.study
        sections = [self._design()]
        if study.states:
            sections.append(self._glides())
        if study.path:
            sections.append(self._path())
        if study.quasi_steady_error:
            sections.append(_quasi_steady(study.quasi_steady_error))
        return sections

    def _design(self) -> Section:
        design = self.study.design
        marked = {"best glide": design.best_glide, "fastest over the ground": design.fastest_glide}
        caption = f"Design glides, net buoyancy {self.study.buoyancy_kg:g} kg"
        tables = [records_table(caption, marked, first="glide", fields=_STATE, on_screen=False)]
        if design.ranges:
            first = design.ranges[0]
            rows: list[list[Cell]] = [
                [
                    each.path_angle_deg,
                    each.buoyancy_kg,
                    each.cycles,
                    each.range_m / 1000,
                    each.duration_s / 86400,
                    each.energy_J / 1000,
                ]
                for each in design.ranges
            ]
            heads = (
                *("path angle (deg)", "net buoyancy (kg)", "cycles", "range (km)", "time (days)"),
                "work against the pressure (kJ)",
            )
            caption = f"Range on {first.budget_kg:g} kg of ballast pushed out at {first.depth_m:g} m"
            tables.append(table(caption, heads, rows))
        polar = Illustration(
            polar_chart(self.study.polar, marked),
            caption="From the best glide to almost straight down. Grey: the path of the best glide; no path is less "
            "steep.",
        )
        return Section(
            "Best glides",
            text="The path angle, not the buoyancy, settles incidence and ratio of lift to drag; speeds go with the "
            f"root of the net buoyancy, here {self.study.buoyancy_kg:g} kg. Below the smallest angle the drag is too "
            "large for the lift at any incidence.",
            tables=tables,
            charts=[polar],
        )

    def _glides(self) -> Section:
        glides, printed, columns = self.study.states, self.study.as_printed, dict(_STATE)
        first = glides[0]
        turning = math.isfinite(first.turning_radius_m)
        if turning:
            columns |= {"turning_radius_m": "", "turning_radius_with_added_mass_m": "radius with added mass"}
        if first.ballast_kg is not None:
            columns["ballast_kg"] = ""
        caption = f"Steady glides, net buoyancy {abs(first.buoyancy_kg):g} kg, roll {first.roll_deg:g} deg"
        tables = [records_table(caption, glides, fields=columns)]
        if printed:
            tables.append(_printed_table(glides, printed, turning=turning))
        return Section("Steady glides", text=f"{_SIGNS}{_TURNS if turning else ''}.", tables=tables)

    def _path(self) -> Section:
        study = self.study
        tables = [_path_table("Path of steady glides, start and end of each step", study.path)]
        paths = {"steady glides": study.path_histories}
        if study.transient:
            paths["transient"] = study.transient.histories
        if study.path_as_printed:
            tables.append(_path_table("Path by the equations as printed", study.path_as_printed))
            paths["as printed"] = study.path_as_printed_histories
        isometric = isometric_chart("steady glides", study.path_histories, study.path)
        charts = [
            Illustration(plan_chart(paths)),
            Illustration(elevation_chart(paths)),
            Illustration(
                isometric,
                caption="Plumb lines lead from the shadow, at the height of the start, to the ends of the steps.",
            ),
        ]
        if study.transient:
            charts.append(Illustration(programme_chart(study.transient)))
        return Section("Path of the programme", tables=tables, charts=charts)


def _printed_table(glides: Sequence[BalancedGlide], printed: Sequence[BalancedGlide], *, turning: bool) -> Table:
    """The glides by the paper's own equations, with their errors."""
    ratios = [wrong.speed_mps / right.speed_mps for wrong, right in zip(printed, glides, strict=True)]
    factors = ", ".join(f"{ratio:.3g}" for ratio in ratios)
    columns = _STATE | ({"turning_radius_m": ""} if turning else {})
    shown = records_table("The same by the equations as printed", printed, fields=columns)
    return table(
        shown.caption,
        [*shown.columns, Column("speed over that above", digits=3)],
        [[*row, ratio] for row, ratio in zip(shown.rows, ratios, strict=True)],
        f"Printed speeds are {factors} times the right ones: they balance the drag alpha (C_D0 + C_D alpha), which "
        "differs from (7).",
        f"By lift and drag of (6) and (7) the printed glides are off balance by {_unbalance(printed)}, those above by "
        f"{_unbalance(glides)}.",
    )


def _unbalance(glides: Sequence[BalancedGlide]) -> str:
    """The largest force that is left."""
    residual = max(abs(force) for glide in glides for force in glide.force_residual_N)
    return f"up to {residual:.2g} N" if residual > _ROUNDING_N else "nothing"


def _path_table(caption: str, places: Sequence[PathPlace]) -> Table:
    words = {"t_s": "time", "x_m": "north x", "y_m": "east y", "height_m": "", "heading_deg": ""}
    return records_table(caption, places, fields=words)


def _quasi_steady(errors: QuasiSteadyErrors) -> Section:
    swings = swing_chart(errors.swings)
    steps = quasi_steady_chart(errors.steps)
    return Section(
        "How slowly the controls must change",
        text="A path of steady glides holds where the controls change slowly. The transient model, with mass and added "
        "mass, shows how slowly: it flies swings and steps of the controls.",
        folded=True,
        charts=[Illustration(swings, caption=_SWINGS), Illustration(steps, caption=_STEPS)],
    )


SpacePaths = Mapping[str, Columns]
"""Label to the columns of a path in space in the order of time: ``x_m`` north, ``y_m`` east, ``height_m``."""


def plan_chart(paths: SpacePaths) -> ChartSpec:
    """Paths from above: north up, east to the right, one scale."""
    drawn = [(label, vector(path["y_m"]), vector(path["x_m"])) for label, path in paths.items()]
    return _plane(drawn, ("east y (m)", "north x (m)"), title="Path from above", height_px=480)


def elevation_chart(paths: SpacePaths) -> ChartSpec:
    """Paths from the side, rolled out: height above the start against the way over the ground, one scale."""
    drawn = []
    for label, path in paths.items():
        steps = np.hypot(np.diff(vector(path["x_m"])), np.diff(vector(path["y_m"])))
        drawn.append((label, np.concatenate([[0.0], np.cumsum(steps)]), vector(path["height_m"])))
    return _plane(
        drawn, ("way over the ground (m)", "height (m)"), title="Path from the side, rolled out", height_px=360
    )


def isometric_chart(label: str, path: Columns, corners: Sequence[PathPlace]) -> ChartSpec:
    """A path in isometric projection: north to the upper right, east to the lower right, height up, one scale.

    Its shadow is drawn at the height of the start, and plumb lines from there to the `corners` of the path `label`.
    """
    north, east, height = (vector(path[name]) for name in ("x_m", "y_m", "height_m"))
    drawn = [(label, *_projected(north, east, height)), ("seen from above", *_projected(north, east, 0 * height))]
    arm = 0.25 * max(1.0, float(np.abs(north).max()), float(np.abs(east).max()))
    lines = [
        (name, name, [(0.0, 0.0), _projected(*end)])
        for name, end in (("north", (arm, 0, 0)), ("east", (0, arm, 0)), ("up", (0, 0, arm)))
    ]
    for number, place in enumerate(corners):
        ends = [_projected(place.x_m, place.y_m, height_m) for height_m in (0.0, place.height_m)]
        lines.append((f"plumb {number}", "", ends))
    arms: list[ChartRecord] = [
        {"axis": axis, "name": name if i else "", "x": float(across), "v": float(up), "i": i}
        for axis, name, points in lines
        for i, (across, up) in enumerate(points)
    ]
    return _plane(drawn, ("", ""), title="Path in isometric projection", height_px=480, arms=arms)


def _projected(north: Any, east: Any, height: Any) -> tuple[Any, Any]:
    """Across and up in isometric projection."""
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    return cos * (north + east), sin * (north - east) + height


def polar_chart(polar: Columns, marked: Mapping[str, GlideState]) -> ChartSpec:
    """The polar: speed down against speed over the ground, with marked glides."""
    line = PlotSeries(
        "polar",
        x=polar["horizontal_speed_mps"],
        y=-polar["climb_mps"],
        closed=True,
        more={"angle": np.abs(polar["path_angle_deg"])},
    )
    glides = [
        PlotSeries(
            label,
            x=[glide.horizontal_speed_mps],
            y=[-glide.climb_mps],
            points=True,
            more={"angle": [abs(glide.path_angle_deg)]},
        )
        for label, glide in marked.items()
    ]
    best = max(marked.values(), key=lambda glide: glide.horizontal_speed_mps / -glide.climb_mps)
    across = PlotAxis("speed over the ground (m/s)", zero=True)
    up = PlotAxis("speed down (m/s)", zero=True, scale={"reverse": True})
    tangent = [{"x": 0.0, "v": 0.0}, {"x": best.horizontal_speed_mps, "v": -best.climb_mps}]
    over = [layer("line", tangent, {"x": across.channel("x"), "y": up.channel("v")}, style="reference")]
    return curve_chart(
        Plot([line, *glides], up=up, height_px=380, over=over),
        across,
        title="Glide polar",
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


def programme_chart(transient: TransientPath) -> ChartSpec:
    """Orders and the motion of the transient model over time."""
    histories = []
    for label, columns in (("orders and steady glides", transient.orders), ("transient", transient.histories)):
        values = {name: to_si(name, 1.0)[1] * columns[name] for name in _PROGRAMME}
        histories.append(History(label, time_s=columns["t_s"], values=values))
    panels = [Signal(name, words, unit) for name, (words, unit) in _PROGRAMME.items()]
    return history_chart(histories, panels, title="Programme and motion", height_px=90)


def quasi_steady_chart(errors: Sequence[ProgrammeError]) -> ChartSpec:
    """Largest distance from the transient path, per cent of the way, against the length of a step."""
    series = [(error.label, error.duration_s, error.share) for error in errors]
    return _errors(
        series,
        ("length of a step (s)", "distance of the paths (% of the way)"),
        title="Error of the quasi-steady path, steps",
    )


def swing_chart(errors: Sequence[SwingError]) -> ChartSpec:
    """Error of velocity or rate of turn, per cent, against the period of a swing."""
    series = [(error.label, error.period_s, error.share) for error in errors]
    return _errors(series, ("period of the swing (s)", "error (%)"), title="Error of the quasi-steady motion, swings")


def _errors(series: Sequence[tuple[str, Array, Array]], titles: tuple[str, str], *, title: str) -> ChartSpec:
    """Shares in per cent against times, both logarithmic."""
    curves = [PlotSeries(label, x=time, y=100 * share) for label, time, share in series]
    across = PlotAxis(titles[0], log=True, nice=False, padding=12, form="~g")
    up = PlotAxis(titles[1], log=True, form="~g")
    text = ", ".join(label for label, _, _ in series)
    place = {"x": across.channel("x"), "y": up.channel("v"), "color": look_of(curves).colour}
    dots = layer("point", [row for curve in curves for row in curve.rows], place, clip=True, filled=True)
    return curve_chart(
        Plot(curves, up=up, height_px=340, over=[dots]),
        across,
        title=title,
        width_px=680,
        described=f"{titles[1]} against {titles[0]} of {text}.",
        shown={"run:N": "programme"},
    )


def _plane(
    drawn: Sequence[tuple[str, Array, Array]],
    titles: tuple[str, str],
    *,
    title: str,
    height_px: int,
    arms: Sequence[ChartRecord] = (),
) -> ChartSpec:
    """Lines in a plane with one scale; with `arms`, lines of reference with a name at their end, there are no axes."""
    labels, across, up = zip(*drawn, strict=True)
    ends = vector([arm["x"] for arm in arms]), vector([arm["v"] for arm in arms])
    both = np.concatenate([*across, ends[0]]), np.concatenate([*up, ends[1]])
    frame = equal_frame(*both, width_px=680, height_px=height_px)
    place = frame.axes(across=("x", titles[0]), up=("v", titles[1]))
    if arms:
        place = {name: axis | {"axis": None} for name, axis in place.items()}
    series = [PlotSeries(label, x=x, y=y, closed=True) for label, x, y in drawn]
    look = look_of(series)
    marks = {**place, "color": look.colour, "strokeDash": look.dash, "order": "i:Q"}
    return layered(
        [layer("line", [row for each in series for row in each.rows], marks, clip=True), *_arm_layers(arms, place)],
        size=(frame.width_px, frame.height_px),
        window=["x", "y"],
        title=title,
        description=f"Paths of {', '.join(labels)}; both axes have one scale.",
        usermeta={"equal_scales": True},
    )


def _arm_layers(arms: Sequence[ChartRecord], place: ChartSpec) -> list[ChartSpec]:
    """Lines of reference with their names, if there are any."""
    if not arms:
        return []
    along, text = {**place, "detail": "axis:N", "order": "i:Q"}, {**place, "text": "name:N"}
    return [
        layer("line", arms, along, style="reference", strokeWidth=0.8, clip=True),
        layer("text", arms, text, style="reference", dx=5, align="left", clip=True),
    ]
