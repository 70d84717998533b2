"""The yaw rig: its model against the equation written again, and its runs under controllers against papers.md 3.5."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from alyshev_rigs import ELLIPSOID_T1, SHIP_T1, SHIP_T2
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.apps.rigs.yaw.card import TankWalls, YawRig, YawRigCard
from tank2sim.apps.rigs.yaw.model import wall_nearness, yaw_rig_model
from tank2sim.apps.rigs.yaw.programme import PAPER_PROGRAMME, dissipation_from_work, inertia_from_work
from tank2sim.apps.rigs.yaw.simulation import AdaptiveController, Measuring, TunedController, run_yaw_rig
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tests.yaw_truth import Truth

FULL = YawRig(
    inertia_kgm2=0.0204,
    torque_constant_NmpA=0.051,
    added_inertia_kgm2=0.03,
    coulomb_Nm=7.9e-4,
    viscous_Nms=0.0117,
    quadratic_Nms2=0.0381,
    braking_quadratic_Nms2=0.05,
    inertia_accelerating_kgm2=0.01,
    inertia_braking_kgm2=0.02,
    gravity_Nm=2e-3,
    gravity_angle_rad=0.4,
    walls=TankWalls(
        body_length_m=0.67, bow_inertia_kgm2=3e-3, stern_inertia_kgm2=3e-3, bow_damping_Nms=4e-3, stern_damping_Nms=4e-3
    ),
)
SAME = Truth(
    braking_quadratic=0.05,
    inertia_a=0.01,
    inertia_d=0.02,
    gravity=2e-3,
    gravity_angle=0.4,
    wall_inertia=3e-3,
    wall_damping=4e-3,
    viscous=0.0117,
    quadratic=0.0381,
)


@pytest.fixture(scope="module")
def full():
    return yaw_rig_model("full", FULL, with_current_loop=False)


@settings(max_examples=25, deadline=None)
@given(st.floats(-6, 6), st.floats(0.01, 0.5) | st.floats(-0.5, -0.01), st.floats(-1, 1))
def test_acceleration_is_that_of_the_equation(psi, w, current):
    model = yaw_rig_model("full", FULL, with_current_loop=False)
    found = np.asarray(model.rhs([psi, w], [current], model.parameter_values())).ravel()
    expected = replace(SAME, total=0.0504).acceleration(psi, w, current)
    np.testing.assert_allclose(found, [w, expected], rtol=1e-9, atol=1e-12)


def test_turning_the_other_way_is_the_mirror_image():
    model = yaw_rig_model("ellipsoid", ELLIPSOID_T1)
    p = model.parameter_values()
    one, other = (np.asarray(model.rhs(sign * np.array([0.3, 0.2, 0.4]), [sign * 0.7], p)) for sign in (1, -1))
    np.testing.assert_allclose(one, -other, rtol=1e-14)


def test_current_follows_with_its_lag_and_no_further_than_the_motor_goes():
    model = yaw_rig_model("ellipsoid", ELLIPSOID_T1)
    p = model.parameter_values()
    rate = float(np.asarray(model.rhs([0, 0, 0.2], [5.0], p))[2, 0])
    assert rate == pytest.approx((1.0 - 0.2) / 0.055)


def test_encoder_counts_whole_pulses_downwards(full):
    place = full.outputs.index("encoder.angle")
    pulse = 2 * np.pi / 3000
    for angle, count in ((2.5, 2), (-0.5, -1), (7.01, 7)):
        y = full.output([angle * pulse, 0.1], [0.0], full.parameter_values())
        assert float(y[place]) == pytest.approx(count * pulse)


def test_a_body_too_long_for_its_tank_is_refused():
    with pytest.raises(ValueError, match="strikes the walls"):
        TankWalls(body_length_m=1.5)
    with pytest.raises(InputError, match=r"yaw_rig\.walls.*strikes the walls"):
        read_card("alyshev", {"yaw_rig.walls.body_length_m": 1.5})


def test_the_bundled_card_is_the_papers_ship():
    card = read_card("alyshev")
    assert isinstance(card, YawRigCard)
    assert card.yaw_rig.model_copy(update={"walls": None}) == SHIP_T1
    assert build(card).name == card.ship.name


@pytest.mark.parametrize(
    ("heading_deg", "bow", "stern"),
    # a tank of 10 m by 4 m, the axis 1 m forward and 0.5 m to starboard of its middle, bow and stern 1 m from the axis
    [(0, 1.5, 1.5), (90, 0.5, 1.5), (-90, 1.5, 0.5), (180, 1.5, 1.5), (30, 1.0, 2.0), (-30, 2.0, 1.0)],
)
def test_distances_to_the_walls_are_those_of_bow_and_stern(heading_deg: float, bow: float, stern: float) -> None:
    walls = SimpleNamespace(length_m=10.0, breadth_m=4.0, x_m=1.0, y_m=0.5, body_length_m=2.0)
    assert [float(one) for one in wall_nearness(math.radians(heading_deg), walls)] == pytest.approx(
        [1 / (bow + 1), 1 / (stern + 1)]
    )


def test_an_end_wall_counts_where_it_is_nearer_than_a_side_wall() -> None:
    walls = SimpleNamespace(length_m=10.0, breadth_m=8.0, x_m=3.0, y_m=0.5, body_length_m=2.0)
    assert [float(one) for one in wall_nearness(0.0, walls)] == pytest.approx([1 / (1 + 1), 1 / (3 + 1)])


EXACT = Measuring(encoder=False)
START = TunedController(inertia_kgm2=0.0505)


@pytest.fixture(scope="module")
def ellipsoid():
    return run_yaw_rig(ELLIPSOID_T1, PAPER_PROGRAMME, START, EXACT)


def last_pair(run, rig, *, reference):
    """lambda661 of (1) and B + D of (2), 1e-4 SI, from the last pair."""
    works, ends = [], []
    for begin, end in run.programme.pairs()[-1]:
        t = np.linspace(begin, end, 2001)
        own = run.programme.at(t).rate_radps if reference else np.interp(t, run.time_s, run.true_rate_radps)
        works.append(0.051 * np.trapezoid(own * np.interp(t, run.time_s, run.current_A), t))
        ends.append(own[[0, -1]])
    return 1e4 * (inertia_from_work(*works, *ends[0]) - rig.inertia_kgm2), 1e4 * dissipation_from_work(*works)


@pytest.mark.parametrize(
    ("rig", "actual", "programmed", "lost", "error"),
    [
        (ELLIPSOID_T1, 298.3, 287.8, (8.40, 8.47), 0.0081),
        pytest.param(SHIP_T1, 279.7, 270.0, (12.04, 12.18), 0.0106, marks=pytest.mark.slow),
        pytest.param(SHIP_T2, 502.8, 488.6, (16.75, 16.98), 0.0103, marks=pytest.mark.slow),
    ],
)
def test_controller_4_gives_the_papers_table(rig, actual, programmed, lost, error):
    run = run_yaw_rig(rig, PAPER_PROGRAMME, START, EXACT)
    for reference, value, dissipation in ((False, actual, lost[0]), (True, programmed, lost[1])):
        found = last_pair(run, rig, reference=reference)
        assert found[0] == pytest.approx(value, abs=1.0)
        assert found[1] == pytest.approx(dissipation, abs=0.02)
    settled = run.time_s > 4 * PAPER_PROGRAMME.period_s
    assert np.abs(run.error_rad[settled]).max() == pytest.approx(error, abs=3e-4)


def test_gains_settle_at_inertia_and_friction_over_lag(ellipsoid):
    gains = ellipsoid.gains[-1]
    assert gains["K_D"] == pytest.approx(0.0505 / (0.055 * 0.051), rel=0.05)
    assert abs(gains["K_D"] / ellipsoid.gains[-2]["K_D"] - 1) < 1e-3
    assert 0.2 < gains["K_P"] / gains["K_D"] < 0.7  # a2 of the linearised friction, not the 0.1 a1 of the start


def test_first_gains_are_inertia_and_a_tenth_of_it_over_lag():
    proportional, derivative = START.first_gains(0.055, 0.051)
    assert derivative == pytest.approx(0.0505 / (0.055 * 0.051)) and proportional == pytest.approx(0.1 * derivative)


def test_the_encoder_counts_whole_pulses_and_never_ahead(ellipsoid):
    run = run_yaw_rig(ELLIPSOID_T1, replace(PAPER_PROGRAMME, humps=1), START)
    pulse = 2 * np.pi / 3000
    counts = run.angle_rad / pulse
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.all((run.true_angle_rad - run.angle_rad >= -1e-12) & (run.true_angle_rad - run.angle_rad < pulse))


def test_turning_to_port_is_the_mirror_image(ellipsoid):
    port = run_yaw_rig(
        ELLIPSOID_T1, replace(PAPER_PROGRAMME, max_rate_radps=-PAPER_PROGRAMME.max_rate_radps), START, EXACT
    )
    np.testing.assert_allclose(port.true_angle_rad, -ellipsoid.true_angle_rad, atol=1e-9)
    np.testing.assert_allclose(port.current_A, -ellipsoid.current_A, atol=1e-9)


def test_a_rig_that_saturates_the_motor_says_when():
    weak = ELLIPSOID_T1.model_copy(update={"max_current_A": 0.1})
    with pytest.raises(InputError, match=r"saturates the motor, first at \d+\.\d{3} s .* 0\.1 A is available"):
        run_yaw_rig(weak, PAPER_PROGRAMME, START, EXACT)
    run = run_yaw_rig(weak, PAPER_PROGRAMME, START, EXACT, allow_saturation=True)
    assert run.saturation and 0.5 < run.saturation.first_s < 4.5
    assert np.abs(run.true_current_A).max() <= 0.1


@pytest.mark.slow
def test_the_adaptive_controller_raises_its_gain_until_the_error_is_small():
    run = run_yaw_rig(ELLIPSOID_T1, PAPER_PROGRAMME, AdaptiveController(), EXACT, allow_saturation=True)
    assert 40 < run.memory[1] < 70  # papers.md 3.5: about 50 to 65
    assert np.abs(run.error_rad[run.time_s > 4 * PAPER_PROGRAMME.period_s]).max() < 0.015


def test_noise_is_that_asked_for_and_the_same_again():
    noisy = Measuring(current_noise_A=0.01, seed=3)
    one, again = (run_yaw_rig(ELLIPSOID_T1, replace(PAPER_PROGRAMME, humps=1), START, noisy) for _ in range(2))
    assert np.std(one.current_A - one.true_current_A) == pytest.approx(0.01, rel=0.05)
    np.testing.assert_array_equal(one.current_A, again.current_A)
