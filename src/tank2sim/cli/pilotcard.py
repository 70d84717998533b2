"""``tank2sim pilotcard``: the pilot card of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.ship import load
from tank2sim.cli.bridge import bridge_options, show_sheet


@click.command("pilotcard")
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
    """Draw the pilot card (IMO A.601(15), A4) of CARD; what the card does not state stays blank."""
    show_sheet(load(card, values).pilot_card(ballast=ballast, orders=orders), page, plot, json_file)
