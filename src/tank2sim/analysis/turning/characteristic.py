"""The nonlinear steering characteristics of Bech and Norrbin, from a ship's steady-turning diagram.

Bech and Wagner Smith (1969): T1 T2 r'' + (T1 + T2) r' + K H(r) = K (delta + T3 delta'), so that in a steady turn H(r) =
delta: the diagram, approximated by the nearest cubic b3 r^3 + b2 r^2 + b1 r + b0. Norrbin (1963): T r' + H_N(r) = K
delta with H_N(r) = n3 r^3 + n2 r^2 + n1 r + n0, n1 = 1 of a ship that is stable on a straight course and -1 of one that
is not: it keeps the position and slope of the diagram there (K = |dr/d(delta)|), and n2 and n3 are fitted. Nearest in
delta, by least squares over evenly spaced yaw rates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from tank2sim.analysis.turning.diagram import SteadyTurning
from tank2sim.arrays import Array

FITTED_RUDDER = math.radians(20.0)
"""Largest rudder of the cubic fits, that of a spiral: a cubic does not follow a ship hard over. Project choice."""

_RATES = 201


@dataclass(frozen=True)
class CubicCharacteristic:
    """Rudder angle (rad) as a cubic in yaw rate (rad/s): coefficients (4,) from the constant up, and its error.

    `rms_rad` and `largest_rad` are the root mean square and the largest error of the rudder angle within the fit,
    `beyond_rad` the largest in the single-valued part beyond it, None without such a part.
    """

    coefficients: Array
    rms_rad: float
    largest_rad: float
    beyond_rad: float | None

    def __call__(self, yaw_rate_radps: Array) -> Array:
        """Rudder angle, rad."""
        return np.asarray(np.polynomial.polynomial.polyval(yaw_rate_radps, self.coefficients))

    def error_json(self) -> dict[str, float | None]:
        """Errors in deg."""
        errors = {"rms": self.rms_rad, "largest": self.largest_rad, "largest_beyond_fit": self.beyond_rad}
        return {f"{name}_deg": None if value is None else math.degrees(value) for name, value in errors.items()}


@dataclass(frozen=True)
class SteeringCharacteristic:
    """Rudder angle that holds a steady yaw rate, and two cubics for it; SI, + to starboard.

    Parameters
    ----------
    yaw_rate_radps, rudder_rad : arrays (k,)
        H(r) of the diagram.
    bech, norrbin : CubicCharacteristic
        The nearest cubic, and the nearest one with the position and slope of the straight course.
    slope_s : float
        dH/dr on the straight course, exact, s: the reciprocal of Nomoto's K if surge does not change with the rudder.
    fitted_rad : float
        Largest yaw rate of the fit, rad/s.
    """

    yaw_rate_radps: Array
    rudder_rad: Array
    bech: CubicCharacteristic
    norrbin: CubicCharacteristic
    slope_s: float
    fitted_radps: float

    @property
    def K_per_s(self) -> float:
        """Norrbin's K, 1/s."""
        return 1 / abs(self.slope_s)

    @property
    def n(self) -> Array:
        """Norrbin's n0 (rad/s), n1 (1), n2 (s/rad), n3 (s^2/rad^2)."""
        return self.K_per_s * self.norrbin.coefficients

    def as_json(self) -> dict[str, object]:
        """Coefficients in SI (rad, s), errors in deg."""
        of_norrbin = dict(zip(("n0_radps", "n1", "n2_s_per_rad", "n3_s2_per_rad2"), self.n, strict=True))
        names = ("b0_rad", "b1_s", "b2_s2_per_rad", "b3_s3_per_rad2")
        return {
            "norrbin": {"K_per_s": self.K_per_s, **of_norrbin, "error": self.norrbin.error_json()},
            "bech": {**dict(zip(names, self.bech.coefficients, strict=True)), "error": self.bech.error_json()},
            "curve": {"yaw_rate_degps": np.degrees(self.yaw_rate_radps), "rudder_deg": np.degrees(self.rudder_rad)},
            "slope_on_straight_course_s": self.slope_s,
            "fitted_up_to_degps": math.degrees(self.fitted_radps),
        }


def steering_characteristic(turning: SteadyTurning) -> SteeringCharacteristic | None:
    """Bech's and Norrbin's characteristic of a diagram; None with too few turns, or for a neutral ship.

    If the diagram has two rudders for a yaw rate, only the part around the straight course is used.
    """
    first, last = _single_valued(turning)
    slope = turning.slope[turning.straight]
    if last - first < 4 or not slope[0] / slope[1]:
        return None
    rows = slice(first, last + 1)
    slopes = turning.slope[rows]
    curve = CubicHermiteSpline(turning.yaw_rate_radps[rows], turning.rudder_rad[rows], slopes[:, 0] / slopes[:, 1])
    rate = np.linspace(curve.x[0], curve.x[-1], _RATES)
    rudder = np.asarray(curve(rate), dtype=float)
    inside = np.abs(rudder) <= max(FITTED_RUDDER, 1.5 * abs(turning.rudder_rad[turning.straight]))
    tangent = np.array([turning.rudder_rad[turning.straight], slope[0] / slope[1]])
    return SteeringCharacteristic(
        yaw_rate_radps=rate,
        rudder_rad=rudder,
        bech=_cubic(rate, rudder, inside, np.zeros(0)),
        norrbin=_cubic(rate, rudder, inside, tangent),
        slope_s=float(tangent[1]),
        fitted_radps=float(np.max(np.abs(rate[inside]))),
    )


def _cubic(rate: Array, rudder: Array, inside: NDArray[np.bool_], kept: Array) -> CubicCharacteristic:
    """The nearest cubic with the first coefficients `kept`."""
    largest = float(np.max(np.abs(rate)))
    powers = np.vander(rate / largest, 4, increasing=True)
    scales = largest ** np.arange(4.0)
    n = len(kept)
    residual = rudder - powers[:, :n] @ (kept * scales[:n])
    higher = np.linalg.lstsq(powers[inside, n:], residual[inside], rcond=None)[0] / scales[n:]
    coefficients = np.concatenate([kept, higher])
    error = np.abs(powers @ (coefficients * scales) - rudder)
    beyond = float(error[~inside].max()) if not inside.all() else None
    return CubicCharacteristic(
        coefficients, float(np.sqrt(np.mean(error[inside] ** 2))), float(error[inside].max()), beyond
    )


def _single_valued(turning: SteadyTurning) -> tuple[int, int]:
    """First and last row of the part around the straight course on which the yaw rate rises."""
    rising, rate = turning.slope[:, 1] > 0, turning.yaw_rate_radps
    first = last = turning.straight
    # Where the curve turns back between two rows, both rise.
    while first > 0 and rising[first - 1] and rate[first - 1] < rate[first]:
        first -= 1
    while last < len(rising) - 1 and rising[last + 1] and rate[last + 1] > rate[last]:
        last += 1
    return first, last
