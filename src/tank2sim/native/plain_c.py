"""CasADi functions as plain C99 in one floating-point type: constants with a suffix, no run-time library of CasADi."""

from __future__ import annotations

import math
from collections.abc import Iterable

import casadi as ca

from tank2sim.native.operations import COMPARISONS, FUNCTIONS, OPERATORS, instructions

_FORMS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{two} * {0}",
    ca.OP_INV: "{one} / {0}",
    ca.OP_SIGN: "({0} < {zero}) ? -{one} : (({0} > {zero}) ? {one} : {0})",
    ca.OP_NOT: "({0} == {zero}) ? {one} : {zero}",
    ca.OP_AND: "(({0} != {zero}) && ({1} != {zero})) ? {one} : {zero}",
    ca.OP_OR: "(({0} != {zero}) || ({1} != {zero})) ? {one} : {zero}",
    ca.OP_IF_ELSE_ZERO: "({0} != {zero}) ? {1} : {zero}",
}
_KINDS = {
    **dict.fromkeys((ca.OP_ADD, ca.OP_SUB, ca.OP_NEG), "additions"),
    **dict.fromkeys((ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE), "multiplications"),
    **dict.fromkeys((ca.OP_DIV, ca.OP_INV), "divisions"),
    **dict.fromkeys(COMPARISONS, "comparisons"),
    **dict.fromkeys((ca.OP_SIGN, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO), "comparisons"),
}
_MOVES = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_ASSIGN)


def plain_c(function: ca.Function, prefix: str, arguments: Iterable[str], results: Iterable[str]) -> str:
    """Statements of C99 that make the results of a function of its arguments, operation by operation in its order.

    With ``<PREFIX>_C(x)`` as ``x`` and ``<PREFIX>_SIN`` as ``sin`` they calculate what
    :func:`tank2sim.native.generate.generate_c` does, to the last bit.

    `function`: Of scalar operations (SX), with dense arguments and results. `prefix`: Of the macros (in capitals) and
    of the type ``<prefix>_real``. `arguments`, `results`: Names of the arrays.

    Raises ValueError: An operation has no C.
    """
    sources, targets, lines = tuple(arguments), tuple(results), []
    for operation, to, given, constant in instructions(function):
        if operation == ca.OP_OUTPUT:
            lines.append(f"    {targets[to[0]]}[{to[1]}] = w{given[0]};")
        elif operation == ca.OP_INPUT:
            lines.append(f"    w{to[0]} = {sources[given[0]]}[{given[1]}];")
        elif operation == ca.OP_CONST:
            lines.append(f"    w{to[0]} = {c_number(constant, prefix)};")
        else:
            lines.append(f"    w{to[0]} = {_expression(operation, [f'w{place}' for place in given], prefix)};")
    declared = [f"    {prefix}_real w{place};" for place in range(function.sz_w())]
    unused = [f"    (void){name};" for name in (*sources, *targets)]  # so that none is reported as unused
    return "\n".join([*declared, *unused, *lines])


def _expression(operation: int, names: list[str], prefix: str) -> str:
    macro = prefix.upper()
    constants = {word: f"{macro}_C({value})" for word, value in (("zero", "0.0"), ("one", "1.0"), ("two", "2.0"))}
    if operation in OPERATORS:
        return f" {OPERATORS[operation]} ".join(names)
    if operation in COMPARISONS:
        return f"({f' {COMPARISONS[operation]} '.join(names)}) ? {constants['one']} : {constants['zero']}"
    if operation in FUNCTIONS:
        return f"{macro}_{FUNCTIONS[operation].upper()}({', '.join(names)})"
    if operation in _FORMS:
        return _FORMS[operation].format(*names, **constants)
    raise ValueError(f"operation {operation} has no C")


def c_number(value: float, prefix: str) -> str:
    """A number as a constant of C that reads back as it is, with the suffix of its type."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    text = f"{prefix.upper()}_C({abs(float(value))!r})"
    return f"-{text}" if math.copysign(1.0, value) < 0 else text


def math_functions(functions: Iterable[ca.Function]) -> tuple[str, ...]:
    """Names of the functions of ``math.h`` that :func:`plain_c` of these functions calls, in alphabetical order."""
    found = {step.operation for function in functions for step in instructions(function)}
    return tuple(sorted({FUNCTIONS[operation] for operation in found if operation in FUNCTIONS}))


def operation_counts(function: ca.Function) -> dict[str, int]:
    """Kind of operation (``additions``, ``sin``) to how many of them one call of a function does, most first."""
    counts: dict[str, int] = {}
    for operation, *_ in instructions(function):
        if operation not in _MOVES:
            kind = _KINDS.get(operation) or FUNCTIONS[operation]
            counts[kind] = counts.get(kind, 0) + 1
    return dict(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))
