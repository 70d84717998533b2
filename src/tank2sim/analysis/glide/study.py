"""All that is asked of a glider at once: steady glides, paths, what is best, and the transient model next to them."""

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
    """What is asked.

    Parameters
    ----------
    angles_rad : tuple of float
        Paths of steady glides, + up, which all have `roll_rad` and a net buoyancy of the size `buoyancy_kg` (by default
        the card's).
    programme : GlideProgramme, optional
        To be flown, by the steady glides and by the transient model.
    as_printed : bool
        True for the paper's own equations next to the corrected ones.
    budget_kg, depth_m : float, optional
        Ballast that can be pushed out, and the depth from which: how far does it carry? Both or neither.
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
    """What was found; tuples next to `glides` are parallel to it.

    Parameters
    ----------
    best, fastest : SteadyGlide
        Dives with the card's buoyancy: the shallowest, and the one with the greatest speed over the ground.
    glides, printed : tuples of SteadyGlide
        At the angles asked for; `printed` is empty unless asked for.
    radii_m : tuple of float
        Turning radius of the transient model, which has the added mass.
    path, printed_path, compared
        Of the programme; None without.
    ranges : tuple of Range
        Of best and fastest glide and the glides asked for that do not turn.
    polar : tuple of SteadyGlide
    errors, swings
        Empty unless views were asked for.
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
        """The smallest angle that can be flown without roll."""
        return abs(self.best.path_angle_rad)

    def as_json(self) -> dict[str, object]:
        """As JSON has it. ``states`` has the glides at the angles asked for, then those of the programme's steps."""
        states = [
            {**glide.as_json(), "turning_radius_with_added_mass_m": radius if math.isfinite(radius) else None}
            | {"ballast_kg": ballast_kg(self.card, glide.buoyancy_kg)}
            | {"force_residual_N": force_residual(self.card, glide)}
            for glide, radius in zip(self.glides, self.radii_m, strict=True)
        ]
        result: dict[str, object] = {"glider": self.card.ship.name, "states": states}
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


def study(card: GliderCard, asked: GlideQuestion) -> GlideStudy:
    """Answer what is asked.

    Raises
    ------
    InputError
        An angle or a step cannot be flown, or budget and depth are not both given.
    """
    model = build(card)
    glides = tuple(_glides(card, asked))
    printed = tuple(_glides(card, asked, as_printed=True)) if asked.as_printed else ()
    path = fly(card, asked.programme) if asked.programme else None
    printed_path = fly(card, asked.programme, as_printed=True) if asked.programme and asked.as_printed else None
    integrator = Integrator(model) if path or asked.views else None
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
        ranges=tuple(_ranges(card, asked, (best, fastest, *glides))),
        polar=glide_polar(card),
        errors=quasi_steady_error(card, integrator) if asked.views and integrator else (),
        swings=swing_errors(card, integrator) if asked.views and integrator else (),
        notices=(*model.notices, *([NO_COMPILER] if integrator and not integrator.compiled else [])),
    )


def _glides(card: GliderCard, asked: GlideQuestion, *, as_printed: bool = False) -> list[SteadyGlide]:
    equations = glide_as_printed if as_printed else steady_glide
    found = []
    for angle in asked.angles_rad:
        size = asked.buoyancy_kg
        buoyancy = None if size is None else math.copysign(size, angle)
        found.append(equations(card, angle, roll_rad=asked.roll_rad, buoyancy_kg=buoyancy))
    return found


def _radius(model: Model, glide: SteadyGlide) -> float:
    """Turning radius of the transient model, m; inf where the glide does not turn."""
    return equilibrium(model, glide).turning_radius_m if glide.turn_rate_radps else math.inf


def _ranges(card: GliderCard, asked: GlideQuestion, glides: tuple[SteadyGlide, ...]) -> list[Range]:
    budget, depth = asked.budget_kg, asked.depth_m
    if budget is None and depth is None:
        return []
    if budget is None or depth is None:
        missing = "--budget-kg" if budget is None else "--depth-m"
        raise InputError(missing, "", "is missing", "a range needs the ballast to push out and the depth")
    return [glide_range(card, glide, budget_kg=budget, depth_m=depth) for glide in glides if not glide.turn_rate_radps]
