"""Exit of a run from its card's range, and the figures before it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.hull import VALIDITY_FACTOR
from tank2sim.notices import Notice, caution
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.trajectory import Trajectory

INSIDE = 1 - 1e-6
"""Value of ``validity`` below which it counts as less than 1: above rounding."""

_STILL = 0.05
"""Share of u0 below which drift and r L/U are not reported: they are undefined at rest. Project choice."""

Numbers = dict[str, float]
"""Figure by name with unit."""

_QUARTER = ("advance_m", "advance_lengths", "transfer_m", "time_90_s")
_HALF = ("tactical_diameter_m", "tactical_diameter_lengths", "time_180_s")
_FIRST_HEADING = ("initial_turning_time_s", "initial_turning_distance_m", "initial_turning_lengths")


@dataclass(frozen=True)
class CardRangeReading:
    """Figures of a run, with their times and the exit from the card's range."""

    figures: Numbers  # Figure by name with unit; entries of a list have separate names (``overshoot_1_deg``)
    read_s: Numbers  # Time at which each figure is known, s from the order; the end of the run for absent names
    exit_s: float | None = None  # Time at which the output ``validity`` first falls below 1; None if it does not
    how: str = ""  # The quantities that leave the range, with both ranges, or else what effects do not hold for

    def outside(self, name: str) -> bool:
        """True if the run had left the card's range before this figure was known."""
        return self.exit_s is not None and self.read_s.get(name, math.inf) >= self.exit_s

    @property
    def outside_names(self) -> tuple[str, ...]:
        """Names of the figures outside the card's range."""
        return tuple(name for name in self.figures if self.outside(name))

    @property
    def notices(self) -> list[Notice]:
        """A caution on the exit from the card's range; none if no figure is outside it."""
        if self.exit_s is None or not self.outside_names:
            return []
        return [caution(f"EXTRAPOLATED beyond the card's measurements from {self.exit_s:.3g} s on: {self.how}")]

    def as_json(self) -> dict[str, object]:
        """Time and cause of the exit from the card's range, and the names of the figures outside it."""
        return {
            "left_card_range_s": self.exit_s,
            "left_card_range_by": self.how,
            "outside_card_range": list(self.outside_names),
        }


NOTHING_READ = CardRangeReading({}, {})
"""The reading of a run that failed."""


def reading(figures: Figures, run: Trajectory, parameters: Mapping[str, float]) -> CardRangeReading:
    """The figures of a run with their times; `parameters` are all of the model, by name."""
    row = range_exit_row(run)
    exit_s = None if row is None else float(run.t[row])
    numbers, settled = single_figures(figures), {}
    for name in numbers:
        times = read_with(name)
        if times and all(time in numbers for time in times):
            settled[name] = sum(numbers[time] for time in times)
    return CardRangeReading(numbers, settled, exit_s, "" if exit_s is None else _how(run, parameters))


def read_with(name: str) -> tuple[str, ...]:
    """Names of the figures whose sum is the time at which a figure is known, s; empty: at the end of the run."""
    for names, last in ((_QUARTER, "time_90_s"), (_HALF, "time_180_s"), (_FIRST_HEADING, "initial_turning_time_s")):
        if name in names:
            return (last,)
    if found := re.fullmatch(r"overshoot(?:_time)?_(\d+)_(?:deg|s)", name):
        return f"execute_time_{found[1]}_s", f"overshoot_time_{found[1]}_s"
    return (name,) if re.fullmatch(r"execute_time_\d+_s", name) else ()


def single_figures(figures: Figures) -> Numbers:
    """The figures of a run as single numbers: entries of lists as ``overshoot_1_deg``; None is omitted."""
    found: Numbers = {}
    for name, value in figures.items():
        if isinstance(value, float):
            found[name] = value
        elif isinstance(value, list):
            found |= {entry_name(name, place): entry for place, entry in enumerate(value)}
    return found


def entry_name(name: str, place: int) -> str:
    """Name of the n-th entry of a list of figures: ``overshoots_deg``, 0 is ``overshoot_1_deg``."""
    stem, _, unit = name.rpartition("_")
    return f"{stem.removesuffix('s')}_{place + 1}_{unit}"


def range_exit_row(run: Trajectory) -> int | None:
    """Row at which ``validity`` first falls below 1; None if it does not, or if the model lacks it."""
    if "validity" not in run.model.outputs:
        return None
    rows = np.flatnonzero(run["validity"] < INSIDE)
    return int(rows[0]) if len(rows) else None


def _how(run: Trajectory, values: Mapping[str, float]) -> str:
    moving = np.maximum(run["motion.speed"], _STILL * values["ship.speed"])
    rate = run["motion.r"] * values["ship.length"] / moving
    drift = np.arcsin(np.clip(run["motion.v"] / moving, -1.0, 1.0))
    rudder = run["rudder.angle"] if "rudder.angle" in run.model else np.zeros_like(rate)
    return exceeded_range(values, run["motion.speed"], rate, drift, rudder) or _fallen_factors(run)


def _fallen_factors(run: Trajectory) -> str:
    """Causes for which effects of the card do not hold, by the names of their factors of ``validity``."""
    factors = [name for name in run.model.outputs if name.startswith(VALIDITY_FACTOR)]
    fallen = [name.removeprefix(VALIDITY_FACTOR).replace("_", " ") for name in factors if run[name].min() < INSIDE]
    return ", ".join(fallen)


def exceeded_range(values: Mapping[str, float], speed: Array, rate: Array, drift: Array, rudder: Array) -> str:
    """Text on the quantities of a motion that leave the card's range, with both ranges; empty if none does.

    `values`: Parameters of the ship's model, by name. `speed`, `rate`, `drift`, `rudder` (n,): U (m/s), r L/U, drift
    angle and rudder angle (rad).
    """
    slowest, fastest = values["ship.slowest"], values["ship.fastest"]
    parts = []
    if speed.min() < slowest or speed.max() > fastest:
        parts.append(f"speed {speed.min():.2f} to {speed.max():.2f} m/s (card {slowest:.2f} to {fastest:.2f} m/s)")
    for words, motion, name, scale, unit in (
        ("yaw rate", rate, "ship.largest_yaw_rate", 1.0, "U/L"),
        ("drift", drift, "ship.largest_drift", 180 / math.pi, "deg"),
        ("rudder", rudder, "ship.largest_rudder", 180 / math.pi, "deg"),
    ):
        limit, largest = values.get(name, math.inf), float(np.max(np.abs(motion)))
        if largest > limit * (1 + 1e-9):
            parts.append(f"{words} to {scale * largest:.3g} {unit} (card {scale * limit:.3g} {unit})")
    return ", ".join(parts)
