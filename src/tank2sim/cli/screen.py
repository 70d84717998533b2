"""What every command does alike: tables and notices on the screen, results as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tank2sim.files import STANDARD_OUTPUT, plain_json
from tank2sim.marks import marked

screen = Console(highlight=False)
"""Where summaries go."""


def _standard_output(context: click.Context, parameter: click.Parameter, given: Path | None) -> Path | None:
    if given != Path("-"):
        screen.stderr = False
        return given
    screen.stderr = True  # the summary goes there, so that standard output is JSON and nothing else
    return STANDARD_OUTPUT


json_option = click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, dir_okay=False),
    callback=_standard_output,
    help="Write the full result as JSON; - is standard output, and the summary then goes to the error stream.",
)
"""``--json FILE``, the same on every command."""


def show_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table; numbers are rounded to five figures and stand right."""
    table = Table(title=escape(title), title_justify="left", header_style="bold", pad_edge=False)
    rows = [list(row) for row in rows]
    for place, head in enumerate(heads):
        numeric = all(isinstance(row[place], int | float) or row[place] is None for row in rows)
        table.add_column(escape(head), justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        table.add_row(*(escape(shown(value)) for value in row))
    screen.print(table)


def show_notices(notices: Iterable[str]) -> None:
    """Print what the user should be told, a line each."""
    for notice in notices:
        screen.print(f"[yellow]note:[/yellow] {escape(notice)}", soft_wrap=True)


def show_marked(notices: Iterable[str]) -> list[str]:
    """Print the notices that mark the result as one that its data do not carry; return the others, for its end."""
    notices = list(notices)
    first = marked(notices)
    for notice in first:
        screen.print(f"[bold red]{escape(notice)}[/bold red]", soft_wrap=True)
    return [notice for notice in notices if notice not in first]


def shown(value: object) -> str:
    """A value as a table shows it."""
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.5g}"
        case list():
            return ", ".join(shown(item) for item in value)
        case _:
            return str(value)


def json_text(result: Mapping[str, object]) -> str:
    """The result as JSON; arrays become lists, and what is not a finite number becomes null."""
    return json.dumps(plain_json(result), indent=1, ensure_ascii=False) + "\n"
