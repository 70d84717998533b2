"""From body to earth: yaw rate, heading, position, and the motion over the ground."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.model import Parameter, Quantity, State, Variable

_STILL_MPS = 1e-8
"""Speed over ground below which a ship is at rest, so that speed and course have a slope there: project choice. At
0.1 m/s it changes the speed by less than 1e-14 of itself."""


def earth_velocity(u: ca.SX, v: ca.SX, psi: ca.SX) -> tuple[ca.SX, ca.SX]:
    """dx/dt to north and dy/dt to east (m/s) of a ship with body velocities u, v (m/s) and heading psi (rad)."""
    return u * ca.cos(psi) - v * ca.sin(psi), u * ca.sin(psi) + v * ca.cos(psi)


def planar_kinematics(body: Mapping[str, Variable]) -> tuple[Variable, ...]:
    """Variables of position and heading, and what follows from them over the ground.

    Parameters
    ----------
    body : mapping
        ``motion.u``, ``motion.v`` (m/s, through the water) and ``motion.r`` (rad/s).

    Returns
    -------
    tuple
        States ``motion.x``, ``motion.y``, ``motion.psi``; quantities ``motion.xdot``, ``motion.ydot``,
        ``motion.psidot``, ``motion.sog``, ``motion.cog``; parameters ``initial.x``, ``.y``, ``.psi``.
    """
    x0, y0, psi0 = starts = _starts()
    _, _, psi = states = _states(x0.symbol, y0.symbol, psi0.symbol)
    north, east = earth_velocity(body["motion.u"].symbol, body["motion.v"].symbol, psi.symbol)
    xdot, ydot, _ = rates = _rates(north, east, body["motion.r"].symbol)
    return (*states, *rates, *_over_ground(xdot.symbol, ydot.symbol, psi.symbol), *starts)


def yaw_rate(nominal_radps: float) -> tuple[State, Parameter]:
    """State ``motion.r`` (rad/s) of a ship, and its start ``initial.r``.

    Its rate ``motion.rdot`` is what the ship's equations give; `nominal_radps` is the size of an ordinary turn's.
    """
    start = Parameter(
        name="initial.r",
        unit="rad/s",
        description="Yaw rate at the start, positive to starboard",
        display_unit="deg/min",
        start=0.0,
        tunable=False,
    )
    state = State(
        name="motion.r",
        unit="rad/s",
        description="Yaw rate (rate of turn), positive to starboard",
        display_unit="deg/min",
        nominal=nominal_radps,
        derivative="motion.rdot",
        start=start.symbol,
        steady=True,
    )
    return state, start


def body_states(speed: float, length: float) -> tuple[Variable, ...]:
    """States ``motion.u``, ``.v``, ``.r`` of a vessel that starts straight ahead, and the parameters of their start.

    Parameters
    ----------
    speed : float
        Surge velocity at the start, m/s.
    length : float
        L, m, for the nominal yaw rate.
    """
    trim = Parameter(
        name="initial.trim",
        unit="1",
        description="True: start in steady motion with the inputs given (initial.u, .v, .r are then a first guess)",
        boolean=True,
        start=0.0,
        tunable=False,
    )
    surge = _velocity("u", "Surge", ", positive forward", start=speed, nominal=speed)
    sway = _velocity("v", "Sway", ", positive to starboard", nominal=0.1 * speed)
    states, starts = zip(surge, sway, yaw_rate(speed / length), strict=True)
    return (*states, *starts, trim)


def _velocity(letter: str, name: str, sign: str, *, nominal: float, start: float = 0.0) -> tuple[State, Parameter]:
    described = f"{name} velocity through the water"
    first = Parameter(
        name=f"initial.{letter}",
        unit="m/s",
        description=f"{described} at the start{sign}",
        display_unit="knots",
        start=start,
        tunable=False,
    )
    state = State(
        name=f"motion.{letter}",
        unit="m/s",
        description=f"{described}{sign}",
        display_unit="knots",
        nominal=nominal,
        derivative=f"motion.{letter}dot",
        start=first.symbol,
        steady=True,
    )
    return state, first


def heel(*, at_rest: bool = False) -> tuple[tuple[State, State], tuple[Parameter, ...]]:
    """States ``motion.phi`` (rad) and ``motion.p`` (rad/s), and their starts ``initial.phi``, ``initial.p``.

    Parameters
    ----------
    at_rest : bool
        Without the starts: upright and at rest.

    Returns
    -------
    tuple
        The two states, whose rates are ``motion.phidot`` and ``motion.pdot``, and the two parameters, none `at_rest`.
    """
    described = (
        ("phi", "rad", "Heel", "deg", 0.1),
        ("p", "rad/s", "Rate of heel", "deg/s", 0.01),
    )
    states, starts = [], []
    for letter, unit, name, shown, nominal in described:
        start = Parameter(
            name=f"initial.{letter}",
            unit=unit,
            description=f"{name} at the start, positive to starboard",
            display_unit=shown,
            start=0.0,
            tunable=False,
        )
        starts.append(start)
        states.append(
            State(
                name=f"motion.{letter}",
                unit=unit,
                description=f"{name}, positive to starboard",
                display_unit=shown,
                nominal=nominal,
                derivative=f"motion.{letter}dot",
                start=0.0 if at_rest else start.symbol,
                steady=True,
            )
        )
    angle, rate = states
    return (angle, rate), () if at_rest else tuple(starts)


def _starts() -> tuple[Parameter, ...]:
    described = (
        ("initial.x", "m", "Position to north at the start", None),
        ("initial.y", "m", "Position to east at the start", None),
        ("initial.psi", "rad", "Heading at the start, clockwise from north", "deg"),
    )
    return tuple(
        Parameter(name=name, unit=unit, description=description, display_unit=shown, start=0.0, tunable=False)
        for name, unit, description, shown in described
    )


def _states(*starts: ca.SX) -> tuple[State, ...]:
    origin = "Position of the origin (midway between perpendiculars)"
    described = (
        ("motion.x", "m", f"{origin} to north", None, 100.0),
        ("motion.y", "m", f"{origin} to east", None, 100.0),
        ("motion.psi", "rad", "Heading, clockwise from north, continuous", "deg", 1.0),
    )
    return tuple(
        State(
            name=name,
            unit=unit,
            description=description,
            display_unit=shown,
            nominal=nominal,
            derivative=f"{name}dot",
            start=start,
        )
        for (name, unit, description, shown, nominal), start in zip(described, starts, strict=True)
    )


def _rates(*values: ca.SX) -> tuple[Quantity, ...]:
    described = (
        ("motion.xdot", "m/s", "Speed to north over the ground", None, 1.0),
        ("motion.ydot", "m/s", "Speed to east over the ground", None, 1.0),
        ("motion.psidot", "rad/s", "Rate of change of heading, positive to starboard", "deg/s", 0.01),
    )
    return tuple(
        Quantity(name=name, unit=unit, description=description, display_unit=shown, nominal=nominal, value=value)
        for (name, unit, description, shown, nominal), value in zip(described, values, strict=True)
    )


def _over_ground(xdot: ca.SX, ydot: ca.SX, psi: ca.SX) -> tuple[Quantity, Quantity]:
    forward, starboard = earth_velocity(xdot, ydot, -psi)
    square = xdot * xdot + ydot * ydot
    return (
        Quantity(
            name="motion.sog",
            unit="m/s",
            description="Speed over ground",
            display_unit="knots",
            nominal=5.0,
            value=ca.sqrt(square + _STILL_MPS**2),
        ),
        # Heading plus drift instead of atan2(east, north): no jump of a full turn while the ship circles.
        Quantity(
            name="motion.cog",
            unit="rad",
            description="Course over ground, clockwise from north, within half a turn of the heading (that at rest)",
            display_unit="deg",
            value=psi + ca.atan2(starboard, forward + _STILL_MPS * (square < _STILL_MPS**2)),
        ),
    )
