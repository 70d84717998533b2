"""Influence on the figures of ships and craft, against closed forms and against differences of high order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.analysis.influence.card_influence import influence
from tank2sim.analysis.influence.figures import FIGURE_KINDS, forms, parse_figure
from tank2sim.analysis.influence.percent import changed_together, combined_percent, difference_percent
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.stability.straight_line import stability
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.cards import CraftCard, linear_card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tests.analysis.symmetric_ship import SYMMETRIC
from tests.cards.made_craft import craft_card

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

        assert result.figures[text].value == pytest.approx(form(d), rel=1e-9)
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
    slopes = linear_study.slopes_at(linear_study.values)[1]
    assert slopes[0, place(linear_study, "Yv")] == pytest.approx(d["Nr"], rel=1e-12)
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
    assert result.figures[LINEAR_FIGURES[0]].standard_error == pytest.approx(products, rel=1e-9)
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
    assert study.slopes_at(study.values)[1][0, current] == pytest.approx(seconds, rel=0.05)
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


# Linear damping, thrust as strong astern as ahead: a spin has neither surge nor sway.
THRUSTER = {"ahead_Ns2": 0.01, "astern_Ns2": 0.01, "max_rpm": 900.0}
LINEAR = craft_card(60.0, 15.0, {"Xu": -80.0, "Yv": -160.0, "Nr": -90.0}, speed_mps=0.5, **THRUSTER)
RADPS = 600 * np.pi / 30


def test_top_speed_and_spin_have_the_influence_of_their_closed_forms() -> None:
    study = study_of(LINEAR, "final_speed_mps@straight:600", "final_rate_degps@spin:600")
    found = influence(study)
    # u = 2 k n^2 / -Xu,  r = 2 k n^2 y / -Nr
    assert [figure.value for figure in found.figures.values()] == pytest.approx(
        [0.02 * RADPS**2 / 80, np.degrees(0.02 * RADPS**2 * 0.4 / 90)], rel=1e-4
    )
    exact = dict(zip(found.names, found.exact.T, strict=True))
    assert exact["Xu"] == pytest.approx([-10, 0], abs=0.01)
    assert exact["Nr"] == pytest.approx([0, -10], abs=0.01)
    assert exact["port.ahead"] == pytest.approx([5, 5], abs=0.01)
    assert exact["starboard.astern"] == pytest.approx([0, 5], abs=0.01)
    assert exact["port.y"] == pytest.approx([0, 5], abs=0.01)
    assert exact["mass"] == pytest.approx([0, 0], abs=0.01)


@pytest.mark.slow
def test_slopes_of_a_turn_are_its_central_differences() -> None:
    texts = ("advance_m@difference:-200", "steady_diameter_m@difference:-200", "steady_rate_degps@difference:-200")
    study = study_of(read_card("otter"), *texts)
    values, slopes = study.slopes_at(study.values)
    assert values[2] < 0 < values[1]
    for place, parameter in enumerate(study.parameters):
        if parameter.name not in ("derivatives.Nrabsr", "thrusters.port.ahead", "ship.x_G"):
            continue
        step = np.zeros(len(study.values))
        step[place] = 1e-4 * parameter.value
        above, below = study.figures_at(study.values + step), study.figures_at(study.values - step)
        assert slopes[:, place] * 2 * step[place] == pytest.approx(above - below, rel=2e-3), parameter.name


def test_figures_without_a_name_are_of_what_the_craft_can_do() -> None:
    from tank2sim.api.influence import default_figures

    card = read_card("otter")
    assert isinstance(card, CraftCard)
    families = {figure.kind.family for figure in default_figures(card)}
    assert families == {"straight run", "turn by difference", "spin"}


@pytest.mark.parametrize("text", ["criterion_C", "steady_radius_m@20", "advance_m@35", "final_rate_degps@spin:5000"])
def test_a_figure_that_a_craft_cannot_show_is_refused(text) -> None:
    with pytest.raises(InputError):
        study_of(read_card("otter"), text)


@pytest.mark.parametrize("text", ["advance_m@spin:400", "final_speed_mps@straight:", "final_speed_mps@straight:0"])
def test_a_figure_that_does_not_exist_is_refused(text) -> None:
    with pytest.raises(InputError, match="figures"):
        parse_figure(text)


def test_a_ship_with_a_rudder_does_not_spin() -> None:
    with pytest.raises(InputError, match="thrusters"):
        study_of(read_card("mariner"), "final_rate_degps@spin:400")


def test_figures_are_read_with_their_rudder_and_heading() -> None:
    assert parse_figure("steady_radius_m@-20").angles == pytest.approx((-math.radians(20.0),))
    assert parse_figure("overshoot_2_deg@10/5").manoeuvre == Zigzag(math.radians(10.0), math.radians(5.0))
    assert parse_figure("advance_m@35").manoeuvre == Turn(math.radians(35.0))
    assert parse_figure("criterion_C").manoeuvre is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("steady_radius", ["did you mean", "steady_radius_m"]),
        ("nonsense", ["criterion_C", "@20/20"]),
        ("steady_radius_m", ["steady_radius_m@20"]),
        ("steady_radius_m@20/20", ["steady_radius_m@20"]),
        ("overshoot1_deg@20/20", ["did you mean overshoot_1_deg?"]),
        ("initial_turning_m@20/20", ["did you mean initial_turning_"]),
        ("overshoot_1_deg@20", ["overshoot_1_deg@20/20"]),
        ("overshoot_1_deg@20/-20", ["out of bounds"]),
        ("advance_m@0", ["out of bounds"]),
        ("advance_m@95", ["out of bounds"]),
        ("criterion_C@20", ["no argument"]),
        ("criterion_C@", ["no argument"]),
        ("advance_m@nan", ["advance_m@35"]),
    ],
)
def test_what_is_no_figure_is_refused_with_what_there_is(text, words) -> None:
    with pytest.raises(InputError) as error:
        parse_figure(text)
    assert all(word in str(error.value) for word in words), error.value


def test_the_help_names_every_figure() -> None:
    assert all(kind.name in forms() for kind in FIGURE_KINDS.values())


def test_both_ways_to_write_a_target_mean_the_same() -> None:
    one, other = parse_target("steady_radius_m=424@20"), parse_target("steady_radius_m@20=424")
    assert (one.figure.kind, one.figure.angles, one.value) == (other.figure.kind, other.figure.angles, other.value)
    assert one.text == "steady_radius_m@20=424"
    limit = parse_target("overshoot_1_deg@20/20<=25")
    assert (limit.relation, limit.value, limit.figure.text) == ("<=", 25.0, "overshoot_1_deg@20/20")


@pytest.mark.parametrize(
    "text", ["steady_radius_m@20", "steady_radius_m@20=424@20", "T_s=fast", "T_s=nan", "=3", "T_s<3"]
)
def test_what_is_no_target_is_refused(text) -> None:
    with pytest.raises(InputError):
        parse_target(text)


K = {
    **{"Cyb": 1.85, "Cyw": -1.73, "Cybb": 0.0, "Cyd": -0.8, "Cybw": 0.85, "Cyww": 0.0},
    **{"Cmb": -5.8, "Cmw": 7.1, "Cmww": 0.85, "Cmd": -3.63, "Cmbbw": 1.8, "Cmbww": 0.3},
}
"""Table 3 as printed: change of the radius, %, for 10 % of each coefficient."""

KC = {
    **{"Cyb": 0.62, "Cyw": -2.153, "Cybb": 20.1529, "Cyd": -0.401, "Cybw": 0.8781, "Cyww": 4.8633},
    **{"Cmb": 1.6676, "Cmw": 1.356, "Cmww": 5.1959, "Cmd": -0.551, "Cmbbw": -0.737, "Cmbww": 0.4026},
}
"""Table 4: change of each coefficient, %, with 1 % of draught."""


def test_ten_per_cent_of_a_power_law_changes_it_by_the_power_of_1_1() -> None:
    found = difference_percent(lambda c: c["a"] ** 2 / c["b"] + 0 * c["idle"], {"a": 3.0, "b": 0.5, "idle": 2.0})
    assert found == pytest.approx({"a": 21.0, "b": 100 * (1 / 1.1 - 1), "idle": 0.0})
    assert math.isnan(difference_percent(lambda c: c["a"] - 3.0, {"a": 3.0})["a"])


def test_the_agreed_variation_gives_404_m_with_the_right_pairing_and_410_6_with_the_slip_of_the_print() -> None:
    assert 399.6 * (1 + combined_percent(K, KC) / 100) == pytest.approx(404.0, abs=0.1)
    slip = K | {"Cybb": 0.85, "Cybw": 0.0}
    assert combined_percent(slip, KC) == pytest.approx(2.75, abs=0.01)
    assert 399.6 * (1 + combined_percent(slip, KC) / 100) == pytest.approx(410.6, abs=0.1)


def test_coefficients_of_an_agreed_variation_move_together_and_the_others_stay() -> None:
    assert changed_together({"a": 2.0, "b": -4.0, "c": 1.0}, {"a": 2.0, "b": -10.0}) == pytest.approx(
        {"a": 2.04, "b": -3.6, "c": 1.0}
    )
