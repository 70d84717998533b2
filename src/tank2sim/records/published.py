"""Published free-running records: models of the KVLCC2 (SIMMAN 2008, of MARIN and HSVA) and of the Esso Osaka.

SIMMAN: text header, then columns without names. The columns are read under the names published with the files, whether
or not they hold what these say: that is for the audit to find. Rudder angles are positive to port in both (trailing
edge to port) and turned here, once.

Esso Osaka: a 3 m model on a pond (Osaka University 2020), with the measured wind. Facts that the files do not state,
found from them (13 runs): the rudder is positive to starboard (with way ahead its angle and the rate of turn have one
sign); u and v are body velocities at midship; the true wind direction is where the wind comes from, clockwise from the
x axis of the pond, and the relative one where it comes from, clockwise from the bow: the relative wind follows from the
true one, the velocities and the heading to 0.005 m/s rms, and the opposite reading misses by 0.1 m/s to 0.5 m/s. As in
the trial format, x is north, here also for the wind.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.records.csv_table import CsvTable, read_bytes_as_text, table_of_rows
from tank2sim.records.trials import TRIAL_SIGNALS, Trial, TrialReader, unwrapped
from tank2sim.units import to_si

_Rows = Sequence[tuple[int, str]]  # Line of the file (from 1) and text of each row

KVLCC2_SCALE = 45.714
"""Length of the KVLCC2 (320 m) over the length of the models, 7.000 m at HSVA and at MARIN (SIMMAN 2008)."""


@dataclass(frozen=True)
class _Laboratory:
    columns: tuple[str, ...]
    omission: str
    values: str
    KVLCC2_length_m: float


_LABORATORIES = {
    "HSVA": _Laboratory(
        columns=tuple("t_s x_m y_m psi_deg u_mps v_mps r_degps heel delta_deg n_rps thrust_N torque_Nm".split()),
        omission="column 8 (probably heel), thrust and torque are not part of the trial format and left out",
        values="values are for the model",
        KVLCC2_length_m=7.0,
    ),
    "MARIN": _Laboratory(
        columns=tuple("t_s x_m y_m phi_deg psi_deg u_mps v_mps p_degps r_degps delta_deg n_rpm".split()),
        omission="the rate of roll is not a part of the trial format and left out",
        values="values are for the ship, scaled from a model",
        KVLCC2_length_m=320.0,
    ),
}


def read_simman(path: Path | str) -> Trial:
    """Read a ``.dat`` of MARIN (11 columns, full scale) or HSVA (12 columns, model scale); times unchanged.

    Times of MARIN have three digits and repeat beyond 100 s: they are replaced by a uniform time base that agrees with
    every time printed, and a notice says so.

    Raises InputError: The file is none of these, a row is faulty, or no uniform step explains its times.
    """
    path = Path(path)
    text = read_bytes_as_text(path)
    laboratory = _laboratory(text)
    if laboratory is None:
        problem = "is not a record of MARIN or HSVA: its first line names neither"
        raise InputError(path, "line 1", problem, "write it as a CSV with a header such as t_s,delta_deg,r_degps")
    header, rows = _split(text)
    table = _table(path, laboratory.columns, rows).si()
    signals = {name: column for name, column in table.columns.items() if name in TRIAL_SIGNALS}
    signals["psi_rad"] = unwrapped(signals["psi_rad"])
    signals["delta_rad"] = 0.0 - signals["delta_rad"]
    turned = "the rudder is positive to port in the file, to starboard here"
    notices = [Notice(text) for text in (laboratory.omission, laboratory.values, turned)]
    time = table.columns["t_s"]
    if np.any(np.diff(time) <= 0):
        time, notice = _uniform_time(path, rows)
        notices.append(notice)
    known = {name: head for name, head in table.headings.items() if name in signals and name != head}
    scale, length = (KVLCC2_SCALE, laboratory.KVLCC2_length_m) if "KVLCC2" in header else (None, None)
    return Trial(path, time, signals, scale=scale, notices=tuple(notices), columns=known, length_m=length)


def _table(path: Path, names: Sequence[str], rows: _Rows) -> CsvTable:
    """The table of rows of numbers with commas or blanks between them, and nan where nothing was recorded."""
    if len(rows) < 2:
        raise InputError(path, "", "has no rows of measured values", "give the file as it was published")
    lines = np.array([line for line, _ in rows], dtype=np.int64)
    texts = [re.sub(r"(?i)\bnan\b", "", text if "," in text else ",".join(text.split())) for _, text in rows]
    return table_of_rows(path, names, texts, lines)


def _laboratory(text: str) -> _Laboratory | None:
    first = text.lstrip().split("\n", 1)[0].strip()
    return next((laboratory for name, laboratory in _LABORATORIES.items() if first.startswith(name)), None)


def _split(text: str) -> tuple[str, _Rows]:
    """Header and rows: the header ends where a line begins with a number and has ten or more cells."""
    lines = list(enumerate(text.split("\n"), start=1))
    first = next((place for place, (_, line) in enumerate(lines) if _begins_rows(line.split())), len(lines))
    header = "\n".join(line for _, line in lines[:first])
    return header, [(number, line) for number, line in lines[first:] if line.strip()]


def _begins_rows(cells: list[str]) -> bool:
    try:
        return len(cells) >= 10 and float(cells[0]) is not None
    except ValueError:
        return False


def _uniform_time(path: Path, rows: _Rows) -> tuple[Array, Notice]:
    """Times of equal step, by least squares with half digits as weights, meeting each printed one; a notice."""
    cells = [line.split()[0] for _, line in rows]
    printed, half = np.array([float(cell) for cell in cells]), np.array([_half_a_digit(cell) for cell in cells])
    count = np.arange(len(rows))
    step = float(np.sum(count * (printed - printed[0]) / half**2) / np.sum((count / half) ** 2))
    time: Array = printed[0] + step * count
    missed = np.flatnonzero(np.abs(time - printed) > half + 0.5 * step)
    if step <= 0 or missed.size:
        place = f"line {rows[int(missed[0])][0] if missed.size else rows[0][0]}, column t_s"
        problem = "the times do not rise, and no uniform step explains them"
        raise InputError(path, place, problem, "give each row a time of its own")
    text = (
        "times are printed with so few digits that some repeat: replaced by a uniform step of "
        f"{step:.6g} s, which agrees with all of them"
    )
    return time, Notice(text)


def _half_a_digit(cell: str) -> float:
    """Half a unit of the last digit printed: ``1.23E+02`` gives 0.5."""
    mantissa, _, exponent = cell.upper().partition("E")
    decimals = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)


SIMMAN = TrialReader(
    name="simman",
    description="free-running records of MARIN and HSVA (SIMMAN 2008)",
    suffixes=(".dat",),
    recognises=lambda text: _laboratory(text) is not None,
    read=read_simman,
)


_ESSO_OSAKA_COLUMNS = {
    "t [s]": "t_s",
    "x_position_mid [m]": "x_m",
    "u_velo [m/s]": "u_mps",
    "y_position_mid [m]": "y_m",
    "vm_velo [m/s]": "v_mps",
    "psi_hat [rad]": "psi_rad",
    "r_angvelo [rad/s]": "r_radps",
    "n_prop [rps]": "n_rps",
    "delta_rudder [rad]": "delta_rad",
    "wind_velo_relative_mid [m/s]": "wind_rel_speed_mps",
    "wind_dir_relative_mid [rad]": "wind_rel_direction_rad",
    "wind_velo_true [m/s]": "wind_speed_mps",
    "wind_dir_true [rad]": "wind_direction_rad",
}


def read_esso_osaka(path: Path | str) -> Trial:
    """Read a CSV of these records; times unchanged, blank rows at the end are passed over.

    Revolutions are in 1/s, negative astern; the rest is in SI. Raises InputError: A column is missing or unknown, or a
    row is faulty.
    """
    path = Path(path)
    first, *lines = read_bytes_as_text(path).split("\n")
    heads = [head.strip(' "') for head in first.lstrip("\ufeff\xef\xbb\xbf").split(",")]
    for head in _ESSO_OSAKA_COLUMNS:
        if heads.count(head) != 1:
            raise InputError(path, "line 1", f"there is not one column {head}", "give a record as it was published")
    rows = [(number, line) for number, line in enumerate(lines, start=2) if line.strip()]
    while rows and not rows[-1][1].lower().replace("nan", "").strip(", "):
        rows.pop()  # spreadsheets leave blank rows
    table = _table(path, heads, rows)
    signals, columns = {}, {}
    for head, heading in _ESSO_OSAKA_COLUMNS.items():
        name, factor = to_si(heading, 1.0)
        signals[name], columns[name] = factor * table.columns[head], head
    time = signals.pop("t_s")
    signals["psi_rad"] = unwrapped(signals["psi_rad"])
    return Trial(path, time, signals, columns=columns)


ESSO_OSAKA = TrialReader(
    name="esso_osaka",
    description="CSV of the free-running Esso Osaka model (Osaka University 2020)",
    suffixes=(".csv",),
    recognises=lambda text: text.lstrip("\ufeff\xef\xbb\xbf").startswith("t [s],x_position_mid [m]"),
    read=read_esso_osaka,
)
