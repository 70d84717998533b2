"""The wheelhouse poster and the pilot card of a ship (IMO A.601(15)), as results."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.analysis.validation.bridge_data import ORDERS_AHEAD, Bridge, bridge_of
from tank2sim.analysis.validation.comparison import differences_of_size
from tank2sim.answer.parts import Table
from tank2sim.api.result import OldResult, charts_of
from tank2sim.api.ship import Ship, as_ship
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.files import plain_json

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

ORDER_OPTION = "--order"
LONGEST_ORDER, MORE_ORDERS = 24, 3
"""Characters of an order's name, and orders in addition to the form's. Project choice: one sheet has room for them."""

_ON_FORM = {order.casefold() for order in ORDERS_AHEAD}


class BridgeResult(OldResult):
    """Circles, stops, speeds by revolutions and zigzags of a ship on a sheet of paper; what is not known is blank.

    Parameters
    ----------
    bridge : Bridge
        Of the ship, or of its loaded condition.
    ballast : Bridge, optional
        Of its ballast condition.
    notices : tuple of str
        About the two cards.
    """

    def __init__(self, bridge: Bridge, ballast: Bridge | None = None, notices: tuple[str, ...] = ()) -> None:
        self.bridge, self.ballast = bridge, ballast
        missing = (
            ()
            if bridge.card.propulsion
            else ("the card has no [propulsion]: stops and speeds by revolutions are blank",)
        )
        self.notices = tuple(
            dict.fromkeys((*notices, *bridge.notices, *(ballast.notices if ballast else ()), *missing))
        )

    @abstractmethod
    def _sheet(self) -> str:
        """The sheet as HTML."""

    @property
    def blanks(self) -> int:
        """Blanks that are to be filled in by hand."""
        return self._html.count('title="not known') + self.beyond_card

    @property
    def beyond_card(self) -> int:
        """Those of the blanks whose figures are outside the range of the card; they are hatched."""
        return self._html.count('title="outside')

    @property
    def telegraph(self) -> pd.DataFrame:
        """Orders of the engine telegraph ahead: revolutions (rpm) and steady speed (m/s), nan where it is not known."""
        import pandas as pd

        return pd.DataFrame([vars(order) for order in self.bridge.telegraph])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {**self.bridge.as_json(), "ballast": self.ballast.as_json() if self.ballast else None}

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and number of blanks."""
        hatched = self.beyond_card
        outside = f", {hatched} of them hatched: outside the range of the card" if hatched else ""
        return (f"{self.bridge.card.ship.name}: {self.blanks} blanks are to be filled in by hand{outside}",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """None: the sheet has them."""
        return ()

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Turning circles and stops by their titles, the way ahead up."""
        from tank2sim.report.results.motions import from_the_bridge

        return charts_of(from_the_bridge(plain_json(self.content())))

    def page(self) -> str:
        """The sheet: self-contained HTML that prints on one page."""
        return self._html

    @cached_property
    def _html(self) -> str:
        return self._sheet()


class PosterResult(BridgeResult):
    """The wheelhouse poster of a ship (A3, landscape).

    Parameters are those of :class:`BridgeResult`.
    """

    command = "poster"

    def _sheet(self) -> str:
        from tank2sim.report.bridge.pages import poster_page

        return poster_page(self.bridge, self.ballast)


class PilotCardResult(BridgeResult):
    """The pilot card of a ship (A4).

    Parameters are those of :class:`BridgeResult`.
    """

    command = "pilotcard"

    def _sheet(self) -> str:
        from tank2sim.report.bridge.pages import pilot_card_page

        return pilot_card_page(self.bridge, self.ballast)


def bridges_of(
    ship: Ship, ballast: Ship | Card | str | Path | None, orders: Mapping[str, float]
) -> tuple[Bridge, Bridge | None, tuple[str, ...]]:
    """Data of a sheet in both conditions, and notices about their cards. Raises as :meth:`.Ship.poster`.

    Parameters
    ----------
    ship, ballast, orders
        As of :meth:`.Ship.poster`.
    """
    check_orders(orders)
    loaded = ship.manoeuvring()
    if ballast is None:
        return bridge_of(loaded, orders), None, ()
    light = as_ship(ballast).manoeuvring()
    notices = _check_ballast(loaded, light)
    return bridge_of(loaded, orders), bridge_of(light, orders), notices


def check_orders(orders: Mapping[str, float]) -> None:
    """Refuse orders of the engine telegraph that the sheets cannot show.

    Raises
    ------
    InputError
        Revolutions are not positive, an order is given twice or is one astern, or there is no room for it.
    """
    known: set[str] = set()
    for name, rpm in orders.items():
        problem = ""
        if not name.strip() or not 0 < rpm < math.inf:
            problem = "is not NAME=RPM with positive revolutions"
        elif name.casefold() in known:
            problem = "is given twice"
        elif "astern" in name.casefold():
            problem = "is an order astern: no card states what a ship does astern, and it is filled in by hand"
        elif len(name) > LONGEST_ORDER:
            problem = f"has no room on the form: up to {LONGEST_ORDER} characters have"
        elif len({*known, name.casefold()} - _ON_FORM) > MORE_ORDERS:
            problem = f"has no room on the form: {MORE_ORDERS} orders have in addition to {', '.join(ORDERS_AHEAD)}"
        if problem:
            raise InputError(ORDER_OPTION, f"{name}={rpm:g}", problem, "give, for example, --order 'Half ahead=56'")
        known.add(name.casefold())


def _check_ballast(loaded: ManoeuvringCard, ballast: ManoeuvringCard) -> tuple[str, ...]:
    """Notices of a ballast card next to the loaded one.

    Raises
    ------
    InputError
        It is of a ship of another length or breadth, or its draught is not smaller.
    """
    remedy = "give the card of the same ship in ballast, of the same size"
    if apart := differences_of_size(loaded, ballast):
        raise InputError(ballast.source, "ship", f"is not of the ship of {loaded.source}: {'; '.join(apart)}", remedy)
    deep, light = loaded.ship.draught_m, ballast.ship.draught_m
    if deep is None or light is None:
        return ("--ballast: one of the cards states no draught: whether it is the lighter condition is not known",)
    if light >= deep:
        problem = f"{light:g} m is not smaller than the {deep:g} m of the loaded card"
        raise InputError(ballast.source, "ship.draught_m", problem, remedy)
    return ()
