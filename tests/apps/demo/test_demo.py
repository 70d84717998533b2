"""The demo from end to end, twice, and stopped half-way."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import jsonschema
import pytest

import tank2sim as t2s
from tank2sim.apps.demo import DEMO_STEPS, PAGE
from tank2sim.apps.demo.result import DemoResult, DemoStudy
from tank2sim.apps.demo.run import write_demo

pytestmark = pytest.mark.slow  # the whole way, which the README's first command goes too


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict, list[str]]:
    folder = tmp_path_factory.mktemp("demo")
    reported: list[str] = []
    found = t2s.run_demo(folder, report=reported.append)
    return folder, found.to_dict(), reported


def test_it_tells_each_of_its_steps(demo) -> None:
    assert len(demo[2]) == DEMO_STEPS


def test_it_writes_what_it_lists_and_nothing_else(demo) -> None:
    folder, result, _ = demo
    assert {path.name for path in folder.iterdir()} == set(result["files"])
    assert sum(name.endswith(".fmu") for name in result["files"]) == 6
    for name in result["files"]:
        if name.endswith(".fmu"):
            assert zipfile.ZipFile(folder / name).testzip() is None


def test_every_fmu_passed_in_both_kinds(demo) -> None:
    checks = [*demo[1]["mariner"]["checks"], *demo[1]["towed_vehicle"]["checks"]]
    assert len(checks) == 6
    assert sorted((check["fmi"], kind) for check in checks for kind in check["errors"]) == sorted(
        [(fmi, kind) for fmi in (2, 3) for kind in ("CoSimulation", "ModelExchange")] * 3
    )
    for check in checks:
        assert check["passed"] and not check["validation"]
        assert max(check["errors"]["CoSimulation"].values()) <= 1e-9
        assert max(check["errors"]["ModelExchange"].values()) <= 1e-6


def test_the_fmu_follows_the_measured_tows(demo) -> None:
    """The readings of the five tows scatter by some 0.005 m/s; the model's known misfit is at most 0.014 m/s."""
    tows = demo[1]["towed_vehicle"]["tows"]
    assert len(tows) == 5
    assert all(tow["rms_mps"] < 0.008 and tow["largest_mps"] < 0.015 for tow in tows)


def as_result(folder: Path, values: dict) -> DemoResult:
    return DemoResult(DemoStudy(values["towed_vehicle"], values["mariner"], tuple(values["files"])), folder)


def test_the_result_follows_its_schema(demo) -> None:
    jsonschema.validate(json.loads(as_result(demo[0], demo[1]).to_json()), t2s.json_schema("demo"))


def test_the_result_is_json_and_the_page_is_there(demo) -> None:
    folder, result, _ = demo
    assert json.loads(json.dumps(result))["mariner"]["stability"]["third order"]["stability_criterion"]["stable"]
    page = (folder / PAGE).read_text(encoding="utf-8")
    assert "20/20 zigzag" in page and page.rstrip().endswith("</html>")


def test_the_result_has_the_page_and_fits_a_screen(demo) -> None:
    folder, values, _ = demo
    found = as_result(folder, values)
    assert found.page() == (folder / PAGE).read_text(encoding="utf-8") and len(repr(found).splitlines()) <= 24
    assert values["schema"] == "tank2sim/demo/1" and found.path == folder / PAGE


@pytest.mark.long
def test_a_second_run_gives_the_same_files_to_the_bit(demo, tmp_path) -> None:
    folder, result, _ = demo
    write_demo(tmp_path, lambda _: None)
    for name in result["files"]:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name


def test_stopped_half_way_it_leaves_no_half_written_file(demo, tmp_path) -> None:
    folder, _, reported = demo

    def stop(words: str) -> None:
        if words == reported[4]:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_demo(tmp_path, stop)
    left = list(tmp_path.iterdir())
    assert left
    for path in left:
        assert path.read_bytes() == (folder / path.name).read_bytes(), path.name
