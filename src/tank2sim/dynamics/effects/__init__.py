"""Physical effects on top of the polynomial: each a function from model to model."""

from tank2sim.dynamics.effects.effect import Effect, EffectParameter
from tank2sim.dynamics.effects.surroundings import CURRENT

EFFECTS: dict[str, Effect] = {effect.name: effect for effect in (CURRENT,)}
"""All effects by the name that cards use."""

__all__ = ["EFFECTS", "Effect", "EffectParameter"]
