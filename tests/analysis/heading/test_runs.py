"""Course changes and weather on the nonlinear model, against an integration that shares no code with it."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, lsim, welch

from tank2sim.analysis.heading.designs import design_heading, steering_plant
from tank2sim.analysis.heading.disturbances import Weather, in_weather, wave_yaw_acceleration, weather_for
from tank2sim.analysis.heading.runs import HeadingLoop, course_change, course_keeping, without_anti_windup
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics.autopilot_loop import YAW_DISTURBANCE
from tank2sim.dynamics.model import Model

COURSE = math.radians(20.0)


@pytest.fixture(scope="module")
def loop(mariner: Model) -> HeadingLoop:
    return HeadingLoop(mariner, design_heading(mariner).autopilot)


def test_the_closed_loop_is_that_of_an_independent_integration(loop: HeadingLoop, mariner: Model) -> None:
    pilot = design_heading(mariner, "pid").autopilot
    p, q, count = mariner.parameter_values(), pilot.parameter_values(), len(mariner.states)
    gains = dict(zip(pilot.parameter_names, q, strict=True))
    psi, r = (mariner.state_names.index(name) for name in ("motion.psi", "motion.r"))
    rudder = mariner.input_names.index("rudder.command")

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        error, z = COURSE - x[psi], x[count]
        wish = gains["autopilot.Kp"] * error - gains["autopilot.Kd"] * x[r] + z
        order = np.clip(wish, -gains["autopilot.max_rudder"], gains["autopilot.max_rudder"])
        band = gains["autopilot.integral_band"]
        emptied = np.clip(order - wish, -max(z, 0), max(-z, 0)) / gains["autopilot.anti_windup_time"]
        u = mariner.input_values()
        u[rudder] = order
        moved = np.array(mariner.rhs(x[:count], u, p)).ravel()
        return np.append(moved, gains["autopilot.Ki"] * np.clip(error, -band, band) + emptied)

    run = loop.run({"heading.command": COURSE}, 400.0)
    start = np.append(np.array(mariner.initial(p)).ravel(), 0.0)
    truth = solve_ivp(rate, (0, 400), start, "LSODA", t_eval=run.t[::100], rtol=1e-8, atol=1e-10, max_step=1.0)
    difference = np.degrees(np.abs(run["motion.psi"][::100] - truth.y[psi])).max()
    assert difference < 2e-3  # RK4 across the kinks of limits


def change_by_hand(band_deg: float, *, trimmed: bool) -> tuple[float, float]:
    """Overshoot and largest rudder (deg) of the Mariner in a change by 20 deg, with nothing of the program but gains.

    Her polynomial and her gear are written down again from the printed coefficients.
    """
    card = tomllib.loads(Path(read_card("mariner").source).read_text(encoding="utf-8"))
    d, body, L, u0 = card["derivatives"], card["rigid_body"], card["ship"]["length_m"], card["model"]["speed_mps"]
    mass = [
        [body["mass"] - d["Yvdot"], body["mass"] * body["x_G"] - d["Yrdot"]],
        [body["mass"] * body["x_G"] - d["Nvdot"], body["yaw_inertia"] - d["Nrdot"]],
    ]
    inverse = np.linalg.inv(mass)
    terms = [(name[0], name[1:].replace("0", ""), value) for name, value in d.items() if "dot" not in name]

    Kp, Kd, Ki, band = 1.18, 40.34057, 0.004153122, math.radians(band_deg)

    def rate(_: float, x: np.ndarray) -> list[float]:
        u, v, r, heading, rudder, z = x
        U = math.hypot(u, v)
        prime = {"u": (u - u0) / U, "v": v / U, "r": r * L / U, "d": -rudder}
        force = {"X": 0.0, "Y": 0.0, "N": 0.0}
        for axis, factors, value in terms:
            force[axis] += value * math.prod(prime[one] for one in factors)
        sway, yaw = inverse @ [force["Y"], force["N"]]
        surge = force["X"] / (body["mass"] - d["Xudot"])
        order = Kp * (COURSE - heading) - Kd * r + z  # far from the limit: no anti-windup
        moved = min(max(order - rudder, -math.radians(5)), math.radians(5))  # lag of 1 s, 5 deg/s
        grown = Ki * min(max(COURSE - heading, -band), band)
        return [surge * U**2 / L, sway * U**2 / L, yaw * U**2 / L**2, r, moved, grown]

    sway, trim = (0.009144, math.radians(-1.1078)) if trimmed else (0.0, 0.0)  # of her straight course
    run = solve_ivp(rate, (0, 250), [u0, sway, 0, 0, trim, trim], "LSODA", np.arange(0, 250, 0.1), rtol=1e-7, atol=1e-9)
    return math.degrees(run.y[3].max()) - 20.0, math.degrees(run.y[4].max())


def test_the_overshoot_is_that_of_a_ship_written_down_again_and_the_band_of_the_integral_makes_it(
    loop: HeadingLoop,
) -> None:
    found = course_change(loop.run({"heading.command": COURSE}, 250.0), COURSE)
    overshoot, rudder = change_by_hand(2.0, trimmed=False)
    assert found.overshoot_deg == pytest.approx(overshoot, abs=2e-3)
    assert found.largest_rudder_deg == pytest.approx(rudder, abs=5e-3)
    # An integral that takes the whole of a course change swings the ship past, and so does one without her trim.
    begin = loop.kept_course({}, 1400.0)
    for band in (180.0, 2.0):
        taken = {"autopilot.integral_band": math.radians(band)}
        run = loop.run({"heading.command": COURSE}, 250.0, parameters=taken, begin=begin)
        found = course_change(run, COURSE)
        overshoot, rudder = change_by_hand(band, trimmed=True)
        assert (found.overshoot_deg, found.largest_rudder_deg) == pytest.approx((overshoot, rudder), abs=0.02)
    assert change_by_hand(180.0, trimmed=True)[0] == pytest.approx(2.60, abs=0.02)


def test_a_course_change_ends_on_the_new_course(loop: HeadingLoop) -> None:
    figures = course_change(loop.run({"heading.command": COURSE}, 900.0), COURSE)
    assert figures.rise_time_s is not None and 50 < figures.rise_time_s < 70
    assert 1 < figures.overshoot_deg < 2
    assert figures.largest_rudder_deg < 20
    assert 2 < figures.rate_limited_s < 4  # 20 deg are more than the largest step that stays linear, 4.2 deg


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pd", "lqr", "robust"])
def test_so_does_every_other_design(mariner: Model, kind: str) -> None:
    if kind == "robust":
        pytest.importorskip("slycot", reason="slycot is not installed")
    loop = HeadingLoop(mariner, design_heading(mariner, kind).autopilot)
    figures = course_change(loop.run({"heading.command": COURSE}, 900.0), COURSE)
    assert figures.rise_time_s is not None and 30 < figures.rise_time_s < 90
    assert 0 < figures.overshoot_deg < 2


def test_figures_of_a_second_order_step_are_those_of_the_textbook(loop: HeadingLoop) -> None:
    run = loop.run({"heading.command": 0.0}, 200.0)
    damping, w, t = 0.5, 0.1, run.t
    shaken = w * math.sqrt(1 - damping**2)
    step = 1 - np.exp(-damping * w * t) * (np.cos(shaken * t) + damping * w / shaken * np.sin(shaken * t))
    x = run.x.copy()
    x[:, run.model.state_names.index("motion.psi")] = -0.3 * step
    y = run.y.copy()
    y[:, run.model.outputs.index("motion.psi")] = -0.3 * step
    made = type(run)(run.model, run.t, x, run.u, y)
    figures = course_change(made, -0.3)
    peak = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    assert figures.overshoot_deg == pytest.approx(math.degrees(0.3) * peak, rel=1e-3)
    assert figures.rise_time_s == pytest.approx(16.39, abs=0.05)  # 1.639/w at a damping of 0.5
    outside = np.flatnonzero(np.abs(step - 1) > 0.02)
    assert figures.settling_time_s == pytest.approx(t[outside[-1] + 1])


def test_anti_windup_keeps_a_large_change_of_course_from_swinging_past(loop: HeadingLoop, mariner: Model) -> None:
    pilot, order = design_heading(mariner, "pid").autopilot, math.radians(90.0)
    with_it, without = (
        course_change(loop.run({"heading.command": order}, 900.0, parameters=values), order)
        for values in ({}, without_anti_windup(pilot))
    )
    assert with_it.largest_rudder_deg == pytest.approx(35.0, abs=0.01)
    assert with_it.overshoot_deg < 4
    assert without.overshoot_deg > 12
    assert with_it.settling_time_s is not None and without.settling_time_s is not None
    assert with_it.settling_time_s < 0.6 * without.settling_time_s
    assert without_anti_windup(design_heading(mariner, "pd").autopilot) == {}


@pytest.mark.slow
def test_in_a_steady_wind_only_the_integral_comes_back_to_the_course(
    mariner: Model, mariner_card: ManoeuvringCard
) -> None:
    ship, inputs = in_weather(mariner, mariner_card, Weather(wave_yaw_rad=0.0))
    errors = {}
    for kind in ("pd", "pid"):
        run = HeadingLoop(ship, design_heading(mariner, kind).autopilot).run({**inputs, "heading.command": 0.0}, 1800)
        errors[kind] = course_keeping(run, 0.0, 1200.0)
    assert abs(errors["pid"].heading_error_mean_deg) < 0.01
    assert abs(errors["pd"].heading_error_mean_deg) > 0.5
    # It stays on the course, and is set by current and wind all the same.
    assert abs(run["motion.y"][-1]) > 100


def test_course_keeping_figures_are_sums_over_the_samples(loop: HeadingLoop) -> None:
    run = loop.run({"heading.command": COURSE}, 100.0)
    kept = course_keeping(run, 0.0, 40.0)
    heading = np.degrees(run["motion.psi"][run.t >= 40])
    assert kept.duration_s == pytest.approx(60.0)
    assert kept.heading_error_deg2s == pytest.approx(np.trapezoid(heading**2, dx=0.1), rel=2e-3)
    assert kept.heading_error_rms_deg == pytest.approx(math.sqrt(kept.heading_error_deg2s / 60.0))
    moved = np.abs(np.diff(np.degrees(run["rudder.angle"][run.t >= 40]))).sum()
    assert kept.rudder_travel_degps == pytest.approx(moved / 60.0)
    quick = np.abs(np.diff(np.degrees(run["rudder.angle"]))) / 0.1 > 4.99
    assert 0 < course_keeping(run, 0.0, 0.0).rate_limited_percent == pytest.approx(100 * quick.mean())


def test_the_yaw_of_waves_is_narrow_about_its_frequency_and_of_the_size_asked() -> None:
    weather, step = Weather(), 0.2
    made = wave_yaw_acceleration(weather, step, 60_000)
    assert made.std() == pytest.approx(weather.wave_radps**2 * weather.wave_yaw_rad, rel=0.08)
    frequency, density = welch(made, 1 / step, nperseg=4096)
    peak = 2 * math.pi * frequency[np.argmax(density)]
    assert peak == pytest.approx(weather.wave_radps, rel=0.05)
    # |2 z w s/(s^2 + 2 z w s + w^2)|^2, the shape of the filter
    s = 2j * math.pi * frequency[1:]
    a = 2 * weather.wave_damping * weather.wave_radps
    shape = np.abs(a * s / (s**2 + a * s + weather.wave_radps**2)) ** 2
    near = (frequency[1:] > 0.05) & (frequency[1:] < 0.2)
    ratio = density[1:][near] / shape[near]
    assert np.std(ratio) / np.mean(ratio) < 0.4
    np.testing.assert_array_equal(made[:100], wave_yaw_acceleration(weather, step, 60_000)[:100])


@pytest.mark.slow
def test_waves_turn_a_ship_as_their_moment_turns_her_linear_hull(mariner: Model, mariner_card: ManoeuvringCard) -> None:
    weather = weather_for(160.0, current_mps=0.0, wind_mps=0.0)
    ship, inputs = in_weather(mariner, mariner_card, weather)
    pilot = design_heading(mariner).autopilot
    loop = HeadingLoop(ship, pilot)
    waves = wave_yaw_acceleration(weather, loop.model.step_s, 9000)
    still = {"autopilot.Kp": 0.0, "autopilot.Kd": 0.0, "autopilot.Ki": 0.0}
    seas, calm = (
        loop.run({**inputs, YAW_DISTURBANCE: shaken, "heading.command": 0.0}, 900, parameters=still)
        for shaken in (waves, 0 * waves)
    )
    hull = steering_plant(mariner).A[:2, :2]
    linear = StateSpace(hull, [[0.0], [1.0]], [[0.0, 1.0]], [[0.0]])
    _, wanted, _ = lsim(linear, np.append(waves, 0.0), seas.t, interp=False)
    assert np.std(seas["motion.r"] - calm["motion.r"] - wanted.ravel()) < 0.1 * wanted.std()
    assert wanted.std() == pytest.approx(weather.wave_yaw_rad * weather.wave_radps, rel=0.2)
