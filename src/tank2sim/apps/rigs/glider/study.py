"""Study of a glider: steady glides, paths, best glides, and comparison with the transient model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.path import GlidePath, GlideProgramme, fly
from tank2sim.apps.rigs.glider.steady import (
    SteadyGlide,
    ballast_kg,
    force_residual,
    glide_as_printed,
    smallest_angle,
    steady_glide,
)
from tank2sim.apps.rigs.glider.transient import (
    Compared,
    ProgrammeError,
    SwingError,
    compare_with_steady,
    equilibrium,
    quasi_steady_error,
    swing_errors,
)
from tank2sim.arrays import Array, Columns, Number, Unbounded
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice
from tank2sim.simulation.integrator import NO_COMPILER, Integrator

_STEEPEST = math.radians(89.5)


def glide_polar(card: GliderCard) -> tuple[SteadyGlide, ...]:
    """Dives with the card's buoyancy from the smallest angle to almost straight down."""
    least = smallest_angle(card)
    # Closer where the path is shallow: speed and incidence change there as the root of the angle above the smallest.
    angles = least + (_STEEPEST - least) * np.linspace(0, 1, 200) ** 2
    return tuple(steady_glide(card, -angle) for angle in angles.tolist())


def best_glide(card: GliderCard) -> SteadyGlide:
    """The dive of largest range for its depth: the smallest angle, at the greatest ratio of lift to drag."""
    return steady_glide(card, -smallest_angle(card))


def fastest_glide(card: GliderCard) -> SteadyGlide:
    """The dive with the greatest speed over the ground, v cos(epsilon). Its angle does not depend on the buoyancy."""
    found = minimize_scalar(
        lambda angle: -steady_glide(card, -angle).horizontal_speed_mps,
        bounds=(smallest_angle(card), _STEEPEST),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return steady_glide(card, -float(found.x))


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

    path_angle_deg: float
    buoyancy_kg: float
    speed_mps: float
    depth_m: float
    budget_kg: float
    cycles: float
    range_m: float
    duration_s: float
    energy_J: float


def glide_range(card: GliderCard, glide: SteadyGlide, *, budget_kg: float, depth_m: float) -> Range:
    """The range of dives and climbs at the angle and net buoyancy of a glide.

    InputError if the glide has no buoyancy or turns.
    """
    if not glide.buoyancy_kg or glide.turn_rate_radps:
        raise card.fault("range", "a glide without buoyancy or with roll has no range", "give another")
    size, steep = abs(glide.buoyancy_kg), abs(glide.path_angle_rad)
    cycles = budget_kg / (2 * size)
    return Range(
        path_angle_deg=math.degrees(steep),
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

    Steady glides are on the paths `angles_rad`, + up, with `roll_rad` and a net buoyancy of the size `buoyancy_kg`, by
    default the card's. The programme is flown by the steady glides and by the transient model; `as_printed` adds the
    paper's equations. Ballast that can be expelled and depth of the dives, for the range: both or neither. With `views`
    also the polar and the error of the quasi-steady assumption against the speed of a programme.
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
class GlideState:
    """A steady glide.

    Parameters
    ----------
    path_angle_deg, pitch_deg : float
        + up.
    incidence_deg : float
        + when the flow comes from below.
    roll_deg : float
        + starboard side down.
    buoyancy_kg : float
        Net buoyancy, + light.
    speed_mps, horizontal_speed_mps, climb_mps : float
        Along the path, over the ground, and + up.
    lift_coefficient, drag_coefficient, lift_N, drag_N : float
        The lift has the sign of the incidence.
    turning_radius_m : float
        Without sign; infinite without roll.
    turn_rate_degps : float
        + to starboard.
    as_printed : bool
        Whether it is by the equations as printed in the paper.
    """

    path_angle_deg: float
    pitch_deg: float
    incidence_deg: float
    roll_deg: float
    buoyancy_kg: float
    speed_mps: float
    horizontal_speed_mps: float
    climb_mps: float
    lift_coefficient: float
    drag_coefficient: float
    lift_N: float
    drag_N: float
    turning_radius_m: Unbounded
    turn_rate_degps: float
    as_printed: bool

    @classmethod
    def of(cls, glide: SteadyGlide, **more: Any) -> Self:
        """The glide in degrees, with `more` fields of a subclass."""
        return cls(**{part.name: _field(glide, part.name) for part in fields(GlideState)}, **more)


@dataclass(frozen=True, kw_only=True)
class BalancedGlide(GlideState):
    """A steady glide, and the force (N) by which lift and drag of (6) and (7) are off balance in it."""

    force_residual_N: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class AngleGlide(BalancedGlide):
    """A steady glide at an angle that was given.

    Parameters
    ----------
    turning_radius_with_added_mass_m : float
        Turning radius of the transient model, which has the added mass; infinite without roll.
    ballast_kg : float, optional
        Ballast that gives the net buoyancy; None if the card does not state the mass of the hull.
    """

    turning_radius_with_added_mass_m: Unbounded
    ballast_kg: float | None


@dataclass(frozen=True, kw_only=True)
class StepGlide(GlideState):
    """The steady glide of a step of a programme."""

    duration_s: float


@dataclass(frozen=True, kw_only=True)
class GlideDesign:
    """Dives with the card's buoyancy: the shallowest, the fastest over the ground, and ranges on a budget of ballast.

    Ranges are of these two and of the given glides that do not turn.
    """

    smallest_angle_deg: float
    best_glide: GlideState
    fastest_glide: GlideState
    ranges: tuple[Range, ...]


@dataclass(frozen=True)
class PathPlace:
    """A place of a path: north, east, height, and heading clockwise from north."""

    t_s: float
    x_m: float
    y_m: float
    height_m: float
    heading_deg: float


@dataclass(frozen=True)
class TransientPlace:
    """A place of the transient motion: north, east, depth; and its speed."""

    t_s: float
    x_m: float
    y_m: float
    depth_m: float
    speed_mps: float


@dataclass(frozen=True, eq=False, kw_only=True)
class TransientPath:
    """A programme flown by the transient model.

    Parameters
    ----------
    path : tuple of TransientPlace
        At the start and at the ends of the steps.
    distance_m : array (steps + 1,)
        Distance from the path of steady glides there.
    distance_by_length : float
        The largest distance, as a share of the length of the path.
    histories, orders : dict
        Columns of the motion, and of the orders with their steady glides.
    """

    path: tuple[TransientPlace, ...]
    distance_m: Array
    distance_by_length: Number
    histories: Columns
    orders: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class QuasiSteadyErrors:
    """Errors of steady glides against the length of steps, and against the period of swings."""

    steps: tuple[ProgrammeError, ...]
    swings: tuple[SwingError, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class GlideStudy:
    """Steady glides, paths and ranges of a glider.

    Parameters
    ----------
    glider, source : str
        Name, and source of its numbers.
    buoyancy_kg : float
        Size of the net buoyancy of the card.
    states : tuple of AngleGlide
        Glides at the given angles.
    polar : dict
        Columns ``path_angle_deg``, ``horizontal_speed_mps``, ``climb_mps``.
    as_printed : tuple of BalancedGlide
        The glides by the equations as printed; empty if they were not asked for.
    steps : tuple of StepGlide
        Glides of the programme's steps.
    path, path_as_printed : tuple of PathPlace
        Start and ends of the steps; empty without a programme.
    length_m : float, optional
        Length of the path through the water.
    path_histories, path_as_printed_histories : dict
        Columns ``t_s``, ``x_m``, ``y_m``, ``height_m`` to draw.
    quasi_steady_error : QuasiSteadyErrors, optional
        Only if views were asked for.
    """

    glider: str
    source: str
    buoyancy_kg: float
    states: tuple[AngleGlide, ...]
    design: GlideDesign
    polar: Columns
    as_printed: tuple[BalancedGlide, ...]
    steps: tuple[StepGlide, ...]
    path: tuple[PathPlace, ...]
    length_m: float | None
    path_histories: Columns
    path_as_printed: tuple[PathPlace, ...]
    path_as_printed_histories: Columns
    transient: TransientPath | None
    quasi_steady_error: QuasiSteadyErrors | None
    notices: tuple[Notice, ...]


def study_glider(card: GliderCard, question: GlideQuestion) -> GlideStudy:
    """Run the study; InputError for an angle or step that cannot be flown, or a budget without depth or the reverse."""
    model = build(card)
    steady = _glides(card, question, steady_glide)
    printed = _glides(card, question, glide_as_printed) if question.as_printed else []
    integrator = Integrator(model) if question.programme or question.views else None
    best, fastest = best_glide(card), fastest_glide(card)
    return GlideStudy(
        glider=card.ship.name,
        source=card.ship.source,
        buoyancy_kg=card.glider.buoyancy_kg,
        states=tuple(_at_angle(card, model, glide) for glide in steady),
        design=GlideDesign(
            smallest_angle_deg=math.degrees(abs(best.path_angle_rad)),
            best_glide=GlideState.of(best),
            fastest_glide=GlideState.of(fastest),
            ranges=_ranges(card, question, (best, fastest, *steady)),
        ),
        polar=_polar(card),
        as_printed=tuple(BalancedGlide.of(glide, force_residual_N=force_residual(card, glide)) for glide in printed),
        **_paths(card, question, integrator),
        quasi_steady_error=(
            QuasiSteadyErrors(steps=quasi_steady_error(card, integrator), swings=swing_errors(card, integrator))
            if question.views and integrator
            else None
        ),
        notices=(*model.notices, *([NO_COMPILER] if integrator and not integrator.compiled else [])),
    )


def _glides(card: GliderCard, question: GlideQuestion, equations: Callable[..., SteadyGlide]) -> list[SteadyGlide]:
    size = question.buoyancy_kg
    return [
        equations(
            card, angle, roll_rad=question.roll_rad, buoyancy_kg=None if size is None else math.copysign(size, angle)
        )
        for angle in question.angles_rad
    ]


def _field(glide: SteadyGlide, name: str) -> Any:
    """A field of :class:`GlideState`."""
    own = name.replace("_degps", "_radps").replace("_deg", "_rad")
    value = getattr(glide, own)
    return value if own == name else math.degrees(value)


def _at_angle(card: GliderCard, model: Model, glide: SteadyGlide) -> AngleGlide:
    turns = glide.turn_rate_radps != 0
    return AngleGlide.of(
        glide,
        force_residual_N=force_residual(card, glide),
        turning_radius_with_added_mass_m=equilibrium(model, glide).turning_radius_m if turns else math.inf,
        ballast_kg=ballast_kg(card, glide.buoyancy_kg),
    )


def _polar(card: GliderCard) -> Columns:
    polar = [GlideState.of(glide) for glide in glide_polar(card)]
    names = ("path_angle_deg", "horizontal_speed_mps", "climb_mps")
    return {name: np.array([getattr(state, name) for state in polar]) for name in names}


def _paths(card: GliderCard, question: GlideQuestion, integrator: Integrator | None) -> dict[str, Any]:
    """Fields of :class:`GlideStudy` on the path of a programme."""
    programme = question.programme
    path = fly(card, programme) if programme else None
    printed = fly(card, programme, as_printed=True) if programme and question.as_printed else None
    flown = zip(path.glides, path.durations_s, strict=True) if path else ()
    return {
        "steps": tuple(StepGlide.of(glide, duration_s=duration) for glide, duration in flown),
        "path": _places(path),
        "length_m": path.length_m if path else None,
        "path_histories": _histories(path),
        "path_as_printed": _places(printed),
        "path_as_printed_histories": _histories(printed),
        "transient": _transient(compare_with_steady(integrator, path)) if path and integrator else None,
    }


def _places(path: GlidePath | None) -> tuple[PathPlace, ...]:
    return tuple(PathPlace(*place[:4], math.degrees(place.heading_rad)) for place in (path.places if path else ()))


def _histories(path: GlidePath | None) -> Columns:
    return path.histories() if path else {}


def _transient(found: Compared) -> TransientPath:
    motion, named = found.motion, ("motion.x", "motion.y", "motion.z", "motion.speed")
    times = [place.time_s for place in found.path.places]
    return TransientPath(
        path=tuple(TransientPlace(time, *(motion.at(name, time) for name in named)) for time in times),
        distance_m=found.distance_m,
        distance_by_length=found.share,
        histories=found.histories(),
        orders=found.orders(),
    )


def _ranges(card: GliderCard, question: GlideQuestion, glides: Sequence[SteadyGlide]) -> tuple[Range, ...]:
    budget, depth = question.budget_kg, question.depth_m
    if budget is None and depth is None:
        return ()
    if budget is None or depth is None:
        missing = "budget_kg" if budget is None else "depth_m"
        raise ArgumentError(missing, "", "is missing", "a range needs the ballast to expel and the depth")
    straight = (glide for glide in glides if not glide.turn_rate_radps)
    return tuple(glide_range(card, glide, budget_kg=budget, depth_m=depth) for glide in straight)
