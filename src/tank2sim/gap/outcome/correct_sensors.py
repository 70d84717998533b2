"""Trials without the faults of sensors that were found in them, and their files written again."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.sensors import correct_reading as without_fault
from tank2sim.files import BYTE_ORDER_MARK, read_exact_text
from tank2sim.gap.outcome.improve_card import Found, in_short
from tank2sim.records.audit import repair_trial
from tank2sim.records.csv_table import read_table
from tank2sim.records.reading import read_trial_file, reader_of
from tank2sim.records.signals.writing import trial_text
from tank2sim.records.trial_csv import TRIAL_CSV
from tank2sim.records.trials import RUDDERS, Trial
from tank2sim.units import from_si

REMAINING_FAULTS = "left as it is"
"""How a notice begins of a fault that cannot be corrected in a trial."""

DIGITS_OF_A_CORRECTION = 2
"""A corrected column has at least so many digits of the correction (project choice); others have those of the file."""


def correct_sensor_faults(trial: Trial, found: Sequence[Found]) -> Trial:
    """The trial as it would be without the faults of its sensors; its notices tell what was done.

    A fault stays, and a notice says so, where a signal is lacking with which another must be corrected.

    Parameters
    ----------
    trial : Trial
    found : sequence of Found
        In the order in which their model was built; what is no sensor's is passed over.
    """
    signals = dict(trial.signals)
    faults = [(name, values) for name, values, _ in found if EFFECTS[name].acts_on == "sensor"]
    messages = []
    for name, values in reversed(faults):  # the last fault acts on what the others show
        try:
            signals = without_fault(trial.time_s, signals, EFFECTS[name], values)
        except ValueError as error:
            messages.append(f"{REMAINING_FAULTS}: {error}")
        else:
            messages.append(f"corrected for {name}")
    return replace(trial, signals=signals, notices=(*trial.notices, *messages))


def corrected_text(path: Path, trial: Trial, found: Sequence[Found]) -> str | None:
    """Text of a trial's file with the columns corrected that faulty sensors had shown, and a comment that says so.

    Comments, other columns and their digits stay as they are in a trial CSV. Files of other formats, and those of which
    a corrected column had to be repaired before use, are written in the trial format at the size of the file.

    Parameters
    ----------
    path : Path
        The file as it was measured.
    trial : Trial
        What was read from it, repaired and scaled to the ship to which `found` applies.
    found : sequence of Found
        See :func:`correct_sensor_faults`.

    Returns
    -------
    str or None
        None if the trial has nothing that the faulty sensors show, or cannot be corrected.

    Raises
    ------
    InputError
        The file cannot be read any more.
    """
    raw = read_trial_file(path, rising=False)
    own, _ = repair_trial(raw)
    sized = _at_size_of(own, trial, found)
    fixed = correct_sensor_faults(own, sized)
    touched = [
        name for name in own.signals if not np.array_equal(own.signals[name], fixed.signals[name], equal_nan=True)
    ]
    if not touched:
        return None
    faults = [one for one in sized if EFFECTS[one[0]].acts_on == "sensor"]
    columns = ", ".join(own.heading(name) for name in touched)
    names = " and ".join(f"{fault[0]} ({in_short(*fault)})" for fault in faults)
    text = f"{columns} corrected by tank2sim gap for {names}"
    sheet = _sheet(path)
    if sheet is None or not _same(raw, own, touched):
        return trial_text(fixed, [f"from {path.name}", text])
    return _edited(sheet, _Columns(path, raw, fixed, touched), f"# {' '.join(text.split())}")


def _at_size_of(own: Trial, trial: Trial, found: Sequence[Found]) -> list[Found]:
    """Faults at the size of a file, from those at the ship's: by Froude's law, as in :func:`.trials.froude_scaled`."""
    scale = own.scale or 1.0
    tried = (1.0, scale, 1 / scale)
    span = trial.time_s[-1] - trial.time_s[0]
    ratio = min(tried, key=lambda one: abs(span - math.sqrt(one) * (own.time_s[-1] - own.time_s[0])))
    factors = {"m": 1 / ratio, "mps": ratio**-0.5, "s": ratio**-0.5, "radps": ratio**0.5}

    def small(values: Mapping[str, float]) -> dict[str, float]:
        return {name: value * factors.get(name.rpartition("_")[2], 1.0) for name, value in values.items()}

    return [(name, small(values), small(errors)) for name, values, errors in found]


def _same(raw: Trial, own: Trial, names: Sequence[str]) -> bool:
    """Whether columns and times of a file are used as they stand."""
    if len(raw.time_s) != len(own.time_s) or not np.array_equal(raw.time_s, own.time_s):
        return False
    return all(
        name in raw.signals and np.array_equal(raw.signals[name], own.signals[name], equal_nan=True) for name in names
    )


# -- editing a file ------------------------------------------------------------------------------------------------


def _sheet(path: Path) -> str | None:
    """Text of a trial CSV; None if it is another format, or has quoted cells."""
    if reader_of(path) is not TRIAL_CSV or b'"' in path.read_bytes():
        return None
    return read_exact_text(path)


@dataclass(frozen=True, eq=False)
class _Columns:
    """Columns of a file to be written again: what was read, what shall be read, and the names of those signals."""

    path: Path
    raw: Trial
    fixed: Trial
    names: Sequence[str]

    def written(self, old: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
        """Heading to new cells, from the old ones."""
        table = read_table(self.path)
        to_port = table.comments.get("rudder_sign", "").strip() == "port"
        found = {}
        for name in self.names:
            heading = self.raw.heading(name)
            before, after = (from_si(heading, 1.0) * one.signals[name] for one in (self.raw, self.fixed))
            if name in RUDDERS and to_port:
                before, after = -before, -after
            if name == "psi_rad":
                after = _as_wrapped(table.columns[heading], before, after, from_si(heading, 2 * math.pi))
            form = _form(old[heading], after - before)
            found[heading] = ["" if math.isnan(value) else form(value + 0.0) for value in after.tolist()]
        return found


def _as_wrapped(shown: Array, before: Array, after: Array, turn: float) -> Array:
    """Headings after the correction, wrapped as the file has those before (from 0 to a turn, about 0, or not)."""
    found = shown + (after - before)
    lowest, highest = float(np.nanmin(shown)), float(np.nanmax(shown))
    if highest - lowest < turn / 2:  # it does not come to where it would wrap
        return found
    if lowest >= 0 and highest <= turn:
        return np.asarray(np.mod(found, turn))
    if lowest >= -turn / 2 and highest <= turn / 2:
        return np.asarray(np.mod(found + turn / 2, turn) - turn / 2)
    return found


_SCIENTIFIC = re.compile(r"[eE]")


def _form(cells: Sequence[str], change: Array) -> Callable[[float], str]:
    """How numbers are written in a column: with its digits, and enough for the correction."""
    if any(_SCIENTIFIC.search(cell) for cell in cells):
        digits = max(len(_SCIENTIFIC.split(cell)[0].partition(".")[2]) for cell in cells)
        return lambda value: f"{value:.{max(digits, 6)}e}"
    decimals = max(len(cell.partition(".")[2]) for cell in cells)
    size = float(np.nanmax(np.abs(change), initial=0.0))
    needed = 0 if size == 0 else math.ceil(DIGITS_OF_A_CORRECTION - math.log10(size))
    return lambda value: f"{value:.{max(decimals, min(needed, 12))}f}"


def _edited(text: str, columns: _Columns, comment: str) -> str:
    """The text with the cells of some columns replaced, and a comment line in front."""
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    lines = re.split(r"(\r\n|\r|\n)", text.removeprefix(mark))  # ends of lines in between
    end = lines[1] if len(lines) > 1 else "\n"
    rows = [
        place for place in range(0, len(lines), 2) if lines[place].strip() and not lines[place].lstrip().startswith("#")
    ]
    cells = [lines[place].split(",") for place in rows]
    heads = [head.strip() for head in cells[0]]
    places = {heading: heads.index(heading) for heading in map(columns.raw.heading, columns.names)}
    old = {heading: [row[place].strip() for row in cells[1:]] for heading, place in places.items()}
    for heading, new in columns.written(old).items():
        for row, cell in zip(cells[1:], new, strict=True):
            row[places[heading]] = cell
    for place, row in zip(rows, cells, strict=True):
        lines[place] = ",".join(row)
    return f"{mark}{comment}{end}{''.join(lines)}"
