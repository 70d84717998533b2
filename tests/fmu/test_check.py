"""The check itself: it passes what is right, and nothing else."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.errors import InputError
from tank2sim.fmu import acceptance, sources
from tank2sim.fmu.check import LIMITS, CheckReport, compare_with_model, description_differences
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.manoeuvre import manoeuvre
from tank2sim.fmu.passport import Replay
from tank2sim.fmu.reference import by_scheme, exactly, reference_errors
from tank2sim.fmu.unpacking import embedded_card
from tests.fmu.driving import FmuFile, ShipFmu, rewritten
from tests.marks import first_fast

KINDS = ("ModelExchange", "CoSimulation")


@first_fast("fmi", [2, 3])
@first_fast("name", ["hull", "body", "gain"])
def test_an_fmu_agrees_with_its_model(name: str, fmi: int, fmu_file: FmuFile, models: dict[str, Model]) -> None:
    report = compare_with_model(fmu_file(name, fmi), model=models[name])
    assert report.passed
    assert (report.kinds, report.validation, report.differences) == (KINDS, (), ())
    assert set(report.max_error) == set(models[name].outputs)
    assert max(report.errors["CoSimulation"].values()) < 1e-9
    assert max(report.errors["ModelExchange"].values()) < 1e-6


@pytest.mark.essential
@pytest.mark.slow
@pytest.mark.parametrize("ship", ["mariner", "wilinski-zellman"])
def test_a_bundled_ship_agrees_with_its_model(ship: str, fmi: int, mariner_fmu: ShipFmu, tmp_path: Path) -> None:
    model, path = with_simulator_interface(build(read_card(ship))), tmp_path / "x.fmu"
    if ship == "mariner":
        path = mariner_fmu(fmi)
    else:
        write_fmu(model, path, fmi=fmi)
    report = compare_with_model(path, model=model)
    assert (report.validation, report.differences) == ((), ())
    assert report.passed


@pytest.mark.slow
def test_another_coefficient_is_found_and_named(hull: Model, tmp_path: Path) -> None:
    write_fmu(hull.with_values({"derivatives.Yv": -0.1200001}), tmp_path / "x.fmu")
    report = compare_with_model(tmp_path / "x.fmu", model=hull)
    assert not report.passed
    assert any("derivatives.Yv is -0.1200001 in the FMU and -0.12" in line for line in report.differences)
    assert report.errors["CoSimulation"]["motion.v"] > LIMITS["CoSimulation"]


@first_fast(
    "quantity, wrong",
    [
        ("force.N", lambda value: -value),
        ("motion.beta", lambda value: -value),
        ("motion.udot", lambda value: value * (1 + 1e-5)),
        ("rudder.rate", lambda value: value * 0.999),
        ("motion.psidot", lambda value: -value),
    ],
)
def test_a_wrong_equation_fails(quantity: str, wrong: Callable[[ca.SX], ca.SX], hull: Model, fmu_file: FmuFile) -> None:
    report = compare_with_model(fmu_file("hull", 2), model=hull.redefine(quantity, wrong))
    assert not report.passed
    for kind in KINDS:
        assert max(report.errors[kind].values()) > LIMITS[kind]  # type: ignore[index]


@pytest.mark.parametrize(("share", "weight"), [(0.0, 0.0), (0.5, 0.5), (2.0, 1.0)])
def test_an_error_of_a_direction_counts_by_the_size_of_its_velocity(share: float, weight: float, hull: Model) -> None:
    place, speed = (hull.outputs.index(name) for name in ("motion.beta", "motion.speed"))
    expected = np.zeros((2, len(hull.outputs)))
    expected[1, speed] = share * hull["motion.speed"].nominal
    found = expected.copy()
    found[1, place] = 1e-3
    errors = reference_errors(hull, expected, dict(zip(hull.outputs, found.T, strict=True)))
    assert errors.pop("motion.beta") == pytest.approx(weight * 1e-3 / hull["motion.beta"].nominal)
    assert not any(errors.values())


def report_of_tampered(
    hull: Model, path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[str, str], str]
) -> CheckReport:
    """Of an FMU whose generated C is changed by its text and name, which `export` refuses to write."""
    generate = sources.generate_c
    monkeypatch.setattr(sources, "generate_c", lambda functions, stem: change(generate(functions, stem), stem))
    with pytest.raises(InputError, match="library that the C compiler made for this machine does not work"):
        write_fmu(hull, path)
    monkeypatch.setattr(acceptance, "replay_in_fmu", lambda *_: Replay(problem="not asked"))
    write_fmu(hull, path)
    return compare_with_model(path, model=hull)


@pytest.mark.slow
def test_a_sign_changed_in_the_generated_code_fails(
    hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tampered(code: str, stem: str) -> str:
        assert "=sin(" in code or stem != "equations"  # those of the start have none
        return code.replace("=sin(", "=-sin(")

    report = report_of_tampered(hull, tmp_path / "x.fmu", monkeypatch, tampered)
    assert not report.passed
    assert report.max_error["motion.y"] > 0.1


def test_an_fmu_of_another_ship_is_reported_by_its_variables(models: dict[str, Model], fmu_file: FmuFile) -> None:
    report = compare_with_model(fmu_file("body", 2), model=models["hull"])
    assert not report.passed
    assert "input rudder.command of the model is not in the FMU" in report.differences
    assert "parameter drag of the FMU is not in the model" in report.differences


@pytest.mark.slow
def test_a_library_that_fails_is_a_failed_check(hull: Model, tmp_path: Path) -> None:
    weak = hull.with_values({"derivatives.thrust": 1e308, "derivatives.drag": -1e308})
    write_fmu(weak, tmp_path / "x.fmu")
    report = compare_with_model(tmp_path / "x.fmu", model=hull)
    assert not report.passed
    assert any("not finite" in line for line in report.differences)


def falsified(source: Path, target: Path, old: bytes, new: bytes) -> Path:
    """An FMU with another description."""
    return rewritten(
        source, target, lambda name, data: data.replace(old, new) if name == "modelDescription.xml" else data
    )


@pytest.mark.slow
def test_a_description_with_a_fault_fails(fmu_file: FmuFile, hull: Model, tmp_path: Path) -> None:
    path = falsified(fmu_file("hull", 2), tmp_path / "x.fmu", b'unit="N.m"', b'unit="lbf.ft"')
    report = compare_with_model(path, model=hull)
    assert not report.passed
    assert any("lbf.ft" in problem for problem in report.validation)
    assert any("lbf.ft" in line for line in report.differences)


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ('start="-0.12"', 'start="-0.22"', r"derivatives\.Yv.*start is -0\.22 in the FMU and -0\.12 in the model"),
        ('factor="1.9438444924406046"', 'factor="1.0"', "Unit m/s: DisplayUnit knots: factor is 1.0 in"),
        ('<BaseUnit kg="1" m="2" s="-2"/>', '<BaseUnit kg="1" m="3" s="-2"/>', "N.m: BaseUnit: m is 3 in"),
        ('displayUnit="knots" ', "", "motion.u.*displayUnit is missing in the FMU and knots in"),
        ('unit="m/s2"', 'unit="m/s"', "motion.udot.*unit is m/s in the FMU and m/s2 in"),
        ('min="-0.6"', 'min="-0.7"', "rudder.command.*min is -0.7 in"),
        ('max="0.6" ', "", "rudder.command.*max is missing in"),
        ('nominal="100.0"', 'nominal="10.0"', "motion.x.*nominal is 10.0 in"),
        ('variability="tunable"', 'variability="fixed"', "derivatives.drag.*variability is fixed in"),
        ('causality="local"', 'causality="output"', "causality is output in the FMU and local in"),
        ("+ to starboard", "+ to port", "rudder.command.*description is Rudder order, . to port in"),
    ],
)
def test_whatever_is_falsified_in_a_description_is_reported(
    fmi: int, old: str, new: str, reported: str, fmu_file: FmuFile, hull: Model, tmp_path: Path
) -> None:
    with zipfile.ZipFile(fmu_file("hull", fmi)) as archive:
        text = archive.read("modelDescription.xml")
    assert description_differences(tmp_path, text, hull, fmi) == []
    assert old.encode() in text
    differences = description_differences(tmp_path, text.replace(old.encode(), new.encode()), hull, fmi)
    assert any(re.search(reported, line) for line in differences), differences


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "reported"), [(b'start="-0.12"', "start is 0.7"), (b'factor="1.9438444924406046"', "knots")]
)
def test_an_fmu_with_a_falsified_description_fails(
    old: bytes, reported: str, fmu_file: FmuFile, hull: Model, tmp_path: Path
) -> None:
    path = falsified(fmu_file("hull", 2), tmp_path / "x.fmu", old, old.split(b"=")[0] + b'="0.7"')
    report = compare_with_model(path, model=hull)
    assert not report.passed
    assert len(report.differences) == 1 and reported in report.differences[0]
    assert max(report.errors["CoSimulation"].values()) < 1e-9


@pytest.mark.slow
def test_another_spelling_of_a_number_is_no_difference(
    fmu_file: FmuFile, models: dict[str, Model], tmp_path: Path
) -> None:
    path = falsified(fmu_file("body", 2), tmp_path / "x.fmu", b'start="0.05"', b'start="5e-2"')
    assert path.read_bytes() != fmu_file("body", 2).read_bytes()
    assert compare_with_model(path, model=models["body"]).passed


def cut(name: str, data: bytes) -> bytes:
    return data[: len(data) // 3] if name.startswith("binaries/") else data


def empty(name: str, data: bytes) -> bytes:
    return b"" if name.startswith("binaries/") else data


def another_token(name: str, data: bytes) -> bytes:
    return re.sub(rb'(guid|instantiationToken)="\{........', rb'\1="{00000000', data) if name.endswith(".xml") else data


@first_fast("fmi", [2, 3])
@first_fast("damage", [cut, empty, another_token])
def test_a_library_that_cannot_be_used_is_a_failed_check(
    damage: Callable[[str, bytes], bytes],
    fmi: int,
    fmu_file: FmuFile,
    hull: Model,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    report = compare_with_model(rewritten(fmu_file("hull", fmi), tmp_path / "x.fmu", damage), model=hull)
    assert not report.passed
    assert [line.split(":")[0] for line in report.differences] == list(KINDS)
    assert not any("\n" in line or "Traceback" in line for line in report.differences)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize(("end", "reported"), [("abort()", "SIGABRT"), ("exit(0)", "exit code 0")])
def test_a_library_that_ends_its_process_is_a_failed_check(
    end: str, reported: str, hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deadly = f"\n#include <stdlib.h>\n__attribute__((constructor)) static void end(void) {{ {end}; }}\n"
    report = report_of_tampered(hull, tmp_path / "x.fmu", monkeypatch, lambda code, _: code + deadly)
    assert not report.passed
    assert all("ended the process" in line and reported in line for line in report.differences)
    assert len(report.differences) == len(KINDS)


def test_without_a_model_the_file_alone_is_validated(fmu_file: FmuFile) -> None:
    report = compare_with_model(fmu_file("hull", 3))
    assert (report.passed, report.compared, report.max_error) == (True, False, {})


@pytest.mark.slow
def test_the_report_is_plain_data_and_nothing_is_printed(
    fmu_file: FmuFile, hull: Model, capfd: pytest.CaptureFixture[str]
) -> None:
    report = asdict(compare_with_model(fmu_file("hull", 2), model=hull))
    assert json.loads(json.dumps(report))["max_error"]["motion.x"] < 1e-6
    assert capfd.readouterr() == ("", "")


# ---- files that are not FMU ----


def test_files_that_are_no_fmu_are_reported_in_one_line(fmu_file: FmuFile, tmp_path: Path, hull: Model) -> None:
    whole = fmu_file("hull", 2).read_bytes()
    damaged = bytearray(whole)
    damaged[len(whole) // 3] ^= 0xFF
    cases = {"text.fmu": b"no zip", "empty.fmu": b"", "short.fmu": whole[:-100], "damaged.fmu": bytes(damaged)}
    for name, content in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=rf"{name}.*not an FMU"):
            compare_with_model(tmp_path / name, model=hull)
    with zipfile.ZipFile(tmp_path / "bare.fmu", "w") as archive:
        archive.writestr("readme.txt", "nothing here")
    with pytest.raises(InputError, match=r"no modelDescription\.xml"):
        compare_with_model(tmp_path / "bare.fmu", model=hull)
    for path, problem in ((tmp_path / "none.fmu", "does not exist"), (tmp_path, "is a folder")):
        with pytest.raises(InputError, match=problem):
            compare_with_model(path, model=hull)
        with pytest.raises(InputError, match=problem):
            embedded_card(path)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (b"<ModelVariables>", b"<ModelVariables", "modelDescription.xml: cannot be read"),
        (b'fmiVersion="2.0"', b'fmiVersion="1.0"', "FMI|cannot be read"),
        (b'modelIdentifier="hull2"', b'modelIdentifier="Other"', "no library for this machine"),
    ],
)
def test_a_description_that_cannot_be_used_is_reported(
    old: bytes, new: bytes, problem: str, fmu_file: FmuFile, tmp_path: Path
) -> None:
    rewritten(fmu_file("hull", 2), tmp_path / "x.fmu", lambda _, data: data.replace(old, new))
    with pytest.raises(InputError, match=problem) as caught:
        compare_with_model(tmp_path / "x.fmu")
    assert "\n" not in str(caught.value)


# ---- the references ----


def test_the_manoeuvre_goes_both_ways_within_the_bounds(hull: Model) -> None:
    run = manoeuvre(hull)
    rudder, revolutions, failed = run.inputs.T
    assert (rudder.max(), rudder.min(), rudder[0]) == (0.3, -0.3, 0.0)
    assert (revolutions.max(), revolutions.min(), revolutions[0]) == (1.5, 0.5, 1.0)
    assert (failed[0], failed[-1], failed.max()) == (0.0, 0.0, 1.0)
    assert run.times[-1] == pytest.approx(300.0)
    for first, behind in run.pieces():
        assert (run.inputs[first:behind] == run.inputs[first]).all()


@pytest.mark.slow
def test_the_scheme_approaches_the_exact_solution_as_its_step_shrinks(hull: Model) -> None:
    run = manoeuvre(hull)
    exact = exactly(hull, run)
    errors = [np.abs(by_scheme(replace(hull, step_s=step), run) - exact)[:, :2].max() for step in (0.4, 0.1, 0.025)]
    assert errors[2] < errors[1] / 4 < errors[0] / 16
    assert errors[2] < 1e-3


def test_the_exact_solution_is_that_of_another_integrator(models: dict[str, Model]) -> None:
    body = models["body"]
    run = manoeuvre(body)
    # dv/dt = -k v^2 has the solution v0 / (1 + k v0 t), whose integral is log(1 + k v0 t) / k.
    slowed = 1 + 0.05 * 2.0 * run.times
    expected = np.column_stack([np.log(slowed) / 0.05, 2.0 / slowed])
    np.testing.assert_allclose(exactly(body, run), expected, rtol=1e-8)
    numeric = solve_ivp(lambda _, x: [x[1], -0.05 * x[1] ** 2], (0, run.times[-1]), [0, 2.0], "DOP853", rtol=1e-12)
    np.testing.assert_allclose(by_scheme(body, run)[-1], numeric.y[:, -1], rtol=1e-7)


def test_a_process_that_drives_an_fmu_waits_for_no_equations_or_cards() -> None:
    code = "import sys, tank2sim.fmu.process; print({'casadi', 'pydantic'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
