"""``tank2sim open``: a page in the browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

from tank2sim.cli.console import screen
from tank2sim.errors import InputError

PAGES = (".html", ".htm", ".svg", ".png")
"""What is opened: pages and pictures that commands write."""


@click.command("open")
@click.argument("page", type=click.Path(path_type=Path))
def command(page: Path) -> None:
    """Show PAGE, which a command wrote, in the browser."""
    if not page.is_file():
        raise InputError(str(page), "", "is not a file", "give a page that a command wrote with --page")
    if page.suffix.lower() not in PAGES:
        raise InputError(str(page), "", "is not a page", "give the .html that a command wrote with --page")
    address = page.resolve().as_uri()
    if not webbrowser.open(address):
        raise InputError(str(page), "", "cannot be shown: no browser is found", f"open {address} yourself")
    screen.print(f"{page} is open in the browser", markup=False, soft_wrap=True)
