"""A card with the coefficients that were fitted together with a missing effect."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, ALL_TERMS
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.ship import mass_fault
from tank2sim.gap.improve_card import changed_derivatives
from tank2sim.gap.inference.fit import CoefficientEstimates
from tank2sim.gap.inference.prior import coefficients_of_card
from tank2sim.gap.result import Refitted
from tank2sim.gap.search.decision import STANDARD_ERRORS
from tank2sim.identification.craft.card import craft_with
from tank2sim.identification.trials.problem.estimation_problem import Estimate
from tank2sim.identification.trials.problem.problem_from_card import card_with_estimate

EXPLAINS = 0.5
"""Share of what the coefficients moved, in squares of their standard errors, that an effect named next to them explains
(project choice: more than half)."""


def effects_like(
    card: SteeredCard, coefficients: Sequence[Refitted], named: Collection[str] = ()
) -> dict[str, Refitted]:
    """Effects that change the coefficients as they moved, and the coefficient of theirs that moved most.

    It moved by more than :data:`.decision.STANDARD_ERRORS`, and the effect explains :data:`EXPLAINS` of what all moved,
    by least squares in units of the standard errors, apart from the changes by speed. Trials alone do not distinguish
    such an effect from coefficients that are off.

    Parameters
    ----------
    card : SteeredCard
        As given.
    coefficients : sequence of Refitted
    named : collection of str
        Effects that are named already.
    """
    steady = [entry for entry in coefficients if entry.name in ALL_TERMS and known_term(entry.name).u == 0]
    errors = {entry.name: entry.standard_error_before for entry in steady}
    moved = np.array([(entry.value - entry.before) / entry.standard_error_before for entry in steady])
    found = {}
    for name, effect in EFFECTS.items():
        if name in named or not effect.tried(card) or not (effect.changes_on(card) or effect.reads_derivatives):
            continue
        by_effect = _changes(card, name, errors)
        explained = by_effect @ np.linalg.lstsq(by_effect, moved, rcond=None)[0]
        changed = [entry for entry, row in zip(steady, by_effect, strict=True) if np.any(row)]
        most = max(changed, key=lambda entry: entry.moved, default=None)
        if most and most.moved > STANDARD_ERRORS and explained @ explained > EXPLAINS * (moved @ moved):
            found[name] = most
    return found


def _changes(card: SteeredCard, name: str, errors: Mapping[str, float]) -> Array:
    """Changes of coefficients, in errors, by each amplitude of an effect of typical size (coefficients, amplitudes)."""
    parameters = EFFECTS[name].parameters
    typical = {each.name: (each.typical_values(card) or (each.value({}, card),))[0] for each in parameters}
    absent = {each.name: each.absent for each in parameters if each.absent is not None}
    columns = []
    for amplitude in absent:
        values = {**typical, **absent, amplitude: typical[amplitude]}
        change = {
            term: after - card.derivatives.get(term, 0.0)
            for term, after, *_ in changed_derivatives(card, name, values, {})
        }
        columns.append([change.get(term, 0.0) / error for term, error in errors.items()])
    return np.array(columns, dtype=float).reshape(len(columns), len(errors)).T


def refit_coefficients(
    card: SteeredCard, model: Model, estimates: CoefficientEstimates
) -> tuple[tuple[Refitted, ...], SteeredCard]:
    """The coefficients with their values before and after, and the card with them and their covariance.

    Data of the steering gear and the clock of the record are part of the fit and are not written: the card states what
    the gear is, and the clock is the record's. Added masses with which the ship would have no positive mass are not
    believed: they remain the card's, and the other coefficients are those that are most probable with them.

    Parameters
    ----------
    card : SteeredCard
    model : Model
        Model of the card; values stay within its bounds.
    estimates : CoefficientEstimates
        Estimates of parameters of the card's model.

    Raises
    ------
    InputError
        No craft has such coefficients: they would drive it on.
    """
    known = coefficients_of_card(card)
    values = _within_bounds(model, estimates, known)
    if mass_fault(model, {**model.defaults, **values}):
        estimates = _with_masses_held(estimates)
        values = _within_bounds(model, estimates, known)
    names = tuple(values)
    rows = [estimates.names.index(name) for name in names]
    before = np.array([known[name] for name in names])
    covariance = estimates.covariance[np.ix_(rows, rows)]
    estimate = Estimate(
        "gap", names, np.array([*values.values()]), covariance, np.asarray(np.linalg.pinv(covariance), dtype=np.float64)
    )
    short = [name.removeprefix("derivatives.") for name in names]
    columns = zip(short, values.values(), estimate.standard_errors.tolist(), *before.T.tolist(), strict=True)
    refitted = _with_estimate(card, estimate, "refitted by gap")
    return tuple(Refitted(*row) for row in columns), replace(
        refitted, covariance=by_file_name(refitted, names, covariance)
    )


def _with_estimate(card: SteeredCard, estimate: Estimate, comment: str) -> SteeredCard:
    """The card with estimates of its coefficients."""
    if card.steered_by is SteeredBy.RUDDER:
        return card_with_estimate(card.manoeuvring(), estimate, comment)
    found = zip(estimate.free, estimate.values.tolist(), estimate.standard_errors.tolist(), strict=True)
    return craft_with(card, {name: (value, error) for name, value, error in found}, comment=comment)


def _within_bounds(
    model: Model, estimates: CoefficientEstimates, known: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Estimates of the card's coefficients, within the bounds of the model."""
    values = {}
    for name, change in zip(estimates.names, map(float, estimates.change), strict=True):
        if name in known:
            low, high = model[name].minimum, model[name].maximum
            values[name] = float(
                np.clip(known[name][0] + change, -np.inf if low is None else low, np.inf if high is None else high)
            )
    return values


def _with_masses_held(estimates: CoefficientEstimates) -> CoefficientEstimates:
    """The other estimates with the card's added masses: a conditional normal distribution."""
    held = np.array([name.removeprefix("derivatives.") in ACCELERATION_TERMS for name in estimates.names])
    change, covariance = estimates.change, estimates.covariance
    gain = covariance[np.ix_(~held, held)] @ np.linalg.pinv(covariance[np.ix_(held, held)])
    return CoefficientEstimates(
        tuple(name for name, is_held in zip(estimates.names, held, strict=True) if not is_held),
        change[~held] - gain @ change[held],
        covariance[np.ix_(~held, ~held)] - gain @ covariance[np.ix_(held, ~held)],
    )
