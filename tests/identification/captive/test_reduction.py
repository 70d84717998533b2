"""The whole way from a campaign to derivatives: against truth, in every convention, and on the real table."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.answer.study import study_values
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.captive.consistency import repeats
from tank2sim.identification.captive.findings import reduction_findings
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.identification.captive.result_card import card_contents, reduced_card_text, reynolds_ratio
from tank2sim.identification.captive.stepwise import scatter_within_tests
from tank2sim.identification.captive.study import prediction_errors, study_reduction
from tank2sim.identification.captive.systematic import type_b_shifts
from tank2sim.records.campaigns import read_campaign
from tests.conftest import ROOT
from tests.identification.captive.generator import Campaign, write
from tests.marks import first_fast

QUIET = Campaign(seed=4, noise=0.0, zero_error=0.0, vibration=False, rate_hz=10.0)


def reduced(campaign, folder, options=None, change=("", "")):
    """Reduction of a made-up campaign, and the ship behind it; its file changed by replacing a text."""
    written = write(campaign, folder)
    written.path.write_text(written.path.read_text().replace(*change))
    return reduce_campaign(read_campaign(written.path), options), written


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    return reduced(Campaign(seed=4, rate_hz=10.0), tmp_path_factory.mktemp("noisy"))[0]


@pytest.fixture(scope="module")
def hmri(data):
    return reduce_campaign(read_campaign(data / "data" / "kvlcc2_captive_hmri" / "campaign.toml"))


@first_fast("convention", ["on_model", "on_gauge", "hydrodynamic"])
def test_without_noise_every_derivative_is_found_in_every_convention(tmp_path, convention):
    found, written = reduced(replace(QUIET, force_convention=convention, asymmetry=True), tmp_path)
    truth = {name: value for name, value in written.derivatives.items() if value}
    assert set(truth) - {"Xudot"} == set(found.derivatives)
    for name, derivative in found.derivatives.items():
        assert derivative.value == pytest.approx(truth[name], rel=2e-4), name


@pytest.mark.slow
def test_speed_and_rates_that_are_resolved_into_ship_axes(tmp_path):
    axial = ("[test]", '[test]\ninertia_speed = "axial"')
    found, written = reduced(replace(QUIET, surge="resolved"), tmp_path, change=axial)
    for name in ("Yv", "Yvvv", "Yvvr", "Nvvr", "Xvv", "Xvr"):
        assert found.derivatives[name].value == pytest.approx(written.derivatives[name], rel=3e-4), name


@first_fast("number", [11, 12])
def test_the_campaigns_with_known_truth_are_met_within_three_standard_errors(data, number):
    folder = data / "data"
    truth = json.loads((folder / f"pmm_synthetic_{number}-truth.json").read_text())
    found = reduce_campaign(read_campaign(folder / f"pmm_synthetic_{number}" / "campaign.toml"))
    assert set(truth["derivatives"]) <= set(found.derivatives)
    ratios = np.array(
        [
            (found.derivatives[name].value - value) / found.derivatives[name].standard_error
            for name, value in truth["derivatives"].items()
        ]
    )
    assert np.max(np.abs(ratios)) < 3
    assert 0.6 < np.sqrt(np.mean(ratios**2)) < 1.4
    card = card_contents(found)
    assert card.mass == pytest.approx(truth["mass"], rel=1e-4)
    assert card.yaw_inertia == pytest.approx(truth["yaw_inertia"], rel=1e-4)


@pytest.mark.slow
def test_standard_errors_hold_the_zero_errors_of_the_runs(data):
    """Ordinary least squares over the samples would state the error of Yd several times too small."""
    found = reduce_campaign(read_campaign(data / "data" / "pmm_synthetic_12" / "campaign.toml"))
    runs = [run for run in found.runs if run.run.type == "static_rudder"]
    unit = float(found.campaign.scales.force)
    rudder = np.concatenate([run.run.delta_rad for run in runs])
    force = np.concatenate([run.run.Y_N for run in runs]) / unit
    design = np.column_stack([rudder, rudder**3])
    residual = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    naive = np.sqrt(np.linalg.inv(design.T @ design)[0, 0] * residual @ residual / (len(force) - 2))
    assert found.derivatives["Yd"].standard_error > 2 * naive
    zero = math.sqrt(found.forces["Y"].selection.spread.zero_variance) * unit
    assert zero == pytest.approx(0.42, rel=0.15)  # a sixth of the noise of 2.5 N


def test_the_papers_order_gives_linear_terms_from_the_simplest_tests(noisy):
    steps = noisy.forces["Y"].stepwise
    found_in = dict(zip(steps.names, steps.found_in, strict=True))
    expected = {"Yv": "static_drift", "Yd": "static_rudder", "Yvdot": "pure_sway", "Yr": "pure_yaw"}
    assert expected.items() <= found_in.items()
    assert found_in["Yvvr"] == found_in["Yvrr"] == "yaw_with_drift"
    for name, value, error in zip(steps.names, steps.values, steps.standard_errors, strict=True):
        best = noisy.forces["Y"].solution
        assert abs(value - best.value(name)) < 4 * error
        assert error > 0.9 * best.error(name) / 1.1


def test_tests_that_contradict_each_other_are_reported(tmp_path):
    written = write(Campaign(seed=4, rate_hz=10.0), tmp_path)
    campaign = read_campaign(written.path)
    runs = [replace(run, Y_N=1.25 * run.Y_N) if run.type == "static_drift" else run for run in campaign.runs]
    reported = reduction_findings(reduce_campaign(replace(campaign, runs=tuple(runs))))
    assert any(sentence.startswith("Yv is") and "test by test" in sentence for sentence in reported)


def test_every_candidate_is_accounted_for_with_a_reason(noisy):
    choices = {choice.name: choice for choice in noisy.forces["N"].selection.choices}
    assert len(choices) == 22 + 2
    assert choices["Nrrd"].reason == "not excited"
    assert choices["Nv"].reason == "linear"
    assert choices["Nvvr"].reason == "determined"
    assert all(choice.explanation for choice in choices.values())
    assert choices["Nv"].inflation > 1
    shown = {name for name, choice in choices.items() if choice.kept}
    assert shown == {name for name in noisy.derivatives if name[0] == "N"}


def test_terms_that_cannot_be_distinguished_are_left_out_and_reported(hmri):
    reasons = {choice.name: choice for choice in hmri.forces["Y"].selection.choices}
    assert reasons["Yvdd"].reason == "collinear"  # rudder and drift keep one ratio in the combined tests
    assert "condition number" in reasons["Yvdd"].explanation
    assert reasons["Yvdd"].inflation > 30


def reasons(reduction):
    return {choice.name: choice.reason for f in reduction.forces.values() for choice in f.selection.choices}


@pytest.mark.slow
def test_terms_of_small_angles_are_left_out_with_the_reason_unless_asked_for(tmp_path):
    found, _ = reduced(Campaign(seed=4, size="linear", rate_hz=10.0), tmp_path)
    left_out = {name for name, reason in reasons(found).items() if reason == "not determined"}
    assert left_out  # the rudder reaches 10 deg
    assert not left_out & set(found.derivatives)
    assert left_out <= set(reduce_campaign(found.campaign, ReductionOptions(all_terms=True)).derivatives)


def test_a_term_that_does_not_differ_from_zero_is_kept_with_its_error(noisy):
    """To leave it out would claim that it is zero, without any error."""
    shown = {name: value.value / value.standard_error for name, value in noisy.derivatives.items()}
    assert min(map(abs, shown.values())) < 1.0
    excited = {name for name, reason in reasons(noisy).items() if reason not in ("not excited", "collinear")}
    assert excited == set(noisy.derivatives)
    assert {"Yddd", "Nddd", "Yvvv", "Nvvv", "Yrrr", "Nrrr", "Yvdd", "Nvdd"} <= excited


@pytest.mark.slow
def test_which_terms_are_kept_does_not_depend_on_the_noise(noisy, tmp_path):
    """At three times the noise Nddd is at 2.3 standard errors or less in some campaigns; the tests are the same."""
    for seed in (4, 5, 6):
        loud, _ = reduced(Campaign(seed=seed, rate_hz=10.0, noise=3.0, zero_error=3.0), tmp_path / str(seed))
        assert set(loud.derivatives) == set(noisy.derivatives)


@pytest.mark.slow
def test_asymmetry_of_a_single_screw_is_found(tmp_path):
    found, written = reduced(Campaign(seed=4, rate_hz=10.0, asymmetry=True), tmp_path)
    for name in ("Y0", "N0"):
        derivative = found.derivatives[name]
        assert abs(derivative.value - written.derivatives[name]) < 3 * derivative.standard_error
        assert abs(derivative.value) > 3 * derivative.standard_error


@pytest.mark.slow
def test_symmetry_is_tested_when_asked_for(tmp_path):
    written = write(Campaign(seed=4, rate_hz=10.0), tmp_path)
    campaign = read_campaign(written.path)
    even = [
        replace(run, Y_N=run.Y_N + 0.02 * float(campaign.scales.force) * (run.v_mps / run.speed_mps) ** 2)
        for run in campaign.runs
    ]
    options = ReductionOptions(test_symmetry=True)
    sound = reduce_campaign(campaign, options)
    skewed = reduce_campaign(replace(campaign, runs=tuple(even)), options)
    assert sound.forces["Y"].asymmetry.chance > 1e-3
    assert skewed.forces["Y"].asymmetry.chance < 1e-6
    test = skewed.forces["Y"].asymmetry
    assert test.values[test.names.index("Yvv")] == pytest.approx(0.02, rel=0.2)
    assert any(
        "Symmetry of Y to port and starboard does not hold" in sentence for sentence in reduction_findings(skewed)
    )


@pytest.mark.slow
def test_fast_oscillations_are_flagged_and_left_out_unless_asked_for(tmp_path):
    campaign = replace(QUIET, frequency_parameters=(0.04, 0.08, 0.12))
    found, written = reduced(campaign, tmp_path)
    fast = {run.name for run in found.campaign.runs if run.name.startswith(("sway_2", "yaw_2"))}
    assert set(found.not_used) == fast
    assert all("omega U/g is 0.12" in reason for reason in found.not_used.values())
    assert any(f"{len(fast)} runs left out" in sentence for sentence in reduction_findings(found))
    kept = reduce_campaign(found.campaign, ReductionOptions(keep_fast=True))
    assert not kept.not_used
    assert len(kept.runs) == len(written.runs)


@pytest.mark.slow
def test_a_trend_with_frequency_is_found_and_the_value_is_that_at_zero_frequency(tmp_path):
    written = write(replace(QUIET, noise=1.0, zero_error=1.0), tmp_path)
    campaign = read_campaign(written.path)
    slope, length = 1e-4, campaign.model.length_m

    def with_trend(run):
        if run.type != "pure_sway":
            return run
        frequency = run.sheet.frequency_radps
        acceleration = -(frequency**2) * run.y_m
        change = slope * (frequency * length / campaign.test.speed_mps) ** 2 * float(campaign.scales.mass)
        return replace(run, Y_N=run.Y_N + change * acceleration)

    runs = [with_trend(run) for run in campaign.runs]
    found = reduce_campaign(replace(campaign, runs=tuple(runs)))
    trend = next(trend for trend in found.forces["Y"].trends if trend.name == "Yvdot")
    assert trend.used
    assert abs(trend.slope - slope) < 3 * trend.standard_error
    derivative = found.derivatives["Yvdot"]
    assert abs(derivative.value - written.derivatives["Yvdot"]) < 3 * derivative.standard_error
    assert any(sentence.startswith("Yvdot changes with the frequency") for sentence in reduction_findings(found))
    assert not any(trend.used for trend in reduce_campaign(campaign).forces["Y"].trends)


def test_a_run_that_does_not_belong_to_the_others_is_named(noisy):
    runs = [replace(run, N_Nm=1.3 * run.N_Nm) if run.name == "both_+08_-20.csv" else run for run in noisy.campaign.runs]
    reported = reduction_findings(reduce_campaign(replace(noisy.campaign, runs=tuple(runs))))
    assert any(sentence.startswith("both_+08_-20.csv: N does not fit the other runs") for sentence in reported)
    assert not any("does not fit the other runs" in sentence for sentence in reduction_findings(noisy))


def test_leaving_one_run_out_predicts_it_from_the_others(noisy):
    row = next(row for row in noisy.forces["Y"].left_out if row.run == "drift_+08.csv")
    without = reduce_campaign(noisy.campaign.without({"drift_+08.csv"}), ReductionOptions(all_terms=True))
    v = -math.sin(math.radians(8))
    values = without.derivatives
    predicted = sum(values[name].value * v**power for name, power in (("Y0", 0), ("Yv", 1), ("Yvvv", 3)))
    assert row.predicted == pytest.approx(predicted, rel=5e-3)
    assert abs(row.error) < 4 * row.standard_error


def test_repeated_runs_tell_what_one_is_worth(noisy):
    twice = [replace(run, name=f"again {run.name}", Y_N=run.Y_N + 2.0) for run in noisy.campaign.runs[:3]]
    campaign = replace(noisy.campaign, runs=(*noisy.campaign.runs, *twice))
    found = repeats(campaign, reduce_campaign(campaign).runs)
    assert found.freedom >= 3
    assert ("drift_-12.csv", "again drift_-12.csv") in found.groups
    assert found.deviation["Y"] * float(campaign.scales.force) >= 1.0


@pytest.mark.slow
def test_type_b_errors_are_carried_through(tmp_path):
    stated = "[test]", "[uncertainty]\ncalibration_relative = 0.01\nalignment_deg = 0.1\nmass_relative = 0.001\n[test]"
    found, _ = reduced(QUIET, tmp_path, change=stated)
    m = found.campaign.model.mass_kg / float(found.campaign.scales.mass)
    Yv, Yvdot, Y = found.derivatives["Yv"], found.derivatives["Yvdot"], found.forces["Y"].solution
    assert Yv.type_b["calibration_relative"] == pytest.approx(0.01 * abs(Yv.value), rel=1e-3)
    # the gauges measure the body's inertia with the water's: their error is one of both
    assert Yvdot.type_b["calibration_relative"] == pytest.approx(0.01 * abs(Yvdot.value - m), rel=1e-3)
    assert Yvdot.type_b["mass_relative"] == pytest.approx(0.001 * m, rel=1e-3)
    assert Yv.type_b["alignment_rad"] < 0.02 * abs(Yv.value)
    # a model that is askew sways at zero drift: the constant takes it up, and of the cube what is even
    shifts = type_b_shifts(found.campaign, found.forces["Y"].selection.equations, Y)
    assert abs(shifts["alignment_rad"]["Y0"]) == pytest.approx(abs(Yv.value) * math.radians(0.1), rel=0.25)
    total = math.hypot(Yv.type_a, *Yv.type_b.values())
    assert Yv.standard_error == pytest.approx(total)
    assert Yv.type_a == pytest.approx(Y.error("Yv"))


def test_yaw_tests_need_the_yaw_inertia(tmp_path):
    written = write(QUIET, tmp_path)
    lines = [line for line in written.path.read_text().splitlines() if "yaw_inertia" not in line]
    written.path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"model\.yaw_inertia_kgm2: is missing"):
        reduce_campaign(read_campaign(written.path))


def test_the_card_says_what_the_reduction_says(noisy):
    card = card_contents(noisy)
    text = reduced_card_text(noisy, card)
    read = parse_card(text, "card.toml")
    result = study_values(study_reduction(noisy, card, reduction_findings(noisy)))
    assert {name: entry["value"] for name, entry in result["derivatives"].items()} == dict(read.derivatives)
    assert {n: entry["standard_error"] for n, entry in result["derivatives"].items()} == dict(read.uncertainty)
    assert read.model.yaw_rate_terms == "hydrodynamic"
    assert read.model.speed_scale == "instantaneous"
    assert read.model.speed_mps == pytest.approx(noisy.campaign.test.speed_mps, rel=1e-5)
    assert "X0" not in read.derivatives  # the resistance of a model without a propeller
    assert result["resistance"]["X0"]["value"] == pytest.approx(-1e-3, rel=0.4)
    assert "measured" in text
    build(read)


def test_a_card_at_ship_scale_follows_froude(noisy):
    card = card_contents(noisy)
    model, ship = (parse_card(reduced_card_text(noisy, card, scale), "card.toml") for scale in (1.0, 36.0))
    assert ship.derivatives == model.derivatives
    assert ship.rigid_body == model.rigid_body
    assert ship.ship.length_m == pytest.approx(36 * model.ship.length_m, rel=1e-5)
    # equal Froude number at the gravity of each place
    froude = [card.model.speed_mps**2 / card.environment.gravity_mps2 / card.ship.length_m for card in (model, ship)]
    assert froude[1] == pytest.approx(froude[0], rel=1e-4)
    assert ship.ship.displacement_kg == pytest.approx(36**3 * 1.025 * model.ship.displacement_kg, rel=1e-5)
    assert reynolds_ratio(noisy.campaign, 36.0) == pytest.approx(216.0)


def test_what_is_missing_is_filled_from_a_named_estimate_and_marked(hmri):
    bare, filled = card_contents(hmri), card_contents(hmri, "clarke1983")
    assert set(bare.missing) == {"Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", "Yr", "Nr"} == set(filled.estimated)
    assert not filled.missing
    for name in filled.estimated:
        entry = filled.entries[name]
        assert entry.how.startswith("ESTIMATED")
        assert entry.standard_error > 0.25 * abs(entry.value)
    assert filled.entries["Yv"] == bare.entries["Yv"]
    assert "ESTIMATED: Clarke" in reduced_card_text(hmri, filled)


def test_a_towed_model_gets_its_thrust_with_the_fill(noisy):
    entries = card_contents(noisy, "clarke1983").entries
    resistance = noisy.derivatives["X0"].value
    # at 80 % of the speed and constant thrust X' is X0' (1 - (1/0.8)^2)
    change = (0.8 - 1.0) / 0.8
    force = entries["Xu"].value * change + entries["Xuu"].value * change**2
    assert force == pytest.approx(resistance * (1 - 1 / 0.8**2), rel=1e-3)
    assert force > 0


def test_the_real_table_predicts_each_condition_from_the_others(hmri):
    errors = prediction_errors(hmri)
    assert errors["drift_and_rudder"]["Y"].relative < 0.03
    assert errors["drift_and_rudder"]["N"].relative < 0.03
    assert errors["static_drift"]["Y"].relative < 0.03


def test_the_real_table_has_the_signs_of_a_ship(hmri):
    values = {name: derivative.value for name, derivative in hmri.derivatives.items()}
    assert values["Yv"] < 0 > values["Nv"]
    assert values["Yd"] < 0 < values["Nd"]


def test_speed_and_load_that_change_together_are_reported_and_left_out(hmri):
    assert len(hmri.not_used) == 20
    reported = " ".join(reduction_findings(hmri))
    assert "speed and propeller load change together" in reported
    assert not any("u" in name.removesuffix("udot") for name in hmri.derivatives)
    more = reduce_campaign(hmri.campaign, ReductionOptions(off_speed=True))
    assert not more.not_used
    assert {"Xu", "Xuu", "Ydu"} <= set(more.derivatives)
    assert more.derivatives["Xu"].value < 0
    assert "at constant revolutions" in " ".join(reduction_findings(more))


@pytest.mark.parametrize("name", ["drift_+08.csv", "rudder_-20.csv"])
def test_harmonics_are_reported_without_dimension(noisy, name):
    """The mean of a steady run by 1/2 rho L^2 U^2, and L more for a moment."""
    reported = study_reduction(noisy, card_contents(noisy))
    record = next(run for run in noisy.campaign.runs if run.name == name)
    shown = next(run for run in reported.runs if run.name == name)
    assert shown.speed_mps == pytest.approx(record.speed_mps.mean(), rel=1e-3)
    force = 0.5 * 1000.0 * noisy.campaign.model.length_m**2 * record.speed_mps.mean() ** 2
    for letter, values, unit in (("Y", record.Y_N, force), ("N", record.N_Nm, force * noisy.campaign.model.length_m)):
        mean = shown.harmonics[letter]["mean"]
        assert abs(mean.value) == pytest.approx(abs(values.mean()) / unit, rel=2e-3)
        white = values.std() / unit / np.sqrt(len(values))
        assert 0.1 * white < mean.standard_error < 10 * white


@pytest.mark.slow
def test_the_scatter_within_tests_is_that_of_the_noise_in_any_order_of_the_runs(tmp_path):
    """All drift runs are static or with rudder: a linear term of each of the two kinds is one column too many."""
    script = ROOT / "docs" / "examples" / "make_campaign.py"
    subprocess.run([sys.executable, script, "campaign"], cwd=tmp_path, check=True, capture_output=True)
    campaign = read_campaign(tmp_path / "campaign" / "campaign.toml")
    for force in "YN":
        spreads = [
            scatter_within_tests(reduce_campaign(replace(campaign, runs=runs)).forces[force].selection.equations)
            for runs in (campaign.runs, campaign.runs[::-1])
        ]
        assert spreads[0].noise == pytest.approx(1.0, abs=0.2)  # the covariance within a run is complete: white noise
        assert spreads[1].noise == pytest.approx(spreads[0].noise, rel=1e-4)
        assert spreads[1].zero_variance == pytest.approx(spreads[0].zero_variance, rel=1e-2)
