"""Messages that name arguments of functions, in the words of the command line: ``length_m`` is ``--length``."""

from __future__ import annotations

import re
from collections.abc import Mapping

import click

_VALUE = re.compile(r"(?<![\w.'-])([a-zA-Z]\w*)=(True|False|\"[^\"]*\"|[^\s\"',;:)]+)")
"""An argument with its value, as messages give it: ``terms="B3"``, ``start_delay=True``."""

_NAME = re.compile(r"(?<![\w.'\"#=/-])(?<!# )([a-z][a-zA-Z0-9]*(?:_[a-zA-Z0-9]+)+)(?![\w='\"/]|\.\w)")
"""A name that no English word is, and no part of a path. Keys of files are in quotation marks, or after a section and a
point."""


def options_of(command: click.Command) -> dict[str, click.Option]:
    """The options of a command by the arguments that they set."""
    return {one.name or "": one for one in command.params if isinstance(one, click.Option)}


def in_options(text: str, options: Mapping[str, click.Option]) -> str:
    """Return a message in which every argument is called by the option that sets it.

    Parameters
    ----------
    text : str
        With arguments as ``length_m`` or, where the name is an English word, as ``terms="B3"``.
    options : mapping
        As of :func:`options_of`.
    """

    def with_value(found: re.Match[str]) -> str:
        option, value = options.get(found[1]), found[2].strip('"')
        if option is None:
            return found[0]
        if value == "False" and option.secondary_opts:
            return option.secondary_opts[0]
        return option.opts[0] if value in ("True", "False") else f"{option.opts[0]} {value}"

    def alone(found: re.Match[str]) -> str:
        return options[found[1]].opts[0] if found[1] in options else found[0]

    return _NAME.sub(alone, _VALUE.sub(with_value, text))
