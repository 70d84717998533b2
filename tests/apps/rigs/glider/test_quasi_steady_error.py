"""The quasi-steady error of swings, against what the linearised model says and against the added mass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.analysis.linearisation import state_space
from tank2sim.apps.rigs.glider.steady import smallest_angle, steady_glide
from tank2sim.apps.rigs.glider.transient import equilibrium, swing_errors
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.integrator import Integrator

PROBE = read_card("kulikovsky-velikanov")
MODEL = build(PROBE)


@pytest.fixture(scope="module")
def errors():
    return swing_errors(PROBE, Integrator(MODEL), (200.0, 800.0))


@pytest.mark.slow
def test_what_inertia_does_falls_with_the_period_and_the_added_mass_stays_in_turns(errors) -> None:
    pitch, buoyancy, roll = (one.share for one in errors)
    for one in (pitch, buoyancy):
        assert one[0] / one[1] == pytest.approx(4, rel=0.15)
    assert roll[1] == pytest.approx(0.0176, abs=2e-4)


def test_a_small_swing_of_buoyancy_errs_by_what_the_linearised_model_says(errors) -> None:
    glide = steady_glide(PROBE, -(smallest_angle(PROBE) + math.radians(10)))
    found = equilibrium(MODEL, glide)
    names = ["motion.u", "motion.w"]
    system = state_space(MODEL, found.point, states=names, inputs=["buoyancy.mass"], outputs=names)
    omega = math.tau / 200.0
    response = system(1j * omega).ravel() - system(0j).ravel()
    # The swing of the buoyancy itself, behind its lag of 10 s; the root mean square of a sine.
    swing = 0.2 * 0.25 / abs(1 + 10j * omega) / math.sqrt(2)
    expected = swing * np.linalg.norm(response) / glide.speed_mps
    assert errors[1].share[0] == pytest.approx(expected, rel=0.05)
