"""The passport: where each coefficient is from, how sure it is, and what was found of the FMU; the reference result."""

from __future__ import annotations

import html
import json
import math
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv

from tank2sim.bundled import bundled_cards
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.fmu.acceptance import passport_files, replay_in_fmu
from tank2sim.fmu.check import compare_with_model
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.passport import PASSPORT_FILE, PASSPORT_PAGE, Replay, passport
from tank2sim.fmu.provenance import ABSENT, ASSUMED_ERROR, NOT_STATED, STATED_ERROR, Documents, documents_of, origins
from tank2sim.fmu.reference import by_scheme, reference_errors
from tank2sim.fmu.reference_run import INPUTS_FILE, OUTPUTS_FILE, ReferenceRun, read_reference, reference_run
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tests.fmu.driving import FmuFile, ShipFmu, rewritten

from ..cli.command_line import tank2sim


def entry(path: Path, name: str) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name).decode()


@pytest.fixture(scope="module")
def reported(mariner_fmu: ShipFmu) -> dict[str, Any]:
    """The passport of the Mariner."""
    found: dict[str, Any] = json.loads(entry(mariner_fmu(2), PASSPORT_FILE))
    return found


# ---- coefficients ----


def test_every_coefficient_of_the_card_is_there_with_its_value(
    reported: dict[str, Any], mariner_card: ManoeuvringCard
) -> None:
    found = {one["variable"]: one for one in reported["coefficients"]}
    for name, value in mariner_card.derivatives.items():
        one = found[f"derivatives.{name}"]
        assert one["value"] == value
        assert (one["standard_error"], one["standard_error_from"]) == (pytest.approx(abs(0.02 * value)), ASSUMED_ERROR)
        assert "Chislett" in one["source"]
    assert found["ship.mass"]["value"] == pytest.approx(798e-5 * 0.5 * 1025 * 160.93**3)
    assert found["derivatives.Xvvu"]["source"] == ABSENT
    assert not [name for name in found if name.startswith(("initial.", "origin.", "solver."))]


def test_what_low_speed_needs_and_the_card_does_not_state_says_where_it_is_from(reported: dict[str, Any]) -> None:
    found = {one["variable"]: one["source"] for one in reported["coefficients"]}
    assert "Chislett" in found["ship.draught"]  # which the card states
    assert found["ship.propeller_diameter"] == "not in the card: 0.6 of the draught, typical"
    assert "Faltinsen" in found["low_speed.drag_coefficient"]
    assert "choice" in found["low_speed.rudder_astern"]


def test_remarks_and_uncertainties_of_a_card_are_reported() -> None:
    known = origins(read_card("kvlcc2-captive"))
    assert "Clarke" in known["derivatives.Yr"].remark
    assert (known["derivatives.Yr"].standard_error, known["derivatives.Yr"].error_from) == (0.00129, STATED_ERROR)
    assert known["derivatives.Yv"].remark == ""
    assert known["steering.max_rate"].error_from == NOT_STATED
    assert "steering.time_constant" not in known  # assumed by the program
    assert "HMRI" in known["ship.draught"].source


def test_an_effect_tells_its_equation_and_its_uncertainty(mariner_card: ManoeuvringCard) -> None:
    added = """
[[effects]]
name = "current"
[effects.parameters]
speed_mps = 0.4 # drift of the log
direction_deg = 120.0
[effects.uncertainty]
speed_mps = 0.02
"""
    card = parse_card(mariner_card.text + added, "x.toml")
    made = passport(build(card), documents_of(card), {}, Replay())
    found = {one.variable: one for one in made.coefficients}
    assert (found["current.speed"].value, found["current.speed"].standard_error) == (0.4, 0.02)
    assert found["current.speed"].remark == "drift of the log"
    assert "moving frame" in found["current.speed"].source
    assert found["current.direction"].value == pytest.approx(math.radians(120.0))


@pytest.mark.parametrize("name", list(bundled_cards()))
def test_each_bundled_ship_has_a_passport_that_machines_and_people_can_read(name: str) -> None:
    card = read_card(name)
    model = build(card)
    files = passport_files(model, documents_of(card), {}, Replay(problem="not now"))
    found = json.loads(files[PASSPORT_FILE])
    assert found["format"] == "tank2sim-passport/1"
    assert {one["variable"] for one in found["coefficients"]} <= {*model.parameter_names, *model.input_names}
    assert all(one["source"] for one in found["coefficients"])
    page = files[PASSPORT_PAGE]
    for one in found["coefficients"]:
        assert one["variable"] in page
    assert html.escape(card.ship.source, quote=False).split("'")[0][:40] in page


# ---- what rules ask for, and pictures ----


def test_rows_of_rules_follow_from_the_model(mariner_card: ManoeuvringCard, mariner: Model) -> None:
    def shown(model: Model) -> dict[str, str]:
        made = passport(model, documents_of(mariner_card), {}, Replay())
        return {row.subject: str(row.shown) for row in made.rules}

    calm = shown(mariner)
    assert calm["tidal stream, currents"] == calm["effects of weather: wind"] == "not shown"
    assert calm["motion in six degrees of freedom"] == calm["effects of weather: waves"] == "not shown"
    assert calm["simulated manoeuvres"] == calm["potential causes of prediction error"] == "not shown"
    assert calm["visual scenario as seen from the bridge"] == "not applicable"
    added = '\n[[effects]]\nname = "current"\nparameters = { speed_mps = 0.4, direction_deg = 120.0 }\n'
    assert shown(build(parse_card(mariner_card.text + added, "x.toml")))["tidal stream, currents"] == "shown"
    assert passport(build(read_card("wilinski-zellman")), Documents(), {}, Replay()).rules == ()


def test_the_page_has_the_turn_to_scale_and_the_zigzag(
    mariner_fmu: ShipFmu, mariner: Model, reported: dict[str, Any]
) -> None:
    page = entry(mariner_fmu(2), PASSPORT_PAGE)
    assert page.count("<svg") == 3
    track = re.search(r'<polyline points="([^"]*)"', page)
    assert track is not None
    points = np.array([[float(each) for each in pair.split(",")] for pair in track[1].split()])
    run = simulate(mariner, parse_manoeuvre("turn:35")).trajectory
    metres = np.column_stack([run["motion.y"], -run["motion.x"]])  # pixels count downward
    scale = np.ptp(points, axis=0) / np.ptp(metres, axis=0)
    assert scale[0] == pytest.approx(scale[1], rel=0.01)
    assert points[-1] - points[0] == pytest.approx(scale * (metres[-1] - metres[0]), abs=1)
    assert {row["shown"] for row in reported["rules"]} == {"shown", "not shown", "not applicable"}


# ---- what was found of the FMU ----


def test_figures_are_those_of_the_simulation(reported: dict[str, Any], mariner: Model) -> None:
    for key, manoeuvre in (("turn_35", "turn:35"), ("zigzag_20_20", "zigzag:20/20")):
        figures = simulate(mariner, parse_manoeuvre(manoeuvre)).figures
        for name, value in figures.items():
            assert reported["figures"][key][name] == pytest.approx(value, rel=1e-9)


def test_the_fmu_repeats_its_reference_run_on_the_machine_that_wrote_it(fmi: int, mariner_fmu: ShipFmu) -> None:
    replay = json.loads(entry(mariner_fmu(fmi), PASSPORT_FILE))["replay"]
    assert replay["problem"] == ""
    assert replay["run"] == "zigzag 20/20"
    assert 0 <= replay["max_error"] < 1e-9


def test_a_library_that_answers_otherwise_is_reported(hull: Model, fmu_file: FmuFile) -> None:
    reference, _ = reference_run(hull)
    assert reference is not None
    outputs = reference.outputs.copy()
    outputs[-1, hull.outputs.index("motion.u")] *= 1.01
    other = ReferenceRun(reference.title, reference.run, hull.input_names, hull.outputs, outputs)
    found = replay_in_fmu(fmu_file("hull", 2).read_bytes(), other, hull, 2)
    assert found.output == "motion.u"
    assert found.max_error is not None
    assert found.max_error > 1e-3


def test_a_motion_that_leaves_all_bounds_has_no_reference(hull: Model) -> None:
    wild = hull.redefine("motion.udot", lambda value: value + hull.symbol("motion.u") ** 3)
    assert reference_run(wild) == (None, {})
    files = passport_files(wild, Documents(), {}, replay_in_fmu(b"", None, wild, 2))
    assert "leaves all bounds" in files[PASSPORT_PAGE]
    assert json.loads(files[PASSPORT_FILE])["replay"]["max_error"] is None


# ---- the reference result ----


def test_the_reference_result_is_the_zigzag_of_the_model(mariner: Model, mariner_fmu: ShipFmu, tmp_path: Path) -> None:
    with zipfile.ZipFile(mariner_fmu(2)) as archive:
        archive.extractall(tmp_path)
    found = read_reference(tmp_path)
    assert found is not None
    rudder = np.degrees(found.run.inputs[:, found.input_names.index("rudder.command")])
    assert set(np.round(rudder, 9)) == {20.0, -20.0}
    run = simulate(mariner, parse_manoeuvre("zigzag:20/20")).trajectory
    switched = found.run.times[1:-1][np.diff(rudder) != 0]
    np.testing.assert_allclose(switched, run.t[1:][np.diff(run["rudder.command"]) != 0], rtol=1e-12)
    heading = found.outputs[:, found.output_names.index("motion.psi")]
    np.testing.assert_allclose(heading, np.interp(found.run.times, run.t, run["motion.psi"]), atol=2e-6)
    columns = dict(zip(found.output_names, found.outputs.T, strict=True))
    assert max(reference_errors(mariner, by_scheme(mariner, found.run), columns).values()) < 1e-11


def test_fmpy_alone_can_repeat_the_reference_result(fmi: int, fmu_file: FmuFile, tmp_path: Path) -> None:
    path = fmu_file("hull", fmi)
    for name in (INPUTS_FILE, OUTPUTS_FILE):
        (tmp_path / Path(name).name).write_text(entry(path, name))
    expected = read_csv(tmp_path / Path(OUTPUTS_FILE).name)
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=float(expected["time"][-1]),
        output_interval=0.1,
        input=read_csv(tmp_path / Path(INPUTS_FILE).name),
        output=["motion.u", "motion.psi"],
        fmi_type="CoSimulation",
    )
    for name in ("motion.u", "motion.psi"):
        near = np.interp(expected["time"], found["time"], found[name])
        np.testing.assert_allclose(near, expected[name], atol=2e-3 * np.ptp(expected[name]))


def with_another_position(text: str) -> str:
    *rows, last = text.splitlines()
    time, _, *rest = last.split(",")
    return "\n".join([*rows, ",".join([time, "12.5", *rest])])


@pytest.mark.slow
def test_a_check_repeats_the_reference_result(mariner_fmu: ShipFmu, tmp_path: Path) -> None:
    ended = tank2sim("check", str(mariner_fmu(2)), "--json", "x.json", cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout
    assert json.loads((tmp_path / "x.json").read_text())["reference_error"] < 1e-11
    assert "repeats the reference result" in ended.stdout


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        (OUTPUTS_FILE, with_another_position, "from the reference result"),
        (OUTPUTS_FILE, lambda text: text.replace("motion.u", "motion.w"), "motion.w, which is not a variable"),
        (OUTPUTS_FILE, lambda text: text[: len(text) // 2 - 3], "not a table of"),
        (INPUTS_FILE, lambda text: text + "x\n", "not a table of numbers"),
        (INPUTS_FILE, lambda text: "", "not a table of"),
    ],
)
def test_a_reference_result_that_is_wrong_or_damaged_fails_the_check(
    name: str, change: Callable[[str], str], words: str, fmu_file: FmuFile, tmp_path: Path
) -> None:
    def damage(file: str, data: bytes) -> bytes:
        return change(data.decode()).encode() if file == name else data

    report = compare_with_model(rewritten(fmu_file("hull", 2), tmp_path / "x.fmu", damage))
    assert not report.passed
    assert words in " ".join(report.differences)


def test_inputs_hold_from_a_jump_to_the_next(tmp_path: Path) -> None:
    run = InputSequence(np.array([0.0, 1.0, 1.5, 4.0]), np.array([[1.0], [1.0], [2.0]]))
    files = ReferenceRun("x", run, ("a",), ("b",), np.array([[0.0], [1.0], [2.0], [3.0]])).files()
    assert files[INPUTS_FILE].split() == ["time,a", "0,1", "1.5,1", "1.5,2", "4,2"]
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = read_reference(tmp_path)
    assert found is not None
    np.testing.assert_array_equal(found.run.times, run.times)
    np.testing.assert_array_equal(found.run.inputs, run.inputs)
