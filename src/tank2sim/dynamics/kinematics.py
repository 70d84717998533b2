"""From body to earth: yaw rate, heading, position, and the motion over the ground."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca

from tank2sim.dynamics.geographic import geographic
from tank2sim.dynamics.model import Parameter, Quantity, State, Variable

_STILL_MPS = 1e-8
"""Speed over ground below which a ship is at rest, so that speed and course have a slope there: project choice. At
0.1 m/s it changes the speed by less than 1e-14 of itself."""


def earth_velocity(u: ca.SX, v: ca.SX, psi: ca.SX) -> tuple[ca.SX, ca.SX]:
    """dx/dt to north and dy/dt to east (m/s) of a ship with body velocities u, v (m/s) and heading psi (rad)."""
    return u * ca.cos(psi) - v * ca.sin(psi), u * ca.sin(psi) + v * ca.cos(psi)


def started(state: State, at_start: str) -> tuple[State, Parameter]:
    """The state ``motion.<letter>``, and the parameter ``initial.<letter>`` at which it starts, by `at_start`.

    The parameter has the value that the state starts at so far.
    """
    name, value = state.name.replace("motion.", "initial."), float(state.start)
    first = Parameter(name, state.unit, at_start, display_unit=state.display_unit, start=value, tunable=False)
    return replace(state, start=first.symbol), first


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
    clockwise, origin = "clockwise from north", "Position of the origin (midway between perpendiculars)"
    described = (
        ("x", "m", f"{origin} to north", "Position to north at the start", 100.0, None),
        ("y", "m", f"{origin} to east", "Position to east at the start", 100.0, None),
        ("psi", "rad", f"Heading, {clockwise}, continuous", f"Heading at the start, {clockwise}", 1.0, "deg"),
    )
    states, starts = zip(
        *(
            started(State(f"motion.{x}", *words, display_unit=shown, nominal=size, derivative=f"motion.{x}dot"), first)
            for x, *words, first, size, shown in described
        ),
        strict=True,
    )
    psi, r = states[2].symbol, body["motion.r"].symbol
    north, east = earth_velocity(body["motion.u"].symbol, body["motion.v"].symbol, psi)
    turning = "Rate of change of heading, positive to starboard"
    xdot, ydot, _ = rates = (
        Quantity("motion.xdot", "m/s", "Speed to north over the ground", north),
        Quantity("motion.ydot", "m/s", "Speed to east over the ground", east),
        Quantity("motion.psidot", "rad/s", turning, r, display_unit="deg/s", nominal=0.01),
    )
    return (*states, *rates, *_over_ground(xdot.symbol, ydot.symbol, psi), *starts)


def yaw_rate(nominal_radps: float) -> tuple[State, Parameter]:
    """State ``motion.r`` (rad/s) of a ship, and its start ``initial.r``.

    Its rate ``motion.rdot`` is what the ship's equations give; `nominal_radps` is the size of an ordinary turn's.
    """
    state = State(
        "motion.r",
        "rad/s",
        "Yaw rate (rate of turn), positive to starboard",
        display_unit="deg/min",
        nominal=nominal_radps,
        derivative="motion.rdot",
        steady=True,
    )
    return started(state, "Yaw rate at the start, positive to starboard")


def motion_variables(speed_mps: float, length_m: float) -> tuple[Variable, ...]:
    """Position, heading and velocities of a vessel that starts straight ahead, with where that is on the Earth."""
    body = body_states(speed_mps, length_m)
    position = planar_kinematics({state.name: state for state in body if isinstance(state, State)})
    symbols = {variable.name: variable.symbol for variable in position}
    return (*position, *geographic(symbols["motion.x"], symbols["motion.y"]), *body)


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
        "initial.trim",
        "1",
        "True: start in steady motion with the inputs given (initial.u, .v, .r are then a first guess)",
        boolean=True,
        start=0.0,
        tunable=False,
    )
    through = "velocity through the water"
    surge, sway = (
        started(
            State(
                f"motion.{letter}",
                "m/s",
                f"{name} {through}, positive {side}",
                display_unit="knots",
                nominal=nominal,
                derivative=f"motion.{letter}dot",
                start=start,
                steady=True,
            ),
            f"{name} {through} at the start, positive {side}",
        )
        for letter, name, side, start, nominal in (
            ("u", "Surge", "forward", speed, speed),
            ("v", "Sway", "to starboard", 0.0, 0.1 * speed),
        )
    )
    states, starts = zip(surge, sway, yaw_rate(speed / length), strict=True)
    return (*states, *starts, trim)


def heel(*, at_rest: bool = False) -> tuple[tuple[State, ...], tuple[Parameter, ...]]:
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
    described = (("phi", "rad", "Heel", "deg", 0.1), ("p", "rad/s", "Rate of heel", "deg/s", 0.01))
    both = [
        State(
            f"motion.{letter}",
            unit,
            f"{name}, positive to starboard",
            display_unit=shown,
            nominal=nominal,
            derivative=f"motion.{letter}dot",
            steady=True,
        )
        for letter, unit, name, shown, nominal in described
    ]
    if at_rest:
        return (both[0], both[1]), ()
    words = [f"{name} at the start, positive to starboard" for _, _, name, *_ in described]
    states, starts = zip(*map(started, both, words), strict=True)
    return states, starts


def rate_of_heel(p: ca.SX) -> Quantity:
    """``motion.phidot`` (rad/s) of the rate of roll `p`."""
    return Quantity("motion.phidot", "rad/s", "Rate of change of heel", p, display_unit="deg/s", nominal=0.01)


def _over_ground(xdot: ca.SX, ydot: ca.SX, psi: ca.SX) -> tuple[Quantity, Quantity]:
    forward, starboard = earth_velocity(xdot, ydot, -psi)
    square = xdot * xdot + ydot * ydot
    return (
        Quantity(
            "motion.sog", "m/s", "Speed over ground", ca.sqrt(square + _STILL_MPS**2), display_unit="knots", nominal=5.0
        ),
        # Heading plus drift instead of atan2(east, north): no jump of a full turn while the ship circles.
        Quantity(
            "motion.cog",
            "rad",
            "Course over ground, clockwise from north, within half a turn of the heading (that at rest)",
            psi + ca.atan2(starboard, forward + _STILL_MPS * (square < _STILL_MPS**2)),
            display_unit="deg",
        ),
    )
