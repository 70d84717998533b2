"""``tank2sim export``: the FMU of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.fmu import make_fmu_file
from tank2sim.api.ship import load
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import OutputFile, set_option
from tank2sim.cli.progress import showing_stages
from tank2sim.errors import InputError
from tank2sim.files import FMU, SYSTEM
from tank2sim.fmu.platforms import PLATFORMS


@click.command("export")
@click.argument("card")
@click.option("-o", "--output", required=True, type=OutputFile(FMU), metavar="SHIP.fmu", help="The FMU.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI.")
@click.option(
    "--platforms",
    default="host",
    show_default=True,
    metavar="all|host|LIST",
    help=f"Platforms of the libraries: all, that of this machine, or of {', '.join(each.fmi3 for each in PLATFORMS)} "
    "with commas between.",
)
@set_option
@click.option(
    "--sources/--no-sources",
    default=True,
    show_default=True,
    help="With the C sources and the ship card, or without them and with coefficients that cannot be read or tuned.",
)
@click.option(
    "--ssp",
    type=OutputFile(SYSTEM),
    metavar="SYSTEM.ssp",
    help="Also an SSP package in which a heading autopilot steers the ship.",
)
@click.option(
    "--ssp-inputs",
    is_flag=True,
    help="Every input in that package is a connector, also those that nothing is joined to.",
)
@click.option(
    "--osp", is_flag=True, help="Also OspSystemStructure.xml and the OSP model description, next to the FMU (FMI 2)."
)
@json_option
def command(
    card: str,
    output: Path,
    fmi: str,
    platforms: str,
    values: dict[str, object],
    sources: bool,
    ssp: Path | None,
    ssp_inputs: bool,
    osp: bool,
    json_file: Path | None,
) -> None:
    """Write the FMU (Model Exchange and Co-Simulation) of CARD (a file, or the name of a bundled ship)."""
    if ssp_inputs and ssp is None:
        raise InputError("--ssp-inputs", "", "needs an SSP package", "give --ssp too")
    ship = load(card, values)
    with showing_stages("making the FMU") as report:
        result = make_fmu_file(
            ship,
            output,
            fmi=int(fmi),
            platforms=platforms,
            ssp=ssp,
            ssp_inputs=ssp_inputs,
            sources=sources,
            osp=osp,
            report=report,
        )
    write_result(result, [ship.card.source], json_file=json_file, files=result.files)
    show_result(result)
