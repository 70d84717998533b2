"""Bodies on the rig of paper 3 (Alyshev 2019), for the benchmark and the tests."""

from __future__ import annotations

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.model import TORQUE_CONSTANT_NMPA

ELLIPSOID_T1 = YawRig(
    inertia_kgm2=204.3e-4,
    added_inertia_kgm2=300.4e-4,
    coulomb_Nm=7.9e-4,
    viscous_Nms=117.4e-4,
    quadratic_Nms2=381.0e-4,
    torque_constant_NmpA=TORQUE_CONSTANT_NMPA,
)
"""The paper's ellipsoid in water, its least squares of Tables 1 and 2."""
SHIP_T1 = YawRig(
    inertia_kgm2=179.6e-4,
    added_inertia_kgm2=302.0e-4,
    coulomb_Nm=9.8e-4,
    viscous_Nms=43.5e-4,
    quadratic_Nms2=1434.6e-4,
    torque_constant_NmpA=TORQUE_CONSTANT_NMPA,
)
SHIP_T2 = YawRig(
    inertia_kgm2=179.6e-4,
    added_inertia_kgm2=531.1e-4,
    coulomb_Nm=2.7e-4,
    viscous_Nms=216.7e-4,
    quadratic_Nms2=1480.9e-4,
    torque_constant_NmpA=TORQUE_CONSTANT_NMPA,
)
ELLIPSOID_AIR = YawRig(
    inertia_kgm2=204.3e-4, coulomb_Nm=10.9e-4, viscous_Nms=7.6e-4, torque_constant_NmpA=TORQUE_CONSTANT_NMPA
)
SHIP_AIR = YawRig(
    inertia_kgm2=179.6e-4, coulomb_Nm=10.3e-4, viscous_Nms=10.7e-4, torque_constant_NmpA=TORQUE_CONSTANT_NMPA
)
