"""What a study of an autopilot refuses, and what it tells."""

from __future__ import annotations

import pytest

from tank2sim.analysis.heading.margins import growing_effects
from tank2sim.analysis.heading.study import StudySettings, study_autopilot
from tank2sim.cards import linear_card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.files import read_exact_text

ROLL = """
[[effects]]
name = "roll_coupling"
[effects.parameters]
Yphi = 0.001
Nphi = {Nphi}
"""


def rolling(Nphi: float):
    card = read_card("mariner")
    return parse_card(read_exact_text(card.source) + ROLL.format(Nphi=Nphi), "rolling.toml")


@pytest.mark.slow
def test_a_ship_that_rolls_herself_out_of_control_is_reported_so_and_not_her_steering_gear() -> None:
    card = rolling(0.02)
    ship = build(card)
    assert set(growing_effects(ship)) == {"motion.phi", "motion.p"}
    with pytest.raises(InputError, match=r"not stable: the ship's own motion in motion.phi, motion.p grows"):
        study_autopilot(card, ship, StudySettings())


@pytest.mark.parametrize("card", [read_card("kvlcc2-captive"), rolling(0.001)], ids=["unstable in yaw", "calm in roll"])
def test_a_ship_that_is_unstable_in_yaw_alone_has_no_growing_effect(card) -> None:
    assert growing_effects(build(card)) == ()


@pytest.mark.slow
def test_a_linear_card_has_margins_at_its_own_speed_alone() -> None:
    card = linear_card(read_card("mariner"))
    ship = build(card)
    found, piloted = study_autopilot(card, ship, StudySettings(speed_mps=card.model.speed_mps))
    assert [one.speed_mps for one in found.margins] == [card.model.speed_mps]
    assert any("other speeds" in notice for notice in found.notices)
    assert found.limits == pytest.approx(
        {"largest_rudder_deg": 35, "anti_windup_time_s": 24.07, "integral_band_deg": 2}, rel=1e-2
    )
    assert piloted.runs["change"]["motion.r"][0] == pytest.approx(0.0, abs=1e-9)
    assert any("35 deg of rudder" in notice and "40 deg" in notice for notice in found.notices)
    with pytest.raises(InputError, match="--speed"):
        study_autopilot(card, ship, StudySettings(speed_mps=6.0))


@pytest.mark.slow
def test_a_gear_that_waves_overwork_is_reported_with_the_remedy_which_helps() -> None:
    card = read_card("kvlcc2-captive")
    ship = build(card)
    found, _ = study_autopilot(card, ship, StudySettings())
    (reported,) = [notice for notice in found.notices if "full rate" in notice]
    assert found.closed_loop.course_keeping.rate_limited_percent > 50 and "--wave-filter 0.424" in reported
    filtered, _ = study_autopilot(card, ship, StudySettings(wave_filter_radps=0.424))
    assert filtered.closed_loop.course_keeping.rate_limited_percent < 10
    assert not any("full rate" in notice for notice in filtered.notices)
