"""Files of a gap in a folder, and the removal of an earlier run's."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from tank2sim.cards.covariance import covariance_file
from tank2sim.errors import InputError
from tank2sim.files import folder_made, write_together
from tank2sim.gap.outcome.export import NEXT_TEST_FILE
from tank2sim.notices import Notice

GAP, IMPROVED, REPORT = "gap.json", "improved.toml", "report.html"
"""Files of the results of a ship."""

ALWAYS = (GAP, IMPROVED, REPORT, NEXT_TEST_FILE)
"""Files that are written into the folder, the last one if there is such a test, the card if nothing objects."""

SOMETIMES = (NEXT_TEST_FILE, IMPROVED, covariance_file(Path(IMPROVED)).name)
"""Files that only some runs write: the orders of a test, the improved card if nothing objects, and its covariance."""

CORRECTED = "corrected"
"""Folder of trials without the faults of their sensors."""

SURROUNDED = "surroundings"
"""Folder of trials with the winds and currents that were found for each as columns."""

FOLDERS = (CORRECTED, SURROUNDED)
"""Folders of trials that only some runs write."""

GapFiles = dict[Path, str | bytes]


def refuse_early(folder: Path, inputs: Sequence[Path]) -> None:
    """Refuse, before the long work, a folder of results in which an input would be overwritten.

    Parameters
    ----------
    folder : Path
    inputs : sequence of Path
    """
    for name in ALWAYS:
        for path in inputs:
            if (folder / name).exists() and (folder / name).samefile(path):
                remedy = "give another folder"
                raise InputError(folder / name, "", f"is an input ({path}), which would be overwritten", remedy)


def put(files: Mapping[Path, str | bytes], folder: Path, inputs: Sequence[Path]) -> list[Notice]:
    """Write all files or none; return messages about files of an earlier run that this run does not replace.

    Parameters
    ----------
    files : mapping
        Path to content.
    folder : Path
        Of the results.
    inputs : sequence of Path
        Files that must not be overwritten.
    """
    earlier = _of_earlier_run(folder)
    with contextlib.ExitStack() as made:
        for path in dict.fromkeys(path.parent for path in files if path.parent in {folder / name for name in FOLDERS}):
            made.enter_context(folder_made(path))
        write_together(files, inputs=inputs, outputs=[*files])
    return _tidied(folder, earlier, {*files, *map(Path.resolve, inputs)})


def _of_earlier_run(folder: Path) -> set[Path]:
    """Orders, card, written trials and covariance that an earlier run lists in its ``gap.json``."""
    try:
        earlier = json.loads((folder / GAP).read_text(encoding="utf-8"))
        names = [*earlier.get("files", ()), (earlier.get("next_test") or {}).get("orders", "")]
        paths = [PurePosixPath(name) for name in names]
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return set()  # none, or another program's
    trials = {
        folder / path for path in paths if len(path.parts) == 2 and any(path.match(f"{name}/*.csv") for name in FOLDERS)
    }
    return trials | {folder / name for name in SOMETIMES if PurePosixPath(name) in paths}


def _tidied(folder: Path, earlier: set[Path], kept: set[Path]) -> list[Notice]:
    """Remove files of an earlier run that this run does not replace; return messages, also about unknown files."""
    messages = []
    trials = [path for name in FOLDERS for path in sorted((folder / name).glob("*.csv"))]
    for path in (*(folder / name for name in SOMETIMES), *trials):
        if path in kept or not path.exists():
            continue
        if path not in earlier or path.resolve() in kept:
            messages.append(Notice(f"{path} is not of this run, and was left"))
            continue
        try:
            path.unlink()
        except OSError:
            messages.append(Notice(f"{path} is of an earlier run, and could not be removed"))
        else:
            messages.append(Notice(f"{path} was of an earlier run, and was removed"))
    for name in FOLDERS:
        with contextlib.suppress(OSError):  # not there, or not empty
            (folder / name).rmdir()
    return messages
