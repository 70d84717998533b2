"""Two propellers and rudders ordered apart: thrusts by hand, and which way they turn a ship."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.dynamics import Model, build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import N0, RHO, U0, L, added_forces, mariner_text, ship, state, values

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
