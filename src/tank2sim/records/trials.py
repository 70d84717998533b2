"""Free-running trials: what was measured while a ship or a model manoeuvred by itself."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice

SIGNALS: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("trial_signals.toml").read_text(encoding="utf-8")
)
"""Every signal of the trial format, in SI, and what is declared of it: words, whether it is a rudder, held, ..."""

TRIAL_SIGNALS = tuple(SIGNALS)
RUDDERS = tuple(name for name in SIGNALS if "rudder" in SIGNALS[name])
"""Angle and order of the rudder: a trial has one of them or both."""

MEASURED_COLUMNS = tuple(name for name in SIGNALS if "measured" in SIGNALS[name])
"""Quantities of the motion, the wind and the current that sensors measure."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One free-running manoeuvre.

    Parameters
    ----------
    path : Path
        The file.
    time_s : array (n,)
        Rising; begins where the file begins.
    signals : mapping
        Name to values (n,), SI, rad, nan where nothing was measured. Names follow the trial format, in SI:
        ``delta_rad`` (angle), ``delta_order_rad`` (order, held until the next), both positive to starboard;
        ``n_radps u_mps v_mps u_ground_mps v_ground_mps sog_mps cog_rad r_radps psi_rad x_m y_m phi_rad wind_speed_mps
        wind_direction_rad wind_rel_speed_mps wind_rel_direction_rad current_speed_mps current_direction_rad``. psi is
        continuous; the wind comes from its direction, the current sets towards it.
    noise : mapping
        Standard deviation of the measurement by signal, where the file states it, SI.
    scale : float or None
        Length of the ship over the length of the model of this trial, where the file or its format states it.
    length_m : float or None
        Length between perpendiculars of what the values belong to, ship or model, where the format states it.
    notices : tuple of Notice
        What was done to the data on reading.
    columns : mapping
        Signal to what its column is called in the file, where that differs.
    origin_deg : tuple or None
        Latitude and longitude of x = y = 0, deg, where the file states them.
    folder : str
        Folder of a trial whose file name another trial has, too (:func:`distinctly_named`).
    """

    path: Path
    time_s: Array
    signals: Mapping[str, Array]
    noise: Mapping[str, float] = field(default_factory=dict)
    scale: float | None = None
    notices: tuple[Notice, ...] = ()
    columns: Mapping[str, str] = field(default_factory=dict)
    length_m: float | None = None
    origin_deg: tuple[float, float] | None = None
    folder: str = ""

    @property
    def name(self) -> str:
        """File name without its ending, behind the folder where several trials have it."""
        return f"{self.folder}/{self.path.stem}" if self.folder else self.path.stem

    def heading(self, signal: str) -> str:
        """Name of a signal's column in the file."""
        return self.columns.get(signal, signal)

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this trial, to be raised: its place, the problem, and the remedy."""
        return InputError(self.path, place, problem, remedy)


@dataclass(frozen=True)
class TrialReader:
    """A format of trial files.

    Parameters
    ----------
    name : str
        Under which it is registered.
    description : str
        A few words for people.
    suffixes : tuple of str
        Endings of the files, small letters with the dot: in a folder only such files are looked at.
    recognises : callable
        ``recognises(text) -> bool``: whether a file that begins with this text has the format. At least the first 4096
        bytes are given, read as ISO 8859-1, ends of lines as in the file.
    read : callable
        ``read(path) -> Trial``: signals in SI, angles in rad, rudder positive to starboard. It raises InputError with
        file, line or column, what is wrong and what to do.
    """

    name: str
    description: str
    suffixes: tuple[str, ...]
    recognises: Callable[[str], bool]
    read: Callable[[Path], Trial]


def fault_of(trial: Trial) -> str:
    """First violation of what :class:`Trial` demands, "" if none: for readers of other packages."""
    if not isinstance(trial, Trial):
        return f"a {type(trial).__name__} was read, and a Trial was expected"
    if unknown := trial.signals.keys() - set(TRIAL_SIGNALS):
        return f"{min(unknown)} is not a signal of a trial; these are {', '.join(TRIAL_SIGNALS)}"
    columns = {"time_s": trial.time_s, **trial.signals}
    for name, values in columns.items():
        if not isinstance(values, np.ndarray) or values.dtype != float or values.shape != (len(trial.time_s),):
            return f"{name} is not an array of floats with one value for each of the {len(trial.time_s)} rows"
    if len(trial.time_s) < 2:
        return "there are fewer than two rows"
    if not (trial.signals.keys() & RUDDERS and trial.signals.keys() & MEASURED_COLUMNS):
        return f"it needs a rudder ({' or '.join(RUDDERS)}) and at least one measured signal of the motion"
    return ""


ROWS_TO_SHOW_AN_ORDER = 0.5
"""Mean time from an order to the first row that shows it, in rows, of a record that asks for the order once a row; it
is evenly distributed between 0 and 1."""


def usual_step(time_s: Array) -> float:
    """Median step between times (n,), s; nan of fewer than two."""
    return float(np.median(np.diff(time_s))) if len(time_s) > 1 else math.nan


def sampling_step(trial: Trial) -> float:
    """Median of the time between rows, s."""
    return usual_step(trial.time_s)


def rows_in(step_s: float, sampling_s: float) -> int:
    """Whole number of rows in a step, 1 or more; a row that misses it by rounding alone is counted."""
    return max(1, int(step_s / sampling_s + 1e-6))


def order_instants(time_s: Array, share: float | Array = ROWS_TO_SHOW_AN_ORDER) -> Array:
    """Instants (n,), s, at which the orders that rows (n,) show were given.

    `share`: Part of the interval from the row before, one number or (n - 1,); the first row shows its order at once.
    """
    given: Array = time_s.copy()
    given[1:] = time_s[:-1] + share * np.diff(time_s)
    return given


def window(trial: Trial, begin_s: float, end_s: float) -> Trial:
    """The rows from one time to another, both included; times stay as they are.

    Raises InputError: Fewer than two rows are in it.
    """
    inside = (trial.time_s >= begin_s) & (trial.time_s <= end_s)
    if np.count_nonzero(inside) < 2:
        span = f"the trial lasts from {trial.time_s[0]:g} s to {trial.time_s[-1]:g} s"
        raise trial.fault("", f"has no two rows between {begin_s:g} s and {end_s:g} s", span)
    return select_rows(trial, np.flatnonzero(inside))


def select_rows(trial: Trial, rows: np.ndarray) -> Trial:
    """The rows of these indices, in this order."""
    signals = {name: values[rows] for name, values in trial.signals.items()}
    return replace(trial, time_s=trial.time_s[rows], signals=signals)


def with_signals(trial: Trial, changes: Mapping[str, Array | None], notice: str) -> Trial:
    """The trial with some signals changed or added, or left out where the change is None, and a notice that says so.

    The stated noise of what is left out goes with it.
    """
    gone = {name for name, values in changes.items() if values is None}
    signals = {name: values for name, values in {**trial.signals, **changes}.items() if values is not None}
    noise = {name: value for name, value in trial.noise.items() if name not in gone}
    return replace(trial, signals=signals, noise=noise, notices=(*trial.notices, Notice(notice)))


def froude_scaled(trial: Trial, length_ratio: float) -> Trial:
    """The same manoeuvre of a geometrically similar ship whose length is `length_ratio` times as great.

    By Froude's law with the same gravity (ITTC): lengths times the ratio, times and speeds times its root, rates of
    turn and revolutions divided by its root, angles as they are; so the stated noise. ``scale`` describes the model
    that was tested and stays.

    Raises ValueError: The ratio is not positive.
    """
    if not 0 < length_ratio < math.inf:
        raise ValueError(f"the ratio of lengths is {length_ratio:g}; a positive one was expected")
    factors = {"m": length_ratio, "mps": math.sqrt(length_ratio), "radps": 1 / math.sqrt(length_ratio), "rad": 1.0}
    signals = {name: values * factors[_unit(name)] for name, values in trial.signals.items()}
    noise = {name: value * factors[_unit(name)] for name, value in trial.noise.items()}
    length = None if trial.length_m is None else trial.length_m * length_ratio
    return replace(trial, time_s=trial.time_s * math.sqrt(length_ratio), signals=signals, noise=noise, length_m=length)


def mean_wind(trials: Iterable[Trial]) -> tuple[float, float] | None:
    """Mean true wind of trials, a mean of vectors over all samples; None if no trial has it.

    The components to north and east are averaged: opposite winds cancel.

    Returns
    -------
    speed, direction : float
        m/s, and where it comes from, rad clockwise from north, 0 to 2 pi.
    """
    names = "wind_speed_mps", "wind_direction_rad"
    winds = [[trial.signals[name] for name in names] for trial in trials if set(names) <= set(trial.signals)]
    if not winds:
        return None
    speed, direction = np.hstack(winds)
    north, east = speed * np.cos(direction), speed * np.sin(direction)
    if np.isnan(north).all():
        return None
    mean_north, mean_east = float(np.nanmean(north)), float(np.nanmean(east))
    return math.hypot(mean_north, mean_east), math.atan2(mean_east, mean_north) % math.tau


def unwrapped(angle: Array, period: float = math.tau) -> Array:
    """A wrapped angle (n,), rad, made continuous; nan stays, and the angle goes the shorter way past it.

    `period`: Where the angle begins again, rad.
    """
    known = np.isfinite(angle)
    continuous = angle.copy()
    continuous[known] = np.unwrap(angle[known], period=period)
    return continuous


def straight_over_gaps(time: Array, values: Array) -> Array:
    """Return a signal with straight lines in place of what was not measured.

    `time` (n,): s. `values` (n,): nan where nothing was measured.
    """
    known = ~np.isnan(values)
    return np.interp(time, time[known], values[known])


def held_over_gaps(values: Array) -> Array:
    """An order (n,), nan where none was recorded, that holds until the next; the first one holds from the beginning."""
    known = np.flatnonzero(~np.isnan(values))
    held: Array = values[known[np.clip(np.searchsorted(known, np.arange(len(values)), side="right") - 1, 0, None)]]
    return held


def _unit(signal: str) -> str:
    return signal.rpartition("_")[2]


def distinctly_named(*groups: Sequence[Trial]) -> list[list[Trial]]:
    """The groups with trials of one file name in different folders named by their folders, too.

    Examples
    --------
    >>> import numpy as np
    >>> trials = [Trial(Path(name), np.arange(2.0), {}) for name in ("a/turn.csv", "b/turn.csv", "b/stop.csv")]
    >>> [[trial.name for trial in group] for group in distinctly_named(trials[:1], trials[1:])]
    [['a/turn'], ['b/turn', 'stop']]
    """
    paths: dict[str, set[Path]] = {}
    for trial in (trial for group in groups for trial in group):
        paths.setdefault(trial.path.stem, set()).add(trial.path)
    return [
        [replace(trial, folder=trial.path.parent.name) if len(paths[trial.path.stem]) > 1 else trial for trial in group]
        for group in groups
    ]
