"""``tank2sim identify``: coefficients from free-running trials."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from tank2sim.api.craft_identification import craft_trial_files, identify_craft
from tank2sim.api.identification import identify
from tank2sim.api.trial import trial_files
from tank2sim.arguments import Count, DrawsOfChain, SmallEnsemble
from tank2sim.cards import CraftCard
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, executor_option, number, page_option, plot_folder_option
from tank2sim.cli.progress import showing_progress
from tank2sim.cli.trials import TakesSeveral
from tank2sim.dynamics.vessel import Vessel
from tank2sim.errors import InputError
from tank2sim.files import CARD
from tank2sim.identification.trials.methods.posterior_sampling import DRAWS_OF_CHAIN, SAMPLERS
from tank2sim.identification.trials.options import BY_RESIDUALS, TRIAL_METHODS
from tank2sim.identification.trials.problem.structures import AUTO, AVERAGE, BY_EVIDENCE, STRUCTURES
from tank2sim.ship import load

_SHIP_OPTIONS = {
    "method": "--method",
    "structure": "--structure",
    "campaign": "--campaign",
    "inertia": "--inertia",
    "piece": "--piece",
    "workers": "--workers",
    "executor": "--executor",
    "members": "--members",
    "bootstrap": "--bootstrap",
    "posterior": "--posterior",
    "draws": "--draws",
    "hold": "--hold",
    "force": "--force",
    "trust_card": "--trust-card",
    "plots": "--plots",
}
"""Parameters that are of a ship's trials alone."""


def _of_craft(
    ship: Vessel,
    trials: tuple[Path, ...],
    holdout: tuple[Path, ...],
    output: Path | None,
    page: Path | None,
    json_file: Path | None,
) -> None:
    """Identify a craft with thrusters; refuse options that it does not have."""
    context = click.get_current_context()
    for name, option in _SHIP_OPTIONS.items():
        if context.get_parameter_source(name) not in (None, ParameterSource.DEFAULT):
            raise InputError(option, "", "is not for a craft with thrusters", "leave it out")
    with showing_progress("fitting") as progress:
        result = identify_craft(ship, trials, holdout=holdout, progress=progress)
    files = result.card.files(output) if output and result.card else {}
    inputs = [Path(ship.card.source), *craft_trial_files(trials), *craft_trial_files(holdout)]
    write_result(result, inputs, json_file=json_file, page=page, files=files)
    show_result(result)


@click.command("identify", cls=TakesSeveral, several=("--holdout",))
@click.argument("card")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--holdout",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="TRIAL...",
    help="Compare with these; do not fit them.",
)
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the card found.")
@click.option(
    "--method",
    type=click.Choice(TRIAL_METHODS),
    default=BY_RESIDUALS,
    show_default=True,
    help=f"{BY_RESIDUALS}: kalman for trials at sea that show gusts or waves, else output_error.",
)
@click.option(
    "--structure",
    type=click.Choice((*STRUCTURES.names(), AUTO, AVERAGE, BY_EVIDENCE)),
    default=BY_EVIDENCE,
    show_default=True,
    help="; ".join(f"{each.name}: {each.description}" for each in STRUCTURES.values())
    + f"; {AUTO}: cross-validation decides; {AVERAGE}: intervals of all, weighted by their predictions; {BY_EVIDENCE}: "
    "cross_flow, or card if an information criterion prefers it strongly or predictions of trials left out do.",
)
@click.option(
    "--campaign",
    type=click.Path(path_type=Path),
    metavar="CAMPAIGN.toml",
    help="Fit these captive tests of a model of the ship together with the trials.",
)
@click.option("--inertia", is_flag=True, help="Estimate acceleration derivatives, too.")
@click.option("--piece", type=float, metavar="S", help="Length of the pieces of output error, s; by default 5 L/u0.")
@click.option("--workers", type=number(Count), metavar="N", help="Processes for cross-validation and bootstrap.")
@executor_option
@click.option(
    "--members",
    type=number(SmallEnsemble),
    default=100,
    show_default=True,
    help="Simulations behind the intervals of figures of trials held out.",
)
@click.option(
    "--bootstrap",
    type=number(SmallEnsemble),
    default=0,
    metavar="N",
    help="Fit N sets of trials simulated again with the estimate, for the scatter of the estimates.",
)
@click.option(
    "--posterior",
    type=click.Choice(SAMPLERS),
    is_flag=False,
    flag_value=SAMPLERS[0],
    help="Sample the posterior by the no-U-turn sampler (nuts) or by an ensemble of walkers; the card carries it.",
)
@click.option(
    "--draws",
    type=number(DrawsOfChain),
    default=DRAWS_OF_CHAIN,
    show_default=True,
    help="Draws of each of four chains.",
)
@click.option("--hold", multiple=True, metavar="NAME", help="Leave a derivative or parameter as the card has it.")
@click.option("--force", is_flag=True, help="Fit trials also if they look like another ship's; the card says so.")
@click.option("--trust-card", is_flag=True, help="Take the card's standard errors as they are.")
@page_option()
@plot_folder_option
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    holdout: tuple[Path, ...],
    output: Path | None,
    method: str,
    structure: str,
    campaign: Path | None,
    inertia: bool,
    piece: float | None,
    workers: int | None,
    executor: str,
    members: int,
    bootstrap: int,
    posterior: str | None,
    draws: int,
    hold: tuple[str, ...],
    force: bool,
    trust_card: bool,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Estimate the coefficients of CARD from the free-running TRIALs (CSV, SIMMAN .dat or Esso Osaka CSV)."""
    ship = load(card)
    if isinstance(ship.card, CraftCard):
        _of_craft(ship, trials, holdout, output, page, json_file)
        return
    with showing_progress("fitting") as progress:
        result = identify(
            ship,
            trials,
            holdout=holdout,
            method=method,
            structure=structure,
            campaign=campaign,
            inertia=inertia,
            piece_s=piece,
            trust_card=trust_card,
            hold=hold,
            force=force,
            members=members,
            bootstrap=bootstrap,
            posterior=posterior or "",
            draws=draws,
            executor=executor,
            workers=workers,
            progress=progress,
        )
    files = result.card.files(output) if output and result.card else {}
    inputs = [Path(ship.card.source), *trial_files(trials), *trial_files(holdout), *([campaign] if campaign else [])]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
    if output:
        count = len(result.study.parameters)
        screen.print(f"{output}: {count} coefficients", soft_wrap=True, markup=False)
