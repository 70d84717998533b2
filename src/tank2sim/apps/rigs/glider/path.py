"""Programmes of a glider, and their paths of steady glides, equations (13) to (25) of paper 5, as printed, too.

    dphi_i = v_i cos(epsilon_i) t_i / R_i                                                                (13), (14)
    X_n = X_{n-1} + R_n (sin dphi_n cos phi_{n-1} - (1 - cos dphi_n) sin phi_{n-1})                            (23)
    Z_n = Z_{n-1} + R_n (sin dphi_n sin phi_{n-1} + (1 - cos dphi_n) cos phi_{n-1})                            (25)
    Y_n = Y_{n-1} + v_n t_n sin(epsilon_n),          phi_n = phi_{n-1} + dphi_n                          (22), (15)

with R of the sign of the turn, and X += v cos(epsilon) t cos(phi), Z += v cos(epsilon) t sin(phi) without roll. The
print has dphi = v t / R, and R multiplies only the first product of (23) and (25). X is north here, Z east, Y the
height.

A programme is a CSV with a row for each step and the columns

    duration_s                            duration of the step
    path_angle_deg or pitch_deg           angle of the path, or pitch of the hull, + up (also _rad)
    roll_deg                              + starboard side down; 0 if absent (also _rad)
    buoyancy_kg                           net buoyancy, + light; absent or empty: the card's, by the sign of the angle
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.steady import SteadyGlide, glide_as_printed, glide_at_pitch, steady_glide
from tank2sim.arrays import Array, Columns
from tank2sim.errors import InputError
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.records.thinning import drawn_columns

_POINTS_OF_AN_ARC = 60


class PathPoint(NamedTuple):
    """Time (s), north, east, height (m) and heading (rad, clockwise, continuous)."""

    time_s: float
    north_m: float
    east_m: float
    height_m: float
    heading_rad: float


@dataclass(frozen=True)
class GlidePath:
    """A path of steady glides: each with its duration, and the places of the start and of the end of each step."""

    glides: tuple[SteadyGlide, ...]
    durations_s: tuple[float, ...]
    places: tuple[PathPoint, ...]

    @property
    def length_m(self) -> float:
        """Length of the path through the water."""
        return math.fsum(glide.speed_mps * time for glide, time in zip(self.glides, self.durations_s, strict=True))

    def sampled(self) -> Array:
        """The path in points dense enough for a chart, (n, 5) in the order of :class:`PathPoint`."""
        rows: list[PathPoint] = [self.places[0]]
        for glide, duration, begin in zip(self.glides, self.durations_s, self.places, strict=False):
            parts = _POINTS_OF_AN_ARC if glide.turn_rate_radps else 1
            rows += [_after(begin, glide, duration * part / parts) for part in range(1, parts + 1)]
        return np.array(rows)

    def histories(self) -> Columns:
        """Columns of the path in points dense enough for a chart: ``t_s``, ``x_m``, ``y_m``, ``height_m``."""
        rows = self.sampled()
        return drawn_columns({name: rows[:, k] for k, name in enumerate(("t_s", "x_m", "y_m", "height_m"))}, len(rows))


def fly(card: GliderCard, programme: GlideProgramme, *, as_printed: bool = False) -> GlidePath:
    """The path of a programme; InputError names the line of a step that cannot be flown, and the limit."""
    glides = tuple(_glide(card, programme.source, step, as_printed) for step in programme.steps)
    return path_of(glides, [step.duration_s for step in programme.steps])


def path_of(glides: Sequence[SteadyGlide], durations_s: Sequence[float]) -> GlidePath:
    """The path of glides with their durations, from the origin, heading north."""
    places = [PathPoint(0.0, 0.0, 0.0, 0.0, 0.0)]
    for glide, duration in zip(glides, durations_s, strict=True):
        places.append(_after(places[-1], glide, duration))
    return GlidePath(tuple(glides), tuple(durations_s), tuple(places))


def _glide(card: GliderCard, source: str, step: ProgrammeStep, as_printed: bool) -> SteadyGlide:
    try:
        if not step.is_pitch:
            equations = glide_as_printed if as_printed else steady_glide
            return equations(card, step.angle_rad, roll_rad=step.roll_rad, buoyancy_kg=step.buoyancy_kg)
        if as_printed:
            raise InputError(source, "column pitch_deg", "is not in the printed equations", "give path_angle_deg")
        return glide_at_pitch(card, step.angle_rad, roll_rad=step.roll_rad, buoyancy_kg=step.buoyancy_kg)
    except InputError as error:
        place = f"{step.place}, {error.place}" if step.place else error.place
        raise InputError(source, place, error.problem, error.remedy) from None


def _after(begin: PathPoint, glide: SteadyGlide, duration: float) -> PathPoint:
    change = glide.turn_rate_radps * duration
    cos, sin = math.cos(begin.heading_rad), math.sin(begin.heading_rad)
    # (13) in print has the whole speed along the ground
    ahead = (glide.speed_mps if glide.as_printed else glide.horizontal_speed_mps) * duration
    aside = across = 0.0
    if glide.turn_rate_radps:
        radius = math.copysign(glide.turning_radius_m, change)
        ahead, aside = radius * math.sin(change), radius * (1 - math.cos(change))
        across = 1 - math.cos(change) if glide.as_printed else aside
    return PathPoint(
        begin.time_s + duration,
        begin.north_m + ahead * cos - across * sin,
        begin.east_m + ahead * sin + across * cos,
        begin.height_m + glide.climb_mps * duration,
        begin.heading_rad + change,
    )


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
            raise table.fault(f"column {table.heading(name)}", "is not a column of a programme", f"known: {known}")
    angles = [name for name in ("path_angle_rad", "pitch_rad") if name in table.columns]
    if len(angles) != 1:
        problem = "has both path_angle_deg and pitch_deg" if angles else "has neither path_angle_deg nor pitch_deg"
        raise table.fault("header", problem, "give one of them")
    durations = table.column("duration_s")
    steps = tuple(_step(table, row, angles[0]) for row in range(len(durations)))
    programme = GlideProgramme(str(table.path), steps)
    if programme.duration_s > LONGEST_PROGRAMME_S:
        problem = f"lasts {programme.duration_s:g} s"
        raise table.fault("column duration_s", problem, f"at most {LONGEST_PROGRAMME_S:g} s can be flown")
    return programme


def _step(table: CsvTable, row: int, angle: str) -> ProgrammeStep:
    def value(name: str, default: float | None = None) -> float:
        given = float(table.columns[name][row]) if name in table.columns else math.nan
        if not math.isnan(given):
            return given
        if default is None:
            raise table.fault(table.place(row, name), "is empty", "give each step its value")
        return default

    duration = value("duration_s")
    if duration <= 0:
        place = table.place(row, "duration_s")
        raise table.fault(place, f"is {duration:g}", "a positive number of seconds was expected")
    buoyancy = value("buoyancy_kg", math.inf)
    if LARGEST_BUOYANCY_KG < abs(buoyancy) < math.inf:
        place = table.place(row, "buoyancy_kg")
        raise table.fault(place, f"is {buoyancy:g}", f"at most {LARGEST_BUOYANCY_KG:g} kg either way can be")
    return ProgrammeStep(
        duration_s=duration,
        angle_rad=value(angle),
        is_pitch=angle == "pitch_rad",
        roll_rad=value("roll_rad", 0.0),
        buoyancy_kg=None if math.isinf(buoyancy) else buoyancy,
        place=f"line {table.lines[row]}",
    )
