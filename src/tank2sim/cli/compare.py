"""``tank2sim compare``: cards of one ship side by side, by coefficients and by trajectories."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.validation.standard_trials import MEMBERS
from tank2sim.api.bounds import SmallEnsemble
from tank2sim.api.comparison import compare
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import number, page_option, plot_folder_option


@click.command("compare")
@click.argument("cards", nargs=-1, required=True, metavar="CARD CARD ...")
@click.option(
    "--members",
    type=number(SmallEnsemble),
    default=MEMBERS,
    show_default=True,
    help="Ships drawn within the errors of each card for the deviations of figures; 0 for none.",
)
@page_option("-o")
@plot_folder_option
@json_option
def command(
    cards: tuple[str, ...], members: int, page: Path | None, plots: Path | None, json_file: Path | None
) -> None:
    """Compare cards of one ship; the first is the reference (captive, trial, estimate: in any order)."""
    result = compare(cards, members=members)
    write_result(result, [ship.card.source for ship in result.ships], json_file=json_file, page=page, plots=plots)
    show_result(result)
