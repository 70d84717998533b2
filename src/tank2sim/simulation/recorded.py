"""A recorded trial as a manoeuvre: which one it was, how it was steered, and the figures it shows.

So that the same manoeuvre can be simulated in closed loop, from the measured state at the execute, and its figures be
compared with the measured ones: a zigzag's rudder turns when the *simulated* heading tells it to, with the delay that
the controller of the trial had.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import SteeringGear
from tank2sim.cards.reading import revised
from tank2sim.dynamics.model import Model, Vector
from tank2sim.dynamics.steering_gear import UNSTATED_LAG
from tank2sim.records.trials import Trial
from tank2sim.simulation.figures import Figures, figures_of
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory

Places = NDArray[np.int64]

NOMINAL_HEADINGS_DEG = (1, 2, 5, 10, 15, 20, 25, 30, 35)
"""Headings at which zigzags are reversed (ITTC 7.5-04-02-01, and the modified ones of SIMMAN)."""

STATES = {
    "u_mps": "motion.u",
    "v_mps": "motion.v",
    "r_radps": "motion.r",
    "psi_rad": "motion.psi",
    "x_m": "motion.x",
    "y_m": "motion.y",
}
"""Signal of a trial to the state of a model that it measures."""

FED = {
    "n_radps": "propeller.speed",
    "wind_speed_mps": "wind.speed",
    "wind_direction_rad": "wind.direction",
}
"""Signal of a trial to the input of a model that it gives, beside the rudder."""

SMOOTHING = 0.3
"""Recorded signals are smoothed over this many L/u0 before figures are read off (ours: below the time of any peak)."""

FARTHEST_OFF_COURSE = math.radians(2.0)
"""Farther from its first heading at the execute, a trial did not begin on its course."""

HALF_TURNS = 2.0
"""A turn is repeated for this many times as long as the measured one took to turn through 180 deg."""

LEAST_RUDDER = math.radians(2.0)
"""A rudder that never exceeds this is no manoeuvre."""

STEADY = 0.02
HELD = 0.05
"""A rudder is held when it stays within a share STEADY of an angle for a share HELD of the longest such time: choices
of ours. In the approaches of the 3 m Esso Osaka it stays for 2 % of that at most, at the first angle of zigzags of the
KVLCC2 for 13 % at least (35/5)."""

STEEPER = 3.0
"""A rudder on its way does not speed up by this factor: gears have constant rates, or slow down (ours)."""

ROUNDS = 6
"""Each halves what a record that begins with the rudder on its way leaves of its error: a choice of ours."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """What a trial was.

    Parameters
    ----------
    trial : Trial
        The record, at the scale of the model that simulates it.
    manoeuvre : Turn or Zigzag
        With the rudder as it was reached, and the controller's lag.
    begin_s, end_s : float
        Execute, and end of what belongs to the manoeuvre (a turn ends when its rudder is taken back), s.
    rudder_rate_radps : float or None
        Rate at which the rudder went over; None where only its order is known, which the gear of the ship follows.
    start : dict
        ``initial.*`` parameters of a model for the state at the execute.
    inputs : dict
        Other inputs of a model, at their mean.
    figures : Figures
        As measured.
    """

    trial: Trial
    manoeuvre: Turn | Zigzag
    begin_s: float
    end_s: float
    rudder_rate_radps: float | None
    start: dict[str, float]
    inputs: dict[str, float]
    figures: Figures

    @property
    def words(self) -> str:
        """What it was, for people: ``zigzag 20/10, reversed 2.4 s late``."""
        rudder = math.degrees(self.manoeuvre.rudder)
        if isinstance(self.manoeuvre, Turn):
            return f"turn {rudder:.3g}"
        late = f"{self.manoeuvre.lag_s:.2g} s late"
        return f"zigzag {rudder:.3g}/{math.degrees(self.manoeuvre.heading):.3g}, reversed {late}"


def recorded(trial: Trial, model: Model) -> Recorded | None:
    """Recognise a turning circle or a zigzag in a trial; None if it is neither.

    Parameters
    ----------
    trial : Trial
        With a rudder, heading, yaw rate, velocities and positions.
    model : Model
        Of a ship of the trial's size: for L/u0 and the names of its variables.
    """
    needed = ("psi_rad", "r_radps", "u_mps", "v_mps", "x_m", "y_m")
    if any(name not in trial.signals or np.isnan(trial.signals[name]).all() for name in needed):
        return None
    rudder = _filled(trial.time_s, trial.signals.get("delta_rad", trial.signals.get("delta_order_rad")))
    held = _plateaus(trial.time_s, rudder)
    if not held:
        return None
    first = held[0]
    values = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    ship_time = values["ship.length"] / values["ship.speed"]
    smooth = {name: _smoothed(trial, name, ship_time) for name in needed}
    turned = np.abs(smooth["psi_rad"] - np.interp(first.execute_s, trial.time_s, smooth["psi_rad"]))
    inside = (trial.time_s >= first.execute_s) & (trial.time_s <= first.end_s)
    manoeuvre: Turn | Zigzag | None = None
    if len(held) >= 2 and all(a.angle * b.angle < 0 for a, b in pairwise(held)):
        manoeuvre = _zigzag(trial, held, smooth)
        end = float(trial.time_s[-1])
    elif turned[inside].max(initial=0.0) > math.radians(120):
        manoeuvre, end = Turn(first.angle), first.end_s
    if manoeuvre is None:
        return None
    track = _trajectory(trial, model, manoeuvre, (first.execute_s, end), (held, smooth))
    figures = figures_of(manoeuvre, track, float(values["ship.length"]))
    start = {f"initial.{name[7:]}": float(track[name][0]) for name in STATES.values()}
    inputs = {
        there: float(np.nanmean(trial.signals[name]))
        for name, there in FED.items()
        if name in trial.signals and there in model.input_names
    }
    start["initial.rudder_angle"] = float(np.interp(first.execute_s, trial.time_s, rudder))
    rate = first.rate if "delta_rad" in trial.signals else None
    return Recorded(trial, manoeuvre, first.execute_s, end, rate, start, inputs, figures)


def steerable(card: ManoeuvringCard) -> ManoeuvringCard:
    """The card with limits of the gear where it states none, so wide that they limit nothing.

    :func:`repeat` then has a rate to set in the model.
    """
    gear = card.steering_gear or SteeringGear()
    wide = {"max_rate_degps": 180.0, "max_angle_deg": 89.0}
    stated = {"max_rate_degps": gear.max_rate_radps, "max_angle_deg": gear.max_angle_rad}
    return revised(card, {}, {f"steering_gear.{key}": wide[key] for key, value in stated.items() if value is None})


def repeat(what: Recorded, integrator: Integrator, parameters: dict[str, float] | None = None) -> Run:
    """Simulate a recorded manoeuvre in closed loop from its measured start.

    Parameters
    ----------
    what : Recorded
        From :func:`recorded`.
    integrator : Integrator
        Of a model with steering gear (of a card made :func:`steerable`, so that the recorded rate can be set).
    parameters : dict, optional
        Values of the model's parameters by name.

    Raises
    ------
    InputError
        The motion leaves all bounds.
    """
    model = integrator.model
    values = {}
    if what.rudder_rate_radps is not None:  # the record shows what came of order and gear: a ramp, and nothing else
        known = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
        lag = UNSTATED_LAG * known["ship.length"] / known["ship.speed"]
        gear = {
            "steering.max_rate": what.rudder_rate_radps,
            "steering.max_angle": math.pi / 2,
            "steering.time_constant": lag,
        }
        values = {name: value for name, value in gear.items() if name in model.parameter_names}
    start = {name: value for name, value in what.start.items() if name in model.parameter_names}
    duration = what.end_s - what.begin_s
    half = what.figures.get("time_180_s")
    if isinstance(half, float):  # what comes long after says nothing of the figures, and may leave the model's range
        duration = min(duration, HALF_TURNS * half)
    return simulate(
        model,
        what.manoeuvre,
        duration_s=duration,
        inputs=what.inputs,
        parameters={**values, **start, **(parameters or {})},
        integrator=integrator,
    )


@dataclass(frozen=True)
class _Plateau:
    """A rudder angle that was held: when the rudder began to move there, how fast, and until when it stayed."""

    angle: float
    execute_s: float
    rate: float
    end_s: float


def _plateaus(time: Vector, rudder: Vector) -> list[_Plateau]:
    found: list[_Plateau] = []
    before = 0
    for group in _held(rudder):
        angle = float(np.median(rudder[group]))
        stretch = slice(before, int(group[0]) + 1)
        if found:
            execute, rate = _execute(time[stretch], rudder[stretch], found[-1].angle, angle)
        else:
            execute, rate = _first_execute(time[stretch], rudder[stretch], angle)
        found.append(_Plateau(angle, execute, min(rate, math.pi), float(time[group[-1]])))
        before = int(group[-1])
    return found


def _first_execute(time: Vector, rudder: Vector, angle: float) -> tuple[float, float]:
    """The same from the approach, whose rudder is its median until the execute: the two are found in turn."""
    origin = float(np.median(rudder))
    for _ in range(ROUNDS):
        execute, _ = _execute(time, rudder, origin, angle)
        origin = float(np.median(rudder[: max(1, int(np.searchsorted(time, execute)))]))
    return _execute(time, rudder, origin, angle)


def _execute(time: Vector, rudder: Vector, origin: float, angle: float) -> tuple[float, float]:
    """When the rudder began to move from one angle to another, s, and its rate, rad/s, at the end of a stretch."""
    sign = math.copysign(1.0, angle)
    course, whole = sign * (rudder - origin), sign * (angle - origin)
    if whole == 0:
        return float(time[0]), math.inf  # the record begins with the rudder there
    quarter, most, more = (_last_crossing(time, course, share * whole) for share in (0.25, 0.7, 0.85))
    rate, last = 0.45 * whole / max(most - quarter, 1e-9), 0.15 * whole / max(more - most, 1e-9)
    if last > STEEPER * rate:  # it kept the course at more than a quarter of the angle, and left from there
        rate = last
    return most - 0.7 * whole / rate, rate


def _held(rudder: Vector) -> list[Places]:
    """Samples of each angle that was held, one side after the other.

    A rudder that keeps the course before the execute may go as far over as later for the manoeuvre, but stays nowhere:
    what comes before the first angle that is held is of the approach.
    """
    size = float(np.percentile(np.abs(rudder), 95))
    if size < LEAST_RUDDER:
        return []
    side = np.where(np.abs(rudder) > 0.8 * size, np.sign(rudder), 0)
    places = np.flatnonzero(side)
    parts = np.split(places, np.flatnonzero((np.diff(side[places]) != 0) | (np.diff(places) > 1)) + 1)
    runs = [part for part in parts if len(part) >= 3]
    if not runs:
        return []
    steady = [np.count_nonzero(np.abs(rudder[run] - np.median(rudder[run])) < STEADY * size) for run in runs]
    first = next(number for number, count in enumerate(steady) if count >= HELD * max(steady))
    kept = runs[first:]
    turns = [number for number in range(1, len(kept)) if side[kept[number][0]] != side[kept[number - 1][0]]]
    return [np.concatenate(kept[a:b]) for a, b in pairwise([0, *turns, len(kept)])]


def _last_crossing(time: Vector, course: Vector, level: float) -> float:
    below = np.flatnonzero(course < level)
    last = int(below[-1]) if len(below) else 0
    if last + 1 >= len(course):
        return float(time[last])
    share = (level - course[last]) / (course[last + 1] - course[last])
    return float(time[last] + share * (time[last + 1] - time[last]))


def _zigzag(trial: Trial, held: list[_Plateau], smooth: dict[str, Vector]) -> Zigzag | None:
    """Rudder, nominal heading of the reversals, and the lag with which they came."""

    def at(name: str, time: float) -> float:
        return float(np.interp(time, trial.time_s, smooth[name]))

    # The course is that at the beginning of the record: until the execute a ship with any asymmetry has drifted off it.
    begin = float(smooth["psi_rad"][0])
    if abs(at("psi_rad", held[0].execute_s) - begin) > FARTHEST_OFF_COURSE:
        begin = at("psi_rad", held[0].execute_s)
    headings = [math.copysign(1, a.angle) * (at("psi_rad", b.execute_s) - begin) for a, b in pairwise(held)]
    rates = [math.copysign(1, a.angle) * at("r_radps", b.execute_s) for a, b in pairwise(held)]
    typical = float(np.mean([np.median(headings[side::2]) for side in (0, 1) if headings[side::2]]))
    nominal = [angle for angle in NOMINAL_HEADINGS_DEG if math.radians(angle - 0.4) <= typical]
    if not nominal or min(rates) <= 0:
        return None
    heading = math.radians(max(nominal))
    lag = float(np.median([(h - heading) / r for h, r in zip(headings, rates, strict=True)]))
    angle = float(np.median([abs(plateau.angle) for plateau in held]))
    return Zigzag(math.copysign(angle, held[0].angle), heading, max(lag, 0.0), begin)


def _trajectory(
    trial: Trial,
    model: Model,
    manoeuvre: Turn | Zigzag,
    span: tuple[float, float],
    seen: tuple[list[_Plateau], dict[str, Vector]],
) -> Trajectory:
    """The record between two times as a trajectory of the model: figures are read off it as off a simulation."""
    held, smooth = seen
    inside = (trial.time_s > span[0]) & (trial.time_s <= span[1])
    t = np.concatenate([[span[0]], trial.time_s[inside]])
    x = np.zeros((len(t), len(model.states)))
    for name, there in STATES.items():
        x[:, model.state_names.index(there)] = np.interp(t, trial.time_s, smooth[name])
    u = np.tile(model.input_values(), (len(t), 1))
    command = model.input_names.index("rudder.command")
    for plateau in held:
        u[t >= plateau.execute_s, command] = plateau.angle
    y = np.array(model.output(x.T, u.T, np.repeat(model.parameter_values()[:, None], len(t), axis=1))).T
    y[:, model.outputs.index("motion.rdot")] = np.gradient(x[:, model.state_names.index("motion.r")], t)
    return Trajectory(model, t - span[0], x, u, y)


def _smoothed(trial: Trial, name: str, ship_time: float) -> Vector:
    values = _filled(trial.time_s, trial.signals[name])
    window = int(SMOOTHING * ship_time / float(np.median(np.diff(trial.time_s)))) // 2 * 2 + 1
    if window < 5 or window > len(values):
        return values
    smooth: Vector = savgol_filter(values, window, 3)
    return smooth


def _filled(time: Vector, values: Vector | None) -> Vector:
    assert values is not None  # a trial without rudder is refused on reading
    known = ~np.isnan(values)
    return np.interp(time, time[known], values[known])
