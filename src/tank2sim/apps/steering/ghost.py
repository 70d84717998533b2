"""A measured trial next to the ship that one steers: its track, what steered it, and where it began."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice
from tank2sim.records.trials import Trial, mean_wind
from tank2sim.units import KNOT_MPS

APPROACH = 20
"""The approach is taken as the first of so many parts of a track (project choice) where a trial states no speed or
heading."""

_START = (("x", "m"), ("y", "m"), ("v", "mps"), ("r", "radps"))
_SPEEDS = {"u_ground_mps": "its speed over the ground", "sog_mps": "its speed over the ground"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Ghost:
    """A measured trial next to the ship, SI, rad, arrays (n,); nan where nothing was measured.

    `rudder_rad` is the measured angle if `by_angle`, else the order. `start` holds the start of the ship on it
    (``initial.*``) and `held` inputs at their mean (the wind), by name; `notices` what was taken for what.
    """

    label: str
    time_s: Array
    x_m: Array
    y_m: Array
    psi_rad: Array
    rudder_rad: Array
    rpm_radps: Array
    by_angle: bool
    start: Mapping[str, float]
    held: Mapping[str, float]
    notices: tuple[Notice, ...]


def ghost_of(trial: Trial, model: Model) -> Ghost:
    """A trial as a ghost: its track from its first row on, and the rudder that steered it.

    That is the measured angle where there is one, as in identification and validation: what its gear made of the
    orders is in the record. Without it, the order.

    Raises
    ------
    InputError
        The trial has no positions.
    """
    blank = np.full(len(trial.time_s), math.nan)
    signals = {
        name: np.asarray(values, dtype=float) for name, values in trial.signals.items() if np.isfinite(values).any()
    }
    if not {"x_m", "y_m"} <= set(signals):
        raise trial.fault("columns x_m, y_m", "hold no track", "a ghost needs positions: leave the ghost out")
    start = {f"initial.{name}": _first(signals[key]) for name, unit in _START if (key := f"{name}_{unit}") in signals}
    course, way = _approach(trial.time_s, signals["x_m"], signals["y_m"])
    start["initial.psi"] = _first(signals["psi_rad"]) if "psi_rad" in signals else course
    start["initial.u"], speed_notices = _speed(signals, way)
    by_angle = "delta_rad" in signals
    if by_angle:
        start["initial.rudder_angle"] = _first(signals["delta_rad"])
        speed_notices.append(
            "steered as in the trial, the rudder follows the measured angle: not through its steering gear"
        )
    held, wind = _wind(trial, model)
    return Ghost(
        label=trial.name,
        time_s=trial.time_s - trial.time_s[0],
        x_m=signals["x_m"],
        y_m=signals["y_m"],
        psi_rad=signals.get("psi_rad", blank),
        rudder_rad=signals.get("delta_rad", signals.get("delta_order_rad", blank)),
        rpm_radps=signals.get("n_radps", blank),
        by_angle=by_angle,
        start={name: value for name, value in start.items() if name in model},
        held=held,
        notices=tuple(Notice(f"{trial.path.name}: {text}") for text in (*speed_notices, *wind)),
    )


def _speed(signals: Mapping[str, Array], way: float) -> tuple[float, list[str]]:
    """Speed ahead at the start, m/s, and what a user should know of it."""
    if "u_mps" in signals:
        return _first(signals["u_mps"]), []
    for name, what in _SPEEDS.items():
        if name in signals:
            speed = _first(signals[name])
            return speed, [f"no speed through the water: the ship starts at {what}, {speed / KNOT_MPS:.2f} knots"]
    return way, [f"no speed: the ship starts at the speed of its first positions, {way / KNOT_MPS:.2f} knots"]


def _wind(trial: Trial, model: Model) -> tuple[dict[str, float], list[str]]:
    """The mean wind of a record as inputs of the model, and a notice of it."""
    wind = mean_wind([trial])
    if wind is None or "wind.speed" not in model.input_names:
        return {}, []  # that a card without wind leaves it out is reported where the trial is read
    mean, come_from = wind
    text = f"the wind is set to the mean of the record, {mean:.3g} m/s from {math.degrees(come_from):.0f} deg"
    return {"wind.speed": mean, "wind.direction": come_from}, [text]


def _first(values: Array) -> float:
    return float(values[np.isfinite(values)][0])


def _approach(time: Array, x: Array, y: Array) -> tuple[float, float]:
    """Course (rad) and speed (m/s) of the first part of a track."""
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(known) < 2:
        return 0.0, 0.0
    begin, end = known[0], known[max(1, len(known) // APPROACH)]
    north, east = float(x[end] - x[begin]), float(y[end] - y[begin])
    return math.atan2(east, north), math.hypot(north, east) / float(time[end] - time[begin])
