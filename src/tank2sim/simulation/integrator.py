"""Integration in machine code: many steps in a call, without a Python loop over right-hand sides.

With a C compiler, the step is compiled together with a loop over it; otherwise CasADi evaluates the same step in its
own loops. Both take the steps of :func:`tank2sim.simulation.scheme.runge_kutta_step`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.native.generate import c_loop, generate_c
from tank2sim.native.library import cached_library
from tank2sim.notices import Notice
from tank2sim.simulation.scheme import runge_kutta_step, step_and_constants

Loop = Callable[..., None]

NO_COMPILER = Notice("no working C compiler was found: CasADi evaluates the model, many times slower")


class Integrator:
    """Takes a model's Runge-Kutta steps.

    Parameters
    ----------
    model : Model
        The integrated model.
    compiled : bool, optional
        True for machine code, False for CasADi's evaluation; by default machine code with a working C compiler.
    every : int
        Number of steps between kept samples of a trajectory. Figures use interpolation of third order: with ten steps,
        as in an ensemble (a twentieth of a ship length), no figure changes by more than 2e-4 of itself.
    """

    def __init__(self, model: Model, compiled: bool | None = None, every: int = 1):
        self.model, self.every = model, every
        self.compiled = find_compiler() is not None if compiled is None else compiled
        if self.compiled:
            try:
                self._rollout, self._outputs = _in_machine_code(self.model)
                return
            except (InputError, OSError):  # a compiler that does not work, or compiles for another machine
                if compiled:
                    raise
                self.compiled = False
        self._rollout, self._outputs = self._in_casadi()

    def rollout(self, x: Array, u: Array, p: Array, h: float, n: int, *, every: int = 1) -> Array:
        """States (ceil(n / every) + 1, nx) at the start `x` (nx,), then after each `every` steps, and at the end.

        `n` steps of `h` s with constant inputs `u` (nu,).
        """
        states = np.empty((-(-n // every) + 1, len(x)))
        states[0] = x
        self._rollout(n, every, h, u, p, states)
        return states

    def step(self, x: Array, u: Array, p: Array, h: float) -> Array:
        """State (nx,) after one step of `h` s."""
        following: Array = self.rollout(x, u, p, h, 1)[1]
        return following

    def outputs(self, x: Array, u: Array, p: Array) -> Array:
        """Outputs (n, ny) at states `x` (n, nx) and inputs `u` (n, nu)."""
        y = np.empty((len(x), len(self.model.outputs)))
        self._outputs(len(x), np.ascontiguousarray(u), p, np.ascontiguousarray(x), y)
        return y

    def _in_casadi(self) -> tuple[Loop, Loop]:
        loops: dict[int, ca.Function] = {}
        step = runge_kutta_step(self.model)

        def rollout(n: int, every: int, h: float, u: Array, p: Array, kept: Array) -> None:
            done, x = 0, np.empty((n + 1, kept.shape[1]))
            x[0] = kept[0]
            while done < n:  # loops of 1, 2, 4, ... steps, so that few different ones are necessary
                length = 1 << ((n - done).bit_length() - 1)
                if length not in loops:
                    loops[length] = step.mapaccum(length)
                part = loops[length](x[done], ca.repmat(u, 1, length), ca.repmat(p, 1, length), ca.repmat(h, 1, length))
                x[done + 1 : done + 1 + length] = np.array(part).T
                done += length
            kept[:] = x[np.minimum(np.arange(len(kept)) * every, n)]

        def outputs(n: int, u: Array, p: Array, x: Array, y: Array) -> None:
            y[:] = np.array(self.model.output(x.T, u.T, ca.repmat(p, 1, n))).T

        return rollout, outputs


@lru_cache(maxsize=KEPT_MODELS)
def _in_machine_code(model: Model) -> tuple[Loop, Loop]:
    step, constants = step_and_constants(model)
    functions = (step, constants, model.output)
    sizes = {name: max(1, *(getattr(f, name)() for f in functions)) for name in ("sz_arg", "sz_res", "sz_iw", "sz_w")}
    lengths = {
        "nx": step.size1_in(0),
        "nu": step.size1_in(1),
        "nc": max(1, constants.size1_out(0)),
        "ny": model.output.size1_out(0),
    }
    source = generate_c(functions, "model") + c_loop("rollout.c", **sizes, **lengths)
    library = ctypes.CDLL(str(cached_library({"model.c": source})))
    array = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    library.rollout.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_double, array, array, array]
    library.outputs.argtypes = [ctypes.c_long, array, array, array, array]
    library.rollout.restype = library.outputs.restype = None
    return library.rollout, library.outputs
