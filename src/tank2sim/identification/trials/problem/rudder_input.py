"""The model as a trial drives it: by the rudder's order through the gear, or by the measured angle without it."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Quantity


def driven_by_angle(model: Model) -> Model:
    """The model without its steering gear: ``rudder.command`` is the angle of the rudder.

    For trials in which the angle was measured: whatever the gear did is in the record.
    """
    angle, order = model.symbol("rudder.angle"), model.symbol("rudder.command")
    gone = {"rudder.rate", "rudder.angle"}
    quantities = []
    for quantity in model.quantities:
        if quantity.name in gone:
            continue
        copy = replace(quantity, value=ca.substitute(quantity.value, angle, order))
        copy.__dict__["symbol"] = quantity.symbol  # what other quantities already refer to
        quantities.append(copy)
    return replace(
        model,
        states=tuple(state for state in model.states if state.name != "rudder.angle"),
        quantities=tuple(quantities),
        outputs=tuple(name for name in model.outputs if name not in gone),
    )


def with_ground_velocities(model: Model) -> Model:
    """The model with ``motion.u_ground`` and ``motion.v_ground``, the velocity over the ground in body axes, m/s."""
    north, east, psi = (model.symbol(name) for name in ("motion.xdot", "motion.ydot", "motion.psi"))
    forward, starboard = earth_velocity(north, east, -psi)
    return model.extend(
        Quantity(name="motion.u_ground", unit="m/s", description="Velocity ahead over the ground", value=forward),
        Quantity(
            name="motion.v_ground", unit="m/s", description="Velocity to starboard over the ground", value=starboard
        ),
    )
