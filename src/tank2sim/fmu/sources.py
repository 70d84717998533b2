"""The C sources of an FMU: the template, the generated equations and tables, the FMI headers."""

from __future__ import annotations

import re
from pathlib import Path

import fmpy

from tank2sim.bundled import bundled
from tank2sim.dynamics.model import Model
from tank2sim.fmu.equations import fmu_equations
from tank2sim.fmu.interface import Interface
from tank2sim.fmu.templates import render
from tank2sim.native.generate import generate_c, work_sizes
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
