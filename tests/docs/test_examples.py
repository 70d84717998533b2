"""The examples of the manual are run as they stand, and print what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.conftest import ROOT

from .examples import MANUAL, alike, chosen, examples, pages, prepare, run

_FOLDER = re.compile(r"`([\w-]+)/`")  # as `campaign/`: a folder in the text of a page

PAGES = [page.relative_to(MANUAL).as_posix() for page in pages()]
SHORT = ("logs.md", "python.md", "runs.md")
"""Those that run with every change."""


def test_every_tutorial_has_examples() -> None:
    tutorials = {page.relative_to(MANUAL).as_posix() for page in (MANUAL / "tutorials").glob("*.md")}
    assert len(tutorials) >= 5 and tutorials <= set(PAGES)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(page, marks=pytest.mark.essential if page in SHORT else ()) for page in PAGES]
)
def test_examples_print_what_the_manual_says(name: str, tmp_path: Path) -> None:
    page = MANUAL / name
    prepare(tmp_path)
    for example in examples(page):
        printed = run(example, tmp_path)
        if example.output is not None:
            assert alike(printed, example.output), (
                f"{example.code}\nprinted\n{printed}\nand the manual has\n{example.output}"
            )
    lost = [one for one in _FOLDER.findall(page.read_text(encoding="utf-8")) if not (tmp_path / one).is_dir()]
    assert not lost, f"folders that a reader of {name} does not have: {lost}"


@pytest.mark.parametrize("page", sorted(MANUAL.rglob("*.md")), ids=lambda page: page.relative_to(MANUAL).as_posix())
def test_files_of_the_checkout_that_a_page_names_are_there(page: Path) -> None:
    named = re.findall(r"\b(?:models|docs|benchmarks|fmu_templates)/[\w./-]*\w", page.read_text(encoding="utf-8"))
    assert [one for one in named if not (ROOT / one).exists()] == []


def test_a_wrong_number_sign_or_word_is_seen() -> None:
    printed = "┃figure ┃ unit┃\n│advance│ 596.85 m│\nspeed loss 21.8 %\nnoise 5.1e-07"
    assert alike(printed, "│advance│ 596.9 m│\n...\nnoise 4.0e-07")
    assert not alike(printed, "│advance│ 650 m│")
    assert not alike(printed, "│advance│ -596.85 m│")
    assert not alike(printed, "│transfer│ 596.85 m│")
    assert not alike(printed, "noise 5.1e-07\n...\nadvance 596.85 m")


def test_chosen_lines_are_shown_and_the_rest_is_left_out() -> None:
    text = "one\ntwo\nthree\nfour"
    assert chosen(text, "2-3") == "...\ntwo\nthree\n..."
    assert chosen(text, "1, 4") == "one\n...\nfour"
    assert chosen(text, None) == text
