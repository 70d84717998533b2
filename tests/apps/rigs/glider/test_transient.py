"""Equilibria of the transient model against the closed form, and the error of stringing steady glides together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from tank2sim.analysis.linearisation import state_space
from tank2sim.apps.rigs.glider.path import path_of
from tank2sim.apps.rigs.glider.steady import smallest_angle, steady_glide
from tank2sim.apps.rigs.glider.transient import compare_with_steady, equilibrium, quasi_steady_error, swing_errors
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.integrator import Integrator

PROBE = read_card("kulikovsky-velikanov")
BARE = read_card("kulikovsky-velikanov", {"glider.added_mass_axial_kg": 0.0, "glider.added_mass_normal_kg": 0.0})


@pytest.fixture(scope="module")
def model():
    return build(PROBE)


@pytest.fixture(scope="module")
def integrator(model):
    return Integrator(model)


def glide_of(card, angle, roll=0.0):
    return steady_glide(card, math.radians(angle), roll_rad=math.radians(roll))


@pytest.mark.parametrize("angle", [-23.5, -30, 45, -70, 28])
def test_straight_glides_are_equilibria_whatever_the_added_mass(model, angle) -> None:
    glide = glide_of(PROBE, angle)
    found = equilibrium(model, glide)
    assert found.speed_mps == pytest.approx(glide.speed_mps, abs=1e-12)
    assert found.path_angle_rad == pytest.approx(glide.path_angle_rad, abs=1e-11)
    assert found.turn_rate_radps == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(("angle", "roll"), [(-30, 5), (-30, -20), (35, 10)])
def test_turns_are_equilibria_of_the_model_without_added_mass(angle, roll) -> None:
    glide = glide_of(BARE, angle, roll)
    found = equilibrium(build(BARE), glide)
    assert found.speed_mps == pytest.approx(glide.speed_mps, abs=1e-12)
    assert found.incidence_rad == pytest.approx(glide.incidence_rad, abs=1e-12)
    assert found.turning_radius_m == pytest.approx(glide.turning_radius_m, rel=1e-11)
    assert found.turn_rate_radps == pytest.approx(glide.turn_rate_radps, rel=1e-11)


def test_with_added_mass_the_turn_is_where_forces_turn_the_momentum(model) -> None:
    """Steady turn: omega x P = F, with P of the body's axes; solved for incidence, speed and rate of turn."""
    glide = glide_of(PROBE, -30, 20)
    roll, pitch = glide.roll_rad, glide.pitch_rad
    half = 0.5 * 1000 * PROBE.glider.reference_area_m2

    def left(unknown):
        alpha, v, turn = unknown
        eps = pitch - alpha
        ahead = np.array([math.cos(eps), 0, -math.sin(eps)])  # north, east, down
        lift_to = np.array([-math.sin(eps) * math.cos(roll), math.sin(roll), -math.cos(eps) * math.cos(roll)])
        nose = math.cos(alpha) * ahead + math.sin(alpha) * lift_to
        belly = math.sin(alpha) * ahead - math.cos(alpha) * lift_to
        velocity = v * ahead
        carried = 50 * velocity + 1.78 * (velocity @ nose) * nose + 46.7 * (velocity @ belly) * belly
        lift = half * v**2 * (11.76 * alpha + 4.6 * alpha * abs(alpha))
        drag = half * v**2 * (0.214 + 32.2 * alpha**2)
        force = lift * lift_to - drag * ahead + np.array([0, 0, 0.25 * 9.81])
        return force - np.cross([0, 0, turn], carried)

    alpha, v, turn = fsolve(left, [glide.incidence_rad, glide.speed_mps, glide.turn_rate_radps], xtol=1e-14)
    found = equilibrium(model, glide)
    assert found.incidence_rad == pytest.approx(alpha, rel=1e-8)
    assert found.speed_mps == pytest.approx(v, rel=1e-8)
    assert found.turn_rate_radps == pytest.approx(turn, rel=1e-8)
    assert abs(found.speed_mps / glide.speed_mps - 1) > 1e-3  # the paper's neglect is seen


def test_a_glide_linearises_and_is_stable(model) -> None:
    point = equilibrium(model, glide_of(PROBE, -30)).point
    system = state_space(model, point, states=["motion.u", "motion.w"], outputs=["motion.speed"])
    poles = sorted(system.poles().real)
    assert max(poles) < 0
    # slow: speed; fast: incidence, rho S v C_L' / 2 (m + A33), to within what the drag adds
    slope = 11.76 + 2 * 4.6 * 0.0377
    expected = 0.5 * 1000 * PROBE.glider.reference_area_m2 * 0.2444 * slope / (50 + 46.7)
    assert -poles[0] == pytest.approx(expected, rel=0.15)
    # against differences of the right-hand side
    rhs, places = model.rhs, [model.state_names.index(name) for name in ("motion.u", "motion.w")]
    for column, place in enumerate(places):
        step = np.zeros(len(point.x))
        step[place] = 1e-6
        both = [np.array(rhs(point.x + sign * step, point.u, point.p)).ravel()[places] for sign in (1, -1)]
        assert system.A[:, column] == pytest.approx((both[0] - both[1]) / 2e-6, rel=1e-5, abs=1e-8)


def test_a_programme_of_one_glide_is_flown_without_error(integrator) -> None:
    path = path_of([glide_of(PROBE, -30), glide_of(PROBE, -30)], [200.0, 100.0])
    found = compare_with_steady(integrator, path)
    assert found.distance_m == pytest.approx([0, 0, 0], abs=1e-9)
    assert found.share < 1e-10


def test_slower_programmes_are_nearer_to_steady_glides(integrator) -> None:
    straight, steeper, turning = quasi_steady_error(PROBE, integrator, (20.0, 100.0, 1000.0))
    for one in (straight, steeper):
        assert np.all(np.diff(one.share) < 0)
        # each change costs one distance, however long the step
        assert one.distance_m[2] == pytest.approx(one.distance_m[1], rel=1e-2)
        assert one.share[1] / one.share[2] == pytest.approx(10, rel=0.02)
    assert straight.share[1] == pytest.approx(0.077, abs=0.001)
    assert turning.share[2] > 0.01  # the added mass widens turns for as long as they last


MODEL = build(PROBE)


@pytest.fixture(scope="module")
def errors():
    return swing_errors(PROBE, Integrator(MODEL), (200.0, 800.0))


@pytest.mark.slow
def test_what_inertia_does_falls_with_the_period_and_the_added_mass_stays_in_turns(errors) -> None:
    pitch, buoyancy, roll = (one.share for one in errors)
    for one in (pitch, buoyancy):
        assert one[0] / one[1] == pytest.approx(4, rel=0.15)
    assert roll[1] == pytest.approx(0.0176, abs=2e-4)


def test_a_small_swing_of_buoyancy_errs_by_what_the_linearised_model_says(errors) -> None:
    glide = steady_glide(PROBE, -(smallest_angle(PROBE) + math.radians(10)))
    found = equilibrium(MODEL, glide)
    names = ["motion.u", "motion.w"]
    system = state_space(MODEL, found.point, states=names, inputs=["buoyancy.mass"], outputs=names)
    omega = math.tau / 200.0
    response = system(1j * omega).ravel() - system(0j).ravel()
    # The swing of the buoyancy itself, behind its lag of 10 s; the root mean square of a sine.
    swing = 0.2 * 0.25 / abs(1 + 10j * omega) / math.sqrt(2)
    expected = swing * np.linalg.norm(response) / glide.speed_mps
    assert errors[1].share[0] == pytest.approx(expected, rel=0.05)
