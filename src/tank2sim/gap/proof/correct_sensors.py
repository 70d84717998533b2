"""Correction of the sensor faults found in trials, and of their files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.form import ThrusterSection
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.sensors import correct_reading as without_fault
from tank2sim.files import BYTE_ORDER_MARK, read_exact_text
from tank2sim.gap.improve_card import Found, in_short
from tank2sim.notices import Notice, caution
from tank2sim.records.audit import repair_trial
from tank2sim.records.craft_trials import read_craft_trial
from tank2sim.records.csv_table import read_table, text_with_commas
from tank2sim.records.reading import read_trial_file, reader_of
from tank2sim.records.signals.writing import trial_text
from tank2sim.records.trial_csv import TRIAL_CSV
from tank2sim.records.trials import RUDDERS, Trial
from tank2sim.records.workbook import is_workbook
from tank2sim.units import from_si

DIGITS_OF_A_CORRECTION = 2
"""Significant digits of the correction in a corrected column, at least (project choice); other columns stay
unchanged."""


def correct_sensor_faults(trial: Trial, found: Sequence[Found]) -> Trial:
    """The trial without the faults of its sensors; its notices list the corrections.

    A fault stays, and a notice says so, where a signal is missing with which another must be corrected.

    Parameters
    ----------
    trial : Trial
    found : sequence of Found
        In the order in which their model was built; effects of other kinds are ignored.
    """
    signals = dict(trial.signals)
    faults = [(name, values) for name, values, _ in found if EFFECTS[name].acts_on == "sensor"]
    messages = []
    for name, values in reversed(faults):  # the last fault acts on the readings of the others
        try:
            signals = without_fault(trial.time_s, signals, EFFECTS[name], values)
        except ValueError as error:
            messages.append(caution(f"left as it is: {error}"))
        else:
            messages.append(Notice(f"corrected for {name}"))
    return replace(trial, signals=signals, notices=(*trial.notices, *messages))


def corrected_text(
    path: Path, trial: Trial, found: Sequence[Found], thrusters: Sequence[ThrusterSection] = ()
) -> str | None:
    """Text of a trial's file with the columns of faulty sensors corrected, and a comment that says so.

    Comments, other columns and their digits stay as they are in a trial CSV. Files of other formats, and those of which
    a corrected column had to be repaired before use, are written in the trial format at the size of the file.

    Parameters
    ----------
    path : Path
        The file as it was measured.
    trial : Trial
        Its data, repaired and scaled to the ship to which `found` applies.
    found : sequence of Found
        See :func:`correct_sensor_faults`.
    thrusters : sequence of ThrusterSection
        Thrusters of the craft that was tried; none of a ship with a rudder.

    Returns
    -------
    str or None
        None if the trial has no signal of the faulty sensors, or cannot be corrected.

    Raises
    ------
    InputError
        The file cannot be read any more.
    """
    if in_file := path.is_file():
        raw = read_craft_trial(path, thrusters) if thrusters else read_trial_file(path, rising=False)
        repaired = raw if thrusters else repair_trial(raw)[0]
        sized = _at_size_of(repaired, trial, found)
    else:  # a data frame: written at the size of the ship
        raw, repaired, sized = trial, trial, list(found)
    fixed = correct_sensor_faults(repaired, sized)
    touched = [name for name in repaired.signals if not _equal_signal(repaired, fixed, name)]
    if not touched:
        return None
    faults = [fault for fault in sized if EFFECTS[fault[0]].acts_on == "sensor"]
    columns = ", ".join(repaired.heading(name) for name in touched)
    names = " and ".join(f"{fault[0]} ({in_short(*fault)})" for fault in faults)
    text = f"{columns} corrected by tank2sim gap for {names}"
    sheet = _sheet(path) if in_file else None
    if sheet is None or not _same(raw, repaired, touched):
        return trial_text(fixed, [f"from {path.name}", text])
    return _edited(sheet, _Columns(path, raw, fixed, touched), f"# {' '.join(text.split())}")


def _at_size_of(repaired: Trial, trial: Trial, found: Sequence[Found]) -> list[Found]:
    """Faults at the size of a file, from those at the ship's: by Froude's law, as in :func:`.trials.froude_scaled`."""
    scale = repaired.scale or 1.0
    tried = (1.0, scale, 1 / scale)
    span = trial.time_s[-1] - trial.time_s[0]
    file_span = repaired.time_s[-1] - repaired.time_s[0]
    ratio = min(tried, key=lambda candidate: abs(span - math.sqrt(candidate) * file_span))
    factors = {"m": 1 / ratio, "mps": ratio**-0.5, "s": ratio**-0.5, "radps": ratio**0.5}

    def small(values: Mapping[str, float]) -> dict[str, float]:
        return {name: value * factors.get(name.rpartition("_")[2], 1.0) for name, value in values.items()}

    return [(name, small(values), small(errors)) for name, values, errors in found]


def _same(raw: Trial, repaired: Trial, names: Sequence[str]) -> bool:
    """Whether columns and times of a file are used unchanged."""
    return np.array_equal(raw.time_s, repaired.time_s) and all(_equal_signal(raw, repaired, name) for name in names)


def _equal_signal(first: Trial, second: Trial, name: str) -> bool:
    return name in first.signals and np.array_equal(first.signals[name], second.signals[name], equal_nan=True)


# -- editing a file ------------------------------------------------------------------------------------------------


def _sheet(path: Path) -> str | None:
    """Text of a trial CSV; None if it is another format, or has quoted cells or no commas between them."""
    data = path.read_bytes()
    if reader_of(path) is not TRIAL_CSV or b'"' in data or is_workbook(data):
        return None
    text = read_exact_text(path)
    return text if text_with_commas(path, text) == text else None


@dataclass(frozen=True, eq=False)
class _Columns:
    """Columns of a file to be rewritten: the signals as read, the corrected ones, and the names of the changed ones."""

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
            before, after = (from_si(heading, 1.0) * trial.signals[name] for trial in (self.raw, self.fixed))
            if name in RUDDERS and to_port:
                before, after = -before, -after
            if name == "psi_rad":
                after = _as_wrapped(table.columns[heading], before, after, from_si(heading, 2 * math.pi))
            form = _form(old[heading], after - before)
            found[heading] = ["" if math.isnan(value) else form(value + 0.0) for value in after.tolist()]
        return found


def _as_wrapped(shown: Array, before: Array, after: Array, turn: float) -> Array:
    """Headings after the correction, wrapped as in the file (from 0 to 360 deg, about 0, or not at all)."""
    found = shown + (after - before)
    lowest, highest = float(np.nanmin(shown)), float(np.nanmax(shown))
    if highest - lowest < turn / 2:  # it does not reach the wrap
        return found
    if lowest >= 0 and highest <= turn:
        return np.asarray(np.mod(found, turn))
    if lowest >= -turn / 2 and highest <= turn / 2:
        return np.asarray(np.mod(found + turn / 2, turn) - turn / 2)
    return found


_SCIENTIFIC = re.compile(r"[eE]")


def _form(cells: Sequence[str], change: Array) -> Callable[[float], str]:
    """Format of the numbers of a column: with its digits, and enough for the correction."""
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
    lines = re.split(r"(\r\n|\r|\n)", text.removeprefix(mark))  # line ends in between
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
