"""What ``tank2sim poster`` and ``tank2sim pilotcard`` share: options, and the way from cards to a page."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from tank2sim.analysis.practice.bridge import Bridge, bridge_of
from tank2sim.cards import Card, ManoeuvringCard, read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.screen import json_option, json_text, screen, show_notices
from tank2sim.errors import InputError
from tank2sim.files import write_together

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
        One is no NAME=RPM with positive revolutions, or is given twice.
    """
    found: dict[str, float] = {}
    for text in given:
        name, _, number = (part.strip() for part in text.partition("="))
        try:
            rpm = float(number)
        except ValueError:
            rpm = math.nan
        if not name or not 0 < rpm < math.inf or name in found:
            problem = "is given twice" if name in found else "is no NAME=RPM with positive revolutions"
            raise InputError("--order", text, problem, "give, for example, --order 'Half ahead=56'")
        found[name] = rpm
    return found


def write_bridge(draw: Draw, card: str, options: dict[str, Any]) -> None:
    """Read the cards, run what the page wants, and write it."""
    orders = parse_orders(options["orders"])
    loaded = manoeuvring(read_card(card, parse_changes(options["settings"])), "steers")
    other = manoeuvring(read_card(options["ballast"]), "steers") if options["ballast"] else None
    first = bridge_of(loaded, orders)
    second = bridge_of(other, orders) if other else None
    contents: dict[Path, str | bytes] = {options["page"]: draw(first, second)}
    if json_file := options["json_file"]:
        ballast = second.as_json() if second else None
        contents[json_file] = json_text({**first.as_json(), "ballast": ballast})
    inputs = [Path(one.source) for one in (loaded, other) if one]
    write_together(contents, inputs=inputs, outputs=(options["page"], options["json_file"]))
    blanks = str(contents[options["page"]]).count('class="blank"')
    told = f"{escape(loaded.ship.name)}: {options['page']} written; {blanks} blanks are to be filled in by hand"
    screen.print(told, soft_wrap=True)
    missing = [] if loaded.propulsion else ["the card has no [propulsion]: stops and speeds by revolutions are blank"]
    show_notices([*first.notices, *(second.notices if second else ()), *missing])
