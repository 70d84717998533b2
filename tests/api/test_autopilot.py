"""The heading autopilot as a user of the API has it: against control theory and the simulated motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def pilot() -> t2s.AutopilotResult:
    # Towards 3.9 m/s the polynomial of this card loses its rudder.
    ship = t2s.load("mariner", {"model.valid_speed_mps": [3.9, 9.3]})
    return ship.autopilot(course_change_deg=-30, track=[[0, 0], [3000, 0], [5000, 2000]])


@pytest.mark.slow
def test_figures_of_a_course_change_are_those_of_its_motion(pilot: t2s.AutopilotResult) -> None:
    motion, change = pilot.runs["change"], pilot.course_changes.loc["change"]
    turned = -(motion["psi_deg"] - motion["psi_deg"].iloc[0])
    assert change["ordered_deg"] == pytest.approx(-30)
    assert change["overshoot_deg"] == pytest.approx(max(0.0, turned.max() - 30), abs=0.05)
    moving = motion["t_s"] > 1
    assert abs(motion["delta_deg"][moving]).max() == pytest.approx(change["largest_rudder_deg"], rel=0.01)


@pytest.mark.slow
def test_margins_are_those_of_the_loop_that_is_drawn(pilot: t2s.AutopilotResult) -> None:
    """Phase at the crossover and largest sensitivity, read off the frequency response on the page."""
    design = next(row for row in pilot.to_dict()["responses"] if row["speed_mps"] == pilot.margins.index[0])
    loop = np.array(design["loop"]) @ np.array([1, 1j])
    assert pilot.margins["sensitivity_peak"].iloc[0] == pytest.approx(np.abs(1 / (1 + loop)).max(), rel=0.02)
    phase = np.interp(0.0, -np.log(np.abs(loop)), np.degrees(np.unwrap(np.angle(loop))))
    assert pilot.margins["phase_margin_deg"].iloc[0] == pytest.approx(phase % 360 - 180, abs=2.0)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["file", pytest.param("table", marks=pytest.mark.slow)])
def test_a_track_is_kept_whatever_form_it_has(pilot: t2s.AutopilotResult, tmp_path: Path, form: str) -> None:
    waypoints = pd.DataFrame({"y_m": [0, 0, 2000], "x_m": [0, 3000, 5000], "name": ["a", "b", "c"]})
    waypoints.to_csv(tmp_path / "track.csv", columns=["x_m", "y_m"], index=False)
    track = waypoints if form == "table" else tmp_path / "track.csv"
    again = t2s.load("mariner", {"model.valid_speed_mps": [3.9, 9.3]}).autopilot(course_change_deg=-30, track=track)
    pd.testing.assert_frame_equal(again.cross_track, pilot.cross_track)
    assert set(pilot.cross_track.index) == {"line of sight", "with integral"}


@pytest.mark.slow
def test_the_fmu_of_the_controller_is_written(pilot: t2s.AutopilotResult, tmp_path: Path) -> None:
    made = pilot.to_fmu(tmp_path / "pilot.fmu", fmi=2)
    assert made.to_dict()["export"]["fmi"] == "2.0" or made.to_dict()["export"]["fmi"] == 2  # type: ignore[index]
    assert t2s.check_fmu(tmp_path / "pilot.fmu").passed and pilot.files == {}


@pytest.mark.parametrize(
    ("options", "source", "place"),
    [
        ({"course_change_deg": 0}, "course_change_deg", ""),
        ({"course_change_deg": 171}, "course_change_deg", ""),
        ({"design": "fuzzy"}, "design", ""),
        ({"heading_weight_deg": 3.0}, "heading_weight_deg", ""),
        ({"design": "pd", "rudder_weight_deg": 3.0}, "rudder_weight_deg", ""),
        ({"track": [[0, 0]]}, "track", ""),
        ({"track": [0, 1]}, "track", "[0]"),
        ({"track": [[0, 0], [0, 0]]}, "track", "waypoint 2"),
        ({"track": [[0, 0], [float("nan"), 0]]}, "track", "waypoint 2"),
    ],
)
def test_what_cannot_be_asked_is_refused_at_its_place(options, source: str, place: str) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("mariner").autopilot(**options)
    assert (str(refusal.value.source), refusal.value.place) == (source, place)
    assert refusal.value.remedy


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weather", "word"),
    [({"wind_mps": 60.0}, "60 m/s"), ({"current_mps": 9.0}, "9 m/s"), ({"wind_mps": 15.0}, "")],
)
def test_a_course_that_is_not_held_is_said_first(weather, word) -> None:
    result = t2s.load("mariner").autopilot(**weather)
    cautions = result.cautions
    assert bool(cautions) == bool(word)
    if word:
        assert word in cautions[0] and repr(result).startswith(cautions[0].line)
    words = " ".join(result.headline)
    kept = result.course_keeping
    load = f"{kept['rudder_travel_degps']:.2g} deg/s, rate limit reached {kept['rate_limited_percent']:.2g} %"
    assert (load in words) == ("rate limit" in words) == (weather.get("wind_mps", 0.0) < 50)
