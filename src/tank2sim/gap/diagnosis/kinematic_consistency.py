"""Whether records of position, heading, velocity and yaw rate agree, whatever the hull does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.gap.result import Passed

ENDS = 20
"""The motion at an end of a trial is read off a straight line through this many instants (half of L/u0)."""

CONTRADICTED = 4.0
"""Records that contradict themselves by more standard errors than this are at fault, not the hull (project choice)."""


@dataclass(frozen=True)
class Kinematics:
    """Contradictions of records in standard errors: root mean square over trials, about 1 if there is none."""

    turning: float  # Integrated yaw rate against the change of heading
    track: float  # Integrated velocities through the water against the change of position


def kinematic_consistency(passed: Sequence[Passed]) -> Kinematics:
    """Compare dpsi/dt with r, and positions with those from u, v and psi, without a model of the hull.

    Both sides are compared over the whole of each trial; the standard error follows from white noise of the sensors,
    integrated.
    """
    turning, track = [], []
    for replay in passed:
        seen, noise = readable(replay)
        if {"psi", "r"} <= seen.keys():
            turning.append(_contradiction(replay.time_s, seen["psi"], noise["psi"], seen["r"], noise["r"]))
        if {"psi", "u", "v", "x", "y"} <= seen.keys():
            u, v, psi = (seen[name] for name in ("u", "v", "psi"))
            over = math.hypot(noise["u"], noise["v"], float(np.max(np.hypot(u, v))) * noise["psi"])
            for axis, rate in zip("xy", recorded_earth_velocity(u, v, psi), strict=True):
                track.append(_contradiction(replay.time_s, seen[axis], noise[axis], rate, over))
    return Kinematics(*(float(np.sqrt(np.mean(np.square(z)))) if z else 0.0 for z in (turning, track)))


def recorded_earth_velocity(u: Array, v: Array, psi: Array) -> tuple[Array, Array]:
    """Velocity to north and east (n,) each, m/s."""
    cos, sin = np.cos(psi), np.sin(psi)
    return u * cos - v * sin, u * sin + v * cos


def _contradiction(time: Array, signal: Array, noise: float, rate: Array, rate_noise: float) -> float:
    """Change of a signal over a trial less the integral of its measured rate, in standard errors."""
    ends = min(ENDS, len(time) // 2)
    deviation = signal - np.concatenate([[0.0], cumulative_trapezoid(rate, time)])
    change = float(deviation[-ends:].mean()) - float(deviation[:ends].mean())
    step = float(np.median(np.diff(time)))
    return change / math.hypot(noise * math.sqrt(2 / ends), rate_noise * step * math.sqrt(len(time)))


def readable(replay: Passed) -> tuple[dict[str, Array], dict[str, float]]:
    """The measured signals of a trial, with gaps interpolated, and their noise; names without ``motion.``."""
    names = {name.removeprefix("motion."): name for name in replay.seen}
    return (
        {short: filled(replay.measured[name]) for short, name in names.items()},
        {short: replay.noise[name] for short, name in names.items()},
    )


def filled(values: Array) -> Array:
    """A signal (n,) with gaps interpolated linearly."""
    known = np.isfinite(values)
    places = np.arange(len(values), dtype=float)
    whole: Array = np.interp(places, places[known], values[known])
    return whole
