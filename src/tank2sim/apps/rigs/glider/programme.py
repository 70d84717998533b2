"""Programmes of a glider: its angle, roll and buoyancy in steps of time, and their simulation by the transient model.

A programme is a CSV with a row for each step and the columns

    duration_s                            duration of the step
    path_angle_deg or pitch_deg           angle of the path, or pitch of the hull, + up (also _rad)
    roll_deg                              + starboard side down; 0 if absent (also _rad)
    buoyancy_kg                           net buoyancy, + light; absent or empty: the card's, by the sign of the angle
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tank2sim.simulation.trajectory import Trajectory

LARGEST_BUOYANCY_KG = 1e6
"""Largest net buoyancy of a step, kg: a thousand times the ballast of any glider, against typing errors."""
LONGEST_PROGRAMME_S = 1e6
"""The longest programme, s, 12 days: project choice, against typing errors."""

_COLUMNS = ("duration_s", "path_angle_rad", "pitch_rad", "roll_rad", "buoyancy_kg")


@dataclass(frozen=True, kw_only=True)
class ProgrammeStep:
    """One step: `duration_s`; `angle_rad` of the path, or of the hull where `is_pitch`; roll; net buoyancy, if given.

    `place` is the location of the step, for messages.
    """

    duration_s: float
    angle_rad: float
    is_pitch: bool = False
    roll_rad: float = 0.0
    buoyancy_kg: float | None = None
    place: str = ""


@dataclass(frozen=True)
class GlideProgramme:
    """Steps in sequence, and their file or name."""

    source: str
    steps: tuple[ProgrammeStep, ...]

    @property
    def duration_s(self) -> float:
        """Time of all steps, s."""
        return math.fsum(step.duration_s for step in self.steps)


def read_programme(path: Path | str) -> GlideProgramme:
    """Read a programme.

    Raises
    ------
    InputError
        The table has an error, a column is unknown or missing, both angles are given, a cell is empty, a duration is
        not positive, or the programme is too long.
    """
    table = read_table(path).si()
    for name in table.columns:
        if name not in _COLUMNS:
            known = "duration_s, path_angle_deg or pitch_deg, roll_deg, buoyancy_kg"
            raise InputError(
                table.path, f"column {table.heading(name)}", "is not a column of a programme", f"known: {known}"
            )
    angles = [name for name in ("path_angle_rad", "pitch_rad") if name in table.columns]
    if len(angles) != 1:
        problem = "has both path_angle_deg and pitch_deg" if angles else "has neither path_angle_deg nor pitch_deg"
        raise InputError(table.path, "header", problem, "give one of them")
    durations = table.column("duration_s")
    steps = tuple(_step(table, row, angles[0]) for row in range(len(durations)))
    programme = GlideProgramme(str(table.path), steps)
    if programme.duration_s > LONGEST_PROGRAMME_S:
        problem = f"lasts {programme.duration_s:g} s"
        raise InputError(table.path, "column duration_s", problem, f"at most {LONGEST_PROGRAMME_S:g} s can be flown")
    return programme


def _step(table: CsvTable, row: int, angle: str) -> ProgrammeStep:
    def value(name: str, default: float | None = None) -> float:
        given = float(table.columns[name][row]) if name in table.columns else math.nan
        if not math.isnan(given):
            return given
        if default is None:
            raise InputError(table.path, table.place(row, name), "is empty", "give each step its value")
        return default

    duration = value("duration_s")
    if duration <= 0:
        place = table.place(row, "duration_s")
        raise InputError(table.path, place, f"is {duration:g}", "a positive number of seconds was expected")
    buoyancy = value("buoyancy_kg", math.inf)
    if LARGEST_BUOYANCY_KG < abs(buoyancy) < math.inf:
        place = table.place(row, "buoyancy_kg")
        raise InputError(table.path, place, f"is {buoyancy:g}", f"at most {LARGEST_BUOYANCY_KG:g} kg either way can be")
    return ProgrammeStep(
        duration_s=duration,
        angle_rad=value(angle),
        is_pitch=angle == "pitch_rad",
        roll_rad=value("roll_rad", 0.0),
        buoyancy_kg=None if math.isinf(buoyancy) else buoyancy,
        place=f"line {table.lines[row]}",
    )


def follow_programme(
    integrator: Integrator, orders: Sequence[Mapping[str, float]], durations_s: Sequence[float]
) -> Trajectory:
    """The motion of a glider model under orders that hold for their durations, from the steady glide of the first.

    Without buoyancy in the first it starts at rest.

    Parameters
    ----------
    integrator : Integrator
        Integrator of a model by :func:`tank2sim.apps.rigs.glider.model.glider_model`.
    orders : sequence of mapping
        For each step ``buoyancy.command`` (kg), ``pitch.command`` and ``roll.command`` (rad).

    Raises
    ------
    InputError
        No steady glide exists near the start, or the motion leaves all bounds.
    """
    first = {f"initial.{name}": orders[0][f"{name}.command"] for name in ("buoyancy", "pitch", "roll")}
    # Newton's first guess: some incidence of the right sign.
    down = -math.copysign(0.04, first["initial.pitch"])
    names = integrator.model.parameter_names
    speed = float(integrator.model.parameter_values()[names.index("initial.u")])
    pull = math.sqrt(abs(first["initial.buoyancy"] / _usual_buoyancy(integrator)))
    start = {"initial.trim": float(pull > 0), "initial.u": speed * pull, "initial.w": speed * pull * down}
    running = Running(integrator, orders[0], {**first, **start})
    for order, duration in zip(orders, durations_s, strict=True):
        running.order(order)
        running.run(duration)
    return running.trajectory()


def _usual_buoyancy(integrator: Integrator) -> float:
    usual = integrator.model.input_values()[integrator.model.input_names.index("buoyancy.command")]
    return float(np.abs(usual))
