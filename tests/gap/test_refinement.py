"""Coefficients refined by simulations: numpy and scipy make the trials of a ship written out there."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.reading import revised
from tank2sim.gap.proof.refinement import CoefficientPrior, _begin, _linearised, refined_coefficients
from tank2sim.gap.proof.replay import replay_trials
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tests.gap.replay_noise import NOISE
from tests.identification.trials import made_up_ship

OFF = {"Yv": 1.1, "Yd": 0.9, "Nv": 0.9, "Nr": 1.1, "Nd": 0.92, "Xvr": 1.1}


@pytest.fixture(scope="module")
def wrong() -> ManoeuvringCard:
    """Coefficients off by a tenth."""
    card = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    changed = {
        name: (share * card.derivatives[name], abs(0.02 * card.derivatives[name])) for name, share in OFF.items()
    }
    return revised(card, changed)


def refined(card: ManoeuvringCard, width: float) -> ManoeuvringCard:
    fitted = Measured(
        (
            made_up_ship.trial(made_up_ship.zigzag(20.0), name="zigzag", duration=200.0, step=0.5),
            made_up_ship.trial(made_up_ship.turn(-25.0), name="turn", duration=200.0, step=0.5, seed=2),
        ),
        "angle",
        (),
    )
    values, errors = (np.array([read(name) for name in OFF]) for read in (card.derivatives.get, card.standard_error))
    found = refined_coefficients(card, CoefficientPrior(tuple(OFF), values, width * errors), fitted, NOISE)
    return revised(card, {name: (float(value), 0.0) for name, value in zip(OFF, found, strict=True)})


def test_a_card_that_is_wrong_by_five_of_its_errors_is_followed_to_the_noise_in_another_trial(wrong) -> None:
    other = made_up_ship.trial(made_up_ship.turn(15.0), name="other", duration=200.0, step=0.5, seed=3)
    after = refined(wrong, width=5.0)
    (replay,) = replay_trials(wrong, after, Measured((other,), "angle", ()), NOISE, held_out=True)
    assert replay.misfit("before") > 10 and replay.misfit("after") == pytest.approx(1.0, abs=0.1)
    for name in OFF:
        assert after.derivatives[name] == pytest.approx(made_up_ship.TRUTH[name], rel=0.01)


def test_a_coefficient_stays_below_its_highest_value_and_the_others_are_the_best_there(wrong) -> None:
    trial = made_up_ship.trial(made_up_ship.turn(-25.0), name="turn", duration=100.0, step=0.5, seed=2)
    fitted, names = Measured((trial,), "angle", ()), ("Nr", "Nv")
    at = np.array([wrong.derivatives[name] for name in names])
    prior = CoefficientPrior(names, at, np.abs(at), np.array([at[0], np.inf]))  # the truth is 1.1 times smaller
    found = refined_coefficients(wrong, prior, fitted, NOISE)
    assert found[0] == at[0]
    held = refined_coefficients(wrong, CoefficientPrior(names[1:], at[1:], np.abs(at[1:])), fitted, NOISE)
    assert found[1] == pytest.approx(held[0], rel=1e-3)


def test_added_masses_that_no_ship_has_are_of_infinite_cost(wrong) -> None:
    """J_z - Nrdot would be negative; half of that step is possible."""
    names, trial = ("Nrdot", "Nr"), made_up_ship.trial(made_up_ship.turn(15.0), name="turn", duration=60.0, step=0.5)
    at = np.array([wrong.derivatives[name] for name in names])
    prior = CoefficientPrior(names, at, 0.1 * np.abs(at))
    begun = _begin(wrong, "angle", NOISE, prior, trial, at)
    step = np.array([1.2 * (wrong.rigid_body.yaw_inertia - at[0]), 0.0])
    costs = [_linearised(wrong, "angle", NOISE, prior, begun, at + share * step).cost for share in (0.0, 0.5, 1.0)]
    assert np.isfinite(costs[:2]).all() and costs[2] == np.inf


def test_a_card_that_is_surer_moves_less(wrong) -> None:
    def moved(width: float) -> float:
        after = refined(wrong, width)
        return sum(abs(after.derivatives[name] / wrong.derivatives[name] - 1) for name in OFF)

    assert moved(1e-4) < 0.1 * moved(1e-2)
