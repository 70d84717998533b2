"""Figures that were settled outside what a card was measured in are marked, by the same rule in every command."""

from __future__ import annotations

import contextlib
import io
import json
import math
import sys

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.cli import main
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.manoeuvres import PullOut, Turn, Zigzag, parse_manoeuvre
from tank2sim.simulation.run import simulate


def turned(changes, manoeuvre="turn:35"):
    return simulate(build(read_card("mariner", changes)), parse_manoeuvre(manoeuvre))


def test_a_ship_inside_the_range_of_its_card_has_no_marks() -> None:
    run = turned({})
    assert run.reading.exit_s is None and run.reading.outside_names == () and run.reading.notices == []
    assert np.all(run.trajectory["validity"] == 1.0)


@pytest.mark.parametrize(
    ("key", "limit", "signal"),
    [
        ("valid_yaw_rate_prime", 0.2, lambda run: np.abs(run["motion.r"]) * 160.93 / run["motion.speed"]),
        ("valid_drift_deg", 4.0, lambda run: np.degrees(np.arcsin(np.abs(run["motion.v"]) / run["motion.speed"]))),
        ("valid_rudder_deg", 20.0, lambda run: np.abs(np.degrees(run["rudder.angle"]))),
        ("valid_speed_mps", [6.5, 9.3], lambda run: -run["motion.speed"]),
    ],
    ids=["yaw rate", "drift", "rudder", "speed"],
)
def test_the_range_is_left_when_a_signal_passes_the_limit_of_the_card(key, limit, signal) -> None:
    run = turned({f"model.{key}": limit})
    beyond = signal(run.trajectory) > (-limit[0] if isinstance(limit, list) else limit)
    first = run.trajectory.t[int(np.argmax(beyond))]
    assert run.reading.exit_s == pytest.approx(first, abs=2.0)
    validity = run.trajectory["validity"]
    assert validity.min() < 0.999 and np.all(validity[~beyond] == 1.0)


def test_an_effect_that_does_not_hold_is_named_where_the_motion_is_in_range() -> None:
    shallow = {"effects": [{"name": "finite_depth", "parameters": {"depth_m": 8.2}}]}
    run = turned(shallow)
    assert run.reading.exit_s == 0.0
    assert run.reading.how.startswith("under keel clearance")


def test_only_figures_settled_after_the_range_is_left_are_marked() -> None:
    whole = turned({})
    speeds = whole.trajectory["motion.speed"][whole.trajectory.t > whole.figures["time_90_s"]]
    run = turned({"model.valid_speed_mps": [float(speeds[0]) - 0.05, 9.3]})
    left, outside = run.reading.exit_s, set(run.reading.outside_names)
    assert run.figures["time_90_s"] < left < run.figures["time_180_s"]  # or the test shows nothing
    assert {"tactical_diameter_m", "tactical_diameter_lengths", "time_180_s", "steady_diameter_m"} <= outside
    assert not {"advance_m", "advance_lengths", "transfer_m", "time_90_s"} & outside


def test_overshoots_are_marked_one_by_one() -> None:
    whole = turned({}, "zigzag:20/20")
    second = whole.figures["execute_times_s"][1]
    slowest = whole.trajectory["motion.speed"][whole.trajectory.t < second].min()
    assert whole.trajectory["motion.speed"].min() < slowest - 0.1  # the ship goes on losing speed
    run = turned({"model.valid_speed_mps": [float(slowest) - 0.02, 9.3]}, "zigzag:20/20")
    outside = run.reading.outside_names
    assert "overshoot_1_deg" not in outside and "overshoot_4_deg" in outside


def test_lists_of_figures_have_names_of_their_own() -> None:
    assert single_figures({"overshoots_deg": [1.0, 2.0], "advance_m": None, "reach_s": 3.0}) == {
        "overshoot_1_deg": 1.0,
        "overshoot_2_deg": 2.0,
        "reach_s": 3.0,
    }


def invoked(*arguments):
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as out:
        patch.setattr(sys, "argv", ["tank2sim", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
    assert end.value.code == 0
    return out.getvalue()


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "kvlcc2-captive", "--manoeuvre", "turn:35"),
        pytest.param(("stability", "kvlcc2-captive"), marks=pytest.mark.slow),
        pytest.param(("influence", "kvlcc2-captive", "--figures", "tactical_diameter_m@35"), marks=pytest.mark.slow),
        ("compare", "kvlcc2-captive", "kvlcc2-captive", "--members", "0"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_command_whose_figures_leave_the_card_says_so_before_it_shows_any(arguments) -> None:
    """Cautions come first; a mark below a table names a row of it that has no verdict."""
    lines = invoked(*arguments).splitlines()
    marks = [line for line in lines if "EXTRAPOLATED" in line and "card 0 U/L" in line]
    first = [line for line in marks if line.startswith("CHECK: ")]
    assert first and lines[: len(first)] == first
    unjudged = [line for line in lines if line.rstrip(" -").endswith("beyond the card")]
    for mark in (mark for mark in marks if mark not in first):
        assert any(row.startswith(mark.partition(";")[0].partition(":")[0][:8]) for row in unjudged)


def test_json_names_the_figures_outside_the_card(tmp_path) -> None:
    file = tmp_path / "run.json"
    invoked("simulate", "kvlcc2-captive", "--manoeuvre", "zigzag:20/20", "--members", "2", "--json", file)
    found = json.loads(file.read_text())
    assert {"overshoot_1_deg", "overshoot_2_deg", "period_s"} <= set(found["outside_card_range"])
    assert found["left_card_range_s"] < 5
    assert set(found["outside_card_range"]) <= set(found["ensemble"]["figures"]), "bands have the names of the marks"
    invoked("compare", "kvlcc2-captive", "mariner", "--members", "0", "--json", file)
    trials = {trial["name"]: trial["figures"] for trial in json.loads(file.read_text())["trials"]}
    assert trials["zigzag 20/20"]["overshoot_1_deg"]["outside_card_range"][0] is True


@pytest.mark.parametrize("make", [Turn, PullOut, lambda angle: Zigzag(angle, 0.3), lambda angle: Zigzag(0.3, angle)])
def test_an_angle_in_degrees_where_radians_belong_is_refused(make) -> None:
    with pytest.raises(InputError) as caught:
        make(35)
    assert "35" in caught.value.problem and "math.radians" in caught.value.remedy
    make(math.radians(35))
