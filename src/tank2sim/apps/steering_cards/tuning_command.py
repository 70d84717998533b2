"""Hull and rudder of a ship scaled until its steady turns meet two points."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
from tank2sim.apps.steering_cards.two_point_tuning import (
    TwoPointStudy,
    TwoPointTuning,
    WantedTurn,
    levers_of_ship,
    tune_to_two_points,
)
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.cards.card import MmgCard
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.cards.reading import revised
from tank2sim.errors import InputError

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel

THROUGH_OPTION = "--through"
THROUGH_REMEDY = "give two, as --through 61@35 47@15 (deg/min at deg of rudder) or 424m@20 (radius in m)"

_POINT = re.compile(r"(?P<value>[\d.]+)(?P<metre>m?)@(?P<rudder>[+-]?[\d.]+)")


def tune_ship_through(ship: Vessel, first: str, second: str) -> TurnTuningResult:
    """Scale hull and rudder. Raises as :meth:`.Ship.tune_through`.

    Parameters
    ----------
    ship, first, second
        As of :meth:`.Ship.tune_through`.
    """
    card = ship.manoeuvring()
    levers = levers_of_ship(card, ship.model)
    tuning = tune_to_two_points(ship.model, levers, parse_point(first), parse_point(second))
    scaled, notices = _scaled_card(card, tuning, (first, second))
    study = TwoPointStudy(
        **vars(tuning),
        ship=ship.name,
        points=(first, second),
        notices=tuple(dict.fromkeys([*ship.model.notices, *notices])),
    )
    return TurnTuningResult(study, ship, scaled)


def _scaled_card(
    card: ManoeuvringCard, tuning: TwoPointTuning, points: tuple[str, str]
) -> tuple[Card, tuple[str, ...]]:
    """The card with the scaled derivatives, whose standard errors keep their share, and notices."""
    changed: dict[str, tuple[float, float]] = {}
    others: dict[str, object] = {}
    for place, value in tuning.parameters.items():
        if isinstance(card, MmgCard) and (key := place.removeprefix("mmg.")) in card.interaction_places():
            others[card.interaction_places()[key]] = value
            continue
        name = place.removeprefix("derivatives.")
        if old := card.derivatives.get(name, 0.0):
            changed[name] = (value, abs(value / old) * card.standard_error(name))
    how = (
        f"hull and rudder scaled by {tuning.hull_factor:.5g} and {tuning.rudder_factor:.5g} to turn through "
        f"{' '.join(points)}"
    )
    source = {"ship.source": f"{card.ship.source}; {how}", **others}
    text = revised(card, changed, source, comment="scaled to two turns").text
    return derived_card(card, text, "the tuned card")


def parse_point(text: str) -> WantedTurn:
    """A point of the steering diagram: ``61@35`` (deg/min at deg of rudder) or ``424m@20`` (a radius).

    A yaw rate is to the side of the rudder; with the rudder amidships it is to starboard.

    Raises
    ------
    InputError
        It cannot be read.
    """
    found = _POINT.fullmatch(text.strip())
    try:
        value, rudder = (float(found[key]) for key in ("value", "rudder")) if found else (math.nan, math.nan)
    except ValueError:
        value = rudder = math.nan
    if not found or not value > 0 or not abs(rudder) < 90:
        raise InputError(THROUGH_OPTION, text, "is not a point", THROUGH_REMEDY)
    angle = math.radians(rudder)
    if found["metre"]:
        return WantedTurn(angle, radius_m=value)
    return WantedTurn(angle, math.copysign(math.radians(value) / 60, angle))
