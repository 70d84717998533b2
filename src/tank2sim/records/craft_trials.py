"""Trials of a craft with thrusters: CSV files with revolutions of each thruster in place of a rudder."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.records.csv_table import read_table
from tank2sim.records.trials import Trial

CRAFT_SIGNALS = ("x_m", "y_m", "psi_rad", "r_radps", "u_mps", "v_mps")
"""Signals that are compared with the motion of a craft; position and heading suffice."""

LEAST_CRAFT_ROWS = 20
"""Fewest rows of a trial. Project choice: a few seconds at the rates of small receivers."""


def read_craft_trial(path: Path, thrusters: Sequence[str]) -> Trial:
    """A trial with the column ``n_<name>_rpm`` of each of the `thrusters`, as ``tank2sim log`` cuts it; SI.

    Parameters
    ----------
    path : Path
    thrusters : sequence of str
        Names of the card's thrusters.

    Raises
    ------
    InputError
        Revolutions, positions or heading are missing, or the time does not rise.
    """
    table = read_table(Path(path)).si()
    columns, time = table.columns, table.increasing("t_s")
    if len(time) < LEAST_CRAFT_ROWS:
        raise InputError(path, "", f"has {len(time)} rows", f"at least {LEAST_CRAFT_ROWS} are needed")
    driven = [f"n_{name}_radps" for name in thrusters]
    for name in (*driven, "x_m", "y_m", "psi_rad"):
        if name not in columns or not np.isfinite(columns[name]).any():
            remedy = f"a craft with thrusters {', '.join(thrusters)} needs t_s, x_m, y_m, psi_deg and "
            remedy += ", ".join(f"n_{thruster}_rpm" for thruster in thrusters)
            raise InputError(path, "header", f"lacks {re.sub('_rad$', '_deg', name.replace('_radps', '_rpm'))}", remedy)
    signals = {name: columns[name] for name in (*driven, *CRAFT_SIGNALS) if name in columns}
    known = np.isfinite(signals["psi_rad"])
    psi = signals["psi_rad"].copy()
    psi[known] = np.unwrap(psi[known])
    return Trial(Path(path), time, signals | {"psi_rad": psi})
