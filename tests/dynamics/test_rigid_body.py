"""Against momentum: (3.1) must follow from (2.1), dL/dt + w x L = F, dH/dt + w x H + v x L = M, by vector algebra."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tank2sim.dynamics.rigid_body import inertia, inertial_forces, rigid_body_accelerations

values = st.floats(-5, 5)
NO_ADDED_MASS = dict.fromkeys(("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot"), 0.0)


@given(u=values, v=values, r=values, udot=values, vdot=values, rdot=values, x_G=values)
def test_inertia_forces_follow_from_momentum(u, v, r, udot, vdot, rdot, x_G) -> None:
    mass, yaw_inertia = 3.0, 200.0
    w, velocity, centre = np.array([0, 0, r]), np.array([u, v, 0]), np.array([x_G, 0, 0])
    wdot, acceleration = np.array([0, 0, rdot]), np.array([udot, vdot, 0])
    momentum = mass * (velocity + np.cross(w, centre))
    force = mass * (acceleration + np.cross(wdot, centre)) + np.cross(w, momentum)
    spin = yaw_inertia * w + mass * np.cross(centre, velocity)
    moment = (
        yaw_inertia * wdot + mass * np.cross(centre, acceleration) + np.cross(w, spin) + np.cross(velocity, momentum)
    )

    matrix = inertia(mass, x_G, yaw_inertia, NO_ADDED_MASS)
    X, Y, N = inertial_forces(mass, x_G, u, v, r)
    np.testing.assert_allclose(matrix.surge * udot - X, force[0], atol=1e-9)
    np.testing.assert_allclose(matrix.sway * vdot + matrix.sway_yaw * rdot - Y, force[1], atol=1e-9)
    np.testing.assert_allclose(matrix.yaw_sway * vdot + matrix.yaw * rdot - N, moment[2], atol=1e-9)


@given(f1=values, f2=values, f3=values)
def test_accelerations_solve_the_mass_matrix(f1, f2, f3) -> None:
    added = {"Xudot": -0.4, "Yvdot": -2.5, "Yrdot": -0.3, "Nvdot": 0.2, "Nrdot": -1.5}
    mass, x_G, yaw_inertia = 3.0, -0.2, 2.0
    matrix = np.array(
        [
            [mass - added["Xudot"], 0, 0],
            [0, mass - added["Yvdot"], mass * x_G - added["Yrdot"]],
            [0, mass * x_G - added["Nvdot"], yaw_inertia - added["Nrdot"]],
        ]
    )
    solved = rigid_body_accelerations(inertia(mass, x_G, yaw_inertia, added), f1, f2, f3)
    np.testing.assert_allclose(solved, np.linalg.solve(matrix, [f1, f2, f3]), atol=1e-12)
