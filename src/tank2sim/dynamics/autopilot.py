"""A heading autopilot: PID on the heading error, with limits and anti-windup, as a model of its own.

    e      = heading.command - motion.psi, brought within half a turn
    order  = Kp e - Kd r + z
    rudder = order, within the limit
    dz/dt  = Ki (e, within the band) + (rudder - order)/Tt

The integral takes no more of a heading error than its band, so that a change of course, which is no disturbance, does
not fill it. The term in Tt empties the integral z while the rudder is at its limit (back-calculation): Astrom &
Hagglund (2006), Advanced PID Control, 3.5. The yaw rate r takes the place of the derivative of the heading, so that a
new order gives no kick: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, 12.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State, Variable


@dataclass(frozen=True, kw_only=True)
class HeadingGains:
    """Gains of the autopilot, rudder positive to starboard.

    Parameters
    ----------
    proportional : float
        Kp, rad of rudder for a rad of heading error.
    derivative : float
        Kd, s.
    integral : float
        Ki, 1/s.
    integral_band_rad : float
        Most of a heading error that the integral takes.
    anti_windup_time_s : float
        Tt, s.
    largest_rudder_rad : float
        The rudder is ordered no further either way.
    """

    proportional: float
    derivative: float
    integral: float
    integral_band_rad: float
    anti_windup_time_s: float
    largest_rudder_rad: float


def autopilot_model(name: str, gains: HeadingGains, step_s: float) -> Model:
    """The autopilot: inputs ``motion.psi``, ``motion.r``, ``heading.command``; output ``rudder.command``.

    Its inputs and its output are called as the signals of the ship that they are joined to.

    Parameters
    ----------
    name : str
        Name of the model.
    step_s : float
        Step of the integration of its one state, s.
    """
    psi, r, command = inputs = _inputs()
    Kp, Kd, Ki, tracking, band, limit, start = parameters = _parameters(gains)
    integral = _integral(start)
    turned = command.symbol - psi.symbol
    error = _angle(
        "heading.error", "Ordered less actual heading, -180 to 180 deg", ca.atan2(ca.sin(turned), ca.cos(turned))
    )
    wish = Kp.symbol * error.symbol - Kd.symbol * r.symbol + integral.symbol
    wanted = _angle("autopilot.demand", "Rudder that the controller would order without its limit", wish)
    put = _within(wanted.symbol, limit.symbol)
    order = _angle("rudder.command", "Rudder order, positive to starboard (turns the ship to starboard)", put)
    rate = Quantity(
        name="autopilot.integral_rate",
        unit="rad/s",
        description="Rate of the integral",
        display_unit="deg/s",
        nominal=1e-3,
        value=Ki.symbol * _within(error.symbol, band.symbol) + (order.symbol - wanted.symbol) / tracking.symbol,
    )
    empty = Model(
        name=name,
        description="Heading autopilot: PID with limits and anti-windup",
        states=(),
        inputs=(),
        parameters=(),
        quantities=(),
        outputs=(),
        step_s=step_s,
    )
    variables: tuple[Variable, ...] = (*inputs, *parameters, integral, error, wanted, order, rate)
    return empty.extend(*variables, outputs=(order.name, error.name))


def _inputs() -> tuple[Input, ...]:
    described = (
        ("motion.psi", "rad", "Heading of the ship, clockwise from north", "deg", 1.0),
        ("motion.r", "rad/s", "Yaw rate of the ship, positive to starboard", "deg/min", 0.01),
        ("heading.command", "rad", "Ordered heading, clockwise from north", "deg", 1.0),
    )
    return tuple(
        Input(name=name, unit=unit, description=description, display_unit=shown, nominal=nominal)
        for name, unit, description, shown, nominal in described
    )


def _parameters(gains: HeadingGains) -> tuple[Parameter, ...]:
    described = (
        ("autopilot.Kp", "1", "Rudder by heading error", gains.proportional),
        ("autopilot.Kd", "s", "Rudder against yaw rate", gains.derivative),
        ("autopilot.Ki", "1/s", "Growth of the rudder by a heading error that stays", gains.integral),
    )
    return (
        *(
            Parameter(name=name, unit=unit, description=description, start=start, nominal=abs(start) or 1.0)
            for name, unit, description, start in described
        ),
        Parameter(
            name="autopilot.anti_windup_time",
            unit="s",
            description="Time in which the integral is emptied while the rudder is at its limit",
            minimum=1e-3,
            nominal=gains.anti_windup_time_s,
            start=gains.anti_windup_time_s,
        ),
        *(
            Parameter(
                name=name,
                unit="rad",
                description=description,
                display_unit="deg",
                minimum=0.0,
                nominal=start,
                start=start,
            )
            for name, description, start in (
                ("autopilot.integral_band", "Most of a heading error that Ki acts on", gains.integral_band_rad),
                ("autopilot.max_rudder", "Largest rudder order either way", gains.largest_rudder_rad),
            )
        ),
        Parameter(
            name="initial.integral",
            unit="rad",
            description="Rudder held against steady disturbances at the start, positive to starboard",
            display_unit="deg",
            start=0.0,
            nominal=0.1,
            tunable=False,
        ),
    )


def _integral(start: Parameter) -> State:
    return State(
        name="autopilot.integral",
        unit="rad",
        description="Rudder held against steady disturbances, positive to starboard",
        display_unit="deg",
        nominal=0.1,
        derivative="autopilot.integral_rate",
        start=start.symbol,
    )


def _angle(name: str, description: str, value: ca.SX) -> Quantity:
    return Quantity(name=name, unit="rad", description=description, display_unit="deg", nominal=0.35, value=value)


def _within(value: ca.SX, limit: ca.SX) -> ca.SX:
    return ca.fmax(-limit, ca.fmin(limit, value))
