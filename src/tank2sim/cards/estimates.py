"""Published estimates of derivatives from the main dimensions of a ship, for derivatives without measurements.

All in the prime system (forces 1/2 rho L^2 U^2, moments 1/2 rho L^3 U^2, accelerations by rho and L), about the origin
midways between the perpendiculars, without inertia terms ("hydrodynamic"). Each estimate has its
source and a wide standard error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

CLARKE = "Clarke, Gedling and Hine 1983, Trans. RINA 125"
"""The application of manoeuvring criteria in hull design using linear theory: regressions over rotating-arm and planar
motion tests of merchant ships."""

SODING = "Söding 1982, Schiffstechnik 29"
"""Prediction of ship steering capabilities: X_udot."""

GYRATION = "radius of gyration 0.25 L"
"""The usual rule for merchant ships without a weight distribution."""

RELATIVE_ERROR = 0.30
"""Standard error of a Clarke estimate, relative: scatter of the regressions, which are for merchant hulls."""

COUPLING_ERROR = 0.05
"""Standard error of Clarke's Y_rdot and N_vdot in units of pi (T/L)^2: small differences of large numbers, even of
uncertain sign; those measured on the Mariner are 0.05 and 0.04 away."""

SURGE_ERROR = 0.50
"""Standard error of X_udot, relative: formulas of different authors differ by a factor of two."""

GYRATION_ERROR = 0.06
"""Standard error of the radius of gyration, relative: 0.22 L to 0.28 L are two of them (the Mariner has 0.222 L)."""


@dataclass(frozen=True, kw_only=True)
class Particulars:
    """Main dimensions, SI: length between perpendiculars, beam, draught; mass, density of the water, and x_G.

    A missing mass follows from the block coefficient and vice versa.
    """

    length_m: float
    beam_m: float
    draught_m: float
    density_kgpm3: float = 1025.0
    mass_kg: float | None = None
    block_coefficient: float | None = None
    x_G_m: float = 0.0

    @property
    def box_m3(self) -> float:
        """L B T."""
        return self.length_m * self.beam_m * self.draught_m

    @property
    def block(self) -> float:
        """C_B, given or from the mass.

        Raises
        ------
        ValueError
            Neither mass nor block coefficient is given.
        """
        if self.block_coefficient is not None:
            return self.block_coefficient
        if self.mass_kg is not None:
            return self.mass_kg / self.density_kgpm3 / self.box_m3
        raise ValueError("neither mass nor block coefficient is given")

    @property
    def mass_prime(self) -> float:
        """m' = m/(1/2 rho L^3)."""
        mass = self.block * self.box_m3 * self.density_kgpm3 if self.mass_kg is None else self.mass_kg
        return mass / (0.5 * self.density_kgpm3 * self.length_m**3)


@dataclass(frozen=True)
class NamedEstimate:
    """An estimated number (prime), its standard error, and the source of its formula."""

    value: float
    standard_error: float
    source: str


def estimate(particulars: Particulars, names: Iterable[str]) -> dict[str, NamedEstimate]:
    """Estimates of derivatives with a published formula.

    Parameters
    ----------
    particulars : Particulars
        Particulars of the ship.
    names : iterable of str
        Canonical names; ``yaw_inertia`` is J_z'. Names without a formula (see :data:`ESTIMATED`) are not in
        the result.

    Returns
    -------
    dict
        Name to estimate.

    Raises
    ------
    ValueError
        Neither mass nor block coefficient is given.
    """
    return {name: ESTIMATED[name](particulars) for name in names if name in ESTIMATED}


CLARKE_BRACKETS: Mapping[str, Callable[[Any, Any, Any], Any]] = {
    "Yvdot": lambda bl, bt, cb: 1 + 0.16 * cb * bt - 5.1 * bl**2,
    "Yrdot": lambda bl, bt, cb: 0.67 * bl - 0.0033 * bt**2,
    "Nvdot": lambda bl, bt, cb: 1.1 * bl - 0.041 * bt,
    "Nrdot": lambda bl, bt, cb: 1 / 12 + 0.017 * cb * bt - 0.33 * bl,
    "Yv": lambda bl, bt, cb: 1 + 0.40 * cb * bt,
    "Yr": lambda bl, bt, cb: -1 / 2 + 2.2 * bl - 0.080 * bt,
    "Nv": lambda bl, bt, cb: 1 / 2 + 2.4 * bl / bt,
    "Nr": lambda bl, bt, cb: 1 / 4 + 0.039 * bt - 0.56 * bl,
}
"""Factors of -pi (T/L)^2 in Clarke's regressions: functions of B/L, B/T and C_B, numbers or symbols."""

CLARKE_COUPLINGS = ("Yrdot", "Nvdot")
"""Those with an absolute error, :data:`COUPLING_ERROR`."""


def _clarke(name: str) -> Callable[[Particulars], NamedEstimate]:
    """An estimate -pi (T/L)^2 times its bracket."""

    def value(ship: Particulars) -> NamedEstimate:
        unit = math.pi * (ship.draught_m / ship.length_m) ** 2
        bracket = CLARKE_BRACKETS[name](ship.beam_m / ship.length_m, ship.beam_m / ship.draught_m, ship.block)
        number = -unit * bracket
        error = unit * COUPLING_ERROR if name in CLARKE_COUPLINGS else RELATIVE_ERROR * abs(number)
        return NamedEstimate(number, error, CLARKE)

    return value


def _surge(ship: Particulars) -> NamedEstimate:
    """X_udot = -2.7 rho V^(5/3)/L^2, V the displaced volume (Söding 1982)."""
    volume = ship.mass_prime / 2  # over L^3
    value = -2 * 2.7 * volume ** (5 / 3)
    return NamedEstimate(value, SURGE_ERROR * abs(value), SODING)


def _yaw_inertia(ship: Particulars) -> NamedEstimate:
    """J_z' = m' (0.25^2 + x_G'^2), about the origin."""
    radius, arm = 0.25, ship.x_G_m / ship.length_m
    error = 2 * GYRATION_ERROR * ship.mass_prime * radius**2
    return NamedEstimate(ship.mass_prime * (radius**2 + arm**2), error, GYRATION)


ESTIMATED: Mapping[str, Callable[[Particulars], NamedEstimate]] = {
    **{name: _clarke(name) for name in CLARKE_BRACKETS},
    "Xudot": _surge,
    "yaw_inertia": _yaw_inertia,
}
"""Formulas by name. Rudder and third-order terms have none: they depend on more than main dimensions."""
