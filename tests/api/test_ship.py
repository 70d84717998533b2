"""Ships and their results through the API: degrees, data frames, and refusals with place and remedy."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.bundled import bundled_cards
from tank2sim.simulation.manoeuvres import Orders, Turn, Zigzag
from tank2sim.simulation.run import simulate


@pytest.fixture(scope="module")
def ship() -> t2s.Ship:
    return t2s.load("mariner")


def test_angles_are_degrees(ship) -> None:
    in_radians = simulate(ship.model, Zigzag(math.radians(20), math.radians(10)))
    run = ship.zigzag(20, 10)
    assert run.figures["overshoot_1_deg"] == in_radians.figures["overshoots_deg"][0]
    np.testing.assert_array_equal(run.df["psi_deg"], np.degrees(in_radians.trajectory["motion.psi"]))
    assert run.df["delta_deg"].abs().max() == pytest.approx(20)


def test_a_turn_to_port_goes_west(ship) -> None:
    port, starboard = ship.turn(-35), ship.turn(35)
    assert port.df["y_m"].min() < -500 and starboard.df["y_m"].max() > 500


def test_orders_of_a_data_frame_are_those_of_a_turn(ship) -> None:
    orders = pd.DataFrame({"t_s": [0.0, 200.0], "delta_order_deg": [20.0, 20.0]})
    turned = simulate(ship.model, Turn(math.radians(20)), duration_s=200.0)
    np.testing.assert_allclose(ship.steer(orders).df["x_m"], turned.trajectory["motion.x"], rtol=1e-12)


def test_orders_of_a_file_are_those_of_its_columns(ship, tmp_path) -> None:
    path = tmp_path / "orders.csv"
    path.write_text("# rudder_sign: port\nt_s,delta_order_deg\n0,-10\n100,15\n200,0\n")
    columns = {"t_s": [0.0, 100.0, 200.0], "delta_order_deg": [10.0, -15.0, 0.0]}
    pd.testing.assert_frame_equal(ship.steer(path).df, ship.steer(columns).df)


@pytest.mark.parametrize(
    ("columns", "place"),
    [
        ({"t_s": [0.0], "rudder": [1.0]}, "column rudder"),
        ({"delta_order_deg": [1.0]}, "header"),
        ({"t_s": [1.0, 2.0], "delta_order_deg": [1.0, 2.0]}, "column t_s"),
        ({"t_s": [0.0, 2.0], "delta_order_deg": [1.0, math.nan]}, "column delta_order_rad"),
    ],
)
def test_orders_at_fault_are_refused_by_place(ship, columns, place) -> None:
    with pytest.raises(t2s.InputError) as raised:
        ship.steer(columns)
    assert raised.value.place == place and raised.value.remedy


def test_a_manoeuvre_as_an_object_has_the_words_of_the_command_line(ship) -> None:
    assert ship.simulate(Turn(math.radians(35)), duration_s=5.0).study.manoeuvre == "turn:35"
    assert Zigzag(math.radians(-10), math.radians(10)).words == "zigzag:-10/10"
    assert Orders(np.zeros(1), {}, "o.csv").words == "file:o.csv"


def test_an_angle_of_no_rudder_is_refused(ship) -> None:
    with pytest.raises(t2s.InputError) as raised:
        ship.turn(120)
    assert "up to 90" in raised.value.remedy


def test_a_run_is_a_trial_for_whoever_reads_it(ship, tmp_path) -> None:
    from tank2sim.records.csv_table import read_table

    run = ship.zigzag(20, 20)
    run.to_csv(tmp_path / "z.csv")
    table = read_table(tmp_path / "z.csv")
    np.testing.assert_allclose(table.columns["psi_deg"], run.df["psi_deg"], rtol=1e-9, atol=1e-9)


def test_values_in_place_of_the_cards_change_the_ship_and_not_the_card(ship) -> None:
    heavier = ship.replace({"derivatives.Nr": -3.3e-3})
    assert heavier.derivatives.loc["Nr", "value"] == -3.3e-3 != ship.derivatives.loc["Nr", "value"]
    assert heavier.turn(20).figures["steady_rate_degps"] < ship.turn(20).figures["steady_rate_degps"]


def test_a_card_is_saved_and_read_again(ship, tmp_path) -> None:
    ship.save(tmp_path / "copy.toml")
    assert t2s.load(tmp_path / "copy.toml").card.text == ship.card.text


def test_state_space_has_the_eigenvalues_of_the_stability_study(ship) -> None:
    found = ship.stability(spirals=False)
    poles = np.linalg.eigvals(ship.state_space(states=["motion.u", "motion.v", "motion.r"]).A)
    np.testing.assert_allclose(sorted(poles.real), sorted(np.real(found.study.eigenvalues)), rtol=1e-3)


def test_states_that_are_left_out_follow_the_others_at_once(ship) -> None:
    signals = {"inputs": ["rudder.command"], "outputs": ["motion.r"]}
    hull = ship.state_space(states=["motion.v", "motion.r"], **signals)
    whole = ship.state_space(**signals)
    assert np.abs(hull.B).min() > 0  # without rudder.angle the order is the rudder
    assert hull.dcgain() == pytest.approx(ship.stability(spirals=False).study.nomoto.dimensional.K_per_s, rel=0.02)
    slow = 1e-4j
    assert hull(slow) == pytest.approx(whole(slow), rel=0.02)
    by_angle = ship.state_space(states=["motion.v", "motion.r"], inputs=["rudder.angle"], outputs=["motion.r"])
    np.testing.assert_allclose(by_angle.B, hull.B)


def test_a_state_that_comes_to_no_rest_is_not_left_out() -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("kvlcc2-captive").state_space(
            states=["motion.u"]
        )  # unstable in sway and yaw, on which its speed depends
    assert refusal.value.source == "states" and "motion.r" in refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("mariner").state_space(states=["motion.flap"])
    assert refusal.value.place == "motion.flap" and "motion.r" in refusal.value.remedy


@pytest.mark.parametrize("argument", ["inputs", "outputs"])
def test_an_unknown_variable_of_a_state_space_is_refused_with_its_argument(ship, argument: str) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        ship.state_space(**{argument: ["motion.yaw_rte"]})
    assert (refusal.value.source, refusal.value.place) == (argument, "motion.yaw_rte")


def test_the_criteria_of_imo_are_a_table(ship) -> None:
    imo = ship.stability(spirals=False).imo
    row = imo.loc["tactical diameter"]
    assert row["met"] == (row["found"] <= row["allowed"]) and row["allowed"] == 5.0


@pytest.mark.slow
def test_an_ensemble_is_the_same_for_the_same_seed(ship) -> None:
    first, second = (ship.turn(20, duration_s=100.0, members=4, seed=3).tables[1].df for _ in range(2))
    pd.testing.assert_frame_equal(first, second)


def test_bundled_ships_are_listed_and_load(ship) -> None:
    listed = t2s.ships()
    assert listed.loc["mariner", "length_m"] == pytest.approx(160.93)
    assert t2s.load("MARINER").name == ship.name


def test_a_name_that_is_no_ship_is_refused_with_a_remedy() -> None:
    with pytest.raises(t2s.InputError) as raised:
        t2s.load("marinner")
    assert "mariner" in raised.value.remedy


def test_a_body_without_rudder_says_so() -> None:
    with pytest.raises(t2s.InputError) as raised:
        t2s.load("wilinski-zellman").turn(20)
    assert "rudder" in raised.value.problem


def test_a_tanks_campaign_gives_a_card_and_a_ship(data) -> None:
    found = t2s.reduce(data / "data/pmm_synthetic_11/campaign.toml")
    assert found.derivatives.loc["Yv", "value"] < 0 < found.derivatives.loc["Yv", "standard_error"]
    assert found.ship.derivatives.loc["Yv", "value"] == pytest.approx(found.derivatives.loc["Yv", "value"])
    assert found.card.covariance is not None


@pytest.mark.slow
def test_an_fmu_passes_its_check(ship, tmp_path) -> None:
    made = ship.to_fmu(tmp_path / "m.fmu", fmi=3)
    assert made.path.stat().st_size == len(made.exported.content)
    found = t2s.check_fmu(tmp_path / "m.fmu")
    assert found.passed and found.study.fmi == 3 and not found.problems


@pytest.mark.slow
def test_a_script_without_a_guard_may_use_processes(tmp_path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import tank2sim as t2s\n"
        "print('once')\n"
        "print(t2s.load('mariner').turn(35, duration_s=5.0, members=80).study.ensemble.usable)\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=250, check=False)
    assert done.stdout == "once\n80\n", done.stderr


def test_every_bundled_ship_is_listed_and_can_be_loaded() -> None:
    listed = t2s.ships()
    assert list(listed.index) == list(bundled_cards()) and len(listed) >= 6
    for name, row in listed.iterrows():
        card = t2s.load(str(name)).card
        assert (row["ship"], row["model"], row["source"]) == (card.ship.name, card.model.kind, card.ship.source)
    assert listed.loc["mariner", "length_m"] == 160.93
