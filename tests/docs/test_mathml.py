"""Formulas of the manual as the browser gets them."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from .examples import MANUAL


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
