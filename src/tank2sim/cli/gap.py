"""``tank2sim gap``: the physical effect that a model lacks, by trials."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.gap import find_gap, gap_options
from tank2sim.api.trial import trial_files
from tank2sim.arguments import Count, Effects
from tank2sim.bundled import bundled_cards
from tank2sim.cli.console import json_option, screen, show_notices, show_result
from tank2sim.cli.options import OutputFile, executor_option, number
from tank2sim.cli.progress import showing_stages
from tank2sim.cli.trials import TakesSeveral
from tank2sim.errors import InputError
from tank2sim.gap.fleet.ships import GAP, HOLDOUT, ship_alone
from tank2sim.gap.outcome.files import folder_made, put, refuse_early
from tank2sim.gap.workflow import MOST_EFFECTS


@click.command("gap", cls=TakesSeveral, several=("--holdout", "--effects", "--without"))
@click.argument("card")
@click.argument("trials", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--holdout",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="TRIAL...",
    help="Prove what was found on these; do not use them to find it.",
)
@click.option(
    "-o",
    "--output",
    required=True,
    type=OutputFile(()),
    metavar="DIR",
    help="Folder for gap.json, improved.toml, report.html, next_test.csv and corrected/.",
)
@click.option("--workers", type=number(Count), metavar="N", help="Processes; by default one for each core.")
@executor_option
@click.option("--effects", multiple=True, metavar="NAME...", help="Look for these alone.")
@click.option("--without", multiple=True, metavar="NAME...", help="Do not look for these.")
@click.option(
    "--max-effects",
    type=number(Effects),
    default=MOST_EFFECTS,
    show_default=True,
    help="Effects named at most.",
)
@click.option(
    "--false-discovery",
    type=float,
    default=0.5,
    show_default=True,
    metavar="Q",
    help="Largest probability with which a name given alone may be wrong, 0.01 to 0.5; less sure: several candidates.",
)
@click.option("--again", is_flag=True, help="Of a fleet, compute also what an earlier run has computed.")
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    holdout: tuple[Path, ...],
    output: Path,
    workers: int | None,
    executor: str,
    effects: tuple[str, ...],
    without: tuple[str, ...],
    max_effects: int,
    false_discovery: float,
    again: bool,
    json_file: Path | None,
) -> int:
    """Name the physical effect that CARD lacks to follow the free-running TRIALs, add it, and prove it.

    A folder in place of CARD and TRIALs is a fleet: each of its sub-folders is a ship, with its card, its trials next
    to it, and held-out trials in a sub-folder holdout. Each ship's results are written as soon as they exist; a
    run that was stopped continues where it was. A finding is not a failure: whatever is found, the command ends with 0,
    or with 2 if a ship of the fleet could not be judged.
    """
    folder, single_ship = Path(card), None
    if folder.is_dir() and not trials:
        if holdout:
            remedy = f"put the trials to be held out into a sub-folder {HOLDOUT} of each ship's folder"
            raise InputError("--holdout", "", "cannot be given with a folder of ships", remedy)
        single_ship = ship_alone(folder)
        if single_ship is None:
            from tank2sim.cli.gap_fleet import FleetRequest, run_fleet  # its page is slow to import

            options = gap_options(effects, without, max_effects, workers, false_discovery)
            return run_fleet(FleetRequest(folder, output, options, executor, again, json_file))
        card, trials, holdout = str(single_ship.card), single_ship.trials, single_ship.holdout
    elif not trials:
        raise click.UsageError("Missing argument 'TRIALS...'", click.get_current_context())
    elif folder.is_dir() and card.lower() not in bundled_cards():
        raise InputError(card, "", "is a folder, and trials are given with it", "give it alone, or a card in it")
    inputs = [*trial_files(trials), *trial_files(holdout), *([Path(card)] if Path(card).is_file() else [])]
    refuse_early(output, json_file, inputs)
    with folder_made(output), showing_stages("reading") as progress:
        result = find_gap(
            card,
            trials,
            holdout=holdout,
            effects=effects,
            without=without,
            max_effects=max_effects,
            false_discovery=false_discovery,
            executor=executor,
            workers=workers,
            progress=progress,
        )
        progress("writing")
        files, notices = result.files(output)
        if json_file:
            files[json_file] = files[output / GAP]
        removed = put(files, output, inputs)
    show_result(result)
    show_notices([*notices, *removed])
    inside = [path.relative_to(output) for path in files if path.is_relative_to(output)]
    names = {path.parts[0] if len(path.parts) == 1 else f"{path.parts[0]}/" for path in inside}
    screen.print(f"{output}: {', '.join(sorted(names))}", soft_wrap=True, markup=False)
    if single_ship:
        show_notices([f"{folder} holds a card itself, and was taken for one ship"])
    return 0
