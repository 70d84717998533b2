"""What every command does alike: tables and notices on the screen, results as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

screen = Console(highlight=False)
"""Where summaries go."""

json_option = click.option(
    "--json", "json_file", type=click.Path(path_type=Path, dir_okay=False), help="Write the full result as JSON."
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
    return json.dumps(_plain(result), indent=1, ensure_ascii=False) + "\n"


def _plain(value: Any) -> Any:
    match value:
        case Mapping():
            return {str(key): _plain(item) for key, item in value.items()}
        case np.ndarray():
            return _plain(value.tolist())
        case list() | tuple():
            return [_plain(item) for item in value]
        case np.generic():
            return _plain(value.item())
        case float():
            return value if math.isfinite(value) else None
        case Path():
            return str(value)
        case _:
            return value
