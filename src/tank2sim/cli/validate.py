"""``tank2sim validate``: a validation report of a card, against trials where there are any."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.validation.standard_trials import MEMBERS
from tank2sim.analysis.validation.study import REQUIRED
from tank2sim.api.bounds import PositiveArgument, SmallEnsemble
from tank2sim.api.ship import load
from tank2sim.api.validation import validate
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import number, page_option, plot_folder_option, set_option


@click.command("validate")
@click.argument("card")
@click.argument("trials", nargs=-1, type=click.Path(path_type=Path), metavar="[TRIAL]...")
@click.option(
    "--members",
    type=number(SmallEnsemble),
    default=MEMBERS,
    show_default=True,
    help="Ships drawn within the card's errors for u_input; 0 for none.",
)
@click.option(
    "--required",
    "required_percent",
    type=number(PositiveArgument),
    default=REQUIRED,
    show_default=True,
    metavar="PERCENT",
    help="Level of validation that is required, U_reqd in per cent of each measured figure.",
)
@set_option
@page_option("-o")
@plot_folder_option
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    members: int,
    required_percent: float,
    values: dict[str, object],
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Validate CARD in the manner of ITTC 7.5-02-06-03: by TRIALs that did not make it, figure by figure.

    A TRIAL that CARD was identified from, by its content or by the names in its source, can only refute it. A craft
    with thrusters is validated by free-running predictions of 30 s of trials that log cut.
    """
    result = validate(load(card, values), trials, members=members, required_percent=required_percent)
    inputs: list[str | Path] = [*([result.card.source] if result.card else []), *result.paths]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots)
    show_result(result)
