"""``tank2sim ships``: the bundled cards."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.bundled_ships import list_ships
from tank2sim.cli.console import json_option, show_result, write_result


@click.command("ships")
@json_option
def command(json_file: Path | None) -> None:
    """List the bundled ships, by the names that CARD takes."""
    result = list_ships()
    write_result(result, [], json_file=json_file)
    show_result(result)
