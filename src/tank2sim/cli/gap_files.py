"""The files that ``tank2sim gap`` writes into a ship's folder, and what becomes of those of an earlier run."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.covariance import covariance_file, not_referring
from tank2sim.cli.console import json_text
from tank2sim.cli.ensemble import with_carried_covariance
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.files import writable_folder, write_together
from tank2sim.gap.fleet.ships import GAP, IMPROVED
from tank2sim.gap.outcome.correct_sensors import REMAINING_FAULTS, correct_sensor_faults, corrected_text
from tank2sim.gap.outcome.export import NEXT_TEST_FILE, gap_as_json, joined
from tank2sim.gap.outcome.improve_card import Found, card_with_effects_text
from tank2sim.gap.result import MISSING, Gap
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.signatures import with_fitted_trials

REPORT = "report.html"

ALWAYS = (GAP, IMPROVED, REPORT, NEXT_TEST_FILE)
"""Files that are written into the folder, the last one if there is such a test."""

SOMETIMES = (NEXT_TEST_FILE, covariance_file(Path(IMPROVED)).name)
"""Files that only some runs write: the orders of a test, and the covariance of the improved card."""

CORRECTED = "corrected"
"""Folder of trials without the faults of their sensors."""

GapFiles = dict[Path, str | bytes]


@contextmanager
def folder_made(path: Path) -> Iterator[None]:
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


def refuse_early(folder: Path, json_file: Path | None, inputs: Sequence[Path]) -> None:
    """What would fail when files are written fails before the long work."""
    for name in ALWAYS:
        for path in inputs:
            if (folder / name).exists() and (folder / name).samefile(path):
                remedy = "give another folder with -o"
                raise InputError(folder / name, "", f"is an input ({path}), which would be overwritten", remedy)
    if json_file and not json_file.parent.is_dir():
        raise InputError(json_file, "", "cannot be written: there is no such folder", "give one that exists")


def gap_file_contents(gap: Gap, fitted: Measured, held: Measured, folder: Path) -> tuple[GapFiles, list[str]]:
    """Path to content of all files, and what a user should be told of them."""
    found: list[Found] = [(one.name, one.parameters, one.standard_errors) for one in gap.effects]
    rivals = [joined(one) for one in gap.alternatives]
    names_fitted = [one.name for one in fitted.trials]
    unchanged = gap.improved.text == gap.card.text
    name = str(folder / IMPROVED)
    text = gap.card.text
    if not unchanged:
        text = with_fitted_trials(
            card_with_effects_text(gap.improved, found, names_fitted, rivals), name, fitted.trials
        )
    parse_card(text, name)
    trials = (*fitted.trials, *held.trials)
    improved, notices = _with_covariance(gap.card, text, folder / IMPROVED)
    files: GapFiles = {**improved, folder / REPORT: _page(gap)}
    if gap.next_test:
        files[folder / NEXT_TEST_FILE] = gap.next_test.orders
    if gap.verdict == MISSING and any(EFFECTS[name].acts_on == "sensor" for name, *_ in found):
        for trial in trials:
            text_of_trial = corrected_text(trial.path, trial, found)
            if text_of_trial is not None:
                files[folder / CORRECTED / f"{trial.name}.csv"] = text_of_trial
            new = correct_sensor_faults(trial, found).notices[len(trial.notices) :]
            notices += [f"{trial.path.name}: {told}" for told in new if told.startswith(REMAINING_FAULTS)]
    own = sorted(path.relative_to(folder).as_posix() for path in (*files, folder / GAP))
    names = {trial.name: trial.path.name for trial in trials}
    files[folder / GAP] = json_text({**gap_as_json(gap, names), "files": own})
    return files, notices


def _with_covariance(card: ManoeuvringCard, text: str, path: Path) -> tuple[GapFiles, list[str]]:
    """The improved card with what of the covariance of `card` holds for it; without one that cannot be read, which
    nothing else needs, and which shall not spoil what the search has found."""
    try:
        return with_carried_covariance(card, text, path)
    except InputError as error:
        return {path: not_referring(text)}, [f"{path.name} has no covariance: {error}"]


def _page(gap: Gap) -> str:
    from tank2sim.report.gap.page import gap_charts, gap_page  # slow to import
    from tank2sim.report.kit.page import render_page

    return render_page(gap_page(gap, gap_charts(gap)))


def put(files: Mapping[Path, str | bytes], folder: Path, inputs: Sequence[Path]) -> list[str]:
    """Write all files or none; tells what became of those of an earlier run that have no successor."""
    earlier = _of_earlier_run(folder)
    some_corrected = any(path.parent == folder / CORRECTED for path in files)
    with folder_made(folder / CORRECTED) if some_corrected else contextlib.nullcontext():
        write_together(files, inputs=inputs, outputs=[*files])
    return _tidied(folder, earlier, {*files, *map(Path.resolve, inputs)})


def _of_earlier_run(folder: Path) -> set[Path]:
    """What of orders, corrected trials and covariance an earlier run says in its ``gap.json`` that it wrote."""
    try:
        told = json.loads((folder / GAP).read_text(encoding="utf-8"))
        names = [*told.get("files", ()), (told.get("next_test") or {}).get("orders", "")]
        paths = [PurePosixPath(name) for name in names]
    except (OSError, ValueError, AttributeError, TypeError):
        return set()  # none, or another program's
    corrected_ones = {folder / path for path in paths if len(path.parts) == 2 and path.match(f"{CORRECTED}/*.csv")}
    return corrected_ones | {folder / name for name in SOMETIMES if PurePosixPath(name) in paths}


def _tidied(folder: Path, earlier: set[Path], kept: set[Path]) -> list[str]:
    """Take away what an earlier run wrote and this one has no successor of; tells of it, and of what is not known."""
    told = []
    for path in (*(folder / name for name in SOMETIMES), *sorted((folder / CORRECTED).glob("*.csv"))):
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
