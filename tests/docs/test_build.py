"""The manual builds without a warning, needs no network, and has what is read off the program."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tank2sim.cli import COMMANDS
from tank2sim.dynamics.effects import EFFECTS

from .examples import MANUAL

_LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*(?:src|href)=\"(?:https?:)?//", re.IGNORECASE)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="Sphinx is not installed (extra docs)")
    pytest.importorskip("myst_nb", reason="MyST is not installed (extra docs)")
    pytest.importorskip("furo", reason="Furo is not installed (extra docs)")
    folder = tmp_path_factory.mktemp("site")
    options = ["-W", "--keep-going", "-q", "-D", "nb_execution_mode=off", "-d", str(folder / "trees"), "-b", "html"]
    command = [sys.executable, "-m", "sphinx", *options]
    done = subprocess.run([*command, str(MANUAL), str(folder / "html")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.slow
def test_the_manual_builds_without_a_warning(site: Path) -> None:
    assert (site / "index.html").is_file() and (site / "search.html").is_file()


@pytest.mark.slow
def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        assert not _LOADED.search(page.read_text(encoding="utf-8")), page.name
    for style in site.rglob("*.css"):
        assert not re.search(r"url\([\"']?(https?:)?//|@import", style.read_text(encoding="utf-8")), style.name


@pytest.mark.slow
def test_formulas_are_mathml(site: Path) -> None:
    page = (site / "theory" / "hull.html").read_text(encoding="utf-8")
    assert (
        page.count("<math") > 20
        and "\\frac" not in page
        and "$" not in re.sub(r"<(pre|code|script).*?</\1>", "", page, flags=re.DOTALL)
    )


@pytest.mark.slow
def test_every_effect_and_command_is_there(site: Path) -> None:
    effects = (site / "formats" / "effects.html").read_text(encoding="utf-8")
    commands = (site / "commands.html").read_text(encoding="utf-8")
    assert all(f">{name}<" in effects for name in EFFECTS)
    assert all(f"tank2sim {name}" in commands for name in COMMANDS)
