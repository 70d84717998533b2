"""Heading autopilots as models of their own: PID on the heading error, or any linear law (:class:`LinearLaw`).

    e      = heading.command - motion.psi, brought within half a turn
    order  = Kp e - Kd r + z
    rudder = order, within the limit
    dz/dt  = Ki (e, within the band) + (rudder - order, within -z and 0)/Tt

The integral takes no more of a heading error than its band, so that a change of course, which is not a disturbance,
does not fill it. The term in Tt empties the integral z while the rudder is at its limit (back-calculation): Astrom &
Hagglund (2006), Advanced PID Control, 3.5. It empties z and no more: a large change of course alone orders far more
than the limit, and would fill z the other way, so that the ship crept to its new course.

The yaw rate r takes the place of the derivative of the heading, so that a new order gives no kick: Fossen (2011),
Handbook of Marine Craft Hydrodynamics and Motion Control, 12.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
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

    Without an integral gain it has no state.

    Parameters
    ----------
    name : str
        Name of the model.
    step_s : float
        Step of the integration of its one state, s.
    """
    psi, r, command = inputs = heading_signals()
    Kp, Kd, Ki, band = parameters = _parameters(gains)
    error = heading_error(psi, command)
    held = IntegralState(gains.anti_windup_time_s, gains.largest_rudder_rad)
    demand = Kp.symbol * error.symbol - Kd.symbol * r.symbol
    if gains.integral == 0:
        state_variables, described = held.without_integral(demand), "Heading autopilot: PD with limits"
        return steered_by(name, described, (*inputs, Kp, Kd, error), state_variables, step_s)
    state_variables = held.variables(demand, Ki.symbol * within(error.symbol, band.symbol))
    described = "Heading autopilot: PID with limits and anti-windup"
    return steered_by(name, described, (*inputs, *parameters, error), state_variables, step_s)


@dataclass(frozen=True)
class IntegralState:
    """The integral of a controller with its anti-windup time Tt (s) and the limit of the order (rad)."""

    anti_windup_time_s: float
    largest_rudder_rad: float

    def variables(self, demand: ca.SX, growth: ca.SX) -> tuple[Variable, ...]:
        """Variables of order = demand + z, within the limit, and dz/dt = growth + (rudder - order, within -z and 0)/Tt.

        `demand` is the rudder without the integral, rad; `growth` the rate of z away from the limit, rad/s.
        """
        tracking, start, most = parameters = self._parameters()
        integral = State(
            "autopilot.integral",
            "rad",
            "Rudder held against steady disturbances, positive to starboard",
            display_unit="deg",
            nominal=0.1,
            derivative="autopilot.integral_rate",
            start=start.symbol,
        )
        wanted, order = _limited(demand + integral.symbol, most)
        z = integral.symbol
        emptied = ca.fmax(-ca.fmax(z, 0), ca.fmin(-ca.fmin(z, 0), order.symbol - wanted.symbol))
        growing = growth + emptied / tracking.symbol
        rate = Quantity(
            integral.derivative, "rad/s", "Rate of the integral", growing, display_unit="deg/s", nominal=1e-3
        )
        return (*parameters, integral, wanted, order, rate)

    def without_integral(self, demand: ca.SX) -> tuple[Variable, ...]:
        """Variables of order = demand, within the limit."""
        most = self._parameters()[-1]
        return (most, *_limited(demand, most))

    def _parameters(self) -> tuple[Parameter, Parameter, Parameter]:
        return (
            Parameter(
                "autopilot.anti_windup_time",
                "s",
                "Time in which the integral is emptied while the rudder is at its limit",
                minimum=1e-3,
                nominal=self.anti_windup_time_s,
                start=self.anti_windup_time_s,
            ),
            Parameter(
                "initial.integral",
                "rad",
                "Rudder held against steady disturbances at the start, positive to starboard",
                display_unit="deg",
                start=0.0,
                nominal=0.1,
                tunable=False,
            ),
            limit("autopilot.max_rudder", "Largest rudder order either way", self.largest_rudder_rad),
        )


def _limited(demand: ca.SX, most: Parameter) -> tuple[Quantity, Quantity]:
    wanted = _angle("autopilot.demand", "Rudder that the controller would order without its limit", demand)
    put = within(wanted.symbol, most.symbol)
    order = _angle("rudder.command", "Rudder order, positive to starboard (turns the ship to starboard)", put)
    return wanted, order


def steered_by(
    name: str, description: str, given: Sequence[Variable], held: Sequence[Variable], step_s: float
) -> Model:
    """A model of a controller of its variables; outputs ``rudder.command`` and ``heading.error``."""
    empty = Model(name, description, step_s=step_s)
    return empty.extend(*given, *held, outputs=("rudder.command", "heading.error"))


def heading_error(psi: Input, command: Input) -> Quantity:
    """Ordered less actual heading, the short way round."""
    turned = command.symbol - psi.symbol
    return _angle(
        "heading.error", "Ordered less actual heading, -180 to 180 deg", ca.atan2(ca.sin(turned), ca.cos(turned))
    )


def heading_signals() -> tuple[Input, ...]:
    """Inputs of every heading autopilot: ``motion.psi``, ``motion.r``, ``heading.command``."""
    described = (
        ("motion.psi", "rad", "Heading of the ship, clockwise from north", "deg", 1.0),
        ("motion.r", "rad/s", "Yaw rate of the ship, positive to starboard", "deg/min", 0.01),
        ("heading.command", "rad", "Ordered heading, clockwise from north", "deg", 1.0),
    )
    return tuple(
        Input(name, unit, description, display_unit=shown, nominal=nominal)
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
            Parameter(name, unit, description, start=start, nominal=abs(start) or 1.0)
            for name, unit, description, start in described
        ),
        limit("autopilot.integral_band", "Most of a heading error that Ki acts on", gains.integral_band_rad),
    )


def limit(name: str, description: str, start: float) -> Parameter:
    """A parameter that bounds an angle either way; `start` in rad."""
    return Parameter(name, "rad", description, display_unit="deg", minimum=0.0, nominal=start, start=start)


def _angle(name: str, description: str, value: ca.SX) -> Quantity:
    return Quantity(name, "rad", description, value, display_unit="deg", nominal=0.35)


def within(value: ca.SX, bound: ca.SX) -> ca.SX:
    """The value, no further from 0 than the bound."""
    return ca.fmax(-bound, ca.fmin(bound, value))


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearLaw:
    """A linear controller of heading, rudder positive to starboard, with the integral and limits of every autopilot.

        dx/dt  = R [x; e; r; rudder]
        order  = d [x; e; r] + z
        rudder = order, within the limit
        dz/dt  = g [x; e; r], within its own limit, + (rudder - order, within -z and 0)/Tt

    e is the heading error and r the yaw rate. The states x see the rudder as it was limited, so that an observer among
    them is not misled by an order that the ship never got: Astrom & Hagglund (2006), Advanced PID Control, 3.5.

    Parameters
    ----------
    rates : array (n, n + 3)
        R: rates of the states by the states, heading error (rad), yaw rate (rad/s) and limited rudder order (rad).
    demand : array (n + 2,)
        d: rudder (rad) by the states, heading error and yaw rate.
    growth : array (n + 2,)
        g: growth of the integral (rad/s) by the same.
    growth_limit_radps : float
        The integral grows no faster than this, so that a change of course does not fill it.
    anti_windup_time_s, largest_rudder_rad : float
        Tt, s; and the limit of the order, rad.
    """

    rates: Array
    demand: Array
    growth: Array
    growth_limit_radps: float
    anti_windup_time_s: float
    largest_rudder_rad: float


def linear_autopilot_model(name: str, description: str, law: LinearLaw, step_s: float) -> Model:
    """The autopilot of a law: inputs and outputs as :func:`autopilot_model`.

    Raises
    ------
    ValueError
        The shapes of the law do not fit.
    """
    count = len(law.rates)
    if law.rates.shape != (count, count + 3) or law.demand.shape != (count + 2,) or law.growth.shape != (count + 2,):
        raise ValueError(f"{count} states do not fit {law.rates.shape}, {law.demand.shape}, {law.growth.shape}")
    psi, r, command = inputs = heading_signals()
    error = heading_error(psi, command)
    places = range(1, count + 1)
    states = [
        State(
            f"autopilot.state_{place}",
            "1",
            f"State {place} of the controller",
            derivative=f"autopilot.rate_{place}",
            start=0.0,
        )
        for place in places
    ]
    seen = ca.vcat([*(state.symbol for state in states), error.symbol, r.symbol])
    most = Parameter(
        "autopilot.integral_limit",
        "rad/s",
        "The integral grows no faster than this",
        display_unit="deg/s",
        minimum=0.0,
        nominal=law.growth_limit_radps,
        start=law.growth_limit_radps,
    )
    held = IntegralState(law.anti_windup_time_s, law.largest_rudder_rad).variables(
        _dot(law.demand, seen), within(_dot(law.growth, seen), most.symbol)
    )
    order = next(variable for variable in held if variable.name == "rudder.command")
    received = ca.vertcat(seen, order.symbol)
    rates = [
        Quantity(f"autopilot.rate_{place}", "1/s", f"Rate of state {place} of the controller", _dot(row, received))
        for place, row in zip(places, law.rates, strict=True)
    ]
    given: tuple[Variable, ...] = (*inputs, most, *states, *rates, error)
    return steered_by(name, description, given, held, step_s)


def _dot(coefficients: Array, of: ca.SX) -> ca.SX:
    return ca.dot(ca.DM(np.asarray(coefficients)), of)
