"""The table in ``[waves]`` of a ship card: motions and drift forces in regular waves of unit amplitude.

Columns are ``frequency_radps`` of the wave; ``direction_deg`` from which it comes, clockwise from the bow, from 0 (head
waves) to 180 in equal steps: waves from port do the same mirrored; of each motion given, ``<motion>_amplitude`` (m/m)
or ``<motion>_amplitude_radpm`` (rotations), and ``<motion>_phase_deg``, its lead over the surface of the wave at
midships; and the mean drift forces over the square of the amplitude, ``X_drift_Npm2``, ``Y_drift_Npm2``,
``N_drift_Npm``. Motions are in the axes of the ship: surge forward, sway to starboard, heave down, roll to starboard,
pitch bow up, yaw to starboard, of the point at midships in the waterline.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array

WAVE_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Motions in waves, in the order of Fossen's six degrees of freedom."""

WAVE_ROTATIONS = WAVE_MOTIONS[3:]

MIRRORED = ("sway", "roll", "yaw", "Y", "N")
"""Motions and forces that change their sign with the side from which the waves come."""

DRIFT_COLUMNS = {"X": "X_drift_Npm2", "Y": "Y_drift_Npm2", "N": "N_drift_Npm"}
"""Force to the column of its drift coefficient."""

MESH_ASYMMETRY = 0.02
"""Largest motion or force in head and following waves, over the largest of its column, that is taken for zero where a
ship alike to both sides has none: what a mesh of panels errs by. Project choice."""


def motion_columns(motion: str) -> tuple[str, str]:
    """Names of the columns of amplitude and phase of a motion."""
    unit = "_radpm" if motion in WAVE_ROTATIONS else ""
    return f"{motion}_amplitude{unit}", f"{motion}_phase_deg"


@dataclass(frozen=True)
class WaveTable:
    """The table by frequency and direction."""

    frequencies: Array  # (nf,): Rising, rad/s
    directions: Array  # (nd,): 0 to pi, rad, evenly spaced
    # Motion to complex amplitude (nf, nd) over the wave amplitude: the real part is in phase with the surface at
    # midships, a positive imaginary one leads it.
    motions: Mapping[str, Array]
    # ``X``, ``Y``, ``N`` to mean force over the square of the wave's amplitude, (nf, nd), N/m^2 and N/m.
    drift: Mapping[str, Array]


def wave_table(columns: Sequence[str], rows: Sequence[Sequence[float]]) -> WaveTable:
    """Read the table of a card.

    Raises ValueError: a column is unknown, missing or given twice, or the rows are not a table of all frequencies and
    directions.
    """
    _check_columns(columns, rows)
    values = dict(zip(columns, np.array(rows, dtype=float).T, strict=True))
    frequencies, directions = (np.unique(values[name]) for name in _PLACES)
    _check_grid(frequencies, directions, values)
    order = np.lexsort((values["direction_deg"], values["frequency_radps"]))
    grid = {name: column[order].reshape(len(frequencies), -1) for name, column in values.items()}
    motions = {motion: _complex(grid, motion) for motion in WAVE_MOTIONS if set(motion_columns(motion)) & set(columns)}
    drift = {force: grid[name] for force, name in DRIFT_COLUMNS.items() if name in grid}
    if not motions and not drift:
        raise ValueError("columns has neither a motion nor a drift force")
    for name, column in {**motions, **drift}.items():
        along = np.max(np.abs(column[:, [0, -1]]))
        if name in MIRRORED and along > MESH_ASYMMETRY * np.max(np.abs(column)):
            raise ValueError(f"{name} is not zero in head and following waves, as for a ship with two equal sides")
    return WaveTable(frequencies, np.radians(directions), motions, drift)


_PLACES = ("frequency_radps", "direction_deg")


def _check_columns(columns: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
    known = [*_PLACES, *(name for motion in WAVE_MOTIONS for name in motion_columns(motion)), *DRIFT_COLUMNS.values()]
    for name in columns:
        if name not in known:
            raise ValueError(f"columns has {name!r}, known are {', '.join(known)}")
        if list(columns).count(name) > 1:
            raise ValueError(f"columns has {name} twice")
    if absent := [name for name in _PLACES if name not in columns]:
        raise ValueError(f"columns lacks {absent[0]}")
    if wrong := next((place for place, row in enumerate(rows) if len(row) != len(columns)), None):
        raise ValueError(f"row {wrong} has {len(rows[wrong])} numbers for {len(columns)} columns")
    if not rows or len(rows[0]) != len(columns):
        raise ValueError(f"rows of {len(columns)} numbers were expected")


def _check_grid(frequencies: Array, directions: Array, values: Mapping[str, Array]) -> None:
    if len(frequencies) < 2 or frequencies[0] <= 0:
        raise ValueError("two frequencies above zero or more were expected")
    even = np.linspace(0.0, 180.0, len(directions))
    if len(directions) < 3 or not np.allclose(directions, even, atol=0.01):
        raise ValueError("directions from 0 to 180 deg in equal steps were expected, three or more")
    pairs = set(zip(values["frequency_radps"], values["direction_deg"], strict=True))
    count = len(values["frequency_radps"])
    if len(pairs) < count or count != len(frequencies) * len(directions):
        raise ValueError("one row for each frequency and direction was expected")


def _complex(grid: Mapping[str, Array], motion: str) -> Array:
    names = motion_columns(motion)
    for name in names:
        if name not in grid:
            raise ValueError(f"columns has {motion} without {name}")
    amplitude, phase = (grid[name] for name in names)
    if np.any(amplitude < 0):
        raise ValueError(f"{names[0]} is below zero")
    result: Array = amplitude * np.exp(1j * math.pi / 180 * phase)
    return result
