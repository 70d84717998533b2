"""Paths of steady glides against the corrected sample path and against circles drawn by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.apps.rigs.glider.path import GlideProgramme, ProgrammeStep, fly, path_of, read_programme
from tank2sim.apps.rigs.glider.steady import glide_as_printed, steady_glide
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.errors import InputError

PROBE = read_card("kulikovsky-velikanov")
SAMPLE = read_programme(bundled("models", "kulikovsky-velikanov", "programme.csv"))


def test_the_sample_path_is_that_of_the_corrected_paper() -> None:
    places = fly(PROBE, SAMPLE).places
    assert places[6][1:] == pytest.approx((127.018, 0, -73.334, 0), abs=1e-3)
    assert places[7][1:] == pytest.approx((138.844, 14.266, -85.544, 1.757), abs=1e-3)
    assert places[12][1:] == pytest.approx((119.215, 118.279, -24.432, 1.757), abs=1e-3)
    assert places[12].time_s == 1200


def test_the_path_is_the_integral_of_its_velocities() -> None:
    glides = [steady_glide(PROBE, math.radians(a), roll_rad=math.radians(r)) for a, r in ((-30, 8), (28, -4), (-40, 0))]
    durations = [130.0, 90.0, 50.0]
    path = path_of(glides, durations)
    at = np.zeros(4)
    for glide, duration, place in zip(glides, durations, path.places[1:], strict=True):

        def velocity(_, x, glide=glide):
            ground = glide.speed_mps * math.cos(glide.path_angle_rad)
            climb = glide.speed_mps * math.sin(glide.path_angle_rad)
            return ground * math.cos(x[3]), ground * math.sin(x[3]), climb, glide.turn_rate_radps

        at = solve_ivp(velocity, (0, duration), at, rtol=1e-11, atol=1e-11).y[:, -1]
        assert place[1:] == pytest.approx(at, abs=1e-8)
    assert path.length_m == pytest.approx(sum(g.speed_mps * t for g, t in zip(glides, durations, strict=True)))


def test_one_turn_closes_and_points_for_drawing_lie_on_the_circle() -> None:
    glide = steady_glide(PROBE, math.radians(-30), roll_rad=math.radians(10))
    path = path_of([glide], [math.tau / glide.turn_rate_radps])
    assert path.places[-1][1:3] == pytest.approx((0, 0), abs=1e-9)
    points = path.sampled()
    radii = np.hypot(points[:, 1], points[:, 2] - glide.turning_radius_m)
    assert radii == pytest.approx(glide.turning_radius_m)


def test_the_path_as_printed_multiplies_the_radius_once_only() -> None:
    step = ProgrammeStep(duration_s=20.0, angle_rad=math.radians(-30), roll_rad=math.radians(5))
    glide = glide_as_printed(PROBE, step.angle_rad, roll_rad=step.roll_rad)
    change = glide.speed_mps * 20.0 / glide.turning_radius_m
    place = fly(PROBE, GlideProgramme("made", (step,)), as_printed=True).places[-1]
    assert place.north_m == pytest.approx(glide.turning_radius_m * math.sin(change))
    assert place.east_m == pytest.approx(1 - math.cos(change))
    straight = fly(PROBE, GlideProgramme("made", (replace(step, roll_rad=0.0),)), as_printed=True)
    assert straight.places[-1].north_m == pytest.approx(20.0 * straight.glides[0].speed_mps)


def test_a_step_that_cannot_be_flown_is_named_by_its_line(tmp_path) -> None:
    file = tmp_path / "p.csv"
    file.write_text("duration_s,path_angle_deg,roll_deg\n10,-30,0\n10,-24,30\n")
    with pytest.raises(InputError, match=r"p\.csv: line 3.*24 deg cannot be flown with 30 deg.*26\.534 deg"):
        fly(PROBE, read_programme(file))
