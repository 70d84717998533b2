"""The record of the inputs of a result, by which it need not be computed again: ``run.json``."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tank2sim.apps.fleet.ships import ShipFolder
from tank2sim.errors import InputError
from tank2sim.gap.workflow import GapOptions
from tank2sim.version import __version__

RUN = "run.json"
"""File next to ``gap.json``."""

_FORMAT = "tank2sim-run/1"


def fleet_run_record(ship: ShipFolder, options: GapOptions) -> dict[str, object]:
    """All on which a result depends: files by the SHA-256 of their bytes, options, version of the program.

    The number and place of the processes is not part of it.

    Raises
    ------
    InputError
        A file cannot be read.
    """
    return {
        "format": _FORMAT,
        "tank2sim": __version__,
        "card": _sums([ship.card]),
        "trials": _sums(ship.trials),
        "holdout": _sums(ship.holdout),
        "options": {
            "effects": None if options.effects is None else list(options.effects),
            "without": list(options.without),
            "max_effects": options.max_effects,
            "false_discovery": options.false_discovery,
        },
    }


def with_results(record: Mapping[str, object], contents: Mapping[Path, str | bytes], folder: Path) -> dict[str, object]:
    """The record of a run that wrote these files into its folder."""
    files = {path.relative_to(folder).as_posix(): sum_of(content) for path, content in contents.items()}
    return {**record, "files": dict(sorted(files.items()))}


def stale(record: Mapping[str, object], folder: Path) -> str:
    """Reason why the files in a folder are not the results of this record; empty if they are.

    The files of the result are compared, too: a run that was killed between two of them leaves the record of the run
    before, and a user may have changed one. Without a record it is :data:`NEW`.
    """
    earlier = _read(folder / RUN)
    if earlier is None:
        return NEW
    for key, words in _WORDS.items():
        if earlier.get(key) != record[key]:
            return words
    results = earlier.get("files")
    if not isinstance(results, dict) or not results:
        return _RESULTS
    for name, digest in results.items():
        try:
            if sum_of((folder / name).read_bytes()) != digest:
                return _RESULTS
        except OSError:
            return _RESULTS
    return ""


NEW = "not computed before"

_RESULTS = "its results were changed"

_WORDS = {
    "format": "its record is of another form",
    "tank2sim": "computed by another version",
    "card": "the card was changed",
    "trials": "the trials were changed",
    "holdout": "the trials held out were changed",
    "options": "the options were changed",
}


def sum_of(content: str | bytes) -> str:
    """SHA-256 of the bytes of a file's content, in hexadecimal."""
    return hashlib.sha256(content.encode("utf-8") if isinstance(content, str) else content).hexdigest()


def _sums(paths: Iterable[Path]) -> dict[str, str]:
    sums = {}
    for path in paths:
        try:
            sums[path.name] = sum_of(path.read_bytes())
        except OSError as error:
            raise InputError(path, "", f"cannot be read ({error.strerror})", "check its permissions") from None
    return sums


def _read(path: Path) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None
