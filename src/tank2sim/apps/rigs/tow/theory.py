"""What the surge coefficients of (1.5) say of a body: drag coefficients (1.3), and the mass by theory (2.5) of paper 1.

Both need the size of the body and its water, which the tows alone do not determine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.rigs.tow.surge import SurgeCoefficients
from tank2sim.arrays import Array
from tank2sim.dynamics.ellipsoid import lamb_coefficients

WATER_KGPM3 = 1000.0
"""Density that the paper calculates with."""
VISCOSITY_M2PS = 1.139e-6
"""Kinematic viscosity of fresh water at 15 deg C (ITTC 7.5-02-01-03). The paper does not print its temperature."""

FREE_SURFACE = 0.96
"""k* of (2.5), by which the surface lessens the mass of a body just below it (the paper, after Gneushev 1982)."""
PRINTED_K11 = 0.156
"""k11 of the printed M_s of 2489 kg; the text rounds it to 0.16. A spheroid 2.5 times as long as thick has it."""


@dataclass(frozen=True, kw_only=True)
class TowedBody:
    """Size of a submerged body and its water, SI.

    Parameters
    ----------
    length_m : float
        Length L.
    volume_m3 : float
        Volume V within its hull.
    beam_m : float, optional
        Breadth; the theory of the added mass needs it.
    density_kgpm3, viscosity_m2ps : float
        Density and kinematic viscosity of the water.
    """

    length_m: float
    volume_m3: float
    beam_m: float | None = None
    density_kgpm3: float = WATER_KGPM3
    viscosity_m2ps: float = VISCOSITY_M2PS

    @property
    def area_ratio(self) -> float:
        """L^2 / V^(2/3): a drag coefficient referred to V^(2/3) is so many times that referred to L^2."""
        return float(self.length_m**2 / self.volume_m3 ** (2 / 3))

    @property
    def height_m(self) -> float:
        """Height of the ellipsoid that has this length, breadth and volume; ValueError if there is no breadth."""
        if self.beam_m is None:
            raise ValueError("the height needs a breadth")
        return 6 * self.volume_m3 / (math.pi * self.length_m * self.beam_m)

    def reynolds(self, speed_mps: Array) -> Array:
        """Re = v L / nu."""
        return np.asarray(speed_mps) * self.length_m / self.viscosity_m2ps


@dataclass(frozen=True, kw_only=True)
class DragPolynomial:
    """C = A1 v^2 + A2 v + A3 of (1.3), v in m/s: A1 in s^2/m^2, A2 in s/m, A3 without dimension."""

    A1_s2pm2: float
    A2_spm: float
    A3: float

    def at(self, speed_mps: Array) -> Array:
        """C at speeds >= 0."""
        v = np.asarray(speed_mps)
        return self.A3 + v * (self.A2_spm + v * self.A1_s2pm2)

    def times(self, factor: float) -> DragPolynomial:
        """The same drag, referred to an area so many times smaller."""
        return DragPolynomial(A1_s2pm2=factor * self.A1_s2pm2, A2_spm=factor * self.A2_spm, A3=factor * self.A3)


def drag_polynomial(coefficients: SurgeCoefficients, body: TowedBody) -> DragPolynomial:
    """A_i = B_i / (rho L^2 / 2), (1.5): C referred to L^2; times :attr:`TowedBody.area_ratio` referred to V^(2/3)."""
    unit = 0.5 * body.density_kgpm3 * body.length_m**2
    return DragPolynomial(
        A1_s2pm2=coefficients.B1_kgs2pm3 / unit, A2_spm=coefficients.B2_kgspm2 / unit, A3=coefficients.B3_kgpm / unit
    )


@dataclass(frozen=True, kw_only=True)
class MassByTheory:
    """M_s of (2.5) with one k11.

    Parameters
    ----------
    basis : str
        What k11 is of.
    k11 : float
        Added over displaced mass in surge, deep below the surface.
    deep_kg, near_surface_kg : float
        (1 + k11) rho V, and k* times that.
    """

    basis: str
    k11: float
    deep_kg: float
    near_surface_kg: float


def mass_by_theory(body: TowedBody, k11: float, basis: str) -> MassByTheory:
    """M_s = k* (1 + k11) rho V, (2.5); the print leaves rho out."""
    deep = (1 + k11) * body.density_kgpm3 * body.volume_m3
    return MassByTheory(basis=basis, k11=k11, deep_kg=deep, near_surface_kg=FREE_SURFACE * deep)


def masses_by_theory(body: TowedBody) -> tuple[MassByTheory, ...]:
    """(2.5) with Lamb's k11 of the triaxial ellipsoid of the body's volume and of the spheroid of its length and
    breadth, and with the k11 that the paper took; the last alone where the breadth is not known.

    Lamb's k11 is exact for an ellipsoid; a real form of the same slenderness differs by a few hundredths.
    """
    printed = mass_by_theory(body, PRINTED_K11, "k11 as published")
    if body.beam_m is None:
        return (printed,)
    a, b = body.length_m / 2, body.beam_m / 2
    triaxial = lamb_coefficients(a, b, body.height_m / 2).k11
    spheroid = lamb_coefficients(a, b, b).k11
    return (
        mass_by_theory(body, triaxial, "triaxial ellipsoid of this volume"),
        mass_by_theory(body, spheroid, "spheroid of this length and breadth"),
        printed,
    )
