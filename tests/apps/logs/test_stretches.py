"""Manoeuvres found in voyages whose orders are known, and the trials that are cut from them."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.apps.logs.clock import utc_text
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.stretches import StretchKind
from tank2sim.apps.logs.trial_files import _name
from tank2sim.records.reading import read_trial_file
from tests.apps.logs.made_logs import T0, frame, steered, truth_manoeuvres, voyage
from tests.marks import first_fast

SAME = {
    "zigzag": {"zigzag"},
    "turn": {"turn"},
    "stop": {"stop"},
    "steps": {"steps"},
    "pivot": {"pivot", "turn"},  # revolutions of two propellers do not cancel as their orders do
    "coast": {"coast"},
    "astern": {"astern"},
    "accelerate": {"accelerate"},
}
SHIP = ("voyage.nmea", "voyage.bag", "voyage.mcap", "voyage.bin", "voyage.ulg", "voyage.csv", "voyage_eu.csv")
BEGIN_S = 2.5
"""Largest error of a begin: the rudder's angle follows its order within a second, samples are 0.6 s apart."""
END_S = 4.0


@pytest.fixture
def made(saved):
    return log(saved(frame()))


def test_a_zigzag_and_a_turn_are_found_where_they_were(made) -> None:
    zigzag, turn = (stretch for stretch in made.found if stretch.kind.excites)
    known = voyage()
    assert (zigzag.kind.value, turn.kind.value) == ("zigzag", "turn")
    assert zigzag.begin_s - T0 == pytest.approx(known.zigzag[0], abs=1.5)
    assert zigzag.end_s - T0 == pytest.approx(known.zigzag[1], abs=END_S)
    assert turn.begin_s - T0 == pytest.approx(known.turn[0], abs=1.5)
    assert turn.end_s - T0 == pytest.approx(known.turn[1], abs=END_S)
    assert (zigzag.reversals, math.degrees(zigzag.rudder_rad)) == (3, pytest.approx(20, abs=0.5))
    assert math.degrees(turn.rudder_rad) == pytest.approx(25, abs=0.5)
    legs = [stretch for stretch in made.found if stretch.kind.value == "steady"]
    assert len(legs) == 3 and all(stretch.yaw_rate_radps < 0.5 * zigzag.yaw_rate_radps for stretch in legs)


STEADY = ("leg", 100.0, 0.0)
IN_A_ROW = {
    "zigzag and turn": [("zigzag", 20, 4), ("turn", 35, 200)],
    "zigzag and turn by the next order": [("zigzag", 20, 4), ("turn", 20, 200)],
    "zigzag and turn to the side of its last order": [("zigzag", 20, 4), ("turn", -35, 200)],
    "two zigzags": [("zigzag", 10, 4), ("zigzag", 20, 4)],
    "turn to the other side": [("turn", 35, 360), ("turn", -35, 360)],
    "turn and zigzag": [("turn", 25, 270), ("leg", 40, 0), ("zigzag", -20, 5)],
    "turns with short legs": [("turn", 35, 70), ("leg", 40, 0), ("turn", -35, 120), ("leg", 40, 0), ("turn", 20, 90)],
}


@first_fast("restless_deg", [0.0, 2.0])
@pytest.mark.parametrize("case", IN_A_ROW)
def test_manoeuvres_in_a_row_are_one_trial_each(saved, case, restless_deg) -> None:
    table, known = steered([STEADY, *IN_A_ROW[case], STEADY], restless_deg)
    path = saved(table, "voyage.csv")
    found = [stretch for stretch in log(path).found if stretch.kind.excites]
    assert [stretch.kind.value for stretch in found] == [kind for kind, _, _ in known]
    for stretch, (_, begin, end) in zip(found, known, strict=True):
        assert stretch.begin_s - T0 == pytest.approx(begin, abs=6.0)  # from the helm's last correction on
        assert -4.0 < stretch.end_s - T0 - end < 65.0  # until the swing is checked


def test_trials_are_read_again_and_begin_when_they_say(made, tmp_path) -> None:
    paths = made.save(tmp_path / "voyage")
    cut = next(cut for cut in made.cuts if cut.stretches[0].kind.value == "turn")
    path = next(path for path in paths if path.name == cut.trial.path.name)
    trial = read_trial_file(path)
    assert f"# begins: {utc_text(cut.begins_s)}" in path.read_text(encoding="utf-8")
    known = voyage()
    at = trial.time_s + cut.begins_s - T0
    assert np.degrees(np.abs(trial.signals["delta_rad"] - np.interp(at, known.time, known.rudder))).max() < 1.0
    heading = trial.signals["psi_rad"] - np.interp(at, known.time, known.heading)
    heading = (heading + np.pi) % (2 * np.pi) - np.pi
    assert np.degrees(np.abs(heading)).max() < 0.6
    assert t2s.audit(path).passed


def test_the_audit_of_every_trial_finds_no_fault(made, tmp_path) -> None:
    made.save(tmp_path / "voyage")
    assert t2s.audit(sorted((tmp_path / "voyage").glob("*.csv"))).passed


@first_fast("name", SHIP)
def test_manoeuvres_of_the_ship_are_found_in_every_format(data, name) -> None:
    check(data, "ship_21", name, {"zigzag", "turn", "stop"}, {"zigzag": 1, "turn": 2, "stop": 1})


@first_fast("name", SHIP)
def test_manoeuvres_of_the_craft_are_found_in_every_format(data, name) -> None:
    expected = {"zigzag": 2, "turn": 2, "steps": 1, "pivot": 2, "coast": 3, "astern": 1, "accelerate": 2}
    check(data, "usv_22", name, set(expected), expected)


def check(data, vessel: str, name: str, kinds: set[str], expected: dict[str, int]) -> None:
    manoeuvres, path = truth_manoeuvres(data, vessel, name)
    result = log(path)
    missed = []
    for manoeuvre in manoeuvres:
        if manoeuvre["kind"] not in kinds:
            continue
        begin, end = (pd.Timestamp(manoeuvre[key]).timestamp() for key in ("utc_start", "utc_end"))
        good = [
            stretch
            for stretch in result.found
            if stretch.kind.value in SAME[manoeuvre["kind"]]
            and abs(stretch.begin_s - begin) < BEGIN_S
            and abs(stretch.end_s - end) < END_S
        ]
        if not good:
            missed.append((manoeuvre["kind"], manoeuvre["t_start_s"]))
    assert missed == []
    assert len([m for m in manoeuvres if m["kind"] in kinds]) == sum(expected.values())


def test_a_current_is_found_where_the_log_determines_it(data) -> None:
    for vessel, name, speed, direction in (
        ("ship_21", "voyage.nmea", 0.4, 25.5),  # both velocities through the water
        ("ship_21", "voyage.bag", 0.4, 25.5),  # the speed ahead alone
        ("usv_22", "voyage.nmea", 0.12, 110.3),
    ):
        _, path = truth_manoeuvres(data, vessel, name)
        current = log(path).current
        assert current is not None
        error = current.speed_mps * np.exp(1j * np.radians(current.direction_deg)) - speed * np.exp(
            1j * np.radians(direction)
        )
        assert abs(error) < 0.04
    _, path = truth_manoeuvres(data, "usv_22", "voyage.csv")  # nothing through the water
    assert log(path).current is None


@pytest.mark.parametrize(("level", "name"), [(-0.001, "03_steps_+0"), (-0.201, "03_steps_-20")])
def test_a_level_that_rounds_to_zero_has_no_minus(level: float, name: str) -> None:
    stretch = SimpleNamespace(kind=StretchKind.STEPS, rudder_rad=level)
    assert _name(3, stretch, steered=False) == name
