"""A ship in plain C99, for controllers and test benches without an importer of FMUs: header, source and self-test."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import Card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.escaping import c_comment
from tank2sim.fmu.interface import TRIM_SWITCH, FmuVariable, Interface, interface
from tank2sim.fmu.manoeuvre import InputSequence, manoeuvre
from tank2sim.fmu.reference import DIRECTIONS, by_scheme
from tank2sim.fmu.sources import fmu_equations
from tank2sim.fmu.templates import c_identifier, render
from tank2sim.native.plain_c import math_functions, operation_counts, plain_c
from tank2sim.simulation.trajectory import TIMES_BEYOND

_LONGEST_PREFIX = 24
"""Letters of the ship's name in each name of the code. Project choice: lines stay short."""

_STEPS, _EVERY, _INTERNAL = 100, 5, 4.5
"""Steps of the self-test, steps from one comparison to the next, and internal steps in a step (rounded up)."""

TOLERANCES = (1e-9, 1e-4)
"""Largest error of an output in the self-test, of its size, in double and single precision. Project choice: what
other mathematical libraries make of the last bits; float loses 6e-6 on the bundled cards, 5e-5 with ``waves``."""


@dataclass(frozen=True, kw_only=True)
class PlainShip:
    """A ship in plain C99."""

    prefix: str  # Beginning of each public name; macros and enumerators have it in capitals
    files: dict[str, str]  # Name to text of ``ship.h``, ``ship.c`` and ``self_test.c``
    counts: dict[str, int]  # ``states``, ``inputs``, ``outputs``, ``parameters``, ``constants`` to their number
    operations: dict[str, int]  # Kind of operation to its number in an internal step
    work: int  # Largest number of local numbers in a function
    use: str  # How the files are compiled and called, and what they need, in Markdown

    def instance_bytes(self, *, single: bool = False) -> int:
        """Size of an instance."""
        return sum(self.counts.values()) * (4 if single else 8)

    def stack_bytes(self, *, single: bool = False) -> int:
        """Estimated largest stack of a call: local numbers and two copies of the states, without what is spilt."""
        return (self.work + 2 * self.counts["states"]) * (4 if single else 8)


def plain_ship(card: Card) -> PlainShip:
    """A card's equations in plain C99: as in its FMU, with the same steps, to the last bit in double precision.

    `card`: of any kind that has a model; steering gear, low speed and effects are in it. Raises InputError: the card
    names what no model knows, or an effect of another package has what C99 cannot name or calculate.
    """
    model = with_simulator_interface(build(card))
    described = interface(model)
    prefix = code_prefix(card.ship.name)
    functions = _functions(model)
    used = {name: function for name, function in functions.items() if name != "settle" or described.trim_switch}
    values = _values(card, model, described, prefix) | {
        "code": _code(card, functions, prefix),
        "constants": max(1, functions["constants"].numel_out(0)),
        "math": sorted({*math_functions(used.values()), "ceil"}),
    }
    counts = {name: len(values[name]) for name in ("states", "inputs", "outputs", "parameters")}
    made = PlainShip(
        prefix=prefix,
        files={name: render(name, values) for name in ("ship.h", "ship.c")}
        | {"self_test.c": render("self_test.c", values | _self_test(model))},
        counts=counts | {"constants": values["constants"]},
        operations=operation_counts(functions["step"]),
        work=max(function.sz_w() for function in used.values()),
        use="",
    )
    sizes = {
        "instance": [made.instance_bytes(), made.instance_bytes(single=True)],
        "stack": [made.stack_bytes(), made.stack_bytes(single=True)],
        "operations": made.operations,
    }
    use = render("c99_use.md", values | sizes | {"tolerances": TOLERANCES})
    return replace(made, use=use)


def code_prefix(name: str) -> str:
    """Small letters, digits and ``_`` with which the names of a ship's code begin; ``ship`` if its name has none."""
    stem = c_identifier(name).lower()[:_LONGEST_PREFIX].rstrip("_")
    if re.fullmatch(r"u?int(max|\d+)", stem):  # INT32_C is a macro of stdint.h
        return f"ship_{stem}"
    return "ship" if stem == "model" or not re.search("[a-z]", name.lower()) else stem


def _functions(model: Model) -> dict[str, ca.Function]:
    """Equations of the FMU by their names in the template; outputs are all of the model's, in its order."""
    equations = {function.name().removeprefix("model_"): function for function in fmu_equations(model)}
    x, u, p = model.x, model.u, model.p
    outputs = ca.Function("outputs", [x, u, p], [ca.densify(model.output_values)], {"cse": True})
    chosen = {name: equations[name] for name in ("constants", "initial", "step")}
    return {**chosen, "outputs": outputs, "settle": equations["trim_step"]}


_NAMES = {
    "constants": (("p",), ("c",)),
    "initial": (("p",), ("x",)),
    "step": (("x", "in", "p", "c", "length"), ("next",)),
    "outputs": (("x", "in", "p"), ("out",)),
    "settle": (("x", "in", "p"), ("next",)),
}
"""Arguments and results of each function in the template."""


def _code(card: Card, functions: dict[str, ca.Function], prefix: str) -> dict[str, str]:
    try:
        return {name: plain_c(function, prefix, *_NAMES[name]) for name, function in functions.items()}
    except ValueError as error:
        raise card.fault("effects", f"cannot be written in C99 ({error})", "leave that effect out") from None


def _values(card: Card, model: Model, described: Interface, prefix: str) -> dict[str, Any]:
    """The data of the templates, without the code."""
    variables = described.variables
    blocks = {"states": described.states, "inputs": described.inputs, "parameters": described.parameters}
    named: dict[str, list[dict[str, Any]]] = {
        "outputs": [_entry(described.by_name[name]) for name in model.outputs],
        **{name: [_entry(one) for one in variables[block.begin : block.end]] for name, block in blocks.items()},
    }
    for kind, entries in named.items():
        words = [entry["word"] for entry in entries]
        if doubled := sorted({word for word in words if words.count(word) > 1}):
            raise card.fault("effects", f"has two {kind} that C99 would call {doubled[0]}", "leave that effect out")
    return {
        "p": prefix,
        "P": prefix.upper(),
        "title": c_comment(card.ship.name),
        "source": c_comment(f"{Path(card.source).name} ({card.ship.source})"),
        "version": version("tank2sim"),
        "card_hash": hashlib.sha256(card.text.encode("utf-8")).hexdigest(),
        "step_s": float(model.step_s),
        "trim_switch": _word(TRIM_SWITCH) if described.trim_switch else "",
        **named,
    }


def _entry(variable: FmuVariable) -> dict[str, Any]:
    lowest, highest = variable.accepted or (variable.minimum, variable.maximum)
    if variable.boolean:
        lowest, highest = 0.0, 1.0
    assert lowest is not None and highest is not None
    unit = "0 or 1" if variable.boolean else variable.unit
    return {
        "word": _word(variable.name),
        "comment": c_comment(f"{variable.name} ({unit}): {variable.description}"),
        "start": variable.start or 0.0,
        "lowest": lowest,
        "highest": highest,
        "largest": TIMES_BEYOND * max(abs(lowest), abs(highest)),
        "nominal": variable.nominal,
    }


def _word(name: str) -> str:
    """A variable's name within an enumerator, in its own letters."""
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")


def self_test_run(model: Model) -> InputSequence:
    """The run of the self-test: each input goes through its course, some of them at a time."""
    inputs = manoeuvre(model).inputs
    times = np.arange(_STEPS + 1, dtype=np.float64) * (_INTERNAL * model.step_s)
    return InputSequence(times, inputs[:: len(inputs) // _STEPS][:_STEPS])


def _self_test(model: Model) -> dict[str, Any]:
    run = self_test_run(model)
    held = np.vstack([model.input_values(), run.inputs])
    changed = [(step, place) for step, place in np.argwhere(held[1:] != held[:-1])]
    rows = by_scheme(model, run)[_EVERY::_EVERY]
    return {
        "tolerances": TOLERANCES,
        "steps": _STEPS,
        "every": _EVERY,
        "dt": _INTERNAL * model.step_s,
        "changes": [
            {"step": int(step), "word": _word(model.input_names[place]), "value": float(run.inputs[step, place])}
            for step, place in changed
        ],
        "rows": rows.tolist(),
        "outputs": [
            {"size": size, "wraps": model[name].unit == "rad" and name not in model.state_names}
            for name, size in zip(model.outputs, _sizes(model, rows), strict=True)
        ],
    }


def _sizes(model: Model, rows: Array) -> list[float]:
    """Size of each output (ny,): the larger of its largest value in the rows and its nominal one.

    Directions count by the size of their velocity, as in :func:`.reference_errors`.
    """
    columns = dict(zip(model.outputs, np.abs(rows).max(axis=0), strict=True))
    sizes = {name: max(float(value), abs(model[name].nominal) or 1.0) for name, value in columns.items()}
    slowest = dict(zip(model.outputs, np.abs(rows).min(axis=0), strict=True))
    for name, velocity in DIRECTIONS.items():
        if {name, velocity} <= sizes.keys():
            share = float(slowest[velocity]) / (abs(model[velocity].nominal) or 1.0)
            sizes[name] /= min(1.0, max(share, 1e-6))
    return list(sizes.values())
