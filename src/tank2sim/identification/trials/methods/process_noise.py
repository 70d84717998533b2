"""A model with random accelerations, and the functions of a filter for it: steps, tangents, observed values.

The accelerations are held over a step and decay from step to step: ``a[k+1] = phi a[k] + w[k]``, a first-order
Gauss-Markov process (white for phi = 0). The sensors may drift in the same way, each by a b that is added to its
observed value. The filter's state is z = (x, a, b).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Input, Model
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.scheme import runge_kutta_step

PUSHED = ("motion.u", "motion.v", "motion.r")
"""States whose rates have random accelerations, if the model has the state."""

LARGEST_PART = 0.5
"""Longest integration step, in the shortest time constant of the motion (project choice: Runge and Kutta's error is
then 0.03 % of a fast mode, and the scheme is far from unstable)."""

MOST_PARTS = 20
"""Most integration steps from an instant to the next (project choice: a wilder motion leaves all bounds)."""

_PROBED_S = 1e-3
"""Step whose slopes show the rates of decay, s: far below the time constants of vessels."""


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives along a run of n instants."""

    # `A`, `B`: (n, nz, nz), (n, nz, k): Slopes of the next state by the state (after the measurement) and by
    # the free parameters
    A: Array
    B: Array
    # `C`, `D`: (n, ny, nz), (n, ny, k): Slopes of the observed values by the state (before the measurement) and
    # by the free parameters
    C: Array
    D: Array


class Disturbed:
    """Filter steps of a model with random accelerations.

    `model`: nx states; m of :data:`PUSHED` are among them. `free`: Names of the k parameters of the derivatives.
    `seen`: Names of the ny states and quantities that are measured. `drifting`: Every sensor drifts: nz = nx + m + ny,
    else nz = nx + m.
    """

    def __init__(self, model: Model, free: Sequence[str], seen: Sequence[str], *, drifting: bool = False):
        pushed = [state for state in model.states if state.name in PUSHED]
        self.pushed = tuple(state.name for state in pushed)
        self.nominal = np.array([state.nominal for state in model.states])
        self._places = np.array([place for place, state in enumerate(model.states) if state in pushed])
        whole, pushes = _pushed(model, [state.derivative for state in pushed])
        drifts = ca.SX.sym("drift", len(seen) if drifting else 0)
        correlated = ca.vertcat(pushes, drifts)
        self.correlated, self.parameters = int(correlated.numel()), len(free)
        z, phi, h = ca.vertcat(model.x, correlated), ca.SX.sym("phi", self.correlated), ca.SX.sym("h")
        theta = ca.vcat([model.symbol(name) for name in free])
        moved = runge_kutta_step(whole)(model.x, ca.vertcat(model.u, pushes), model.p, h)
        following = ca.vertcat(moved, phi * correlated)
        shown = whole.expand(ca.vcat([model.symbol(name) for name in seen]))
        shown = shown + drifts if drifting else shown
        y, K = ca.SX.sym("y", len(seen)), ca.SX.sym("K", z.numel(), len(seen))
        corrected = ca.substitute(following, z, z + K @ (y - shown))
        arguments, cse = [z, model.u, model.p], {"cse": True}
        step_derivatives = [ca.densify(ca.jacobian(following, expression)) for expression in (z, theta)]
        shown_by = [ca.densify(expression) for expression in (shown, ca.jacobian(shown, z), ca.jacobian(shown, theta))]
        self._observer = Chain(ca.Function("observer", [*arguments, y, ca.vec(K), phi, h], [corrected], cse))
        self._tangents = RowFunction(ca.Function("pushed_tangents", [*arguments, phi, h], step_derivatives, cse))
        self._moved = RowFunction(ca.Function("pushed_moved", [*arguments, phi, h], [following], cse))
        self._shown = RowFunction(ca.Function("pushed_shown", arguments, shown_by, cse))

    def parts(self, states: Array, inputs: Array, p: Array, h: float) -> int:
        """Integration steps from an instant to the next, by the fastest mode of the motion along states (n, nz)."""
        case = p, np.ones(self.correlated), np.array([_PROBED_S])
        slopes = self._tangents(states, inputs, *case)[0].reshape(len(states), states.shape[1], -1)
        block = slopes[:, self._places[:, None], self._places] - np.eye(len(self._places))
        block = block[np.isfinite(block).all(axis=(1, 2))]
        fastest = float(np.abs(np.linalg.eigvals(block)).max()) / _PROBED_S if len(block) else 0.0
        return int(np.clip(np.ceil(fastest * h / LARGEST_PART), 1, MOST_PARTS))

    def predicted(
        self, start: Array, inputs: Array, measured: Array, gains: Array, case: tuple[Array, ...], parts: int = 1
    ) -> Array:
        """States (n, nz) before each measurement, of the observer with given gains.

        `start` (nz,). `inputs` (n, nu). `measured` (n, ny): Without nan: any value where not measured, with a column of
        zeros in the gain. `gains` (n, nz, ny). `case`: Parameters p, factors phi (nz - nx,), step h (1,). `parts`:
        Integration steps from an instant to the next.
        """
        p, phi, h = case
        columns = gains[:-1].transpose(0, 2, 1).reshape(len(gains) - 1, -1)
        if parts == 1:
            return self._observer.run(start, inputs[:-1], p, measured[:-1], columns, phi, h)
        # A measurement corrects the first part, and accelerations decay after the last.
        corrected = np.zeros((len(columns) * parts, columns.shape[1]))
        corrected[::parts] = columns
        decay = np.ones((len(corrected), len(phi)))
        decay[parts - 1 :: parts] = phi
        rows = np.repeat(inputs[:-1], parts, axis=0), np.repeat(measured[:-1], parts, axis=0)
        return self._observer.run(start, rows[0], p, rows[1], corrected, decay, h / parts)[::parts]

    def seen(self, states: Array, inputs: Array, p: Array) -> Array:
        """Observed values (n, ny) at states z (n, nz)."""
        return self._shown(states, inputs, p)[0]

    def tangents(self, before: Array, after: Array, inputs: Array, case: tuple[Array, ...], parts: int = 1) -> Tangents:
        """Derivatives at the states before and after each measurement (n, nz), over `parts` integration steps."""
        p, phi, h = case
        n, nz = before.shape
        A, B = self._step_slopes(after, inputs, (p, phi if parts == 1 else np.ones(len(phi)), h / parts))
        for part in range(2, parts + 1):
            after = self._moved(after, inputs, p, np.ones(len(phi)), h / parts)[0]
            by_state, by_theta = self._step_slopes(
                after, inputs, (p, phi if part == parts else np.ones(len(phi)), h / parts)
            )
            A, B = by_state @ A, by_state @ B + by_theta
        seen, C, D = self._shown(before, inputs, p)
        ny = seen.shape[1]
        return Tangents(
            A=A,
            B=B,
            C=C.reshape(n, nz, ny).transpose(0, 2, 1),
            D=D.reshape(n, -1, ny).transpose(0, 2, 1),
        )

    def _step_slopes(self, after: Array, inputs: Array, case: tuple[Array, ...]) -> tuple[Array, Array]:
        """Slopes (n, nz, nz) and (n, nz, k) of one integration step."""
        n, nz = after.shape
        by_state, by_theta = self._tangents(after, inputs, *case)
        return by_state.reshape(n, nz, nz).transpose(0, 2, 1), by_theta.reshape(n, -1, nz).transpose(0, 2, 1)


def _pushed(model: Model, rates: Sequence[str]) -> tuple[Model, ca.SX]:
    """The model with an input added to each of the quantities `rates`, and the symbols of these inputs."""
    inputs = tuple(
        Input(name=f"process.{rate}", unit=model[rate].unit, description=f"Random acceleration in {rate}")
        for rate in rates
    )
    whole = model.extend(*inputs)
    for rate, push in zip(rates, inputs, strict=True):
        whole = whole.redefine(rate, lambda old, push=push: old + push.symbol)  # type: ignore[misc]
    return whole, ca.vcat([push.symbol for push in inputs])
