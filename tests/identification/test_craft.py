"""Craft from trials: hull, thrust curves, lag and dead band against truths of other simulations; honest verdicts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import craft_log
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import CraftCard, parse_card
from tank2sim.errors import InputError
from tank2sim.identification.craft.card import CRUISING_SHARE, craft_with, identified_craft
from tank2sim.identification.craft.first_values import _by_velocities
from tank2sim.identification.craft.fit import CoefficientVerdict, CraftFit, determination
from tank2sim.identification.craft.order_response import order_responses
from tank2sim.identification.craft.problem import craft_problem, deviates
from tank2sim.identification.craft.study import (
    _model_does_not_hold,
    worse_than_a_mean,
)
from tank2sim.notices import Level
from tank2sim.records.craft_trials import read_craft_trial
from tank2sim.records.csv_table import table_of_frame
from tank2sim.records.trials import Trial
from tests.cards.made_craft import craft_card
from tests.craft_trials import PLACE, THRUST, outboard_trial, written


@pytest.fixture(scope="module")
def craft() -> dict[str, float]:
    return craft_log.random_craft(np.random.default_rng(7))


@pytest.fixture(scope="module")
def found(craft, tmp_path_factory) -> t2s.CraftIdentificationResult:
    folder = tmp_path_factory.mktemp("trials")
    *fitted, held = written(folder, craft, ["straight", "spin", "astern", "steps", "zigzag"])
    first = craft_log.first_card(craft, np.random.default_rng(5))
    return t2s.identify(first, fitted, holdout=held)


@pytest.mark.slow
def test_position_and_heading_alone_give_thrust_curve_and_damping(craft, found) -> None:
    coefficients = found.study.coefficients
    for name in ("port.ahead", "port.astern", "Xu", "Xuabsu", "Nr", "Nrabsr"):
        entry, truth = coefficients[name], craft[name.rpartition(".")[2]]
        assert abs(entry.value - truth) < 3 * entry.standard_error, name
    assert coefficients["port.ahead"].value == pytest.approx(craft["ahead"], rel=0.1)
    assert abs(coefficients["port.ahead"].before / craft["ahead"] - 1) > 0.1


@pytest.mark.slow
def test_the_card_written_is_a_craft_with_the_estimates_and_their_errors(found) -> None:
    card, fit = found.card, found.fit
    assert isinstance(card, CraftCard)
    values = dict(zip(fit.problem.free, fit.estimate.values, strict=True))
    errors = dict(zip(fit.problem.free, fit.estimate.standard_errors, strict=True))
    assert card.derivatives["Xu"] == pytest.approx(values["derivatives.Xu"], rel=1e-9)
    assert card.uncertainty["Nr"] == pytest.approx(errors["derivatives.Nr"], rel=1e-9)
    for thruster in card.thrusters:
        name = f"thrusters.{thruster.name}"
        assert thruster.ahead_Ns2 == pytest.approx(values[f"{name}.ahead"], rel=1e-9)
        assert thruster.uncertainty["astern_Ns2"] == pytest.approx(errors[f"{name}.astern"], rel=1e-9)


@pytest.mark.slow
def test_members_of_the_card_found_have_the_speeds_that_the_trials_have(found, tmp_path) -> None:
    """Trials show the speed better than thrust or drag: the covariance next to the card knows that they go together."""
    found.card.save(tmp_path / "found.toml")
    (tmp_path / "alone.toml").write_text(found.card.text, encoding="utf-8")
    spread = {}
    for name in ("found", "alone"):
        run = t2s.load(tmp_path / f"{name}.toml").simulate("straight:500", members=40)
        spread[name] = run.study.ensemble.figures["final_speed_mps"].standard_deviation
    assert spread["found"] < 0.5 * spread["alone"]


@pytest.mark.slow
def test_orders_alone_give_thrust_curve_damping_and_lag(craft, tmp_path) -> None:
    paths = written(tmp_path, craft, ["straight", "spin", "astern", "steps", "zigzag"], ordered=True)
    text = craft_log.first_card(craft, np.random.default_rng(5)).card.text
    lines = f"max_rpm = {craft['rpm']!r}\ntime_constant_s = {1.5 * craft['lag']!r}"
    text = text.replace(f"max_rpm = {1.05 * craft['rpm']!r}", lines)
    found = t2s.identify(t2s.Ship(parse_card(text, "first.toml")), paths)
    assert found.study.driven_by == "orders"
    coefficients = found.study.coefficients
    for name, truth in [(f"port.{key}", craft[key]) for key in ("ahead", "astern")] + [
        ("port.time_constant", craft["lag"])
    ]:
        entry = coefficients[name]
        assert abs(entry.value - truth) < 3 * entry.standard_error, name
        assert entry.standard_error < 0.1 * truth
    for name in ("Xu", "Xuabsu", "Nr", "Nrabsr"):
        assert abs(coefficients[name].value - craft[name]) < 3 * coefficients[name].standard_error, name
    assert found.card.thrusters[1].time_constant_s == pytest.approx(coefficients["port.time_constant"].value)


def test_a_fit_that_drives_the_craft_on_is_not_blamed_on_the_card(craft) -> None:
    card = craft_log.first_card(craft, np.random.default_rng(5)).card
    assert isinstance(card, CraftCard)
    estimate = SimpleNamespace(values=np.array([40.0]), standard_errors=np.array([1.0]))
    fit = SimpleNamespace(problem=SimpleNamespace(free=("derivatives.Xu",)), estimate=estimate)
    with pytest.raises(InputError) as refused:
        identified_craft(card, fit)
    assert refused.value.place == "derivatives.Xu" and "these trials" in refused.value.problem


@pytest.mark.parametrize("logged", [True, False], ids=["log", "positions alone"])
def test_first_values_are_by_the_velocities_through_the_water_where_a_log_shows_them(logged) -> None:
    """From rest in a current of 0.5 m/s: the log shows the time constant of 1.1 s, positions the speed after it."""
    otter = t2s.load("otter")
    rows = otter.simulate("straight:600", duration_s=12.0).df[::20].reset_index(drop=True)
    speed = rows["u_mps"].to_numpy()
    rows["x_m"] += 0.5 * rows["t_s"]
    trial = read_craft_trial(
        table_of_frame(rows if logged else rows.drop(columns="u_mps"), "run"), otter.card.thrusters
    )
    (run,) = craft_problem(otter.card, [trial]).runs
    derived = _by_velocities(run)
    assert derived.seen[0] == "motion.u"
    truth = np.interp(run.times, rows["t_s"], speed) + (0.0 if logged else 0.5)
    late = run.times > (0.0 if logged else 5.0)
    np.testing.assert_allclose(derived.measured[late, 0], truth[late], atol=0.01)


def test_a_cruising_speed_that_the_thrusters_found_do_not_hold_is_lowered_to_one_that_they_hold() -> None:
    hull = {"Xu": -20.0, "Xuabsu": -30.0, "Yv": -100.0, "Nr": -50.0}
    card = craft_card(55.0, 12.0, hull, ahead_Ns2=0.01, astern_Ns2=0.005, max_rpm=900.0)
    weak = {f"thrusters.{name}.ahead": (0.001, 1e-5) for name in ("port", "starboard")}
    speed = craft_with(card, weak, comment="identified").model.speed_mps
    fastest = speed / CRUISING_SHARE
    assert speed < fastest < card.model.speed_mps
    assert 20 * fastest + 30 * fastest**2 == pytest.approx(2 * 0.001 * (900 * np.pi / 30) ** 2, rel=1e-2)


def test_a_cruising_speed_that_scales_the_numbers_of_a_card_stays(craft) -> None:
    hull = {"Xu": -0.02, "Xuabsu": -0.03, "Yv": -0.1, "Nr": -0.05}
    card = craft_card(0.01, 0.001, hull, more='scaling = "prime"', ahead_Ns2=0.01, astern_Ns2=0.005, max_rpm=900.0)
    weak = {f"thrusters.{name}.ahead": (0.001, 1e-5) for name in ("port", "starboard")}
    with pytest.raises(InputError) as raised:
        craft_with(card, weak, comment="identified")
    assert raised.value.place == "model.speed_mps"


@pytest.mark.parametrize(("rows", "place"), [("1.5", "order_port"), ("", "n_port_rpm")])
def test_orders_that_cannot_be_are_refused(craft, tmp_path, rows, place) -> None:
    (path,) = written(tmp_path, craft, ["spin"], ordered=True)
    lines = path.read_text().splitlines()
    changed = [",".join([*line.split(",")[:-2], rows, rows]) for line in lines[1:]]
    path.write_text("\n".join([lines[0], *changed]) + "\n")
    with pytest.raises(InputError, match=place):
        t2s.identify(craft_log.first_card(craft, np.random.default_rng(5)), path)


def test_trials_by_revolutions_and_by_orders_are_not_mixed(craft, tmp_path) -> None:
    (first,) = written(tmp_path, craft, ["spin"])
    (tmp_path / "ordered").mkdir()
    (second,) = written(tmp_path / "ordered", craft, ["steps"], ordered=True)
    with pytest.raises(InputError, match="give trials of one kind") as raised:
        t2s.identify(craft_log.first_card(craft, np.random.default_rng(5)), [first, second])
    assert raised.value.source == str(first)


@pytest.mark.slow
def test_a_held_out_trial_is_predicted(found) -> None:
    r_squared = found.determination
    assert r_squared["u"] > 0.9 and r_squared["r"] > 0.9
    assert found.study.held_out == ("zigzag",)


@pytest.mark.slow
def test_what_straight_runs_do_not_show_is_said_and_a_manoeuvre_that_would_is_named(craft, tmp_path) -> None:
    paths = written(tmp_path, craft, ["straight"])
    found = t2s.identify(craft_log.first_card(craft, np.random.default_rng(5)), paths)
    verdicts = dict(zip(found.fit.problem.free, found.fit.verdicts, strict=True))
    for name in ("derivatives.Nr", "derivatives.Nrabsr", "derivatives.Yvabsv", "thrusters.port.astern"):
        assert verdicts[name] is CoefficientVerdict.PRIOR, name
    assert found.cautions and "astern" in found.cautions[0]
    best = found.next_trials[0]
    assert {"Nr", "Nrabsr"} <= set(best.determines)
    assert max(best.t_s) < 300
    straight = next(entry for entry in found.next_trials if entry.words.startswith("straight"))
    assert "Nrabsr" not in straight.determines and "port.astern" not in straight.determines


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (("n_port_rpm", "rpm_links"), "lacks n_port_rpm"),
        (("psi_deg", "heading"), "lacks psi_deg"),
        (("t_s", "time"), "no column t_s"),
    ],
)
def test_a_trial_that_lacks_a_column_is_refused_by_its_name(craft, tmp_path, change, problem) -> None:
    (path,) = written(tmp_path, craft, ["spin"])
    path.write_text(path.read_text().replace(*change, 1))
    with pytest.raises(InputError, match=problem):
        t2s.identify(craft_log.first_card(craft, np.random.default_rng(5)), path)


def test_a_trial_is_not_fitted_and_held_out_at_once(craft, tmp_path) -> None:
    (path,) = written(tmp_path, craft, ["spin"])
    with pytest.raises(InputError, match="held out"):
        t2s.identify("otter", path, holdout=path)


@pytest.mark.parametrize("given", [{"structure": "card"}, {"hold": ["Xuu"]}, {"members": 0}, {"inertia": True}])
def test_what_is_for_ships_alone_is_refused(craft, tmp_path, given) -> None:
    (path,) = written(tmp_path, craft, ["spin"])
    with pytest.raises(InputError, match="is not for a craft") as raised:
        t2s.identify("otter", path, **given)
    assert raised.value.source == next(iter(given))


def test_the_share_explained_is_one_without_error_and_zero_for_the_mean() -> None:
    truth = np.array([[1.0], [2.0], [6.0]])
    assert determination(truth, truth)[0] == 1.0
    assert determination(np.full((3, 1), 3.0), truth)[0] == pytest.approx(0.0)


def test_predictions_worse_than_a_mean_are_the_first_words() -> None:
    assert worse_than_a_mean({"u": 0.9, "v": 0.2, "r": 0.5}) == []
    (doubt,) = worse_than_a_mean({"u": 0.9, "v": -0.1, "r": float("nan")})
    assert doubt.level is Level.CAUTION and "v -0.1" in doubt and "r nan" in doubt
    assert "u 0.9" not in doubt


@pytest.fixture(scope="module")
def deviating(craft, tmp_path_factory) -> t2s.CraftIdentificationResult:
    """Trials in two folders with the same names, recorded with a compass that deviates by 1, 7 and -5 deg."""
    paths = {}
    for part, names in (("first", ["straight", "spin", "steps"]), ("second", ["astern", "zigzag"])):
        folder = tmp_path_factory.mktemp("deviating") / part
        folder.mkdir()
        paths[part] = written(folder, craft, names)
        for path in paths[part]:
            rows = np.loadtxt(path, delimiter=",", skiprows=1)
            heading = np.radians(rows[:, 3]) + (1.0 if part == "second" else 0.0)  # the second day to another side
            turned = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
            rows[:, 1:3] = rows[:, 1:3] @ (turned.T if part == "second" else np.eye(2))
            rows[:, 3] = np.degrees(heading) + 1.0 + 7.0 * np.sin(heading) - 5.0 * np.cos(heading)
            np.savetxt(path, rows, delimiter=",", header=path.read_text().splitlines()[0], comments="")
    paths["second"][1] = paths["second"][1].rename(paths["second"][1].with_name("steps.csv"))
    first = craft_log.first_card(craft, np.random.default_rng(5))
    return t2s.identify(first, paths["first"], holdout=paths["second"])


@pytest.mark.slow
def test_the_deviation_of_the_compass_is_found_and_does_not_bend_the_coefficients(craft, deviating, found) -> None:
    compass = deviating.study.compass
    for letter, truth in (("a", 1.0), ("b", 7.0), ("c", -5.0)):
        value, error = getattr(compass, f"{letter}_deg"), getattr(compass, f"{letter}_error_deg")
        assert abs(value - truth) < 3 * error, letter
    assert compass.b_deg > 3.5 and compass.c_deg < -2.5
    assert found.study.compass is None
    for name in ("port.ahead", "Xuabsu", "Nrabsr"):
        entry = deviating.study.coefficients[name]
        assert abs(entry.value - craft[name.rpartition(".")[2]]) < 3 * entry.standard_error, name
    assert not any(name.startswith("compass") for name in (*deviating.card.spelt, *deviating.study.coefficients))


@pytest.mark.parametrize(("b_deg", "said"), [(0.007, False), (0.2, True), (-0.2, True)])
def test_a_compass_deviates_only_where_its_deviation_is_beyond_its_errors(b_deg: float, said: bool) -> None:
    free, errors = ("compass.A", "compass.B", "compass.C"), np.array([0.03, 0.04, 0.04])
    assert deviates(SimpleNamespace(free=free, values=np.array([0.5, b_deg, 0.02]), standard_errors=errors)) is said


@pytest.mark.slow
def test_trials_of_one_file_name_in_two_folders_are_two_trials(deviating) -> None:
    assert deviating.study.trials == ("straight", "spin", "first/steps")
    assert deviating.study.held_out == ("astern", "second/steps")
    assert "second/steps" in {prediction.run.name for prediction in deviating.predictions}
    assert min(deviating.determination.values()) > 0.8


@pytest.mark.parametrize(("method", "level"), [("kalman", Level.CAUTION), ("output_error", Level.INFO)])
def test_a_model_that_does_not_hold_is_said_as_far_as_the_estimate_suffers(method, level) -> None:
    estimate = SimpleNamespace(method=method)
    fit = CraftFit(None, estimate, np.zeros((1, 1, 1)), gust_share=0.2)  # type: ignore[arg-type]
    assert not fit.holds and _model_does_not_hold(fit).level is level
    assert replace(fit, gust_share=0.04).holds


@pytest.fixture(scope="module")
def outboard(craft) -> t2s.Ship:
    text = craft_log.first_card(craft, np.random.default_rng(5)).card.text
    thruster = f"""[[thrusters]]
name = "outboard"
x_m = {PLACE}
ahead_Ns2 = {1.4 * THRUST}
astern_Ns2 = {THRUST}
max_rpm = {1.05 * craft["rpm"]}
max_azimuth_deg = 35.0
azimuth_time_constant_s = 0.4
"""
    return t2s.Ship(parse_card(text[: text.index("[[thrusters]]")] + thruster, "outboard.toml"))


def test_the_columns_of_a_rudder_are_the_direction_of_the_one_outboard(craft, outboard, tmp_path) -> None:
    by_rudder = read_craft_trial(outboard_trial(tmp_path / "a.csv", craft), outboard.card.thrusters)
    columns = "n_outboard_rpm,azimuth_outboard_deg"
    by_name = read_craft_trial(outboard_trial(tmp_path / "b.csv", craft, columns, side=-1.0), outboard.card.thrusters)
    for signal in ("azimuth_outboard_rad", "n_outboard_radps"):
        np.testing.assert_allclose(by_rudder.signals[signal], by_name.signals[signal], atol=1e-12)


def test_trials_with_measured_and_with_ordered_directions_are_not_mixed(craft, outboard, tmp_path) -> None:
    measured = outboard_trial(tmp_path / "a.csv", craft)
    ordered = outboard_trial(tmp_path / "b.csv", craft | {"Nr": 2 * craft["Nr"]}, "n_rpm,delta_order_deg")
    for verb in (t2s.identify, t2s.find_gap):
        with pytest.raises(InputError, match=r"b\.csv: header: has the ordered direction") as raised:
            verb(outboard, [measured, ordered])
        assert raised.value.remedy == "give trials of one kind"


@pytest.mark.slow
def test_thrust_and_damping_are_found(craft, outboard, tmp_path) -> None:
    path = outboard_trial(tmp_path / "trial.csv", craft)
    found = t2s.identify(outboard, path).study.coefficients
    truth = {"outboard.ahead": THRUST, "Xu": craft["Xu"], "Nr": craft["Nr"], "Nrabsr": craft["Nrabsr"]}
    for name, value in truth.items():
        assert abs(found[name].value - value) < 3 * found[name].standard_error, name
    assert found["outboard.ahead"].standard_error < 0.15 * THRUST


def test_a_trial_without_the_direction_is_refused(craft, outboard, tmp_path) -> None:
    path = outboard_trial(tmp_path / "trial.csv", craft, "n_outboard_rpm,heel_deg")
    with pytest.raises(InputError, match="azimuth_outboard_deg"):
        t2s.identify(outboard, path)


FULL = 1800 * np.pi / 30


@pytest.fixture(scope="module")
def card():
    rng = np.random.default_rng(7)
    craft = craft_log.random_craft(rng)
    text = craft_log.first_card(craft, rng).card.text
    return parse_card(text.replace(f"max_rpm = {1.05 * craft['rpm']!r}", "max_rpm = 1800.0"), "first.toml")


def trial(shares: list[float], *, lag: float = 0.4, band: float = 0.04, gain: float = 1.0, noise: float = 0.3) -> Trial:
    """Orders of 4 s each, read five times a second at an instant that the orders do not know; both thrusters alike."""
    rng = np.random.default_rng(3)
    fine, n, rows = 0.01, 0.0, []
    orders = np.repeat(np.array(shares) * FULL, 403)
    for k, order in enumerate(orders):
        if k % 20 == 0:
            rows.append([k * fine, order, n])
        goal = gain * order if abs(order) > band * FULL else 0.0
        n = goal + (n - goal) * np.exp(-fine / lag)
    time, order, n = np.array(rows).T
    n = n + noise * rng.normal(size=len(n))
    signals = {
        f"{what}_{name}_radps": values
        for name in ("port", "starboard")
        for what, values in (("order", order), ("n", n))
    }
    return Trial(Path("trial.csv"), time, signals)


def test_lag_and_dead_band_are_found_with_their_errors(card) -> None:
    found = order_responses(card, [trial([0.5, 0.03, -0.4, 0.05, 0.7, -0.02, 0.3, -0.06], gain=0.95)])
    response = found["port"]
    assert abs(response.lag_s - 0.4) < 2 * response.lag_error_s < 0.15
    value, error = response.dead_band
    assert (response.rest_radps, response.turning_radps) == pytest.approx((0.03 * FULL, 0.05 * FULL), rel=1e-3)
    assert abs(value - 0.04 * FULL) < 2 * error
    assert found["starboard"] == response  # one thruster twice on the card


def test_without_small_orders_the_dead_band_is_not_determined(card) -> None:
    response = order_responses(card, [trial([0.5, -0.4, 0.2, 0.7, -0.3])])["port"]
    assert response.dead_band is None
    assert response.turning_radps == pytest.approx(0.2 * FULL, rel=1e-3)


def test_a_thruster_without_a_dead_band_has_none(card) -> None:
    response = order_responses(card, [trial([0.5, 0.02, -0.4, 0.04, 0.7], band=0.0)])["port"]
    assert response.dead_band is None
    assert response.turning_radps == pytest.approx(0.02 * FULL, rel=1e-3)


def test_orders_alone_have_no_response(card) -> None:
    ordered = trial([0.5, 0.02, -0.4])
    alone = {name: values for name, values in ordered.signals.items() if name.startswith("order")}
    assert order_responses(card, [Trial(ordered.path, ordered.time_s, alone)]) == {}
