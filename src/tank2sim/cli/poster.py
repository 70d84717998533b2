"""``tank2sim poster``: the wheelhouse poster of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.ship import load
from tank2sim.cli.bridge import bridge_options, show_sheet


@click.command("poster")
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
    """Draw the wheelhouse poster (IMO A.601(15), A3) of CARD; what the card does not state stays blank."""
    show_sheet(load(card, values).poster(ballast=ballast, orders=orders), page, plot, json_file)
