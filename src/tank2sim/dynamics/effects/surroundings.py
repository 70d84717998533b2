"""Effects of the ship's surroundings: current."""

from __future__ import annotations

import math
from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.effects.effect import Effect, EffectParameter
from tank2sim.dynamics.model import Input, Model


def _with_current(model: Model, values: Mapping[str, float]) -> Model:
    """Water that moves uniformly over the ground: dx/dt and dy/dt gain its velocity.

    u and v are through the water; a uniform steady current is only another inertial frame, so that no force changes.
    """
    speed = Input(
        name="current.speed",
        unit="m/s",
        description="Speed of the current over the ground",
        display_unit="knots",
        minimum=0.0,
        start=values["speed_mps"],
    )
    direction = Input(
        name="current.direction",
        unit="rad",
        description="Direction towards which the current sets, clockwise from north",
        display_unit="deg",
        start=values["direction_rad"],
    )
    return (
        model.extend(speed, direction)
        .redefine("motion.xdot", lambda north: north + speed.symbol * ca.cos(direction.symbol))
        .redefine("motion.ydot", lambda east: east + speed.symbol * ca.sin(direction.symbol))
    )


CURRENT = Effect(
    name="current",
    acts_on="kinematics",
    description="The water moves over the ground and carries the ship with it.",
    source="kinematics of a moving frame; formats of the ship card",
    parameters=(
        EffectParameter("speed_mps", "speed of the current over the ground", 0.0, 5.0),
        EffectParameter("direction_rad", "direction towards which it sets", -2 * math.pi, 2 * math.pi),
    ),
    apply=_with_current,
)
