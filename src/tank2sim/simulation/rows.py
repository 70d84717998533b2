"""Evaluation of a CasADi function over many rows of arguments, or over a chain of states.

:class:`RowFunction` evaluates ``f(a, b, ...) -> (y, ...)`` for each row of its arguments in machine code, and
:class:`ArrayFunction` operation by operation in NumPy, without a compiler; :class:`Chain` passes the result of a step
to the next step as its first argument, as in integration.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from types import EllipsisType
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.native.generate import c_loop, generate_c
from tank2sim.native.library import cached_library
from tank2sim.native.operations import instructions

_NUMPY: dict[int, Callable[..., Any]] = {
    **{ca.OP_ADD: np.add, ca.OP_SUB: np.subtract, ca.OP_MUL: np.multiply, ca.OP_DIV: np.divide, ca.OP_NEG: np.negative},
    **{ca.OP_SQ: np.square, ca.OP_SQRT: np.sqrt, ca.OP_POW: np.power, ca.OP_CONSTPOW: np.power},
    **{ca.OP_EXP: np.exp, ca.OP_LOG: np.log, ca.OP_SINH: np.sinh, ca.OP_COSH: np.cosh, ca.OP_TANH: np.tanh},
    **{ca.OP_SIN: np.sin, ca.OP_COS: np.cos, ca.OP_TAN: np.tan, ca.OP_ASIN: np.arcsin, ca.OP_ACOS: np.arccos},
    **{ca.OP_ATAN: np.arctan, ca.OP_ATAN2: np.arctan2, ca.OP_HYPOT: np.hypot, ca.OP_FMOD: np.fmod},
    **{ca.OP_LT: np.less, ca.OP_LE: np.less_equal, ca.OP_EQ: np.equal, ca.OP_NE: np.not_equal},
    **{ca.OP_NOT: np.logical_not, ca.OP_AND: np.logical_and, ca.OP_OR: np.logical_or},
    **{ca.OP_FABS: np.abs, ca.OP_SIGN: np.sign, ca.OP_COPYSIGN: np.copysign, ca.OP_FLOOR: np.floor},
    **{ca.OP_FMIN: np.fmin, ca.OP_FMAX: np.fmax, ca.OP_ASSIGN: np.positive},
    ca.OP_TWICE: lambda a: 2.0 * a,
    ca.OP_INV: lambda a: 1.0 / a,
    ca.OP_IF_ELSE_ZERO: lambda condition, a: np.where(condition, a, 0.0),
}
"""CasADi's scalar operations in NumPy."""

_AT_ONCE = 4096
"""Rows that pass through the operations together: more no longer fit the cache (project choice)."""


class ArrayFunction:
    """Evaluates a function of scalar operations for each row of its arguments, each operation over all rows in NumPy.

    Over some thousand rows 9 to 15 times as fast as CasADi's own loop, which is meant for single points. For functions
    that are evaluated too seldom to be worth compiling. Arguments and results are dense; a matrix result is in CasADi's
    order, by columns.
    """

    def __init__(self, function: ca.Function):
        self.function = function if function.is_a("SXFunction") else function.expand()
        compute = _NUMPY | dict.fromkeys((ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST))
        self._program = [(compute[step.operation], *step) for step in instructions(self.function)]

    def __call__(self, *arguments: Array) -> tuple[Array, ...]:
        """Results (n, elements) each; an argument is (elements,), the same for every row, or (n, elements)."""
        n = _rows_of(arguments)
        # Columns in one piece each; a scalar stays one.
        columns = [np.array(argument.T, dtype=float, order="C") for argument in arguments]
        results = [np.empty((self.function.numel_out(place), n)) for place in range(self.function.n_out())]
        with np.errstate(all="ignore"):  # of the branch that is not taken
            for begin in range(0, n, _AT_ONCE):
                rows = slice(begin, begin + _AT_ONCE)
                self._run([a[:, rows] if a.ndim == 2 else a for a in columns], [result[:, rows] for result in results])
        return tuple(np.ascontiguousarray(result.T) for result in results)

    def _run(self, arguments: Sequence[Array], results: Sequence[Array]) -> None:
        work: list[Any] = [None] * self.function.sz_w()
        for compute, operation, to, source, constant in self._program:
            if compute is not None and len(source) == 2:
                work[to[0]] = compute(work[source[0]], work[source[1]])
            elif compute is not None:
                work[to[0]] = compute(work[source[0]])
            elif operation == ca.OP_INPUT:
                work[to[0]] = arguments[source[0]][source[1]]
            elif operation == ca.OP_CONST:
                work[to[0]] = np.float64(constant)
            else:
                results[to[0]][to[1]] = work[source[0]]


class RowFunction:
    """Evaluates a function of vectors for each row of its arguments.

    Arguments and results are dense; a matrix result is in CasADi's order, by columns. The `library` is that of
    :func:`compiled_rows` with this function, among others; None: nothing is compiled.
    """

    def __init__(self, function: ca.Function, library: ctypes.CDLL | EllipsisType | None = ...):
        self.function = function
        library = compiled_rows([function]) if library is ... else library
        self._rows = None if library is None else library[f"{function.name()}_rows"]

    def __call__(self, *arguments: Array) -> tuple[Array, ...]:
        """Results (n, elements) each; an argument is (elements,), the same for every row, or (n, elements)."""
        n = _rows_of(arguments)
        arrays = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        if self._rows is None:
            return self._in_numpy(*arrays)
        results = [np.empty((n, self.function.numel_out(place))) for place in range(self.function.n_out())]
        self._loop(n, arrays, [array.shape[1] if array.ndim == 2 else 0 for array in arrays], results)
        return tuple(results)

    @cached_property
    def _in_numpy(self) -> ArrayFunction:
        return ArrayFunction(self.function)

    def _loop(self, n: int, arrays: Sequence[Array], strides: Sequence[int], results: Sequence[Array]) -> None:
        assert self._rows is not None
        starts = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
        ends = (ctypes.c_void_p * len(results))(*(array.ctypes.data for array in results))
        lengths = [self.function.numel_out(place) for place in range(self.function.n_out())]
        longs = (ctypes.c_long * len(strides))(*strides), (ctypes.c_long * len(lengths))(*lengths)
        self._rows(ctypes.c_long(n), starts, longs[0], ends, longs[1])


class Chain(RowFunction):
    """Evaluates a function whose result is its first argument in the next step."""

    @cached_property
    def _in_casadi(self) -> dict[int, ca.Function]:
        """Loops of 1, 2, 4, ... steps, so that few different ones are necessary."""
        return {}

    def run(self, start: Array, *arguments: Array) -> Array:
        """States (n + 1, nx): `start` (nx,), then the result of each step with its row of the other arguments."""
        n = _rows_of(arguments)
        states = np.empty((n + 1, len(start)))
        states[0] = start
        arrays = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        if self._rows is not None:
            strides = [states.shape[1], *(array.shape[1] if array.ndim == 2 else 0 for array in arrays)]
            self._loop(n, [states, *arrays], strides, [states[1:]])
            return states
        done = 0
        while done < n:
            length = 1 << ((n - done).bit_length() - 1)
            if length not in self._in_casadi:
                self._in_casadi[length] = self.function.mapaccum(length)
            part = slice(done, done + length)
            given = [array[part].T if array.ndim == 2 else ca.repmat(array, 1, length) for array in arrays]
            states[done + 1 : done + 1 + length] = np.array(self._in_casadi[length](states[done], *given)).T
            done += length
        return states


def _rows_of(arguments: Sequence[Array]) -> int:
    return max(len(argument) for argument in arguments if argument.ndim == 2)


def compiled_rows(
    functions: Sequence[ca.Function], sources: Mapping[str, str] | None = None, flags: Collection[str] = ()
) -> ctypes.CDLL | None:
    """Library of functions, each with a name of its own and its loop over rows; None without a compiler that works.

    `sources`: name to text of further C sources, which may call the functions; `flags`: more flags of the compiler.
    """
    if find_compiler() is None:
        return None
    code = generate_c(functions, "rows")
    for function in functions:
        sizes = {name: max(1, getattr(function, name)()) for name in ("sz_arg", "sz_res", "sz_iw", "sz_w")}
        names = {"function": function.name(), "loop": f"{function.name()}_rows"}
        code += c_loop("rows.c", n_in=function.n_in(), n_out=function.n_out(), **sizes, **names)
    try:
        return ctypes.CDLL(str(cached_library({"model.c": code, **(sources or {})}, flags=flags)))
    except (InputError, OSError):  # a compiler that does not work, or compiles for another machine
        return None
