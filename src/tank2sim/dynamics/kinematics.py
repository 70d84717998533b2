"""From body to earth: position, heading, and the motion over the ground."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.model import Parameter, Quantity, State, Variable


def earth_velocity(u: ca.SX, v: ca.SX, psi: ca.SX) -> tuple[ca.SX, ca.SX]:
    """dx/dt to north and dy/dt to east (m/s) of a ship with body velocities u, v (m/s) and heading psi (rad)."""
    return u * ca.cos(psi) - v * ca.sin(psi), u * ca.sin(psi) + v * ca.cos(psi)


def kinematics(body: Mapping[str, State]) -> tuple[Variable, ...]:
    """Variables of position and heading, and what follows from them over the ground.

    Parameters
    ----------
    body : mapping
        The states ``motion.u``, ``motion.v`` (m/s, through the water) and ``motion.r`` (rad/s).

    Returns
    -------
    tuple
        States ``motion.x``, ``motion.y``, ``motion.psi``; quantities ``motion.xdot``, ``motion.ydot``,
        ``motion.psidot``, ``motion.sog``, ``motion.cog``; parameters ``initial.x``, ``.y``, ``.psi``.
    """
    starts = (
        Parameter(name="initial.x", unit="m", description="Position to north at the start", start=0.0, tunable=False),
        Parameter(name="initial.y", unit="m", description="Position to east at the start", start=0.0, tunable=False),
        Parameter(
            name="initial.psi",
            unit="rad",
            description="Heading at the start, clockwise from north",
            display_unit="deg",
            start=0.0,
            tunable=False,
        ),
    )
    x, y, psi = (
        State(
            name="motion.x",
            unit="m",
            description="Position of the origin (midway between perpendiculars) to north",
            nominal=100.0,
            derivative="motion.xdot",
            start=starts[0].symbol,
        ),
        State(
            name="motion.y",
            unit="m",
            description="Position of the origin (midway between perpendiculars) to east",
            nominal=100.0,
            derivative="motion.ydot",
            start=starts[1].symbol,
        ),
        State(
            name="motion.psi",
            unit="rad",
            description="Heading, clockwise from north, continuous",
            display_unit="deg",
            derivative="motion.psidot",
            start=starts[2].symbol,
        ),
    )
    north, east = earth_velocity(body["motion.u"].symbol, body["motion.v"].symbol, psi.symbol)
    xdot = Quantity(name="motion.xdot", unit="m/s", description="Speed to north over the ground", value=north)
    ydot = Quantity(name="motion.ydot", unit="m/s", description="Speed to east over the ground", value=east)
    psidot = Quantity(
        name="motion.psidot",
        unit="rad/s",
        description="Rate of change of heading, positive to starboard",
        display_unit="deg/s",
        nominal=0.01,
        value=body["motion.r"].symbol,
    )
    return (x, y, psi, xdot, ydot, psidot, *_over_ground(xdot.symbol, ydot.symbol, psi.symbol), *starts)


def _over_ground(xdot: ca.SX, ydot: ca.SX, psi: ca.SX) -> tuple[Quantity, Quantity]:
    forward, starboard = earth_velocity(xdot, ydot, -psi)
    return (
        Quantity(
            name="motion.sog",
            unit="m/s",
            description="Speed over ground",
            display_unit="knots",
            nominal=5.0,
            value=ca.sqrt(xdot * xdot + ydot * ydot),
        ),
        # Heading plus drift instead of atan2(east, north): no jump of a full turn while the ship circles.
        Quantity(
            name="motion.cog",
            unit="rad",
            description="Course over ground, clockwise from north, within half a turn of the heading",
            display_unit="deg",
            value=psi + ca.atan2(starboard, forward),
        ),
    )
