"""Numbers at the edges, one at a time: refused in one line that names the file and the place."""

from __future__ import annotations

import json

import pytest

from tests.cli.command_line import refused, tank2sim
from tests.corpus.inputs import plain


@pytest.fixture
def folder(tmp_path):
    for name, content in plain().items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    return tmp_path


def changed(path, column: str, factor: float) -> None:
    lines = path.read_text().splitlines()
    head = next(number for number, line in enumerate(lines) if not line.startswith("#"))
    place = lines[head].split(",").index(column)
    for number in range(head + 1, len(lines)):
        cells = lines[number].split(",")
        cells[place] = repr(float(cells[place] or 0) * factor)
        lines[number] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(("column", "factor"), [("t_s", 1e200), ("t_s", 1e-200), ("u_mps", 1e200), ("r_degps", -1e200)])
def test_a_trial_of_impossible_numbers_is_refused_by_column(folder, column, factor):
    changed(folder / "zigzag.csv", column, factor)
    refused(tank2sim("audit", "zigzag.csv", cwd=folder), "zigzag.csv", column)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("column", "factor"), [("t_s", 1e200), ("t_s", 1e-200), ("speed_2_mps", 1e200), ("speed_2_mps", 1e5)]
)
def test_tows_of_impossible_numbers_are_refused_by_column(folder, column, factor):
    changed(folder / "tows.csv", column, factor)
    refused(tank2sim("tow", "tows.csv", cwd=folder), "tows.csv", column)


@pytest.mark.parametrize("value", ["1e300", "-1e6", "9" * 400])
def test_a_derivative_that_no_hull_has_is_refused_by_its_key(folder, value):
    text = (folder / "card.toml").read_text().replace("Yv = -1160e-5", f"Yv = {value}")
    (folder / "card.toml").write_text(text)
    refused(tank2sim("stability", "card.toml", "--no-spirals", cwd=folder), "card.toml", "derivatives.Yv")


def test_a_motion_that_leaves_all_bounds_names_the_card(folder):
    text = (
        (folder / "card.toml")
        .read_text()
        .replace("Nddd = ", "Nddd = 9000  # ")
        .replace("Nvvv = 1636e-5", "Nvvv = 9000")
    )
    (folder / "card.toml").write_text(text)
    refused(tank2sim("simulate", "card.toml", "--manoeuvre", "turn:35", "--duration", "60", cwd=folder), "card.toml")


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_captive_run_that_is_all_zero_is_refused_by_its_file(folder):
    path = folder / "tank" / "rudder_-10.csv"
    lines = path.read_text().splitlines()
    zero = [",".join([line.split(",")[0], *["0"] * line.count(",")]) for line in lines[1:]]
    path.write_text("\n".join([lines[0], *zero]) + "\n")
    refused(tank2sim("reduce", "tank/campaign.toml", cwd=folder), "rudder_-10.csv")


@pytest.mark.slow
def test_one_bad_time_among_good_ones_asks_for_no_gigabytes(folder):
    path = folder / "zigzag.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, ",".join(["1.6e9", *lines[-1].split(",")[1:]])]) + "\n")
    result = tank2sim("identify", "card.toml", "zigzag.csv", "--members", "0", cwd=folder)
    assert result.returncode in (0, 2) and "t_s" in result.stdout + result.stderr, result  # named, and left out


@pytest.mark.parametrize("value", ["1e300", "1e200"])
def test_a_waypoint_beyond_the_earth_is_refused_by_its_file(folder, value):
    (folder / "track.csv").write_text(f"x_m,y_m\n0,0\n{value},0\n")
    refused(tank2sim("autopilot", "card.toml", "--track", "track.csv", cwd=folder), "track.csv")


def test_a_run_of_months_is_refused_by_the_option(folder):
    refused(tank2sim("simulate", "card.toml", "--manoeuvre", "turn:35", "--duration", "1e6", cwd=folder), "--duration")


@pytest.mark.parametrize(
    "text",
    ['{"kind": "\\ud800"}', '{"a": ' + "1" * 5000 + "}", "[" * 100000, '{"a": [1, ', "\x00"],
    ids=["half a character", "integer of 5000 digits", "nested", "cut", "binary"],
)
def test_a_result_that_is_no_json_for_a_page_is_refused_by_its_file(folder, text):
    (folder / "result.json").write_text(text)
    refused(tank2sim("report", "result.json", "-o", "page.html", cwd=folder), "result.json")
    assert not (folder / "page.html").exists()


def test_a_notice_that_is_no_text_is_refused_by_its_key(folder):
    assert tank2sim("influence", "card.toml", "--figures", "K_per_s", "--json", "i.json", cwd=folder).returncode == 0
    content = json.loads((folder / "i.json").read_text())
    (folder / "i.json").write_text(json.dumps({**content, "notices": [1.5]}))
    refused(tank2sim("report", "i.json", "-o", "page.html", cwd=folder), "i.json", "notices")
