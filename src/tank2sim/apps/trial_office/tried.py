"""Manoeuvres as they were tried: recognised, corrected for the current, with the errors of their figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from tank2sim.apps.trial_office.drift import CircleDrift, circle_drift
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.trials import Trial, straight_over_gaps
from tank2sim.simulation.card_range import Numbers, single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag
from tank2sim.simulation.recorded import POINT_ERROR, Recorded, recognise, repeat
from tank2sim.simulation.run import Run, simulate
from tank2sim.units import from_si

_SMOOTH = 60
"""Parts of a stop; speed and place are smoothed over each: noise lengthens a way of single rows. Project
choice."""

_AT_REST = 0.02
"""Share of the approach speed at which a ship counts as dead in the water. Project choice: above the noise of a log;
its last metre is far below the errors of a reach."""

REVERSED = 0.1
"""Share of the revolutions of the approach below which the engine counts as stopped or reversed. Project choice."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A manoeuvre of a trial."""

    trial: Trial | None  # None for a manoeuvre whose figures alone are known
    manoeuvre: Turn | Zigzag | Stop
    record: Recorded | None  # The recognised turn or zigzag
    begin_s: float  # Time of the execute
    speed_mps: float  # Speed of the approach
    figures: Numbers  # By name with unit
    errors: Numbers  # Standard errors of the figures by the reading of the record

    @property
    def name(self) -> str:
        """File of the record, or the manoeuvre."""
        return self.trial.name if self.trial is not None else self.manoeuvre.words

    @property
    def side(self) -> str:
        """``starboard`` or ``port``, the side of the first rudder; empty for a stop."""
        rudder = 0.0 if isinstance(self.manoeuvre, Stop) else self.manoeuvre.rudder
        return "starboard" if rudder > 0 else "port" if rudder < 0 else ""

    @property
    def drawn(self) -> bool:
        """Whether there is a track of a turn to draw."""
        return self.trial is not None and isinstance(self.manoeuvre, Turn)

    def _of_turn(self, *names: str) -> list[Array] | None:
        """Times and signals of a recorded turn, without gaps; None for other manoeuvres."""
        if self.trial is None or not isinstance(self.manoeuvre, Turn) or self.record is None:
            return None
        time, signals = self.trial.time_s, self.trial.signals
        rows = (time >= self.begin_s) & (time <= self.record.end_s)
        return [time[rows], *(straight_over_gaps(time, signals[name])[rows] for name in names)]

    @property
    def turned_deg(self) -> float | None:
        """Largest change of heading of a recorded turn; None for other manoeuvres."""
        if (found := self._of_turn("psi_rad")) is None:
            return None
        return math.degrees(float(np.max(np.abs(found[1] - found[1][0]))))

    @property
    def drift(self) -> CircleDrift | None:
        """The drift of a turn; None for a short one, and for other manoeuvres."""
        found = self._of_turn("x_m", "y_m", "psi_rad")
        return None if found is None else circle_drift(*found)


def tried(trial: Trial, model: Model) -> Tried | str:
    """The turn, the zigzag or the stop in a record at the size of the ship, or why it is none."""
    stop = _stop(trial, model)
    if isinstance(stop, Tried):
        return stop
    found = recognise(trial, model)
    if isinstance(found, str):
        return stop or found
    figures, noise = single_figures(found.figures), record_noise(trial)
    white = {"m": noise.get("x_m", 0.0), "deg": math.degrees(noise.get("psi_rad", 0.0))}
    errors = {
        name: math.hypot(from_si(name, found.reading_errors.get(name, 0.0)), white.get(name.rpartition("_")[2], 0.0))
        for name in figures
    }
    return Tried(trial, found.manoeuvre, found, found.begin_s, found.start["initial.u"], figures, errors)


def current_removed(one: Tried, current: Array, error_mps: float, model: Model) -> Tried:
    """The manoeuvre in water that rests: ``x'(t) = x(t) - V_c t`` from the execute on (MSC/Circ.1053, 3.4.2).

    `current` (2,): North and east, m/s; `error_mps`: Standard error of each component; it widens the errors of
    distances by its time.
    """
    if one.trial is None or not {"x_m", "y_m"} <= set(one.trial.signals):
        return one
    after = one.trial.time_s - one.begin_s
    moved = {name: one.trial.signals[name] - part * after for name, part in zip(("x_m", "y_m"), current, strict=True)}
    again = tried(replace(one.trial, signals={**one.trial.signals, **moved}), model)
    if isinstance(again, str) or type(again.manoeuvre) is not type(one.manoeuvre):
        return one
    errors = {
        name: math.hypot(again.errors.get(name, 0.0), error_mps * again.figures.get(_READ_AT.get(name, _STOPPED), 0.0))
        for name in again.figures
        if name.endswith("_m")
    }
    return replace(again, errors={**again.errors, **errors})


# Distance to the time from the execute at which it is read
_READ_AT = {
    "advance_m": "time_90_s",
    "transfer_m": "time_90_s",
    "tactical_diameter_m": "time_180_s",
    "initial_turning_distance_m": "initial_turning_time_s",
}
_STOPPED = "time_to_stop_s"


def simulated(one: Tried, integrator: Integrator, weather: Mapping[str, float], values: Mapping[str, float]) -> Numbers:
    """Figures of the manoeuvre by a model from the same approach: in closed loop where it was recorded.

    `integrator`: For a :func:`.steerable` ship; `weather`: Inputs of the model; without any, a calm approach; `values`:
    Parameters of the model in place of its own.
    """
    if one.record is not None and weather:
        record = replace(one.record, inputs={**one.record.inputs, **weather})
        return single_figures(repeat(record, integrator, dict(values)).figures)
    return single_figures(calm_run(one, integrator, one.speed_mps, values).figures)


def calm_run(one: Tried, integrator: Integrator, speed_mps: float, values: Mapping[str, float]) -> Run:
    """The same manoeuvre in calm water, from a straight approach at a speed, with the recorded rate of the rudder."""
    rate = None if one.record is None else one.record.rudder_rate_radps
    given = {**({} if rate is None else {"steering.max_rate": rate}), **values, "initial.u": speed_mps}
    known = {name: value for name, value in given.items() if name in integrator.model}
    manoeuvre = one.manoeuvre
    if isinstance(manoeuvre, Zigzag):
        manoeuvre = replace(manoeuvre, course=None)
    return simulate(integrator.model, manoeuvre, parameters=known, integrator=integrator)


def logged_speed(trial: Trial) -> Array | None:
    """Speed ahead as recorded, m/s, without gaps; None where no row has it."""
    speed = trial.signals.get("u_mps")
    return None if speed is None or np.isnan(speed).all() else straight_over_gaps(trial.time_s, speed)


def _stop(trial: Trial, model: Model) -> Tried | str:
    """A stop in a record: from the change of the revolutions until the ship does not move ahead any more.

    In words why it is none, where the engine was stopped; else an empty text.
    """
    signals = trial.signals
    if not {"n_radps", "x_m", "y_m", "psi_rad"} <= set(signals):
        return ""
    time = trial.time_s
    revolutions, psi, *place = (
        straight_over_gaps(time, signals[name]) for name in ("n_radps", "psi_rad", "x_m", "y_m")
    )
    approach = float(np.median(revolutions[: max(3, len(revolutions) // 50)]))
    slow = revolutions < REVERSED * approach
    if approach <= 0 or slow[0]:
        return "the engine is stopped or astern in its first rows, before which an approach is needed"
    if not slow.any():
        return ""
    begin = int(np.argmax(slow))
    velocity = [np.gradient(values, time) for values in place]
    ahead = velocity[0] * np.cos(psi) + velocity[1] * np.sin(psi)
    if (logged := logged_speed(trial)) is not None:
        ahead = logged
    steps = max(1, (len(time) - begin) // _SMOOTH)
    speed = float(np.median(ahead[max(0, begin - 5) : begin + 1]))
    still = np.flatnonzero(uniform_filter1d(ahead, steps)[begin:] <= _AT_REST * speed)
    if not len(still):
        return "the ship still moves ahead at its end, after the engine was stopped or reversed"
    end = begin + int(still[0])
    t, north, east = (values[begin : end + 1] for values in (time, *place))
    cos, sin = math.cos(psi[begin]), math.sin(psi[begin])
    n, e = north[-1] - north[0], east[-1] - east[0]
    length = model.defaults["ship.length"]
    way = float(np.hypot(np.diff(north[::steps]), np.diff(east[::steps])).sum())
    figures = {
        "track_reach_m": way,
        "head_reach_m": float(n * cos + e * sin),
        "side_reach_m": float(e * cos - n * sin),
        "time_to_stop_s": float(t[-1] - t[0]),
        "track_reach_lengths": way / length,
        "heading_change_deg": math.degrees(float(psi[end] - psi[begin])),
    }
    noise = record_noise(trial)
    point = POINT_ERROR * length
    errors = dict.fromkeys(("track_reach_m", "head_reach_m", "side_reach_m"), math.hypot(point, noise.get("x_m", 0.0)))
    errors["time_to_stop_s"] = float(np.median(np.diff(time))) / math.sqrt(12)
    manoeuvre = Stop(float(np.median(revolutions[begin : end + 1])))
    return Tried(trial, manoeuvre, None, float(time[begin]), speed, figures, errors)
