"""The page of a result: of a result in hand, of its values, and of the file that a command wrote."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import tank2sim as t2s
from tank2sim.api.results import commands_with_results
from tests.cli.command_line import refused, tank2sim


@pytest.fixture(scope="module")
def turn() -> t2s.ManoeuvreResult:
    return t2s.load("mariner").turn(35)


def test_the_name_of_the_schema_is_not_a_figure_of_the_page(turn: t2s.ManoeuvreResult) -> None:
    assert "tank2sim/simulate/1" not in t2s.make_report(turn.to_dict()).page().partition("<script")[0]


def test_a_chart_that_is_not_there_is_a_lookup_error(turn: t2s.ManoeuvreResult) -> None:
    with pytest.raises(LookupError):
        turn.plot(name="none")


@pytest.mark.parametrize("schema", ["tank2sim/simulate/2", "tank2sim/dance/1", "simulate", 3])
def test_a_schema_that_is_not_known_is_refused(turn: t2s.ManoeuvreResult, schema: object) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.make_report({**turn.to_dict(), "schema": schema})
    assert refusal.value.place == "schema" and refusal.value.remedy


def test_every_command_of_a_type_exists() -> None:
    from tank2sim.cli import COMMANDS

    types = set(commands_with_results())
    assert types == set(COMMANDS) - {"open", "report"}


def test_a_page_never_takes_the_place_of_its_json(turn: t2s.ManoeuvreResult, tmp_path: Path) -> None:
    turn.to_json(tmp_path / "turn.json")
    refused(tank2sim("report", "turn.json", "-o", "turn.json", cwd=tmp_path), "turn.json")
    assert json.loads((tmp_path / "turn.json").read_text())["ship"] == "Mariner class"


def test_the_report_of_a_page_to_steer_says_how_to_make_the_page() -> None:
    made = t2s.load("mariner").steering_page()
    assert not any("not in the JSON" in line for line in made.headline)
    again = t2s.make_report(made.to_dict())
    assert "tank2sim steer CARD --page FILE.html" in again.headline[-1] and again.headline[-1] in again.page()
