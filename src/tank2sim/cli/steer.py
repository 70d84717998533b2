"""``tank2sim steer``: a page that carries the ship, to be steered in a browser."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.steering_card import find_steering_card
from tank2sim.cli.console import screen, show_notices
from tank2sim.cli.overrides import parse_changes
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.files import write_whole
from tank2sim.identification.trials.problem.prepare_trials import measured


@click.command("steer")
@click.argument("card")
@click.option(
    "-o",
    "--page",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="PAGE.html",
    help="The page.",
)
@click.option(
    "--ghost",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="TRIAL",
    help="A measured trial next to the ship.",
)
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
def command(card: str, page: Path, ghost: Path | None, settings: tuple[str, ...]) -> None:
    """Write a page in which CARD (a file, or the name of a bundled ship) can be steered; it needs no network."""
    # Drawing is asked for seldom, and its libraries are slow to load.
    from tank2sim.native.cross import has_compiled
    from tank2sim.report.steering.ghost import ghost_of
    from tank2sim.report.steering.page import steering_page
    from tank2sim.report.steering.ship import NO_WASM_COMPILER, WEB, has_compiler, ship_following_angle, ship_in_page

    _refuse_steering_card(card)
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    if not isinstance(ship, ManoeuvringCard):
        raise InputError(ship.source, "", "has no rudder", "only a ship (kind linear or abkowitz) can be steered")
    trial = measured([ghost], ship) if ghost else None
    beside = ghost_of(trial.trials[0], model) if trial else None
    if beside and beside.by_angle:
        model = ship_following_angle(model)
    library = None
    if has_compiler():
        if not has_compiled(WEB):
            screen.print("the compiler makes its own library first, once: about a minute")
        library = ship_in_page(model)
    messages = [*(trial.notices if trial else ()), *(beside.notices if beside else ()), *model.notices]
    text = steering_page(model, library, beside, messages)
    write_whole(page, text, inputs=[Path(ship.source), *([ghost] if ghost else [])])
    screen.print(f"{escape(ship.ship.name)}: {escape(str(page))}, {len(text.encode()) / 1e3:.0f} kB", soft_wrap=True)
    show_notices([*([] if library else [NO_WASM_COMPILER]), *messages])


def _refuse_steering_card(name: str) -> None:
    """Refuse a card of steering equations, which tells of no ship that moves over the water."""
    if find_steering_card(name):
        problem = "is a steering card (equations of drift and turning), not a ship card"
        remedy = "give a ship card (kind linear or abkowitz); tank2sim influence shows a steering card"
        raise InputError(name, "", problem, remedy)
