"""``tank2sim demo``: the whole way on bundled data."""

from __future__ import annotations

import time
from pathlib import Path

import click
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from tank2sim.cli.console import json_option, json_text, screen
from tank2sim.errors import InputError
from tank2sim.files import writable_folder, write_whole
from tank2sim.native.compiler import require_compiler


@click.command("demo")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("demo"),
    show_default=True,
    metavar="DIR",
    help="Folder.",
)
@json_option
def command(output: Path, json_file: Path | None) -> None:
    """Go the whole way on bundled data: tows to an FMU, the Mariner to checked FMUs, and a page that shows both."""
    from tank2sim.demo.run import (  # drawing and control: seconds, for which --help does not wait
        DEMO_STEPS,
        PAGE,
        run_demo,
    )

    require_compiler("the demo")
    if json_file and not json_file.absolute().parent.is_dir():
        raise InputError(json_file, "", "is in a folder that does not exist", "choose one that does")
    folder = writable_folder(output)
    begin = time.monotonic()
    columns = SpinnerColumn(), BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=screen, transient=True) as progress:
        task = progress.add_task("", total=DEMO_STEPS)

        def tell(words: str) -> None:
            progress.update(task, description=words, advance=1)
            if not screen.is_terminal:  # a log has no bar
                screen.print(f"{time.monotonic() - begin:5.1f} s  {words}", soft_wrap=True, markup=False)

        result = run_demo(folder, tell)
    if json_file:
        write_whole(json_file, json_text(result))
    screen.print(f"{folder / PAGE}: the page that shows it all, next to {len(_files(result)) - 1} files", markup=False)
    screen.print(f"done in {time.monotonic() - begin:.0f} s")


def _files(result: dict[str, object]) -> list[str]:
    files = result["files"]
    assert isinstance(files, list)
    return files
