"""Steady glides against the corrected numbers of the paper, the forces themselves, and brute search for the best."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve

import tank2sim as t2s
from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.steady import (
    ballast_kg,
    force_residual,
    glide_as_printed,
    glide_at_pitch,
    radius_as_printed,
    smallest_angle,
    steady_glide,
)
from tank2sim.apps.rigs.glider.study import best_glide, fastest_glide, glide_polar, glide_range
from tank2sim.cards import read_card
from tank2sim.errors import InputError

PROBE = read_card("kulikovsky-velikanov")
assert isinstance(PROBE, GliderCard)

# eps, alpha, C_L, C_D, v, theta: S = V^(2/3), m0 0.25 kg, rho 1000, g 9.81
REFERENCE = [
    (25, 3.2402, 0.6798, 0.3170, 0.2034, 21.760),
    (30, 2.1603, 0.4499, 0.2598, 0.2444, 27.840),
    (35, 1.6578, 0.3441, 0.2410, 0.2718, 33.342),
    (45, 1.0914, 0.2257, 0.2257, 0.3119, 43.909),
]

angles = st.floats(24.0, 85.0)
rolls = st.floats(-60.0, 60.0)
loads = st.floats(0.01, 2.0)


def flown(angle: float, roll: float = 0.0, buoyancy: float | None = None):
    return steady_glide(PROBE, math.radians(angle), roll_rad=math.radians(roll), buoyancy_kg=buoyancy)


@pytest.mark.parametrize(("angle", "incidence", "lift", "drag", "speed", "pitch"), REFERENCE)
@pytest.mark.parametrize("way", [1, -1])
def test_glides_are_those_of_the_corrected_paper_climbing_and_diving(
    angle, incidence, lift, drag, speed, pitch, way
) -> None:
    glide = flown(way * angle)
    assert math.degrees(glide.incidence_rad) == pytest.approx(-way * incidence, abs=6e-5)
    assert glide.lift_coefficient == pytest.approx(-way * lift, abs=6e-5)
    assert glide.drag_coefficient == pytest.approx(drag, abs=6e-5)
    assert glide.speed_mps == pytest.approx(speed, abs=6e-5)
    assert math.degrees(glide.pitch_rad) == pytest.approx(way * pitch, abs=6e-4)
    assert glide.buoyancy_kg == way * 0.25
    assert glide.turn_rate_radps == 0 and math.isinf(glide.turning_radius_m)


@pytest.mark.parametrize(
    ("roll", "incidence", "speed", "radius"),
    [(5, 2.1728, 0.2442, 12.034), (10, 2.2114, 0.2434, 5.933), (20, 2.3834, 0.2399, 2.792)],
)
def test_turns_are_those_of_the_corrected_paper(roll, incidence, speed, radius) -> None:
    glide = flown(-30, roll)
    assert math.degrees(glide.incidence_rad) == pytest.approx(incidence, abs=6e-5)
    assert glide.speed_mps == pytest.approx(speed, abs=6e-5)
    assert glide.turning_radius_m == pytest.approx(radius, abs=6e-4)
    assert glide.turn_rate_radps == pytest.approx(glide.horizontal_speed_mps / glide.turning_radius_m)


@settings(max_examples=25, deadline=None)
@given(angles, rolls, loads, st.sampled_from([1, -1]))
def test_forces_balance_along_the_course_aside_and_upwards(angle, roll, load, way) -> None:
    if math.radians(angle) < smallest_angle(PROBE, math.radians(roll)) * 1.001:
        return
    glide = flown(way * angle, roll, way * load)
    assert max(map(abs, force_residual(PROBE, glide))) < 1e-10
    # The small root: no larger incidence than where lift by drag is greatest.
    assert abs(glide.incidence_rad) <= math.sqrt(0.214 / 32.2) * 1.05


@settings(max_examples=15, deadline=None)
@given(angles, st.floats(1.0, 40.0), loads)
def test_mirrored_orders_give_mirrored_glides(angle, roll, load) -> None:
    if math.radians(angle) < smallest_angle(PROBE, math.radians(roll)):
        return
    dive, port, climb = flown(-angle, roll, -load), flown(-angle, -roll, -load), flown(angle, roll, load)
    assert port.turn_rate_radps == pytest.approx(-dive.turn_rate_radps, rel=1e-14)
    assert climb.turn_rate_radps == pytest.approx(-dive.turn_rate_radps, rel=1e-14)  # its lift is down
    assert dive.turn_rate_radps > 0
    for other in (port, climb):
        assert other.speed_mps == pytest.approx(dive.speed_mps, rel=1e-14)
    assert climb.incidence_rad == -dive.incidence_rad


def test_a_solver_finds_the_same_incidence_and_speed_from_the_two_balances() -> None:
    eps, roll, half = math.radians(-33), math.radians(12), 0.5 * 1000 * 0.0628 ** (2 / 3)

    def balances(unknown):
        alpha, v = unknown
        lift = half * v**2 * (11.76 * alpha + 4.6 * alpha * abs(alpha))
        drag = half * v**2 * (0.214 + 32.2 * alpha**2)
        across = drag * math.cos(eps) + lift * math.cos(roll) * math.sin(eps)
        return across, -0.4 * 9.81 + lift * math.cos(roll) * math.cos(eps) - drag * math.sin(eps)

    alpha, v = fsolve(balances, [0.03, 0.3], xtol=1e-14)
    glide = flown(-33, 12, -0.4)
    assert glide.incidence_rad == pytest.approx(alpha, rel=1e-8)
    assert glide.speed_mps == pytest.approx(v, rel=1e-8)


def test_the_smallest_angle_is_the_greatest_ratio_of_lift_to_drag() -> None:
    assert math.degrees(smallest_angle(PROBE)) == pytest.approx(23.385, abs=5e-4)
    assert math.degrees(steady_glide(PROBE, -smallest_angle(PROBE)).incidence_rad) == pytest.approx(4.822, abs=5e-4)
    alpha = np.linspace(0.001, 0.3, 200001)
    ratio = (11.76 * alpha + 4.6 * alpha**2) / (0.214 + 32.2 * alpha**2)
    assert 1 / math.tan(smallest_angle(PROBE)) == pytest.approx(ratio.max(), rel=1e-9)
    assert math.tan(smallest_angle(PROBE, 0.5)) * math.cos(0.5) == pytest.approx(math.tan(smallest_angle(PROBE)))


@pytest.mark.parametrize(
    ("angle", "roll", "words"),
    [
        (23.38, 0, "the smallest that can is 23.385 deg"),
        (-20, 0, "23.385"),
        (24, 30, "26.534"),
        (0, 0, "not a glide"),
        (90, 0, "not a glide"),
        (math.nan, 0, "not a glide"),
        (30, 90, "not a roll"),
    ],
)
def test_what_cannot_be_flown_is_refused_and_the_smallest_angle_named(angle, roll, words) -> None:
    with pytest.raises(InputError, match=words):
        flown(angle, roll)


def test_a_light_glider_does_not_dive() -> None:
    with pytest.raises(InputError, match="light"):
        flown(-30, buoyancy=0.2)
    with pytest.raises(InputError, match="heavy"):
        flown(30, buoyancy=-0.2)
    assert flown(30, buoyancy=0.0).speed_mps == 0


def test_a_pitch_leads_back_to_its_path() -> None:
    for angle, roll in ((-30, 0), (27, 10), (-60, -20)):
        glide = flown(angle, roll)
        back = glide_at_pitch(PROBE, glide.pitch_rad, roll_rad=glide.roll_rad)
        assert back.path_angle_rad == pytest.approx(glide.path_angle_rad, abs=1e-12)
    with pytest.raises(InputError, match=r"smallest pitch is 18\.563 deg"):
        glide_at_pitch(PROBE, math.radians(18.0))


@pytest.mark.parametrize(("angle", "incidence", "speed"), [(30, 12.75, 0.0972), (45, 23.97, 0.0619)])
def test_the_printed_equations_give_the_printed_error(angle, incidence, speed) -> None:
    glide = glide_as_printed(PROBE, math.radians(angle))
    assert math.degrees(glide.incidence_rad) == pytest.approx(-incidence, abs=5e-3)
    assert glide.speed_mps == pytest.approx(speed, abs=5e-5)
    # They balance a drag that is not (7); with that of (7) they do not.
    along = glide.drag_N * math.cos(glide.path_angle_rad) + glide.lift_N * math.sin(glide.path_angle_rad)
    assert abs(along) < 1e-10
    right = glide.drag_N * (0.214 + 32.2 * glide.incidence_rad**2) / glide.drag_coefficient
    left = force_residual(PROBE, glide)
    assert left[0] == pytest.approx((glide.drag_N - right) * math.cos(glide.path_angle_rad))
    assert abs(left[0]) > 0.02


def test_the_printed_radius_is_too_large_by_the_cosine_cubed() -> None:
    glide = flown(-30, 5)
    radius = radius_as_printed(PROBE, glide.lift_coefficient, glide.path_angle_rad, glide.roll_rad)
    assert radius / glide.turning_radius_m == pytest.approx(1 / math.cos(math.radians(30)) ** 3)
    assert math.degrees(100 * glide.turn_rate_radps) == pytest.approx(100.7, abs=0.05)
    assert math.degrees(100 * glide.speed_mps / radius) == pytest.approx(75.5, abs=0.05)  # (13) as printed


def test_speed_goes_with_the_roots_of_buoyancy_and_area() -> None:
    frontal = read_card("kulikovsky-velikanov", {"glider.reference_area_m2": 0.0356})
    faster = steady_glide(frontal, math.radians(30)).speed_mps / flown(30).speed_mps
    assert faster == pytest.approx(math.sqrt(0.0628 ** (2 / 3) / 0.0356))
    assert faster == pytest.approx(2.1, abs=0.01)
    assert flown(30, buoyancy=1.0).speed_mps == pytest.approx(2 * flown(30).speed_mps)


def test_ballast_makes_up_what_the_hull_lacks() -> None:
    assert ballast_kg(PROBE, 0.25) is None
    right = read_card("kulikovsky-velikanov", {"glider.volume_m3": 0.05, "glider.hull_mass_kg": 49.0})
    assert ballast_kg(right, 0.25) == pytest.approx(0.75)
    assert ballast_kg(right, -0.25) == pytest.approx(1.25)
    with pytest.raises(InputError, match="hull_mass_kg"):
        ballast_kg(right, 1.5)


def test_the_fastest_glide_is_the_fastest_of_all_angles() -> None:
    angles = np.radians(np.linspace(23.4, 89, 20001))
    speeds = np.array([steady_glide(PROBE, -angle).horizontal_speed_mps for angle in angles])
    fastest = fastest_glide(PROBE)
    assert fastest.horizontal_speed_mps >= speeds.max()
    assert -fastest.path_angle_rad == pytest.approx(angles[speeds.argmax()], abs=1e-4)
    heavier = t2s.load("kulikovsky-velikanov").replace({"glider.buoyancy_kg": 1.0}).card
    assert fastest_glide(heavier).path_angle_rad == pytest.approx(fastest.path_angle_rad)


def test_the_best_glide_goes_farthest_for_its_depth() -> None:
    best, polar = best_glide(PROBE), glide_polar(PROBE)
    assert -best.path_angle_rad == smallest_angle(PROBE)
    ratios = [glide.horizontal_speed_mps / -glide.climb_mps for glide in polar]
    assert ratios[0] == max(ratios) == pytest.approx(2.3126, abs=1e-4)
    assert polar[-1].horizontal_speed_mps < 0.02 * polar[-1].speed_mps


def test_the_work_of_the_pump_is_what_the_drag_takes() -> None:
    glide = steady_glide(PROBE, math.radians(-33))
    found = glide_range(PROBE, glide, budget_kg=30.0, depth_m=150.0)
    assert found.cycles == 60
    assert found.range_m == pytest.approx(60 * 2 * 150 / math.tan(math.radians(33)))
    assert found.duration_s == pytest.approx(found.range_m / glide.horizontal_speed_mps)
    assert found.energy_J == pytest.approx(glide.drag_N * glide.speed_mps * found.duration_s, rel=1e-12)
