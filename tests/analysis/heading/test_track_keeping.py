"""Tracks: line of sight against the analytic approach to a straight line, corners, current, waypoints at fault."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tank2sim.analysis.heading.designs import design_heading
from tank2sim.analysis.heading.runs import HeadingLoop
from tank2sim.analysis.heading.track_keeping import Guidance, keep_track, line_of_sight, read_waypoints
from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

SQUARE = np.array([[0.0, 0.0], [4000.0, 0.0], [4000.0, 4000.0]])


@pytest.fixture(scope="module")
def loop(mariner: Model, mariner_card: ManoeuvringCard) -> HeadingLoop:
    ship = EFFECTS["current"].apply(mariner, {"speed_mps": 0.0, "direction_rad": 0.0}, mariner_card)
    return HeadingLoop(ship, design_heading(mariner).autopilot)


def test_a_point_that_obeys_at_once_approaches_a_line_as_the_equation_says() -> None:
    """de/dt = -U e/sqrt(D^2 + e^2) has the first integral t U = sqrt(D^2+e^2) - D asinh(D/e), up to a constant."""
    speed, lookahead, step = 7.0, 480.0, 0.01
    error, time = 900.0, 0.0

    def clock(e: float) -> float:
        return -(math.hypot(lookahead, e) - lookahead * math.asinh(lookahead / e)) / speed

    begin = clock(error)
    while error > 5.0 and time < 1000:
        turned, _ = line_of_sight(error, 0.0, lookahead)
        middle, _ = line_of_sight(error + 0.5 * step * speed * math.sin(turned), 0.0, lookahead)
        error += step * speed * math.sin(middle)
        time += step
    assert time == pytest.approx(clock(error) - begin, rel=1e-5)


def test_the_heading_turns_towards_the_track_from_either_side() -> None:
    assert line_of_sight(480.0, 0.0, 480.0)[0] == pytest.approx(-math.pi / 4)
    assert line_of_sight(-480.0, 0.0, 480.0)[0] == pytest.approx(math.pi / 4)
    assert line_of_sight(0.0, 100.0, 480.0, 2.0)[0] < 0 < line_of_sight(1.0, 0.0, 480.0)[1]


def test_a_corner_is_turned_and_the_next_leg_found(loop: HeadingLoop) -> None:
    run = keep_track(loop, SQUARE, Guidance())
    assert run.figures.finished and run.figures.length_m == 8000.0
    assert run.figures.largest_error_on_legs_m < 80
    assert run.figures.largest_error_m < 2.2 * 160.93  # the circle of acceptance, and what is sailed in a step
    assert math.degrees(run.trajectory["motion.psi"][-1]) == pytest.approx(90.0, abs=3.0)
    assert run.trajectory["motion.y"][-1] == pytest.approx(4000.0, abs=20)
    # East of a leg to north is to starboard of it, north of one to east to port.
    first = run.leg == 0
    np.testing.assert_allclose(
        run.error_m[first], np.interp(run.time_s[first], run.trajectory.t, run.trajectory["motion.y"]), atol=1e-6
    )


@pytest.mark.slow
def test_tracks_are_alike_in_every_direction(loop: HeadingLoop) -> None:
    turned = SQUARE @ np.array([[math.cos(2.0), math.sin(2.0)], [-math.sin(2.0), math.cos(2.0)]]) + 1000.0
    one, other = keep_track(loop, SQUARE, Guidance()), keep_track(loop, turned, Guidance())
    np.testing.assert_allclose(one.error_m, other.error_m, atol=1e-3)


@pytest.mark.slow
def test_a_current_across_leaves_an_error_that_the_integral_takes_away(loop: HeadingLoop) -> None:
    straight = np.array([[0.0, 0.0], [16000.0, 0.0]])
    current = {"current.speed": 0.5, "current.direction": math.pi / 2}
    plain, integral = (
        keep_track(loop, straight, Guidance(integral_share=share), current).figures for share in (0.0, 0.25)
    )
    # At rest e of the line of sight: U sin(atan(e/D)) = 0.5 m/s, D three ship lengths, less the ship's own drift.
    speed = 7.7175
    wanted = 3 * 160.93 * math.tan(math.asin(0.5 / speed))
    assert plain.mean_error_at_end_m == pytest.approx(wanted, rel=0.08)
    assert abs(integral.mean_error_at_end_m) < 1.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x_m,y_m\n0,0\n", "has one waypoint"),
        ("x_m,y_m\n0,0\n0,0\n", "line 3: is the same place"),
        ("x_m,y_m\n0,0\n5,\n", "line 3, column y_m: is empty"),
        ("x_m,z_m\n0,0\n5,5\n", "there is no column y_m"),
        ("x_m,y_m\n0,0\nnorth,5\n", "'north' is not a number"),
        ("x_m,y_m\n0,0\n2e6,0\n3e6,1.5e6\n", "track.csv: its track is 3802.78 km long"),
    ],
)
def test_waypoints_at_fault_are_reported(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "track.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_waypoints(tmp_path / "track.csv")


def test_a_leg_within_the_circle_of_acceptance_is_reported(loop: HeadingLoop) -> None:
    with pytest.raises(InputError, match="leg 2"):
        keep_track(loop, np.array([[0.0, 0.0], [4000.0, 0.0], [4100.0, 0.0]]), Guidance())
