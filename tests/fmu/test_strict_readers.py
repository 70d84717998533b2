"""What strict readers of FMUs reject, as rules of FMI 2.0.5 and 3.0.2, held against every bundled ship."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from datetime import datetime
from functools import cache
from pathlib import Path
from unittest import mock

import pytest
from fmpy.validation import validate_fmu
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from tank2sim.bundled import bundled_cards
from tank2sim.dynamics import Model
from tank2sim.fmu.acceptance import passport_files
from tank2sim.fmu.export import description_text, write_fmu
from tank2sim.fmu.passport import PASSPORT_PAGE, Replay
from tank2sim.fmu.provenance import Documents, ValueOrigin
from tank2sim.fmu.templates import c_identifier
from tank2sim.notices import Notice
from tank2sim.simulation.card_range import CardRangeReading
from tank2sim.simulation.run import Run
from tests.fmu.descriptions import model_of, whole_description
from tests.fmu.driving import ShipFmu
from tests.marks import first_fast

SHIPS = pytest.mark.parametrize("ship", [*bundled_cards(), "autopilot"])
A_SHIP = first_fast("ship", [*bundled_cards(), "autopilot"])


@cache
def description(ship: str, fmi: int) -> etree._Element:
    return etree.fromstring(description_text(model_of(ship), fmi=fmi).encode())


def variables(root: etree._Element) -> list[dict[str, str]]:
    """Attributes of each variable with those of its type, whose name is under ``type``, by either version of FMI."""
    found = []
    for one in root.find("ModelVariables"):
        kind = one if one.tag != "ScalarVariable" else one[0]
        found.append({**one.attrib, **kind.attrib, "type": kind.tag})
    return found


# ---- units ----


@SHIPS
def test_every_unit_is_defined(ship: str, fmi: int) -> None:
    root = description(ship, fmi)
    units = {unit.get("name"): {one.get("name") for one in unit.iter("DisplayUnit")} for unit in root.iter("Unit")}
    for one in variables(root):
        if one["type"] == "Boolean":
            assert not {"unit", "displayUnit", "min", "max", "nominal"} & set(one)
            continue
        assert one["unit"] in units, one["name"]
        assert one.get("displayUnit") in {None, *units[one["unit"]]}, one["name"]


# ---- names ----

_B_NAME = r"[_a-zA-Z][_a-zA-Z0-9]*"
_ARRAY = r"(\[[0-9]+(,[0-9]+)*\])?"
_NAME = rf"{_B_NAME}{_ARRAY}(\.{_B_NAME}{_ARRAY})*"


@SHIPS
def test_names_are_structured_and_unique(ship: str, fmi: int) -> None:
    root = description(ship, fmi)
    assert root.get("variableNamingConvention") == "structured"
    names = [one["name"] for one in variables(root)]
    assert len(names) == len(set(names))
    for name in names:
        assert re.fullmatch(rf"{_NAME}|der\({_NAME}(,[0-9]+)?\)", name), name
    references = [int(one["valueReference"]) for one in variables(root)]
    first = 0 if fmi == 3 else 1  # FMI 2 need not describe the time, and libcosim has no use for it
    assert references == list(range(first, first + len(references)))


# ---- start values, causality, variability ----


@SHIPS
def test_start_values_stand_where_they_must_and_nowhere_else(ship: str, fmi: int) -> None:
    for one in variables(description(ship, fmi)):
        exact = one["causality"] in ("input", "parameter")
        assert ("start" in one) is exact, one["name"]
        assert one.get("initial") == {"parameter": "exact", "input": None, "independent": None}.get(
            one["causality"], "calculated"
        )
        if one["causality"] == "parameter":
            assert one["variability"] in ("fixed", "tunable")
        if one["type"] != "Boolean" and exact:
            start = float(one["start"])
            assert float(one.get("min", "-inf")) <= start <= float(one.get("max", "inf")), one["name"]
            assert float(one["nominal"]) > 0


# ---- structure ----


def unknowns(root: etree._Element, fmi: int, element: str) -> list[tuple[str, list[str], list[str]]]:
    """Name of each unknown, its dependencies and their kinds."""
    names = [one["name"] for one in variables(root)]
    tags = {"Outputs": "Output", "Derivatives": "ContinuousStateDerivative", "InitialUnknowns": "InitialUnknown"}
    structure = root.find("ModelStructure")
    key, offset = ("index", 1) if fmi == 2 else ("valueReference", 0)
    listed = structure.findall(f"{element}/Unknown" if fmi == 2 else tags[element])
    return [
        (
            names[int(one.get(key)) - offset],
            [names[int(number) - offset] for number in one.get("dependencies").split()],
            one.get("dependenciesKind").split(),
        )
        for one in listed
    ]


@SHIPS
def test_unknowns_are_complete_and_depend_on_knowns_alone(ship: str, fmi: int) -> None:
    root, model = description(ship, fmi), model_of(ship)
    by_name = {one["name"]: one for one in variables(root)}
    outputs = [one["name"] for one in by_name.values() if one["causality"] == "output"]
    rates = [one["name"] for one in by_name.values() if "derivative" in one]
    states = set(model.state_names)
    assert [name for name, _, _ in unknowns(root, fmi, "Outputs")] == outputs
    assert [name for name, _, _ in unknowns(root, fmi, "Derivatives")] == rates
    assert len(rates) == len(states)
    # All outputs, continuous states and their derivatives that are calculated at the start, and no others.
    listed = [name for name, _, _ in unknowns(root, fmi, "InitialUnknowns")]
    assert sorted(listed) == sorted({*outputs, *rates, *states})
    inputs = {one["name"] for one in by_name.values() if one["causality"] == "input"}
    parameters = {one["name"] for one in by_name.values() if one["causality"] == "parameter"}
    for element, known in (
        ("Outputs", inputs | states),
        ("Derivatives", inputs | states),
        ("InitialUnknowns", inputs | parameters),
    ):
        for name, dependencies, kinds in unknowns(root, fmi, element):
            assert set(dependencies) <= known, (element, name)
            assert len(kinds) == len(dependencies)
            assert len(set(dependencies)) == len(dependencies)


@A_SHIP
def test_fmpy_finds_nothing_to_object_to(ship: str, fmi: int, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", whole_description(ship, fmi))
    assert validate_fmu(str(tmp_path / "x.fmu")) == []


# ---- the date ----


@pytest.mark.parametrize("epoch", ["0", "1700000000", "1709164800"])
def test_the_date_is_of_the_form_that_fmi_gives(epoch: str, fmi: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    date = etree.fromstring(description_text(model_of("autopilot"), fmi=fmi).encode()).get("generationDateAndTime")
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", date)
    assert datetime.fromisoformat(date).timestamp() == int(epoch)


# ---- the file, and its library ----


def test_entries_of_the_zip_are_plain_and_in_folders_of_the_standard(fmi: int, mariner_fmu: ShipFmu) -> None:
    with zipfile.ZipFile(mariner_fmu(fmi)) as archive:
        entries = archive.infolist()
        assert archive.testzip() is None
    names = [entry.filename for entry in entries]
    assert len({name.lower() for name in names}) == len(names)  # also where case does not count
    for entry in entries:
        assert re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.\-]*(/[A-Za-z0-9_][A-Za-z0-9_.\-]*)*", entry.filename)
        assert entry.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
        assert not entry.flag_bits & 0x9  # neither encrypted nor streamed
    folders = {"binaries", "documentation", "extra", "resources", "sources"}
    if fmi == 3:
        folders |= {"terminalsAndIcons"}
    roots = {"modelDescription.xml"} | ({"model.png"} if fmi == 2 else set())
    assert {name.partition("/")[0] for name in names} == folders | roots


# ---- whatever a card calls things ----

TEXT = st.one_of(
    st.text(st.characters(exclude_categories=["Cs"]), max_size=80),
    st.text(alphabet="<>&\"'%\\/.;:*?|{}[]()-_ \x00\x07\x1b\x7f\r\n\t\u2028\ufffe\ud800船🚢é", max_size=80),
    st.sampled_from(
        ["]]>", "*/", "../../x", "C:\\NUL", "con", "-->", "{{ 7 * 7 }}", "{% raw %}", "\x00", "x" * 5000, ""]
    ),
)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=TEXT)
def test_no_name_breaks_the_description(fmi: int, text: str, models: dict[str, Model]) -> None:
    plain = description_text(models["gain"], fmi=fmi)
    strange = replace(models["gain"], name=text, description=text, notices=(Notice(text),))
    root = etree.fromstring(description_text(strange, fmi=fmi).encode())
    whole = etree.fromstring(plain.encode())
    assert [one.tag for one in root.iter()] == [one.tag for one in whole.iter()]
    identifier = root.find("CoSimulation").get("modelIdentifier")
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,63}", identifier)
    assert identifier == c_identifier(text)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=TEXT)
def test_no_name_breaks_the_passport(text: str, models: dict[str, Model]) -> None:
    strange = replace(models["gain"], name=text, description=text, notices=(Notice(text),))
    zigzag = Run(mock.Mock(), {"overshoots_deg": [1.0]}, (text,), CardRangeReading({}, {"x": 0.0}, 0.0, text))
    documents = Documents(source=text, validity=text, origins={"command": ValueOrigin(text, text)})
    files = passport_files(strange, documents, {"zigzag": zigzag}, Replay(problem=text))
    tags = [one.tag for one in page_of(files).iter()]
    quiet = passport_files(
        replace(strange, name="x", description="x", notices=(Notice("x"),)),
        Documents(source="x", validity="x", origins={"command": ValueOrigin("x", "x")}),
        {"zigzag": zigzag},
        Replay(problem="x"),
    )
    if text:  # without a text a paragraph is left out
        assert tags == [one.tag for one in page_of(quiet).iter()]
    for content in files.values():
        content.encode("utf-8")


def page_of(files: dict[str, str]) -> etree._Element:
    return etree.fromstring(files[PASSPORT_PAGE].encode("utf-8"), etree.HTMLParser())


@pytest.mark.slow
def test_names_of_a_card_stay_out_of_the_c_sources_and_of_paths(
    fmi: int, models: dict[str, Model], tmp_path: Path
) -> None:
    mark = "Zorgon"
    strange = replace(
        models["gain"], name=f"*/ ../{mark}\\ \x00 ]]> 船", description=f"{mark} */", notices=(Notice(f"{mark}*/"),)
    )
    write_fmu(
        strange, tmp_path / "x.fmu", fmi=fmi, documents=Documents(source=f"{mark} */ \x07", validity=f"{mark}\ud800")
    )
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        for name in archive.namelist():
            assert ".." not in name
            if name.endswith((".c", ".h")):
                assert mark.encode() not in archive.read(name), name
        archive.extractall(tmp_path / "here")
    assert {path.name for path in tmp_path.iterdir()} == {"x.fmu", "here"}
    assert validate_fmu(str(tmp_path / "x.fmu")) == []
