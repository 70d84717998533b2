"""Surge of an own ship of Bridge Command 5.11, fitted to straight runs and stops of a card.

As the source of version 5.11 has it (no program was run), on a quiet sea, with levers e from -1 to 1::

    m du/dt = T - A u|u| - B u        T = F (e_port + e_starboard), times the efficiency astern where it is negative
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import COASTING_END, Stop
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running

_LEVERS = {"half thrust ahead": 0.5, "quarter thrust ahead": 0.25}

_ASTERN = 0.5
"""Thrust astern over ahead of a card without an engine (project choice)."""

Runs = dict[tuple[str, str], float]
"""Manoeuvre and figure to its value."""

HEADING_ASTERN = ("stop", "heading_change_deg")
"""The figure of a crash stop that the walk of the propeller follows."""


def full_ahead_order(model: Model) -> float | None:
    """Order of the engine at the start, rad/s; None without one."""
    names = model.input_names
    return float(model.input_values()[names.index("propeller.speed")]) if "propeller.speed" in names else None


def speed_against_drag(force: float, quadratic: float, linear: float) -> float:
    """Steady speed (or rate of turn) at a positive force (or moment) against quadratic and linear drag."""
    root = math.sqrt(linear**2 + 4 * quadratic * force) + linear  # without cancellation where the quadratic is small
    return 2 * force / root if root else math.inf


@dataclass(frozen=True)
class SurgeNumbers:
    """Numbers of surge: A (N s2/m2), B (N s/m), thrust of all engines (N), thrust astern over ahead, mass (kg)."""

    A: float
    B: float
    thrust_N: float
    astern: float
    mass_kg: float

    @property
    def keys(self) -> dict[str, float]:
        """Keys of ``boat.ini``."""
        return {
            "Mass": self.mass_kg,
            "AsternEfficiency": self.astern,
            "DynamicsSpeedA": self.A,
            "DynamicsSpeedB": self.B,
        }

    def speed(self, lever: float) -> float:
        """Steady speed at a lever, m/s."""
        return speed_against_drag(lever * self.thrust_N, self.A, self.B)

    def run(self, lever: float, first_mps: float, last_mps: float) -> tuple[float, float]:
        """Time (s) and way (m) between two speeds at a lever."""
        nodes, weights = np.polynomial.legendre.leggauss(64)
        half = (last_mps - first_mps) / 2
        u = first_mps + half * (1 + nodes)
        thrust = lever * self.thrust_N * (self.astern if lever < 0 else 1.0)
        times = self.mass_kg * half * weights / (thrust - self.A * u * np.abs(u) - self.B * u)
        return float(times.sum()), float((times * u).sum())


def straight_runs(surge: SurgeNumbers, speed_mps: float) -> Runs:
    """Figures of straight runs in Bridge Command.

    `speed_mps`: Speed at full ahead, from which the ship stops and to whose parts it gathers way.
    """
    found = {(name, "final_speed_mps"): surge.speed(lever) for name, lever in _LEVERS.items()}
    for name, lever, first, last, keys in (
        ("ahead from half speed", 1.0, 0.5, 0.9, ("time_to_90_percent_s", "distance_to_90_percent_m")),
        ("stop:0", 0.0, 1.0, COASTING_END, ("time_to_stop_s", "track_reach_m")),
        ("stop", -1.0, 1.0, 0.0, ("time_to_stop_s", "track_reach_m")),
    ):
        values = surge.run(lever, first * speed_mps, last * speed_mps)
        found |= {(name, key): value for key, value in zip(keys, values, strict=True)}
    return found


def _held(model: Model, speed: float, revolutions: float | None) -> Running:
    """60 L/u0 from a speed, at an order of the engine, on a course that a helmsman holds."""
    orders = {} if revolutions is None else {"propeller.speed": revolutions}
    running, values = Running(Integrator(model), orders, {"initial.u": speed}), model.defaults
    ship_time, largest = values["ship.length"] / values["ship.speed"], values.get("steering.max_angle", 0.6)
    for _ in range(600):
        rudder = -running.state("motion.psi") - 1.5 * ship_time * running.state("motion.r")
        running.order({"rudder.command": float(np.clip(rudder, -largest, largest))})
        running.run(ship_time / 10)
    return running


def straight_runs_of_card(model: Model) -> Runs:
    """Figures of straight runs of a card and the change of heading in its crash stop; with an engine only, the
    engine's figures.

    A lever is a share of the thrust: the order of the engine goes with its root.

    Raises InputError: A run leaves all bounds.
    """
    speed = model.defaults["ship.speed"]
    run = _held(model, 0.5 * speed, None).trajectory()
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(run["motion.x"]), np.diff(run["motion.y"])))])
    found: Runs = {}
    if fast := int(np.argmax(run["motion.u"] >= 0.9 * speed)):
        for key, values in (("time_to_90_percent_s", run.t), ("distance_to_90_percent_m", way)):
            found["ahead from half speed", key] = float(values[fast])
    nominal = full_ahead_order(model)
    if nominal is None:
        return found
    for name, lever in _LEVERS.items():
        found[name, "final_speed_mps"] = _held(model, speed, nominal * math.sqrt(lever)).state("motion.u")
    for stop in (Stop(0.0), Stop()):
        figures = single_figures(simulate(model, stop).figures)
        found |= {(stop.words, key): figures[key] for key in ("time_to_stop_s", "track_reach_m") if key in figures}
    if "heading_change_deg" in figures:
        found[HEADING_ASTERN] = figures["heading_change_deg"]
    return found


def fitted_surge(wanted: Runs, speed_mps: float, mass_kg: float) -> SurgeNumbers:
    """The numbers that follow the straight runs of a card best, with exactly its speed at full ahead.

    `wanted`: As of :func:`straight_runs_of_card`, without the change of heading; `speed_mps`, `mass_kg`: Speed at full
    ahead; mass with the added mass in surge.
    """
    from scipy.optimize import least_squares  # slow to import

    def surge(logs: Array) -> SurgeNumbers:
        A, B, astern = (float(number) for number in np.exp(logs))
        A, B = A * mass_kg / (10 * speed_mps), B * mass_kg / 1000  # about their usual sizes
        return SurgeNumbers(A, B, A * speed_mps**2 + B * speed_mps, astern, mass_kg)

    def residuals(logs: Array) -> Array:
        made = straight_runs(surge(logs), speed_mps)
        # The last ones are small, and hold numbers that nothing shows.
        return np.array([*(math.log(made[key] / value) for key, value in wanted.items() if value > 0), *(1e-3 * logs)])

    fit = least_squares(residuals, [0.0, 0.0, math.log(_ASTERN)], bounds=([-8, -12, -5], [5, 8, 2]))
    found = surge(fit.x)
    return found if ("stop", "time_to_stop_s") in wanted else replace(found, astern=_ASTERN)
