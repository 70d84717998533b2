"""``tank2sim gap``: the physical effect that a model lacks, by trials."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

import click

from tank2sim.api.trials import fitted_and_held, trial_files
from tank2sim.bundled import bundled_cards
from tank2sim.cards import read_card
from tank2sim.cli.console import json_option, screen, show_notices
from tank2sim.cli.ensemble import executor_option
from tank2sim.cli.gap_files import GapFiles, folder_made, gap_file_contents, put, refuse_early
from tank2sim.cli.gap_screen import show_gap
from tank2sim.cli.progress import showing_stages
from tank2sim.cli.trials import TakesSeveral
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.gap.fleet.search import can_lack
from tank2sim.gap.fleet.ships import GAP, HOLDOUT, ship_alone
from tank2sim.gap.workflow import GapOptions, find_gap


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
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for gap.json, improved.toml, report.html, next_test.csv and corrected/.",
)
@click.option("--workers", type=click.IntRange(1), metavar="N", help="Processes; by default one for each core.")
@executor_option
@click.option("--effects", multiple=True, metavar="NAME...", help="Look for these alone.")
@click.option("--without", multiple=True, metavar="NAME...", help="Do not look for these.")
@click.option("--max-effects", type=click.IntRange(1, 2), default=2, show_default=True, help="Effects at a time.")
@click.option("--again", is_flag=True, help="Of a fleet, compute also what an earlier run has computed.")
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    *,
    holdout: tuple[Path, ...],
    output: Path,
    json_file: Path | None,
    **more: object,
) -> int:
    """Name the physical effect that CARD lacks to follow the free-running TRIALs, add it, and prove it.

    A folder in place of CARD and TRIALs is a fleet: each of its sub-folders is a ship, with her card, her trials beside
    it, and those that are held out in a sub-folder holdout. Each ship's results are written into DIR as soon as they
    are there; a run that was stopped goes on where it was. A finding is no failure: whatever is found, the command ends
    0, or 2 if a ship of the fleet could not be judged.
    """
    if Path(card).is_dir() and not trials:
        return _of_folder(Path(card), holdout, output, json_file, more)
    if not trials:
        raise click.UsageError("Missing argument 'TRIALS...'", click.get_current_context())
    if Path(card).is_dir() and card.lower() not in bundled_cards():
        raise InputError(card, "", "is a folder, and trials are given beside it", "give it alone, or a card in it")
    _one_ship(card, (trials, holdout), output, json_file, more)
    return 0


def _of_folder(
    folder: Path, holdout: tuple[Path, ...], output: Path, json_file: Path | None, more: Mapping[str, object]
) -> int:
    """The ship whose card lies in the folder itself, or those in its sub-folders."""
    if holdout:
        remedy = f"put the trials to be held out into a sub-folder {HOLDOUT} of each ship's folder"
        raise InputError("--holdout", "", "cannot be given with a folder of ships", remedy)
    if ship := ship_alone(folder):
        _one_ship(str(ship.card), (ship.trials, ship.holdout), output, json_file, more)
        show_notices([f"{folder} holds a card itself, and was taken for one ship"])
        return 0
    from tank2sim.cli.gap_fleet import FleetRequest, run_fleet  # its page is slow to import

    options = _options(more)
    return run_fleet(FleetRequest(folder, output, options, str(more["executor"]), bool(more["again"]), json_file))


def _one_ship(
    card: str,
    trials: tuple[tuple[Path, ...], tuple[Path, ...]],
    output: Path,
    json_file: Path | None,
    more: Mapping[str, object],
) -> None:
    """One ship by trials that are fitted, and others that are held out."""
    known = can_lack(read_card(card))
    options = _options(more)
    inputs = [*trial_files(trials[0]), *trial_files(trials[1]), *([Path(card)] if Path(card).is_file() else [])]
    fitted, held = fitted_and_held(*trials, known)
    refuse_early(output, json_file, inputs)
    with folder_made(output), showing_stages("reading") as progress:
        with _cluster(str(more["executor"])) as executor:
            gap = find_gap(known, fitted, held, options, progress, executor)
        progress("writing")
        files, notices = gap_file_contents(gap, fitted, held, output)
        if json_file:
            files[json_file] = files[output / GAP]
        tidied = put(files, output, inputs)
    show_gap(gap)
    show_notices([*gap.notices, *notices, *tidied])
    screen.print(f"{output}: {', '.join(sorted(_told(files, output)))}", soft_wrap=True, markup=False)


@contextmanager
def _cluster(text: str) -> Iterator[Executor | None]:
    """The cluster asked for; None for processes of this machine, which the search begins itself if it needs them."""
    if check_executor(text) == PROCESSES:
        yield None
        return
    with executing(text) as executor:
        yield executor


def _options(given: Mapping[str, object]) -> GapOptions:
    names = {option: _names(f"--{option}", given[option]) for option in ("effects", "without")}
    workers = given["workers"]
    return GapOptions(
        effects=names["effects"] or None,
        without=names["without"],
        max_effects=int(str(given["max_effects"])),
        workers=workers if isinstance(workers, int) else None,
    )


def _names(option: str, given: object) -> tuple[str, ...]:
    """Names of effects, each known."""
    assert isinstance(given, tuple)
    for name in given:
        if name not in EFFECTS:
            close = difflib.get_close_matches(name, EFFECTS, n=1)
            remedy = f"did you mean {close[0]}?" if close else f"known are: {', '.join(EFFECTS)}"
            raise InputError(option, "", f"{name!r} is no effect", remedy)
    return given


def _told(files: GapFiles, folder: Path) -> set[str]:
    inside = [path.relative_to(folder) for path in files if path.is_relative_to(folder)]
    return {path.parts[0] if len(path.parts) == 1 else f"{path.parts[0]}/" for path in inside}
