"""Two propellers and rudders that are ordered apart."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca

from tank2sim.cards.card import MmgCard, SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, refuse_given
from tank2sim.dynamics.effects.forces import scales, with_forces
from tank2sim.dynamics.effects.froude_scale import rates
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.model import Input, Model, Quantity, State, Variable
from tank2sim.dynamics.propulsion import propeller_force
from tank2sim.dynamics.steering_gear import rudder_quantity, rudder_rate, rudder_state

SIDES = {"starboard": (1.0, "_right"), "port": (-1.0, "_left")}
"""Side to the sign of its y, and to the ending of its quantities in the MMG method."""

PROPELLER_PLACE = 0.2
"""Place of the propellers from the centre line over the beam where it is not stated: the blades stay well within the
side. Project choice."""


def _with_separate_orders(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Each propeller turns with n + n_i, each rudder is ordered to delta + delta_i, i = S, P, by a gear of its own:

        MMG card:        thrust T_i, inflow and normal force of each side, N_P = -sum of y_i (1 - t_P) T_i
        any other card:  X += T_S + T_P - T,   N -= y_P (T_S - T_P),   T_i = 1/2 Xnn 1/2 rho L^2 u0^2 n_i abs(n_i)/n0^2

    y to starboard: more thrust on the starboard side turns the bow to port; T is the thrust of both at their mean
    revolutions. A polynomial's rudder forces are those at the mean angle and revolutions. The gear of each rudder is
    that of the card.
    """
    if "propeller.speed_actual" not in model:
        raise card.fault("propulsion", "is missing", "twin_orders needs the revolutions of the propellers")
    if isinstance(card, MmgCard) and card.propeller.number == 1:
        raise card.fault("propeller.number", "is 1", "twin_orders is for two propellers and rudders")
    common = model["propeller.speed"]
    model = _with_bounds(model, common)
    model = _with_rudders(model, given)
    mean = (given["propeller_starboard"] + given["propeller_port"]) / 2
    model = model.redefine("propeller.speed_actual", lambda speed: speed + mean)
    shown = []
    for side, (_, suffix) in SIDES.items():
        turning = Quantity(
            f"propeller.speed_{side}",
            "rad/s",
            f"Revolutions of the {side} propeller, positive ahead",
            model.symbol("propeller.speed_actual") + given[f"propeller_{side}"] - mean,
            display_unit="rpm",
            nominal=common.nominal,
        )
        model = model.extend(turning)
        shown.append(turning.name)
        if isinstance(card, MmgCard):
            model = model.redefine(f"propeller.speed_actual{suffix}", lambda _, turning=turning: turning.symbol)  # type: ignore[misc]
    model = replace(model, outputs=(*model.outputs, *shown, *(f"rudder.angle_{side}" for side in SIDES)))
    if isinstance(card, MmgCard):
        refuse_given(card, TWIN_ORDERS.name, "place_m", "leave it out: propeller.y_P of the card holds")
        kept = tuple(one for one in model.parameters if one.name != "twin_orders.place")
        return replace(model, parameters=kept)
    return _with_thrust_of_each(model, given["place"])


def _with_bounds(model: Model, common: Variable) -> Model:
    """The offset of each propeller within the bounds of the order to both."""
    for side in SIDES:
        order = model[f"propeller.{side}_offset"]
        assert isinstance(order, Input) and isinstance(common, Input)
        bounded = replace(order, minimum=common.minimum, maximum=common.maximum, nominal=common.nominal)
        model = replace(model, inputs=tuple(bounded if one is order else one for one in model.inputs))
    return model


def _with_rudders(model: Model, given: EffectSymbols) -> Model:
    """A rudder to each side, with a gear as the model's and its angle in addition to ``rudder.angle`` as state."""
    common, rate = model["rudder.angle"], model["rudder.rate"]
    assert isinstance(common, State) and isinstance(rate, Quantity) and common.trim is not None
    order, expanded = model.symbol("rudder.command"), model.expand(rate.symbol)
    both = ca.vertcat(common.symbol, order)
    added = []
    for side, (_, suffix) in SIDES.items():
        ordered = order + given[f"rudder_{side}"]
        own = rudder_state(
            f"rudder.added_{side}",
            f"Angle of the {side} rudder in addition to rudder.angle, positive to starboard",
            f"rudder.rate_{side}",
            0.0,
            trim=ca.substitute(common.trim, order, ordered) - common.trim,
        )
        total = common.symbol + own.symbol
        angle = rudder_quantity(f"rudder.angle_{side}", f"Angle of the {side} rudder, positive to starboard", total)
        moving = rudder_rate(
            own.derivative,
            f"Rate of the {side} rudder less the rate of rudder.angle, positive to starboard",
            ca.substitute(expanded, both, ca.vertcat(total, ordered)) - rate.symbol,
        )
        model = model.extend(own, angle, moving)
        added.append(own.symbol)
        if f"rudder.effective{suffix}" in model:
            model = model.redefine(f"rudder.effective{suffix}", lambda angle, own=own: angle + own.symbol)  # type: ignore[misc]
    if "rudder.effective_right" in model:
        return model
    return model.redefine("rudder.effective", lambda angle: angle + (added[0] + added[1]) / 2)


def _with_thrust_of_each(model: Model, place: ca.SX) -> Model:
    nominal, Xnn = model.symbol("propulsion.nominal_speed"), model.symbol("propulsion.Xnn")
    scale = scales(model, model.symbol("ship.speed")).force / 2

    def thrust(n: ca.SX) -> ca.SX:
        """T_i of one of the two, N: propeller_force is zero at nominal revolutions, thrust at none."""
        return ca.SX(scale * (propeller_force(n, nominal, Xnn) + Xnn))

    each = {side: thrust(model.symbol(f"propeller.speed_{side}")) for side in SIDES}
    both = 2 * thrust(model.symbol("propeller.speed_actual"))
    moment = sum((sign * each[side] for side, (sign, _) in SIDES.items()), ca.SX(0))
    return with_forces(model, X=each["starboard"] + each["port"] - both, N=-place * moment)


def _propeller(side: str) -> EffectParameter:
    return EffectParameter(
        f"propeller_{side}_radps",
        f"revolutions of the {side} propeller in addition to the revolutions of both, positive ahead",
        -400.0,
        400.0,
        input_name=f"propeller.{side}_offset",
        absent=0.0,
        typical=rates(40.0),  # a fifth of the revolutions of a merchant ship (project choice)
    )


def _rudder(side: str) -> EffectParameter:
    return EffectParameter(
        f"rudder_{side}_rad",
        f"order of the {side} rudder in addition to the order of both, positive to starboard",
        -math.pi,
        math.pi,
        0.0,
        input_name=f"rudder.{side}_offset",
        absent=0.0,
    )


TWIN_ORDERS = Effect(
    name="twin_orders",
    acts_on="force",
    description="Two propellers and two rudders are ordered apart, and turn the ship by their difference.",
    source="statics of two thrusts; MMG method with two propellers and rudders",
    parameters=(
        *(_propeller(side) for side in SIDES),
        *(_rudder(side) for side in SIDES),
        EffectParameter(
            "place_m",
            "distance of each propeller from the centre line (of an MMG card its own y_P)",
            0.0,
            50.0,
            lambda card: PROPELLER_PLACE * model_particular(card, "beam_m"),
        ),
    ),
    equations=_with_separate_orders,
    sought=False,
    terminal="Orders of each propeller and rudder",
)
