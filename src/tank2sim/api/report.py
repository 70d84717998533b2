"""The page of a result that was written as JSON, in this session or before."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tank2sim.answer.parts import Table
from tank2sim.answer.result import Result
from tank2sim.answer.study import not_as_written
from tank2sim.api.bounds import checked
from tank2sim.api.result import PagedResult
from tank2sim.api.results import RESULT_CLASSES, read_result
from tank2sim.files import parsed_json, plain_json, read_text, refuse_deep, schema_command, write_together
from tank2sim.marks import marked

if TYPE_CHECKING:
    from tank2sim.answer.page import Page

_REMEDY = "give what a command wrote with --json"


class ReportResult(PagedResult):
    """The page of a result.

    Parameters
    ----------
    values : mapping
        The result as JSON values.
    source : str
        What messages and the head of the page call it.

    Raises
    ------
    InputError
        It is not a result of tank2sim, or a value in it is not as a command writes it.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.make_report(t2s.load("mariner").turn(35)).title
    'Mariner class: turning circle, 35° of rudder to starboard'
    """

    command = "report"

    def __init__(self, values: Mapping[str, Any], source: str) -> None:
        self._values, self.source = values, source
        self._layout = _layout(values, source)
        self.notices = tuple(marked(values.get("notices") or ()))

    @property
    def schema(self) -> str:
        """Schema of the result; empty if the version that wrote it had none."""
        return str(self._values.get("schema", ""))

    @property
    def title(self) -> str:
        """Title of the page: what it is, and of which ship."""
        return self._layout.title

    def content(self) -> Mapping[str, object]:
        """The result that is shown."""
        return self._values

    @property
    def headline(self) -> tuple[str, ...]:
        """Title of the page, and how many charts and tables it has."""
        sections = self._layout.sections
        charts, tables = (sum(len(getattr(each, kind)) for each in sections) for kind in ("charts", "tables"))
        return (f"{self.title}: {charts} charts and {tables} tables",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """None: the page has them."""
        return ()

    def layout(self) -> Page:
        """As :meth:`.PagedResult.layout`."""
        return self._layout


def _layout(values: Mapping[str, Any], source: str) -> Page:
    if not isinstance(values, Mapping) or schema_command(values.get("schema")) not in RESULT_CLASSES:
        from tank2sim.report.results.page import result_page

        return result_page(values, source)
    result = read_result(values, source)
    try:
        return result.layout()
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, ArithmeticError, LookupError) as fault:
        raise not_as_written(source, "") from fault


@checked
def make_report(
    result: Result[Any] | Mapping[str, object] | str | Path, path: str | Path | None = None
) -> ReportResult:
    """Make the page of a result.

    Parameters
    ----------
    result : Result, mapping or path
        A result, its ``to_dict()``, or the JSON file that a command wrote with ``--json``.
    path : path, optional
        HTML file to write.

    Raises
    ------
    InputError
        It is not a result of tank2sim, or a file cannot be read or written.
    """
    if isinstance(result, Result):
        found = ReportResult(result.to_dict(), f"tank2sim {result.command}")
    elif isinstance(result, Mapping):
        refuse_deep(result, "the result")
        found = ReportResult(plain_json(result), "the result")
    else:
        found = ReportResult(read_values(Path(result)), str(result))
    if path is not None:
        inputs = [Path(result)] if isinstance(result, str | Path) else []
        write_together({Path(path): found.page()}, inputs=inputs)
    return found


def read_values(path: Path) -> Any:
    """The JSON of a file.

    Raises
    ------
    InputError
        The file cannot be read, or is not JSON that a page can show.
    """
    return parsed_json(read_text(path), path, _REMEDY)
