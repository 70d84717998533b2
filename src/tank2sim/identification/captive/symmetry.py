"""The symmetry that (3.8) uses, tested: are there terms of the other parity?

By the symmetry of a hull to port and starboard X has even terms and Y, N odd ones, except for Y0, N0 and their change
with speed, which (3.8) has for a single screw. What the other parity would add has no place in a card; that it is
small is worth knowing.
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

_OTHER_PARITY = {"X": "v r d vvv rrr ddd".split(), "Y": "vv rr dd vr vd rd".split(), "N": "vv rr dd vr vd rd".split()}


@dataclass(frozen=True, kw_only=True)
class Asymmetry:
    """The test of one force.

    Parameters
    ----------
    names : tuple of str
        Terms of the other parity that the campaign excites.
    values, standard_errors : tuple of float
        Prime, with them all next to the terms of the result.
    chance : float
        Probability of values as large as these together if the symmetry holds (Wald's test); 1 without terms.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    chance: float


def asymmetry(campaign: Campaign, selection: Selection) -> Asymmetry:
    """Terms of the other parity next to those of the result."""
    force, runs = selection.equations.force, selection.equations.runs
    kept, prior = selection.equations.names, selection.equations.prior
    other: list[str] = []
    for powers in _OTHER_PARITY[force]:
        term = parse_term(force + powers)
        assert term is not None
        if not excited(campaign, runs, term):
            continue
        trial = campaign_equations(campaign, runs, force, [*kept, *other, term.name]).held(prior)
        if solve(trial, selection.spread).condition <= COLLINEAR:
            other.append(term.name)
    if not other:
        return Asymmetry(names=(), values=(), standard_errors=(), chance=1.0)
    solution = solve(campaign_equations(campaign, runs, force, [*kept, *other]).held(prior), selection.spread)
    values, covariance = solution.values[len(kept) :], solution.covariance[len(kept) :, len(kept) :]
    return Asymmetry(
        names=tuple(other),
        values=tuple(float(value) for value in values),
        standard_errors=tuple(float(error) for error in np.sqrt(np.diag(covariance))),
        chance=float(chdtrc(len(other), values @ np.linalg.solve(covariance, values))),
    )
