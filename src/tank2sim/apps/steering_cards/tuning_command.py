"""Hull and rudder of a ship scaled until its steady turns meet two points."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.errors import ArgumentError
from tank2sim.files import CARD
from tank2sim.notices import Notice

if TYPE_CHECKING:
    from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
    from tank2sim.apps.steering_cards.two_point_tuning import TwoPointTuning, WantedTurn
    from tank2sim.cards import Card, ManoeuvringCard
    from tank2sim.dynamics.vessel import Vessel

_REMEDY = "give two, as 61@35 47@15 (deg/min at deg of rudder) or 424m@20 (radius in m)"

_POINT = re.compile(r"(?P<value>[\d.]+)(?P<metre>m?)@(?P<rudder>[+-]?[\d.]+)")


@verb(
    "hull and rudder scaled until the steady turns meet two points",
    Output("-o", CARD, "Write the tuned card.", lambda result, path: result.card.files(path), "CARD.toml"),
    name="influence.through",
    options={"points": "--through"},
    results=("tank2sim.apps.steering_cards.tuning_result:TurnTuningResult",),
    charts=False,
)
def tune_ship_through(ship: Vessel, points: Sequence[str]) -> TurnTuningResult:
    """Scale the hull's moments and the rudder until the steady turns meet two points of the steering diagram.

    Parameters
    ----------
    ship : Vessel
    points : sequence of str
        Scale the hull's moments and the rudder until the steady turns meet these two points, RATE@RUDDER: the yaw rate
        in deg/min, without a sign, and the rudder in deg, positive to starboard (``61@35``; ``20@-3`` is 20 deg/min to
        port at 3 deg to port; ``20@0`` of an unstable ship is to starboard), or a radius, ``424m@20``.

    Raises
    ------
    InputError
        A point cannot be read, or no factors between 1/5 and 5 meet both.
    """
    from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
    from tank2sim.apps.steering_cards.two_point_tuning import TwoPointStudy, levers_of_ship, tune_to_two_points

    if len(points) != 2:
        raise ArgumentError("points", "", f"has {len(points)} point{'s' * (len(points) != 1)}", _REMEDY)
    first, second = points
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
) -> tuple[Card, tuple[Notice, ...]]:
    """The card with the scaled derivatives, whose relative standard errors stay, and notices."""
    from tank2sim.cards.card import MmgCard
    from tank2sim.cards.covariance_reading import derived_card
    from tank2sim.cards.reading import revised

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

    A yaw rate is to the side of the rudder, and to starboard with the rudder amidships.

    Raises
    ------
    InputError
        It cannot be read.
    """
    from tank2sim.apps.steering_cards.two_point_tuning import WantedTurn

    found = _POINT.fullmatch(text.strip())
    try:
        value, rudder = (float(found[key]) for key in ("value", "rudder")) if found else (math.nan, math.nan)
    except ValueError:
        value = rudder = math.nan
    if not found or not value > 0 or not abs(rudder) < 90:
        raise ArgumentError("points", text, "is not a point", _REMEDY)
    angle = math.radians(rudder)
    if found["metre"]:
        return WantedTurn(angle, radius_m=value)
    return WantedTurn(angle, math.copysign(math.radians(value) / 60, angle))
