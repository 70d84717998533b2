"""``tank2sim report`` and ``tank2sim steer``."""

from __future__ import annotations

from pathlib import Path
from unittest import mock

import pytest

from tank2sim.report import steer_ship
from tests.cli.command_line import refused, tank2sim


def test_what_simulate_wrote_becomes_a_page(tmp_path: Path) -> None:
    assert tank2sim("simulate", "mariner", "--manoeuvre", "turn:35", "--json", "s.json", cwd=tmp_path).returncode == 0
    result = tank2sim("report", "s.json", "-o", "s.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    page = (tmp_path / "s.html").read_text(encoding="utf-8")
    assert "Simulated manoeuvre: Mariner class" in page and "tactical diameter" in page


@pytest.mark.parametrize(
    ("text", "said"), [('{"name": 1}', "no result"), ("{", "no JSON"), ("\xff", "no JSON"), (None, "cannot be read")]
)
def test_what_is_no_result_is_refused_in_one_line(tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / "x.json").write_text(text, encoding="latin-1")
    refused(tank2sim("report", "x.json", "-o", "x.html", cwd=tmp_path), "x.json", said, "--json")
    assert not (tmp_path / "x.html").exists()


def test_a_page_to_steer_is_written_without_the_compiler_too(tmp_path: Path) -> None:
    with mock.patch.object(steer_ship, "has_compiler", return_value=False):
        result = tank2sim("steer", "mariner", "-o", "s.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "tank2sim[platforms]" in " ".join(result.stdout.split())
    assert "tank2sim[platforms]" in (tmp_path / "s.html").read_text(encoding="utf-8")


def test_a_towed_vehicle_has_nothing_to_steer(tmp_path: Path) -> None:
    with mock.patch.object(steer_ship, "has_compiler", return_value=False):
        refused(tank2sim("steer", "wilinski-zellman", "-o", "s.html", cwd=tmp_path), "has no rudder")
    assert not (tmp_path / "s.html").exists()
