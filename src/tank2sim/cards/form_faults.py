"""Faults that pydantic finds in a file that should follow a form, as one line with place and remedy."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from tank2sim.cards.terms import parse_term
from tank2sim.errors import InputError
from tank2sim.units import from_si

_RELATIONS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "of at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "of at most"),
}
"""Kind of fault to the name of the bound in pydantic's words and in a message."""

_EXPECTED = {
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a number",
    "string_type": "a text",
}
"""Kind of fault to the value that was expected."""


def form_fault(
    error: ValidationError, source: str | Path, spelt: Mapping[str, str], *, form: type[BaseModel], what: str
) -> InputError:
    """The first fault that pydantic found, as one line with place and remedy.

    `source`: the file. `spelt`: dotted key in SI to the key as it is spelt in the file, where the two differ. `form`:
    the form that the file should follow. `what`: what the file is, for the message: ``a card``.
    """
    # A key that is unknown explains one that is missing (length_ft for length_m), not the other way round.
    first: Any = min(error.errors(), key=lambda fault: fault["type"] != "extra_forbidden")
    place = ".".join(str(part) for part in first["loc"])
    place = spelt.get(place, place)
    problem, remedy = _problem_and_remedy(first, place.rpartition(".")[2], form, what)
    more = len(error.errors()) - 1
    after = f" ({more} more fault{'s' * (more > 1)} after this)" if more else ""
    return InputError(source, place, problem, remedy + after)


def short(value: object) -> str:
    """A value as Python would write it, cut to 80 characters."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def suggestion(key: str, known: list[str]) -> str:
    """Remedy for an unknown key where the `known` ones may be given."""
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    same_stem = [name for name in known if name.partition("_")[0] == key.partition("_")[0]]
    best = close or same_stem
    return f"did you mean {best[0]}?" if best else f"known here: {', '.join(known)}" if known else "remove it"


def _in_a_section(key: str, form: Any) -> list[str]:
    """Dotted keys of sections in which a key may be given that was given outside of them: ``derivatives.Yv``."""
    found = ["derivatives." + key] if "derivatives" in form.model_fields and parse_term(key) else []
    for name, field in form.model_fields.items():
        for kind in (field.annotation, *getattr(field.annotation, "__args__", ())):
            found += [f"{name}.{key}"] if key in getattr(kind, "model_fields", ()) else []
    return found


def _problem_and_remedy(fault: Any, key: str, form: type[BaseModel], what: str) -> tuple[str, str]:
    """Problem and remedy."""
    given, wanted = fault["input"], fault.get("ctx", {})
    match fault["type"]:
        case "missing":
            return "is missing", "add it"
        case "extra_forbidden":
            inside = _in_a_section(key, form) if len(fault["loc"]) == 1 else []
            remedy = f"did you mean {inside[0]}?" if inside else suggestion(key, _siblings(fault["loc"], form))
            return f"is not a key of {what}", remedy
        case kind if kind in _EXPECTED:
            return f"is {short(given)}", f"{_EXPECTED[kind]} was expected"
        case kind if kind in _RELATIONS:
            bound, relation = _RELATIONS[kind]
            return f"is {_shown(key, given)}", f"a number {relation} {_shown(key, wanted[bound])} was expected"
        case "literal_error":
            return f"is {short(given)}", f"{wanted['expected']} was expected"
        case "value_error" if isinstance(given, dict):  # what is wrong with a section as a whole
            return str(wanted["error"]), "correct its keys"
        case "value_error":
            return f"is {short(given)}", str(wanted["error"])
        case _:
            return f"is {short(given)}", fault["msg"][0].lower() + fault["msg"][1:]


def _shown(key: str, value: float) -> str:
    """A value in the unit that its key is spelt with."""
    try:
        return f"{from_si(key, value):g}"
    except OverflowError:
        return short(value)


def _siblings(place: tuple[int | str, ...], form: Any) -> list[str]:
    """Keys that may be given where an unknown one was found."""
    for part in place[:-1]:
        if isinstance(part, int):
            continue
        annotation = form.model_fields[part].annotation if part in form.model_fields else None
        inner = [kind for kind in (annotation, *getattr(annotation, "__args__", ())) if hasattr(kind, "model_fields")]
        if not inner:
            return []
        form = inner[0]
    return list(form.model_fields)
