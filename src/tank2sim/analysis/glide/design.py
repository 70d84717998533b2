"""Design of a glider: its polar, the best and the fastest glide, the range of a buoyancy budget."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.analysis.glide.steady import SteadyGlide, smallest_angle, steady_glide
from tank2sim.cards.card import GliderCard
from tank2sim.errors import InputError

_STEEPEST = math.radians(89.5)


def glide_polar(
    card: GliderCard, *, roll_rad: float = 0.0, buoyancy_kg: float | None = None, points: int = 200
) -> tuple[SteadyGlide, ...]:
    """Dives from the smallest angle to almost straight down; `buoyancy_kg` is a magnitude, by default the card's."""
    least = smallest_angle(card, roll_rad)
    # Closer where the path is shallow: speed and incidence change there as the root of the angle above the smallest.
    angles = least + (_STEEPEST - least) * np.linspace(0, 1, points) ** 2
    size = card.glider.buoyancy_kg if buoyancy_kg is None else abs(buoyancy_kg)
    return tuple(steady_glide(card, -angle, roll_rad=roll_rad, buoyancy_kg=-size) for angle in angles.tolist())


def best_glide(card: GliderCard, *, buoyancy_kg: float | None = None) -> SteadyGlide:
    """The dive of largest range for its depth: the smallest angle, at the greatest ratio of lift to drag."""
    size = card.glider.buoyancy_kg if buoyancy_kg is None else abs(buoyancy_kg)
    return steady_glide(card, -smallest_angle(card), buoyancy_kg=-size)


def fastest_glide(card: GliderCard, *, buoyancy_kg: float | None = None) -> SteadyGlide:
    """The dive with the greatest speed over the ground, v cos(epsilon). Its angle does not depend on the buoyancy."""
    size = card.glider.buoyancy_kg if buoyancy_kg is None else abs(buoyancy_kg)
    found = minimize_scalar(
        lambda angle: -steady_glide(card, -angle).horizontal_speed_mps,
        bounds=(smallest_angle(card), _STEEPEST),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return steady_glide(card, -float(found.x), buoyancy_kg=-size)


@dataclass(frozen=True, kw_only=True)
class Range:
    """Range of a glider with a budget of ballast water that it can expel.

    Parameters
    ----------
    path_angle_rad, buoyancy_kg, speed_mps : float
        Of its dives and climbs, without sign.
    depth_m : float
        Depth of the dives and climbs.
    budget_kg : float
        Total ballast that the pump can expel.
    cycles : float
        Number of dives with their climbs; each takes in 2 |m0| at the surface and expels it at depth.
    range_m, duration_s : float
        Over the ground; turning points take neither time nor distance.
    energy_J : float
        Work of expelling the budget against the pressure at depth, budget g h, without losses.
    """

    path_angle_rad: float
    buoyancy_kg: float
    speed_mps: float
    depth_m: float
    budget_kg: float
    cycles: float
    range_m: float
    duration_s: float
    energy_J: float

    def as_json(self) -> dict[str, object]:
        """The JSON form; the angle in degrees."""
        values = {name: value for name, value in vars(self).items() if name != "path_angle_rad"}
        return {"path_angle_deg": math.degrees(self.path_angle_rad), **values}


def glide_range(card: GliderCard, glide: SteadyGlide, *, budget_kg: float, depth_m: float) -> Range:
    """The range of dives and climbs at the angle and net buoyancy of a glide.

    Raises
    ------
    InputError
        Budget or depth is not positive, or the glide has no buoyancy or turns.
    """
    for name, value in (("--budget-kg", budget_kg), ("--depth-m", depth_m)):
        if not 0 < value < math.inf:
            raise InputError(name, "", f"is {value:g}", "a positive number was expected")
    if not glide.buoyancy_kg or glide.turn_rate_radps:
        raise InputError(card.source, "range", "a glide without buoyancy or with roll has no range", "give another")
    size, steep = abs(glide.buoyancy_kg), abs(glide.path_angle_rad)
    cycles = budget_kg / (2 * size)
    return Range(
        path_angle_rad=steep,
        buoyancy_kg=size,
        speed_mps=glide.speed_mps,
        depth_m=depth_m,
        budget_kg=budget_kg,
        cycles=cycles,
        range_m=cycles * 2 * depth_m / math.tan(steep),
        duration_s=cycles * 2 * depth_m / abs(glide.climb_mps),
        energy_J=budget_kg * card.environment.gravity_mps2 * depth_m,
    )
