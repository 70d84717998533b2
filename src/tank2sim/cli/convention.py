"""``tank2sim convention``: what a table of derivatives with unstated conventions means."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.convention import convention
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile
from tank2sim.files import CARD


@click.command("convention")
@click.argument("coefficients")
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the card of the first reading.")
@json_option
def command(coefficients: str, output: Path | None, json_file: Path | None) -> None:
    """Say what COEFFICIENTS means: rows of name and value, or a card that lacks conventions.

    Every reading (sign of the rudder, scaling, yaw-rate terms, origin) is made a ship, and ranked by how much it is
    like one of its dimensions. What the file states is taken as it is.
    """
    result = convention(coefficients)
    files = result.files(output) if output else {}
    write_result(result, [Path(coefficients)], json_file=json_file, files=files)
    show_result(result)
    if output:
        screen.print(f"{output}: the card of the first reading", soft_wrap=True, markup=False)
