"""Rows of a run, its record of motion, and manoeuvres of thrusters: signs, mirror images, steady values by hand."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tank2sim as t2s
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.motion_record import means_of_held, means_of_lines
from tank2sim.simulation.rows import ArrayFunction, Chain, RowFunction


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


_SPANS = st.lists(st.floats(0.05, 3.0), min_size=2, max_size=12)


@settings(max_examples=30, deadline=None)
@given(_SPANS, _SPANS, st.floats(-4.0, 4.0), st.integers(0, 2**31), st.booleans())
def test_means_between_uneven_times_are_those_of_the_course(
    rows: list[float], spans: list[float], begin: float, seed: int, held: bool
) -> None:
    time, edges = np.cumsum([0.0, *rows]), np.cumsum([begin, *spans])
    values = np.random.default_rng(seed).uniform(-1, 1, len(time))
    found = (means_of_held if held else means_of_lines)(time, values, edges)
    for before, after, mean in zip(edges[:-1], edges[1:], found, strict=True):
        middles = before + (after - before) * (np.arange(4000) + 0.5) / 4000
        if held:
            course = values[np.clip(np.searchsorted(time, middles, side="right") - 1, 0, None)]
        else:
            course = np.interp(middles, time, values)
        assert mean == pytest.approx(course.mean(), abs=2e-3)


@pytest.fixture(params=["machine code", "numpy"])
def compiler(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setenv("CC", "no-such-compiler")
    return request.param


def function():
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b", 3)
    return ca.Function("two", [a, b], [ca.densify(a @ b.T), ca.vcat([ca.sin(a[0]) * b[2]])])


def test_each_row_has_its_own_arguments_and_matrices_come_by_columns(compiler):
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((50, 2)), rng.standard_normal((50, 3))
    rows = RowFunction(function())
    assert (rows._rows is None) == (compiler == "numpy")
    outer, sine = rows(a, b)
    expected = np.einsum("ni,nj->nij", a, b)
    np.testing.assert_allclose(outer.reshape(50, 3, 2).transpose(0, 2, 1), expected, rtol=1e-14)
    np.testing.assert_allclose(sine, np.sin(a[:, :1]) * b[:, 2:], rtol=1e-14)


def test_an_argument_without_rows_holds_for_all(compiler):
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((20, 2)), rng.standard_normal(3)
    held, own = RowFunction(function())(a, b), RowFunction(function())(a, np.tile(b, (20, 1)))
    for one, other in zip(held, own, strict=True):
        np.testing.assert_array_equal(one, other)


def test_columns_of_a_larger_table_are_taken_as_they_stand(compiler):
    table = np.random.default_rng(3).standard_normal((5, 20)).T
    outer, _ = RowFunction(function())(table[:, :2], table[:, 2:])
    np.testing.assert_allclose(outer[:, 0], table[:, 0] * table[:, 2], rtol=1e-14)


def test_a_chain_is_the_recursion(compiler):
    x, u, gain = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("gain")
    step = ca.Function("step", [x, u, gain], [ca.vcat([x[0] + gain * u, 0.5 * x[1] + x[0]])])
    inputs = np.random.default_rng(4).standard_normal((30, 1))
    states = Chain(step).run(np.array([1.0, -2.0]), inputs, np.array([0.3]))
    expected = np.array([1.0, -2.0])
    np.testing.assert_array_equal(states[0], expected)
    for row in range(30):
        expected = np.array([expected[0] + 0.3 * inputs[row, 0], 0.5 * expected[1] + expected[0]])
        np.testing.assert_allclose(states[row + 1], expected, rtol=1e-13)
    assert states.shape == (31, 2)


@pytest.mark.parametrize("name", ["esso-osaka", "kvlcc2-mmg", "otter"])
def test_rates_of_a_ship_are_those_of_casadi_also_far_astern_and_at_rest(name):
    """A card's equations hold switches, powers and angles; rows are more than pass through at once."""
    model = build(read_card(name))
    function = ca.Function("rates", [model.x, model.u, model.p], [ca.densify(model.rates)], {"cse": True})
    rng, p = np.random.default_rng(5), model.parameter_values()
    x = rng.uniform(-2.0, 2.0, (4500, len(model.states)))
    x[:10] = 0.0
    u = model.input_values() * rng.uniform(-1.0, 1.0, (4500, 1))
    (found,) = ArrayFunction(function)(x, u, p)
    expected = np.array([np.array(function(*row, p)).ravel() for row in zip(x[::50], u[::50], strict=True)])
    np.testing.assert_allclose(found[::50], expected, rtol=1e-9, atol=1e-12)
    assert np.isfinite(found).all() == np.isfinite(expected).all()
