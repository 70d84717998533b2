"""Agreement against values by hand, black boxes against records of a ship written out in numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.diagnosis.strangeness import trial_consistency
from tank2sim.gap.proof.cross_check import black_box, closes_gap, worse_trials
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tests.gap.replay_noise import NOISE
from tests.identification.trials import made_up_ship


def test_cochran_by_hand() -> None:
    found = trial_consistency({"a": (1.0, 1.0), "b": (2.0, 1.0), "c": (3.0, 1.0)})
    assert (found.mean, found.q) == pytest.approx((2.0, 2.0))
    assert found.standard_error == pytest.approx(1 / math.sqrt(3))
    assert found.p == pytest.approx(math.exp(-1.0))  # chi-square with two degrees of freedom
    weighted = trial_consistency({"a": (0.0, 1.0), "b": (3.0, 0.5)})
    assert (weighted.mean, weighted.q) == pytest.approx((2.4, 7.2))
    assert weighted.p == pytest.approx(math.erfc(math.sqrt(3.6)))  # with one


def test_outliers_are_named_and_trials_that_tell_nothing_left_out() -> None:
    values = {name: (1.0 + 0.01 * place, 0.1) for place, name in enumerate("abcde")}
    found = trial_consistency({**values, "odd": (2.0, 0.1), "silent": (7.0, math.inf)})
    assert found.outliers == ("odd",) and found.p < 1e-6
    assert trial_consistency(values).outliers == () and trial_consistency(values).p > 0.9
    assert trial_consistency({"alone": (1.0, 0.1)}).p == 1.0
    with pytest.raises(ValueError, match="no trial"):
        trial_consistency({"silent": (7.0, math.inf)})


def test_trials_that_got_worse_are_named() -> None:
    measured = {"motion.x": np.zeros(100)}

    def trial(name: str, before: float, after: float) -> Passed:
        columns = [{"motion.x": np.full(100, size)} for size in (before, after)]
        return Passed(name, False, np.arange(100.0), {"motion.x": 1.0}, measured, *columns)

    passed = [trial("better", 5, 1), trial("same", 1.0, 1.02), trial("worse", 1.0, 1.2), trial("far", 9.0, 9.3)]
    assert worse_trials([*passed, trial("lost", 1.0, np.nan)]) == ("worse", "lost")
    assert worse_trials(passed, tolerance=0.01) == ("same", "worse", "far")


@pytest.mark.parametrize(
    ("sizes", "closed"),
    [
        ([(90, 1), (80, 2)], True),
        ([(90, 89), (80, 81)], False),  # nothing is any nearer
        ([(1.1, 1.15), (1.0, 1.0)], True),  # all of it is noise
        ([(2.0, 2.0), (1.5, 1.5)], False),
        ([(1.66, 1.66)], False),
        ([(2.56, 3.7)], False),
        ([(2.56, 1.4)], True),
        ([(700, 2000), (10, 8), (10, 8)], False),  # most are closer, and all together further away
        ([(90, 89), (90, 10), (90, 10)], True),  # one trial has something more
        ([(90, 10), (90, 89), (90, 91)], False),
        ([(math.inf, 5), (math.inf, 4)], True),  # a simulation that ran away is caught
        ([(math.inf, math.inf), (90, 30), (80, 30)], True),
        ([(90, math.inf), (80, math.inf)], False),
        ([(90, 10), (90, 90), (80, 80), (70, 70)], True),  # it acts in one trial alone
        ([(90, 90), (80, 80)], False),
        ([(200, 1.2), (15, 1.1), (0.9, 1.4), (0.9, 1.3), (0.9, 11)], True),  # near the noise neither is nearer
        ([(200, 1.2), (0.9, 9), (0.9, 11)], False),
    ],
)
def test_a_name_that_brings_no_simulation_nearer_closes_nothing(sizes, closed: bool) -> None:
    measured = {"motion.x": np.zeros(50), "motion.psi": np.full(50, np.nan)}  # of which one was not measured
    passed = [
        Passed(
            str(number),
            False,
            np.arange(50.0),
            {"motion.x": 1.0, "motion.psi": 1.0},
            measured,
            *({"motion.x": np.full(50, float(size)), "motion.psi": np.zeros(50)} for size in pair),
        )
        for number, pair in enumerate(sizes)
    ]
    assert closes_gap(passed) == closed


@pytest.mark.slow
def test_a_linear_change_is_found_by_the_black_box_and_counts_no_more_terms_than_asked() -> None:
    truth = {**made_up_ship.TRUTH, "Nr": 1.2 * made_up_ship.TRUTH["Nr"]}
    trials = [
        made_up_ship.trial(rudder, name=name, truth=truth, duration=200.0, seed=seed)
        for seed, (name, rudder) in enumerate({"z": made_up_ship.zigzag(10.0), "t": made_up_ship.turn(10.0)}.items())
    ]
    card = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    measured = Measured(tuple(trials), "angle", ())
    box = black_box(card, measured, NOISE, 1)
    assert set(box.values) == {"Nr"}
    assert box.values["Nr"] == pytest.approx(0.2 * made_up_ship.TRUTH["Nr"], rel=0.05)
    assert box.card.derivatives["Nr"] == pytest.approx(truth["Nr"], rel=0.01)
    assert len(black_box(card, measured, NOISE, 3).values) == 3
    assert black_box(card, measured, NOISE, 0).card is card
