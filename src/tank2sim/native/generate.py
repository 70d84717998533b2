"""C code: of CasADi functions, and of the loops about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca

_LOOPS = Path(__file__).with_name("c")

_EXPORT = """#ifdef EXPORT
#elif defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
"""


def c_loop(name: str, **values: object) -> str:
    """The C of a file in ``native/c``, with macros of these values in it, and ``EXPORT`` for what is called."""
    macros = {key.upper(): value for key, value in values.items()}
    defined = "".join(f"#define {key} {value}\n" for key, value in macros.items())
    removed = "".join(f"#undef {key}\n" for key in macros)
    return f"{_EXPORT}{defined}{(_LOOPS / name).read_text(encoding='utf-8')}{removed}"


@dataclass(frozen=True)
class WorkSizes:
    """Lengths of the work vectors that the largest of some generated functions needs."""

    reals: int
    integers: int


def generate_c(functions: Sequence[ca.Function], stem: str) -> str:
    """One C file with all `functions`, under their own names, none of them exported from a library.

    Each is ``int name(const double **arg, double **res, long long int *iw, double *w, int mem)``, keeps nothing
    between calls and allocates nothing. `stem` distinguishes the file's other symbols from other files'.
    """
    generator = ca.CodeGenerator(f"{stem}.c", {"with_export": False, "with_header": False})
    for function in functions:
        generator.add(function)
    code: str = generator.dump()
    return code


def work_sizes(functions: Sequence[ca.Function]) -> WorkSizes:
    """Sizes of `w` and `iw` that code of :func:`generate_c` needs."""
    return WorkSizes(
        reals=max(function.sz_w() for function in functions), integers=max(function.sz_iw() for function in functions)
    )
