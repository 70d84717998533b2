"""Single points of the steering diagram: the steady turn at a rudder angle, of a ship or of a steering model.

The turn is the end of the smooth branch of steady turns that starts on the straight course and is followed towards the
side of the turn (:mod:`tank2sim.analysis.turning.continuation`), through the folds of a ship that is unstable there.
This selects the physical root among several.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.turning.continuation import EDGE, Bounds, Curve, corrector_step, follow_branch
from tank2sim.analysis.turning.diagram import TurningEquations
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

_MOST, _MOST_YAW = 10.0, 12.0
"""Bounds of the scaled unknowns, and of r L/u0: no ship turns in a circle of a sixth of its length. Project choice."""

_LEAST_YAW = 1e-6
"""r L/u0 below which a course counts as straight. Project choice."""


@dataclass(frozen=True)
class SteadyTurn:
    """A steady turn; rudder, yaw rate and drift positive to starboard (drift -asin(v/U))."""

    rudder_rad: float
    yaw_rate_radps: float
    drift_rad: float
    speed_mps: float

    @property
    def radius_m(self) -> float:
        """Radius of the origin's circle, m, positive."""
        return self.speed_mps / abs(self.yaw_rate_radps)

    def in_degrees(self) -> TurnInDegrees:
        """Return the turn as results report it."""
        return TurnInDegrees(
            rudder_deg=math.degrees(self.rudder_rad),
            radius_m=self.radius_m,
            yaw_rate_degpmin=60 * math.degrees(self.yaw_rate_radps),
            drift_deg=math.degrees(self.drift_rad),
            speed_mps=self.speed_mps,
        )


@dataclass(frozen=True, kw_only=True)
class TurnInDegrees:
    """A steady turn as results report it; rudder, yaw rate and drift are positive to starboard, the radius always."""

    rudder_deg: float
    radius_m: float
    yaw_rate_degpmin: float
    drift_deg: float
    speed_mps: float


class TurningPoints:
    """Steady turns of a model in calm water at any values of its parameters, by :class:`.TurningEquations`."""

    def __init__(self, model: Model):
        self.model, self.equations = model, TurningEquations(model, free=True)
        self.rates, self.y, self.yaw = self.equations.rates, self.equations.symbol, self.equations.yaw
        u, v, r = (model.symbol(f"motion.{name}") for name in "uvr")
        self.shown = self.equations.along(model.expand(ca.vertcat(r, ca.sqrt(u**2 + v**2), -ca.atan2(v, u))))
        self._shown = ca.Function("shown", [self.y, model.p], [self.shown], {"cse": True})

    def turn_at(self, rudder_rad: float, parameters: Mapping[str, float] | None = None) -> tuple[SteadyTurn, Array]:
        """The steady turn to the side of a rudder angle, and its unknowns y (n + 1,).

        With the rudder amidships it is the turn of an unstable ship to starboard.

        `rudder_rad`: rudder, positive to starboard; `parameters`: values in place of the model's, by name. Raises
        InputError: the ship does not turn at that rudder, or no steady turn was found.
        """
        p = self.model.parameter_values(parameters)
        straight = self._straight(p)
        side = -1.0 if rudder_rad < 0 else 1.0
        if side * straight[-1] > side * rudder_rad + 1e-9:
            raise self._fault(rudder_rad, "holds the ship on the other side of its straight course")
        curve = self._branch(p, straight, rudder_rad, np.where(self.yaw > 0, _MOST_YAW, _MOST))
        last: Array = curve.points[-1]
        if curve.ended != EDGE or abs(last[-1] - rudder_rad) > 1e-9:  # the far edge is none of the turn's
            raise self._fault(rudder_rad, "makes no steady turn that follows from the straight course")
        if side * last @ self.yaw < _LEAST_YAW:
            raise self._fault(rudder_rad, "does not turn the ship")
        return self._turn(last, p), last

    def near(self, y: Array, parameters: Mapping[str, float]) -> SteadyTurn | None:
        """The steady turn near the one with unknowns y, at the same rudder and other parameters, or None."""
        p = self.model.parameter_values(parameters)
        found = corrector_step(self._equations(p), y, np.eye(len(y))[-1])
        return None if found is None else self._turn(found[0], p)

    def diagram(self, largest_rad: float, parameters: Mapping[str, float] | None = None) -> list[SteadyTurn]:
        """The branch from the straight course to a rudder angle, as followed by :meth:`turn_at` (without its start)."""
        p = self.model.parameter_values(parameters)
        curve = self._branch(p, self._straight(p), largest_rad, np.full(len(self.yaw), _MOST))
        return [self._turn(y, p) for y in curve.points if abs(y @ self.yaw) > _LEAST_YAW]

    def _branch(self, p: Array, straight: Array, rudder_rad: float, most: Array) -> Curve:
        """The branch from the straight course to a rudder angle; the other unknowns stay within +- `most`."""
        least, side = -most, -1.0 if rudder_rad < 0 else 1.0
        # Before a fold the rudder lies beyond the straight course's: only the side of the turn has a limit.
        most[-1], least[-1] = (rudder_rad, -math.pi) if side > 0 else (math.pi, rudder_rad)
        return follow_branch(self._equations(p), straight, side * self.yaw, Bounds(least, most))

    def holds_course(self, parameters: Mapping[str, float] | None = None) -> bool:
        """True if the straight course is stable with the rudder held: all motions of the hull decay."""
        p = self.model.parameter_values(parameters)
        slopes = self._equations(p)(self._straight(p))[1][:, :-1]
        return bool(np.linalg.eigvals(slopes).real.max() < 0)

    def _equations(self, p: Array) -> _At:
        return _At(self.equations.function, p)

    def _straight(self, p: Array) -> Array:
        """The straight course: steady, with a yaw rate of zero."""
        start = np.array(self.model.initial(p)).ravel()
        places = [self.model.state_names.index(name) for name in (*self.equations.names, "rudder.angle")]
        found = corrector_step(self._equations(p), start[places] / self.equations.scale * (1 - self.yaw), self.yaw)
        if found is None:
            raise self.model.fault("", "keeps no straight course", "check the card's coefficients")
        return found[0]

    def _turn(self, y: Array, p: Array) -> SteadyTurn:
        rate, speed, drift = np.array(self._shown(y, p)).ravel().tolist()
        return SteadyTurn(float(y[-1]), rate, drift, speed)

    def _fault(self, rudder_rad: float, problem: str) -> InputError:
        place = f"rudder {math.degrees(rudder_rad):.4g} deg"
        return self.model.fault(place, problem, "give another rudder angle, or check the card")


@dataclass(frozen=True)
class _At:
    """The equations at given parameters, in the form of the continuation."""

    function: ca.Function
    p: Array

    def __call__(self, y: Array) -> tuple[Array, Array]:
        residual, jacobian = self.function(y, self.p)
        return np.array(residual).ravel(), np.array(jacobian)
