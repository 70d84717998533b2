"""Results by the command that writes them: their JSON is read back, and its JSON Schema is made, from their studies."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from tank2sim.answer.result import Result
from tank2sim.answer.study import study_schema
from tank2sim.arguments import checked
from tank2sim.errors import InputError
from tank2sim.files import schema_command, schema_name

RESULT_CLASSES: dict[str, tuple[str, ...]] = {
    "audit": ("results.audit:AuditResult",),
    "autopilot": ("results.autopilot:AutopilotResult", "results.autopilot:CraftAutopilotResult"),
    "check": ("results.fmu:CheckResult",),
    "compare": ("results.comparison:ComparisonResult",),
    "convention": ("apps.programs.convention_result:ConventionResult",),
    "convert": ("apps.programs.convert_result:ConversionResult",),
    "demo": ("apps.demo.result:DemoResult",),
    "design": ("apps.design.result:CampaignDesignResult", "apps.design.result:TrialDesignResult"),
    "export": ("results.fmu:ExportResult",),
    "gap": ("results.gap:GapResult", "results.gap_fleet:FleetResult"),
    "glide": ("apps.rigs.glider.result:GlideResult",),
    "influence": (
        "results.influence:InfluenceResult",
        "apps.steering_cards.result:SteeringModelsResult",
        "apps.steering_cards.tuning_result:TurnTuningResult",
    ),
    "guess": ("apps.guess.result:GuessResult",),
    "identify": (
        "results.identification:IdentificationResult",
        "results.craft_identification:CraftIdentificationResult",
    ),
    "log": ("apps.logs.result:LogResult",),
    "reduce": ("results.reduction:ReductionResult", "results.mmg_reduction:MmgReductionResult"),
    "run": ("results.captive_run:CaptiveRunResult",),
    "pilotcard": ("apps.bridge.result:PilotCardResult",),
    "poster": ("apps.bridge.result:PosterResult",),
    "ships": ("results.ships:ShipsResult",),
    "signals": ("apps.signals.result:SignalsResult",),
    "simulate": ("results.manoeuvre:ManoeuvreResult",),
    "stability": ("results.stability:StabilityResult", "results.craft_stability:CraftStabilityResult"),
    "steer": ("apps.steering.result:SteeringPageResult",),
    "tow": ("apps.rigs.tow.result:TowResult",),
    "validate": ("results.validation:ValidationResult", "results.craft_validation:CraftValidationResult"),
    "yaw": ("apps.rigs.yaw.result:YawResult",),
}
"""Command to its results, each as ``module:class``; a command that has several writes one of them."""


def result_classes(command: str) -> list[type[Result[Any]]]:
    """Return the classes of the results of a command; empty if it writes none."""
    found = []
    for place in RESULT_CLASSES.get(command, ()):
        module, _, name = place.partition(":")
        found.append(getattr(importlib.import_module(f"tank2sim.{module}"), name))
    return found


@checked
def json_schema(command: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of the JSON that a command writes.

    Parameters
    ----------
    command : str
        A key of :data:`RESULT_CLASSES`.

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
    if command not in RESULT_CLASSES:
        raise KeyError(command)
    shapes, parts = [], {}
    for kind in result_classes(command):
        shape = study_schema(kind.study_type())
        parts.update(shape.pop("$defs", {}))
        shape["properties"] = {"schema": {"const": schema_name(command)}, **shape["properties"]}
        shape["required"] = ["schema", *shape.get("required", ())]
        shapes.append({**shape, "description": (kind.study_type().__doc__ or "").partition("\n")[0]})
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": schema_name(command)}
    return {**head, **(shapes[0] if len(shapes) == 1 else {"oneOf": shapes}), "$defs": parts}


def read_result(values: Mapping[str, Any], source: str) -> Result[Any]:
    """Return the result whose JSON values these are.

    Raises
    ------
    InputError
        They are not the result of a command of this version, or a value is not as the command writes it.
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
