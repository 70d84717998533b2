"""Comparison of the models of a steering card."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.quantities import SlantAngle

if TYPE_CHECKING:
    from tank2sim.apps.steering_cards.result import SteeringModelsResult


def _is_steering_card(name: str) -> bool:
    from tank2sim.apps.steering_cards.card import find_steering_card

    return find_steering_card(name) is not None


@verb(
    "the models of a steering card",
    name="influence.steering_card",
    takes=_is_steering_card,
    results=("tank2sim.apps.steering_cards.result:SteeringModelsResult",),
)
def steering_models(card: str | Path, rudder_deg: SlantAngle | None = None) -> SteeringModelsResult:
    """Compare the models of a steering card.

    Parameters
    ----------
    card : str or path
        File, or name of a bundled steering card (``poznyakov-yudin``).
    rudder_deg : float, optional
        Rudder of influence coefficients and turning circle, deg; by default as on the card, else 20.

    Raises
    ------
    InputError
        It is not a steering card, no model of it is complete, or a model has no steady turn at a rudder of Table 1.
    """
    from tank2sim.apps.steering_cards.card import read_steering_card
    from tank2sim.apps.steering_cards.comparison import compare_steering_models
    from tank2sim.apps.steering_cards.result import SteeringModelsResult

    read = read_steering_card(card)
    return SteeringModelsResult(compare_steering_models(read, rudder_deg), read)
