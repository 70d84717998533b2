"""Effects, trial readers and structures of other packages: a package that is installed apart, and faulty ones."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import tomllib
import warnings
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import Distribution, EntryPoint
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from tank2sim import plugins
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import Effect, EffectParameter
from tank2sim.errors import InputError
from tank2sim.plugins import PluginWarning, Registry
from tank2sim.records import reading
from tank2sim.records.trials import Trial, TrialReader, fault_of
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

from .cli.command_line import refused
from .conftest import ROOT
from .dynamics.effects.ships import RHO, U0, L, mariner_text

EXAMPLE = ROOT / "docs" / "examples" / "plugin"
FORCE, LEVER, HALF_SPEED = 5e-4, 0.4, 4.0
THRUSTER = f'\n[[effects]]\nname = "bow_thruster"\n[effects.parameters]\nforce_prime = {FORCE}\n'
KNOT = 1852 / 3600
NOISE = {"psi_deg": 0.05, "r_degps": 0.005, "u_mps": 0.02, "v_mps": 0.02}


def install(package: Path, folder: Path) -> Path:
    """Put a package into a folder as an installer does: its modules, and what its metadata say of entry points."""
    project = tomllib.loads((package / "pyproject.toml").read_text())["project"]
    shutil.copytree(package, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("pyproject.toml", "__pycache__"))
    described = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    described.mkdir()
    (described / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {place}" for name, place in entries.items()))
    ]
    (described / "entry_points.txt").write_text("\n".join(lines) + "\n")
    return folder


def python(site: Path, code: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """A fresh interpreter that finds what is installed in `site`."""
    command = [sys.executable, "-c", code, *arguments]
    environment = os.environ | {"PYTHONPATH": str(site)}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


CALLS = """
import json, pathlib, sys
sys.path.append(sys.argv[2])
from tests.cli.command_line import tank2sim
results = [tank2sim(*words, cwd=pathlib.Path()) for words in json.loads(sys.argv[1])]
print(json.dumps([(result.returncode, result.stdout, result.stderr) for result in results]))
"""


def tank2sim(site: Path, *calls: str, cwd: Path) -> list[subprocess.CompletedProcess[str]]:
    """Commands in one fresh interpreter, each as it would be typed."""
    words = [call.split() for call in calls]
    output = done(python(site, CALLS, json.dumps(words), str(ROOT), cwd=cwd))
    return [subprocess.CompletedProcess(call, *result) for call, result in zip(calls, json.loads(output), strict=True)]


def done(result: subprocess.CompletedProcess[str]) -> str:
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(EXAMPLE, tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="module")
def work(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the Mariner, the Mariner with the thruster, and a zigzag of the latter."""
    folder = tmp_path_factory.mktemp("work")
    (folder / "mariner.toml").write_text(mariner_text())
    (folder / "thruster.toml").write_text(mariner_text() + THRUSTER)
    command = "simulate thruster.toml --manoeuvre zigzag:20/20 --duration 400 -o zz.csv"
    done(*tank2sim(site, command, cwd=folder))
    return folder


def columns(path: Path) -> dict[str, np.ndarray]:
    text = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    values = np.array([[float(cell) for cell in line.split(",")] for line in text[1:]])
    return dict(zip(text[0].split(","), values.T, strict=True))


def measured(path: Path) -> dict[str, np.ndarray]:
    """A record each 2 s with the noise of sensors."""
    found = {name: values[::20] for name, values in columns(path).items()}
    assert found["t_s"][1] == pytest.approx(2.0)
    noise = np.random.default_rng(2)
    return {name: values + NOISE.get(name, 0.0) * noise.standard_normal(len(values)) for name, values in found.items()}


def test_the_effect_of_a_package_has_the_force_of_its_equation(site: Path, work: Path) -> None:
    code = """
import json, casadi as ca
from tank2sim.cards import read_card
from tank2sim.dynamics import build
found = []
for name in ("mariner.toml", "thruster.toml"):
    model = build(read_card(name))
    wanted = model.expand(ca.vcat([model.symbol(name) for name in ("force.X", "force.Y", "force.N")]))
    x = [3.0 if state == "motion.u" else 0.0 for state in model.state_names]
    force = ca.Function("force", [model.x, model.u, model.p], [wanted])
    found.append(force(x, model.input_values(), model.parameter_values()).full().ravel().tolist())
print(json.dumps(found))
"""
    without, pushed = np.array(json.loads(done(python(site, code, cwd=work))))
    force = 0.5 * RHO * L**2 * U0**2 * FORCE / (1 + (3.0 / HALF_SPEED) ** 2)
    np.testing.assert_allclose(pushed - without, [0, force, LEVER * L * force], rtol=1e-9, atol=1e-6)


@pytest.mark.essential
@pytest.mark.slow
def test_it_simulates_and_its_fmu_does_the_same_without_the_package(site: Path, work: Path) -> None:
    bare = simulate(
        build(parse_card(mariner_text(), "mariner.toml")), Zigzag(math.radians(20), math.radians(20)), duration_s=400
    )
    run = columns(work / "zz.csv")
    assert np.ptp(run["psi_deg"] - np.degrees(bare.trajectory["motion.psi"])) > 1.0, "the thruster does nothing"
    exported, checked = tank2sim(
        site, "export thruster.toml -o thruster.fmu --fmi 3", "check thruster.fmu --json check.json", cwd=work
    )
    done(exported)
    done(checked)
    assert "tank2sim_example" not in sys.modules
    with zipfile.ZipFile(work / "thruster.fmu") as archive:
        passport = archive.read("documentation/passport.html").decode()
    assert "equation of the effect bow_thruster (tank2sim-example 1.0): after Brix" in passport
    orders = np.array(
        list(zip(run["t_s"], np.radians(run["delta_order_deg"]), strict=True)),
        dtype=[("time", float), ("rudder.command", float)],
    )
    wanted = {"motion.psi": np.radians(run["psi_deg"]), "motion.u": run["u_mps"], "motion.v": run["v_mps"]}
    found = simulate_fmu(
        str(work / "thruster.fmu"), stop_time=400.0, output_interval=0.1, input=orders, output=list(wanted)
    )
    for name, expected in wanted.items():
        error = np.abs(np.interp(run["t_s"], found["time"], found[name]) - expected).max()
        assert error < 0.01 * np.ptp(expected), name


def test_the_input_of_an_effect_moves_the_fmu_and_has_its_terminal(site: Path, work: Path) -> None:
    code = """
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.fmu.interface import interface
from tank2sim.fmu.export import terminals
model = build(read_card("thruster.toml"))
(terminal,) = [each for each in terminals(interface(model)) if each.name == "bow_thruster"]
print(terminal.description, undisturbed_inputs(model))
"""
    assert done(python(site, code, cwd=work)).strip() == "Bow thruster {'bow_thruster.force': 0.0}"


WRONG = {
    "force_prime = 0.02": ("effects.0.parameters.force_prime", "is 0.02", "-0.01 to 0.01"),
    "lever = 0.4": ("effects.0.parameters.force_prime", "is missing"),
    "force_prime = 1e-4\npower = 3": ("effects.0.parameters.power", "force_prime, lever, half_speed_mps"),
}


def test_its_parameters_are_validated_with_file_and_place(site: Path, tmp_path: Path) -> None:
    for number, line in enumerate(WRONG):
        text = mariner_text() + f'\n[[effects]]\nname = "bow_thruster"\n[effects.parameters]\n{line}\n'
        (tmp_path / f"wrong_{number}.toml").write_text(text)
    calls = [f"simulate wrong_{number}.toml --manoeuvre turn:20" for number in range(len(WRONG))]
    results = tank2sim(site, *calls, cwd=tmp_path)
    for number, (result, words) in enumerate(zip(results, WRONG.values(), strict=True)):
        refused(result, f"wrong_{number}.toml", *words)


@pytest.mark.slow
def test_the_page_of_effects_has_it(site: Path, work: Path) -> None:
    pytest.importorskip("sphinx", reason="Sphinx is not installed (extra docs)")
    code = f"import sys; sys.path.insert(0, {str(ROOT / 'docs')!r}); import generated; print(generated.effects())"
    page = done(python(site, code, cwd=work))
    section = page.partition("### `bow_thruster`")[2]
    assert "## From installed packages" in page and "From the package tank2sim-example 1.0." in section
    assert "| `half_speed_mps` | m/s | 0.1 to 20 | 4 | speed at which half of the force is left |" in section
    assert "(input `bow_thruster.force`)" in section


@pytest.mark.slow
def test_gap_offers_it_as_a_candidate(site: Path, work: Path) -> None:
    code = """
from tank2sim.cards import read_card
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.prior import candidate_explanations
card = read_card("mariner.toml")
print(*candidate_explanations(card, "angle"))
estimated = Hypothesis(card, "angle", ["bow_thruster"]).estimated
print([(estimate.variable, estimate.parameter.name) for estimate in estimated])
"""
    offered, asked = done(python(site, code, cwd=work)).splitlines()
    assert "bow_thruster" in offered.split()
    assert asked == "[('bow_thruster.force', 'force_prime')]"


@pytest.mark.slow
def test_gap_finds_it_and_adds_it_to_the_card(site: Path, work: Path) -> None:
    record = measured(work / "zz.csv")
    names = ["t_s", "delta_deg", *NOISE]
    rows = np.column_stack([record[name] for name in names])
    np.savetxt(work / "trial.csv", rows, fmt="%.6f", delimiter=",", header=",".join(names), comments="")
    done(*tank2sim(site, "gap mariner.toml trial.csv --max-effects 1 -o found", cwd=work))
    found = json.loads((work / "found" / "gap.json").read_text())
    assert [effect["name"] for effect in found["effects"]] == ["bow_thruster"]
    improved = tomllib.loads((work / "found" / "improved.toml").read_text())
    value = improved["effects"][0]["parameters"]["force_prime"]
    assert value == pytest.approx(FORCE, abs=4 * improved["effects"][0]["uncertainty"]["force_prime"])


def write_log(path: Path, record: Mapping[str, np.ndarray]) -> None:
    order = {"t_s": 1.0, "psi_deg": 1.0, "r_degps": 60.0, "u_mps": 1 / KNOT, "v_mps": 1 / KNOT, "delta_deg": 1.0}
    rows = np.column_stack([factor * record[name] for name, factor in order.items()])
    rows[:, 1] %= 360.0
    np.savetxt(path, rows, fmt="%.6f", header="BRIDGE LOG", comments="")


@pytest.mark.slow
def test_a_log_is_read_by_the_package_and_fitted_in_its_structure(site: Path, work: Path) -> None:
    record = measured(work / "zz.csv")
    (work / "logs").mkdir()
    write_log(work / "logs" / "zz.log", record)
    (work / "logs" / "notes.log").write_text("nothing of a trial\n")
    code = """
import json
from tank2sim.records.reading import read_trial_file
trial = read_trial_file("logs/zz.log")
print(json.dumps({"t_s": trial.time_s.tolist(), **{name: column.tolist() for name, column in trial.signals.items()}}))
"""
    read = json.loads(done(python(site, code, cwd=work)))
    for name, factor in {"t_s": 1.0, "psi": math.pi / 180, "u_mps": 1.0, "v_mps": 1.0, "delta": math.pi / 180}.items():
        (signal,) = [key for key in read if key.startswith(name)]
        (given,) = [key for key in record if key in (name, f"{name}_deg")]
        np.testing.assert_allclose(read[signal], factor * record[given], atol=2e-6)
    np.testing.assert_allclose(read["r_radps"], np.radians(record["r_degps"]), atol=1e-8)
    fit = "identify mariner.toml logs --structure asymmetric --method equation_error -o better.toml"
    audited, fitted = tank2sim(site, "audit logs/zz.log", fit, cwd=work)
    assert "zz" in done(audited)
    done(fitted)
    better = tomllib.loads((work / "better.toml").read_text())
    assert "zz" in better["ship"]["source"]
    assert {"Y0", "N0", "Y0u", "N0u"} <= set(better["uncertainty"]), "the terms of the structure of the package"


@pytest.mark.slow
def test_a_fault_of_a_log_is_named_by_file_and_line(site: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.log").write_text("BRIDGE LOG\n0 0 0 15 0 0\n1 0 0 fifteen 0 0\n")
    refused(*tank2sim(site, "audit bad.log", cwd=tmp_path), "bad.log", "line 3", "ahead (kn)", "fifteen")


@pytest.mark.slow
def test_without_the_package_a_log_and_its_effect_are_refused(tmp_path: Path) -> None:
    (tmp_path / "thruster.toml").write_text(mariner_text() + THRUSTER)
    empty = tmp_path / "site"
    empty.mkdir()
    (tmp_path / "zz.log").write_text("BRIDGE LOG\n0 0 0 15 0 0\n1 0 0 15 0 0\n")
    results = tank2sim(empty, "simulate thruster.toml --manoeuvre turn:20", "audit zz.log", cwd=tmp_path)
    refused(results[0], "thruster.toml", "effects.0.name", "'bow_thruster'")
    refused(results[1], "zz.log")


# -- faulty packages -----------------------------------------------------------------------------------------------

FAULTY = """
from dataclasses import replace
from tank2sim.dynamics.effects.surroundings import WIND

def fail(*arguments):
    raise ValueError("not to be done\\nat all")

FAILING = replace(WIND, name="failing", equations=fail, parameters=(), measured_as={})
OTHER = replace(WIND, name="another")
ODD = replace(WIND, name="odd", acts_on="mood")
TEXT = "an effect"
"""
ENTRIES = {
    **{"absent": "faulty:NOTHING", "failing": "faulty:FAILING", "other": "faulty:OTHER", "odd": "faulty:ODD"},
    **{"text": "faulty:TEXT", "wind": "faulty:WIND", "lost": "no_such_module:EFFECT"},
}


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    package, folder = (tmp_path_factory.mktemp(name) for name in ("faulty", "faulty_site"))
    (package / "faulty.py").write_text(FAULTY)
    entries = "".join(f'{name} = "{place}"\n' for name, place in ENTRIES.items())
    groups = f'[project.entry-points."tank2sim.effects"]\n{entries}'
    groups += '[project.entry-points."tank2sim.trial_readers"]\nlost = "no_such_module:READER"\n'
    groups += '[project.entry-points."tank2sim.structures"]\nlost = "no_such_module:STRUCTURE"\n'
    (package / "pyproject.toml").write_text(f'[project]\nname = "faulty"\nversion = "0.3"\n{groups}')
    return install(package, folder)


FAULTS = {
    "absent": ("cannot be loaded: AttributeError", "NOTHING"),
    "lost": ("cannot be loaded: ModuleNotFoundError", "no_such_module"),
    "other": ("with the name 'another'",),
    "text": ("gives a str", "Effect was expected"),
    "odd": ("acts_on is 'mood'", "propulsion"),
    "failing": ("failed: ValueError: not to be done at all",),
}


@pytest.mark.slow
def test_a_faulty_effect_is_refused_where_it_is_used(faulty: Path, tmp_path: Path) -> None:
    for name in FAULTS:
        (tmp_path / f"{name}.toml").write_text(mariner_text() + f'\n[[effects]]\nname = "{name}"\n')
    calls = [f"simulate {name}.toml --manoeuvre turn:20" for name in FAULTS]
    calls += ["gap failing.toml run.csv -o out --effects lost"]
    *results, searched = tank2sim(faulty, *calls, cwd=tmp_path)
    for result, (name, words) in zip(results, FAULTS.items(), strict=True):
        assert result.returncode == 2
        line = result.stderr.strip().splitlines()[-1]
        assert line.startswith(f"tank2sim: faulty 0.3: entry point tank2sim.effects: {name}: "), line
        assert all(word in line for word in words), line
        assert result.stderr.count(f"effects: {name}: ") == 1, "it is said twice"
    refused(searched, "entry point tank2sim.effects: lost: ", "no_such_module")


@pytest.mark.slow
def test_faulty_packages_do_not_stop_what_does_not_use_them(faulty: Path, tmp_path: Path) -> None:
    text = (
        mariner_text() + '\n[[effects]]\nname = "wind"\n[effects.parameters]\nspeed_mps = 5.0\ndirection_deg = 40.0\n'
    )
    (tmp_path / "card.toml").write_text(text)
    (tmp_path / "trials").mkdir()
    (tmp_path / "trials" / "notes.txt").write_text("not a trial\n")
    simulated, audited, folder = tank2sim(
        faulty,
        "simulate card.toml --manoeuvre turn:20 --duration 60 -o trials/run.csv",
        "audit trials/run.csv",
        "identify card.toml trials --structure linear --method equation_error",
        cwd=tmp_path,
    )
    for result in (simulated, audited, folder):
        done(result)
    assert folder.stderr.count("entry point tank2sim.trial_readers: lost: cannot be loaded") == 1
    assert folder.stderr.count("entry point tank2sim.structures: lost: cannot be loaded") == 1
    assert all(line.startswith("tank2sim: warning: faulty 0.3: ") for line in folder.stderr.splitlines())
    listed = python(faulty, "from tank2sim.dynamics.effects import EFFECTS; print(*EFFECTS, *EFFECTS)", cwd=tmp_path)
    names = done(listed).split()
    assert names.count("failing") == names.count("wind") == 2
    assert not {"absent", "lost", "other", "text", "odd"} & set(names)
    for name in set(ENTRIES) - {"failing"}:
        assert listed.stderr.count(f"entry point tank2sim.effects: {name}: ") == 1, name
    assert "tank2sim.effects: wind: its name is built in" in listed.stderr


@pytest.mark.slow
def test_a_structure_that_cannot_be_loaded_is_refused_by_its_name(faulty: Path, tmp_path: Path) -> None:
    (tmp_path / "card.toml").write_text(mariner_text())
    rows = "".join(f"{t},10,7.7,0,{0.2 * t},{0.1 * t * t}\n" for t in range(200))
    (tmp_path / "run.csv").write_text(f"t_s,delta_deg,u_mps,v_mps,r_degps,psi_deg\n{rows}")
    (result,) = tank2sim(faulty, "identify card.toml run.csv --structure lost", cwd=tmp_path)
    assert result.returncode == 2
    assert "faulty 0.3: entry point tank2sim.structures: lost: cannot be loaded" in result.stderr.splitlines()[-1]


# -- the registry --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Thing:
    name: str
    value: int = 0


def misread(path: Path) -> Trial:
    time = np.arange(3.0)
    return Trial(path, time, {"delta_rad": time, "u_mps": time, "speed_over_water": time})


def broken(text: str) -> bool:
    raise KeyError(text)


MISREADING = TrialReader("misreading", "a format", (".xyz",), lambda text: text.startswith("XYZ"), misread)
BROKEN = TrialReader("broken", "another format", (".abc",), broken, misread)
LATE = Thing("late", 3)
NOT_LATE = Thing("other")


class Package(Distribution):
    """A package in memory."""

    def __init__(self, name: str):
        self._name = name

    def read_text(self, filename: str) -> str | None:
        return f"Name: {self._name}\nVersion: 1\n" if filename == "METADATA" else None

    def locate_file(self, path: object) -> Path:
        return Path()


def entries(monkeypatch: pytest.MonkeyPatch, *given: tuple[str, str, str]) -> list[str]:
    """Entry points (package, name, place) in place of those that are installed; the groups that were asked for."""
    asked: list[str] = []

    def found(group: str) -> Iterable[EntryPoint]:
        asked.append(group)
        for package, name, place in given:
            entry = EntryPoint(name, place, group)
            vars(entry).update(dist=Package(package))
            yield entry

    monkeypatch.setattr(plugins, "entry_points", found)
    return asked


def test_packages_are_asked_for_only_when_they_are_needed_and_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = entries(monkeypatch, ("one", "late", f"{__name__}:LATE"))
    registry = Registry("things", (Thing("built_in"),), Thing)
    assert registry["built_in"] == Thing("built_in") and "built_in" in registry and not asked
    assert registry["late"] == LATE and list(registry) == ["built_in", "late"] and len(registry) == 2
    assert "late" in registry and "nothing" not in registry and registry.get("nothing") is None
    assert asked == ["things"]
    assert registry.origin("built_in") is None
    origin = registry.origin("late")
    assert origin is not None and origin.distribution == "one 1" and origin.place == "entry point things: late"


def test_two_packages_with_one_name_are_both_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    place = f"{__name__}:LATE"
    entries(monkeypatch, ("one", "late", place), ("two", "late", place), ("one", "late", place))
    registry = Registry("things", (), Thing)
    with pytest.warns(PluginWarning, match="one 1 has an entry point of this name, too"):
        assert list(registry) == []
    with pytest.raises(InputError) as refusal:
        registry["late"]
    assert (refusal.value.source, refusal.value.place) == ("two 1", "entry point things: late")


def test_reserved_names_are_refused_and_listed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    entries(monkeypatch, ("one", "auto", f"{__name__}:LATE"), ("one", "late", f"{__name__}:NOT_LATE"))
    registry = Registry("things", (Thing("built_in"),), Thing, reserved=("auto",))
    with pytest.warns(PluginWarning) as warned:
        assert list(registry) == ["built_in"] and list(registry) == ["built_in"]
    assert len(warned) == 2, "each is said once"
    assert registry.names() == ("built_in", "late")


def test_a_package_does_not_take_the_name_of_an_app(monkeypatch: pytest.MonkeyPatch) -> None:
    app, other = "tank2sim.errors:InputError", f"{__name__}:LATE"
    entries(monkeypatch, ("one", "late", other), ("tank2sim", "late", app))
    registry = Registry("things", (), Thing)
    with pytest.warns(PluginWarning, match="one 1: entry point things: late: its name is built in"):
        assert list(registry) == ["late"] and "late" in registry and registry.names() == ("late",)
    assert registry["late"] is InputError and registry.origin("late") is None


def test_who_asks_for_a_faulty_one_is_not_warned_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    entries(monkeypatch, ("one", "late", f"{__name__}:NOT_LATE"))
    with warnings.catch_warnings(), pytest.raises(InputError, match="with the name 'other'"):
        warnings.simplefilter("error")
        Registry("things", (), Thing)["late"]


def test_a_reader_that_fails_names_its_package_and_does_not_stop_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    places = {"misreading": "MISREADING", "broken": "BROKEN"}
    entries(monkeypatch, *(("readers", name, f"{__name__}:{place}") for name, place in places.items()))
    registry = Registry(
        "tank2sim.trial_readers", [reading.READERS[name] for name in ("trial_csv", "esso_osaka", "simman")], TrialReader
    )
    monkeypatch.setattr(reading, "READERS", registry)
    (tmp_path / "a.xyz").write_text("XYZ\n")
    with pytest.raises(InputError) as refusal:
        reading.read_trial_file(tmp_path / "a.xyz")
    assert (refusal.value.source, refusal.value.place) == (
        "readers 1",
        "entry point tank2sim.trial_readers: misreading",
    )
    assert "a.xyz: speed_over_water is not a signal of a trial" in refusal.value.problem
    (tmp_path / "a.csv").write_text("time\n1\n")
    with pytest.warns(PluginWarning, match="readers 1: entry point .*: broken: failed: KeyError"):
        assert reading.reader_of(tmp_path / "a.csv").name == "trial_csv"


TIME = np.arange(4.0)


@pytest.mark.parametrize(
    ("signals", "fault"),
    [
        ({"delta_rad": TIME, "u_mps": TIME}, ""),
        ({"delta_rad": TIME, "u_mps": TIME[:3]}, "u_mps is not an array of floats with one value for each of the 4"),
        ({"delta_rad": TIME.astype(int), "u_mps": TIME}, "delta_rad is not an array of floats"),
        ({"delta_rad": TIME}, "at least one measured signal"),
        ({"r_radps": TIME}, "it needs a rudder (delta_rad or delta_order_rad)"),
    ],
)
def test_a_trial_of_a_package_is_as_the_format_says(signals: dict[str, np.ndarray], fault: str) -> None:
    found = fault_of(Trial(Path("a.xyz"), TIME, signals))
    assert fault in found and bool(found) == bool(fault)


def test_an_effect_cannot_take_a_variable_of_the_model() -> None:
    card = parse_card(mariner_text(), "ship.toml")
    order = EffectParameter("order_rad", "another rudder order", -1.0, 1.0, input_name="rudder.command")
    effect = Effect("second_rudder", "force", "A second rudder.", "none", (order,))
    with pytest.raises(
        InputError, match=r"ship\.toml.*second_rudder adds rudder\.command, which the model has already"
    ):
        effect.apply(build(card), {"order_rad": 0.1}, card)


# -- commands, kinds of cards, readers of logs ---------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.essential
def test_a_command_of_a_package_has_help_page_json_and_schema(site: Path, work: Path) -> None:
    listed, helped, ran, read, bad = tank2sim(
        site,
        "--help",
        "turns --help",
        "turns mariner.toml --rudder -20 35 --json turns.json --page turns.html --plot turns.png",
        "report turns.json -o again.html",
        "turns mariner.toml --rudder 400",
        cwd=work,
    )
    assert "turns" in done(listed) and "tactical diameters over rudder angles" in listed.stdout
    assert "--rudder" in done(helped) and "--json" in helped.stdout
    done(ran)
    done(read)
    found = json.loads((work / "turns.json").read_text())
    own = simulate(build(parse_card(mariner_text(), "ship.toml")), Turn(math.radians(35))).figures
    assert found["schema"] == "tank2sim/turns/1" and [turn["rudder_deg"] for turn in found["turns"]] == [-20, 35]
    assert found["turns"][1]["tactical_diameter_m"] == pytest.approx(own["tactical_diameter_m"], rel=1e-6)
    assert "Tightest turn" in (work / "again.html").read_text() and (work / "turns.png").stat().st_size > 5000
    refused(bad, "--rudder", "400")
    code = "import tank2sim as t2s, json; print(json.dumps(t2s.json_schema('turns')))"
    assert "turns" in json.loads(done(python(site, code, cwd=work)))["properties"]


@pytest.mark.slow
@pytest.mark.essential
def test_a_variant_of_a_package_is_a_flag_of_a_command_of_the_core(site: Path, work: Path) -> None:
    """Pivot point: v + x r = 0 in the steady turn."""
    helped, ran, plain, read, idle = tank2sim(
        site,
        "stability --help",
        "stability mariner.toml --pivot --rudder -20 --json pivot.json",
        "stability mariner.toml --no-spirals --json plain.json",
        "report pivot.json -o pivot.html",
        "stability mariner.toml --rudder 20",
        cwd=work,
    )
    assert "Instead: pivot point in the steady turn." in " ".join(done(helped).split())
    done(ran)
    done(read)
    found = json.loads((work / "pivot.json").read_text())
    motion = simulate(build(parse_card(mariner_text(), "ship.toml")), Turn(math.radians(-20))).trajectory
    v, r = (motion[name][-1] for name in ("motion.v", "motion.r"))
    assert found["pivot_m"] == pytest.approx(-v / r, rel=1e-4) and 0 < found["pivot_m"] < L / 2
    assert "Pivot point" in (work / "pivot.html").read_text()
    done(plain)
    assert "pivot_m" not in json.loads((work / "plain.json").read_text())
    refused(idle, "--rudder", "needs --pivot")
    code = "import tank2sim as t2s, json; print(json.dumps(t2s.json_schema('stability')))"
    shapes = json.loads(done(python(site, code, cwd=work)))["oneOf"]
    assert ["pivot_m" in shape["properties"] for shape in shapes].count(True) == 1 < len(shapes)


DRIFTER = """format = "tank2sim-ship/1"
[ship]
name = "Drifter"
source = "made up"
[model]
kind = "drifter"
[drifter]
mass_kg = 50.0
drag_kgpm = 4.0
"""


@pytest.mark.slow
@pytest.mark.essential
def test_a_kind_of_card_of_a_package_becomes_an_fmu(site: Path, tmp_path: Path) -> None:
    """Speed from rest under a constant force: v = v_e tanh(t/T), v_e = sqrt(F/B), T = M/sqrt(F B)."""
    (tmp_path / "drifter.toml").write_text(DRIFTER)
    (tmp_path / "bad.toml").write_text(DRIFTER.replace("50.0", "-1.0"))
    exported, checked, bad = tank2sim(
        site, "export drifter.toml -o drifter.fmu", "check drifter.fmu", "export bad.toml -o bad.fmu", cwd=tmp_path
    )
    done(exported)
    done(checked)
    refused(bad, "bad.toml", "drifter.mass_kg")
    force, time_s = 16.0, np.arange(0.0, 30.0, 0.5)
    result = simulate_fmu(
        str(tmp_path / "drifter.fmu"), stop_time=29.5, output_interval=0.5, start_values={"drift.force": force}
    )
    expected = math.sqrt(force / 4.0) * np.tanh(time_s * math.sqrt(force * 4.0) / 50.0)
    np.testing.assert_allclose(result["motion.u"], expected, atol=1e-4)


@pytest.mark.slow
def test_a_log_of_a_recorder_is_cut_into_trials_by_its_reader(site: Path, work: Path) -> None:
    record = columns(work / "zz.csv")
    lines = ["RECORDER 1"]
    for place in range(0, len(record["t_s"]), 10):
        time = 1.7e9 + record["t_s"][place]
        values = {
            "heading": record["psi_deg"][place] % 360,
            "rot": 60 * record["r_degps"][place],
            "speed": record["u_mps"][place] / KNOT,
            "rudder": record["delta_deg"][place],
        }
        lines += [f"{time:.1f} {name} {value:.5f}" for name, value in values.items()]
    (work / "voyage.rec").write_text("\n".join(lines) + "\n")
    (work / "faulty.rec").write_text("RECORDER 1\n1 heading north\n")
    cut, bad = tank2sim(site, "log voyage.rec -o cut --json log.json", "log faulty.rec -o cut2", cwd=work)
    done(cut)
    found = json.loads((work / "log.json").read_text())
    assert found["logs"][0]["format"] == "recorder" and any(
        "zigzag" in path.name for path in (work / "cut").glob("*.csv")
    )
    refused(bad, "faulty.rec", "line 2")
