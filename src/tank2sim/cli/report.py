"""``tank2sim report``: a page of a result that another command wrote."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from tank2sim.cli.console import screen
from tank2sim.errors import InputError
from tank2sim.files import write_whole


@click.command("report")
@click.argument("result", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "-o",
    "--page",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="PAGE.html",
    help="The page.",
)
def command(result: Path, page: Path) -> None:
    """Write one self-contained page of RESULT, the JSON that any command wrote with --json."""
    # Drawing is slow to load, and is not needed to refuse a file.
    content = _read(result)
    from tank2sim.report.kit.page import render_page
    from tank2sim.report.results.page import result_page

    told = result_page(content, str(result))
    text = render_page(told)
    write_whole(page, text, inputs=[result])
    charts = sum(len(section.charts) for section in told.sections)
    tables = sum(len(section.tables) for section in told.sections)
    screen.print(
        f"{escape(told.title)}: {charts} charts and {tables} tables in {escape(str(page))}, "
        f"{len(text.encode()) / 1e6:.1f} MB",
        soft_wrap=True,
    )


def _read(path: Path) -> Any:
    remedy = "give what a command wrote with --json"
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
        json.dumps(content, ensure_ascii=False).encode()  # a text may hold half a character, which no page can
        return content
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", remedy) from None
    except json.JSONDecodeError as error:
        raise InputError(path, f"line {error.lineno}", f"is no JSON ({error.msg})", remedy) from None
    except UnicodeEncodeError:
        raise InputError(path, "", "holds half of a character (a lone surrogate, \\ud800 to \\udfff)", remedy) from None
    except (ValueError, RecursionError):  # a ValueError also where an integer has thousands of digits
        raise InputError(path, "", "is no JSON", remedy) from None
