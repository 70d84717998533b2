"""``tank2sim gap`` over a folder of ships: each as if alone, and a run that was stopped goes on where it was."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.gap.improve_card import add_effects_to_card
from tank2sim.gap.result import Gap, Named
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tank2sim.simulation.trial_file import trial_csv
from tests.cli.command_line import refused, tank2sim
from tests.dask_cluster import loopback_cluster
from tests.gap import made_up

CURRENT = Named("current", {"speed_mps": 0.45, "direction_rad": -1.0}, {"speed_mps": 0.02}, 0.97)


def straight(speed_mps: float, rows: int = 100) -> str:
    """A straight run towards the north, by hand."""
    lines = (f"{t},0,{speed_mps:g},0,{speed_mps * t:g},0" for t in range(rows))
    return "\n".join(["t_s,delta_deg,u_mps,psi_deg,x_m,y_m", *lines]) + "\n"


@pytest.fixture
def ships(tmp_path: Path) -> Path:
    """Three ships, one with a name that means something else in an address."""
    card = Path(read_card("mariner").source).read_text()
    for place, name in enumerate(("alpha", "beta", "gamma ray #1")):
        folder = tmp_path / "ships" / name
        folder.mkdir(parents=True)
        (folder / "ship.toml").write_text(card.replace("Mariner class", f"Mariner {name}"))
        (folder / "slow.csv").write_text(straight(7.0 + place / 10))
        (folder / "fast.csv").write_text(straight(7.5 + place / 10))
    (tmp_path / "ships/alpha/holdout").mkdir()
    (tmp_path / "ships/alpha/holdout/held.csv").write_text(straight(7.2))
    return tmp_path / "ships"


@pytest.fixture
def finding(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Lets each ship lack a current; gives the ships that were sought. Pages are left out: they take seconds."""
    for place in ("results.gap.GapResult.page", "apps.fleet.result.FleetResult.page"):
        monkeypatch.setattr(f"tank2sim.{place}", lambda reported: f"<html>{type(reported).__name__}</html>")

    def set_up(fails: dict[str, BaseException] | None = None) -> list[str]:
        calls: list[str] = []

        def find_gap(card, fitted, held, options, progress, executor=None) -> Gap:
            name = Path(card.source).parent.name
            if fails and name in fails:
                raise fails[name]
            calls.append(name)
            assert options.max_effects == 1
            passed = tuple(
                made_up.passed(trial.name, 0.08 * len(trial.time_s), 1.0, held_out=trial in held.trials)
                for trial in (*fitted.trials, *held.trials)
            )
            improved = add_effects_to_card(
                card, [(one.name, one.parameters, one.standard_errors) for one in (CURRENT,)]
            )
            gap = replace(made_up.missing(), card=card, base=card, improved=improved, effects=(CURRENT,), passed=passed)
            return replace(gap, missing_force=None, agreement={}, figures_before=())

        monkeypatch.setattr("tank2sim.apps.fleet.run.run_gap_workflow", find_gap)
        monkeypatch.setattr("tank2sim.api.gap_search.run_gap_workflow", find_gap)
        return calls

    return set_up


ONE = ("--max-effects", "1", "--workers", "1")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def touched(folder: Path) -> dict[str, tuple[int, int]]:
    """When files were written, and which they are."""
    reported = {path: path.stat() for path in folder.rglob("*") if path.is_file()}
    return {str(path): (stat.st_mtime_ns, stat.st_ino) for path, stat in reported.items()}


@pytest.mark.slow
def test_a_fleet_has_for_each_ship_what_the_ship_alone_has(ships: Path, tmp_path: Path, finding) -> None:
    calls = finding()
    result = tank2sim("gap", "ships", "-o", "out", "--json", "f.json", *ONE, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert calls == ["alpha", "beta", "gamma ray #1"] and result.stderr == ""
    for name in list(calls):  # each call adds to it
        held = ("--holdout", f"ships/{name}/holdout/held.csv") if name == "alpha" else ()
        trials = (f"ships/{name}/fast.csv", f"ships/{name}/slow.csv")
        alone = tank2sim("gap", f"ships/{name}/ship.toml", *trials, *held, "-o", f"one/{name}", *ONE, cwd=tmp_path)
        assert alone.returncode == 0, alone.stderr
        of_fleet = contents(tmp_path / "out" / name)
        assert json.loads(of_fleet.pop("run.json"))["options"]["max_effects"] == 1
        assert of_fleet == contents(tmp_path / "one" / name)

    reported = json.loads((tmp_path / "out/fleet.json").read_text())
    assert (tmp_path / "f.json").read_text() == (tmp_path / "out/fleet.json").read_text()
    assert reported["fleet"] == "ships" and reported["verdicts"] == {"missing effect": 3}
    alpha, beta, _ = reported["ships"]
    assert alpha["name"] == "Mariner alpha" and alpha["trials"] == {"fit": 2, "holdout": 1}
    assert alpha["effects"][0]["parameters"]["speed_mps"] == 0.45 and alpha["report"] == "alpha/report.html"
    assert alpha["misfit"]["before"]["holdout"] == pytest.approx(8.0) and beta["misfit"]["before"]["holdout"] is None
    assert "gamma ray #1: computed" in result.stdout.splitlines()
    assert "ships: 3 ships (missing effect: 3)." in result.stdout.splitlines()


@pytest.mark.slow
def test_a_run_that_was_stopped_goes_on_where_it_was(ships: Path, tmp_path: Path, finding) -> None:
    arguments = ("gap", "ships", *ONE, "-o")
    finding(fails={"beta": KeyboardInterrupt()})
    stopped = tank2sim(*arguments, "out", cwd=tmp_path)
    assert stopped.returncode == 130 and "nothing is left half-written" in stopped.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"alpha"}
    before = touched(tmp_path / "out")

    calls = finding()
    assert tank2sim(*arguments, "out", cwd=tmp_path).returncode == 0
    assert calls == ["beta", "gamma ray #1"]
    assert before.items() <= touched(tmp_path / "out").items()
    assert tank2sim(*arguments, "whole", cwd=tmp_path).returncode == 0
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")


def test_a_run_killed_between_two_files_is_not_taken_for_the_one_before(
    ships: Path, tmp_path: Path, finding, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record of the run before is there, and so are its inputs again, but the results are of other inputs."""
    calls, arguments = finding(), ("gap", "ships", "-o", "out", *ONE)
    assert tank2sim(*arguments, cwd=tmp_path).returncode == 0
    whole = contents(tmp_path / "out")
    trial = ships / "beta/slow.csv"
    text = trial.read_text()
    trial.write_text(straight(7.1, 120))
    rename = Path.replace

    def killed(self: Path, target: Path) -> Path:
        if Path(target).name == "run.json":
            raise KeyboardInterrupt
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", killed)
        assert tank2sim(*arguments, cwd=tmp_path).returncode == 130
    assert contents(tmp_path / "out/beta")["gap.json"] != whole["beta/gap.json"]
    trial.write_text(text)
    calls.clear()
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0 and calls == ["beta"] and "its results were changed" in result.stdout
    assert contents(tmp_path / "out") == whole


@pytest.mark.slow
def test_what_changed_is_computed_again_and_the_rest_is_not(ships: Path, tmp_path: Path, finding) -> None:
    calls = finding()
    arguments = ("gap", "ships", "-o", "ships/out", *ONE)
    assert tank2sim(*arguments, cwd=tmp_path).returncode == 0
    (ships / "beta/slow.csv").write_text(straight(7.7))
    shutil.rmtree(ships / "gamma ray #1")
    calls.clear()
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0 and calls == ["beta"]
    assert "computed: the trials were changed" in result.stdout and "taken from the earlier run" in result.stdout
    assert "ships/out/gamma ray #1 is of an earlier run, and its ship is not in the fleet" in result.stdout
    calls.clear()
    assert tank2sim(*arguments, "--again", cwd=tmp_path).returncode == 0 and calls == ["alpha", "beta"]
    calls.clear()
    assert tank2sim(*arguments, "--without", "wind", cwd=tmp_path).returncode == 0 and calls == ["alpha", "beta"]


def test_bad_ships_are_reported_at_the_end_and_the_others_are_kept(ships: Path, tmp_path: Path, finding) -> None:
    (ships / "beta/ship.toml").write_text('format = "tank2sim-ship/1"\n[ship\n')
    (ships / "empty").mkdir()
    torn = ships / "gamma ray #1/slow.csv"
    torn.write_text(straight(7.0) + "101,x,7,0,0,0\n")
    finding()
    result = tank2sim("gap", "ships", "-o", "out", *ONE, cwd=tmp_path)
    assert result.returncode == 2 and "Traceback" not in result.stderr
    card, trial = result.stderr.splitlines()
    assert card.startswith("tank2sim: beta: ships/beta/ship.toml: line 2") and "correct the TOML" in card
    assert trial.startswith("tank2sim: gamma ray #1: ships/gamma ray #1/slow.csv: ")
    assert "ships/empty: holds neither card nor trial, and was passed over" in result.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"alpha", "fleet.json", "fleet.html"}
    reported = json.loads((tmp_path / "out/fleet.json").read_text())
    assert reported["verdicts"] == {"missing effect": 1}
    assert {one["folder"] for one in reported["ships"] if one["fault"]} == {"beta", "gamma ray #1"}
    torn.write_text(straight(7.0))
    calls = finding()
    assert tank2sim("gap", "ships", "-o", "out", *ONE, cwd=tmp_path).returncode == 2 and calls == ["gamma ray #1"]


def test_a_folder_that_holds_a_card_is_one_ship(ships: Path, tmp_path: Path, finding) -> None:
    calls = finding()
    result = tank2sim("gap", "ships/alpha", "-o", "out", *ONE, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert calls == ["alpha"] and "was taken for one ship" in result.stdout
    reported = json.loads((tmp_path / "out/gap.json").read_text())
    assert [one["trial"] for one in reported["trials"] if one["held_out"]] == ["held.csv"]
    assert not (tmp_path / "out/run.json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["ships", "--holdout", "ships/alpha/holdout/held.csv", "-o", "out"],
            ["--holdout", "folder of ships"],
        ),
        (["ships", "ships/alpha/slow.csv", "-o", "out"], ["trials", "does not go with a folder of ships"]),
        (["ships", "-o", "ships"], ["ships", "of its own"]),
        (["ships", "-o", "ships/beta"], ["ships/beta", "of its own"]),
        (["ships/alpha/holdout", "-o", "out"], ["holds no ship"]),
        (["ships", "-o", "out", "--effects", "curent"], ["did you mean current"]),
        (["ships", "-o", "out", "--executor", "threads"], ["is not an executor"]),
        (["ships", "-o", "out", "--json", "no/f.json"], ["no/f.json", "folder does not exist"]),
        (["ships", "-o", "file"], ["file", "not a folder"]),
    ],
)
def test_what_a_fleet_cannot_be_asked_is_one_line_and_nothing_is_written(
    ships: Path, tmp_path: Path, finding, arguments: list[str], words: list[str]
) -> None:
    calls = finding()
    (tmp_path / "file").write_text("no folder")
    before = contents(tmp_path)
    refused(tank2sim("gap", *arguments, *ONE, cwd=tmp_path), *words)
    assert contents(tmp_path) == before and not (tmp_path / "out").exists() and not calls


def test_no_card_is_overwritten_by_the_results_of_its_ship(ships: Path, tmp_path: Path, finding) -> None:
    """FOLDER inside DIR: a ship that is called like it would have its results next to the cards."""
    calls = finding()
    (tmp_path / "out").mkdir()
    (ships / "alpha/ship.toml").rename(ships / "alpha/improved.toml")
    (tmp_path / "out/alpha").symlink_to(ships / "alpha")
    result = tank2sim("gap", "ships", "-o", "out", *ONE, cwd=tmp_path)
    assert result.returncode == 2 and "improved.toml: is an input" in result.stderr
    assert calls == ["beta", "gamma ray #1"]


# -- the real search, in processes ---------------------------------------------------------------------------------


NOISE = {"u_mps": 0.03, "v_mps": 0.03, "r_degps": 0.01, "psi_deg": 0.1, "x_m": 0.5, "y_m": 0.5}


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two ships in a current that their cards lack: trials by our own simulation, a reading each two seconds."""
    home = tmp_path_factory.mktemp("fleet")
    text = Path(read_card("mariner").source).read_text()
    chance = np.random.default_rng(3)
    for name, speed, manoeuvres in (("alpha", 0.5, ("turn:35",)), ("beta", 0.3, ("turn:-35",))):
        folder = home / "ships" / name
        (folder / "holdout").mkdir(parents=True)
        (folder / "ship.toml").write_text(text)
        current = f'\n[[effects]]\nname = "current"\n[effects.parameters]\nspeed_mps = {speed}\ndirection_deg = 90.0\n'
        (home / "real.toml").write_text(text + current)
        model = build(read_card(home / "real.toml"))
        for place, manoeuvre in enumerate((*manoeuvres, "zigzag:20/20")):
            run = simulate(model, parse_manoeuvre(manoeuvre), duration_s=200.0)
            lines = [line for line in trial_csv(run.trajectory, name).splitlines() if not line.startswith("#")]
            heads = lines[0].split(",")
            rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1::20]])
            for head, sigma in NOISE.items():
                rows[:, heads.index(head)] += sigma * chance.standard_normal(len(rows))
            target = folder / ("holdout" if place == len(manoeuvres) else "") / f"trial_{place}.csv"
            np.savetxt(target, rows, delimiter=",", header=lines[0], comments="", fmt="%.6g")
    return home


SOUGHT = ("gap", "ships", "--effects", "current", "--max-effects", "1")


@pytest.fixture(scope="module")
def whole(drifting: Path) -> dict[str, bytes]:
    """What one process makes of both, without a break."""
    result = tank2sim(*SOUGHT, "--workers", "1", "-o", "whole", cwd=drifting)
    assert result.returncode == 0, result.stderr
    reported = json.loads((drifting / "whole/fleet.json").read_text())
    assert [[effect["name"] for effect in one["effects"]] for one in reported["ships"]] == [["current"], ["current"]]
    return contents(drifting / "whole")


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="dask[distributed] is missing")
def test_a_cluster_that_sees_no_file_of_ours_gives_the_same_to_the_bit(
    drifting: Path, whole: dict[str, bytes], tmp_path: Path
) -> None:
    with loopback_cluster(tmp_path) as cluster:
        option = cluster.with_workers(1).option
        result = tank2sim(*SOUGHT, "--executor", option, "-o", "there", cwd=drifting)
    assert result.returncode == 0, result.stderr
    assert contents(drifting / "there") == whole


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="processes of a process are asked of Linux")
def test_a_killed_run_goes_on_and_gives_the_uninterrupted_result_to_the_bit(
    drifting: Path, whole: dict[str, bytes]
) -> None:
    """Two processes with a ship each, killed when one is written, and their parent with them."""
    out = drifting / "out"
    command = [sys.executable, "-c", "from tank2sim.cli import main; main()", *SOUGHT, "--workers", "2", "-o", "out"]
    run = subprocess.Popen(command, cwd=drifting, start_new_session=True, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 120
        while not (written := list(out.glob("*/run.json"))):
            assert run.poll() is None and time.monotonic() < until, "a ship is written"
            time.sleep(0.02)
        workers = _children(run.pid)
        run.kill()
        run.wait(10)
        assert len(written) == 1 and not (out / "fleet.json").exists()
        before = touched(out)
        until = time.monotonic() + 10
        while any(map(_alive, workers)):
            assert time.monotonic() < until, "its workers do not outlive it"
            time.sleep(0.05)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    resumed = tank2sim(*SOUGHT, "--workers", "1", "-o", "out", cwd=drifting)
    assert resumed.returncode == 0, resumed.stderr
    assert resumed.stdout.count("taken from the earlier run") == 1
    assert before.items() <= touched(out).items()
    assert contents(out) == whole


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
