"""Pages and pictures that commands write, in a browser."""

from __future__ import annotations

from pathlib import Path

from tank2sim.api.verbs import verb
from tank2sim.errors import InputError

SHOWN_ENDINGS = (".html", ".htm", ".svg", ".png")
"""Endings of pages and pictures that a browser shows."""


@verb("a page, in the browser", name="open")
def open_page(page: str | Path) -> str:
    """Open a page or a picture that a command wrote in the browser, and return its address.

    Parameters
    ----------
    page : path
        File that ends in .html, .svg or .png.

    Raises
    ------
    InputError
        The file is missing or of another kind, or there is no browser.
    """
    import webbrowser

    path = Path(page)
    if not path.is_file():
        raise InputError(page, "", "is not a file", "give a page that a command wrote with --page")
    if path.suffix.lower() not in SHOWN_ENDINGS:
        raise InputError(page, "", "is not a page", "give the .html that a command wrote with --page")
    address = path.resolve().as_uri()
    if not webbrowser.open(address):
        raise InputError(page, "", "cannot be shown: no browser is found", f"open {address} yourself")
    return address
