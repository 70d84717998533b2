"""The autopilot of a craft with fixed thrusters: gains by pole placement, its closed loop, and what it does."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from tank2sim.analysis.heading.designs import DAMPING, INTEGRAL_BAND_RAD, SLOWNESS
from tank2sim.analysis.heading.piloted import Piloted, PilotStudy
from tank2sim.analysis.heading.runs import CraftKeeping, HeadingLoop, StepFigures, craft_keeping, step_figures
from tank2sim.analysis.heading.study import StudySettings, WeatherRuns, not_held
from tank2sim.analysis.linearisation import OperatingPoint, jacobians
from tank2sim.analysis.stability.straight_line import sorted_modes
from tank2sim.arrays import Array, ComplexNumber
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_ADDED_MASSES
from tank2sim.dynamics.craft_autopilot import CraftGains, craft_autopilot_model, thrust_limits
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import inertia
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.simulation.trial_file import histories

HALF_MOMENT_AT_RAD = math.radians(30.0)
"""Heading error for which half of the largest yaw moment is ordered (project choice: a usual change of course does not
saturate the thrusters)."""

LAG_SHARE = 0.25
"""Largest frequency of the loops times the longest lag of a thruster: the lag then takes 14 deg of their phase (project
choice)."""

SLOWER_SHARE = 0.5
"""Share of the ordered speed from which a change of speed begins (project choice)."""

FASTER = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0)
LEAST_DAMPING = 0.5
"""Frequencies of heading that are tried, over that of :data:`HALF_MOMENT_AT_RAD`, until every pole of the whole closed
loop has at least this relative damping (project choices): sway, which the gains leave out, turns a fast craft by the
moment of Munk."""

KEEPING_LENGTHS = 60.0
"""Length of course keeping in L/u0, twice the others: figures are taken of its later half (project choice)."""

RUN_LENGTHS = 30.0
"""Length of a run in L/u0 (project choice): several times what heading and speed need to settle."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CraftAutopilotStudy(PilotStudy):
    """The autopilot of a craft, and its runs ``course``, ``speed`` and ``keeping``.

    Gains are the yaw moment (N m) by heading error and yaw rate, the surge force (N) by speed error, with their
    integrals.

    Parameters
    ----------
    speed_mps : float
        Speed of the design.
    largest_moment_Nm : tuple of two floats
        Largest yaw moment to port (negative) and to starboard.
    poles : tuple of complex
        Poles of the whole closed loop at that speed, 1/s, the slowest first.
    course_change, speed_change : StepFigures
        A change of course (deg) and of speed (m/s).
    course_keeping : CraftKeeping
        In current, wind and waves.
    at_limit_percent : dict
        Share of the time of each run in which an order is at a limit of a thruster.
    """

    speed_mps: float
    largest_moment_Nm: tuple[float, float]
    poles: tuple[ComplexNumber, ...]
    course_change: StepFigures
    speed_change: StepFigures
    course_keeping: CraftKeeping
    at_limit_percent: dict[str, float]


def study_craft_autopilot(
    card: SteeredCard, model: Model, settings: StudySettings
) -> tuple[CraftAutopilotStudy, Piloted]:
    """Design the autopilot of a craft, and try changes of course and speed, weather and a track.

    Parameters
    ----------
    settings : StudySettings
        Way of design, weights and wave filter belong to a rudder, and are not used.

    Raises
    ------
    InputError
        The thrusters turn, or give no yaw moment without a surge force; the speed is beyond them; the loop is unstable;
        or a leg of the track is too short.
    """
    speed = card.model.speed_mps if settings.speed_mps is None else settings.speed_mps
    change = settings.course_change_rad
    duration = RUN_LENGTHS * card.ship.length_m / speed
    gains, autopilot, poles = _damped(card, model, speed, duration)
    loop = HeadingLoop(model, autopilot)
    steady, slower = (_settled(loop, wanted, duration) for wanted in (speed, SLOWER_SHARE * speed))
    runs = {
        "course": loop.run({"speed.command": speed, "heading.command": change}, duration, begin=steady),
        "speed": loop.run({"speed.command": speed, "heading.command": 0.0}, duration, begin=slower),
    }
    course = step_figures(runs["course"].t, runs["course"]["motion.psi"], change)
    at_speed = replace(settings, speed_mps=speed)
    outside = WeatherRuns.of(model, card, autopilot, at_speed, KEEPING_LENGTHS / RUN_LENGTHS * duration)
    runs["keeping"] = outside.run
    keeping = craft_keeping(outside.run, speed)
    in_degrees = {name: math.degrees(getattr(course, name)) for name in ("ordered", "overshoot")}
    reached = speed - float(runs["speed"]["motion.u"][0])
    study = CraftAutopilotStudy(
        ship=card.ship.name,
        source=(
            f"Poles placed on the yaw (relative damping {DAMPING:g}) and the surge (two equal poles) of "
            f"{card.ship.name} at {speed:.4g} m/s"
        ),
        speed_mps=speed,
        gains={
            "Kp_Nm": gains.heading,
            "Kd_Nms": gains.yaw_rate,
            "Ki_Nmps": gains.heading_integral,
            "Ku_kgps": gains.speed,
            "Ki_u_Npm": gains.speed_integral,
        },
        largest_moment_Nm=gains.largest_moment_Nm,
        poles=poles,
        course_change=replace(course, **in_degrees),
        speed_change=step_figures(runs["speed"].t, runs["speed"]["motion.u"], reached),
        course_keeping=keeping,
        at_limit_percent={name: 100 * _at_limit(card, run) for name, run in runs.items()},
        histories={name: histories(run) for name, run in runs.items()},
        notices=(*outside.notices, *not_held(keeping, outside.weather, speed), *outside.unfinished),
        **outside.reported,
    )
    return study, Piloted(model, autopilot, runs)


def _damped(
    card: SteeredCard, model: Model, speed: float, duration: float
) -> tuple[CraftGains, Model, tuple[complex, ...]]:
    """The slowest of the autopilots that are tried whose closed loop is damped, with its gains and poles."""
    for faster in FASTER:
        gains = craft_gains(card, speed, faster)
        autopilot = craft_autopilot_model(card, gains, model.step_s)
        loop = HeadingLoop(model, autopilot)
        poles = _poles(loop, _settled(loop, speed, duration), speed)
        if min(-pole.real / abs(pole) for pole in poles) >= LEAST_DAMPING:
            return gains, autopilot, poles
    problem = f"leaves a pole of the closed loop at {poles[0]:.3g} 1/s however fast the autopilot"
    raise card.fault("derivatives", problem, "check the damping of the card, or give another speed")


def craft_gains(card: SteeredCard, speed_mps: float, faster: float = 1.0) -> CraftGains:
    """Gains for a craft at a speed, with `faster` times the frequency of heading.

    Yaw, I r' = d r + N with the added inertia in I and d = Nr + Nrabsu u: poles where (s^2 + 2 z w s + w^2)(s + a) = 0,
    z :data:`.DAMPING`, a :data:`.SLOWNESS` w; w^2 I is half of the largest moment over :data:`HALF_MOMENT_AT_RAD`.
    Surge, m u' = d u + X, d the slope of the resistance: two equal poles, Ku all of the surge force for an error of the
    speed. Both frequencies are at most :data:`LAG_SHARE` over the longest lag of the thrusters.

    Raises
    ------
    InputError
        As of :func:`study_craft_autopilot`.
    """
    known, lags = card.derivatives, [thruster.time_constant_s or 0.0 for thruster in card.thrusters]
    fastest = LAG_SHARE / max(lags) if any(lags) else math.inf
    gives = _effectiveness(card)
    low, high = _largest_moments(card, gives, speed_mps)
    added = {name: known.get(name, 0.0) for name in CRAFT_ADDED_MASSES}
    masses = inertia(card.rigid_body.mass, card.rigid_body.x_G, card.rigid_body.yaw_inertia, added)
    yaw, surge = float(masses.yaw), float(masses.surge)
    w = min(faster * math.sqrt(min(-low, high) / 2 / HALF_MOMENT_AT_RAD / yaw), fastest)
    a = SLOWNESS * w
    damping = -known.get("Nr", 0.0) - known.get("Nrabsu", 0.0) * speed_mps
    drag = -known.get("Xu", 0.0) - 2 * known.get("Xuabsu", 0.0) * speed_mps
    most = float(gives[0] @ [float(thrust_limits(thruster, speed_mps)[1]) for thruster in card.thrusters])
    Ku = max(0.0, min(most / speed_mps, 2 * surge * fastest - drag))
    return CraftGains(
        heading=yaw * (w**2 + 2 * DAMPING * w * a),
        yaw_rate=max(0.0, yaw * (2 * DAMPING * w + a) - damping),
        heading_integral=yaw * w**2 * a,
        integral_band_rad=INTEGRAL_BAND_RAD,
        speed=Ku,
        speed_integral=(drag + Ku) ** 2 / (4 * surge),
        anti_windup_time_s=1 / w,
        largest_moment_Nm=(low, high),
        allocation=np.asarray(np.linalg.pinv(gives), dtype=float),
    )


def _effectiveness(card: SteeredCard) -> Array:
    """Surge force and yaw moment by the thrust of each thruster (2, m): 1, and m."""
    for place, thruster in enumerate(card.thrusters):
        if thruster.max_azimuth_rad is not None:
            remedy = "the autopilot needs thrusters that do not turn"
            raise card.fault(f"thrusters.{place}.max_azimuth_rad", "lets it turn", remedy)
    angles = np.array([thruster.azimuth_rad for thruster in card.thrusters])
    x, y = (np.array([getattr(thruster, key) for thruster in card.thrusters]) for key in ("x_m", "y_m"))
    gives = np.stack([np.cos(angles), x * np.sin(angles) - y * np.cos(angles)])
    if np.linalg.matrix_rank(gives) < 2:
        problem = "give no yaw moment that is free of their surge force"
        raise card.fault("thrusters", problem, "the autopilot needs one at port and one at starboard")
    return gives


def _largest_moments(card: SteeredCard, gives: Array, speed_mps: float) -> tuple[float, float]:
    """Largest yaw moments to port (negative) and to starboard, N m, with the surge share of the least squares."""
    bounds = [tuple(map(float, thrust_limits(thruster, speed_mps))) for thruster in card.thrusters]
    if any(high <= 0 for _, high in bounds):
        problem = f"give no thrust ahead at {speed_mps:.4g} m/s"
        raise card.fault("thrusters", problem, "give a lower speed")
    least, most = (np.array(column, dtype=float) for column in zip(*bounds, strict=True))
    by = np.linalg.pinv(gives)
    within = {"A_ub": np.vstack([by, -by]), "b_ub": np.concatenate([most, -least]), "bounds": [(None, None)] * 2}
    port, starboard = (linprog([0.0, side], **within).x[1] for side in (1.0, -1.0))
    return float(port), float(starboard)


def _settled(loop: HeadingLoop, speed_mps: float, duration_s: float) -> Array:
    """State (nx,) on course 0 after a time at an ordered speed, at the origin."""
    order = {"speed.command": speed_mps, "heading.command": 0.0}
    states, _ = loop.advance(loop.start(), order, round(duration_s / loop.model.step_s), None)
    names = loop.model.state_names
    state: Array = states[-1].copy()
    if not np.isfinite(state).all() or abs(state[names.index("motion.u")] - speed_mps) > 0.1 * speed_mps:
        problem = f"does not come to {speed_mps:.4g} m/s under the autopilot: {state[names.index('motion.u')]:.4g} m/s"
        raise loop.model.fault("", problem, "give a speed that its thrusters hold")
    state[[names.index("motion.x"), names.index("motion.y")]] = 0.0
    return state


def _poles(loop: HeadingLoop, state: Array, speed_mps: float) -> tuple[complex, ...]:
    """Poles of the closed loop at a steady state, 1/s, the slowest first; without the position."""
    model = loop.model
    inputs = model.input_values()
    inputs[model.input_names.index("speed.command")] = speed_mps
    names = [name for name in model.state_names if name not in ("motion.x", "motion.y")]
    point = OperatingPoint(state, inputs, model.parameter_values())
    return sorted_modes(jacobians(model, point, model.derivatives_of(names), names, [])[0])


def _at_limit(card: SteeredCard, run: Trajectory) -> float:
    """Share of the time in which the order of a thruster is at one of its limits."""
    at = np.zeros(len(run.t), dtype=bool)
    for thruster in card.thrusters:
        order = run[f"thrusters.{thruster.name}.command"]
        at |= (order >= 0.999 * thruster.max_radps) | (order <= 0.999 * thruster.lowest_radps)
    return float(at.mean())
