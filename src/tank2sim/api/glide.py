"""Steady glides, paths and ranges of an underwater glider, as a result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tank2sim.analysis.glide.path import GlidePath
from tank2sim.analysis.glide.steady import SteadyGlide, ballast_kg, force_residual
from tank2sim.analysis.glide.study import GlideQuestion, GlideStudy, study
from tank2sim.answer.parts import Table
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import GliderCard

if TYPE_CHECKING:
    import pandas as pd

BUNDLED_GLIDER = "kulikovsky-velikanov"
"""Name of the bundled glider."""

_COLUMNS = ("path (deg)", "alpha (deg)", "pitch (deg)", "v (m/s)", "C_L", "C_D", "R (m)")
"""Of a steady glide; all have one roll and one size of buoyancy."""

_ROUNDING_N = 1e-9
"""Forces below this are rounding of an equilibrium. Project choice: a millionth of the smallest net buoyancy."""


class GlideResult(PagedResult):
    """Steady glides, paths and ranges of an underwater glider.

    Parameters
    ----------
    found : GlideStudy
        SI and radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> glider = t2s.load("kulikovsky-velikanov")
    >>> found = glider.glide([-25, -30, -45])
    >>> found.glides["speed_mps"].round(3).tolist()
    [0.203, 0.244, 0.312]
    >>> round(found.smallest_angle_deg, 1)
    23.4
    """

    command = "glide"

    def __init__(self, found: GlideStudy) -> None:
        self.found, self.notices = found, found.notices

    @property
    def smallest_angle_deg(self) -> float:
        """The smallest angle of a path that can be flown without roll, deg."""
        return math.degrees(self.found.smallest_angle_rad)

    @property
    def best(self) -> dict[str, object]:
        """The dive that goes farthest for each metre of depth, with the net buoyancy of the card."""
        return dict(self.found.best.as_json())

    @property
    def fastest(self) -> dict[str, object]:
        """The dive that is fastest over the ground, with the net buoyancy of the card."""
        return dict(self.found.fastest.as_json())

    @property
    def glides(self) -> pd.DataFrame:
        """The steady glides at the angles that were given: deg, m/s, m, kg; + up, and starboard side down."""
        import pandas as pd

        return pd.DataFrame([glide.as_json() for glide in self.found.glides])

    @property
    def path(self) -> pd.DataFrame:
        """The path of the programme by steady glides, at the ends of its steps; empty without a programme."""
        import pandas as pd

        return pd.DataFrame(self.found.path.as_json() if self.found.path else [])

    @property
    def ranges(self) -> pd.DataFrame:
        """How far the ballast carries, for the best and the fastest glide and those given; empty without ballast."""
        import pandas as pd

        return pd.DataFrame([each.as_json() for each in self.found.ranges])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self.found.as_json()

    @property
    def headline(self) -> tuple[str, ...]:
        """The limits of gliding, and how far the transient model ends from the path of steady glides."""
        found = self.found
        least, fastest = found.smallest_angle_rad, found.fastest
        lines = [
            f"{found.card.ship.name}: no glide below {math.degrees(least):.3f} deg, "
            f"where it goes {1 / math.tan(least):.3f} m over the ground for 1 m of depth at "
            f"{found.best.speed_mps:.4g} m/s; fastest over the ground at {-math.degrees(fastest.path_angle_rad):.2f} "
            f"deg, {fastest.horizontal_speed_mps:.4g} m/s (net buoyancy {found.card.glider.buoyancy_kg:g} kg)"
        ]
        if found.compared:
            far = found.compared.distance_m
            lines.append(
                f"The transient model, with mass and added mass, ends {far[-1]:.3g} m from the path of steady glides; "
                f"at most {far.max():.3g} m, {100 * found.compared.share:.2g} % of the way"
            )
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Steady glides, paths and ranges."""
        found = self.found
        tables = [_glide_table(found)] if found.glides else []
        if found.printed:
            tables.append(_printed_table(found))
        if found.path:
            tables.append(_path_table("Path of steady glides", found.path))
        if found.printed_path:
            tables.append(_path_table("Path by the equations as printed", found.printed_path))
        if found.ranges:
            first = found.ranges[0]
            tables.append(
                screen_table(
                    f"Range on {first.budget_kg:g} kg of ballast pushed out at {first.depth_m:g} m",
                    ("path (deg)", "buoyancy (kg)", "cycles", "range (km)", "days", "energy (kJ)"),
                    [
                        [
                            math.degrees(each.path_angle_rad),
                            each.buoyancy_kg,
                            each.cycles,
                            each.range_m / 1000,
                            each.duration_s / 86400,
                            each.energy_J / 1000,
                        ]
                        for each in found.ranges
                    ],
                )
            )
        return tuple(tables)


def glide_with(ship: Ship, question: GlideQuestion) -> GlideResult:
    """Steady glides, paths and ranges. Raises as :meth:`.Ship.glide`."""
    card = ship.card
    if not isinstance(card, GliderCard):
        remedy = f"a card of kind glider is needed, such as {BUNDLED_GLIDER}"
        raise card.fault("model.kind", f"is {card.model.kind}", remedy)
    return GlideResult(study(card, question))


def _glide_table(found: GlideStudy) -> Table:
    first = found.glides[0]
    title = f"Steady glides, net buoyancy {abs(first.buoyancy_kg):g} kg, roll {math.degrees(first.roll_rad):g} deg"
    columns, rows = list(_COLUMNS), [_row(glide) for glide in found.glides]
    notes: tuple[str, ...] = ()
    if first.turn_rate_radps:
        columns.append("R* (m)")
        rows = [[*row, _radius_text(radius)] for row, radius in zip(rows, found.radii_m, strict=True)]
        notes = ("R*: of the transient model, which has the added mass",)
    if found.card.glider.hull_mass_kg is not None:
        columns.append("ballast (kg)")
        ballast = [ballast_kg(found.card, glide.buoyancy_kg) for glide in found.glides]
        rows = [[*row, None if kg is None else f"{kg:.4g}"] for row, kg in zip(rows, ballast, strict=True)]
    return screen_table(title, tuple(columns), rows, notes)


def _printed_table(found: GlideStudy) -> Table:
    """The glides by the paper's own equations, with what is wrong with them."""
    ratios = [a.speed_mps / b.speed_mps for a, b in zip(found.printed, found.glides, strict=True)]
    factors = ", ".join(f"{ratio:.3g}" for ratio in ratios)
    printed, right = (_unbalance_text(found, glides) for glides in (found.printed, found.glides))
    notes = (
        f"Printed speeds are {factors} times the right ones: the drag that they balance, alpha (C_D0 + C_D alpha), is "
        "not that of (7)",
        f"By lift and drag of (6) and (7) the printed glides are off balance by {printed}, those above by {right}",
    )
    return screen_table(
        "The same by the equations as published", _COLUMNS, [_row(glide) for glide in found.printed], notes
    )


def _unbalance_text(found: GlideStudy, glides: tuple[SteadyGlide, ...]) -> str:
    """The largest force that is left."""
    residual = max(abs(force) for glide in glides for force in force_residual(found.card, glide))
    return f"up to {residual:.2g} N" if residual > _ROUNDING_N else "nothing"


def _row(glide: SteadyGlide) -> list[object]:
    angles = (math.degrees(angle) for angle in (glide.path_angle_rad, glide.incidence_rad, glide.pitch_rad))
    path, alpha, pitch = angles
    coefficients = (glide.speed_mps, glide.lift_coefficient, glide.drag_coefficient)
    shown = [f"{path:.3f}", f"{alpha:.4f}", f"{pitch:.3f}", *(f"{value:.4f}" for value in coefficients)]
    return [*shown, _radius_text(glide.turning_radius_m)]


def _radius_text(radius_m: float) -> str:
    return f"{radius_m:.3f}" if math.isfinite(radius_m) else "-"


def _path_table(title: str, path: GlidePath) -> Table:
    columns = ("t (s)", "x (m)", "y (m)", "height (m)", "heading (deg)")
    rows = [
        [place.time_s, place.north_m, place.east_m, place.height_m, math.degrees(place.heading_rad)]
        for place in path.places
    ]
    return screen_table(title, columns, rows)
