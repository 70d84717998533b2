"""The texts of an FMU, written from the templates in ``fmu_templates/``."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Mapping
from functools import cache
from typing import Any

import casadi as ca
import jinja2

from tank2sim.bundled import bundled
from tank2sim.escaping import xml_text
from tank2sim.native.plain_c import c_number

_LONGEST_IDENTIFIER = 60

# Names that C or a file system of Windows keeps for itself.
_RESERVED = {
    *("auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern"),
    *("float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed"),
    *("sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while"),
    *("con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))),
}


def render(template: str, values: Mapping[str, Any]) -> str:
    """The text of the template ``fmu_templates/<template>.j2``; XML and HTML escape what they are given."""
    return _environment().get_template(f"{template}.j2").render(values)


def c_identifier(name: str) -> str:
    """A C identifier, of ASCII letters, digits and underscores, that resembles `name`; also a safe file name."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii")
    identifier = re.sub(r"\W+", "_", plain, flags=re.ASCII).strip("_")[:_LONGEST_IDENTIFIER].rstrip("_")
    if not identifier or identifier[0].isdigit() or identifier.lower() in _RESERVED or keyword.iskeyword(identifier):
        identifier = f"model_{identifier}".rstrip("_")
    return identifier


def _signature(function: ca.Function) -> str:
    """``(x, u) -> (y)`` with the lengths of the vectors, for a comment."""
    lengths_in = ", ".join(str(function.numel_in(place)) for place in range(function.n_in()))
    lengths_out = ", ".join(str(function.numel_out(place)) for place in range(function.n_out()))
    return f"lengths ({lengths_in}) -> ({lengths_out})"


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(bundled("fmu_templates")),
        autoescape=lambda name: name is not None and name.endswith((".xml.j2", ".html.j2")),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters["xml"] = xml_text
    environment.filters["signature"] = _signature
    environment.filters["c"] = c_number
    return environment
