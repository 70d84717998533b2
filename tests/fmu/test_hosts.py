"""FMUs in programs that are stricter than FMI: few variables, and each condition of a host turned by an FMU."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.api.fmu import make_fmu_file
from tank2sim.bundled import bundled_cards
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.errors import InputError
from tank2sim.fmu.hosts import Host, host_conditions, lean_model
from tank2sim.fmu.interface import interface
from tank2sim.fmu.manoeuvre import InputSequence, manoeuvre
from tank2sim.fmu.platforms import PLATFORMS, named_platforms
from tank2sim.fmu.running import replay
from tests.cli.command_line import tank2sim
from tests.fmu.driving import ShipFmu

DESCRIPTION = "modelDescription.xml"
OSP_FILE = "extra/com.open-simulation-platform/OspModelDescription.xml"


@pytest.fixture(scope="module")
def lean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The lean FMU of the Mariner with an empty library for Windows, and the files of OSP next to it."""
    folder = tmp_path_factory.mktemp("lean")
    ship = t2s.load("mariner")
    made = make_fmu_file(ship, folder / "mariner.fmu", lean=True, osp=True)
    for path, content in made.files.items():
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with zipfile.ZipFile(folder / "mariner.fmu", "a") as archive:
        archive.writestr("binaries/win64/mariner.dll", b"")
    return folder / "mariner.fmu"


def unmet(path: Path, host: Host) -> list[str]:
    return [one.condition for one in host_conditions(path, host) if not one.met]


@pytest.mark.parametrize("host", ["unity", "unreal", "osp"])
def test_a_lean_fmu_meets_every_condition(host: Host, lean: Path) -> None:
    conditions = host_conditions(lean, host)
    assert len(conditions) == {"unity": 9, "unreal": 13, "osp": 5}[host]
    assert unmet(lean, host) == []


Edit = Callable[[str], str]


def replaced(old: str, new: str) -> Edit:
    def edit(text: str) -> str:
        assert re.search(old, text)
        return re.sub(old, new, text)

    return edit


def edited(path: Path, folder: Path, edit: Edit, *, entry: str = DESCRIPTION, name: str = "mariner.fmu") -> Path:
    """A copy of an FMU with an edited text, or without an entry for which the edit has none."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(folder / name, "w") as new:
        for each in old.namelist():
            content = old.read(each)
            if each == entry:
                content = edit(content.decode()).encode()
            if content or each != entry:
                new.writestr(each, content)
    beside = path.with_name("mariner_OspModelDescription.xml")
    (folder / beside.name).write_bytes(beside.read_bytes())
    return folder / name


MANY = "".join(
    f'<ScalarVariable name="more.v{k}" valueReference="{900 + k}"><Real/></ScalarVariable>' for k in range(80)
)

BROKEN: list[tuple[str, str, Edit]] = [
    ("unity unreal osp", "fmi_2_co_simulation", replaced('fmiVersion="2.0"', 'fmiVersion="3.0"')),
    ("unity unreal", "model_name file_name", replaced('modelName="mariner"', 'modelName="Mariner class"')),
    ("unity unreal", "model_name file_name", replaced('modelName="mariner"', f'modelName="{"m" * 61}"')),
    ("unity unreal osp", "model_name windows_library library_of_the_engine",
     replaced('modelIdentifier="mariner"', 'modelIdentifier="other"')),
    ("unity unreal", "no_resources", replaced('generationTool="tank2sim [^"]*"', 'generationTool="another"')),
    ("unity", "memory_callbacks", replaced('canNotUseMemoryManagementFunctions="true"', "")),
    ("unity unreal", "few_variables", replaced("</ModelVariables>", f"{MANY}</ModelVariables>")),
    ("unity unreal", "ascii_description", replaced('description="Mariner', 'description="Märiner')),
    ("unity unreal", "ascii_description", replaced('description="Heading', 'description="Heading °')),
    ("unity unreal", "names_without_case", replaced('name="motion.xdot"', 'name="motion.X"')),
    ("unreal", "default_experiment", replaced('stopTime="3600.0"', 'stopTime="600.0"')),
    ("unreal", "default_experiment", replaced(' stepSize="0.1"', "")),
    ("unreal", "default_experiment", replaced('startTime="0.0" ', "")),
    ("unreal", "default_experiment", replaced("<DefaultExperiment [^>]*/>", "")),
    ("unreal", "start_near_zero", replaced(r'(name="initial.x".*\n.*) start="0.0"', r'\1 start="-2e5"')),
    ("unreal", "real_inputs", replaced(r'(name="rudder.command".*\n) *<Real.*/>', r"\1 <Boolean/>")),
    ("osp", "structured_names", replaced('variableNamingConvention="structured"', "")),
    ("osp", "variable_groups", replaced('name="rudder.command"', 'name="rudder.order"')),
]  # fmt: skip


@pytest.mark.parametrize(("hosts", "broken", "edit"), BROKEN, ids=lambda value: value if isinstance(value, str) else "")
def test_an_fmu_that_is_broken_fails_the_condition_that_it_breaks(
    hosts: str, broken: str, edit: Edit, lean: Path, tmp_path: Path
) -> None:
    path = edited(lean, tmp_path, edit)
    for host in ("unity", "unreal", "osp"):
        known = {one.condition for one in host_conditions(lean, host)}
        expected = set(broken.split()) & known if host in hosts.split() else set()
        found = set(unmet(path, host)) - ({"groups_next_to_it"} if "model_name" in broken else set())
        assert found == expected, host


def test_files_that_are_missing_or_too_many_fail_their_condition(lean: Path, tmp_path: Path) -> None:
    def gone(_: str) -> str:
        return ""

    renamed = edited(lean, tmp_path, str, name="my ship.fmu")
    assert unmet(renamed, "unreal") == ["file_name", "no_blank_in_path"]
    assert unmet(edited(lean, tmp_path, gone, entry=OSP_FILE), "osp") == ["variable_groups"]
    without = edited(lean, tmp_path, gone, entry="binaries/win64/mariner.dll")
    assert unmet(without, "unity") == ["windows_library"]
    (tmp_path / "mariner_OspModelDescription.xml").unlink()
    assert unmet(without, "osp") == ["groups_next_to_it"]
    with zipfile.ZipFile(without, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("resources/table.csv", b"0" * 6_000_000)
    assert unmet(without, "unreal") == ["windows_library", "no_resources", "small_file"]


def test_the_usual_fmu_has_more_than_a_game_engine_takes(mariner_fmu: ShipFmu) -> None:
    assert {"few_variables", "real_inputs"} <= set(unmet(mariner_fmu(2), "unreal"))
    assert not {"names_without_case", "model_name", "file_name", "default_experiment"} & set(
        unmet(mariner_fmu(2), "unreal")
    )


def test_what_is_no_fmu_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.fmu").write_text("no archive")
    with pytest.raises(InputError, match="is not an FMU"):
        host_conditions(tmp_path / "x.fmu", "unity")


@pytest.mark.parametrize("card", sorted(bundled_cards()))
def test_a_lean_model_has_at_most_forty_variables_all_real_and_apart_without_case(card: str) -> None:
    whole = with_simulator_interface(t2s.load(card).model)
    model = lean_model(whole)
    variables = [one for one in interface(model).variables if one.causality != "independent"]
    assert len(variables) <= 42 and not any(one.boolean for one in model.inputs)
    assert set(model.state_names) >= set(model.outputs) - {"motion.speed", "motion.heading", "validity"} - {
        "propeller.speed_actual"
    }
    for described in (interface(model), interface(whole)):
        names = [one.name.lower() for one in described.variables]
        assert len(names) == len(set(names))


def test_no_effect_has_names_that_differ_by_case_alone() -> None:
    names = {name for effect in EFFECTS.values() for name in effect.model_names().values()}
    names |= {one.name for one in with_simulator_interface(t2s.load("container").model).variables}
    assert len({name.lower() for name in names}) == len(names)


def test_a_lean_fmu_sails_as_the_whole_one(lean: Path, mariner: Model, mariner_fmu: ShipFmu) -> None:
    small = lean_model(mariner)
    assert small.input_names == ("rudder.command",)
    assert small.parameter_names == ("initial.x", "initial.y", "initial.psi", "initial.u")
    assert set(small.outputs) == {*small.state_names, "motion.speed", "motion.heading", "validity"}
    run = manoeuvre(small)
    found = replay(lean, run, small)
    inputs = np.zeros((len(run.inputs), len(mariner.inputs)))
    inputs[:, mariner.input_names.index("rudder.command")] = run.inputs[:, 0]
    expected = replay(mariner_fmu(2), InputSequence(run.times, inputs), mariner)
    assert np.ptp(found["motion.psi"]) > 0.2
    for name in small.outputs:
        assert found[name] == pytest.approx(expected[name], rel=1e-11, abs=1e-11)


def test_check_fails_an_fmu_that_a_host_does_not_take(lean: Path, tmp_path: Path) -> None:
    other = edited(lean, tmp_path, str, name="other.fmu")
    done = tank2sim("check", other.name, "--for", "unreal", "--json", "a.json", cwd=tmp_path)
    assert done.returncode == 1 and "file_name" in done.stdout
    study = json.loads((tmp_path / "a.json").read_text())
    assert study["host"] == "unreal" and study["compared"] and not study["passed"]
    assert study["max_error"].keys() >= {"motion.heading", "rudder.angle"} and not study["differences"]
    assert [one["condition"] for one in study["conditions"] if not one["met"]] == ["file_name"]


@pytest.mark.slow
@pytest.mark.parametrize("host", ["unity", "unreal", "osp"])
def test_check_passes_a_lean_fmu_that_a_host_takes(host: str, lean: Path) -> None:
    done = tank2sim("check", lean.name, "--for", host, cwd=lean.parent)
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_check_knows_a_lean_fmu_without_sources(tmp_path: Path) -> None:
    made = tank2sim("export", "mariner", "-o", "a.fmu", "--lean", "--no-sources", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    done = tank2sim("check", "a.fmu", "--card", "mariner", cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_export_names_the_model_where_a_game_engine_would_look_for_the_file(tmp_path: Path) -> None:
    ship = t2s.load("mariner")
    for file, said in (("mariner.fmu", ()), ("my ship.fmu", ("my_ship",))):
        notices = [str(one) for one in make_fmu_file(ship, tmp_path / file, lean=True).study.notices]
        found = [text for text in notices if "modelName" in text]
        assert len(found) == len(said) and all(name in text for name, text in zip(said, found, strict=True))


def test_lean_has_nothing_to_design_an_autopilot_with(tmp_path: Path) -> None:
    done = tank2sim("export", "mariner", "-o", "a.fmu", "--lean", "--ssp", "a.ssp", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.startswith("tank2sim: --lean") and not list(tmp_path.iterdir())


def test_all_platforms_are_with_windows() -> None:
    assert named_platforms("all") == PLATFORMS and "win64" in {one.fmi2 for one in PLATFORMS}


def test_export_writes_the_ship_as_c_next_to_the_fmu(tmp_path: Path) -> None:
    done = tank2sim("export", "mariner", "-o", "a.fmu", "--lean", "--c", "c", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "c").iterdir()} == {"ship.h", "ship.c", "self_test.c", "README.md"}
    assert (tmp_path / "c" / "README.md").read_text().startswith("# Mariner class: C99\n\n")
