"""Effects of propeller and engine."""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.form import ASTERN_THRUST
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, side_force, with_steps_for
from tank2sim.dynamics.effects.forces import scales, with_forces, with_side_force
from tank2sim.dynamics.effects.particulars import with_particulars
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State
from tank2sim.dynamics.propulsion import propeller_force
from tank2sim.notices import Notice

RESISTANCE = 6e-4
"""Resistance, and so effective thrust, at u0 over 1/2 rho L^2 u0^2 where a card states no propulsion: between those of
a tanker (5e-4) and of the Mariner (8e-4); project choice."""


def resistance_prime(model: Model, card: SteeredCard) -> ca.SX:
    """Resistance at u0 over 1/2 rho L^2 u0^2: R_0 of an MMG card, Xnn of [propulsion], or :data:`RESISTANCE`."""
    if card.model.kind == "mmg":
        return -model.symbol("derivatives.X0")
    if "propulsion.Xnn" in model:
        return model.symbol("propulsion.Xnn")
    return ca.SX(RESISTANCE)


def _relative_revolutions(model: Model) -> ca.SX:
    """n/n0, positive ahead; 1 on a card without propulsion, whose revolutions are the nominal ones."""
    if "propeller.speed_actual" not in model:
        return ca.SX(1)
    return model.symbol("propeller.speed_actual") / model.symbol("propulsion.nominal_speed")


def _with_side_force(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = 1/2 rho L^2 u0^2 (Y', L N') n abs(n)/n0^2.

    The blades meet the upper and the lower half of the wake unlike: Saunders (1957), Hydrodynamics in Ship Design;
    Brix (ed.) (1993), Manoeuvring Technical Manual. It does not fall with the ship's speed as all else does.
    """
    n = _relative_revolutions(model)
    force = scales(model, model.symbol("ship.speed")).force * n * ca.fabs(n)
    return with_side_force(model, given, force)


PROPELLER_SIDE_FORCE = Effect(
    name="propeller_side_force",
    acts_on="force",
    description="A single propeller pushes the stern to one side as it turns.",
    source="Saunders (1957), Hydrodynamics in Ship Design; Brix (ed.) (1993), Manoeuvring Technical Manual",
    # Y0 and N0 of the Mariner (Chislett and Strom-Tejsen 1965), a ship with one screw.
    parameters=side_force("at nominal revolutions, prime at u0", -4e-5, 3e-5),
    equations=_with_side_force,
)


def _with_walk(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = 1/2 rho L^2 u0^2 (Y', L N') min(n, 0)^2/n0^2: only while the propeller turns astern.

    Then its jet meets one side of the stern: Brix (ed.) (1993), Manoeuvring Technical Manual; a right-handed propeller
    throws the stern to port and the bow to starboard (Y' < 0, N' > 0).
    """
    if card.propulsion is None:
        raise card.fault("propulsion", "is missing", "propeller_walk needs nominal_rpm and Xnn")
    astern = ca.fmin(_relative_revolutions(model), 0)
    force = scales(model, model.symbol("ship.speed")).force * astern**2
    return with_side_force(model, given, force)


PROPELLER_WALK = Effect(
    name="propeller_walk",
    acts_on="force",
    description="A propeller that turns astern throws the stern to one side.",
    source="Brix (ed.) (1993), Manoeuvring Technical Manual",
    # A few times the side force ahead (project choice).
    parameters=side_force("at nominal revolutions, prime at u0", -2e-4, 1e-4),
    equations=_with_walk,
)


def _with_loading_side_force(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = 1/2 rho L^2 U^2 (Y', L N') eta, with the propeller loading eta = (n/n0) u0/U - 1.

    An asymmetry that vanishes where the propeller holds the speed and grows as the ship slows: the form is a project
    choice, after the KVLCC2 (SIMMAN 2008) whose tactical diameters differ by 8 % between the sides, but not by one
    constant.
    """
    speed = model.symbol("motion.speed")
    # U^2 eta, without its division by U at rest
    loading = speed * (_relative_revolutions(model) * model.symbol("ship.speed") - speed)
    force = scales(model, ca.SX(1)).force * loading
    return with_side_force(model, given, force)


LOADING_SIDE_FORCE = Effect(
    name="loading_side_force",
    acts_on="force",
    description="The harder the propeller works for the ship's speed, the more it pushes the stern to one side.",
    source="form chosen here, after the asymmetry of the KVLCC2 in SIMMAN 2008",
    # The Mariner's side force, at the loading of a ship that has lost a third of its speed (project choice).
    parameters=side_force("by propeller loading, prime", -8e-5, 6e-5),
    equations=_with_loading_side_force,
)


def _with_droop(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """n = order (1 - droop (1 - u/u0)): the engine is not held at its revolutions when the ship slows.

    First order in the loss of speed of an engine at constant torque or power, whose propeller load rises in a turn: the
    propulsion strategies that ITTC 7.5-02-06-01, free running model tests, distinguishes. On a card without propulsion
    the order is the nominal one, and :data:`RESISTANCE` takes the place of Xnn.
    """
    loss = 1 - model.symbol("motion.u") / model.symbol("ship.speed")
    if "propeller.speed_actual" in model:
        return model.redefine("propeller.speed_actual", lambda order: order * (1 - given["droop"] * loss))
    text = Notice(f"the card states no propulsion: engine_droop takes Xnn = {RESISTANCE:g}, a typical resistance at u0")
    lost = propeller_force(1 - given["droop"] * loss, ca.SX(1), ca.SX(RESISTANCE))
    thrust = scales(model, model.symbol("ship.speed")).force * lost
    return with_forces(model.extend(notices=[text]), X=thrust)


ENGINE_DROOP = Effect(
    name="engine_droop",
    acts_on="propulsion",
    description="The engine slows down when the ship loses speed.",
    source="ITTC 7.5-02-06-01, propulsion strategy of free running tests; first order in the loss of speed",
    parameters=(
        EffectParameter(
            "droop",
            "relative loss of revolutions by relative loss of speed",
            -1.0,
            1.0,
            absent=0.0,
            typical=(
                0.3,
            ),  # between constant revolutions (0) and torque in proportion to n^2 (towards 1) (project choice)
        ),
    ),
    equations=_with_droop,
)


def _start(model: Model, order: Input) -> tuple[Parameter, ca.SX]:
    """Parameter ``initial.propeller_speed``, and the revolutions (rad/s) at the start that follow from it."""
    start = Parameter(
        "initial.propeller_speed",
        order.unit,
        f"Revolutions at the start, positive ahead; at {order.start:g}, where it is not set, the revolutions of a "
        "ship that starts at rest (initial.u = 0) are zero",
        display_unit=order.display_unit,
        nominal=order.nominal,
        start=order.start,
        tunable=False,
    )
    berthed = ca.logic_and(model.symbol("initial.u") == 0, start.symbol == order.start)
    return start, ca.if_else(berthed, 0, start.symbol)


def _revolutions_reached(effect: str, order: Input, start: ca.SX) -> State:
    return State(
        f"{effect}.speed",
        order.unit,
        "Revolutions that the engine has reached, positive ahead",
        display_unit=order.display_unit,
        nominal=order.nominal,
        derivative=f"{effect}.rate",
        start=start,
        steady=True,
    )


def _with_engine_lag(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """dn/dt = (order - n)/T: the engine's gear between telegraph and propeller, of the first order.

    ITTC 7.5-02-06-03 asks for the time constants of engine and steering gear. A diesel that must be
    stopped before it is reversed takes longer still. The engine of a ship at the berth (``initial.u`` = 0) is stopped,
    unless ``initial.propeller_speed`` is set.
    """
    if "propeller.speed_actual" not in model:
        raise card.fault("effects", "engine_lag needs an engine", "give the card [propulsion] nominal_rpm and Xnn")
    order = model["propeller.speed"]
    assert isinstance(order, Input)
    start, begun = _start(model, order)
    turning = _revolutions_reached("engine_lag", order, begun)
    rate = Quantity("engine_lag.rate", "rad/s2", "Rate of the revolutions", ca.SX(0), nominal=0.1 * order.nominal)
    # Its rate last: it alone still holds the order, which gives way to what the engine has reached everywhere else.
    lagging = (
        model.extend(start, turning, rate)
        .substitute(order.name, turning.symbol)
        .redefine(rate.name, lambda _: (order.symbol - turning.symbol) / given["time_constant"])
    )
    return with_steps_for(lagging, "engine_lag.time_constant")


ENGINE_LAG = Effect(
    name="engine_lag",
    acts_on="propulsion",
    description="The engine reaches its ordered revolutions with this delay.",
    source="ITTC 7.5-02-06-03, validation of manoeuvring simulation models: time constant of the engine",
    parameters=(EffectParameter("time_constant_s", "time constant of the engine", 0.01, 600.0),),
    equations=_with_engine_lag,
    states_behind={"engine_lag.speed": "propeller.speed"},
)


STOP_ORDER = 0.02
"""Revolutions over the nominal ones below which an order is Stop: a telegraph has no lower ahead. Project choice."""

_CLUTCHING = 0.05
"""Share of the way of the engine's gear in its new direction over which it takes the order: project choice."""


def _with_telegraph(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """An engine that must be started, and stopped before it is reversed.

    A state g goes from 0 (stopped) to 1 (running ahead) or -1 (astern) in the time `start`, back to 0 in `reversal`
    less `start`, and dn/dt = (order - n)/T only where g has come to the side of the order, else dn/dt = -n/T. So an
    order from stop acts after `start`, and one to the other direction after `reversal`, while the propeller slows down.
    ITTC 7.5-02-06-03 asks for the time constant and the reversal of the engine; the form is a project choice.
    """
    if "propeller.speed_actual" not in model or card.propulsion is None:
        raise card.fault("effects", "engine_telegraph needs an engine", "give the card [propulsion]")
    order = model["propeller.speed"]
    assert isinstance(order, Input)
    start, begun = _start(model, order)
    turning = _revolutions_reached("engine_telegraph", order, begun)
    least = STOP_ORDER * model.symbol("propulsion.nominal_speed") if "propulsion.nominal_speed" in model else STOP_ORDER
    wanted = (order.symbol > least) - (order.symbol < -least)
    gear = State(
        "engine_telegraph.gear",
        "1",
        "The engine's gear: 1 running ahead, 0 stopped, -1 running astern",
        derivative="engine_telegraph.gear_rate",
        start=(begun > least) - (begun < -least),
        trim=wanted,
    )
    starting, stopping = given["start"], ca.fmax(given["reversal"] - given["start"], 0.01)
    towards_stop = ca.fabs(wanted) * gear.symbol * wanted < 0
    leaving = ca.logic_or(towards_stop, wanted == 0)
    pace = ca.if_else(leaving, 1 / stopping, 1 / starting)
    # Proportional within the last step of the way, so that it comes to rest at its end.
    step = 1.0 / _CLUTCHING
    moving = ca.fmax(-1, ca.fmin(1, step * (wanted - gear.symbol))) * pace
    engaged = ca.fmax(0, ca.fmin(1, (gear.symbol * wanted - (1 - 2 * _CLUTCHING)) / _CLUTCHING))
    rates = (
        Quantity("engine_telegraph.rate", "rad/s2", "Rate of the revolutions", ca.SX(0)),
        Quantity("engine_telegraph.gear_rate", "1/s", "Rate of the engine's gear", ca.SX(0)),
    )
    lagging = (
        model.extend(start, turning, gear, *rates)
        .substitute(order.name, turning.symbol)
        .redefine(rates[0].name, lambda _: (engaged * order.symbol - turning.symbol) / given["time_constant"])
        .redefine(rates[1].name, lambda _: moving)
    )
    return with_steps_for(lagging, "engine_telegraph.time_constant")


ENGINE_TELEGRAPH = Effect(
    name="engine_telegraph",
    acts_on="propulsion",
    description="The engine needs time to start, and more to be stopped and reversed.",
    source="ITTC 7.5-02-06-03, validation of manoeuvring simulation models; form chosen here",
    parameters=(
        EffectParameter("time_constant_s", "time constant of the engine", 0.01, 600.0),
        EffectParameter("start_s", "time from an order to the first turn of a stopped engine", 0.1, 600.0),
        EffectParameter(
            "reversal_s", "time from an order astern to the first turn astern, more than start_s", 0.2, 900.0
        ),
    ),
    equations=_with_telegraph,
    sought=False,
    states_behind={"engine_telegraph.speed": "propeller.speed"},
)


def _with_weaker_astern(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X += Xnn 1/2 rho L^2 u0^2 (1 - f) min(n, 0)^2/n0^2: astern the thrust is f of what it is ahead.

    Blades are cambered and twisted for ahead, and astern the hull takes more of the thrust: Harvald (1983), Resistance
    and Propulsion of Ships.
    """
    if "propulsion.Xnn" not in model:
        raise card.fault("propulsion", "has no Xnn", "astern_thrust is for linear and abkowitz cards with [propulsion]")
    astern = ca.fmin(_relative_revolutions(model), 0)
    force = scales(model, model.symbol("ship.speed")).force * model.symbol("propulsion.Xnn")
    return with_forces(model, X=force * (1 - given["factor"]) * astern**2)


REVERSED_THRUST = Effect(
    name="astern_thrust",
    acts_on="force",
    description="A propeller that turns astern pulls less than it pushes ahead.",
    source="Harvald (1983), Resistance and Propulsion of Ships",
    parameters=(
        EffectParameter(
            "factor",
            "thrust astern over that ahead at the same revolutions",
            0.0,
            1.5,
            absent=1.0,
            typical=(ASTERN_THRUST,),
        ),
    ),
    equations=_with_weaker_astern,
    in_mmg=True,
    sought=False,
)


TANKER_THRUST = (-0.175, 0.33, 0.233)
TANKER_SIDE = (-7.90e-5, 7.99e-3, -5.87e-3)
TANKER_YAW = (3.50e-5, -3.17e-3, 2.33e-3)
"""Thrust and side force of the right-handed propeller of the Esso Osaka, turning astern: C(0), slope of C by J, and -J
from which C is constant; A or B at J = 0, its slopes by J between the two bounds below and beyond the second. Miyauchi
et al. (2022), J. Mar. Sci. Technol. 27, after Hachii, in the transcription that goes with the authors' simulator."""

SIDE_BOUNDS = (0.06, 0.35)
"""-J below which A and B are constant, and where their slopes change: the same source."""


def _with_propeller_astern(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Thrust and side force of a propeller that turns astern, by its J = u/(n D), in place of the card's:

        X = c rho D^4 n^2 C(J),   Y = k 1/2 rho L T D^2 n^2 A(J),   N = k 1/2 rho L^2 T D^2 n^2 B(J),   n < 0

    C, A, B are continuous and linear between bounds of J (:data:`TANKER_THRUST`, :data:`SIDE_BOUNDS`), so that n^2 C is
    regular at n = 0. The stern goes to port while the ship moves ahead, most at J = -0.35, and hardly at rest.
    """
    if "propulsion.Xnn" not in model:
        raise card.fault("propulsion", "has no Xnn", "propeller_astern is for linear and abkowitz cards with it")
    model, (draught, diameter) = with_particulars(model, card, "draught_m", "propeller_diameter_m")
    density, length = model.symbol("ship.water_density"), model.symbol("ship.length")
    turning = -ca.fmin(model.symbol("propeller.speed_actual"), 0) / (2 * math.pi)
    met = model.symbol("motion.u") / diameter
    first, second = (bound * turning for bound in SIDE_BOUNDS)

    def across(at_rest: float, slope: float, beyond: float) -> ca.SX:
        """n^2 A(J), with n < 0 and J = -met/turning."""
        within = ca.fmin(ca.fmax(met, first), second)
        return ca.SX(turning * (at_rest * turning - slope * within - beyond * ca.fmax(met - second, 0)))

    at_rest, slope, bound = TANKER_THRUST
    pull = turning * (at_rest * turning - slope * ca.fmin(met, bound * turning))
    of_card = scales(model, model.symbol("ship.speed")).force * model.symbol("propulsion.Xnn")
    of_card = of_card * ca.fmin(_relative_revolutions(model), 0) ** 2
    unit = given["side_force"] * density / 2 * length * draught * diameter**2
    return with_forces(
        model,
        X=given["thrust"] * density * diameter**4 * pull + of_card,
        Y=unit * across(*TANKER_SIDE),
        N=unit * length * across(*TANKER_YAW),
    )


PROPELLER_ASTERN = Effect(
    name="propeller_astern",
    acts_on="force",
    description="A propeller that turns astern pulls, and throws the stern aside, by the speed that is left.",
    source="Miyauchi et al. (2022), J. Mar. Sci. Technol. 27, after Hachii: tanker Esso Osaka",
    parameters=(
        EffectParameter(
            "side_force",
            "share of the published side force; negative for a left-handed propeller",
            -5.0,
            5.0,
            typical=(1.0,),
        ),
        EffectParameter("thrust", "share of the published thrust astern", 0.0, 3.0, 1.0),
    ),
    equations=_with_propeller_astern,
    in_mmg=True,
    includes=("propeller_walk", "astern_thrust"),
    sought=False,
)
