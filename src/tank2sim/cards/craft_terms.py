"""Terms of a small craft: names, units by the prime system.

Terms are named by what they multiply: ``Xuabsu`` is the coefficient of u|u| in X, ``Nrabsv`` the coefficient of
r|v| in N. All are zero at rest, so that a craft may stop, spin and go astern; a coefficient that damps is negative.
Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 6.4 and 6.5 (there X_|u|u, N_|v|r).
"""

from __future__ import annotations

from typing import NamedTuple

from tank2sim.cards.scaling import FileScales, Scales


class CraftTerm(NamedTuple):
    """A velocity term of a small craft.

    Parameters
    ----------
    name : str
    force : str
        ``X``, ``Y`` or ``N``.
    factor : str
        ``u``, ``v`` or ``r``.
    size : str
        The velocity whose size it has as a second factor; empty for a linear term.
    """

    name: str
    force: str
    factor: str
    size: str

    @property
    def lengths(self) -> int:
        """Lengths that it has more than a term of a force by linear velocities: an arm, and one for each yaw rate."""
        return (self.force == "N") + (self.factor == "r") + (self.size == "r")


def _terms() -> tuple[CraftTerm, ...]:
    surge = [("X", "u", ""), ("X", "u", "u")]
    others = [(force, factor, size) for force in "YN" for factor in "vr" for size in ("", "v", "r", "u")]
    return tuple(
        CraftTerm(f"{force}{factor}{'abs' * bool(size)}{size}", force, factor, size)
        for force, factor, size in (*surge, *others)
    )


VELOCITY_TERMS: tuple[CraftTerm, ...] = _terms()
"""Damping of a small craft: linear terms, and products of a velocity with the size of one."""

CRAFT_ADDED_MASSES = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
"""Acceleration derivatives of a small craft, negative for added masses."""

CRAFT_TERMS: tuple[str, ...] = (*CRAFT_ADDED_MASSES, *(term.name for term in VELOCITY_TERMS))
"""Names in ``[derivatives]`` of a small craft."""


def craft_scale(name: str, scales: Scales) -> float:
    """SI value of a term of a small craft that is 1 in the prime system: with 1/2 rho L^2 V^2, L and V.

    Parameters
    ----------
    name : str
        One of :data:`CRAFT_TERMS`.
    scales : Scales
        Density (kg/m3), length (m) and speed V (m/s).

    Examples
    --------
    >>> from tank2sim.cards.scaling import Scales
    >>> craft_scale("Xuabsu", Scales(1000.0, 2.0, 3.0))  # 1/2 rho L^2
    2000.0
    """
    length, speed = float(scales.length), float(scales.speed)
    if name in CRAFT_ADDED_MASSES:
        return float(scales.mass) * length ** ((name[0] == "N") + (name[1] == "r"))
    term = next(term for term in VELOCITY_TERMS if term.name == name)
    return float(scales.force) * length**term.lengths / speed ** (2 if term.size else 1)


def body_scales(scales: FileScales) -> dict[str, float]:
    """Values of ``mass``, ``yaw_inertia`` and ``x_G`` that are 1 in the prime system.

    Parameters
    ----------
    scales : Scales or OtherPrime
        In which the values are; :class:`Scales` give SI.
    """
    return {"mass": float(scales.mass), "yaw_inertia": float(scales.inertia), "x_G": float(scales.length)}
