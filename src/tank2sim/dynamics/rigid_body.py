"""The rigid body in the horizontal plane (3.1), solved for the accelerations (3.6), (3.7) of paper 2.

The origin is midway between the perpendiculars; the centre of gravity lies x_G forward of it, and J_z refers to the
origin. Paper 2: Krezelewski and Misiag.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Scalar = Any
"""A number or a CasADi expression."""


@dataclass(frozen=True)
class Inertia:
    """Mass matrix of surge, and of sway and yaw together, with the added masses; any consistent units.

    Rows: X: ``surge`` du/dt; Y: ``sway`` dv/dt + ``sway_yaw`` dr/dt; N: ``yaw_sway`` dv/dt + ``yaw`` dr/dt.
    """

    surge: Scalar
    sway: Scalar
    sway_yaw: Scalar
    yaw_sway: Scalar
    yaw: Scalar

    @property
    def determinant(self) -> Scalar:
        """f4 of (3.6)."""
        return self.sway * self.yaw - self.sway_yaw * self.yaw_sway


def inertia(mass: Scalar, x_G: Scalar, yaw_inertia: Scalar, added: dict[str, Scalar]) -> Inertia:
    """Mass matrix of (3.5): rigid body less acceleration derivatives.

    Parameters
    ----------
    mass, x_G, yaw_inertia : number or expression
        m, x_G and J_z about the origin.
    added : dict
        ``Xudot Yvdot Yrdot Nvdot Nrdot`` in the same units.
    """
    return Inertia(
        surge=mass - added["Xudot"],
        sway=mass - added["Yvdot"],
        sway_yaw=mass * x_G - added["Yrdot"],
        yaw_sway=mass * x_G - added["Nvdot"],
        yaw=yaw_inertia - added["Nrdot"],
    )


def rigid_body_accelerations(inertia: Inertia, f1: Scalar, f2: Scalar, f3: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """(3.7): du/dt, dv/dt, dr/dt from the right-hand sides f1, f2, f3 of X, Y and N."""
    f4 = inertia.determinant
    # The divisions are of masses alone, so that generated code divides once in a step and not at each evaluation.
    return (
        f1 * (1 / inertia.surge),
        f2 * (inertia.yaw / f4) - f3 * (inertia.sway_yaw / f4),
        f3 * (inertia.sway / f4) - f2 * (inertia.yaw_sway / f4),
    )


def inertial_forces(mass: Scalar, x_G: Scalar, u: Scalar, v: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Rigid-body terms of (3.1) on the right next to X, Y, N: m (v r + x_G r^2), -m u r, -m x_G u r (N, N, N m in SI).

    In the linear equations (3.5) u is the speed of expansion, in (3.8) the instantaneous one.
    """
    return mass * (v * r + x_G * r * r), -mass * u * r, -mass * x_G * u * r


def added_mass_forces(added: dict[str, Scalar], u: Scalar, v: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """-C_A nu of Fossen (2021), 6.3.1: what the water's inertia leaves on the right, the moment of Munk with it.

        X = -(Yvdot v + Yrdot r) r,  Y = Xudot u r,  N = (Yvdot v + Yrdot r) u - Xudot u v

    Yrdot is the mean of Yrdot and Nvdot, which are equal in theory.

    Parameters
    ----------
    added : dict
        ``Xudot Yvdot Yrdot Nvdot``, kg and kg m.
    u, v, r : number or expression
        Velocities through the water (m/s) and yaw rate (rad/s).
    """
    across = added["Yvdot"] * v + (added["Yrdot"] + added["Nvdot"]) / 2 * r
    return -across * r, added["Xudot"] * u * r, across * u - added["Xudot"] * u * v
