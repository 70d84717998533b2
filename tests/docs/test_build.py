"""The manual builds without a warning and needs no network; its formulas are MathML."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from collections.abc import Callable
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


@pytest.fixture(scope="module")
def shown() -> Callable[[str], str]:
    """From a formula to its MathML, without blanks between the elements."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed (extra docs)")
    from docutils import nodes

    spec = importlib.util.spec_from_file_location("mathml", MANUAL / "mathml.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda formula: re.sub(r">\s+", ">", module.mathml(formula, nodes.math(), block=False))


@pytest.mark.parametrize(("formula", "accent"), [(r"\hat c_i", "ˆ"), (r"\dot\omega_i", "˙"), (r"\ddot{c}_i", "¨")])
def test_a_subscript_of_an_accented_symbol_is_next_to_it(
    shown: Callable[[str], str], formula: str, accent: str
) -> None:
    found = shown(formula)
    assert "munder" not in found
    assert re.search(rf'<msub><mover accent="true"><mi>.</mi><mo[^>]*>{accent}</mo></mover><mi>i</mi></msub>', found)


def test_limits_of_a_sum_stay_above_and_below(shown: Callable[[str], str]) -> None:
    assert "<munderover>" in shown(r"\sum_{i=1}^n x_i")


def test_functions_have_room_about_them_but_not_before_a_bracket(shown: Callable[[str], str]) -> None:
    assert shown(r"u \cos\psi").count("<mspace") == 2
    assert shown(r"\log\det V").count("<mspace") == 2
    assert shown(r"\cos(x)").count("<mspace") == shown(r"-\exp\left(x\right)").count("<mspace") == 0


@pytest.mark.parametrize("page", sorted(MANUAL.rglob("*.md")), ids=lambda page: page.relative_to(MANUAL).as_posix())
def test_fractions_have_braces(page: Path) -> None:
    r"""Docutils reads \frac12 as twelve over what follows."""
    assert not re.search(r"\\frac\s*[^\s{]", page.read_text(encoding="utf-8"))
