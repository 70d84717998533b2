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

from tank2sim.analysis.turning.diagram import SteadyTurning
from tank2sim.arrays import Array

FITTED_RUDDER = math.radians(20.0)
"""Largest rudder of the cubic fits, as in a spiral: a cubic does not follow a ship hard over. Project choice."""

_RATES = 201


@dataclass(frozen=True)
class CubicError:
    """Error of the rudder angle of a cubic: root mean square and largest within the fit, and largest in the
    single-valued part beyond it, None without such a part."""

    rms_deg: float
    largest_deg: float
    largest_beyond_fit_deg: float | None


@dataclass(frozen=True)
class BechCubic:
    """delta = b0 + b1 r + b2 r^2 + b3 r^3, rad and s."""

    b0_rad: float
    b1_s: float
    b2_s2_per_rad: float
    b3_s3_per_rad2: float
    error: CubicError

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """b0 to b3."""
        return self.b0_rad, self.b1_s, self.b2_s2_per_rad, self.b3_s3_per_rad2


@dataclass(frozen=True)
class NorrbinCubic:
    """K delta = n0 + n1 r + n2 r^2 + n3 r^3, rad and s."""

    K_per_s: float
    n0_radps: float
    n1: float
    n2_s_per_rad: float
    n3_s2_per_rad2: float
    error: CubicError

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """n0 to n3."""
        return self.n0_radps, self.n1, self.n2_s_per_rad, self.n3_s2_per_rad2


@dataclass(frozen=True, eq=False)
class CharacteristicCurve:
    """H(r) of the diagram: yaw rate and the rudder angle that holds it (k,), positive to starboard."""

    yaw_rate_degps: Array
    rudder_deg: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class SteeringCharacteristic:
    """Rudder angle that holds a steady yaw rate, and two cubics for it.

    Parameters
    ----------
    norrbin, bech : NorrbinCubic, BechCubic
        The nearest cubic with the position and slope of the straight course, and the nearest one.
    slope_on_straight_course_s : float
        dH/dr, exact, s: the reciprocal of Nomoto's K if surge does not change with the rudder.
    fitted_up_to_degps : float
        Largest yaw rate of the fit.
    """

    norrbin: NorrbinCubic
    bech: BechCubic
    curve: CharacteristicCurve
    slope_on_straight_course_s: float
    fitted_up_to_degps: float


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
    from scipy.interpolate import CubicHermiteSpline  # slow to import

    curve = CubicHermiteSpline(turning.yaw_rate_radps[rows], turning.rudder_rad[rows], slopes[:, 0] / slopes[:, 1])
    rate = np.linspace(curve.x[0], curve.x[-1], _RATES)
    rudder = np.asarray(curve(rate), dtype=float)
    inside = np.abs(rudder) <= max(FITTED_RUDDER, 1.5 * abs(turning.rudder_rad[turning.straight]))
    tangent = np.array([turning.rudder_rad[turning.straight], slope[0] / slope[1]])
    nearest, error = _cubic(rate, rudder, inside, np.zeros(0))
    tangential, its_error = _cubic(rate, rudder, inside, tangent)
    K = float(1 / abs(tangent[1]))
    b0, b1, b2, b3 = nearest.tolist()
    n0, n1, n2, n3 = (K * tangential).tolist()
    return SteeringCharacteristic(
        norrbin=NorrbinCubic(K, n0, n1, n2, n3, its_error),
        bech=BechCubic(b0, b1, b2, b3, error),
        curve=CharacteristicCurve(np.degrees(rate), np.degrees(rudder)),
        slope_on_straight_course_s=float(tangent[1]),
        fitted_up_to_degps=math.degrees(np.max(np.abs(rate[inside]))),
    )


def _cubic(rate: Array, rudder: Array, inside: NDArray[np.bool_], kept: Array) -> tuple[Array, CubicError]:
    """Coefficients (4,), SI, of the nearest cubic with the first coefficients `kept`, and its error."""
    largest = float(np.max(np.abs(rate)))
    powers = np.vander(rate / largest, 4, increasing=True)
    scales = largest ** np.arange(4.0)
    n = len(kept)
    residual = rudder - powers[:, :n] @ (kept * scales[:n])
    higher = np.linalg.lstsq(powers[inside, n:], residual[inside], rcond=None)[0] / scales[n:]
    coefficients = np.concatenate([kept, higher])
    error = np.degrees(np.abs(powers @ (coefficients * scales) - rudder))
    beyond = float(error[~inside].max()) if not inside.all() else None
    within = error[inside]
    return coefficients, CubicError(float(np.sqrt(np.mean(within**2))), float(within.max()), beyond)


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
