"""Straight-line stability and Nomoto's models of steering, of any ship."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import control
import numpy as np

from tank2sim.analysis.linearisation import jacobians, state_space, straight_course
from tank2sim.dynamics.model import Model


@dataclass(frozen=True)
class Nomoto:
    """Yaw rate by rudder angle, r/delta = K (1 + T3 s) / ((1 + T1 s)(1 + T2 s)), and T = T1 + T2 - T3.

    Nomoto, Taguchi, Honda and Hirano (1957). K in 1/s, positive if the ship follows its rudder; T's in s. Of an
    unstable ship T1 (and with it T and K) is negative. T1 is the slower mode. Of a pair that oscillates only
    the sum and product of T1 and T2 are real: both are then None.
    """

    K_per_s: float
    T_s: float
    T1_s: float | None
    T2_s: float | None
    T3_s: float


@dataclass(frozen=True)
class Stability:
    """Straight-line stability of a ship at a speed.

    Parameters
    ----------
    name : str
        The ship.
    speed_mps, drift_deg, rudder_deg : float
        The straight course about which it was linearised (beta and rudder, starboard positive).
    eigenvalues : tuple of complex
        Of surge, sway and yaw, 1/s, slowest first.
    criterion : float
        C' = Y'_v (N'_r - m' x'_G u') - N'_v (Y'_r - m' u'): a ship that is stable on a straight course has it positive.
        Prime system; the slopes are those of the full forces at the operating point.
    steering_modes : tuple of complex
        Eigenvalues of sway and yaw alone, 1/s.
    nomoto, nomoto_prime : Nomoto
        In SI; and with K L/U, T U/L.
    """

    name: str
    speed_mps: float
    drift_deg: float
    rudder_deg: float
    eigenvalues: tuple[complex, ...]
    criterion: float
    steering_modes: tuple[complex, ...]
    nomoto: Nomoto
    nomoto_prime: Nomoto

    @property
    def stable(self) -> bool:
        """True if the ship holds a straight course with the rudder fixed: both modes of sway and yaw decay.

        C' > 0 alone is not enough: two modes that both grow have it, too.
        """
        return all(mode.real < 0 for mode in self.steering_modes)

    def as_json(self) -> dict[str, object]:
        """The result as JSON has it; eigenvalues as [real, imaginary]."""
        return {
            "ship": self.name,
            "operating_point": {
                "speed_mps": self.speed_mps,
                "drift_deg": self.drift_deg,
                "rudder_deg": self.rudder_deg,
            },
            "eigenvalues": [[value.real, value.imag] for value in self.eigenvalues],
            "stability_criterion": {"C_prime": self.criterion, "stable": self.stable},
            "nomoto": {"dimensional": vars(self.nomoto), "prime": vars(self.nomoto_prime)},
        }


def stability(model: Model, speed_mps: float | None = None) -> Stability:
    """Straight-line stability of a ship, by default at its speed of expansion.

    Raises
    ------
    InputError
        The model is no ship, or holds no straight course.
    """
    point = straight_course(model, speed_mps)
    values = dict(zip(model.parameter_names, point.p.tolist(), strict=True))
    at = dict(zip(model.state_names, point.x.tolist(), strict=True))
    speed = float(np.hypot(at["motion.u"], at["motion.v"]))
    length, density = values["ship.length"], values["ship.water_density"]

    settled = settled_states(model)
    whole = state_space(model, point, states=["motion.u", "motion.v", "motion.r"], settled=settled)
    eigenvalues = sorted((complex(value) for value in whole.poles()), key=lambda value: -value.real)
    slopes, _ = jacobians(model, point, ["force.Y", "force.N"], ["motion.v", "motion.r"], [], settled=settled)
    # Y_v N_r and N_v Y_r are both in (1/2 rho)^2 L^6 V^2.
    criterion = float(np.linalg.det(slopes)) / (0.25 * density**2 * length**6 * speed**2)
    steering = state_space(
        model, point, states=["motion.v", "motion.r"], inputs=["rudder.angle"], outputs=["motion.r"], settled=settled
    )
    own = nomoto(steering)
    time = length / speed
    return Stability(
        name=model.name,
        speed_mps=speed,
        drift_deg=float(np.degrees(-np.arcsin(at["motion.v"] / speed))),
        rudder_deg=float(np.degrees(at["rudder.angle"])),
        eigenvalues=tuple(eigenvalues),
        criterion=criterion,
        steering_modes=tuple(complex(value) for value in steering.poles()),
        nomoto=own,
        nomoto_prime=Nomoto(
            own.K_per_s * time,
            own.T_s / time,
            own.T1_s and own.T1_s / time,
            own.T2_s and own.T2_s / time,
            own.T3_s / time,
        ),
    )


def settled_states(model: Model) -> list[str]:
    """States of effects (the memory of the flow, roll): stability on a straight course is that of slow motions."""
    own = {f"motion.{name}" for name in ("u", "v", "r", "psi", "x", "y")}
    return [name for name in model.state_names if name not in own and not name.startswith("rudder.")]


def nomoto(steering: control.StateSpace) -> Nomoto:
    """Nomoto's coefficients of a sway-yaw system from rudder angle (rad) to yaw rate (rad/s).

    From A (2, 2), B (2, 1), C (1, 2): 1/(T1 T2) = det A, T1 + T2 = -tr A / det A, T3 from the zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # a ship that is neutral has K and T without end
        K, total, product, T3 = (float(one) for one in steering_constants(steering.A, steering.B, steering.C))
    # T1 and T2 are the roots of T^2 - (T1 + T2) T + T1 T2; those of a pair that oscillates are not real.
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
