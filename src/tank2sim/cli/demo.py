"""``tank2sim demo``: the whole way on bundled data."""

from __future__ import annotations

import time
from pathlib import Path

import click
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from tank2sim.apps.demo import DEMO_STEPS
from tank2sim.apps.demo.command import run_demo
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile
from tank2sim.errors import InputError


@click.command("demo")
@click.option(
    "-o",
    "--output",
    type=OutputFile(()),
    default=Path("demo"),
    show_default=True,
    metavar="DIR",
    help="Folder.",
)
@json_option
def command(output: Path, json_file: Path | None) -> None:
    """Go the whole way on bundled data: tows to an FMU, the Mariner to checked FMUs, and a page that shows both."""
    if json_file and not json_file.absolute().parent.is_dir():
        raise InputError(json_file, "", "is in a folder that does not exist", "choose one that does")
    begin = time.monotonic()
    columns = SpinnerColumn(), BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=screen, transient=True) as progress:
        task = progress.add_task("", total=DEMO_STEPS)

        def report(step: str) -> None:
            progress.update(task, description=step, advance=1)
            if not screen.is_terminal:  # a log has no bar
                screen.print(f"{time.monotonic() - begin:5.1f} s  {step}", soft_wrap=True, markup=False)

        result = run_demo(output, report=report)
    write_result(result, [], json_file=json_file)
    show_result(result)
    screen.print(f"done in {time.monotonic() - begin:.0f} s")
