"""Effects that change coefficients of the true ship: multipliers by name, for one lane.

The hydrodynamic part alone is changed: Y_r and N_r of the card contain -m' and -m'x_G, which no water alters.
"""

from __future__ import annotations

from collections.abc import Callable

from gap_truth.ship import ACCELERATIONS, DRAUGHT_M, MASS, X_G

Coefficients = dict[str, float]

_INERTIA = {"Yr": -MASS, "Yru": -MASS, "Nr": -MASS * X_G, "Nru": -MASS * X_G}
_RUDDER = tuple("Xdd Xudd Xvd Xuvd Yd Yddd Yud Yuud Yvdd Yvvd Nd Nddd Nud Nuud Nvdd Nvvd".split())


def _times(coefficients: Coefficients, factors: dict[str, float]) -> Coefficients:
    new = dict(coefficients)
    for name, factor in factors.items():
        inertia = _INERTIA.get(name, 0.0)
        new[name] = inertia + factor * (new[name] - inertia)
    return new


def rudder_effectiveness(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """All forces of the rudder, its drag included."""
    return _times(c, dict.fromkeys(_RUDDER, 1.0 + p["factor"]))


def linear_yaw_damping(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """N_r and Y_r at all speeds."""
    return _times(c, dict.fromkeys(("Nr", "Nru", "Yr", "Yru"), 1.0 + p["factor"]))


def linear_sway_damping(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Y_v and N_v at all speeds."""
    return _times(c, dict.fromkeys(("Yv", "Yvu", "Nv", "Nvu"), 1.0 + p["factor"]))


def added_yaw_inertia(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Added inertia in yaw."""
    return _times(c, {"Nrdot": 1.0 + p["factor"]})


def added_sway_mass(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Added mass in sway."""
    return _times(c, {"Yvdot": 1.0 + p["factor"]})


def shallow_water(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Masses and damping together; moments and the cubic terms a little less than the sway force."""
    m = p["magnification"]
    factors = {"Yvdot": 1.0 + m, "Nrdot": 1.0 + 0.8 * m, "Xudot": 1.0 + 0.5 * m, "Nvdot": 1.0 + m, "Yrdot": 1.0 + m}
    factors |= dict.fromkeys(("Yv", "Yvu", "Nr", "Nru"), 1.0 + m) | dict.fromkeys(("Nv", "Nvu", "Yr", "Yru"), 1.0 + m)
    return _times(c, factors | dict.fromkeys(("Yvvv", "Yvvr", "Nvvv", "Nvvr"), 1.0 + 0.8 * m))


def water_depth(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Depth over draught, by the powers of slender-body regressions: sway grows fastest, yaw slowest."""
    ratio = DRAUGHT_M / p["depth_m"]
    sway, yaw, masses = 1.0 + 2.0 * ratio**2.5, 1.0 + 1.1 * ratio**2.3, 1.0 + 1.6 * ratio**2.6
    factors = dict.fromkeys(("Yv", "Yvu", "Yvvv", "Yvvr", "Nv", "Nvu"), sway)
    factors |= dict.fromkeys(("Nr", "Nru", "Yr", "Yru", "Nvvv", "Nvvr"), yaw)
    return _times(c, factors | {"Xu": 1.0 + 0.4 * ratio**2} | dict.fromkeys(ACCELERATIONS, masses))


def trim(c: Coefficients, p: dict[str, float]) -> Coefficients:
    """Linear derivatives with trim by the stern, after the slopes of Inoue et al. (1981), N_v the strongest."""
    t = p["by_stern_m"] / DRAUGHT_M
    factors = dict.fromkeys(("Yv", "Yvu"), 1.0 + 0.6 * t) | dict.fromkeys(("Yr", "Yru"), 1.0 + 0.75 * t)
    return _times(
        c, factors | dict.fromkeys(("Nv", "Nvu"), 1.0 - 1.0 * t) | dict.fromkeys(("Nr", "Nru"), 1.0 + 0.3 * t)
    )


CHANGES: dict[str, Callable[[Coefficients, dict[str, float]], Coefficients]] = {
    change.__name__: change
    for change in (
        *(rudder_effectiveness, linear_yaw_damping, linear_sway_damping, added_yaw_inertia, added_sway_mass),
        *(shallow_water, water_depth, trim),
    )
}
