"""The commands of the sheets of the bridge, ``tank2sim poster`` and ``tank2sim pilotcard``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import click

from tank2sim.api.bridge import ORDER_OPTION, BridgeResult
from tank2sim.api.ship import load
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import Command, OutputFile, plot_option, set_option
from tank2sim.errors import InputError
from tank2sim.files import PAGE


def bridge_options(command: Command) -> Command:
    """CARD, ``--ballast``, ``--order``, ``--set``, ``-o``, ``--plot`` and ``--json``."""
    page = OutputFile(PAGE, dir_okay=False)
    options = (
        click.argument("card"),
        click.option("--ballast", metavar="CARD", help="Card of the ballast condition; CARD is then the loaded one."),
        click.option(
            ORDER_OPTION,
            "orders",
            multiple=True,
            metavar="NAME=RPM",
            callback=_parsed_orders,
            help="An order of the engine telegraph ahead; repeat.",
        ),
        set_option,
        click.option("-o", "--page", type=page, metavar="FILE.html", required=True, help="The sheet."),
        plot_option,
        json_option,
    )
    for option in reversed(options):
        command = option(command)
    return command


def _parsed_orders(context: click.Context, parameter: click.Parameter, given: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in given:
        name, _, number = (part.strip() for part in text.partition("="))
        try:
            rpm = float(number)
        except ValueError:
            rpm = math.nan
        problem = "is not NAME=RPM" if not math.isfinite(rpm) else "is given twice" if name in found else ""
        if problem:
            raise InputError(ORDER_OPTION, text, problem, "give, for example, --order 'Half ahead=56'")
        found[name] = rpm
    return found


def sheet_command(name: str, sheet: Callable[..., BridgeResult], text: str) -> click.Command:
    """Return the command that draws a sheet with a method of a ship; `text` is its help."""

    @click.command(name, help=text)
    @bridge_options
    def command(
        card: str,
        ballast: str | None,
        orders: dict[str, float],
        values: dict[str, object],
        page: Path,
        plot: Path | None,
        json_file: Path | None,
    ) -> None:
        result = sheet(load(card, values), ballast=ballast, orders=orders)
        inputs = [bridge.card.source for bridge in (result.bridge, result.ballast) if bridge]
        write_result(result, inputs, json_file=json_file, page=page, plot=plot)
        show_result(result)

    return command


def manoeuvring(card: Card, what: str) -> ManoeuvringCard:
    """The card, if it is of a ship that manoeuvres.

    Raises
    ------
    InputError
        It is not.
    """
    if not isinstance(card, ManoeuvringCard):
        raise card.fault(
            "model.kind", f"is not that of a ship that {what}", "give a card of kind linear, abkowitz or mmg"
        )
    return card
