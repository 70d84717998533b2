"""The one kind of error that a user sees: a fault in what was given, reported in one line."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType


class InputError(Exception):
    """Something given to the program is wrong, and the user can correct it.

    The command line prints it as one line and ends with exit code 2.

    Parameters
    ----------
    source : path or str
        The file (or option) at fault.
    place : str
        Where in it: a key, a line, a column; empty if it is the file as a whole.
    problem : str
        What is wrong.
    remedy : str
        What to do about it.
    """

    def __init__(self, source: Path | str, place: str, problem: str, remedy: str):
        self.source, self.place, self.problem, self.remedy = str(source), place, problem, remedy
        super().__init__(": ".join(part for part in (self.source, place, problem) if part) + f"; {remedy}")

    @property
    def reason(self) -> str:
        """Place and problem, where the file is known."""
        return f"{self.place}: {self.problem}" if self.place else self.problem

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str, str]]:
        """As it comes back from another process: pickle would call it with its one line alone."""
        return type(self), (self.source, self.place, self.problem, self.remedy)


class ArgumentError(InputError):
    """An argument of a function is of the wrong kind or out of its bounds; `source` is its name.

    The command line calls it by the option.
    """


def close_name(name: str, known: Iterable[str]) -> str:
    """A remedy for a name that is not known: the one that resembles it, or all of them."""
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]}?" if close else f"known are: {', '.join(names)}"


def optional_library(name: str, extra: str, source: Path | str) -> ModuleType:
    """Import a library of the optional `extra` of tank2sim.

    Raises
    ------
    InputError
        It is not installed; the message names the `source` that needs it.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        problem = f"needs the library {name.partition('.')[0]}, which is not installed"
        raise InputError(source, "", problem, f"install it with: pip install 'tank2sim[{extra}]'") from None
