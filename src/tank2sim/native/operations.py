"""The scalar operations of CasADi's graphs, and what C calls them: for code in other languages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

OPERATORS = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
COMPARISONS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
FUNCTIONS = {
    **{ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs", ca.OP_FMIN: "fmin", ca.OP_FMAX: "fmax", ca.OP_FMOD: "fmod"},
    **{ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos"},
    **{ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2", ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_FLOOR: "floor"},
    **{ca.OP_CEIL: "ceil", ca.OP_SINH: "sinh", ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_LOG1P: "log1p"},
    **{ca.OP_EXPM1: "expm1", ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh"},
    **{ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_HYPOT: "hypot", ca.OP_COPYSIGN: "copysign"},
}
"""Functions of ``math.h``."""


class Instruction(NamedTuple):
    """A step of a graph: places of the work vector, or of an argument or result (its number, and the entry).

    `constant` is the value of ``OP_CONST``; else 0.
    """

    operation: int
    to: list[int]
    given: list[int]
    constant: float


def instructions(function: ca.Function) -> Iterator[Instruction]:
    """The steps of a function of scalar operations (SX), in their order."""
    for number in range(function.n_instructions()):
        operation = function.instruction_id(number)
        constant = float(function.instruction_constant(number)) if operation == ca.OP_CONST else 0.0
        yield Instruction(operation, function.instruction_output(number), function.instruction_input(number), constant)
