"""``tank2sim influence`` as a user gives it."""

from __future__ import annotations

import json

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
    refused(tank2sim(*points, "--plot", "p.png", cwd=tmp_path), "--plot", "there is no chart to draw")


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
