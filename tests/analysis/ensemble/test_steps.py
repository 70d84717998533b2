"""Longer integration steps of large ensembles of turns, against the model's own step."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.ensemble import questions, results
from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import (
    STEP_FACTORS,
    STEP_TOLERANCE,
    OfManoeuvre,
    ShipText,
    fastest_pace,
    same_figures,
)
from tank2sim.analysis.ensemble.results import EnsembleRequest, manoeuvre_bands
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.native.lanes import widest_lanes
from tank2sim.simulation import ensemble as ensembles
from tank2sim.simulation.ensemble import ensemble
from tank2sim.simulation.lane_figures import USUAL_PACE, LaneFigures, Pace
from tank2sim.simulation.manoeuvres import Manoeuvre, Turn, Zigzag

pytestmark = pytest.mark.skipif(widest_lanes() == 0, reason="needs a C compiler")

TURN = Turn(math.radians(35.0))


def question(card: ManoeuvringCard, manoeuvre: Manoeuvre = TURN, duration_s: float | None = None) -> OfManoeuvre:
    return OfManoeuvre(ShipText.of(card), manoeuvre, duration_s, np.linspace(0.0, 300.0, 4))


@pytest.mark.slow
def test_the_longest_step_with_the_same_figures_is_taken(mariner_card, monkeypatch) -> None:
    draws, _ = draws_of(mariner_card, 1)
    assert fastest_pace(question(mariner_card), draws) == Pace(STEP_FACTORS[0], single=True)
    assert fastest_pace(question(mariner_card, Zigzag(0.2, 0.2)), draws) == Pace(1, single=True)
    monkeypatch.setattr(questions, "STEP_TOLERANCE", 5e-8)  # single precision is not as exact
    assert fastest_pace(question(mariner_card), draws) == Pace(4)
    monkeypatch.setattr(questions, "STEP_TOLERANCE", 1e-13)
    assert fastest_pace(question(mariner_card), draws) == USUAL_PACE


@pytest.mark.slow
def test_a_step_at_the_edge_of_the_stable_ones_is_not_taken(monkeypatch) -> None:
    card = read_card("kvlcc2").manoeuvring()
    draws, _ = draws_of(card, 1)
    monkeypatch.setattr(questions, "STEP_FACTORS", (5,))
    assert fastest_pace(question(card), draws).step_factor == 1
    monkeypatch.setattr(questions, "EDGE_TOLERANCE", 1.0)
    assert fastest_pace(question(card), draws).step_factor == 5


@pytest.mark.slow
def test_turns_of_which_most_show_no_steady_part_keep_the_usual_step() -> None:
    card = read_card("kvlcc2").manoeuvring()
    assert fastest_pace(question(card, duration_s=600.0), draws_of(card, 1)[0]) == USUAL_PACE


def test_a_figure_that_is_a_number_with_one_step_alone_is_not_the_same() -> None:
    def figures(*values: float) -> LaneFigures:
        none = np.zeros(2, dtype=np.bool_)
        return LaneFigures({"advance_m": np.array(values)}, np.zeros((2, 0, 1)), ~none, np.full(2, np.inf), none)

    usual = figures(500.0, np.nan)
    assert same_figures(usual, figures(500.0 * (1 + 0.5 * STEP_TOLERANCE), np.nan), STEP_TOLERANCE)
    assert not same_figures(usual, figures(500.0 * (1 + 2 * STEP_TOLERANCE), np.nan), STEP_TOLERANCE)
    assert not same_figures(usual, figures(500.0, 500.0), 1.0) and not same_figures(figures(500.0, 500.0), usual, 1.0)


@pytest.mark.slow
def test_members_have_the_same_figures_in_whatever_batches(mariner_card, monkeypatch) -> None:
    monkeypatch.setattr(ensembles, "KEPT", 20)
    draws, _ = draws_of(mariner_card, 1)
    usual = question(mariner_card)
    longer = replace(usual, pace=Pace(3, single=True))
    own, whole, parts = (ensemble(usual, draws, 40), ensemble(longer, draws, 40), ensemble(longer, draws, 40, batch=7))
    assert whole.histories is not None and parts.histories is not None and own.histories is not None
    np.testing.assert_array_equal(whole.histories, parts.histories)
    np.testing.assert_array_equal(whole.histories, own.histories)
    for name, values in whole.figures.items():
        np.testing.assert_array_equal(values, parts.figures[name])
        np.testing.assert_array_equal(values[:20], own.figures[name][:20])
        np.testing.assert_allclose(values[20:], own.figures[name][20:], rtol=STEP_TOLERANCE)
    assert (whole.figures["advance_m"][20:] != own.figures["advance_m"][20:]).all()


@pytest.mark.slow
def test_the_steps_of_the_members_are_reported(mariner_card, monkeypatch) -> None:
    own = build(mariner_card).step_s
    few = manoeuvre_bands(mariner_card, TURN, (None, 400.0), EnsembleRequest(30, 1))
    assert few.steps_s == (own, own) and not few.single_precision
    for module in (ensembles, results):
        monkeypatch.setattr(module, "KEPT", 10)
    many = manoeuvre_bands(mariner_card, TURN, (None, 400.0), EnsembleRequest(30, 1))
    assert many.steps_s == pytest.approx((own, 6 * own)) and many.single_precision and many.steps_s[1] > many.steps_s[0]
    for name, band in few.figures.items():
        assert many.figures[name].p50 == pytest.approx(band.p50, rel=STEP_TOLERANCE)
