"""Test of the symmetry in (3.8): terms of the opposite parity.

By the symmetry of a hull to port and starboard X has even terms and Y, N odd ones, except for Y0, N0 and their change
with speed, which (3.8) has for a single screw. Terms of the opposite parity
are not part of a card; the test shows that they are small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from tank2sim.cards.terms import parse_term
from tank2sim.identification.captive.equations import campaign_equations, excited
from tank2sim.identification.captive.regression import solve
from tank2sim.identification.captive.selection import Selection
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.records.campaigns import Campaign

_EVEN = "vv rr dd vr vd rd".split()
_OPPOSITE_PARITY = {"X": "v r d vvv rrr ddd".split(), "Y": _EVEN, "N": _EVEN}


@dataclass(frozen=True, kw_only=True)
class Asymmetry:
    """The test of one force.

    Parameters
    ----------
    names : tuple of str
        Terms of the opposite parity that the campaign excites.
    values, standard_errors : tuple of float
        Prime, with all of them in addition to the terms of the result.
    chance : float
        Probability of values as large as these together if the symmetry holds (Wald's test); 1 without terms.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    chance: float


def asymmetry(campaign: Campaign, selection: Selection) -> Asymmetry:
    """Terms of the opposite parity in addition to those of the result."""
    force, runs = selection.equations.force, selection.equations.runs
    kept, prior = selection.equations.names, selection.equations.prior
    excited_terms: list[str] = []
    for powers in _OPPOSITE_PARITY[force]:
        term = parse_term(force + powers)
        assert term is not None
        if not excited(campaign, runs, term):
            continue
        trial = campaign_equations(campaign, runs, force, [*kept, *excited_terms, term.name]).held(prior)
        if solve(trial, selection.spread).condition <= COLLINEAR:
            excited_terms.append(term.name)
    if not excited_terms:
        return Asymmetry(names=(), values=(), standard_errors=(), chance=1.0)
    solution = solve(campaign_equations(campaign, runs, force, [*kept, *excited_terms]).held(prior), selection.spread)
    values, covariance = solution.values[len(kept) :], solution.covariance[len(kept) :, len(kept) :]
    return Asymmetry(
        names=tuple(excited_terms),
        values=tuple(float(value) for value in values),
        standard_errors=tuple(float(error) for error in np.sqrt(np.diag(covariance))),
        chance=float(chdtrc(len(excited_terms), values @ np.linalg.solve(covariance, values))),
    )
