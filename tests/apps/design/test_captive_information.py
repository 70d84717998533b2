"""Parts of the plan of a campaign: information of the runs, the usual matrix, and the form of the tank."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.design.captive_information import PlannedCampaign
from tank2sim.apps.design.captive_runs import PlannedRun, TankRuns
from tank2sim.apps.design.plan_files import runs_of_matrix
from tank2sim.apps.design.study import GaugeStudy
from tank2sim.apps.design.tank_form import TankFile, refuse_contradictions
from tank2sim.cards import writing
from tank2sim.errors import InputError
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


RUNS = TankRuns(
    tank=TankFile(), length_m=4.0, speed_mps=1.0, largest=writing.TestedRange(math.radians(20), math.radians(35), 0.8)
)

TABLE = """id,beta (deg) ,delta (deg),v'max,r'max,Nrep,U/U0,Type
1,4,0,,,1,1,Static Drift
2,0,-35,,,2,1,Static Rudder
3,-8,10,,,1,0.6,Static Drift
4,0,0,0.16,,1,1,Pure Sway
5,0,20,,0.4,1,0.8,Pure Yaw
6,-12,0,,0.7,1,1,Yaw-and-Drift
"""


def table(folder: Path, text: str) -> Path:
    path = folder / "matrix.csv"
    path.write_text(text)
    return path


def test_each_row_is_a_run_with_its_angles_and_amplitudes(tmp_path: Path) -> None:
    groups, notices = runs_of_matrix(table(tmp_path, TABLE), RUNS)
    runs = [run for group in groups for run in group]
    assert [run.type for run in runs] == [
        *("static_drift", "static_rudder", "static_rudder", "drift_and_rudder"),
        *("pure_sway", "pure_yaw", "yaw_with_drift"),
    ]
    degrees = [(round(math.degrees(run.drift_rad)), round(math.degrees(run.rudder_rad))) for run in runs]
    assert degrees == [(4, 0), (0, -35), (0, -35), (-8, 10), (0, 0), (0, 20), (-12, 0)]
    assert runs[4].velocity == pytest.approx(0.16)  # v' U
    assert [run.velocity for run in runs[5:]] == pytest.approx([0.1, 0.175])  # r' U/L
    assert [run.cycles for run in runs[4:]] == [
        math.floor(RUNS.longest_s * run.frequency_radps / (2 * math.pi)) for run in runs[4:]
    ]
    text = " ".join(map(str, notices))
    assert "3 oscillating runs" in text and "2 rows at other speeds" in text


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("id,force\n1,2\n", "header"),
        (TABLE.replace("1,4,0", "1,fore,0"), "row 2"),
        (TABLE.replace("1,4,0", "1,95,0"), "row 2"),
        (TABLE.replace("2,0,-35,,,2", "2,0,-35,,,0.5"), "row 3"),
        (TABLE.partition("\n")[0] + "\n", ""),
    ],
)
def test_a_table_that_is_no_matrix_is_refused(tmp_path: Path, text: str, place: str) -> None:
    with pytest.raises(InputError) as refused:
        runs_of_matrix(table(tmp_path, text), RUNS)
    assert refused.value.place == place


def test_the_matrix_of_insean_has_its_141_runs(data: Path) -> None:
    """SOURCE.txt: 118 static runs, 4 of pure sway, 13 of pure yaw, 6 of yaw with drift."""
    groups, _ = runs_of_matrix(data / "data/kvlcc2_insean_runs/index_PMM.csv", RUNS)
    kinds = Counter(run.type for group in groups for run in group)
    steady = sum(kinds[name] for name in ("static_drift", "static_rudder", "drift_and_rudder"))
    assert (steady, kinds["pure_sway"], kinds["pure_yaw"], kinds["yaw_with_drift"]) == (118, 4, 13, 6)


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ({"tank": {"length_m": 200.0}, "carriage": {"length_m": 240.0}}, "carriage.length_m"),
        ({"tank": {"length_m": 200.0}}, "carriage.length_m"),
        ({"tank": {"breadth_m": 0.5}}, "tank.breadth_m"),
        ({"tank": {"depth_m": 0.1}}, "tank.depth_m"),
        (
            {"mechanism": {"lowest_frequency_radps": 2.0, "highest_frequency_radps": 1.0}},
            "mechanism.lowest_frequency_radps",
        ),
    ],
)
def test_a_tank_that_contradicts_itself_or_the_model_is_refused(content, key):
    with pytest.raises(InputError) as fault:
        refuse_contradictions(TankFile.model_validate(content), "tank.toml", 4.0, 0.576, 0.186)
    assert (fault.value.source, fault.value.place) == ("tank.toml", key)


def test_a_tank_that_holds_the_model_is_taken():
    tank = {"tank": {"length_m": 240.0, "breadth_m": 0.6, "depth_m": 0.2}, "carriage": {"length_m": 240.0}}
    refuse_contradictions(TankFile.model_validate(tank), "tank.toml", 4.0, 0.576, 0.186)


def test_the_file_of_the_tank_is_named_and_the_beam_is_that_of_the_model(tmp_path):
    (tmp_path / "tank.toml").write_text("[tank]\nbreadth_m = 0.5\n", encoding="utf-8")
    options = {"figures": "K_prime", "members": 0, "tank": tmp_path / "tank.toml", "largest": (10, 20, 0.5)}
    with pytest.raises(InputError, match=r"0\.5 m.*0\.576 m") as fault:  # 4 m by 23.165/160.93
        t2s.design_campaign("mariner", **options)
    assert fault.value.source == str(tmp_path / "tank.toml")


@pytest.mark.parametrize(
    "errors",
    [
        {"noise_share": 0.0, "zero_share": 0.0, "gain_relative": 0.0},
        {"noise_share": 2e-6, "zero_share": 0.0},
        {f"{force}_{kind}_{unit}": 1e-9 for force, unit in (("X", "N"), ("Y", "N"), ("N", "Nm"))
         for kind in ("noise", "zero")},
    ],
)  # fmt: skip
def test_gauges_without_an_error_are_refused(errors):
    tank = TankFile.model_validate({"gauges": errors})
    with pytest.raises(InputError, match="no error of X") as fault:
        t2s.design_campaign("esso-osaka", figures="K_prime", members=0, tank=tank, largest=(10, 20, 0.5))
    assert fault.value.place == "gauges"
