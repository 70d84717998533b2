"""Comparison of the models of a steering card."""

from __future__ import annotations

from pathlib import Path

from tank2sim.apps.steering_cards.card import read_steering_card
from tank2sim.apps.steering_cards.comparison import compare_steering_models
from tank2sim.apps.steering_cards.result import SteeringModelsResult
from tank2sim.arguments import AngleArgument, checked


@checked
def steering_models(card: str | Path, rudder_deg: AngleArgument | None = None) -> SteeringModelsResult:
    """Compare the models of a steering card.

    Parameters
    ----------
    card : str or path
        File, or name of a bundled steering card (``poznyakov-yudin``).
    rudder_deg : float, optional
        Rudder of influence and turning circle; by default that of the card, else 20.

    Raises
    ------
    InputError
        It is not a steering card, no model of it is complete, or a model has no steady turn at a rudder of Table 1.
    """
    found = read_steering_card(card)
    return SteeringModelsResult(compare_steering_models(found, rudder_deg), found)
