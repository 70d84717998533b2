"""Ships of the generator: the Mariner of Chislett & Strom-Tejsen (1965), three others, and their polynomial in numpy.

Prime system with the instantaneous speed U, rudder positive to port in the coefficients and to starboard outside,
total yaw-rate terms (Y_r, N_r, X_vr, X_rr contain the centrifugal terms). All arrays have one element a lane.

The tanker and the container ship have linear terms near those of published MMG models (KVLCC2: Yasukawa & Yoshimura
2015, Table 3, times d/L; the container ship: Son & Nomoto 1982, upright), with the rudder behind the hull as part of
the polynomial and yaw terms chosen for a tanker that is unstable on a straight course and turns in 4.3 lengths: ships
of these forms, not those ships. The model is the tanker at 7 m with Froude's speed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tank2sim.arrays import Array

WATER_KGPM3 = 1025.0
AIR_KGPM3 = 1.225
GRAVITY_MPS2 = 9.80665


@dataclass(frozen=True)
class Hull:
    """A ship: m, m/s, revolutions per minute; mass, inertia, centre of gravity and derivatives in the prime system."""

    name: str
    source: str
    length_m: float
    beam_m: float
    draught_m: float
    speed_mps: float
    rpm: float
    mass: float
    yaw_inertia: float
    x_g: float
    xnn: float  # X' of the revolutions' excess n^2/n0^2 - 1
    front_m2: float  # areas above water
    side_m2: float
    coefficients: dict[str, float] = field(repr=False)

    @property
    def time(self) -> float:
        """L/U over the Mariner's: what takes a second there takes so many here."""
        return (self.length_m / self.speed_mps) / _MARINER_TIME_S

    @property
    def gear_time_s(self) -> float:
        """Time constant of the healthy gear."""
        return 1.0 * self.time

    @property
    def gear_rate_degps(self) -> float:
        """Largest rate of the healthy gear."""
        return 5.0 / self.time

    def scaled(self, parameter: str, value: float) -> float:
        """A parameter drawn for the Mariner, in file units, at this ship's size: the same in the prime system."""
        if self.name == "mariner":
            return value
        length = self.length_m / MARINER.length_m
        speed = self.speed_mps / MARINER.speed_mps
        waves = length * speed / (self.beam_m / MARINER.beam_m) ** 0.5
        sizes = dict.fromkeys(("forward_m", "starboard_m", "north_m", "east_m"), length)
        sizes |= dict.fromkeys(("speed_mps", "width_mps"), speed) | {"height_m": waves}
        sizes |= dict.fromkeys(("depth_m", "by_stern_m"), self.draught_m / MARINER.draught_m)
        sizes |= dict.fromkeys(("max_rate_degps", "rate_degps"), 1.0 / self.time)
        sizes |= dict.fromkeys(("time_constant_s", "roll_period_s", "delay_s", "t0", "dur", "period_s"), self.time)
        sizes |= {"freeze_s": self.time, "heel_ratio": length / speed**2}
        return value * sizes.get(parameter, 1.0)


GEAR_ANGLE_DEG = 40.0
_MARINER_TIME_S = 160.93 / 7.7175

_MARINER: dict[str, float] = {
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
"""Prime derivatives by name; a 0 behind the force is a constant, `dot` an acceleration."""

_TANKER: dict[str, float] = {
    name: 1e-5 * value
    for name, value in {
        **{"Xudot": -143.0, "Yvdot": -1450.0, "Nvdot": 0.0, "Yrdot": 0.0, "Nrdot": -71.5},
        **{"Xu": -230.0, "Xuu": -115.0, "Xvv": -260.0, "Xrr": 72.0, "Xvr": 1800.0, "Xdd": -190.0},
        **{"Yv": -2220.0, "Yr": -1420.0, "Yvvv": -10450.0, "Yvvr": 2460.0, "Yvrr": -2540.0, "Yrrr": 52.0},
        **{"Nv": -760.0, "Nr": -440.0, "Nvvv": -195.0, "Nvvr": -2200.0, "Nvrr": 357.0, "Nrrr": -150.0},
        **{"Yd": 400.0, "Yddd": -110.0, "Nd": -190.0, "Nddd": 52.0, "Y0": -3.0, "N0": 1.5},
    }.items()
}
_CONTAINER: dict[str, float] = {
    name: 1e-5 * value
    for name, value in {
        **{"Xudot": -23.8, "Yvdot": -704.9, "Nvdot": 0.0, "Yrdot": 0.0, "Nrdot": -41.9},
        **{"Xu": -90.0, "Xuu": -45.0, "Xvv": -386.0, "Xrr": 20.0, "Xvr": 480.0, "Xdd": -110.0},
        **{"Yv": -1230.0, "Yr": -570.0, "Yvvv": -10900.0, "Yvvr": 2140.0, "Yvrr": -4050.0, "Yrrr": 177.0},
        **{"Nv": -350.0, "Nr": -260.0, "Nvvv": 149.0, "Nvvr": -4240.0, "Nvrr": 156.0, "Nrrr": -229.0},
        **{"Yd": 300.0, "Yddd": -80.0, "Nd": -145.0, "Nddd": 38.0, "Y0": 2.0, "N0": -1.0},
    }.items()
}

MARINER = Hull(
    *("mariner", "Chislett & Strom-Tejsen 1965", 160.93, 23.17, 7.5, 7.7175, 84.0),
    *(798e-5, 39.2e-5, -0.023, 77e-5, 430.0, 1900.0, _MARINER),
)
TANKER = Hull(
    *("tanker", "made up, of KVLCC2's form", 320.0, 58.0, 20.8, 7.97, 95.0),
    *(1908e-5, 119e-5, 0.035, 105e-5, 1100.0, 3600.0, _TANKER),
)
CONTAINER = Hull(
    *("container", "made up, of the form of Son & Nomoto's container ship", 175.0, 25.4, 8.5, 10.3, 110.0),
    *(792e-5, 45.6e-5, -0.003, 60e-5, 620.0, 2900.0, _CONTAINER),
)
MODEL = Hull(
    *("model", "made up, of KVLCC2's form, 7 m", 7.0, 1.1688, 0.455, 1.179, 642.0),
    *(1908e-5, 119e-5, 0.035, 105e-5, 0.53, 1.72, _TANKER),
)
HULLS = {hull.name: hull for hull in (MARINER, TANKER, CONTAINER, MODEL)}

ACCELERATIONS = ("Xudot", "Yvdot", "Nvdot", "Yrdot", "Nrdot")


def _exponents(name: str) -> tuple[int, int, int, int]:
    """Powers of (u, v, r, d) in the term of a derivative."""
    u, v, r, d = (name[1:].count(letter) for letter in "uvrd")
    return u, v, r, d


_TERMS = {name: _exponents(name) for hull in HULLS.values() for name in hull.coefficients if name not in ACCELERATIONS}


def perturbed(hull: Hull, kind: str, generator: np.random.Generator, size: float = 0.02) -> dict[str, float]:
    """Coefficients of the true ship: each of the card times 1 + `size` N(0, 1), alone or in groups.

    `exact` as the card; `independent` each by itself; `correlated` one error for all surge terms, the linear and the
    non-linear Y, the linear and the non-linear N, the rudder terms, the constants and the accelerations.
    """
    if kind == "exact":
        return dict(hull.coefficients)
    if kind == "independent":
        return {name: value * (1.0 + size * generator.standard_normal()) for name, value in hull.coefficients.items()}
    if kind != "correlated":
        raise ValueError(f"coefficients {kind!r}: exact, independent or correlated expected")
    groups = ("acceleration", "constant", "rudder", "X", "Y1", "Y3", "N1", "N3")
    error = dict(zip(groups, size * generator.standard_normal(len(groups)), strict=True))
    return {name: value * (1.0 + error[_group(name)]) for name, value in hull.coefficients.items()}


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


class Polynomial:
    """Hull and rudder forces by the terms of the derivatives; `coefficients` has an element a lane.

    Sums run term by term, so that a lane's last bit does not depend on the number of lanes beside it.
    """

    def __init__(self, coefficients: dict[str, Array]) -> None:
        groups = [(force, of_rudder) for of_rudder in (False, True) for force in "XYN"]
        names = [[name for name in _TERMS if name in coefficients and _row(name) == group] for group in groups]
        ordered = [name for group in names for name in group]
        self._values = np.array([coefficients[name] for name in ordered])
        self._powers = tuple(np.array([_TERMS[name] for name in ordered]).T)
        ends = np.cumsum([len(group) for group in names])
        self._parts = [slice(end - len(group), end) for group, end in zip(names, ends, strict=True)]

    def __call__(self, u: Array, v: Array, r: Array, rudder: Array) -> tuple[Array, Array]:
        """Each (3, n): X', Y', N' of u' = (u - u0)/U, v', r' and the rudder (rad, starboard)."""
        base = np.array([u, v, r, -rudder])
        square = base * base
        powers = np.array([np.ones_like(base), base, square, square * base])
        monomials = powers[self._powers[0], 0]
        for place in (1, 2, 3):
            monomials = monomials * powers[self._powers[place], place]
        terms = self._values * monomials
        sums = np.zeros((6, u.size))
        for place, part in enumerate(self._parts):
            if part.stop > part.start:
                sums[place] += np.add.accumulate(terms[part], axis=0)[-1]  # in this order, whatever n is
        return sums[:3], sums[3:]


def _row(name: str) -> tuple[str, bool]:
    """Force of a term, and whether it is the rudder's."""
    return name[0], _TERMS[name][3] > 0


def ship_toml(hull: Hull) -> str:
    """The nominal card, the one the analyst gets whatever the true ship is."""
    name = "Mariner class" if hull is MARINER else hull.name.capitalize()
    lines = ['format = "tank2sim-ship/1"', "", "[ship]", f'name = "{name}"', f"length_m = {hull.length_m}"]
    lines += [f"beam_m = {hull.beam_m}", f"draught_m = {hull.draught_m}", f'source = "{hull.source}"', ""]
    lines += ["[model]", 'kind = "abkowitz"', f"speed_mps = {hull.speed_mps}", 'scaling = "prime"']
    lines += ['speed_scale = "instantaneous"', 'yaw_rate_terms = "total"', 'rudder_sign = "port"', ""]
    lines += ["[rigid_body]", f"mass = {hull.mass}", f"yaw_inertia = {hull.yaw_inertia}", f"x_G = {hull.x_g}"]
    lines += ["", "[derivatives]", *(f"{key} = {value:.12g}" for key, value in hull.coefficients.items())]
    lines += ["", "[steering_gear]", f"time_constant_s = {hull.gear_time_s:.6g}"]
    lines += [f"max_rate_degps = {hull.gear_rate_degps:.6g}", f"max_angle_deg = {GEAR_ANGLE_DEG}", ""]
    return "\n".join([*lines, "[propulsion]", f"nominal_rpm = {hull.rpm}", f"Xnn = {hull.xnn}"]) + "\n"
