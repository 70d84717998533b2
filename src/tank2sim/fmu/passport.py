"""The passport of an FMU: where each coefficient is from, how sure it is, where it holds, and what was found of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any

from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.fmu.documents import Documents
from tank2sim.fmu.provenance import ABSENT, STATED_ERROR, ValueOrigin
from tank2sim.fmu.reference_run import EXTRA
from tank2sim.fmu.simulator_rules import RuleRow, simulator_rules
from tank2sim.simulation.run import Run

PASSPORT_FILE = f"{EXTRA}/passport.json"
PASSPORT_PAGE = "documentation/passport.html"
_FORMAT = "tank2sim-passport/1"

# What a user sets is not a coefficient of the ship.
_NOT_OF_THE_SHIP = ("initial.", "origin.", "solver.")


@dataclass(frozen=True, kw_only=True)
class PassportCoefficient:
    """A coefficient: the FMU's variable that holds it and what it is, its value in `unit`, and where that is from."""

    variable: str
    description: str
    value: float
    unit: str
    standard_error: float | None
    standard_error_from: str
    source: str
    remark: str


@dataclass(frozen=True, kw_only=True)
class Replay:
    """What the library of the FMU answered to its own reference run, in Co-Simulation on the machine that wrote it.

    Parameters
    ----------
    run : str
        What was done; empty if there is no reference run.
    platform : str
        Folder of the library that was run; empty if it was not run.
    max_error : float, optional
        Largest error of an output, relative to the larger of its range in the run and its nominal value.
    output : str
        The output with that error.
    problem : str
        Why there is no error to show.
    """

    run: str = ""
    platform: str = ""
    max_error: float | None = None
    output: str = ""
    problem: str = ""


@dataclass(frozen=True, kw_only=True)
class Passport:
    """All that is said of a model. See :func:`passport` and :meth:`as_json`."""

    model: str
    description: str
    source: str
    validity: str
    speed_range_mps: tuple[float, float] | None
    coefficients: tuple[PassportCoefficient, ...]
    notices: tuple[str, ...]
    figures: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    card_range: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    replay: Replay = field(default_factory=Replay)
    rules: tuple[RuleRow, ...] = ()

    def as_json(self) -> str:
        """The passport as JSON text, in ASCII; a number that is not finite is null."""
        values = {"format": _FORMAT, "written_by": f"tank2sim {version('tank2sim')}", **asdict(self)}
        return json.dumps(_finite(values), indent=1, allow_nan=False) + "\n"


def passport(model: Model, documents: Documents, manoeuvres: Mapping[str, Run], replay: Replay) -> Passport:
    """The passport of a model, from the origins that its documents state."""
    variables: list[Parameter | Input] = [*model.parameters]
    variables += [input_ for input_ in model.inputs if input_.name in documents.origins]
    return Passport(
        model=model.name,
        description=model.description,
        source=documents.source,
        validity=documents.validity,
        speed_range_mps=documents.speed_range_mps,
        coefficients=tuple(
            _coefficient(variable, documents.origins.get(variable.name, ValueOrigin(ABSENT)))
            for variable in variables
            if not variable.name.startswith(_NOT_OF_THE_SHIP)
        ),
        notices=model.notices,
        figures={name: run.figures for name, run in manoeuvres.items()},
        card_range={name: run.reading.as_json() | {"message": run.reading.message} for name, run in manoeuvres.items()},
        replay=replay,
        rules=simulator_rules(
            model,
            manoeuvres={"turn_35", "zigzag_20_20"} <= set(manoeuvres),
            errors=any(origin.error_from == STATED_ERROR for origin in documents.origins.values()),
        ),
    )


def _coefficient(variable: Parameter | Input, origin: ValueOrigin) -> PassportCoefficient:
    return PassportCoefficient(
        variable=variable.name,
        description=variable.description,
        value=float(variable.start),
        unit=variable.unit,
        standard_error=origin.standard_error,
        standard_error_from=origin.error_from,
        source=origin.source,
        remark=origin.remark,
    )


def _finite(value: Any) -> Any:
    match value:
        case Mapping():
            return {str(key): _finite(item) for key, item in value.items()}
        case list() | tuple():
            return [_finite(item) for item in value]
        case float():
            return value if math.isfinite(value) else None
        case _:
            return value
