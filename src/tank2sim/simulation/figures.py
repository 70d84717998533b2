"""Manoeuvring figures of a trajectory, as in ITTC 7.5-04-02-01 and IMO MSC.137(76).

Distances are in axes fixed at the execute: advance along the initial heading, transfer at right angles to it, positive
to the side of the turn. Between samples signals are interpolated, so that figures do not depend on the sampling.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.simulation.manoeuvres import PullOut, SpiralManoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun
from tank2sim.simulation.trajectory import EventSamples, Trajectory

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


@dataclass(frozen=True, eq=False)
class Events:
    """Events of n runs: their times (n, m), nan where there is none, and any signal (n, m) at them."""

    times: Array
    at: Callable[[str], Array]


@dataclass(frozen=True, eq=False)
class KeptRuns:
    """What the figures of n runs need: one run with all its samples, or many with few samples kept."""

    # `length`, `end`, `way` (n,): Lengths of the ships, m; times of the ends, s; lengths of the tracks, m.
    length: Array
    end: Array
    way: Array
    speeds: Array  # (n, 4): First, lowest, highest and last, m/s
    then: Array  # (n, 2): Yaw rate and speed two lengths before the end, nan in shorter runs
    # `first`, `last`: A state (n,) at the execute; a state or ``motion.beta`` (n,) at the end.
    first: Callable[[str], Array]
    last: Callable[[str], Array]
    # Crossings of a level (n,) by a state with this time derivative, the first or second that is watched (0, 1).
    crossings: Callable[[str, str, Array, int], Events]
    executes: Callable[[float], Events]  # Orders of the rudder to the other side, this time (s) before it moves


def whole_run(run: Trajectory, length: float, end_s: float | None = None) -> KeptRuns:
    """A run with all its samples, up to a time, as n = 1 runs of a ship of a length, m."""
    speed, end = run["motion.speed"], float(run.t[-1]) if end_s is None else end_s
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(run["motion.x"]), np.diff(run["motion.y"])))])
    before = run.t[-1] - 2 * length / max(float(speed[-1]), 1e-9)
    row = int(np.searchsorted(run.t, before))
    then = [run[name][row] if before >= run.t[0] else np.nan for name in ("motion.r", "motion.speed")]

    def events(rows: NDArray[np.intp], crossing: Callable[[EventSamples], Array]) -> Events:
        samples = run.samples(rows)
        times = crossing(samples)
        return Events(times[None], lambda name: samples.at(name, times)[None])

    def crossings(name: str, rate: str, level: Array, number: int) -> Events:
        rows = run.rows_before(name, float(level[0]))
        rows = np.append(rows, np.full(max(0, 3 - len(rows)), -9))  # at least three, the last of them outside the run
        return events(rows, lambda samples: samples.crossing(name, rate, level))

    def executes(wait_s: float) -> Events:
        command = run["rudder.command"]
        times = run.t[1:][command[:-1] * command[1:] < 0] - wait_s
        times = times if len(times) else np.array([np.nan])
        return events(run.gap(times), lambda _: times)

    return KeptRuns(
        length=np.array([length]),
        end=np.array([end]),
        way=np.array([np.interp(end, run.t, ways)]),
        speeds=np.array([[speed[0], speed.min(), speed.max(), speed[-1]]]),
        then=np.array([then]),
        first=lambda name: run[name][:1],
        last=lambda name: run[name][-1:] if end_s is None else np.array([run.at(name, end)]),
        crossings=crossings,
        executes=executes,
    )


def figures_of(manoeuvre: object, trajectory: Trajectory, length: float) -> Figures:
    """Figures of a manoeuvre of :mod:`tank2sim.simulation.manoeuvres`; None where the run was too short to show it.

    `trajectory`: Trajectory of a ship. `length`: Length between perpendiculars, m.
    """
    whole = whole_run(trajectory, length)
    match manoeuvre:
        case Turn() | DifferenceTurn() | Zigzag():
            return _listed(run_figures(manoeuvre, whole)) | _largest_heel(trajectory)
        case Stop():
            final = manoeuvre.final_speed(whole.first("motion.u"))
            times = trajectory.crossings("motion.u", "motion.udot", float(final[0])).tolist()
            return _listed(run_figures(manoeuvre, whole_run(trajectory, length, *times[:1])))
        case Spin(revolutions):
            return _listed(_spin(whole, trajectory, math.copysign(1.0, revolutions)))
        case StraightRun():
            return _listed(_straight(whole))
        case PullOut(rudder):
            return _pull_out(trajectory, rudder)
        case SpiralManoeuvre(rudders):
            changes = np.flatnonzero(np.diff(trajectory["rudder.command"]) != 0)
            ends = np.append(changes[len(changes) - len(rudders) + 1 :] + 1, len(trajectory.t) - 1)
            return _listed(spiral_figures(rudders, trajectory["motion.r"][None, ends]))
        case _:
            return _ending(trajectory, whole)


def run_figures(manoeuvre: object, runs: KeptRuns) -> dict[str, Array]:
    """Figures (n,), or (n, m) for m entries of a list, of n runs of a turn, a zigzag or a stop; nan where not shown."""
    match manoeuvre:
        case Zigzag():
            return _zigzag(runs, manoeuvre)
        case Stop():
            return _stop(runs, manoeuvre.final_speed(runs.first("motion.u")))
        case Turn(rudder=order) | DifferenceTurn(order):
            return _turn(runs, math.copysign(1.0, order))
    raise TypeError(manoeuvre)


def _listed(columns: Mapping[str, Array]) -> Figures:
    """The figures of one run: numbers, lists, and None for what it does not show."""
    return {
        name: values[0][np.isfinite(values[0])].tolist()
        if values.ndim == 2
        else float(values[0])
        if np.isfinite(values[0])
        else None
        for name, values in columns.items()
    }


def _ending(run: Trajectory, whole: KeptRuns) -> Figures:
    return {
        "duration_s": float(run.t[-1]),
        "final_speed_mps": float(run["motion.speed"][-1]),
        "final_heading_deg": math.degrees(run["motion.psi"][-1]),
        **_listed({"speed_loss_percent": _speed_loss(whole, whole.speeds[:, 3])}),
    }


def _ahead_and_aside(runs: KeptRuns, x: Array, y: Array, side: float) -> tuple[Array, Array]:
    """Distances ahead and to the side of the turn of places (n,) from that at the execute, m."""
    heading = runs.first("motion.psi")
    north, east, cos, sin = x - runs.first("motion.x"), y - runs.first("motion.y"), np.cos(heading), np.sin(heading)
    with np.errstate(invalid="ignore"):  # ships beyond all bounds, which are left out later
        return north * cos + east * sin, side * (east * cos - north * sin)


def _headings(runs: KeptRuns, side: float, changes: Sequence[float]) -> list[tuple[Array, Array, Array]]:
    """Time of the first crossing of each change of heading (rad, to the side of the turn), and the place then, m."""
    found = []
    for number, change in enumerate(changes):
        passed = runs.crossings("motion.psi", "motion.r", runs.first("motion.psi") + side * change, number)
        place = _ahead_and_aside(runs, passed.at("motion.x")[:, 0], passed.at("motion.y")[:, 0], side)
        found.append((passed.times[:, 0], *place))
    return found


def _turn(runs: KeptRuns, side: float) -> dict[str, Array]:
    (quarter, advance, transfer), (half, _, tactical) = _headings(runs, side, (math.pi / 2, math.pi))
    speed, rate = runs.speeds[:, 3], runs.last("motion.r")
    steady = np.isfinite(half) & (unsteadiness(runs) < STEADY_SHARE)
    with np.errstate(invalid="ignore", divide="ignore"):
        at_last = {
            "steady_diameter_m": 2 * speed / np.abs(rate),
            "steady_drift_deg": np.degrees(runs.last("motion.beta")),
            "steady_rate_degps": np.degrees(rate),
            "steady_speed_mps": speed,
            "speed_loss_percent": _speed_loss(runs, speed),
        }
    return {
        "advance_m": advance,
        "transfer_m": transfer,
        "tactical_diameter_m": tactical,
        "advance_lengths": advance / runs.length,
        "tactical_diameter_lengths": tactical / runs.length,
        "time_90_s": quarter,
        "time_180_s": half,
    } | {name: np.where(steady, values, np.nan) for name, values in at_last.items()}


def unsteadiness(runs: KeptRuns) -> Array:
    """Larger relative change (n,) of yaw rate and speed over the last two lengths; nan without them."""
    now = np.column_stack([runs.last("motion.r"), runs.speeds[:, 3]])
    with np.errstate(invalid="ignore", divide="ignore"):
        changes: Array = np.max(np.abs(now - runs.then) / np.abs(now), axis=1)
    return changes


def _spin(runs: KeptRuns, run: Trajectory, side: float) -> dict[str, Array]:
    """Times to a half and to a whole turn, the rate at the end, and how far the origin went from its place."""
    (half, *_), (whole, *_) = _headings(runs, side, (math.pi, 2 * math.pi))
    away = np.hypot(run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0]).max(keepdims=True)
    return {
        "time_180_s": half,
        "time_360_s": whole,
        "final_rate_degps": np.degrees(runs.last("motion.r")),
        "largest_distance_m": away,
        "largest_distance_lengths": away / runs.length,
    }


def _straight(runs: KeptRuns) -> dict[str, Array]:
    """The speed at the end of a run from rest, and the time and distance to nine tenths of it."""
    final = runs.last("motion.u")
    reached = runs.crossings("motion.u", "motion.udot", REACHED_SPEED * final, 0)
    place = _ahead_and_aside(runs, reached.at("motion.x")[:, 0], reached.at("motion.y")[:, 0], 1.0)
    return {
        "final_speed_mps": final,
        "time_to_90_percent_s": reached.times[:, 0],
        "distance_to_90_percent_m": np.hypot(*place),
        "distance_to_90_percent_lengths": np.hypot(*place) / runs.length,
    }


def _largest_heel(run: Trajectory) -> Figures:
    """The largest heel (deg, positive to starboard) of a ship that rolls; no figure of one that does not."""
    if "motion.phi" not in run.model:
        return {}
    heel = run["motion.phi"]
    return {"largest_heel_deg": math.degrees(heel[np.argmax(np.abs(heel))])}


def _zigzag(runs: KeptRuns, zigzag: Zigzag) -> dict[str, Array]:
    side = math.copysign(1.0, zigzag.rudder)
    course = runs.first("motion.psi") if zigzag.course is None else np.full(len(runs.end), zigzag.course)
    orders = runs.executes(zigzag.wait_s)
    executes, first = orders.times, orders
    returns = runs.crossings("motion.psi", "motion.r", course, 0).times
    with np.errstate(invalid="ignore"):
        returns = np.sort(np.where(returns > executes[:, :1], returns, np.nan), axis=1)
    swung = runs.crossings("motion.r", "motion.rdot", np.zeros_like(course), 1)
    headings = swung.at("motion.psi")
    overshoots, peaks = np.full(executes.shape, np.nan), np.full(executes.shape, np.nan)
    for number in range(executes.shape[1]):
        after = np.where(swung.times > executes[:, [number]], swung.times, np.inf)
        next_ = np.argmin(after, axis=1)[:, None]
        peak = np.take_along_axis(after, next_, axis=1)[:, 0]
        change = side * (-1) ** number * (np.take_along_axis(headings, next_, axis=1)[:, 0] - course)
        shown = np.isfinite(peak)
        overshoots[:, number] = np.where(shown, np.degrees(change - zigzag.headings[number % 2]), np.nan)
        peaks[:, number] = np.where(shown, peak - executes[:, number], np.nan)
    if zigzag.lag_s or zigzag.course is not None:  # the first heading is not the first reversal's
        reached = runs.crossings("motion.psi", "motion.r", course + side * zigzag.heading, 0)
        first = reached if np.isfinite(reached.times[:, 0]).all() else first
    place = _ahead_and_aside(runs, first.at("motion.x")[:, 0], first.at("motion.y")[:, 0], 1.0)
    arrival = np.where(np.isfinite(executes[:, 0]), first.times[:, 0], np.nan)
    distance = np.where(np.isfinite(arrival), np.hypot(*place), np.nan)
    return {
        "overshoots_deg": overshoots,
        "overshoot_times_s": peaks,
        "execute_times_s": executes,
        "initial_turning_time_s": arrival,
        "initial_turning_distance_m": distance,
        "initial_turning_lengths": distance / runs.length,
        "reach_s": returns[:, 0],
        "period_s": returns[:, 2] - returns[:, 0],
        "speed_loss_percent": _speed_loss(runs, runs.speeds[:, 1]),
    }


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

    `rudders`, `rates` (n,): Rudder angles and steady yaw rates in the order they were run, in any units; the way back
    has the rudders of the way out.
    """
    half = len(rudders) // 2
    outward, back = (
        float(np.interp(0.0, way[::-1], rudders[: half + 1][::-1])) for way in (rates[: half + 1], rates[half:][::-1])
    )
    return outward, back


def spiral_figures(rudders: Sequence[float], rates: Array) -> dict[str, Array]:
    """Figures of spirals by their rudders (m,), rad, and yaw rates (n, m), rad/s; nan where a rate is.

    Where the two ways give different rates at one rudder angle, the ship has two steady turns there: a loop, as wide as
    the rudder has to go beyond one crossing of zero rate to reach the other.
    """
    angles, rates = np.degrees(rudders), np.degrees(rates)
    half = len(angles) // 2
    height = np.max(np.abs(rates[:, : half + 1] - rates[:, half:][:, ::-1]), axis=1)
    with np.errstate(invalid="ignore"):
        looped = height > LOOP_HEIGHT * np.max(np.abs(rates), axis=1)
    width = np.zeros(len(rates))
    for row in np.flatnonzero(looped):
        outward, back = zero_rate_rudders(angles, rates[row])
        width[row] = abs(outward - back)
    known = np.isfinite(height)
    return {
        "rudder_deg": np.where(known[:, None], np.round(angles, 9), np.nan),
        "rate_degps": np.where(known[:, None], rates, np.nan),
        "loop_width_deg": np.where(known, width, np.nan),
        "loop_height_degps": np.where(looped, height, np.where(known, 0.0, np.nan)),
    }


def _stop(runs: KeptRuns, final: Array) -> dict[str, Array]:
    """Track reach along the path, head reach along the initial course, side reach across it, to starboard: all of the
    origin, from the order until the ship is dead in the water (IMO MSC.137(76), ITTC 7.5-04-02-01), or coasts at the
    reported speed `final` (n,), m/s."""
    stopped = runs.last("motion.u") <= final + REST_SPEED * runs.speeds[:, 0]
    moved = stopped & (runs.end > 0)
    ahead, aside = _ahead_and_aside(runs, runs.last("motion.x"), runs.last("motion.y"), 1.0)
    figures = {
        "track_reach_m": runs.way,
        "head_reach_m": ahead,
        "side_reach_m": aside,
        "time_to_stop_s": np.where(stopped, runs.end, np.nan),
        "stopped_at_mps": final,
        "track_reach_lengths": runs.way / runs.length,
        "head_reach_lengths": ahead / runs.length,
        "heading_change_deg": np.degrees(runs.last("motion.psi") - runs.first("motion.psi")),
    }
    return {
        name: values if name == "time_to_stop_s" else np.where(moved, values, np.nan)
        for name, values in figures.items()
    }


def _speed_loss(runs: KeptRuns, speed: Array) -> Array:
    """Per cent of the speed at the execute (n,); nan for a ship that started at rest."""
    before, largest = runs.speeds[:, 0], runs.speeds[:, 2]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(before > REST_SPEED * largest, 100 * (1 - speed / before), np.nan)
