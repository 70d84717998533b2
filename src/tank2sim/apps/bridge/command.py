"""The wheelhouse poster and the pilot card of a ship (IMO A.601(15))."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import named_numbers, verb
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice

if TYPE_CHECKING:
    from tank2sim.apps.bridge.result import PilotCardResult, PosterResult
    from tank2sim.apps.bridge.study import Bridge, BridgeStudy, DataBasis
    from tank2sim.cards import ManoeuvringCard
    from tank2sim.dynamics.vessel import Vessel

LONGEST_ORDER, MORE_ORDERS = 24, 3
"""Characters of an order's name, and orders in addition to the form's. Project choice: one sheet has room for them."""


_read_orders = named_numbers("order", "'Half ahead=56'")


@verb(
    "a wheelhouse poster (A3)",
    page_required=True,
    texts={"order": _read_orders},
    name="poster",
    results=("tank2sim.apps.bridge.result:PosterResult",),
)
def make_poster(
    ship: Vessel,
    *,
    ballast: Vessel | str | Path | None = None,
    order: Mapping[str, float] | None = None,
) -> PosterResult:
    """Draw the wheelhouse poster of a ship (IMO A.601(15), A3); unknown values stay blank.

    Parameters
    ----------
    ship : Vessel
    ballast : Vessel, optional
        The ship in ballast; `ship` is then the loaded condition.
    order : mapping, optional
        Orders of the engine telegraph ahead, with their revolutions in rpm: ``{"Half ahead": 56}``, on the command line
        ``"Half ahead=56"``.

    Raises
    ------
    InputError
        The ship does not manoeuvre, an order cannot be shown, or the ballast card is of another ship.
    """
    from tank2sim.apps.bridge.result import PosterResult

    return PosterResult(*sheet_data(ship, ballast, order or {}))


@verb(
    "a pilot card (A4)",
    page_required=True,
    texts={"order": _read_orders},
    name="pilotcard",
    results=("tank2sim.apps.bridge.result:PilotCardResult",),
)
def make_pilot_card(
    ship: Vessel,
    *,
    ballast: Vessel | str | Path | None = None,
    order: Mapping[str, float] | None = None,
) -> PilotCardResult:
    """Draw the pilot card of a ship (IMO A.601(15), A4); unknown values stay blank.

    Parameters
    ----------
    ship : Vessel
    ballast : Vessel, optional
        The ship in ballast; `ship` is then the loaded condition.
    order : mapping, optional
        Orders of the engine telegraph ahead, with their revolutions in rpm: ``{"Half ahead": 56}``, on the command line
        ``"Half ahead=56"``.

    Raises
    ------
    InputError
        As :func:`make_poster`.
    """
    from tank2sim.apps.bridge.result import PilotCardResult

    return PilotCardResult(*sheet_data(ship, ballast, order or {}))


def sheet_data(
    ship: Vessel,
    ballast: Vessel | str | Path | None,
    orders: Mapping[str, float],
    basis: DataBasis | None = None,
    ballast_basis: DataBasis | None = None,
) -> tuple[BridgeStudy, Bridge, Bridge | None]:
    """Data of a sheet in both conditions, and where they are from."""
    from tank2sim.apps.bridge.study import bridge_of
    from tank2sim.dynamics.vessel import as_vessel

    check_orders(orders)
    loaded = ship.manoeuvring()
    first, second = bridge_of(loaded, orders, basis), None
    notices: tuple[Notice, ...] = ()
    if ballast is not None:
        light = as_vessel(ballast).manoeuvring()
        notices = _check_ballast(loaded, light)
        second = bridge_of(light, orders, ballast_basis)
    text = "the card has no [propulsion]: stops and speeds by revolutions are blank"
    missing = () if loaded.propulsion else (Notice(text),)
    said = dict.fromkeys((*notices, *first.study.notices, *(second.study.notices if second else ()), *missing))
    study = replace(first.study, notices=tuple(said), ballast=second.study if second else None)
    return study, first, second


def check_orders(orders: Mapping[str, float]) -> None:
    """Refuse orders of the engine telegraph that the sheets cannot show.

    Raises
    ------
    InputError
        Revolutions are not positive, an order is given twice or is one astern, or there is no room for it.
    """
    from tank2sim.apps.bridge.study import ORDERS_AHEAD

    on_form = {order.casefold() for order in ORDERS_AHEAD}
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
        elif len({*known, name.casefold()} - on_form) > MORE_ORDERS:
            problem = f"has no room on the form: {MORE_ORDERS} orders have in addition to {', '.join(ORDERS_AHEAD)}"
        if problem:
            raise ArgumentError("order", f"{name}={rpm:g}", problem, "give, for example, 'Half ahead=56'")
        known.add(name.casefold())


def _check_ballast(loaded: ManoeuvringCard, ballast: ManoeuvringCard) -> tuple[Notice, ...]:
    """Notices of a ballast card next to the loaded one.

    Raises
    ------
    InputError
        It is of a ship of another length or breadth, or its draught is not smaller.
    """
    from tank2sim.analysis.validation.comparison import differences_of_size
    from tank2sim.dynamics.effects.loading import mean_draught

    remedy = "give the card of the same ship in ballast, of the same size"
    if apart := differences_of_size(loaded, ballast):
        raise InputError(ballast.source, "ship", f"is not of the ship of {loaded.source}: {'; '.join(apart)}", remedy)
    deep, light = mean_draught(loaded), mean_draught(ballast)
    if deep is None or light is None:
        return (
            Notice("ballast: one of the cards states no draught: whether it is the lighter condition is not known"),
        )
    if light >= deep:
        problem = f"{light:g} m is not smaller than the {deep:g} m of the loaded card"
        raise InputError(ballast.source, "ship.draught_m", problem, remedy)
    return ()
