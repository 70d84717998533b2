"""The steering gear: first-order lag with limits of rate and angle."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.form import SteeringGear
from tank2sim.dynamics.model import Input, Parameter, Quantity, State, Variable

UNSTATED_LAG = 0.01
"""Time constant where a card states none, in L/u0: small against every motion of the hull, large against the step."""


def steering_gear(gear: SteeringGear | None, ship_time_s: float) -> tuple[tuple[Variable, ...], list[str]]:
    """Variables of the gear, and what a user should be told.

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
        ``rudder.rate`` and ``rudder.effective`` (the angle that the hull forces see), parameters ``steering.*``.
    notices : list of str
    """
    gear = gear or SteeringGear()
    notices = []
    if gear.time_constant_s is None:
        notices.append(
            "the card states no time constant of the steering gear: "
            f"{UNSTATED_LAG * ship_time_s:.3g} s is taken ({UNSTATED_LAG} L/u0)"
        )
    lag = Parameter(
        name="steering.time_constant",
        unit="s",
        description="Time constant of the steering gear",
        minimum=1e-6,
        start=gear.time_constant_s or UNSTATED_LAG * ship_time_s,
    )
    command = Input(
        name="rudder.command",
        unit="rad",
        description="Rudder order, positive to starboard (turns the ship to starboard)",
        display_unit="deg",
        nominal=0.35,
        minimum=-(gear.max_angle_rad or ca.pi / 2),
        maximum=gear.max_angle_rad or ca.pi / 2,
    )
    failed = Input(
        name="steering.failed",
        unit="1",
        description="True: the steering gear has failed and the rudder stays where it is",
        boolean=True,
    )
    parameters = [lag]
    order, limited_rate = command.symbol, None
    if gear.max_angle_rad is not None:
        angle = _limit("steering.max_angle", "rad", "Largest rudder angle either way", gear.max_angle_rad, "deg")
        parameters.append(angle)
        order = ca.fmax(-angle.symbol, ca.fmin(angle.symbol, order))
    if gear.max_rate_radps is not None:
        limited_rate = _limit("steering.max_rate", "rad/s", "Largest rate of the rudder", gear.max_rate_radps, "deg/s")
        parameters.append(limited_rate)
    start = Parameter(
        name="initial.rudder_angle",
        unit="rad",
        description="Rudder angle at the start, positive to starboard",
        display_unit="deg",
        nominal=0.35,
        start=0.0,
        tunable=False,
    )
    rudder = State(
        name="rudder.angle",
        unit="rad",
        description="Rudder angle, positive to starboard (turns the ship to starboard)",
        display_unit="deg",
        nominal=0.35,
        derivative="rudder.rate",
        start=start.symbol,
        trim=ca.if_else(failed.symbol, start.symbol, order),
    )
    rate = (order - rudder.symbol) / lag.symbol
    if limited_rate is not None:
        rate = ca.fmax(-limited_rate.symbol, ca.fmin(limited_rate.symbol, rate))
    quantities = (
        Quantity(
            name="rudder.rate",
            unit="rad/s",
            description="Rate of the rudder, positive to starboard",
            display_unit="deg/s",
            nominal=0.05,
            value=rate * (1 - failed.symbol),
        ),
        Quantity(
            name="rudder.effective",
            unit="rad",
            description="Rudder angle that the hull forces see, positive to starboard",
            display_unit="deg",
            nominal=0.35,
            value=rudder.symbol,
        ),
    )
    return (command, failed, rudder, *quantities, *parameters, start), notices


def _limit(name: str, unit: str, description: str, value: float, display_unit: str) -> Parameter:
    return Parameter(
        name=name,
        unit=unit,
        description=description,
        minimum=0.0,
        start=value,
        nominal=value,
        display_unit=display_unit,
    )
