"""Added mass and added inertia of a triaxial ellipsoid in unbounded ideal fluid: Lamb's coefficients.

Lamb, Hydrodynamics, 6th ed. 1932, art. 114 and 115; Korotkin, Added masses of ship structures, 2009, section 2.3. The
integrals are Carlson's (DLMF 19.33.4), which need no order of the axes and stay exact where two of them are equal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import elliprd

# Two axes closer than this make a body of revolution: (b/c - 1)^2, to which the added inertia is proportional, is then
# below what a float can distinguish from 1.
_ROUND = 1e-8


@dataclass(frozen=True)
class LambCoefficients:
    """Added mass over displaced mass along the axes a, b, c (k11, k22, k33), and added inertia over that of the
    displaced fluid about them (k44, k55, k66), all non-dimensional."""

    k11: float
    k22: float
    k33: float
    k44: float
    k55: float
    k66: float


def lamb_integrals(a_m: float, b_m: float, c_m: float) -> tuple[float, float, float]:
    """Lamb's alpha0, beta0, gamma0 of an ellipsoid with semi-axes a, b, c; their sum is 2.

    alpha0 = abc int_0^inf ds / ((a^2 + s) sqrt((a^2 + s)(b^2 + s)(c^2 + s))) = 2/3 abc R_D(b^2, c^2, a^2).

    Raises
    ------
    ValueError
        A semi-axis is not positive and finite.
    """
    axes = (a_m, b_m, c_m)
    if not all(0 < axis < math.inf for axis in axes):
        raise ValueError(f"semi-axes {axes} m are not positive")
    # Referred to the middle axis: the integrals have no dimension, and no power of a length leaves the range.
    size = sorted(axes)[1]
    a2, b2, c2 = ((axis / size) ** 2 for axis in axes)
    factor = 2.0 / 3.0 * math.sqrt(a2 * b2 * c2)
    return (
        factor * float(elliprd(b2, c2, a2)),
        factor * float(elliprd(c2, a2, b2)),
        factor * float(elliprd(a2, b2, c2)),
    )


def lamb_coefficients(a_m: float, b_m: float, c_m: float) -> LambCoefficients:
    """Coefficients of an ellipsoid with semi-axes `a_m` (x, half the length), `b_m` (y), `c_m` (z), in any order.

    k11 = alpha0/(2 - alpha0); k66 = (a^2 - b^2)^2 (beta0 - alpha0) / ((a^2 + b^2)(2 (a^2 - b^2) + (a^2 + b^2)(alpha0 -
    beta0))), and so on in turn. A half ellipsoid below a rigid free surface has the same coefficients, k11, k22 and
    k66, of half the mass.

    Raises
    ------
    ValueError
        As :func:`lamb_integrals`.
    """
    alpha, beta, gamma = lamb_integrals(a_m, b_m, c_m)
    return LambCoefficients(
        alpha / (2 - alpha),
        beta / (2 - beta),
        gamma / (2 - gamma),
        _turning(b_m, c_m, beta, gamma),
        _turning(c_m, a_m, gamma, alpha),
        _turning(a_m, b_m, alpha, beta),
    )


def _turning(semi_axis_m: float, other_axis_m: float, own_factor: float, other_factor: float) -> float:
    """Added inertia about the third axis over the inertia of the displaced fluid, 1/5 M (a^2 + b^2)."""
    if abs(semi_axis_m / other_axis_m - 1) < _ROUND:
        return 0.0
    p = (semi_axis_m / other_axis_m) ** 2
    return (
        (p - 1) ** 2 * (other_factor - own_factor) / ((p + 1) * (2 * (p - 1) + (p + 1) * (own_factor - other_factor)))
    )
