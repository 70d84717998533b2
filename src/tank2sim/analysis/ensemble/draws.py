"""From what a card says of its errors to the draws of an ensemble."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.influence.parameters import (
    CardParameter,
    card_parameters,
    standard_errors_in_words,
    study_model,
)
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.covariance import Covariance, read_covariance
from tank2sim.simulation.ensemble import Draws

Array = NDArray[np.float64]


def draws_of(card: ManoeuvringCard, seed: int) -> tuple[Draws, list[str]]:
    """The draws of a card, and what is to be told of them.

    Numbers in the card's covariance vary together as it says; all others are independent, with their standard errors.

    Raises
    ------
    InputError
        The covariance to which the card refers is at fault.
    """
    known = read_covariance(card)
    parameters = card_parameters(card, study_model(card))
    places = {one.key: place for place, one in enumerate(parameters)}
    own = np.array([one.standard_error for one in parameters])
    covariance = np.diag(own**2)
    told: list[str] = []
    together: set[str] = set()
    if known is not None:
        names = [name for name in known.names if name in places]
        rows = [places[name] for name in names]
        here = [known.names.index(name) for name in names]
        factors = np.array([parameters[row].factor for row in rows])
        covariance[np.ix_(rows, rows)] = known.matrix[np.ix_(here, here)] / np.outer(factors, factors)
        together = set(names)
        told.append(f"{len(names)} numbers vary together, as the covariance beside the card says")
    alone = [replace(one, assumed=one.assumed and one.key not in together) for one in parameters]
    told += standard_errors_in_words([one for one in alone if one.key not in together])
    uncertain = np.flatnonzero(np.diag(covariance) > 0)
    chosen = [parameters[place] for place in uncertain]
    bounds = [one.bounds for one in chosen]
    draws = Draws(
        names=tuple(one.name for one in chosen),
        mean=np.array([one.value for one in chosen]),
        root=_root(covariance[np.ix_(uncertain, uncertain)]),
        lowest=np.array([-np.inf if low is None else low for low, _ in bounds]),
        highest=np.array([np.inf if high is None else high for _, high in bounds]),
        seed=seed,
    )
    return draws, told


def in_file(card: ManoeuvringCard, names: Sequence[str], matrix: Array) -> Covariance:
    """A covariance of parameters of the model as the card's file has them; what is not on the card is left out."""
    found = {one.name: one for one in card_parameters(card, study_model(card))}
    rows = [place for place, name in enumerate(names) if name in found]
    chosen: list[CardParameter] = [found[names[place]] for place in rows]
    factors = np.array([one.factor for one in chosen])
    kept = matrix[np.ix_(rows, rows)] * np.outer(factors, factors)
    return Covariance(tuple(one.key for one in chosen), (kept + kept.T) / 2)


def _root(covariance: Array) -> Array:
    """A root of a covariance (k, k), by the eigenvectors of its correlations: numbers differ by orders of magnitude."""
    errors = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(errors, errors))
    root: Array = errors[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return np.ascontiguousarray(root)
