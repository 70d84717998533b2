"""What a plan is predicted to show: against forces written elsewhere, and against what ``reduce`` makes of the runs."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.apps.design.captive_information import PlannedCampaign
from tank2sim.apps.design.captive_runs import PlannedRun
from tank2sim.apps.design.study import GaugeStudy
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.records.campaign_form import ModelSection
from tank2sim.records.campaigns import read_campaign
from tank2sim.records.captive_record import FORCE_COLUMNS
from tests.identification.captive import generator
from tests.identification.captive.generator import DENSITY, GRAVITY, NOISE_SHARE, Campaign

MADE = Campaign(seed=21, size="full", rate_hz=5.0, vibration=False, frequency_parameters=(0.05, 0.09), noise=1.0)


def planned(made=MADE, **changes):
    """The generator's ship in a tank with the generator's errors."""
    model = generator.ship(made)
    force, arm = NOISE_SHARE * model.force_N, 0.3 * model.length_m
    sizes = {"X": force, "Y": force, "N": force * arm}
    gauges = {name: GaugeStudy(noise=size, zero=size / 6, range=np.inf) for name, size in sizes.items()}
    return PlannedCampaign(
        **{
            "model": ModelSection(
                name="made up",
                length_m=model.length_m,
                mass_kg=model.mass_kg,
                yaw_inertia_kgm2=model.yaw_inertia_kgm2,
                x_G_m=model.x_G_m,
            ),
            "speed_mps": model.speed_mps,
            "water_density_kgpm3": DENSITY,
            "gravity_mps2": GRAVITY,
            "derivatives": model.derivatives,
            "gauges": gauges,
            "gain_relative": 0.0,
            "rate_hz": made.rate_hz,
            **changes,
        }
    )


def as_planned(run, made=MADE):
    """A run of the generator as a plan has it."""
    model = generator.ship(made)
    record = made.periods * 2 * np.pi / run.frequency if run.frequency else 12.0
    swings = run.kind == "pure_sway"
    return PlannedRun(
        type=run.kind,
        drift_rad=run.drift,
        rudder_rad=run.rudder,
        frequency_radps=run.frequency,
        velocity=run.amplitude * (run.frequency if swings else 1.0),
        speed_mps=model.speed_mps,
        record_s=record,
        tank_s=record,
    )


def test_the_largest_forces_on_the_gauges_are_those_of_the_equations_written_elsewhere():
    model, rng = generator.ship(MADE), np.random.default_rng(0)
    runs = {run.kind: run for run in generator.plan(MADE, model)}
    assert len(runs) == 6
    for run in runs.values():
        found = planned().largest_forces(as_planned(run))
        motion = generator.motion(replace(MADE, rate_hz=50.0), model, run, rng)
        shown = np.abs(generator.gauge_forces(replace(MADE, force_convention="on_gauge"), model, motion)).max(axis=1)
        # Made-up plans have 24 readings a period: their largest may lie between two of them.
        assert list(found.values()) == pytest.approx(shown, rel=0.01, abs=1e-6 * model.force_N)


def test_predicted_standard_errors_are_those_that_reduce_finds(tmp_path):
    written = generator.write(MADE, tmp_path)
    reduction = reduce_campaign(read_campaign(written.path), ReductionOptions(keep_going=True))
    groups = [(as_planned(run),) for run in generator.plan(MADE, written.ship)]
    plan = planned()
    ratios = {}
    for force, (names, information) in plan.information(groups).items():
        errors = np.sqrt(np.diag(np.linalg.inv(information.sum(axis=0) + plan.prior(names))))
        found = reduction.forces[force].solution
        assert set(names) == set(found.names)
        ratios |= {name: found.error(name) / error for name, error in zip(names, errors, strict=True)}
    assert len(ratios) > 25
    assert np.median(list(ratios.values())) == pytest.approx(1.0, abs=0.15)
    assert min(ratios.values()) > 0.7 and max(ratios.values()) < 1.5


def test_twice_the_noise_has_a_quarter_of_the_information_and_twice_the_readings_half_the_variance():
    (run,) = [run for run in generator.plan(MADE, generator.ship(MADE)) if run.name == "yaw_01"]
    groups = [(as_planned(run),)]
    no_zero = {name: replace(error, zero=0.0) for name, error in planned().gauges.items()}
    loud = {name: replace(error, noise=2 * error.noise) for name, error in no_zero.items()}
    plain = planned(gauges=no_zero).information(groups)
    for changed, factor in ((planned(gauges=loud), 0.25), (planned(gauges=no_zero, rate_hz=10.0), 2.0)):
        for force in FORCE_COLUMNS:
            assert changed.information(groups)[force][1] == pytest.approx(factor * plain[force][1], rel=1e-9)


def test_a_gain_error_limits_what_one_run_shows_of_a_force():
    """A run with a gain that is known to 1 % shows no force to better than that, however quiet its gauge."""
    run = as_planned(generator.Run("drift", "static_drift", drift=0.2))
    quiet = {name: GaugeStudy(noise=1e-9, zero=1e-9, range=np.inf) for name in FORCE_COLUMNS}
    plan = planned(gauges=quiet, gain_relative=0.01)
    names, information = plan.information([(run,)])["Y"]
    place = names.index("Yv")
    total = sum(
        value * np.sin(-0.2) ** name.count("v") for name, value in plan.derivatives.items() if name in ("Yv", "Yvvv")
    )
    alone = 1 / np.sqrt(information[0, place, place])
    assert alone * np.sin(0.2) == pytest.approx(0.01 * abs(total), rel=1e-3)


def test_terms_that_no_run_excites_are_in_no_regression():
    names = {
        name
        for found, _ in planned().information([(as_planned(generator.Run("b", "static_drift", drift=0.1)),)]).values()
        for name in found
    }
    assert {"Yv", "Nvvv", "Xvv"} <= names and not {"Yr", "Nd", "Yvdot", "Xvr"} & names
