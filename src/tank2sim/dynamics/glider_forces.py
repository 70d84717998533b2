"""Coefficients, forces and momentum of an underwater glider: paper 5 (Kulikovsky and Velikanov 2012), corrected.

The path makes an angle epsilon with the horizontal (+ up), the hull the pitch theta = epsilon + alpha (2), and the
plane of symmetry, in which the motion stays, is rolled by gamma about the path (+ starboard side down). These are the
paper's angles; at the incidences of a glide they differ from Euler's pitch and roll by alpha (1 - cos gamma), 0.01 deg
with 5 deg of roll. Vectors are in axes that turn with the course: along it and horizontal, to starboard, up.

Everything here takes numbers as well as CasADi expressions.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

_SLOWEST_MPS = 1e-8
"""Added under the root of the speed: it keeps directions finite at rest, and is lost in rounding at any real speed."""


def lift_coefficient(incidence: Any, slope: Any, quadratic: Any) -> Any:
    """C_L of (6) as it must be read: slope alpha + quadratic alpha |alpha|; incidence in rad."""
    return incidence * (slope + quadratic * abs(incidence))


def drag_coefficient(incidence: Any, constant: Any, quadratic: Any) -> Any:
    """C_D of (7): constant + quadratic alpha^2; incidence in rad."""
    return constant + quadratic * incidence**2


class Attitude(NamedTuple):
    """Body velocities (m/s; forward, and down in the plane of symmetry), pitch and roll (rad)."""

    u: ca.SX
    w: ca.SX
    pitch: ca.SX
    roll: ca.SX

    @property
    def speed(self) -> ca.SX:
        """Speed through the water, m/s."""
        return ca.sqrt(self.u**2 + self.w**2 + _SLOWEST_MPS**2)

    @property
    def horizontal(self) -> ca.SX:
        """v cos(epsilon), the speed over the ground, m/s."""
        return self.u * ca.cos(self.pitch) + self.w * ca.sin(self.pitch)

    @property
    def climb(self) -> ca.SX:
        """v sin(epsilon), the rate at which the glider rises, m/s."""
        return self.u * ca.sin(self.pitch) - self.w * ca.cos(self.pitch)

    @property
    def along_path(self) -> ca.SX:
        """Speed times the direction of motion: the velocity (3, 1)."""
        return ca.vertcat(self.horizontal, 0, self.climb)

    @property
    def along_lift(self) -> ca.SX:
        """Speed times the direction of a positive lift (3, 1): across the path, up, rolled by gamma."""
        upright, across = ca.cos(self.roll), ca.sin(self.roll)
        return ca.vertcat(-self.climb * upright, self.speed * across, self.horizontal * upright)


def momentum(at: Attitude, mass: ca.SX, axial: ca.SX, normal: ca.SX) -> ca.SX:
    """Momentum (3, 1) of the glider with the water it drags along, kg m/s: m V + A11 u x_b + A33 w z_b.

    x_b and z_b are the body's axes forward and down; `axial` and `normal` are its added masses A11 and A33 along them.
    """
    forward = ca.vertcat(ca.cos(at.pitch), 0, ca.sin(at.pitch))
    down = ca.vertcat(ca.sin(at.pitch), 0, -ca.cos(at.pitch))
    upright = mass * at.along_path + axial * at.u * forward + normal * at.w * down
    # What roll about the path changes: only the added mass, whose axes roll, and only across the path.
    rolled = at.along_lift - Attitude(at.u, at.w, at.pitch, ca.SX(0)).along_lift
    return upright + (axial - normal) * at.u * at.w / at.speed**2 * rolled


def forces(at: Attitude, lift_area: ca.SX, drag_area: ca.SX, buoyancy_N: ca.SX) -> ca.SX:
    """Force (3, 1), N, of lift, drag and net buoyancy; the areas are rho S C / 2 in kg/m."""
    return at.speed * (lift_area * at.along_lift - drag_area * at.along_path) + ca.vertcat(0, 0, buoyancy_N)


def glider_accelerations(at: Attitude, momentum: ca.SX, force: ca.SX, others: ca.SX) -> ca.SX:
    """du/dt, dw/dt (m/s2) and the rate of the course (rad/s, + to starboard), (3, 1).

    dP/dt = F in axes that turn with the course: dP = P_u du + P_w dw + (what pitch and roll do) + dpsi (-P_2, P_1, 0).

    Parameters
    ----------
    others : (3, 1)
        Rate of the momentum by the rates of pitch and roll alone.
    """
    # A path that is almost vertical has no course, and these equations do not determine how it would turn: beyond 84
    # deg (a horizontal share of 0.1, project choice) its course turns no faster than at that angle.
    turned = ca.fmax(momentum[0], 0.1 * ca.norm_2(momentum) + _SLOWEST_MPS)
    by_velocity = ca.jacobian(momentum, ca.vertcat(at.u, at.w))
    matrix = ca.horzcat(by_velocity, ca.vertcat(-momentum[1], turned, 0))
    return ca.solve(matrix, force - others)
