"""Trials of a craft with thrusters: CSV files with revolutions of each thruster in place of a rudder."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from tank2sim.arrays import Array
from tank2sim.cards.form import ThrusterSection
from tank2sim.errors import InputError
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.records.trials import Trial, unwrapped

CRAFT_SIGNALS = ("x_m", "y_m", "psi_rad", "r_radps", "u_mps", "v_mps")
"""Signals that are compared with the motion of a craft; position and heading suffice."""

ROUNDED_ORDER = 0.01
"""By how much an order may be beyond 1: rounding of pulse widths (project choice)."""

MOST_REPEATED = 4
"""Rows in a row that repeat a position because the recorder is faster than the receiver; more are a craft at rest
(project choice)."""

LEAST_CRAFT_ROWS = 20
"""Fewest rows of a trial. Project choice: a few seconds at the rates of small receivers."""


def read_craft_trial(path: Path | CsvTable, thrusters: Sequence[ThrusterSection]) -> Trial:
    """A trial with the column ``n_<name>_rpm`` or ``order_<name>`` of each thruster, as ``tank2sim log`` cuts it; SI.

    An order is a share of the largest revolutions of the card, positive ahead, and becomes the signal
    ``order_<name>_radps``; measured revolutions are ``n_<name>_radps``. A thruster that turns, an outboard, needs the
    column ``azimuth_<name>_deg`` (clockwise from the bow); of a single one ``delta_deg`` or ``delta_order_deg`` and
    ``n_rpm`` do, as ``tank2sim log`` cuts them.

    `path`: The file, or the table of a data frame. `thrusters`: Thrusters of the card.

    Raises InputError: Revolutions and orders, positions or heading are missing, an order is beyond 1, or the time does
    not rise.
    """
    table = read_table(path).si()
    path = table.path
    time = table.increasing("t_s")
    if len(time) < LEAST_CRAFT_ROWS:
        raise InputError(path, "", f"has {len(time)} rows", f"at least {LEAST_CRAFT_ROWS} are needed")
    signals = _driving_signals(table, thrusters)
    signals |= {name: table.columns[name] for name in CRAFT_SIGNALS if name in table.columns}
    held = _held(signals["x_m"], signals["y_m"])
    signals |= {name: np.where(held, np.nan, signals[name]) for name in ("x_m", "y_m")}
    headings = {name: table.heading(name) for name in CRAFT_SIGNALS if name in signals}
    return Trial(path, time, signals | {"psi_rad": unwrapped(signals["psi_rad"])}, columns=headings)


def _driving_signals(table: CsvTable, thrusters: Sequence[ThrusterSection]) -> dict[str, Array]:
    """Revolutions, orders and directions of the thrusters; refused without them, a position or the heading."""
    path, columns = table.path, table.columns
    shaft = columns.get("n_radps") if len(thrusters) == 1 else None  # of the log, if single
    driven = {f"n_{thruster.name}_radps": columns.get(f"n_{thruster.name}_radps", shaft) for thruster in thrusters}
    orders = {f"order_{thruster.name}_radps": _ordered(path, thruster, columns) for thruster in thrusters}
    needed = () if all(map(_known, orders.values())) else driven
    present = {**columns, **driven}
    missing = next((name for name in (*needed, "x_m", "y_m", "psi_rad") if not _known(present.get(name))), None)
    if missing is not None:
        raise _without_column(table, missing, thrusters)
    every = driven | _azimuths(path, thrusters, columns) | orders
    return {name: values for name, values in every.items() if _known(values)}


def _without_column(table: CsvTable, name: str, thrusters: Sequence[ThrusterSection]) -> InputError:
    every, measured, ordered = (
        ", ".join(form.format(thruster.name) for thruster in thrusters) for form in ("{}", "n_{}_rpm", "order_{}")
    )
    remedy = f"a craft with thrusters {every} needs t_s, x_m, y_m, psi_deg and of each thruster {measured} or its order"
    in_file = re.sub("_rad$", "_deg", name.replace("_radps", "_rpm"))
    return table.fault("header", f"lacks {in_file}", f"{remedy}, {ordered}")


def _held(x: Array, y: Array) -> NDArray[np.bool_]:
    """Rows (n,) in which a recorder faster than its receiver repeats a position: a few in a row, exactly the same."""
    same = np.concatenate([[False], (np.diff(x) == 0) & (np.diff(y) == 0)])
    runs, _ = label(same)
    return np.asarray(same & (np.bincount(runs)[runs] <= MOST_REPEATED))


def _azimuths(path: Path, thrusters: Sequence[ThrusterSection], columns: Mapping[str, Array]) -> dict[str, Array]:
    """Directions of the thrusters that turn, or as ordered; a single one may be a rudder; a missing one is refused."""
    found = {}
    turning = [thruster for thruster in thrusters if thruster.max_azimuth_rad is not None]
    single = len(turning) == 1
    for thruster in turning:
        name, side = thruster.name, 1.0 if thruster.x_m > 0 else -1.0
        shown = [(f"azimuth_{name}_rad", f"azimuth_{name}_rad", 0.0, 1.0)]  # signal, column, its zero and its sign
        if single:
            shown.append((f"azimuth_{name}_rad", "delta_rad", thruster.azimuth_rad, side))
            shown.append((f"azimuth_order_{name}_rad", "delta_order_rad", thruster.azimuth_rad, side))
        known = [way for way in shown if _known(columns.get(way[1]))]
        if not known:
            remedy = f"thruster {name} turns: give azimuth_{name}_deg, in which it pushes the craft, clockwise from the"
            remedy += " bow, or delta_deg, positive to starboard" if single else " bow"
            raise InputError(path, "header", f"lacks azimuth_{name}_deg", remedy)
        signal, column, zero, sign = known[0]
        found[signal] = zero + sign * columns[column]
    return found


def _known(values: Array | None) -> TypeGuard[Array]:
    return values is not None and bool(np.isfinite(values).any())


def _ordered(path: Path, thruster: ThrusterSection, columns: Mapping[str, Array]) -> Array | None:
    """Ordered revolutions (n,), rad/s: shares of the largest ones, ahead or astern."""
    share = columns.get(f"order_{thruster.name}")
    if share is None:
        return None
    if np.nanmax(np.abs(share), initial=0.0) > 1 + ROUNDED_ORDER:
        problem = f"reaches {np.nanmax(np.abs(share)):.3g}"
        raise InputError(path, f"column order_{thruster.name}", problem, "give shares of the largest order, -1 to 1")
    return np.asarray(share * np.where(share >= 0, thruster.max_radps, -thruster.lowest_radps))
