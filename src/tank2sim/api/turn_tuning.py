"""Hull and rudder of a ship scaled until its steady turns meet two points, as a result with its card."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning, WantedTurn, levers_of_ship, tune_to_two_points
from tank2sim.answer.parts import Table
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import Card
from tank2sim.cards.card import MmgCard
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.cards.reading import revised
from tank2sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

THROUGH_OPTION = "--through"
THROUGH_REMEDY = "give two, as --through 61@35 47@15 (deg/min at deg of rudder) or 424m@20 (radius in m)"

_POINT = re.compile(r"(?P<value>[\d.]+)(?P<metre>m?)@(?P<rudder>[+-]?[\d.]+)")


class TurnTuningResult(OldResult):
    """A ship whose steady turns go through two points.

    Parameters
    ----------
    ship : Ship
        Before.
    points : tuple of str
        As :meth:`.Ship.tune_through` takes them.
    tuning : TwoPointTuning
        SI and radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").tune_through("35@35", "1400m@3")
    >>> [round(radius) for radius in found.turns["radius_after_m"]][1]
    1400
    """

    command = "influence"

    def __init__(self, ship: Ship, points: tuple[str, str], tuning: TwoPointTuning) -> None:
        self.ship, self.points, self.tuning = ship, points, tuning
        self.notices = tuple(dict.fromkeys([*ship.model.notices, *self._derived[1]]))

    @property
    def hull_factor(self) -> float:
        """The static moment is divided by it, the damping multiplied: above 1 the ship is steadier."""
        return self.tuning.hull

    @property
    def rudder_factor(self) -> float:
        """All terms of the rudder are multiplied by it."""
        return self.tuning.rudder

    @property
    def card(self) -> Card:
        """The scaled card, with what of the covariance still holds; ``card.save("tuned.toml")`` writes it."""
        return self._derived[0]

    @property
    def tuned_ship(self) -> Ship:
        """The ship of the scaled card."""
        return Ship(self.card)

    @property
    def turns(self) -> pd.DataFrame:
        """Both turns: rudder (deg), yaw rate (deg/min) and radius (m) before and after; + to starboard."""
        import pandas as pd

        columns = ["rudder_deg", "rate_before_degpmin", "rate_after_degpmin", "radius_before_m", "radius_after_m"]
        return pd.DataFrame(turn_rows(self.tuning), columns=columns)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {**self.tuning.as_json(), "notices": self.notices}

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship, and whether it has become stable or unstable on a straight course."""
        return self.ship.name, *stability_change(self.tuning)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Both turns before and after."""
        return (turn_table(self.tuning),)

    @cached_property
    def _derived(self) -> tuple[Card, tuple[str, ...]]:
        """The card with the scaled derivatives, whose standard errors keep their share."""
        card, tuning = self.ship.manoeuvring(), self.tuning
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
            f"hull and rudder scaled by {tuning.hull:.5g} and {tuning.rudder:.5g} to turn through "
            f"{' '.join(self.points)}"
        )
        source = {"ship.source": f"{card.ship.source}; {how}", **others}
        text = revised(card, changed, source, comment="scaled to two turns").text
        return derived_card(card, text, "the tuned card")


def tune_ship_through(ship: Ship, first: str, second: str) -> TurnTuningResult:
    """Scale hull and rudder. Raises as :meth:`.Ship.tune_through`.

    Parameters
    ----------
    ship, first, second
        As of :meth:`.Ship.tune_through`.
    """
    levers = levers_of_ship(ship.manoeuvring(), ship.model)
    return TurnTuningResult(
        ship, (first, second), tune_to_two_points(ship.model, levers, parse_point(first), parse_point(second))
    )


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


def turn_rows(tuning: TwoPointTuning) -> list[list[float]]:
    """Of both turns: rudder (deg), yaw rate before and after (deg/min), radius before and after (m)."""
    return [
        [
            math.degrees(after.rudder_rad),
            *(turn.as_json()[key] for key in ("yaw_rate_degpmin", "radius_m") for turn in (before, after)),
        ]
        for before, after in zip(tuning.before, tuning.after, strict=True)
    ]


def turn_table(tuning: TwoPointTuning) -> Table:
    """The factors, and both turns before and after."""
    title = f"Two points met (+ to starboard): hull factor {tuning.hull:.4g}, rudder factor {tuning.rudder:.4g}"
    columns = ("rudder (deg)", "rate before (deg/min)", "rate after", "radius before (m)", "radius after")
    return screen_table(title, columns, turn_rows(tuning))


def stability_change(tuning: TwoPointTuning) -> tuple[str, ...]:
    """A sentence where scaling made the ship stable or unstable on a straight course."""
    if tuning.stable_before == tuning.stable_after:
        return ()
    return (
        f"With these factors the ship becomes {'stable' if tuning.stable_after else 'unstable'} on a straight course",
    )
