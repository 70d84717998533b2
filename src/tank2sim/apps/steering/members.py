"""Ships that the measurements cannot exclude: members drawn from the uncertainty of a card, for the steering page."""

from __future__ import annotations

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.cards import SteeredCard
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.ship import mass_fault

PAGE_MEMBERS = 20
"""Ships next to the own one: one in twenty is about as far off as a standard figure's interval of 95 % says, and a
browser steps and draws them 50 times a second (project choice)."""

_TRIES = 10
"""Draws for a member before fewer members are taken; nearly all are usable (project choice)."""

NO_COVARIANCE = "The card has no covariance of its coefficients, so that no ships are drawn from its uncertainty."
"""Text of a page without members."""


def members_of(card: SteeredCard, model: Model, count: int = PAGE_MEMBERS, seed: int = 0) -> list[dict[str, float]]:
    """Parameters of the members by name, in the model's units; none for a card without a covariance.

    They are drawn as in an ensemble (:func:`tank2sim.analysis.ensemble.draws.draws_of`): numbers in the
    covariance together, all others with their own standard errors. What is an input of the model (a current) is set in
    the page instead. A ship without a mass matrix that can be used is left out.

    Raises
    ------
    InputError
        The covariance to which the card refers has an error.

    Examples
    --------
    >>> from tank2sim.cards import read_card
    >>> from tank2sim.dynamics import build
    >>> card = read_card("kvlcc2")
    >>> members = members_of(card, build(card), count=3)
    >>> len(members), len({member["derivatives.Nr"] for member in members})
    (3, 3)
    >>> members_of(read_card("mariner"), build(read_card("mariner")))
    []
    """
    if read_covariance(card) is None:
        return []
    draws, _ = draws_of(card, seed)
    known = model.defaults
    found: list[dict[str, float]] = []
    for number in range(_TRIES * count):
        (row,), _, (trouble,), _ = draws.members(number, 1)
        values = {name: value for name, value in zip(draws.names, row.tolist(), strict=True) if name in known}
        if not trouble and not mass_fault(model, {**known, **values}):
            found.append(values)
        if len(found) == count:
            break
    return found
