"""The sign test of one-sided errors against probabilities by hand, and rudders of the other sign."""

from __future__ import annotations

import json
import math
import sys
import tomllib

import numpy as np
import pytest

from tank2sim.analysis.validation.one_sided import one_sided_errors
from tank2sim.analysis.validation.study import TURN_FIGURES, ZIGZAG_FIGURES, Validated
from tank2sim.bundled import bundled_cards
from tank2sim.cli import main

FAMILIES = (TURN_FIGURES, ZIGZAG_FIGURES)
TIME, FIRST, SECOND = "initial_turning_time_s", "overshoot_1_deg", "overshoot_2_deg"


def figures(name: str, errors: list[float], measured: float = 40.0) -> list[Validated]:
    return [
        Validated(f"z{number}", "zigzag", name, measured, measured + error, 0.0, 5.0, 5.0)
        for number, error in enumerate(errors)
    ]


def test_a_time_that_is_too_short_in_eight_of_eight_zigzags_is_reported_though_each_is_within_its_uncertainty() -> None:
    errors = [-1.0, -2.0, -3.0, -1.0, -2.0, -3.0, -1.0, -3.0]
    balanced = [1.0, -1.0] * 4
    all_figures = [*figures(TIME, errors), *figures(FIRST, balanced), *figures(SECOND, balanced)]
    assert {figure.outcome.value for figure in all_figures} <= {"validated", "too uncertain"}
    (found,) = one_sided_errors(all_figures, FAMILIES)
    assert (found.name, found.trials, found.same_side) == (TIME, 8, 8)
    assert found.mean_error == pytest.approx(-2.0) and found.mean_percent == pytest.approx(-5.0)
    assert found.sign_probability == pytest.approx(2 / 256)
    assert found.probability == pytest.approx(3 * 2 / 256)  # three figures have eight trials each
    text = str(found.notice)
    assert "too small in 8 of 8" in text and "-2 s" in text


def test_one_to_the_other_side_of_nine_is_nine_and_one_of_five_hundred_and_twelve() -> None:
    (found,) = one_sided_errors(figures(TIME, [1.0] * 8 + [-1.0]), FAMILIES)
    assert found.same_side == 8 and found.mean_error > 0
    assert found.probability == pytest.approx(2 * (1 + 9) / 512)  # alone in its family
    assert one_sided_errors(figures(TIME, [1.0] * 7 + [-1.0]), FAMILIES) == ()  # 2 (1 + 8)/256 = 0.07


def test_few_trials_say_nothing_and_do_not_weaken_the_figures_of_many() -> None:
    assert one_sided_errors(figures(TIME, [-1.0] * 5), FAMILIES) == ()  # 2/32
    many = [
        *figures(TIME, [-1.0] * 6),
        *(each for name in (FIRST, SECOND) for each in figures(name, [1.0, -1.0] * 2 + [1.0])),
    ]
    (found,) = one_sided_errors(many, FAMILIES)
    assert found.probability == pytest.approx(2 / 64)  # five trials can never be significant


def test_the_second_figure_is_corrected_for_one_figure_less() -> None:
    """Holm: the smallest of two probabilities counts twice, the other once, and not less than the first."""
    both = [*figures(TIME, [-1.0] * 9), *figures(FIRST, [2.0] * 8)]
    first, second = one_sided_errors(both, FAMILIES)
    assert (first.name, second.name) == (TIME, FIRST) and second.mean_error > 0
    assert first.probability == pytest.approx(2 * 2 / 512)
    assert second.probability == pytest.approx(2 / 256)


def test_a_figure_that_no_simulation_reached_is_left_out() -> None:
    lost = [Validated("z", "zigzag", TIME, 40.0, None)] * 3
    (found,) = one_sided_errors([*figures(TIME, [-1.0] * 6), *lost], FAMILIES)
    assert found.trials == 6


def test_errors_without_a_side_are_reported_in_less_than_one_of_twenty_validations() -> None:
    random = np.random.default_rng(1)
    reports = 0
    for _ in range(400):
        drawn = [each for name in ZIGZAG_FIGURES for each in figures(name, random.standard_normal(8).tolist())]
        reports += bool(one_sided_errors(drawn, FAMILIES))
    assert reports / 400 < 0.05 + 2 * math.sqrt(0.05 * 0.95 / 400)


@pytest.mark.slow
@pytest.mark.parametrize(("ship", "other"), [("mariner", "kvlcc2-captive"), ("kvlcc2-captive", "mariner")])
def test_compare_and_influence_show_the_rudder_derivatives_of_the_card(ship, other, tmp_path, monkeypatch) -> None:
    stated = tomllib.loads(bundled_cards()[ship].read_text())["derivatives"]
    runs = {
        "compare": ["compare", ship, other, "--members", "0"],
        "influence": ["influence", ship, "--figures", "criterion_C"],
    }
    found = {}
    for name, arguments in runs.items():
        monkeypatch.setattr(sys, "argv", ["tank2sim", *arguments, "--json", str(tmp_path / "x.json")])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0
        found[name] = json.loads((tmp_path / "x.json").read_text())
    rows = {row["name"]: row["cards"] for row in found["compare"]["coefficients"]}
    for derivative in ("Yd", "Nd", "Nddd", "Ydu", "Xdd", "Nv"):
        assert rows[derivative][0]["value"] == pytest.approx(stated[derivative])
        assert found["influence"]["parameters"][f"derivatives.{derivative}"]["value"] == pytest.approx(
            stated[derivative]
        )
    # the other card's file has the other sign: turned to that of the first
    assert rows["Nd"][1]["value"] * stated["Nd"] > 0
