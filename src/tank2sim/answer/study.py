"""A study (a dataclass of numbers) as JSON, its JSON Schema, and back: derived from the types of its fields."""

from __future__ import annotations

import functools
import json
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from tank2sim.errors import InputError
from tank2sim.files import plain_json

_S = TypeVar("_S")


_made = functools.cache(TypeAdapter)


def _adapter(kind: Any) -> TypeAdapter[Any]:
    return _made(kind)


def study_values(study: object) -> dict[str, Any]:
    """Return a study as JSON values: names of fields are keys, lists for arrays, None for what is not finite."""
    values: dict[str, Any] = plain_json(
        _adapter(type(study)).dump_python(study, mode="json", by_alias=True, warnings="error")
    )
    return values


def study_schema(kind: type[object]) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a study; no key is allowed but its fields."""
    schema = _adapter(kind).json_schema(mode="serialization")
    if "$ref" in schema:  # a study that holds one of its own kind
        schema = {**schema["$defs"][schema["$ref"].rpartition("/")[2]], "$defs": schema["$defs"]}
    for part in (schema, *schema.get("$defs", {}).values()):
        if "properties" in part:
            part["additionalProperties"] = False
    return schema


def read_study(kind: type[_S], values: dict[str, Any], source: str) -> _S:
    """Return the study that JSON values hold.

    Raises InputError: a key is missing or unknown, or its value is of another type than the command writes; the key is
    named.
    """
    try:
        study: _S = _adapter(kind).validate_json(json.dumps(values), strict=True)
    except ValidationError as fault:
        first = fault.errors(include_url=False, include_input=False)[0]
        raise not_as_written(source, _key(first)) from None
    return study


def not_as_written(source: str, key: str) -> InputError:
    """Return the error for a key whose value is not as the command wrote it."""
    remedy = "give the file as the command wrote it, or let this version of tank2sim write it again"
    return InputError(source, key, "has not the form of a result of this command", remedy)


def _key(fault: ErrorDetails) -> str:
    """The path of a key as a reader writes it: ``margins.at_speeds[2].Ms``."""
    text = ""
    for part in fault["loc"]:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".")
