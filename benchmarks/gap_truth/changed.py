"""Effects that change coefficients of the true ship: multipliers by name, for one lane.

The hydrodynamic part alone is changed: Y_r and N_r of the card contain -m' and -m'x_G, which no water alters.
"""

from __future__ import annotations

from collections.abc import Callable

from gap_truth.ship import ACCELERATIONS, Hull

Coefficients = dict[str, float]

_RUDDER = tuple("Xdd Xudd Xvd Xuvd Yd Yddd Yud Yuud Yvdd Yvvd Nd Nddd Nud Nuud Nvdd Nvvd".split())


def _times(hull: Hull, coefficients: Coefficients, factors: dict[str, float]) -> Coefficients:
    inertias = {"Yr": -hull.mass, "Nr": -hull.mass * hull.x_g}
    if "Yru" in coefficients:  # the card's terms in u undo the scaling by the instantaneous speed
        inertias |= {"Yru": inertias["Yr"], "Nru": inertias["Nr"]}
    new = dict(coefficients)
    for name, factor in factors.items():
        if name in new:
            inertia = inertias.get(name, 0.0)
            new[name] = inertia + factor * (new[name] - inertia)
    return new


def rudder_effectiveness(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """All forces of the rudder, its drag included."""
    return _times(hull, c, dict.fromkeys(_RUDDER, 1.0 + p["factor"]))


def linear_yaw_damping(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """N_r and Y_r at all speeds."""
    return _times(hull, c, dict.fromkeys(("Nr", "Nru", "Yr", "Yru"), 1.0 + p["factor"]))


def linear_sway_damping(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Y_v and N_v at all speeds."""
    return _times(hull, c, dict.fromkeys(("Yv", "Yvu", "Nv", "Nvu"), 1.0 + p["factor"]))


def added_yaw_inertia(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Added inertia in yaw."""
    return _times(hull, c, {"Nrdot": 1.0 + p["factor"]})


def added_sway_mass(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Added mass in sway."""
    return _times(hull, c, {"Yvdot": 1.0 + p["factor"]})


def shallow_water(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Masses and damping together; moments and the cubic terms a little less than the sway force."""
    m = p["magnification"]
    factors = {"Yvdot": 1.0 + m, "Nrdot": 1.0 + 0.8 * m, "Xudot": 1.0 + 0.5 * m, "Nvdot": 1.0 + m, "Yrdot": 1.0 + m}
    factors |= dict.fromkeys(("Yv", "Yvu", "Nr", "Nru"), 1.0 + m) | dict.fromkeys(("Nv", "Nvu", "Yr", "Yru"), 1.0 + m)
    return _times(hull, c, factors | dict.fromkeys(("Yvvv", "Yvvr", "Yvrr", "Nvvv", "Nvvr", "Nvrr"), 1.0 + 0.8 * m))


def water_depth(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Depth over draught, by the powers of slender-body regressions: sway grows fastest, yaw slowest."""
    ratio = hull.draught_m / p["depth_m"]
    sway, yaw, masses = 1.0 + 2.0 * ratio**2.5, 1.0 + 1.1 * ratio**2.3, 1.0 + 1.6 * ratio**2.6
    factors = dict.fromkeys(("Yv", "Yvu", "Yvvv", "Yvvr", "Nv", "Nvu"), sway)
    factors |= dict.fromkeys(("Nr", "Nru", "Yr", "Yru", "Nvvv", "Nvvr", "Nvrr"), yaw)
    return _times(hull, c, factors | {"Xu": 1.0 + 0.4 * ratio**2} | dict.fromkeys(ACCELERATIONS, masses))


def trim(hull: Hull, c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Linear derivatives with trim by the stern, after the slopes of Inoue et al. (1981), N_v the strongest."""
    t = p["by_stern_m"] / hull.draught_m
    factors = dict.fromkeys(("Yv", "Yvu"), 1.0 + 0.6 * t) | dict.fromkeys(("Yr", "Yru"), 1.0 + 0.75 * t)
    return _times(
        hull, c, factors | dict.fromkeys(("Nv", "Nvu"), 1.0 - 1.0 * t) | dict.fromkeys(("Nr", "Nru"), 1.0 + 0.3 * t)
    )


CHANGES: dict[str, Callable[[Hull, Coefficients, dict[str, float]], Coefficients]] = {
    change.__name__: change
    for change in (
        *(rudder_effectiveness, linear_yaw_damping, linear_sway_damping, added_yaw_inertia, added_sway_mass),
        *(shallow_water, water_depth, trim),
    )
}
