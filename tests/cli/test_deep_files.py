"""Files that are nested without end, never end, or are of others: refused, and nothing of them is shown."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tank2sim.bundled import bundled
from tests.cli.command_line import refused, tank2sim
from tests.corpus.inputs import plain
from tests.marks import first_fast

DEPTHS = (150, 900, 5000, 100_000)


def _nested(depth: int, opening: str = "[", closing: str = "]") -> str:
    return opening * depth + closing * depth


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("schema", ["simulate", "stability", "tow", "identify", "validate", "gap"])
def test_a_result_that_is_nested_without_end_is_refused(schema: str, depth: int, tmp_path: Path) -> None:
    result = f'{{"schema": "tank2sim/{schema}/1", "ship": "x", "unknown": {_nested(depth)}}}'
    (tmp_path / "r.json").write_text(result)
    refused(tank2sim("report", "r.json", "-o", "p.html", cwd=tmp_path), "r.json", "nested")
    assert not (tmp_path / "p.html").exists()


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize(
    "arguments",
    [
        ("influence", "mariner", "--joint-variation", "deep.toml"),
        ("influence", "deep.toml"),
        ("simulate", "deep.toml", "--manoeuvre", "turn:35"),
        ("convention", "deep.toml"),
        ("reduce", "deep.toml"),
        ("design", "mariner", "--tank", "deep.toml"),
        ("design", "mariner", "--usual", "deep.toml"),
        ("yaw", "made.csv", "--simulate", "deep.toml"),
        ("log", "deep.toml", "--channels", "deep.toml", "-o", "voyage"),
        ("steer", "mariner", "--scenario", "deep.json", "-o", "p.html"),
    ],
)
def test_a_file_that_is_nested_without_end_is_refused(arguments: tuple[str, ...], depth: int, tmp_path: Path) -> None:
    (tmp_path / "deep.toml").write_text(f"a = {_nested(depth)}\n")
    (tmp_path / "deep.json").write_text(_nested(depth, '{"a":[', "]}").replace("[]", "[1]"))
    refused(tank2sim(*arguments, cwd=tmp_path), "deep")


def test_a_value_of_set_that_is_nested_without_end_is_refused(tmp_path: Path) -> None:
    for value in (_nested(5000), "1" * 5000, "{" * 5000):
        options = ("--set", f"model.speed_mps={value}", "--manoeuvre", "turn:35")
        refused(tank2sim("simulate", "mariner", *options, cwd=tmp_path), "model.speed_mps")


def _ship_with(tmp_path: Path, covariance: str) -> None:
    text = (bundled("models") / "mariner" / "ship.toml").read_text()
    (tmp_path / "ship.toml").write_text(f"# covariance: ship.covariance.json\n{text}")
    names = ["derivatives.Yv", "derivatives.Nr"]
    content = f'{{"format": "tank2sim-covariance/1", "names": {json.dumps(names)}, {covariance}}}'
    (tmp_path / "ship.covariance.json").write_text(content)


@pytest.mark.parametrize(
    "rows",
    [
        "[[true, 0], [0, 1e-6]]",
        '[["1e-6", 0], [0, 1e-6]]',
        "[[1e-6, null], [null, 1e-6]]",
        "[[1e-6, 0], [0]]",
        "[1e-6, 1e-6]",
        "true",
        "{}",
        f"[[{'9' * 400}, 0], [0, 1e-6]]",
        f"[[{'9' * 5000}, 0], [0, 1e-6]]",
        "[[NaN, 0], [0, 1e-6]]",
        "[[1e999, 0], [0, 1e-6]]",
        "[[-1e-6, 0], [0, 1e-6]]",
        _nested(300),
        _nested(50_000),
    ],
)
def test_a_covariance_that_is_no_matrix_of_numbers_is_refused(rows: str, tmp_path: Path) -> None:
    _ship_with(tmp_path, f'"covariance": {rows}')
    options = ("--manoeuvre", "turn:35", "--members", "4")
    refused(tank2sim("simulate", "ship.toml", *options, cwd=tmp_path), "ship.covariance.json")


@pytest.mark.parametrize("rows", ["[[true, false], [false, true]]", '[["0", 0], [0, 0]]', "true"])
def test_samples_of_a_covariance_that_are_no_numbers_are_refused(rows: str, tmp_path: Path) -> None:
    _ship_with(tmp_path, f'"covariance": [[1e-6, 0], [0, 1e-6]], "samples": {rows}')
    options = ("--manoeuvre", "turn:35", "--members", "4")
    refused(tank2sim("simulate", "ship.toml", *options, cwd=tmp_path), "ship.covariance.json", "samples")


@first_fast(
    "command",
    [
        pytest.param(command, id=command[0])
        for command in (("simulate", "--manoeuvre", "turn:35"), ("stability", "--no-spirals"), ("influence",))
    ],
)
def test_an_ensemble_without_one_ship_that_sails_is_refused(command: tuple[str, ...], tmp_path: Path) -> None:
    name, *options = command
    _ship_with(tmp_path, '"covariance": [[1e300, 0], [0, 1e300]]')
    refused(tank2sim(name, "ship.toml", *options, "--members", "4", cwd=tmp_path), "ship.covariance.json")
    _ship_with(tmp_path, '"covariance": [[9e7, 0], [0, 9e7]]')
    done = tank2sim(name, "ship.toml", *options, "--members", "2", "--seed", "3", cwd=tmp_path)
    assert done.returncode in (0, 2) and "fault of the program" not in done.stderr


_CLOSED = """
import os, sys
for number in {closed}:
    os.close(number)
os.execv(sys.executable, [sys.executable, "-m", "tank2sim", {arguments}])
"""


@first_fast(
    "closed, arguments, code",
    [
        ((1,), ("ships",), 0),
        ((2,), ("ships",), 0),
        ((0, 1, 2), ("ships",), 0),
        ((1,), ("--help",), 0),
        ((1,), ("stability", "mariner", "--no-spirals", "--json", "s.json"), 0),
        ((1,), ("stability", "mariner", "--no-spirals", "--json", "-"), 2),
        ((2,), ("stability", "mariner", "--no-spirals", "--json", "s.json"), 0),
        ((1, 2), ("stability", "nowhere"), 2),
    ],
)
def test_closed_streams_are_no_fault(
    closed: tuple[int, ...], arguments: tuple[str, ...], code: int, tmp_path: Path
) -> None:
    text = _CLOSED.format(closed=closed, arguments=", ".join(map(repr, arguments)))
    done = subprocess.run([sys.executable, "-c", text], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr and "fault of the program" not in done.stderr
    if "s.json" in arguments:
        assert json.loads((tmp_path / "s.json").read_text())["schema"] == "tank2sim/stability/1"


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("stream, arguments, code", [("stdout", ("ships",), 2), ("stderr", ("nowhere",), 2)])
def test_a_full_stream_is_no_fault(stream: str, arguments: tuple[str, ...], code: int) -> None:
    with open("/dev/full", "w") as full:
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: full}
        done = subprocess.run([sys.executable, "-m", "tank2sim", *arguments], text=True, check=False, **streams)
    assert done.returncode == code and "Traceback" not in f"{done.stdout}{done.stderr}"


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
