"""What belongs together: terminals of FMI 3, groups of OSP, the icon; the reference run as FMI-LS-REF describes it."""

from __future__ import annotations

import hashlib
import io
import re
import subprocess
import sys
import zipfile
from pathlib import Path, PurePosixPath
from posixpath import normpath
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
import vl_convert
from lxml import etree
from PIL import Image

import tank2sim as t2s
from tank2sim.bundled import bundled
from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import terminals
from tank2sim.fmu.interface import interface
from tank2sim.units import UNITS
from tests.fmu.driving import FmuFile, ShipFmu

NAMES = pytest.mark.parametrize("name", ["hull", "body", "gain"])
OSP = "{https://open-simulation-platform.com/OspModelDescription/1.0.1}"
OSP_FILE = "extra/com.open-simulation-platform/OspModelDescription.xml"

# Of OspModelDescription-1.0.1.xsd: kinds of groups within a Generic, in the order of their sequence, those used here;
# and the unit that makes a signal of the kind.
KINDS = {
    "Force": "N",
    "Torque": "N.m",
    "LinearVelocity": "m/s",
    "AngularVelocity": "rad/s",
    "LinearDisplacement": "m",
    "AngularDisplacement": "rad",
    "LinearAcceleration": "m/s2",
    "AngularAcceleration": "rad/s2",
    "ShaftSpeed": "rad/s",
}


def entry(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


# ---- terminals ----


@NAMES
def test_terminals_keep_to_the_schema_and_name_variables(
    name: str, fmu_file: FmuFile, models: dict[str, Model]
) -> None:
    root = etree.fromstring(entry(fmu_file(name, 3), "terminalsAndIcons/terminalsAndIcons.xml"))
    folder = Path(fmpy.__file__).parent / "schema" / "fmi3"
    etree.XMLSchema(file=str(folder / "fmi3TerminalsAndIcons.xsd")).assertValid(root)
    there = {one.name for one in interface(models[name]).variables if one.causality in ("input", "output")}
    for terminal in root.iter("Terminal"):
        members = [one.attrib for one in terminal.iter("TerminalMemberVariable")]
        assert {one["variableName"] for one in members} <= there
        assert len({one["memberName"] for one in members}) == len(members)


def test_a_ship_has_terminals_for_what_a_bridge_is_wired_to(mariner: Model) -> None:
    found = {
        one.name: {member: variable.name for member, variable in one.members} for one in terminals(interface(mariner))
    }
    assert found["steering"] == {
        "angle": "rudder.angle",
        "command": "rudder.command",
        "failed": "steering.failed",
        **{letter: f"rudder.{letter}" for letter in "XYN"},
    }
    assert {"x", "y", "psi", "u", "v", "r", "sog", "cog"} <= set(found["motion"])
    assert set(found["position"]) == {"latitude", "longitude"}


def test_every_input_and_output_with_a_group_in_its_name_is_in_one_terminal(mariner: Model) -> None:
    described = interface(mariner)
    members = [variable.name for one in terminals(described) for _, variable in one.members]
    assert len(members) == len(set(members))
    wanted = {one.name for one in described.variables if one.causality in ("input", "output") and "." in one.name}
    assert set(members) == wanted


# ---- the icon ----


def test_each_version_has_its_icon(fmu_file: FmuFile) -> None:
    assert entry(fmu_file("gain", 2), "model.png") == bundled("fmu_templates", "icon.png").read_bytes()
    for name in ("icon.png", "icon.svg"):
        assert entry(fmu_file("gain", 3), f"terminalsAndIcons/{name}") == bundled("fmu_templates", name).read_bytes()


def test_the_icon_in_pixels_is_that_in_lines() -> None:
    drawn = Image.open(io.BytesIO(vl_convert.svg_to_png(bundled("fmu_templates", "icon.svg").read_text(), scale=1)))
    kept = Image.open(bundled("fmu_templates", "icon.png"))
    assert kept.size == drawn.size
    difference = np.abs(np.asarray(drawn.convert("RGBA"), float) - np.asarray(kept.convert("RGBA"), float))
    assert difference.mean() < 3.0  # of 255: the colours are rounded to a palette


# ---- variable groups ----


@NAMES
def test_groups_keep_to_the_rules_of_osp(name: str, fmi: int, fmu_file: FmuFile, models: dict[str, Model]) -> None:
    assert_rules(entry(fmu_file(name, fmi), OSP_FILE), models[name])


def test_groups_of_a_ship_keep_to_the_rules_of_osp(mariner: Model, mariner_fmu: ShipFmu) -> None:
    root = assert_rules(entry(mariner_fmu(2), OSP_FILE), mariner)
    position = root.find(f".//{OSP}Generic[@name='ned_position']/{OSP}LinearDisplacement")
    assert [(one.get("ref"), one.get("axis")) for one in position] == [("motion.x", "x"), ("motion.y", "y")]
    velocity = root.find(f".//{OSP}Generic[@name='body_velocity']/{OSP}AngularVelocity")
    assert [(one.get("ref"), one.get("axis")) for one in velocity] == [("motion.r", "z")]


def assert_rules(text: bytes, model: Model) -> etree._Element:
    root = etree.fromstring(text)
    described = {one.name: one for one in interface(model).variables}
    assert (root.tag, root.get("version")) == (f"{OSP}OspModelDescription", "1.0")
    (groups,) = root
    assert groups.tag == f"{OSP}VariableGroups"
    assert {group.tag for group in groups} <= {f"{OSP}Generic"}
    names = [one.get("name") for one in groups.iter() if one.get("name")]
    assert len(names) == len(set(names))
    referred = [one.get("ref") for one in groups.iter(f"{OSP}Variable")]
    assert sorted(referred) == sorted(n for n, one in described.items() if one.causality in ("input", "output"))
    for one in groups.iter(f"{OSP}Variable"):
        variable = described[one.get("ref")]
        assert one.get("unit") == (None if variable.boolean else variable.unit)
        assert variable.unit in UNITS
    for group in groups:
        order = [part.tag.removeprefix(OSP) for part in group]
        ranks = [-1 if kind == "Variable" else list(KINDS).index(kind) for kind in order]
        assert ranks == sorted(ranks)
        for part in group.iterchildren(*(f"{OSP}{kind}" for kind in KINDS)):
            variables = [described[one.get("ref")] for one in part]
            assert 1 <= len(variables) <= 3
            assert {one.unit for one in variables} == {KINDS[part.tag.removeprefix(OSP)]}
            assert len({one.causality for one in variables}) == 1
    return root


_OSP_SYSTEM = """<?xml version="1.0" encoding="utf-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
  <StartTime>0.0</StartTime>
  <BaseStepSize>0.5</BaseStepSize>
  <Algorithm>fixedStep</Algorithm>
  <Simulators>
    <Simulator name="ship" source="ship.fmu" stepSize="0.5"/>
    <Simulator name="autopilot" source="autopilot.fmu" stepSize="0.5">
      <InitialValues>
        <InitialValue variable="heading.command"><Real value="0.3"/></InitialValue>
      </InitialValues>
    </Simulator>
  </Simulators>
  <Connections>
    <VariableGroupConnection>
      <VariableGroup simulator="ship" name="ned_position.angular"/>
      <VariableGroup simulator="autopilot" name="ned_position.angular"/>
    </VariableGroupConnection>
    <VariableGroupConnection>
      <VariableGroup simulator="ship" name="body_velocity.angular"/>
      <VariableGroup simulator="autopilot" name="body_velocity.angular"/>
    </VariableGroupConnection>
    <VariableGroupConnection>
      <VariableGroup simulator="autopilot" name="rudder_order"/>
      <VariableGroup simulator="ship" name="rudder_order"/>
    </VariableGroupConnection>
  </Connections>
</OspSystemStructure>
"""

_LIBCOSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
run = CosimExecution.from_osp_config_file(osp_path=sys.argv[1])
names = {info.name.decode(): info.index for info in run.slave_infos()}
observer = CosimObserver.create_last_value()
run.add_observer(observer)
ship = next(one.reference for one in run.slave_variables(names["ship"]) if one.name.decode() == "motion.psi")
run.step(1800)
print("heading", observer.last_real_values(names["ship"], [ship])[0])
"""


@pytest.mark.slow
def test_the_engine_of_osp_joins_ship_and_autopilot_by_their_groups(
    mariner: Model, mariner_ssp: Path, tmp_path: Path
) -> None:
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    for name in ("ship", "autopilot"):
        with zipfile.ZipFile(mariner_ssp) as archive:
            (tmp_path / f"{name}.fmu").write_bytes(archive.read(f"resources/{name}.fmu"))
    for name, model in (("ship", mariner.name), ("autopilot", f"Autopilot of {mariner.name}")):
        (tmp_path / f"{model}_OspModelDescription.xml").write_bytes(entry(tmp_path / f"{name}.fmu", OSP_FILE))
    (tmp_path / "OspSystemStructure.xml").write_text(_OSP_SYSTEM, encoding="utf-8")
    command = [sys.executable, "-c", _LIBCOSIM, str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    words = [line.split()[1] for line in ended.stdout.splitlines() if line.startswith("heading")]
    assert words, ended.stderr[-1500:]
    assert float(words[0]) == pytest.approx(0.3, abs=2e-3)


@pytest.mark.slow
def test_beside_the_fmu_osp_finds_a_system_of_the_ship(tmp_path: Path) -> None:
    t2s.load("mariner").to_fmu(tmp_path / "my ship.fmu", fmi=2, osp=True)
    described = fmpy.read_model_description(str(tmp_path / "my ship.fmu"), validate=False)
    inputs = {one.name for one in described.modelVariables if one.causality == "input"}
    root = etree.parse(tmp_path / "OspSystemStructure.xml").getroot()
    space = "{http://opensimulationplatform.com/MSMI/OSPSystemStructure}"
    (simulator,) = root.iter(f"{space}Simulator")
    assert simulator.get("source") == "my ship.fmu"
    assert {one.get("variable") for one in root.iter(f"{space}InitialValue")} == inputs
    beside = tmp_path / f"{described.modelName}_OspModelDescription.xml"
    assert beside.read_bytes() == entry(tmp_path / "my ship.fmu", OSP_FILE)


@pytest.mark.slow
def test_the_engine_of_osp_runs_the_system_that_is_beside_the_fmu(tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    t2s.load("mariner").to_fmu(tmp_path / "ship.fmu", fmi=2, osp=True)
    text = (tmp_path / "OspSystemStructure.xml").read_text(encoding="utf-8")
    ordered = text.replace('"rudder.command"><Real value="0.0"/>', '"rudder.command"><Real value="0.3"/>')
    assert ordered != text
    (tmp_path / "OspSystemStructure.xml").write_text(ordered, encoding="utf-8")
    command = [sys.executable, "-c", _LIBCOSIM.replace("1800", "200"), str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    words = [line.split()[1] for line in ended.stdout.splitlines() if line.startswith("heading")]
    assert words, ended.stderr[-1500:]
    assert float(words[0]) > 0.5


FOLDER = PurePosixPath("extra/org.fmi-standard.fmi-ls-ref")
NAMESPACE = "{http://fmi-standard.org/fmi-ls-manifest}"
ROLES = re.compile(r"experiment/smoke-test|result")


def at(source: str) -> str:
    """Path in the archive of a source that is relative to the manifest."""
    return normpath(str(FOLDER / source))


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_manifest_names_the_run_with_its_inputs_and_outputs(mariner_fmu: ShipFmu, fmi: int) -> None:
    with zipfile.ZipFile(mariner_fmu(fmi)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    manifest = ElementTree.fromstring(files[str(FOLDER / "fmi-ls-manifest.xml")])
    assert manifest.tag == "fmiReferences"
    assert manifest.get(f"{NAMESPACE}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert manifest.get(f"{NAMESPACE}fmi-ls-version") and manifest.get(f"{NAMESPACE}fmi-ls-description")
    related = {str(one.get("role")): one for one in manifest}
    assert all(one.tag == "Related" for one in manifest) and all(ROLES.fullmatch(role) for role in related)
    for one in manifest:
        content = files[at(str(one.get("source")))]
        assert (one.get("checksumType"), one.get("checksum")) == ("SHA3-256", hashlib.sha3_256(content).hexdigest())
    experiments = ElementTree.fromstring(files[at(str(related["experiment/smoke-test"].get("source")))])
    assert experiments.tag == "Experiments" and experiments.get("name")
    (experiment,) = experiments
    stimuli, references = (files[at(str(one.get("source")))].decode() for one in experiment)
    assert [one.tag for one in experiment] == ["Stimuli", "References"]
    assert stimuli.startswith("time,rudder.command") and references.startswith("time,motion.x")
    times = np.array([float(row.split(",")[0]) for row in references.splitlines()[1:]])
    ends = [float(str(experiment.get(name))) for name in ("startTime", "stopTime")]
    assert ends == pytest.approx(times[[0, -1]], rel=1e-12)
    assert float(str(experiment.get("stepSize"))) == pytest.approx(np.median(np.diff(times)))
