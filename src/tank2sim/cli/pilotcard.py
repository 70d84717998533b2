"""``tank2sim pilotcard``: the pilot card of a ship."""

from __future__ import annotations

from typing import Any

import click

from tank2sim.analysis.validation.bridge_data import Bridge
from tank2sim.cli.bridge import bridge_options, write_bridge


@click.command("pilotcard")
@bridge_options
def command(card: str, **options: Any) -> None:
    """Draw the pilot card (IMO A.601(15), A4) of CARD; what the card does not tell stays blank."""
    write_bridge(_draw, card, options)


def _draw(bridge: Bridge, ballast: Bridge | None) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.bridge.pages import pilot_card_page

    return pilot_card_page(bridge, ballast)
