"""Influence on a ship's figures, against closed forms of a linear ship and against differences of high order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.analysis.influence.card_influence import influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.stability.straight_line import stability
from tank2sim.cards import linear_card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tests.analysis.symmetric_ship import SYMMETRIC

LINEAR_FIGURES = ("criterion_C", "K_prime", "steady_radius_m@10", "steady_rate_degps@10", "steady_drift_deg@-10")
SIMULATED = (
    "advance_m@35",
    "tactical_diameter_m@35",
    "time_180_s@35",
    "overshoot_1_deg@20/20",
    "initial_turning_distance_m@10/10",
)


def study_of(card, *texts: str) -> Study:
    return Study(card, [parse_figure(text) for text in texts])


@pytest.fixture(scope="module")
def linear_study() -> Study:
    return study_of(linear_card(read_card("mariner", SYMMETRIC)), *LINEAR_FIGURES)


@pytest.fixture(scope="module")
def simulated() -> Study:
    return study_of(read_card("mariner"), *SIMULATED)


def place(study: Study, short: str) -> int:
    return [one.short for one in study.parameters].index(short)


def closed_form(d: dict[str, float], rudder_deg: float) -> dict[str, float]:
    """Criterion, K' and steady turn of a ship with linear Y and N, "total" yaw terms, and u = u0."""
    L, u0, delta = 160.93, 7.7175, math.radians(rudder_deg)
    C = d["Yv"] * d["Nr"] - d["Nv"] * d["Yr"]
    r = (d["Nv"] * d["Yd"] - d["Yv"] * d["Nd"]) / C * delta
    v = (d["Yr"] * d["Nd"] - d["Nr"] * d["Yd"]) / C * delta
    U = u0 * math.hypot(1.0, v)
    return {
        "criterion_C": C,
        "K_prime": r / delta,
        "steady_radius_m": U / abs(r * u0 / L),
        "steady_rate_degps": math.degrees(r * u0 / L),
        "steady_drift_deg": -math.degrees(math.asin(v * u0 / U)),
    }


def test_figures_and_both_K_of_a_linear_ship_are_those_of_its_closed_form(linear_study) -> None:
    d = dict(linear_study.card.derivatives)
    result = influence(linear_study)
    for row, text in enumerate(LINEAR_FIGURES):
        name, _, argument = text.partition("@")

        def form(changed: dict[str, float], name: str = name, argument: str = argument) -> float:
            return closed_form(changed, float(argument or 1))[name]

        assert result.values[row] == pytest.approx(form(d), rel=1e-9)
        for coefficient in ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd"):
            column = place(linear_study, coefficient)

            def at(factor: float, coefficient: str = coefficient, form=form) -> float:
                return form(d | {coefficient: factor * d[coefficient]})

            h = 1e-5
            slope = 10 * (at(1 + h) - at(1 - h)) / (2 * h) / at(1.0)
            assert result.exact[row, column] == pytest.approx(slope, rel=1e-6, abs=1e-7), (text, coefficient)
            step = 100 * (at(1.1) / at(1.0) - 1)
            assert result.difference[row, column] == pytest.approx(step, rel=1e-7, abs=1e-9), (text, coefficient)


def test_the_analytic_slope_of_the_criterion_is_met_to_rounding(linear_study) -> None:
    d = linear_study.card.derivatives
    result = influence(linear_study)
    C = d["Yv"] * d["Nr"] - d["Nv"] * d["Yr"]
    assert result.slopes[0, place(linear_study, "Yv")] == pytest.approx(d["Nr"], rel=1e-12)
    assert result.exact[0, place(linear_study, "Nv")] == pytest.approx(-10 * d["Nv"] * d["Yr"] / C, rel=1e-9)


@pytest.mark.parametrize("ship", ["mariner", "esso-osaka-estimated"])
def test_linear_figures_are_those_of_the_stability_analysis(ship) -> None:
    card = read_card(ship)
    found = study_of(card, "K_per_s", "T_s", "T1_s", "T2_s", "T3_s", "T_prime", "criterion_C").base
    known = stability(build(card))
    own = known.nomoto.dimensional
    wanted = [
        own.K_per_s,
        own.T_s,
        own.T1_s,
        own.T2_s,
        own.T3_s,
        known.nomoto.prime.T_prime,
        known.stability_criterion.C_prime,
    ]
    assert found == pytest.approx(wanted, rel=1e-9)


def sixth_order(study: Study, column: int, h: float) -> np.ndarray:
    """K % by a central difference of the sixth order with steps of `h` of the parameter."""

    def at(steps: int) -> np.ndarray:
        values = study.values.copy()
        values[column] *= 1 + steps * h
        return study.figures_at(values)

    difference = 45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + at(3) - at(-3)
    return 10 * difference / (60 * h) / study.base


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("Nr", "Yv", "Xu")]


@pytest.mark.parametrize("name", ["Nd", "mass", "steering.max_rate", *SLOW])
def test_slopes_through_the_events_of_manoeuvres_are_those_of_differences(simulated, name) -> None:
    """Simulated figures of zigzags ripple a little with the place of kinks between steps; their slopes do not."""
    _, slopes = simulated.slopes_at(simulated.values)
    column = place(simulated, name)
    exact = 10 * slopes[:, column] * simulated.values[column] / simulated.base
    wanted = sixth_order(simulated, column, 4e-3)
    assert exact == pytest.approx(wanted, rel=1e-3, abs=1.5e-3)
    smooth = [0, 1, 2, 4]
    assert exact[smooth] == pytest.approx(wanted[smooth], rel=1e-4, abs=1e-3 if name == "steering.max_rate" else 1e-5)


@pytest.mark.slow
def test_slopes_do_not_depend_on_where_a_kink_falls_between_the_steps(monkeypatch) -> None:
    """The second overshoot after two reversals of a rudder with a rate limit: half the step gives the same slopes."""
    from dataclasses import replace

    from tank2sim.analysis.influence import study as influence_study

    usual, both = influence_study.study_model, []
    for share in (1.0, 0.25):

        def finer(card, share=share):
            model = usual(card)
            return replace(model, step_s=share * model.step_s)

        monkeypatch.setattr(influence_study, "study_model", finer)
        study = study_of(read_card("mariner"), "overshoot_2_deg@10/10")
        values, slopes = study.slopes_at(study.values)
        both.append(10 * slopes[0] * study.values / values[0])
    assert both[0] == pytest.approx(both[1], rel=1e-3, abs=1e-3)


def test_the_standard_error_of_a_figure_is_that_of_the_delta_method_and_shares_sum_to_one(linear_study) -> None:
    result = influence(linear_study)
    d = linear_study.card.derivatives
    # 2 % of each, for the card states none; C is a difference of two products.
    products = 0.02 * math.sqrt(2 * (d["Yv"] * d["Nr"]) ** 2 + 2 * (d["Nv"] * d["Yr"]) ** 2)
    assert result.standard_errors[0] == pytest.approx(products, rel=1e-9)
    assert result.shares.sum(axis=1) == pytest.approx(1.0)
    assert any("2 %" in notice for notice in result.notices)


def test_a_small_agreed_variation_is_predicted(linear_study) -> None:
    result = influence(linear_study, {"Yv": 0.01, "derivatives.Nr": -0.02})
    assert result.agreed is not None
    changes = list(result.agreed.figures.values())
    assert [one.foretold_exact for one in changes] == pytest.approx([one.direct for one in changes], rel=1e-3)
    assert changes[0].foretold_exact == pytest.approx((31.65 * 0.01 - 31.65 * 0.02) / 10, rel=0.01)


@pytest.mark.slow
def test_effects_and_their_inputs_have_an_influence() -> None:
    text = read_card("mariner").text + (
        '\n[[effects]]\nname = "current"\n[effects.parameters]\nspeed_mps = 0.5\ndirection_deg = 0.0\n'
        '\n[[effects]]\nname = "rudder_bias"\n[effects.parameters]\nangle_deg = 1.0\n'
        "[effects.uncertainty]\nangle_deg = 0.5\n"
    )
    study = study_of(parse_card(text, "made.toml"), "advance_m@35", "steady_radius_m@20")
    result = influence(study)
    current, bias = place(study, "current.speed"), place(study, "rudder_bias.angle")
    # The water carries the ship ahead for the time to 90 deg: the slope of the advance by its speed is that time.
    seconds = study_of(read_card("mariner", {}), "time_90_s@35").base[0]
    assert result.slopes[0, current] == pytest.approx(seconds, rel=0.05)
    assert result.exact[1, current] == 0.0 and abs(result.exact[1, bias]) > 0.1
    assert study.parameters[bias].standard_error == pytest.approx(math.radians(0.5))
    assert study.parameters[bias].key == "effects.1.parameters.angle_deg"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "parameters"), [("telemotor_lag", "time_constant_s = 2.0"), ("rudder_backlash", "width_deg = 1.0")]
)
def test_a_steady_turn_does_not_know_how_the_order_reaches_the_rudder(effect, parameters) -> None:
    text = f'{read_card("mariner").text}\n[[effects]]\nname = "{effect}"\n[effects.parameters]\n{parameters}\n'
    found = study_of(parse_card(text, "made.toml"), "steady_radius_m@20").base
    assert found == pytest.approx(study_of(read_card("mariner"), "steady_radius_m@20").base, rel=0.01)


@pytest.mark.slow
def test_no_turn_is_steady_in_wind() -> None:
    wind = '\n[[effects]]\nname = "wind"\n[effects.parameters]\nspeed_mps = 15.0\ndirection_deg = 30.0\n'
    with pytest.raises(InputError, match="no turn is steady"):
        study_of(parse_card(read_card("mariner").text + wind, "windy.toml"), "steady_radius_m@20")


@pytest.mark.parametrize(
    ("changes", "text", "words"),
    [
        ({"derivatives.Nd": 0.0, "derivatives.Yd": 0.0}, "steady_radius_m@1", "does not turn"),
        ({"derivatives.Nd": -1e-6, "derivatives.Yd": 0.0}, "overshoot_1_deg@10/80", "does not show"),
        ({"derivatives.Nd": 139e-5}, "advance_m@35", "does not show"),
    ],
)
def test_a_figure_that_the_ship_does_not_show_is_reported(changes, text, words) -> None:
    with pytest.raises(InputError) as error:
        study_of(read_card("mariner", SYMMETRIC | changes), text)
    assert words in str(error.value) and text in str(error.value)
