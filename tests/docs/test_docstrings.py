"""The examples in the docstrings of the package are true."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import tank2sim

SOURCE = Path(tank2sim.__file__).parent

LENGTHY = {
    "tank2sim.analysis.stability.study",
    "tank2sim.answer.parts",
    "tank2sim.api.audit",
    "tank2sim.api.identification",
    "tank2sim.api.stability",
    "tank2sim.apps.design.command",
    "tank2sim.apps.design.result",
    "tank2sim.apps.guess.command",
    "tank2sim.apps.steering_cards.result",
    "tank2sim.apps.trial_office.command",
    "tank2sim.results.fmu",
}
"""Modules whose examples take a second and more."""


def with_examples() -> list[str]:
    files = [path for path in sorted(SOURCE.rglob("*.py")) if ">>> " in path.read_text(encoding="utf-8")]
    names = [".".join(path.relative_to(SOURCE.parent).with_suffix("").parts) for path in files]
    return [name.removesuffix(".__init__") for name in names]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LENGTHY else ()) for name in with_examples()]
)
def test_examples_in_docstrings_are_true(name: str, tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    report: list[str] = []
    for found in doctest.DocTestFinder().find(importlib.import_module(name)):
        runner.run(found, out=report.append)
    assert runner.tries and not runner.failures, "".join(report)
