"""``--json -`` is standard output, with nothing else on it, and no other output is."""

from __future__ import annotations

import json

import pytest

from tests.cli.command_line import refused, tank2sim


@pytest.mark.parametrize(
    "arguments",
    [
        ("ships",),
        ("simulate", "mariner", "--manoeuvre", "turn:35"),
        ("influence", "mariner", "--figures", "criterion_C"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_json_on_standard_output_is_json_alone(tmp_path, arguments) -> None:
    result = tank2sim(*arguments, "--json", "-", cwd=tmp_path)
    assert result.returncode == 0 and json.loads(result.stdout)
    assert result.stderr.strip()  # the summary
    assert not list(tmp_path.iterdir())
    again = tank2sim(*arguments, cwd=tmp_path)  # and without it the summary is where it was
    assert again.stdout.strip() and not again.stderr.strip()


@pytest.mark.slow
def test_no_other_output_goes_there(tmp_path) -> None:
    refused(tank2sim("export", "mariner", "-o", "-", cwd=tmp_path), "standard output")
    assert not list(tmp_path.iterdir())
