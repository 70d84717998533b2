"""The missing effect of a craft with thrusters, against an integration that shares no code with the program."""

from __future__ import annotations

import math
from pathlib import Path

import craft_log
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.gap.result import COEFFICIENTS, MISSING, NO_EFFECT_MISSING
from tests.craft_trials import PLACE, THRUST, outboard_trial, written

HULL = ("Xudot", "Yvdot", "Yrdot", "Nrdot", "Xu", "Xuabsu", "Yv", "Yvabsv", "Yr", "Nv", "Nr", "Nrabsr", "Nrabsu")
NAMES = ["steps", "zigzag", "spin", "astern"]
SOUGHT = ("current", "heading_offset")


@pytest.fixture(scope="module")
def craft() -> dict[str, float]:
    return craft_log.random_craft(np.random.default_rng(7))


def true_card(c: dict[str, float]) -> t2s.Ship:
    """The craft as it is, each number known to 5 %."""
    hull = "".join(f"{name} = {c[name]!r}\n" for name in HULL) + f"Nvdot = {c['Yrdot']!r}\n"
    errors = "".join(f"{name} = {0.05 * abs(c[name])!r}\n" for name in HULL)
    thrusters = "".join(
        f'[[thrusters]]\nname = "{name}"\ny_m = {side * c["arm"]!r}\nahead_Ns2 = {c["ahead"]!r}\n'
        f"astern_Ns2 = {c['astern']!r}\nspeed_loss_kg = {c['loss']!r}\nmax_rpm = {1.05 * c['rpm']!r}\n"
        f"uncertainty = {{ ahead_Ns2 = {0.05 * c['ahead']!r}, astern_Ns2 = {0.05 * c['astern']!r} }}\n"
        for name, side in (("port", -1), ("starboard", 1))
    )
    text = f"""format = "tank2sim-ship/1"
[ship]
name = "made up"
source = "made up"
length_m = {c["length"]!r}
[model]
kind = "small_craft"
speed_mps = {c["cruise"]!r}
[rigid_body]
mass = {c["mass"]!r}
yaw_inertia = {c["inertia"]!r}
x_G = {c["x_G"]!r}
[derivatives]
{hull}[uncertainty]
{errors}{thrusters}"""
    return t2s.Ship(parse_card(text, "craft.toml"))


def test_a_current_is_named_with_its_size_and_written_on_the_card(craft, tmp_path: Path) -> None:
    speed, towards = 0.25, math.radians(70.0)
    current = (speed * math.cos(towards), speed * math.sin(towards))
    *fitted, held = written(tmp_path, craft, NAMES, current=current)
    found = t2s.find_gap(true_card(craft), fitted, holdout=held, effects=SOUGHT, workers=1)
    assert found.gap.verdict == MISSING
    (effect,) = found.gap.effects
    assert effect.name == "current"
    assert effect.parameters["speed_mps"] == pytest.approx(speed, rel=0.05)
    assert effect.parameters["direction_rad"] == pytest.approx(towards, abs=math.radians(2.0))
    assert found.gap.misfit("before", held_out=True) > 10
    assert found.gap.misfit("after", held_out=True) < 2
    (entry,) = found.gap.improved.effects
    assert entry.name == "current" and entry.parameters["speed_mps"] == pytest.approx(speed, rel=0.05)


@pytest.mark.parametrize("ordered", [False, True])
def test_nothing_is_named_where_nothing_is_missing(craft, tmp_path: Path, ordered: bool) -> None:
    card = true_card(craft).card
    lagging = card.text.replace("max_rpm", f"time_constant_s = {craft['lag']!r}\nmax_rpm")
    ship = t2s.Ship(parse_card(lagging, "craft.toml"))
    fitted = written(tmp_path, craft, NAMES[:3], ordered=ordered)
    found = t2s.find_gap(ship, fitted, effects=SOUGHT, workers=1)
    assert found.gap.verdict in (NO_EFFECT_MISSING, COEFFICIENTS)
    assert not found.gap.effects
    assert found.gap.misfit("after", held_out=False) < 1.5


def test_only_effects_that_a_craft_can_have_are_tried(craft, tmp_path: Path) -> None:
    fitted = written(tmp_path, craft, ["spin"])
    with pytest.raises(InputError) as raised:
        t2s.find_gap(true_card(craft), fitted, effects=["rudder_bias"], workers=1)
    assert "current" in raised.value.remedy and "rudder" not in raised.value.remedy


def test_a_linear_black_box_is_of_ships(craft, tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        t2s.find_gap(true_card(craft), written(tmp_path, craft, ["spin"]), black_box=True, workers=1)
    assert raised.value.source == "black_box"


def test_a_measured_direction_of_an_outboard_is_not_delayed_again(craft, tmp_path: Path) -> None:
    thruster = f"""[[thrusters]]
name = "outboard"
x_m = {PLACE}
ahead_Ns2 = {THRUST}
astern_Ns2 = {THRUST}
max_rpm = {1.05 * craft["rpm"]}
max_azimuth_deg = 35.0
azimuth_time_constant_s = 0.4
"""
    text = true_card(craft).card.text
    ship = t2s.Ship(parse_card(text[: text.index("[[thrusters]]")] + thruster, "outboard.toml"))
    found = t2s.find_gap(ship, outboard_trial(tmp_path / "trial.csv", craft), effects=SOUGHT, workers=1)
    assert not found.gap.effects
    assert found.gap.misfit("before", held_out=False) < 2
