"""The project's own trial files: a CSV whose column names contain the units, with comment lines."""

from __future__ import annotations

import difflib
import re
from pathlib import Path

import numpy as np

from tank2sim.arguments import PositiveArgument
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.trials import MEASURED_COLUMNS, RUDDERS, TRIAL_SIGNALS, Trial, TrialReader, unwrapped
from tank2sim.units import to_si

COMMENT_KEYS = ("rudder_sign", "noise", "scale")
"""Comments that are understood."""


def read_trial_csv(path: Path | str | CsvTable) -> Trial:
    """Read a trial such as ``t_s,delta_deg,n_rpm,u_mps,v_mps,r_degps,psi_deg,x_m,y_m``; times unchanged.

    Comment lines: ``# rudder_sign: port`` turns rudder angles and orders to positive to starboard; ``# noise: u_mps
    0.03, psi_deg 0.1`` states standard deviations; ``# scale: 45.714`` the length of the ship over the model's;
    ``# origin: 54.4 10.3`` latitude and longitude of x = y = 0 (any other text behind ``# origin:`` is free).
    Columns that are not part of the format are left out, and a notice names them.

    Raises InputError: The table is at fault (:func:`tank2sim.records.csv_table.read_table`); there is no ``t_s`` in
    each row, no rudder or nothing measured; a column has the name of a signal and another unit; a comment is not
    understood.
    """
    raw = read_table(path)
    raw.refuse_misspelt_keys(COMMENT_KEYS)
    table = raw.si()
    time = table.filled_column("t_s", "give each row its time")
    signals = {name: values for name, values in table.columns.items() if name in TRIAL_SIGNALS}
    notices = _omitted(table)
    _check_content(table, signals)
    if "psi_rad" in signals:
        signals["psi_rad"] = unwrapped(signals["psi_rad"])
    if _rudder_sign(table) == "port":
        signals |= {name: 0.0 - signals[name] for name in RUDDERS if name in signals}
        notices.append(Notice("the rudder is positive to port in the file, and to starboard here"))
    scale = table.bounded_comment("scale", PositiveArgument)
    columns = {name: table.heading(name) for name in signals if table.heading(name) != name}
    return Trial(table.path, time, signals, _noise(table), scale, tuple(notices), columns, origin_deg=_origin(table))


def _omitted(table: CsvTable) -> list[Notice]:
    """A notice of the columns that are not part of the format; those that look like slips are refused."""
    omitted = [name for name in table.columns if name not in ("t_s", *TRIAL_SIGNALS)]
    _refuse_slips(table, omitted)
    text = ", ".join(map(table.heading, omitted))
    return [Notice(f"columns that are not part of the trial format are left out: {text}")] if omitted else []


def _origin(table: CsvTable) -> tuple[float, float] | None:
    """Latitude and longitude, deg, of the comment ``origin``; None where it is absent or says something else."""
    try:
        latitude, longitude = (float(word) for word in table.comments.get("origin", "").split())
    except ValueError:
        return None
    return (latitude, longitude) if abs(latitude) <= 90 and abs(longitude) <= 360 else None


def _refuse_slips(table: CsvTable, names: list[str]) -> None:
    """Refuse columns that look like signals misspelt or with a unit that they cannot have, all in one message."""
    near = {name: SignalName(signal).file for name in names if (signal := _meant(name)) is not None}
    if not near:
        return
    if len(near) == 1:
        ((name, right),) = near.items()
        remedy = f"call it as {right} (or with another unit of that kind), or delete the column"
        raise table.fault(f"column {table.heading(name)}", "is not a signal of a trial", remedy)
    columns = ", ".join(table.heading(name) for name in near)
    remedy = "call them as " + ", ".join(near.values()) + " (or with other units of that kind), or delete the columns"
    raise table.fault(f"columns {columns}", "are not signals of a trial", remedy)


def _meant(name: str) -> str | None:
    """The signal that the name of a column resembles, if any."""
    stem = name.rpartition("_")[0] or name
    stems = {signal: signal.rpartition("_")[0] for signal in TRIAL_SIGNALS}
    same = [signal for known in (name, stem) for signal in TRIAL_SIGNALS if stems[signal] == known]
    return next(iter(same or difflib.get_close_matches(name, TRIAL_SIGNALS, n=1, cutoff=0.85)), None)


def _without_rudder(table: CsvTable) -> InputError:
    if craft := [table.heading(name) for name in table.columns if re.match(r"order_\w|n_\w+_", name)]:
        problem = f"there is no rudder; by {', '.join(craft)} it is a trial of a craft with thrusters"
        remedy = "identify, validate and gap take it with its card; for a ship with a rudder add delta_deg"
        return table.fault("header", problem, remedy)
    present = ", ".join(map(table.heading, table.columns))
    remedy = f"add delta_deg (angle) or delta_order_deg (order); the columns are {present}"
    return table.fault("header", "there is no rudder", remedy)


def _check_content(table: CsvTable, signals: dict[str, Array]) -> None:
    if not signals.keys() & RUDDERS:
        raise _without_rudder(table)
    for name in ("wind_speed_mps", "current_speed_mps"):
        if name in signals and np.any(signals[name] < 0):
            remedy = "a speed is 0 or more, and its direction says where it goes or comes from"
            raise table.fault(f"column {table.heading(name)}", "has negative values", remedy)
    if not signals.keys() & MEASURED_COLUMNS:
        remedy = "add at least one measured column, such as r_degps, psi_deg or u_mps"
        raise table.fault("header", "nothing measured is in it", remedy)
    if len(table.lines) < 2:
        raise table.fault("", "has a single row", "give the manoeuvre row by row")
    for name, values in signals.items():
        if np.isnan(values).all():
            raise table.fault(f"column {table.heading(name)}", "has no value", "delete the column")


def _rudder_sign(table: CsvTable) -> str:
    sign = table.comments.get("rudder_sign", "starboard").strip()
    if sign not in ("port", "starboard"):
        raise table.fault("comment rudder_sign", f"is {sign!r}", "write port or starboard")
    return sign


def _noise(table: CsvTable) -> dict[str, float]:
    """Stated standard deviations by signal, SI."""
    stated: dict[str, float] = {}
    if "noise" not in table.comments:
        return stated
    for part in table.comments["noise"].replace("\n", ",").split(","):
        words = part.split()
        if not words:
            continue
        try:
            name, value = to_si(words[0], float(words[1]))
        except (IndexError, ValueError):
            name, value = words[0], np.nan
        if len(words) != 2 or not 0 < value < np.inf:
            remedy = "write such as '# noise: u_mps 0.03, psi_deg 0.1', with positive standard deviations"
            raise table.fault("comment noise", f"{part.strip()!r} is not understood", remedy)
        if name not in TRIAL_SIGNALS or name not in table.columns:
            raise table.fault("comment noise", f"there is no column {words[0]}", "name a measured column")
        stated[name] = value
    return stated


def _has_time_column(text: str) -> bool:
    """Whether the first line that is not a comment names a column ``t_s``."""
    lines = text.removeprefix("\xef\xbb\xbf").splitlines()
    header = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return "t_s" in (name.strip(' "\r') for name in re.split("[,;\t]", header))


TRIAL_CSV = TrialReader(
    name="trial_csv",
    description="CSV whose column names have the units, or a spreadsheet with such a first sheet",
    suffixes=(".csv", ".xlsx"),
    recognises=_has_time_column,
    read=read_trial_csv,
)
