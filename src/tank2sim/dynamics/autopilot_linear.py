"""A heading autopilot with states of its own: any linear law, with the integral and the limits of every autopilot.

    dx/dt  = R [x; e; r; rudder]
    order  = d [x; e; r] + z
    rudder = order, within the limit
    dz/dt  = g [x; e; r], within its own limit, + (rudder - order, within -z and 0)/Tt

e is the heading error and r the yaw rate, as in :mod:`tank2sim.dynamics.autopilot`. The states x see the rudder as it
was limited, so that an observer among them is not misled by an order that the ship never got: Astrom & Hagglund (2006),
Advanced PID Control, 3.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.autopilot import IntegralState, heading_error, heading_signals, steered_by, within
from tank2sim.dynamics.model import Model, Parameter, Quantity, State, Variable


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearLaw:
    """A linear controller of heading, rudder positive to starboard.

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
    """The autopilot of a law: inputs and outputs as :func:`tank2sim.dynamics.autopilot.autopilot_model`.

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
    states = [_state(place) for place in range(1, count + 1)]
    seen = ca.vcat([*(state.symbol for state in states), error.symbol, r.symbol])
    most = Parameter(
        name="autopilot.integral_limit",
        unit="rad/s",
        description="The integral grows no faster than this",
        display_unit="deg/s",
        minimum=0.0,
        nominal=law.growth_limit_radps,
        start=law.growth_limit_radps,
    )
    held = IntegralState(law.anti_windup_time_s, law.largest_rudder_rad).variables(
        _row(law.demand, seen), within(_row(law.growth, seen), most.symbol)
    )
    order = next(variable for variable in held if variable.name == "rudder.command")
    rates = [_rate(place, _row(row, ca.vertcat(seen, order.symbol))) for place, row in enumerate(law.rates, start=1)]
    given: tuple[Variable, ...] = (*inputs, most, *states, *rates, error)
    return steered_by(name, description, given, held, step_s)


def _row(coefficients: Array, of: ca.SX) -> ca.SX:
    return ca.dot(ca.DM(np.asarray(coefficients)), of)


def _state(place: int) -> State:
    return State(
        name=f"autopilot.state_{place}",
        unit="1",
        description=f"State {place} of the controller",
        derivative=f"autopilot.rate_{place}",
        start=0.0,
    )


def _rate(place: int, value: ca.SX) -> Quantity:
    return Quantity(
        name=f"autopilot.rate_{place}",
        unit="1/s",
        description=f"Rate of state {place} of the controller",
        value=value,
    )
