"""Draws of an ensemble from the errors of a card."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.covariance import Covariance
from tank2sim.dynamics.card_parameters import (
    CardParameter,
    JointErrors,
    card_parameters,
    joint_errors,
    study_model,
)
from tank2sim.notices import Notice
from tank2sim.simulation.ensemble import Draws


def draws_of(card: SteeredCard, seed: int) -> tuple[Draws, list[Notice]]:
    """The draws of a card, with notices on them.

    Numbers in the card's covariance are correlated; all other numbers are independent, with their standard errors.

    Raises InputError: The covariance to which the card refers has an error.
    """
    errors = joint_errors(card, card_parameters(card, study_model(card)))
    return draws_with(errors, seed), errors.in_words


def draws_with(errors: JointErrors, seed: int) -> Draws:
    """Draws of parameters with these errors; exact parameters are not drawn."""
    uncertain = np.flatnonzero(np.diag(errors.covariance) > 0)
    chosen = [errors.parameters[place] for place in uncertain]
    bounds = np.array([parameter.bounds for parameter in chosen], dtype=float).reshape(-1, 2)  # None becomes nan
    rows = {place: row for row, place in enumerate(uncertain.tolist())}
    return Draws(
        names=tuple(parameter.name for parameter in chosen),
        mean=np.array([parameter.value for parameter in chosen]),
        root=_root(errors.covariance[np.ix_(uncertain, uncertain)]),
        lowest=np.nan_to_num(bounds[:, 0], nan=-np.inf, posinf=np.inf, neginf=-np.inf),
        highest=np.nan_to_num(bounds[:, 1], nan=np.inf, posinf=np.inf, neginf=-np.inf),
        seed=seed,
        samples=errors.samples,
        sampled=np.array([rows[place] for place in errors.sampled], dtype=np.int64),
        assumed=errors.assumed,
    )


def by_file_name(card: SteeredCard, names: Sequence[str], matrix: Array, samples: Array | None = None) -> Covariance:
    """A covariance by the names of the card's file instead of the model's, without numbers that are not on the card.

    `matrix` is (k, k) and `samples`, if any, (n, k).
    """
    found = {parameter.name: parameter for parameter in card_parameters(card, study_model(card))}
    rows = [place for place, name in enumerate(names) if name in found]
    chosen: list[CardParameter] = [found[names[place]] for place in rows]
    factors = np.array([parameter.factor for parameter in chosen])
    kept = matrix[np.ix_(rows, rows)] * np.outer(factors, factors)
    drawn = None if samples is None else samples[:, rows] * factors
    return Covariance(tuple(parameter.key for parameter in chosen), (kept + kept.T) / 2, drawn)


def _root(covariance: Array) -> Array:
    """The symmetric root of the correlations times the errors (k, k); unlike eigenvectors it is unique."""
    errors = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(errors, errors))
    root: Array = errors[:, None] * ((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
    return np.ascontiguousarray(root)
