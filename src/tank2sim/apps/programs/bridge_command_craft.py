"""A craft with two fixed thrusters as two engines of an own ship of Bridge Command 5.11, without a rudder.

With levers e_P, e_S (shares of the largest thrust F of a thruster, positive ahead) and the distance b between them::

    m du/dt = F (e_P + e_S) - A u|u| - B u        I dr/dt = F (e_P - e_S) b/2 - TA r|r| - TB r

F, b and the thrust astern are the card's. A and B follow its steady speeds, TA and TB its steady rates of turn in spins
and in turns by a difference, by least squares that keep them positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.programs.bridge_command_surge import SurgeNumbers
from tank2sim.apps.programs.program_files import FigureChange
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.small_craft import cruising_revolutions
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.run import simulate
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun

_SHARES = (1.0, 0.7, 0.4)
"""Revolutions of straight runs and spins over the largest, and differences over twice what is left beyond the cruising
revolutions: the whole range (project choice)."""


@dataclass(frozen=True)
class CraftNumbers:
    """Numbers of ``boat.ini`` of a craft, and figures by the card and by Bridge Command."""

    surge: SurgeNumbers
    spacing_m: float
    turn_A: float
    turn_B: float
    inertia_kgm2: float
    largest_radps: float
    changes: tuple[FigureChange, ...] = ()

    @property
    def keys(self) -> dict[str, float]:
        """Keys of ``boat.ini``."""
        return {
            **self.surge.keys,
            "Inertia": self.inertia_kgm2,
            "Max_propulsion_force": self.surge.thrust_N / 2,
            "PropSpace": self.spacing_m,
            "MaxRevs": self.largest_radps * 60 / math.tau,
            "DynamicsTurnDragA": self.turn_A,
            "DynamicsTurnDragB": self.turn_B,
        }

    def rate(self, moment_Nm: float) -> float:
        """Steady rate of turn (rad/s) at a moment that is positive."""
        root = math.sqrt(self.turn_B**2 + 4 * self.turn_A * moment_Nm) + self.turn_B
        return 2 * moment_Nm / root if root else math.inf


def craft_numbers(card: SteeredCard, model: Model) -> CraftNumbers:
    """The numbers of a craft that follow its straight runs, spins and turns best.

    Raises InputError: Its thrusters are not two fixed ones of a size, one at either side, that push ahead.
    """
    spacing, thruster = _spacing(card), card.thrusters[0]
    most, least, force = thruster.max_radps, -thruster.lowest_radps, thruster.largest_thrust_N
    astern = max(1e-6, thruster.astern_Ns2 * least**2 / force)  # 0 would mean as much as ahead
    mass = card.rigid_body.mass - card.derivatives.get("Xudot", 0.0)
    inertia = card.rigid_body.yaw_inertia - card.derivatives.get("Nrdot", 0.0)
    cruise = cruising_revolutions(card)
    straight = {share * most: _figures(model, StraightRun(share * most)) for share in _SHARES}
    spins = {share * min(most, least): _figures(model, Spin(share * min(most, least))) for share in _SHARES}
    left = 1.9 * min(most - cruise, cruise + least)  # nearly all, for rounding
    turns = {share * left: _figures(model, DifferenceTurn(share * left)) for share in _SHARES}

    def lever(revolutions: float) -> float:
        return math.copysign((revolutions / most) ** 2, revolutions)

    def moment(port: float, starboard: float) -> float:
        return force * (port - starboard) * spacing / 2

    A, B = _drag([(2 * force * lever(n), found["final_speed_mps"]) for n, found in straight.items()])
    spun = {n: moment(lever(n), -thruster.astern_Ns2 / thruster.ahead_Ns2 * lever(n)) for n in spins}
    ends = {d: (lever(cruise + d / 2), lever(cruise - d / 2)) for d in turns}
    turning = [(spun[n], found.get("final_rate_degps")) for n, found in spins.items()]
    turning += [(moment(*ends[d]), found.get("steady_rate_degps")) for d, found in turns.items()]
    rates = [(turned, math.radians(abs(rate))) for turned, rate in turning if rate]
    if not rates:
        raise card.fault("thrusters", "turn the craft in no spin and no turn", "check the card with simulate")
    made = CraftNumbers(SurgeNumbers(A, B, 2 * force, astern, mass), spacing, *_drag(rates), inertia, most)
    changes = []
    for n, found in straight.items():
        speed = made.surge.speed(lever(n))
        time, way = made.surge.run(lever(n), 0.0, 0.9 * speed)
        after = {"final_speed_mps": speed, "time_to_90_percent_s": time, "distance_to_90_percent_m": way}
        changes += _compared(StraightRun(n).words, found, after)
    for n, found in spins.items():
        changes += _compared(Spin(n).words, found, {"final_rate_degps": math.degrees(made.rate(spun[n]))})
    for d, found in turns.items():
        rate, speed = made.rate(moment(*ends[d])), made.surge.speed(sum(ends[d]) / 2)
        after = {"steady_rate_degps": math.degrees(rate), "steady_diameter_m": 2 * speed / rate}
        changes += _compared(DifferenceTurn(d).words, found, after)
    return replace(made, changes=tuple(changes))


def _spacing(card: SteeredCard) -> float:
    """Distance between two alike, fixed thrusters at either side, m; others are refused."""
    first, last = card.thrusters[0], card.thrusters[-1]
    alike = all(getattr(first, key) == getattr(last, key) for key in ("ahead_Ns2", "astern_Ns2", "max_radps", "x_m"))
    fixed = all(one.azimuth_rad == 0 and one.max_azimuth_rad is None for one in (first, last))
    if len(card.thrusters) != 2 or not alike or not fixed or not first.y_m or first.y_m != -last.y_m:
        problem = "are not two alike that push ahead, one at either side, as the engines of Bridge Command are"
        raise card.fault("thrusters", problem, "export an FMU, or convert the card --to gazebo")
    return 2 * abs(first.y_m)


def _figures(model: Model, manoeuvre: StraightRun | Spin | DifferenceTurn) -> dict[str, float]:
    """Figures of a manoeuvre; none of one that the craft cannot do."""
    try:
        return single_figures(simulate(model, manoeuvre).figures)
    except InputError:
        return {}


def _drag(points: list[tuple[float, float]]) -> tuple[float, float]:
    """Quadratic and linear coefficient, not negative, by forces (or moments) and steady speeds (or rates)."""
    from scipy.optimize import nnls  # slow to import

    forces, speeds = np.array(points).T
    rows: Array = np.column_stack([speeds**2, speeds]) / forces[:, None]
    scale = np.linalg.norm(rows, axis=0)
    found = nnls(rows / scale, np.ones(len(forces)))[0] / scale
    return float(found[0]), float(found[1])


def _compared(words: str, before: dict[str, float], after: dict[str, float]) -> list[FigureChange]:
    return [FigureChange(words, name, before[name], value) for name, value in after.items() if name in before]
