"""``tank2sim run`` and ``reduce``: files written whole, one line for a fault."""

import csv
import json
import math
import re
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner

from tank2sim.api.captive_run import reduce_runs
from tank2sim.api.reduction import reduce
from tank2sim.cards import read_card
from tank2sim.cli.derived import command_of
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.captive.findings import drifting_zeros
from tank2sim.records.campaigns import read_campaign
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
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


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(Campaign(seed=6, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("campaign")).path


def run(*arguments):
    result = CliRunner().invoke(command_of(reduce.verb), [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.mark.slow
@pytest.mark.parametrize("name, problem", [("dir.csv", "is a folder"), ("none.csv", "does not exist")])
def test_a_name_that_is_wrong_is_said_before_a_type_that_is_missing(tmp_path, name, problem):
    (tmp_path / "dir.csv").mkdir()
    refused(tank2sim("run", name, cwd=tmp_path), name, problem)


def test_a_missing_run_is_refused_and_nothing_is_written(tmp_path):
    faulty = write(Campaign(seed=6, size="linear", rate_hz=5.0, faults={"drift_+04": "missing"}), tmp_path / "c").path
    card = tmp_path / "card.toml"
    with pytest.raises(InputError, match=r"drift_\+04\.csv.*does not exist"):
        run(faulty, "-o", card)
    assert not card.exists()
    assert run(faulty, "-o", card, "--keep-going").exit_code == 0
    assert "left out because of a fault" in run(faulty, "--keep-going").output


def test_what_is_estimated_and_what_is_missing_is_said(path, tmp_path):
    assert "has no Xudot" in run(path).output
    filled = run(path, "--fill", "clarke1983", "-o", tmp_path / "card.toml").output
    assert "Estimated, not measured" in filled
    assert "ESTIMATED" in (tmp_path / "card.toml").read_text()


@pytest.mark.slow
def test_the_card_says_how_far_the_tests_went_and_marks_what_goes_beyond(path, tmp_path):
    card_file = tmp_path / "card.toml"
    run(path, "-o", card_file, "--fill", "clarke1983")
    campaign = tomllib.loads(path.read_text())
    runs, speed, length = campaign["runs"], campaign["test"]["speed_mps"], campaign["model"]["length_m"]
    sway = max(one.get("amplitude_m", 0.0) * one.get("frequency_radps", 0.0) for one in runs)
    drift = max(sway / speed, *(abs(math.sin(one.get("drift_rad", 0.0))) for one in runs))
    card = read_card(card_file)
    assert card.model.valid_drift_rad == pytest.approx(math.asin(drift), rel=0.05)
    assert card.model.valid_rudder_rad == pytest.approx(max(one.get("rudder_rad", 0.0) for one in runs), rel=0.01)
    rate = max(one.get("yaw_rate_amplitude_radps", 0.0) for one in runs) * length / speed
    assert card.model.valid_yaw_rate_prime == pytest.approx(rate, rel=0.05)
    hard, gentle = (simulate(build(card), Turn(math.radians(angle))).reading for angle in (35.0, 2.0))
    assert hard.outside("advance_m") and "rudder to 35 deg (card 10 deg)" in hard.how
    assert "rudder" not in gentle.how


@pytest.mark.slow
def test_a_card_at_ship_scale_tells_the_reynolds_ratio(path, tmp_path):
    shown = run(path, "--scale", "25", "-o", tmp_path / "card.toml").output
    assert "125 times the model's" in shown.replace("\n", " ")
    assert read_card(tmp_path / "card.toml").ship.length_m == pytest.approx(
        25 * read_card(_model_card(path, tmp_path)).ship.length_m, rel=1e-4
    )
    for wrong in ("ship", "0.5", "big"):
        with pytest.raises(InputError):
            run(path, "--scale", wrong)


def _model_card(path, folder):
    run(path, "-o", folder / "model.toml")
    return folder / "model.toml"


@pytest.mark.slow
@pytest.mark.parametrize("convention", ["on_gauge", "hydrodynamic"])
def test_a_wrong_force_convention_is_warned_of_before_the_numbers(path, convention):
    wrong = path.with_name(f"{convention}.toml")
    wrong.write_text(path.read_text().replace('"on_model"', f'"{convention}"'))
    shown = run(wrong).output
    assert shown.startswith("CHECK: ")
    assert shown.index("the added mass is negative") < shown.index("derivatives are measured")
    assert "CHECK: " not in run(path).output
