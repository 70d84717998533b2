"""The C sources of an FMU: template, equations (CasADi functions) and tables generated from them, FMI headers."""

from __future__ import annotations

import re
from pathlib import Path

import casadi as ca
import fmpy

from tank2sim.bundled import bundled
from tank2sim.dynamics.event_indicators import kinks
from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import Interface, other_outputs
from tank2sim.fmu.templates import render
from tank2sim.native.generate import generate_c, work_sizes
from tank2sim.simulation.scheme import step_and_constants
from tank2sim.simulation.trajectory import TIMES_BEYOND

_COMMON = ("instance.h", "instance.c", "values.c", "simulation.c", "derivatives.c", "snapshot.c")
_OF_VERSION = {2: ("fmi2.c",), 3: ("fmi3.c", "fmi3_step.c", "fmi3_unsupported.c")}
_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}

# Three files of about the same length, for a compiler takes longer over them than over all others.
_START = "equations_start.c"
SELDOM = ("equations_partial.c", _START)
"""Sources that no step needs: partial derivatives, and the start."""

# What runs once need not be fast: left as it is, it compiles in a quarter of the time, by every compiler and on every
# platform; not a digit changes.
_ONCE = """\
#if defined(__clang__)
#pragma clang optimize off
#elif defined(__GNUC__)
#pragma GCC optimize ("O0")
#endif
"""


def c_sources(model: Model, interface: Interface, fmi: int, token: str) -> dict[str, str]:
    """Name to text of every C file; together they compile alone (``cc -shared -fPIC *.c -lm``)."""
    texts = {name: bundled("fmu_templates", name).read_text(encoding="utf-8") for name in (*_COMMON, *_OF_VERSION[fmi])}
    texts |= {name: _header(name) for name in _HEADERS[fmi]}
    texts["variables.c"] = render("variables.c", {"interface": interface})
    functions = fmu_equations(model)
    for name in ("equations.c", *SELDOM):
        chosen = [function for function in functions if _file_of(function.name()) == name]
        texts[name] = (_ONCE if name == _START else "") + generate_c(chosen, name.removesuffix(".c"))
    values = {
        "interface": interface,
        "functions": functions,
        "work": work_sizes(functions),
        "token": token,
        "times_beyond": TIMES_BEYOND,
    }
    texts["model.h"] = render("model.h", values)
    return texts


def _file_of(function: str) -> str:
    if "initial" in function or "trim" in function:
        return "equations_start.c"
    return "equations_partial.c" if function in ("model_forward", "model_reverse") else "equations.c"


def headers_notice(fmi: int) -> str:
    """Copyright notice and licence of the FMI headers, as written in them."""
    text = _header(_HEADERS[fmi][0])
    found = re.search(r"Copyright \(C\).*?POSSIBILITY OF SUCH DAMAGE\.", text, re.DOTALL)
    if found is None:
        raise RuntimeError("the FMI headers of fmpy have no licence: another version of fmpy is needed")
    lines = [line.strip() for line in found.group().splitlines()]
    return f"{', '.join(_HEADERS[fmi])} in sources/:\n\n" + "\n".join(lines) + "\n"


def _header(name: str) -> str:
    return (Path(fmpy.__file__).parent / "c-code" / name).read_text(encoding="utf-8")


def fmu_equations(model: Model) -> tuple[ca.Function, ...]:
    """The functions that the C template calls, each on whole vectors x, u, p.

    ``model_constants(p) -> c`` and with them ``model_step(x, u, p, c, h) -> x``, ``model_rates(x, u, p) -> xdot``,
    ``model_outputs(x, u, p) -> y`` (of :func:`other_values`), ``model_initial(p) -> x``,
    ``model_trim_step(x, u, p) -> x`` (the identity if the model cannot be trimmed), and their derivatives:
    ``model_forward`` (tangents of x, u, p to tangents of xdot, y), ``model_reverse`` (adjoints of xdot, y to adjoints
    of x, u, p), ``model_initial_forward``, ``model_trim_forward``.
    """
    x, u, p = model.x, model.u, model.p
    dx, du, dp = (ca.SX.sym(f"d{name}", vector.numel()) for name, vector in (("x", x), ("u", u), ("p", p)))
    outputs = other_values(model)
    results, points = ca.vertcat(model.rates, outputs), ca.vertcat(x, u, p)
    tangents = ca.vertcat(dx, du, dp)
    seeds = [ca.SX.sym("xdot_bar", x.numel()), ca.SX.sym("y_bar", outputs.numel())]
    pushed = ca.vertsplit(ca.jtimes(results, points, tangents), [0, x.numel(), results.numel()])
    places = [0, x.numel(), x.numel() + u.numel(), points.numel()]
    pulled = ca.vertsplit(ca.jtimes(results, points, ca.vertcat(*seeds), True), places)
    start = model.initial(p)
    trimmed = model.trim_step(x, u, p) if model.trim_step is not None else x
    step, constants = step_and_constants(model)
    c, h = ca.SX.sym("c", constants.numel_out(0)), ca.SX.sym("h")
    return (
        _function("model_step", [x, u, p, c, h], [step(x, u, p, c, h)]),
        _function("model_constants", [p], [constants(p)]),
        _function("model_rates", [x, u, p], [model.rates]),
        _function("model_outputs", [x, u, p], [outputs]),
        _function("model_initial", [p], [start]),
        _function("model_trim_step", [x, u, p], [trimmed]),
        _function("model_forward", [x, u, p, dx, du, dp], pushed),
        _function("model_reverse", [x, u, p, *seeds], pulled),
        _function("model_initial_forward", [p, dp], [ca.jtimes(start, p, dp)]),
        _function("model_trim_forward", [x, u, p, dx, du, dp], [ca.jtimes(trimmed, points, tangents)]),
    )


def other_values(model: Model) -> ca.SX:
    """Outputs that are neither states nor their rates, then the event indicators, as expressions of x, u, p."""
    outputs = [model.symbol(name) for name in other_outputs(model)]
    return ca.vertcat(model.expand(ca.vcat(outputs)), *(kink.value for kink in kinks(model)))


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    # Dense results: the C template reads whole vectors, and an entry that is always zero must be written as such.
    return ca.Function(name, arguments, [ca.densify(result) for result in results], {"cse": True})
