"""Keys of the JSON of each result, and the JSON Schema that is generated from them.

Units are in the names of keys; what is not a finite number is null. A schema allows no key that is not declared here.
"""

from __future__ import annotations

from typing import Any

from pydantic import ConfigDict, TypeAdapter
from typing_extensions import TypedDict

from tank2sim.api.bounds import checked
from tank2sim.api.results import RESULT_CLASSES, result_schema
from tank2sim.files import schema_name

JsonNumber = float | None
"""A number; null where it is not finite or not known."""

JsonColumns = dict[str, list[JsonNumber]]
"""JsonColumns (n,) by name with unit, all of one length."""

FigureValues = dict[str, float | list[float] | None]
"""Manoeuvring figures by name with unit; null where the run was too short."""


class _Part(TypedDict):
    """Base of parts of results: no keys except those declared."""

    __pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[misc]


class _Keys(_Part):
    """Base of results."""

    schema: str


KEYS: dict[str, Any] = {}
"""Command to the keys of its JSON; ``report`` has none."""


@checked
def json_schema(command: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of the JSON that a command writes.

    Parameters
    ----------
    command : str
        A key of :data:`KEYS`.

    Raises
    ------
    KeyError
        The command has no schema.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.json_schema("simulate")["properties"]["schema"]
    {'const': 'tank2sim/simulate/1'}
    """
    if command in RESULT_CLASSES:
        return result_schema(command)
    schema = TypeAdapter(KEYS[command]).json_schema()
    if "anyOf" in schema:  # no key is allowed that is not declared, so that one shape alone fits
        schema["oneOf"] = schema.pop("anyOf")
    for part in (schema, *schema.get("$defs", {}).values()):
        if "schema" in part.get("properties", {}):
            part["properties"]["schema"] = {"const": schema_name(command)}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": schema_name(command), **schema}
