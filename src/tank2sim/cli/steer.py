"""``tank2sim steer``: a page that carries the ship, to be steered in a browser."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, set_option
from tank2sim.files import PAGE
from tank2sim.ship import load

DEFAULT_SHIP = "esso-osaka-ship"
"""Bundled ship of the page without a card: full scale, with an engine that goes astern, and with a covariance."""


@click.command("steer")
@click.argument("card", default=DEFAULT_SHIP)
@click.option(
    "-o",
    "--page",
    required=True,
    type=OutputFile(PAGE, dir_okay=False),
    metavar="PAGE.html",
    help="The page.",
)
@click.option(
    "--ghost",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="TRIAL",
    help="A measured trial next to the ship.",
)
@click.option("--scenario", metavar="FILE", help="Waters as GeoJSON, or 'channel' or 'basin'.")
@click.option("--view-3d", is_flag=True, help="Also the view from the bridge, 0.6 MB.")
@set_option
@json_option
def command(
    card: str,
    page: Path,
    ghost: Path | None,
    scenario: str | None,
    view_3d: bool,
    values: dict[str, object],
    json_file: Path | None,
) -> None:
    """Write a page in which CARD (a file, or the name of a bundled ship; the tanker Esso Osaka without) can be steered.

    It needs no network.
    """
    from tank2sim.apps.steering.command import make_steering_page

    ship = load(card, values)
    result = make_steering_page(ship, ghost, scenario, view_3d, report=screen.print)
    inputs = [Path(given) for given in (ghost, scenario) if given and Path(given).is_file()]
    write_result(result, [Path(ship.card.source), *inputs], json_file=json_file, page=page)
    show_result(result)
