"""Manoeuvres of a craft with thrusters: signs, mirror images and steady values by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.errors import InputError


@pytest.fixture(scope="module")
def otter() -> t2s.Ship:
    return t2s.load("otter")


def test_a_straight_run_ends_where_thrust_is_resistance(otter: t2s.Ship) -> None:
    run = otter.simulate("straight:572.9578")
    assert run.figures["final_speed_mps"] == pytest.approx(2 * 0.01108 * 60**2 / 77.5544, rel=1e-5)
    # first order, M/X_u: ln 10 time constants to nine tenths
    assert run.figures["time_to_90_percent_s"] == pytest.approx(math.log(10) * 85.281521 / 77.5544, rel=1e-3)


def test_more_revolutions_at_port_turn_to_starboard_and_the_other_way_is_the_mirror_image(otter: t2s.Ship) -> None:
    right, left = otter.simulate("difference:190"), otter.simulate("difference:-190")
    assert right.figures["steady_rate_degps"] > 0 > left.figures["steady_rate_degps"]
    assert right.figures["tactical_diameter_m"] == pytest.approx(left.figures["tactical_diameter_m"], rel=1e-9)
    rate, speed = math.radians(right.figures["steady_rate_degps"]), right.figures["steady_speed_mps"]
    assert right.figures["steady_diameter_m"] == pytest.approx(2 * speed / rate, rel=1e-6)


def test_a_spin_turns_on_the_spot(otter: t2s.Ship) -> None:
    run = otter.simulate("spin:382")
    assert 0 < run.figures["time_180_s"] < run.figures["time_360_s"]
    assert run.figures["largest_distance_lengths"] < 1.0
    assert otter.simulate("spin:-382").figures["final_rate_degps"] == pytest.approx(
        -run.figures["final_rate_degps"], rel=1e-9
    )


def test_stopped_thrusters_let_the_craft_coast_and_reversed_ones_stop_it_sooner(otter: t2s.Ship) -> None:
    coasting = otter.simulate("stop:0").figures
    # u = u0 exp(-X_u t/M) down to a fifth
    assert coasting["time_to_stop_s"] == pytest.approx(math.log(5) * 85.281521 / 77.5544, rel=1e-3)
    assert otter.simulate("stop").figures["track_reach_m"] < coasting["track_reach_m"]


def test_orders_of_each_thruster_come_from_a_file_and_come_out_as_columns(otter: t2s.Ship, tmp_path) -> None:
    orders = tmp_path / "orders.csv"
    orders.write_text("t_s,n_port_rpm,n_starboard_rpm\n0,600,600\n5,700,500\n20,700,500\n")
    run = otter.simulate(f"file:{orders}")
    rows = run.df
    assert {"n_port_rpm", "n_starboard_rpm"} <= set(rows.columns) and "delta_deg" not in rows.columns
    late = rows[rows["t_s"] > 5.1]
    assert np.allclose(late["n_port_rpm"], 700) and np.allclose(late["n_starboard_rpm"], 500)
    assert late["psi_deg"].iloc[-1] > 20


@pytest.mark.parametrize(
    ("card", "manoeuvre", "place"),
    [
        ("otter", "turn:35", "turn:35"),
        ("otter", "zigzag:20/20", "zigzag:20/20"),
        ("mariner", "spin:100", "spin:100"),
        ("otter", "spin:2000", "spin:2000"),
    ],
)
def test_what_a_craft_cannot_do_is_refused(card: str, manoeuvre: str, place: str) -> None:
    with pytest.raises(InputError) as caught:
        t2s.load(card).simulate(manoeuvre)
    assert caught.value.place == place


def test_a_craft_with_one_thruster_cannot_spin(otter: t2s.Ship) -> None:
    text = otter.card.text
    second = text.index("[[thrusters]]", text.index("[[thrusters]]") + 1)
    one = text[:second].replace("y_m = -0.395", "y_m = 0.0").replace("speed_mps = 1.5", "speed_mps = 1.0")
    from tank2sim.cards import parse_card

    with pytest.raises(InputError, match="not on both sides"):
        t2s.Ship(parse_card(one, "one.toml")).simulate("spin:300")
