"""Derivatives about another origin.

For a point P at a' L forward of the old origin O, v_O' = v_P' - a' r' and N_P' = N_O' - a' Y'. Every term in v becomes
terms in v and r by the binomial theorem; accelerations alike. Both ways of stating terms in r ("total" and
"hydrodynamic") change by the same rule, for the inertia of the body does, too. U, by which cards are scaled, is that of
the new origin afterwards: a difference of second order in a' r', which is not in the rule.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.form import RigidBody
from tank2sim.cards.terms import Term, known_term

_IN_SWAY = {("Y", "v"): "Yrdot", ("N", "v"): "Nrdot", ("K", "v"): "Krdot"}


def shifted_terms(name: str, ahead: float) -> dict[str, float]:
    """What a derivative of value 1 (prime) becomes for an origin `ahead` lengths forward: names to values."""
    found: dict[str, float] = {}
    for shifted, value in _in_other_velocities(known_term(name), ahead).items():
        found[shifted] = found.get(shifted, 0.0) + value
        if shifted.startswith("Y"):  # N - a Y
            moment = f"N{shifted[1:]}"
            found[moment] = found.get(moment, 0.0) - ahead * value
    return found


def _in_other_velocities(term: Term, ahead: float) -> dict[str, float]:
    """The same force by v and r of the new origin."""
    if term.acceleration:
        other = _IN_SWAY.get((term.force, term.acceleration))
        return {term.name: 1.0, other: -ahead} if other else {term.name: 1.0}
    return {
        replace(term, v=term.v - count, r=term.r + count).name: comb(term.v, count) * (-ahead) ** count
        for count in range(term.v + 1)
    }


def shift_matrix(names: Sequence[str], ahead: float) -> tuple[tuple[str, ...], Array]:
    """Names of the derivatives about the new origin, and the matrix that makes them of those of `names`.

    Parameters
    ----------
    names : sequence of str
        The k derivatives about the old origin.
    ahead : float
        The new origin forward of it, in lengths.

    Returns
    -------
    names : tuple of str
        The n names, those of the card first.
    matrix : array (n, k)
    """
    columns = [shifted_terms(name, ahead) for name in names]
    every = tuple(dict.fromkeys([*names, *(name for column in columns for name in column)]))
    matrix = np.array([[column.get(name, 0.0) for column in columns] for name in every]).reshape(len(every), len(names))
    return every, matrix


def shifted_body(body: RigidBody, ahead: float) -> RigidBody:
    """m', J_z', x_G' about an origin `ahead` lengths forward."""
    inertia = body.yaw_inertia - 2 * ahead * body.mass * body.x_G + ahead**2 * body.mass
    return RigidBody(mass=body.mass, yaw_inertia=inertia, x_G=body.x_G - ahead)
