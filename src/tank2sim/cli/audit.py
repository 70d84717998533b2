"""``tank2sim audit``: what is wrong with the data of free-running trials."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.audit import audit
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import page_option, plot_folder_option


@click.command("audit")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRIAL...")
@page_option()
@plot_folder_option
@json_option
def command(trials: tuple[Path, ...], page: Path | None, plots: Path | None, json_file: Path | None) -> None:
    """Find what is wrong with the columns of each TRIAL (a CSV, or a SIMMAN .dat), by their consistency alone."""
    result = audit(trials)
    write_result(result, [record.path for record in result.trials], json_file=json_file, page=page, plots=plots)
    show_result(result)
