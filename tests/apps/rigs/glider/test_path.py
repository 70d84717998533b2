"""Programmes of a glider: what their files may hold, and paths against the corrected sample and circles by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.apps.rigs.glider.path import GlideProgramme, ProgrammeStep, fly, path_of, read_programme
from tank2sim.apps.rigs.glider.steady import glide_as_printed, steady_glide
from tank2sim.apps.rigs.glider.transient import follow_programme
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator

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


MODEL = build(read_card("kulikovsky-velikanov"))


def written(folder, text):
    file = folder / "programme.csv"
    file.write_text(text)
    return file


def test_columns_are_read_with_their_units_and_defaults(tmp_path) -> None:
    text = "# a remark\nduration_s,pitch_rad,roll_deg,buoyancy_kg\n60,-0.5,,-0.3\n30,0.5,10,\n"
    programme = read_programme(written(tmp_path, text))
    first, second = programme.steps
    assert (first.duration_s, first.angle_rad, first.is_pitch, first.roll_rad) == (60, -0.5, True, 0)
    assert first.buoyancy_kg == -0.3 and second.buoyancy_kg is None
    assert second.roll_rad == pytest.approx(math.radians(10))
    assert programme.duration_s == 90


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("duration_s,path_angle_deg\n0,-30\n", "line 2.*duration_s.*positive"),
        ("duration_s,path_angle_deg\n-5,-30\n", "positive"),
        ("duration_s,path_angle_deg\n,-30\n", "empty"),
        ("duration_s,path_angle_deg\n10,\n", "line 2, column path_angle_deg: is empty"),
        ("duration_s,roll_deg\n10,0\n", "neither path_angle_deg nor pitch_deg"),
        ("duration_s,path_angle_deg,pitch_deg\n10,-30,-28\n", "both"),
        ("duration_s,path_angle_deg,yaw_deg\n10,-30,0\n", "column yaw_deg"),
        ("path_angle_deg\n-30\n", "no column duration_s"),
        ("duration_s,path_angle_deg\n2e6,-30\n", "at most"),
    ],
)
def test_a_programme_at_fault_is_refused_with_its_place(tmp_path, text, words) -> None:
    with pytest.raises(InputError, match=words):
        read_programme(written(tmp_path, text))


def test_the_model_starts_in_steady_glide_and_follows_the_orders() -> None:
    dive = {"buoyancy.command": -0.25, "pitch.command": -0.5, "roll.command": 0.0}
    climb = {"buoyancy.command": 0.1, "pitch.command": 0.6, "roll.command": 0.1}
    run = follow_programme(Integrator(MODEL, compiled=False), [dive, climb], [20.0, 80.0])
    assert run["motion.udot"][0] == pytest.approx(0, abs=1e-12)
    assert run.at("motion.speed", 19.9) == pytest.approx(run["motion.speed"][0], rel=1e-9)
    assert run["pitch.angle"][-1] == pytest.approx(0.6 - 1.1 * math.exp(-80 / 5), abs=1e-6)
    assert run["buoyancy.mass"][-1] == pytest.approx(0.1 - 0.35 * math.exp(-80 / 10), abs=1e-6)
    assert run["motion.psidot"][-1] < 0  # rolled to starboard a climb turns to port


def test_without_buoyancy_it_starts_at_rest_and_then_glides() -> None:
    still = {"buoyancy.command": 0.0, "pitch.command": -0.4859, "roll.command": 0.0}
    run = follow_programme(
        Integrator(MODEL, compiled=False), [still, {**still, "buoyancy.command": -0.25}], [10.0, 150.0]
    )
    assert run.at("motion.speed", 10.0) < 1e-7
    assert run["motion.speed"][-1] == pytest.approx(0.2444, abs=1e-3)
