"""The README's examples are run as they stand."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command_line import tank2sim

from .conftest import DATA, ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


COMMANDS = [
    line
    for block in blocks("sh")
    for line in block.splitlines()
    if line.startswith("tank2sim ") and "my-ship" not in line
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "models", path / "models")
    subprocess.run([sys.executable, ROOT / "docs" / "examples" / "make_campaign.py", "campaign"], cwd=path, check=True)
    trials = DATA / "data" / "gap_cases" / "case_6"
    if trials.is_dir():
        shutil.copytree(trials, path / "trials")
    return path


def test_the_readme_has_exactly_two_one_line_commands_that_set_up_what_they_need() -> None:
    setting_up = [block.strip() for block in blocks("sh") if "python3 -m venv" in block]
    assert len(setting_up) == 2 and all("\n" not in block for block in setting_up)
    assert "tank2sim demo" in setting_up[0] and "pytest" in setting_up[1]


@pytest.mark.slow
def test_every_example_command_runs(folder: Path) -> None:
    assert len(COMMANDS) >= 6
    if not (folder / "trials").is_dir():
        pytest.skip(f"no trials to identify from: measured data are missing in {DATA} (set TANK2SIM_DATA)")
    for line in COMMANDS:
        done = tank2sim(*line.split()[1:], cwd=folder)
        assert done.returncode == 0, f"{line}\n{done.stderr}"


def test_the_python_example_prints_margins(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = blocks("python")
    exec(compile(example, "README.md", "exec"), {})
    gain, phase = map(float, re.findall(r"margin (-?[\d.]+|inf)", capsys.readouterr().out))
    assert gain > 1 and 0 < phase < 90


def test_every_claim_names_a_script_that_is_there() -> None:
    rows = re.findall(r"\| `benchmarks/(\w+\.py)` \|", README)
    assert rows and all((ROOT / "benchmarks" / name).is_file() for name in rows)
