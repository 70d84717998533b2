"""``tank2sim influence``, ``stability`` and ``autopilot`` as a user gives them."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.cards.covariance import Covariance, covariance_file, referring
from tank2sim.cards.covariance_reading import read_covariance
from tests.cli.command_line import refused, tank2sim


def test_influence_tells_both_coefficients_of_every_parameter(tmp_path) -> None:
    result = tank2sim(
        *("influence", "mariner", "--figures", "criterion_C", "steady_radius_m@20", "K_per_s", "T_s", "K_prime"),
        *("--joint-variation", "Yv=0.62", "Nv=1.7"),
        *("--json", "i.json", "--page", "i.html"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "i.json").read_text())
    assert "…" not in result.stdout and result.stdout.count("K %") == 2  # no digits are cut
    K = found["influence_percent"]["steady_radius_m@20"]["derivatives.Nd"]
    assert K["exact"] == pytest.approx(-7.60, abs=0.01) and K["difference"] == pytest.approx(-7.11, abs=0.01)
    assert found["figures"]["criterion_C"]["standard_error"] > 0
    assert found["agreed"]["figures"]["criterion_C"]["direct"] == pytest.approx(-1.7, abs=0.2)
    assert (tmp_path / "i.html").read_text().startswith("<!doctype html>")


def test_a_result_without_a_chart_cannot_be_drawn(tmp_path) -> None:
    points = ("influence", "mariner", "--through", "35@35", "1400m@3")
    for place in ("p.png", "charts"):
        refused(tank2sim(*points, "--plot", place, cwd=tmp_path), "--plot", "there is no chart to draw")
    assert not list(tmp_path.iterdir())


def test_a_tuned_card_is_written_and_read_again(tmp_path) -> None:
    result = tank2sim(
        *("influence", "mariner", "--tune", "steady_radius_m=640@20", "--by", "fewest", "-o", "new.toml"),
        *("--json", "t.json"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    tuned = json.loads((tmp_path / "t.json").read_text())["tuned"]
    assert tuned["reached"] is True and list(tuned["parameters"]) == ["derivatives.Nd"]
    assert tuned["parameters"]["derivatives.Nd"]["before"] == pytest.approx(-139e-5)
    assert read_card(tmp_path / "new.toml").derivatives["Nd"] == pytest.approx(
        -tuned["parameters"]["derivatives.Nd"]["after"], rel=1e-9
    )


def test_a_tuned_card_has_a_covariance_of_its_own_in_any_folder(tmp_path) -> None:
    (tmp_path / "there").mkdir()
    ship = tmp_path / "ship.toml"
    text = read_card("mariner").text + "\n[uncertainty]\nNd = 4e-5\nYv = 2e-4\nNv = 1e-4\n"
    ship.write_text(referring(text, ship))
    names = ("derivatives.Nd", "derivatives.Yv", "derivatives.Nv")
    matrix = np.array([[1.6e-9, 2e-9, 0.0], [2e-9, 4e-8, 1e-8], [0.0, 1e-8, 1e-8]])
    covariance_file(ship).write_text(Covariance(names, matrix).as_text())
    result = tank2sim(
        *("influence", "ship.toml", "--tune", "steady_radius_m=640@20", "--by", "fewest", "-o", "there/new.toml"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    reported = " ".join(result.stdout.split())
    assert "as if they were independent" in reported and "errors of the others are independent now: Nd" in reported
    found = read_covariance(read_card(tmp_path / "there" / "new.toml"))
    assert found is not None and found.names == names[1:]
    np.testing.assert_array_equal(found.matrix, matrix[1:, 1:])


def test_wishes_that_contradict_each_other_are_a_finding_unless_a_card_was_asked_for(tmp_path) -> None:
    wishes = ("influence", "mariner", "--tune", "steady_radius_m@20=640", "steady_diameter_m@20=1200")
    reported = tank2sim(*wishes, "--json", "t.json", cwd=tmp_path)
    assert reported.returncode == 0 and "contradict" in reported.stdout
    assert json.loads((tmp_path / "t.json").read_text())["tuned"]["contradiction"]
    refused(tank2sim(*wishes, "-o", "new.toml", cwd=tmp_path), "contradict", "nearest")
    assert not (tmp_path / "new.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["mariner", "--figures", "steady_radius"], ["steady_radius_m"]),
        (["mariner", "--figures", "criterion_C", "--joint-variation", "Yq=1"], ["--joint-variation", "Yq"]),
        (["mariner", "--figures", "criterion_C", "--joint-variation", "Yv=much"], ["--joint-variation", "much"]),
        (["mariner", "--figures", "criterion_C", "--joint-variation", "none.toml"], ["none.toml"]),
        (["mariner", "--tune", "criterion_C=5e-6", "--bounds", "Yv=1"], ["--bounds", "LOW..HIGH"]),
        (["mariner", "--figures", "criterion_C", "-o", "x.toml"], ["--tune"]),
        (["mariner", "--figures", "criterion_C", "--hold", "Foo"], ["--hold", "--tune"]),
        (["mariner", "--figures", "criterion_C", "--bounds", "Nr=0..1"], ["--bounds", "--tune"]),
        (["mariner", "--tune", "K_per_s=0.2", "--bounds", "Nr=1..0"], ["--bounds", "LOW below HIGH"]),
        (["mariner", "--tune", "steady_radius_m=-5@20"], ["--tune", "no ship has"]),
        (["mariner", "--through", "35@35", "20@-3", "--hold", "Nr"], ["--hold", "--through"]),
        (
            ["mariner", "--through", "35@35", "20@-3"],
            ["35 deg/min to starboard", "20 deg/min to port at 3 deg to port"],
        ),
        (["wilinski-zellman", "--figures", "criterion_C"], ["linear, abkowitz or mmg"]),
        (
            ["mariner", "--set", "derivatives.Nd=0", "--set", "derivatives.Yd=0", "--figures", "T_s"],
            ["straight course"],
        ),
    ],
)
def test_bad_input_ends_in_one_line_and_nothing_is_written(tmp_path, arguments, words) -> None:
    refused(tank2sim("influence", *arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())


def test_an_agreed_variation_can_stand_in_a_file(tmp_path) -> None:
    (tmp_path / "kc.toml").write_text("mass = 1.0\n[derivatives]\nYv = 0.62\nNr = 1.36\n")
    result = tank2sim(
        *("influence", "mariner", "--figures", "criterion_C", "--joint-variation", "kc.toml", "--json", "a.json"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    percent = json.loads((tmp_path / "a.json").read_text())["agreed"]["percent"]
    assert percent == {"rigid_body.mass": 1.0, "derivatives.Yv": 0.62, "derivatives.Nr": 1.36}


def test_a_ship_without_a_steady_speed_gets_all_the_rest_and_a_note(tmp_path) -> None:
    arguments = ["stability", "kvlcc2-captive", "--set", "derivatives.X0=0.02", "--json", "s.json", "-o", "s.html"]
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "no steady-turning diagram: keeps no steady speed" in " ".join(result.stdout.split())
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["steady_turning"] is None and found["characteristic"] is None and found["nomoto"]
    assert any("steady speed" in notice["text"] for notice in found["notices"])


def test_a_ship_that_holds_no_straight_course_is_refused_in_one_line(tmp_path) -> None:
    arguments = ["--set", "derivatives.Yd=0.0", "--set", "derivatives.Nd=0.0", "-o", "s.html"]
    refused(tank2sim("stability", "mariner", *arguments, cwd=tmp_path), "straight course")
    assert not list(tmp_path.iterdir())


def test_what_leaves_the_card_and_what_is_open_says_why_on_the_screen(tmp_path) -> None:
    result = tank2sim("stability", "kvlcc2-captive", "--no-spirals", cwd=tmp_path)
    reported = " ".join(result.stdout.split())
    assert re.search(r"advance; [^:]*: EXTRAPOLATED beyond the card", reported)
    assert "track reach: the card has no [propulsion]" in reported


@pytest.mark.slow
def test_a_linear_card_has_no_curve_over_speed_and_weather_is_reported(tmp_path) -> None:
    weather = '[{name = "current", parameters = {speed_mps = 0.5, direction_deg = 90.0}}]'
    arguments = ["--set", "model.kind=linear", "--set", f"effects={weather}", "--speed", "5.4", "--json", "s.json"]
    result = tank2sim("stability", "mariner", "--no-spirals", *arguments, "-o", "s.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["margins"]["speed"] is None and "Over the card" not in (tmp_path / "s.html").read_text()
    reported = " ".join(notice["text"] for notice in found["notices"])
    assert "do not change with speed" in reported and "in the card's current" in reported


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A PID for the Mariner with a track, an FMU and a page."""
    folder = tmp_path_factory.mktemp("autopilot")
    (folder / "track.csv").write_text("x_m,y_m\n0,0\n3000,0\n5000,2000\n")
    files = ["--track", "track.csv", "--export", "ap.fmu", "-o", "page.html", "--json", "ap.json"]
    # Towards 3.9 m/s the polynomial of this card loses its rudder.
    speeds = ["--set", "model.valid_speed_mps=[3.9, 9.3]"]
    ended = tank2sim("autopilot", "mariner", *speeds, *files, cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert "Margins" in ended.stdout and "Cross-track" in ended.stdout and "ap.fmu: FMI 2" in ended.stdout
    return folder


@pytest.mark.slow
def test_the_json_has_gains_margins_and_the_closed_loop(result: Path) -> None:
    reported = json.loads((result / "ap.json").read_text())
    assert reported["gains"]["Kp"] == pytest.approx(1.18)
    design, *others = reported["margins"]
    assert design["phase_margin_deg"] == pytest.approx(96.5, abs=0.5)
    assert design["gain_margin_dB"] is None and design["stable"] is True
    assert len(others) == 4 and design["speed_mps"] == pytest.approx(7.718, abs=1e-3)
    changes = reported["closed_loop"]["course_changes"]
    assert changes["large"]["overshoot_deg"] < changes["large without anti-windup"]["overshoot_deg"]
    assert reported["closed_loop"]["largest_steps"]["within_rate_deg"] == pytest.approx(5.0 / 1.18, rel=0.01)
    assert set(reported["track"]) == {"line of sight", "with integral"}
    assert reported["weather"]["wind_from_deg"] == 45.0
    assert any("3.9 m/s" in notice["text"] for notice in reported["notices"])


@pytest.mark.slow
def test_what_is_wrong_is_reported_in_one_line_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("x_m,y_m\n0,0\n0,0\n")
    (tmp_path / "short.csv").write_text("x_m,y_m\n0,0\n2,0\n0,9000\n")
    wrong = {
        ("wilinski-zellman",): "has no rudder",
        ("mariner", "--speed", "30"): "outside the range",
        ("mariner", "--track", "track.csv"): "same place",
        ("mariner", "--track", "none.csv"): "does not exist",
        ("mariner", "--track", "short.csv"): "short.csv: leg 1: is 2 m",
        ("mariner", "--course-change", "0"): "is 0",
        ("mariner", "--verify"): "needs --export",
        ("mariner", "--design", "fuzzy"): "fuzzy",
        ("nothing",): "nothing",
        ("mariner", "--set", "derivatives.Nd=139e-5", "--set", "derivatives.Yd=-278e-5"): "wrong way",
    }
    for arguments, words in wrong.items():
        refused(tank2sim("autopilot", *arguments, "--json", "x.json", cwd=tmp_path), words)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["short.csv", "track.csv"]


@pytest.mark.skipif(importlib.util.find_spec("slycot") is not None, reason="slycot is installed")
def test_the_robust_design_says_what_to_install(tmp_path: Path) -> None:
    refused(tank2sim("autopilot", "mariner", "--design", "robust", cwd=tmp_path), "pip install 'tank2sim[robust]'")


@pytest.mark.slow
def test_a_tanker_that_is_unstable_is_steered_and_verified_together_with_her_fmu(tmp_path: Path) -> None:
    more = ["--export", "ap.fmu", "--fmi", "3", "--verify", "--json", "ap.json", "--wave-yaw", "0.1", "--seed", "5"]
    ended = tank2sim("autopilot", "kvlcc2-captive", "--design", "lqr", *more, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    reported = json.loads((tmp_path / "ap.json").read_text())
    assert reported["export"]["co_simulation"]["order"] == pytest.approx(1.0, abs=0.1)
    assert reported["margins"][0]["gain_margin_down"] > 0.05
    assert reported["weather"]["seed"] == 5 and reported["weather"]["wave_yaw_deg"] == pytest.approx(0.1)
