"""Places, missing forces, kinematic contradictions and equations, on values made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.diagnosis.kinematic_consistency import kinematic_consistency
from tank2sim.gap.diagnosis.misfit_location import (
    _at_work,
    equation_of,
    explained_share,
    figures,
    missing_force_by_state,
    places,
)
from tank2sim.gap.result import MissingForce, Passed
from tests.gap.misfit_motion import NOISE, TIME, motion
from tests.identification.trials import made_up_ship


def moved(replay: Passed, signal: str, begin: float, end: float, size: float) -> Passed:
    inside = (replay.time_s >= begin) & (replay.time_s <= end)
    measured = {**replay.measured, signal: replay.measured[signal] + np.where(inside, size * NOISE[signal], 0.0)}
    return Passed(replay.name, replay.held_out, replay.time_s, replay.noise, measured, replay.before, replay.after)


def test_noise_has_no_places() -> None:
    assert places([motion(seed=seed) for seed in range(4)]) == ()


def test_places_are_where_the_misfit_was_put_and_their_shares_are_of_all() -> None:
    replay = moved(motion(), "motion.u", 100.0, 200.0, 8.0)
    zigzag = moved(motion(seed=2, name="zigzag"), "motion.v", 300.0, 400.0, 4.0)
    first, second = places([of_velocities(replay), of_velocities(zigzag)])
    assert (first.trial, first.signal, second.trial, second.signal) == ("turn", "motion.u", "zigzag", "motion.v")
    assert first.t_start_s == pytest.approx(100.0, abs=6.0) and first.t_end_s == pytest.approx(200.0, abs=6.0)
    # 8^2 against 4^2 over 100 s each
    assert first.share_of_misfit == pytest.approx(
        0.8, abs=0.03
    ) and first.share_of_misfit + second.share_of_misfit == pytest.approx(1.0)
    assert len(places([of_velocities(replay), of_velocities(zigzag)], limit=1)) == 1


def of_velocities(replay: Passed) -> Passed:
    """Without positions, which would contradict them."""
    kept = {name: sigma for name, sigma in NOISE.items() if name not in ("motion.x", "motion.y")}
    return replace(replay, noise=kept)


def test_a_track_is_a_place_while_it_is_left_and_not_for_staying_off() -> None:
    """For 50 s the model is carried to the side; after that it stays beside the track, and is right again."""
    replay = motion()
    off = 0.4 * np.clip(TIME - 150.0, 0.0, 50.0)
    drifted = replace(replay, before={**replay.before, "motion.y": replay.before["motion.y"] + off})
    (place,) = places([drifted])
    assert place.signal == "motion.y" and place.share_of_misfit == 1.0
    assert place.t_start_s == pytest.approx(150.0, abs=8.0) and place.t_end_s == pytest.approx(200.0, abs=8.0)


def test_a_wrong_yaw_rate_is_the_place_and_not_the_heading_and_track_that_follow_from_it() -> None:
    replay = motion()
    r = replay.before["motion.r"] + np.where((TIME > 100) & (TIME < 150), 0.002, 0.0)
    psi = replay.before["motion.psi"] + 0.002 * np.clip(TIME - 100, 0.0, 50.0)
    u, v = replay.before["motion.u"], replay.before["motion.v"]
    x = np.cumsum(0.5 * (u * np.cos(psi) - v * np.sin(psi)))
    y = np.cumsum(0.5 * (u * np.sin(psi) + v * np.cos(psi)))
    before = {**replay.before, "motion.r": r, "motion.psi": psi, "motion.x": x, "motion.y": y}
    assert replace(replay, before=before).misfit("before", "motion.y") > 20
    (place,) = places([replace(replay, before=before)])
    assert place.signal == "motion.r"
    assert place.t_start_s == pytest.approx(100.0, abs=6.0) and place.t_end_s == pytest.approx(150.0, abs=6.0)


def test_a_force_is_at_work_when_it_was_put_there() -> None:
    rng = np.random.default_rng(12)
    count = 400
    force = rng.standard_normal((count, 3))
    force[100:150, 2] += 12.0
    trials = ["a"] * 200 + ["b"] * 200
    time = np.tile(2.0 * np.arange(200), 2)
    columns = {name: values[:count] for name, values in states().items()}
    found = missing_force_by_state(trials, time, force, np.ones((count, 3)), columns)
    assert found is not None
    (passage,) = found.passages
    assert (passage.trial, passage.equation) == ("a", "yaw") and passage.size == pytest.approx(12.0, rel=0.1)
    assert passage.t_start_s == pytest.approx(200.0, abs=6.0) and passage.t_end_s == pytest.approx(298.0, abs=6.0)


def test_a_motion_that_ran_away_is_a_place() -> None:
    replay = motion()
    lost = np.where(TIME > 250, np.nan, replay.before["motion.r"])
    (place,) = places(
        [Passed(replay.name, False, TIME, NOISE, replay.measured, {**replay.before, "motion.r": lost}, replay.after)]
    )
    assert place.signal == "motion.r" and place.share_of_misfit == 1.0
    assert place.t_start_s == pytest.approx(250.0, abs=6.0) and place.t_end_s == TIME[-1]


def test_figures_at_the_end_of_trials(mariner_card: ManoeuvringCard) -> None:
    replay = motion()
    slower = {**replay.before, "motion.u": np.linspace(5.0, 4.0, len(TIME))}
    shown = Passed(replay.name, False, TIME, NOISE, replay.measured, replay.before, slower)
    found = {figure.name: figure for figure in figures(mariner_card, [], [shown], "after")}
    assert found["final_heading_deg"].measured == pytest.approx(np.degrees(0.025 * 399.5), abs=0.2)
    assert found["speed_loss_percent"].measured == pytest.approx(0.0, abs=0.6)
    predicted = found["speed_loss_percent"].predicted
    assert predicted is not None and predicted == pytest.approx(20.0, abs=0.6)
    assert found["made_good_m"].measured > 0


def states(count: int = 4000) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    names = ("rudder", "drift", "yaw rate", "speed", "heading")
    columns = dict(zip(names, rng.uniform(-0.6, 0.6, (5, count)), strict=True))
    columns["drift"] = 0.3 * columns["rudder"] + 0.9 * columns["drift"]  # turns follow rudders, not closely
    return columns


def found_force(force: np.ndarray, errors: np.ndarray) -> MissingForce | None:
    count = len(force)
    return missing_force_by_state(["a"] * count, np.arange(count, dtype=float), force, errors, states())


def test_a_force_that_is_a_function_of_the_rudder_is_explained_by_the_rudder() -> None:
    rng = np.random.default_rng(6)
    rudder = states()["rudder"]
    force = rng.standard_normal((4000, 3)) * [1e3, 1e3, 1e5]
    force[:, 1] += 5e3 * np.where(np.abs(rudder) > 0.35, np.sign(rudder), 0.0)
    found = found_force(force, np.tile([1e3, 1e3, 1e5], (4000, 1)))
    assert found is not None and found.equation == "Y" and found.explaining == "rudder"
    assert found.explained["rudder"] > 0.8 and found.explained["heading"] < 0.2


def test_a_force_of_the_heading_is_found_round_the_circle() -> None:
    rng = np.random.default_rng(7)
    turned = 20 * states()["heading"]
    force = rng.standard_normal((4000, 3))
    force[:, 0] += 4 * np.cos(turned)
    count = len(force)
    errors = np.ones((count, 3))
    found = missing_force_by_state(["a"] * count, np.arange(count), force, errors, {**states(), "heading": turned})
    assert found is not None and found.equation == "X" and found.explaining == "heading"
    assert found.explained["heading"] > 0.8


def test_a_force_within_its_error_is_none() -> None:
    force = 0.9 * np.random.default_rng(8).standard_normal((4000, 3))
    assert found_force(force, np.ones((4000, 3))) is None


def test_shares_are_those_of_the_variance_and_none_for_what_is_unrelated() -> None:
    rng = np.random.default_rng(9)
    state = rng.uniform(-1, 1, 5000)
    steps = np.sign(state)
    force = steps + rng.standard_normal(5000)  # half of the variance is of the step
    weights = np.ones(5000)
    assert explained_share(state, force, weights) == pytest.approx(0.5, abs=0.03)
    assert explained_share(rng.uniform(-1, 1, 5000), force, weights) < 0.01
    assert explained_share(np.zeros(5000), force, weights) == 0.0


def test_kinematics_contradict_a_biased_gyro_and_a_current() -> None:
    clean, turned, carried = (
        kinematic_consistency([motion(seed=seed, **fault) for seed in (1, 2, 3)])
        for fault in ({}, {"bias": 5e-4}, {"current": 0.3})
    )
    assert clean.turning < 3 and clean.track < 3
    assert turned.turning > 10 and turned.track < 3
    assert carried.track > 10 and carried.turning < 3


@pytest.mark.parametrize(
    ("name", "parameters", "expected"),
    [
        ("current", {"speed_mps": 0.5, "direction_rad": 1.0}, "kinematics"),
        ("gyro_bias", {"rate_radps": 1e-3}, "sensor"),
        ("rudder_lag", {"time_constant_s": 3.0}, "actuator"),
        ("hull_fouling", {"X_prime": -2e-4}, "surge"),
        ("turning_drag", {"Xvr": 2e-3}, "surge"),
        ("linear_yaw_damping", {"factor": 0.2}, "yaw"),
        ("added_sway_mass", {"factor": 0.3}, "sway"),
    ],
)
def test_a_named_effect_tells_its_equation(name: str, parameters: dict[str, float], expected: str) -> None:
    lines = "\n".join(f"{key} = {value}" for key, value in parameters.items())
    text = f'{made_up_ship.CARD}\n[[effects]]\nname = "{name}"\n[effects.parameters]\n{lines}\n'
    improved = parse_card(text, "made_up.toml")
    assert isinstance(improved, ManoeuvringCard)
    assert equation_of([name], improved, None, []) == expected


def test_without_a_name_kinematics_speak_before_forces(mariner_card: ManoeuvringCard) -> None:
    force = MissingForce("N", ("a",), np.zeros(1), np.ones(1), {}, "rudder", {})
    assert equation_of([], mariner_card, force, [motion()]) == "yaw"
    assert equation_of([], mariner_card, force, [motion(current=0.3)]) == "kinematics"
    assert equation_of([], mariner_card, force, [motion(bias=5e-4)]) == "sensor"
    assert equation_of([], mariner_card, None, [motion()]) == ""


@pytest.mark.parametrize(("low", "whole"), [(0.8, True), (0.6, False)])
def test_a_force_is_at_work_where_its_square_is_above_half_of_its_mean_square(low: float, whole: bool) -> None:
    """Half of the time 1.2, half `low`: 0.64 of a mean of 1.04 is at work, 0.36 of 0.9 is not."""
    time = np.arange(200.0)
    force = np.zeros((200, 3))
    force[:, 1] = np.where(time < 100, 1.2, low)
    (found,) = _at_work(np.array(["a"] * 200, dtype=object), time, force, np.full((200, 3), 0.05))
    inside = (time >= found.t_start_s) & (time <= found.t_end_s)
    assert found.force == pytest.approx(np.sqrt(np.mean(force[inside, 1] ** 2)))
    assert found.equation == "sway" and found.t_start_s == pytest.approx(0.0, abs=5)
    assert found.t_end_s == pytest.approx(199.0 if whole else 99.0, abs=5)
