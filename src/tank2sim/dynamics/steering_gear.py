"""The steering gear: first-order lag with limits of rate and angle."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.form import SteeringGear
from tank2sim.dynamics.model import Input, Parameter, Quantity, State, Variable
from tank2sim.notices import Notice

UNSTATED_LAG = 0.01
"""Time constant where a card states none, in L/u0: small against every motion of the hull, large against the step."""


def steering_gear(gear: SteeringGear | None, ship_time_s: float) -> tuple[tuple[Variable, ...], list[Notice]]:
    """Variables of the gear, and what a user should know.

    d(delta)/dt = sat((sat(order) - delta)/T), 0 while the gear has failed.

    Parameters
    ----------
    gear : SteeringGear or None
        Section of the card; a limit that is not stated is none.
    ship_time_s : float
        L/u0, s.

    Returns
    -------
    variables : tuple
        Inputs ``rudder.command`` (rad, + starboard) and ``steering.failed``, state ``rudder.angle``, quantities
        ``rudder.rate``, ``rudder.error`` (order less angle, which drives the rate) and ``rudder.effective`` (the angle
        that the hull forces see), parameters ``steering.*``.
    notices : list of Notice
    """
    gear = gear or SteeringGear()
    notices = [] if gear.time_constant_s else [assumed_lag_notice(ship_time_s)]
    command, failed = _inputs(gear)
    lag, *limits = _parameters(gear, ship_time_s)
    by_name = {limit.name: limit.symbol for limit in limits}
    start = Parameter(
        "initial.rudder_angle",
        "rad",
        "Rudder angle at the start, positive to starboard",
        display_unit="deg",
        nominal=0.35,
        start=0.0,
        tunable=False,
    )
    order = _within(command.symbol, by_name.get("steering.max_angle"))
    rudder = rudder_state(
        "rudder.angle",
        "Rudder angle, positive to starboard (turns the ship to starboard)",
        "rudder.rate",
        start.symbol,
        trim=ca.if_else(failed.symbol, start.symbol, order),
    )
    error = rudder_quantity("rudder.error", "Order less rudder angle, on which the gear acts", order - rudder.symbol)
    turning = _within(error.symbol / lag.symbol, by_name.get("steering.max_rate")) * (1 - failed.symbol)
    rate = rudder_rate(rudder.derivative, "Rate of the rudder, positive to starboard", turning)
    seen = rudder_quantity(
        "rudder.effective", "Rudder angle that the hull forces see, positive to starboard", rudder.symbol
    )
    return (command, failed, rudder, error, rate, seen, lag, *limits, start), notices


def assumed_lag_notice(ship_time_s: float) -> Notice:
    """Notice where a card states no time constant; L/u0 in s."""
    return Notice(
        "the card states no time constant of the steering gear: "
        f"{UNSTATED_LAG * ship_time_s:.3g} s is taken ({UNSTATED_LAG} L/u0)"
    )


def _inputs(gear: SteeringGear) -> tuple[Input, Input]:
    command = Input(
        "rudder.command",
        "rad",
        "Rudder order, positive to starboard (turns the ship to starboard)",
        display_unit="deg",
        nominal=0.35,
        minimum=-(gear.max_angle_rad or ca.pi / 2),
        maximum=gear.max_angle_rad or ca.pi / 2,
        accepted=ca.pi / 2,  # more is an angle in degrees; up to there the gear stops at its largest angle
    )
    failed = Input(
        "steering.failed", "1", "True: the steering gear has failed and the rudder stays where it is", boolean=True
    )
    return command, failed


def _parameters(gear: SteeringGear, ship_time_s: float) -> list[Parameter]:
    lag = Parameter(
        "steering.time_constant",
        "s",
        "Time constant of the steering gear",
        minimum=1e-6,
        start=gear.time_constant_s or UNSTATED_LAG * ship_time_s,
    )
    described = (
        ("steering.max_angle", "rad", "Largest rudder angle either way", gear.max_angle_rad, "deg"),
        ("steering.max_rate", "rad/s", "Largest rate of the rudder", gear.max_rate_radps, "deg/s"),
    )
    limits = (
        Parameter(name, unit, description, minimum=0.0, start=value, nominal=value, display_unit=display_unit)
        for name, unit, description, value, display_unit in described
        if value is not None
    )
    return [lag, *limits]


def rudder_quantity(name: str, description: str, value: ca.SX) -> Quantity:
    """An angle of a rudder or of its gear."""
    return Quantity(name, "rad", description, value, display_unit="deg", nominal=0.35)


def rudder_rate(name: str, description: str, value: ca.SX) -> Quantity:
    """The rate of such an angle."""
    return Quantity(name, "rad/s", description, value, display_unit="deg/s", nominal=0.05)


def rudder_state(
    name: str,
    description: str,
    derivative: str,
    start: ca.SX | float,
    *,
    trim: ca.SX | None = None,
    steady: bool = False,
) -> State:
    """Such an angle as a state; `derivative`, `start`, `trim` and `steady` as in :class:`.State`."""
    return State(
        name,
        "rad",
        description,
        display_unit="deg",
        nominal=0.35,
        derivative=derivative,
        start=start,
        trim=trim,
        steady=steady,
    )


def _within(value: ca.SX, limit: ca.SX | None) -> ca.SX:
    return value if limit is None else ca.fmax(-limit, ca.fmin(limit, value))
