"""Tows: speeds of a body that a constant force accelerates from rest, several runs read at the same times."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from tank2sim.arguments import bounds_of, numbers_in
from tank2sim.arrays import Array
from tank2sim.errors import ArgumentError
from tank2sim.quantities import LONGEST_RUN_S, Breadth, Length, Mass, TowingForce, Viscosity, Volume, WaterDensity
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.records.same_record import same_readings

_SPEED = re.compile(r"speed_([1-9]\d*)_mps")
FEWEST_TIMES = 5
"""Times at which a speed must be known: the release, three for a quadratic, and one to show whether that fits."""

FASTEST_MPS = 100.0
"""As for the speeds of a card (``tank2sim.cards.form.Speed``)."""

_SLOWEST_MPS = 1e-6
"""A tow whose fastest reading is below it did not move. Project choice: a hundredth of the last digit of the paper's
speeds (Wilinski & Zellman, Table 1, prints 0.0001 m/s)."""

BODY_KEYS: Mapping[str, object] = {
    **{"length_m": Length, "beam_m": Breadth, "volume_m3": Volume},
    **{"water_density_kgpm3": WaterDensity, "kinematic_viscosity_m2ps": Viscosity},
}
"""Comments that describe the body and the water, with their types; they turn drag into coefficients."""


@dataclass(frozen=True, eq=False)
class Tows:
    """Speeds of one body in tows by the same force.

    Times (s) rise from the release, 0; speeds (times, tows) are nan where nothing was recorded; each row and each tow
    has at least one reading. Force and mass of the body with the water in it, and the keys of :data:`BODY_KEYS`, are as
    the file states them. `names` are the columns.
    """

    path: Path
    names: tuple[str, ...]
    time_s: Array
    speed_mps: NDArray[np.float64]
    force_N: float | None = None
    mass_kg: float | None = None
    body: dict[str, float] = field(default_factory=dict)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of tows read at each time, (times,)."""
        counts: NDArray[np.int64] = np.sum(~np.isnan(self.speed_mps), axis=1)
        return counts

    @property
    def mean_speed_mps(self) -> Array:
        """Mean over the tows that were read at each time, (times,)."""
        mean: Array = np.nanmean(self.speed_mps, axis=1)
        return mean

    @property
    def top_speed_mps(self) -> float:
        """The highest reading."""
        return float(np.nanmax(self.speed_mps))

    def only(self, *numbers: int) -> Tows:
        """The tows of these `numbers`, from 0, at the times when they were read."""
        speed = self.speed_mps[:, numbers]
        read = ~np.isnan(speed).all(axis=1)
        names = tuple(self.names[number] for number in numbers)
        return replace(self, names=names, time_s=self.time_s[read], speed_mps=speed[read])


def read_tows(path: Path | str | CsvTable) -> Tows:
    """Read tows: ``t_s,speed_1_mps,speed_2_mps,...``, with comments ``# force_N: 11.63`` and ``# mass_kg: 2243``.

    The body may be described by further comments (:data:`BODY_KEYS`), as in ``# length_m: 3.8``.

    Rows without any reading are left out.

    Raises
    ------
    InputError
        The table is at fault (:func:`tank2sim.records.csv_table.read_table`), a column is not a speed in m/s, a tow has
        no reading or another's, there are fewer than five times with one, or the time does not rise from 0 or
        later.
    """
    table = read_table(path)
    table.refuse_misspelt_keys(("force_N", "mass_kg", *BODY_KEYS))
    time = table.increasing("t_s")
    remedy = "count the time from the release, t_s = 0, in s"
    if time[0] < 0:
        raise table.fault(table.place(0, "t_s"), "is before the release", remedy)
    if time[-1] > LONGEST_RUN_S:
        problem = f"is {time[-1]:.10g} s after the release, and at most {LONGEST_RUN_S:g} s can be simulated"
        raise table.fault(table.place(len(time) - 1, "t_s"), problem, remedy)
    names = tuple(name for name in table.columns if name != "t_s")
    if not names:
        raise table.fault("header", "there is no speed", "add a column speed_1_mps")
    speed = np.column_stack([_speeds(table, name) for name in names])
    _refuse_copies(table, names, speed[time > 0])
    read = ~np.isnan(speed).all(axis=1)
    if np.count_nonzero(read) < FEWEST_TIMES:
        problem = f"has readings at {np.count_nonzero(read)} times only"
        raise table.fault("", problem, f"give readings at {FEWEST_TIMES} times or more")
    force, mass = table.bounded_comment("force_N", TowingForce), table.bounded_comment("mass_kg", Mass)
    return Tows(table.path, names, time[read], speed[read], force, mass, table.bounded_comments(BODY_KEYS))


def _speeds(table: CsvTable, name: str) -> Array:
    """The readings of a tow; InputError for a column that is not one."""
    place, readings = f"column {name}", table.columns[name]
    if not _SPEED.fullmatch(name):
        other = name.startswith("speed") and not name.endswith("_mps")
        problem = "is not a speed in m/s" if other else "is not a speed of a tow"
        remedy = f"{'convert it to m/s and' if other else 'delete it, or'} call it speed_1_mps, speed_2_mps, ..."
        raise table.fault(place, problem, remedy)
    if np.isnan(readings).all():
        raise table.fault(place, "has no reading", "delete the column")
    if np.nanmax(readings) < _SLOWEST_MPS:
        remedy = "delete the column, or give the speeds in m/s"
        raise table.fault(place, f"never reaches {_SLOWEST_MPS:g} m/s: no motion", remedy)
    row = int(np.nanargmax(np.abs(readings)))
    if abs(readings[row]) > FASTEST_MPS:
        problem = f"{readings[row]:.6g} m/s is faster than any body is towed"
        raise table.fault(table.place(row, name), problem, f"give it in m/s, up to {FASTEST_MPS:g}")
    return readings


def _refuse_copies(table: CsvTable, names: tuple[str, ...], moving: Array) -> None:
    """Raise InputError for a tow with the readings (times, tows) of another."""
    for first, second in combinations(range(len(names)), 2):
        if same_readings(moving[:, first], moving[:, second]):
            problem, remedy = f"has the readings of {names[first]}", "delete it: a copy is not a second tow"
            raise table.fault(f"column {names[second]}", problem, remedy)


def as_force(force: float | Polynomial) -> Polynomial:
    """T(t), N over s from the release; a number is a constant force."""
    return force if isinstance(force, Polynomial) else Polynomial([float(force)])


def parse_force(text: str) -> Polynomial:
    """T(t) from an option's text ``c0,c1,...``: T = c0 + c1 t + ..., N over s; InputError for any other text."""
    coefficients = numbers_in(text)
    if not coefficients:
        raise ArgumentError("force_N", "", f"{text!r} is not a polynomial", "give numbers: 11.6,0.02,-1e-4")
    return Polynomial(coefficients)


def checked_force(force: Polynomial, times_s: Array) -> Polynomial:
    """The force, if it pulls forward from the release to the last reading; InputError if negative, or zero
    throughout."""
    end = float(times_s[-1])
    times = np.linspace(0.0, end, 201)
    values = force(times)
    if values.min() < 0 or values.max() == 0:
        at = times[values.argmin()]
        problem = f"is {values.min():.4g} N at {at:.4g} s, and must pull forward from 0 to {end:g} s"
        raise ArgumentError("force_N", "", problem, "check signs and order: c0,c1,... with T = c0 + c1 t + ...")
    bounds = bounds_of(TowingForce)
    if bounds is not None and not bounds.hold(float(values.max())):
        raise ArgumentError("force_N", "", f"reaches {values.max():.4g} N", f"give {bounds.words}, in N")
    return force


def mean_force(force: Polynomial, times_s: Array) -> float:
    """Mean of T(t) from the release to the last reading, N."""
    end = float(times_s[-1])
    return float(force.integ()(end)) / end


def force_words(force: Polynomial) -> str:
    """Text of the force: ``T = 11.63 N``, ``T = 11.6 + 0.02 t N``."""
    powers = [f"{value:+.6g}" + ("" if k == 0 else " t" if k == 1 else f" t^{k}") for k, value in enumerate(force.coef)]
    return "T = " + " ".join(powers).lstrip("+").replace(" +", " + ").replace(" -", " - ") + " N"
