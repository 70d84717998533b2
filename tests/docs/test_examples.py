"""The examples of the manual are run as they stand, and print what it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from .examples import MANUAL, alike, chosen, examples, needed, pages, prepare, run

PAGES = [page.relative_to(MANUAL).as_posix() for page in pages()]


def test_every_tutorial_has_examples() -> None:
    tutorials = {page.relative_to(MANUAL).as_posix() for page in (MANUAL / "tutorials").glob("*.md")}
    assert len(tutorials) >= 5 and tutorials <= set(PAGES)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_examples_print_what_the_manual_says(name: str, tmp_path: Path) -> None:
    page = MANUAL / name
    if "campaign/" in page.read_text(encoding="utf-8") and not needed().is_dir():
        pytest.skip(f"measured data are missing: no folder {needed()} (set TANK2SIM_DATA)")
    prepare(tmp_path)
    for example in examples(page):
        printed = run(example, tmp_path)
        if example.output is not None:
            assert alike(printed, example.output), (
                f"{example.code}\nprinted\n{printed}\nand the manual has\n{example.output}"
            )


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
