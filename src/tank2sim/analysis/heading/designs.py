"""Heading controllers for a ship by four design methods, each a model for simulation, coupling and FMU export."""

from __future__ import annotations

import importlib.util
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import control
import numpy as np

from tank2sim.analysis.linearisation import state_space, straight_course
from tank2sim.analysis.stability.straight_line import Nomoto, Stability, stability
from tank2sim.arrays import Array
from tank2sim.dynamics.autopilot import HeadingGains, LinearLaw, autopilot_model, linear_autopilot_model
from tank2sim.dynamics.effects import acting_variable
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError, InputError

DAMPING = 0.9
"""Relative damping of the heading, between the 0.8 and 1 that Fossen (2011), 12.2, recommends for ships."""

SLOWNESS = 0.1
"""The pole of the integral over the natural frequency, so that it does not disturb a course change (Fossen, 12.2)."""

INTEGRAL_BAND_RAD = math.radians(2.0)
"""Heading error that counts as a change of course, not a disturbance: project choice, twice a helmsman's."""

LARGEST_RUDDER_RAD = math.radians(35.0)
"""Limit without one on the card: the rudder angle that SOLAS II-1, regulation 29 requires of a gear."""

NOTCH_DAMPING = 0.1
"""Share of waves at the frequency of a wave filter that passes: project choice, as narrow as the band of the waves."""

DESIGNS = ("pd", "pid", "lqr", "robust")
"""Design methods, by the names of ``--design``."""

# All in w = sqrt(K/T) of the ship: project choices, tested on stable and unstable ships (Ms 1.4 to 1.7).
POLE_SHIFT = 0.2
"""Every mode of the loop decays faster."""

INTEGRAL = 0.3
"""Zero b of the integral; above the shift, so that it can be moved."""

_BANDWIDTH = 0.8
"""Frequency below which W1 requires a sensitivity below 1."""

PEAK = 1.5
"""Largest peak of the sensitivity that W1 allows."""

RUDDER_FREQUENCY = 20.0
"""Frequency above which W2 allows less rudder than heading error; far below it 5 times as much."""

LEAST_ERROR = 0.01
"""Share of BANDWIDTH at which W1 becomes flat, because its pole must be stable."""


@dataclass(frozen=True, kw_only=True)
class LqrWeights:
    """Weights of the LQR (Bryson & Ho, 1975): errors of equal cost, rad.

    Equal weights give a heading error the same cost as the same rudder, as in pole placement (project choice).
    """

    heading_rad: float = math.radians(5.0)
    rudder_rad: float = math.radians(5.0)


@dataclass(frozen=True, kw_only=True)
class HeadingDesign:
    """A controller of heading.

    Parameters
    ----------
    kind : str
        One of :data:`DESIGNS`.
    found : Stability
        The ship at the speed of the design.
    gains : mapping
        Figures of the controller by name with their unit; of the robust one, of its synthesis.
    source : str
        Origin of the controller, in a sentence.
    autopilot : Model
        Inputs ``motion.psi``, ``motion.r``, ``heading.command``; outputs ``rudder.command``, ``heading.error``.
    """

    kind: str
    found: Stability
    gains: Mapping[str, float]
    source: str
    autopilot: Model


@dataclass(frozen=True, eq=False)
class SteeringPlant:
    """Plant of the design: the ship at the design speed with its gear, and the limit of its rudder.

    Parameters
    ----------
    frequency_radps : float
        w = sqrt(K/T), the frequency of the design by pole placement, which scales the other designs.
    A, B : arrays (4, 4), (4, 1)
        Rates of sway velocity (m/s), yaw rate (rad/s), heading (rad) and rudder (rad), by these and by the order (rad).
    """

    found: Stability
    frequency_radps: float
    A: Array
    B: Array
    largest_rudder_rad: float
    step_s: float


def design_heading(
    ship: Model,
    kind: str = "pid",
    *,
    speed_mps: float | None = None,
    weights: LqrWeights | None = None,
    wave_filter_radps: float | None = None,
) -> HeadingDesign:
    """Design a heading controller.

    Parameters
    ----------
    kind : str
        ``pd`` and ``pid``: poles placed on Nomoto's model; ``lqr``: the linear quadratic regulator of sway, yaw,
        heading, rudder and integral, with an observer of sway and rudder; ``robust``: mixed sensitivity.
    speed_mps : float, optional
        Speed of the design; by default the expansion speed.
    weights : LqrWeights, optional
        Weights of the LQR.
    wave_filter_radps : float, optional
        Frequency of encounter of waves to which the rudder of the PID does not respond (:func:`_filtered`).

    Raises
    ------
    InputError
        The model is not a ship or has no straight course, the speed is outside the card's range, the rudder turns the
        ship the wrong way or not at all, or the robust design lacks its library.
    """
    plant = steering_plant(ship, speed_mps)
    name = f"Autopilot of {ship.name}"
    if wave_filter_radps is not None:
        if kind != "pid":
            raise ArgumentError(
                "wave_filter_radps", "", f"is not part of the design {kind!r}", "leave it out, or choose pid"
            )
        return _filtered(plant, name, wave_filter_radps)
    match kind:
        case "pd" | "pid":
            return _placed(plant, name, integral=kind == "pid")
        case "lqr":
            return _quadratic(plant, name, weights or LqrWeights())
        case "robust":
            return robust_design(plant, name, ship.origin)
        case _:
            raise ArgumentError("design", "", f"{kind!r} is not a design", f"choose one of {', '.join(DESIGNS)}")


def steering_plant(ship: Model, speed_mps: float | None = None) -> SteeringPlant:
    """The ship with its gear at a speed, for design. Raises as :func:`design_heading`."""
    if "rudder.angle" not in ship:
        raise ship.fault("", "has no rudder", "an autopilot needs the card of a ship (linear, abkowitz or mmg)")
    values = ship.defaults
    slowest, fastest = values["ship.slowest"], values["ship.fastest"]
    if speed_mps is not None and not slowest <= speed_mps <= fastest:
        remedy = f"the card holds from {slowest:g} to {fastest:g} m/s"
        raise ArgumentError("speed_mps", "", f"{speed_mps:g} m/s is outside the range of {ship.origin}", remedy)
    point = straight_course(ship, speed_mps)
    hull = state_space(ship, point, states=["motion.v", "motion.r"], inputs=["rudder.angle"], outputs=["motion.r"])
    remedy = "check Yd and Nd of the card, and its rudder_sign"
    if not abs(hull.B[1, 0]) > 0:
        raise ship.fault("", "its rudder has no effect on yaw", remedy)
    found = stability(ship, speed_mps)
    K, T = found.nomoto.dimensional.K_per_s, found.nomoto.dimensional.T_s
    if not K / T > 0:
        raise ship.fault("", "the rudder turns the ship the wrong way", remedy)
    lag = values[acting_variable(ship, "steering.time_constant")]
    A = np.zeros((4, 4))
    A[:2, :2], A[:2, 3:], A[2, 1], A[3, 3] = hull.A, hull.B, 1.0, -1 / lag
    B = np.array([[0.0], [0.0], [0.0], [1 / lag]])
    largest = min(values.get("steering.max_angle", LARGEST_RUDDER_RAD), LARGEST_RUDDER_RAD)
    return SteeringPlant(found, math.sqrt(K / T), A, B, largest, ship.step_s)


def heading_gains(nomoto: Nomoto, largest_rudder_rad: float = LARGEST_RUDDER_RAD) -> HeadingGains:
    """Gains that put the poles of heading, yaw rate and integral where (s^2 + 2 z w s + w^2)(s + a) = 0.

    With T dr/dt + r = K delta the loop is T s^3 + (1 + K Kd) s^2 + K Kp s + K Ki; w = sqrt(K/T), which makes the rudder
    that a heading error orders about as large as the error (project choice, amid the 0.5 to 2 of practice), z is
    :data:`DAMPING` and a is :data:`SLOWNESS` w. It also holds for a ship that is unstable (K and T negative). K/T is
    positive.
    """
    K, T = nomoto.K_per_s, nomoto.T_s
    w = math.sqrt(K / T)
    a = SLOWNESS * w
    proportional = T / K * (w**2 + 2 * DAMPING * w * a)
    integral = T / K * w**2 * a
    return HeadingGains(
        proportional=proportional,
        derivative=(T * (2 * DAMPING * w + a) - 1) / K,
        integral=integral,
        integral_band_rad=INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / w,  # as fast as the heading
        largest_rudder_rad=largest_rudder_rad,
    )


def _placed(plant: SteeringPlant, name: str, *, integral: bool) -> HeadingDesign:
    gains = heading_gains(plant.found.nomoto.dimensional, plant.largest_rudder_rad)
    note = f"integral {SLOWNESS:g} of the natural frequency"
    if not integral:
        gains, note = _without_integral(plant, gains), "no integral"
    source = (
        f"Pole placement (relative damping {DAMPING:g}, {note}) on Nomoto's model of {plant.found.ship} at "
        f"{plant.found.operating_point.speed_mps:.4g} m/s"
    )
    return HeadingDesign(
        kind="pid" if integral else "pd",
        found=plant.found,
        gains={"Kp": gains.proportional, "Kd_s": gains.derivative, "Ki_per_s": gains.integral},
        source=source,
        autopilot=autopilot_model(name, gains, plant.step_s),
    )


def _filtered(plant: SteeringPlant, name: str, frequency: float) -> HeadingDesign:
    """The PID with a notch (s^2 + 2 z w s + w^2)/(s + w)^2 on its proportional and derivative parts, w of the waves.

    Fossen (2011), 11.1.2; z is :data:`NOTCH_DAMPING`. With p = Kp e - Kd r the notch is p + 2 w (z - 1) x2,
    dx1/dt = x2, dx2/dt = -w^2 x1 - 2 w x2 + p.
    """
    plain = _placed(plant, name, integral=True)
    Kp, Kd, Ki = plain.gains.values()
    law = LinearLaw(
        rates=np.array([[0.0, 1.0, 0.0, 0.0, 0.0], [-(frequency**2), -2 * frequency, Kp, -Kd, 0.0]]),
        demand=np.array([0.0, 2 * frequency * (NOTCH_DAMPING - 1), Kp, -Kd]),
        growth=np.array([0.0, 0.0, Ki, 0.0]),
        growth_limit_radps=Ki * INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / plant.frequency_radps,
        largest_rudder_rad=plant.largest_rudder_rad,
    )
    description = "Heading autopilot: PID with wave filter, limits and anti-windup"
    return replace(
        plain,
        gains={**plain.gains, "wave_filter_radps": frequency},
        source=f"{plain.source}; waves filtered at {frequency:.3g} rad/s",
        autopilot=linear_autopilot_model(name, description, law, plant.step_s),
    )


def _without_integral(plant: SteeringPlant, gains: HeadingGains) -> HeadingGains:
    """PD gains for T s^2 + (1 + K Kd) s + K Kp = T (s^2 + 2 z w s + w^2), on the states heading and yaw rate."""
    K, T, w = plant.found.nomoto.dimensional.K_per_s, plant.found.nomoto.dimensional.T_s, plant.frequency_radps
    poles = np.roots([1, 2 * DAMPING * w, w**2])
    Kp, Kd = np.asarray(control.place([[0, 1], [0, -1 / T]], [[0], [K / T]], poles)).ravel()
    return replace(gains, proportional=float(Kp), derivative=float(Kd), integral=0.0)


def _quadratic(plant: SteeringPlant, name: str, weights: LqrWeights) -> HeadingDesign:
    """LQR of [sway, yaw rate, heading, rudder, integral of heading]; sway and rudder by an observer.

    Least integral of (psi/psi0)^2 + (r/(w psi0))^2 + (z/(psi0/(a w)))^2 + (order/delta0)^2, psi0 and delta0 the
    weights, z the integral of psi, a the :data:`SLOWNESS` of the integral. The observer is the ship's own sway equation
    with the measured yaw rate, and the gear's lag: both are stable without correction.
    """
    w, bad = plant.frequency_radps, weights.heading_rad
    A = np.zeros((5, 5))
    A[:4, :4], A[4, 2] = plant.A, 1.0
    B = np.vstack([plant.B, [[0.0]]])
    Q = np.diag([0.0, 1 / (w * bad) ** 2, 1 / bad**2, 0.0, (SLOWNESS * w / bad) ** 2])
    gain, _, _ = control.lqr(A, B, Q, [[1 / weights.rudder_rad**2]])
    Kv, Kd, Kp, Kdelta, Ki = (float(value) for value in np.asarray(gain).ravel())
    rates = np.array(
        [
            [plant.A[0, 0], plant.A[0, 3], 0.0, plant.A[0, 1], 0.0],
            [0.0, plant.A[3, 3], 0.0, 0.0, plant.B[3, 0]],
        ]
    )
    law = LinearLaw(
        rates=rates,
        demand=np.array([-Kv, -Kdelta, Kp, -Kd]),
        growth=np.array([0.0, 0.0, Ki, 0.0]),
        growth_limit_radps=Ki * INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / w,
        largest_rudder_rad=plant.largest_rudder_rad,
    )
    source = (
        f"LQR on {plant.found.ship} with its steering gear at {plant.found.operating_point.speed_mps:.4g} m/s, "
        f"{math.degrees(bad):g} deg of heading as bad as {math.degrees(weights.rudder_rad):g} deg of rudder"
    )
    gains = {"Kp": Kp, "Kd_s": Kd, "Ki_per_s": Ki, "Kv_radpmps": Kv, "Kdelta": Kdelta}
    description = "Heading autopilot: LQR with observed sway and rudder, limits and anti-windup"
    model = linear_autopilot_model(name, description, law, plant.step_s)
    return HeadingDesign(kind="lqr", found=plant.found, gains=gains, source=source, autopilot=model)


def robust_design(plant: SteeringPlant, name: str, origin: str) -> HeadingDesign:
    """The mixed-sensitivity controller (H-infinity; extra ``robust``: slycot).

    Least largest gain of [W1 S; W2 K S], S = 1/(1 + G K): W1 requires a fast loop with a low peak of S, W2 little
    rudder at high frequency (waves, gear): Skogestad & Postlethwaite (2005), Multivariable Feedback Control, 9.3.

    The design uses a frequency axis shifted by a: the controller of G(s - a) is shifted back. Then every mode of the
    loop decays faster than a, and the controller cannot cancel the slow mode of the hull, which would make the ship
    slow to recover from a gust: Chiang & Safonov (1992), J. Guidance, Control, and Dynamics 15. The integral precedes
    the ship as (s + b)/s in the design and is part of the controller afterwards.

    Parameters
    ----------
    name : str
        Name of the controller.
    origin : str
        :attr:`Model.origin` of the ship, for messages.

    Raises
    ------
    InputError
        slycot is not installed, or the controller does not exist.
    """
    if importlib.util.find_spec("slycot") is None:
        raise ArgumentError("design", "robust", "needs slycot", "pip install 'tank2sim[robust]'")
    w = plant.frequency_radps
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # of a name inside python-control
        core, gamma = _synthesis(plant, origin)
    core = _without_fast_modes(core, 1 / plant.step_s / w)
    A, B, C, D = core.A * w, core.B * w, core.C, core.D  # time back from 1/w to s
    n = len(A)
    rates = np.hstack([A, B, np.zeros((n, 2))])
    demand = np.concatenate([C.ravel(), D.ravel(), [0.0]])
    steady = float(np.real(core.dcgain()).item())
    law = LinearLaw(
        rates=rates,
        demand=demand,
        growth=INTEGRAL * w * demand,
        growth_limit_radps=INTEGRAL * w * abs(steady) * INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / w,
        largest_rudder_rad=plant.largest_rudder_rad,
    )
    source = (
        f"Mixed sensitivity on {plant.found.ship} with its steering gear "
        f"at {plant.found.operating_point.speed_mps:.4g} m/s: gamma {gamma:.3g}, order {n + 1}"
    )
    gains = {"gamma": gamma, "order": float(n + 1), "steady_gain": steady, "integral_radps": INTEGRAL * w}
    description = "Heading autopilot: mixed sensitivity (H-infinity) on the heading error, limits and anti-windup"
    model = linear_autopilot_model(name, description, law, plant.step_s)
    return HeadingDesign(kind="robust", found=plant.found, gains=gains, source=source, autopilot=model)


def _synthesis(plant: SteeringPlant, origin: str) -> tuple[control.StateSpace, float]:
    """Controller without its integral (time in 1/w), and the gain reached."""
    w = plant.frequency_radps
    if not (np.isfinite(plant.A).all() and np.isfinite(plant.B).all()):  # LAPACK may search for ever
        raise InputError(origin, "", "no robust controller was found (the linear ship is not finite)", "check the card")
    ship = control.ss(plant.A / w, plant.B / w, [[0, 0, 1, 0]], [[0]])
    integral = control.ss([[0]], [[1]], [[INTEGRAL]], [[1]])
    together = control.series(integral, ship)
    shifted = control.ss(together.A + POLE_SHIFT * np.eye(together.nstates), together.B, together.C, together.D)
    W1 = control.tf([1 / PEAK, _BANDWIDTH], [1, LEAST_ERROR * _BANDWIDTH])
    W2 = control.tf([1, 0.2 * RUDDER_FREQUENCY], [0.01, RUDDER_FREQUENCY])
    try:
        found, _, reached = control.mixsyn(shifted, control.ss(W1), control.ss(W2), None)
    except (control.ControlArgument, ArithmeticError, ValueError) as error:
        remedy = "choose another design"
        raise InputError(origin, "", f"no robust controller was found ({error})", remedy) from None
    back = control.ss(found.A - POLE_SHIFT * np.eye(found.nstates), found.B, found.C, found.D)
    return back, float(reached[0])


def _without_fast_modes(system: control.StateSpace, fastest: float) -> control.StateSpace:
    """Modes that decay faster than the integration resolves, replaced by their steady values."""
    modal, _ = control.modal_form(system)
    fast = [place for place in range(modal.nstates) if -modal.A[place, place] > fastest]
    return control.model_reduction(modal, elim_states=fast, method="matchdc") if fast else modal
