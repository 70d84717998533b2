"""``tank2sim export``: the FMU of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.screen import json_option, json_text, screen, show_notices
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.fmu.documents import documents_of
from tank2sim.fmu.export import make_fmu


@click.command("export")
@click.argument("card")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), metavar="SHIP.fmu", help="The FMU.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI.")
@click.option("--platforms", default="host", show_default=True, help="Platforms of the library; now: host.")
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@json_option
def command(
    card: str, output: Path, fmi: str, *, platforms: str, settings: tuple[str, ...], json_file: Path | None
) -> None:
    """Write the FMU (Model Exchange and Co-Simulation) of CARD (a file, or the name of a bundled ship)."""
    if platforms != "host":
        remedy = "take --platforms host, on a machine of the platform; the FMU's sources/ compile on others"
        raise InputError("--platforms", platforms, "only the platform of this machine can be built", remedy)
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    made = make_fmu(model, fmi=int(fmi), documents=documents_of(ship))
    contents: dict[Path, str | bytes] = {output: made.content}
    if json_file:
        result = {"ship": ship.ship.name, "fmu": output, **made.as_json(), "notices": model.notices}
        contents[json_file] = json_text(result)
    write_together(contents, inputs=[Path(ship.source)], outputs=[output, json_file])
    screen.print(
        f"{output}: {ship.ship.name}, FMI {fmi}, Model Exchange and Co-Simulation, {', '.join(made.platforms)}, "
        f"{len(made.content) / 1000:.0f} kB",
        soft_wrap=True,
        markup=False,
    )
    show_notices(model.notices)
