"""Names of hydrodynamic derivatives: how a name is spelt, and which powers of v, r, rudder and speed it denotes.

The names that a model has are listed next to its equation (:mod:`tank2sim.dynamics.abkowitz`); this is the grammar
alone: ``Yvvr`` is the coefficient of v^2 r in Y, ``X0`` a constant, ``Y0u`` the coefficient of Du in Y, ``Kvphiphi``
the coefficient of v phi^2 in the rolling moment K, ``Nrdot`` an acceleration derivative.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

_VELOCITY_TERM = re.compile(r"([XYKN])(0?)((?:phi|[vrpdu])*)")
_ACCELERATION_TERM = re.compile(r"([XYKN])([uvrp])dot")
_LETTER = re.compile(r"phi|[vrpdu]")


@dataclass(frozen=True)
class Term:
    """One derivative: a force and what it is derived by.

    Parameters
    ----------
    force : str
        ``X``, ``Y``, ``N``, or ``K`` about the longitudinal axis.
    v, r, d, u, p, phi : int
        Powers of sway velocity, yaw rate, rudder angle, speed change Du, rate of roll and heel in the term.
    acceleration : str
        ``u``, ``v``, ``r`` or ``p`` for an acceleration derivative (its powers are then zero), else empty.
    """

    force: str
    v: int = 0
    r: int = 0
    d: int = 0
    u: int = 0
    acceleration: str = ""
    p: int = 0
    phi: int = 0

    @property
    def powers(self) -> dict[str, int]:
        """The letters of the term (v, r, p, phi, d, u) with their powers, in this order."""
        letters = {"v": self.v, "r": self.r, "p": self.p, "phi": self.phi, "d": self.d, "u": self.u}
        return {letter: power for letter, power in letters.items() if power}

    @property
    def of_roll(self) -> bool:
        """True if only a ship that rolls has it: a term of K, or of p or phi."""
        return self.force == "K" or self.p + self.phi > 0 or self.acceleration == "p"

    @property
    def name(self) -> str:
        """Canonical spelling: order v, r, p, phi, d, u; a term of Y or N in Du alone is ``Y0u``, by asymmetry."""
        if self.acceleration:
            return f"{self.force}{self.acceleration}dot"
        odd = "v" * self.v + "r" * self.r + "p" * self.p + "phi" * self.phi + "d" * self.d
        zero = "0" if not odd and (self.force != "X" or not self.u) else ""
        return self.force + zero + odd + "u" * self.u


@lru_cache(maxsize=4096)
def parse_term(name: str) -> Term | None:
    """The term a name denotes, whatever the order of its letters (``Xudd`` is ``Xddu``); None if it is not a name."""
    acceleration = _ACCELERATION_TERM.fullmatch(name)
    if acceleration:
        return Term(acceleration[1], acceleration=acceleration[2])
    velocity = _VELOCITY_TERM.fullmatch(name)
    if velocity is None or (velocity[2] and set(velocity[3]) - {"u"}) or not (velocity[2] or velocity[3]):
        return None
    letters = _LETTER.findall(velocity[3])
    v, r, d, u, p, phi = (letters.count(letter) for letter in ("v", "r", "d", "u", "p", "phi"))
    return Term(velocity[1], v, r, d, u, p=p, phi=phi)


def known_term(name: str) -> Term:
    """The term of a name that a list of the program has; raises ValueError if it is none."""
    term = parse_term(name)
    if term is None:
        raise ValueError(f"{name} is not a derivative")
    return term
