"""Two-point tuning: two characteristics of a ship fitted to two points of the steering diagram (paper 4, section 4).

Melkozerova and Pershits (1975; after Poznyakov and Yudin 2007) state that two characteristics of the ship determine the
steering of a model: the reduced fullness of the submerged profile, which weighs the areas at the stern (deadwood,
skegs, a cut-up) by their effect against drift and turn, and the effectiveness of the rudder. Both follow from two
measured points of the steering diagram: the greatest yaw rate, with the rudder hard over, and the yaw rate of an
unstable ship with the rudder amidships, or for a stable ship any other point far enough from the first.

The paper prints no formula by which the fullness enters the coefficients. It names the affected coefficients: C_m^beta
and C_m^omega, the strongest influences of the hull, and C_y^delta, C_m^delta of the rudder (curve 3 of its Fig. 1).
Project choice: a fuller stern reduces the static moment and increases the damping, both by the same factor h,

    N_v / h,   N_r h,   all terms of the rudder times e

with h above 1 for the steadier ship; Taylor terms of N_v and N_r in the speed go with them. N_r is the hydrodynamic
one: the part -m x_G in a card's N_r does not change. Other terms do not change.

The sequential method of 1975 and the joint solution agree; this module solves both jointly, by Newton's method with
continuation from the model's points to the measured ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.apps.steering_cards.steady_points import SteadyTurn, TurnInDegrees, TurningPoints
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.terms import parse_term
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.steering_models import SteeringForm
from tank2sim.errors import InputError
from tank2sim.notices import Notice

LARGEST_FACTOR = 5.0
"""Largest factor, and inverse of the least, of a hull or rudder that is still the card's ship. Project choice."""

_LEAST_STEP = 1e-3
_ACCURACY = 1e-10
_ITERATIONS = 12
_SINGULAR = 1e13
_ALIKE = 20.0
"""Condition of the factors against the measures above which the points do not determine both. Project choice."""


@dataclass(frozen=True)
class Levers:
    """Parameters of a model that the two characteristics scale.

    Parameters
    ----------
    static_moment : tuple of str
        Divided by the hull's factor.
    damping : mapping
        Name to the inertial part of the parameter that is not scaled (0 if none): multiplied by the hull's factor.
    rudder : tuple of str
        Multiplied by the rudder's factor.
    """

    static_moment: tuple[str, ...]
    damping: Mapping[str, float] = field(default_factory=dict)
    rudder: tuple[str, ...] = ()

    def scaled(self, value: Mapping[str, Any], hull: Any, rudder: Any) -> dict[str, Any]:
        """The parameters after scaling, by name; numbers or CasADi expressions."""
        given: dict[str, Any] = {name: value[name] / hull for name in self.static_moment}
        for name, inertial in self.damping.items():
            given[name] = (value[name] - inertial) * hull + inertial
        return given | {name: value[name] * rudder for name in self.rudder}


def levers_of_ship(card: ManoeuvringCard, model: Model) -> Levers:
    """The levers of a ship in the derivatives of (3.5) or (3.8): Nv, Nvu, ..; Nr, Nru, ..; all terms with a rudder.

    In an MMG ship f_alpha takes the place of the rudder's terms.
    """
    static: list[str] = []
    damping: dict[str, float] = {}
    rudder: list[str] = []
    body = card.rigid_body
    total = card.model.yaw_rate_terms == "total"
    if "mmg.f_alpha" in model:
        rudder.append("mmg.f_alpha")
    for name in model.parameter_names:
        term = parse_term(name.removeprefix("derivatives.")) if name.startswith("derivatives.") else None
        if term is None or term.acceleration:
            continue
        if term.d:
            rudder.append(name)
        elif term.force == "N" and (term.v, term.r) == (1, 0):
            static.append(name)
        elif term.force == "N" and (term.v, term.r) == (0, 1):
            damping[name] = -body.mass * body.x_G if total and term.u == 0 else 0.0
    return Levers(tuple(static), damping, tuple(rudder))


def levers_of_form(form: SteeringForm) -> Levers:
    """The levers of a steering model, by the names of its form."""

    def named(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(f"coefficients.{name}" for name in names)

    return Levers(named(form.static_moment), dict.fromkeys(named(form.damping), 0.0), named(form.rudder))


@dataclass(frozen=True)
class WantedTurn:
    """A measured point of the steering diagram: a rudder angle (rad) and the yaw rate (rad/s) or the radius (m) there.

    The rate is positive to starboard; one of the two is given.
    """

    rudder_rad: float
    yaw_rate_radps: float | None = None
    radius_m: float | None = None

    def __post_init__(self) -> None:
        if (self.yaw_rate_radps is None) == (self.radius_m is None):
            raise ValueError("a point has a yaw rate or a radius")

    def measure(self, turn: SteadyTurn) -> float:
        """The measured quantity of a turn: its yaw rate or its radius."""
        return turn.radius_m if self.yaw_rate_radps is None else turn.yaw_rate_radps

    @property
    def value(self) -> float:
        """The measured yaw rate or radius."""
        return float(self.yaw_rate_radps if self.radius_m is None else self.radius_m)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class TwoPointTuning:
    """A ship whose steering diagram goes through two measured points.

    Parameters
    ----------
    hull_factor, rudder_factor : float
        The factors h and e.
    parameters : dict
        Values of the scaled parameters of the model, by name.
    before, after : pairs of TurnInDegrees
        At the two rudder angles, with the model before and after.
    course_stable_before, course_stable_after : bool
        True if the straight course is stable with the rudder held.
    """

    hull_factor: float
    rudder_factor: float
    parameters: dict[str, float]
    before: tuple[TurnInDegrees, TurnInDegrees]
    after: tuple[TurnInDegrees, TurnInDegrees]
    course_stable_before: bool
    course_stable_after: bool


@dataclass(frozen=True, kw_only=True)
class TwoPointStudy(TwoPointTuning):
    """A ship tuned to two points, which are texts as a user writes them: ``61@35``."""

    ship: str
    points: tuple[str, str]
    notices: tuple[Notice, ...]


def tune_to_two_points(model: Model, levers: Levers, first: WantedTurn, second: WantedTurn) -> TwoPointTuning:
    """Find the factors of hull and rudder with which the steady turns of a model agree with two measured points.

    Parameters
    ----------
    model : Model
        A ship of any card, or a steering model.
    levers : Levers
        What the factors move (:func:`levers_of_ship`, :func:`levers_of_form`).
    first, second : WantedTurn
        The points, at different rudder angles.

    Raises
    ------
    InputError
        The model does not turn at one of the angles, or no factors between 1/5 and 5 fit both points; the message
        states the progress.
    """
    points = TurningPoints(model)
    found = [points.turn_at(wanted.rudder_rad) for wanted in (first, second)]
    _refuse_opposed(model, (first, second), found[0][0], found[1][0])
    system = _System(points, levers, (first, second))
    unknown = np.concatenate([found[0][1], found[1][1], [0.0, 0.0]])
    have = np.log(np.abs([wanted.measure(turn) for wanted, (turn, _) in zip((first, second), found, strict=True)]))
    want = np.log(np.abs([first.value, second.value]))
    unknown = _followed(system, unknown, have, want)
    hull, rudder = np.exp(unknown[-2:]).tolist()
    start = model.defaults
    changed: dict[str, float] = levers.scaled(start, hull, rudder)
    after = [points.turn_at(wanted.rudder_rad, changed)[0] for wanted in (first, second)]
    for wanted, turn in zip((first, second), after, strict=True):
        if abs(wanted.measure(turn) / wanted.value - 1) > 1e-6:
            raise system.fault("the two points lie on different branches of the steering diagram")
    return TwoPointTuning(
        hull_factor=hull,
        rudder_factor=rudder,
        parameters=changed,
        before=(found[0][0].in_degrees(), found[1][0].in_degrees()),
        after=(after[0].in_degrees(), after[1].in_degrees()),
        course_stable_before=points.holds_course(),
        course_stable_after=points.holds_course(changed),
    )


def _refuse_opposed(model: Model, wanted: tuple[WantedTurn, WantedTurn], *turns: SteadyTurn) -> None:
    if abs(wanted[0].rudder_rad - wanted[1].rudder_rad) < 1e-6:
        raise model.fault("two points", "have one rudder angle", "give two that are far from each other")
    for target, turn in zip(wanted, turns, strict=True):
        if target.yaw_rate_radps is not None and target.yaw_rate_radps * turn.yaw_rate_radps <= 0:
            place = f"rudder {math.degrees(target.rudder_rad):.4g} deg"
            problem = f"a yaw rate of {60 * math.degrees(target.yaw_rate_radps):.4g} deg/min is not to its side"
            raise model.fault(place, problem, "rudder and yaw rate are positive to starboard")


class _System:
    """Steady turns at both rudders with the target measures: unknowns (y1, y2, ln h, ln e)."""

    def __init__(self, points: TurningPoints, levers: Levers, wanted: tuple[WantedTurn, WantedTurn]):
        self._model = model = points.model
        self.wanted = wanted
        n = points.y.numel()
        self.unknown = ca.SX.sym("unknown", 2 * n + 2)
        goal = ca.SX.sym("goal", 2)
        numbers = {name: ca.SX(value) for name, value in model.defaults.items()}
        scaled = levers.scaled(numbers, ca.exp(self.unknown[-2]), ca.exp(self.unknown[-1]))
        p = ca.vcat([ca.SX(scaled.get(name, numbers[name])) for name in model.parameter_names])
        rows: list[ca.SX] = []
        for place, target in enumerate(wanted):
            y = self.unknown[place * n : (place + 1) * n]
            rates, shown = ca.substitute([points.rates, points.shown], [points.y, model.p], [y, p])
            measure = ca.fabs(shown[0]) if target.radius_m is None else shown[1] / ca.fabs(shown[0])
            rows += [rates, y[-1] - target.rudder_rad, ca.log(measure) - goal[place]]
        equations = ca.vcat(rows)
        slopes = ca.densify(ca.jacobian(equations, self.unknown))
        self._newton = ca.Function("tuning", [self.unknown, goal], [equations, slopes], {"cse": True})

    def solved(self, near: Array, goal: Array) -> Array | None:
        """The unknowns near `near` that fit the logarithms of the measures; None if Newton's method fails."""
        value = near.copy()
        for _ in range(_ITERATIONS):
            residual, slopes = (np.array(part) for part in self._newton(value, goal))
            if not (np.isfinite(slopes).all() and np.isfinite(residual).all()):
                return None
            # Least squares: of a linear ship, whose turns are in proportion to the rudder, hull and rudder act alike.
            change = np.linalg.lstsq(slopes, -residual.ravel(), rcond=1e-12)[0]
            value = value + change
            if np.max(np.abs(change)) < _ACCURACY:
                met = np.max(np.abs(residual)) < math.sqrt(_ACCURACY)
                return value if met and np.all(np.abs(value[-2:]) <= math.log(LARGEST_FACTOR)) else None
        return None

    def act_alike(self, near: Array, goal: Array) -> bool:
        """True if hull and rudder move both measures nearly in the same proportion."""
        residual, slopes = (np.array(part) for part in self._newton(near, goal))
        n = len(residual) // 2
        if np.linalg.cond(slopes) > _SINGULAR:
            return True
        factors_by_measures = np.linalg.solve(slopes, np.eye(len(residual))[:, [n - 1, -1]])[-2:]
        return bool(np.linalg.cond(factors_by_measures) > _ALIKE)

    def fault(self, problem: str) -> InputError:
        """An error about the two points."""
        text = " and ".join(_target_text(target) for target in self.wanted)
        return self._model.fault(text, problem, "check both points, or change other coefficients first")


def _target_text(wanted: WantedTurn) -> str:
    at = f"at {_to_a_side(math.degrees(wanted.rudder_rad), 'deg')}"
    if wanted.yaw_rate_radps is None:
        return f"{wanted.radius_m:.5g} m {at}"
    return f"{_to_a_side(60 * math.degrees(wanted.yaw_rate_radps), 'deg/min')} {at}"


def _to_a_side(value: float, unit: str) -> str:
    return f"{abs(value):.4g} {unit}" + (f" to {'port' if value < 0 else 'starboard'}" if value else "")


def _followed(system: _System, unknown: Array, have: Array, want: Array) -> Array:
    """The unknowns at the target measures, from those at the model's measures."""
    done, step = 0.0, 0.25
    while done < 1.0:
        share = min(1.0, done + step)
        found = system.solved(unknown, have + share * (want - have))
        if found is not None:
            unknown, done, step = found, share, 1.5 * step
            continue
        step /= 2
        if step < _LEAST_STEP:
            hull, rudder = np.exp(unknown[-2:]).tolist()
            alike = system.act_alike(unknown, have + done * (want - have))
            raise system.fault(
                ("hull and rudder move both points nearly alike (take points further apart), and " if alike else "")
                + f"no hull factor and rudder factor from {1 / LARGEST_FACTOR:g} to {LARGEST_FACTOR:g} meet both: "
                f"{100 * done:.0f} % of the way they are {hull:.3g} and {rudder:.3g}"
            )
    return unknown
