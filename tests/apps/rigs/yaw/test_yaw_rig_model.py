"""The rig's model against the equation written again, and what turning the other way does."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from alyshev_rigs import ELLIPSOID_T1, SHIP_T1
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.apps.rigs.yaw.card import TankWalls, YawRig, YawRigCard
from tank2sim.apps.rigs.yaw.model import wall_nearness, yaw_rig_model
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
