"""Study of a glider: steady glides, paths, best glides, and comparison with the transient model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.analysis.glide.path import GlidePath, fly
from tank2sim.analysis.glide.quasi_steady_error import SwingError, swing_errors
from tank2sim.analysis.glide.steady import (
    SteadyGlide,
    ballast_kg,
    force_residual,
    glide_as_printed,
    smallest_angle,
    steady_glide,
)
from tank2sim.analysis.glide.transient import (
    Compared,
    ProgrammeError,
    compare_with_steady,
    equilibrium,
    quasi_steady_error,
)
from tank2sim.cards.card import GliderCard
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.glide_programme import GlideProgramme
from tank2sim.simulation.integrator import NO_COMPILER, Integrator

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
        Path angle, buoyancy and speed of its dives and climbs, without sign.
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


@dataclass(frozen=True, kw_only=True)
class GlideQuestion:
    """Settings of the study.

    Parameters
    ----------
    angles_rad : tuple of float
        Paths of steady glides, + up, which all have `roll_rad` and a net buoyancy of the size `buoyancy_kg` (by default
        the card's).
    programme : GlideProgramme, optional
        To be flown, by the steady glides and by the transient model.
    as_printed : bool
        True for the paper's equations in addition to the corrected ones.
    budget_kg, depth_m : float, optional
        Ballast that can be expelled, and the depth of the dives, for the range. Both or neither.
    views : bool
        True for the polar and the error of the quasi-steady assumption against the speed of a programme.
    """

    angles_rad: tuple[float, ...] = ()
    roll_rad: float = 0.0
    buoyancy_kg: float | None = None
    programme: GlideProgramme | None = None
    as_printed: bool = False
    budget_kg: float | None = None
    depth_m: float | None = None
    views: bool = False


@dataclass(frozen=True, kw_only=True)
class GlideStudy:
    """Result of a study; tuples parallel to `glides` have its length.

    Parameters
    ----------
    best, fastest : SteadyGlide
        Dives with the card's buoyancy: the shallowest, and that of greatest speed over the ground.
    glides, printed : tuples of SteadyGlide
        At the requested angles; `printed` only on request.
    radii_m : tuple of float
        Turning radius of the transient model, which has the added mass.
    path, printed_path, compared
        Results of the programme; None without one.
    ranges : tuple of Range
        Ranges of the best and the fastest glide and the requested glides that do not turn.
    polar : tuple of SteadyGlide
    errors, swings
        Empty unless views were requested.
    """

    card: GliderCard
    best: SteadyGlide
    fastest: SteadyGlide
    glides: tuple[SteadyGlide, ...]
    radii_m: tuple[float, ...]
    printed: tuple[SteadyGlide, ...] = ()
    path: GlidePath | None = None
    printed_path: GlidePath | None = None
    compared: Compared | None = None
    ranges: tuple[Range, ...] = ()
    polar: tuple[SteadyGlide, ...] = ()
    errors: tuple[ProgrammeError, ...] = ()
    swings: tuple[SwingError, ...] = ()
    notices: tuple[str, ...] = field(default=())

    @property
    def smallest_angle_rad(self) -> float:
        """The smallest angle of flight without roll."""
        return abs(self.best.path_angle_rad)

    def as_json(self) -> dict[str, object]:
        """The JSON form. ``states`` has the glides at the requested angles, then those of the programme's steps."""
        states = [
            {**glide.as_json(), "turning_radius_with_added_mass_m": radius if math.isfinite(radius) else None}
            | {"ballast_kg": ballast_kg(self.card, glide.buoyancy_kg)}
            | {"force_residual_N": force_residual(self.card, glide)}
            for glide, radius in zip(self.glides, self.radii_m, strict=True)
        ]
        result: dict[str, object] = {
            "glider": self.card.ship.name,
            "source": self.card.ship.source,
            "buoyancy_kg": self.card.glider.buoyancy_kg,
            "states": states,
        }
        result["design"] = {
            "smallest_angle_deg": math.degrees(self.smallest_angle_rad),
            "best_glide": self.best.as_json(),
            "fastest_glide": self.fastest.as_json(),
            "ranges": [row.as_json() for row in self.ranges],
        }
        names = ("path_angle_deg", "horizontal_speed_mps", "climb_mps")
        polar = [row.as_json() for row in self.polar]
        result["polar"] = {name: [row[name] for row in polar] for name in names}
        if self.printed:
            result["as_printed"] = [
                {**glide.as_json(), "force_residual_N": force_residual(self.card, glide)} for glide in self.printed
            ]
        if self.path:
            result["states"] = [*states, *self.path.states_as_json()]
            result |= {"path": self.path.as_json(), "length_m": self.path.length_m}
            result |= {"path_histories": self.path.histories()}
        if self.printed_path:
            result["path_as_printed"] = self.printed_path.as_json()
            result["path_as_printed_histories"] = self.printed_path.histories()
        if self.compared:
            result["transient"] = self.compared.as_json()
        if self.errors:
            steps, swings = ([row.as_json() for row in found] for found in (self.errors, self.swings))
            result["quasi_steady_error"] = {"steps": steps, "swings": swings}
        return result | {"notices": list(self.notices)}


def study(card: GliderCard, question: GlideQuestion) -> GlideStudy:
    """Run the study.

    Raises
    ------
    InputError
        An angle or a step cannot be flown, or budget and depth are not both given.
    """
    model = build(card)
    glides = tuple(_glides(card, question))
    printed = tuple(_glides(card, question, as_printed=True)) if question.as_printed else ()
    path = fly(card, question.programme) if question.programme else None
    printed_path = (
        fly(card, question.programme, as_printed=True) if question.programme and question.as_printed else None
    )
    integrator = Integrator(model) if path or question.views else None
    best, fastest = best_glide(card), fastest_glide(card)
    return GlideStudy(
        card=card,
        best=best,
        fastest=fastest,
        glides=glides,
        radii_m=tuple(_radius(model, glide) for glide in glides),
        printed=printed,
        path=path,
        printed_path=printed_path,
        compared=compare_with_steady(integrator, path) if path and integrator else None,
        ranges=tuple(_ranges(card, question, (best, fastest, *glides))),
        polar=glide_polar(card),
        errors=quasi_steady_error(card, integrator) if question.views and integrator else (),
        swings=swing_errors(card, integrator) if question.views and integrator else (),
        notices=(*model.notices, *([NO_COMPILER] if integrator and not integrator.compiled else [])),
    )


def _glides(card: GliderCard, question: GlideQuestion, *, as_printed: bool = False) -> list[SteadyGlide]:
    equations = glide_as_printed if as_printed else steady_glide
    found = []
    for angle in question.angles_rad:
        size = question.buoyancy_kg
        buoyancy = None if size is None else math.copysign(size, angle)
        found.append(equations(card, angle, roll_rad=question.roll_rad, buoyancy_kg=buoyancy))
    return found


def _radius(model: Model, glide: SteadyGlide) -> float:
    """Turning radius of the transient model, m; inf where the glide does not turn."""
    return equilibrium(model, glide).turning_radius_m if glide.turn_rate_radps else math.inf


def _ranges(card: GliderCard, question: GlideQuestion, glides: tuple[SteadyGlide, ...]) -> list[Range]:
    budget, depth = question.budget_kg, question.depth_m
    if budget is None and depth is None:
        return []
    if budget is None or depth is None:
        missing = "--budget-kg" if budget is None else "--depth-m"
        raise InputError(missing, "", "is missing", "a range needs the ballast to push out and the depth")
    return [glide_range(card, glide, budget_kg=budget, depth_m=depth) for glide in glides if not glide.turn_rate_radps]
