"""The Mariner of Chislett & Strom-Tejsen (1965), typed once more, and the forces of its polynomial in numpy.

Prime system with the instantaneous speed U, rudder positive to port in the coefficients and to starboard outside,
total yaw-rate terms (Y_r, N_r, X_vr, X_rr contain the centrifugal terms). All arrays have one element a lane.
"""

from __future__ import annotations

import numpy as np

from tank2sim.arrays import Array

LENGTH_M = 160.93
BEAM_M = 23.17
DRAUGHT_M = 7.5
SPEED_MPS = 7.7175
NOMINAL_RPM = 84.0
WATER_KGPM3 = 1025.0
AIR_KGPM3 = 1.225
GRAVITY_MPS2 = 9.80665

MASS = 798e-5
YAW_INERTIA = 39.2e-5
X_G = -0.023
XNN = 77e-5

GEAR_TIME_S = 1.0
GEAR_RATE_DEGPS = 5.0
GEAR_ANGLE_DEG = 40.0

COEFFICIENTS: dict[str, float] = {
    name: 1e-5 * value
    for name, value in {
        "Xudot": -42.0,
        "Yvdot": -748.0,
        "Nvdot": 4.646,
        "Yrdot": -9.354,
        "Nrdot": -43.8,
        **{"Xu": -184.0, "Xuu": -110.0, "Xuuu": -215.0, "Xvv": -899.0, "Xrr": 18.0},
        **{"Xdd": -95.0, "Xudd": -190.0, "Xvr": 798.0, "Xvd": 93.0, "Xuvd": 93.0},
        **{"Yv": -1160.0, "Yr": -499.0, "Yvvv": -8078.0, "Yvvr": 15356.0, "Yvu": -1160.0, "Yru": -499.0},
        **{"Yd": 278.0, "Yddd": -90.0, "Yud": 556.0, "Yuud": 278.0, "Yvdd": -4.0, "Yvvd": 1190.0},
        **{"Y0": -4.0, "Y0u": -8.0, "Y0uu": -4.0},
        **{"Nv": -264.0, "Nr": -166.0, "Nvvv": 1636.0, "Nvvr": -5483.0, "Nvu": -264.0, "Nru": -166.0},
        **{"Nd": -139.0, "Nddd": 45.0, "Nud": -278.0, "Nuud": -139.0, "Nvdd": 13.0, "Nvvd": -489.0},
        **{"N0": 3.0, "N0u": 6.0, "N0uu": 3.0},
    }.items()
}
"""Prime derivatives by name; the number behind the force is a constant, `dot` an acceleration."""

ACCELERATIONS = ("Xudot", "Yvdot", "Nvdot", "Yrdot", "Nrdot")


def _exponents(name: str) -> tuple[int, int, int, int]:
    """Powers of (u, v, r, d) in the term of a derivative."""
    u, v, r, d = (name[1:].count(letter) for letter in "uvrd")
    return u, v, r, d


_TERMS = {name: _exponents(name) for name in COEFFICIENTS if name not in ACCELERATIONS}
_MONOMIALS = tuple(sorted(set(_TERMS.values())))


def perturbed(kind: str, generator: np.random.Generator, size: float = 0.02) -> dict[str, float]:
    """Coefficients of the true ship: each of the card times 1 + `size` N(0, 1), alone or in groups.

    `exact` as the card; `independent` each by itself; `correlated` one error for all surge terms, the linear and the
    non-linear Y, the linear and the non-linear N, the rudder terms, the constants and the accelerations.
    """
    if kind == "exact":
        return dict(COEFFICIENTS)
    if kind == "independent":
        return {name: value * (1.0 + size * generator.standard_normal()) for name, value in COEFFICIENTS.items()}
    if kind != "correlated":
        raise ValueError(f"coefficients {kind!r}: exact, independent or correlated expected")
    groups = ("acceleration", "constant", "rudder", "X", "Y1", "Y3", "N1", "N3")
    error = dict(zip(groups, size * generator.standard_normal(len(groups)), strict=True))
    return {name: value * (1.0 + error[_group(name)]) for name, value in COEFFICIENTS.items()}


def _group(name: str) -> str:
    if name in ACCELERATIONS:
        return "acceleration"
    if "0" in name:
        return "constant"
    if "d" in name:
        return "rudder"
    if name[0] == "X":
        return "X"
    return name[0] + ("3" if sum(_TERMS[name][1:]) > 1 else "1")


def polynomial(coefficients: dict[str, Array], u: Array, v: Array, r: Array, rudder: Array) -> tuple[Array, Array]:
    """Hull and rudder forces, each (3, n): X', Y', N' of u' = (u - u0)/U, v', r' and the rudder (rad, starboard).

    Sums run term by term, so that a lane's last bit does not depend on the number of lanes beside it.
    """
    bases = [(np.ones_like(base), base, base * base, base * base * base) for base in (u, v, r, -rudder)]
    values: dict[tuple[int, ...], Array] = {}
    for powers in _MONOMIALS:
        value = bases[0][0]
        for base, power in zip(bases, powers, strict=True):
            if power:
                value = base[power] if value is bases[0][0] else value * base[power]
        values[powers] = value
    hull, steering = np.zeros((3, u.size)), np.zeros((3, u.size))
    rows = {"X": (hull[0], steering[0]), "Y": (hull[1], steering[1]), "N": (hull[2], steering[2])}
    for name, powers in _TERMS.items():
        row = rows[name[0]][powers[3] > 0]
        row += coefficients[name] * values[powers]
    return hull, steering


def ship_toml() -> str:
    """The nominal card, the one the analyst gets whatever the true ship is."""
    lines = ['format = "tank2sim-ship/1"', "", "[ship]", 'name = "Mariner class"', f"length_m = {LENGTH_M}"]
    lines += [f"beam_m = {BEAM_M}", f"draught_m = {DRAUGHT_M}", 'source = "Chislett & Strom-Tejsen 1965"', ""]
    lines += ["[model]", 'kind = "abkowitz"', f"speed_mps = {SPEED_MPS}", 'scaling = "prime"']
    lines += ['speed_scale = "instantaneous"', 'yaw_rate_terms = "total"', 'rudder_sign = "port"', ""]
    lines += ["[rigid_body]", f"mass = {MASS}", f"yaw_inertia = {YAW_INERTIA}", f"x_G = {X_G}", "", "[derivatives]"]
    lines += [f"{name} = {value:.12g}" for name, value in COEFFICIENTS.items()]
    lines += ["", "[steering_gear]", f"time_constant_s = {GEAR_TIME_S}", f"max_rate_degps = {GEAR_RATE_DEGPS}"]
    lines += [f"max_angle_deg = {GEAR_ANGLE_DEG}", "", "[propulsion]", f"nominal_rpm = {NOMINAL_RPM}", f"Xnn = {XNN}"]
    return "\n".join(lines) + "\n"
