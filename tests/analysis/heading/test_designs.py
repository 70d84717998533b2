"""The designs and the autopilot: poles where they were placed, Riccati, mixed sensitivity, limits, anti-windup."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

from tank2sim.analysis.heading.designs import (
    DAMPING,
    POLE_SHIFT,
    SLOWNESS,
    LqrWeights,
    SteeringPlant,
    _without_integral,
    design_heading,
    heading_gains,
    robust_design,
    steering_plant,
)
from tank2sim.analysis.heading.margins import loop_margins
from tank2sim.analysis.linearisation import OperatingPoint, state_space
from tank2sim.analysis.stability.straight_line import Nomoto, stability
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.autopilot import HeadingGains, autopilot_model
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tests.dynamics.effects.ships import ship

NO_SLYCOT = "slycot is not installed"


@pytest.fixture(scope="module")
def kvlcc2() -> Model:
    return build(read_card("kvlcc2-captive"))


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(K=st.floats(0.01, 1.0), T=st.floats(5.0, 500.0), unstable=st.booleans())
def test_the_poles_of_a_pd_are_where_they_were_placed(mariner: Model, K: float, T: float, unstable: bool) -> None:
    K, T = (-K, -T) if unstable else (K, T)
    found, w = stability(mariner), math.sqrt(K / T)
    object.__setattr__(found.nomoto, "dimensional", Nomoto(K, T, None, None, 0.0))
    plant = SteeringPlant(found, w, np.zeros((4, 4)), np.zeros((4, 1)), 0.6, 0.1)
    gains = _without_integral(plant, heading_gains(found.nomoto.dimensional))
    # psi' = r, T r' = -r - K (Kp psi + Kd r)
    loop = [[0, 1], [-K * gains.proportional / T, -(1 + K * gains.derivative) / T]]
    wanted = np.roots([1, 2 * DAMPING * w, w**2])
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(loop)), np.sort_complex(wanted), rtol=1e-6)
    assert gains.integral == 0.0


@pytest.mark.parametrize("heading_deg", [5.0, 2.0])
def test_the_regulator_is_that_of_riccati_s_equation(mariner: Model, heading_deg: float) -> None:
    weights = LqrWeights(heading_rad=math.radians(heading_deg), rudder_rad=math.radians(10.0))
    gains = design_heading(mariner, "lqr", weights=weights).gains
    plant = steering_plant(mariner)
    w, bad = plant.frequency_radps, weights.heading_rad
    A = np.block([[plant.A, np.zeros((4, 1))], [np.array([[0, 0, 1.0, 0, 0]])]])
    B = np.append(plant.B, [[0.0]], axis=0)
    Q = np.diag([0, (1 / (w * bad)) ** 2, bad**-2, 0, (SLOWNESS * w / bad) ** 2])
    R = np.array([[weights.rudder_rad**-2]])
    wanted = np.linalg.solve(R, B.T @ solve_continuous_are(A, B, Q, R)).ravel()
    named = [gains[name] for name in ("Kv_radpmps", "Kd_s", "Kp", "Kdelta", "Ki_per_s")]
    np.testing.assert_allclose(named, wanted, rtol=1e-6)


def test_the_loop_of_the_regulator_has_the_poles_of_the_regulator_and_of_its_observer(mariner: Model) -> None:
    design, plant = design_heading(mariner, "lqr"), steering_plant(mariner)
    order = ("Kv_radpmps", "Kd_s", "Kp", "Kdelta", "Ki_per_s")
    gain = np.array([[design.gains[name] for name in order]])
    A = np.block([[plant.A, np.zeros((4, 1))], [np.array([[0, 0, 1.0, 0, 0]])]])
    B = np.append(plant.B, [[0.0]], axis=0)
    # The observed sway is the ship's own equation with the yaw rate as measured: its error decays as the sway does.
    wanted = [*np.linalg.eigvals(A - B @ gain), plant.A[0, 0], plant.A[3, 3]]
    found = loop_margins(mariner, design.autopilot).poles
    np.testing.assert_allclose(np.sort_complex(np.array(found)), np.sort_complex(wanted), rtol=1e-5, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pd", "pid", "lqr"])
def test_a_ship_that_is_unstable_is_held_on_her_course(kvlcc2: Model, kind: str) -> None:
    design = design_heading(kvlcc2, kind)
    assert not design.found.stability_criterion.stable
    margins = loop_margins(kvlcc2, design.autopilot)
    assert margins.stable
    assert 0 < margins.gain_margin_down < 0.5  # with too little gain she goes her own way


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("slycot") is None, reason=NO_SLYCOT)
@pytest.mark.parametrize("name", ["mariner", "kvlcc2-captive"])
def test_the_robust_loop_is_robust_and_no_mode_of_it_is_slower_than_asked(name: str) -> None:
    ship = build(read_card(name))
    design = design_heading(ship, "robust")
    margins = loop_margins(ship, design.autopilot)
    assert margins.sensitivity_peak < 1.7
    assert margins.phase_margin_deg > 38
    w = math.sqrt(design.found.nomoto.dimensional.K_per_s / design.found.nomoto.dimensional.T_s)
    assert max(pole.real for pole in margins.poles) < -0.99 * POLE_SHIFT * w


@pytest.mark.skipif(importlib.util.find_spec("slycot") is None, reason=NO_SLYCOT)
def test_a_ship_without_a_robust_controller_is_refused_by_its_file(mariner: Model) -> None:
    plant = steering_plant(mariner)
    nothing = replace(plant, A=np.full((4, 4), np.nan))
    with pytest.raises(InputError, match=r"^hull\.toml \(Mariner\): no robust controller"):
        robust_design(nothing, "pilot", "hull.toml (Mariner)")


@pytest.mark.skipif(importlib.util.find_spec("slycot") is not None, reason="slycot is installed")
def test_without_its_library_the_robust_design_is_refused_with_what_to_install(mariner: Model) -> None:
    with pytest.raises(InputError, match=r"pip install 'tank2sim\[robust\]'"):
        design_heading(mariner, "robust")


def test_a_wave_filter_lets_a_tenth_of_the_waves_through_and_leaves_slow_motions_alone(mariner: Model) -> None:
    frequency = 0.6
    plain = design_heading(mariner).autopilot
    filtered = design_heading(mariner, wave_filter_radps=frequency).autopilot
    seen = {}
    for name, pilot in (("plain", plain), ("filtered", filtered)):
        states = [1e-6 if state == "autopilot.integral" else 0.0 for state in pilot.state_names]
        rest = OperatingPoint(np.array(states), pilot.input_values(), pilot.parameter_values())
        seen[name] = state_space(pilot, rest, inputs=["motion.r"], outputs=["rudder.command"])
    waves, slow = (abs(seen["filtered"](w) / seen["plain"](w)) for w in (1j * frequency, 1e-3j * frequency))
    assert waves == pytest.approx(0.1, rel=1e-6)
    assert slow == pytest.approx(1.0, abs=3e-3)
    assert loop_margins(mariner, filtered).stable
    with pytest.raises(InputError, match="not part of the design"):
        design_heading(mariner, "lqr", wave_filter_radps=frequency)


def test_what_cannot_be_steered_is_reported(mariner: Model) -> None:
    with pytest.raises(InputError, match="outside the range"):
        design_heading(mariner, speed_mps=20.0)
    with pytest.raises(InputError, match="has no rudder"):
        design_heading(build(read_card("wilinski-zellman")))
    with pytest.raises(InputError, match="is not a design"):
        design_heading(mariner, "fuzzy")
    dead = mariner
    for term in ("d", "ddd", "vvd", "du", "duu", "0", "0u", "0uu"):
        for force in "YN":
            dead = dead.substitute(f"derivatives.{force}{term}", 0 * mariner.symbol("ship.length"))
    with pytest.raises(InputError, match=r"no effect|straight course"):
        design_heading(dead)


def test_the_gear_of_the_plant_is_that_of_the_effect_in_its_place() -> None:
    lagging = ship({"rudder_lag": {"time_constant_s": 3.0}})
    assert steering_plant(lagging).A[3, 3] == pytest.approx(-1 / 3.0)
    assert steering_plant(ship()).A[3, 3] == pytest.approx(-1 / read_card("mariner").steering_gear.time_constant_s)


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
    made = {one.name: one.start for one in design_heading(mariner).autopilot.parameters}
    gains = heading_gains(stability(mariner).nomoto.dimensional)
    assert made["autopilot.Kp"] == gains.proportional == pytest.approx(1 + 2 * DAMPING * SLOWNESS)
    assert made["autopilot.Kd"] == gains.derivative
    assert math.degrees(made["autopilot.max_rudder"]) == pytest.approx(35.0)  # the gear of the card goes to 40


def test_a_rudder_that_turns_the_wrong_way_is_reported(mariner: Model) -> None:
    wrong = mariner.substitute("derivatives.Nd", -mariner.symbol("derivatives.Nd"))
    with pytest.raises(InputError, match="wrong way"):
        design_heading(wrong.substitute("derivatives.Yd", -wrong.symbol("derivatives.Yd")))


@pytest.mark.parametrize("side", [1, -1])
def test_an_autopilot_without_integral_orders_up_to_its_limit_and_no_further(side: int) -> None:
    """Kp is 1.2: 20 deg of error ask for 24 deg of rudder, 90 deg for more than the 35 deg that there are."""
    model = autopilot_model("Autopilot", replace(GAINS, integral=0.0), 0.1)
    p = model.parameter_values()
    outputs = [np.array(model.output([], [0.0, 0.0, side * math.radians(error)], p)).ravel() for error in (20, 90)]
    orders = [math.degrees(order) for order, _ in outputs]
    assert orders == pytest.approx([side * 24, side * 35])
    assert not model.states
