"""The equations of a ship as a program: a function for MSS (MATLAB, Octave), a class for PVS (Python).

Both are written from the same CasADi graph as the FMU's C code, operation by operation, so that they are the model with
its steering gear, effects and low speed, and not a second version of it.
"""

from __future__ import annotations

import builtins
import keyword
import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import casadi as ca

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.model import Model, Variable
from tank2sim.escaping import one_line, python_text
from tank2sim.native.operations import COMPARISONS, FUNCTIONS, OPERATORS, instructions

_RENAMED = {"fabs": "abs", "fmin": "min", "fmax": "max", "fmod": "rem"}
# Operations of CasADi to functions of MATLAB; Python's are the same or in _PYTHON
_CALLED = {op: _RENAMED.get(word, word) for op, word in FUNCTIONS.items()} | {ca.OP_SIGN: "sign"}

_PYTHON = {word: f"math.{word}" for word in _CALLED.values() if word not in ("abs", "min", "max")}
_PYTHON |= {"rem": "math.fmod", "sign": "_sign", "~=": "!="}

Spelling = Callable[[str], str]


def _operation(op: int, names: list[str], spelt: Spelling) -> str:
    """An operation on one or two names, as an expression of MATLAB or Python."""
    a, b = names[0], names[-1]
    if op in OPERATORS:
        return f"{a} {OPERATORS[op]} {b}"
    if op in COMPARISONS:
        return f"1.0 * ({a} {spelt(COMPARISONS[op].replace('!', '~'))} {b})"
    python = spelt("^") == "**"
    others: Mapping[int, str] = {
        ca.OP_ASSIGN: a,
        ca.OP_NEG: f"-{a}",
        ca.OP_SQ: f"{a} * {a}",
        ca.OP_TWICE: f"2 * {a}",
        ca.OP_INV: f"1 / {a}",
        ca.OP_POW: f"{a} {spelt('^')} {b}",
        ca.OP_CONSTPOW: f"{a} {spelt('^')} {b}",
        ca.OP_NOT: f"1.0 * ({a} == 0)",
        ca.OP_AND: f"1.0 * ({a} != 0 and {b} != 0)" if python else f"1.0 * ({a} ~= 0 && {b} ~= 0)",
        ca.OP_OR: f"1.0 * ({a} != 0 or {b} != 0)" if python else f"1.0 * ({a} ~= 0 || {b} ~= 0)",
        ca.OP_IF_ELSE_ZERO: f"_if({a}, {b})" if python else f"if_else_zero({a}, {b})",
        ca.OP_COPYSIGN: f"abs({a}) * (1 - 2 * ({b} < 0))",
    }
    if op in others:
        return others[op]
    if op in _CALLED:
        return f"{spelt(_CALLED[op])}({', '.join(names)})"
    raise ValueError(f"operation {op} of CasADi has no spelling in other programs")


def operations(model: Model, spelt: Spelling, first: int) -> list[str]:
    """Assignments that make ``xdot`` of ``x``, ``ui``, ``p``, whose entries are counted from `first` (0 or 1).

    `spelt`: Spelling of a function or operator in the language; `first`: 0 for Python, with square brackets; 1 for
    MATLAB, with round ones.
    """
    opening, closing = ("[", "]") if first == 0 else ("(", ")")
    arrays, lines = ("x", "ui", "p"), []
    for op, out, into, constant in instructions(model.rhs):
        if op == ca.OP_OUTPUT:
            lines.append(f"xdot{opening}{out[1] + first}{closing} = w{into[0]}")
        elif op == ca.OP_INPUT:
            lines.append(f"w{out[0]} = {arrays[into[0]]}{opening}{into[1] + first}{closing}")
        elif op == ca.OP_CONST:
            lines.append(f"w{out[0]} = {constant!r}")
        else:
            lines.append(f"w{out[0]} = {_operation(op, [f'w{place}' for place in into], spelt)}")
    return lines


_LONGEST_NAME = 60  # MATLAB takes 63 letters

_MATLAB_WORDS = (
    "break case catch classdef continue do else elseif end for function global if otherwise parfor persistent return "
    "spmd switch try until while"
).split()


def program_name(ship: str, code: Iterable[str] = ()) -> str:
    """A ship's name as an identifier in small letters: neither a word of the language nor one of the code."""
    stem = re.sub(r"\W+", "_", ship.lower(), flags=re.ASCII).strip("_")[:_LONGEST_NAME].rstrip("_")
    taken = {*_MATLAB_WORDS, *keyword.kwlist, *dir(builtins), *re.findall(r"\w+", "\n".join(code))}
    return stem if stem[:1].isalpha() and stem not in taken else f"ship_{stem}"


def _listed(variables: Iterable[Variable], mark: str, first: int) -> list[str]:
    return [
        one_line(f"{mark} {place:3d} {variable.name} ({variable.unit}): {variable.description}")
        for place, variable in enumerate(variables, start=first)
    ]


def mss_function(card: ManoeuvringCard, model: Model) -> str:
    """A function ``[xdot, U] = ship(x, ui, p)`` for MATLAB or Octave, as the ships of MSS are.

    SI and rad, rudder positive to starboard; without `ui` and `p` the card's.
    """
    values = {"ui": model.input_values().tolist(), "p": model.parameter_values().tolist()}
    start = [float(value) for value in model.initial(model.parameter_values()).full().ravel()]
    code = [
        *(
            f"if nargin < {place}, {key} = [{' '.join(repr(value) for value in values[key])}]'; end"
            for place, key in ((2, "ui"), (3, "p"))
        ),
        f"xdot = zeros({len(model.states)}, 1);",
        *(f"{line};" for line in operations(model, lambda word: word, 1)),
        f"U = hypot(x({model.state_names.index('motion.u') + 1}), x({model.state_names.index('motion.v') + 1}));",
        "end",
        "",
        "function value = if_else_zero(condition, value)",
        "if ~condition, value = 0; end",
        "end",
    ]
    name = program_name(card.ship.name, code)
    lines = [
        f"function [xdot, U] = {name}(x, ui, p)",
        one_line(f"% [xdot, U] = {name}(x, ui, p): {model.description}."),
        "% Written by tank2sim convert, operation by operation, from the equations of the card",
        one_line(f"% {Path(card.source).name}: {card.ship.name}."),
        "% SI and rad; rudder positive to starboard (MSS: to port). U is the speed through the water.",
        "% States x (rates in xdot), started by default from",
        f"%   x0 = [{' '.join(repr(value) for value in start)}]'",
        *_listed(model.states, "%", 1),
        "% Inputs ui:",
        *_listed(model.inputs, "%", 1),
        "% Parameters p:",
        *_listed(model.parameters, "%", 1),
        *code,
    ]
    return "\n".join(lines) + "\n"


_PVS_CLASS = '''class {name}:
    """{title}: a vehicle of the Python Vehicle Simulator.

    controlSystem is "stepInput" or "manual"; r is the rudder (deg, positive to starboard) of the step. V_current (m/s)
    and beta_current (deg, towards) act on the position alone.
    """

    def __init__(self, controlSystem="stepInput", r=0.0, V_current=0.0, beta_current=0.0):
        self.name = "{title}"
        self.L = {length}
        self.ref = r
        self.V_c = V_current
        self.beta_c = math.radians(beta_current)
        self.controlMode = controlSystem
        self.controlDescription = "Step input for the rudder" if controlSystem == "stepInput" else "Manual input"
        self.controls = ["Rudder angle (deg)"]
        self.dimU = 1
        self.p = list(P)
        self.ui = list(UI)
        self.x = list(X0)
        self.nu = np.array([X0[{u}], X0[{v}], 0.0, 0.0, 0.0, X0[{r}]], dtype=float)
        self.u_actual = np.array([X0[{delta}]], dtype=float)

    def dynamics(self, eta, nu, u_actual, u_control, sampleTime):
        """One Euler step: nu = [u v w p q r] and u_actual = [rudder] (rad) at the end of it."""
        x = self.x
        x[{px}], x[{py}], x[{psi}] = float(eta[0]), float(eta[1]), float(eta[5])
        x[{u}], x[{v}], x[{r}] = float(nu[0]), float(nu[1]), float(nu[5])
        x[{delta}] = float(u_actual[0])
        self.ui[{order}] = float(u_control[0])
        rates = rates_of(x, self.ui, self.p)
        self.x = x = [value + sampleTime * rate for value, rate in zip(x, rates)]
        north, east = self.V_c * math.cos(self.beta_c), self.V_c * math.sin(self.beta_c)
        eta[0] += sampleTime * north
        eta[1] += sampleTime * east
        return np.array([x[{u}], x[{v}], 0.0, 0.0, 0.0, x[{r}]]), np.array([x[{delta}]])

    def stepInput(self, t):
        """The rudder order (rad) at a time (s)."""
        return np.array([math.radians(self.ref) if t > 0 else 0.0])
'''


_OF_PVS = ("math", "np", "P", "UI", "X0", "rates_of")  # Names of the module in which the class is


def pvs_class(card: ManoeuvringCard, model: Model) -> str:
    """A Python file with a vehicle class for Fossen's Python Vehicle Simulator; it needs NumPy alone.

    SI and rad, rudder positive to starboard. States of effects are kept in the vehicle.
    """

    def spelt(word: str) -> str:
        return "**" if word == "^" else _PYTHON.get(word, word)

    title = python_text(card.ship.name)
    start = [float(value) for value in model.initial(model.parameter_values()).full().ravel()]
    places = {name: model.state_names.index(name) for name in model.state_names}
    body = _PVS_CLASS.format(
        name=program_name(card.ship.name, [_PVS_CLASS, *_OF_PVS]),
        title=title,
        length=card.ship.length_m,
        u=places["motion.u"],
        v=places["motion.v"],
        r=places["motion.r"],
        delta=places["rudder.angle"],
        px=places["motion.x"],
        py=places["motion.y"],
        psi=places["motion.psi"],
        order=model.input_names.index("rudder.command"),
    )
    lines = [
        f'"""{title}, written by tank2sim convert, operation by operation, from the equations of a ship card."""',
        "",
        "import math",
        "",
        "import numpy as np",
        "",
        "# States x:",
        *_listed(model.states, "#", 0),
        "# Inputs ui:",
        *_listed(model.inputs, "#", 0),
        "# Parameters p:",
        *_listed(model.parameters, "#", 0),
        f"X0 = {_finite(start)}",
        f"UI = {_finite(model.input_values().tolist())}",
        f"P = {_finite(model.parameter_values().tolist())}",
        "",
        "",
        "def _sign(a):",
        "    return (a > 0) - (a < 0)",
        "",
        "",
        "def _if(condition, value):",
        "    return value if condition else 0.0",
        "",
        "",
        "def rates_of(x, ui, p):",
        '    """Rates of the states x at inputs ui and parameters p."""',
        f"    xdot = [0.0] * {len(model.states)}",
        *(f"    {line}" for line in operations(model, spelt, 0)),
        "    return xdot",
        "",
        "",
    ]
    return "\n".join(lines) + "\n" + body


def _finite(values: list[float]) -> str:
    assert all(math.isfinite(value) for value in values)
    return repr(values)
