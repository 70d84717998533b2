"""Free-running records of a 3 m model of the Esso Osaka on a pond (Osaka University 2020), with the measured wind.

Facts that the files do not state, found from them (13 runs): the rudder is positive to starboard (with way ahead its
angle and the rate of turn have one sign); u and v are body velocities at midship; the true wind direction is where the
wind comes from, clockwise from the x axis of the pond, and the relative one where it comes from, clockwise from the
bow: the relative wind follows from the true one, the velocities and the heading to 0.005 m/s rms, and the opposite
reading misses by 0.1 m/s to 0.5 m/s. As in the trial format, x is north, here also for the wind.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.records.csv_table import number_rows, read_bytes_as_text
from tank2sim.records.trials import Trial, TrialReader, unwrapped
from tank2sim.units import to_si

_COLUMNS = {
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


def is_esso_osaka(text: str) -> bool:
    """Whether a file begins as these records do."""
    return text.lstrip("\ufeff\xef\xbb\xbf").startswith("t [s],x_position_mid [m]")


def read_esso_osaka(path: Path | str) -> Trial:
    """Read a CSV of these records; times unchanged, blank rows at the end are passed over.

    Revolutions are in 1/s, negative astern; the rest is in SI.

    Raises InputError: A column is missing or unknown, or a row is faulty.
    """
    path = Path(path)
    lines = read_bytes_as_text(path).split("\n")
    heads = [head.strip() for head in next(csv.reader([lines[0].lstrip("\ufeff\xef\xbb\xbf")]))]
    for head in _COLUMNS:
        if heads.count(head) != 1:
            raise InputError(path, "line 1", f"there is not one column {head}", "give a record as it was published")
    rows = [(line, content.split(",")) for line, content in enumerate(lines[1:], start=2) if content.strip()]
    values = number_rows(path, rows, heads)
    filled = np.flatnonzero(~np.isnan(values).all(axis=1))
    values = values[: 1 + np.max(filled, initial=-1)]  # spreadsheets leave blank rows
    if len(values) < 2:
        raise InputError(path, "", "has no rows of measured values", "give the file as it was published")
    signals = {}
    columns = {}
    for head, heading in _COLUMNS.items():
        name, factor = to_si(heading, 1.0)
        signals[name] = factor * values[:, heads.index(head)]
        columns[name] = head
    time = signals.pop("t_s")
    signals["psi_rad"] = unwrapped(signals["psi_rad"])
    return Trial(path, time, signals, columns=columns)


ESSO_OSAKA = TrialReader(
    name="esso_osaka",
    description="CSV of the free-running Esso Osaka model (Osaka University 2020)",
    suffixes=(".csv",),
    recognises=is_esso_osaka,
    read=read_esso_osaka,
)
