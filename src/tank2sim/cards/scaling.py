"""Prime system and signs: converted here, once, between a card's file and the program.

Inside, every derivative is non-dimensional in the prime system (forces by 1/2 rho L^2 V^2, moments by 1/2 rho L^3 V^2,
v' = v/V, r' = r L/V, Du' = Du/V; inertias and acceleration derivatives by rho and L alone) and the rudder is positive
to starboard.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tank2sim.cards.terms import Term

LARGEST_PRIME = 1e4
"""Largest derivative or standard error in the prime system. Published ones are below 10; with a thousand times that
every force of the model stays a number. Project choice: what is beyond is a slip of the pen or of the scaling."""


@dataclass(frozen=True)
class Scales:
    """Reference values that make numbers of a ship non-dimensional: water density (kg/m3), length (m), speed of the
    scaling (m/s).

    Numbers, or CasADi expressions: the equations of motion use the same scales.
    """

    density: Any
    length: Any
    speed: Any

    def derivative(self, term: Term) -> Any:
        """SI value of a derivative whose prime value is 1.

        F = 1/2 rho L^2 V^2 a' (v/V)^i (r L/V)^j d^k (Du/V)^l, and L times that for N and K; p goes with L/V as r does,
        phi as it is; for acceleration derivatives V cancels and only rho and L remain.
        """
        arm = 1 if term.force in "KN" else 0
        if term.acceleration:
            turning = 1 if term.acceleration in "pr" else 0
            return 0.5 * self.density * self.length ** (3 + arm + turning)
        rates = term.r + term.p
        return 0.5 * self.density * self.length ** (2 + arm + rates) * self.speed ** (2 - term.v - rates - term.u)

    @property
    def mass(self) -> Any:
        """SI value of m' = 1, kg."""
        return 0.5 * self.density * self.length**3

    @property
    def inertia(self) -> Any:
        """SI value of J_z' = 1, kg m2."""
        return 0.5 * self.density * self.length**5

    @property
    def force(self) -> Any:
        """SI value of X' = 1, N."""
        return 0.5 * self.density * self.length**2 * self.speed**2

    def unit(self, force: str) -> Any:
        """SI value of X' = 1 or Y' = 1, N, or of N' = 1, N m."""
        return self.force * (self.length if force == "N" else 1.0)


@dataclass(frozen=True)
class OtherPrime:
    """A non-dimensional system whose masses are `scale`/`ship_mass` times the prime system's, lengths in L.

    Each velocity takes one of the two powers of `froude` that a force has. Prime system II of the MMG method has L d in
    place of L^2: `scale` is L/d. Norrbin's bis system (1971, SSPA publication 68), with times in sqrt(L/g) and masses
    in the ship's own, finite at rest: `froude` is u0/sqrt(g L), `ship_mass` m' of the ship.
    """

    scale: float = 1.0
    froude: float = 1.0
    ship_mass: float = 1.0

    @property
    def length(self) -> float:
        """Value of x_G' = 1."""
        return 1.0

    @property
    def mass(self) -> float:
        """Value of m' = 1."""
        return self.scale / self.ship_mass

    @property
    def inertia(self) -> float:
        """Value of J_z' = 1."""
        return self.mass

    @property
    def force(self) -> float:
        """Value of X' = 1."""
        return self.scale * self.froude**2 / self.ship_mass

    def derivative(self, term: Term) -> float:
        """Value of a derivative whose prime value is 1."""
        if term.acceleration:
            return self.mass
        return self.scale * self.froude ** (2 - term.v - term.r - term.p - term.u) / self.ship_mass


FileScales = Scales | OtherPrime
"""Systems of a file's numbers, other than the prime system."""


def file_factor(term: Term, scales: FileScales | None, *, rudder_to_port: bool) -> float:
    """Factor of a derivative from inside (prime, starboard) to the file.

    Parameters
    ----------
    term : Term
        The derivative.
    scales : FileScales or None
        What the file's numbers are in: the ship's scales if it is dimensional (SI), None if in the prime system.
    rudder_to_port : bool
        The file counts rudder angles positive to port: odd powers of the rudder change sign.
    """
    sign = -1.0 if rudder_to_port and term.d % 2 else 1.0
    return sign * (float(scales.derivative(term)) if scales else 1.0)
