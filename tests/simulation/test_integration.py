"""Integration against closed forms, other integrators and the reference trajectories."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import NO_COMPILER, Integrator
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running, SwitchingPlan
from tank2sim.simulation.trajectory import bracketed_root


@pytest.fixture(scope="module")
def integrator(mariner) -> Integrator:
    return Integrator(mariner)


def test_machine_code_and_casadi_take_the_same_steps(mariner, integrator) -> None:
    assert integrator.compiled
    p, u = mariner.parameter_values(), mariner.input_values({"rudder.command": 0.4})
    x = np.array(mariner.initial(p)).ravel()
    interpreted = Integrator(mariner, compiled=False)
    fast, slow = (one.rollout(x, u, p, 0.1, 777) for one in (integrator, interpreted))
    np.testing.assert_allclose(fast, slow, rtol=1e-13, atol=1e-13)
    inputs = np.repeat(u[None, :], 50, axis=0)
    np.testing.assert_allclose(
        integrator.outputs(fast[:50], inputs, p), interpreted.outputs(fast[:50], inputs, p), rtol=1e-13, atol=1e-13
    )


def test_no_compiler_means_casadi_and_one_line_that_says_so(mariner, monkeypatch) -> None:
    with_compiler = simulate(mariner, parse_manoeuvre("turn:20"), duration_s=60.0)
    monkeypatch.setenv("CC", "no-such-compiler")
    without = simulate(mariner, parse_manoeuvre("turn:20"), duration_s=60.0)
    assert NO_COMPILER in without.notices and NO_COMPILER not in with_compiler.notices
    np.testing.assert_allclose(without.trajectory.x, with_compiler.trajectory.x, rtol=1e-12, atol=1e-12)


def test_the_motion_is_that_of_an_adaptive_solver(mariner, integrator) -> None:
    p, u = mariner.parameter_values(), mariner.input_values({"rudder.command": np.radians(-20)})
    running = Running(integrator, inputs={"rudder.command": np.radians(-20)})
    running.run(200.0)
    rhs = lambda _, x: np.array(mariner.rhs(x, u, p)).ravel()  # noqa: E731
    exact = solve_ivp(rhs, (0, 200), np.array(mariner.initial(p)).ravel(), rtol=1e-10, atol=1e-12, max_step=0.2)
    np.testing.assert_allclose(running.trajectory().x[-1], exact.y[:, -1], rtol=1e-6, atol=1e-6)


def test_the_scheme_is_of_fourth_order(mariner, integrator) -> None:
    """Without steering gear limits in play (they are kinks): halving the step divides the error by 16."""
    p, u = mariner.parameter_values(), mariner.input_values()
    x = np.array([0, 0, 0, 7.7, 0.5, 0.01, 0.0])
    ends = [integrator.rollout(x, u, p, 40.0 / n, n)[-1] for n in (10, 20, 40, 1280)]
    errors = [np.abs(end - ends[-1])[3:6].max() for end in ends[:3]]
    assert 11 < errors[0] / errors[1] < 22 and 12 < errors[1] / errors[2] < 20


def test_a_zigzag_switches_at_the_heading_and_not_at_a_step(mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("zigzag:20/20")).trajectory
    switches = 1 + np.flatnonzero(np.diff(run["rudder.command"]))
    assert len(switches) == 4
    np.testing.assert_allclose(np.abs(np.degrees(run["motion.psi"][switches])), 20.0, atol=1e-9)
    assert np.all(np.diff(run.t) > 0)
    off_grid = np.abs(run.t / mariner.step_s - np.round(run.t / mariner.step_s)) > 1e-6
    assert set(np.flatnonzero(off_grid)) <= {
        *switches,
        len(run.t) - 1,
    }  # the last sample is the heading's fifth crossing


def test_halving_the_step_hardly_moves_the_figures(mariner) -> None:
    finer = replace(mariner, step_s=mariner.step_s / 2)
    for text in ("zigzag:20/20", "turn:35"):
        coarse, fine = (simulate(model, parse_manoeuvre(text)).figures for model in (mariner, finer))
        for name, value in coarse.items():
            np.testing.assert_allclose(value, fine[name], rtol=1e-5, err_msg=name)


def test_a_crossing_that_never_comes_ends_at_the_limit(integrator) -> None:
    running = Running(integrator)
    assert not running.run_until("motion.psi", 3.0, rising=True, at_most=33.33)
    assert running.time == pytest.approx(33.33)
    assert running.trajectory().t[-1] == pytest.approx(33.33)


def test_orders_of_a_plan_follow_their_level_by_lag_and_wait(mariner, integrator) -> None:
    """The rudder to port is ordered 3 s after the heading is reached, and moves 2 s later; headings count from 0.1."""
    start = {"initial.psi": 0.1}
    orders = {"rudder.command": 0.3}, {"rudder.command": -0.2}
    running = Running(integrator, {}, start)
    plan = SwitchingPlan(orders, "motion.psi", (0.2, -0.1), 1.0, 2, 150.0, wait_s=2.0, lag_s=3.0)
    running.follow(plan, 900.0)
    run = running.trajectory()
    rows = np.flatnonzero(np.diff(run["rudder.command"])) + 1
    assert run["rudder.command"][rows].tolist() == [0.3, -0.2]
    assert run.t[rows[0]] == pytest.approx(2.0)
    (reached, back) = run.crossings("motion.psi", "motion.r", 0.3)[0], run.crossings("motion.psi", "motion.r", 0.0)[-1]
    assert run.t[rows[1]] == pytest.approx(reached + 5.0) and run.t[-1] == pytest.approx(back + 5.0)
    held = Running(integrator, {}, start)
    held.follow(replace(plan, changes=0), 100.0)
    assert held.time == pytest.approx(100.0) and set(held.trajectory()["rudder.command"]) == {0.0, 0.3}


def test_splitting_a_run_does_not_change_it(integrator) -> None:
    whole, parts = Running(integrator), Running(integrator)
    for running in (whole, parts):
        running.order({"rudder.command": 0.3})
    whole.run(100.0)
    for piece in (13.0, 0.4, 50.1, 36.5):
        parts.run(piece)
    np.testing.assert_allclose(parts.trajectory().x[-1], whole.trajectory().x[-1], rtol=1e-12)


def test_a_motion_that_leaves_all_bounds_is_reported(mariner_card) -> None:
    model = build(parse_card(mariner_card.text.replace("Yv = -1160e-5", "Yv = 0.5"), "ship.toml"))
    with pytest.raises(InputError, match="leaves all bounds"):
        simulate(model, parse_manoeuvre("turn:35"))


def test_trim_starts_in_steady_motion(integrator) -> None:
    running = Running(integrator, {"rudder.command": np.radians(15)}, {"initial.trim": 1.0})
    start = [running.state(name) for name in ("motion.u", "motion.v", "motion.r")]
    running.run(300.0)
    np.testing.assert_allclose([running.state(name) for name in ("motion.u", "motion.v", "motion.r")], start, rtol=1e-9)
    assert start[2] > 0.005


def test_trim_leaves_a_failed_rudder_where_it_is(integrator) -> None:
    start = {"initial.trim": 1.0, "initial.rudder_angle": np.radians(5.0)}
    running = Running(integrator, {"rudder.command": np.radians(20.0), "steering.failed": 1.0}, start)
    assert running.state("rudder.angle") == pytest.approx(np.radians(5.0))
    assert running.state("motion.r") > 0


def test_what_a_short_run_does_not_show_is_named_in_words(mariner) -> None:
    (reported,) = (
        one for one in simulate(mariner, parse_manoeuvre("turn:35"), duration_s=60.0).notices if "not show" in one
    )
    listed = reported.split(": ")[1].split(", ")
    assert {"advance", "transfer", "tactical diameter", "steady diameter"} <= set(listed)


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (math.cos, 1.0, 2.0),
        (lambda x: x**3 - 2, 0.0, 5.0),
        (lambda x: math.exp(x) - 1e6, 0.0, 100.0),
        (lambda x: math.atan(1e6 * (x - 0.3)), -1.0, 1.0),
        (lambda x: (x - 1) ** 3 + 1e-3 * (x - 1), 0.0, 1.7),
        (lambda x: 2 - x, 0.0, 3.0),
    ],
)
def test_the_root_is_that_of_scipy(function, low, high):
    expected = brentq(function, low, high, xtol=1e-15)
    assert bracketed_root(function, low, high) == pytest.approx(expected, abs=1e-12)


def test_an_end_may_be_the_root():
    assert bracketed_root(lambda x: x, 0.0, 1.0) == 0.0
    assert bracketed_root(lambda x: x - 1, 0.0, 1.0) == 1.0


def test_without_a_change_of_sign_it_refuses():
    with pytest.raises(ValueError, match="change of sign"):
        bracketed_root(lambda x: x * x + 1, -1.0, 1.0)


@pytest.fixture(scope="module")
def reference(data):
    return lambda name: np.genfromtxt(data / "reference" / name, delimiter=",", names=True)


def test_the_35_degree_turn_agrees_within_5_cm_over_600_s(mariner, reference) -> None:
    expected = reference("mariner_turn_35.csv")
    run = simulate(mariner, parse_manoeuvre("turn:35"), duration_s=600.0).trajectory
    at = np.searchsorted(run.t, expected["t_s"] - 1e-6)
    np.testing.assert_allclose(run.t[at], expected["t_s"], atol=1e-6)
    distance = np.hypot(run["motion.x"][at] - expected["x_m"], run["motion.y"][at] - expected["y_m"])
    assert distance.max() < 0.05
    for name, column in (
        ("motion.u", "u_mps"),
        ("motion.v", "v_mps"),
        ("motion.r", "r_radps"),
        ("motion.psi", "psi_rad"),
    ):
        np.testing.assert_allclose(run[name][at], expected[column], atol=1e-6)
    np.testing.assert_allclose(run["rudder.angle"][at], -expected["delta_state_rad"], atol=1e-9)


def test_the_10_10_zigzag_overshoots_agree_within_0_02_deg(mariner, reference) -> None:
    expected = reference("mariner_zigzag_10_10.csv")
    figures = simulate(mariner, parse_manoeuvre("zigzag:10/10"), duration_s=float(expected["t_s"][-1])).figures
    heading = np.degrees(expected["psi_rad"])
    inner = heading[1:-1]
    peaks = inner[((inner >= heading[:-2]) & (inner > heading[2:])) | ((inner <= heading[:-2]) & (inner < heading[2:]))]
    overshoots = np.abs(peaks[np.abs(peaks) > 10]) - 10
    assert len(figures["overshoots_deg"]) >= len(overshoots) >= 3
    np.testing.assert_allclose(figures["overshoots_deg"][: len(overshoots)], overshoots, atol=0.02)
