"""Joint errors of a card's numbers: the covariance of its parameters in the model's units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.influence.parameters import CardParameter, standard_errors_in_words
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.covariance import read_covariance


@dataclass(frozen=True, eq=False)
class JointErrors:
    """Errors of parameters.

    Parameters
    ----------
    parameters : tuple of CardParameter
    covariance : array (k, k)
        In the units of the parameters' values.
    together : frozenset of str
        Keys of the parameters in the card's covariance; all others are independent. Empty without a covariance.
    """

    parameters: tuple[CardParameter, ...]
    covariance: Array
    together: frozenset[str]

    @property
    def in_words(self) -> list[str]:
        """Notices on the standard errors."""
        words = standard_errors_in_words(self.parameters, self.together)
        return [self.together_in_words, *words] if self.together else words

    @property
    def together_in_words(self) -> str:
        """Text on the correlated parameters."""
        return f"errors of {len(self.together)} numbers go together, as the covariance next to the card says"


def joint_errors(card: ManoeuvringCard, parameters: Sequence[CardParameter]) -> JointErrors:
    """The errors of parameters of a card: correlated if in its covariance, else independent.

    Raises
    ------
    InputError
        The covariance to which the card refers has an error.
    """
    known = read_covariance(card)
    standard_errors = np.array([parameter.standard_error for parameter in parameters])
    covariance = np.diag(standard_errors**2)
    if known is None:
        return JointErrors(tuple(parameters), covariance, frozenset())
    places = {parameter.key: place for place, parameter in enumerate(parameters)}
    names = [name for name in known.names if name in places]
    rows = [places[name] for name in names]
    columns = [known.names.index(name) for name in names]
    factors = np.array([parameters[row].factor for row in rows])
    covariance[np.ix_(rows, rows)] = known.matrix[np.ix_(columns, columns)] / np.outer(factors, factors)
    return JointErrors(tuple(parameters), covariance, frozenset(names))
