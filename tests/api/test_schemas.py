"""The JSON of results follows its schema, and a wrong key, type or command does not."""

from __future__ import annotations

import copy
import json

import jsonschema
import pytest

import tank2sim as t2s
from tank2sim.api.result import Result
from tank2sim.api.schemas import KEYS
from tank2sim.report.results.result_types import kind_of


def commands(kind: type[Result] = Result) -> set[str]:
    return {kind.command} if "command" in vars(kind) else set().union(*map(commands, kind.__subclasses__()))


def holds(result: dict[str, object], command: str) -> bool:
    return jsonschema.Draft202012Validator(t2s.json_schema(command)).is_valid(result)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, object]]:
    ship = t2s.load("mariner")
    made = ship.to_fmu(tmp_path_factory.mktemp("fmu") / "m.fmu", fmi=2)
    found = [
        ship.zigzag(20, 20, members=3),
        ship.turn(35, duration_s=20.0),
        t2s.load("kvlcc2").stability(members=3),
        ship.stability(5.0, spirals=False),
        made,
        t2s.check_fmu(made.path),
    ]
    return {f"{place} {result.command}": json.loads(result.to_json()) for place, result in enumerate(found)}


def test_results_follow_their_schemas(results) -> None:
    for name, result in results.items():
        jsonschema.validate(result, t2s.json_schema(name.split()[1]))


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


def test_what_is_no_such_result_does_not_hold(results) -> None:
    run = results["0 simulate"]
    wrong = []
    for change in ({"advance_ft": 3.0}, {"figures": 3.0}, {"schema": "tank2sim/stability/1"}, {"notices": None}):
        wrong.append(copy.deepcopy(run) | change)
    wrong += [{key: value for key, value in run.items() if key != left_out} for left_out in ("figures", "schema")]
    assert holds(run, "simulate") and not any(holds(one, "simulate") for one in wrong)


def test_report_finds_a_result_by_its_schema(results) -> None:
    for name, result in results.items():
        assert kind_of(result, "r.json").commands.split()[0] == name.split()[1]
        without = {key: value for key, value in result.items() if key != "schema"}
        assert kind_of(without, "r.json").commands.split()[0] == name.split()[1]


def test_report_refuses_a_schema_that_is_not_known_or_that_the_keys_contradict(results) -> None:
    for schema, place in (("tank2sim/stability/1", ""), ("tank2sim/simulate/99", "schema"), ("other", "schema")):
        with pytest.raises(t2s.InputError) as raised:
            kind_of(results["0 simulate"] | {"schema": schema}, "r.json")
        assert raised.value.place == place


def test_every_result_has_a_schema() -> None:
    for name in t2s.__all__:
        getattr(t2s, name)
    assert commands() - {"report"} == set(KEYS)
