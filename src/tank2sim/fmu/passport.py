"""The passport of an FMU: where each coefficient is from, how sure it is, where it holds, and what was found of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from importlib.metadata import version
from typing import Any

from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.fmu.provenance import ABSENT, STATED_ERROR, Documents, ValueOrigin
from tank2sim.fmu.reference_run import EXTRA
from tank2sim.simulation.run import Run

PASSPORT_FILE = f"{EXTRA}/passport.json"
PASSPORT_PAGE = "documentation/passport.html"
_FORMAT = "tank2sim-passport/1"

# What a user sets is not a coefficient of the ship.
_NOT_OF_THE_SHIP = ("initial.", "origin.", "solver.")

STCW, ITTC = "STCW Code, section B-I/12", "ITTC 7.5-02-06-03 (2002)"
DNV = "DNV-ST-0033, as 2.14 (2011) is reported by Czaplewski & Zwolan (2018)"


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
    """Answer of the FMU's library to its own reference run, in Co-Simulation on the machine that wrote it."""

    run: str = ""  # What was done; empty if there is no reference run
    platform: str = ""  # Folder of the library that was run; empty if it was not run
    # Largest error of an output, relative to the larger of its range in the run and its nominal value.
    max_error: float | None = None
    output: str = ""  # The output with that error
    problem: str = ""  # Why there is no error to show


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
        notices=tuple(notice.line for notice in model.notices),
        figures={name: run.figures for name, run in manoeuvres.items()},
        card_range={
            name: run.reading.as_json() | {"message": "; ".join(run.reading.notices)}
            for name, run in manoeuvres.items()
        },
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


class Shown(StrEnum):
    """Whether a requirement is shown to be met."""

    SHOWN = "shown"
    NOT_SHOWN = "not shown"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, kw_only=True)
class RuleRow:
    """A requirement: rule and clause, what it asks for, whether it is shown, and where or why not."""

    rule: str
    clause: str
    subject: str
    shown: Shown
    remark: str


def simulator_rules(model: Model, *, manoeuvres: bool, errors: bool) -> tuple[RuleRow, ...]:
    """Requirements of rules for simulators on the model of a ship, and what the passport shows of each; else empty.

    Only requirements whose text was at hand are listed: paragraph 68 of section B-I/12 of the STCW Code (navigation and
    watchkeeping simulation), and headings of ITTC 7.5-02-06-03 (2002), Validation of Manoeuvring Simulation Models.
    Text of DNV-ST-0033, Maritime Simulator Systems, was not at hand. Its rows are those that K. Czaplewski & P. Zwolan
    (2018), Multicriteria analysis method for evaluation of vessel simulation models in open waters, Journal of
    Navigation, report of section C2 of the edition of 2011, then Standard for Certification 2.14; the clauses of today
    may ask for more.

    `manoeuvres`: the passport has figures of a turning circle and a zigzag. `errors`: the card states standard errors
    of its coefficients.
    """
    if "rudder.command" not in model.input_names:
        return ()
    inputs = set(model.input_names)
    run = "turning circle and zigzag in this passport" if manoeuvres else "the motion leaves all bounds"
    wind, waves = "wind.speed" in inputs, "waves.height" in inputs
    motions = "surge, sway, yaw and roll" if "motion.phi" in model else "surge, sway and yaw"
    current = bool({"current.speed", "current.north"} & inputs)
    external = "a force from outside can be given: inputs external.*" if "external.X" in inputs else "no input for it"
    bridge = "of the simulator, not of the model of the ship"
    rows: tuple[tuple[str, str, str, bool | None, str], ...] = (
        (STCW, "68.1", "operating environment in real time: instruments and controls", None, bridge),
        (STCW, "68.2", "visual scenario as seen from the bridge", None, bridge),
        (STCW, "68.3", "own ship dynamics in open water", manoeuvres, run),
        (STCW, "68.3", "effects of weather: wind", wind, "input wind.speed" if wind else "no wind"),
        (STCW, "68.3", "effects of weather: waves", waves, "inputs waves.*" if waves else "no waves"),
        (STCW, "68.3", "tidal stream, currents", current, "inputs of the current" if current else "no current"),
        (STCW, "68.3", "interaction with other ships", False, external),
        (STCW, "68.4", "communication with vessel traffic services", None, bridge),
        (
            DNV,
            "C2",
            "motion in six degrees of freedom",
            False,
            f"{motions}, others only in waves",
        ),
        (
            DNV,
            "C2",
            "hydrodynamic forces allowed for",
            True,
            "coefficients below, equations in the manual",
        ),
        (ITTC, "3.2", "prediction of forces", True, "source of each coefficient below"),
        (ITTC, "3.3", "modelling of forces", True, "kind of the model above; equations in its manual"),
        (ITTC, "3.5", "integration method", True, f"Runge-Kutta of the fourth order, {model.step_s:.3g} s at most"),
        (ITTC, "3.6", "simulation software", True, "tank2sim, version above"),
        (ITTC, "3.7", "simulated manoeuvres", manoeuvres, run),
        (ITTC, "4.2", "benchmark data", False, "comparison with trials: tank2sim validate"),
        (ITTC, "4.3", "potential causes of prediction error", errors, _errors(errors)),
        (ITTC, "4.4", "sensitivity analysis", False, "tank2sim influence"),
    )
    return tuple(
        RuleRow(rule=rule, clause=clause, subject=subject, shown=_shown(shown), remark=remark)
        for rule, clause, subject, shown, remark in rows
    )


def _shown(shown: bool | None) -> Shown:
    if shown is None:
        return Shown.NOT_APPLICABLE
    return Shown.SHOWN if shown else Shown.NOT_SHOWN


def _errors(stated: bool) -> str:
    return "standard errors below" if stated else "the card states no standard error"
