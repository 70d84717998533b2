"""Which command wrote a result: by its schema; of files without, which older versions wrote, by its keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tank2sim.errors import InputError
from tank2sim.files import schema_command


@dataclass(frozen=True)
class ResultType:
    """Results of one command.

    Parameters
    ----------
    title : str
        What it is, for the head of the page.
    commands : str
        Commands that write it, as their schemas name them, with spaces between.
    keys : tuple of str
        What the JSON of this command has at its top, and that of no other has all of.
    headlines : tuple of str
        Paths of the values that the reader looks for first, with dots between keys; for those that are
        worked out see :mod:`tank2sim.report.results.headlines`.
    note : str
        What the JSON has not, and where it is.
    """

    title: str
    commands: str
    keys: tuple[str, ...]
    headlines: tuple[str, ...] = ()
    note: str = ""


RESULT_TYPES: tuple[ResultType, ...] = ()
"""The results that are known, those with more particular keys first."""


def kind_of(result: Any, source: str) -> ResultType:
    """Which command wrote a result.

    Raises
    ------
    InputError
        It is not a result of any.
    """
    remedy = "give what a command wrote with --json (or the gap.json of tank2sim gap)"
    if isinstance(result, Mapping):
        for kind in _types_of(result.get("schema"), source):
            if all(key in result for key in kind.keys):
                return kind
    raise InputError(source, "", "is not a result of a tank2sim command", remedy)


def _types_of(schema: object, source: str) -> Sequence[ResultType]:
    """The types that a schema may mean; without one all of them."""
    if schema is None:
        return RESULT_TYPES
    types = [kind for kind in RESULT_TYPES if schema_command(schema) in kind.commands.split()]
    if not types:
        remedy = "give what this version of tank2sim wrote with --json"
        raise InputError(source, "schema", f"is {str(schema)[:60]!r}, which is not known", remedy)
    return types
