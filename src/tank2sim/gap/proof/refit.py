"""A card with the coefficients that were fitted together with a missing effect."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.gap.inference.fit import CoefficientEstimates
from tank2sim.gap.result import Refitted
from tank2sim.gap.search.decision import STANDARD_ERRORS
from tank2sim.identification.trials.problem.estimation_problem import Estimate
from tank2sim.identification.trials.problem.problem_from_card import card_with_estimate, free_parameters

FEW_TERMS = 2
"""Derivatives at most, apart from their changes by speed, that an effect changes which is named next to a refitted
coefficient: more, and it is a change of the whole ship or rudder (project choice)."""


def effects_like(coefficients: Sequence[Refitted], named: Collection[str]) -> dict[str, Refitted]:
    """Effects that change a refitted coefficient which has moved by :data:`.decision.STANDARD_ERRORS`, and that coefficient.

    Trials alone do not distinguish such an effect from a coefficient that is off.

    Parameters
    ----------
    coefficients : sequence of Refitted
    named : collection of str
        Effects that are named already.
    """
    found = {}
    for name, effect in EFFECTS.items():
        terms = [term for term in effect.changes if known_term(term).u == 0]
        moved = [entry for entry in coefficients if entry.name in terms and entry.moved > STANDARD_ERRORS]
        if moved and name not in named and len(terms) <= FEW_TERMS:
            found[name] = max(moved, key=lambda coefficient: coefficient.moved)
    return found


def refit_coefficients(
    card: ManoeuvringCard, model: Model, estimates: CoefficientEstimates
) -> tuple[tuple[Refitted, ...], ManoeuvringCard]:
    """The coefficients with their values before and after, and the card with them and their covariance.

    Data of the steering gear and the clock of the record are part of the fit and are not written: the card states what
    the gear is, and the clock is the record's.

    Parameters
    ----------
    card : ManoeuvringCard
    model : Model
        Model of the card; values stay within its bounds.
    estimates : CoefficientEstimates
        Estimates of parameters of the card's model.
    """
    known = free_parameters(card, inertia=True)
    rows = [row for row, name in enumerate(estimates.names) if name in known]
    names = tuple(estimates.names[row] for row in rows)
    before = np.array([known[name] for name in names])
    covariance = estimates.covariance[np.ix_(rows, rows)]
    bounds = [(model[name].minimum, model[name].maximum) for name in names]
    lowest = np.array([-np.inf if low is None else low for low, _ in bounds])
    highest = np.array([np.inf if high is None else high for _, high in bounds])
    values = np.clip(before[:, 0] + estimates.change[rows], lowest, highest)
    estimate = Estimate("gap", names, values, covariance, np.asarray(np.linalg.pinv(covariance), dtype=np.float64))
    short = [name.removeprefix("derivatives.") for name in names]
    columns = zip(short, values.tolist(), estimate.standard_errors.tolist(), *before.T.tolist(), strict=True)
    refitted = card_with_estimate(card, estimate, "refitted by gap")
    return tuple(Refitted(*row) for row in columns), replace(
        refitted, covariance=by_file_name(refitted, names, covariance)
    )
