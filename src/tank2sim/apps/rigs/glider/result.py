"""Result of ``glide``: steady glides, paths and ranges of an underwater glider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, records_table, table
from tank2sim.answer.result import Result
from tank2sim.apps.rigs.glider.charts import (
    corners_of,
    elevation_chart,
    isometric_chart,
    plan_chart,
    polar_chart,
    programme_chart,
    quasi_steady_chart,
    space_path,
    swing_chart,
)
from tank2sim.apps.rigs.glider.study import (
    BalancedGlide,
    GlideState,
    GlideStudy,
    PathPlace,
    QuasiSteadyErrors,
    TransientPath,
)

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
        import pandas as pd

        names = [part.name for part in fields(GlideState)]
        return pd.DataFrame([{name: getattr(glide, name) for name in names} for glide in self.study.states])

    @property
    def path(self) -> pd.DataFrame:
        """The path of the programme by steady glides, at the ends of its steps; empty without a programme."""
        import pandas as pd

        return pd.DataFrame([asdict(place) for place in self.study.path])

    @property
    def ranges(self) -> pd.DataFrame:
        """How far the ballast carries, for the best and the fastest glide and those given; empty without ballast."""
        import pandas as pd

        return pd.DataFrame([asdict(each) for each in self.study.design.ranges])

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
            KeyFigure(label="Smallest path angle", value=least, unit="deg", note="the best glide"),
            KeyFigure(label="Distance for each metre of depth", value=distance, unit="m", note="at this angle"),
            KeyFigure(label="Fastest over the ground", value=-fastest.path_angle_deg, unit="deg", note=fast),
        ]
        if transient := self.study.transient:
            label, far = "Programme flown by the transient model", float(transient.distance_m.max())
            note = "farthest from the path of steady glides"
            figures.append(KeyFigure(label=label, value=far, unit="m", note=note))
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
            chart=polar_chart(self.study.polar, marked, title="Glide polar"),
            caption="From the best glide to almost straight down. Grey: the path of the best glide; no path is less "
            "steep.",
        )
        return Section(
            heading="Best glides",
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
        return Section(heading="Steady glides", text=f"{_SIGNS}{_TURNS if turning else ''}.", tables=tables)

    def _path(self) -> Section:
        study = self.study
        tables = [_path_table("Path of steady glides, start and end of each step", study.path)]
        paths = [space_path("steady glides", study.path_histories)]
        if study.transient:
            paths.append(space_path("transient", study.transient.histories))
        if study.path_as_printed:
            tables.append(_path_table("Path by the equations as printed", study.path_as_printed))
            paths.append(space_path("as printed", study.path_as_printed_histories))
        charts = [
            Illustration(chart=plan_chart(paths, title="Path from above")),
            Illustration(chart=elevation_chart(paths, title="Path from the side, rolled out")),
            Illustration(
                chart=isometric_chart(paths[0], corners_of(study.path), title="Path in isometric projection"),
                caption="Plumb lines lead from the shadow, at the height of the start, to the ends of the steps.",
            ),
            *_programme(study.transient),
        ]
        return Section(heading="Path of the programme", tables=tables, charts=charts)


def _programme(transient: TransientPath | None) -> list[Illustration]:
    return [Illustration(chart=programme_chart(transient, title="Programme and motion"))] if transient else []


def _printed_table(glides: Sequence[BalancedGlide], printed: Sequence[BalancedGlide], *, turning: bool) -> Table:
    """The glides by the paper's own equations, with their errors."""
    ratios = [wrong.speed_mps / right.speed_mps for wrong, right in zip(printed, glides, strict=True)]
    factors = ", ".join(f"{ratio:.3g}" for ratio in ratios)
    columns = _STATE | ({"turning_radius_m": ""} if turning else {})
    shown = records_table("The same by the equations as printed", printed, fields=columns)
    return table(
        shown.caption,
        [*shown.columns, Column(title="speed over that above", digits=3)],
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
    swings = swing_chart(errors.swings, title="Error of the quasi-steady motion, swings")
    steps = quasi_steady_chart(errors.steps, title="Error of the quasi-steady path, steps")
    return Section(
        heading="How slowly the controls must change",
        text="A path of steady glides holds where the controls change slowly. The transient model, with mass and added "
        "mass, shows how slowly: it flies swings and steps of the controls.",
        folded=True,
        charts=[Illustration(chart=swings, caption=_SWINGS), Illustration(chart=steps, caption=_STEPS)],
    )
