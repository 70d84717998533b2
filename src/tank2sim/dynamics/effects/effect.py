"""What an effect is: a function from model to model, with what it needs to know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tank2sim.dynamics.model import Model


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Parameters
    ----------
    name : str
        Name with its unit in SI (``direction_rad``; a card may give ``direction_deg``).
    description : str
        What it is, with its sign.
    minimum, maximum : float
        Physical bounds, SI.
    """

    name: str
    description: str
    minimum: float
    maximum: float


@dataclass(frozen=True)
class Effect:
    """A physical effect on top of the polynomial.

    Parameters
    ----------
    name : str
        Name in cards.
    acts_on : str
        ``force``, ``mass``, ``actuator``, ``propulsion``, ``kinematics`` or ``sensor``.
    description : str
        A sentence for people.
    source : str
        Where the equation comes from.
    parameters : tuple
        All are required in a card.
    apply : callable
        ``apply(model, values) -> model``; values in SI by the names of the parameters.
    """

    name: str
    acts_on: str
    description: str
    source: str
    parameters: tuple[EffectParameter, ...]
    apply: Callable[[Model, Mapping[str, float]], Model]
