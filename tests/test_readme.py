"""The README: short, its examples run, its pictures and links are there; the page of benchmarks names its scripts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

from tests.docs.examples import alike, examples, prepare, run

from .conftest import ROOT

PATH = ROOT / "README.md"
README = PATH.read_text(encoding="utf-8")
BENCHMARKS = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
LINKED = [path for path in re.findall(r"\]\(([^)#]+)", README) if "://" not in path]


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def claims(page: str) -> dict[str, str]:
    """The scripts of a table of figures by claim and figure."""
    rows = re.findall(r"^\| (.+ \| .+) \| (`benchmarks/.+`) \|$", page, flags=re.MULTILINE)
    assert rows
    return dict(rows)


def test_the_readme_has_at_most_150_lines() -> None:
    assert len(README.splitlines()) <= 150


def test_the_readme_has_exactly_two_one_line_commands_that_set_up_what_they_need() -> None:
    first, *setting_up = [block.strip() for block in blocks("sh") if "python3 -m venv" in block]
    assert len(first.splitlines()) == 3 and "tank2sim simulate" in first and "tank2sim steer" in first
    assert len(setting_up) == 2 and all("\n" not in block for block in setting_up)
    assert "tank2sim demo" in setting_up[0] and "pytest" in setting_up[1]


@pytest.mark.essential
@pytest.mark.slow
def test_the_python_example_prints_what_the_readme_says(tmp_path: Path) -> None:
    prepare(tmp_path)
    shown = [example for example in examples(PATH) if "python3 -m venv" not in example.code]
    printed = [run(example, tmp_path) for example in shown]
    assert [example.language for example in shown] == ["sh", "python"]
    assert shown[-1].output is not None and alike(printed[-1], shown[-1].output), printed[-1]


def test_every_link_goes_to_a_file_that_is_there() -> None:
    assert len(LINKED) > 20
    assert [path for path in LINKED if not (ROOT / path).exists()] == []


def test_its_pictures_are_small_and_readable() -> None:
    pictures = {path for path in LINKED if path.endswith(".png")}
    assert len(pictures) == 7
    for path in pictures:
        assert (ROOT / path).stat().st_size < 150_000, path
        with Image.open(ROOT / path) as picture:
            assert picture.width >= 700, path


def test_every_claim_of_the_benchmarks_names_scripts_that_are_there() -> None:
    named = [name for commands in claims(BENCHMARKS).values() for name in re.findall(r"([\w/]+\.py)\b", commands)]
    assert len(named) >= 36 and all((ROOT / name).is_file() for name in named)


def test_the_figures_of_the_readme_are_those_of_the_benchmarks() -> None:
    figures = {row.rsplit(" | ", 1)[1] for row in claims(BENCHMARKS)}
    shown = [row.rsplit(" | ", 1)[1] for row in claims(README)]
    assert len(shown) == 5
    assert [figure for figure in shown if not any(figure in known for known in figures)] == []
