"""A result has one page: the command's ``--page`` and ``report`` of its JSON give the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

import tank2sim as t2s
from tests.made_results import OWN_DOCUMENTS, RESULTS


@pytest.mark.parametrize("name", [name for name in RESULTS if name.split()[0] not in OWN_DOCUMENTS])
def test_the_command_and_report_give_the_same_page(name: str, tmp_path: Path) -> None:
    found = RESULTS[name](tmp_path)
    found.to_json(tmp_path / "result.json")
    assert t2s.make_report(tmp_path / "result.json").page() == found.page()
    assert all(section.heading for section in found.layout().sections)
