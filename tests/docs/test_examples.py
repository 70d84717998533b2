"""Examples of the manual, its scripts and notebooks run as they are, and print what it says."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tank2sim as t2s
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


SCRIPTS = MANUAL / "examples"
WRITTEN = {
    "autopilot": ["stability.html", "ap.html", "ap.fmu", "tuned.toml"],
    "bridge": ["poster.html", "pilot.html", "steer.html", "zigzag.html", "report.html", "compare.html"],
    "glider_and_yaw_rig": ["glide.html", "glider.fmu", "ship.toml"],
    "sea_trials": ["report/report.html", "report/report.pdf", "report/form.html", "report/full-load.toml"],
    "simulator": ["mariner.fmu", "ship.fmu", "mariner.ssp"],
    "towing_tank": ["vehicle.fmu", "model.toml", "model.covariance.json", "from_tank.toml"],
    "trials": ["found.toml", "identified.html", "gap/improved.toml"],
}


def make_trials(truth: str, folder: Path) -> None:
    subprocess.run([sys.executable, SCRIPTS / "make_trials.py", folder, truth], check=True, timeout=120)


def test_every_tutorial_has_a_script_of_less_than_60_lines() -> None:
    assert {page.stem for page in (MANUAL / "tutorials").glob("*.md")} == set(WRITTEN)
    for name in WRITTEN:
        assert len((SCRIPTS / f"{name}.py").read_text(encoding="utf-8").splitlines()) < 60


@pytest.mark.long
@pytest.mark.parametrize("name", WRITTEN)
def test_the_script_runs_and_writes(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, SCRIPTS / f"{name}.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=280
    )
    assert done.returncode == 0, done.stderr
    assert [file for file in WRITTEN[name] if not (tmp_path / file).is_file()] == []


@pytest.mark.slow
def test_identification_finds_the_truth_of_the_made_up_trials(tmp_path: Path) -> None:
    make_trials("damping", tmp_path)
    fit = t2s.identify("mariner", [tmp_path / "zigzag.csv", tmp_path / "turn.csv"], hold=["Xuuu"], members=0)
    found = fit.ship.derivatives.loc["Nr"]
    assert abs(found["value"] - -174e-5) < 3 * found["standard_error"] < 5e-5


@pytest.mark.slow
def test_the_made_up_trials_differ_by_a_current_of_half_a_metre_a_second_to_the_east(tmp_path: Path) -> None:
    make_trials("current", tmp_path)
    head, *rows = (tmp_path / "turn.csv").read_text(encoding="utf-8").splitlines()
    columns = dict(zip(head.split(","), zip(*(map(float, row.split(",")) for row in rows), strict=True), strict=True))
    orders = {key: columns[key] for key in ("t_s", "delta_order_deg")}
    still = t2s.load("mariner").steer(orders, duration_s=columns["t_s"][-1]).df
    assert columns["y_m"][-1] - still.y_m.iloc[-1] == pytest.approx(0.5 * columns["t_s"][-1], abs=2.0)
    assert columns["x_m"][-1] - still.x_m.iloc[-1] == pytest.approx(0.0, abs=2.0)


DOCS = Path(__file__).parents[2] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


def cells(path: Path, kind: str) -> list[dict]:
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == kind]


def test_there_are_five_notebooks_and_the_manual_lists_each() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    assert len(NOTEBOOKS) == 5
    assert all(f"notebooks/{path.stem}\n" in index for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_begins_with_a_title_and_keeps_no_outputs(path: Path) -> None:
    (first, *_), code = cells(path, "markdown"), cells(path, "code")
    assert "".join(first["source"]).startswith("# ")
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_from_above_to_below(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for cell in cells(path, "code"):
        exec(compile("".join(cell["source"]), path.name, "exec"), names)
    if path.stem == "sea_trials":
        found = names["fit"].ship.derivatives.loc["Nr"]  # type: ignore[attr-defined]
        assert abs(found["value"] + 174e-5) < 3 * found["standard_error"]
