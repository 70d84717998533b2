"""Glides through the API and the command line: against the balance of forces, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tests.cli.command_line import refused, tank2sim


@pytest.fixture(scope="module")
def glider() -> t2s.Ship:
    return t2s.load("kulikovsky-velikanov")


def test_lift_drag_and_buoyancy_balance_in_degrees(glider: t2s.Ship) -> None:
    """(3) and (9) of the paper; 1 kg of net buoyancy is g N."""
    glides = glider.glide([25, -30, 60], roll_deg=10, buoyancy_kg=2.0, views=False).glides
    path, roll = np.radians(glides["path_angle_deg"]), np.radians(glides["roll_deg"])
    lift, drag = glides["lift_N"] * np.cos(roll), glides["drag_N"]
    assert glides["path_angle_deg"].tolist() == pytest.approx([25, -30, 60])
    assert glides["buoyancy_kg"].tolist() == [2.0, -2.0, 2.0]
    along = np.sign(path)  # drag is against the path, buoyancy along it
    np.testing.assert_allclose(drag, 2.0 * 9.81 * np.abs(np.sin(path)), rtol=2e-3)
    np.testing.assert_allclose(lift, -along * 2.0 * 9.81 * np.cos(path), rtol=2e-3)
    q = glides["drag_N"] / glides["drag_coefficient"]
    np.testing.assert_allclose(glides["lift_N"], q * glides["lift_coefficient"], rtol=1e-12)


def test_what_cannot_be_asked_is_refused_at_its_place(glider: t2s.Ship, tmp_path: Path) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("mariner").glide(30)
    assert refusal.value.place == "model.kind" and "glider" in refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        glider.glide(budget_kg=10, views=False)
    assert str(refusal.value.source) == "depth_m" and refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        glider.glide(programme=tmp_path / "none.csv", views=False)
    assert str(refusal.value.source).endswith("none.csv")
    for budget, depth in ((0, 100), (-1, 100), (10, 0), (math.nan, 100), (10, math.inf)):
        with pytest.raises(t2s.InputError, match="give a finite number from"):
            glider.glide(budget_kg=budget, depth_m=depth, views=False)
    for angle in (20, 95, math.nan):
        with pytest.raises(t2s.InputError) as refusal:
            glider.glide(angle, views=False)
        assert refusal.value.remedy


PROGRAMME = str(Path(__file__).parents[4] / "models/kulikovsky-velikanov/programme.csv")


def test_angles_give_states(tmp_path) -> None:
    result = tank2sim(
        *("glide", "--angles", "25", "-45,35", "30", "--as-printed", "--budget-kg", "50"),
        *("--depth-m", "200", "--no-views", "--json", "g.json"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    assert "23.385 deg" in result.stdout and "12.8 kg" in result.stdout and "times the right ones" in result.stdout
    found = json.loads((tmp_path / "g.json").read_text())
    assert [state["path_angle_deg"] for state in found["states"]] == pytest.approx([25, -45, 35, 30])
    assert found["states"][3]["speed_mps"] == pytest.approx(0.2444, abs=6e-5)
    assert found["as_printed"][3]["speed_mps"] == pytest.approx(0.0972, abs=6e-5)
    assert max(abs(force) for one in found["states"] for force in one["force_residual_N"]) < 1e-10
    assert min(abs(one["force_residual_N"][0]) for one in found["as_printed"]) > 0.01
    assert found["design"]["smallest_angle_deg"] == pytest.approx(23.385, abs=5e-4)
    assert len(found["design"]["ranges"]) == 6


def test_a_programme_gives_a_path_and_the_transient_next_to_it(tmp_path) -> None:
    result = tank2sim("glide", "--programme", PROGRAMME, "--as-printed", "--no-views", "--json", "g.json", cwd=tmp_path)
    assert result.returncode == 0 and "transient model" in result.stdout, result.stderr
    found = json.loads((tmp_path / "g.json").read_text())
    last = found["path"][-1]
    assert (last["x_m"], last["y_m"], last["height_m"]) == pytest.approx((119.215, 118.279, -24.432), abs=1e-3)
    assert len(found["steps"]) == 12 and len(found["path_as_printed"]) == 13
    assert found["transient"]["distance_m"][6] < 1e-6 < found["transient"]["distance_m"][12] < 10


def test_the_reference_area_is_an_option(tmp_path) -> None:
    arguments = ["glide", "--angles", "30", "--reference-area-m2", "0.0356", "--no-views", "--json", "g.json"]
    assert tank2sim(*arguments, cwd=tmp_path).returncode == 0
    (state,) = json.loads((tmp_path / "g.json").read_text())["states"]
    assert state["speed_mps"] == pytest.approx(0.515, abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--angles", "20"], ["20 deg cannot be flown", "23.385 deg"]),
        (["--angles", "24", "--roll-deg", "30"], ["26.534 deg"]),
        (["--angles", "thirty"], ["--angles", "thirty"]),
        (["--angles", "95"], ["--angles", "95", "<=90"]),
        (["mariner"], ["model.kind", "glider"]),
        (["--programme", "none.csv"], ["none.csv"]),
        (["--no-views", "--budget-kg", "10"], ["--depth", "missing"]),
        (["--no-views", "--budget-kg", "10", "--depth-m", "-3"], ["--depth", "-3"]),
        (["--reference-area-m2", "-1"], ["--reference-area"]),
        (["--angles", "30", "--json", "missing/g.json"], ["missing/g.json"]),
    ],
)
def test_bad_input_ends_in_one_line_and_exit_2(tmp_path, arguments, words) -> None:
    refused(tank2sim("glide", *arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", [["simulate", "--manoeuvre", "turn:20"], ["stability"]])
def test_commands_for_ships_refuse_a_glider(tmp_path, command) -> None:
    refused(tank2sim(command[0], "kulikovsky-velikanov", *command[1:], cwd=tmp_path), "rudder")


@pytest.mark.parametrize("argument", [{"roll_deg": 20.0}, {"buoyancy_kg": 1.0}, {"as_printed": True}])
def test_what_belongs_to_steady_glides_is_refused_without_their_angles(glider: t2s.Ship, argument: dict) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        glider.glide(**argument, views=False)
    assert str(refusal.value.source) == next(iter(argument)) and "angles" in refusal.value.remedy


def test_a_programme_is_flown_as_printed_without_angles(glider: t2s.Ship) -> None:
    assert glider.glide(programme=PROGRAMME, as_printed=True, views=False).study.path_as_printed
