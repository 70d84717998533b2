"""A small craft with thrusters: Fossen's equations in three degrees of freedom, SI.

    M nu' = -C_RB(nu) nu - C_A(nu) nu + D(nu) + sum of thrusts,    nu = (u, v, r) through the water

    X = Xu u + Xuabsu u|u|
    Y = Yv v + Yvabsv v|v| + Yvabsr v|r| + Yvabsu v|u| + Yr r + Yrabsr r|r| + Yrabsv r|v| + Yrabsu r|u|,   N likewise
    T = k n|n| - l max(n, 0) u_T    (one thruster; k ahead or astern)
    X = T cos a,  Y = T sin a,  N = x Y - y X

with M, C_RB (:mod:`tank2sim.dynamics.rigid_body`), C_A (:func:`.added_mass_forces`), the azimuth a of a thruster at
x, y, and u_T = u cos a + v sin a, the craft's velocity along it; what the yaw rate adds at its place is left out. The
order is held within the largest revolutions, and one within the dead band leaves the propeller at rest. The revolutions
go to the order, or to m (o/m)^e of an order o with its largest m, with a lag of the first order.

Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 6.1 to 6.5 (equations), 9.1 (thrust:
T_nn n|n| - T_nu |n| u_a). That a reversed propeller loses nothing by speed is a project choice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_ADDED_MASSES, CRAFT_TERMS, VELOCITY_TERMS
from tank2sim.cards.form import ThrusterSection
from tank2sim.cards.small_craft import cruising_revolutions, pushes_ahead
from tank2sim.dynamics.hull import (
    MOTION_OUTPUTS,
    VALIDITY_MARGIN,
    acceleration_quantities,
    force_quantities,
    hull_particulars,
    inertia_quantities,
    inside_range,
    speed_and_drift,
)
from tank2sim.dynamics.kinematics import motion_variables
from tank2sim.dynamics.low_speed import regular_speed
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State, Variable
from tank2sim.dynamics.rigid_body import (
    Inertia,
    added_mass_forces,
    inertia,
    inertial_forces,
    rigid_body_accelerations,
)
from tank2sim.units import rounded_down

_STEPS_PER_LENGTH = 200
_STEPS_PER_LAG = 5
"""Integration steps while the craft covers its length, and in the shortest lag: as of a ship, project choices."""

_ROUNDED_SHARE = 0.01
"""Share of the largest order below which the curve of the revolutions is straight (project choice: a dead band is
larger)."""

THRUSTER_PARAMETERS = {
    "x_m": "x",
    "y_m": "y",
    "ahead_Ns2": "ahead",
    "astern_Ns2": "astern",
    "speed_loss_kg": "speed_loss",
    "dead_band_radps": "dead_band",
    "order_exponent": "order_exponent",
    "time_constant_s": "time_constant",
}
"""Key of ``[[thrusters]]`` to the last part of the name of the parameter that holds it."""


def craft_model(card: SteeredCard) -> Model:
    """The model of a small craft without its effects.

    Inputs are ``thrusters.<name>.command`` (rad/s, positive ahead) and, of one that turns,
    ``thrusters.<name>.azimuth_command`` (rad clockwise from the bow); outputs the motion, ``thrusters.<name>.speed``
    (rad/s) and ``.thrust`` (N).

    Raises
    ------
    InputError
        Mass with added mass is not positive.
    """
    moving = motion_variables(card.model.speed_mps, card.ship.length_m)
    constants = (*hull_particulars(card, "Cruising speed", "I_z"), *_craft_derivatives(card))
    s = {variable.name: variable.symbol for variable in (*moving, *constants)}
    thrusters, pushes = _thrusters(card, s)
    matrix = _craft_inertia(s)
    _refuse_mass(card)
    masses = inertia_quantities(matrix)
    forces = force_quantities(_craft_forces(s, pushes), "right-hand side of Fossen's equations", _nominal_forces(card))
    X, Y, N = forces
    motion = rigid_body_accelerations(Inertia(*(mass.symbol for mass in masses)), X.symbol, Y.symbol, N.symbol)
    described = ", ".join(thruster.name for thruster in card.thrusters)
    empty = Model(
        name=card.ship.name,
        description=f"{card.ship.name}: small craft in surge, sway and yaw with thrusters {described}",
        step_s=_craft_step(card),
    )
    shown = [f"thrusters.{thruster.name}.{what}" for thruster in card.thrusters for what in ("speed", "thrust")]
    return empty.extend(
        *(*moving, *constants, *thrusters),
        *(*forces, *masses, *acceleration_quantities(motion), *_craft_speed(s)),
        outputs=(*MOTION_OUTPUTS, "force.X", "force.Y", "force.N", "validity", *shown),
    )


def _craft_step(card: SteeredCard) -> float:
    """Step of integration, s: 1, 2 or 5 times a power of ten."""
    lags = [thruster.time_constant_s for thruster in card.thrusters]
    lags += [thruster.azimuth_time_constant_s for thruster in card.thrusters]
    wanted = card.ship.length_m / card.model.speed_mps / _STEPS_PER_LENGTH
    wanted = min(wanted, *(lag / _STEPS_PER_LAG for lag in lags if lag), math.inf)
    return rounded_down(wanted)


def _refuse_mass(card: SteeredCard) -> None:
    body = card.rigid_body
    added = {name: card.derivatives.get(name, 0.0) for name in CRAFT_ADDED_MASSES}
    matrix = inertia(body.mass, body.x_G, body.yaw_inertia, added)
    if min(matrix.surge, matrix.sway, matrix.yaw, matrix.determinant) <= 0:
        problem = "with added mass is not positive (m - Xudot, m - Yvdot, I_z - Nrdot, determinant of sway and yaw)"
        raise card.fault("rigid_body", problem, "check mass, yaw_inertia, x_G and the signs of the added masses")


def _nominal_forces(card: SteeredCard) -> tuple[float, float]:
    """Thrust (N) of all thrusters at their largest revolutions, and its moment (N m) at half the length."""
    thrust = sum(thruster.largest_thrust_N for thruster in card.thrusters)
    return thrust, thrust * card.ship.length_m / 2


_ADDED_UNITS = {"Xudot": "kg", "Yvdot": "kg", "Yrdot": "kg.m", "Nvdot": "kg.m", "Nrdot": "kg.m2"}

_DAMPING_UNITS = {0: ("kg/s", "kg.m/s", "kg.m2/s"), 1: ("kg/m", "kg", "kg.m", "kg.m2")}
"""Unit of a linear and of a quadratic term by the powers of m that the moment and the yaw rates add."""


def craft_unit(name: str) -> str:
    """Unit of a derivative of a small craft.

    Examples
    --------
    >>> craft_unit("Xuabsu"), craft_unit("Nr")
    ('kg/m', 'kg.m2/s')
    """
    if name in _ADDED_UNITS:
        return _ADDED_UNITS[name]
    term = next(term for term in VELOCITY_TERMS if term.name == name)
    return _DAMPING_UNITS[int(bool(term.size))][term.lengths]


def _craft_derivatives(card: SteeredCard) -> tuple[Parameter, ...]:
    velocity = {term.name: term for term in VELOCITY_TERMS}

    def described(name: str) -> str:
        if name not in velocity:
            return f"Acceleration derivative {name}, negative for an added mass"
        term = velocity[name]
        return f"Coefficient of {term.factor}{f'|{term.size}|' * bool(term.size)} in {term.force}"

    return tuple(
        Parameter(
            f"derivatives.{name}",
            craft_unit(name),
            described(name),
            nominal=abs(card.derivatives.get(name, 0.0)) or 1.0,
            start=card.derivatives.get(name, 0.0),
        )
        for name in CRAFT_TERMS
    )


def _craft_inertia(s: Mapping[str, ca.SX]) -> Inertia:
    added = {name: s[f"derivatives.{name}"] for name in CRAFT_ADDED_MASSES}
    return inertia(s["ship.mass"], s["ship.x_G"], s["ship.yaw_inertia"], added)


def craft_damping(coefficients: Mapping[str, ca.SX], u: ca.SX, v: ca.SX, r: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """X, Y (N) and N (N m) of the velocity terms.

    Parameters
    ----------
    coefficients : mapping
        Name of each of :data:`tank2sim.cards.craft_terms.VELOCITY_TERMS` to its value, SI.
    u, v, r : casadi.SX
        m/s through the water, rad/s.
    """
    velocities = {"u": u, "v": v, "r": r}
    sums = {force: ca.SX(0) for force in "XYN"}
    for term in VELOCITY_TERMS:
        size = ca.fabs(velocities[term.size]) if term.size else 1
        sums[term.force] += coefficients[term.name] * velocities[term.factor] * size
    return sums["X"], sums["Y"], sums["N"]


def _craft_forces(s: Mapping[str, ca.SX], pushes: tuple[ca.SX, ca.SX, ca.SX]) -> tuple[ca.SX, ca.SX, ca.SX]:
    u, v, r = s["motion.u"], s["motion.v"], s["motion.r"]
    known = {name: s[f"derivatives.{name}"] for name in CRAFT_TERMS}
    parts = (
        inertial_forces(s["ship.mass"], s["ship.x_G"], u, v, r),
        added_mass_forces(known, u, v, r),
        craft_damping(known, u, v, r),
        pushes,
    )
    X, Y, N = (sum(column, ca.SX(0)) for column in zip(*parts, strict=True))
    return X, Y, N


def thrust_of(n: ca.SX, along: ca.SX, ahead: ca.SX, astern: ca.SX, loss: ca.SX) -> ca.SX:
    """T (N) = k n|n| - l max(n, 0) u_T of a thruster.

    Parameters
    ----------
    n : casadi.SX
        Revolutions, rad/s, positive ahead.
    along : casadi.SX
        u_T, velocity of the craft through the water along the thruster, m/s.
    ahead, astern : casadi.SX
        k for n > 0 and for n < 0, N s^2.
    loss : casadi.SX
        l, N s^2/m.
    """
    # k n|n| of both sides without a comparison, to which a solver would have to step up.
    return (ahead + astern) / 2 * n * ca.fabs(n) + (ahead - astern) / 2 * n * n - loss * ca.fmax(n, 0) * along


def revolutions_for(thrust: ca.SX, along: ca.SX, ahead: ca.SX, astern: ca.SX, loss: ca.SX) -> ca.SX:
    """Revolutions n (rad/s, positive ahead) that give a thrust: the inverse of :func:`thrust_of`.

    Ahead, k n^2 - l u_T n = T has one root that is not negative, also where the craft moves astern (u_T < 0). A thrust
    of 0 means a propeller at rest, or one that turns with the water where the craft moves ahead.

    Parameters
    ----------
    thrust : casadi.SX
        T, N, positive ahead.
    along, ahead, astern, loss : casadi.SX
        As in :func:`thrust_of`.
    """
    lost = loss * along
    forward = (lost + ca.sqrt(lost**2 + 4 * ahead * ca.fmax(thrust, 0))) / (2 * ahead)
    return ca.if_else(thrust >= 0, forward, -ca.sqrt(ca.fmax(-thrust, 0) / astern))


def revolutions_of_order(order: ca.SX, largest: ca.SX | float, exponent: ca.SX | float) -> ca.SX:
    """Revolutions m (o/m)^e (rad/s) to which an order goes; with 1/e the order for revolutions.

    The power is rounded near zero, so that its slope is finite there.

    Parameters
    ----------
    order, largest : casadi.SX
        o and m, rad/s.
    exponent : casadi.SX
        e.
    """
    share = order / largest
    return order * (share**2 + _ROUNDED_SHARE**2) ** ((exponent - 1) / 2)


def _thrusters(card: SteeredCard, s: Mapping[str, ca.SX]) -> tuple[list[Variable], tuple[ca.SX, ca.SX, ca.SX]]:
    """Variables of all thrusters, and their X, Y (N) and N (N m)."""
    cruising = cruising_revolutions(card)
    found: list[Variable] = []
    X, Y, N = ca.SX(0), ca.SX(0), ca.SX(0)
    for thruster, holds in zip(card.thrusters, pushes_ahead(card), strict=True):
        variables, thrust, azimuth = _thruster(thruster, cruising if holds else 0.0, s)
        found += variables
        places = {variable.name: variable.symbol for variable in variables}
        x, y = (places[f"thrusters.{thruster.name}.{axis}"] for axis in "xy")
        along, across = thrust * ca.cos(azimuth), thrust * ca.sin(azimuth)
        X, Y, N = X + along, Y + across, N + x * across - y * along
    return found, (X, Y, N)


def _thruster(thruster: ThrusterSection, start: float, s: Mapping[str, ca.SX]) -> tuple[list[Variable], ca.SX, ca.SX]:
    """Variables of a thruster, the symbol of its thrust (N), and its azimuth (rad)."""
    prefix = f"thrusters.{thruster.name}"
    where = f"thruster {thruster.name}"

    def constant(name: str, unit: str, description: str, value: float, shown: str | None = None) -> Parameter:
        return Parameter(
            f"{prefix}.{name}",
            unit,
            f"{description} of {where}",
            display_unit=shown,
            nominal=abs(value) or 1.0,
            minimum=0.0,
            start=value,
        )

    ahead = constant("ahead", "kg.m", "Thrust ahead over the square of the revolutions (rad/s)", thruster.ahead_Ns2)
    astern = constant("astern", "kg.m", "Thrust astern over the square of the revolutions", thruster.astern_Ns2)
    loss = constant("speed_loss", "kg", "Thrust lost by revolutions ahead and speed", thruster.speed_loss_kg)
    band = constant(
        "dead_band", "rad/s", "Largest order that leaves the propeller at rest", thruster.dead_band_radps, "rpm"
    )
    exponent = None
    ordered = start
    if thruster.order_exponent is not None:
        exponent = constant(
            "order_exponent", "1", "Power of the order that the revolutions follow", thruster.order_exponent
        )
        ordered = float(ca.evalf(revolutions_of_order(ca.SX(start), thruster.max_radps, 1 / thruster.order_exponent)))
    command = Input(
        f"{prefix}.command",
        "rad/s",
        f"Ordered revolutions of {where}, positive ahead",
        display_unit="rpm",
        nominal=thruster.max_radps / 2,
        minimum=thruster.lowest_radps,
        maximum=thruster.max_radps,
        start=ordered,
    )
    held = ca.fmax(thruster.lowest_radps, ca.fmin(thruster.max_radps, command.symbol))
    beyond = held * (ca.fabs(held) > band.symbol) if thruster.dead_band_radps else held
    largest = ca.if_else(held >= 0, thruster.max_radps, -thruster.lowest_radps)
    order = Quantity(
        f"{prefix}.order",
        "rad/s",
        f"Revolutions that {where} goes to: its order within its limits, 0 in the dead band",
        beyond if exponent is None else revolutions_of_order(beyond, largest, exponent.symbol),
        display_unit="rpm",
        nominal=thruster.max_radps,
    )
    places = [
        Parameter(
            f"{prefix}.{axis}",
            "m",
            f"Place of {where}, positive {way} of midships",
            nominal=abs(value) or 1.0,
            start=value,
            tunable=False,
        )
        for axis, way, value in (("x", "forward", thruster.x_m), ("y", "to starboard", thruster.y_m))
    ]
    variables: list[Variable] = [command, order, ahead, astern, loss, *places]
    if thruster.dead_band_radps:
        variables.append(band)
    if exponent is not None:
        variables.append(exponent)
    variables += (speed := _revolutions(thruster, prefix, where, order, start))
    turning, azimuth = _azimuth(thruster, prefix, where)
    variables += turning
    along = s["motion.u"] * ca.cos(azimuth) + s["motion.v"] * ca.sin(azimuth)
    thrust = Quantity(
        f"{prefix}.thrust",
        "N",
        f"Thrust of {where}, positive with revolutions ahead",
        thrust_of(speed[0].symbol, along, ahead.symbol, astern.symbol, loss.symbol),
        nominal=thruster.largest_thrust_N,
    )
    return [*variables, thrust], thrust.symbol, azimuth


def _revolutions(thruster: ThrusterSection, prefix: str, where: str, order: Quantity, start: float) -> list[Variable]:
    """``speed`` first: a state behind its lag, or the order itself."""
    described = {
        "name": f"{prefix}.speed",
        "unit": "rad/s",
        "description": f"Revolutions of {where}, positive ahead",
        "display_unit": "rpm",
        "nominal": thruster.max_radps,
    }
    if thruster.time_constant_s is None:
        return [Quantity(value=order.symbol, **described)]  # type: ignore[arg-type]
    first = Parameter(
        f"initial.{thruster.name}_speed",
        "rad/s",
        f"Revolutions of {where} at the start, positive ahead",
        display_unit="rpm",
        nominal=thruster.max_radps,
        start=start,
        tunable=False,
    )
    lag = Parameter(
        f"{prefix}.time_constant",
        "s",
        f"Lag of the revolutions of {where}",
        nominal=thruster.time_constant_s,
        minimum=1e-6,
        start=thruster.time_constant_s,
    )
    state = State(derivative=f"{prefix}.rate", start=first.symbol, trim=order.value, **described)  # type: ignore[arg-type]
    rate = Quantity(
        f"{prefix}.rate",
        "rad/s2",
        f"Rate of change of the revolutions of {where}",
        (order.symbol - state.symbol) / lag.symbol,
        nominal=thruster.max_radps,
    )
    return [state, rate, first, lag]


def _azimuth(thruster: ThrusterSection, prefix: str, where: str) -> tuple[list[Variable], ca.SX]:
    """Variables of a thruster that turns, and its azimuth (rad); none, and the number, of one that is fixed."""
    middle, reach = thruster.azimuth_rad, thruster.max_azimuth_rad
    if reach is None:
        return [], ca.SX(middle)
    command = Input(
        f"{prefix}.azimuth_command",
        "rad",
        f"Ordered direction in which {where} pushes the craft, clockwise from the bow",
        display_unit="deg",
        nominal=min(reach, 0.5),
        minimum=middle - reach,
        maximum=middle + reach,
        start=middle,
    )
    described = {
        "name": f"{prefix}.azimuth",
        "unit": "rad",
        "description": f"Direction in which {where} pushes the craft, clockwise from the bow",
        "display_unit": "deg",
        "nominal": min(reach, 0.5),
    }
    lag, held = thruster.azimuth_time_constant_s, ca.fmax(middle - reach, ca.fmin(middle + reach, command.symbol))
    if lag is None:
        angle = Quantity(value=held, **described)  # type: ignore[arg-type]
        return [command, angle], angle.symbol
    state = State(derivative=f"{prefix}.azimuth_rate", start=middle, trim=command.symbol, **described)  # type: ignore[arg-type]
    rate = (held - state.symbol) / lag
    if thruster.max_azimuth_rate_radps:
        limit = thruster.max_azimuth_rate_radps
        rate = ca.fmax(-limit, ca.fmin(limit, rate))
    turn = Quantity(
        f"{prefix}.azimuth_rate", "rad/s", f"Rate at which {where} turns, clockwise", rate, display_unit="deg/s"
    )
    return [command, state, turn], state.symbol


def _craft_speed(s: Mapping[str, ca.SX]) -> tuple[Quantity, ...]:
    u0 = s["ship.speed"]
    speed, drift = speed_and_drift(s, regular_speed(s), 1.0)
    margin = VALIDITY_MARGIN * u0
    inside = inside_range(speed.symbol - s["ship.fastest"], margin) * inside_range(
        s["ship.slowest"] - speed.symbol, margin
    )
    validity = Quantity(
        "validity",
        "1",
        "1 in the range of speeds in which the card holds, falling to 0 beyond",
        inside,
        minimum=0.0,
        maximum=1.0,
    )
    return speed, drift, validity
