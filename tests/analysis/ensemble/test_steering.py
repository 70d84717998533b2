"""Bands of steady turns and linear responses, against closed forms of a linear ship and against members one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import ShipText
from tank2sim.analysis.ensemble.steering import (
    Grid,
    _responses,
    branches,
    steering_bands,
)
from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.stability.response import steering_responses
from tank2sim.analysis.stability.straight_line import stability
from tank2sim.analysis.turning.diagram import steady_turning
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build

MEMBERS = 6


def grid_of(card: ManoeuvringCard) -> Grid:
    model = build(card)
    return Grid.of(model, steering_responses(model, straight_course(model), stability(model).nomoto.dimensional)[0])


@pytest.fixture(scope="module", params=["mariner", pytest.param("kvlcc2-captive", marks=pytest.mark.slow)])
def found(request: pytest.FixtureRequest):
    card = read_card(request.param).manoeuvring()
    draws, _ = draws_of(card, 3)
    grid = grid_of(card)
    return card, draws, grid, *steering_bands(ShipText.of(card), draws, MEMBERS, (None, grid))


@pytest.mark.slow
def test_bands_are_the_quantiles_of_the_members_own_responses(found) -> None:
    card, draws, grid, bands, _ = found
    model, magnitude, phase, step = build(card), [], [], []
    for number in range(MEMBERS):
        member = model.with_values(draws.member(number))
        course = straight_course(member)
        A, B = _yaw_by_rudder(member, course)
        response = np.array([np.linalg.solve(1j * w * np.eye(2) - A, B)[1] for w in grid.omega_radps])
        magnitude.append(20 * np.log10(np.abs(response)))
        phase.append(np.degrees(np.angle(response)))
        values, vectors = np.linalg.eig(A)
        modes = (np.exp(np.outer(grid.time_s, values)) - 1) / values
        step.append(((modes * np.linalg.solve(vectors, B)) @ vectors.T)[:, 1].real)
    for band, truth in ((bands.bode.magnitude_dB, magnitude), (bands.step.step_per_s, step)):
        for side, share in ((band.p5, 0.05), (band.p95, 0.95)):
            np.testing.assert_allclose(side, np.quantile(truth, share, axis=0), rtol=2e-3, atol=2e-4)
    # But for whole turns; all within half a turn of the ship's own at the highest frequency.
    off = bands.bode.phase_deg.p50 - np.median(np.unwrap(phase, axis=0, period=360), axis=0)
    np.testing.assert_allclose(off - 360 * np.round(off / 360), 0.0, atol=0.2)
    assert abs(bands.bode.phase_deg.p95[-1] - grid.phase_deg) < 180
    turned = _responses(model, None, replace(grid, phase_deg=grid.phase_deg + 360))[1]
    np.testing.assert_allclose(turned - bands.bode.phase_deg.own, 360.0, atol=1e-4)


def _yaw_by_rudder(model, course) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of sway and yaw acceleration by central differences of the model itself."""
    rows = [model.outputs.index(name) for name in ("motion.vdot", "motion.rdot")]

    def slope(name: str) -> np.ndarray:
        place, sides = model.state_names.index(name), []
        for step in (1e-5, -1e-5):
            x = course.x.copy()
            x[place] += step
            sides.append(np.array(model.output(x, course.u, course.p)).ravel()[rows])
        return (sides[0] - sides[1]) / 2e-5

    return np.column_stack([slope("motion.v"), slope("motion.r")]), slope("rudder.angle")


def test_branches_are_those_of_the_diagram_and_part_in_the_loop_alone(found) -> None:
    card, _, grid, bands, notices = found
    turning = steady_turning(build(card))
    starboard, port = branches(turning, grid.rudder_rad)
    own = bands.steady_turning.yaw_rate_from_starboard_degps.own
    np.testing.assert_allclose(own, starboard, rtol=1e-6)
    edge = turning.loop.width_deg / 2 if turning.loop else 0.0
    middle = math.degrees(turning.rudder_rad[turning.straight])
    parts = np.abs(starboard - port) > 1e-6
    inside = np.abs(np.degrees(grid.rudder_rad) - middle) < max(edge - 0.6, 0.0)
    assert parts[inside].all() and not parts[np.abs(np.degrees(grid.rudder_rad) - middle) > edge + 0.6].any()
    assert (bands.steady_turning.with_loop > 0) == (turning.loop is not None) and inside.any() == (
        turning.loop is not None
    )
    from_port = bands.steady_turning.yaw_rate_from_port_degps
    low, high = from_port.p5, from_port.p95
    assert np.all((low <= high) | np.isnan(low)) and low[-1] < port[-1] < high[-1]
    assert np.isnan(low).any() == any("no stable turn" in one for one in notices)
    if turning.loop:
        assert bands.steady_turning.loop_width_deg.p5 < 2 * edge < bands.steady_turning.loop_width_deg.p95 * 1.5
    assert bands.members == MEMBERS and np.isfinite(bands.step.step_per_s.p95).all()
