"""Is an FMU right? Validation by FMPy, then co-simulation through FMPy against the CasADi model."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from tank2sim.dynamics.model import Model, Vector
from tank2sim.fmu.interface import MAX_STEP, interface
from tank2sim.fmu.manoeuvre import Manoeuvre, manoeuvre
from tank2sim.fmu.reference import by_scheme, exactly
from tank2sim.fmu.running import RunningFmu, co_simulate, exchange, running
from tank2sim.fmu.unpacking import Kind, UnpackedFmu, unpack

LIMITS: dict[Kind, float] = {"ModelExchange": 1e-6, "CoSimulation": 1e-9}
"""Largest error allowed. Co-Simulation is held against the same scheme, Model Exchange against the exact solution."""


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """What a check found.

    Parameters
    ----------
    validation : tuple of str
        What FMPy objects to in the description; empty if nothing.
    differences : tuple of str
        Where variables of the FMU differ from those of the model, and calls that failed.
    errors : dict
        Kind (``ModelExchange``, ``CoSimulation``) to output to its largest error in the run, relative to the larger
        of the output's range in the run and its nominal value.
    max_error : dict
        Output to the larger of its errors.
    compared : bool
        False if there was no model to compare with, and the file alone was validated.
    """

    path: str
    fmi: int
    kinds: tuple[Kind, ...]
    validation: tuple[str, ...]
    compared: bool
    differences: tuple[str, ...] = ()
    errors: dict[Kind, dict[str, float]] = field(default_factory=dict)
    max_error: dict[str, float] = field(default_factory=dict)
    limits: dict[Kind, float] = field(default_factory=lambda: dict(LIMITS))
    duration_s: float = 0.0
    passed: bool = False

    def as_json(self) -> dict[str, Any]:
        """Plain data for a JSON file."""
        return asdict(self)


def check_fmu(path: Path, *, model: Model | None = None) -> CheckReport:
    """Validate an FMU, and drive it in every kind it offers through steps of all inputs, beside the model.

    Parameters
    ----------
    path : Path
        The FMU, FMI 2.0 or 3.0, with a library for this machine.
    model : Model, optional
        What the FMU should be. Without it, the file alone is validated.

    Raises
    ------
    InputError
        The file is missing, no FMU, of another version of FMI, or has no library for this machine.
    """
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory(prefix="tank2sim-") as folder:
        unpacked = unpack(Path(path), Path(folder))
        validation = tuple(str(problem) for problem in validate_fmu(str(path)))
        about: dict[str, Any] = {"path": str(path), "fmi": unpacked.fmi, "kinds": unpacked.kinds}
        if model is None:
            return CheckReport(**about, validation=validation, compared=False, passed=not validation)
        run = manoeuvre(model)
        differences, errors = _compare(unpacked, model, run)
    return CheckReport(
        **about,
        validation=validation,
        compared=True,
        differences=tuple(differences),
        errors=errors,
        max_error={
            name: max(found[name] for found in errors.values() if name in found)
            for name in dict.fromkeys(name for found in errors.values() for name in found)
        },
        duration_s=float(run.times[-1]),
        passed=not validation and not differences and len(errors) > 0 and _within(errors),
    )


def _compare(unpacked: UnpackedFmu, model: Model, run: Manoeuvre) -> tuple[list[str], dict[Kind, dict[str, float]]]:
    differences = _interface_differences(unpacked, model)
    if differences:
        return differences, {}
    references: dict[Kind, Callable[[Model, Manoeuvre], Vector]] = {
        "ModelExchange": exactly,
        "CoSimulation": by_scheme,
    }
    drive = {"ModelExchange": exchange, "CoSimulation": co_simulate}
    errors: dict[Kind, dict[str, float]] = {}
    for kind in unpacked.kinds:
        expected = references[kind](model, run)
        log: list[str] = []
        try:
            with running(unpacked, kind) as fmu:
                log = fmu.log
                differences += [f"{kind}: {difference}" for difference in _parameter_differences(fmu, model)]
                found = drive[kind](fmu, run, model.input_names, model.outputs)
        except (FMICallException, RuntimeError, AttributeError) as error:
            differences.append(f"{kind}: {error} {' '.join(log)}".strip())
            continue
        errors[kind] = _errors(model, found, expected)
    return differences, errors


def _interface_differences(unpacked: UnpackedFmu, model: Model) -> list[str]:
    described = interface(model)
    there = {variable.name: variable for variable in unpacked.description.modelVariables}
    differences = []
    for causality in ("input", "output", "parameter"):
        wanted = [variable.name for variable in described.with_causality(causality)]
        found = [name for name, variable in there.items() if variable.causality == causality]
        differences += [f"{causality} {name} of the model is not in the FMU" for name in wanted if name not in found]
        differences += [f"{causality} {name} of the FMU is not in the model" for name in found if name not in wanted]
    for name in model.outputs:
        if name in there and there[name].unit != model[name].unit:
            differences.append(f"output {name} is in {there[name].unit}, in the model in {model[name].unit}")
    return differences


def _parameter_differences(fmu: RunningFmu, model: Model) -> list[str]:
    expected = {parameter.name: float(parameter.start) for parameter in model.parameters} | {MAX_STEP: model.step_s}
    return [
        f"parameter {name} is {found!r} in the FMU and {expected[name]!r} in the model"
        for name, found in zip(expected, fmu.read(list(expected)), strict=True)
        if found != expected[name]
    ]


def _errors(model: Model, found: Vector, expected: Vector) -> dict[str, float]:
    errors = {}
    for place, name in enumerate(model.outputs):
        difference = np.abs(found[:, place] - expected[:, place])
        if model[name].unit == "rad" and name not in model.state_names:
            # An angle that is calculated anew may jump by a full turn, a moment sooner or later.
            difference = np.minimum(difference, np.abs(difference - 2 * np.pi))
        scale = max(float(np.ptp(expected[:, place])), abs(model[name].nominal) or 1.0)
        errors[name] = float(np.max(difference)) / scale
    return errors


def _within(errors: dict[Kind, dict[str, float]]) -> bool:
    # Written so that an error that is not a number fails.
    return all(error <= LIMITS[kind] for kind, found in errors.items() for error in found.values())
