"""An autopilot of heading and speed for a craft with fixed thrusters, as a model of its own.

    e = heading.command - motion.psi, brought within half a turn        w = speed.command - motion.u
    N = Kp e - Kd r + z,    dz/dt = Ki (e, within the band) + (N limited - N, within -z and 0)/Tt
    X = R(speed.command) + Ku w + y,    dy/dt = Ki_u w + (X limited - X)/Tt
    T = P [X; N],    n of each thruster from its thrust curve at the speed u

R is the resistance of the card, P the pseudo-inverse of what the thrusts give, so that their squares are least: Fossen
(2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 11.2 (allocation), 12.2 (heading) and 15.2
(speed). The yaw moment comes first: the surge force is held within what the thrusters have left. The integrals are
emptied at the limits as in :mod:`tank2sim.dynamics.autopilot`; that of speed, which no course change fills, by all that
the limit cut off: Astrom & Hagglund (2006), Advanced PID Control, 3.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_TERMS
from tank2sim.cards.form import ThrusterSection
from tank2sim.dynamics.autopilot import heading_error, heading_signals, limit, within
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State, Variable
from tank2sim.dynamics.small_craft import craft_damping, revolutions_for, revolutions_of_order, thrust_of


@dataclass(frozen=True, kw_only=True, eq=False)
class CraftGains:
    """Gains of the autopilot of a craft, SI.

    Parameters
    ----------
    heading, yaw_rate, heading_integral : float
        Kp (N m for 1 rad), Kd (N m s), Ki (N m/s).
    integral_band_rad : float
        Most of a heading error that the integral takes.
    speed, speed_integral : float
        Ku (N s/m), Ki_u (N/m).
    anti_windup_time_s : float
        Tt.
    largest_moment_Nm : (float, float)
        Yaw moments to port (negative) and to starboard that are ordered at most.
    allocation : array (m, 2)
        P: thrusts of the m thrusters (N) by surge force (N) and yaw moment (N m).
    """

    heading: float
    yaw_rate: float
    heading_integral: float
    integral_band_rad: float
    speed: float
    speed_integral: float
    anti_windup_time_s: float
    largest_moment_Nm: tuple[float, float]
    allocation: Array


def craft_autopilot_model(card: SteeredCard, gains: CraftGains, step_s: float) -> Model:
    """The autopilot of a craft.

    Inputs ``motion.psi``, ``motion.r``, ``motion.u``, ``heading.command`` and ``speed.command`` (m/s, by default the
    speed of the card); outputs ``thrusters.<name>.command`` (rad/s), ``heading.error`` (rad) and ``speed.error`` (m/s).

    Parameters
    ----------
    card : SteeredCard
        Fixed thrusters and resistance are its.
    gains : CraftGains
    step_s : float
        Step of the integration of the two integrals, s.
    """
    psi, r, command = heading_signals()
    u = Input("motion.u", "m/s", "Surge velocity through the water, positive ahead")
    ordered = Input(
        "speed.command",
        "m/s",
        "Ordered surge velocity through the water",
        nominal=card.model.speed_mps,
        start=card.model.speed_mps,
    )
    error = heading_error(psi, command)
    lack = Quantity("speed.error", "m/s", "Ordered less actual surge velocity", ordered.symbol - u.symbol)
    Kp, Kd, Ki, Ku, Ki_u, Tt = tuned = _gains(gains)
    band = limit("autopilot.integral_band", "Most of a heading error that Ki acts on", gains.integral_band_rad)
    z, y = (
        State(f"autopilot.{name}_integral", unit, words, derivative=f"autopilot.{name}_rate_of_integral", start=0.0)
        for name, unit, words in (
            ("yaw", "N.m", "Yaw moment held against steady disturbances, positive to starboard"),
            ("surge", "N", "Surge force held against steady disturbances, positive ahead"),
        )
    )
    wanted_N = Quantity(
        "autopilot.demanded_moment",
        "N.m",
        "Yaw moment without its limits, positive to starboard",
        Kp.symbol * error.symbol - Kd.symbol * r.symbol + z.symbol,
    )
    low, high = gains.largest_moment_Nm
    N = Quantity(
        "autopilot.moment",
        "N.m",
        "Yaw moment of the thrusters, positive to starboard",
        ca.fmax(low, ca.fmin(high, wanted_N.symbol)),
    )
    known = {name: ca.SX(card.derivatives.get(name, 0.0)) for name in CRAFT_TERMS}
    resistance = -craft_damping(known, ordered.symbol, ca.SX(0), ca.SX(0))[0]
    wanted_X = Quantity(
        "autopilot.demanded_force",
        "N",
        "Surge force without its limits, positive ahead",
        resistance + Ku.symbol * lack.symbol + y.symbol,
    )
    X = Quantity(
        "autopilot.force",
        "N",
        "Surge force of the thrusters, positive ahead",
        _left(card.thrusters, gains.allocation, wanted_X.symbol, N.symbol, u.symbol),
    )
    emptied = N.symbol - wanted_N.symbol
    emptied = ca.fmax(-ca.fmax(z.symbol, 0), ca.fmin(-ca.fmin(z.symbol, 0), emptied))
    rates = (
        Quantity(
            "autopilot.yaw_rate_of_integral",
            "N.m/s",
            "Rate of the held yaw moment",
            Ki.symbol * within(error.symbol, band.symbol) + emptied / Tt.symbol,
        ),
        Quantity(
            "autopilot.surge_rate_of_integral",
            "N/s",
            "Rate of the held surge force",
            Ki_u.symbol * lack.symbol + (X.symbol - wanted_X.symbol) / Tt.symbol,
        ),
    )
    orders = [
        _order(thruster, share[0] * X.symbol + share[1] * N.symbol, u.symbol)
        for thruster, share in zip(card.thrusters, gains.allocation, strict=True)
    ]
    empty = Model(
        name=f"Autopilot of {card.ship.name}",
        description="Autopilot of heading and speed: PID and PI, with limits and anti-windup",
        step_s=step_s,
    )
    given: tuple[Variable, ...] = (psi, r, u, command, ordered, *tuned, band, error, lack)
    return empty.extend(
        *(*given, z, y, wanted_N, N, wanted_X, X, *rates, *orders),
        outputs=(*(order.name for order in orders), "heading.error", "speed.error"),
    )


def thrust_limits(thruster: ThrusterSection, u: Any) -> tuple[Any, Any]:
    """Least and largest thrust (N) of a fixed thruster at the surge velocity `u` (m/s)."""
    ahead, astern, loss = map(ca.SX, (thruster.ahead_Ns2, thruster.astern_Ns2, thruster.speed_loss_kg))
    least, most = (
        thrust_of(ca.SX(n), ca.SX(u), ahead, astern, loss) for n in (thruster.lowest_radps, thruster.max_radps)
    )
    return least, most


def _left(thrusters: Sequence[ThrusterSection], allocation: Array, X: ca.SX, N: ca.SX, u: ca.SX) -> ca.SX:
    """The surge force (N), within what the yaw moment N (N m) leaves of the thrusts."""
    least, most = [], []
    for thruster, (by_force, by_moment) in zip(thrusters, allocation, strict=True):
        if by_force > 0:
            low, high = thrust_limits(thruster, u)
            least.append((low - by_moment * N) / by_force)
            most.append((high - by_moment * N) / by_force)
    return ca.fmax(ca.mmax(ca.vcat(least)), ca.fmin(ca.mmin(ca.vcat(most)), X))


def _order(thruster: ThrusterSection, thrust: ca.SX, u: ca.SX) -> Quantity:
    if not thruster.astern_Ns2:  # reversing gives nothing
        thrust = ca.fmax(thrust, 0)
    n = revolutions_for(thrust, u, ca.SX(thruster.ahead_Ns2), ca.SX(thruster.astern_Ns2), ca.SX(thruster.speed_loss_kg))
    if thruster.order_exponent is not None:
        largest = ca.if_else(n >= 0, thruster.max_radps, -thruster.lowest_radps)
        n = revolutions_of_order(n, largest, 1 / thruster.order_exponent)
    return Quantity(
        f"thrusters.{thruster.name}.command",
        "rad/s",
        f"Ordered revolutions of thruster {thruster.name}, positive ahead",
        ca.fmax(thruster.lowest_radps, ca.fmin(thruster.max_radps, n)),
        display_unit="rpm",
        nominal=thruster.max_radps / 2,
    )


def _gains(gains: CraftGains) -> tuple[Parameter, ...]:
    described = (
        ("autopilot.Kp", "N.m", "Yaw moment by a heading error of 1 rad", gains.heading),
        ("autopilot.Kd", "N.m.s", "Yaw moment against yaw rate", gains.yaw_rate),
        ("autopilot.Ki", "N.m/s", "Growth of the yaw moment by a heading error that stays", gains.heading_integral),
        ("autopilot.Ku", "kg/s", "Surge force by speed error", gains.speed),
        ("autopilot.Ki_u", "N/m", "Growth of the surge force by a speed error that stays", gains.speed_integral),
        ("autopilot.anti_windup_time", "s", "Time in which integrals are emptied at a limit", gains.anti_windup_time_s),
    )
    return tuple(
        Parameter(name, unit, description, minimum=0.0, nominal=abs(start) or 1.0, start=start)
        for name, unit, description, start in described
    )
