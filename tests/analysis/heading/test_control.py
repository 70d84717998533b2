"""The heading autopilot: poles where they were placed, limits, anti-windup, the short way round."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.analysis.heading.control import DAMPING, SLOWNESS, heading_autopilot, heading_gains
from tank2sim.analysis.stability.straight_line import Nomoto, stability
from tank2sim.dynamics.autopilot import HeadingGains, autopilot_model
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

GAINS = HeadingGains(
    proportional=1.2,
    derivative=40.0,
    integral=0.004,
    integral_band_rad=math.radians(2.0),
    anti_windup_time_s=20.0,
    largest_rudder_rad=math.radians(35.0),
)


def answer(psi_deg: float, r: float, command_deg: float, held_deg: float = 0.0) -> tuple[float, float, float]:
    """Order and error in deg, and the rate of the integral in deg/s."""
    model = autopilot_model("Autopilot", GAINS, 0.1)
    u = [math.radians(psi_deg), r, math.radians(command_deg)]
    x, p = [math.radians(held_deg)], model.parameter_values()
    order, error = np.array(model.output(x, u, p)).ravel()
    return math.degrees(order), math.degrees(error), math.degrees(float(model.rhs(x, u, p)))


@settings(max_examples=20, deadline=None)
@given(K=st.floats(0.01, 1.0), T=st.floats(5.0, 500.0), unstable=st.booleans())
def test_the_poles_are_where_they_were_placed(K: float, T: float, unstable: bool) -> None:
    K, T = (-K, -T) if unstable else (K, T)
    gains = heading_gains(Nomoto(K, T, None, None, 0.0))
    # psi' = r, T r' = -r + K (-Kp psi - Kd r + z), z' = -Ki psi
    loop = [
        [0, 1, 0],
        [-K * gains.proportional / T, -(1 + K * gains.derivative) / T, K / T],
        [-gains.integral, 0, 0],
    ]
    w = math.sqrt(K / T)
    wanted = [*np.roots([1, 2 * DAMPING * w, w**2]), -SLOWNESS * w]
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(loop)), np.sort_complex(wanted), rtol=1e-7)


def test_an_error_to_starboard_orders_starboard_rudder_and_yaw_takes_it_back() -> None:
    assert answer(10.0, 0.0, 15.0)[0] == pytest.approx(1.2 * 5.0)
    assert answer(10.0, 0.001, 15.0)[0] == pytest.approx(1.2 * 5.0 - math.degrees(0.04))
    assert answer(10.0, 0.0, 15.0, held_deg=1.5)[0] == pytest.approx(7.5)


@pytest.mark.parametrize(
    ("psi_deg", "command_deg", "error_deg"), [(350, 10, 20), (10, 350, -20), (730, 0, -10), (-200, 150, -10)]
)
def test_the_ship_turns_the_short_way_round(psi_deg: float, command_deg: float, error_deg: float) -> None:
    assert answer(psi_deg, 0.0, command_deg)[1] == pytest.approx(error_deg)


def test_the_order_keeps_to_its_limit_and_the_integral_is_emptied_there() -> None:
    order, _, rate = answer(0.0, 0.0, 90.0, held_deg=10.0)
    assert order == pytest.approx(35.0)
    assert rate == pytest.approx(0.004 * 2.0 - 10.0 / 20.0)  # emptied, and not filled the other way
    _, _, rate = answer(0.0, 0.0, 25.0, held_deg=10.0)  # 40 deg are wished for
    assert rate == pytest.approx(0.004 * 2.0 - 5.0 / 20.0)
    assert answer(90.0, 0.0, 0.0)[0] == pytest.approx(-35.0)


def test_the_integral_takes_no_more_than_its_band() -> None:
    assert answer(0.0, 0.0, 20.0)[2] == pytest.approx(0.004 * 2.0)
    assert answer(0.0, 0.0, -1.5)[2] == pytest.approx(0.004 * -1.5)


def test_the_autopilot_of_a_ship_is_of_its_nomoto_model_and_gear(mariner: Model) -> None:
    made = {one.name: one.start for one in heading_autopilot(mariner).parameters}
    gains = heading_gains(stability(mariner).nomoto.dimensional)
    assert made["autopilot.Kp"] == gains.proportional == pytest.approx(1 + 2 * DAMPING * SLOWNESS)
    assert made["autopilot.Kd"] == gains.derivative
    assert math.degrees(made["autopilot.max_rudder"]) == pytest.approx(35.0)  # the gear of the card goes to 40


def test_a_rudder_that_turns_the_wrong_way_is_reported(mariner: Model) -> None:
    with pytest.raises(ValueError, match="wrong way"):
        heading_gains(Nomoto(-0.1, 100.0, None, None, 0.0))
    wrong = mariner.substitute("derivatives.Nd", -mariner.symbol("derivatives.Nd"))
    with pytest.raises(InputError, match="wrong way"):
        heading_autopilot(wrong.substitute("derivatives.Yd", -wrong.symbol("derivatives.Yd")))


@pytest.mark.parametrize("side", [1, -1])
def test_an_autopilot_without_integral_orders_up_to_its_limit_and_no_further(side: int) -> None:
    """Kp is 1.2: 20 deg of error ask for 24 deg of rudder, 90 deg for more than the 35 deg that there are."""
    model = autopilot_model("Autopilot", replace(GAINS, integral=0.0), 0.1)
    p = model.parameter_values()
    outputs = [np.array(model.output([], [0.0, 0.0, side * math.radians(error)], p)).ravel() for error in (20, 90)]
    orders = [math.degrees(order) for order, _ in outputs]
    assert orders == pytest.approx([side * 24, side * 35])
    assert not model.states
