"""Current, wind, waves and banks against their equations in plain numpy."""

from __future__ import annotations

import numpy as np
import pytest

from .ships import FRONT, RHO, RHO_AIR, SIDE, STATES, TYPICAL, B, G, L, added_forces, forces, ship, state, values


def wind_by_angle(speed: float, direction: float, at: dict[str, float], water: tuple[float, float]) -> np.ndarray:
    """X, Y, N by the relative wind's speed and angle, found with angles and distances, not with components."""
    psi, u, v = at["motion.psi"], at["motion.u"], at["motion.v"]
    over_ground = (u + 1j * v) * np.exp(1j * psi) + water[0] * np.exp(1j * water[1])
    felt = speed * np.exp(1j * (direction + np.pi)) - over_ground  # towards
    V, gamma = abs(felt), np.angle(-felt) - psi  # from, clockwise from the bow
    q = 0.5 * RHO_AIR * V**2
    Y = -q * SIDE * 0.8 * np.sin(gamma)
    return np.array([-q * FRONT * 0.7 * np.cos(gamma), Y, -q * SIDE * L * 0.1 * np.sin(2 * gamma) - 5.0 * Y])


@pytest.mark.parametrize("at", STATES)
@pytest.mark.parametrize("direction_deg", [0.0, 35.0, 120.0, -100.0])
def test_wind_is_the_force_by_speed_and_angle_of_the_relative_wind(at, direction_deg) -> None:
    at = {**at, "motion.psi": 0.7}
    found = added_forces("wind", {"speed_mps": 12.0, "direction_deg": direction_deg, "centroid_forward_m": -5.0}, at)
    np.testing.assert_allclose(found, wind_by_angle(12.0, np.radians(direction_deg), at, (0.0, 0.0)), rtol=1e-7)


@pytest.mark.parametrize("order", [("wind", "current"), ("current", "wind")])
def test_wind_blows_over_the_ground_and_current_adds_to_the_ships_way(order) -> None:
    at = {**STATES[0], "motion.psi": 2.1}
    effects = {"wind": {"speed_mps": 12.0, "direction_deg": 35.0, "centroid_forward_m": -5.0},
               "current": {"speed_mps": 1.5, "direction_deg": 80.0}}  # fmt: skip
    found = forces(ship({name: effects[name] for name in order}), at) - forces(ship(), at)
    expected = wind_by_angle(12.0, np.radians(35.0), at, (1.5, np.radians(80.0)))
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_ship_that_creeps_ahead_in_still_air_meets_a_pure_head_wind() -> None:
    found = added_forces("wind", {"speed_mps": 0.0, "direction_deg": 77.0}, {**state(0.5, 0.0, 0.0), "motion.psi": 1.0})
    np.testing.assert_allclose(found, [-0.5 * RHO_AIR * FRONT * 0.7 * 0.5**2, 0.0, 0.0], rtol=1e-9, atol=1e-6)


def test_what_the_card_holds_of_still_air_is_not_counted_twice() -> None:
    at = {**state(7.0, 0.4, 0.0), "motion.psi": 0.6}
    given = {"speed_mps": 12.0, "direction_deg": 100.0}
    still = wind_by_angle(0.0, 0.0, at, (0.0, 0.0))
    felt = wind_by_angle(12.0, np.radians(100.0), at, (0.0, 0.0))
    for share in (0.0, 0.3, 1.0):
        found = added_forces("wind", {**given, "still_air": share, "centroid_forward_m": -5.0}, at)
        np.testing.assert_allclose(found, felt - (1 - share) * still, rtol=1e-7)


def test_wind_from_starboard_drives_the_ship_to_port_and_turns_a_fine_bow_away() -> None:
    """Heading north at rest, wind from the north-east: 45 deg on the starboard bow."""
    X, Y, N = added_forces("wind", {"speed_mps": 15.0, "direction_deg": 45.0}, state(0.001, 0.0, 0.0))
    assert X < 0 and Y < 0 and N < 0


def test_the_wind_is_an_input_that_may_change() -> None:
    model = ship({"wind": TYPICAL["wind"]})
    assert model.input_names[-2:] == ("wind.speed", "wind.direction")
    assert [model["wind.speed"].unit, model["wind.direction"].display_unit] == ["m/s", "deg"]
    at = {**STATES[0], "motion.psi": 0.2}
    doubled = forces(model, {**at, "wind.speed": 20.0, "wind.direction": 3.0})
    np.testing.assert_allclose(
        doubled, forces(ship({"wind": {"speed_mps": 20.0, "direction_deg": np.degrees(3.0)}}), at), rtol=1e-12
    )


def test_current_carries_the_ship_over_the_ground_and_changes_no_force() -> None:
    at = {**STATES[0], "motion.psi": 0.7}
    effects = {"current": {"speed_mps": 1.2, "direction_deg": 90.0}}
    moved = values(ship(effects), ["motion.xdot", "motion.ydot"], at)
    still = values(ship(), ["motion.xdot", "motion.ydot"], at)
    np.testing.assert_allclose(moved - still, [0.0, 1.2], atol=1e-12)
    np.testing.assert_array_equal(forces(ship(effects), at), forces(ship(), at))


@pytest.mark.parametrize("from_deg", [0.0, 60.0, 170.0, -130.0])
def test_waves_push_away_from_where_they_come(from_deg: float) -> None:
    at = {**STATES[0], "motion.psi": 0.3}
    found = added_forces("wave_drift", {"height_m": 3.0, "direction_deg": from_deg, "yaw_coefficient": 0.02}, at)
    chi = np.radians(from_deg) - 0.3
    q = RHO * G * 9.0 / 16
    across = np.sign(np.sin(chi)) * np.sin(chi) ** 2
    along = np.sign(np.cos(chi)) * np.cos(chi) ** 2
    expected = [-q * B * 2 / 3 * along, -q * L * across, -q * L**2 * 0.02 * np.sin(2 * chi)]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_bank_draws_with_the_square_of_the_speed() -> None:
    found = added_forces("bank_suction", {"Y_prime": 2e-4, "N_prime": -5e-5}, STATES[0])
    q = 0.5 * RHO * L**2 * 7.0**2
    np.testing.assert_allclose(found, [0.0, 2e-4 * q, -5e-5 * q * L], rtol=1e-7, atol=1e-6)
