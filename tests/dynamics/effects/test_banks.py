"""Banks and finite depth: by hand, Lataire, Vantorre and Eloot (2009), measured sinkage, and what a pilot sees."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics.effects.banks import FAR_M, SQUAT_BY_BANK, SQUAT_BY_PROPELLER, SWAY, YAW, mean_nearness
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import CB, N0, RHO, STATES, U0, B, G, L, T, added_forces, forces, mariner_text, ship, state, values

AT_WORK = {"propeller.speed": N0}
STOPPED = {"propeller.speed": 0.0}
AHEAD = {**state(6.0, 0.0, 0.0), **AT_WORK}


def bank(port: float = FAR_M, starboard: float = FAR_M, **more: float) -> dict[str, float]:
    return {"port_distance_m": port, "starboard_distance_m": starboard, **more}


def test_a_wall_to_starboard_draws_the_ship_and_turns_its_bow_away() -> None:
    nearness = B / 2 * (1 / (40.0 + B / 2) - 1 / (FAR_M + B / 2))
    scale = 0.5 * RHO * L * T * 6.0**2 * nearness
    found = added_forces("bank", bank(starboard=40.0), AHEAD)
    np.testing.assert_allclose(found, [0.0, scale * SWAY, -scale * L * YAW], rtol=1e-9)
    assert found[1] > 0 > found[2]


def test_banks_at_equal_distances_cancel_and_mirrored_ones_mirror_the_force() -> None:
    np.testing.assert_allclose(added_forces("bank", bank(30.0, 30.0), AHEAD), 0.0, atol=1e-6)
    near, mirrored = (added_forces("bank", bank(*sides), AHEAD) for sides in ((80.0, 25.0), (25.0, 80.0)))
    np.testing.assert_allclose(mirrored, -near, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("slope", [0.0, 1e-4, 1.5, 4.0])
def test_a_sloping_bank_counts_by_the_mean_of_its_nearness_over_the_draught(slope: float) -> None:
    height = (np.arange(20_000) + 0.5) / 20_000 * T - T / 2
    y = 35.0 + B / 2 + slope * height
    expected = np.mean(1 / y)
    x = ca.SX.sym("x")
    found = ca.Function("f", [x], [mean_nearness(x, ca.SX(slope * T / 2))])(35.0 + B / 2)
    assert float(found) == pytest.approx(expected, rel=1e-7)
    wall, sloping = (added_forces("bank", bank(starboard=35.0, slope=one), AHEAD)[1] for one in (0.0, slope))
    far = 1 / (FAR_M + B / 2)
    assert sloping / wall == pytest.approx((expected - far) / (1 / (35.0 + B / 2) - far), rel=1e-5)


@pytest.mark.parametrize("share", [1e-5, 0.99e-3, 1.01e-3, 0.05, 0.5, 0.94, 0.96, 2.0])
def test_the_nearness_of_a_slope_is_its_mean_at_every_steepness_up_to_the_steepest(share: float) -> None:
    """Mean of 1/y from y (1 - s) to y (1 + s), by quadrature; a bank steeper than 0.95 counts as one of 0.95."""
    s = min(share, 0.95)
    x, weights = np.polynomial.legendre.leggauss(60)
    distance = ca.SX.sym("distance")
    found = ca.Function("f", [distance], [mean_nearness(distance, ca.SX(share * 20.0))])(20.0)
    assert float(found) == pytest.approx(weights @ (1 / (1 + s * x)) / 2 / 20.0, rel=1e-10)


def test_validity_is_half_where_the_bank_is_one_and_a_half_times_as_near_as_was_measured() -> None:
    """y_B = 0.26 + 0.26/2 = B/2/(B/2 + distance), less the far side; on either side."""
    distance = B / 2 / (0.39 + B / 2 / (FAR_M + B / 2)) - B / 2
    for side in ("port", "starboard"):
        model = ship({"bank": bank(**{side: distance})})
        assert values(model, ["validity_by.bank"], AHEAD)[0] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(
    ("turns", "speed", "at_work"), [(0.3, 1.0, 0.5), (0.15, 0.5, 0.5), (0.6, 1.0, 1.0), (-0.5, 1.0, 0.0)]
)
def test_a_propeller_counts_as_at_work_by_its_revolutions_for_the_speed(
    turns: float, speed: float, at_work: float
) -> None:
    moving = state(speed * U0, 0.0, 0.0)
    none, part, whole = (
        added_forces("bank", bank(starboard=20.0), {**moving, "propeller.speed": share * N0})
        for share in (0.0, turns, 1.0)
    )
    np.testing.assert_allclose(part, none + at_work * (whole - none), rtol=1e-3, atol=1e-3)


def test_a_stopped_propeller_lets_the_ship_be_pushed_away_near_the_bottom_alone() -> None:
    model_at = {"bank": bank(starboard=20.0), "finite_depth": {"depth_m": 1.1 * T, "resistance": 0.0}}
    ordered = {name: model_at[name] for name in ("finite_depth", "bank")}
    shallow, bare = ship(ordered), ship({"finite_depth": model_at["finite_depth"]})
    moving = {**state(5.0, 0.0, 0.0), **STOPPED}
    names = ["force.Y", "force.N"]
    Y, N = values(shallow, names, moving) - values(bare, names, moving)
    deep_Y, deep_N = added_forces("bank", model_at["bank"], moving)[1:]
    assert Y < 0 < deep_Y and N < deep_N < 0
    working_Y, working_N = added_forces("bank", model_at["bank"], {**moving, **AT_WORK})[1:]
    assert working_Y > deep_Y and working_N < deep_N


def test_nothing_is_felt_at_rest_and_going_astern() -> None:
    for u in (0.0, -3.0):
        np.testing.assert_allclose(
            added_forces("bank", bank(starboard=20.0), {**state(u, 0.0, 0.0), **STOPPED}), 0.0, atol=1e-6
        )


def test_a_bank_and_a_propeller_at_work_add_squat_and_take_from_the_water_under_the_keel() -> None:
    depth, u = 1.5 * T, 5.0
    effects = {"finite_depth": {"depth_m": depth}, "bank": bank(FAR_M, 20.0)}
    names = ["squat.bank", "water.under_keel_clearance", "squat.icorels", "squat.barrass"]
    nearness = B / 2 * (1 / (20.0 + B / 2) - 1 / (FAR_M + B / 2))
    for order, propeller in ((AT_WORK, SQUAT_BY_PROPELLER), (STOPPED, 0.0)):
        squat, clearance, icorels, barrass = values(ship(effects), names, {**state(u, 0.0, 0.0), **order})
        assert squat == pytest.approx(icorels * (1 + SQUAT_BY_BANK * nearness + propeller), rel=1e-9)
        assert clearance == pytest.approx(depth - T - max(squat, icorels, barrass), rel=1e-9)


def test_validity_falls_nearer_than_was_measured_and_a_negative_distance_is_refused() -> None:
    model = ship({"bank": bank(starboard=40.0)})
    inside, near = (
        values(model, ["validity_by.bank"], {**state(U0, 0.0, 0.0), "bank.starboard_distance": distance})[0]
        for distance in (40.0, 8.0)
    )
    assert inside == 1.0 and near < 0.5
    with pytest.raises(InputError):
        model.input_values({"bank.port_distance": -1.0})


EQUIVALENT = {"B": (0.536, 3.5), "D": (0.571, 4.575), "E": (1.024, 3.765), "I": (0.681, 3.8), "J": (2.705, 3.765)}
"""Tests with the propeller at work: distances of walls as near in the mean as the bank, by hand from its shape, and of
the tank's other side, m."""


@pytest.mark.parametrize("name", EQUIVALENT)
def test_a_container_ship_with_its_propeller_at_work_feels_a_bank_as_measured(name: str, data: Path) -> None:
    """Moments within 30 %, forces with the measured sign (Lataire, Vantorre and Eloot 2009)."""
    with (data / "data" / "bank_effects" / "subset2_forces.csv").open() as file:
        (row,) = (row for row in csv.DictReader(file) if row["test"] == name)
    side = -1 if row["psi_deg"] == "180.0" else 1  # the bank is to port
    size = {
        "length_m": 0.945 * 4.332, "beam_m": 0.530, "draught_m": float(row["draught_m"]), "speed_mps": 0.6,
        "block_coefficient": 0.65, "projected_area_front_m2": 0.1, "projected_area_side_m2": 0.5,
        "water_density_kgpm3": 1000.0,
    }  # fmt: skip
    text = mariner_text(valid_speed_mps="", **{key: f"{key} = {value}" for key, value in size.items()})
    near, far = EQUIVALENT[name]
    sides = (far, near) if side > 0 else (near, far)
    _, Y, N = added_forces("bank", bank(*sides), {**state(float(row["u_mps"]), 0.0, 0.0), **AT_WORK}, text)
    assert pytest.approx(float(row["N_Nm"]), rel=0.30) == N
    assert math.copysign(1, Y) == math.copysign(1, float(row["Y_N"]))


DEEP = {"depth_m": 5000.0}
SHOWN = ["squat.barrass", "squat.icorels", "water.under_keel_clearance", "validity"]


@pytest.mark.parametrize("depth", [9.0, 12.0, 20.0])
@pytest.mark.parametrize("u", [3.0, 6.0, 7.7, -2.0])
def test_resistance_is_that_at_the_speed_of_the_same_power_in_deep_water(depth: float, u: float) -> None:
    """Lackenby's loss of speed (ITTC 7.5-04-01-01.1) and a resistance of 77e-5 1/2 rho L^2 u^2."""
    loss = 0.1242 * max(0.98 * B * T / depth**2 - 0.05, 0) + 1 - math.sqrt(math.tanh(G * depth / u**2))
    resistance = [77e-5 * 0.5 * RHO * L**2 * speed**2 for speed in (abs(u) / (1 - loss), abs(u))]
    at = state(u, 0.0, 0.0)
    X = (
        forces(ship({"finite_depth": {"depth_m": depth}}), at)[0]
        - forces(ship({"water_depth": {"depth_m": depth}}), at)[0]
    )
    assert pytest.approx(-math.copysign(resistance[0] - resistance[1], u), rel=1e-5) == X
    assert X * u < 0


def test_the_resistance_of_an_mmg_card_is_its_own() -> None:
    """KVLCC2: R_0' = 0.0141 of 1/2 rho L d U^2."""
    text = Path(read_card("kvlcc2-mmg").source).read_text()
    X = [forces(build_with(text, name), {"motion.u": 5.0})[0] for name in ("finite_depth", "water_depth")]
    loss = 0.1242 * (0.98 * 58.0 * 20.8 / 25.0**2 - 0.05) + 1 - math.sqrt(math.tanh(G * 25.0 / 25.0))
    resistance = 0.0141 * 0.5 * RHO * 320.0 * 20.8 * 5.0**2
    assert X[0] - X[1] == pytest.approx(-resistance * (1 / (1 - loss) ** 2 - 1), rel=1e-5)


def build_with(text: str, name: str) -> Model:
    return ship({name: {"depth_m": 25.0}}, text)


def test_squat_and_clearance_are_the_published_formulas() -> None:
    found = values(ship({"finite_depth": {"depth_m": 12.0}}), SHOWN, state(6.0, 0.0, 0.0))
    barrass = CB * (6.0 / 0.514444444444) ** 2 / 100
    froude = 6.0 / math.sqrt(G * 12.0)
    icorels = 2.4 * CB * L * B * T / L**2 * froude**2 / math.sqrt(1 - froude**2)
    np.testing.assert_allclose(found, [barrass, icorels, 12.0 - T - max(barrass, icorels), 1.0], rtol=1e-6)
    assert 0.5 < icorels < barrass < 1.0


def test_in_deep_water_nothing_changes_but_the_outputs() -> None:
    for at in STATES:
        np.testing.assert_allclose(forces(ship({"finite_depth": DEEP}), at), forces(ship(), at), rtol=2e-3)


def test_a_ship_is_slower_in_shallow_water_and_derivatives_are_those_of_water_depth() -> None:
    shallow = {"depth_m": 1.2 * T}
    reached = {}
    for name, given in (("finite_depth", shallow), ("water_depth", shallow)):
        running = Running(Integrator(ship({name: given})), {"propeller.speed": 0.6 * N0}, {"initial.u": 0.6 * U0})
        running.run(1500.0)
        reached[name] = running.state("motion.u")
    assert 0.75 < reached["finite_depth"] / reached["water_depth"] < 0.98
    at = STATES[0]
    pair = [forces(ship({name: {**shallow}}), at)[1:] for name in ("finite_depth", "water_depth")]
    np.testing.assert_allclose(*pair, rtol=1e-12)


def test_grounding_takes_all_validity_and_a_fast_ship_grounds_where_a_slow_one_floats() -> None:
    model = ship({"finite_depth": {"depth_m": 1.10 * T}}, mariner_text(valid_speed_mps="valid_speed_mps = [2.0, 9.3]"))
    slow, fast = (values(model, SHOWN, state(u, 0.0, 0.0)) for u in (2.2, 7.5))
    assert slow[2] > 0 and slow[3] > 0.9
    assert fast[2] < 0 and fast[3] == 0.0
    factor = values(model, ["validity_by.under_keel_clearance"], state(7.5, 0.0, 0.0))
    assert factor == [0.0]


def test_icorels_is_near_the_sinkage_that_was_measured_in_mid_tank_and_barrass_above_it(data: Path) -> None:
    """8000 TEU container ship, draught 0.180 m, depth 0.243 m (Lataire, Vantorre and Eloot 2009), in mid-tank."""
    with (data / "data" / "bank_effects" / "subset1_squat.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if float(row["y0_m"]) == 0.0]
    size = {
        "length_m": 4.1, "beam_m": 0.530, "draught_m": 0.180, "speed_mps": 0.6, "block_coefficient": 0.66,
        "projected_area_front_m2": 0.1, "projected_area_side_m2": 0.5,
    }  # fmt: skip
    text = mariner_text(valid_speed_mps="", **{key: f"{key} = {value}" for key, value in size.items()})
    model = ship({"finite_depth": {"depth_m": 0.243}}, text)
    assert len(rows) == 4
    for row in rows[:3]:  # the fourth is at the critical speed of the tank
        measured = 1e-3 * max(float(row["sinkage_fore_mm"]), float(row["sinkage_aft_mm"]))
        barrass, icorels, *_ = values(model, SHOWN, state(float(row["u_mps"]), 0.0, 0.0))
        assert icorels == pytest.approx(measured, rel=0.25)
        assert barrass > measured
