"""What ``tank2sim poster`` and ``tank2sim pilotcard`` share: options, and the way from cards to a page."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from tank2sim.analysis.validation.bridge_data import ORDERS_AHEAD, Bridge, bridge_of
from tank2sim.analysis.validation.comparison import differences_of_size
from tank2sim.cards import Card, ManoeuvringCard, read_card
from tank2sim.cli.console import json_option, json_text, screen, show_notices
from tank2sim.cli.overrides import parse_changes
from tank2sim.errors import InputError
from tank2sim.files import write_together

LONGEST_ORDER, MORE_ORDERS = 24, 3
"""Characters of an order's name, and orders that are not on the form, that one sheet has room for."""

_ON_FORM = {one.casefold() for one in ORDERS_AHEAD}

Draw = Callable[[Bridge, Bridge | None], str]


def bridge_options(command: Callable[..., None]) -> Callable[..., None]:
    """CARD, ``--ballast``, ``--order``, ``--set``, ``-o`` and ``--json``."""
    several: dict[str, Any] = {"multiple": True}
    for add in (
        json_option,
        click.option(
            "-o", "--page", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE.html", required=True
        ),
        click.option(
            "--set", "settings", metavar="KEY=VALUE", help="A value in place of the card's, by dotted key.", **several
        ),
        click.option(
            "--order", "orders", metavar="NAME=RPM", help="An order of the engine telegraph ahead; repeat.", **several
        ),
        click.option("--ballast", metavar="CARD", help="Card of the ballast condition; CARD is then the loaded one."),
        click.argument("card"),
    ):
        command = add(command)
    return command


def manoeuvring(card: Card, what: str) -> ManoeuvringCard:
    """The card, if it is of a ship that manoeuvres.

    Raises
    ------
    InputError
        It is not.
    """
    if not isinstance(card, ManoeuvringCard):
        raise card.fault("model.kind", f"is no ship that {what}", "give a card of kind linear or abkowitz")
    return card


def parse_orders(given: Iterable[str]) -> dict[str, float]:
    """``("Full ahead=70", ...)`` as revolutions (rpm) by order.

    Raises
    ------
    InputError
        One is no NAME=RPM with positive revolutions, is given twice, is of an order astern, or the forms have no room.
    """
    found: dict[str, float] = {}
    for text in given:
        name, _, number = (part.strip() for part in text.partition("="))
        try:
            rpm = float(number)
        except ValueError:
            rpm = math.nan
        problem = ""
        if not name or not 0 < rpm < math.inf:
            problem = "is no NAME=RPM with positive revolutions"
        elif name.casefold() in (one.casefold() for one in found):
            problem = "is given twice"
        elif "astern" in name.casefold():
            problem = "is an order astern: what a ship does astern no card tells, and it is filled in by hand"
        elif len(name) > LONGEST_ORDER:
            problem = f"has no room on the form: up to {LONGEST_ORDER} characters have"
        elif len({one.casefold() for one in (*found, name)} - _ON_FORM) > MORE_ORDERS:
            problem = f"has no room on the form: {MORE_ORDERS} orders have next to {', '.join(ORDERS_AHEAD)}"
        if problem:
            raise InputError("--order", text, problem, "give, for example, --order 'Half ahead=56'")
        found[name] = rpm
    return found


def check_ballast(loaded: ManoeuvringCard, ballast: ManoeuvringCard) -> list[str]:
    """What is to be reported of a ballast card next to the loaded one.

    Raises
    ------
    InputError
        It is of a ship of another length or breadth, or its draught is not smaller.
    """
    remedy = "give the card of the same ship in ballast, as large as it is"
    if apart := differences_of_size(loaded, ballast):
        raise InputError(ballast.source, "ship", f"is not of the ship of {loaded.source}: {'; '.join(apart)}", remedy)
    deep, light = loaded.ship.draught_m, ballast.ship.draught_m
    if deep is None or light is None:
        return ["--ballast: one of the cards tells no draught: whether it is the lighter condition is not known"]
    if light >= deep:
        problem = f"{light:g} m is no smaller than the {deep:g} m of the loaded card"
        raise InputError(ballast.source, "ship.draught_m", problem, remedy)
    return []


def write_bridge(draw: Draw, card: str, options: dict[str, Any]) -> None:
    """Read the cards, run what the page wants, and write it."""
    orders = parse_orders(options["orders"])
    loaded = manoeuvring(read_card(card, parse_changes(options["settings"])), "steers")
    other = manoeuvring(read_card(options["ballast"]), "steers") if options["ballast"] else None
    told = check_ballast(loaded, other) if other else []
    first = bridge_of(loaded, orders)
    second = bridge_of(other, orders) if other else None
    contents: dict[Path, str | bytes] = {options["page"]: draw(first, second)}
    if json_file := options["json_file"]:
        ballast = second.as_json() if second else None
        contents[json_file] = json_text({**first.as_json(), "ballast": ballast})
    inputs = [Path(one.source) for one in (loaded, other) if one]
    write_together(contents, inputs=inputs, outputs=(options["page"], options["json_file"]))
    page = str(contents[options["page"]])
    blanks, hatched = page.count('title="not known'), page.count('title="outside')
    outside = f", {hatched} of them hatched: outside the range of the card" if hatched else ""
    line = (
        f"{escape(loaded.ship.name)}: {options['page']} written; {blanks + hatched} blanks are to be filled in by hand"
    )
    screen.print(line + outside, soft_wrap=True)
    missing = [] if loaded.propulsion else ["the card has no [propulsion]: stops and speeds by revolutions are blank"]
    show_notices([*told, *first.notices, *(second.notices if second else ()), *missing])
