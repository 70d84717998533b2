"""Figures against motions whose figures are known without any simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.records.trial_csv import read_trial_csv
from tank2sim.simulation.figures import figures_of
from tank2sim.simulation.manoeuvres import PullOut, SpiralManoeuvre, Turn, Zigzag, parse_manoeuvre, read_orders
from tank2sim.simulation.run import simulate
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.simulation.trial_file import trial_csv


def made_up(model, t, **signals) -> Trajectory:
    """A trajectory with given signals (underscore for the dot), the rest zero."""
    y = np.zeros((len(t), len(model.outputs)))
    x = np.zeros((len(t), len(model.states)))
    u = np.zeros((len(t), len(model.inputs)))
    for name, values in signals.items():
        dotted = name.replace("_", ".", 1)
        for names, table in ((model.outputs, y), (model.state_names, x), (model.input_names, u)):
            if dotted in names:
                table[:, names.index(dotted)] = values
    return Trajectory(model, t, x, u, y)


def test_crossings_and_values_of_a_cubic_are_exact_between_uneven_samples(mariner) -> None:
    """psi = (t - 1)(t - 2)(t - 4) crosses zero at 1, 2 and 4 s; near the ends fewer samples make a parabola."""
    t = np.array([0.0, 0.7, 1.1, 1.9, 2.3, 3.2, 3.9, 4.4, 5.0])
    psi, rate = np.poly1d(np.poly([1.0, 2.0, 4.0])), np.polyder(np.poly1d(np.poly([1.0, 2.0, 4.0])))
    run = made_up(mariner, t, motion_psi=psi(t), motion_r=rate(t), motion_x=t**2)
    np.testing.assert_allclose(run.crossings("motion.psi", "motion.r", 0.0), [1.0, 2.0, 4.0], rtol=1e-12)
    assert len(run.crossings("motion.psi", "motion.r", 99.0)) == 0
    for time in (1.0, 2.7, 4.0):
        assert run.at("motion.psi", time) == pytest.approx(psi(time), abs=1e-12)
    assert [run.at("motion.x", time) for time in (0.3, 1.1, 4.9)] == pytest.approx([0.09, 1.21, 24.01], rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("start", [0.0, 2.5])
def test_a_circle_has_the_figures_of_a_circle(mariner, side: int, start: float) -> None:
    """On a circle of radius R: advance = transfer = R at 90 deg, tactical diameter = steady diameter = 2 R."""
    radius, speed = 300.0, 5.0
    t = np.arange(0, 500, 0.7)
    change = side * speed / radius * t
    ahead, aside = radius * np.sin(abs(change)), side * radius * (1 - np.cos(change))
    run = made_up(
        mariner,
        t,
        motion_psi=start + change,
        motion_r=side * speed / radius,
        motion_speed=speed,
        motion_x=10 + ahead * math.cos(start) - aside * math.sin(start),
        motion_y=20 + ahead * math.sin(start) + aside * math.cos(start),
    )
    figures = figures_of(Turn(side * 0.6), run, 100.0)
    assert figures["advance_m"] == pytest.approx(radius, rel=1e-6)
    assert figures["transfer_m"] == pytest.approx(radius, rel=1e-6)
    assert figures["tactical_diameter_m"] == pytest.approx(2 * radius, rel=1e-6)
    assert figures["steady_diameter_m"] == pytest.approx(2 * radius, rel=1e-9)
    assert figures["advance_lengths"] == pytest.approx(3.0, rel=1e-6)
    assert figures["time_90_s"] == pytest.approx(math.pi / 2 * radius / speed, rel=1e-9)
    assert figures["speed_loss_percent"] == pytest.approx(0.0)


@pytest.mark.parametrize("side", [1, -1])
def test_a_sine_of_heading_has_the_overshoots_of_a_sine(mariner, side: int) -> None:
    amplitude, heading, omega = math.radians(17.0), math.radians(10.0), 0.05
    t = np.arange(0, 300, 0.5)
    psi = side * amplitude * np.sin(omega * t)
    order, sign, now = np.zeros_like(t), side, 0.2 * side
    for k, angle in enumerate(psi):
        if sign * angle >= heading and now == 0.2 * sign:
            sign = -sign
            now = 0.2 * sign
        order[k] = now
    run = made_up(
        mariner,
        t,
        motion_psi=psi,
        motion_r=side * amplitude * omega * np.cos(omega * t),
        motion_rdot=-side * amplitude * omega**2 * np.sin(omega * t),
        motion_speed=5.0,
        rudder_command=order,
    )
    figures = figures_of(Zigzag(0.2 * side, heading), run, 100.0)
    np.testing.assert_allclose(figures["overshoots_deg"], 7.0, atol=1e-5)
    assert len(figures["overshoots_deg"]) == 5
    assert figures["period_s"] == pytest.approx(2 * math.pi / omega, rel=1e-6)


def test_a_port_turn_has_positive_transfer(mariner) -> None:
    figures = simulate(mariner, parse_manoeuvre("turn:-35")).figures
    assert figures["transfer_m"] > 0 and figures["tactical_diameter_m"] > figures["transfer_m"]
    assert figures["steady_rate_degps"] < 0 and figures["steady_drift_deg"] < 0


def test_figures_do_not_depend_on_where_the_ship_starts(mariner) -> None:
    moved = {"initial.x": 500.0, "initial.y": -900.0, "initial.psi": 2.2}
    at_home, abroad = (simulate(mariner, parse_manoeuvre("turn:20"), parameters=start).figures for start in ({}, moved))
    for name, value in at_home.items():
        assert abroad[name] == pytest.approx(value, rel=1e-7), name


def test_a_run_too_short_leaves_figures_open_and_says_so(mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("turn:35"), duration_s=60.0)
    assert run.figures["advance_m"] is None and any("does not show" in notice for notice in run.notices)


def test_the_spiral_of_a_stable_ship_has_no_loop_and_that_of_an_unstable_one_has(mariner_card) -> None:
    stable = simulate(build(mariner_card), parse_manoeuvre("spiral:5")).figures
    assert stable["loop_width_deg"] == 0.0
    assert stable["rate_degps"][0] > 0 > min(stable["rate_degps"])
    # Less yaw damping: C' turns negative, and near midships the ship has two steady turns.
    text = mariner_card.text.replace("Nr = -166e-5", "Nr = -90e-5")
    unstable = simulate(build(parse_card(text, "ship.toml")), parse_manoeuvre("spiral:5")).figures
    assert 0.5 < unstable["loop_width_deg"] < 2.0 and unstable["loop_height_degps"] > 0.1


def test_the_pull_out_of_a_symmetric_stable_ship_ends_straight(mariner_card) -> None:
    text = mariner_card.text.replace("N0 = 3e-5", "N0 = 0.0").replace("Y0 = -4e-5", "Y0 = 0.0")
    for name in ("Y0u = -8e-5", "Y0uu = -4e-5", "N0u = 6e-5", "N0uu = 3e-5"):
        text = text.replace(name, name.split("=")[0] + "= 0.0")
    figures = simulate(build(parse_card(text, "ship.toml")), parse_manoeuvre("pullout:20")).figures
    assert abs(figures["residual_rate_degps"]) < 0.002 < figures["steady_rate_degps"]
    assert figures["time_to_half_rate_s"] > 0


def test_orders_from_a_file_are_held_and_repeat_a_turn(mariner, tmp_path) -> None:
    lines = [f"{t},{35.0 if t < 100 else 0.0}" for t in np.arange(0, 200.5, 0.5)]
    (tmp_path / "orders.csv").write_text("t_s,delta_order_deg\n" + "\n".join(lines) + "\n")
    run = simulate(mariner, parse_manoeuvre(f"file:{tmp_path}/orders.csv")).trajectory
    turn = simulate(mariner, parse_manoeuvre("turn:35"), duration_s=100.0).trajectory
    n = len(turn.t)
    np.testing.assert_allclose(run.x[:n], turn.x, rtol=1e-12, atol=1e-12)
    assert run.t[-1] == pytest.approx(200.0)
    assert set(run["rudder.command"]) == {math.radians(35.0), 0.0}


@pytest.mark.parametrize("comment", ["# rudder_sign: port", "# rudder_sign: Port", "# RUDDER_SIGN: port"])
def test_a_port_positive_orders_file_is_converted(tmp_path, comment: str) -> None:
    (tmp_path / "o.csv").write_text(f"{comment}\nt_s,delta_order_deg\n0,10\n50,-10\n")
    orders = read_orders(tmp_path / "o.csv")
    np.testing.assert_allclose(orders.inputs["rudder.command"], np.radians([-10, 10]))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t_s\n0\n", "lacks"),
        ("t_s,delta_order_deg\n5,1\n6,2\n", "rise from 0"),
        ("t_s,delta_order_deg\n0,1\n0,2\n", "rise from 0"),
        ("t_s,delta_order_deg,sail_deg\n0,1,2\n", "not an order"),
        ("t_s,delta_order_deg\n0,\n1,2\n", "empty"),
        ("t_s,delta_order_deg\n0,hard over\n", "hard over"),
        ("# rudder_sign: prot\nt_s,delta_order_deg\n0,1\n5,2\n", "rudder_sign"),
        ("t_s,delta_order_deg,delta_deg\n0,1,2\n5,1,2\n", "two rudder columns"),
        ("t_s,delta_order_deg\n0,1\n1e8,2\n", "1e\\+08"),
    ],
)
def test_faulty_orders_are_refused(tmp_path, text: str, expected: str) -> None:
    (tmp_path / "o.csv").write_text(text)
    with pytest.raises(InputError, match=expected):
        read_orders(tmp_path / "o.csv")


def test_revolutions_for_a_ship_without_propulsion_are_refused(mariner, tmp_path) -> None:
    (tmp_path / "o.csv").write_text("t_s,delta_order_deg,n_rpm\n0,10,84\n50,0,84\n")
    with pytest.raises(InputError, match="propulsion"):
        simulate(mariner, parse_manoeuvre(f"file:{tmp_path}/o.csv"))


@pytest.mark.parametrize(
    "text", ["turn", "turn:", "turn:x", "turn:0", "turn:95", "zigzag:20", "zigzag:20/-20", "loop:3", ""]
)
def test_what_is_no_manoeuvre_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^manoeuvre: "):
        parse_manoeuvre(text)


def test_manoeuvres_are_read_in_degrees() -> None:
    assert parse_manoeuvre("zigzag:-10/20") == Zigzag(math.radians(-10), math.radians(20))
    spiral = parse_manoeuvre("spiral:2")
    assert isinstance(spiral, SpiralManoeuvre)
    np.testing.assert_allclose(np.degrees(spiral.rudders), [2, 1, 0, -1, -2, -1, 0, 1, 2])


def test_a_run_is_written_as_a_trial_in_the_units_of_its_header(mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("turn:20"), duration_s=30.0).trajectory
    lines = trial_csv(run, "two\nlines").splitlines()
    assert lines[0] == "# two lines"
    header, last = lines[1].split(","), dict(zip(lines[1].split(","), map(float, lines[-1].split(",")), strict=True))
    assert header[:3] == ["t_s", "delta_order_deg", "delta_deg"]
    assert last["delta_order_deg"] == pytest.approx(20.0)
    assert last["r_degps"] == pytest.approx(math.degrees(run["motion.r"][-1]))
    assert last["x_m"] == pytest.approx(run["motion.x"][-1])


def test_heel_is_written_in_a_trial_and_read_again_outwards_in_a_turn(mariner_card, tmp_path) -> None:
    ratio = 3.0  # steady heel is -h u r/g, to port in a turn to starboard
    rolling = f"""
[[effects]]
name = "roll_coupling"
parameters = {{ heel_ratio = {ratio}, Yphi = 3e-4, Nphi = -1e-4 }}
"""
    card = parse_card(mariner_card.text + rolling, "rolling")
    run = simulate(build(card), parse_manoeuvre("turn:20")).trajectory
    (tmp_path / "turn.csv").write_text(trial_csv(run, "turn"), encoding="utf-8")
    signals = read_trial_csv(tmp_path / "turn.csv").signals
    steady = -ratio * run["motion.u"][-1] * run["motion.r"][-1] / 9.80665
    assert steady < 0
    assert signals["phi_rad"][-1] == pytest.approx(steady, rel=1e-4)
    assert signals["phi_rad"] == pytest.approx(run["motion.phi"], abs=1e-9)
    assert abs(run["motion.p"]).max() > 1e-4
    np.testing.assert_allclose(
        np.gradient(run["motion.phi"], run.t)[1:-1], run["motion.p"][1:-1], atol=2e-2 * abs(run["motion.p"]).max()
    )


def test_a_single_order_needs_to_be_reported_how_long(mariner, tmp_path) -> None:
    (tmp_path / "o.csv").write_text("t_s,delta_order_deg\n0,10\n")
    with pytest.raises(InputError, match="or a duration"):
        simulate(mariner, parse_manoeuvre(f"file:{tmp_path}/o.csv"))
    run = simulate(mariner, parse_manoeuvre(f"file:{tmp_path}/o.csv"), duration_s=20.0).trajectory
    assert run.t[-1] == pytest.approx(20.0) and run["motion.psi"][-1] > 0


def test_an_order_beyond_the_gear_is_reported(mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("turn:60"), duration_s=60.0)
    assert any("its gear stops at 40 deg" in notice for notice in run.notices)


def test_a_duration_next_to_the_grid_by_rounding_ends(mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("zigzag:10/10"), duration_s=100.00000000001).trajectory
    assert run.t[-1] == pytest.approx(100.0)


def circling(model, duration: float, rate=1.0, speed=1.0, radius: float = 100.0):
    """Figures of a turn at 5 m/s of a ship of 100 m, yaw rate and speed times what is given over time to the end."""
    t = np.arange(0, duration + 0.05, 0.1)
    psi = 5.0 / radius * t
    motion = {"motion_psi": psi, "motion_x": radius * np.sin(psi), "motion_y": radius * (1 - np.cos(psi))}
    factors = [part(t[-1] - t) if callable(part) else part for part in (rate, speed)]
    run = made_up(model, t, motion_r=5.0 / radius * factors[0], motion_speed=5.0 * factors[1], **motion)
    return figures_of(Turn(0.6), run, 100.0)


@pytest.mark.parametrize("signal", ["rate", "speed"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_turn_is_steady_if_neither_rate_nor_speed_changes_by_a_hundredth_over_two_lengths(
    mariner, signal: str, sign: int
) -> None:
    """Two lengths are 40 s here: a drift of 0.97 % in that time is steady, one of 1.03 % is not."""
    for percent, steady in ((0.97, True), (1.03, False)):
        figures = circling(mariner, 200.0, **{signal: lambda left, share=percent / 4000: 1 + sign * share * left})
        assert (figures["steady_diameter_m"] is not None) == steady, percent
        assert (figures["steady_rate_degps"] is not None) == steady, percent
    assert circling(mariner, 200.0)["steady_diameter_m"] == pytest.approx(200.0)


def test_what_a_turn_did_before_its_last_two_lengths_does_not_make_it_unsteady(mariner) -> None:
    for since, steady in ((40.5, True), (39.5, False)):
        figures = circling(mariner, 200.0, rate=lambda left, since=since: np.where(left > since, 1.05, 1.0))
        assert (figures["steady_diameter_m"] is not None) == steady, since


def test_a_turn_is_not_steady_before_it_has_run_two_lengths(mariner) -> None:
    """In 39 s and 41 s at 5 m/s a ship of 100 m, having turned about, has run 1.95 and 2.05 lengths."""
    short, enough = (circling(mariner, duration, radius=30.0) for duration in (39.0, 41.0))
    assert short["tactical_diameter_m"] == pytest.approx(60.0, rel=1e-6)
    assert short["steady_diameter_m"] is None
    assert enough["steady_diameter_m"] == pytest.approx(60.0)


def spiralling(model, lag: float) -> dict:
    """Figures of a spiral, 10 deg to starboard, to port and back in steps of 5 deg, held for 50 s each.

    Steady rates are 0.1 deg/s a degree of rudder, but on the way back `lag` (deg/s) less.
    """
    rudders = np.array([10.0, 5, 0, -5, -10, -5, 0, 5, 10])
    rates = 0.1 * rudders - np.where(np.arange(9) > 4, lag, 0.0)
    rates[-1] = 1.0
    t = np.arange(0, 450.5, 0.5)
    hold = np.minimum(t // 50, 8).astype(int)
    reached = np.minimum(np.maximum(t - 0.25, 0) // 50, 8).astype(int)  # a row is the end of the hold before
    run = made_up(
        model, t, motion_r=np.radians(rates[reached]), rudder_command=np.radians(rudders[hold]), motion_speed=5.0
    )
    return figures_of(SpiralManoeuvre(tuple(np.radians(rudders))), run, 100.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_spiral_has_a_loop_from_a_twentieth_of_its_largest_rate_on(mariner, sign: int) -> None:
    none, loop = (spiralling(mariner, sign * lag) for lag in (0.045, 0.056))
    np.testing.assert_allclose(none["rate_degps"][:5], [1, 0.5, 0, -0.5, -1], atol=1e-12)
    assert none["loop_height_degps"] == 0.0 and none["loop_width_deg"] == 0.0
    assert loop["loop_height_degps"] == pytest.approx(0.056)
    assert loop["loop_width_deg"] == pytest.approx(0.56)  # 0.1 deg/s a degree


@pytest.mark.parametrize("side", [1, -1])
def test_the_rate_of_a_pull_out_is_halved_after_the_time_constant_times_ln_2(mariner, side: int) -> None:
    """Rudder to neutral at 100 s, where it is 0.5 deg; from there the rate decays with 30 s."""
    t = np.arange(0, 300.05, 0.1)
    rate = side * 0.7 * np.where(t < 99.95, 1.0, np.exp(-(t - 100) / 30))
    order = np.radians(np.where(t < 99.95, side * 20.0, 0.5))
    run = made_up(mariner, t, motion_r=np.radians(rate), rudder_command=order, motion_speed=5.0)
    figures = figures_of(PullOut(side * math.radians(20)), run, 100.0)
    assert figures["steady_rate_degps"] == pytest.approx(side * 0.7)
    assert figures["neutral_rudder_deg"] == pytest.approx(0.5)
    assert figures["time_to_half_rate_s"] == pytest.approx(30 * math.log(2), abs=0.11)
    assert figures["residual_rate_degps"] == pytest.approx(side * 0.7 * math.exp(-200 / 30))
    short = made_up(mariner, t[:1200], motion_r=np.radians(rate[:1200]), rudder_command=order[:1200])
    assert figures_of(PullOut(side * math.radians(20)), short, 100.0)["time_to_half_rate_s"] is None


@pytest.mark.parametrize("side", [1, -1])
def test_a_spiral_goes_from_its_largest_angle_to_the_other_side_and_back(side: int) -> None:
    there = [side * angle for angle in (5, 4, 3, 2, 1, 0, -1, -2, -3, -4, -5)]
    spiral = parse_manoeuvre(f"spiral:{5 * side}")
    assert isinstance(spiral, SpiralManoeuvre)
    np.testing.assert_allclose(np.degrees(spiral.rudders), [*there, *there[-2::-1]], atol=1e-12)
