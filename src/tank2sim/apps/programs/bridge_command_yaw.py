"""Yaw of an own ship of Bridge Command 5.11, fitted to turns and zigzags of a card.

As the source of version 5.11 has it (no program was run), on a quiet sea::

    I dr/dt = d (RA u + RB T) + W - TA r|r| - TB r

with the rudder d (deg) at a constant rate, the thrust T, and the propeller's walk W. No term couples it with surge: a
ship turns without drift and keeps its speed. The fit follows the paths of turns, and not their times.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from tank2sim.apps.programs.bridge_command_surge import SurgeNumbers, full_ahead_order
from tank2sim.apps.programs.program_files import value_at
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

LARGEST_RUDDER_DEG = 30.0
"""Largest rudder angle in Bridge Command, fixed in its source."""

COURSE_FIGURES = {"advance_m": 1.0, "tactical_diameter_m": 1.0, "overshoot_1_deg": 0.1, "time_180_s": 0.0}
"""Figures of turns and zigzags, and their weights in the fit: paths come first (project choice)."""

_TURNS_DEG, _ZIGZAGS_DEG, _HALF_TURN_DEG = (10.0, 20.0, LARGEST_RUDDER_DEG), (10.0, 20.0), 20.0

_SHARE, _SHARE_WEIGHT, _ASTERN_RUDDER = 0.5, 0.2, 0.2
"""Share of the rudder's moment that a stopped engine leaves, of a card without an engine; weight of that share in the
fit; RudderBAstern over RudderB, in the stream of a propeller that turns astern (project choices)."""


@dataclass(frozen=True)
class YawNumbers:
    """Numbers of yaw over the inertia, of m ships."""

    # `rudder`, `quadratic`, `linear`, `share`: (m, 1): Moment of the rudder at full ahead, 1/(deg s2); TA, 1/rad; TB,
    # 1/s; share of that moment which goes with the speed (RA)
    rudder: Array
    quadratic: Array
    linear: Array
    share: Array
    neutral_deg: float  # Rudder of a straight course, deg to starboard

    def keys(self, inertia_kgm2: float, surge: SurgeNumbers) -> dict[str, float]:
        """Keys of ``boat.ini`` of a single ship, with its inertia in yaw."""
        rudder, quadratic, linear = (
            inertia_kgm2 * value.item() for value in (self.rudder, self.quadratic, self.linear)
        )
        by_thrust = rudder * (1 - self.share.item()) / surge.thrust_N
        return {
            "Inertia": inertia_kgm2,
            "DynamicsTurnDragA": quadratic,
            "DynamicsTurnDragB": linear,
            "RudderA": rudder * self.share.item() / surge.speed(1.0),
            "RudderB": by_thrust,
            "RudderBAstern": _ASTERN_RUDDER * by_thrust,
            "PropWalkAhead": -rudder * self.neutral_deg / 2,
        }


@dataclass(frozen=True)
class Course:
    """A turn or zigzag in Bridge Command: lever, speed, rudder (deg), heading of a zigzag (rad; infinite: a turn)."""

    manoeuvre: str
    lever: float
    speed_mps: float
    rudder_deg: float
    switch_rad: float = math.inf


def sailed(yaw: YawNumbers, courses: Sequence[Course], gear_degps: float, full_mps: float, step_s: float) -> Array:
    """The :data:`COURSE_FIGURES` of n courses of m ships, (4, m, n), in the program's order of steps; nan if not seen.

    `gear_degps`, `full_mps`: Rate of the rudder (deg/s), speed at full ahead.
    """
    names = ("lever", "speed_mps", "rudder_deg", "switch_rad")
    lever, speed, order, switch = (np.array([getattr(course, name) for course in courses]) for name in names)
    effect = yaw.rudder * (yaw.share * speed / full_mps + (1 - yaw.share) * lever)
    walk = -yaw.rudder * yaw.neutral_deg * lever
    side, shape = np.sign(order), effect.shape
    r, psi, x, y, rudder, highest, flips = (np.zeros(shape) for _ in range(7))
    found, way, most = np.full((4, *shape), np.nan), np.ones(shape), gear_degps * step_s
    for step in range(6000):
        r = r + step_s * (effect * rudder + walk - yaw.quadratic * r * np.abs(r) - yaw.linear * r)
        before, psi = psi, psi + step_s * r
        rudder = rudder + np.clip(way * order - rudder, -most, most)
        ahead, across = step_s * speed * np.cos(psi), side * step_s * speed * np.sin(psi)
        for row, level, place, gone in ((0, math.pi / 2, x, ahead), (1, math.pi, y, across)):
            now = (side * psi >= level) & np.isnan(found[row])
            if now.any():
                part = (level - side * before)[now] / (side * (psi - before))[now]
                found[row][now] = place[now] + part * gone[now]
                found[3][now] = (step + part) * step_s
        x, y = x + ahead, y + across
        highest = np.where(flips == 1, np.maximum(highest, side * psi), highest)
        turned = way * side * psi >= switch
        way, flips = np.where(turned, -way, way), flips + turned
        if np.where(np.isinf(switch), ~np.isnan(found[1]), flips > 1).all():
            break
    zigzags = np.isfinite(switch)
    found[:, :, zigzags] = np.nan
    found[2][:, zigzags] = np.where(flips > 1, np.degrees(highest - np.where(zigzags, switch, 0.0)), np.nan)[:, zigzags]
    found[3] = np.where(np.isnan(found[1]), np.nan, found[3])
    return found


def heading_astern(yaw: YawNumbers, moment: float, time_s: float) -> float:
    """Change of heading (rad) from a straight course.

    `yaw`: Of one ship; `moment`: Constant moment over the inertia, 1/s2, positive to starboard.
    """
    r = psi = 0.0
    step_s = time_s / 2000
    for _ in range(2000):
        r += step_s * (moment - yaw.quadratic.item() * r * abs(r) - yaw.linear.item() * r)
        psi += step_s * r
    return psi


def moment_astern(yaw: YawNumbers, heading_rad: float, time_s: float) -> float:
    """The constant moment over the inertia (1/s2) that changes the heading so far while the ship stops."""
    from scipy.optimize import brentq

    if not heading_rad:
        return 0.0
    most = 2 * abs(heading_rad) / time_s**2
    while heading_astern(yaw, most, time_s) < abs(heading_rad):
        most *= 4
    found = brentq(lambda moment: heading_astern(yaw, moment, time_s) - abs(heading_rad), 0.0, most, rtol=1e-6)
    return math.copysign(float(found), heading_rad)


def courses_of_card(model: Model, half_mps: float, slow_mps: float | None) -> tuple[list[Course], Array]:
    """Turns and zigzags, and their figures by the card, (4, n).

    `half_mps`, `slow_mps`: Speed at half thrust in Bridge Command and of the card (None without an engine).
    """
    values, asked = model.defaults, []
    largest = min(LARGEST_RUDDER_DEG, math.degrees(values.get("steering.max_angle", math.pi)))
    for angle, side in product(_TURNS_DEG, (1, -1)):
        if angle <= largest + 1e-9:
            turn = Turn(math.radians(side * angle))
            asked.append((Course(turn.words, 1.0, values["ship.speed"], side * angle), simulate(model, turn)))
    for angle, side in product(_ZIGZAGS_DEG, (1, -1)):
        zigzag = Zigzag(math.radians(side * angle), math.radians(angle))
        course = Course(zigzag.words, 1.0, values["ship.speed"], side * angle, math.radians(angle))
        asked.append((course, simulate(model, zigzag)))
    nominal = full_ahead_order(model)
    if nominal is not None and slow_mps is not None:
        for side in (1, -1):
            turn = Turn(math.radians(side * _HALF_TURN_DEG))
            orders = {"propeller.speed": nominal * math.sqrt(0.5)}
            run = simulate(model, turn, inputs=orders, parameters={"initial.u": slow_mps})
            asked.append((Course(f"{turn.words} at half thrust", 0.5, half_mps, side * _HALF_TURN_DEG), run))
    found = [[single_figures(run.figures).get(name, math.nan) for _, run in asked] for name in COURSE_FIGURES]
    return [course for course, _ in asked], np.array(found)


def fitted_yaw(
    model: Model, courses: Sequence[Course], wanted: Array, gear_degps: float, neutral_deg: float
) -> YawNumbers:
    """The numbers of yaw that follow the paths of the card's turns best.

    `courses`, `wanted`: As of :func:`courses_of_card`; `gear_degps`, `neutral_deg`: Rate of the rudder; rudder of a
    straight course, to starboard.
    """
    from scipy.optimize import least_squares

    values = model.defaults
    full, shown = values["ship.speed"], ~np.isnan(wanted)
    ship_time, share = values["ship.length"] / full, _share_of_card(model, full)

    def yaw(numbers: Array) -> YawNumbers:
        rudder, quadratic, linear = np.exp(numbers[:, :3, None]).swapaxes(0, 1)
        return YawNumbers(rudder / ship_time**2, quadratic, linear / ship_time, numbers[:, 3, None], neutral_deg)

    def residuals(numbers: Array) -> Array:
        """Shape (m, k) for numbers (m, 4)."""
        found = sailed(yaw(numbers), courses, gear_degps, full, 0.03 * ship_time)
        parts = [
            weight * np.log(np.where(found[row] > 0, found[row], 100 * wanted[row]) / wanted[row])[:, shown[row]]
            for row, weight in enumerate(COURSE_FIGURES.values())
        ]
        return np.hstack([*parts, 1e-3 * numbers[:, :3], _SHARE_WEIGHT * (numbers[:, 3:] - share)])

    def slopes(numbers: Array) -> Array:
        found = residuals(np.vstack([numbers, numbers + 1e-4 * np.eye(4)]))
        return np.asarray((found[1:] - found[0]).T / 1e-4)

    start = [math.log(0.02), 0.0, 0.0, min(0.99, max(0.01, share))]
    bounds = ([-9, -6, -6, 0], [3, 6, 4, 1])
    fit = least_squares(lambda numbers: residuals(numbers[None])[0], start, jac=slopes, bounds=bounds)
    return yaw(fit.x[None])


def _share_of_card(model: Model, speed: float) -> float:
    """Share of the rudder's moment at full ahead that is left with a stopped engine."""
    if full_ahead_order(model) is None:
        return _SHARE
    sides = [{"motion.u": speed, "rudder.angle": math.radians(angle)} for angle in (5.0, -5.0)]
    ahead, stopped = (
        force_at(model, "force.N", sides[0], orders) - force_at(model, "force.N", sides[1], orders)
        for orders in ({}, {"propeller.speed": 0.0})
    )
    return min(1.0, max(0.0, stopped / ahead)) if ahead else _SHARE


def force_at(model: Model, name: str, motion: Mapping[str, float], orders: Mapping[str, float] | None = None) -> float:
    """A force of a card (N, N m) at a motion, which is zero where it is not given, with other `orders` (inputs)."""
    still = {name: 0.0 for name in ("motion.u", "motion.v", "motion.r", "rudder.angle") if name in model.state_names}
    return value_at(model, name, still | dict(motion), orders)
