"""Straight-line stability and Nomoto's models of steering, of any ship."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.analysis.linearisation import OperatingPoint, jacobians, state_space, straight_course
from tank2sim.analysis.turning.diagram import hull_states
from tank2sim.arrays import Array, ComplexNumber, Unbounded
from tank2sim.dynamics.model import Model

_ROUNDING = 1e-9
"""Relative size, by rounding, of a neutral mode or of the difference of equal slopes."""


@dataclass(frozen=True)
class Nomoto:
    """Yaw rate by rudder angle, r/delta = K (1 + T3 s) / ((1 + T1 s)(1 + T2 s)), and T = T1 + T2 - T3.

    Nomoto, Taguchi, Honda and Hirano (1957). K in 1/s, positive if the ship follows its rudder; T's in s. For an
    unstable ship T1 (and with it T and K) is negative. T1 is the slower mode. For an oscillating pair only the sum and
    product of T1 and T2 are real: both are then None.
    """

    K_per_s: Unbounded
    T_s: Unbounded
    T1_s: float | None
    T2_s: float | None
    T3_s: Unbounded


@dataclass(frozen=True)
class NomotoPrime:
    """:class:`Nomoto` in the prime system: K L/U and T U/L."""

    K_prime: Unbounded
    T_prime: Unbounded
    T1_prime: float | None
    T2_prime: float | None
    T3_prime: Unbounded


@dataclass(frozen=True)
class NomotoModels:
    """Nomoto's coefficients in SI and in the prime system."""

    dimensional: Nomoto
    prime: NomotoPrime


@dataclass(frozen=True, kw_only=True)
class StraightCourse:
    """A straight course: speed, drift (beta) and rudder, both positive to starboard."""

    speed_mps: float
    drift_deg: float
    rudder_deg: float


@dataclass(frozen=True, kw_only=True)
class CourseCriterion:
    """The criterion of straight-line stability.

    Parameters
    ----------
    C_prime : float
        C' = Y'_v (N'_r - m' x'_G u') - N'_v (Y'_r - m' u'): positive for a ship that is stable on a straight course.
        Prime system; the slopes are taken from the full forces at the operating point, in slow motion: states of
        effects follow at once (:func:`settled_states`).
    stable : bool
        True if the straight course is stable with the rudder fixed: all modes of steering decay, and none grows.
        C' > 0 alone is not sufficient: it also holds with two growing modes, and with a growing roll.
    C_prime_decides : bool
        True if the sign of C' agrees with the modes; else it is not a margin of stability.
    growth_per_s : float
        Real part of the mode that decays least or grows most, 1/s.
    settled_states : tuple of str
        States of effects that respond to sway and yaw and act on them (:func:`answering_states`): C' and Nomoto's
        models include them only at rest.
    """

    C_prime: float
    stable: bool
    C_prime_decides: bool
    growth_per_s: float
    settled_states: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Stability:
    """Straight-line stability of a ship about a straight course.

    Parameters
    ----------
    eigenvalues : tuple of complex
        Of surge, sway and yaw with the states of effects that act on the hull (roll, the memory of the flow), rudder
        and heading held, 1/s, least damped first.
    nomoto : NomotoModels
        Of slow motion, as C' is.
    """

    ship: str
    operating_point: StraightCourse
    eigenvalues: tuple[ComplexNumber, ...]
    stability_criterion: CourseCriterion
    nomoto: NomotoModels


def stability(model: Model, speed_mps: float | None = None) -> Stability:
    """Straight-line stability of a ship, by default at its speed of expansion.

    Raises
    ------
    InputError
        The model is not a ship, or has no straight course.
    """
    point = straight_course(model, speed_mps)
    values = model.parameters_by_name(point.p)
    at = dict(zip(model.state_names, point.x.tolist(), strict=True))
    speed = float(np.hypot(at["motion.u"], at["motion.v"]))
    length, density = values["ship.length"], values["ship.water_density"]
    scaling = speed if speed_acts(model, point) else values["ship.speed"]

    settled = settled_states(model)
    modes = steering_modes(model, point)
    eigenvalues = _modes(model, point, hull_states(model))
    slopes, _ = jacobians(model, point, ["force.Y", "force.N"], ["motion.v", "motion.r"], [], settled=settled)
    # Y_v N_r and N_v Y_r are both in (1/2 rho)^2 L^6 V^2.
    criterion = float(np.linalg.det(slopes)) / (0.25 * density**2 * length**6 * scaling**2)
    steering = state_space(
        model, point, states=["motion.v", "motion.r"], inputs=["rudder.angle"], outputs=["motion.r"], settled=settled
    )
    models = nomoto(steering.A, steering.B, steering.C)
    time = length / scaling
    growth = max(mode.real for mode in (*eigenvalues, *modes))
    nothing = _ROUNDING * max(abs(mode) for mode in eigenvalues)
    stable = all(mode.real < 0 for mode in modes) and growth <= nothing
    return Stability(
        ship=model.name,
        operating_point=StraightCourse(
            speed_mps=speed,
            drift_deg=float(np.degrees(0.0 - np.arcsin(at["motion.v"] / speed))),
            rudder_deg=float(np.degrees(at["rudder.angle"])),
        ),
        eigenvalues=eigenvalues,
        stability_criterion=CourseCriterion(
            C_prime=criterion,
            stable=stable,
            C_prime_decides=stable == (criterion > 0),
            growth_per_s=growth,
            settled_states=answering_states(model),
        ),
        nomoto=NomotoModels(
            models,
            NomotoPrime(
                models.K_per_s * time,
                models.T_s / time,
                models.T1_s and models.T1_s / time,
                models.T2_s and models.T2_s / time,
                models.T3_s / time,
            ),
        ),
    )


def steering_modes(model: Model, point: OperatingPoint) -> tuple[complex, ...]:
    """Modes of sway and yaw with the states of effects at a held speed, 1/s."""
    return _modes(model, point, steering_states(model))


def _modes(model: Model, point: OperatingPoint, states: Sequence[str]) -> tuple[complex, ...]:
    return sorted_modes(jacobians(model, point, model.derivatives_of(states), states, [])[0])


def sorted_modes(A: Array) -> tuple[complex, ...]:
    """Eigenvalues of a matrix `A` (n, n), least damped first."""
    return tuple(complex(value) for value in sorted(np.linalg.eigvals(A), key=lambda value: -value.real))


def steering_states(model: Model) -> tuple[str, ...]:
    """Sway, yaw and the states of effects that act on them, at a held speed and rudder."""
    return hull_states(model, ("motion.v", "motion.r"))


def answering_states(model: Model) -> tuple[str, ...]:
    """The steering states of effects that respond to sway, yaw or each other: not the lag of an engine."""
    states = steering_states(model)

    def answers(name: str) -> bool:
        rate = model.expand(model.symbols(model.derivatives_of([name])))
        return any(ca.depends_on(rate, model.symbol(state_name)) for state_name in states if state_name != name)

    return tuple(name for name in states[2:] if answers(name))


def speed_acts(model: Model, point: OperatingPoint) -> bool:
    """True if the slopes of Y and N change with speed; False for a linear card, whose forces are those at u0: (3.5).

    There V = u0 by definition, and C' and prime numbers use it at any speed.
    """
    motion = ["motion.v", "motion.r", "rudder.angle"]
    place = model.state_names.index("motion.u")
    design_speed = float(point.p[model.parameter_names.index("ship.speed")])
    fastest = float(point.p[model.parameter_names.index("ship.fastest")])
    found = []
    # both where the card holds: below its slowest speed a linear card, too, goes over to the forces at low speed
    for speed in (design_speed, 0.5 * (design_speed + fastest) if fastest > design_speed else 1.01 * design_speed):
        x = point.x.copy()
        x[place] = speed
        found.append(jacobians(model, OperatingPoint(x, point.u, point.p), ["force.Y", "force.N"], motion, [])[0])
    return not np.allclose(found[0], found[1], rtol=_ROUNDING, atol=0.0)


def settled_states(model: Model) -> list[str]:
    """States of effects (the memory of the flow, roll) that follow at once in the slow motions of C' and Nomoto."""
    rigid_body = {f"motion.{name}" for name in ("u", "v", "r", "psi", "x", "y")}
    return [name for name in model.state_names if name not in rigid_body and not name.startswith("rudder.")]


def nomoto(A: Array, B: Array, C: Array) -> Nomoto:
    """Nomoto's coefficients of a sway-yaw system from what steers (the rudder, rad) to yaw rate (rad/s).

    From A (2, 2), B (2, 1), C (1, 2): 1/(T1 T2) = det A, T1 + T2 = -tr A / det A, T3 from the zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # a ship that is neutral has K and T without end
        K, total, product, T3 = (float(constant) for constant in steering_constants(A, B, C))
    # T1 and T2 are the roots of T^2 - (T1 + T2) T + T1 T2; an oscillating pair's are not real.
    discriminant = total**2 - 4 * product
    T1 = 0.5 * (total + math.copysign(math.sqrt(discriminant), total)) if discriminant >= 0 else None
    return Nomoto(K_per_s=K, T_s=total - T3, T1_s=T1, T2_s=product / T1 if T1 else None, T3_s=T3)


def steering_constants(A: Any, B: Any, C: Any) -> tuple[Any, Any, Any, Any]:
    """K, T1 + T2, T1 T2 and T3 of A (2, 2), B (2, 1), C (1, 2): numbers or CasADi expressions.

    C (sI - A)^-1 B = (s C B - C adj(A) B) / det(sI - A), adj the adjugate.
    """
    determinant = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    linear = C[0, 0] * B[0, 0] + C[0, 1] * B[1, 0]
    constant = C[0, 0] * (A[0, 1] * B[1, 0] - A[1, 1] * B[0, 0]) + C[0, 1] * (A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0])
    return constant / determinant, -(A[0, 0] + A[1, 1]) / determinant, 1 / determinant, linear / constant
