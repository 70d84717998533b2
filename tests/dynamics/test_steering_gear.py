"""The steering gear by itself: which orders it takes, and what it does with them."""

from __future__ import annotations

import math

import pytest

from tank2sim.cards.form import SteeringGear
from tank2sim.dynamics.steering_gear import steering_gear


def variables(gear: SteeringGear | None) -> dict:
    return {variable.name: variable for variable in steering_gear(gear, 20.0)[0]}


@pytest.mark.parametrize("gear", [None, SteeringGear(), SteeringGear(max_rate_radps=0.04)])
def test_a_gear_without_a_largest_angle_takes_orders_to_ninety_degrees_either_way(gear) -> None:
    found = variables(gear)
    order = found["rudder.command"]
    assert (math.degrees(order.minimum), math.degrees(order.maximum)) == pytest.approx((-90, 90))
    assert "steering.max_angle" not in found


def test_orders_are_bounded_by_the_largest_angle_of_the_gear_and_accepted_to_ninety_degrees() -> None:
    found = variables(SteeringGear(max_angle_rad=math.radians(35)))
    order = found["rudder.command"]
    assert (math.degrees(order.minimum), math.degrees(order.maximum)) == pytest.approx((-35, 35))
    assert math.degrees(order.accepted) == pytest.approx(90)
    assert math.degrees(found["steering.max_angle"].start) == pytest.approx(35)


def test_a_gear_without_a_lag_takes_a_hundredth_of_the_time_of_a_length() -> None:
    assert variables(None)["steering.time_constant"].start == pytest.approx(0.2)
    assert variables(SteeringGear(time_constant_s=2.5))["steering.time_constant"].start == 2.5
    assert len(steering_gear(None, 20.0)[1]) == 1 and not steering_gear(SteeringGear(time_constant_s=2.5), 20.0)[1]
