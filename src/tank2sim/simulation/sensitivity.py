"""A model's motion under recorded inputs, with its exact derivatives by initial state and by parameters.

The steps are taken by :func:`tank2sim.simulation.scheme.runge_kutta_step`. Their derivatives follow from the chain
rule over the four slopes of a step, whose Jacobians are by CasADi: small functions, which compile many times faster
than the Jacobian of the whole step. The loops over time are in ``sensitivity.c``; without a compiler NumPy does the
same.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.native.generate import work_sizes
from tank2sim.native.lanes import FLAGS_OF_LANES, widest_lanes
from tank2sim.simulation.rows import Chain, RowFunction, compiled_rows
from tank2sim.simulation.scheme import runge_kutta_step

_SOURCE = Path(__file__).with_suffix(".c")


class Sensitivity:
    """Motion of a model and its derivatives.

    `model`: nx states, nu inputs, np parameters. `free`: Names of the k parameters of the derivatives. `seen`: Names of
    the ny states and quantities to be compared with measurements.
    """

    def __init__(self, model: Model, free: Sequence[str], seen: Sequence[str]):
        self.model, self.free, self.seen = model, tuple(free), tuple(seen)
        self._steps, self._slopes, self._shown, self._library = _functions(model, self.free, self.seen)

    def motion(self, start: Array, inputs: Array, p: Array, h: float) -> Array:
        """States (n + 1, nx) from `start` (nx,), each row of `inputs` (n, nu) held for `h` s."""
        return self._steps.run(start, inputs, p, np.array([h]))

    def shown(self, states: Array, inputs: Array, p: Array) -> Array:
        """Observed values (n, ny) at `states` (n, nx) with `inputs` (n, nu)."""
        return self._shown(states, inputs, p)[0]

    def rates(self, states: Array, inputs: Array, p: Array) -> Array:
        """Rates (n, nx) of `states` (n, nx) with `inputs` (n, nu)."""
        return self._slopes(states, inputs, p)[0]

    def shown_by_states(self, states: Array, inputs: Array, p: Array) -> Array:
        """Derivatives (n, ny, nx) of observed values by states; arguments as of :meth:`shown`."""
        by_state = self._shown(states, inputs, p)[1]
        return by_state.reshape(len(states), -1, len(self.seen)).swapaxes(1, 2)

    def derivatives(self, states: Array, inputs: Array, p: Array, h: float) -> tuple[Array, Array, Array]:
        """Observed values and final states, with their derivatives by initial state and parameters.

        `states` (pieces, n + 1, nx): Motions from :meth:`motion`. `inputs` (pieces, n + 1, nu): The last row of each is
        only for the observed values at its end.

        Returns seen (pieces, n + 1, ny); by (pieces, n + 1, ny, nx + k): Derivatives of `seen` by the initial
        state of its piece, and by the free parameters; end_by (pieces, nx, nx + k): Derivatives of the final state.
        """
        pieces, rows, nx = states.shape
        ny, columns = len(self.seen), nx + len(self.free)
        if self._library is not None:
            results = (
                np.empty((pieces, rows, ny)),
                np.empty((pieces, rows, ny, columns)),
                np.empty((pieces, nx, columns)),
            )
            given = [np.ascontiguousarray(array, dtype=float) for array in (states, inputs, p)]
            sizes, step = (ctypes.c_long(pieces), ctypes.c_long(rows)), ctypes.c_double(h)
            self._library.derivatives(*sizes, *_places(given), step, *_places(results))
            return results
        return self._derivatives_in_numpy(states, inputs, p, h)

    def _derivatives_in_numpy(self, states: Array, inputs: Array, p: Array, h: float) -> tuple[Array, Array, Array]:
        pieces, rows, nx = states.shape
        ny, k = len(self.seen), len(self.free)
        flat = inputs[:, :-1].reshape(-1, inputs.shape[2])
        steps = self.tangents(states[:, :-1].reshape(-1, nx), flat, p, h).reshape(pieces, rows - 1, nx, nx + k)
        S = np.zeros((pieces, rows, nx, nx + k))
        S[:, 0, :, :nx] = np.eye(nx)
        for row in range(rows - 1):
            np.matmul(steps[:, row, :, :nx], S[:, row], out=S[:, row + 1])
            S[:, row + 1, :, nx:] += steps[:, row, :, nx:]
        seen, C, D = self._shown(states.reshape(-1, nx), inputs.reshape(-1, inputs.shape[2]), p)
        by = C.reshape(pieces, rows, nx, ny).transpose(0, 1, 3, 2) @ S
        by[..., nx:] += D.reshape(pieces, rows, k, ny).transpose(0, 1, 3, 2)
        return seen.reshape(pieces, rows, ny), by, S[:, -1]

    def propagate(self, by: Array, tangents: Array) -> None:
        """Add to each of `by` (n + 1, nx, columns) the tangent of the step before times the one before it.

        `by` holds derivatives of the first state, and the changes of later states from outside. `tangents` (n, nx, nx
        + k): From :meth:`tangents`.
        """
        if self._library is not None and by.flags.c_contiguous:
            sizes = ctypes.c_long(len(tangents)), ctypes.c_long(by.shape[2])
            self._library.propagate(*sizes, *_places([np.ascontiguousarray(tangents), by]))
            return
        for step, tangent in enumerate(tangents):
            by[step + 1] += tangent[:, : by.shape[1]] @ by[step]

    def tangents(self, states: Array, inputs: Array, p: Array, h: float | Array) -> Array:
        """State after a step from each of `states` (n, nx), with derivatives by it and by the parameters, (n, nx, nx +
        k).

        The length of each step is `h` s, a number or (n,).
        """
        n, nx = states.shape
        k = len(self.free)
        h = np.ascontiguousarray(np.broadcast_to(np.asarray(h, dtype=float), n))
        if self._library is not None:
            total = np.empty((n, nx, nx + k))
            given = [np.ascontiguousarray(array, dtype=float) for array in (states, inputs, p, h)]
            self._library.tangents(ctypes.c_long(n), *_places([*given, total]))
            return total
        h = h[:, None]
        start = np.zeros((n, nx, nx + k))
        start[:, :, :nx] = np.eye(nx)
        total = start.copy()
        at, by = states, start
        for weight, reach in ((1, h / 2), (2, h / 2), (2, h), (1, 0 * h)):
            slope, by_state, by_theta = self._slopes(at, inputs, p)
            tangent = by_state.reshape(n, nx, nx).transpose(0, 2, 1) @ by
            tangent[:, :, nx:] += by_theta.reshape(n, k, nx).transpose(0, 2, 1)
            total += (h / 6 * weight)[..., None] * tangent
            at, by = states + reach * slope, start + reach[..., None] * tangent
        return total


def augmented_step(
    following: ca.SX, x: ca.SX, theta: ca.SX, others: Sequence[ca.SX], of_starts: int = 0
) -> ca.Function:
    """``step((x, S), *others) -> (x, S)`` after a step of the states and of their derivatives, to be chained.

    For models of a state or two, whose whole step is one expression; :class:`Sensitivity` is for ships.

    `following` (nx,): States after a step from `x` (nx,) with the parameters `theta` (k,). `others`: Further arguments,
    with `theta` or a vector that holds it. `of_starts`: Further columns of S (nx, k + of_starts): by unknowns that act
    through the first states alone.
    """
    S = ca.SX.sym("S", x.numel(), theta.numel() + of_starts)
    moved = ca.jacobian(following, x) @ S
    moved[:, : theta.numel()] += ca.jacobian(following, theta)
    columns = [ca.horzcat(x, S), *others], [ca.horzcat(following, moved)]
    return ca.Function("augmented", *columns, {"cse": True})


def _places(arrays: Sequence[Array]) -> list[ctypes.c_void_p]:
    return [ctypes.c_void_p(array.ctypes.data) for array in arrays]


@lru_cache(maxsize=KEPT_MODELS)
def _functions(
    model: Model, free: tuple[str, ...], seen: tuple[str, ...]
) -> tuple[Chain, RowFunction, RowFunction, ctypes.CDLL | None]:
    """A step; the rates, and the observed values, each with its derivatives by states and free parameters; the loops
    over time."""
    theta = ca.vertcat(ca.SX(0, 1), *(model.symbol(name) for name in free))
    arguments, cse = [model.x, model.u, model.p], {"cse": True}
    seen_values = model.expand(ca.vcat([model.symbol(name) for name in seen]))
    functions = []
    for name, value in (("slopes", model.rates), ("shown", seen_values)):
        results = [ca.densify(each) for each in (value, *(ca.jacobian(value, by) for by in (model.x, theta)))]
        functions.append(ca.Function(name, arguments, results, cse))
    work = work_sizes(functions)
    sizes = {"NX": model.x.numel(), "NU": model.u.numel(), "NK": len(free), "NY": len(seen)}
    sizes |= {"SZ_ARG": max(each.sz_arg() for each in functions), "SZ_RES": max(each.sz_res() for each in functions)}
    sizes |= {"SZ_IW": max(1, work.integers), "SZ_W": max(1, work.reals)}
    flags = ["-O3", *FLAGS_OF_LANES.get(widest_lanes(), ()), *(f"-D{name}={size}" for name, size in sizes.items())]
    library = compiled_rows(functions, {_SOURCE.name: _SOURCE.read_text(encoding="utf-8")}, flags)
    slopes, shown = (RowFunction(function, library) for function in functions)
    return Chain(runge_kutta_step(model)), slopes, shown, library
