"""Particulars of the ship that effects need: from the card, or estimates that the model's notices report."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice

BEAMS_IN_LENGTH = 7.0
BEAMS_IN_DRAUGHT = 0.4
"""L/B = 7 and B/T = 2.5 are in the middle of loaded merchant ships (6 to 8, 2 to 3.5): project choices."""

FRONT_IN_BEAMS = 0.6
SIDE_IN_LENGTHS = 0.055
"""Areas above the water over B^2 and L^2, between a loaded tanker's (0.35 and 0.03) and a container ship's
(0.95 and 0.1): project choices."""

DIAMETER_IN_DRAUGHTS = 0.6
"""Diameter of the propeller over the draught, between full tankers (0.45) and container ships (0.75): a
project choice."""

AREA_ERROR = 0.4
"""Standard error of such an area, relative: the distance from the middle to tanker and container ship."""

FULLEST, FINEST = 0.95, 0.3
"""Block coefficients are held within these bounds where mass and an estimated draught disagree (project choice)."""


def _beam(card: SteeredCard) -> float:
    return card.ship.length_m / BEAMS_IN_LENGTH


def _draught(card: SteeredCard) -> float:
    return BEAMS_IN_DRAUGHT * model_particular(card, "beam_m")


def _block(card: SteeredCard) -> float:
    """C_B = m/(rho L B T), with the mass of the card's equations of motion."""
    scales = card.scales
    box = card.ship.length_m * model_particular(card, "beam_m") * model_particular(card, "draught_m")
    return float(min(max(card.rigid_body.mass * scales.mass / (scales.density * box), FINEST), FULLEST))


_ESTIMATES: dict[str, tuple[str, str, str, Callable[[SteeredCard], float]]] = {
    "beam_m": ("beam", "m", "L/7", _beam),
    "draught_m": ("draught", "m", "0.4 of the beam", _draught),
    "block_coefficient": ("block coefficient", "", "from mass, length, beam and draught", _block),
    "projected_area_front_m2": (
        "area above the water seen from ahead",
        "m2",
        f"{FRONT_IN_BEAMS:g} of the beam squared",
        lambda card: FRONT_IN_BEAMS * model_particular(card, "beam_m") ** 2,
    ),
    "projected_area_side_m2": (
        "area above the water seen from the side",
        "m2",
        f"{SIDE_IN_LENGTHS:g} of the length squared",
        lambda card: SIDE_IN_LENGTHS * card.ship.length_m**2,
    ),
    "propeller_diameter_m": (
        "propeller diameter",
        "m",
        f"{DIAMETER_IN_DRAUGHTS:g} of the draught",
        lambda card: DIAMETER_IN_DRAUGHTS * model_particular(card, "draught_m"),
    ),
}


ESTIMABLE = tuple(_ESTIMATES)
"""Particulars that :func:`model_particular` can estimate."""


def model_particular(card: SteeredCard, key: str) -> float:
    """A number of the card's ``[ship]``, or an estimate of it (SI).

    `key`: one of :data:`ESTIMABLE`.
    """
    value = getattr(card.ship, key)
    return float(_ESTIMATES[key][-1](card) if value is None else value)


def estimated_from(key: str) -> str:
    """In a few words, what :func:`model_particular` takes for a number that the card does not state."""
    return f"{_ESTIMATES[key][2]}, typical"


def estimate_notice(card: SteeredCard, key: str) -> Notice:
    """The notice of an effect that takes an estimate for a number that the card does not state."""
    name, unit, *_ = _ESTIMATES[key]
    taken = f"the {name} is taken as {model_particular(card, key):.3g} {unit}".rstrip()
    return Notice(f"the card states no {key}: {taken} ({estimated_from(key)})")


def volume_exponent(block: float) -> float:
    """C_WP/C_B: the displaced volume goes with this power of the draught.

    dV/dT = C_WP L B, with C_WP = (1 + 2 C_B)/3 of usual sections (Schneekluth and Bertram 1998, Ship Design for
    Efficiency and Economy); that C_WP/C_B is the same at all draughts is the usual way to estimate C_B at another one.

    `block`: block coefficient at the card's draught.
    """
    return (1 + 2 * block) / 3 / block


def _at_draught(model: Model, card: SteeredCard, key: str) -> ca.SX | float:
    """A particular at the model's draught ``ship.draught``: the side above the water grows as the draught falls."""
    value = model_particular(card, key)
    if "ship.draught" not in model:
        return value
    draught, own = model.symbol("ship.draught"), model_particular(card, "draught_m")
    by_draught: dict[str, Callable[[], ca.SX]] = {
        "draught_m": lambda: draught,
        "block_coefficient": lambda: value * (draught / own) ** (volume_exponent(value) - 1),
        "projected_area_front_m2": lambda: value + model_particular(card, "beam_m") * (own - draught),
        "projected_area_side_m2": lambda: value + card.ship.length_m * (own - draught),
    }
    return by_draught[key]() if key in by_draught else value


def with_particulars(model: Model, card: SteeredCard, *keys: str) -> tuple[Model, tuple[Any, ...]]:
    """Particulars by their keys (SI), and the model with a notice on each that the card does not state.

    Draught, block coefficient and areas above the water are expressions of ``ship.draught``, where the model has it.
    """
    for key in keys:
        if getattr(card.ship, key) is None and (notice := estimate_notice(card, key)) not in model.notices:
            model = model.extend(notices=[notice])
    return model, tuple(_at_draught(model, card, key) for key in keys)
