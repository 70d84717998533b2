"""Errors common to many runs: a delay of the forces, gauges of different gain, numbers that cannot be, copies."""

import math
from dataclasses import replace

import pytest

from tank2sim.errors import InputError
from tank2sim.identification.captive.findings import implausible, reduction_findings
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.notices import caution
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.marks import first_fast

SOUND = Campaign(seed=7, rate_hz=10.0)


def reduced(campaign, folder, *changes):
    """Reduction of a made-up campaign whose file is changed by replacing texts, and the truth behind it."""
    written = write(campaign, folder)
    text = written.path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    written.path.write_text(text)
    return reduce_campaign(read_campaign(written.path)), written


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return reduced(SOUND, tmp_path_factory.mktemp("sound"))


def ratios(reduction, written, names):
    found = reduction.derivatives
    return {name: (found[name].value - written.derivatives[name]) / found[name].standard_error for name in names}


@first_fast("delay, convention", [(0.03, "on_model"), (0.15, "on_gauge"), (-0.05, "on_model")])
def test_a_delay_of_the_forces_is_estimated_and_reported_first(tmp_path, delay, convention):
    campaign = replace(SOUND, force_delay_s=delay, force_convention=convention)
    found, written = reduced(campaign, tmp_path)
    (error,) = found.systematic
    assert error.source == "force_delay"
    assert error.force == "XYN"
    assert abs(error.size - delay) < 4 * error.standard_error
    assert error.standard_error < 0.1 * abs(delay)
    assert reduction_findings(found)[0] == caution(error.message)
    wrong = ratios(found, written, ("Yvdot", "Yrdot", "Nvdot", "Nrdot"))
    assert max(map(abs, wrong.values())) < 3.0, wrong
    assert 0 < found.derivatives["Yrdot"].type_b["force_delay"] < found.derivatives["Yrdot"].type_a


@pytest.mark.slow
def test_the_key_of_the_campaign_takes_the_delay_out(tmp_path, sound):
    campaign = replace(SOUND, force_delay_s=0.03)
    found, written = reduced(campaign, tmp_path, ("[test]", "[test]\nforce_delay_s = 0.03"))
    assert not found.systematic
    for name, derivative in sound[0].derivatives.items():
        assert abs(found.derivatives[name].value - derivative.value) < 0.5 * derivative.standard_error, name
    doubtful, _ = reduced(
        campaign, tmp_path / "doubt", ("[test]", "[uncertainty]\nforce_delay_s = 0.002\n[test]\nforce_delay_s = 0.03")
    )
    m = campaign_mass(doubtful)
    # damping turns into added mass: by the paper's (4.4) a delay tau changes Y_rdot by (Y_r - m') tau U/L
    expected = abs(written.derivatives["Yr"] - m) * 0.002 * written.ship.speed_mps / written.ship.length_m
    assert doubtful.derivatives["Yrdot"].type_b["force_delay_s"] == pytest.approx(expected, rel=0.05)


def campaign_mass(reduction):
    return reduction.campaign.model.mass_kg / float(reduction.campaign.scales.mass)


@pytest.mark.slow
def test_a_force_that_depends_on_the_frequency_is_no_delay(tmp_path):
    """A memory of the flow acts on sway alone: it is a trend, as before."""
    written = write(SOUND, tmp_path)
    campaign = read_campaign(written.path)
    length, speed = campaign.model.length_m, campaign.test.speed_mps

    def remembering(run):
        if run.type != "pure_sway":
            return run
        share = 0.02 * (run.sheet.frequency_radps * length / speed) ** 2
        change = share * written.derivatives["Yv"] * float(campaign.scales.force) * run.v_mps / run.speed_mps
        return replace(run, Y_N=run.Y_N + change)

    found = reduce_campaign(replace(campaign, runs=tuple(remembering(run) for run in campaign.runs)))
    assert not [error for error in found.systematic if error.source == "force_delay"]
    assert "Yv" in {trend.name for trend in found.forces["Y"].trends if trend.used}


def test_a_campaign_of_one_frequency_says_that_it_cannot_show_a_delay(tmp_path, sound):
    one, _ = reduced(replace(SOUND, frequency_parameters=(0.05,), force_delay_s=0.03), tmp_path)
    assert any("whether the forces lag the motion" in sentence for sentence in reduction_findings(one))
    assert not any("whether the forces lag the motion" in sentence for sentence in reduction_findings(sound[0]))


@first_fast(
    "kind, force",
    [
        *(("static_drift", "Y"), ("pure_sway", "N"), ("pure_yaw", "Y"), ("yaw_with_drift", "N")),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (("static_drift", "N"), ("pure_sway", "Y"))),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (("pure_yaw", "N"), ("yaw_with_drift", "Y"))),
    ],
)
def test_a_gauge_that_errs_in_one_kind_of_run_is_named(sound, kind, force):
    column = {"Y": "Y_N", "N": "N_Nm"}[force]
    runs = [
        replace(run, **{column: 1.05 * run.force(force)}) if run.type == kind else run for run in sound[0].campaign.runs
    ]
    found = reduce_campaign(replace(sound[0].campaign, runs=tuple(runs)))
    (error,) = found.systematic
    assert error.force == force
    assert error.size == pytest.approx(0.05, abs=0.02)
    assert error.runs == kind
    assert reduction_findings(found)[0] == caution(error.message)
    wrong = ratios(found, sound[1], [name for name in ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd") if name[0] == force])
    assert max(map(abs, wrong.values())) < 3.0, wrong


@pytest.mark.slow
def test_two_kinds_of_run_that_contradict_each_other_are_both_named(sound):
    """Rudder angles were tested with and without drift alone: either may err."""
    campaign = sound[0].campaign
    runs = [replace(run, N_Nm=1.05 * run.N_Nm) if run.type == "drift_and_rudder" else run for run in campaign.runs]
    (error,) = reduce_campaign(replace(campaign, runs=tuple(runs))).systematic
    assert {error.runs, *error.or_runs} == {"static_rudder", "drift_and_rudder"}


def test_kinds_of_run_that_no_other_can_check_are_named(tmp_path):
    found, _ = reduced(Campaign(seed=7, size="linear", rate_hz=5.0), tmp_path)
    assert {"static_rudder", "pure_yaw"} <= set(found.forces["Y"].unchecked)
    assert any(
        "whether the gauges" in sentence and "static_rudder" in sentence for sentence in reduction_findings(found)
    )


@pytest.mark.slow
def test_gains_that_differ_from_run_to_run_are_in_the_standard_errors(tmp_path, sound):
    found, _ = reduced(replace(SOUND, gain_error=0.005), tmp_path)
    for force in "YN":
        assert math.sqrt(found.forces[force].selection.spread.gain_variance) == pytest.approx(0.005, rel=0.4)
        assert math.sqrt(sound[0].forces[force].selection.spread.gain_variance) < 0.002
    assert found.derivatives["Yvdot"].standard_error > 2 * sound[0].derivatives["Yvdot"].standard_error


@first_fast(
    "seed",
    [
        *(30, 31),
        *(pytest.param(one, marks=pytest.mark.slow) for one in range(32, 36)),
        *(pytest.param(one, marks=pytest.mark.long) for one in range(36, 60)),
    ],
)
def test_sound_campaigns_show_no_systematic_error(tmp_path, seed):
    kinds = [
        {},
        {"correlation_time_s": 2.0, "zero_drift": 2.0, "gain_error": 0.005},
        {"speed_fluctuation": 0.02, "sheet_error": 0.04, "part_periods": True, "asymmetry": True},
        {"size": "linear"},
        {"noise": 0.0, "zero_error": 0.0},
        {"gain_error": 0.01},
    ]
    found, _ = reduced(Campaign(seed=seed, rate_hz=5.0, **kinds[seed % len(kinds)]), tmp_path)
    assert implausible(found) == ()


@pytest.mark.slow
def test_measured_campaigns_show_no_systematic_error(data):
    for name in ("pmm_synthetic_11", "pmm_synthetic_12", "kvlcc2_captive_hmri"):
        assert implausible(reduce_campaign(read_campaign(data / "data" / name / "campaign.toml"))) == (), name


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return write(replace(SOUND, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("small"))


def number(written, key):
    return next(line for line in written.path.read_text().splitlines() if line.startswith(f"{key} = "))


@pytest.mark.parametrize(
    ("key", "factor", "place"),
    [
        ("mass_kg", 1e-3, "model.mass_kg"),
        ("mass_kg", 2.2, "model.mass_kg"),
        ("draught_m", 100, "model.mass_kg"),
        ("beam_m", 1000, "model.beam_m"),
        ("yaw_inertia_kgm2", 1e-3, "model.yaw_inertia_kgm2"),
        ("yaw_inertia_kgm2", 10, "model.yaw_inertia_kgm2"),
        ("x_G_m", 1000, "model.x_G_m"),
        ("gravity_mps2", 100, "test.gravity_mps2"),
        ("water_density_kgpm3", 1e-3, "test.water_density_kgpm3"),
    ],
)
def test_numbers_that_cannot_be_are_refused_by_their_key(small, key, factor, place):
    old = number(small, key)
    value = float(old.partition(" = ")[2])
    changed = small.path.with_name("changed.toml")
    changed.write_text(small.path.read_text().replace(old, f"{key} = {value * factor!r}"))
    with pytest.raises(InputError) as error:
        reduce_campaign(read_campaign(changed))
    assert error.value.place == place
    assert error.value.source == str(changed)


def test_a_mass_of_1_kg_is_refused_without_beam_and_draught_too(small):
    lines = [one for one in small.path.read_text().splitlines() if not one.startswith(("beam_m", "draught_m"))]
    changed = small.path.with_name("changed.toml")
    changed.write_text("\n".join("mass_kg = 1.0" if one.startswith("mass_kg") else one for one in lines))
    with pytest.raises(InputError) as error:
        reduce_campaign(read_campaign(changed))
    assert error.value.place == "model.mass_kg"


@first_fast("seed", range(2))
def test_half_the_mass_is_reported_first(tmp_path, seed):
    written = write(Campaign(seed=seed, size="linear", rate_hz=5.0), tmp_path)
    for mass in (written.ship.mass_kg, 0.5 * written.ship.mass_kg):
        text = written.path.read_text().replace(number(written, "mass_kg"), f"mass_kg = {mass!r}")
        written.path.write_text(text)
        found = reduce_campaign(read_campaign(written.path))
        messages = implausible(found)
        assert bool(messages) == (mass < written.ship.mass_kg)
        assert reduction_findings(found)[: len(messages)] == messages
    assert any("added mass" in sentence for sentence in messages)


@pytest.mark.slow
def test_a_resistance_that_pushes_the_model_ahead_is_refused(sound):
    campaign = sound[0].campaign
    turned = replace(campaign, runs=tuple(replace(run, X_N=-run.X_N) for run in campaign.runs))
    with pytest.raises(InputError) as error:
        reduce_campaign(turned)
    assert error.value.place == "gauge X"
    driven = replace(turned, runs=tuple(replace(run, propeller_radps=60.0) for run in turned.runs))
    assert reduce_campaign(driven).derivatives["X0"].value > 0  # thrust may exceed the resistance


@first_fast("cut", [slice(None), slice(20, None), slice(None, -20)])
def test_a_run_copied_under_another_name_is_refused_with_both_names(tmp_path, cut):
    written = write(replace(SOUND, size="linear", rate_hz=5.0), tmp_path)
    header, *rows = (written.path.parent / "drift_+04.csv").read_text().splitlines()
    (written.path.parent / "again.csv").write_text("\n".join([header, *rows[cut]]) + "\n")
    written.path.write_text(
        written.path.read_text()
        + '\n[[runs]]\nfile = "again.csv"\ntype = "static_drift"\nrudder_rad = 0.0\ndrift_rad = 0.0698132\n'
    )
    with pytest.raises(InputError, match=r"drift_\+04\.csv") as error:
        read_campaign(written.path)
    assert error.value.source == "again.csv"
    rest = read_campaign(written.path, keep_going=True)
    assert {run.name for run in rest.runs} == {f"{run.name}.csv" for run in written.runs}
    assert reduce_campaign(rest, ReductionOptions(keep_going=True)).faults[0].source == "again.csv"


def test_repeated_runs_and_computed_ones_are_no_copies(tmp_path):
    written = write(replace(SOUND, size="linear", rate_hz=5.0, noise=0.0, zero_error=0.0), tmp_path / "computed")
    assert not read_campaign(written.path).faults  # drift 0 and rudder 0 have the same constant forces
    loud = write(replace(SOUND, size="linear", rate_hz=5.0), tmp_path / "measured")
    second = write(replace(SOUND, size="linear", rate_hz=5.0, noise_seed=1), tmp_path / "second")
    (loud.path.parent / "again.csv").write_text((second.path.parent / "drift_+04.csv").read_text())
    loud.path.write_text(
        loud.path.read_text() + '\n[[runs]]\nfile = "again.csv"\ntype = "static_drift"\ndrift_rad = 0.0698132\n'
    )
    assert not read_campaign(loud.path).faults
