"""``tank2sim check``: whether an FMU is what its card says."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from tank2sim.api.fmu import check_fmu
from tank2sim.api.ship import load
from tank2sim.cli.console import json_option, screen, show_result, write_result

MOST_PROBLEMS = 8
"""Problems that the screen shows. Project choice: they fit under the table."""


@click.command("check")
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--card", help="What it should be: a card, or a bundled ship's name; by default the card in the FMU.")
@json_option
def command(fmu: Path, card: str | None, json_file: Path | None) -> int:
    """Validate FMU and compare its outputs with the CasADi model of its card, through fmpy, in each kind it offers.

    It runs the FMU's own code with your rights: check only files from sources that you trust.

    Ends with exit code 1 if the description is not valid or an output differs.
    """
    result = check_fmu(fmu, load(card) if card else None)
    write_result(result, [fmu, *([card] if card else [])], json_file=json_file)
    show_result(result)
    for problem in result.problems[:MOST_PROBLEMS]:
        screen.print(f"[red]wrong:[/red] {escape(problem)}", soft_wrap=True)
    if len(result.problems) > MOST_PROBLEMS:
        screen.print(f"... and {len(result.problems) - MOST_PROBLEMS} more (--json has all)")
    return 0 if result.passed else 1
