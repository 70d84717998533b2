"""C code that evaluates a CasADi function for several ships at once, each in a lane of a vector register.

Every operation acts on all lanes by itself and in the order of the function, without fused operations, and sine,
cosine and atan2 are polynomials (``c/vectors.h``): a lane has the same bits for any number of lanes, on any processor.
Conditions are masks. Lanes are of double precision, or of single precision (``SINGLE`` defined as 1), twice as many.
"""

from __future__ import annotations

import ctypes
from functools import cache

import casadi as ca

from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.native.generate import c_loop
from tank2sim.native.library import cached_library
from tank2sim.native.operations import FUNCTIONS, OPERATORS, Instruction, instructions

FLAGS_OF_LANES: dict[int, tuple[str, ...]] = {8: ("-mavx512f", "-mavx512dq"), 4: ("-mavx2",), 2: (), 1: ()}
"""Flags of the compiler for a number of lanes of double precision: AVX-512, AVX2, SSE2 or NEON, plain C."""

_COMPARISONS = {ca.OP_LT: "LT", ca.OP_LE: "LE", ca.OP_EQ: "EQ", ca.OP_NE: "NE"}
_FUNCTIONS = {**FUNCTIONS, ca.OP_SIGN: "sign", ca.OP_ERF: "erf"}
_SIMPLE = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "all(2.0) * {0}",
    ca.OP_INV: "all(1.0) / {0}",
}


class NoLanesError(Exception):
    """A function has an operation that cannot be evaluated in lanes."""


@cache
def widest_lanes() -> int:
    """Number of doubles in a vector register of this machine; 1 without vectors, 0 without a C compiler."""
    if find_compiler() is None:
        return 0
    try:
        library = ctypes.CDLL(str(cached_library({"widest.c": c_loop("widest.c")})))
    except (InputError, OSError):
        return 0
    except RuntimeError:  # a compiler that has no words for what a processor has
        return 1
    return int(library.widest())


def lane_function(function: ca.Function, name: str) -> str:
    """C of ``static void name(const V *const *arg, V *const *res)``, a function of scalar operations in lanes.

    Arguments and results are dense vectors of lanes, in the function's order. It needs ``vectors.h`` before it.

    Raises NoLanesError: An operation cannot be evaluated in lanes.
    """
    return _Lanes(function).code(name)


class _Lanes:
    """The instructions of a function, each a C variable that is assigned once."""

    def __init__(self, function: ca.Function):
        self.function = function
        self.lines: list[str] = []
        self.at: dict[int, str] = {}  # place in CasADi's work vector, to the variable that it holds now
        self.masks: set[str] = set()
        self.circular: dict[str, tuple[str, str]] = {}  # an angle's sine and cosine

    def code(self, name: str) -> str:
        if not self.function.is_a("SXFunction"):
            raise NoLanesError(f"{self.function.name()} is not of scalar operations")
        for number, instruction in enumerate(instructions(self.function)):
            self._add(number, instruction)
        body = "\n".join(f"  {line}" for line in self.lines)
        return f"static void {name}(const V *const *arg, V *const *res) {{\n{body}\n}}\n"

    def _add(self, number: int, instruction: Instruction) -> None:
        operation, to, given, constant = instruction
        variable = f"a{number}"
        if operation == ca.OP_OUTPUT:
            self.lines.append(f"res[{to[0]}][{to[1]}] = {self._real(self.at[given[0]])};")
        elif operation == ca.OP_INPUT:
            self._set(to[0], variable, f"arg[{given[0]}][{given[1]}]")
        elif operation == ca.OP_CONST:
            self._set(to[0], variable, f"all({constant!r})")
        else:
            text, mask = self._operation(operation, [self.at[place] for place in given], number)
            self._set(to[0], variable, text, mask=mask)

    def _set(self, place: int, variable: str, text: str, *, mask: bool = False) -> None:
        self.lines.append(f"const {'M' if mask else 'V'} {variable} = {text};")
        self.at[place] = variable
        if mask:
            self.masks.add(variable)

    def _real(self, variable: str) -> str:
        return f"TRUTH({variable})" if variable in self.masks else variable

    def _mask(self, variable: str) -> str:
        return variable if variable in self.masks else f"NOT_ZERO({variable})"

    def _operation(self, operation: int, sources: list[str], number: int) -> tuple[str, bool]:
        """The expression of an operation, and whether it is a mask."""
        if operation in (ca.OP_AND, ca.OP_OR):
            sign = "&" if operation == ca.OP_AND else "|"
            return f"{self._mask(sources[0])} {sign} {self._mask(sources[1])}", True
        if operation == ca.OP_NOT:
            return f"~{self._mask(sources[0])}", True
        if operation == ca.OP_IF_ELSE_ZERO:
            return f"WHERE0({self._mask(sources[0])}, {self._real(sources[1])})", False
        real = [self._real(source) for source in sources]
        if operation in _COMPARISONS:
            return f"{_COMPARISONS[operation]}({real[0]}, {real[1]})", True
        if operation in OPERATORS:
            return f" {OPERATORS[operation]} ".join(real), False
        if operation in (ca.OP_SIN, ca.OP_COS):
            return self._sine_or_cosine(real[0], number)[operation == ca.OP_COS], False
        if operation in _SIMPLE:
            return _SIMPLE[operation].format(*real), False
        if operation in _FUNCTIONS:
            return f"lane_{_FUNCTIONS[operation]}({', '.join(real)})", False
        raise NoLanesError(f"operation {operation} of {self.function.name()}")

    def _sine_or_cosine(self, angle: str, number: int) -> tuple[str, str]:
        if angle not in self.circular:
            self.lines.append(f"V s{number}, c{number}; lane_sincos({angle}, &s{number}, &c{number});")
            self.circular[angle] = f"s{number}", f"c{number}"
        return self.circular[angle]
