"""Evaluation of a CasADi function over many rows of arguments, or over a chain of states, in machine code with a
compiler.

:class:`RowFunction` evaluates ``f(a, b, ...) -> (y, ...)`` for each row of its arguments; :class:`Chain` passes the
result of a step to the next step as its first argument, as in integration. Without a compiler CasADi's own loops do the
same.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.native.generate import generate_c
from tank2sim.native.library import cached_library

EXPORT = """#ifdef _WIN32
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
"""
"""Attribute of an exported function of a shared library, in C."""

# Work arrays are on the stack, with sizes known at generation. A stride of 0 keeps an argument constant.
_LOOP = """
{export}void loop(long n, const double** arguments, const long* strides, double** results, const long* lengths) {{
  const double* arg[{sz_arg}];
  double* res[{sz_res}];
  casadi_int iw[{sz_iw}];
  double w[{sz_w}];
  long k, i;
  for (k = 0; k < n; ++k) {{
    for (i = 0; i < {n_in}; ++i) arg[i] = arguments[i] + k * strides[i];
    for (i = 0; i < {n_out}; ++i) res[i] = results[i] + k * lengths[i];
    {name}(arg, res, iw, w, 0);
  }}
}}
"""


class RowFunction:
    """Evaluates a function of vectors for each row of its arguments.

    Parameters
    ----------
    function : casadi.Function
        Dense arguments and results; a matrix result is in CasADi's order, by columns.
    """

    def __init__(self, function: ca.Function):
        self.function = function
        self._library: ctypes.CDLL | None = None
        if find_compiler() is not None:
            try:
                self._library = _compiled(function)
            except (InputError, OSError):  # a compiler that does not work, or compiles for another machine
                self._library = None

    def __call__(self, *arguments: Array) -> tuple[Array, ...]:
        """Results (n, elements) each; an argument is (elements,), the same for every row, or (n, elements)."""
        n = max(len(argument) for argument in arguments if argument.ndim == 2)
        arrays = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        if self._library is None:
            return self._in_casadi(n, arrays)
        results = [np.empty((n, self.function.numel_out(place))) for place in range(self.function.n_out())]
        self._loop(n, arrays, [array.shape[1] if array.ndim == 2 else 0 for array in arrays], results)
        return tuple(results)

    def _loop(self, n: int, arrays: Sequence[Array], strides: Sequence[int], results: Sequence[Array]) -> None:
        assert self._library is not None
        starts = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
        ends = (ctypes.c_void_p * len(results))(*(array.ctypes.data for array in results))
        lengths = [self.function.numel_out(place) for place in range(self.function.n_out())]
        longs = (ctypes.c_long * len(strides))(*strides), (ctypes.c_long * len(lengths))(*lengths)
        self._library.loop(ctypes.c_long(n), starts, longs[0], ends, longs[1])

    def _in_casadi(self, n: int, arrays: Sequence[Array]) -> tuple[Array, ...]:
        columns = [array.T if array.ndim == 2 else np.repeat(array[:, None], n, axis=1) for array in arrays]
        results = self.function.map(n).call(columns)
        shapes = [self.function.size_out(place) for place in range(self.function.n_out())]
        return tuple(
            np.array(result).reshape(shape[0], n, shape[1]).transpose(1, 2, 0).reshape(n, -1)
            for result, shape in zip(results, shapes, strict=True)
        )


class Chain(RowFunction):
    """Evaluates a function whose result is its first argument in the next step."""

    def run(self, start: Array, *arguments: Array) -> Array:
        """States (n + 1, nx): `start` (nx,), then the result of each step with its row of the other arguments."""
        n = max(len(argument) for argument in arguments if argument.ndim == 2)
        states = np.empty((n + 1, len(start)))
        states[0] = start
        arrays = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        if self._library is not None:
            strides = [states.shape[1], *(array.shape[1] if array.ndim == 2 else 0 for array in arrays)]
            self._loop(n, [states, *arrays], strides, [states[1:]])
            return states
        for row in range(n):
            step = self.function(states[row], *(array[row] if array.ndim == 2 else array for array in arrays))
            states[row + 1] = np.array(step).ravel()
        return states


def _compiled(function: ca.Function) -> ctypes.CDLL:
    sizes = {name: max(1, getattr(function, name)()) for name in ("sz_arg", "sz_res", "sz_iw", "sz_w")}
    counts = {"n_in": function.n_in(), "n_out": function.n_out(), "name": function.name()}
    source = generate_c([function], "rows") + _LOOP.format(export=EXPORT, **sizes, **counts)
    library = ctypes.CDLL(str(cached_library({"model.c": source})))
    library.loop.restype = None
    return library
