"""``tank2sim ships``: the bundled cards."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.bundled import bundled_cards
from tank2sim.cards import read_card
from tank2sim.cli.console import json_option, json_text, screen, show_table
from tank2sim.files import write_whole


@click.command("ships")
@json_option
def command(json_file: Path | None) -> None:
    """List the bundled ships, by the names that CARD takes."""
    cards = {name: read_card(path) for name, path in bundled_cards().items()}
    if json_file:
        listed = [
            {
                "name": name,
                "ship": card.ship.name,
                "kind": card.model.kind,
                "source": card.ship.source,
                "card": card.source,
            }
            for name, card in cards.items()
        ]
        write_whole(json_file, json_text({"ships": listed}))
    rows = [[name, card.ship.name, card.model.kind, card.ship.length_m] for name, card in cards.items()]
    show_table("Bundled ships", ["CARD", "ship", "model", "length (m)"], rows)
    for name, card in cards.items():
        screen.print(f"{name}: {card.ship.source}", soft_wrap=True, markup=False)
