"""Effects of the steering gear: what it makes of a rudder order."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, with_steps_for
from tank2sim.dynamics.effects.froude_scale import rates, time_scale_passages
from tank2sim.dynamics.model import Model, Quantity, State
from tank2sim.dynamics.steering_gear import assumed_lag_notice, rudder_rate, rudder_state


def _limited(value: ca.SX, limit: ca.SX) -> ca.SX:
    return ca.fmax(-limit, ca.fmin(limit, value))


def _with_rate_limit(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """abs(d delta/dt) <= k, in place of the card's own limit."""
    limit = given["max_rate"]
    if "steering.max_rate" in model:
        return model.substitute("steering.max_rate", limit)
    return model.redefine("rudder.rate", lambda rate: _limited(rate, limit))


RUDDER_RATE_LIMIT = Effect(
    name="rudder_rate_limit",
    acts_on="actuator",
    description="The steering gear turns the rudder no faster than this.",
    source="van Amerongen (1982), Adaptive steering of ships, thesis, Delft: pump capacity of the gear",
    parameters=(
        EffectParameter(
            "max_rate_radps",
            "largest rate of the rudder",
            1e-4,
            2.0,
            # 1 to 5 deg/s where L/u0 is 20 s; SOLAS II-1/29 asks for 2.3 deg/s.
            typical=rates(*(math.radians(angle) for angle in (40.0, 20.0, 60.0, 100.0))),
            worse=-1,
        ),
    ),
    equations=_with_rate_limit,
    in_place_of={"max_rate_radps": "steering.max_rate"},
)


def _with_lag(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """d delta/dt = (order - delta)/T, with T in place of the card's time constant."""
    assumed = assumed_lag_notice(card.ship.length_m / card.model.speed_mps)
    lagging = model.substitute("steering.time_constant", given["time_constant"])
    lagging = replace(lagging, notices=tuple(notice for notice in lagging.notices if notice != assumed))
    return with_steps_for(lagging, "rudder_lag.time_constant")


RUDDER_LAG = Effect(
    name="rudder_lag",
    acts_on="actuator",
    description="The rudder follows its order with this delay.",
    source="van Amerongen (1982), Adaptive steering of ships, thesis, Delft",
    parameters=(
        EffectParameter(
            "time_constant_s",
            "time constant of the steering gear",
            0.01,
            100.0,
            typical=time_scale_passages(0.1, 0.05, 0.2),  # 1 to 4 s where L/u0 is 20 s (project choice)
            worse=1,
        ),
    ),
    equations=_with_lag,
    in_place_of={"time_constant_s": "steering.time_constant"},
)


def _beyond(value: ca.SX, limit: ca.SX) -> ca.SX:
    """Excess of `value` over +-`limit`, 0 between them; continuous."""
    return value - _limited(value, limit)


CONTACT = 0.005
"""Time in which the rudder follows the gear once the gap between them is closed, in L/u0: a stiff contact, a tenth of a
second on a ship of 160 m (project choice); the play operator is its limit at 0."""


def _with_backlash(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Play between the gear and the rudder: the rudder stays until the gear has crossed the play, then follows.

        d delta/dt = e/T_c,   e what g - delta exceeds half the play b by, either way

    g is the gear's angle, delta the rudder's. For T_c to 0 it is the play operator, which lags by b/2 behind
    an angle that rises and by b/2 behind one that falls (Brokate and Sprekels 1996, Hysteresis and Phase Transitions).
    """
    rudder, rate = model["rudder.angle"], model["rudder.rate"]
    assert isinstance(rudder, State) and isinstance(rate, Quantity)
    contact = CONTACT * card.ship.length_m / card.model.speed_mps
    words = "of the steering gear before its play, positive to starboard"
    gear = rudder_state(
        "rudder_backlash.gear", f"Angle {words}", "rudder_backlash.rate", rudder.start, trim=rudder.trim
    )
    turning = rudder_rate(gear.derivative, f"Rate {words}", rate.value)
    played = _beyond(gear.symbol - rudder.symbol, given["width"] / 2) / contact
    return (
        model.extend(gear, turning)
        .redefine("rudder.error", lambda error: ca.substitute(error, rudder.symbol, gear.symbol))
        .redefine("rudder.rate", lambda _: played)
    )


RUDDER_BACKLASH = Effect(
    name="rudder_backlash",
    acts_on="actuator",
    description="There is play between the steering gear and the rudder: small changes do not reach it.",
    source="Brokate and Sprekels (1996), Hysteresis and Phase Transitions: play operator",
    parameters=(
        EffectParameter(
            "width_rad",
            "whole play of the gear",
            0.0,
            math.radians(20.0),
            absent=0.0,
            typical=(math.radians(2.0),),  # worn, but not yet out of the rules (project choice)
        ),
    ),
    equations=_with_backlash,
    states_behind={"rudder_backlash.gear": "rudder.command"},
)


def _with_dead_band(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """The gear acts on that part of order - delta which exceeds the band b: it stops b short of its order.

    The dead zone of a servo valve with overlap; unlike :data:`RUDDER_BACKLASH` the rudder is not late at first.
    """
    return model.redefine("rudder.error", lambda error: _beyond(error, given["half_width"]))


RUDDER_DEAD_BAND = Effect(
    name="rudder_dead_band",
    acts_on="actuator",
    description="The steering gear does not act on small differences between order and rudder.",
    source="van Amerongen (1982), Adaptive steering of ships, thesis, Delft; dead zone of the servo",
    parameters=(
        EffectParameter(
            "half_width_rad",
            "largest difference of order and rudder that moves nothing",
            0.0,
            math.radians(10.0),
            absent=0.0,
            typical=(math.radians(1.0),),  # half the play above, either way (project choice)
        ),
    ),
    equations=_with_dead_band,
    nearly_like=RUDDER_BACKLASH.name,
)


def _with_telemotor_lag(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """dq/dt = (order - q)/T, and the gear follows q: the first of the two stages of a steering gear.

    van Amerongen (1982): telemotor before rudder servo. In model tests it is the lag of the controller.
    """
    command = model.symbol("rudder.command")
    order = rudder_state(
        "telemotor_lag.order",
        "Rudder order as it reaches the gear, positive to starboard",
        "telemotor_lag.rate",
        model.symbol("initial.rudder_angle"),
        steady=True,
    )
    words = "Rate of the rudder order that reaches the gear, positive to starboard"
    rate = rudder_rate(order.derivative, words, ca.SX(0))
    # Its rate last: it alone still holds the command, which gives way to q everywhere else.
    lagging = (
        model.extend(order, rate)
        .substitute("rudder.command", order.symbol)
        .redefine(rate.name, lambda _: (command - order.symbol) / given["time_constant"])
    )
    return with_steps_for(lagging, "telemotor_lag.time_constant")


TELEMOTOR_LAG = Effect(
    name="telemotor_lag",
    acts_on="actuator",
    description="Orders reach the steering gear late.",
    source="van Amerongen (1982), Adaptive steering of ships, thesis, Delft",
    parameters=(
        EffectParameter(
            "time_constant_s",
            "time constant before the steering gear",
            0.01,
            100.0,
            typical=time_scale_passages(0.05, 0.025, 0.1),  # half the values of the gear itself (project choice)
        ),
    ),
    equations=_with_telemotor_lag,
)
