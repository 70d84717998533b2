"""``tank2sim gap``: the physical effect that a model lacks, by trials."""

from __future__ import annotations

import contextlib
import difflib
import json
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

import click
from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from tank2sim.cards import Card, ManoeuvringCard, parse_card, read_card
from tank2sim.cli.ensemble import executor_option
from tank2sim.cli.progress import showing_stages
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, shown
from tank2sim.cli.trials import TakesSeveral, fitted_and_held, trial_files
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import writable_folder, write_together
from tank2sim.gap.acting import acting
from tank2sim.gap.add import Found, improved_text
from tank2sim.gap.as_json import (
    NEXT_TEST_FILE,
    estimate_in_file,
    gap_as_json,
    in_file,
    joined,
    measured_in,
    signal_name,
)
from tank2sim.gap.correct import LEFT, corrected, corrected_text
from tank2sim.gap.find import Options, find_gap
from tank2sim.gap.result import AMBIGUOUS, MISSING, Gap, Named
from tank2sim.records.trials import Trial
from tank2sim.units import in_words

GAP = "gap.json"

ALWAYS = (GAP, "improved.toml", "report.html", NEXT_TEST_FILE)
"""Files that are written into the folder, the last one if there is such a test."""

CORRECTED = "corrected"
"""Folder of trials without the faults of their sensors."""


@click.command("gap", cls=TakesSeveral, several=("--holdout", "--effects", "--without"))
@click.argument("card")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path))
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
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    *,
    holdout: tuple[Path, ...],
    output: Path,
    json_file: Path | None,
    **more: object,
) -> None:
    """Name the physical effect that CARD lacks to follow the free-running TRIALs, add it, and prove it.

    A finding is no failure: whatever is found, the command ends 0.
    """
    known = _ship(read_card(card))
    options = _options(more)
    inputs = [*trial_files(trials), *trial_files(holdout), *([Path(card)] if Path(card).exists() else [])]
    fitted, held = fitted_and_held(trials, holdout, known)
    _refuse_early(output, json_file, inputs)
    earlier = _of_earlier_run(output)
    with _folder(output), showing_stages("reading") as progress:
        with _cluster(str(more["executor"])) as executor:
            gap = find_gap(known, fitted, held, options, progress, executor)
        progress("writing")
        files, notices = _files(gap, (*fitted.trials, *held.trials), [one.name for one in fitted.trials], output)
        if json_file:
            files[json_file] = files[output / GAP]
        some_corrected = any(path.parent == output / CORRECTED for path in files)
        with _folder(output / CORRECTED) if some_corrected else contextlib.nullcontext():
            write_together(files, inputs=inputs, outputs=[*files])
    _show(gap)
    show_notices([*gap.notices, *notices, *_tidied(output, earlier, {*files, *map(Path.resolve, inputs)})])
    screen.print(f"{output}: {', '.join(sorted(_told(files, output)))}", soft_wrap=True, markup=False)


@contextmanager
def _cluster(text: str) -> Iterator[Executor | None]:
    """The cluster asked for; None for processes of this machine, which the search begins itself if it needs them."""
    if check_executor(text) == PROCESSES:
        yield None
        return
    with executing(text) as executor:
        yield executor


def _ship(card: Card) -> ManoeuvringCard:
    if not isinstance(card, ManoeuvringCard):
        raise InputError(card.source, "model.kind", "is no ship that manoeuvres", "give an abkowitz card")
    if card.model.kind == "linear":
        remedy = 'set kind = "abkowitz"; what it lacks of the third order is then zero'
        raise InputError(card.source, "model.kind", "is linear, and most effects are no part of such a model", remedy)
    return card


def _options(given: dict[str, object]) -> Options:
    names = {option: _names(f"--{option}", given[option]) for option in ("effects", "without")}
    workers = given["workers"]
    return Options(
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


@contextmanager
def _folder(path: Path) -> Iterator[None]:
    """A folder for outputs, made before the long work that fills it, and taken away again if that fails."""
    made = not path.exists()
    writable_folder(path)
    try:
        yield
    except BaseException:
        if made:
            with contextlib.suppress(OSError):
                path.rmdir()
        raise


def _refuse_early(folder: Path, json_file: Path | None, inputs: Sequence[Path]) -> None:
    """What would fail when files are written fails before the long work."""
    for name in ALWAYS:
        for path in inputs:
            if (folder / name).exists() and (folder / name).samefile(path):
                remedy = "give another folder with -o"
                raise InputError(folder / name, "", f"is an input ({path}), which would be overwritten", remedy)
    if json_file and not json_file.parent.is_dir():
        raise InputError(json_file, "", "cannot be written: there is no such folder", "give one that exists")


def _files(
    gap: Gap, trials: Sequence[Trial], fitted: Sequence[str], folder: Path
) -> tuple[dict[Path, str | bytes], list[str]]:
    """Path to content of all files, and what a user should be told of them."""
    from tank2sim.report.gap_page import gap_charts, gap_page
    from tank2sim.report.page import render_page

    found: list[Found] = [(one.name, one.parameters, one.standard_errors) for one in gap.effects]
    rivals = [joined(one) for one in gap.alternatives]
    text = gap.card.text if gap.improved.text == gap.card.text else improved_text(gap.improved, found, fitted, rivals)
    parse_card(text, str(folder / "improved.toml"))
    names = {trial.name: trial.path.name for trial in trials}
    files: dict[Path, str | bytes] = {
        folder / "improved.toml": text,
        folder / "report.html": render_page(gap_page(gap, gap_charts(gap))),
    }
    if gap.next_test:
        files[folder / NEXT_TEST_FILE] = gap.next_test.orders
    notices = []
    if gap.verdict == MISSING and any(EFFECTS[name].acts_on == "sensor" for name, *_ in found):
        for trial in trials:
            text_of_trial = corrected_text(trial.path, trial, found)
            if text_of_trial is not None:
                files[folder / CORRECTED / f"{trial.name}.csv"] = text_of_trial
            new = corrected(trial, found).notices[len(trial.notices) :]
            notices += [f"{trial.path.name}: {told}" for told in new if told.startswith(LEFT)]
    own = sorted(path.relative_to(folder).as_posix() for path in (*files, folder / GAP))
    files[folder / GAP] = json_text({**gap_as_json(gap, names), "files": own})
    return files, notices


def _of_earlier_run(folder: Path) -> set[Path]:
    """Orders and corrected trials that an earlier run says in its ``gap.json`` that it wrote."""
    try:
        told = json.loads((folder / GAP).read_text(encoding="utf-8"))
        names = [*told.get("files", ()), (told.get("next_test") or {}).get("orders", "")]
        paths = [PurePosixPath(name) for name in names]
    except (OSError, ValueError, AttributeError, TypeError):
        return set()  # none, or another program's
    corrected_ones = {folder / path for path in paths if len(path.parts) == 2 and path.match(f"{CORRECTED}/*.csv")}
    return corrected_ones | ({folder / NEXT_TEST_FILE} if PurePosixPath(NEXT_TEST_FILE) in paths else set())


def _tidied(folder: Path, earlier: set[Path], kept: set[Path]) -> list[str]:
    """Take away what an earlier run wrote and this one has no successor of; tells of it, and of what is not known."""
    told = []
    for path in (folder / NEXT_TEST_FILE, *sorted((folder / CORRECTED).glob("*.csv"))):
        if path in kept or not path.exists():
            continue
        if path not in earlier or path.resolve() in kept:
            told.append(f"{path} is not of this run, and was left")
            continue
        try:
            path.unlink()
        except OSError:
            told.append(f"{path} is of an earlier run, and could not be removed")
        else:
            told.append(f"{path} was of an earlier run, and was removed")
    with contextlib.suppress(OSError):  # not there, or not empty
        (folder / CORRECTED).rmdir()
    return told


def _told(files: dict[Path, str | bytes], folder: Path) -> set[str]:
    inside = [path.relative_to(folder) for path in files if path.is_relative_to(folder)]
    return {path.parts[0] if len(path.parts) == 1 else f"{path.parts[0]}/" for path in inside}


def _show(gap: Gap) -> None:
    from tank2sim.report.gap_words import probabilities_in_words, sizes_of_candidates, verdict_in_words

    _line(f"{gap.card.ship.name}: {verdict_in_words(gap)}")
    if rows := [row for one in gap.effects for row in _parameters(one)]:
        what = "What the best of the candidates would be" if gap.verdict == AMBIGUOUS else "What was found"
        _table(what, ["effect", "parameter", "value", "standard error", "unit"], rows)
    for told in probabilities_in_words(gap):
        _line(told)
    if gap.alternatives:
        _line(f"these data cannot tell it from: {'; '.join(joined(one) for one in gap.alternatives)}")
    if rows := [row for one in sizes_of_candidates(gap) for row in _parameters(one)]:
        _table("What the others would be", ["effect", "parameter", "value", "standard error", "unit"], rows)
    for place in gap.where[:1]:
        _line(
            f"most of the misfit arises in {signal_name(place.signal).file} of {place.trial}, {place.t_start_s:.4g} s "
            f"to {place.t_end_s:.4g} s ({100 * place.share:.0f} %)"
        )
    for one in acting(gap)[:1]:
        _line(
            f"the cause acts most in {one.equation} of {one.trial}, {one.t_start_s:.4g} s to {one.t_end_s:.4g} s "
            f"({one.size:.2g} standard errors)"
        )
    _table("Misfit in units of the noise (1 is noise)", ["trial", "set", "before", "after"], _misfits(gap))
    if gap.next_test:
        _line(f"next test: {gap.next_test.manoeuvre}. {gap.next_test.why}")


def _misfits(gap: Gap) -> list[list[object]]:
    rows: list[list[object]] = [
        [one.name, "held out" if one.held_out else "fitted", *(_hundredths(one.misfit(w)) for w in ("before", "after"))]
        for one in gap.passed
        if measured_in(one)
    ]
    for word, held in (("fitted", False), ("held out", True)):
        before, after = (gap.misfit(which, held_out=held) for which in ("before", "after"))
        if before is not None and after is not None:
            rows.append(["all", word, _hundredths(before), _hundredths(after)])
    return rows


def _parameters(one: Named) -> list[list[object]]:
    rows: list[list[object]] = []
    for parameter, value in one.parameters.items():
        own, there = estimate_in_file(parameter, value)
        error = in_file(parameter, one.standard_errors[parameter])[1] if parameter in one.standard_errors else math.nan
        words, unit = in_words(own)
        rows.append([one.name, words, there, float(f"{error:.2g}"), unit or "-"])
    return rows


def _hundredths(misfit: float) -> str:
    return f"{misfit:.2f}" if math.isfinite(misfit) else "ran away"


def _line(text: str) -> None:
    screen.print(text, soft_wrap=True, markup=False)


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """A table as wide as it must be: names of trials and effects are never broken; a dash for what is no number."""
    table = Table(header_style="bold", pad_edge=False)
    for place, head in enumerate(heads):
        numeric = all(isinstance(row[place], int | float) for row in rows)
        table.add_column(head, justify="right" if numeric else "left", no_wrap=True)
    for row in rows:
        told = [None if isinstance(value, float) and not math.isfinite(value) else value for value in row]
        table.add_row(*(escape(shown(value)) for value in told))
    width = Measurement.get(screen, screen.options.update(width=WIDE), table).maximum
    screen.print(title, style="italic", soft_wrap=True, markup=False)
    Console(width=max(width, screen.width), highlight=False).print(table)


WIDE = 1000
"""Characters in which any table of ours has room."""
