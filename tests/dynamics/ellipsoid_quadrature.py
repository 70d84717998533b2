"""Added masses of an ellipsoid by quadrature."""

from __future__ import annotations

import math

from scipy.integrate import quad


def by_quadrature(a: float, b: float, c: float) -> tuple[float, float, float]:
    """abc int_0^inf ds/((x^2 + s) Delta), with s = tan(u)^2 so that the range is finite."""

    def integral(own: float) -> float:
        def integrand(u: float) -> float:
            s, slope = math.tan(u) ** 2, 2 * math.tan(u) / math.cos(u) ** 2
            return slope / ((own**2 + s) * math.sqrt((a * a + s) * (b * b + s) * (c * c + s)))

        return a * b * c * quad(integrand, 0, math.pi / 2, epsabs=1e-13, epsrel=1e-13)[0]

    return integral(a), integral(b), integral(c)


def turning(a: float, b: float, alpha: float, beta: float) -> float:
    return (
        (a * a - b * b) ** 2
        * (beta - alpha)
        / ((a * a + b * b) * (2 * (a * a - b * b) + (a * a + b * b) * (alpha - beta)))
    )
