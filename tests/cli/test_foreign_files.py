"""A campaign or a card from elsewhere may name any file of this machine: no message shows what is in it."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tank2sim.bundled import bundled
from tests.cli.command_line import refused, tank2sim
from tests.corpus.inputs import plain
from tests.marks import first_fast

SECRET = "SECRET,root:x:0:0\n1,SECRET\nSECRET,2\n"


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """A file that is none of ours, next to the folder in which the inputs are."""
    for name, content in plain().items():
        (tmp_path / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / name).write_bytes(content)
    path = tmp_path / "secret"
    path.write_text(SECRET)
    return path


def _naming(folder: Path, campaign: str, named: str) -> None:
    """Let the first file that a campaign names be another."""
    path = folder / campaign
    changed, count = re.subn(r'(?m)^file = ".*?"', f'file = "{named}"', path.read_text(), count=1)
    assert count == 1
    path.write_text(changed)


@first_fast("named", ["{path}", "../secret", "../../secret", "./sub/../../secret", "link.csv"])
@first_fast("campaign, command", [
    ("captive.toml", ("reduce", "captive.toml", "-o", "out.toml")),
    ("tank/campaign.toml", ("reduce", "tank/campaign.toml", "-o", "out.toml")),
    ("tank/campaign.toml", ("reduce", "tank/campaign.toml", "--keep-going")),
])  # fmt: skip
def test_a_campaign_shows_nothing_of_a_foreign_file(
    campaign: str, command: tuple[str, ...], named: str, foreign: Path
) -> None:
    folder = foreign.parent / "in"
    (folder / campaign).parent.joinpath("link.csv").symlink_to(foreign)
    if named == "../secret" and campaign.startswith("tank"):
        named = "../../secret"
    _naming(folder, campaign, named.format(path=foreign))
    done = tank2sim(*command, cwd=folder)
    assert "SECRET" not in done.stderr + done.stdout and "root:x" not in done.stderr + done.stdout
    if "--keep-going" not in command:
        refused(done)
        assert "secret" in done.stderr or "link.csv" in done.stderr
        assert not (folder / "out.toml").exists()


def test_a_file_of_the_campaign_is_still_explained(foreign: Path) -> None:
    folder = foreign.parent / "in"
    (folder / "own.csv").write_text(SECRET)
    _naming(folder, "captive.toml", "own.csv")
    refused(tank2sim("reduce", "captive.toml", "-o", "out.toml", cwd=folder), "SECRET")


@pytest.mark.skipif(os.name != "posix", reason="needs devices and pipes")
@pytest.mark.parametrize("named", ["/dev/zero", "pipe", "/dev/stdin", ".."])
def test_a_file_that_never_ends_is_not_read(named: str, foreign: Path) -> None:
    folder = foreign.parent / "in"
    os.mkfifo(folder / "pipe")
    _naming(folder, "captive.toml", named)
    refused(tank2sim("reduce", "captive.toml", "-o", "out.toml", cwd=folder), "is not a file")


@pytest.mark.parametrize(
    "content", [SECRET, '{"format": "SECRET"}', '{"format": "tank2sim-covariance/1", "names": ["SECRET"]}']
)
def test_a_card_shows_nothing_of_a_foreign_covariance(content: str, foreign: Path) -> None:
    foreign.write_text(content)
    text = (bundled("models") / "mariner" / "ship.toml").read_text()
    (foreign.parent / "in" / "ship.toml").write_text(f"# covariance: {foreign}\n{text}")
    options = ("--manoeuvre", "turn:35", "--members", "4")
    done = tank2sim("simulate", "ship.toml", *options, cwd=foreign.parent / "in")
    refused(done, str(foreign))
    assert "SECRET" not in done.stderr
