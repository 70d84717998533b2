"""Forces of propellers, also two ordered apart, of engine and hull drag against their equations in plain numpy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.dynamics import Model, build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import N0, RHO, STATES, TYPICAL, U0, L, T, added_forces, mariner_text, ship, state, values

SIDE = {"Y_prime": -1e-4, "N_prime": 5e-5}


def sideways(q: float, Y_prime: float = -1e-4, N_prime: float = 5e-5) -> object:
    """X, Y, N of a side force."""
    return pytest.approx([0.0, Y_prime * q, N_prime * q * L], rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("share", [1.0, 0.5, -0.7])
def test_the_side_force_goes_with_revolutions_squared_whatever_the_ships_speed(share: float) -> None:
    q = 0.5 * RHO * L**2 * U0**2 * share * abs(share)
    for at in STATES:
        found = added_forces("propeller_side_force", SIDE, {**at, "propeller.speed": share * N0})
        assert found == sideways(q)


def test_without_propulsion_the_revolutions_are_nominal() -> None:
    text = mariner_text().split("[propulsion]")[0]
    assert added_forces("propeller_side_force", SIDE, STATES[0], text) == sideways(0.5 * RHO * L**2 * U0**2)


def test_a_propeller_walks_only_astern() -> None:
    given = TYPICAL["propeller_walk"]
    assert not np.any(added_forces("propeller_walk", given, {**STATES[0], "propeller.speed": N0}))
    q = 0.5 * RHO * L**2 * U0**2 * 0.36
    found = added_forces("propeller_walk", given, {**STATES[0], "propeller.speed": -0.6 * N0})
    assert found == sideways(q)


@pytest.mark.parametrize("J", [-1.2, -0.35, -0.3, -0.1, -0.06, -0.02, 0.4])
def test_a_propeller_astern_has_the_published_thrust_and_side_force_in_place_of_the_cards(J: float) -> None:
    """Esso Osaka (Miyauchi et al. 2022): A_1 to A_5, B_1 to B_5, C_3, C_6, C_7 as printed."""
    D, n = 0.6 * T, -1.1
    if J < -0.35:
        A, N_by_J = -4.93e-3 - 5.87e-3 * J, 1.96e-3 + 2.33e-3 * J
    elif J > -0.06:
        A, N_by_J = -5.58e-4, 2.25e-4
    else:
        A, N_by_J = -7.90e-5 + 7.99e-3 * J, 3.50e-5 - 3.17e-3 * J
    C = -0.251 if J < -0.233 else -0.175 + 0.33 * J
    at = {**state(J * n * D, 0.0, 0.0), "propeller.speed": 2 * np.pi * n}
    share = 2 * np.pi * n / N0
    of_card = -77e-5 * 0.5 * RHO * L**2 * U0**2 * share**2
    X, Y, N = added_forces("propeller_astern", {"side_force": 1.0}, at)
    assert pytest.approx(RHO * D**4 * n**2 * C - of_card, rel=5e-3) == X
    assert pytest.approx(0.5 * RHO * L * T * (n * D) ** 2 * A, rel=2e-3) == Y
    assert pytest.approx(0.5 * RHO * L**2 * T * (n * D) ** 2 * N_by_J, rel=3e-3) == N


def test_a_propeller_ahead_has_no_part_in_it_and_one_astern_swings_the_bow_to_starboard() -> None:
    given = {"side_force": 1.0}
    assert not np.any(added_forces("propeller_astern", given, {**STATES[0], "propeller.speed": 0.5 * N0}))
    running = Running(Integrator(ship({"propeller_astern": given})), {"propeller.speed": -0.6 * N0}, {"initial.u": 3.0})
    running.run(60.0)
    assert running.state("motion.psi") > 0.005
    assert running.state("motion.u") < 3.0


@pytest.mark.parametrize("at", STATES)
def test_side_force_by_loading(at: dict[str, float]) -> None:
    U, n = np.hypot(at["motion.u"], at["motion.v"]), 0.9
    q = 0.5 * RHO * L**2 * U**2 * (n * U0 / U - 1)
    found = added_forces("loading_side_force", TYPICAL["loading_side_force"], {**at, "propeller.speed": n * N0})
    assert found == sideways(q)


def test_a_drooping_engine_loses_revolutions_with_speed() -> None:
    model = ship({"engine_droop": {"droop": 0.4}})
    n = values(model, ["propeller.speed_actual"], {"motion.u": 0.75 * U0, "propeller.speed": 8.0})
    np.testing.assert_allclose(n, 8.0 * (1 - 0.4 * 0.25))
    found = added_forces("engine_droop", {"droop": 0.4}, {"motion.u": 0.75 * U0, "propeller.speed": 8.0})
    thrust = 0.5 * RHO * L**2 * U0**2 * 77e-5 * (8.0 / N0) ** 2 * ((1 - 0.1) ** 2 - 1)
    np.testing.assert_allclose(found, [thrust, 0.0, 0.0], rtol=1e-7, atol=1e-6)


def test_without_propulsion_an_engine_droops_from_a_typical_resistance() -> None:
    text = mariner_text().split("[propulsion]")[0]
    found = added_forces("engine_droop", {"droop": 0.4}, {"motion.u": 0.75 * U0}, text)
    thrust = 0.5 * RHO * L**2 * U0**2 * 6e-4 * (0.9**2 - 1)
    assert thrust < 0
    np.testing.assert_allclose(found, [thrust, 0.0, 0.0], rtol=1e-7, atol=1e-6)
    reported = [notice for notice in ship({"engine_droop": {"droop": 0.4}}, text).notices if "engine_droop" in notice]
    assert len(reported) == 1 and "0.0006" in reported[0]


LAGGING = ship({"engine_lag": {"time_constant_s": 15.0}})


def test_an_engine_with_a_lag_reaches_its_order_exponentially() -> None:
    running = Running(Integrator(LAGGING, compiled=False), {"propeller.speed": -0.5 * N0})
    turned = [running.state("engine_lag.speed")]
    for _ in range(3):
        running.run(10.0)
        turned.append(running.state("engine_lag.speed"))
    expected = N0 * (-0.5 + 1.5 * np.exp(-np.arange(4) * 10.0 / 15.0))
    np.testing.assert_allclose(turned, expected, rtol=1e-5)


def test_an_engine_with_a_lag_may_start_at_rest_and_trims_at_its_order() -> None:
    integrator = Integrator(LAGGING, compiled=False)
    assert Running(integrator, {}, {"initial.propeller_speed": 0.0}).state("engine_lag.speed") == 0.0
    trimmed = Running(integrator, {"propeller.speed": 0.8 * N0}, {"initial.trim": 1.0})
    assert trimmed.state("engine_lag.speed") == pytest.approx(0.8 * N0, rel=1e-9)
    assert 0.5 * U0 < trimmed.state("motion.u") < 0.9 * U0


def test_the_engine_of_a_ship_at_the_berth_is_stopped_unless_its_revolutions_are_set() -> None:
    integrator = Integrator(LAGGING, compiled=False)
    berthed = Running(integrator, {"propeller.speed": 0.0}, {"initial.u": 0.0})
    assert berthed.state("engine_lag.speed") == 0.0
    berthed.run(120.0)
    assert abs(berthed.state("motion.u")) < 1e-9
    turning = Running(integrator, {"propeller.speed": 0.0}, {"initial.u": 0.0, "initial.propeller_speed": 3.0})
    assert turning.state("engine_lag.speed") == 3.0
    assert Running(integrator, {}, {"initial.u": 0.1}).state("engine_lag.speed") == pytest.approx(N0)


def test_thrust_and_droop_follow_what_the_engine_has_reached() -> None:
    model = ship({"engine_lag": {"time_constant_s": 15.0}, "engine_droop": {"droop": 0.4}})
    at = {"motion.u": 0.75 * U0, "engine_lag.speed": 8.0, "propeller.speed": 3.0}
    np.testing.assert_allclose(values(model, ["propeller.speed_actual"], at), 8.0 * (1 - 0.4 * 0.25))
    np.testing.assert_allclose(values(LAGGING, ["engine_lag.rate"], at), (3.0 - 8.0) / 15.0)
    plain = values(ship(), ["force.X"], {**at, "propeller.speed": 8.0})
    np.testing.assert_allclose(values(LAGGING, ["force.X"], at), plain, rtol=1e-12)


def test_an_engine_lag_without_an_engine_is_refused() -> None:
    text = mariner_text().split("[propulsion]")[0]
    with pytest.raises(InputError, match="propulsion"):
        ship({"engine_lag": {"time_constant_s": 15.0}}, text)


def closed_cross_flow(v: float, r: float) -> tuple[float, float]:
    """Integrals of |w| w and x |w| w, w = v + x r, over the length, piecewise in closed form."""
    ends = [-L / 2, L / 2]
    if r and abs(v / r) < L / 2:
        ends.insert(1, -v / r)
    total = np.zeros(2)
    square = np.polynomial.Polynomial([v, r]) ** 2
    for low, high in itertools.pairwise(ends):
        sign = np.sign(v + r * (low + high) / 2)
        for place, integrand in enumerate((square, square * np.polynomial.Polynomial([0, 1]))):
            whole = integrand.integ()
            total[place] += sign * (whole(high) - whole(low))
    return float(total[0]), float(total[1])


@settings(max_examples=40, deadline=None)
@given(st.floats(-3, 3), st.floats(-0.03, 0.03))
def test_cross_flow_drag_is_the_integral_over_the_hull(v: float, r: float) -> None:
    found = added_forces("cross_flow_drag", {"drag_coefficient": 0.8}, state(5.0, v, r))
    expected = -0.5 * RHO * T * 0.8 * np.array(closed_cross_flow(v, r))
    largest = 0.5 * RHO * T * 0.8 * L * (abs(v) + abs(r) * L / 2) ** 2
    # rounding of the whole force that the added one is taken out of
    assert found[0] == 0
    assert abs(found[1] - expected[0]) <= 3e-4 * largest + 1e-6
    assert abs(found[2] - expected[1]) <= 3e-4 * largest * L / 2 + 1e-4


def test_cross_flow_drag_opposes_drift_and_turning() -> None:
    _, Y, _ = added_forces("cross_flow_drag", {"drag_coefficient": 0.8}, state(5.0, 1.0, 0.0))
    _, _, N = added_forces("cross_flow_drag", {"drag_coefficient": 0.8}, state(5.0, 0.0, 0.01))
    np.testing.assert_allclose([Y, N], [-0.5 * RHO * T * 0.8 * L, -0.5 * RHO * T * 0.8 * 1e-4 * L**4 / 32], rtol=1e-3)


@pytest.mark.parametrize("u", [6.0, -2.0])
def test_fouling_resists_motion_either_way(u: float) -> None:
    found = added_forces("hull_fouling", {"X_prime": -2e-4}, state(u, 0.3, 0.001))
    np.testing.assert_allclose(found, [-2e-4 * 0.5 * RHO * L**2 * u * abs(u), 0.0, 0.0], rtol=1e-7)


def test_a_hump_is_felt_at_its_speed() -> None:
    given = {"X_prime": -2e-4, "speed_mps": 6.0, "width_mps": 0.5}
    for u in (5.0, 6.0, 6.7):
        expected = -2e-4 * 0.5 * RHO * L**2 * u**2 * np.exp(-(((u - 6.0) / 0.5) ** 2) / 2)
        np.testing.assert_allclose(added_forces("hump_resistance", given, state(u, 0, 0))[0], expected, rtol=1e-6)
    assert ship({"hump_resistance": TYPICAL["hump_resistance"]})["hump_resistance.width"].start == 0.08 * U0


def test_asymmetric_turning_goes_with_the_square_of_the_rate() -> None:
    for at in STATES:
        found = added_forces("asymmetric_turning", {"Yrr": 1e-4, "Nrr": -2e-4}, at)
        q = 0.5 * RHO * L**4 * at["motion.r"] ** 2
        assert found == sideways(q, 1e-4, -2e-4)


APART = {"propeller_starboard_rpm": 0.0, "propeller_port_rpm": 0.0}
PLACE = 6.0
MMG = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")
# of the card: L, rho, D_P, K_T, t_P, w_P0
L7, RHO7, DIAMETER, K_T, T_P, W_P0 = 7.0, 1000.0, 0.216, (0.2931, -0.2753, -0.1385), 0.22, 0.40
Y_P = 0.03


def twin_mmg(more: str = "") -> Model:
    text = MMG.replace("[propeller]", f"[propeller]\nnumber = 2\ny_P = {Y_P}")
    text = text.replace("[rudder]", f"[rudder]\nnumber = 2\ny_R = {Y_P}").replace("C_1 = 2.0", "C_1 = 0.0")
    given = f"propeller_starboard_rpm = 0.0, propeller_port_rpm = 0.0{more}"
    card = parse_card(f'{text}\n[[effects]]\nname = "twin_orders"\nparameters = {{{given}}}\n', "ship.toml")
    return build(card)


@pytest.fixture(scope="module")
def mmg() -> Model:
    return twin_mmg()


def test_thrust_of_a_polynomial_is_half_for_each_and_turns_by_its_difference() -> None:
    scale = 0.5 * RHO * L**2 * U0**2 * 77e-5 / 2
    for starboard, port in ((0.3, -0.1), (-1.6, 0.0), (-1.2, 1.1)):
        at = state(3.0, 0.0, 0.0)
        orders = {
            "propeller.speed": N0,
            "propeller.starboard_offset": starboard * N0,
            "propeller.port_offset": port * N0,
        }
        found = added_forces("twin_orders", {**APART, "place_m": PLACE}, {**at, **orders})
        T_S, T_P = (scale * (1 + share) * abs(1 + share) for share in (starboard, port))
        np.testing.assert_allclose(found, [T_S + T_P - 2 * scale, 0.0, -PLACE * (T_S - T_P)], rtol=1e-9, atol=1e-3)


def test_a_ship_at_rest_turns_to_the_side_of_the_propeller_that_backs() -> None:
    model = ship({"twin_orders": APART})
    order = {"propeller.speed": 0.0, "propeller.port_offset": 0.6 * N0, "propeller.starboard_offset": -0.6 * N0}
    running = Running(Integrator(model), order, {"initial.u": 0.0})
    running.run(300.0)
    assert running.state("motion.psi") > 0.1
    assert math.hypot(running.state("motion.x"), running.state("motion.y")) < 0.15 * L


def test_each_propeller_of_the_mmg_method_has_the_thrust_of_its_revolutions_and_inflow(mmg: Model) -> None:
    u, common, (starboard, port) = 1.0, 10.0, (4.0, -3.0)
    turns = 2 * math.pi
    at = {
        "motion.u": u, "propeller.speed": common * turns,
        "propeller.starboard_offset": starboard * turns, "propeller.port_offset": port * turns,
    }  # fmt: skip
    thrusts = []
    for n in (common + starboard, common + port):
        J = (1 - W_P0) * u / (n * DIAMETER)
        thrusts.append(RHO7 * n**2 * DIAMETER**4 * (K_T[0] + K_T[1] * J + K_T[2] * J**2))
    names = ["propeller.thrust_right", "propeller.thrust_left", "propeller.X", "propeller.N"]
    found = values(mmg, names, at)
    np.testing.assert_allclose(found[:2], thrusts, rtol=1e-9)
    effective = (1 - T_P) * np.array(thrusts)
    np.testing.assert_allclose(found[2:], [effective.sum(), -Y_P * L7 * (effective[0] - effective[1])], rtol=1e-9)
    turning = values(mmg, ["propeller.speed_starboard", "propeller.speed_port"], at)
    np.testing.assert_allclose(turning, [(common + starboard) * turns, (common + port) * turns])


@pytest.mark.parametrize("polynomial", [True, False])
def test_the_same_order_to_both_is_the_common_order(polynomial: bool, mmg: Model) -> None:
    model = ship({"twin_orders": APART}) if polynomial else mmg
    n = 0.8 * model.input_values()[model.input_names.index("propeller.speed")]
    names, moving = ["force.X", "force.Y", "force.N"], {"motion.u": 1.0, "motion.v": 0.1, "motion.r": 0.01}
    together = values(model, names, {**moving, "propeller.speed": n, "rudder.angle": 0.2})
    apart = values(
        model,
        names,
        {
            **moving, "propeller.speed": 0.0, "propeller.port_offset": n, "propeller.starboard_offset": n,
            "rudder.added_port": 0.2, "rudder.added_starboard": 0.2,
        },
    )  # fmt: skip
    np.testing.assert_allclose(apart, together, rtol=1e-9)


def test_rudders_put_apart_brake_and_do_not_turn(mmg: Model) -> None:
    at = {"motion.u": 1.0, "rudder.added_port": 0.5, "rudder.added_starboard": -0.5}
    X, Y, N = values(mmg, ["rudder.X", "rudder.Y", "rudder.N"], at)
    assert X < -1.0
    assert abs(Y) < 1e-9 * abs(X) and abs(N) < 1e-9 * abs(X) * L7
    port_alone = values(mmg, ["rudder.N"], {**at, "rudder.added_starboard": 0.0})[0]
    assert port_alone > 0  # to starboard, as its angle


def test_each_rudder_moves_at_the_rate_of_the_gear_and_stops_at_its_largest_angle() -> None:
    model = ship({"twin_orders": APART})
    running = Running(Integrator(model), {"rudder.starboard_offset": 0.4, "rudder.port_offset": -2.0}, {})
    running.run(4.0)
    rate, largest = math.radians(5.0), math.radians(40.0)
    assert running.state("rudder.added_starboard") == pytest.approx(4.0 * rate, rel=0.1)
    running.run(60.0)
    assert running.state("rudder.added_starboard") == pytest.approx(0.4, rel=1e-3)
    assert running.state("rudder.added_port") == pytest.approx(-largest, rel=1e-3)
    assert running.state("rudder.angle") == 0.0


def test_a_ship_without_engine_or_with_one_propeller_is_refused() -> None:
    with pytest.raises(InputError, match=r"propulsion: is missing"):
        ship({"twin_orders": APART}, mariner_text().split("[propulsion]")[0])
    given = "propeller_port_rpm = 0.0, propeller_starboard_rpm = 0.0"
    single = f'{MMG}\n[[effects]]\nname = "twin_orders"\nparameters = {{{given}}}\n'
    with pytest.raises(InputError, match=r"propeller\.number: is 1"):
        build(parse_card(single, "ship.toml"))
    with pytest.raises(InputError, match=r"place_m: acts on nothing"):
        twin_mmg(", place_m = 0.2")
    with pytest.raises(InputError) as caught:
        ship({"twin_orders": APART}).input_values({"propeller.port_offset": 90.0})
    assert caught.value.place == "propeller.port_offset"
