"""Verbs: functions of the API that are commands, too; each declares what the command line adds to its signature.

This module and those that declare verbs import nothing heavy, so that the help of a command is there at once.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from tank2sim.arguments import checked
from tank2sim.errors import ArgumentError
from tank2sim.files import names_folder

_P = ParamSpec("_P")
_T = TypeVar("_T")

Progress = Callable[[str], None]
"""Argument of a verb that takes long: called with the stage that begins; the command line shows it."""


@dataclass(frozen=True)
class Written:
    """Mark of an argument that names a file to be written: the ``files`` of the result hold its content.

    `endings`: as of :class:`Output`; `by_function`: the function itself writes there (a folder, as its work goes on),
    and the command requires it unless it has a default; the ``written`` of the result are the files.
    """

    endings: tuple[str, ...] | None
    metavar: str = "FILE"
    by_function: bool = False


@dataclass(frozen=True)
class Output:
    """A file that a command can write of its result, in addition to page, pictures and JSON.

    Parameters
    ----------
    option : str
        ``-o`` for the main one.
    endings : tuple of str, optional
        How the name of the file may end (:mod:`tank2sim.files`); empty for a folder, None where its content decides.
    help : str
    write : callable
        Called with the result and the path; returns contents by path, or a result whose ``files`` they are. Its
        keyword arguments are options of the command.
    metavar : str
    required : bool
    folder_without_ending : bool
        Whether a name without an ending means a folder for several files.
    unwritten : callable, optional
        Called with the result where the file was not asked for; returns a note about it, or nothing.
    """

    option: str
    endings: tuple[str, ...] | None
    help: str
    write: Callable[..., Any]
    metavar: str = "FILE"
    required: bool = False
    folder_without_ending: bool = False
    unwritten: Callable[[Any], str] | None = None

    def is_folder(self, path: Path) -> bool:
        """Whether a folder of this name is written."""
        return self.endings == () or (self.folder_without_ending and names_folder(path))


@dataclass(frozen=True)
class Verb:
    """A command as its function declares it.

    `words`: for the list of commands; `results`: classes of the results, ``module:class``, by which JSON is read back
    and its schema is made; `texts`: argument to a function that makes its value of the words on the command line;
    `choices`: argument to the words of its choices; `options`: argument to the option that sets it, where the command
    line does not take it by position or has another name; `variants`: flag to another verb, which the command calls
    with this flag in place of the function (an option of the other verb of that name is the flag; the key of a verb
    that `takes` certain first arguments is their kind, ``steering_card``); `takes`: as a variant, the verb is called
    if this is true of the first argument as a text; `default_ship`: name of the bundled ship that the command takes
    where no card is given; empty if one must be; `page_required`: whether the page is the result itself, and must be
    written; `charts`: whether its results may have a chart, which ``--plot`` draws.
    """

    function: Callable[..., Any]
    name: str
    words: str
    outputs: Sequence[Output] = ()
    results: Sequence[str] = ()
    texts: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)
    choices: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    options: Mapping[str, str] = field(default_factory=dict)
    variants: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    takes: Callable[[str], bool] | None = None
    default_ship: str = ""
    page_required: bool = False
    charts: bool = True


def named_numbers(argument: str, example: str) -> Callable[[Sequence[str]], dict[str, float]]:
    """Return a reader of words ``NAME=NUMBER`` for an argument, for `texts` of a verb; `example` is for the remedy."""

    def read(given: Sequence[str]) -> dict[str, float]:
        found: dict[str, float] = {}
        for text in given:
            name, _, number = (part.strip() for part in text.partition("="))
            try:
                value = float(number)
            except ValueError:
                value = math.nan
            problem = "is not NAME=NUMBER" if not math.isfinite(value) else "is given twice" if name in found else ""
            if problem or not name:
                raise ArgumentError(argument, text, problem or "has no name", f"give, for example, {example}")
            found[name] = value
        return found

    return read


def verb(words: str, *outputs: Output, name: str = "", **more: Any) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """Declare a function a verb: its arguments are checked by their annotations, and it is a command.

    A first argument `ship` may also be a card, its file, or the name of a bundled ship.

    Parameters
    ----------
    words : str
        A few words for the list of commands.
    *outputs : Output
    name : str
        Of the command; by default the name of the function.
    **more
        Further fields of :class:`Verb`.
    """

    def declare(function: Callable[_P, _T]) -> Callable[_P, _T]:
        checking = checked(function)
        first = next(iter(inspect.signature(function).parameters), "")

        @functools.wraps(checking)
        def call(*args: _P.args, **options: _P.kwargs) -> _T:
            if first != "ship":
                return checking(*args, **options)
            from tank2sim.dynamics.vessel import as_vessel

            ship, *rest = args or (options.pop("ship", None),)
            return checking(as_vessel(ship), *rest, **options)  # type: ignore[arg-type]

        call.verb = Verb(call, name or function.__name__, words, outputs, **more)  # type: ignore[attr-defined]
        return call

    return declare
