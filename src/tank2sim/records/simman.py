"""SIMMAN 2008 free-running records of MARIN and HSVA: text header, then columns without names.

The columns are read under the names published with the files, whether or not they hold what these say: that is for
the audit to find. Rudder angles are positive to port in both (trailing edge to port) and turned here, once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.records.csv_table import NumberRows, number_rows, read_bytes_as_text
from tank2sim.records.trials import TRIAL_SIGNALS, Trial, TrialReader, unwrapped
from tank2sim.units import to_si

KVLCC2_SCALE = 45.714
"""Length of the KVLCC2 (320 m) over that of the models, 7.000 m at HSVA and at MARIN (SIMMAN 2008)."""


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
        values="values are those of the model",
        KVLCC2_length_m=7.0,
    ),
    "MARIN": _Laboratory(
        columns=tuple("t_s x_m y_m phi_deg psi_deg u_mps v_mps p_degps r_degps delta_deg n_rpm".split()),
        omission="the rate of roll is not a part of the trial format and left out",
        values="values are those of the ship, scaled from a model",
        KVLCC2_length_m=320.0,
    ),
}


def is_simman(text: str) -> bool:
    """Whether the first line of a file names a laboratory whose records are known here."""
    return _laboratory(text) is not None


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
    values = number_rows(path, rows, laboratory.columns)
    named = {
        name: factor * column
        for (name, factor), column in zip((to_si(head, 1.0) for head in laboratory.columns), values.T, strict=True)
    }
    columns = {to_si(head, 1.0)[0]: head for head in laboratory.columns}
    signals: dict[str, Array] = {name: column for name, column in named.items() if name in TRIAL_SIGNALS}
    signals["psi_rad"] = unwrapped(signals["psi_rad"])
    signals["delta_rad"] = 0.0 - signals["delta_rad"]
    notices = [
        Notice(laboratory.omission),
        Notice(laboratory.values),
        Notice("the rudder is positive to port in the file, to starboard here"),
    ]
    time = named["t_s"]
    if np.any(np.diff(time) <= 0):
        time, notice = _uniform_time(path, rows)
        notices.append(notice)
    known = {name: head for name, head in columns.items() if name in signals and name != head}
    tanker = "KVLCC2" in header
    return Trial(
        path,
        time,
        signals,
        scale=KVLCC2_SCALE if tanker else None,
        notices=tuple(notices),
        columns=known,
        length_m=laboratory.KVLCC2_length_m if tanker else None,
    )


def _laboratory(text: str) -> _Laboratory | None:
    first = text.lstrip().split("\n", 1)[0].strip()
    known: Mapping[str, _Laboratory] = _LABORATORIES
    return next((laboratory for name, laboratory in known.items() if first.startswith(name)), None)


def _split(text: str) -> tuple[str, NumberRows]:
    """Header and rows: the header ends where a line begins with a number and has ten or more cells."""
    header: list[str] = []
    rows: list[tuple[int, list[str]]] = []
    for line, content in enumerate(text.split("\n"), start=1):
        cells = content.split()
        if rows or _begins_rows(cells):
            if cells:
                rows.append((line, cells))
        else:
            header.append(content)
    return "\n".join(header), rows


def _begins_rows(cells: list[str]) -> bool:
    try:
        return len(cells) >= 10 and float(cells[0]) is not None
    except ValueError:
        return False


def _uniform_time(path: Path, rows: NumberRows) -> tuple[Array, Notice]:
    """Times of equal step that agree with every time printed, and messages about them.

    A time printed as 1.23E+02 lies within half a unit of its last digit, evenly: the step is the least-squares one
    with these halves as weights. A sample lost or doubled would shift the rest by a step, so that every time printed
    must be met to its half digit and half a step.
    """
    printed = np.array([float(cells[0]) for _, cells in rows])
    half = np.array([_half_a_digit(cells[0]) for _, cells in rows])
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
    recognises=is_simman,
    read=read_simman,
)
