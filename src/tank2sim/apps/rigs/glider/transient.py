"""Transient effects that the steady glides of paper 5 neglect: equilibria of the full model, and paths between them.

The paper assumes a steady glide at each instant, with slow controls. Programmes of steps, and pitch, buoyancy or roll
that vary as a sine about a dive, show the error of this against the length of a step or the period of the swing. For
swings the transient model is compared with the steady glide of the instantaneous controls: the difference is the effect
of inertia alone, without the delay of the controls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.path import GlidePath, path_of
from tank2sim.apps.rigs.glider.steady import SteadyGlide, glide_at_pitch, smallest_angle, steady_glide
from tank2sim.arrays import Array, Columns
from tank2sim.dynamics.model import Model
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tank2sim.simulation.straight_course import OperatingPoint, steady_motion
from tank2sim.simulation.trajectory import Trajectory

SWEEP_DURATIONS_S = (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""Lengths of a step for :func:`quasi_steady_error`; the paper's period is 100 s."""


class GlideEquilibrium(NamedTuple):
    """A steady glide of the transient model: its operating point, and what :class:`SteadyGlide` has of it."""

    point: OperatingPoint
    speed_mps: float
    path_angle_rad: float
    incidence_rad: float
    turn_rate_radps: float
    turning_radius_m: float


def equilibrium(model: Model, glide: SteadyGlide) -> GlideEquilibrium:
    """The equilibrium of the transient model under the pitch, roll and buoyancy of a glide.

    `glide` is the first guess. On a straight path it is the same glide; in a turn it includes the added mass, which the
    closed form neglects. InputError if there is none near the glide.
    """
    orders = {"buoyancy": glide.buoyancy_kg, "pitch": glide.pitch_rad, "roll": glide.roll_rad}
    first = {
        "initial.u": glide.speed_mps * math.cos(glide.incidence_rad),
        "initial.w": glide.speed_mps * math.sin(glide.incidence_rad),
    }
    p = model.parameter_values(first | {f"initial.{name}": order for name, order in orders.items()})
    u = model.input_values({f"{name}.command": order for name, order in orders.items()})
    x = steady_motion(model, np.array(model.initial(p)).ravel(), u, p)
    y = dict(zip(model.outputs, np.array(model.output(x, u, p)).ravel().tolist(), strict=True))
    turn = y["motion.psidot"]
    ground = y["motion.speed"] * math.cos(y["motion.path_angle"])
    radius = abs(ground / turn) if abs(turn) > 1e-15 else math.inf
    return GlideEquilibrium(
        OperatingPoint(x, u, p), y["motion.speed"], y["motion.path_angle"], y["motion.incidence"], turn, radius
    )


def follow_programme(
    integrator: Integrator, orders: Sequence[Mapping[str, float]], durations_s: Sequence[float]
) -> Trajectory:
    """The motion of a glider model under orders that hold for their durations, from the steady glide of the first.

    Orders are ``buoyancy.command`` (kg), ``pitch.command`` and ``roll.command`` (rad). Without buoyancy in the first it
    starts at rest. InputError if no steady glide exists near the start, or the motion leaves all bounds.
    """
    first = {f"initial.{name}": orders[0][f"{name}.command"] for name in ("buoyancy", "pitch", "roll")}
    # Newton's first guess: some incidence of the right sign.
    down = -math.copysign(0.04, first["initial.pitch"])
    speed = integrator.model.defaults["initial.u"]
    usual = integrator.model.input_values()[integrator.model.input_names.index("buoyancy.command")]
    pull = math.sqrt(abs(first["initial.buoyancy"] / float(np.abs(usual))))
    start = {"initial.trim": float(pull > 0), "initial.u": speed * pull, "initial.w": speed * pull * down}
    running = Running(integrator, orders[0], {**first, **start})
    for order, duration in zip(orders, durations_s, strict=True):
        running.order(order)
        running.run(duration)
    return running.trajectory()


class Compared(NamedTuple):
    """A path of steady glides, the motion of the transient model under the same orders, and their distance (steps + 1,)
    at the start and at the end of each step."""

    path: GlidePath
    motion: Trajectory
    distance_m: Array

    @property
    def share(self) -> float:
        """The largest distance, as a share of the length of the path."""
        return float(self.distance_m.max()) / self.path.length_m if self.path.length_m else math.nan

    def histories(self) -> Columns:
        """Columns of the transient motion, thinned for a chart."""
        run, degrees = self.motion, math.degrees(1.0)
        angles = {"pitch_deg": "pitch.angle", "roll_deg": "roll.angle", "incidence_deg": "motion.incidence"}
        columns = {"t_s": run.t, "x_m": run["motion.x"], "y_m": run["motion.y"], "height_m": -run["motion.z"]}
        columns |= {"buoyancy_kg": run["buoyancy.mass"]} | {key: degrees * run[name] for key, name in angles.items()}
        return drawn_columns(columns | {"speed_mps": run["motion.speed"]})

    def orders(self) -> Columns:
        """Columns of the orders and their steady glides, each constant through its step."""
        times = np.repeat([place.time_s for place in self.path.places], 2)[1:-1]
        columns = {"t_s": times}
        for name in ("buoyancy_kg", "pitch_rad", "roll_rad", "incidence_rad", "speed_mps"):
            held = np.repeat([getattr(glide, name) for glide in self.path.glides], 2)
            angle = name.endswith("_rad")
            columns[name.replace("_rad", "_deg")] = math.degrees(1.0) * held if angle else held
        return drawn_columns(columns, len(times))


def compare_with_steady(integrator: Integrator, path: GlidePath) -> Compared:
    """Fly the glides of a path with the transient model. Raises as :func:`follow_programme`."""
    orders = [
        {"buoyancy.command": glide.buoyancy_kg, "pitch.command": glide.pitch_rad, "roll.command": glide.roll_rad}
        for glide in path.glides
    ]
    motion = follow_programme(integrator, orders, path.durations_s)
    distance = []
    for place in path.places:
        flown = [motion.at(name, place.time_s) for name in ("motion.x", "motion.y", "motion.z")]
        distance.append(math.dist(flown, (place.north_m, place.east_m, -place.height_m)))
    return Compared(path, motion, np.array(distance))


@dataclass(frozen=True, eq=False)
class ProgrammeError:
    """The quasi-steady error of a kind of programme.

    Parameters
    ----------
    label : str
        Name of the alternating orders.
    duration_s : array (n,)
        Duration of one step.
    distance_m, share : arrays (n,)
        Largest distance of the two paths at the end of a step, and as a share of the length of the path.
    """

    label: str
    duration_s: Array
    distance_m: Array
    share: Array


def quasi_steady_error(
    card: GliderCard, integrator: Integrator, durations_s: Sequence[float] = SWEEP_DURATIONS_S
) -> tuple[ProgrammeError, ...]:
    """Distance of the quasi-steady path from the transient model, against the length of the steps.

    Four steps, from a steady glide, of three kinds (project choice): from dive to climb and back, from a shallow to a
    steep dive and back, and with roll to starboard and to port; all from 6 deg above the smallest angle.
    """
    shallow = math.radians(math.ceil(math.degrees(smallest_angle(card)) + 6))
    steep, roll = min(shallow + math.radians(15), math.radians(80)), math.radians(2.0)
    kinds = {
        f"dive and climb at {math.degrees(shallow):.0f} deg": ((-shallow, 0.0), (shallow, 0.0)),
        f"dive at {math.degrees(shallow):.0f} and {math.degrees(steep):.0f} deg": ((-shallow, 0.0), (-steep, 0.0)),
        "roll of 2 deg to and fro": ((-shallow, roll), (-shallow, -roll)),
    }
    errors = []
    for label, pair in kinds.items():
        glides = [steady_glide(card, angle, roll_rad=rolled) for angle, rolled in (*pair, *pair)]
        found = [compare_with_steady(integrator, path_of(glides, [duration] * len(glides))) for duration in durations_s]
        distance = np.array([float(path.distance_m.max()) for path in found])
        errors.append(ProgrammeError(label, np.array(durations_s), distance, np.array([path.share for path in found])))
    return tuple(errors)


SWING_PERIODS_S = (20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
"""Periods for :func:`swing_errors`."""

_PIECES = 200  # orders in a period, each held: what is between them the lag of the controls smooths
_PERIODS = 3  # the last one is evaluated

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


def swing_errors(
    card: GliderCard, integrator: Integrator, periods_s: Sequence[float] = SWING_PERIODS_S
) -> tuple[SwingError, ...]:
    """Errors of the quasi-steady assumption against the period of pitch, buoyancy and roll."""
    middle = steady_glide(card, -(smallest_angle(card) + math.radians(10)))
    velocity, turn = _velocity_error(card), _turn_error(card, middle)
    swings = (
        (f"pitch by {math.degrees(_PITCH):g} deg", (0.0, _PITCH, 0.0), velocity),
        (f"buoyancy by {100 * _BUOYANCY:g} %", (_BUOYANCY * card.glider.buoyancy_kg, 0.0, 0.0), velocity),
        (f"roll by {math.degrees(_ROLL):g} deg", (0.0, 0.0, _ROLL), turn),
    )
    found = []
    for label, amplitudes, error in swings:
        share = [error(*_swing(integrator, middle, amplitudes, period)) for period in periods_s]
        found.append(SwingError(label, np.array(periods_s), np.array(share)))
    return tuple(found)


def _swing(
    integrator: Integrator, middle: SteadyGlide, amplitudes: tuple[float, float, float], period: float
) -> tuple[Trajectory, slice]:
    """The motion under a swing of buoyancy (kg), pitch and roll (rad) about a glide, and its last period."""
    phases = np.sin(math.tau * (np.arange(_PERIODS * _PIECES) + 0.5) / _PIECES).tolist()
    names, centre = ("buoyancy", "pitch", "roll"), (middle.buoyancy_kg, middle.pitch_rad, 0.0)
    orders = [
        {f"{name}.command": at + size * phase for name, at, size in zip(names, centre, amplitudes, strict=True)}
        for phase in phases
    ]
    run = follow_programme(integrator, orders, [period / _PIECES] * len(orders))
    return run, slice(int(np.searchsorted(run.t, (_PERIODS - 1) * period)), None)


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
