"""One door for free-running trials of every known format."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.files import first_bytes
from tank2sim.plugins import PluginWarning, Registry
from tank2sim.records.csv_table import SHORTEST_STEP, CsvTable, read_bytes_as_text
from tank2sim.records.published import ESSO_OSAKA, SIMMAN
from tank2sim.records.trial_csv import TRIAL_CSV, read_trial_csv
from tank2sim.records.trials import Trial, TrialReader, fault_of
from tank2sim.records.workbook import is_workbook, workbook_text

HEAD_BYTES = 4096
"""Bytes of a file that are read to decide whether it is a trial."""

READERS: Registry[TrialReader] = Registry("tank2sim.trial_readers", (TRIAL_CSV, ESSO_OSAKA, SIMMAN), TrialReader)
"""All formats of trials, installed packages included."""


def reader_of(path: Path) -> TrialReader:
    """The reader of a file: the first that recognises its beginning, else the first for its ending.

    The latter says what is wrong with the file. A file with an ending that no format has is taken for a trial CSV.

    Raises InputError: The file is missing or unreadable, or the reader of a package fails.
    """
    text = read_bytes_as_text(path)
    if is_workbook(text[:4].encode("latin-1")):
        text = workbook_text(path)
    for reader in READERS.values():
        if _recognises(reader, text):
            return reader
    suffix = path.suffix.lower()
    return next((reader for reader in READERS.values() if suffix in reader.suffixes), TRIAL_CSV)


def _recognises(reader: TrialReader, text: str) -> bool:
    """Whether a reader recognises a file; one that fails at this does not, and must not keep others from reading it."""
    try:
        return reader.recognises(text)
    except InputError as error:
        warnings.warn(str(error), PluginWarning, stacklevel=3)
        return False


def read_trial_file(path: Path | str | CsvTable, *, rising: bool = True) -> Trial:
    """Read a trial of any format of :data:`READERS`; its beginning shows which.

    `path`: The file, or the table of a data frame, which is read as the project's CSV. `rising`: Refuse a time that
    does not rise from row to row; False lets it through, for the audit to judge.

    Raises InputError: The file is missing or of no known format, or its content is faulty; the message names line and
    column.
    """
    if isinstance(path, CsvTable):
        reader, trial = TRIAL_CSV, read_trial_csv(path)
    else:
        reader = reader_of(Path(path))
        trial = reader.read(Path(path))
    path = trial.path
    if (origin := READERS.origin(reader.name)) and (problem := fault_of(trial)):
        raise origin.fault(f"{path.name}: {problem}")
    if np.isnan(trial.time_s).any():
        row = int(np.flatnonzero(np.isnan(trial.time_s))[0]) + 1
        raise InputError(path, f"column {trial.heading('t_s')}", f"row {row} has no time", "give each row its time")
    steps = np.abs(np.diff(trial.time_s))
    if len(steps) and np.median(steps) < SHORTEST_STEP and steps.max() > 0:
        problem = f"most rows are less than {SHORTEST_STEP:g} s apart"
        raise InputError(path, f"column {trial.heading('t_s')}", problem, "give the time in s")
    if rising:
        _refuse_falling_time(trial)
    return trial


def called_like_a_trial(path: Path) -> bool:
    """True if a file's name ends as trials of a known format do."""
    return any(path.suffix.lower() in reader.suffixes for reader in READERS.values())


def looks_like_a_trial(path: Path) -> bool:
    """True if name and first lines of a file fit a known format of trials: for folders with other files."""
    if not called_like_a_trial(path):
        return False
    text = first_bytes(path, HEAD_BYTES).decode("latin-1")
    if is_workbook(text[:4].encode("latin-1")):
        try:
            text = workbook_text(path)
        except InputError:
            return False
    return any(_recognises(reader, text) for reader in READERS.values())


def _refuse_falling_time(trial: Trial) -> None:
    falls = np.flatnonzero(np.diff(trial.time_s) <= 0)
    if falls.size:
        row = int(falls[0]) + 1
        problem = f"{trial.time_s[row]:.10g} does not come after {trial.time_s[row - 1]:.10g} of the row before"
        remedy = "sort the rows and give each time once; 'tank2sim audit' shows more"
        raise trial.fault(f"row {row + 1}, column {trial.heading('t_s')}", problem, remedy)
