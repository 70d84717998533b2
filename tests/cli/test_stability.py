"""``tank2sim stability``: its JSON, its page, and ships that have no steady turn."""

from __future__ import annotations

import json
import re

import pytest

from tests.cli.command_line import refused, tank2sim


def test_a_ship_without_a_steady_speed_gets_all_the_rest_and_a_note(tmp_path) -> None:
    arguments = ["stability", "kvlcc2-captive", "--set", "derivatives.X0=0.02", "--json", "s.json", "-o", "s.html"]
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "no steady-turning diagram: keeps no steady speed" in " ".join(result.stdout.split())
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["steady_turning"] is None and found["characteristic"] is None and found["nomoto"]
    assert any("steady speed" in notice["text"] for notice in found["notices"])


def test_a_ship_that_holds_no_straight_course_is_refused_in_one_line(tmp_path) -> None:
    arguments = ["--set", "derivatives.Yd=0.0", "--set", "derivatives.Nd=0.0", "-o", "s.html"]
    refused(tank2sim("stability", "mariner", *arguments, cwd=tmp_path), "straight course")
    assert not list(tmp_path.iterdir())


def test_what_leaves_the_card_and_what_is_open_says_why_on_the_screen(tmp_path) -> None:
    result = tank2sim("stability", "kvlcc2-captive", "--no-spirals", cwd=tmp_path)
    reported = " ".join(result.stdout.split())
    assert re.search(r"advance; [^:]*: EXTRAPOLATED beyond the card", reported)
    assert "track reach: the card has no [propulsion]" in reported


@pytest.mark.slow
def test_a_linear_card_has_no_curve_over_speed_and_weather_is_reported(tmp_path) -> None:
    weather = '[{name = "current", parameters = {speed_mps = 0.5, direction_deg = 90.0}}]'
    arguments = ["--set", "model.kind=linear", "--set", f"effects={weather}", "--speed", "5.4", "--json", "s.json"]
    result = tank2sim("stability", "mariner", "--no-spirals", *arguments, "-o", "s.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["margins"]["speed"] is None and "Over the card" not in (tmp_path / "s.html").read_text()
    reported = " ".join(notice["text"] for notice in found["notices"])
    assert "do not change with speed" in reported and "in the card's current" in reported
