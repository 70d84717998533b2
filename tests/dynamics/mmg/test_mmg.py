"""The MMG model is the method's: by its own numbers, an integration elsewhere, mirror images, and at rest."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.analysis.turning.diagram import steady_turning
from tank2sim.cards import parse_card
from tank2sim.cards.card import MmgCard
from tank2sim.dynamics import build
from tank2sim.dynamics.mmg.equivalent import linear_equivalent, straight_inflow
from tank2sim.dynamics.model import Model
from tests.dynamics.states import at_start, replaced, values

SIDES = {"stbd": 1, "port": -1}


@pytest.fixture(scope="module")
def ship() -> t2s.Ship:
    """The 7 m model."""
    return t2s.load("kvlcc2-l7-mmg")


def mmg_card(ship: t2s.Ship) -> MmgCard:
    assert isinstance(ship.card, MmgCard)
    return ship.card


def changed_mmg(ship: t2s.Ship, *pairs: tuple[str, str]) -> MmgCard:
    """The card with parts of its text replaced."""
    card = parse_card(replaced(ship.card.text, *pairs), "changed.toml")
    assert isinstance(card, MmgCard)
    return card


class Forces:
    """A model's quantities at given states."""

    def __init__(self, model: Model, *names: str):
        self.model, self.names = model, names

    def at(self, delta: float = 0.0, n_rps: float | None = None, **motion: float) -> np.ndarray:
        at = {"rudder.angle": delta, **{f"motion.{key}": v for key, v in motion.items()}}
        return values(self.model, self.names, at if n_rps is None else at | {"propeller.speed": 2 * math.pi * n_rps})


def reference(data: Path, name: str) -> tuple[dict[str, list[float]], str]:
    """Columns and comments of a trajectory that was integrated elsewhere."""
    lines = (data / "reference" / name).read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    comments = "\n".join(line for line in lines if line.startswith("#"))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}, comments


def crossing(heading: np.ndarray, values: np.ndarray, degrees: float) -> float:
    return float(np.interp(degrees, np.abs(heading), values))


@pytest.mark.parametrize("side", SIDES)
def test_hard_turns_are_those_of_an_integration_elsewhere(ship: t2s.Ship, data: Path, side: str) -> None:
    columns, _ = reference(data, f"kvlcc2_l7_paper_turn_35_{side}.csv")
    heading, x, y = (np.array(columns[name]) for name in ("psi_deg", "x_m", "y_m"))
    run = ship.turn(35 * SIDES[side])
    assert run.figures["advance_m"] == pytest.approx(crossing(heading, x, 90), rel=1e-3)
    assert run.figures["tactical_diameter_m"] == pytest.approx(abs(crossing(heading, y, 180)), rel=1e-3)
    speed = np.hypot(columns["u_mps"][-1], columns["v_mps"][-1])
    assert run.figures["steady_speed_mps"] == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("angle", [10, 20])
def test_zigzags_are_those_of_an_integration_elsewhere(ship: t2s.Ship, data: Path, angle: int, side: str) -> None:
    _, comments = reference(data, f"kvlcc2_l7_paper_zigzag_{angle}_{angle}_{side}.csv")
    stated = comments.partition("overshoots_deg in order: ")[2].split("\n")[0].split(", ")
    found = ship.zigzag(SIDES[side] * angle, angle).figures
    for number, overshoot in enumerate(stated[:2], start=1):
        assert found[f"overshoot_{number}_deg"] == pytest.approx(float(overshoot), abs=0.05)


def test_revolutions_are_those_that_hold_the_speed(ship: t2s.Ship) -> None:
    card = mmg_card(ship)
    assert card.propulsion is not None
    n = card.propulsion.nominal_radps / (2 * math.pi)
    assert n == pytest.approx(11.8516, abs=1e-4)
    X, Y, N = Forces(ship.model, "force.X", "force.Y", "force.N").at(u=1.179)
    drag = 0.5 * 1000 * 7 * 0.46 * 1.179**2 * 0.022
    assert abs(X) < 1e-9 * drag and abs(Y) < 1e-12 and abs(N) < 1e-12


def test_thrust_and_flow_to_the_rudder_have_the_known_values(ship: t2s.Ship) -> None:
    """J = 0.2763, K_T = 0.20645 and u_R/U = 1.0633 of these numbers at 1.179 m/s and 11.85 rps."""
    forces = Forces(ship.model, "propeller.inflow", "propeller.thrust", "rudder.inflow")
    u_P, thrust, u_R = forces.at(u=1.179)
    assert u_P / (11.8516 * 0.216) == pytest.approx(0.2763, abs=1e-4)
    assert thrust / (1000 * 11.8516**2 * 0.216**4) == pytest.approx(0.20645, abs=1e-5)
    assert u_R / 1.179 == pytest.approx(1.0633, abs=1e-4)
    assert straight_inflow(ship.model) / 1.179 == pytest.approx(1.0633, abs=1e-4)


def test_forces_in_a_turn_are_those_of_the_methods_own_formulas(ship: t2s.Ship) -> None:
    """Written again from the method, with K_T/J^2 and tangents, at one motion of a turn to starboard."""
    u, v, r, delta, n = 0.8, -0.25, 0.06, 0.4, 11.0
    L, d, D, U = 7.0, 0.46, 0.216, math.hypot(0.8, 0.25)
    beta, rr, vv = math.atan2(0.25, 0.8), 0.06 * 7 / U, -0.25 / U
    beta_P = beta + 0.48 * rr
    w = 1 - 0.6 * (1 + (1 - math.exp(-2 * beta_P)) * 0.6)
    J = u * (1 - w) / (n * D)
    K = 0.2931 - 0.2753 * J - 0.1385 * J**2
    X_P = 0.78 * 1000 * n**2 * D**4 * K
    eta = D / 0.345
    race = math.sqrt(eta * (1 + 0.5 * (math.sqrt(1 + 8 * K / (math.pi * J**2)) - 1)) ** 2 + 1 - eta)
    u_R, v_R = 1.09 * u * (1 - w) * race, U * 0.64 * (beta + 0.71 * rr)
    F_N = 500 * 0.0539 * (u_R**2 + v_R**2) * 2.747 * math.sin(delta - math.atan2(v_R, u_R))
    X_H = -0.022 - 0.04 * vv**2 + 0.002 * vv * rr + 0.011 * rr**2 + 0.771 * vv**4
    cubic = vv**3, vv**2 * rr, vv * rr**2, rr**3
    Y_H = -0.315 * vv + 0.083 * rr + np.dot((-1.607, 0.379, -0.391, 0.008), cubic)
    N_H = -0.137 * vv - 0.049 * rr + np.dot((-0.030, -0.294, 0.055, -0.013), cubic)
    force, m = 500 * L * d * U**2, 0.290151 * 500 * L**2 * d
    m_x, m_y, x_G = 0.022 * 500 * L**2 * d, 0.223 * 500 * L**2 * d, 0.0357143 * L
    expected = (
        force * X_H + X_P - 0.613 * F_N * math.sin(delta) + (m + m_y) * v * r + x_G * m * r**2,
        force * Y_H - 1.312 * F_N * math.cos(delta) - (m + m_x) * u * r,
        force * L * N_H + (0.5 + 0.312 * 0.464) * L * F_N * math.cos(delta) - x_G * m * u * r,
    )
    names = "force.X", "force.Y", "force.N", "rudder.normal_force"
    found = Forces(ship.model, *names).at(u=u, v=v, r=r, delta=delta, n_rps=n)
    assert found == pytest.approx((*expected, F_N), rel=1e-9)


@pytest.mark.parametrize(("side", "sign"), [("minus", 1), ("plus", -1)])
def test_linearised_derivatives_are_known_on_either_side(ship: t2s.Ship, side: str, sign: int) -> None:
    """Prime II values of the KVLCC2; and slopes of the model itself, a little to that side."""
    known = {
        "minus": {"Yv": -0.3403, "Yr": 0.1010, "Nv": -0.1245, "Nr": -0.0578},
        "plus": {"Yv": -0.3561, "Yr": 0.1121, "Nv": -0.1168, "Nr": -0.0633},
    }[side] | {"Yd": -0.06821, "Nd": 0.03352}
    found = linear_equivalent(mmg_card(ship), ship.model, side)  # type: ignore[arg-type]
    in_prime_ii = {name: value * 7 / 0.46 for name, value in found.items()}
    assert in_prime_ii["Yr"] + 0.022 == pytest.approx(known["Yr"], abs=6e-5)
    for name in ("Yd", "Nd", "Yv", "Nv", "Nr"):
        assert in_prime_ii[name] == pytest.approx(known[name], abs=6e-5), name
    forces, U, h = Forces(ship.model, "force.Y", "force.N"), 1.179, 1e-7
    straight = forces.at(u=U)
    unit = 500 * 7 * 0.46 * U**2 * np.array([1, 7])
    by_v = (forces.at(u=U, v=sign * h * U) - straight) / (sign * h * unit)
    by_r = (forces.at(u=U, r=-sign * h * U / 7) - straight) / (-sign * h * unit)  # the stern meets the other side
    by_d = (forces.at(u=U, delta=h) - straight) / (h * unit)
    mass = 0.290151
    assert by_v == pytest.approx([in_prime_ii["Yv"], in_prime_ii["Nv"]], rel=1e-4)
    assert by_r == pytest.approx([in_prime_ii["Yr"] - mass, in_prime_ii["Nr"] - mass * 0.0357143], rel=1e-4)
    assert by_d == pytest.approx([in_prime_ii["Yd"], in_prime_ii["Nd"]], rel=1e-4)


def test_linearisation_at_the_kink_takes_the_side_that_is_said(ship: t2s.Ship) -> None:
    model = ship.model
    slopes = ca.Function(
        "s", [model.x, model.u, model.p], [ca.jacobian(model.expand(model.symbol("force.Y")), model.symbol("motion.v"))]
    )
    slope = float(slopes(*at_start(model, {}))) / (500 * 7 * 0.46 * 1.179)
    assert slope == pytest.approx(-0.3403, abs=6e-5)
    assert any("gamma_R_minus" in notice for notice in model.notices)


def test_a_ship_alike_to_both_sides_has_mirrored_forces(ship: t2s.Ship) -> None:
    card = changed_mmg(ship, ("gamma_R_minus = 0.395", "gamma_R_minus = 0.640"), ("C_2_minus = 1.1", "C_2_minus = 1.6"))
    forces = Forces(build(card), "force.X", "force.Y", "force.N")
    for u in (1.0, 0.1, -0.5):
        right = forces.at(u=u, v=-0.2, r=0.05, delta=0.3)
        assert forces.at(u=u, v=0.2, r=-0.05, delta=-0.3) == pytest.approx(right * [1, -1, -1], rel=1e-9)


@pytest.mark.parametrize("u", [-1.5, -0.3, 0.0, 1e-9, 0.3, 1.5])
@pytest.mark.parametrize("n", [-15.0, -3.0, 0.0, 1e-9, 3.0, 15.0])
def test_forces_and_slopes_are_finite_in_all_quadrants(ship: t2s.Ship, u: float, n: float) -> None:
    model = ship.model
    value = model.expand(ca.vcat([model.symbol(name) for name in ("force.X", "force.Y", "force.N")]))
    both = ca.Function("f", [model.x, model.u, model.p], [value, ca.jacobian(value, ca.vertcat(model.x, model.u))])
    for v, r in ((0.0, 0.0), (0.4, 0.1), (-0.4, 0.3)):
        at = {"motion.u": u, "motion.v": v, "motion.r": r, "rudder.angle": 0.3, "propeller.speed": 2 * math.pi * n}
        assert all(np.isfinite(np.array(part)).all() for part in both(*at_start(model, at)))


def test_forces_are_continuous_where_a_quadrant_begins(ship: t2s.Ship) -> None:
    forces = Forces(ship.model, "force.X", "force.Y", "force.N")
    size = np.array([10.0, 10.0, 70.0])
    for n in (-5.0, 0.0, 8.0):
        ahead, astern = (forces.at(u=u, v=0.1, r=0.02, delta=0.3, n_rps=n) for u in (1e-7, -1e-7))
        assert np.abs(ahead - astern).max() < 1e-5 * size.max()
    for u in (-0.5, 0.0, 0.8):
        ahead, astern = (forces.at(u=u, v=0.1, r=0.02, delta=0.3, n_rps=n) for n in (1e-6, -1e-6))
        assert np.abs(ahead - astern).max() < 1e-4 * size.max()


def test_a_reversed_propeller_stops_the_ship_and_then_backs_it(ship: t2s.Ship) -> None:
    stop = ship.stop()
    assert 0 < stop.figures["track_reach_lengths"] < 25
    thrust = Forces(ship.model, "propeller.X")
    assert thrust.at(u=1.179, n_rps=-11.85)[0] < -10 and thrust.at(u=0.0, n_rps=-11.85)[0] < -10
    assert thrust.at(u=0.0, n_rps=-5.0)[0] / thrust.at(u=0.0, n_rps=5.0)[0] == pytest.approx(-0.765)


def test_two_propellers_and_rudders_are_mirror_images_and_turn_a_ship_alike(ship: t2s.Ship) -> None:
    twin = changed_mmg(
        ship,
        ("[propeller]", "[propeller]\nnumber = 2\ny_P = 0.03"),
        ("[rudder]", "[rudder]\nnumber = 2\ny_R = 0.03"),
        ("C_1 = 2.0", "C_1 = 0.0"),
    )
    forces = Forces(build(twin), "force.X", "force.Y", "force.N")
    right = forces.at(u=1.0, v=-0.2, r=0.05, delta=0.3)
    assert forces.at(u=1.0, v=0.2, r=-0.05, delta=-0.3) == pytest.approx(right * [1, -1, -1], rel=1e-9)
    thrusts = Forces(build(twin), "propeller.thrust_right", "propeller.thrust_left", "propeller.N")
    outer, inner, moment = thrusts.at(u=1.0, r=-0.05)
    # Turning to port the right one runs ahead: more inflow, less thrust, and a moment to starboard.
    assert outer < inner and moment > 0
    straight = thrusts.at(u=1.0)
    assert straight[0] == pytest.approx(straight[1]) and abs(straight[2]) < 1e-9
    names = "rudder.normal_force_right", "rudder.normal_force_left", "rudder.N"
    first, second, N = Forces(build(twin), *names).at(u=1.0, r=0.1, delta=0.5)
    by_drag = 0.03 * 7 * 0.613 * math.sin(0.5) * (first - second)
    assert pytest.approx((0.5 + 0.312 * 0.464) * 7 * math.cos(0.5) * (first + second) + by_drag, rel=1e-9) == N
    assert abs(by_drag) > 1e-3 * abs(N)
    port, starboard = (t2s.Ship(twin).turn(side).figures["tactical_diameter_m"] for side in (-35, 35))
    assert port == pytest.approx(starboard, rel=1e-6)


def test_a_table_of_thrust_gives_what_its_polynomial_gives(ship: t2s.Ship) -> None:
    J = [0.0, 0.2, 0.4, 0.6, 0.8]
    K_T = [0.2931 - 0.2753 * j - 0.1385 * j * j for j in J]
    card = changed_mmg(ship, ("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", f"J = {J}\nK_T = {K_T}"))
    assert [card.propeller.k_0, card.propeller.k_1, card.propeller.k_2] == pytest.approx([0.2931, -0.2753, -0.1385])


def test_steady_turns_are_found_to_both_sides_of_the_kink(ship: t2s.Ship) -> None:
    """The side of gamma_R_minus is unstable, the other stable: the loop ends in a corner at the straight course."""
    turning = steady_turning(ship.model)
    assert turning.rudder_rad[0] == pytest.approx(-math.radians(35))
    assert turning.rudder_rad[-1] == pytest.approx(math.radians(35))
    (fold,) = [fold for fold in turning.folds if fold.place != turning.straight]
    assert fold.rudder_rad > 0 > fold.yaw_rate_radps
    assert turning.loop is not None and turning.loop.width_deg == pytest.approx(math.degrees(fold.rudder_rad))
    assert turning.growth_per_s[turning.straight - 1] > 0 > turning.growth_per_s[turning.straight + 1]


@pytest.mark.slow
def test_criterion_of_straight_line_stability_is_that_of_the_linear_equivalent(ship: t2s.Ship) -> None:
    """C' of the KVLCC2 on the side of gamma_R_minus: -0.0031 in Prime II."""
    assert ship.stability().to_dict()["margins"]["C_prime"] * (7 / 0.46) ** 2 == pytest.approx(-0.0031, abs=5e-5)


CURVE = "q_0 = 0.0312\nq_1 = -0.0208\nq_2 = -0.0149\n"


@pytest.mark.parametrize(("n_rps", "u"), [(10.0, 1.1), (4.0, 1.1), (0.0, 0.9), (12.0, -0.3)])
def test_torque_and_power_are_those_of_the_open_water_curve(ship: t2s.Ship, n_rps: float, u: float) -> None:
    card = changed_mmg(ship, ("[propeller]\n", f"[propeller]\n{CURVE}eta_R = 1.03\n"))
    torque, power, thrust = Forces(build(card), "propeller.torque", "propeller.power", "propeller.thrust").at(
        n_rps=n_rps, u=u, v=0.0, r=0.0
    )
    diameter, u_P = card.ship.propeller_diameter_m, u * (1 - card.propeller.w_P0 if u > 0 else 1)
    density = card.environment.water_density_kgpm3
    if n_rps:
        J = u_P / n_rps / diameter
        sign = 1 if J > 0 else -1  # J^2 has the sign of the inflow
        K_Q = 0.0312 - 0.0208 * J - 0.0149 * sign * J**2
        assert torque == pytest.approx(density * n_rps**2 * diameter**5 * K_Q / 1.03, rel=1e-9)
        assert torque > 0 or J > 0.8
    else:
        assert torque < 0 > thrust  # the flow turns a propeller that is held
    assert power == pytest.approx(2 * math.pi * n_rps * torque, rel=1e-9, abs=1e-9)


def test_reversed_revolutions_take_power_too(ship: t2s.Ship) -> None:
    card = changed_mmg(ship, ("[propeller]\n", f"[propeller]\n{CURVE}"))
    torque, power = Forces(build(card), "propeller.torque", "propeller.power").at(n_rps=-8.0, u=0.0, v=0.0, r=0.0)
    expected = -card.propeller.astern * card.environment.water_density_kgpm3 * 64.0 * 0.0312
    assert torque == pytest.approx(expected * card.ship.propeller_diameter_m**5, rel=1e-9)
    assert power == pytest.approx(2 * math.pi * -8.0 * torque, rel=1e-9) and power > 0


def test_outputs_of_torque_are_of_cards_with_its_curve_alone(ship: t2s.Ship) -> None:
    assert "propeller.torque" not in ship.model
    model = build(changed_mmg(ship, ("[propeller]\n", f"[propeller]\n{CURVE}")))
    assert {"propeller.torque", "propeller.power"} <= set(model.outputs)
    assert model["propeller.power"].unit == "W" and model["propeller.torque"].unit == "N.m"
    table = "J = [0.0, 0.4, 0.8]\nK_T = [0.2931, 0.16082, -0.01578]\nK_Q = [0.0312, 0.020496, 0.005024]\n"
    card = changed_mmg(ship, ("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385\n", table))
    assert [card.propeller.q_0, card.propeller.q_1, card.propeller.q_2] == pytest.approx([0.0312, -0.0208, -0.0149])
    assert card.propeller.eta_R == 1.0
