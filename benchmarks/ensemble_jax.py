"""The Mariner's turns in JAX, as one would write them for many ships: ``vmap`` over the members, double precision.

The equations are those of ``fmu_step/mariner.c``; integrated by the same Runge-Kutta steps, or with diffrax by
Tsitouras 5(4) with adaptive steps.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from tank2sim.arrays import Array

jax.config.update("jax_enable_x64", True)

RELATIVE, ABSOLUTE = 1e-6, 1e-8
"""Tolerances of the adaptive steps: figures within some 1e-6, as those of the ensemble at its fastest pace."""

X = "X0 Xu Xuu Xuuu Xvv Xrr Xdd Xvvu Xrru Xddu Xvr Xvd Xrd Xvru Xvdu Xrdu".split()
SWAY = "0 0u 0uu v vvv vrr vdd vu vuu r rrr vvr rdd ru ruu d ddd vvd rrd du duu vrd".split()
SIZES = 9  # before the coefficients in ``Ship`` of mariner.h


def rates(motion: jax.Array, ship: jax.Array, order: float) -> jax.Array:
    """Rates of x, y, psi, u, v, r and rudder of one ship, with the numbers of ``Ship``."""
    psi, u_mps, v_mps, r_radps, d = motion[2:]
    length, speed, _, mass, x_g, inertia, lag, rate_limit, angle_limit = ship[:SIZES]
    c = ship[SIZES:]
    U = jnp.sqrt(u_mps**2 + v_mps**2)
    v, r, u = v_mps / U, r_radps * length / U, (u_mps - speed) / U
    surge_terms = jnp.stack(
        [
            *(jnp.ones_like(u), u, u * u, u**3, v * v, r * r, d * d, v * v * u, r * r * u, d * d * u),
            *(v * r, v * d, r * d, v * r * u, v * d * u, r * d * u),
        ]
    )
    sway_terms = jnp.stack(
        [
            *(jnp.ones_like(u), u, u * u, v, v**3, v * r * r, v * d * d, v * u, v * u * u, r, r**3, v * v * r),
            *(r * d * d, r * u, r * u * u, d, d**3, v * v * d, r * r * d, d * u, d * u * u, v * r * d),
        ]
    )
    n, m = len(X), len(X) + len(SWAY)
    force_x, force_y, moment = c[:n] @ surge_terms, c[n:m] @ sway_terms, c[m : m + len(SWAY)] @ sway_terms
    xudot, yvdot, yrdot, nvdot, nrdot = c[m + len(SWAY) :]
    sway, yaw, surge = mass - yvdot, inertia - nrdot, mass - xudot
    sway_yaw, yaw_sway = mass * x_g - yrdot, mass * x_g - nvdot
    f4, scale = sway * yaw - sway_yaw * yaw_sway, U * U / length
    wanted = (jnp.clip(order, -angle_limit, angle_limit) - d) / lag
    return jnp.stack(
        [
            u_mps * jnp.cos(psi) - v_mps * jnp.sin(psi),
            u_mps * jnp.sin(psi) + v_mps * jnp.cos(psi),
            r_radps,
            force_x / surge * scale,
            (force_y * yaw - moment * sway_yaw) / f4 * scale,
            (moment * sway - force_y * yaw_sway) / f4 * scale / length,
            jnp.clip(wanted, -rate_limit, rate_limit),
        ]
    )


def _start(ship: jax.Array) -> jax.Array:
    return jnp.zeros(7).at[3].set(ship[1])


def runge_kutta_turns(steps: int, h: float, order: float) -> Callable[[Array], Array]:
    """A function from ships (n, numbers) to their last motion (n, 7), by `steps` classical steps of `h` s."""

    def turn(ship: jax.Array) -> jax.Array:
        def step(_: int, m: jax.Array) -> jax.Array:
            k1 = rates(m, ship, order)
            k2 = rates(m + h / 2 * k1, ship, order)
            k3 = rates(m + h / 2 * k2, ship, order)
            k4 = rates(m + h * k3, ship, order)
            return m + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

        return jax.lax.fori_loop(0, steps, step, _start(ship))

    compiled = jax.jit(jax.vmap(turn))
    return lambda ships: np.asarray(compiled(ships))


def diffrax_turns(duration_s: float, order: float) -> Callable[[Array], Array]:
    """The same by diffrax with adaptive steps."""
    import diffrax

    term = diffrax.ODETerm(lambda _, m, ship: rates(m, ship, order))
    control = diffrax.PIDController(rtol=RELATIVE, atol=ABSOLUTE)

    def turn(ship: jax.Array) -> jax.Array:
        solution = diffrax.diffeqsolve(
            *(term, diffrax.Tsit5(), 0.0, duration_s, 0.1, _start(ship)),
            args=ship,
            stepsize_controller=control,
            max_steps=100_000,
        )
        return solution.ys[0]

    compiled = jax.jit(jax.vmap(turn))
    return lambda ships: np.asarray(compiled(ships))
