"""The JSON of results follows its schema, a wrong key, type or command does not, and a page is made of it alone."""

from __future__ import annotations

import copy
import functools
import json
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest

import tank2sim as t2s
from tank2sim.answer.result import Result
from tank2sim.api.results import commands_with_results, read_result
from tests.made_results import OWN_DOCUMENTS, RESULTS, marked

PAGES = [name for name in RESULTS if name.split()[0] not in OWN_DOCUMENTS]


def commands(kind: type[Result] = Result) -> set[str]:
    return {kind.command} if "command" in vars(kind) else set().union(*map(commands, kind.__subclasses__()))


def holds(result: dict[str, object], command: str) -> bool:
    return jsonschema.Draft202012Validator(t2s.json_schema(command)).is_valid(result)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Result]:
    """The result of a name; made once."""
    return functools.cache(lambda name: RESULTS[name](tmp_path_factory.mktemp("made")))


@pytest.fixture(scope="module")
def result(made: Callable[[str], Result]) -> Callable[[str], dict[str, object]]:
    """The JSON of the result of a name, as it is read from a file; made once."""
    return functools.cache(lambda name: json.loads(made(name).to_json()))


@pytest.mark.parametrize("name", marked(RESULTS), scope="module")  # grouped by result: each is made once
def test_results_follow_their_schemas_and_no_others(result, name) -> None:
    command, found = name.split()[0], result(name)
    jsonschema.validate(found, t2s.json_schema(command))
    assert found["schema"] == f"tank2sim/{command}/1"
    without = {key: value for key, value in found.items() if key != "schema"}
    assert not holds({**found, "not_declared": 1}, command) and not holds(without, command)
    assert read_result(found, "r.json").to_dict() == found


@pytest.mark.parametrize("name", marked(PAGES), scope="module")
def test_the_command_and_report_give_the_same_page(made, name: str, tmp_path: Path) -> None:
    found = made(name)
    found.to_json(tmp_path / "result.json")
    again = t2s.make_report(tmp_path / "result.json")
    assert again.page() == found.page() and t2s.make_report(found.to_dict()).page() == found.page()
    assert list(again.charts()) == list(found.charts())
    assert all(section.heading for section in found.layout().sections)


@pytest.mark.parametrize("name", marked(RESULTS), scope="module")
def test_a_result_fits_a_screen(made, name: str) -> None:
    assert len(repr(made(name)).splitlines()) <= 26  # a screen of 24, and what a headline of several lines takes


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES, scope="module")
def test_a_notebook_shows_the_first_chart_of_a_result(made, name: str) -> None:
    found = made(name)
    assert ("data:image/png;base64," in found._repr_html_()) == bool(found.charts())


def test_every_command_but_those_with_long_searches_has_a_result_here() -> None:
    assert {name.split()[0] for name in RESULTS} == set(commands_with_results()) - {"demo"}


@pytest.mark.slow
def test_a_campaign_follows_its_schema(data) -> None:
    found = t2s.reduce(data / "data/pmm_synthetic_11/campaign.toml", fill="clarke1983")
    jsonschema.validate(json.loads(found.to_json()), t2s.json_schema("reduce"))


@pytest.mark.slow
def test_trials_follow_their_schemas(data) -> None:
    case = data / "data/gap_cases/case_6"
    fit = t2s.identify(case / "ship.toml", case / "zigzag20_20.csv", holdout=case / "turn35_port.csv", members=3)
    jsonschema.validate(json.loads(fit.to_json()), t2s.json_schema("identify"))
    gap = t2s.find_gap(case / "ship.toml", case / "zigzag20_20.csv", effects=["wind"], max_effects=1)
    jsonschema.validate(json.loads(gap.to_json(files=["gap.json"])), t2s.json_schema("gap"))


def test_what_is_not_such_a_result_does_not_hold(result) -> None:
    run = result("simulate a short run")
    wrong = []
    for change in ({"advance_ft": 3.0}, {"figures": 3.0}, {"schema": "tank2sim/stability/1"}, {"notices": None}):
        wrong.append(copy.deepcopy(run) | change)
    wrong += [{key: value for key, value in run.items() if key != left_out} for left_out in ("figures", "schema")]
    assert holds(run, "simulate") and not any(holds(one, "simulate") for one in wrong)


def test_report_refuses_a_schema_that_is_not_known_or_that_the_keys_contradict(result) -> None:
    for schema, place in (("tank2sim/tow/1", "tows"), ("tank2sim/simulate/99", "schema"), ("other", "schema")):
        with pytest.raises(t2s.InputError) as raised:
            read_result(result("simulate") | {"schema": schema}, "r.json")
        assert raised.value.place == place


def test_every_result_has_a_schema() -> None:
    for name in t2s.__all__:
        getattr(t2s, name)
    assert commands() - {"report"} == set(commands_with_results())
