"""Integration: many steps in a call, in machine code with a C compiler, else in CasADi's own loops."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.native.compiler import find_compiler, require_compiler
from tank2sim.notices import Notice
from tank2sim.simulation.rows import Chain, RowFunction, compiled_rows
from tank2sim.simulation.scheme import step_and_constants

NO_COMPILER = Notice("no working C compiler was found: CasADi evaluates the model, many times slower")


def compiler_notices() -> tuple[Notice, ...]:
    """Return :data:`NO_COMPILER` where there is no compiler, else nothing."""
    return () if find_compiler() else (NO_COMPILER,)


class Integrator:
    """Takes a model's Runge-Kutta steps (:func:`tank2sim.simulation.scheme.runge_kutta_step`).

    Parameters
    ----------
    model : Model
        The integrated model.
    compiled : bool, optional
        True for machine code, False for CasADi's evaluation; by default machine code with a working C compiler.
    """

    def __init__(self, model: Model, compiled: bool | None = None):
        self.model = model
        if compiled:
            require_compiler("compiling a model")
        elif compiled is None:
            compiled = find_compiler() is not None
        self._steps, self._constants, self._outputs = _functions(model, compiled)
        self.compiled = self._outputs is not None

    def rollout(self, x: Array, u: Array, p: Array, h: float, n: int) -> Array:
        """States (n + 1, nx): the start `x`, then after each of `n` steps of `h` s with inputs `u` (nu,) or (n, nu)."""
        return self._steps.run(x, u, p, np.array(self._constants(p)).ravel(), np.full((n, 1), h))

    def step(self, x: Array, u: Array, p: Array, h: float) -> Array:
        """State (nx,) after one step of `h` s."""
        following: Array = self.rollout(x, u, p, h, 1)[1]
        return following

    def outputs(self, x: Array, u: Array, p: Array) -> Array:
        """Outputs (n, ny) at states `x` (n, nx) and inputs `u` (n, nu)."""
        if self._outputs is None:
            return np.array(self.model.output(x.T, u.T, np.repeat(p[:, None], len(x), axis=1))).T
        return self._outputs(x, u, p)[0]


@lru_cache(maxsize=KEPT_MODELS)
def _functions(model: Model, compiled: bool) -> tuple[Chain, ca.Function, RowFunction | None]:
    """The step, the constants of parameters, and the outputs if they are compiled."""
    step, constants = step_and_constants(model)
    library = compiled_rows([step, constants, model.output]) if compiled else None
    outputs = None if library is None else RowFunction(model.output, library)
    return Chain(step, library), constants, outputs
