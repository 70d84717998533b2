"""Manoeuvring figures of a trajectory, as in ITTC 7.5-04-02-01 and IMO MSC.137(76).

Distances are in axes fixed at the execute: advance along the initial heading, transfer at right angles to it, positive
to the side of the turn. Between samples signals are interpolated, so that figures do not depend on the sampling.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.simulation.manoeuvres import PullOut, SpiralManoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun
from tank2sim.simulation.trajectory import Trajectory

Figures = dict[str, float | list[float] | None]
"""Manoeuvring figures by name with unit: a number, several in their order, or None where the run does not show it."""

LOOP_HEIGHT = 0.05
"""Difference of two yaw rates at a rudder angle of a spiral, as a share of the largest rate, from which they are two
steady turns; smaller ones are residuals of the waiting time."""

STEADY_SHARE = 0.01
"""Change of yaw rate and speed over two ship lengths, relative to themselves, below which a turn is steady. Project
choice."""

REACHED_SPEED = 0.9
"""Share of the last speed of a straight run at which it counts as reached. Project choice: the last tenth takes for
ever."""

REST_SPEED = 1e-6
"""Share of the run's largest speed below which a speed counts as zero: project choice, above rounding."""


def figures_of(manoeuvre: object, trajectory: Trajectory, length: float) -> Figures:
    """Figures of a manoeuvre; None for figures that the run was too short to show.

    Parameters
    ----------
    manoeuvre
        One of :mod:`tank2sim.simulation.manoeuvres`.
    trajectory : Trajectory
        Trajectory of a ship.
    length : float
        Length between perpendiculars, m.
    """
    match manoeuvre:
        case Turn(rudder=rudder):
            return _turn(trajectory, math.copysign(1.0, rudder), length)
        case DifferenceTurn(difference):
            return _turn(trajectory, math.copysign(1.0, difference), length)
        case Spin(revolutions):
            return _spin(trajectory, math.copysign(1.0, revolutions), length)
        case StraightRun():
            return _straight(trajectory, length)
        case Zigzag():
            return _zigzag(trajectory, manoeuvre, length)
        case PullOut(rudder):
            return _pull_out(trajectory, rudder)
        case SpiralManoeuvre(rudders):
            return _spiral(trajectory, rudders)
        case Stop():
            return _stop(trajectory, manoeuvre, length)
        case _:
            return _ending(trajectory)


def _ending(run: Trajectory) -> Figures:
    return {
        "duration_s": float(run.t[-1]),
        "final_speed_mps": float(run["motion.speed"][-1]),
        "final_heading_deg": math.degrees(run["motion.psi"][-1]),
        "speed_loss_percent": _speed_loss(run, float(run["motion.speed"][-1])),
    }


def _first(times: Array) -> float | None:
    return float(times[0]) if len(times) else None


@dataclass(frozen=True)
class _Execute:
    """Axes at the execute of a run, mirrored so that the turn goes to starboard."""

    run: Trajectory
    side: float

    @property
    def heading(self) -> float:
        return float(self.run["motion.psi"][0])

    def time_of(self, change: float) -> float | None:
        """Time of the first crossing of a heading change (rad, to the side of the turn)."""
        return _first(self.run.crossings("motion.psi", "motion.r", self.heading + self.side * change))

    def place(self, time: float) -> tuple[float, float]:
        """Distance ahead and to the side of the turn at a time, m."""
        north = self.run.at("motion.x", time) - float(self.run["motion.x"][0])
        east = self.run.at("motion.y", time) - float(self.run["motion.y"][0])
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return north * cos + east * sin, self.side * (east * cos - north * sin)


def _turn(run: Trajectory, side: float, length: float) -> Figures:
    execute = _Execute(run, side)
    quarter, half = execute.time_of(math.pi / 2), execute.time_of(math.pi)
    advance, transfer = execute.place(quarter) if quarter else (None, None)
    tactical = execute.place(half)[1] if half else None
    figures: Figures = {
        "advance_m": advance,
        "transfer_m": transfer,
        "tactical_diameter_m": tactical,
        "advance_lengths": advance and advance / length,
        "tactical_diameter_lengths": tactical and tactical / length,
        "time_90_s": quarter,
        "time_180_s": half,
    }
    steady = half is not None and _is_steady(run, length)
    rate, speed = float(run["motion.r"][-1]), float(run["motion.speed"][-1])
    return figures | {
        "steady_diameter_m": 2 * speed / abs(rate) if steady else None,
        "steady_drift_deg": math.degrees(run["motion.beta"][-1]) if steady else None,
        "steady_rate_degps": math.degrees(rate) if steady else None,
        "steady_speed_mps": speed if steady else None,
        "speed_loss_percent": _speed_loss(run, speed) if steady else None,
        **_largest_heel(run),
    }


def _spin(run: Trajectory, side: float, length: float) -> Figures:
    """Times to a half and to a whole turn, the rate at the end, and how far the origin went from its place."""
    execute = _Execute(run, side)
    away = np.hypot(run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0])
    whole = execute.time_of(2 * math.pi)
    return {
        "time_180_s": execute.time_of(math.pi),
        "time_360_s": whole,
        "final_rate_degps": math.degrees(run["motion.r"][-1]),
        "largest_distance_m": float(away.max()),
        "largest_distance_lengths": float(away.max()) / length,
    }


def _straight(run: Trajectory, length: float) -> Figures:
    """The speed at the end of a run from rest, and the time and distance to nine tenths of it."""
    final = float(run["motion.u"][-1])
    time = _first(run.crossings("motion.u", "motion.udot", REACHED_SPEED * final))
    distance = math.hypot(*_Execute(run, 1.0).place(time)) if time else None
    return {
        "final_speed_mps": final,
        "time_to_90_percent_s": time,
        "distance_to_90_percent_m": distance,
        "distance_to_90_percent_lengths": distance and distance / length,
    }


def _largest_heel(run: Trajectory) -> Figures:
    """The largest heel (deg, positive to starboard) of a ship that rolls; no figure of one that does not."""
    if "motion.phi" not in run.model:
        return {}
    heel = run["motion.phi"]
    return {"largest_heel_deg": math.degrees(heel[np.argmax(np.abs(heel))])}


def _is_steady(run: Trajectory, length: float) -> bool:
    """Yaw rate and speed have not changed by more than 1 % over the last two ship lengths."""
    before = run.t[-1] - 2 * length / max(float(run["motion.speed"][-1]), 1e-9)
    if before < run.t[0]:
        return False
    then = int(np.searchsorted(run.t, before))
    same = [
        abs(run[name][-1] - run[name][then]) < STEADY_SHARE * abs(run[name][-1])
        for name in ("motion.r", "motion.speed")
    ]
    return all(same)


def _zigzag(run: Trajectory, zigzag: Zigzag, length: float) -> Figures:
    side = math.copysign(1.0, zigzag.rudder)
    execute = _Execute(run, side)
    course = execute.heading if zigzag.course is None else zigzag.course
    command = run["rudder.command"]
    executes = run.t[1:][command[:-1] * command[1:] < 0] - zigzag.wait_s
    turns = run.crossings("motion.r", "motion.rdot", 0.0)
    peaks = [later[0] for time in executes if len(later := turns[turns > time])]
    overshoots = [
        math.degrees(side * (-1) ** number * (run.at("motion.psi", time) - course) - zigzag.headings[number % 2])
        for number, time in enumerate(peaks)
    ]
    returns = run.crossings("motion.psi", "motion.r", course)
    returns = returns[returns > executes[0]] if len(executes) else returns[:0]
    arrival = _first_heading(run, zigzag, executes, course) if len(executes) else None
    distance = None if arrival is None else math.hypot(*execute.place(arrival))
    return {
        "overshoots_deg": overshoots,
        "overshoot_times_s": [float(peak - time) for peak, time in zip(peaks, executes, strict=False)],
        "execute_times_s": [float(time) for time in executes],
        "initial_turning_time_s": arrival,
        "initial_turning_distance_m": distance,
        "initial_turning_lengths": distance and distance / length,
        "reach_s": _first(returns),
        "period_s": float(returns[2] - returns[0]) if len(returns) > 2 else None,
        "speed_loss_percent": _speed_loss(run, float(run["motion.speed"].min())),
        **_largest_heel(run),
    }


def _first_heading(run: Trajectory, zigzag: Zigzag, executes: Array, course: float) -> float:
    """Time at which a zigzag's first heading is reached, s: its first reversal, unless that came early or late."""
    if zigzag.lag_s or zigzag.course is not None:
        heading = course + math.copysign(zigzag.heading, zigzag.rudder)
        reached = run.crossings("motion.psi", "motion.r", heading)
        if len(reached):
            return float(reached[0])
    return float(executes[0])


def _pull_out(run: Trajectory, rudder: float) -> Figures:
    midships = int(np.flatnonzero(np.diff(run["rudder.command"]) != 0)[-1]) + 1
    rates = np.degrees(run["motion.r"])
    side = math.copysign(1.0, rudder)
    halved = run.t[midships:][side * rates[midships:] < side * rates[midships] / 2]
    return {
        "steady_rate_degps": float(rates[midships]),
        "neutral_rudder_deg": math.degrees(run["rudder.command"][midships]),
        # With the neutral rudder: zero on a ship that is stable on a straight course, symmetric or not.
        "residual_rate_degps": float(rates[-1]),
        "time_to_half_rate_s": float(halved[0] - run.t[midships]) if len(halved) else None,
    }


def zero_rate_rudders(rudders: Array, rates: Array) -> tuple[float, float]:
    """Return the rudder at which the yaw rate of a spiral is zero, on its way out and on its way back.

    Parameters
    ----------
    rudders, rates : array (n,)
        Rudder angles and steady yaw rates in the order they were run, in any units; the way back has the rudders of
        the way out.
    """
    half = len(rudders) // 2
    outward, back = (
        float(np.interp(0.0, way[::-1], rudders[: half + 1][::-1])) for way in (rates[: half + 1], rates[half:][::-1])
    )
    return outward, back


def spiral_loop(rudders: Array, rates: Array) -> tuple[float, float]:
    """Width and height of the loop of a spiral, in the units of its arguments; zero of a ship without one.

    Where the two ways give different rates at one rudder angle, the ship has two steady turns there: a loop, as wide as
    the rudder has to go beyond one crossing of zero rate to reach the other.

    Parameters
    ----------
    rudders, rates : array (n,)
        As in :func:`zero_rate_rudders`.
    """
    half = len(rudders) // 2
    height = float(np.max(np.abs(rates[: half + 1] - rates[half:][::-1])))
    if not height > LOOP_HEIGHT * np.max(np.abs(rates)):
        return 0.0, 0.0
    crossings = zero_rate_rudders(rudders, rates)
    return abs(crossings[0] - crossings[1]), height


def _spiral(run: Trajectory, rudders: tuple[float, ...]) -> Figures:
    changes = np.flatnonzero(np.diff(run["rudder.command"]) != 0)
    ends = np.append(changes[len(changes) - len(rudders) + 1 :] + 1, len(run.t) - 1)
    rates, angles = np.degrees(run["motion.r"][ends]), np.degrees(rudders)
    width, height = spiral_loop(angles, rates)
    return {
        "rudder_deg": [float(angle) for angle in np.round(angles, 9)],
        "rate_degps": [float(rate) for rate in rates],
        "loop_width_deg": width,
        "loop_height_degps": height,
    }


def _stop(run: Trajectory, stop: Stop, length: float) -> Figures:
    """Track reach along the path, head reach along the initial course, side reach across it, to starboard: all of the
    origin, from the order until the ship is dead in the water (IMO MSC.137(76), ITTC 7.5-04-02-01), or coasts at the
    reported speed."""
    final = stop.final_speed(float(run["motion.u"][0]))
    time = _first(run.crossings("motion.u", "motion.udot", final))
    if time is None and run["motion.u"][-1] <= final + REST_SPEED * run["motion.speed"][0]:
        time = float(run.t[-1])  # the run ends at the event
    ahead, side = _Execute(run, 1.0).place(time) if time else (None, None)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(run["motion.x"]), np.diff(run["motion.y"])))])
    track = float(np.interp(time, run.t, way)) if time else None
    return {
        "track_reach_m": track,
        "head_reach_m": ahead,
        "side_reach_m": side,
        "time_to_stop_s": time,
        "stopped_at_mps": final if time else None,
        "track_reach_lengths": track and track / length,
        "head_reach_lengths": ahead and ahead / length,
        "heading_change_deg": math.degrees(run.at("motion.psi", time) - run["motion.psi"][0]) if time else None,
    }


def _speed_loss(run: Trajectory, speed: float) -> float | None:
    """Per cent of the speed at the execute; None for a ship that started at rest."""
    before, largest = float(run["motion.speed"][0]), float(run["motion.speed"].max())
    return 100 * (1 - speed / before) if before > REST_SPEED * largest else None
