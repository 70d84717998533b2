"""A ship steered by its helm or by its autopilot."""

import numpy as np
import pytest

from tank2sim.analysis.heading.designs import design_heading
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.autopilot_loop import closed_loop_model, ship_steered_by_either


def rates(model, states, inputs):
    """Rates by name of state, of a model at these states and inputs; all else as it starts."""
    x = [states.get(state.name, 0.0) for state in model.states]
    u = [inputs.get(variable.name, float(variable.start)) for variable in model.inputs]
    names = [state.name for state in model.states]
    return dict(zip(names, np.array(model.rhs(x, u, model.parameter_values())).ravel(), strict=True))


def test_the_rudder_goes_to_the_order_of_whoever_steers():
    ship = build(read_card("mariner"))
    autopilot = design_heading(ship).autopilot
    either = ship_steered_by_either(ship, autopilot)
    states = {"motion.u": 7.5, "motion.v": 0.1, "motion.r": 0.002, "motion.psi": 0.3, "rudder.angle": 0.05}
    states["autopilot.integral"] = 0.02
    orders = {"rudder.command": -0.1, "heading.command": 0.4}
    helm = rates(either, states, {**orders, "autopilot.steers": 0.0})
    alone = rates(ship, states, orders)
    assert {name: helm[name] for name in alone} == pytest.approx(alone, rel=1e-12)
    time = dict(zip(either.parameter_names, either.parameter_values(), strict=True))["autopilot.anti_windup_time"]
    assert helm["autopilot.integral"] == pytest.approx(-0.02 / time)
    on = rates(either, states, {**orders, "autopilot.steers": 1.0})
    assert on == pytest.approx(rates(closed_loop_model(ship, autopilot), states, orders), rel=1e-12)
    assert on["rudder.angle"] > 0 > helm["rudder.angle"]


def test_a_trimmed_start_is_that_of_the_ship_alone():
    ship = build(read_card("kvlcc2"))
    either = ship_steered_by_either(ship, design_heading(ship).autopilot)
    assert either.trim_step is not None
    assert [state.name for state in either.states][: len(ship.states)] == [state.name for state in ship.states]
