"""``tank2sim run``: files written whole, one line for a fault."""

import csv
import json
import re
import tomllib

import numpy as np
import pytest

from tank2sim.api.captive_run import reduce_runs
from tank2sim.errors import InputError
from tank2sim.identification.captive.findings import drifting_zeros
from tank2sim.records.campaigns import read_campaign
from tests.cli.command_line import refused, tank2sim
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.made_runs import oscillation


def test_a_run_gives_coefficients_cycle_page_and_json(tmp_path):
    file = oscillation(tmp_path)
    out = {name: tmp_path / name for name in ("h.csv", "c.csv", "p.html", "r.json")}
    done = tank2sim(
        "run", file.name, "--type", "pure_yaw", "-o", "h.csv", "--cycle", "c.csv", "--page", "p.html", "--json",
        "r.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(out["h.csv"].open()))
    (first,) = [row for row in rows if (row["signal"], row["order"]) == ("Y", "1")]
    assert float(first["cos"]) == pytest.approx(25.0, abs=0.1) and float(first["sin"]) == pytest.approx(-7.0, abs=0.1)
    assert 0 < float(first["cos_error"]) < 0.05
    assert len(list(csv.DictReader(out["c.csv"].open()))) == 72
    assert json.loads(out["r.json"].read_text())["runs"][0]["periods"] == 4
    assert "Averaged cycle" in out["p.html"].read_text() and "Fourier coefficients" in out["p.html"].read_text()


def test_reduce_writes_the_uncertainty_budget(tmp_path):
    made = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path / "made")
    done = tank2sim("reduce", str(made.path), "--budget", "budget.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = {row["name"]: row for row in csv.DictReader((tmp_path / "budget.csv").open())}
    assert {"Yv", "Yvdot", "Nrdot"} <= rows.keys()
    for row in rows.values():
        shares = [float(value) for key, value in row.items() if key not in ("name", "value", "combined", "expanded")]
        assert sum(shares) == pytest.approx(1.0, abs=1e-4)
        assert float(row["expanded"]) == pytest.approx(2 * float(row["combined"]), rel=1e-4)


def test_a_steady_run_has_no_cycle_and_nothing_is_written(tmp_path):
    file = oscillation(tmp_path)
    refused(tank2sim("run", file.name, "--type", "straight", "-o", "h.csv", "--cycle", "c.csv", cwd=tmp_path), "cycle")
    assert not (tmp_path / "h.csv").exists()


def disguised(file, name, change):
    """A copy of a run's file under another name, its table changed."""
    header = file.read_text().partition("\n")[0]
    table = change(np.loadtxt(file, delimiter=",", skiprows=1))
    np.savetxt(file.with_name(name), table, delimiter=",", header=header, comments="", fmt="%.9g")
    return name


COPIES = {
    "again": lambda table: table,
    "rounded": lambda table: np.column_stack([table[:, :-3], np.round(table[:, -3:], 1)]),
    "thinned": lambda table: table[1::2],
    "begun_later": lambda table: table[60:] - np.array([table[60, 0], *[0] * (table.shape[1] - 1)]),
}


@pytest.mark.parametrize("how", COPIES)
def test_a_copy_is_no_repeat_of_a_run(tmp_path, how):
    file = oscillation(tmp_path)
    copy = disguised(file, f"{how}.csv", COPIES[how])
    with pytest.raises(InputError, match=rf"{how}\.csv.*yaw\.csv"):
        reduce_runs([file, tmp_path / copy], type="pure_yaw")


def test_a_mirror_image_is_marked_and_a_repeat_is_not(tmp_path):
    file, repeat = oscillation(tmp_path), oscillation(tmp_path, "repeat.csv")
    sides = np.array([1, -1, -1, 1, 1, -1, -1])  # t_s, psi, r, speed, X, Y, N
    image = disguised(file, "image.csv", lambda table: table * sides)
    assert reduce_runs([file, repeat], type="pure_yaw").cautions == ()
    (mark,) = reduce_runs([file, tmp_path / image], type="pure_yaw").cautions
    assert mark.leads and "image.csv" in mark and "mirror" in mark


def test_a_run_of_a_campaign_is_given_once_however_it_was_changed(tmp_path):
    made = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path / "made")
    name = tomllib.loads(made.path.read_text())["runs"][0]["file"]
    sheet = made.path.read_text().partition("[[runs]]")[2].partition("[[runs]]")[0]
    disguised(made.path.parent / name, "other.csv", COPIES["thinned"])
    made.path.write_text(made.path.read_text() + "\n[[runs]]" + sheet.replace(name, "other.csv"))
    with pytest.raises(InputError, match=rf"other\.csv.*{re.escape(name)}"):
        read_campaign(made.path)


@pytest.mark.parametrize(
    ("columns", "factor", "place"),
    [("t_s", 1000.0, "t_s"), ("speed_mps", 1000.0, "speed_mps"), ("v_mps", 1000.0, "v_mps"), ("y_m", 1000.0, "y_m")],
)
def test_a_motion_that_no_carriage_makes_is_refused(tmp_path, columns, factor, place):
    """Milliseconds and millimetres under s and m."""
    t = np.arange(0, 30.05, 0.1)
    made = {"t_s": t, "v_mps": 0.2 * np.cos(t), "speed_mps": np.full(len(t), 1.5)}
    if columns == "y_m":
        made["y_m"] = 0.2 * np.sin(t)
        del made["v_mps"]
    made |= {"X_N": -5 + 0 * t, "Y_N": 9 * np.cos(t), "N_Nm": 3 * np.cos(t)}

    def write_run(name, table):
        rows = np.column_stack(list(table.values()))
        np.savetxt(tmp_path / name, rows, delimiter=",", header=",".join(table), comments="", fmt="%.9g")
        return tmp_path / name

    assert not reduce_runs(write_run("right.csv", made), type="pure_sway").cautions
    with pytest.raises(InputError, match=rf"wrong\.csv.*{place}"):
        reduce_runs(write_run("wrong.csv", {**made, columns: factor * made[columns]}), type="pure_sway")


def test_zeros_that_drift_within_the_runs_are_said(tmp_path):
    names = [f"{number}.csv" for number in range(5)]
    files = [oscillation(tmp_path, name) for name in names]
    assert not list(drifting_zeros(reduce_runs(files, type="pure_yaw").reduced))
    for file in files:
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        table[:, 4] += 2.0 * table[:, 0] / table[-1, 0]  # X, whose mean is -9 N
        disguised(file, file.name, lambda _, table=table: table)
    (message,) = drifting_zeros(reduce_runs(files, type="pure_yaw").reduced)
    assert "X gauge" in message
    assert float(re.search(r"by (\S+) N ", message)[1]) == pytest.approx(2.0 * 4 / 4.3, rel=0.05)  # over whole periods
