"""The card of a craft with what was estimated."""

from __future__ import annotations

from tank2sim.cards.card import CraftCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.cards.small_craft import craft_scale, craft_scales
from tank2sim.dynamics.small_craft import THRUSTER_PARAMETERS
from tank2sim.identification.craft.fit import CraftFit
from tank2sim.identification.craft.problem import twins

_KEYS = {part: key for key, part in THRUSTER_PARAMETERS.items()}


def identified_craft(card: CraftCard, fit: CraftFit) -> CraftCard:
    """The card with the estimates and their standard errors, in the scaling of its own text.

    Parameters
    ----------
    card : CraftCard
        That the problem was made of; numbers that were not estimated stay.
    fit : CraftFit
    """
    changes: dict[str, object] = {}
    scales = craft_scales(card)
    shared = twins(card)
    estimates = zip(fit.problem.free, fit.estimate.values, fit.estimate.standard_errors, strict=True)
    for name, value, error in estimates:
        first, *rest = name.split(".")
        if first == "derivatives":
            unit = craft_scale(rest[0], scales) if card.model.scaling == "prime" else 1.0
            names = ["Yrdot", "Nvdot"] if rest[0] == "Yrdot" and "derivatives.Nvdot" not in fit.problem.free else rest
            for term in names:
                changes[f"derivatives.{term}"] = float(value / unit)
                changes[f"uncertainty.{term}"] = float(error / abs(unit))
            continue
        for number, thruster in enumerate(card.thrusters):
            twin = thruster.name in shared and rest[0] == card.thrusters[0].name
            if thruster.name == rest[0] or twin:
                key = _KEYS[rest[1]]
                changes[f"thrusters.{number}.{key}"] = max(0.0, float(value))
                changes[f"thrusters.{number}.uncertainty.{key}"] = float(error)
    found = parse_card(changed_text(card.text, card.source, changes, comment="identified"), card.source)
    assert isinstance(found, CraftCard)
    return found
