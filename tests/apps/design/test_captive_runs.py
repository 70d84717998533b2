"""Planned runs: their time, their cycles, and the limits of carriage, mechanism and tank."""

import math

import pytest

from tank2sim.apps.design.captive_runs import TankRuns, time_of
from tank2sim.apps.design.tank_form import TankFile, read_tank
from tank2sim.cards.writing import TestedRange
from tank2sim.errors import InputError

LARGEST = TestedRange(math.radians(12.0), math.radians(35.0), 0.6)


def runs(length_m=4.0, speed_mps=1.2, **sections):
    return TankRuns(tank=TankFile.model_validate(sections), length_m=length_m, speed_mps=speed_mps, largest=LARGEST)


def oscillations(groups):
    return [run for group in groups for run in group if run.oscillates]


def test_the_time_of_a_run_is_start_settling_record_stop_and_waiting():
    tank = runs(carriage={"length_m": 100.0, "acceleration_mps2": 0.3, "settling_lengths": 2.0, "waiting_s": 300.0})
    # Start and stop: 2 x 4 s and 2 x 2.4 m; settling 8 m in 6.667 s; record 87.2 m.
    assert tank.longest_s == pytest.approx((100 - 4.8 - 8) / 1.2)
    (run,) = tank.steady("static_drift")
    assert run.record_s == pytest.approx(tank.longest_s)
    assert run.tank_s == pytest.approx(8 + 8 / 1.2 + 87.2 / 1.2 + 300)


def test_the_way_back_counts_where_it_takes_longer_than_the_waiting():
    tank = runs(carriage={"length_m": 100.0, "waiting_s": 10.0, "return_speed_mps": 0.5})
    (run,) = tank.steady("static_drift")
    assert run.tank_s == pytest.approx(8 + (8 + 87.2) / 1.2 + 100 / 0.5, rel=1e-3)


def test_steady_runs_go_to_both_sides():
    to_starboard, to_port = runs().steady("drift_and_rudder", 0.1, -0.2)
    assert (to_starboard.drift_rad, to_starboard.rudder_rad) == (0.1, -0.2)
    assert (to_port.drift_rad, to_port.rudder_rad) == (-0.1, 0.2)
    assert time_of([(to_starboard, to_port)]) == pytest.approx(2 * to_port.tank_s)


def test_records_have_whole_cycles_as_many_as_the_carriage_has_room_for():
    tank = runs(mechanism={"cycles": 4})
    found = oscillations(tank.candidates())
    assert found
    for run in found:
        cycles = run.record_s * run.frequency_radps / (2 * math.pi)
        assert cycles == pytest.approx(round(cycles)) and run.cycles >= 4 and run.record_s <= tank.longest_s + 1e-9


def test_frequencies_stay_below_the_limits_of_waves_and_of_the_memory_of_the_flow():
    for speed in (0.4, 1.2, 2.4):
        for run in oscillations(runs(speed_mps=speed).candidates()):
            assert run.frequency_radps * speed / 9.80665 < 0.1
            assert run.frequency_radps * 4.0 / speed <= (2.0 if run.type == "pure_sway" else 3.0) + 1e-9


def test_frequencies_near_a_standing_wave_of_the_tank_are_left_out():
    # Mode 1 of a deep tank: omega^2 = g pi/B.
    wave = math.sqrt(9.80665 * math.pi / 60.0)
    free, beside = runs(), runs(tank={"breadth_m": 60.0})
    assert any(abs(run.frequency_radps / wave - 1) < 0.1 for run in oscillations(free.candidates()))
    near = [run for run in oscillations(beside.candidates()) if abs(run.frequency_radps / wave - 1) < 0.1]
    assert near == [] and oscillations(beside.candidates())


def test_amplitudes_stay_within_the_mechanism():
    limits = {"sway_amplitude_m": 0.5, "heading_amplitude_rad": 0.15, "drift_rad": 0.1, "rudder_rad": 0.3}
    found = [run for group in runs(mechanism=limits).candidates() for run in group]
    assert max(abs(run.drift_rad) for run in found) == pytest.approx(0.1)
    assert max(abs(run.rudder_rad) for run in found) == pytest.approx(0.3)
    swinging = [run for run in found if run.oscillates]
    for run in swinging:
        side = run.velocity / run.frequency_radps
        path = side if run.type == "pure_sway" else 1.2 * run.velocity / run.frequency_radps**2
        assert run.sway_amplitude_m == pytest.approx(path) and path <= 0.5 + 1e-12
        assert run.type == "pure_sway" or side <= 0.15 + 1e-12
    assert {run.type for run in swinging} == {"pure_sway", "pure_yaw", "yaw_with_drift"}


@pytest.mark.parametrize(
    ("sections", "place"),
    [
        ({"carriage": {"length_m": 10.0}}, "carriage_length_m"),
        ({"carriage": {"length_m": 30.0}, "mechanism": {"cycles": 5}}, "carriage_length_m"),
        ({"carriage": {"speed_mps": 1.0}}, "tank"),
    ],
)
def test_a_tank_that_cannot_make_the_runs_is_refused(sections, place):
    with pytest.raises(InputError) as caught:
        runs(**sections).candidates()
    assert caught.value.source == place


def test_the_usual_matrix_has_every_type_to_the_limits_and_both_sides():
    found = [run for group in runs().usual_matrix() for run in group]
    assert len(found) == 93
    assert {run.type for run in found} == {
        *("static_drift", "static_rudder", "drift_and_rudder", "pure_sway", "pure_yaw", "yaw_with_drift")
    }
    assert sum(run.drift_rad for run in found) == pytest.approx(0, abs=1e-9)
    assert max(run.velocity for run in found if run.type == "pure_yaw") == pytest.approx(0.6 * 1.2 / 4.0)


def test_runs_of_a_tanks_own_matrix_are_candidates_and_yaw_with_a_rudder_angle_where_it_has_such_runs():
    tank = runs()
    straight = tank.steady("static_drift", share=0.3)
    turned = tank.oscillating("pure_yaw", 0.5, 0.1, rudder=0.2)
    assert [run.rudder_rad for run in turned] == [0.2, -0.2]
    without, with_turned = tank.candidates([straight]), tank.candidates([straight, turned])
    assert straight in without and turned in with_turned
    assert not any(run.rudder_rad for run in oscillations(without))
    assert max(run.rudder_rad for run in oscillations(with_turned)) == pytest.approx(LARGEST.rudder_rad)


def test_checks_are_the_motions_that_a_plan_lacks_between_its_extremes():
    tank = runs()
    every = tank.check_runs(())
    assert {group[0].type for group in every} == {"static_drift", "static_rudder", "pure_sway", "pure_yaw"}
    assert tank.check_runs(every) == ()
    extremes = [group for group in tank.usual_matrix() if abs(group[0].drift_rad) in (0.0, tank.drift_rad)]
    assert any(group[0].drift_rad == pytest.approx(tank.drift_rad / 2) for group in tank.check_runs(extremes))


@pytest.mark.parametrize("keys", [("drift_deg", "drift_rad"), ("heading_amplitude_rad", "heading_amplitude_deg")])
def test_a_quantity_of_the_tank_given_twice_is_refused_by_both_its_keys(tmp_path, keys):
    path = tmp_path / "tank.toml"
    path.write_text("[mechanism]\n" + "".join(f"{key} = 0.1\n" for key in keys))
    with pytest.raises(InputError, match=f"mechanism.{keys[1]}: is given twice, also as {keys[0]};"):
        read_tank(path)
