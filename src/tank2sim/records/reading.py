"""One door for free-running trials of every known format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.records.csv_table import SHORTEST_STEP
from tank2sim.records.esso_osaka import is_esso_osaka, read_esso_osaka
from tank2sim.records.number_rows import read_bytes_as_text
from tank2sim.records.simman import is_simman, read_simman
from tank2sim.records.trial_csv import read_trial_csv
from tank2sim.records.trials import Trial

HEAD_BYTES = 4096
"""What of a file is looked at to tell whether it is a trial."""


def read_trial(path: Path | str, *, rising: bool = True) -> Trial:
    """Read a trial; its first line tells the format: the project's CSV, a SIMMAN ``.dat`` or an Esso Osaka CSV.

    Parameters
    ----------
    path : path
        The file.
    rising : bool
        Refuse a time that does not rise from row to row; False lets it through, for the audit to judge.

    Raises
    ------
    InputError
        The file is missing or of no known format, or its content is faulty; the message tells line and column.
    """
    path = Path(path)
    text = read_bytes_as_text(path)
    if is_esso_osaka(text):
        trial = read_esso_osaka(path)
    elif is_simman(text):
        trial = read_simman(path)
    elif path.suffix.lower() == ".dat":
        problem = "is no record of MARIN or HSVA: its first line names neither"
        raise InputError(path, "line 1", problem, "write it as a CSV with a header such as t_s,delta_deg,r_degps")
    else:
        trial = read_trial_csv(path)
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


def looks_like_a_trial(path: Path) -> bool:
    """True if a file's beginning is that of a trial of a known format: for folders that hold other files, too."""
    if path.suffix.lower() not in (".csv", ".dat"):
        return False
    with path.open("rb") as file:
        text = file.read(HEAD_BYTES).decode("latin-1")
    header = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return is_esso_osaka(text) or is_simman(text) or "t_s" in (name.strip() for name in header.split(","))


def _refuse_falling_time(trial: Trial) -> None:
    falls = np.flatnonzero(np.diff(trial.time_s) <= 0)
    if falls.size:
        row = int(falls[0]) + 1
        problem = f"{trial.time_s[row]:.10g} does not come after {trial.time_s[row - 1]:.10g} of the row before"
        remedy = "sort the rows and give each time once; 'tank2sim audit' tells more"
        raise InputError(trial.path, f"row {row + 1}, column {trial.heading('t_s')}", problem, remedy)
