"""The page of a result that was written as JSON, in this session or before, and pages in a browser."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tank2sim.api.verbs import verb
from tank2sim.errors import InputError

if TYPE_CHECKING:
    from tank2sim.answer.result import Result

_REMEDY = "give what a command wrote with --json"
_FAULTS = (AttributeError, IndexError, KeyError, TypeError, ValueError, ArithmeticError)

SHOWN_ENDINGS = (".html", ".htm", ".svg", ".png")
"""Endings of pages and pictures that a browser shows."""


@verb("one page of any result", page_required=True, name="report")
def make_report(result: Mapping[str, object] | str | Path) -> Result[Any]:
    """Read a result back: its page, tables and charts equal the output of the command that wrote it.

    The JSON of poster, pilotcard and steer holds their data alone: the page shows these, not the sheet or the ship.

    Parameters
    ----------
    result : mapping or path
        The JSON file that a command wrote with ``--json``, or its values (``to_dict()``).

    Raises
    ------
    InputError
        It is not a result of tank2sim, or a value in it is not as a command writes it.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.make_report(t2s.load("mariner").turn(35).to_dict()).title
    'Mariner class: turning circle, 35° of rudder to starboard'
    """
    from tank2sim.answer.study import not_as_written
    from tank2sim.api.results import read_result
    from tank2sim.files import plain_json, refuse_deep

    source = str(result) if isinstance(result, str | Path) else "the result"
    values = read_values(Path(result)) if isinstance(result, str | Path) else result
    refuse_deep(values, source)
    if not isinstance(values, Mapping):
        raise InputError(source, "", "is not a result of a tank2sim command", _REMEDY)
    found = read_result(plain_json(values), source)
    try:
        found.layout()
    except _FAULTS as fault:
        raise not_as_written(source, "") from fault
    return found


def read_values(path: Path) -> Any:
    """The JSON of a file. Raises InputError: it cannot be read, or is not JSON that a page can show."""
    from tank2sim.files import parsed_json, read_text

    return parsed_json(read_text(path), path, _REMEDY)


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
