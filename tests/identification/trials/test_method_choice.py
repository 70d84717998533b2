"""Which method fits trials: by what output error leaves, and where the trials are from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.identification.trials.assessment.model_selection import choose_method, signal_residuals
from tank2sim.identification.trials.identify import identify_trials
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.study import study_identification

from .made_up_ship import CARD, SPEED, gusts, problem, trial, turn, zigzag

COUNT, STEP = 601, 0.5


def trials(*, gusty: bool):
    """A turn and a zigzag, with forces of a 40th of the rudder's, or with white noise of the sensors alone."""
    rudders = {"turn": turn(20), "zigzag": zigzag(20)}
    force = gusts(COUNT + 1, STEP, (1e-4, 3e-4, 6e-5), 30.0, 5) if gusty else None
    return [
        trial(rudder, name=name, step=STEP, seed=seed, force=force)
        for seed, (name, rudder) in enumerate(rudders.items(), start=1)
    ]


@pytest.mark.parametrize(("gusty", "method"), [(True, "kalman"), (False, "output_error")])
def test_gusts_leave_residuals_of_the_process_and_sensors_do_not(gusty, method) -> None:
    posed = problem(trials(gusty=gusty))
    fitted = output_error(posed, settings=OutputErrorSettings(piece_s=5 * posed.ship_time))
    choice = choose_method(signal_residuals(posed, fitted))
    assert choice.method == method and choice.reason


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(CARD, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


NONE = Measured((), "angle", ())


def chosen(card: ManoeuvringCard, group, **options):
    given = Measured(tuple(group), "angle", ())
    return identify_trials(card, given, options=IdentificationOptions(members=0, structure="card", **options))


@pytest.mark.slow
def test_trials_of_a_basin_stay_with_output_error_and_the_result_says_why(card) -> None:
    result = chosen(card, trials(gusty=True))
    assert result.estimate.method == "output_error" and result.current is None
    assert result.choice is not None and "at sea" in result.choice.reason
    assert any(notice.startswith("method: output error") for notice in result.notices)
    study = study_identification(card, result, NONE, NONE)
    assert study.method_reason == result.choice.reason and study.current is None


@pytest.mark.slow
def test_gusty_trials_at_sea_are_filtered_and_a_stated_method_is_kept(card) -> None:
    sea = [replace(one, origin_deg=(54.0, 10.0)) for one in trials(gusty=True)]
    result = chosen(card, sea)
    assert result.estimate.method == "kalman" and result.choice is not None and result.choice.method == "kalman"
    assert result.current is not None and result.current.speed_mps < 0.02 * SPEED
    for method in ("output_error", "kalman"):
        forced = chosen(card, sea, method=method)
        assert forced.estimate.method == method and forced.choice is None
    assert chosen(card, sea, piece_s=60.0).estimate.method == "output_error"
    calm = [replace(one, origin_deg=(54.0, 10.0)) for one in trials(gusty=False)]
    assert chosen(card, calm).estimate.method == "output_error"
    water = study_identification(card, result, NONE, NONE).current
    assert water is not None and water.determined and water.speed_mps == result.current.speed_mps
    assert np.isfinite(result.estimate.standard_errors).all()
