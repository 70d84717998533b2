"""A ship and its autopilot in one model, and the yaw that waves put upon it."""

from __future__ import annotations

from dataclasses import replace

from tank2sim.dynamics.model import Input, Model, Quantity

YAW_DISTURBANCE = "waves.yaw_acceleration"
"""Input of :func:`with_yaw_disturbance`, rad/s2."""

AUTOPILOT_STEERS, AUTOPILOT_ORDER = "autopilot.steers", "autopilot.order"
"""Input and output of :func:`ship_steered_by_either`."""


def closed_loop_model(ship: Model, autopilot: Model) -> Model:
    """One model of both: each input of the one that has the name of the other's state or quantity is joined to it.

    ``heading.command`` stays an input; outputs are taken from both. The equations of the two models stay as they
    are: an input that is joined becomes a quantity ``joint.<name>`` whose value is the signal itself.

    Raises
    ------
    ValueError
        Both have a variable of the same name that is not joined.
    """
    joints: list[Quantity] = []
    for receiver, sender in ((ship, autopilot), (autopilot, ship)):
        sent = {state.name: state for state in (*sender.states, *sender.quantities)}
        joints += (
            Quantity(
                f"joint.{one.name}",
                one.unit,
                f"What is received of: {one.description}",
                sent[one.name].symbol,
                symbol=one.symbol,
            )
            for one in receiver.inputs
            if one.name in sent
        )
    joined = {joint.name.removeprefix("joint.") for joint in joints}
    return Model(
        name=f"{ship.name} with {autopilot.name}",
        source=ship.source,
        description=f"{ship.description}; {autopilot.description}",
        states=(*ship.states, *autopilot.states),
        inputs=tuple(variable for variable in (*ship.inputs, *autopilot.inputs) if variable.name not in joined),
        parameters=(*ship.parameters, *autopilot.parameters),
        quantities=(*ship.quantities, *autopilot.quantities, *joints),
        outputs=(*ship.outputs, *autopilot.outputs),
        step_s=min(ship.step_s, autopilot.step_s),
        notices=(*ship.notices, *autopilot.notices),
    )


def ship_steered_by_either(ship: Model, autopilot: Model) -> Model:
    """One model of both, in which the autopilot steers while the input ``autopilot.steers`` is true, else the helm.

        rudder order = autopilot.order  or  rudder.command

    ``autopilot.order`` is an output. While the helm steers, the integral z of the autopilot goes to zero as
    dz/dt = -z/Tt, Tt its anti-windup time, so that the autopilot begins without what it held before.

    Parameters
    ----------
    autopilot : Model
        Model by :func:`tank2sim.dynamics.autopilot.autopilot_model`, with an integral.
    """
    order = next(quantity for quantity in autopilot.quantities if quantity.name == "rudder.command")
    words = "Rudder order of the autopilot, positive to starboard"
    renamed = replace(order, name=AUTOPILOT_ORDER, description=words)
    others = tuple(quantity for quantity in autopilot.quantities if quantity is not order)
    outputs = (*(name for name in autopilot.outputs if name != order.name), AUTOPILOT_ORDER)
    loop = closed_loop_model(ship, replace(autopilot, quantities=(*others, renamed), outputs=outputs))
    steers = Input(AUTOPILOT_STEERS, "1", "True: the autopilot steers", boolean=True)
    helm, on = loop.symbol("rudder.command"), steers.symbol
    integral, time = loop.symbol("autopilot.integral"), loop.symbol("autopilot.anti_windup_time")
    steered = (
        loop.extend(steers)
        .substitute("rudder.command", on * order.symbol + (1 - on) * helm)
        .redefine("autopilot.integral_rate", lambda rate: on * rate - (1 - on) * integral / time)
    )
    # The states start and are trimmed with the helm.
    return replace(steered, name=ship.name, description=ship.description, states=loop.states)


def with_yaw_disturbance(ship: Model) -> Model:
    """The ship with an input ``waves.yaw_acceleration``: the first-order yaw moment of waves over the yaw inertia.

    The moment has wave frequency, to which hull damping adds little: its coupling into sway is left out.
    """
    waves = Input(
        YAW_DISTURBANCE,
        "rad/s2",
        "Yaw acceleration by waves, positive to starboard",
        display_unit="deg/s2",
        nominal=1e-3,
    )
    return ship.extend(waves).redefine("motion.rdot", lambda acceleration: acceleration + waves.symbol)
