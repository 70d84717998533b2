"""``tank2sim convert`` writes what it says, whole or not at all."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

import tank2sim as t2s
from tests.cli.command_line import refused, tank2sim


def test_bad_requests_are_one_line_and_write_nothing(tmp_path: Path) -> None:
    for arguments, word in (
        (("mariner", "--to", "matlab"), "--to"),
        (("kvlcc2-mmg", "--to", "mss", "--origin", "3"), "--to"),
        (("nowhere", "--to", "mss"), "nowhere"),
        (("mariner", "--to", "gazebo"), "xdyn"),  # which takes a ship
        (("otter", "--to", "mss"), "xdyn"),
    ):
        refused(tank2sim("convert", *arguments, "-o", "made", cwd=tmp_path), word)
        assert not (tmp_path / "made").exists()
    refused(tank2sim("convert", "mariner", "--to", "mss", "-o", "no/made.m", cwd=tmp_path), "no")


def test_a_folder_holds_the_file_and_a_readme_with_what_is_lost(tmp_path: Path) -> None:
    done = tank2sim("convert", "otter", "--to", "gazebo", "-o", "craft", "--json", "made.json", cwd=tmp_path)
    assert done.returncode == 0
    assert sorted(path.name for path in (tmp_path / "craft").iterdir()) == ["README.md", "otter_usv.sdf"]
    figures = json.loads((tmp_path / "made.json").read_text())["figures"]
    rows = [line for line in (tmp_path / "craft" / "README.md").read_text().splitlines() if line.startswith("| ")]
    assert len(rows) == 1 + len(figures)
    worst = max(figures, key=lambda one: abs(one["error_percent"]))
    assert any(f"{worst['error_percent']:+.2f}" in row and worst["figure"] in row for row in rows)


def test_the_function_in_a_folder_is_in_the_file_of_its_name(tmp_path: Path) -> None:
    t2s.convert("mariner", to="mss").save(tmp_path / "made")
    written = next((tmp_path / "made").glob("*.m"))
    assert f"= {written.stem}(x, ui, p)" in written.read_text().splitlines()[0]
    t2s.convert("kvlcc2-l7-mmg").save(tmp_path / "card")
    assert sorted(path.suffix for path in (tmp_path / "card").iterdir()) == [".md", ".toml"]


def test_a_readme_names_the_sensors_that_no_program_has(tmp_path: Path) -> None:
    ship = t2s.load("mariner").replace({"effects": [{"name": "gyro_bias", "parameters": {"rate_radps": 0.001}}]})
    for to in ("xdyn", "mss"):
        t2s.convert(ship, to=to).save(tmp_path / to)
        assert "sensors are left out: gyro_bias" in (tmp_path / to / "README.md").read_text()
    t2s.convert("mariner", to="mss").save(tmp_path / "bare")
    assert "sensors" not in (tmp_path / "bare" / "README.md").read_text()


@pytest.mark.parametrize(("to", "words"), [("gazebo", ("izz", "DART", "_joint", "newtons")), ("vrx", ("izz", "DART"))])
def test_the_readme_of_a_robot_says_what_else_its_model_needs(to: str, words: tuple[str, ...], tmp_path: Path) -> None:
    t2s.convert("otter", to=to).save(tmp_path / "craft")
    use = (tmp_path / "craft" / "README.md").read_text().partition("## What is lost")[0]
    assert all(word in use for word in (*words, "otter_usv.sdf")) and "NAME" not in use


def test_a_vehicle_is_made_as_its_readme_says(tmp_path: Path) -> None:
    t2s.convert("kvlcc2", to="pvs").save(tmp_path / "made")
    (call,) = re.findall(r"`(\w+\([^)]*\))`", (tmp_path / "made" / "README.md").read_text())
    names: dict[str, Any] = {}
    exec((tmp_path / "made" / "kvlcc2.py").read_text(), names)
    vehicle = eval(call, names)
    assert vehicle.stepInput(1.0)[0] == pytest.approx(math.radians(20))
