"""Transient effects that the steady glides of paper 5 neglect: equilibria of the full model, and paths between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.linearisation import OperatingPoint
from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.path import GlidePath, path_of
from tank2sim.apps.rigs.glider.programme import follow_programme
from tank2sim.apps.rigs.glider.steady import SteadyGlide, smallest_angle, steady_glide
from tank2sim.arrays import Array, Columns
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.trajectory import Trajectory

SWEEP_DURATIONS_S = (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""Lengths of a step for :func:`quasi_steady_error`; the paper's period is 100 s."""

_ACCURACY = 1e-12  # m/s2, of the accelerations at an equilibrium


@dataclass(frozen=True)
class GlideEquilibrium:
    """A steady glide of the transient model.

    Parameters
    ----------
    point : OperatingPoint
        Operating point, for :func:`tank2sim.analysis.linearisation.state_space`.
    speed_mps, path_angle_rad, incidence_rad, turn_rate_radps : float
        As in :class:`tank2sim.apps.rigs.glider.steady.SteadyGlide`.
    turning_radius_m : float
        Without sign; inf without a turn.
    """

    point: OperatingPoint
    speed_mps: float
    path_angle_rad: float
    incidence_rad: float
    turn_rate_radps: float
    turning_radius_m: float


def equilibrium(model: Model, glide: SteadyGlide) -> GlideEquilibrium:
    """The equilibrium of the transient model under the pitch, roll and buoyancy of a glide, by CasADi's Newton solver.

    `glide` is the first guess. Its u and w are constant; on a straight path it is the same glide, in a turn it includes
    the added mass, which the closed form neglects.

    Raises
    ------
    InputError
        No equilibrium exists near the glide.
    """
    p = model.parameter_values()
    u = model.input_values(
        {
            "buoyancy.command": glide.buoyancy_kg,
            "pitch.command": glide.pitch_rad,
            "roll.command": glide.roll_rad,
        }
    )
    names = model.state_names
    x = np.zeros(len(names))
    for name, value in {
        "motion.u": glide.speed_mps * math.cos(glide.incidence_rad),
        "motion.w": glide.speed_mps * math.sin(glide.incidence_rad),
        "buoyancy.mass": glide.buoyancy_kg,
        "pitch.angle": glide.pitch_rad,
        "roll.angle": glide.roll_rad,
    }.items():
        x[names.index(name)] = value
    places = [names.index("motion.u"), names.index("motion.w")]
    residual = ca.substitute(ca.substitute(model.rates[places], model.u, ca.DM(u)), model.p, ca.DM(p))
    given = [place for place in range(len(names)) if place not in places]
    residual = ca.substitute(residual, model.x[given], ca.DM(x[given]))
    problem = {"x": model.x[places], "g": residual}
    solver = ca.rootfinder("equilibrium", "newton", problem, {"abstol": _ACCURACY, "error_on_fail": False})
    x[places] = np.array(solver(x[places], [])).ravel()
    rates = np.abs(np.array(model.rhs(x, u, p)).ravel()[places])
    if not np.all(rates < 1e3 * _ACCURACY):
        raise InputError(
            model.origin, "", "the transient model has no equilibrium near this glide", "give another angle"
        )
    y = dict(zip(model.outputs, np.array(model.output(x, u, p)).ravel().tolist(), strict=True))
    turn = y["motion.psidot"]
    ground = y["motion.speed"] * math.cos(y["motion.path_angle"])
    radius = abs(ground / turn) if abs(turn) > 1e-15 else math.inf
    return GlideEquilibrium(
        OperatingPoint(x, u, p), y["motion.speed"], y["motion.path_angle"], y["motion.incidence"], turn, radius
    )


@dataclass(frozen=True)
class Compared:
    """A path of steady glides, the motion of the transient model under the same orders, and their distance.

    Parameters
    ----------
    path : GlidePath
        Quasi-steady.
    motion : Trajectory
        Transient.
    distance_m : array (steps + 1,)
        Between the two at the start and at the end of each step.
    """

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
        ends = np.array([place.time_s for place in self.path.places])
        steps, degrees = self.path.glides, math.degrees(1.0)
        columns = {
            "buoyancy_kg": [glide.buoyancy_kg for glide in steps],
            "pitch_deg": [degrees * glide.pitch_rad for glide in steps],
            "roll_deg": [degrees * glide.roll_rad for glide in steps],
            "incidence_deg": [degrees * glide.incidence_rad for glide in steps],
            "speed_mps": [glide.speed_mps for glide in steps],
        }
        times = np.repeat(ends, 2)[1:-1]
        held = {name: np.repeat(np.array(values), 2) for name, values in columns.items()}
        return drawn_columns({"t_s": times, **held}, len(times))


def compare_with_steady(integrator: Integrator, path: GlidePath) -> Compared:
    """Fly the glides of a path with the transient model. Raises as :func:`follow_programme`."""
    motion = follow_programme(integrator, path.orders(), path.durations_s)
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
