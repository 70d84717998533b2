"""JavaScript that evaluates a CasADi function, for pages in which a ship sails: nothing has to be compiled."""

from __future__ import annotations

import casadi as ca

_OF_TWO = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/", ca.OP_FMOD: "%"}
_COMPARISONS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "===", ca.OP_NE: "!=="}
_NAMED = {
    **{ca.OP_SQRT: "sqrt", ca.OP_FABS: "abs", ca.OP_SIGN: "sign", ca.OP_FMIN: "min", ca.OP_FMAX: "max"},
    **{ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos"},
    **{ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2", ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_FLOOR: "floor"},
    **{ca.OP_CEIL: "ceil", ca.OP_SINH: "sinh", ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_LOG1P: "log1p"},
    **{ca.OP_EXPM1: "expm1", ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh"},
    **{ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_HYPOT: "hypot"},
}
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

    The operations are those of the function, in its order. Numbers equal those of C except for the last bits of sines.

    Parameters
    ----------
    function : casadi.Function
        Of scalar operations (SX), with dense arguments and results.
    name : str

    Raises
    ------
    ValueError
        An operation has no JavaScript.
    """
    lines = [_instruction(function, number) for number in range(function.n_instructions())]
    arguments = [f"i{place}" for place in range(function.n_in())] + [f"o{place}" for place in range(function.n_out())]
    work = ",".join(f"w{place}" for place in range(function.sz_w()))
    declared = f"let {work};" if work else ""
    return f"function {name}({','.join(arguments)}){{{declared}\n" + "\n".join(lines) + "\n}\n"


def _instruction(function: ca.Function, number: int) -> str:
    """A statement. Variables are the places of CasADi's work vector, so that few of them live at a time."""
    operation, to = function.instruction_id(number), function.instruction_output(number)
    given = function.instruction_input(number)
    if operation == ca.OP_OUTPUT:
        return f"o{to[0]}[{to[1]}]=w{given[0]};"
    if operation == ca.OP_INPUT:
        return f"w{to[0]}=i{given[0]}[{given[1]}];"
    if operation == ca.OP_CONST:
        return f"w{to[0]}={function.instruction_constant(number)!r};".replace("inf", "Infinity").replace("nan", "NaN")
    sources = [f"w{place}" for place in given]
    return f"w{to[0]}={_expression(operation, sources)};"


def _expression(operation: int, sources: list[str]) -> str:
    if operation in _OF_TWO:
        return _OF_TWO[operation].join(sources)
    if operation in _COMPARISONS:
        return f"({_COMPARISONS[operation].join(sources)}?1:0)"
    if operation in _NAMED:
        return f"Math.{_NAMED[operation]}({','.join(sources)})"
    if operation in _FORMS:
        return _FORMS[operation].format(*sources)
    raise ValueError(f"operation {operation} has no JavaScript")
