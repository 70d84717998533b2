"""Recognition of the manoeuvre in a recorded trial, its steering, and its figures.

The same manoeuvre can then be simulated in closed loop, from the measured state at the execute, and its figures
compared with the measured ones: a zigzag's rudder is reversed at the *simulated* heading, with the delay of the trial's
controller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import SteeringGear
from tank2sim.cards.reading import revised
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model
from tank2sim.records.audit.noise import white_noise
from tank2sim.records.trials import ROWS_TO_SHOW_AN_ORDER, Trial, sampling_step, straight_over_gaps, usual_step
from tank2sim.simulation.figures import Figures, figures_of
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.motion_record import FED, STATES
from tank2sim.simulation.rudder_record import (
    TURNS_AT_EXECUTE,
    HeldAngle,
    held_rudders,
    holds_other_angles,
    rudder_before,
)
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.simulation.zigzag_reversals import COURSE_ERROR, FittedZigzag, fitted_zigzag

SMOOTHING = 0.3
"""Smoothing time of recorded signals for figures, L/u0 (project choice: below the time of any peak)."""

POINT_ERROR = 0.01
"""Standard error of the place of the measured point along the ship, in ship lengths: antennas and model origins are
stated to a per cent of the length at best (project choice)."""

HALF_TURNS = 2.0
"""Duration of a simulated turn over the time of the measured one to 180 deg."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """The manoeuvre of a trial.

    `trial`: The record, at the scale of the model that simulates it. `manoeuvre`: With the reached rudder angle, and
    the controller's lag. `begin_s`, `end_s`: Execute (the step of the order where the record has it, else the rudder's
    first movement), and end of the manoeuvre (a turn ends when its rudder is reduced), s. `rudder_rate_radps`: Rate of
    the rudder; None where only its order is known, which the gear of the ship follows. `start`: ``initial.*``
    parameters of a model for the state at the execute. `inputs`: Other inputs of a model, at their mean. `figures`: As
    measured. `errors`: Standard errors of the joint fit of a zigzag's reversals (:func:`.fitted_zigzag`).
    `reading_errors`: Standard errors of figures by what is uncertain of the measured point, of the heading's zero and
    of the time of the first order: m for distances of turns, rad for overshoots, s for times.
    """

    trial: Trial
    manoeuvre: Turn | Zigzag
    begin_s: float
    end_s: float
    rudder_rate_radps: float | None
    start: dict[str, float]
    inputs: dict[str, float]
    figures: Figures
    errors: dict[str, float] = field(default_factory=dict)
    reading_errors: dict[str, float] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """Description of the manoeuvre: ``zigzag 20/10, reversed 2.4 s late (± 0.1 s)``."""
        rudder = math.degrees(self.manoeuvre.rudder)
        if isinstance(self.manoeuvre, Turn):
            return f"turn {rudder:.3g}"
        if self.manoeuvre.opposite is not None:
            rudder = (rudder - math.degrees(self.manoeuvre.opposite)) / 2
        late = f"{self.manoeuvre.lag_s:.2g} s late"
        if "lag_s" in self.errors:
            late += f" (± {self.errors['lag_s']:.1g} s)"
        headings = " and ".join(f"{math.degrees(each):.3g}" for each in dict.fromkeys(self.manoeuvre.headings))
        return f"zigzag {rudder:.3g}/{headings}, reversed {late}"


_FEWEST = 4
"""Rows before an execute from which its state is by straight lines (project choice)."""

CIRCLE_FROM = math.radians(120.0)
"""Least change of heading of a turning circle: its figures are read to 90 and 180 deg (project choice)."""

_ABOVE_NOISE = 3.0
"""Standard deviations by which a yaw rate exceeds its noise (project choice: one reading in 370)."""


def recorded(trial: Trial, model: Model) -> Recorded | None:
    """Recognise a turning circle or a zigzag in a trial as :func:`recognise`; None if it is neither."""
    found = recognise(trial, model)
    return None if isinstance(found, str) else found


@lru_cache(maxsize=32)  # each trial is asked for once by every comparison with a card
def recognise(trial: Trial, model: Model) -> Recorded | str:
    """Recognise a turning circle or a zigzag in a trial, or say why it is neither.

    Both begin on a straight course. A record that begins in a manoeuvre has no figures, and a rudder that is held at
    other angles in between makes no zigzag.

    `trial`: With a rudder, heading and positions. Unmeasured yaw rate and velocities through the water are derived from
    them, less the current of the model. `model`: Model of a ship of the trial's size: for L/u0 and the names of its
    variables.
    """
    held = held_rudders(trial)
    if not held:
        return "its rudder is not held over"
    values = model.defaults
    ship_time = values["ship.length"] / values["ship.speed"]
    smooth = _motion(trial, model, ship_time)
    if smooth is None:
        return "it has no heading or no positions"
    first = held[0]
    if _turning(trial, first, smooth["r_radps"], ship_time):
        return f"the ship turns at its first order, at {first.execute_s:.4g} s"
    steered = _steered(trial, held, smooth, ship_time)
    if isinstance(steered, str):
        return steered
    manoeuvre, zigzag = steered.manoeuvre, steered.zigzag
    track = _trajectory(trial, model, manoeuvre, (first.execute_s, steered.end_s), (held, smooth), ship_time)
    figures = figures_of(manoeuvre, track, float(values["ship.length"]))
    start = {f"initial.{name[7:]}": float(track[name][0]) for name in STATES.values()}
    start["initial.rudder_angle"] = rudder_before(trial, first)
    inputs = _fed(trial, model)
    late = _order_error(trial, first)
    if zigzag:
        figures = zigzag.from_reversals(figures)
        errors, reading = zigzag.errors, dict(zigzag.reading_errors)
        reading["initial_turning_time_s"] = math.hypot(reading["initial_turning_time_s"], late)
    else:
        errors, reading = {}, _turn_reading_errors(track, float(values["ship.length"]), late)
    rate = _usual_rate(held)
    return Recorded(trial, manoeuvre, first.execute_s, steered.end_s, rate, start, inputs, figures, errors, reading)


def _usual_rate(held: list[HeldAngle]) -> float | None:
    """Rate of the rudder, rad/s, at the reversals of a zigzag, which are twice as long as its first movement."""
    reversals = [angle.rate for angle in held[1:] if angle.rate is not None]
    return float(np.median(reversals)) if reversals else held[0].rate


@dataclass(frozen=True, eq=False)
class _Steered:
    """How a trial was steered, until when, and the fit of a zigzag's reversals."""

    manoeuvre: Turn | Zigzag
    end_s: float
    zigzag: FittedZigzag | None = None


def _steered(trial: Trial, held: list[HeldAngle], smooth: dict[str, Array], ship_time: float) -> _Steered | str:
    """The manoeuvre of the held angles, or why they make none."""
    first = held[0]
    if len(held) == 1:
        inside = (trial.time_s >= first.execute_s) & (trial.time_s <= first.end_s)
        turned = np.abs(smooth["psi_rad"] - np.interp(first.execute_s, trial.time_s, smooth["psi_rad"]))
        most = float(turned[inside].max(initial=0.0))
        if most <= CIRCLE_FROM:
            return (
                f"it turns {math.degrees(most):.0f} deg with the rudder over, less than {math.degrees(CIRCLE_FROM):.0f}"
            )
        return _Steered(Turn(first.angle, first.moves_s - first.execute_s), first.end_s)
    if holds_other_angles(trial, held):
        return "its rudder is held at other angles between the reversals"
    noise = _smoothed_noise(trial, "psi_rad", ship_time)
    zigzag = fitted_zigzag(trial.time_s, held, smooth, noise, ship_time)
    if zigzag is None:
        return "its rudder is not reversed at the same heading to both sides"
    wait = float(np.median([angle.moves_s - angle.execute_s for angle in held]))
    return _Steered(replace(zigzag.manoeuvre, wait_s=wait), float(trial.time_s[-1]), zigzag)


def _turning(trial: Trial, first: HeldAngle, rates: Array, ship_time: float) -> bool:
    """True if the ship turns at the first execute, by its smoothed yaw rates (n,), rad/s, beyond their noise."""
    noise = _smoothed_noise(trial, "r_radps", ship_time) if "r_radps" in trial.signals else 0.0
    rate = abs(float(np.interp(first.execute_s, trial.time_s, rates)))
    return rate > max(TURNS_AT_EXECUTE * float(np.max(np.abs(rates))), _ABOVE_NOISE * noise)


def _order_error(trial: Trial, held: HeldAngle) -> float:
    """Standard error of an order's time, s: 0.29 of a row, or half a row in records that a simulator wrote."""
    return 0.0 if held.rate is not None else ROWS_TO_SHOW_AN_ORDER * sampling_step(trial)


def _turn_reading_errors(track: Trajectory, length: float, order_error: float) -> dict[str, float]:
    """Standard errors of a turn's distances, m, and times, s.

    A point p ahead of the place that is taken for it changes the advance by -p and the transfer by p (heading 90 deg),
    and the tactical diameter by nothing (180 deg). With a heading's zero off by e the axes turn: a distance changes by
    e times the one across it, where it is read. With an order given e later (s, standard error `order_error`) the
    times are shorter by e, and the advance by e times the speed ahead.
    """
    psi, x, y = (track[f"motion.{name}"] - track[f"motion.{name}"][0] for name in ("psi", "x", "y"))
    course = track["motion.psi"][0]
    ahead, side = x * math.cos(course) + y * math.sin(course), y * math.cos(course) - x * math.sin(course)
    turned = np.maximum.accumulate(np.abs(psi))
    point, errors = POINT_ERROR * length, {"time_90_s": order_error, "time_180_s": order_error}
    late = order_error * float(track["motion.u"][0])
    for name, angle, across, shift in (
        ("advance_m", 90.0, side, math.hypot(point, late)),
        ("transfer_m", 90.0, ahead, point),
        ("tactical_diameter_m", 180.0, ahead, 0.0),
    ):
        place = int(np.searchsorted(turned, math.radians(angle)))
        if place < len(turned):
            errors[name] = math.hypot(COURSE_ERROR * float(across[place]), shift)
    return errors


def steerable(card: ManoeuvringCard) -> ManoeuvringCard:
    """The card with limits of the gear where it states none, too wide to have an effect.

    :func:`repeat` then has a rate to set in the model.
    """
    gear = card.steering_gear or SteeringGear()
    wide = {"max_rate_degps": 180.0, "max_angle_deg": 89.0}
    stated = {"max_rate_degps": gear.max_rate_radps, "max_angle_deg": gear.max_angle_rad}
    return revised(card, {}, {f"steering_gear.{key}": wide[key] for key, value in stated.items() if value is None})


def repeat(record: Recorded, integrator: Integrator, parameters: dict[str, float] | None = None) -> Run:
    """Simulate a recorded manoeuvre in closed loop from its measured start.

    `what`: From :func:`recorded`. `integrator`: Integrator of a model with steering gear (card made :func:`steerable`,
    so that the recorded rate can be set). `parameters`, optional: Values of the model's parameters by name.

    Raises InputError: The motion leaves all bounds.
    """
    model = integrator.model
    values = {}
    if record.rudder_rate_radps is not None:  # the record shows the result of order and gear: a ramp, and its last part
        gear = {"steering.max_rate": record.rudder_rate_radps, "steering.max_angle": math.pi / 2}
        values = {name: value for name, value in gear.items() if name in model.parameter_names}
    start = {name: value for name, value in record.start.items() if name in model.parameter_names}
    duration = record.end_s - record.begin_s
    half = record.figures.get("time_180_s")
    if isinstance(half, float):  # later motion does not affect the figures, and may leave the model's range
        duration = min(duration, HALF_TURNS * half)
    return simulate(
        model,
        record.manoeuvre,
        duration_s=duration,
        inputs=record.inputs,
        parameters={**values, **start, **(parameters or {})},
        integrator=integrator,
    )


def _smoothed_noise(trial: Trial, name: str, ship_time: float) -> float:
    """Standard deviation of a signal's noise after smoothing, SI."""
    from scipy.signal import savgol_coeffs  # slow to import

    window = smoothing_window(sampling_step(trial), ship_time)
    gain = float(savgol_coeffs(window, 3)[window // 2]) if window >= 5 else 1.0
    return math.sqrt(gain) * trial.noise.get(name, white_noise(trial.signals[name]))


def _trajectory(
    trial: Trial,
    model: Model,
    manoeuvre: Turn | Zigzag,
    span: tuple[float, float],
    seen: tuple[list[HeldAngle], dict[str, Array]],
    ship_time: float,
) -> Trajectory:
    """The record between two times as a trajectory of the model: for the same evaluation of figures as a simulation."""
    held, smooth = seen
    near = 1e-3 * sampling_step(trial)
    moves = [angle.moves_s for angle in held if np.min(np.abs(trial.time_s - angle.moves_s)) > near]
    times = np.union1d(trial.time_s, moves)  # with the executes between two rows
    t = np.concatenate([[span[0]], times[(times > span[0]) & (times <= span[1])]])
    x = np.zeros((len(t), len(model.states)))
    before = _state_before(trial, smooth, span[0], ship_time)
    for name, state in STATES.items():
        x[:, model.state_names.index(state)] = np.interp(t, trial.time_s, smooth[name])
        x[0, model.state_names.index(state)] = before[name]
    u = np.tile(model.input_values(), (len(t), 1))
    command = model.input_names.index("rudder.command")
    for held_angle in held:
        u[t >= held_angle.moves_s - near, command] = held_angle.angle
    y = np.array(model.output(x.T, u.T, np.repeat(model.parameter_values()[:, None], len(t), axis=1))).T
    y[:, model.outputs.index("motion.rdot")] = np.gradient(x[:, model.state_names.index("motion.r")], t)
    return Trajectory(model, t - span[0], x, u, y)


def _state_before(trial: Trial, smooth: dict[str, Array], execute_s: float, ship_time: float) -> dict[str, float]:
    """Signals of :data:`STATES` at an execute, by straight lines through what came before it.

    Smoothing mixes what comes after into it: of a 10/10 zigzag of a Mariner a tenth of the largest yaw rate, which
    seems to begin 0.3 s earlier. Signals that were derived are slopes over a window: they have their mean over another
    one, half a window before. Without :data:`_FEWEST` rows before, the smoothed value.
    """
    time, window = trial.time_s, SMOOTHING * ship_time
    found = {}
    for name, values in smooth.items():
        measured = trial.signals.get(name, np.full(len(time), np.nan))
        derived = bool(np.isnan(measured).all())
        end = execute_s - 0.5 * window * derived
        known = (time >= end - window) & (time <= end) & (derived | np.isfinite(measured))
        line = values if derived else measured
        if np.count_nonzero(known) >= _FEWEST:
            found[name] = float(np.polyfit(time[known] - execute_s, line[known], 0 if derived else 1)[-1])
        else:
            found[name] = float(np.interp(execute_s, time, values))
    return found


def velocities_through_water(model: Model, inputs: Array, psi: Array, north: Array, east: Array) -> tuple[Array, Array]:
    """u and v (n,), m/s, of a ship from its velocity over the ground, less the current of the model.

    `inputs` (n, nu): The model's inputs. `psi` (n,): Heading, rad; nan where it is unknown. `north`, `east` (n,): Over
    the ground, m/s.
    """
    drift = _drift_over_ground(model, inputs, psi)
    return earth_components(north - drift[:, 0], east - drift[:, 1], -psi)


def earth_components(forward: Array, starboard: Array, angle: Array) -> tuple[Array, Array]:
    """Components to north and east (n,) of a vector with components `forward` and `starboard` (n,) in axes that are
    turned by `angle` (n,), rad."""
    north, east = earth_velocity(*(ca.DM(values) for values in (forward, starboard, angle)))  # type: ignore[arg-type]
    return np.array(north).ravel(), np.array(east).ravel()


def _drift_over_ground(model: Model, inputs: Array, psi: Array) -> Array:
    """Velocity over the ground of a ship that rests in the water, north and east (n, 2), m/s: the current's."""
    rates = model.expand(ca.vcat([model.symbol(f"motion.{axis}dot") for axis in "xy"]))
    states = np.zeros((len(psi), len(model.states)))
    states[:, model.state_names.index("motion.psi")] = psi
    p = np.repeat(model.parameter_values()[:, None], len(psi), axis=1)
    return np.array(ca.Function("rest", [model.x, model.u, model.p], [rates])(states.T, inputs.T, p)).T


def _motion(trial: Trial, model: Model, ship_time: float) -> dict[str, Array] | None:
    """Smoothed signals of :data:`STATES` (n,), by slopes where not measured; None without heading or positions."""
    known = {name for name in STATES if name in trial.signals and not np.isnan(trial.signals[name]).all()}
    if not {"psi_rad", "x_m", "y_m"} <= known:
        return None
    time = trial.time_s
    smooth = {name: _smoothed(time, straight_over_gaps(time, trial.signals[name]), ship_time) for name in known}

    if "r_radps" not in known:
        smooth["r_radps"] = _slope(time, smooth["psi_rad"], ship_time)
    if not {"u_mps", "v_mps"} <= known:
        fed = {**dict(zip(model.input_names, model.input_values(), strict=True)), **_fed(trial, model)}
        inputs = np.tile([fed[name] for name in model.input_names], (len(time), 1))
        north, east = (_slope(time, smooth[name], ship_time) for name in ("x_m", "y_m"))
        u, v = velocities_through_water(model, inputs, smooth["psi_rad"], north, east)
        smooth = {"u_mps": u, "v_mps": v, **smooth}
    return smooth


def _fed(trial: Trial, model: Model) -> dict[str, float]:
    """Other inputs of the model at their mean in the trial."""
    return {
        variable: float(np.nanmean(trial.signals[name]))
        for name, variable in FED.items()
        if name in trial.signals and variable in model.input_names
    }


def smoothing_window(step_s: float, ship_time: float) -> int:
    """Odd number of samples, `step_s` s apart, of the smoothing window of a ship whose L/u0 is `ship_time` s."""
    return int(SMOOTHING * ship_time / step_s) // 2 * 2 + 1


def _smoothed(time: Array, values: Array, ship_time: float) -> Array:
    from scipy.signal import savgol_filter  # slow to import

    window = smoothing_window(usual_step(time), ship_time)
    if window < 5 or window > len(values):
        return values
    smooth: Array = savgol_filter(values, window, 3)
    return smooth


def _slope(time: Array, values: Array, ship_time: float) -> Array:
    """Time derivative by straight lines through windows: a higher degree would follow noise at a record's ends."""
    from scipy.signal import savgol_filter  # slow to import

    window = smoothing_window(usual_step(time), ship_time)
    if window < 3 or window > len(values):
        return np.asarray(np.gradient(values, time), dtype=np.float64)
    rise, run = (savgol_filter(signal, window, 1, deriv=1) for signal in (values, time))
    return np.asarray(rise / run, dtype=np.float64)
