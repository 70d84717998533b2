"""Study of a glider: steady glides, paths, best glides, and comparison with the transient model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tank2sim.analysis.glide.design import Range, best_glide, fastest_glide, glide_polar, glide_range
from tank2sim.analysis.glide.path import GlidePath, fly
from tank2sim.analysis.glide.quasi_steady_error import SwingError, swing_errors
from tank2sim.analysis.glide.steady import SteadyGlide, ballast_kg, force_residual, glide_as_printed, steady_glide
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
        Of the programme; None without.
    ranges : tuple of Range
        Of the best and the fastest glide and the requested glides that do not turn.
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
