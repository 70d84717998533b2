"""Propeller and rudder of the MMG method beyond straight ahead: by hand, by limits and by mirror images."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest

from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.mmg.propeller import thrust_over_density, torque_over_density
from tank2sim.dynamics.mmg.rudder import normal_force, rudder_inflow
from tank2sim.dynamics.model import Model
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.dynamics.states import motion, replaced, values

ASTERN = 0.6
SLOW = 1e-6


def number(value: ca.SX) -> float:
    return float(ca.evalf(value))


def model_of(name: str, *pairs: tuple[str, str]) -> Model:
    return build(parse_card(replaced(bundled_cards()[name].read_text(encoding="utf-8"), *pairs), "changed.toml"))


def given_of(model: Model) -> dict[str, float]:
    return dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))


def seen(model: Model, names: list[str], n_rps: float, u: float, v: float, r: float, delta: float = 0.0) -> np.ndarray:
    return values(model, names, motion(u, v, r) | {"rudder.angle": delta, "propeller.speed": 2 * math.pi * n_rps})


@pytest.mark.parametrize(("C_Pv", "C_Pr"), [(0.3, 0.0), (0.0, 0.3), (-0.2, 0.5)])
def test_drift_and_yaw_to_one_side_raise_the_wake_and_to_the_other_lower_it(C_Pv: float, C_Pr: float) -> None:
    """1 - w_P = 1 - w_P0 + tau ((v' + x_P' r')^2 + C_Pv v' + C_Pr r'), Son and Nomoto (1982)."""
    model = model_of("container", ("tau = 1.09", f"tau = 1.09\nC_Pv = {C_Pv}\nC_Pr = {C_Pr}"))
    given = given_of(model)
    u, v, r = 8.0, 0.7, -0.009
    U, L, x_P, w_P0 = math.hypot(u, v), 175.0, given["mmg.x_P"], given["mmg.w_P0"]
    for side in (1, -1):
        across, turn = side * v / U, side * r * L / U
        kept = 1 - w_P0 + 1.09 * ((across + x_P * turn) ** 2 + C_Pv * across + C_Pr * turn)
        (u_P,) = seen(model, ["propeller.inflow"], 1.2, u=u, v=side * v, r=side * r)
        assert u_P == pytest.approx(u * kept, rel=1e-6)
    (astern,) = seen(model, ["propeller.inflow"], 1.2, u=-2.0, v=v, r=r)
    assert astern == -2.0  # no wake of a ship that goes astern


@pytest.mark.parametrize(
    ("u_R", "v_R", "share"), [(-5.0, 0.0, 0.6), (-3.0, 4.0, 0.76), (3.0, 4.0, 1.0), (0.0, 5.0, 1.0)]
)
@pytest.mark.parametrize("delta", [0.4, -0.7])
def test_a_rudder_met_from_aft_has_its_share_of_the_force_and_pushes_the_other_way(
    u_R: float, v_R: float, share: float, delta: float
) -> None:
    """F_N = 1/2 rho A f U^2 sin(alpha), alpha to the flow; of it 1 - (1 - 0.6) cos^-(flow from aft)."""
    p = {"f_alpha": 2.5, "rudder_astern": ASTERN}
    force = number(normal_force(p, ca.SX(10.0), (ca.SX(u_R), ca.SX(v_R)), ca.SX(delta), ca.SX(SLOW)))
    alpha = delta - math.atan2(v_R, u_R)
    assert force == pytest.approx(10.0 * 2.5 * (u_R**2 + v_R**2) * math.sin(alpha) * share, rel=1e-9)
    ahead = number(normal_force(p, ca.SX(10.0), (ca.SX(5.0), ca.SX(0.0)), ca.SX(delta), ca.SX(SLOW)))
    if v_R == 0.0:
        assert force == pytest.approx(-ASTERN * ahead, rel=1e-9)


def test_the_ship_that_goes_astern_is_turned_the_other_way_by_its_rudder() -> None:
    model = model_of("kvlcc2-l7-mmg")
    given = given_of(model)
    names = ["rudder.inflow", "rudder.normal_force", "rudder.X", "rudder.Y", "rudder.N"]
    u_R, F_N, X, Y, N = seen(model, names, 0.0, u=-0.5, v=0.0, r=0.0, delta=0.3)
    # A stopped propeller still takes k_2 J^2 of the flow: thrust of the other sign astern, 8 T/(rho pi D^2).
    taken = 8 / math.pi * 0.1385 * 0.25
    far = math.sqrt(0.25 + taken)
    behind = -0.5 + 0.5 * (far - 0.5)
    eta = 0.216 / 0.345
    assert u_R == pytest.approx(-1.09 * math.sqrt(eta * behind**2 + (1 - eta) * 0.25), rel=1e-6)
    share = given["low_speed.rudder_astern"]
    assert 0 < share < 1
    assert pytest.approx(-500 * 0.0539 * 2.747 * share * u_R**2 * math.sin(0.3), rel=1e-6) == F_N
    assert pytest.approx(-0.613 * F_N * math.sin(0.3), rel=1e-9) == X
    assert pytest.approx(-1.312 * F_N * math.cos(0.3), rel=1e-9) == Y and Y > 0
    assert pytest.approx((0.5 + 0.312 * 0.464) * 7.0 * F_N * math.cos(0.3), rel=1e-9) == N and N < 0


@pytest.mark.parametrize(
    ("u_P", "race", "flow"),
    [
        (2.0, 0.0, 2.0),  # no load: the stream itself
        (-2.0, 0.0, -2.0),
        (0.0, 9.0, 0.5 * 3.0 * math.sqrt(0.7)),  # at rest: the share kappa of the race, on the share eta of the rudder
        (2.0, 5.0, math.sqrt(0.7 * (2 + 0.5 * (3 - 2)) ** 2 + 0.3 * 4)),
        (2.0, -9.0, math.sqrt(0.7 * (2 - 0.5 * 2) ** 2 + 0.3 * 4)),  # a windmill stops the stream at most
    ],
)
def test_the_flow_to_the_rudder_is_known_without_load_at_rest_and_behind_a_windmill(
    u_P: float, race: float, flow: float
) -> None:
    p = {"eps": 1.1, "kappa": 0.5}
    found = number(rudder_inflow(p, ca.SX(0.7), ca.SX(u_P), ca.SX(race), ca.SX(SLOW)))
    assert found == pytest.approx(1.1 * flow, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(("n", "u_P"), [(8.0, 1.5), (-8.0, 1.5), (8.0, -1.5), (-8.0, -1.5), (0.0, 1.5), (0.0, -1.5)])
def test_thrust_and_torque_in_all_quadrants(n: float, u_P: float) -> None:
    """T = rho n^2 D^4 K_T(J) ahead; the stopped or reversed propeller keeps k_2 u_P abs(u_P), and no term in n u_P."""
    p = {"k_0": 0.3, "k_1": -0.28, "k_2": -0.14, "q_0": 0.03, "q_1": -0.02, "q_2": -0.015}
    p |= {"astern": ASTERN, "eta_R": 0.9}
    D = 0.25

    def curve(first: float, second: float, third: float) -> float:
        at_rest = first * n**2 if n >= 0 else -ASTERN * first * n**2
        by_product = second * n * u_P / D if n > 0 else 0.0
        return at_rest + by_product + third * u_P * abs(u_P) / D**2

    thrust = number(thrust_over_density(p, ca.SX(D), ca.SX(n), ca.SX(u_P)))
    torque = number(torque_over_density(p, ca.SX(D), ca.SX(n), ca.SX(u_P)))
    assert thrust == pytest.approx(D**4 * curve(0.3, -0.28, -0.14), rel=1e-12)
    assert torque == pytest.approx(D**5 * curve(0.03, -0.02, -0.015) / 0.9, rel=1e-12)


def test_the_rudder_outside_the_race_meets_the_stream_alone() -> None:
    """A rudder twice as high has half the share in the race: u_R^2 lies half way between stream and race."""
    flows = []
    for height in (0.216, 0.432):
        model = model_of("kvlcc2-l7-mmg", ("height_m = 0.345", f"height_m = {height}"))
        u_R, u_P, thrust = seen(
            model, ["rudder.inflow", "propeller.inflow", "propeller.thrust"], 11.0, u=1.0, v=0.0, r=0.0
        )
        flows.append((u_R / 1.09) ** 2)
    race = (u_P + 0.5 * (math.sqrt(u_P**2 + 8 * thrust / (1000 * math.pi * 0.216**2)) - u_P)) ** 2
    assert flows == pytest.approx([race, (race + u_P**2) / 2], rel=1e-6)


@pytest.mark.parametrize("n_rps", [0.0, 1.2])
@pytest.mark.parametrize("speed", [0.0, 0.01, 0.3])
def test_a_ship_with_polynomials_of_wake_and_cross_flow_turns_on_the_spot_until_it_lies_still(
    n_rps: float, speed: float
) -> None:
    """At rest r' = r L/U has no bound: cubic terms of it would push the rudder without end."""
    running = Running(
        Integrator(model_of("container")),
        {"propeller.speed": 2 * math.pi * n_rps},
        {"initial.u": speed, "initial.r": 0.005},
    )
    running.run(60.0)
    assert 0.0 < running.state("motion.r") < 0.005
    assert abs(running.state("motion.v")) < 0.3


def test_the_wake_of_a_ship_that_turns_on_the_spot_is_that_of_the_tightest_turn() -> None:
    model = model_of("container")
    (tight,) = seen(model, ["propeller.inflow"], 1.2, u=1.75, v=0.0, r=0.01)
    (spot,) = seen(model, ["propeller.inflow"], 1.2, u=0.0175, v=0.0, r=0.01)
    assert spot / 0.0175 == pytest.approx(tight / 1.75, rel=1e-6)


def test_cross_flow_goes_on_with_the_yaw_rate_where_the_ship_turns_on_the_spot() -> None:
    model = model_of("container")
    given = given_of(model)
    (first,), (second,) = (seen(model, ["rudder.cross_flow"], 0.0, u=0.0, v=0.0, r=r) for r in (0.001, 0.002))
    assert second == pytest.approx(2 * first, rel=1e-6)
    assert first == pytest.approx(-0.001 * 175.0 * (given["mmg.C_Rr"] + given["mmg.C_Rrrr"]), rel=1e-6)
