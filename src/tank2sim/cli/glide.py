"""``tank2sim glide``: steady glides, paths and design views of an underwater glider."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import click
from rich.markup import escape

from tank2sim.analysis.glide.design import Range
from tank2sim.analysis.glide.path import GlidePath
from tank2sim.analysis.glide.steady import SteadyGlide, ballast_kg, force_residual
from tank2sim.analysis.glide.study import GlideQuestion, GlideStudy, study
from tank2sim.cards import GliderCard, read_card
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.cli.overrides import parse_changes
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.simulation.glide_programme import read_programme

_PROBE = "kulikovsky-velikanov"


@click.command("glide")
@click.argument("further", nargs=-1, metavar="[A ...]")
@click.option("--card", default=_PROBE, show_default=True, metavar="CARD", help="A file, or a bundled glider's name.")
@click.option("--angle-deg", "angles", multiple=True, metavar="A",
              help="Angle of a steady path, + to climb, - to dive; several: repeat it, or 25,-30.")  # fmt: skip
@click.option("--roll-deg", type=float, default=0.0, metavar="G", help="Roll of these glides, + starboard side down.")
@click.option("--buoyancy-kg", type=click.FloatRange(min=0, min_open=True), metavar="M",
              help="Size of the net buoyancy of these glides; by default the card's.")  # fmt: skip
@click.option("--reference-area-m2", "area", type=float, metavar="S", help="Area of the coefficients, for the card's.")
@click.option("--programme", type=click.Path(path_type=Path), metavar="FILE",
              help="A path: CSV of steps duration_s, path_angle_deg or pitch_deg, roll_deg, buoyancy_kg.")  # fmt: skip
@click.option("--as-printed", is_flag=True, help="Beside them what the paper's equations give as they are printed.")
@click.option("--budget-kg", type=float, metavar="B", help="Ballast to push out in all: how far it carries ...")
@click.option("--depth-m", type=float, metavar="H", help="... between the surface and this depth.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's.")
@click.option("-o", "--page", type=click.Path(path_type=Path), metavar="PAGE.html", help="All as a page with charts.")
@json_option
def command(**options: object) -> None:
    """Fly an underwater glider: steady glides at given angles, the path of a programme, and what is best.

    The transient model flies the programme next to the strung steady glides, and tells how far they are apart.
    """
    wanted = _Wanted(**options)  # type: ignore[arg-type]  # click has checked them
    card = wanted.glider()
    found = study(card, wanted.question())
    contents: dict[Path, str | bytes] = {}
    if wanted.json_file:
        contents[wanted.json_file] = json_text(found.as_json())
    if wanted.page:
        contents[wanted.page] = _page(found)
    inputs = [Path(card.source), *([wanted.programme] if wanted.programme else [])]
    write_together(contents, inputs=inputs, outputs=[wanted.json_file, wanted.page])
    _show(found)


@dataclass(frozen=True, kw_only=True)
class _Wanted:
    """The options."""

    card: str
    angles: tuple[str, ...]
    further: tuple[str, ...]
    roll_deg: float
    buoyancy_kg: float | None
    area: float | None
    programme: Path | None
    as_printed: bool
    budget_kg: float | None
    depth_m: float | None
    settings: tuple[str, ...]
    page: Path | None
    json_file: Path | None

    def glider(self) -> GliderCard:
        """The card, with the settings."""
        changes = parse_changes(self.settings)
        if self.area is not None:
            changes["glider.reference_area_m2"] = self.area
        card = read_card(self.card, changes)
        if not isinstance(card, GliderCard):
            raise card.fault(
                "model.kind", f"is {card.model.kind}", f"a card of kind glider is needed, such as {_PROBE}"
            )
        return card

    def question(self) -> GlideQuestion:
        """What is asked."""
        return GlideQuestion(
            angles_rad=tuple(self._angles()),
            roll_rad=math.radians(self.roll_deg),
            buoyancy_kg=self.buoyancy_kg,
            programme=read_programme(self.programme) if self.programme else None,
            as_printed=self.as_printed,
            budget_kg=self.budget_kg,
            depth_m=self.depth_m,
            views=self.page is not None,
        )

    def _angles(self) -> list[float]:
        if self.further and not self.angles:
            raise InputError(
                self.further[0], "", "stands alone", "a card goes after --card, an angle after --angle-deg"
            )
        texts = [text.strip() for group in (*self.angles, *self.further) for text in group.split(",")]
        try:
            return [math.radians(float(text)) for text in texts]
        except ValueError:
            remedy = "give degrees, several with commas: --angle-deg 25,30"
            raise InputError("--angle-deg", "", f"{','.join(texts)!r} is no angle", remedy) from None


def _page(found: GlideStudy) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.glide.page import glide_page
    from tank2sim.report.kit.page import render_page

    return render_page(glide_page(found))


_HEADS = ("path (deg)", "alpha (deg)", "pitch (deg)", "v (m/s)", "C_L", "C_D", "R (m)")
"""Of a steady glide; all have one roll and one size of buoyancy."""
_ROUNDING_N = 1e-9
"""Forces below this are what arithmetic leaves of an equilibrium: project choice."""


def _show(found: GlideStudy) -> None:
    best, fastest = found.best, found.fastest
    screen.print(
        f"{escape(found.card.ship.name)}: no glide below {math.degrees(found.smallest_angle_rad):.3f} deg, "
        f"where it goes {1 / math.tan(found.smallest_angle_rad):.3f} m over the ground for 1 m of depth at "
        f"{best.speed_mps:.4g} m/s; fastest over the ground at {-math.degrees(fastest.path_angle_rad):.2f} deg, "
        f"{fastest.horizontal_speed_mps:.4g} m/s (net buoyancy {found.card.glider.buoyancy_kg:g} kg)",
        soft_wrap=True,
    )
    if found.glides:
        _show_glides(found)
    if found.path:
        _show_path("Path of steady glides", found.path)
    if found.printed_path:
        _show_path("Path by the equations as printed", found.printed_path)
    if found.compared:
        screen.print(
            f"The transient model, with mass and added mass, ends {found.compared.distance_m[-1]:.3g} m from there; "
            f"at most {found.compared.distance_m.max():.3g} m, {100 * found.compared.share:.2g} % of the way",
            soft_wrap=True,
        )
    if found.ranges:
        _show_ranges(found.ranges)
    show_notices(found.notices)


def _show_glides(found: GlideStudy) -> None:
    first = found.glides[0]
    title = f"Steady glides, net buoyancy {abs(first.buoyancy_kg):g} kg, roll {math.degrees(first.roll_rad):g} deg"
    heads, rows = list(_HEADS), [_row(glide) for glide in found.glides]
    if first.turn_rate_radps:
        heads.append("R* (m)")
        rows = [[*row, _radius(radius)] for row, radius in zip(rows, found.radii_m, strict=True)]
    if found.card.glider.hull_mass_kg is not None:
        heads.append("ballast (kg)")
        ballast = [ballast_kg(found.card, glide.buoyancy_kg) for glide in found.glides]
        rows = [[*row, None if kg is None else f"{kg:.4g}"] for row, kg in zip(rows, ballast, strict=True)]
    show_table(title, heads, rows)
    if first.turn_rate_radps:
        screen.print("R*: of the transient model, which has the added mass", soft_wrap=True)
    if found.printed:
        show_table("The same as the paper prints it", _HEADS, [_row(glide) for glide in found.printed])
        ratios = [a.speed_mps / b.speed_mps for a, b in zip(found.printed, found.glides, strict=True)]
        text = ", ".join(f"{ratio:.3g}" for ratio in ratios)
        why = "the drag that they balance, alpha (C_D0 + C_D alpha), is not that of (7)"
        screen.print(f"Printed speeds are {text} times the right ones: {why}", soft_wrap=True)
        printed, right = _unbalance(found, found.printed), _unbalance(found, found.glides)
        screen.print(
            f"By lift and drag of (6) and (7) the printed glides are off balance by {printed}, those above by {right}",
            soft_wrap=True,
        )


def _unbalance(found: GlideStudy, glides: tuple[SteadyGlide, ...]) -> str:
    """The largest force that is left."""
    left = max(abs(force) for glide in glides for force in force_residual(found.card, glide))
    return f"up to {left:.2g} N" if left > _ROUNDING_N else "nothing"


def _row(glide: SteadyGlide) -> list[object]:
    path, alpha, pitch = (math.degrees(one) for one in (glide.path_angle_rad, glide.incidence_rad, glide.pitch_rad))
    others = (glide.speed_mps, glide.lift_coefficient, glide.drag_coefficient)
    shown = [f"{path:.3f}", f"{alpha:.4f}", f"{pitch:.3f}", *(f"{value:.4f}" for value in others)]
    return [*shown, _radius(glide.turning_radius_m)]


def _radius(radius: float) -> str:
    return f"{radius:.3f}" if math.isfinite(radius) else "-"


def _show_ranges(ranges: tuple[Range, ...]) -> None:
    heads = ["path (deg)", "buoyancy (kg)", "cycles", "range (km)", "days", "energy (kJ)"]
    rows: list[list[object]] = []
    for one in ranges:
        far, long, work = one.range_m / 1000, one.duration_s / 86400, one.energy_J / 1000
        rows.append([math.degrees(one.path_angle_rad), one.buoyancy_kg, one.cycles, far, long, work])
    show_table(f"Range on {ranges[0].budget_kg:g} kg of ballast pushed out at {ranges[0].depth_m:g} m", heads, rows)


def _show_path(title: str, path: GlidePath) -> None:
    rows = [
        [place.time_s, place.north_m, place.east_m, place.height_m, math.degrees(place.heading_rad)]
        for place in path.places
    ]
    show_table(title, ["t (s)", "x (m)", "y (m)", "height (m)", "heading (deg)"], rows)
