"""Warnings against numbers computed by hand: the 221 m tanker of paper 2, and tanks of simple shape."""

import math

import pytest

from tank2sim.cards.plausibility import levers, unusual_signs, yaw_force
from tank2sim.identification.captive.tank_conditions import (
    FroudeScaling,
    blockage,
    brard_number,
    carried_mass,
    depth_froude,
    flow_memory,
    frequency_parameters,
    model_length,
    reduced_frequency,
    scale_effect,
    shortest_period_s,
    standing_wave_frequency,
    tank_resonance,
    tank_size,
    trim,
)
from tank2sim.identification.captive.warnings import (
    OscillationMotion,
    cautions_of_result,
    cautions_of_test,
    force_convention,
    foreign_units,
)
from tank2sim.records.campaign_form import ModelSection, TankSection
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write

MASS, INERTIA = 0.0095, 0.00059
SHIP = {"Yv": -0.0143, "Nv": -0.0028, "Yr": 0.0016, "Nr": -0.0022, "Yd": -0.0027, "Nd": 0.0013} | {
    "Yvdot": -0.0074, "Nrdot": -0.00047}  # fmt: skip


def basin(breadth_m=None, depth_m=None):
    return TankSection(breadth_m=breadth_m, depth_m=depth_m)


def said(cautions):
    return " | ".join(caution.message for caution in cautions)


@pytest.mark.parametrize(("model_m", "scale", "reynolds"), [(4.0, 55.25, 410.7), (2.0, 110.5, 1161.6)])
def test_the_tanker_of_the_paper_scales_as_printed(model_m, scale, reynolds):
    ratio = FroudeScaling(221.0 / model_m)
    assert ratio.length == pytest.approx(scale)
    assert ratio.reynolds == pytest.approx(reynolds, abs=0.05)
    assert f"{reynolds:.4g} times" in scale_effect(scale, model_m, 1.0, None).message


def test_froude_scaling_keeps_froude_number_force_coefficients_and_reduced_frequency():
    ratio = FroudeScaling(50.0, density=1.025)
    assert ratio.speed**2 / ratio.length == pytest.approx(1)
    assert ratio.force == pytest.approx(1.025 * ratio.length**2 * ratio.speed**2)
    assert ratio.moment == pytest.approx(ratio.force * ratio.length)
    assert ratio.frequency * ratio.length / ratio.speed == pytest.approx(1)
    assert FroudeScaling(50.0, viscosity=2.0).reynolds == pytest.approx(0.5 * 50**1.5)


def test_only_models_below_four_metres_are_too_short():
    assert not list(model_length(4.0))
    assert "3.99 m" in said(model_length(3.99))


def test_the_frequency_parameter_is_the_reduced_frequency_times_the_froude_number_squared():
    omega, speed, length, gravity = 0.9, 1.1, 4.75, 9.81
    froude = speed / math.sqrt(gravity * length)
    assert brard_number(omega, speed, gravity) == pytest.approx(reduced_frequency(omega, speed, length) * froude**2)
    assert brard_number(2 * math.pi / shortest_period_s(speed, gravity), speed, gravity) == pytest.approx(0.1)
    assert shortest_period_s(1.0, 9.81) == pytest.approx(6.405, abs=1e-3)


def test_runs_from_a_frequency_parameter_of_a_tenth_are_named():
    runs = tuple(OscillationMotion(f"run {omega}", "sway", omega) for omega in (0.5, 0.982, 1.5))
    (caution,) = frequency_parameters(runs, 1.0, 9.81)
    assert caution.runs == ("run 0.982", "run 1.5")
    assert "0.153" in caution.message and "6.4 s" in caution.message
    assert not list(frequency_parameters(runs[:1], 1.0, 9.81))


def test_flow_memory_begins_at_two_in_sway_and_three_in_yaw():
    runs = tuple(
        OscillationMotion(f"{motion} {omega}", motion, omega) for motion in ("sway", "yaw") for omega in (0.4, 0.5, 0.7)
    )
    found = {runs for caution in flow_memory(runs, 1.0, 5.0) for runs in caution.runs}
    assert found == {"sway 0.5", "sway 0.7", "yaw 0.7"}


def test_trim_is_reported_or_missed():
    assert next(trim(None, 5.0)).missing == "[model] trim_m"
    assert not list(trim(0.0, 5.0))
    assert "1 % of the length" in said(trim(0.05, 5.0))


def test_standing_waves_of_known_tanks():
    # Deep: k = pi/10 and omega^2 = g k. Shallow: omega = k sqrt(g h). By hand for the 14 m x 6 m tank: k h = 1.3464.
    assert standing_wave_frequency(1, 10.0, math.inf, 9.81) == pytest.approx(1.75554, abs=1e-4)
    assert standing_wave_frequency(1, 10.0, 0.01, 9.81) == pytest.approx(math.pi / 10 * math.sqrt(0.0981), rel=1e-4)
    assert standing_wave_frequency(1, 14.0, 6.0, 9.81) == pytest.approx(1.3865, abs=2e-4)


def test_motion_and_third_harmonic_near_an_odd_standing_wave_are_reported():
    own = standing_wave_frequency(1, 10.0, 4.0, 9.81)
    even = standing_wave_frequency(2, 10.0, 4.0, 9.81)
    runs = (
        OscillationMotion("at it", "sway", 1.05 * own),
        OscillationMotion("third", "yaw", own / 3),
        OscillationMotion("even", "sway", even),
        OscillationMotion("slow", "sway", 0.2 * own),
    )
    found = list(tank_resonance(runs, basin(10.0, 4.0), 9.81))
    assert [caution.runs for caution in found] == [("at it",), ("third",)]
    assert next(tank_resonance(runs, basin(), 9.81)).missing == "[tank] breadth_m"
    assert not list(tank_resonance((), basin(), 9.81))


def test_blockage_and_depth_by_hand():
    kvlcc2 = list(blockage(1.2493, 0.448, basin(14.0, 6.0)))
    assert not kvlcc2  # 0.56 m2 in 84 m2: 0.67 %, and 13 draughts
    assert "2 %" in said(blockage(1.0, 0.4, basin(5.0, 4.0)))
    assert "3.5 draughts" in said(blockage(1.0, 0.4, basin(50.0, 1.4)))
    assert next(blockage(None, 0.4, basin(5.0))).missing == "[model] beam_m, [tank] depth_m"
    assert "0.7" in said(depth_froude(0.7 * math.sqrt(9.81 * 2), 2.0, 9.81))
    assert not list(depth_froude(0.55 * math.sqrt(9.81 * 2), 2.0, 9.81))
    assert next(depth_froude(1.0, None, 9.81)).missing == "[tank] depth_m"


def test_a_mass_in_the_wrong_unit_is_seen():
    body = {
        "name": "KVLCC2", "length_m": 6.8927, "mass_kg": 3124.0, "yaw_inertia_kgm2": 3124.0 * (0.25 * 6.8927) ** 2,
        "beam_m": 1.2493, "draught_m": 0.448, "block_coefficient": 0.8098,
    }  # fmt: skip

    def found(**changes):
        return said(carried_mass(ModelSection(**body | changes), 1000.0))

    assert not found()
    assert "810 times" in found(mass_kg=3124e3)
    assert "0.405" in found(mass_kg=1562.0)
    assert "0.025 L" in found(yaw_inertia_kgm2=body["yaw_inertia_kgm2"] / 100)


@pytest.mark.parametrize(("convention", "other"), [("on_model", "on_gauge"), ("on_gauge", "on_model")])
def test_reversed_forces_are_seen_in_the_added_mass(convention, other):
    reversed_forces = {"Yvdot": 2 * MASS + 0.0074, "Nrdot": 2 * INERTIA + 0.00047}
    found = list(force_convention(reversed_forces, MASS, INERTIA, convention))
    assert len(found) == 2
    assert f'"{other}" would give -0.0074' in found[0].message
    assert f'"{other}" would give -0.00047' in found[1].message
    assert not list(force_convention(SHIP, MASS, INERTIA, convention))


def test_inertia_removed_twice_is_seen_in_the_added_mass():
    twice = {"Yvdot": MASS - 0.0074}
    (caution,) = force_convention(twice, MASS, INERTIA, "on_gauge")
    assert '"hydrodynamic" would give -0.0074' in caution.message


def test_gauges_in_the_wrong_unit_are_seen_in_the_added_mass():
    in_kilonewtons = {"Yvdot": MASS - 0.001 * (MASS + 0.0074)}
    (caution,) = force_convention(in_kilonewtons, MASS, INERTIA, "on_gauge")
    assert "check the unit of the gauges" in caution.message and "would give" not in caution.message


@pytest.mark.parametrize("name", ["Yv", "Nv", "Nr", "Yd", "Nd", "Yvdot", "Nrdot"])
def test_a_turned_sign_is_reported_with_its_reason(name):
    assert not list(unusual_signs(SHIP, {}))
    (caution,) = unusual_signs(SHIP | {name: -SHIP[name]}, {})
    assert caution.message.startswith(f"{name} is ") and "known ship: " in caution.message
    assert not list(unusual_signs(SHIP | {name: -SHIP[name]}, {name: 0.6 * abs(SHIP[name])}))


def test_bundled_ships_have_the_signs_of_every_known_ship(mariner_card):
    derivatives = dict(mariner_card.derivatives)
    assert not list(unusual_signs(derivatives, {}))
    assert not list(levers(derivatives, {}))
    assert not list(yaw_force(derivatives, mariner_card.rigid_body.mass))


def test_forces_that_act_off_the_ship_are_reported():
    assert "0.30 lengths abaft" in said(levers({"Yv": -0.01, "Nv": 0.003}, {}))
    assert "0.90 lengths" in said(levers({"Yd": -0.003, "Nd": 0.0027}, {}))
    assert "+0.26" in said(levers({"Yd": -0.003, "Nd": -0.00078}, {}))
    assert "0.60 lengths" in said(levers({"Yd": -0.003, "Nd": 0.0018}, {"Yd": 0.00005}))
    assert not list(levers({"Yd": -0.003, "Nd": 0.0018}, {"Yd": 0.00015}))  # 0.60 with 0.03 twice is 0.54
    assert "taken out of the forces twice" in said(yaw_force({"Yr": 0.0112}, MASS))


def test_a_whole_campaign_is_judged(tmp_path):
    written = write(Campaign(seed=2, size="linear", frequency_parameters=(0.05, 0.12)), tmp_path)
    campaign = read_campaign(written.path)
    runs = tuple(OscillationMotion(run.name, "sway", run.frequency) for run in written.runs if run.kind == "pure_sway")
    found = cautions_of_test(campaign, runs)
    by_kind = {caution.kind: caution for caution in found}
    assert by_kind["frequency parameter"].runs == ("sway_10", "sway_11")
    assert {caution.missing for caution in found} >= {
        "[model] trim_m", "[model] scale", "[tank] breadth_m", "[tank] breadth_m, [tank] depth_m", "[tank] depth_m",
    }  # fmt: skip
    assert not cautions_of_result(written.derivatives, {}, campaign)
    turned = dict(written.derivatives) | {"Nd": -written.derivatives["Nd"]}
    assert {caution.kind for caution in cautions_of_result(turned, {}, campaign)} == {"sign", "lever"}
    reversed_forces = dict(written.derivatives) | {"Yvdot": 0.02}
    (once,) = cautions_of_result(reversed_forces, {}, campaign)
    assert once.kind == "force convention" and once.message.startswith("Yvdot is 0.02")


MARINER = {"Yv": -0.0116, "Nv": -0.00264, "Nr": -0.00166, "Yd": -0.00278, "Nd": 0.00139, "Yvdot": -0.00748} | {
    "Nrdot": -0.000438}  # fmt: skip
MARINER_BODY = ModelSection(
    name="Mariner", length_m=160.93, mass_kg=0.00798 * 500 * 160.93**3, beam_m=23.17, draught_m=7.468, x_G_m=-3.7
)


def misread(force, moment, removed):
    """The Mariner's derivatives from readings that are so many times too small."""
    inertias = {"Yvdot": 0.00798, "Nrdot": 0.000392, "Nr": 0.00798 * -3.7 / 160.93}
    found = {}
    for name, value in MARINER.items():
        own = 0.0 if removed else inertias.get(name, 0.0)
        found[name] = own - (own - value) / (moment if name[0] == "N" else force)
    return found


@pytest.mark.parametrize("removed", [False, True])
@pytest.mark.parametrize(
    ("force", "moment", "words"),
    [
        (9.80665, 9.80665, ["in kgf,", "in kgf m,"]),
        (4.44822, 1.35582, ["in lbf,", "in lbf ft,"]),
        (4.44822, 0.112985, ["in lbf,", "in lbf in,"]),
        (1000.0, 1000.0, ["in kN,", "in kN m,"]),
        (9.80665, 1.0, ["in kgf,"]),
        (1.0, 9.80665, ["in kgf m,"]),
        (9.80665, 0.0980665, ["in kgf,", "in kgf cm,"]),
    ],
)
def test_a_foreign_unit_of_the_gauges_is_named(force, moment, words, removed):
    text = said(foreign_units(misread(force, moment, removed), 0.00798, 0.000392, removed, MARINER_BODY))
    assert all(word in text for word in words) and text.count("1 ") == len(words)


def test_a_wrong_sign_or_convention_is_no_foreign_unit():
    def found(derivatives, removed=False):
        return list(foreign_units(derivatives, 0.00798, 0.000392, removed, MARINER_BODY))

    assert not found(MARINER) and not found(MARINER, removed=True)
    assert not found({**MARINER, "Yvdot": 0.00798 - 0.00748, "Nrdot": 0.000392 - 0.000438})  # inertia removed already
    assert not found({name: -value for name, value in MARINER.items()})
    assert not found({**MARINER, "Yvdot": 2 * 0.00798 + 0.00748, "Nrdot": 2 * 0.000392 + 0.000438, "Yv": 0.0116})


def test_a_tank_larger_than_any_is_named():
    assert "depth_m" in said(tank_size(basin(12.0, 550.0))) and "breadth_m" in said(tank_size(basin(1200.0, 5.5)))
    assert not list(tank_size(basin(70.0, 30.0))) and not list(tank_size(basin()))
