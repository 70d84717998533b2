"""``tank2sim glide``: steady glides, paths and design views of an underwater glider."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from tank2sim.apps.rigs.glider.command import BUNDLED_GLIDER
from tank2sim.arguments import PositiveArgument
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import number, page_option, plot_option, set_option
from tank2sim.errors import InputError
from tank2sim.ship import load


@click.command("glide")
@click.argument("further", nargs=-1, metavar="[A ...]")
@click.option("--card", default=BUNDLED_GLIDER, show_default=True, metavar="CARD",
              help="A file, or a bundled glider's name.")  # fmt: skip
@click.option("--angle-deg", "angles", multiple=True, metavar="A",
              help="Angle of a steady path, + to climb, - to dive; several: repeat it, or 25,-30.")  # fmt: skip
@click.option("--roll-deg", type=float, default=0.0, metavar="G", help="Roll of these glides, + starboard side down.")
@click.option("--buoyancy-kg", type=number(PositiveArgument), metavar="M",
              help="Size of the net buoyancy of these glides; by default the card's.")  # fmt: skip
@click.option("--reference-area-m2", "area", type=float, metavar="S", help="Area of the coefficients, for the card's.")
@click.option("--programme", type=click.Path(path_type=Path), metavar="FILE",
              help="A path: CSV of steps duration_s, path_angle_deg or pitch_deg, roll_deg, buoyancy_kg.")  # fmt: skip
@click.option("--as-printed", is_flag=True, help="Also what the published equations give as they are printed.")
@click.option("--budget-kg", type=float, metavar="B", help="Ballast to push out in all: how far it carries ...")
@click.option("--depth-m", type=float, metavar="H", help="... between the surface and this depth.")
@set_option
@page_option("-o")
@plot_option
@json_option
def command(
    card: str,
    angles: tuple[str, ...],
    further: tuple[str, ...],
    roll_deg: float,
    buoyancy_kg: float | None,
    area: float | None,
    programme: Path | None,
    as_printed: bool,
    budget_kg: float | None,
    depth_m: float | None,
    values: dict[str, object],
    page: Path | None,
    plot: Path | None,
    json_file: Path | None,
) -> None:
    """Fly an underwater glider: steady glides at given angles, the path of a programme, and what is best.

    The transient model flies the programme, too, and shows how far it ends from the path of steady glides.
    """
    if further and not angles:
        remedy = "a card goes after --card, an angle after --angle-deg"
        raise InputError(further[0], "", "is given alone", remedy)
    ship = load(card, values if area is None else {**values, "glider.reference_area_m2": area})
    result = ship.glide(
        _parse_angles((*angles, *further)),
        roll_deg=roll_deg,
        buoyancy_kg=buoyancy_kg,
        programme=programme,
        as_printed=as_printed,
        budget_kg=budget_kg,
        depth_m=depth_m,
        views=page is not None,
    )
    inputs = [Path(ship.card.source), *([programme] if programme else [])]
    write_result(result, inputs, json_file=json_file, page=page, plot=plot)
    show_result(result)


def _parse_angles(groups: Sequence[str]) -> list[float]:
    texts = [text.strip() for group in groups for text in group.split(",")]
    try:
        return [float(text) for text in texts]
    except ValueError:
        remedy = "give degrees, several with commas: --angle-deg 25,30"
        raise InputError("--angle-deg", "", f"{','.join(texts)!r} is not an angle", remedy) from None
