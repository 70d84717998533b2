"""The office after a sea trial, on the document's cases: made by other code, and one published ship."""

from __future__ import annotations

import json
import math
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.trial_office.conditions import Met
from tank2sim.apps.trial_office.form import form_boxes
from tank2sim.apps.trial_office.result import TrialOfficeResult
from tank2sim.apps.trial_office.tried import current_removed, tried
from tank2sim.records.trials import Trial
from tank2sim.simulation.manoeuvres import Stop
from tests.apps.trial_office.sea_trial import APPROACH_S, CARD, Mariner, turn, turns, write_record, zigzag

TRUE = {"starboard": (570.2, 1029.2), "port": (596.7, 1070.3)}
"""Advance and tactical diameter in calm water, m, of the document."""


def _figures(found, name, field="without_current"):
    return {one.side: getattr(one, field) for one in found.study.figures if one.name == name}


@pytest.fixture
def office(tmp_path: Path) -> Callable[..., TrialOfficeResult]:
    """The office's result by the text of notes alone, or with records and options; of the Mariner unless stated."""

    def asked(text: str, records: object = (), ship: object = "mariner", **options: Any) -> TrialOfficeResult:
        notes = tmp_path / "notes.toml"
        notes.write_text(text, encoding="utf-8")
        return t2s.trial_office(records, ship=ship, notes=notes, **options)

    return asked


def test_the_generator_gives_the_calm_figures_of_the_document() -> None:
    for rudder, side in ((35.0, "starboard"), (-35.0, "port")):
        rows = Mariner().run(turn(rudder, 200.0))
        rows = rows[rows[:, 0] >= APPROACH_S]
        at = int((abs(rows[:, 6] - rows[0, 6]) >= math.pi / 2).argmax())
        assert abs(rows[at, 4] - rows[0, 4] - TRUE[side][0]) < 4.0
        half = int((abs(rows[:, 6] - rows[0, 6]) >= math.pi).argmax())
        assert abs(abs(rows[half, 5] - rows[0, 5]) - TRUE[side][1]) < 4.0


def test_a_current_is_found_and_taken_off(tmp_path: Path) -> None:
    ship = Mariner(current=(0.5, 90.0))
    ten = ship.run(zigzag(10.0, 10.0))
    records = [*turns(tmp_path, ship), write_record(tmp_path / "zigzag.csv", ten, ship, 7)]
    found = t2s.trial_office(records, ship="mariner", members=0)
    assert found.study.current.speed_mps == pytest.approx(0.5, abs=0.002)
    assert found.study.current.towards_deg == pytest.approx(90.0, abs=0.3)
    assert found.study.current.separated == "by both sides"
    for side, (advance, tactical) in TRUE.items():
        assert _figures(found, "tactical_diameter_m")[side] == pytest.approx(tactical, abs=4.0)
        assert _figures(found, "advance_m")[side] == pytest.approx(advance, abs=4.0)
        assert abs(_figures(found, "tactical_diameter_m", "as_run")[side] - tactical) > 100.0
    overshoots = [one for one in found.study.figures if one.name.startswith("overshoot")]
    assert not any("WIND" in notice for notice in found.cautions)
    assert overshoots and all(one.as_run == pytest.approx(one.without_current, abs=1e-9) for one in overshoots)


def test_a_record_of_one_turn_uses_the_moving_circle_and_says_so(tmp_path: Path) -> None:
    found = t2s.trial_office(turns(tmp_path, Mariner(current=(0.5, 90.0)), turned_deg=360.0), ship="mariner", members=0)
    assert {one.measured.method for one in found.study.drifts} == {"circle in a moving frame"}
    assert found.study.current.speed_mps == pytest.approx(0.5, abs=0.02)
    assert found.study.current.spread_mps is None
    assert any("circle in a moving frame" in line for line in found.headline)


@pytest.mark.slow
def test_a_tide_that_falls_shows_in_the_spread_and_widens_the_errors(tmp_path: Path) -> None:
    steady, falling = tmp_path / "steady", tmp_path / "falling"
    for folder in (steady, falling):
        folder.mkdir()
    ship = Mariner(current=(0.5, 90.0))
    constant = t2s.trial_office(turns(steady, ship), ship="mariner", members=0)
    tide = t2s.trial_office(turns(falling, ship, tide=0.2), ship="mariner", members=0)
    assert tide.study.current.spread_mps > 0.01 > constant.study.current.spread_mps
    assert ["changes during a turn" in "".join(found.headline) for found in (tide, constant)] == [True, False]
    errors = [_figures(found, "tactical_diameter_m", "error")["port"] for found in (tide, constant)]
    assert errors[0] > errors[1]


def test_wind_and_current_are_separated_and_the_wind_is_taken_off_by_the_model(tmp_path: Path) -> None:
    found = t2s.trial_office(
        turns(tmp_path, Mariner(wind=(9.0, 300.0), current=(0.5, 60.0))), ship="mariner", members=0
    )
    current = found.study.current
    assert current.speed_mps == pytest.approx(0.5, abs=0.03)
    assert current.towards_deg == pytest.approx(60.0, abs=4.0)
    assert current.wind_share_mps > 0.1
    for side, (advance, tactical) in TRUE.items():
        assert _figures(found, "tactical_diameter_m", "calm")[side] == pytest.approx(tactical, rel=0.01)
        assert _figures(found, "advance_m", "calm")[side] == pytest.approx(advance, rel=0.012)


@pytest.mark.slow
def test_without_an_anemometer_both_sides_separate_the_wind(tmp_path: Path) -> None:
    ship = Mariner(wind=(10.0, 30.0))
    found = t2s.trial_office(turns(tmp_path, ship, with_wind=False), ship="mariner", members=0)
    assert found.study.current.speed_mps < 0.04
    assert found.study.current.separated == "by both sides"
    assert any(notice.startswith("WIND IS NOT TAKEN OFF") for notice in found.cautions)
    one_side = t2s.trial_office(tmp_path / "turn_starboard.csv", ship="mariner", members=0)
    assert one_side.study.current.speed_mps > 0.1
    assert one_side.study.current.separated == ""
    assert any("NOT SEPARATED" in notice for notice in one_side.cautions)


BITUMEN = """
draught_fore_m = 5.690
draught_aft_m = 5.711
[figures."turn:-35"]
advance_m = 278.0
tactical_diameter_m = 277.2
[figures."turn:35"]
advance_m = 272.9
tactical_diameter_m = 339.5
[figures."zigzag:-10/10"]
overshoot_1_deg = 6.5
overshoot_2_deg = 10.8
[figures."zigzag:10/10"]
overshoot_1_deg = 7.4
overshoot_2_deg = 10.5
[figures."zigzag:-20/20"]
overshoot_1_deg = 20.9
[figures."zigzag:20/20"]
overshoot_1_deg = 19.2
[figures.stop]
track_reach_m = 1191
"""


@pytest.fixture(scope="module")
def bitumen(tmp_path_factory: pytest.TempPathFactory) -> t2s.Ship:
    path = tmp_path_factory.mktemp("bitumen") / "ship.toml"
    card = CARD.read_text(encoding="utf-8")
    sizes = {"length_m = 160.93": "length_m = 99.0", "beam_m = 23.17": "beam_m = 18.0\nblock_coefficient = 0.738"}
    sizes |= {"draught_m = 7.468": "draught_m = 5.70", "speed_mps = 7.7175": "speed_mps = 7.4594"}
    sizes |= {"valid_speed_mps = [5.4, 9.3]": "valid_speed_mps = [5.2, 9.3]"}
    for old, new in sizes.items():
        card = card.replace(old, new)
    path.write_text(card, encoding="utf-8")
    return t2s.load(path)


def test_published_figures_without_records_fill_the_form(bitumen: t2s.Ship, office) -> None:
    """FS Bitumen No. 1, full load, 2014: the numbers of its form; what nobody recorded stays blank."""
    found = office(BITUMEN, ship=bitumen)
    study = found.study
    assert study.tested_at_full_load and not study.applies
    assert study.particulars.length_over_speed_s == pytest.approx(13.27, abs=0.01)
    allowed = {one.name: one.allowed for one in study.criteria}
    assert allowed["10/10 zigzag, first overshoot"] == pytest.approx(11.6, abs=0.05)
    assert allowed["10/10 zigzag, second overshoot"] == pytest.approx(27.5, abs=0.05)
    rows = {row.label: row.values for box in form_boxes(study) for row in box.rows}
    expected = {
        "Turning circle: advance, ship lengths": (2.81, 2.76),
        "Turning circle: tactical diameter, ship lengths": (2.80, 3.43),
        "10/10 zigzag: first overshoot, deg": (6.5, 7.4),
        "10/10 zigzag: second overshoot, deg": (10.8, 10.5),
        "20/20 zigzag: first overshoot, deg": (20.9, 19.2),
    }
    for label, (port, starboard) in expected.items():
        shown = [float(value) for value in rows[label][:2]]
        assert shown == pytest.approx([port, starboard], abs=0.006)
    assert float(rows["Stopping, full astern: track reach, ship lengths"][0]) == pytest.approx(12.0, abs=0.05)
    initial = "Initial turning: distance to 10 deg with 10 deg of rudder, ship lengths"
    blanks = (rows[initial][0], rows["Wind: Beaufort number"][0], rows["Water depth over trial draught"][0])
    assert blanks == (None, None, None)
    assert study.current is None and "Current" not in rows


@pytest.mark.slow
def test_conditions_that_are_not_met_are_said_and_refuse_nothing(office, tmp_path: Path) -> None:
    known = "draught_fore_m = 7.4\ndraught_aft_m = 7.5\ndepth_m = 20.0\nspeed_85_mcr_mps = 8.8\nsea_state = 5\n"
    found = office(known, turns(tmp_path, Mariner()), members=0, wind_speed_mps=12.0, wind_from_deg=0.0)
    met = {one.name: one.met for one in found.study.conditions}
    assert {met[name] for name in ("deep water", "wind speed", "sea state", "test speed")} == {Met.NOT_MET}
    assert {met[name] for name in ("draught", "trim by the stern", "turns", "both sides", "approach")} == {Met.MET}
    assert met["engine"] is Met.UNKNOWN
    verdicts = {one.name: one.verdict for one in found.study.criteria}
    assert verdicts["tactical diameter"] == "fail"
    assert verdicts["20/20 zigzag, first overshoot"] == "not tried"


def test_a_stop_is_read_from_the_revolutions_and_its_track_without_the_current() -> None:
    """From 8 m/s evenly to rest in 100 s: 400 m; 0.4 m/s to the east add 40 m to starboard and none ahead."""
    time = np.arange(0.0, 170.0)
    after = np.clip(time - 60.0, 0.0, 100.0)
    signals = {
        "x_m": 8.0 * np.minimum(time, 60.0) + 8.0 * after - 0.04 * after**2,
        "y_m": 0.4 * time,
        "psi_rad": np.zeros_like(time),
        "u_mps": 8.0 - 0.08 * after,
        "delta_rad": np.zeros_like(time),
        "n_radps": np.where(time < 60.0, 10.0, -5.0),
    }
    model = t2s.load("mariner").model
    found = tried(Trial(Path("stop.csv"), time, signals), model)
    still = current_removed(found, np.array([0.0, 0.4]), 0.01, model)
    assert isinstance(found.manoeuvre, Stop) and found.manoeuvre.revolutions == -5.0
    assert (found.begin_s, found.speed_mps) == (60.0, pytest.approx(8.0, abs=0.2))
    assert found.figures["side_reach_m"] == pytest.approx(40.0, abs=1.0)
    for name, value in {"track_reach_m": 400.0, "head_reach_m": 400.0, "side_reach_m": 0.0}.items():
        assert still.figures[name] == pytest.approx(value, abs=1.0), name
    assert still.figures["time_to_stop_s"] == pytest.approx(100.0, abs=4.0)
    assert still.figures["track_reach_lengths"] == pytest.approx(400.0 / 160.93, abs=0.01)


def test_a_trial_far_from_full_load_certifies_nothing(tmp_path: Path) -> None:
    records = turns(tmp_path, Mariner())
    light = t2s.trial_office(records, ship="mariner", members=4, draught_fore_m=3.4, draught_aft_m=4.2)
    assert light.study.loading_validity < 0.5
    assert not light.study.tested_at_full_load
    verdicts = {one.name: one.verdict for one in light.study.criteria if one.as_run is not None}
    assert "pass" not in verdicts.values()
    assert all(verdict.endswith("EXTRAPOLATED") for verdict in verdicts.values())
    assert any("EXTRAPOLATED" in notice for notice in light.cautions)
    near = t2s.trial_office(records, ship="mariner", members=0, draught_fore_m=7.3, draught_aft_m=7.3)
    assert near.study.tested_at_full_load


def test_a_ship_that_is_stable_in_ballast_alone_certifies_no_overshoot(office) -> None:
    """The KVLCC2 by MMG: C' is positive at 0.7 draughts with a trim by the stern, and negative at full load."""
    figures = '[figures."zigzag:10/10"]\novershoot_1_deg = 4.0\novershoot_2_deg = 6.0\n'
    found = office(f"draught_fore_m = 13.5\ndraught_aft_m = 15.6\n{figures}", ship="kvlcc2-mmg", members=10)
    study = found.study
    assert study.stable_as_tried == 1.0 and study.stable_at_full_load == 0.0
    verdicts = {one.name: one.verdict for one in study.criteria if one.as_run is not None}
    assert len(verdicts) == 2 and all(verdict.endswith("EXTRAPOLATED") for verdict in verdicts.values())
    assert any("P stable = 0.00" in notice for notice in found.cautions)


@pytest.mark.parametrize(("factor", "agrees"), [(1.0, True), (0.7, False)])
def test_a_model_agrees_with_its_own_figures_and_not_with_others(factor: float, agrees: bool, tmp_path: Path) -> None:
    own, notes = t2s.load("mariner").turn(35).figures, tmp_path / "notes.toml"
    figures = "\n".join(f"{name} = {factor * own[name]}" for name in ("advance_m", "tactical_diameter_m"))
    notes.write_text(f'draught_fore_m = 7.4\ndraught_aft_m = 7.5\n[figures."turn:35"]\n{figures}\n', encoding="utf-8")
    study = t2s.trial_office((), ship="mariner", notes=notes, members=12).study
    assert study.tested_at_full_load
    for one in study.figures:
        assert one.model_agrees is agrees
        assert one.full_load == one.as_run == pytest.approx(factor * own[one.name])
        assert one.model_as_tried == one.model_full_load == pytest.approx(own[one.name], rel=0.02)


@pytest.mark.essential
@pytest.mark.slow
def test_the_report_is_written_as_a_whole(tmp_path: Path) -> None:
    records = turns(tmp_path, Mariner(current=(0.5, 90.0)))
    found = t2s.trial_office(records, ship="mariner", members=2, draught_fore_m=5.0, draught_aft_m=6.0)
    files = {path.name: content for path, content in found.files(tmp_path / "report").items()}
    names = {"report.html", "form.html", "report.pdf", "trials.json", "poster.html", "pilotcard.html"}
    assert names | {"as-tried.toml", "full-load.toml"} <= set(files)
    assert files["report.pdf"].startswith(b"%PDF-")
    jsonschema.validate(found.to_dict(), t2s.json_schema("trials"))
    again = type(found).read(found.to_dict(), "trials.json")
    assert again.to_json() == found.to_json()
    assert "<td>7.468 m</td><td>5 m</td>" in files["poster.html"]
    assert "agree with the trial" in files["poster.html"]
    as_tried = tmp_path / "as-tried.toml"
    as_tried.write_text(files["as-tried.toml"], encoding="utf-8")
    assert t2s.load(as_tried).turn(35).figures["tactical_diameter_m"] < 1029.0


@pytest.mark.parametrize(
    ("notes", "place"),
    [
        ("depth = 20", "depth"),
        ("draught_fore_m = 5", "draught_aft_m"),
        ("depth_m = -3", "depth_m"),
        ('[figures."round:3"]\nadvance_m = 3', "figures.round:3"),
        ('[figures."turn:35"]\nadvance = 3', "figures.turn:35.advance"),
        ("[form]\nrudder_kind = 'flap'", "form.rudder_kind"),
        ('[figures."turn:35"]\nadvance_m = -3', "figures.turn:35.advance_m"),
        ("[figures.stop]\ntrack_reach_m = 0", "figures.stop.track_reach_m"),
        ("sea_state = 2.5", "sea_state"),
        ("= 3", "line 1"),
    ],
)
def test_notes_that_are_wrong_are_named(notes: str, place: str, tmp_path: Path) -> None:
    path = tmp_path / "notes.toml"
    path.write_text(notes, encoding="utf-8")
    with pytest.raises(t2s.InputError) as fault:
        t2s.trial_office((), ship="mariner", notes=path)
    assert fault.value.source == str(path)
    assert place in fault.value.place


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"draught_fore_m": 100.0, "draught_aft_m": 5.0}, "draught_fore_m"),
        ({"draught_fore_m": 5.0}, "draught_aft_m"),
        ({"wind_speed_mps": 5.0}, "wind_from_deg"),
        ({"sea_state": 99}, "sea_state"),
    ],
)
def test_arguments_that_are_wrong_are_named(options: dict[str, float], argument: str) -> None:
    with pytest.raises(t2s.InputError) as fault:
        t2s.trial_office((), ship="mariner", **options)
    assert str(fault.value.source) == argument and fault.value.remedy


def test_records_without_a_manoeuvre_are_refused(tmp_path: Path) -> None:
    ship = Mariner()
    straight = write_record(tmp_path / "straight.csv", ship.run(lambda _time, _state: None), ship, 1)
    with pytest.raises(t2s.InputError, match=r"straight\.csv"):
        t2s.trial_office(straight, ship="mariner")
    with pytest.raises(t2s.InputError):
        t2s.trial_office((), ship="mariner")


@pytest.fixture(scope="module")
def both_turns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Turns to both sides of 720 deg in 0.5 m/s towards north."""
    return turns(tmp_path_factory.mktemp("turns"), Mariner(current=(0.5, 0.0)))


def _changed(path: Path, folder: Path, change) -> Path:
    """A copy of a record with other columns."""
    head, *lines = path.read_text(encoding="utf-8").splitlines()
    columns = dict(zip(head.split(","), np.loadtxt(lines, delimiter=",").T, strict=True))
    change(columns)
    table = np.column_stack(list(columns.values()))
    copy = folder / path.name
    np.savetxt(copy, table, fmt="%.6g", delimiter=",", header=",".join(columns), comments="")
    return copy


def test_a_rudder_of_the_other_sign_is_read_as_what_it_is_and_this_is_said(
    both_turns: list[Path], tmp_path: Path
) -> None:
    def positive_to_port(columns: dict[str, np.ndarray]) -> None:
        columns["delta_deg"], columns["delta_order_deg"] = -columns["delta_deg"], -columns["delta_order_deg"]

    wrong = [_changed(path, tmp_path, positive_to_port) for path in both_turns]
    found = t2s.trial_office(wrong, ship="mariner", members=0)
    assert found.study.current.speed_mps == pytest.approx(0.5, abs=0.01)
    assert _figures(found, "tactical_diameter_m")["starboard"] == pytest.approx(TRUE["starboard"][1], abs=4.0)
    assert any("positive to port" in notice for notice in found.cautions)


def test_positions_in_kilometres_are_no_ship_that_complies(both_turns: list[Path], tmp_path: Path) -> None:
    def kilometres(columns: dict[str, np.ndarray]) -> None:
        columns["x_m"], columns["y_m"] = columns["x_m"] / 1000, columns["y_m"] / 1000

    wrong = [_changed(path, tmp_path, kilometres) for path in both_turns]
    with pytest.raises(t2s.InputError, match=r"turn_starboard\.csv.*probably x and y are in kilometres"):
        t2s.trial_office(wrong, ship="mariner", members=0)


def test_a_copy_of_a_record_is_refused(both_turns: list[Path], tmp_path: Path) -> None:
    copy = tmp_path / "again.csv"
    copy.write_bytes(both_turns[0].read_bytes())
    with pytest.raises(t2s.InputError, match=r"again\.csv.*is the record of turn_starboard"):
        t2s.trial_office([*both_turns, copy], ship="mariner", members=0)


def test_the_test_speed_is_through_the_water_where_only_positions_show_it(
    both_turns: list[Path], office, tmp_path: Path
) -> None:
    """The approach is at 7.72 m/s through the water and at 8.22 over the ground."""
    records = [_changed(path, tmp_path, lambda columns: columns.pop("u_mps")) for path in both_turns]
    found = office("speed_85_mcr_mps = 8.9\n", records, members=0)
    condition = next(one for one in found.study.conditions if one.name == "test speed")
    assert condition.met is Met.NOT_MET
    assert float(condition.found.removesuffix(" %")) == pytest.approx(100 * 7.7175 / 8.9, abs=2.5)


def test_draughts_that_nobody_recorded_are_not_said_to_be_those_of_full_load(office) -> None:
    notes = '[figures."turn:35"]\nadvance_m = 570\n'
    unknown = office(notes, members=0)
    known = office(notes, members=0, draught_fore_m=7.4, draught_aft_m=7.5)
    for found, met, ticks in ((unknown, Met.UNKNOWN, (None, None)), (known, Met.MET, ("[x]", "[ ]"))):
        conditions = {one.name: one.met for one in found.study.conditions}
        assert conditions["draught"] is met and conditions["trim by the stern"] is met
        rows = {row.label: row.values for box in form_boxes(found.study) for row in box.rows}
        assert (rows["Tested at full load"][0], rows["Tested at partial load and corrected"][0]) == ticks
    assert any("DRAUGHTS ARE NOT RECORDED" in notice for notice in unknown.cautions)
    assert not any("DRAUGHTS" in notice for notice in known.cautions)


def test_the_form_says_in_which_condition_the_ship_was_tried_and_what_is_not_certified(office) -> None:
    figures = '[figures."turn:35"]\nadvance_m = 500\ntactical_diameter_m = 700\n'
    found = office(f"depth_m = 12\n{figures}", members=0, draught_fore_m=3.4, draught_aft_m=4.2)
    rows = {row.label: row.values for box in form_boxes(found.study) for row in box.rows}
    assert rows["Trim, m by the stern"] == ("0",)  # of the ship at full load, on even keel
    assert rows["Draughts of the trial"] == ("3.4 m forward, 4.2 m aft",)
    assert rows["Conditions not met"][0].startswith("deep water (3.2 draughts), draught (-49.1 %)")
    assert rows["Not certified: EXTRAPOLATED to full load"] == ("advance; tactical diameter",)
    first = found.headline[0]
    assert "No criterion is certified" in first and "EXTRAPOLATED" in first
    assert any("deep water (3.2 draughts)" in line for line in found.headline)
    assert any("without members" in notice for notice in found.cautions)


def test_without_a_trial_of_a_criterion_none_is_said_to_be_met(office) -> None:
    found = office('[figures."turn:15"]\nadvance_m = 900\n', members=0)
    assert found.headline[0] == "No criterion of MSC.137(76) was tried."


@pytest.mark.parametrize(("port", "met"), [("zigzag:-20/20", Met.NOT_MET), ("zigzag:-10/10", Met.MET)])
def test_both_sides_are_of_the_same_manoeuvre(port: str, met: Met, office) -> None:
    figures = "".join(f'[figures."{name}"]\novershoot_1_deg = 5\n' for name in ("zigzag:10/10", port))
    found = office(figures, members=0)
    assert {one.name: one.met for one in found.study.conditions}["both sides"] is met


def test_assumed_errors_of_the_card_are_said(office) -> None:
    assert any("ASSUMED" in one for one in office('[figures."turn:35"]\nadvance_m = 570\n', members=2).cautions)


def test_a_zigzag_that_was_reversed_late_is_read_at_its_heading(tmp_path: Path) -> None:
    """The first reversal at 12 deg, the others at 10 deg: the initial turning is to 10 deg all the same."""
    done: list[float] = []

    def orders(time: float, state: np.ndarray) -> float | None:
        side, heading = (-1) ** len(done), 12.0 if not done else 10.0
        if side * math.degrees(state[5]) >= heading:
            done.append(time)
        return None if len(done) >= 6 else math.radians(10.0) * (-1) ** len(done)

    ship = Mariner()
    rows = ship.run(orders)
    after = rows[rows[:, 0] >= APPROACH_S]
    at = int((after[:, 6] >= math.radians(10.0)).argmax())
    true_m = math.hypot(*(after[at, 4:6] - after[0, 4:6]))
    late_m = math.hypot(*(after[int((after[:, 6] >= math.radians(12.0)).argmax()), 4:6] - after[0, 4:6]))
    assert late_m > true_m + 15.0
    found = t2s.trial_office(write_record(tmp_path / "late.csv", rows, ship, 5), ship="mariner", members=0)
    assert _figures(found, "initial_turning_distance_m", "as_run")["starboard"] == pytest.approx(true_m, abs=8.0)


def test_a_stop_that_does_not_end_says_why_it_is_no_stop(tmp_path: Path) -> None:
    time = np.arange(0.0, 200.0)
    speed = np.where(time < 60.0, 8.0, 8.0 - 0.02 * (time - 60.0))
    columns = {
        "t_s": time,
        "x_m": np.cumsum(speed),
        "y_m": np.random.default_rng(1).normal(0, 0.5, len(time)),
        "psi_deg": np.random.default_rng(2).normal(0, 0.1, len(time)),
        "u_mps": speed,
        "delta_deg": np.random.default_rng(3).normal(0, 0.1, len(time)),
        "n_rpm": np.where(time < 60.0, 90.0, -60.0),
    }
    path = tmp_path / "stop.csv"
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, fmt="%.6g", delimiter=",", header=",".join(columns), comments="")
    with pytest.raises(t2s.InputError, match=r"stop\.csv.*the ship still moves ahead at its end"):
        t2s.trial_office(path, ship="mariner", members=0)


def test_short_turns_say_how_far_they_turned_and_that_no_current_is_taken_off(
    both_turns: list[Path], tmp_path: Path
) -> None:
    def cut(columns: dict[str, np.ndarray]) -> None:
        rows = np.abs(columns["psi_deg"]) <= 250.0
        columns.update({name: values[rows] for name, values in columns.items()})

    short = [_changed(path, tmp_path, cut) for path in both_turns]
    found = t2s.trial_office(short, ship="mariner", members=0)
    turned = next(one for one in found.study.conditions if one.name == "turns")
    assert float(turned.found.removesuffix(" deg")) == pytest.approx(250.0, abs=1.5)
    assert any(notice.startswith("NO CURRENT IS TAKEN OFF") for notice in found.cautions)


def test_records_with_long_names_differ_in_the_legend(both_turns: list[Path], tmp_path: Path) -> None:
    records = []
    for path in both_turns:
        records.append(tmp_path / f"2026-05-04 sea trial of hull 1234 off the coast, run 7, {path.name}")
        records[-1].write_bytes(path.read_bytes())
    found = t2s.trial_office(records, ship="mariner", members=0)
    (illustration,) = (one for section in found.sections for one in section.charts)
    text = json.dumps(illustration.chart, ensure_ascii=False)
    labels = set(re.findall(r'"([^"]*, (?:as run|without current))"', text))
    assert len(labels) == 4 and all(len(label) <= 45 for label in labels)


def test_trials_of_another_ship_are_said(tmp_path: Path) -> None:
    ship = Mariner()
    ten, twenty = (ship.run(zigzag(angle, angle)) for angle in (10.0, 20.0))
    zigzags = [write_record(tmp_path / f"{name}.csv", rows, ship, 3) for name, rows in (("10", ten), ("20", twenty))]
    assert not any("another ship" in one for one in t2s.trial_office(zigzags, ship="mariner", members=0).cautions)
    found = t2s.trial_office(zigzags, ship="kvlcc2-mmg", members=0)
    assert any("another ship" in notice for notice in found.cautions)


def test_a_pair_may_be_of_notes_and_option(tmp_path: Path) -> None:
    notes = tmp_path / "notes.toml"
    notes.write_text('draught_fore_m = 7.4\n[figures."turn:35"]\nadvance_m = 570\n', encoding="utf-8")
    found = t2s.trial_office((), ship="mariner", notes=notes, members=0, draught_aft_m=7.6)
    assert found.study.state.draught_m == pytest.approx(7.5)
    with pytest.raises(t2s.InputError) as fault:
        t2s.trial_office((), ship="mariner", notes=notes, members=0)
    assert (fault.value.source, fault.value.place) == (str(notes), "draught_aft_m")


def _words_of_pdf(content: bytes) -> list[str]:
    """Texts that a PDF draws, in their order, from its streams."""
    texts: list[str] = []
    for part in content.split(b"stream\n")[1:]:
        try:
            stream = zlib.decompress(part.split(b"\nendstream")[0])
        except zlib.error:
            continue
        texts += [found.decode("latin-1") for found in re.findall(rb"\(((?:\\.|[^\\)])*)\) Tj", stream)]
    return texts


def test_the_pdf_has_the_numbers_of_the_form(office) -> None:
    from tank2sim.apps.trial_office.form import form_boxes
    from tank2sim.apps.trial_office.paper import report_pdf

    figures = '[figures."turn:35"]\nadvance_m = 511\ntactical_diameter_m = 713\n'
    found = office(f'place = "Gdańsk – roads"\n{figures}', members=3, draught_fore_m=5.1, draught_aft_m=5.9)
    words = _words_of_pdf(report_pdf(found))
    data = next(box for box in form_boxes(found.study) if box.title == "Manoeuvring data")
    known = [row for row in data.rows if row.values[1]]
    assert len(known) == 2
    for row in known:
        place = words.index(row.label)
        assert words[place + 1 : place + 3] == [row.values[1], row.values[2]]
    assert any("Gdansk - roads" in text for text in words)


def test_long_words_of_the_poster_break_within_their_box(office, tmp_path: Path) -> None:
    found = office('[figures."turn:35"]\nadvance_m = 520\n', members=3, draught_fore_m=7.0, draught_aft_m=7.2)
    poster = str(found.files(tmp_path)[tmp_path / "poster.html"])
    assert re.search(r'<td class="long">estimated; \d of \d agree with the trial</td>', poster)
    assert "td.long { white-space: normal; }" in poster


@pytest.mark.parametrize(("factor", "filled"), [(1.0, True), (0.6, False)])
def test_the_poster_shows_the_ballast_in_which_the_trial_confirmed_the_model(
    factor: float, filled: bool, office, tmp_path: Path
) -> None:
    """At 0.74 draughts ``validity`` is 0.67: the trial decides, or the panel is left to be filled in by hand."""
    card = CARD.read_text(encoding="utf-8")
    loaded = '\n[[effects]]\nname = "loading"\nparameters = { mean_draught_m = 5.5, trim_m = 0.8 }\n'
    (tmp_path / "light.toml").write_text(card + loaded, encoding="utf-8")
    own = t2s.load(tmp_path / "light.toml").turn(35).figures
    figures = "\n".join(f"{name} = {factor * own[name]}" for name in ("advance_m", "tactical_diameter_m"))
    found = office(f'[figures."turn:35"]\n{figures}\n', members=8, draught_fore_m=5.1, draught_aft_m=5.9)
    assert 0.5 < found.study.loading_validity < 0.8
    poster = str(found.files(tmp_path)[tmp_path / "poster.html"])
    assert ("range of the card ends" not in poster) is filled
