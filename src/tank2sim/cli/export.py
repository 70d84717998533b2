"""``tank2sim export``: the FMU of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.progress import showing_stages
from tank2sim.cli.screen import json_option, json_text, screen, show_notices
from tank2sim.dynamics import build
from tank2sim.files import write_together
from tank2sim.fmu.documents import documents_of
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.platforms import PLATFORMS, named_platforms


@click.command("export")
@click.argument("card")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), metavar="SHIP.fmu", help="The FMU.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI.")
@click.option(
    "--platforms",
    default="host",
    show_default=True,
    metavar="all|host|LIST",
    help=f"Platforms of the libraries: all, that of this machine, or of {', '.join(each.fmi3 for each in PLATFORMS)} "
    "with commas between.",
)
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@click.option(
    "--ssp",
    type=click.Path(path_type=Path),
    metavar="SYSTEM.ssp",
    help="Also an SSP package in which a heading autopilot steers the ship.",
)
@json_option
def command(
    card: str,
    output: Path,
    fmi: str,
    *,
    platforms: str,
    settings: tuple[str, ...],
    **more: Path | None,
) -> None:
    """Write the FMU (Model Exchange and Co-Simulation) of CARD (a file, or the name of a bundled ship)."""
    chosen, ssp, json_file = named_platforms(platforms), more["ssp"], more["json_file"]
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    with showing_stages("making the FMU") as told:
        made = make_fmu(model, fmi=int(fmi), documents=documents_of(ship), platforms=chosen, told=told)
        contents: dict[Path, str | bytes] = {output: made.content}
        if ssp:
            from tank2sim.fmu.ssp import ship_with_autopilot  # takes most of a second to import

            contents[ssp] = ship_with_autopilot(model, made, platforms=chosen, told=told)
    if json_file:
        result = {"ship": ship.ship.name, "fmu": output, "ssp": ssp, **made.as_json(), "notices": model.notices}
        contents[json_file] = json_text(result)
    write_together(contents, inputs=[Path(ship.source)], outputs=[output, ssp, json_file])
    screen.print(
        f"{output}: {ship.ship.name}, FMI {fmi}, Model Exchange and Co-Simulation, {', '.join(made.platforms)}, "
        f"{len(made.content) / 1000:.0f} kB",
        soft_wrap=True,
        markup=False,
    )
    show_notices(model.notices)
