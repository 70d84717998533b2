"""The current of a voyage from made-up tracks in a known current: by both components, by the speed ahead, or not."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.apps.logs.voyage import AVERAGED_S, drift_current

SET_DEG, SPEED = 300.0, 0.6
NORTH, EAST = SPEED * math.cos(math.radians(SET_DEG)), SPEED * math.sin(math.radians(SET_DEG))
TIME = np.arange(0.0, 900.0)


def sailed(psi: np.ndarray, *, ground: str = "velocity", **left_out: bool) -> SimpleNamespace:
    """A voyage at 4 m/s with 0.3 m/s of leeway to starboard on these headings (rad), in the current."""
    ahead, side = 4.0 + 0.5 * np.sin(TIME / 70), 0.3 + 0.1 * np.cos(TIME / 50)
    north = ahead * np.cos(psi) - side * np.sin(psi) + NORTH
    east = ahead * np.sin(psi) + side * np.cos(psi) + EAST
    known = {"heading": psi, "u_water": ahead, "v_water": side}
    known |= {
        "velocity": {"v_north": north, "v_east": east},
        "course": {"sog": np.hypot(north, east), "cog": np.arctan2(east, north)},
        "position": {"x": np.cumsum(north), "y": np.cumsum(east)},
        "none": {},
    }[ground]
    series = {name: SimpleNamespace(time_s=TIME, values=v) for name, v in known.items() if not left_out.get(name)}
    return SimpleNamespace(series=series)


TURNING, STRAIGHT = TIME / 100, np.full_like(TIME, 0.7)


@pytest.mark.parametrize("heading", [TURNING, STRAIGHT], ids=["turning", "straight"])
@pytest.mark.parametrize("ground", ["velocity", "course", "position"])
def test_both_components_through_the_water_give_the_current_on_any_heading(heading, ground) -> None:
    found = drift_current(sailed(heading, ground=ground), 100.0, 800.0)
    assert found is not None
    assert found.speed_mps == pytest.approx(SPEED, abs=0.02)
    assert found.direction_deg == pytest.approx(SET_DEG, abs=2.0)
    assert found.spread_mps < 0.02


def test_the_speed_ahead_alone_gives_the_current_of_a_ship_that_turns() -> None:
    """Its leeway would be a current that turns with it: there is none in the speed ahead."""
    found = drift_current(sailed(TURNING, v_water=True), 0.0, 900.0)
    assert found is not None
    assert (found.speed_mps, found.direction_deg) == (pytest.approx(SPEED, abs=1e-3), pytest.approx(SET_DEG, abs=0.1))
    assert found.spread_mps < 1e-3


@pytest.mark.parametrize(
    ("swing_deg", "known"), [(0.0, False), (60.0, False), (79.0, False), (83.0, True), (180.0, True)]
)
def test_the_speed_ahead_alone_says_nothing_without_a_turn_of_a_quadrant(swing_deg: float, known: bool) -> None:
    """Headings evenly over an arc of 2 a have the least mean square (1 - sin(2 a)/(2 a))/2; 0.15 is one of 81 deg."""
    arc = np.radians(swing_deg) * np.linspace(-1, 1, len(TIME)) / 2 + 0.4
    found = drift_current(sailed(arc, v_water=True), 0.0, 900.0)
    assert (found is not None) == known
    if found is not None:
        assert found.direction_deg == pytest.approx(SET_DEG, abs=0.5)


def test_the_spread_is_of_the_means_over_a_minute() -> None:
    """A current that alternates from minute to minute by 0.1 m/s to either side spreads by 0.1."""
    voyage = sailed(STRAIGHT)
    gusty = np.where(np.floor(TIME / AVERAGED_S) % 2 == 0, 0.1, -0.1)
    voyage.series["v_east"] = SimpleNamespace(time_s=TIME, values=voyage.series["v_east"].values + gusty)
    found = drift_current(voyage, 0.0, 8 * AVERAGED_S - 1)
    assert found is not None and found.spread_mps == pytest.approx(0.1, rel=1e-6)
    quick = sailed(STRAIGHT)
    noise = np.where(TIME % 2 == 0, 0.1, -0.1)
    quick.series["v_east"] = SimpleNamespace(time_s=TIME, values=quick.series["v_east"].values + noise)
    found = drift_current(quick, 0.0, 8 * AVERAGED_S - 1)
    assert found is not None and found.spread_mps < 0.01


@pytest.mark.parametrize("half", ["v_north", "v_east", "sog", "cog"])
def test_half_of_a_velocity_over_the_ground_gives_way_to_the_positions(half: str) -> None:
    voyage = sailed(TURNING, ground="position")
    voyage.series[half] = SimpleNamespace(time_s=TIME, values=np.full_like(TIME, 9.0))
    found = drift_current(voyage, 100.0, 800.0)
    assert found is not None and found.speed_mps == pytest.approx(SPEED, abs=0.02)


def test_what_does_not_determine_a_current_gives_none() -> None:
    for voyage in (sailed(TURNING, ground="none"), sailed(TURNING, heading=True), sailed(TURNING, u_water=True)):
        assert drift_current(voyage, 0.0, 900.0) is None
    assert drift_current(sailed(TURNING), 100.0, 108.0) is None
    assert drift_current(sailed(TURNING), 100.0, 109.0) is not None
