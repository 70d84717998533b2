"""Errors of the quasi-steady assumption with oscillating controls, against the period of the oscillation.

The paper assumes a steady glide at each instant, with slow controls. This module varies pitch, buoyancy or roll as a
sine about a dive, and compares the transient model with the steady glide of the instantaneous controls: the difference
is the effect of inertia alone, without the delay of the controls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.programme import follow_programme
from tank2sim.apps.rigs.glider.steady import SteadyGlide, glide_at_pitch, smallest_angle, steady_glide
from tank2sim.arrays import Array
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.trajectory import Trajectory

SWING_PERIODS_S = (20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
"""Periods for :func:`swing_errors`."""

_PIECES = 200  # orders in a period, each held: what is between them the lag of the controls smooths
_PERIODS = 3  # of which the last is evaluated

_PITCH, _ROLL, _BUOYANCY = math.radians(3.0), math.radians(2.0), 0.2
"""Amplitudes of the oscillations, the last as a share of the net buoyancy: project choice, within small incidences."""


@dataclass(frozen=True, eq=False)
class SwingError:
    """Effect of inertia in a kind of oscillation.

    Parameters
    ----------
    label : str
        The oscillating control.
    period_s : array (n,)
        Period of the swing.
    share : array (n,)
        Root mean square over a period of the difference from the instantaneous steady glide: of the velocity, relative
        to the speed; for roll of the rate of turn, relative to its root mean square.
    """

    label: str
    period_s: Array
    share: Array


@dataclass(frozen=True)
class _Swing:
    label: str
    amplitudes: tuple[float, float, float]
    """Amplitudes of buoyancy (kg), pitch and roll (rad)."""
    error: Callable[[Trajectory, slice], float]


def swing_errors(
    card: GliderCard, integrator: Integrator, periods_s: Sequence[float] = SWING_PERIODS_S
) -> tuple[SwingError, ...]:
    """Errors of the quasi-steady assumption against the period of pitch, buoyancy and roll."""
    middle = steady_glide(card, -(smallest_angle(card) + math.radians(10)))
    velocity, turn = _velocity_error(card), _turn_error(card, middle)
    swings = (
        _Swing(f"pitch by {math.degrees(_PITCH):g} deg", (0.0, _PITCH, 0.0), velocity),
        _Swing(f"buoyancy by {100 * _BUOYANCY:g} %", (_BUOYANCY * card.glider.buoyancy_kg, 0.0, 0.0), velocity),
        _Swing(f"roll by {math.degrees(_ROLL):g} deg", (0.0, 0.0, _ROLL), turn),
    )
    found = []
    for swing in swings:
        share = [_error(integrator, middle, swing, period) for period in periods_s]
        found.append(SwingError(swing.label, np.array(periods_s), np.array(share)))
    return tuple(found)


def _error(integrator: Integrator, middle: SteadyGlide, swing: _Swing, period: float) -> float:
    phases = np.sin(math.tau * (np.arange(_PERIODS * _PIECES) + 0.5) / _PIECES).tolist()
    centre = (middle.buoyancy_kg, middle.pitch_rad, 0.0)
    names = ("buoyancy.command", "pitch.command", "roll.command")
    orders = [
        {name: at + size * phase for name, at, size in zip(names, centre, swing.amplitudes, strict=True)}
        for phase in phases
    ]
    run = follow_programme(integrator, orders, [period / _PIECES] * len(orders))
    last = slice(int(np.searchsorted(run.t, (_PERIODS - 1) * period)), None)
    return swing.error(run, last)


def _velocity_error(card: GliderCard) -> Callable[[Trajectory, slice], float]:
    """Error of the velocity in the vertical plane, by the speed, without roll."""
    angles = smallest_angle(card) * 1.0001 + np.linspace(0, 0.8, 200) ** 2
    glides = [steady_glide(card, -angle) for angle in angles[angles < 1.5].tolist()]
    pitch = np.array([-glide.pitch_rad for glide in glides])
    path = CubicSpline(pitch, [glide.path_angle_rad for glide in glides])
    speed = CubicSpline(pitch, [glide.speed_mps for glide in glides])

    def error(run: Trajectory, part: slice) -> float:
        down = -run["pitch.angle"][part]
        steady = speed(down) * np.sqrt(np.abs(run["buoyancy.mass"][part]) / card.glider.buoyancy_kg)
        angle, speed_mps = run["motion.path_angle"][part], run["motion.speed"][part]
        along = speed_mps * np.cos(angle) - steady * np.cos(path(down))
        up = speed_mps * np.sin(angle) - steady * np.sin(path(down))
        return float(np.sqrt(np.mean(along**2 + up**2)) / np.mean(speed_mps))

    return error


def _turn_error(card: GliderCard, middle: SteadyGlide) -> Callable[[Trajectory, slice], float]:
    """Error of the rate of turn, at the pitch of `middle`."""
    rolls = np.linspace(-2 * _ROLL, 2 * _ROLL, 41)
    glides = [glide_at_pitch(card, middle.pitch_rad, roll_rad=roll) for roll in rolls.tolist()]
    rate = CubicSpline(rolls, [glide.turn_rate_radps for glide in glides])

    def error(run: Trajectory, part: slice) -> float:
        steady = rate(run["roll.angle"][part])
        off = run["motion.psidot"][part] - steady
        return float(np.sqrt(np.mean(off**2) / np.mean(steady**2)))

    return error
