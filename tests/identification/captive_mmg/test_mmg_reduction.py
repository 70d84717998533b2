"""The reduction to the MMG method against a tank that is written by itself (tank.py), and against a real one (HMRI)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.errors import InputError
from tank2sim.identification.captive_mmg.card_text import estimated_masses
from tank2sim.identification.captive_mmg.regression import ORDINARY, fit_mmg
from tank2sim.identification.captive_mmg.steady_tests import read_steady_tests
from tank2sim.identification.captive_mmg.study import study_mmg
from tank2sim.results.mmg_reduction import MmgReductionResult
from tests.cli.command_line import refused, tank2sim
from tests.identification.captive_mmg.tank import (
    KVLCC2,
    STATED,
    TORQUE,
    as_runs,
    conditions,
    forces,
    hmri_campaign,
    read_rows,
    ship_like_the_kvlcc2,
    with_common_errors,
    write_campaign,
    write_rows,
)

SEEDS = 20


def another_ship(folder: Path, seed: int) -> dict[str, float]:
    """A ship like the KVLCC2, its added masses off their estimate by chance."""
    return ship_like_the_kvlcc2(seed, estimated_masses(read_steady_tests(write_campaign(folder, KVLCC2))))


def of_the_estimate(folder: Path) -> dict[str, float]:
    """The KVLCC2 with the added masses that the reduction estimates, so that nothing but the readings is in error."""
    masses = estimated_masses(read_steady_tests(write_campaign(folder, KVLCC2)))
    return KVLCC2 | {"mx": -masses["Xudot"][0], "my": -masses["Yvdot"][0]}


def test_without_noise_the_coefficients_are_those_of_the_tank(tmp_path) -> None:
    truth = of_the_estimate(tmp_path)
    found = t2s.reduce_to_mmg(write_campaign(tmp_path, truth, noise=1e-5)).coefficients
    for name, value in truth.items():
        assert found[name].value == pytest.approx(value, rel=2e-3, abs=2e-4), name
    assert {entry.origin for name, entry in found.items() if name not in ("mx", "my")} == {"measured"}
    assert found["mx"].origin == found["my"].origin == "estimated"


# The bounds of few campaigns are wider, as chance makes them.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("seeds", "least", "most", "first", "options"),
    [
        (6, 0.87, 1.0, 7000, {}),
        (SEEDS, 0.90, 0.98, 7000, {}),
        (SEEDS, 0.90, 0.98, 9000, {"torque": True}),
        (SEEDS, 0.90, 0.98, 9900, {"y": 0.05}),
    ],
    ids=["few", "many", "with torque", "two propellers"],
)
def test_standard_errors_cover_the_truth_as_often_as_they_say(tmp_path, seeds, least, most, first, options) -> None:
    inside = []
    for seed in range(seeds):
        truth = another_ship(tmp_path, first + seed)
        if "torque" in options:
            random = np.random.default_rng(first + 500 + seed)
            truth |= {name: value * random.uniform(0.97, 1.03) for name, value in TORQUE.items()}
        found = t2s.reduce_to_mmg(write_campaign(tmp_path, truth, seed, **options)).coefficients
        inside += [abs(found[name].value - value) < 1.96 * found[name].standard_error for name, value in truth.items()]
    assert least <= np.mean(inside) <= most


@pytest.mark.slow
def test_the_card_steers_like_the_ship_that_was_tested(tmp_path) -> None:
    truth = of_the_estimate(tmp_path)
    result = t2s.reduce_to_mmg(write_campaign(tmp_path, truth, noise=1e-4))
    result.card.save(tmp_path / "found.toml")
    found = t2s.load(tmp_path / "found.toml")
    bundled, _, _ = t2s.load("kvlcc2-l7-mmg").card.text.partition("[steering_gear]")
    inertia = -estimated_masses(result.fit.tests)["Nrdot"][0]
    for old, new in (("mx = 0.022", truth["mx"]), ("my = 0.223", truth["my"]), ("Jz = 0.011", inertia)):
        assert old in bundled
        bundled = bundled.replace(old, f"{old[:2]} = {new}")
    (tmp_path / "truth.toml").write_text(bundled)
    for figure in ("advance_m", "tactical_diameter_m"):
        values = [ship.turn(35).figures[figure] for ship in (found, t2s.load(tmp_path / "truth.toml"))]
        assert values[0] == pytest.approx(values[1], rel=2e-3), figure
    spread = found.turn(35, duration_s=60.0, members=3)
    assert spread.to_dict()["ensemble"]


def test_conventions_of_the_file_give_one_ship(tmp_path) -> None:
    """Port-positive rudder, starboard-positive normal force, force of the carriage on the model, prime II."""
    path = write_campaign(tmp_path, KVLCC2)
    first = fit_mmg(read_steady_tests(path))
    heads, table = read_rows(tmp_path)
    unit = 0.5 * 1000.0 * 7.0 * 0.46 * table[:, 0] ** 2
    table[:, 3] *= -1
    table[:, 5:8] *= -1
    table[:, 9] *= -1
    table[:, 5:] /= unit[:, None]
    table[:, 7] /= 7.0
    write_rows(tmp_path, heads, table)
    text = path.read_text().replace(
        '"dimensional"', '"prime_ii"\nrudder_sign = "port"\nnormal_force_sign = "starboard"'
    )
    path.write_text(text.replace('"on_gauge"', '"on_model"'))
    again = fit_mmg(read_steady_tests(path))
    assert again.names == first.names
    np.testing.assert_allclose(again.values, first.values, rtol=1e-4, atol=1e-6)


def test_forces_of_the_water_alone_have_no_inertia_of_the_body(tmp_path) -> None:
    truth = of_the_estimate(tmp_path)
    path = write_campaign(tmp_path, truth, noise=1e-5)
    U, beta, r, *_ = conditions().T
    rate = r * U / 7.0
    heads, table = read_rows(tmp_path)
    table[:, 5] -= 3270.0 * (-U * np.sin(beta) * rate + 0.25 * rate**2)
    table[:, 6] += 3270.0 * U * np.cos(beta) * rate
    table[:, 7] += 3270.0 * 0.25 * U * np.cos(beta) * rate
    write_rows(tmp_path, heads, table)
    path.write_text(path.read_text().replace('"on_gauge"', '"hydrodynamic"'))
    found = t2s.reduce_to_mmg(path).coefficients
    for name in ("Yr", "Nr", "Xvr", "Yv"):
        assert found[name].value == pytest.approx(truth[name], rel=2e-3, abs=2e-4), name


def test_a_zero_of_the_rudder_is_found_and_not_taken_for_a_force(tmp_path) -> None:
    found = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, rudder_zero=np.radians(1.5)))
    assert found.study.rudder_angle_of_no_force_deg == pytest.approx(-1.5, abs=0.1)
    assert t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2)).study.rudder_angle_of_no_force_deg is None


def test_what_no_condition_shows_is_open_or_zero_and_named(tmp_path) -> None:
    rows = conditions()
    result = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, rows=rows[rows[:, 2] == 0]))
    assert {"Yr", "Nr", "Xvr", "Nrrr"} <= set(result.fit.not_excited)
    assert result.coefficients["l_R"].origin == "open"
    assert result.coefficients["l_R"].standard_error == ORDINARY["l_R"][1]
    assert result.card.derivatives["Yr"] == 0.0
    one_sided = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, rows=rows[(rows[:, 2] == 0) & (rows[:, 1] >= 0)]))
    assert one_sided.coefficients["C_2_minus"].origin == one_sided.coefficients["gamma_R_minus"].origin == "open"
    assert one_sided.coefficients["gamma_R_plus"].origin == "measured"


LACKING = [
    ("[open_water]", "normal_force_sign_of = 1\n[open_water]", "normal_force_sign_of"),
    ('scaling = "dimensional"', 'scaling = "dimensional"\nnormal_force_sign = "starboard"', "F_N"),
    ('thrust = "T"\n', "", "averages.columns.thrust"),
    ('rudder_normal_force = "F"\n', "", "averages.columns.rudder_normal_force"),
    ('thrust = "T"\n', 'thrust = "thrust"\n', "thrust"),
    ("f_alpha = 2.747\n", "", "rudder.f_alpha"),
    ("f_alpha = 2.747\n", "f_alpha = 2.747\naspect_ratio = 1.8\n", "rudder.f_alpha"),
    ('[open_water]\nfile = "water.csv"\n', "", "open_water"),
    ('file = "water.csv"', "J = [0, 0.4, 0.8]\nK_T = [0.3, 0.2, 0.1]", "open_water.J"),
    ('file = "water.csv"', "J = [0, 0.2, 0.4, 0.8]\nK_T = [0.3, 0.2, 0.1]", "open_water.K_T"),
    ("propeller_diameter_m = 0.216\n", "", "propeller_diameter_m"),
    ('drift_deg = "beta"\n', "", "drift angle"),
    ("rudder_area_m2 = 0.0539", "rudder_area_m2 = 112.5", "model.rudder_area_m2"),
    ("rudder_area_m2 = 0.0539", "rudder_area_m2 = 0.0000539", "model.rudder_area_m2"),
    ("height_m = 0.345", "height_m = 15.8", "rudder.height_m"),
    ("propeller_diameter_m = 0.216", "propeller_diameter_m = 9.86", "model.propeller_diameter_m"),
    ("propeller_diameter_m = 0.216", "propeller_diameter_m = 0.25", "open_water.K_T: .*propeller_diameter_m"),
    ("x_P = -0.48", "x_P = 0.48", "propeller.x_P"),
    ("x_R = -0.5", "x_R = 0.5", "rudder.x_R"),
    ("x_R = -0.5", "x_R = 0.0", "rudder.x_R"),
    ('yaw_rate_prime = "r"', 'yaw_rate_radps = "r"', "averages.columns.yaw_rate: reaches 0.8"),
]
LACKING_WITH_TORQUE = [
    ("K_Q_factor = 0.1", "", "open_water.K_Q: is .*K_Q_factor"),
    ('K_Q = "10K_Q"', "", "open_water.K_Q: is missing"),
    pytest.param('torque = "Q"', 'torque = "T"', "Q: the MMG method leaves", marks=pytest.mark.slow),
]
LACKING_OF_TWO_PROPELLERS = [
    ("y_P = 0.05", "", "propeller.y_P"),
    ("y_R = 0.05", "", "rudder.y_R"),
    ('thrust_left = "TL"', "", "averages.columns.thrust_left"),
    ('rudder_normal_force_left = "FL"', "", "averages.columns.rudder_normal_force_left"),
    ('rudder_normal_force_left = "FL"', 'rudder_normal_force_left = "FL"\ntorque = "T"', "averages.columns.torque"),
]


def assert_refused(path: Path, old: str, new: str, words: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=words):
        t2s.reduce_to_mmg(path)


@pytest.mark.parametrize(("old", "new", "words"), LACKING)
def test_a_campaign_without_what_the_method_needs_or_of_no_ship_is_refused(tmp_path, old, new, words) -> None:
    assert_refused(write_campaign(tmp_path, KVLCC2), old, new, words)


@pytest.mark.parametrize(("old", "new", "words"), LACKING_WITH_TORQUE)
def test_torque_in_another_unit_sign_or_without_its_curve_is_refused(tmp_path, old, new, words) -> None:
    assert_refused(write_campaign(tmp_path, KVLCC2, torque=True), old, new, words)


@pytest.mark.parametrize(("old", "new", "words"), LACKING_OF_TWO_PROPELLERS)
def test_two_propellers_without_what_the_method_needs_are_refused(tmp_path, old, new, words) -> None:
    assert_refused(write_campaign(tmp_path, KVLCC2, y=0.05), old, new, words)


@pytest.mark.slow
def test_a_coefficient_at_the_limit_of_the_search_marks_the_result(tmp_path) -> None:
    fit = fit_mmg(read_steady_tests(write_campaign(tmp_path, KVLCC2)))
    assert fit.at_limit == () and MmgReductionResult(study_mmg(fit)).cautions == ()
    values = fit.values.copy()
    values[fit.names.index("C_2_plus")] = 5.0
    at_limit = replace(fit, values=values)
    assert at_limit.at_limit == ("C_2_plus",)
    assert any("C_2_plus" in mark for mark in MmgReductionResult(study_mmg(at_limit)).cautions)
    assert fit_mmg(read_steady_tests(write_campaign(tmp_path, KVLCC2 | {"C_2_plus": 6.0}))).at_limit == ("C_2_plus",)


def scale_column(folder: Path, name: str, factor: float) -> None:
    """A column of ``runs.csv`` or ``water.csv`` times a factor."""
    for file in ("runs.csv", "water.csv"):
        heads, table = read_rows(folder, file)
        if name in heads:
            table[:, heads.index(name)] *= factor
            write_rows(folder, heads, table, file)


@pytest.mark.parametrize(
    ("column", "factor", "words"),
    [
        ("K_T", 1.5, "open_water.K_T: is .* off its curve.*propeller_diameter_m"),
        ("T", -1.0, r"averages.columns.thrust \(column T\)"),
        ("rps", -1.0, r"averages.columns.propeller \(column rps\)"),
        ("r", 0.1, r"averages.columns.yaw_rate \(column r\): .*l_R"),
        ("Q", -1.0, r"open_water.K_Q: is .* off its curve"),
        ("Y", -1.0, r"averages.columns.Y \(column Y\) .*Yv"),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in (
                ("K_T", 10.0, "open_water.K_T: is .* at J = 0"),
                ("K_T", -1.0, "open_water.K_T: .*falls with J"),
                ("T", 0.5, "open_water.K_T: is .* off its curve"),
                ("r", -1.0, r"averages.columns.yaw_rate \(column r\): Nr is \+"),
                ("X", -1.0, r"averages.columns.X \(column X\) .*R0"),
                ("N", -1.0, r"averages.columns.N \(column N\) .*x_H"),
            )
        ),
    ],
)
def test_columns_of_another_sign_or_unit_are_refused_by_their_names(tmp_path, column, factor, words) -> None:
    path = write_campaign(tmp_path, KVLCC2, torque=column == "Q")
    scale_column(tmp_path, column, factor)
    with pytest.raises(InputError, match=words) as fault:
        t2s.reduce_to_mmg(path)
    assert fault.value.source == str(path)


@pytest.mark.slow
def test_points_of_the_open_water_curve_have_a_row_and_mark_a_result_that_they_doubt(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2)
    sound = t2s.reduce_to_mmg(path)
    assert sound.cautions == () and sound.study.open_water["K_T"].unexplained < 0.02
    assert [row[0] for row in sound.tables[1].rows][-1].startswith("K_T")
    scale_column(tmp_path, "K_T", 1.1)
    doubted = t2s.reduce_to_mmg(path)
    assert doubted.study.open_water["K_T"].unexplained == pytest.approx(0.09, abs=0.01)
    assert any("K_T" in mark for mark in doubted.cautions)
    with_torque = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, torque=True))
    assert [row[0].partition(" ")[0] for row in with_torque.tables[1].rows][-2:] == ["K_T", "K_Q"]


def test_what_a_fit_says_of_its_coefficients_follows_from_their_errors(tmp_path) -> None:
    fit = fit_mmg(read_steady_tests(write_campaign(tmp_path, KVLCC2)))
    assert fit.open == fit.at_limit == ()
    a_H, x_H = (fit.names.index(name) for name in ("a_H", "x_H"))
    arm, error = fit.yaw_arm()
    assert arm == pytest.approx(-0.5 + fit.values[a_H] * fit.values[x_H])
    block = fit.covariance[np.ix_([a_H, x_H], [a_H, x_H])]
    drawn = np.random.default_rng(1).multivariate_normal(fit.values[[a_H, x_H]], 1e-4 * block, 20_000)
    assert 1e-2 * error == pytest.approx(np.std(drawn[:, 0] * drawn[:, 1]), rel=0.03)
    assert fit.in_errors("k_0") == pytest.approx(abs(fit.value("k_0")) / fit.random[fit.names.index("k_0")])
    assert fit.value("Nothing") == 0.0
    for name, value, at_limit in (
        ("eps", 2.9995, True),
        ("eps", 2.99, False),
        ("C_1", 0.01, True),
        ("C_1", 0.1, False),
    ):
        values = fit.values.copy()
        values[fit.names.index(name)] = value
        assert replace(fit, values=values).at_limit == ((name,) if at_limit else ())
    for share, is_open in ((0.69, False), (0.71, True)):
        random = fit.random.copy()
        random[fit.names.index("kappa")] = share * ORDINARY["kappa"][1]
        assert replace(fit, random=random).open == (("kappa",) if is_open else ())


def test_ordinary_ships_enclose_the_kvlcc2_within_about_a_deviation() -> None:
    apart = {name: abs(KVLCC2[name] - mean) / spread for name, (mean, spread) in ORDINARY.items()}
    assert set(ORDINARY) == set(KVLCC2) & set(ORDINARY) and max(apart.values()) <= 0.5


def test_a_hull_whose_derivatives_no_ship_has_marks_the_result(tmp_path) -> None:
    fit = fit_mmg(read_steady_tests(write_campaign(tmp_path, KVLCC2)))
    for name, value in (("Nr", 0.03), ("Nr", -0.5), ("Nr", -0.005), ("Nv", 0.1), ("l_R", 0.5), ("t_P", 0.75)):
        values = fit.values.copy()
        values[fit.names.index(name)] = value
        marks = MmgReductionResult(study_mmg(replace(fit, values=values))).cautions
        assert any(f"{name} is" in mark for mark in marks), name


@pytest.mark.slow
def test_the_polynomial_warns_of_a_yaw_rate_in_another_unit(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2)
    assert not t2s.reduce(path).cautions
    path.write_text(path.read_text().replace("yaw_rate_prime", "yaw_rate_degps"))
    assert any("yaw rate" in line for line in t2s.reduce(path).cautions)


def test_the_polynomial_takes_turns_and_leaves_out_other_loads_of_the_propeller(tmp_path) -> None:
    result = t2s.reduce(write_campaign(tmp_path, KVLCC2))
    found = result.reduction
    loaded = sum(abs(n / 10.4 - 1) > 0.03 for n in conditions()[:, 4])
    assert sum(" left out (" in notice for notice in result.notices) == 1
    assert sum("rpm" in reason for reason in found.not_used.values()) == loaded > 0
    assert {"steady_turn"} <= {run.run.type for run in found.runs}
    U, step = np.full(2, 1.179), np.array([-0.05, 0.05])
    read = forces(KVLCC2, U, 0 * step, step, 0 * step, np.full(2, 10.4))
    slope = np.diff(read["N"] + 3270.0 * 0.25 * step * U**2 / 7.0)[0] / (0.1 * 0.5 * 1000.0 * 7.0**3 * 1.179**2)
    assert found.derivatives["Nr"].value == pytest.approx(slope, rel=0.15)


@pytest.mark.slow
def test_the_command_writes_the_card_with_its_covariance(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2)
    options = ("--mmg", "-o", "ship.toml")
    assert tank2sim("reduce", str(path), *options, cwd=tmp_path).returncode == 0
    assert t2s.load(tmp_path / "ship.toml").card.interaction("w_P0") == pytest.approx(0.40, abs=0.02)
    assert (tmp_path / "ship.covariance.json").exists()
    refused(tank2sim("reduce", str(path), "--mmg", "--fill", "clarke1983", cwd=tmp_path), "--fill")


def test_the_tests_of_hmri_give_the_kvlcc2_of_another_tank(tmp_path, data) -> None:
    """Yasukawa and Yoshimura (2015) tested another model: what a second tank confirms is the structure."""
    found = t2s.reduce_to_mmg(hmri_campaign(data, tmp_path)).coefficients
    assert found["w_P0"].value == pytest.approx(0.387, abs=0.03)  # thrust identity at 1.17 m/s
    assert found["C_2_plus"].value > found["C_2_minus"].value > 1.0
    assert found["gamma_R_plus"].value == pytest.approx(0.640, abs=0.1)
    assert found["gamma_R_minus"].value == pytest.approx(0.395, abs=0.1)
    assert found["eps"].value == pytest.approx(1.09, abs=0.06)
    assert found["kappa"].value == pytest.approx(0.5, abs=0.1)
    assert found["Yv"].value == pytest.approx(-0.315, rel=0.1)
    assert found["Nv"].value == pytest.approx(-0.137, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("on_model", [False, True])
def test_runs_with_a_history_give_the_coefficients_of_their_means(tmp_path, on_model) -> None:
    path = write_campaign(tmp_path, KVLCC2, seed=4)
    by_rows = fit_mmg(read_steady_tests(path))
    by_runs = fit_mmg(read_steady_tests(as_runs(tmp_path, on_model=on_model)))
    assert by_runs.names == by_rows.names
    np.testing.assert_allclose(by_runs.values, by_rows.values, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(by_runs.errors, by_rows.errors, rtol=1e-2)


@pytest.mark.parametrize("on_model", [False, True])
def test_means_of_runs_with_a_history_are_the_rows_of_a_table(tmp_path, on_model) -> None:
    by_rows = read_steady_tests(write_campaign(tmp_path, KVLCC2, seed=4))
    by_runs = read_steady_tests(as_runs(tmp_path, on_model=on_model))
    np.testing.assert_allclose(by_runs.motion, by_rows.motion, rtol=1e-6, atol=1e-6)
    for place, values in enumerate(by_rows.readings.T):
        np.testing.assert_allclose(by_runs.readings[:, place], values, rtol=1e-3, atol=0.01 * np.std(values))


@pytest.mark.parametrize(
    ("old", "words"), [("thrust_N", "thrust_N"), ("rudder_normal_force_N", "normal"), ("propeller_rps", "revol")]
)
def test_a_run_without_what_the_method_needs_is_refused_by_its_name(tmp_path, old, words) -> None:
    write_campaign(tmp_path, KVLCC2)
    path = as_runs(tmp_path)
    (tmp_path / "7.csv").write_text((tmp_path / "7.csv").read_text().replace(old, "temperature"))
    with pytest.raises(InputError, match=words) as fault:
        read_steady_tests(path)
    assert fault.value.source == "7.csv"


def test_oscillating_runs_are_left_out_and_named(tmp_path) -> None:
    write_campaign(tmp_path, KVLCC2)
    path = as_runs(tmp_path)
    time = np.arange(0.0, 60.0, 0.2)
    rate = 0.05 * np.cos(0.4 * time)
    rows = np.column_stack([time, np.full_like(time, 1.179), rate, 0 * time - 9, -300 * rate, -4000 * rate])
    np.savetxt(tmp_path / "yaw.csv", rows, delimiter=",", header="t_s,speed_mps,r_radps,X_N,Y_N,N_Nm", comments="")
    steady = read_steady_tests(path)
    path.write_text(path.read_text() + '[[runs]]\nfile = "yaw.csv"\ntype = "pure_yaw"\n')
    both = read_steady_tests(path)
    assert both.names == steady.names
    assert any("yaw.csv" in remark for remark in both.remarks)


@pytest.mark.slow
def test_errors_common_to_all_conditions_are_covered_where_they_are_stated(tmp_path) -> None:
    inside, without = [], []
    for seed in range(SEEDS):
        truth = another_ship(tmp_path, 8000 + seed)
        found = t2s.reduce_to_mmg(with_common_errors(write_campaign(tmp_path, truth, seed), seed)).coefficients
        measured = {name: value for name, value in truth.items() if found[name].origin == "measured"}
        apart = {name: abs(found[name].value - value) for name, value in measured.items()}
        inside += [apart[name] < 1.96 * found[name].standard_error for name in measured]
        without += [apart[name] < 1.96 * found[name].type_a for name in measured]
    assert 0.90 <= np.mean(inside) <= 0.98
    assert np.mean(without) < 0.85


def test_parts_of_the_uncertainty_add_up_and_each_has_its_own_effect(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2)
    plain = t2s.reduce_to_mmg(path)
    path.write_text(STATED + path.read_text())
    result = t2s.reduce_to_mmg(path)
    for name, entry in result.coefficients.items():
        assert entry.standard_error == pytest.approx(np.hypot(entry.type_a, np.linalg.norm([*entry.type_b.values()])))
        assert entry.type_a == pytest.approx(plain.coefficients[name].standard_error, rel=1e-6)
    # K_T = T/(rho n^2 D^4) of all points: 1 % of speed is 1 % of 1 - w_P0, 1 % of thrust moves only that.
    w = result.coefficients["w_P0"]
    assert w.type_b["speed_relative"] == pytest.approx(0.01 * (1 - w.value), rel=0.15)
    assert result.coefficients["k_0"].type_b["mass_relative"] < 1e-3 * result.coefficients["k_0"].type_a
    assert result.coefficients["Yr"].type_b["mass_relative"] > 1e3 * result.coefficients["t_P"].type_b["mass_relative"]
    assert not any("scatter alone" in notice for notice in result.notices)
    assert any("scatter alone" in notice for notice in plain.notices)


@pytest.mark.slow
def test_torque_gives_the_relative_rotative_efficiency_and_leaves_the_ship_as_it_is(tmp_path) -> None:
    truth = of_the_estimate(tmp_path)
    found = t2s.reduce_to_mmg(write_campaign(tmp_path, truth, noise=1e-5, torque=True)).coefficients
    for name, value in (truth | TORQUE).items():
        assert found[name].value == pytest.approx(value, rel=2e-3, abs=2e-4), name
    plain = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, seed=3))
    result = t2s.reduce_to_mmg(write_campaign(tmp_path, KVLCC2, seed=3, torque=True))
    assert result.coefficients["w_P0"].standard_error < plain.coefficients["w_P0"].standard_error
    of_torque = {f"propeller.{name}" for name in TORQUE}
    assert set(result.card.covariance.names) - of_torque == set(plain.card.covariance.names)
    written = t2s.Ship(result.card)
    assert written.card.propeller.eta_R == pytest.approx(result.coefficients["eta_R"].value, rel=1e-4)
    assert "propeller.power" in written.model.outputs and "propeller.power" not in t2s.Ship(plain.card).model.outputs
    assert result.study.readings["Q"].unit == "N.m"
    for name in ("Yv", "Nr", "t_P", "eps"):
        apart = abs(result.coefficients[name].value - plain.coefficients[name].value)
        assert apart < plain.coefficients[name].standard_error, name


@pytest.mark.slow
def test_blockage_of_the_tank_is_named_until_it_is_stated(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2)
    tank = "[tank]\nlength_m = 200.0\nbreadth_m = 10.0\ndepth_m = 5.0\n"
    path.write_text(tank + path.read_text())
    share = 1.27 * 0.46 / 50.0
    raised = share / (1 - share - 1.179**2 / (9.80665 * 5.0))
    assert any("Schuster" in notice and f"{100 * raised:.2g} %" in notice for notice in t2s.reduce_to_mmg(path).notices)
    path.write_text(STATED + path.read_text())
    assert not any("Schuster" in notice for notice in t2s.reduce_to_mmg(path).notices)


def test_two_propellers_and_rudders_give_the_coefficients_of_both_sides(tmp_path) -> None:
    truth = of_the_estimate(tmp_path)
    result = t2s.reduce_to_mmg(write_campaign(tmp_path, truth, noise=1e-5, y=0.05))
    for name, value in truth.items():
        assert result.coefficients[name].value == pytest.approx(value, rel=2e-3, abs=2e-4), name
    assert result.card.propeller.number == result.card.rudder.number == 2
    assert result.card.propeller.y_P == result.card.rudder.y_R == 0.05
    assert set(result.study.readings) == {"X", "Y", "N", "T", "F_N", "T_left", "F_N_left"}


@pytest.mark.slow
def test_sides_that_are_exchanged_do_not_pass_for_the_ship(tmp_path) -> None:
    path = write_campaign(tmp_path, KVLCC2, y=0.05)
    right = t2s.reduce_to_mmg(path)
    text = path.read_text().replace('thrust = "T"', 'thrust = "TL"').replace('thrust_left = "TL"', 'thrust_left = "T"')
    path.write_text(text)
    exchanged = t2s.reduce_to_mmg(path)
    assert exchanged.unexplained[3] > 3 * right.unexplained[3]
