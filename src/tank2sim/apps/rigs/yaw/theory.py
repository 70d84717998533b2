"""Added yaw inertia from the form of a body: (7), (8), (9) of paper 3 (Alyshev 2019, after Palagushkin 1996).

All values are in kg m2, about the vertical axis through midships, of the body floating at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from scipy.special import ellipeinc, ellipkinc

from tank2sim.arguments import bounds_of, numbers_in
from tank2sim.dynamics.ellipsoid import lamb_coefficients
from tank2sim.dynamics.vessel import as_vessel
from tank2sim.errors import ArgumentError
from tank2sim.quantities import Breadth, Draught, Length, WaterDepth

Stage = Literal["accelerating", "braking"]

_WATER_KGPM3 = 1000.0
"""Density that the paper calculates with."""
GRAVITY_MPS2 = 9.80665

_SPEED_FACTORS: dict[Stage, tuple[float, float]] = {"accelerating": (0.986, 8.63), "braking": (1.23, 10.1)}
"""a and b of (8); the print calls both a_d and b_d."""


@dataclass(frozen=True, kw_only=True)
class FloatingBody:
    """Dimensions of a body and its tank, SI: waterline length and beam, draught, depth of the water, and for a ship
    the block coefficient."""

    length_m: float
    beam_m: float
    draught_m: float
    depth_m: float
    block_coefficient: float | None = None
    density_kgpm3: float = _WATER_KGPM3

    @property
    def block(self) -> float:
        """The block coefficient; raises ValueError if there is none."""
        if self.block_coefficient is None:
            raise ValueError("(8) and (9) need a block coefficient")
        return self.block_coefficient


ELLIPSOID = FloatingBody(length_m=0.67, beam_m=0.20, draught_m=0.08, depth_m=0.22)
"""The paper's ellipsoid at its draught T1."""
SHIP_MOTION_T1 = FloatingBody(length_m=0.67, beam_m=0.20, draught_m=0.08, depth_m=0.22, block_coefficient=0.47)
SHIP_MOTION_T2 = FloatingBody(length_m=0.685, beam_m=0.20, draught_m=0.10, depth_m=0.24, block_coefficient=0.49)
"""The paper's ship model at its two draughts."""


def depth_factor(draught_over_depth: float) -> float:
    """k66h, by which shallow water magnifies the added yaw inertia: 0.997 + 0.358 x + 0.814 x^2 + 2.27 x^3, x = T/h."""
    x = draught_over_depth
    return 0.997 + x * (0.358 + x * (0.814 + x * 2.27))


def ellipsoid_water_inertia(body: FloatingBody) -> float:
    """J* of (7): yaw inertia of the water that a half ellipsoid displaces, pi/120 rho L B T (L^2 + B^2)."""
    size = body.density_kgpm3 * body.length_m * body.beam_m * body.draught_m
    return math.pi / 120 * size * (body.length_m**2 + body.beam_m**2)


def ratio_by_7(length_over_beam: float, draught_ratio: float, *, as_printed: bool = False) -> float:
    """Added over displaced inertia of a triaxial ellipsoid by (7), p = L/B > 1 and q = 2T/B < 1; else ValueError.

    The print has (p^2 - 1) in the numerator where (p^2 - 1)^2 belongs, and the letter E for both elliptic integrals;
    with the square and F for the second it is Lamb's value (k66). `as_printed` leaves the square out.
    """
    p, q = length_over_beam, draught_ratio
    if not p > 1 > q > 0:
        raise ValueError(f"(7) is for L > B > 2T, not L/B = {p:g} and 2T/B = {q:g}; take lamb_coefficients")
    s = math.sqrt(p * p - q * q)
    # The integrals have sin(alpha) = s/p; the complement is exact where s/p is near 1.
    alpha, m = math.atan2(s, q), (p * p - 1) / (p * p - q * q)
    first, second = float(ellipkinc(alpha, m)), float(ellipeinc(alpha, m))
    g2 = p * second * (p * p - 2 * q * q + 1) - 2 * p * (1 - q * q) * first - q * (p * p - 1) * s
    below = (p * p + 1) * ((p * p - 1) ** 2 * (1 - q * q) * s - q * (p * p + 1) * g2)
    return q * (p * p - 1) * (1.0 if as_printed else p * p - 1) * g2 / below


def added_inertia_by_7(body: FloatingBody, *, as_printed: bool = False) -> float:
    """lambda66 of a half ellipsoid by (7), with the factor of depth."""
    ratio = ratio_by_7(body.length_m / body.beam_m, 2 * body.draught_m / body.beam_m, as_printed=as_printed)
    return depth_factor(body.draught_m / body.depth_m) * ellipsoid_water_inertia(body) * ratio


def added_inertia_of_ellipsoid(body: FloatingBody) -> float:
    """lambda66 of a half ellipsoid with any order of axes: Lamb's k66, with the factor of depth."""
    k66 = lamb_coefficients(body.length_m / 2, body.beam_m / 2, body.draught_m).k66
    return depth_factor(body.draught_m / body.depth_m) * ellipsoid_water_inertia(body) * k66


def rotational_froude_number(body: FloatingBody, rate_radps: float) -> float:
    """|Fr| = L |w| / sqrt(g B), of the speed of the ends and the beam."""
    return body.length_m * abs(rate_radps) / math.sqrt(GRAVITY_MPS2 * body.beam_m)


def added_inertia_by_8(body: FloatingBody, rate_radps: float, stage: Stage, *, bracket: float = 0.088) -> float:
    """lambda66 of a ship by (8), as printed: a regression over models turned in a circulating tank.

    The stage says whether the water is being set in motion, or overtakes the body. `bracket` is the second factor of
    the last bracket; 0.088 in the print, 0.08 (with a rate 3/4 as large) comes nearest to the paper's own table.
    ValueError for a body without block coefficient.
    """
    a, b = _SPEED_FACTORS[stage]
    length, beam, draught, block = body.length_m, body.beam_m, body.draught_m, body.block
    finite = 1 - (beam / length - 0.0502) * (0.965 + 0.86 * 2 * draught / beam)
    size = finite * math.pi / 2 * body.density_kgpm3 * draught**2 * length**3
    still_water = (0.60 * block - 0.258) * (0.962 + 0.0127 * beam / (2 * draught))
    fineness = a * (0.066 - 0.08 * (1 - block) ** 0.8)
    shallow = b * (draught / body.depth_m) ** 2 * (0.066 - bracket * (1 - block) ** 0.81)
    waves = rotational_froude_number(body, rate_radps) ** 1.5 * (beam / draught) ** 0.73 * (fineness + shallow)
    return float(size * (still_water + waves))


def sensitivity_of_8(body: FloatingBody, rate_radps: float, stage: Stage) -> float:
    """Change of (8) with 0.01 in the block coefficient, kg m2."""
    fuller = replace(body, block_coefficient=body.block + 0.01)
    return added_inertia_by_8(fuller, rate_radps, stage) - added_inertia_by_8(body, rate_radps, stage)


def ship_water_inertia(body: FloatingBody) -> float:
    """J* of (9): yaw inertia of the water that a ship displaces, rho delta B T L^3 / 12.4 (delta^1.6 + (B/L)^2)."""
    slender = float(body.block**1.6) + (body.beam_m / body.length_m) ** 2
    return body.density_kgpm3 * body.block * body.beam_m * body.draught_m * body.length_m**3 / 12.4 * slender


def added_inertia_by_9(body: FloatingBody) -> float:
    """lambda66 of a ship by (9): that of the spheroid with its length and beam, with the inertia J* of the ship."""
    k66 = lamb_coefficients(body.length_m / 2, body.beam_m / 2, body.beam_m / 2).k66
    return depth_factor(body.draught_m / body.depth_m) * ship_water_inertia(body) * k66


@dataclass(frozen=True, kw_only=True)
class TheoryValue:
    """An added yaw inertia from the form: by what, kg m2, the paper's own number where it has one, and a remark."""

    formula: str
    value_kgm2: float
    printed_kgm2: float | None = None
    remark: str = ""


_PRINTED: dict[FloatingBody, dict[str, float]] = {
    ELLIPSOID: {"(7)": 509.7e-4},
    SHIP_MOTION_T1: {"(9)": 263.0e-4, "(8) accelerating": 456.6e-4, "(8) braking": 464.4e-4},
    SHIP_MOTION_T2: {"(9)": 797.6e-4, "(8) accelerating": 1056.8e-4, "(8) braking": 1070.3e-4},
}
"""Table 1 of the paper, of its own bodies."""
_SAME = 0.002
"""Two numbers that differ by so little, relatively, are the same except for the print's rounding."""


def theory_values(body: FloatingBody, rate_radps: float) -> tuple[TheoryValue, ...]:
    """(7), or Lamb where its axes are in another order, and for a ship (8) and (9), at the rate `rate_radps`."""
    printed = _PRINTED.get(body, {})

    def row(formula: str, value: float, remark: str) -> TheoryValue:
        printed_value = printed.get(formula)
        if printed_value is not None:
            same = "reproduces" if abs(value / printed_value - 1) < _SAME else "does not reproduce"
            remark = f"the published number {same}; {remark}"
        return TheoryValue(formula=formula, value_kgm2=value, printed_kgm2=printed_value, remark=remark)

    try:
        values = [row("(7)", added_inertia_by_7(body), "half ellipsoid, corrected, times the factor of depth")]
    except ValueError:
        values = [row("Lamb", added_inertia_of_ellipsoid(body), "half ellipsoid, times the factor of depth")]
    if body.block_coefficient is None:
        return tuple(values)
    stages: tuple[Stage, ...] = ("accelerating", "braking")
    for stage in stages:
        more = 1e4 * sensitivity_of_8(body, rate_radps, stage)
        remark = f"block coefficient + 0.01 changes it by {more:+.3g}e-4"
        values.append(row(f"(8) {stage}", added_inertia_by_8(body, rate_radps, stage), remark))
    values.append(row("(9)", added_inertia_by_9(body), "spheroid's ratio with the ship's inertia of water"))
    return tuple(values)


def parse_body(text: str) -> FloatingBody:
    """From a text ``L,B,T,H`` or ``L,B,T,H,CB``, or from a card that states these."""
    if "," in text:
        sizes: list[float | None] = [*numbers_in(text, (4, 5))]
    else:
        ship = as_vessel(text).card.ship
        sizes = [ship.length_m, ship.beam_m, ship.draught_m, ship.water_depth_m, ship.block_coefficient]
    kinds = (Length, Breadth, Draught, WaterDepth)
    known = zip(sizes, map(bounds_of, kinds), strict=False)
    stated = [size for size, bounds in known if size is not None and bounds is not None and bounds.hold(size)]
    block = sizes[4] if len(sizes) > 4 else None
    if len(stated) < 4 or (block is not None and not 0 < block <= 1):
        problem = f"{text!r} does not state length, beam, draught and depth of water"
        remedy = "write for example 0.67,0.20,0.08,0.22,0.47, or name a card with them"
        raise ArgumentError("theory", "", problem, remedy)
    length, beam, draught, depth = stated
    return FloatingBody(length_m=length, beam_m=beam, draught_m=draught, depth_m=depth, block_coefficient=block)
