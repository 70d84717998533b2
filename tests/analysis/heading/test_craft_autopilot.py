"""The autopilot of a craft: thrust curves inverted, moments within the thrusters, heading and speed reached."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.analysis.heading.craft import craft_gains
from tank2sim.analysis.heading.runs import step_figures
from tank2sim.cards import CraftCard, parse_card
from tank2sim.dynamics.small_craft import revolutions_for, thrust_of


@pytest.fixture(scope="module")
def otter() -> t2s.Ship:
    return t2s.load("otter")


@pytest.mark.parametrize("thrust", [-60.0, -1.0, 0.0, 2.0, 100.0])
@pytest.mark.parametrize("along", [0.0, 1.5])
def test_the_revolutions_for_a_thrust_give_it(thrust: float, along: float) -> None:
    curve = [ca.SX(value) for value in (0.011, 0.0065, 0.05)]
    n = revolutions_for(ca.SX(thrust), ca.SX(along), *curve)
    assert float(ca.evalf(thrust_of(n, ca.SX(along), *curve))) == pytest.approx(thrust, abs=1e-9)


def test_the_largest_moment_is_that_of_the_weaker_way_of_both_propellers(otter: t2s.Ship) -> None:
    """Otter: T = (X + N/y)/2 at one side, (X - N/y)/2 at the other; the astern one ends first at any X it leaves."""
    assert isinstance(otter.card, CraftCard)
    port, starboard = craft_gains(otter.card, 1.5).largest_moment_Nm
    most, least = 0.01108 * 103.930864**2, -0.006445 * 101.736666**2
    assert starboard == pytest.approx(0.395 * (most - least), rel=1e-9) and port == pytest.approx(-starboard)


@pytest.mark.slow
def test_a_change_of_course_to_starboard_settles_and_keeps_its_speed(otter: t2s.Ship) -> None:
    found = otter.autopilot(course_change_deg=45.0)
    run = found.runs["course"]
    assert run["r_degps"].iloc[1:50].min() > 0 and run["n_port_rpm"].iloc[1] > run["n_starboard_rpm"].iloc[1]
    assert run["psi_deg"].iloc[-1] == pytest.approx(45.0, abs=0.05)
    assert run["u_mps"].iloc[-1] == pytest.approx(1.5, abs=0.005)
    assert found.study.course_change.overshoot < 4.5
    speed = found.runs["speed"]
    assert speed["u_mps"].iloc[0] == pytest.approx(0.75, abs=0.01)
    assert speed["u_mps"].iloc[-1] == pytest.approx(1.5, abs=0.005)


def test_the_poles_of_the_loop_are_those_of_its_motion(otter: t2s.Ship) -> None:
    """A small change of course decays as the slowest pole that heading shares says."""
    found = otter.autopilot(course_change_deg=0.01)
    assert all(-pole.real >= 0.5 * abs(pole) for pole in found.study.poles)
    run = found.runs["course"]
    error = np.abs(run["psi_deg"] - 0.01).to_numpy()
    time = run["t_s"].to_numpy()
    slowest = min(-pole.real for pole in found.study.poles)
    late = error[time >= 10.0].max()
    assert late < 0.01 * 20 * math.exp(-slowest * 10.0)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (("y_m = -0.395", "y_m = 0.395"), "thrusters"),
        (("y_m = -0.395", "y_m = -0.395\nmax_azimuth_deg = 30.0\nazimuth_time_constant_s = 0.5"), "max_azimuth"),
    ],
)
def test_thrusters_that_cannot_steer_by_their_difference_are_refused(otter: t2s.Ship, change, place) -> None:
    ship = t2s.Ship(parse_card(otter.card.text.replace(*change), "craft.toml"))
    with pytest.raises(t2s.InputError) as raised:
        ship.autopilot()
    assert place in raised.value.place


@pytest.mark.parametrize(
    ("options", "place"),
    [({"design": "lqr"}, "design"), ({"rudder_weight_deg": 3.0}, "rudder_weight_deg"),
     ({"speed_mps": -1.0}, "speed_mps"), ({"course_change_deg": 0.0}, "course_change_deg")],
)  # fmt: skip
def test_what_the_autopilot_of_a_craft_does_not_take_is_refused(otter: t2s.Ship, options, place) -> None:
    with pytest.raises(t2s.InputError) as raised:
        otter.autopilot(**options)
    assert raised.value.source == place


def test_figures_of_a_step_by_hand() -> None:
    time = np.arange(5.0)
    found = step_figures(time, np.array([1.0, 2.0, 3.2, 3.0, 3.0]), 2.0)
    assert found.overshoot == pytest.approx(0.2)
    assert found.settling_time_s == 3.0
    assert found.rise_time_s == pytest.approx(1 + 0.8 / 1.2 - 0.2)
    assert step_figures(time, time, -1.0).rise_time_s is None


def test_heading_errors_in_waves_are_in_proportion_to_the_waves(otter: t2s.Ship) -> None:
    """In calm air and water small waves are the only disturbance, and the craft answers them linearly."""
    calm = {"current_mps": 0.0, "wind_mps": 0.0, "seed": 3}
    small, large = (otter.autopilot(**calm, wave_yaw_deg=size).study.course_keeping for size in (0.05, 0.1))
    ratio = large.heading_error_rms_deg / small.heading_error_rms_deg
    assert small.heading_error_rms_deg > 0.005 and ratio == pytest.approx(2.0, rel=0.02)


def test_a_track_across_a_current_is_kept_by_the_integral(otter: t2s.Ship) -> None:
    """Line of sight alone leaves lookahead times the tangent of the crab angle; 0.3 m/s of 1.5 m/s across the leg."""
    weather = {"current_mps": 0.3, "wind_mps": 0.0, "wave_yaw_deg": 0.0}
    found = otter.autopilot(track=[[0.0, 0.0], [120.0, 0.0]], **weather).cross_track
    alone, held = (found.loc[name, "mean_error_at_end_m"] for name in ("line of sight", "with integral"))
    assert found["finished"].all()
    assert alone > 0.5 and abs(held) < 0.3 * alone


def test_a_thruster_that_is_always_at_its_limit_is_so_for_100_percent_of_the_time(otter: t2s.Ship) -> None:
    found = otter.autopilot(course_change_deg=0.01)
    always = replace(found, study=replace(found.study, at_limit_percent={"course": 99.8, "speed": 3.0}))
    assert "at its limit for 100 % of the time" in " ".join(always.headline)
