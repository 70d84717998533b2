"""The office after a sea trial, on the document's cases: made by other code, and one published ship."""

from __future__ import annotations

import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.trial_office.conditions import Met
from tank2sim.apps.trial_office.tried import current_removed, tried
from tank2sim.records.trials import Trial
from tank2sim.simulation.manoeuvres import Stop
from tests.apps.trial_office.sea_trial import APPROACH_S, CARD, Mariner, turn, turns, write_record, zigzag

TRUE = {"starboard": (570.2, 1029.2), "port": (596.7, 1070.3)}
"""Advance and tactical diameter in calm water, m, of the document."""


def _figures(found, name, field="without_current"):
    return {one.side: getattr(one, field) for one in found.study.figures if one.name == name}


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
    assert overshoots and all(one.as_run == pytest.approx(one.without_current, abs=1e-9) for one in overshoots)


def test_a_record_of_one_turn_uses_the_moving_circle_and_says_so(tmp_path: Path) -> None:
    found = t2s.trial_office(turns(tmp_path, Mariner(current=(0.5, 90.0)), turned_deg=360.0), ship="mariner", members=0)
    assert {one.measured.method for one in found.study.drifts} == {"circle in a moving frame"}
    assert found.study.current.speed_mps == pytest.approx(0.5, abs=0.02)
    assert found.study.current.spread_mps is None


@pytest.mark.slow
def test_a_tide_that_falls_shows_in_the_spread_and_widens_the_errors(tmp_path: Path) -> None:
    steady, falling = tmp_path / "steady", tmp_path / "falling"
    for folder in (steady, falling):
        folder.mkdir()
    ship = Mariner(current=(0.5, 90.0))
    constant = t2s.trial_office(turns(steady, ship), ship="mariner", members=0)
    tide = t2s.trial_office(turns(falling, ship, tide=0.2), ship="mariner", members=0)
    assert tide.study.current.spread_mps > 0.01 > constant.study.current.spread_mps
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


def test_published_figures_without_records_fill_the_form(bitumen: t2s.Ship, tmp_path: Path) -> None:
    """FS Bitumen No. 1, full load, 2014: the numbers of its form; what nobody recorded stays blank."""
    from tank2sim.apps.trial_office.form import form_boxes

    notes = tmp_path / "notes.toml"
    notes.write_text(BITUMEN, encoding="utf-8")
    found = t2s.trial_office((), ship=bitumen, notes=notes)
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
def test_conditions_that_are_not_met_are_said_and_refuse_nothing(tmp_path: Path) -> None:
    notes = tmp_path / "notes.toml"
    notes.write_text("depth_m = 20.0\nspeed_85_mcr_mps = 8.8\nsea_state = 5\n", encoding="utf-8")
    records = turns(tmp_path, Mariner())
    found = t2s.trial_office(records, ship="mariner", notes=notes, members=0, wind_speed_mps=12.0, wind_from_deg=0.0)
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


def test_a_ship_that_is_stable_in_ballast_alone_certifies_no_overshoot(tmp_path: Path) -> None:
    """The KVLCC2 by MMG: C' is positive at 0.7 draughts with a trim by the stern, and negative at full load."""
    notes = tmp_path / "notes.toml"
    figures = '[figures."zigzag:10/10"]\novershoot_1_deg = 4.0\novershoot_2_deg = 6.0\n'
    notes.write_text(f"draught_fore_m = 13.5\ndraught_aft_m = 15.6\n{figures}", encoding="utf-8")
    found = t2s.trial_office((), ship="kvlcc2-mmg", notes=notes, members=10)
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


def test_records_without_a_manoeuvre_are_refused(tmp_path: Path) -> None:
    ship = Mariner()
    straight = write_record(tmp_path / "straight.csv", ship.run(lambda _time, _state: None), ship, 1)
    with pytest.raises(t2s.InputError, match=r"straight\.csv"):
        t2s.trial_office(straight, ship="mariner")
    with pytest.raises(t2s.InputError):
        t2s.trial_office((), ship="mariner")
