"""``tank2sim tow``: surge mass and drag from accelerating tows."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.tow import tow as identify_tow
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, page_option, plot_folder_option
from tank2sim.errors import InputError
from tank2sim.files import CARD
from tank2sim.identification.tow.force import parse_force
from tank2sim.identification.tow.identify import TOW_METHODS


@click.command("tow")
@click.argument("tow", type=click.Path(path_type=Path))
@click.option(
    "--force-N", "--force-n", "force", type=float, metavar="F", help="Towing force, N; else that in the file."
)
@click.option(
    "--force-polynomial",
    metavar="C0,C1,...",
    help="A force that varies, N: T = C0 + C1 t + C2 t^2 + ..., t in s from the release.",
)
@click.option(
    "--mass-kg", "mass", type=float, metavar="M", help="Mass with the water inside, kg; else that in the file."
)
@click.option("--terms", default="B3,B2,B1", show_default=True, help="Drag terms of (1.5) in addition to M; or none.")
@click.option("--start-delay", is_flag=True, help="Let the body start late, by a time that output_error estimates.")
@click.option("--total-mass-kg", "total_mass", type=float, metavar="M", help="Hold M at this; estimate drag alone.")
@click.option("--length-m", type=float, metavar="L", help="Length, for drag coefficients; else that in the file.")
@click.option("--beam-m", type=float, metavar="B", help="Breadth, for the mass by theory; else that in the file.")
@click.option("--volume-m3", type=float, metavar="V", help="Volume; else that in the file, or of a body that floats.")
@click.option(
    "--method",
    type=click.Choice(TOW_METHODS),
    default="output_error",
    show_default=True,
    help="Whose numbers the card gets.",
)
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write a surge card.")
@page_option()
@plot_folder_option
@json_option
def command(
    tow: Path,
    force: float | None,
    force_polynomial: str | None,
    mass: float | None,
    terms: str,
    start_delay: bool,
    total_mass: float | None,
    length_m: float | None,
    beam_m: float | None,
    volume_m3: float | None,
    method: str,
    output: Path | None,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Estimate M and drag of M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T from the tows in TOW (a CSV).

    Models of other size, each tow by itself and the mass by theory show what the tows determine.
    """
    if force is not None and force_polynomial is not None:
        raise InputError("--force-polynomial", "", "does not go with --force-N", "give one of them")
    result = identify_tow(
        tow,
        force_N=force if force_polynomial is None else parse_force(force_polynomial).coef.tolist(),
        mass_kg=mass,
        terms=terms,
        start_delay=start_delay,
        total_mass_kg=total_mass,
        length_m=length_m,
        beam_m=beam_m,
        volume_m3=volume_m3,
        method=method,
        name=output.stem if output else None,
    )
    files = result.card.files(output) if output else {}
    write_result(result, [tow], json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
    if output:
        screen.print(f"{output}: the card has the numbers of {result.method}", soft_wrap=True, markup=False)
