"""The pages at the front of the manual and the packaging files agree with the program."""

from __future__ import annotations

import json
import re
import tomllib
from typing import get_args

import pytest
import yaml

import tank2sim as t2s
from tank2sim.apps.programs.forms import FORMS
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.fmu.hosts import Host
from tests.conftest import ROOT
from tests.marks import first_fast

from .examples import MANUAL

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ABOUT = {"length": 160.93, "draught": 7.468, "speed": 7.7175, "density": 1025.0}


def table_below(page: str, heading: str) -> list[list[str]]:
    """Cells of the first table under a heading, without its rule."""
    text = (MANUAL / page).read_text(encoding="utf-8").split(f"## {heading}\n", 1)[1]
    rows = re.search(r"(?:^\|.*\|\n)+", text, re.MULTILINE)
    assert rows is not None
    lines = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[0].splitlines()]
    return [lines[0], *lines[2:]]


def test_the_mariner_in_each_scaling_follows_the_definitions() -> None:
    """Factors by hand: 1/2 rho L^2 U^2 / U and so on; L/d; an odd power of the rudder changes sign."""
    source = tomllib.loads((ROOT / "models/mariner/ship.toml").read_text(encoding="utf-8"))
    L, d, U, rho = ABOUT.values()
    of_si = {
        "Yv": 0.5 * rho * L**2 * U,
        "Nr": 0.5 * rho * L**4 * U,
        "Yd": 0.5 * rho * L**2 * U**2,
        "Nd": 0.5 * rho * L**3 * U**2,
        "Nrdot": 0.5 * rho * L**5,
        "mass": 0.5 * rho * L**3,
    }
    head, *rows = table_below("conventions.md", "The Mariner in each scaling")
    assert len(head) == 5 and {row[0].strip("`") for row in rows} == set(of_si)
    for name, port, starboard, second, dimensional in rows:
        key = name.strip("`")
        value = source["rigid_body"]["mass"] if key == "mass" else source["derivatives"][key]
        to_starboard = -value if key in ("Yd", "Nd") else value
        expected = (value, to_starboard, to_starboard * L / d, to_starboard * of_si[key])
        assert [float(x) for x in (port, starboard, second, dimensional)] == pytest.approx(expected, rel=1e-5), key


@first_fast("scaling", ["prime_ii", "dimensional"])
def test_convert_writes_the_numbers_of_that_table(scaling: str) -> None:
    made = tomllib.loads(t2s.convert("mariner", scaling=scaling, rudder_sign="starboard").made.text)
    head, *rows = table_below("conventions.md", "The Mariner in each scaling")
    column = head.index(f"`{scaling}`, `starboard`")
    for row in rows:
        key = row[0].strip("`")
        value = made["rigid_body"]["mass"] if key == "mass" else made["derivatives"][key]
        assert value == pytest.approx(float(row[column]), rel=1e-5), key


def test_the_cookbook_has_each_program() -> None:
    text = (MANUAL / "cookbook.md").read_text(encoding="utf-8")
    cards = {"abkowitz", "mmg", "small_craft", "shipmmg", "mmgdynamics"}
    assert [
        name for name in FORMS if name not in cards and f"--to {name}`" not in text and f"--to {name} " not in text
    ] == []
    assert all(f"--for {name}" in text for name in get_args(Host))


def test_terms_of_the_glossary_are_in_order_and_in_one_line_each() -> None:
    terms = _terms()
    assert terms == sorted(terms, key=str.lower) and len(set(terms)) == len(terms)


def _terms() -> list[str]:
    text = (MANUAL / "glossary.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    return [re.sub(r"[`($*].*", "", row.strip("| ").split(" | ")[0]).strip(" ,") for row in rows[1:] if " | " in row]


def test_no_cell_of_the_comparison_is_empty() -> None:
    head, *rows = table_below("features.md", "Next to other packages")
    assert head[1:] == ["tank2sim", "MSS", "shipmmg", "vessel-manoeuvring-models", "xdyn"]
    assert all(len(row) == len(head) and all(row) for row in rows)


def test_the_conda_recipe_needs_what_the_package_needs() -> None:
    text = (MANUAL / "packaging/conda/meta.yaml").read_text(encoding="utf-8")
    assert f'version = "{PROJECT["version"]}"' in text
    for old, new in (("{{ version }}", PROJECT["version"]), ("{{ PYTHON }}", "python")):
        text = text.replace(old, new)
    recipe = yaml.safe_load(re.sub(r"{%.*?%}", "", text))
    needed = {"".join(one.split()) for one in recipe["requirements"]["run"]} - {"c-compiler"}
    assert needed == {*PROJECT["dependencies"], f"python{PROJECT['requires-python']}"}
    assert recipe["build"]["entry_points"] == [f"{name} = {place}" for name, place in PROJECT["scripts"].items()]


def test_the_image_and_the_container_take_a_python_that_is_supported() -> None:
    image = (MANUAL / "packaging/Dockerfile").read_text(encoding="utf-8")
    container = json.loads((MANUAL / "packaging/devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    lowest = tuple(map(int, PROJECT["requires-python"].removeprefix(">=").split(".")))
    for text in (image, container["image"]):
        version = re.search(r"python:(\d+)\.(\d+)", text)
        assert version is not None and tuple(map(int, version.groups())) >= lowest


def test_the_map_for_language_models_names_pages_that_are_there() -> None:
    links = re.findall(r"\]\(([\w/]+)\.html\)", (MANUAL / "llms.txt").read_text(encoding="utf-8"))
    assert len(links) > 10 and [one for one in links if not (MANUAL / f"{one}.md").is_file()] == []


def test_the_number_of_effects_is_the_one_written() -> None:
    sensors = sum(effect.acts_on == "sensor" for effect in EFFECTS.values())
    assert 45 < len(EFFECTS) - sensors < 55
    assert f"{sensors} more are errors of sensors" in (MANUAL / "features.md").read_text(encoding="utf-8")
    for page in ("README.md", "CHANGELOG.md"):
        assert re.search(r"some fifty (physical )?effects", (ROOT / page).read_text(encoding="utf-8")), page


@pytest.mark.slow
def test_a_spiral_in_finer_steps_reaches_the_loop_of_stability() -> None:
    """The page says so: the width of a spiral is short by up to a step at either side."""
    from spiral_loop import spiral_width_deg

    ship = t2s.load("kvlcc2")
    turning = ship.stability(spirals=False).study.steady_turning
    assert turning is not None and turning.loop is not None
    widths = [spiral_width_deg(ship, step) for step in (1.0, 0.25)]
    exact = turning.loop.width_deg
    assert 0 < exact - widths[1] < 0.1 < exact - widths[0] < 1.0
