"""Margins and poles of a heading loop: the ship with its gear and its autopilot, linearised."""

from __future__ import annotations

import math
from dataclasses import dataclass

import control
import numpy as np

from tank2sim.analysis.linearisation import OperatingPoint, state_space, straight_course
from tank2sim.analysis.stability.straight_line import settled_states, sorted_modes
from tank2sim.arrays import Array, ComplexArray, ComplexNumber, Number, Unbounded
from tank2sim.dynamics.autopilot_loop import closed_loop_model
from tank2sim.dynamics.effects import acting_variable
from tank2sim.dynamics.model import Model

_HELD = ("motion.x", "motion.y", "motion.u")
"""States that a small course change does not move: position, and to first order the speed."""

_OFF_THE_KINK = 1e-6
"""rad: far below any rudder angle that matters."""

_TAKES_PART = 0.1
"""Participation in a mode from which a state is named (project choice)."""


@dataclass(frozen=True, kw_only=True)
class LoopMargins:
    """Margins of a heading loop at one speed, broken at the rudder order.

    `gain_margin_up`, `gain_margin_down`: factor by which the loop gain may grow, and share to which it may fall; inf
    and 0 without a limit (null in JSON). For an unstable ship the second is above 0: the ship needs its helmsman.
    `phase_margin_deg`: the least of all crossovers; `delay_margin_s`: largest delay in the loop that keeps it stable;
    `sensitivity_peak`: Ms, the largest 1/abs(1 + L), 1/Ms is the least distance of the Nyquist curve from -1;
    `crossover_radps`, `bandwidth_radps`: last crossover of the loop gain, and where the heading answers its order by
    3 dB less than slow ones; `stable`: every mode of the closed loop decays; `poles`: 1/s, slowest first.
    """

    speed_mps: float
    gain_margin_up: Unbounded
    gain_margin_down: float
    gain_margin_dB: Unbounded
    phase_margin_deg: Unbounded
    delay_margin_s: Unbounded
    sensitivity_peak: Number
    crossover_radps: Number
    bandwidth_radps: Unbounded
    stable: bool
    poles: tuple[ComplexNumber, ...]


@dataclass(frozen=True, kw_only=True)
class LargestSteps:
    """Largest change of course (deg) that stays linear: within the gear's rate limit, and within its angle limit.

    inf without such a limit. The linear response to a step in ``heading.command`` is scaled until it meets it.
    """

    within_rate_deg: Unbounded
    within_angle_deg: Unbounded


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopResponse:
    """Frequency responses of a heading loop at one speed: `omega_radps` (n,), and complex (n,) the `loop` transfer and
    the `heading` by its order, closed."""

    speed_mps: float
    omega_radps: Array
    loop: ComplexArray
    heading: ComplexArray


_DECADES = (-2.0, 1.3)
"""Reported frequencies, in decades from the crossover (project choice)."""
_FREQUENCIES = 500


def loop_response(ship: Model, autopilot: Model, speed_mps: float, crossover_radps: float) -> LoopResponse:
    """The loop over frequencies about its crossover."""
    omega = crossover_radps * np.logspace(*_DECADES, _FREQUENCIES)
    loop = np.asarray(loop_transfer(ship, autopilot, speed_mps)(1j * omega)).ravel()
    heading = np.asarray(closed_loop_transfer(ship, autopilot, speed_mps)(1j * omega))[0].ravel()
    return LoopResponse(speed_mps=speed_mps, omega_radps=omega, loop=loop, heading=heading)


def loop_transfer(ship: Model, autopilot: Model, speed_mps: float | None = None) -> control.StateSpace:
    """Loop transfer L from rudder order to rudder order, sign reversed: the closed loop has 1 + L."""
    point = straight_course(ship, speed_mps)
    states = [name for name in ship.state_names if name not in _HELD]
    seen = ["motion.psi", "motion.r"]
    plant = state_space(ship, point, states=states, inputs=["rudder.command"], outputs=seen)
    pilot = _pilot_system(autopilot, seen)
    return -control.ss(pilot.A, pilot.B, pilot.C, pilot.D) * control.ss(plant.A, plant.B, plant.C, plant.D)


def _pilot_system(autopilot: Model, inputs: list[str]) -> control.StateSpace:
    point = OperatingPoint(_states(autopilot, 0.0), autopilot.input_values(), autopilot.parameter_values())
    return state_space(autopilot, point, inputs=inputs, outputs=["rudder.command"])


def _states(autopilot: Model, held: float) -> Array:
    """States of an autopilot whose integral holds a rudder (rad)."""
    # At exactly 0 two limits of the anti-windup meet, and no slope is right.
    integral = held if abs(held) > _OFF_THE_KINK else _OFF_THE_KINK
    return np.array([integral if name == "autopilot.integral" else 0.0 for name in autopilot.state_names])


def closed_loop_transfer(ship: Model, autopilot: Model, speed_mps: float | None = None) -> control.StateSpace:
    """Transfer from the ordered heading to heading, rudder order and rudder rate of the closed loop."""
    course = straight_course(ship, speed_mps)
    joint = closed_loop_model(ship, autopilot)
    held = float(course.x[ship.state_names.index("rudder.angle")])
    held_states = _states(autopilot, held)
    u = joint.input_values()
    if "autopilot.integral" not in autopilot:  # a heading error holds the rudder that keeps the course
        u[joint.input_names.index("heading.command")] = held / float(
            _pilot_system(autopilot, ["heading.command"]).D.item()
        )
    point = OperatingPoint(np.concatenate([course.x, held_states]), u, joint.parameter_values())
    states = [name for name in joint.state_names if name not in _HELD]
    outputs = ["motion.psi", "rudder.command", "rudder.rate"]
    return state_space(joint, point, states=states, inputs=["heading.command"], outputs=outputs)


def loop_margins(ship: Model, autopilot: Model, speed_mps: float | None = None) -> LoopMargins:
    """Margins at a speed, by default the expansion speed.

    Raises InputError: the model is not a ship, or has no straight course.
    """
    loop = loop_transfer(ship, autopilot, speed_mps)
    whole = closed_loop_transfer(ship, autopilot, speed_mps)
    omega = margin_frequencies(loop)
    gain, phase, nearest, _, crossover, _ = control.stability_margins(
        control.frd(loop, omega, smooth=True), returnall=True
    )
    up, down = gain[gain > 1], gain[(gain < 1) & (gain > 0)]
    # A loop of almost no gain comes nearest to -1 at an end of the frequencies.
    closest = nearest.min() if nearest.size else np.abs(1 + loop(1j * omega)).min()
    delays = np.radians(np.mod(phase, 360.0)) / crossover
    heading = np.abs(whole(1j * omega))[0]
    below = np.flatnonzero(heading < math.sqrt(0.5))
    poles = sorted_modes(whole.A)
    largest_gain = float(up.min()) if up.size else math.inf
    return LoopMargins(
        speed_mps=ship.defaults["ship.speed"] if speed_mps is None else speed_mps,
        gain_margin_up=largest_gain,
        gain_margin_dB=20 * math.log10(largest_gain),
        gain_margin_down=float(down.max()) if down.size else 0.0,
        phase_margin_deg=float(min(phase, key=abs)) if phase.size else math.inf,
        delay_margin_s=float(delays.min()) if delays.size else math.inf,
        sensitivity_peak=float(1 / closest),
        crossover_radps=float(crossover.max()) if crossover.size else math.nan,
        bandwidth_radps=float(omega[below[0]]) if below.size else math.inf,
        stable=all(pole.real < 0 for pole in poles),
        poles=poles,
    )


def growing_effects(ship: Model, speed_mps: float | None = None) -> tuple[str, ...]:
    """States of the ship's effects (roll, memory of the flow) whose own modes grow with the rudder fixed.

    A design on sway and yaw assumes such states as settled and ignores them. A mode belongs to them if their
    participation in it is more than half: \\|w_i v_i\\|, w and v its left and right eigenvectors (Perez-Arriaga,
    Verghese and Schweppe 1982).
    """
    names = settled_states(ship)
    states = [name for name in ship.state_names if name not in (*_HELD, "motion.psi")]
    found = state_space(ship, straight_course(ship, speed_mps), states=states, inputs=["rudder.command"])
    modes, right = np.linalg.eig(found.A)
    shares = np.abs(right * np.linalg.inv(right).T)  # (states, modes)
    shares /= shares.sum(axis=0)
    theirs = [states.index(name) for name in names]
    growing = (modes.real > 0) & (shares[theirs].sum(axis=0) > 0.5)
    return tuple(
        name for name, place in zip(names, theirs, strict=True) if np.any(shares[place, growing] > _TAKES_PART)
    )


def margin_frequencies(loop: control.StateSpace) -> Array:
    """Frequencies (4000,) in rad/s that cover a loop: two decades beyond its crossover either way."""
    coarse = np.logspace(-6, 3, 2000)
    above = np.flatnonzero(np.abs(loop(1j * coarse)) > 1)
    middle = coarse[above[-1]] if above.size else 1.0
    return np.asarray(middle * np.logspace(-3, 2.5, 4000))


def largest_steps(ship: Model, autopilot: Model, speed_mps: float | None = None) -> LargestSteps:
    """Largest change of course whose linear response stays within the limits of the gear."""
    rate = ship.defaults.get(acting_variable(ship, "steering.max_rate"), math.inf)
    whole = closed_loop_transfer(ship, autopilot, speed_mps)
    sizes = np.abs(whole.poles())
    peaks = np.zeros(3)
    for duration in (20 / sizes.max(), 10 / sizes.min()):  # the gear's own answer, and the ship's
        answer = control.step_response(whole, np.linspace(0, duration, 2000)).outputs
        peaks = np.maximum(peaks, np.abs(answer).max(axis=-1).ravel())
    order, moved = (float(peak) for peak in peaks[1:])
    return LargestSteps(
        within_rate_deg=math.degrees(rate / moved),
        within_angle_deg=math.degrees(autopilot.defaults["autopilot.max_rudder"] / order),
    )
