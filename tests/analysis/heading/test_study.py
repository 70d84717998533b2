"""Margins against loops whose margins are known, and what a study of an autopilot refuses and reports."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from tank2sim.analysis.heading.designs import LqrWeights, design_heading
from tank2sim.analysis.heading.margins import (
    closed_loop_transfer,
    growing_effects,
    largest_steps,
    loop_margins,
    loop_transfer,
)
from tank2sim.analysis.heading.study import StudySettings, _notices, study_autopilot
from tank2sim.cards import linear_card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
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
    with pytest.raises(InputError, match="speed_mps"):
        study_autopilot(card, ship, StudySettings(speed_mps=6.0))


def test_a_rudder_whose_rate_nothing_limits_is_a_caution_that_names_the_key() -> None:
    card = read_card("esso-osaka")
    found, _ = study_autopilot(card, build(card), StudySettings())
    kept = found.closed_loop.course_keeping
    assert kept.rate_limited_percent is None and found.closed_loop.course_changes["change"].rate_limited_s is None
    assert kept.rudder_travel_degps > 10
    (doubt,) = [notice for notice in found.notices if notice.leads]
    assert "no largest rate" in doubt and "steering_gear.max_rate_degps" in doubt
    stated = read_card("esso-osaka", {"steering_gear.max_rate_degps": 20.0})
    limited, _ = study_autopilot(stated, build(stated), StudySettings())
    assert limited.closed_loop.course_keeping.rate_limited_percent is not None
    assert not any("no largest rate" in notice for notice in limited.notices)


@pytest.mark.slow
def test_a_gear_that_waves_overwork_is_reported_with_the_remedy_which_helps() -> None:
    card = read_card("kvlcc2-captive")
    ship = build(card)
    found, _ = study_autopilot(card, ship, StudySettings())
    (reported,) = [notice for notice in found.notices if "full rate" in notice]
    assert found.closed_loop.course_keeping.rate_limited_percent > 50 and "wave_filter_radps=0.424" in reported
    filtered, _ = study_autopilot(card, ship, StudySettings(wave_filter_radps=0.424))
    assert filtered.closed_loop.course_keeping.rate_limited_percent < 10
    assert not any("full rate" in notice for notice in filtered.notices)


@pytest.fixture(scope="module", params=[("mariner", "pid"), ("kvlcc2-captive", "lqr")])
def loop(request: pytest.FixtureRequest) -> tuple[Model, Model]:
    name, kind = request.param
    ship = build(read_card(name))
    return ship, design_heading(ship, kind).autopilot


def test_margins_are_those_of_a_plain_sweep(loop: tuple[Model, Model]) -> None:
    found, L = loop_margins(*loop), loop_transfer(*loop)
    omega = np.logspace(-4, 1, 50_000)
    value = _values(L, omega)
    size, phase = np.abs(value), np.degrees(np.angle(value))
    crossing = np.flatnonzero((size[:-1] > 1) != (size[1:] > 1))
    margins = [180 + phase[k] for k in crossing]
    assert found.phase_margin_deg == pytest.approx(min(margins, key=abs), abs=0.05)
    delays = [math.radians(margin % 360) / omega[k] for margin, k in zip(margins, crossing, strict=True)]
    assert found.delay_margin_s == pytest.approx(min(delays), rel=1e-3)
    assert found.sensitivity_peak == pytest.approx(1 / np.abs(1 + value).min(), rel=1e-4)
    axis = np.flatnonzero((value.imag[:-1] > 0) != (value.imag[1:] > 0))
    falls = [size[k] for k in axis if value[k].real < 0 and size[k] > 1]
    assert found.gain_margin_down == pytest.approx(1 / min(falls) if falls else 0.0, rel=1e-3, abs=1e-6)


def test_a_loop_of_almost_no_gain_amplifies_nothing(loop: tuple[Model, Model]) -> None:
    ship, _ = loop
    weak = design_heading(ship, "lqr", weights=LqrWeights(heading_rad=1e7)).autopilot
    L = _values(loop_transfer(ship, weak), np.logspace(-4, 1, 50_000))
    assert loop_margins(ship, weak).sensitivity_peak == pytest.approx(1 / np.abs(1 + L).min(), rel=1e-3)


def _values(L: object, omega: np.ndarray) -> np.ndarray:
    matrices = 1j * omega[:, None, None] * np.eye(len(L.A)) - L.A
    return (L.C @ np.linalg.solve(matrices, np.broadcast_to(L.B, (len(omega), *L.B.shape)))).ravel()


def test_one_and_the_loop_transfer_share_their_poles_with_the_joint_model(loop: tuple[Model, Model]) -> None:
    """Two ways to the closed loop: the models joined and linearised, and linearised and joined."""
    L, whole = loop_transfer(*loop), closed_loop_transfer(*loop)
    joined = np.linalg.eigvals(L.A - L.B @ L.C)
    np.testing.assert_allclose(np.sort_complex(joined), np.sort_complex(whole.poles()), rtol=1e-4, atol=1e-7)


def test_the_heading_comes_to_its_order(loop: tuple[Model, Model]) -> None:
    assert abs(closed_loop_transfer(*loop)(1e-7j)[0].item()) == pytest.approx(1.0, abs=1e-3)


def test_a_delay_of_the_margin_takes_the_loop_to_its_edge(mariner: Model) -> None:
    pilot = design_heading(mariner).autopilot
    margin = loop_margins(mariner, pilot).delay_margin_s
    L = loop_transfer(mariner, pilot)
    omega = np.linspace(0.1, 0.12, 20_000)
    value = _values(L, omega) * np.exp(-1j * omega * margin)
    assert np.abs(1 + value).min() < 1e-4


def test_the_largest_step_is_where_the_linear_answer_meets_the_limit(mariner: Model) -> None:
    pilot = design_heading(mariner).autopilot
    steps, whole = largest_steps(mariner, pilot), closed_loop_transfer(mariner, pilot)
    time = np.linspace(0, 300, 30_001)
    _, answer, _ = lsim(StateSpace(whole.A, whole.B, whole.C, whole.D), np.ones_like(time), time)
    order, rate = np.abs(answer[:, 1:]).max(axis=0)
    assert math.radians(steps.within_rate_deg) * rate == pytest.approx(math.radians(5.0), rel=1e-3)
    assert math.radians(steps.within_angle_deg) * order == pytest.approx(math.radians(35.0), rel=1e-3)


@pytest.mark.slow
def test_more_speed_is_more_gain(mariner: Model) -> None:
    pilot = design_heading(mariner).autopilot
    slow, fast = (loop_margins(mariner, pilot, speed) for speed in (6.0, 9.0))
    assert slow.crossover_radps < fast.crossover_radps
    assert slow.delay_margin_s > fast.delay_margin_s


def test_a_loop_that_is_not_stable_is_a_caution() -> None:
    margins = [SimpleNamespace(speed_mps=speed, stable=stable) for speed, stable in ((5.0, False), (7.7, True))]
    (found,) = _notices(margins, {}, {})
    assert found.leads and "5 m/s" in found
