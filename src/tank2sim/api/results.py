"""Results by the command that writes them: their JSON is read back, and its JSON Schema is made, from their studies."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from tank2sim.answer.result import Result
from tank2sim.answer.study import study_schema
from tank2sim.api.commands import VERBS, variants_of
from tank2sim.arguments import checked
from tank2sim.errors import InputError
from tank2sim.files import schema_command, schema_name


def result_classes(command: str) -> list[type[Result[Any]]]:
    """Return the result classes of a command, its variants' last; empty if it writes none."""
    if (verb := VERBS.get(command)) is None:
        return []
    found: dict[type[Result[Any]], None] = {}
    for place in (place for each in (verb, *variants_of(verb).values()) for place in each.results):
        module, _, name = place.partition(":")
        found[getattr(importlib.import_module(module), name)] = None
    return list(found)


def commands_with_results() -> list[str]:
    """Names of the commands that write a result as JSON, in the order of the alphabet."""
    return sorted(name for name, verb in VERBS.items() if verb.results)


@checked
def json_schema(command: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of the JSON that a command writes.

    Parameters
    ----------
    command : str
        Its name.

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
    shapes, parts = [], {}
    if not (kinds := result_classes(command)):
        raise KeyError(command)
    for kind in kinds:
        shape = study_schema(kind.study_type())
        parts.update(shape.pop("$defs", {}))
        shape["properties"] = {"schema": {"const": schema_name(command)}, **shape["properties"]}
        shape["required"] = ["schema", *shape.get("required", ())]
        shapes.append({**shape, "description": (kind.study_type().__doc__ or "").partition("\n")[0]})
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": schema_name(command)}
    return {**head, **(shapes[0] if len(shapes) == 1 else {"oneOf": shapes}), "$defs": parts}


def read_result(values: Mapping[str, Any], source: str) -> Result[Any]:
    """Return the result whose JSON values these are.

    Raises InputError: they are not of a command of this version, or a value is not as the command writes it.
    """
    if "schema" not in values:
        remedy = "give what a command wrote with --json"
        raise InputError(source, "", "is not a result of a tank2sim command", remedy)
    schema = values["schema"]
    kinds = result_classes(schema_command(schema) or "")
    if not kinds:
        remedy = "give what this version of tank2sim wrote with --json"
        raise InputError(source, "schema", f"is {str(schema)[:60]!r}, which is not known", remedy)

    def strange(kind: type[Result[Any]]) -> int:
        """Number of keys that one has and the other does not."""
        return len(set(study_schema(kind.study_type())["properties"]) ^ (set(values) - {"schema"}))

    return min(kinds, key=strange).read(values, source)
