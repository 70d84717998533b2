"""``tank2sim report``: a page of a result that another command wrote."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.report import make_report
from tank2sim.cli.console import show_result, write_result
from tank2sim.cli.options import OutputFile, plot_option
from tank2sim.files import PAGE


@click.command("report")
@click.argument("result", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "-o",
    "--page",
    required=True,
    type=OutputFile(PAGE, dir_okay=False),
    metavar="PAGE.html",
    help="The page.",
)
@plot_option
def command(result: Path, page: Path, plot: Path | None) -> None:
    """Write one self-contained page of RESULT, the JSON that any command wrote with --json."""
    found = make_report(result)
    write_result(found, [result], page=page, plot=plot)
    show_result(found)
