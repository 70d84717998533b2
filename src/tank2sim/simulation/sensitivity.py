"""A model's motion under recorded inputs, with its exact derivatives by initial state and by parameters.

The steps are those of :func:`tank2sim.simulation.scheme.runge_kutta_step`; their Jacobians are by CasADi. Many pieces
of motion of the same length are integrated together: each step is a product of stacks of small matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.scheme import runge_kutta_step


class Sensitivity:
    """Motion of a model and its derivatives.

    Parameters
    ----------
    model : Model
        nx states, nu inputs, np parameters.
    free : sequence of str
        Names of the k parameters of the derivatives.
    seen : sequence of str
        Names of the ny states and quantities to be compared with measurements.
    """

    def __init__(self, model: Model, free: Sequence[str], seen: Sequence[str]):
        self.model, self.free, self.seen = model, tuple(free), tuple(seen)
        self._steps, self._slopes, self._shown = _functions(model, self.free, self.seen)

    def motion(self, start: Array, inputs: Array, p: Array, h: float) -> Array:
        """States (n + 1, nx) from `start` (nx,), each row of `inputs` (n, nu) held for `h` s."""
        return self._steps.run(start, inputs, p, np.array([h]))

    def shown(self, states: Array, inputs: Array, p: Array) -> Array:
        """Observed values (n, ny) at `states` (n, nx) with `inputs` (n, nu)."""
        return self._shown(states, inputs, p)[0]

    def derivatives(self, states: Array, inputs: Array, p: Array, h: float) -> tuple[Array, Array, Array]:
        """Observed values and final states, with their derivatives by initial state and parameters.

        Parameters
        ----------
        states : array (pieces, n + 1, nx)
            Motions from :meth:`motion`.
        inputs : array (pieces, n + 1, nu)
            The last row of each is only for the observed values at its end.

        Returns
        -------
        seen : array (pieces, n + 1, ny)
        by : array (pieces, n + 1, ny, nx + k)
            Derivatives of `seen` by the initial state of its piece, and by the free parameters.
        end_by : array (pieces, nx, nx + k)
            Derivatives of the final state.
        """
        pieces, rows, nx = states.shape
        k = len(self.free)
        flat = inputs[:, :-1].reshape(-1, inputs.shape[2])
        steps = self.tangents(states[:, :-1].reshape(-1, nx), flat, p, h).reshape(pieces, rows - 1, nx, nx + k)
        A, B = steps[..., :nx], steps[..., nx:]
        S = np.zeros((pieces, rows, nx, nx + k))
        S[:, 0, :, :nx] = np.eye(nx)
        for row in range(rows - 1):
            np.matmul(A[:, row], S[:, row], out=S[:, row + 1])
            S[:, row + 1, :, nx:] += B[:, row]
        seen, C, D = self._shown(states.reshape(-1, nx), inputs.reshape(-1, inputs.shape[2]), p)
        ny = len(self.seen)
        C = C.reshape(pieces, rows, nx, ny).transpose(0, 1, 3, 2)
        by = C @ S
        by[..., nx:] += D.reshape(pieces, rows, k, ny).transpose(0, 1, 3, 2)
        return seen.reshape(pieces, rows, ny), by, S[:, -1]

    def tangents(self, states: Array, inputs: Array, p: Array, h: float | Array) -> Array:
        """State after a step from each of `states` (n, nx), with derivatives by it and by the parameters, (n, nx, nx +
        k).

        The length of each step is `h` s, a number or (n,).

        The derivative of the Runge-Kutta step by the chain rule over its four slopes: their Jacobians are small
        functions, which compile many times faster than the Jacobian of the whole step.
        """
        n, nx = states.shape
        k = len(self.free)
        h = np.broadcast_to(np.asarray(h, dtype=float), n)[:, None]
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


@lru_cache(maxsize=KEPT_MODELS)
def _functions(model: Model, free: tuple[str, ...], seen: tuple[str, ...]) -> tuple[Chain, RowFunction, RowFunction]:
    """A step; the rates, and the observed values, each with its derivatives by states and free parameters."""
    theta = ca.vcat([model.symbol(name) for name in free])
    arguments, cse = [model.x, model.u, model.p], {"cse": True}
    slopes = [model.rates, *(ca.jacobian(model.rates, by) for by in (model.x, theta))]
    seen_values = model.expand(ca.vcat([model.symbol(name) for name in seen]))
    shown = [seen_values, *(ca.jacobian(seen_values, by) for by in (model.x, theta))]
    return (
        Chain(runge_kutta_step(model)),
        RowFunction(ca.Function("slopes", arguments, [ca.densify(value) for value in slopes], cse)),
        RowFunction(ca.Function("shown", arguments, [ca.densify(value) for value in shown], cse)),
    )
