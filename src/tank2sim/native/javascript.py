"""JavaScript that evaluates a CasADi function, for pages in which a ship sails: nothing has to be compiled."""

from __future__ import annotations

import casadi as ca

from tank2sim.native.operations import COMPARISONS, FUNCTIONS, OPERATORS, Instruction, instructions

_OF_TWO = {**OPERATORS, ca.OP_FMOD: "%"}
_STRICT = {"==": "===", "!=": "!=="}
_RENAMED = {"fabs": "abs", "fmin": "min", "fmax": "max"}
_NAMED = {operation: _RENAMED.get(word, word) for operation, word in FUNCTIONS.items()} | {ca.OP_SIGN: "sign"}
del _NAMED[ca.OP_COPYSIGN]
_FORMS = {
    ca.OP_NEG: "-{0}",
    ca.OP_INV: "1/{0}",
    ca.OP_SQ: "{0}*{0}",
    ca.OP_TWICE: "2*{0}",
    ca.OP_ASSIGN: "{0}",
    ca.OP_AND: "({0}&&{1}?1:0)",
    ca.OP_OR: "({0}||{1}?1:0)",
    ca.OP_NOT: "({0}?0:1)",
    ca.OP_IF_ELSE_ZERO: "({0}?{1}:0)",
    ca.OP_COPYSIGN: "({1}<0||Object.is({1},-0)?-1:1)*Math.abs({0})",
}


def javascript_function(function: ca.Function, name: str) -> str:
    """Return JavaScript of ``function name(...arguments, ...results)``: arrays of numbers, the results are filled.

    The operations are the function's, in its order. Numbers equal C's except for the last bits of sines.

    `function`: Of scalar operations (SX), with dense arguments and results.

    Raises ValueError: An operation has no JavaScript.
    """
    lines = [_statement(step) for step in instructions(function)]
    arguments = [f"i{place}" for place in range(function.n_in())] + [f"o{place}" for place in range(function.n_out())]
    work = ",".join(f"w{place}" for place in range(function.sz_w()))
    declared = f"let {work};" if work else ""
    return f"function {name}({','.join(arguments)}){{{declared}\n" + "\n".join(lines) + "\n}\n"


def _statement(step: Instruction) -> str:
    """A statement. Variables are the places of CasADi's work vector, so that few of them live at a time."""
    operation, to, given, constant = step
    if operation == ca.OP_OUTPUT:
        return f"o{to[0]}[{to[1]}]=w{given[0]};"
    if operation == ca.OP_INPUT:
        return f"w{to[0]}=i{given[0]}[{given[1]}];"
    if operation == ca.OP_CONST:
        return f"w{to[0]}={constant!r};".replace("inf", "Infinity").replace("nan", "NaN")
    sources = [f"w{place}" for place in given]
    return f"w{to[0]}={_expression(operation, sources)};"


def _expression(operation: int, sources: list[str]) -> str:
    if operation in _OF_TWO:
        return _OF_TWO[operation].join(sources)
    if operation in COMPARISONS:
        sign = COMPARISONS[operation]
        return f"({_STRICT.get(sign, sign).join(sources)}?1:0)"
    if operation in _NAMED:
        return f"Math.{_NAMED[operation]}({','.join(sources)})"
    if operation in _FORMS:
        return _FORMS[operation].format(*sources)
    raise ValueError(f"operation {operation} has no JavaScript")
