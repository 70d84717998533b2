"""Sizes that scale with the ship: the same values for a model and its ship, by Froude's law.

A search for a missing effect begins at values of the size in which the effect is common. That size is stated without
dimension, and a card gives it its dimension: lengths by L, speeds by u0, times by L/u0 (a *passage*, in which the ship
covers its own length), rates by u0/L.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from tank2sim.cards.card import SteeredCard

_Sizes = Callable[[SteeredCard], tuple[float, ...]]


def first(sizes: _Sizes) -> Callable[[SteeredCard], float]:
    """The first of `sizes`, as a default of a parameter."""
    return lambda card: sizes(card)[0]


DIRECTION_SIGNS = tuple(math.radians(degrees) for degrees in range(-135, 181, 45))
"""Every 45 deg, rad: the nearest is within the half wave in which a search downhill finds any direction."""


def lengths(*shares: float) -> _Sizes:
    """Lengths, m, as shares of L."""
    return lambda card: tuple(share * card.ship.length_m for share in shares)


def speeds(*shares: float) -> _Sizes:
    """Speeds, m/s, as shares of u0."""
    return lambda card: tuple(share * card.model.speed_mps for share in shares)


def wave_speeds(*shares: float) -> _Sizes:
    """Speeds, m/s, as shares of sqrt(g L): of what does not go with the ship's own speed, as wind."""
    return lambda card: tuple(share * math.sqrt(card.environment.gravity_mps2 * card.ship.length_m) for share in shares)


def time_scale_passages(*shares: float) -> _Sizes:
    """Times, s, as shares of L/u0."""
    return lambda card: tuple(share * card.ship.length_m / card.model.speed_mps for share in shares)


def rates(*angles: float) -> _Sizes:
    """Rates, rad/s, by the angle (rad) in a time of L/u0."""
    return lambda card: tuple(angle * card.model.speed_mps / card.ship.length_m for angle in angles)
