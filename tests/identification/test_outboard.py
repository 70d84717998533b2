"""A craft with one outboard from trials as a log gives them: rudder columns, revolutions, position and heading."""

from __future__ import annotations

from pathlib import Path

import craft_log
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.records.craft_trials import read_craft_trial

PLACE = -1.4
THRUST = 0.03  # N s^2
LEGS = [(8, 0.6, 0), (7, 0.6, 20), (7, 0.8, -20), (6, 0.8, 10), (8, 0.0, 0), (6, 0.9, -25), (6, 0.4, 25), (7, 1.0, 0)]


@pytest.fixture(scope="module")
def craft() -> dict[str, float]:
    return craft_log.random_craft(np.random.default_rng(7))


def written(path: Path, craft: dict[str, float], columns: str = "n_rpm,delta_deg", side: float = 1.0) -> Path:
    """A trial by the integration of the benchmark; the helm's angle is positive where the craft turns to starboard."""
    rng, full = np.random.default_rng(2), craft["rpm"] * np.pi / 30
    state, n, angle, t, rows = np.zeros(6), 0.0, 0.0, 0.0, []
    for seconds, share, degrees in LEGS:
        for _ in range(round(seconds / 0.02)):
            if round(t / 0.02) % 10 == 0:
                rows.append([t, *state[:3], n * 30 / np.pi, side * np.degrees(angle)])
            n += (share * full - n) * 0.02 / 0.3
            angle += (np.radians(degrees) - angle) * 0.02 / 0.4
            T = THRUST * n * abs(n)
            push = np.array([T * np.cos(angle), -T * np.sin(angle), -PLACE * T * np.sin(angle)])  # the stern to port
            psi, u, v, r = state[2:]
            speed = [u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r]
            state = state + 0.02 * np.array([*speed, *craft_log.rates(craft, state[3:], np.zeros(2), push)])
            t += 0.02
    table = np.array(rows)
    table[:, 1:3] += 0.01 * rng.normal(size=(len(table), 2))
    table[:, 3] = np.degrees(table[:, 3]) + 0.1 * rng.normal(size=len(table))
    np.savetxt(path, table, delimiter=",", header=f"t_s,x_m,y_m,psi_deg,{columns}", comments="")
    return path


@pytest.fixture(scope="module")
def card(craft) -> t2s.Ship:
    text = craft_log.first_card(craft, np.random.default_rng(5)).card.text
    thruster = f"""[[thrusters]]
name = "outboard"
x_m = {PLACE}
ahead_Ns2 = {1.4 * THRUST}
astern_Ns2 = {THRUST}
max_rpm = {1.05 * craft["rpm"]}
max_azimuth_deg = 35.0
azimuth_time_constant_s = 0.4
"""
    return t2s.Ship(parse_card(text[: text.index("[[thrusters]]")] + thruster, "outboard.toml"))


def test_the_columns_of_a_rudder_are_the_direction_of_the_one_outboard(craft, card, tmp_path) -> None:
    by_rudder = read_craft_trial(written(tmp_path / "a.csv", craft), card.card.thrusters)
    columns = "n_outboard_rpm,azimuth_outboard_deg"
    by_name = read_craft_trial(written(tmp_path / "b.csv", craft, columns, side=-1.0), card.card.thrusters)
    for signal in ("azimuth_outboard_rad", "n_outboard_radps"):
        np.testing.assert_allclose(by_rudder.signals[signal], by_name.signals[signal], atol=1e-12)


@pytest.mark.slow
def test_thrust_and_damping_are_found(craft, card, tmp_path) -> None:
    path = written(tmp_path / "trial.csv", craft)
    found = t2s.identify(card, path).study.coefficients
    truth = {"outboard.ahead": THRUST, "Xu": craft["Xu"], "Nr": craft["Nr"], "Nrabsr": craft["Nrabsr"]}
    for name, value in truth.items():
        assert abs(found[name].value - value) < 3 * found[name].standard_error, name
    assert found["outboard.ahead"].standard_error < 0.15 * THRUST


def test_a_trial_without_the_direction_is_refused(craft, card, tmp_path) -> None:
    path = written(tmp_path / "trial.csv", craft, "n_outboard_rpm,heel_deg")
    with pytest.raises(InputError, match="azimuth_outboard_deg"):
        t2s.identify(card, path)
