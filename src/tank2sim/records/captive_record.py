"""One captive run: what a carriage did to a model and what its gauges read, from a file of its own.

A :class:`CaptiveRun` is in SI and radians, whatever its file says: the rudder positive to starboard, ``drift_rad`` is
beta = -asin(v/U), ``speed_mps`` is the speed U through the water. ``X_N``, ``Y_N``, ``N_Nm`` are in the *hydrodynamic*
sense: positive as the water pushes the model (forward, to starboard, bow to starboard). Unless
:attr:`.Campaign.inertia_removed`, they still hold the reaction of the carried body's inertia: Y_N = Y_hydrodynamic -
m (v' + u r + x_G r'). So a file ``on_model`` has its signs changed, one ``on_gauge`` keeps them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.records.campaign_form import OSCILLATING, ColumnEntry, FilesSection, RunSheet, RunType, TankTest
from tank2sim.records.csv_table import CsvTable
from tank2sim.records.run_tables import read_run_table

FORCE_COLUMNS = {"X": "X_N", "Y": "Y_N", "N": "N_Nm"}
"""Force to its column in a run."""
FORCE_UNITS_SI = {"X": "N", "Y": "N", "N": "N m"}


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptiveRun:
    """One captive run."""

    name: str  # Its file's name, or ``captive.csv line 12`` for a row of averages
    type: RunType  # One of :data:`tank2sim.records.campaign_form.RUN_TYPES`
    sheet: RunSheet  # What the test sheet says (SI, rudder to starboard); None where it is silent
    time_s: Array  # (rows,): Rising; a single 0 for a row of averages
    # `v_mps`, `r_radps`, `speed_mps`, `delta_rad`: (rows,): Sway velocity, yaw rate, speed U through the water, rudder
    # angle
    v_mps: Array
    r_radps: Array
    speed_mps: Array
    delta_rad: Array
    # `X_N`, `Y_N`, `N_Nm`: (rows,): Forces and moment in the hydrodynamic sense (see the module), about midships
    X_N: Array
    Y_N: Array
    N_Nm: Array
    # `y_m`, `psi_rad`: (rows,): Sideways position in the tank and heading against its axis
    y_m: Array | None = None
    psi_rad: Array | None = None
    propeller_radps: float | None = None  # Revolutions: the mean of the record, or from the sheet
    # `thrust_N`, `rudder_normal_force_N`: (rows,): Thrust of the propeller, positive forward; force of the water on the
    # rudder, positive to port; with two, right side first, then left
    thrust_N: Array | None = None
    rudder_normal_force_N: Array | None = None
    thrust_left_N: Array | None = None
    rudder_normal_force_left_N: Array | None = None
    torque_Nm: Array | None = None  # (rows,): That the propeller takes
    heel_rad: float = 0.0  # At which the model is held, positive to starboard
    force_delay_s: float = 0.0  # By how much the forces lag the motion

    @property
    def is_average(self) -> bool:
        """A row of averages: one reading without a history."""
        return len(self.time_s) == 1

    @property
    def oscillates(self) -> bool:
        """The model oscillates in it."""
        return self.type in OSCILLATING

    @property
    def duration_s(self) -> float:
        """Length of the record, the last sample's own interval included."""
        count = len(self.time_s)
        return float(self.time_s[-1] - self.time_s[0]) * count / (count - 1) if count > 1 else 0.0

    def force(self, name: str) -> Array:
        """``X``, ``Y`` (N) or ``N`` (N m), (rows,)."""
        return np.asarray(getattr(self, FORCE_COLUMNS[name]))


def read_captive_run(
    path: Path, sheet: RunSheet, test: TankTest, columns: Mapping[str, ColumnEntry | str], files: FilesSection
) -> CaptiveRun:
    """Read one captive run from its file.

    `path`: The file, of any layout (:func:`tank2sim.records.run_tables.read_run_table`); `sheet`: What the test sheet
    says of it; `test`: Signs, speed and delay; `columns`: Column of the file to its quantity; `files`: Layout of text
    files.

    Raises InputError: The file cannot be read, or lacks a column.
    """
    table = read_run_table(path, columns, files)
    time = table.increasing("t_s") - float(table.column("t_s")[0])
    side = -1.0 if test.rudder_sign == "port" else 1.0
    if sheet.rudder_rad is not None:
        sheet = sheet.model_copy(update={"rudder_rad": side * sheet.rudder_rad})
    y, psi, recorded = (_optional(table, name) for name in ("y_m", "psi_rad", "propeller_radps"))
    rudder = side * _column_or(table, "delta_rad", side * (sheet.rudder_rad or 0.0))
    speed = _column_or(table, "speed_mps", test.speed_mps)
    revolutions = sheet.propeller_radps if sheet.propeller_radps is not None else test.propeller_radps
    revolutions = revolutions if recorded is None else float(np.mean(recorded))
    return CaptiveRun(
        name=sheet.file,
        type=sheet.type,
        sheet=sheet,
        time_s=time,
        v_mps=_sway_velocity(table, sheet, (time, y, speed)),
        r_radps=_yaw_rate(table, sheet, psi, time),
        speed_mps=speed,
        delta_rad=rudder,
        **{column: test.sense * table.filled_column(column) for column in FORCE_COLUMNS.values()},
        y_m=y,
        psi_rad=psi,
        propeller_radps=revolutions,
        thrust_N=_optional(table, "thrust_N"),
        rudder_normal_force_N=_optional(table, "rudder_normal_force_N"),
        torque_Nm=_optional(table, "torque_Nm"),
        heel_rad=sheet.heel_rad or 0.0,
        force_delay_s=test.force_delay_s,
    )


def _yaw_rate(table: CsvTable, sheet: RunSheet, psi: Array | None, time: Array) -> Array:
    """Yaw rate (n,), rad/s: as recorded, by the sheet of a steady turn, or the slope of the heading."""
    recorded = _optional(table, "r_radps")
    if recorded is not None:
        return recorded
    if sheet.type == "steady_turn" and sheet.yaw_rate_radps is not None:
        return np.full(len(time), sheet.yaw_rate_radps)
    if sheet.type not in ("pure_yaw", "yaw_with_drift", "steady_turn"):
        return np.zeros(len(time))
    if psi is None:
        raise table.fault("header", "there is neither r_radps nor psi_rad", "add one of them")
    return np.asarray(np.gradient(np.unwrap(psi), time))


def _optional(table: CsvTable, name: str) -> Array | None:
    return table.filled_column(name) if name in table.columns else None


def _column_or(table: CsvTable, name: str, constant: float) -> Array:
    """A column (n,), or a constant where it was not recorded."""
    column = _optional(table, name)
    return np.full(len(table.lines), constant) if column is None else column


def _sway_velocity(table: CsvTable, sheet: RunSheet, motion: tuple[Array, Array | None, Array]) -> Array:
    """v as measured; else from the position (pure sway), or from the drift angle of the sheet."""
    time, y, speed = motion
    measured = _optional(table, "v_mps")
    if measured is not None:
        return measured
    if sheet.type == "pure_sway":
        if y is None:
            raise table.fault("header", "there is neither v_mps nor y_m", "add one of them")
        return np.asarray(np.gradient(y, time))
    drifts = ("static_drift", "drift_and_rudder", "steady_turn", "yaw_with_drift")
    if sheet.drift_rad is None and sheet.type in drifts:
        raise table.fault("header", "there is no v_mps, and the campaign gives no drift", "give one of them")
    return np.asarray(-speed * np.sin(sheet.drift_rad or 0.0))
