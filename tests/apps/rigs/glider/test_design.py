"""Best and fastest glide, polar and range, against brute search and the balance of energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.rigs.glider.steady import smallest_angle, steady_glide
from tank2sim.apps.rigs.glider.study import best_glide, fastest_glide, glide_polar, glide_range
from tank2sim.cards import read_card
from tank2sim.errors import InputError

PROBE = read_card("kulikovsky-velikanov")


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


@pytest.mark.parametrize(("budget", "depth"), [(0, 100), (-1, 100), (10, 0), (math.nan, 100), (10, math.inf)])
def test_budgets_and_depths_that_are_none_are_refused(budget, depth) -> None:
    with pytest.raises(InputError, match="positive"):
        glide_range(PROBE, best_glide(PROBE), budget_kg=budget, depth_m=depth)
