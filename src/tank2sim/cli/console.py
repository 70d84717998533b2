"""Output that all commands share: tables and notices on the screen, results as JSON, pages and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from rich.box import HEAVY_HEAD
from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table as Grid

from tank2sim.answer.parts import Table, cell_text
from tank2sim.answer.result import Result
from tank2sim.errors import ArgumentError
from tank2sim.escaping import file_name, one_line
from tank2sim.files import PICTURE, STANDARD_OUTPUT, writable_folder, write_together

screen = Console(highlight=False)
"""Where summaries go. There are colours on a terminal, unless ``NO_COLOR`` is set."""

_WIDEST = 1000
"""Characters in which every table has room. Project choice."""


def show_table(shown: Table, words: Callable[[str], str] = str) -> None:
    """Print a table with its notes; numbers are aligned right and never broken; in a wide one no cell is.

    Frames are drawn on a terminal; a pipe and a file get columns with spaces between them. `words`: of a sentence.
    """
    grid = Grid(header_style="bold", pad_edge=False, box=HEAVY_HEAD if screen.is_terminal else None)
    digits = [column.digits for column in shown.columns]
    texts = [[one_line(cell_text(*cell)) for cell in zip(row, digits, strict=True)] for row in shown.rows]
    texts = [[words(text) if " " in text else text for text in row] for row in texts]
    of_numbers = [
        all(isinstance(row[place], int | float) or row[place] is None for row in shown.rows)
        for place in range(len(shown.heads))
    ]
    for head, numeric in zip(shown.heads, of_numbers, strict=True):
        justify: Literal["left", "right"] = "right" if numeric else "left"
        grid.add_column(escape(head), justify=justify, overflow="fold", no_wrap=shown.wide)
    for row in texts:
        grid.add_row(*map(escape, row))
    screen.print(escape(one_line(shown.caption)), style="italic", soft_wrap=True)
    room = Measurement.get(screen, screen.options.update(width=_WIDEST), grid)
    if not shown.wide and room.maximum > screen.width:
        for place, column in enumerate(grid.columns):
            cells = [*shown.heads[place].split(), *(row[place] for row in texts)]
            column.width = max(map(len, cells)) if of_numbers[place] else None
        room = Measurement.get(screen, screen.options.update(width=_WIDEST), grid)
    # Without a height, Rich cuts numbers at 80 characters on a terminal that calls itself dumb.
    width = max(room.maximum if shown.wide else room.minimum, screen.width)
    Console(width=width, height=screen.height, highlight=False, stderr=screen.stderr).print(grid)
    for note in shown.notes:
        screen.print(escape(one_line(words(note))), soft_wrap=True)


def show_notices(notices: Iterable[str]) -> None:
    """Print what the user should know, a line each."""
    for notice in notices:
        screen.print(f"[yellow]note:[/yellow] {escape(one_line(notice))}", soft_wrap=True)


def show_result(
    result: Result[Any],
    written: Iterable[Path] = (),
    *,
    quiet: bool = False,
    verbose: bool = False,
    words: Callable[[str], str] = str,
) -> None:
    """Print a result: cautions first, then the main findings, tables, files and notices.

    Parameters
    ----------
    result : Result
    written : paths
        Files that were written.
    quiet : bool
        Only cautions.
    verbose : bool
        All tables, not only those for the screen.
    words : callable
        A sentence as the command line has it: options in place of arguments.
    """
    for caution in result.cautions:
        screen.print(f"[bold red]{escape(one_line(words(caution.line)))}[/bold red]", soft_wrap=True)
    if quiet:
        return
    for line in result.headline:
        screen.print(escape(one_line(words(line))), soft_wrap=True)
    for table in result.tables if verbose else result.screen_tables:
        show_table(table, words)
    for path in written:
        screen.print(f"wrote {escape(one_line(str(path)))}", soft_wrap=True)
    show_notices(words(notice) for notice in result.notices if not notice.leads)


def write_outputs(
    result: Result[Any],
    files: Mapping[Path, str | bytes],
    inputs: Iterable[Path],
    *,
    page: Path | None,
    plot: Path | None,
    json: Path | None,
) -> list[Path]:
    """Write what of a result was asked for, all files or none, and return their paths.

    Parameters
    ----------
    result : Result
    files : mapping
        Paths and contents of the files that only this command writes.
    inputs : paths
        Files that were read and must not be overwritten.
    page, json : Path, optional
    plot : Path, optional
        Picture of the main chart, if its name ends like a picture; else a folder for all charts and the page.

    Raises
    ------
    InputError
        A file cannot be written, is an input or is given twice.
    """
    contents = dict(files)
    screen.stderr = json is STANDARD_OUTPUT  # then standard output is JSON and nothing else
    if json:
        contents[json] = result.to_json()
    if page:
        contents[page] = result.page()
    if plot and not result.chart_names:
        raise ArgumentError("plot", "", "there is no chart to draw", "leave it out")
    if plot and plot.suffix.lower() in PICTURE:
        contents[plot] = result.picture(ending=plot.suffix)
    elif plot:
        writable_folder(plot)
        contents |= {plot / f"{file_name(name)}.png": picture for name, picture in result.pictures().items()}
        contents[plot / "report.html"] = result.page()
    write_together(contents, inputs=inputs, outputs=[path for path in (*files, page, plot, json) if path in contents])
    return [path for path in contents if path is not STANDARD_OUTPUT]
