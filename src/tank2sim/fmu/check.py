"""Is an FMU right? Validation by FMPy, then co-simulation through FMPy against the CasADi model."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fmpy.validation import validate_fmu

from tank2sim.arrays import Array, Number
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.export import description_text, without_coefficients
from tank2sim.fmu.hosts import Host, HostCondition, host_conditions, lean_model
from tank2sim.fmu.interface import CLAMP_SWITCH, MAX_STEP, interface
from tank2sim.fmu.manoeuvre import InputSequence, manoeuvre
from tank2sim.fmu.process import Drive, drive_apart
from tank2sim.fmu.reference import by_scheme, exactly, reference_errors, relative_errors
from tank2sim.fmu.reference_run import ReferenceRun, read_reference
from tank2sim.fmu.unpacking import FmuType, UnpackedFmu, unpack
from tank2sim.notices import Level, Notice

LIMITS: dict[FmuType, float] = {"ModelExchange": 1e-6, "CoSimulation": 1e-9}
"""Largest error allowed. Co-Simulation is held against the same scheme, Model Exchange against the exact solution."""

_SECTIONS = ("UnitDefinitions", "DefaultExperiment", "ModelVariables", "ModelStructure")
"""Attributes that the model decides. Names, tokens, dates and capabilities are the FMU's own."""

_IDENTIFIERS = ("name", "valueReference", "index")

Elements = dict[str, dict[str, str]]
"""Place of each element, in words, to its attributes."""


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """Findings of a check.

    Parameters
    ----------
    validation : tuple of str
        What FMPy objects to in the description; empty if nothing.
    differences : tuple of str
        Where the FMU's description or parameters differ from the model's, and what its library failed to do.
    errors : dict
        Kind (``ModelExchange``, ``CoSimulation``) to output to its largest error in the run, relative to the larger
        of the output's range in the run and its nominal value.
    max_error : dict
        Output to the larger of its errors.
    reference_error : float, optional
        Largest error of an output when the FMU repeats the reference result that it carries, relative as above.
    notices : tuple of Notice
        Why it failed, and doubts about the card.
    host : str, optional
        Program of whose conditions it was asked.
    conditions : tuple of HostCondition
        Those conditions.
    compared : bool
        False if there was no model to compare with, and the file alone was validated.
    """

    path: str
    fmi: int
    kinds: tuple[FmuType, ...]
    validation: tuple[str, ...]
    compared: bool
    differences: tuple[str, ...] = ()
    errors: dict[FmuType, dict[str, Number]] = field(default_factory=dict)
    max_error: dict[str, Number] = field(default_factory=dict)
    limits: dict[FmuType, float] = field(default_factory=lambda: dict(LIMITS))
    duration_s: float = 0.0
    reference_error: float | None = None
    passed: bool = False
    notices: tuple[Notice, ...] = ()
    host: str | None = None
    conditions: tuple[HostCondition, ...] = ()

    def judged(self) -> CheckReport:
        """The report with its verdict, and with a notice for each kind of failure."""
        failures = tuple(self._failures())
        notices = tuple(Notice(f"{self.path}: {text}", Level.STOP) for text in failures)
        return replace(self, passed=not failures, notices=(*notices, *self.notices))

    def _failures(self) -> Iterator[str]:
        if self.validation:
            yield f"the description is not valid: {len(self.validation)} objections"
        if self.differences:
            yield f"the FMU is not what its model says: {len(self.differences)} differences"
        if beyond := self._beyond_limits():
            yield f"errors beyond the limits: {', '.join(beyond)}"
        if self.compared and not (self.errors or self.validation or self.differences):
            yield "no output was compared"
        if unmet := [one for one in self.conditions if not one.met]:
            named = "; ".join(f"{one.condition} ({one.found})" for one in unmet)
            yield f"{len(unmet)} of {len(self.conditions)} conditions of {self.host} are not met: {named}"

    def _beyond_limits(self) -> dict[str, None]:
        """Outputs with an error beyond its limit, or with one that is not a number."""
        return {
            name: None
            for kind, found in self.errors.items()
            for name, error in found.items()
            if not error <= LIMITS[kind]
        }


def compare_with_model(path: Path, *, model: Model | None = None, host: Host | None = None) -> CheckReport:
    """Validate an FMU, and drive it in every kind it offers through steps of all inputs, next to the model.

    The library runs in processes of its own: one that cannot be loaded, or ends its process, is a failed check.

    Parameters
    ----------
    path : Path
        The FMU, FMI 2.0 or 3.0, with a library for this machine.
    model : Model, optional
        What the FMU should be. Without it, the file alone is validated.
    host : str, optional
        A program whose conditions the FMU is to meet, too.

    Raises
    ------
    InputError
        The file is missing, no FMU, of another version of FMI, or has no library for this machine.
    """
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory(prefix="tank2sim-") as folder:
        unpacked = unpack(Path(path), Path(folder))
        validation = tuple(str(problem) for problem in validate_fmu(str(path)))
        about: dict[str, Any] = {"path": str(path), "fmi": unpacked.fmi, "kinds": unpacked.kinds}
        about |= {"validation": validation, "host": host}
        about["conditions"] = host_conditions(Path(path), host) if host else ()
        if model is None:
            differences, about["reference_error"] = _repeat_reference(unpacked)
            return CheckReport(**about, compared=False, differences=tuple(differences)).judged()
        model = _as_exported(unpacked, model)
        run = manoeuvre(model)
        differences, errors = _compare(unpacked, model, run)
        if "CoSimulation" in errors:  # else the library cannot run, which has been said
            repeated, about["reference_error"] = _repeat_reference(unpacked)
            differences += repeated
    return CheckReport(
        **about,
        compared=True,
        differences=tuple(differences),
        errors=errors,
        max_error={
            name: max(found[name] for found in errors.values() if name in found)
            for name in dict.fromkeys(name for found in errors.values() for name in found)
        },
        duration_s=float(run.times[-1]),
    ).judged()


def _compare(
    unpacked: UnpackedFmu, model: Model, run: InputSequence
) -> tuple[list[str], dict[FmuType, dict[str, float]]]:
    differences = _name_differences(unpacked, model)
    if differences:
        return differences, {}
    references: dict[FmuType, Callable[[Model, InputSequence], Array]] = {
        "ModelExchange": exactly,
        "CoSimulation": by_scheme,
    }
    parameters = {parameter.name: float(parameter.start) for parameter in model.parameters} | {
        MAX_STEP: model.step_s,
        CLAMP_SWITCH: 0.0,
    }
    names = {"inputs": model.input_names, "outputs": model.outputs, "parameters": tuple(parameters)}
    errors: dict[FmuType, dict[str, float]] = {}
    with ThreadPoolExecutor() as pool:  # the FMU runs in its processes while this one calculates what to expect
        answers = {
            kind: pool.submit(drive_apart, unpacked, Drive(kind=kind, run=run, **names)) for kind in unpacked.kinds
        }
        text = (unpacked.folder / "modelDescription.xml").read_bytes()
        differences = description_differences(unpacked.folder, text, model, unpacked.fmi)
        for kind, promised in answers.items():
            expected = references[kind](model, run)
            answer = promised.result()
            if answer.parameters is not None:
                differences += [f"{kind}: {line}" for line in _parameter_differences(answer.parameters, parameters)]
            if answer.problem:
                differences.append(f"{kind}: {answer.problem}")
            if answer.outputs is not None:
                found = dict(zip(model.outputs, answer.outputs.T, strict=True))
                errors[kind] = reference_errors(model, expected, found)
    return differences, errors


def _repeat_reference(unpacked: UnpackedFmu) -> tuple[list[str], float | None]:
    """Faults when the FMU repeats its reference result in Co-Simulation, and its largest error."""
    try:
        reference = read_reference(unpacked.folder)
    except InputError as error:
        return [f"the reference result {error.problem}"], None
    if reference is None or "CoSimulation" not in unpacked.kinds:
        return [], None
    return _compare_reference(unpacked, reference)


def _compare_reference(unpacked: UnpackedFmu, reference: ReferenceRun) -> tuple[list[str], float | None]:
    variables = {variable.name: variable for variable in unpacked.description.modelVariables}
    unknown = [name for name in (*reference.input_names, *reference.output_names) if name not in variables]
    if unknown:
        return [f"the reference result has {unknown[0]}, which is not a variable of the FMU"], None
    names: dict[str, tuple[str, ...]] = {"inputs": reference.input_names, "outputs": reference.output_names}
    answer = drive_apart(unpacked, Drive(kind="CoSimulation", run=reference.run, parameters=(), **names))
    if answer.outputs is None:
        return [f"reference result: {answer.problem}"], None
    expected, found = (
        dict(zip(reference.output_names, table.T, strict=True)) for table in (reference.outputs, answer.outputs)
    )
    nominals = {name: float(variables[name].nominal or 1.0) for name in expected}
    errors = relative_errors(expected, found, nominals, {name for name in expected if variables[name].unit == "rad"})
    worst = max(errors, key=lambda name: errors[name])
    if errors[worst] <= LIMITS["CoSimulation"]:
        return [], errors[worst]
    return [f"{worst} differs by {errors[worst]:.1e} of its range from the reference result in the FMU"], errors[worst]


def _as_exported(unpacked: UnpackedFmu, model: Model) -> Model:
    """The model, the lean one, or the one with coefficients as constants, by the variables that the FMU has."""
    lean = lean_model(model)
    if not _name_differences(unpacked, lean):
        return lean
    bare = without_coefficients(model)
    found = {name.name for name in unpacked.description.modelVariables if name.causality == "parameter"}
    hidden = set(model.parameter_names) - set(bare.parameter_names)
    return model if found & hidden else bare


def _name_differences(unpacked: UnpackedFmu, model: Model) -> list[str]:
    described = interface(model)
    variables = {variable.name: variable for variable in unpacked.description.modelVariables}
    differences = []
    for causality in ("input", "output", "parameter"):
        wanted = [variable.name for variable in described.with_causality(causality)]
        found = [name for name, variable in variables.items() if variable.causality == causality]
        differences += [f"{causality} {name} of the model is not in the FMU" for name in wanted if name not in found]
        differences += [f"{causality} {name} of the FMU is not in the model" for name in found if name not in wanted]
    return differences


def _parameter_differences(found: Array, expected: dict[str, float]) -> list[str]:
    return [
        f"parameter {name} is {value!r} in the FMU and {expected[name]!r} in the model"
        for name, value in zip(expected, found.tolist(), strict=True)
        if value != expected[name]
    ]


def description_differences(path: Path, text: bytes, model: Model, fmi: int) -> list[str]:
    """Sentences on whatever a model description says of units, variables and dependencies and the model does not.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    text : bytes
        Its ``modelDescription.xml``.
    fmi : int
        2 or 3.

    Raises
    ------
    InputError
        The text is not XML.
    """
    try:
        found = _elements(ElementTree.fromstring(text))
    except ElementTree.ParseError as error:
        raise InputError(path, "modelDescription.xml", f"cannot be read ({error})", "export the FMU again") from None
    expected = _elements(ElementTree.fromstring(description_text(model, fmi=fmi)))
    differences = [f"{place} of the model is not in the FMU" for place in expected if place not in found]
    differences += [f"{place} of the FMU is not in the model" for place in found if place not in expected]
    for place in expected:
        differences += _attribute_differences(place, found.get(place, expected[place]), expected[place])
    if not differences and list(found) != list(expected):
        differences.append("the elements of the description are in another order than the model's")
    return differences


def _elements(root: ElementTree.Element) -> Elements:
    elements: Elements = {}
    for section in _SECTIONS:
        for top in root.findall(section):
            for place, attributes in _walk(top, section):
                again = sum(1 for other in elements if other == place or other.startswith(f"{place} (again"))
                elements[f"{place} (again {again})" if again else place] = attributes
    return elements


def _walk(element: ElementTree.Element, place: str) -> Iterator[tuple[str, dict[str, str]]]:
    yield place, dict(element.attrib)
    for child in element:
        identity = next((child.attrib[key] for key in _IDENTIFIERS if key in child.attrib), "")
        yield from _walk(child, f"{place}: {child.tag} {identity}".rstrip())


def _attribute_differences(place: str, found: dict[str, str], expected: dict[str, str]) -> list[str]:
    return [
        f"{place}: {name} is {found.get(name, 'missing')} in the FMU and {expected.get(name, 'missing')} in the model"
        for name in dict.fromkeys([*expected, *found])
        if not _same(found.get(name), expected.get(name))
    ]


def _same(found: str | None, expected: str | None) -> bool:
    if found is None or expected is None or found == expected:
        return found == expected
    try:
        return float(found) == float(expected)  # 1e2 says what 100.0 says
    except ValueError:
        return False
