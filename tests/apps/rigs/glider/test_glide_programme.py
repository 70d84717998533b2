"""Programmes of a glider: what their files may hold, and that the model follows them."""

from __future__ import annotations

import math

import pytest

from tank2sim.apps.rigs.glider.path import read_programme
from tank2sim.apps.rigs.glider.transient import follow_programme
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator

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
