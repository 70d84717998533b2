"""What trials can tell: against closed forms, and against runs that move nothing."""

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.identifiability import (
    identifiability,
    refuse_unseen,
    share_from_trials,
)
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.problem.estimation_problem import Estimate
from tests.identification.trials.made_up_ship import NOISE, TRUTH, problem, trial, turn, zigzag

YAW = ("Nv", "Nr", "Nd")


def answer(asked, information, scale=1.0):
    k = len(asked.free)
    scale = dict.fromkeys(asked.groups, scale)
    return Estimate("made_up", asked.free, np.zeros(k), np.eye(k), np.asarray(information), prior_scale=scale)


@pytest.fixture(scope="module")
def asked():
    return problem([trial(zigzag(20), duration=60.0)], free=YAW)


def test_information_in_units_of_the_prior(asked):
    unit = 2 * asked.prior_error
    found = answer(asked, np.diag([100.0, 9.0, 1.0]) / unit**2, scale=2.0)
    known = identifiability(asked, found)
    np.testing.assert_allclose(known.singular_values, [10, 3, 1])
    assert known.condition == pytest.approx(10)
    np.testing.assert_allclose(share_from_trials(asked, found), [100 / 101, 9 / 10, 1 / 2])
    assert known.correlated_pairs == known.unseen == known.notices == ()


def test_two_that_drift_are_reported_by_name(asked):
    rho = 0.98
    covariance = np.eye(3)
    covariance[0, 1] = covariance[1, 0] = -rho
    known = identifiability(asked, answer(asked, 1e4 * np.linalg.inv(covariance) / np.outer(*2 * [asked.prior_error])))
    ((one, other, value),) = known.correlated_pairs
    assert (one, other) == ("Nv", "Nr")
    assert value == pytest.approx(-rho, abs=1e-4)
    assert "Nv and Nr" in known.notices[0] and "drift" in known.notices[0]


def test_an_unseen_sum_is_reported_as_one_and_an_unseen_term_alone(asked):
    difference = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    information = 1e4 * np.outer(difference, difference)
    found = answer(asked, information / np.outer(asked.prior_error, asked.prior_error))
    known = identifiability(asked, found)
    assert {frozenset(direction) for direction in known.unseen} == {frozenset({"Nv", "Nr"}), frozenset({"Nd"})}
    np.testing.assert_allclose(share_from_trials(asked, found), [0.5, 0.5, 0.0], atol=1e-3)
    assert any("nothing of Nd" in notice for notice in known.notices)
    assert any("Nv and Nr" in notice or "Nr and Nv" in notice for notice in known.notices)


def test_a_zigzag_shows_the_yaw_terms_and_their_drift():
    asked = problem([trial(zigzag(15), duration=300.0)], free=("Yv", "Yr", "Yd", *YAW))
    found = equation_error(asked)
    known = identifiability(asked, found)
    assert share_from_trials(asked, found).min() > 0.9
    correlation = known.correlation[known.parameters.index("Nv"), known.parameters.index("Nr")]
    assert abs(correlation) > 0.8


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_straight_run_is_refused_for_all_that_turns(noise):
    straight = problem([trial(lambda t: 0.0, noise=noise, name="straight")], free=YAW)
    with pytest.raises(
        InputError, match=r"straight.csv: shows nothing of Nv, Nr, Nd; add a run in which sway, yaw and rudder"
    ):
        refuse_unseen(straight)


def test_a_constant_rudder_is_refused_for_the_rudder():
    steady = trial(lambda t: np.deg2rad(10.0), duration=700.0)
    late = {name: values[2000:] for name, values in steady.signals.items()}
    asked = problem([type(steady)(steady.path, steady.time_s[2000:], late)], free=("Nd",))
    with pytest.raises(InputError, match="nothing of Nd; add a run in which rudder change"):
        refuse_unseen(asked)


def test_a_zigzag_and_a_turn_are_not_refused():
    refuse_unseen(problem([trial(zigzag(10)), trial(turn(30))]))


def test_a_zigzag_so_small_that_the_noise_hides_it_is_refused():
    small = problem([trial(zigzag(0.02), noise=3.0)], free=YAW)
    assert NOISE["r_radps"] > 0
    with pytest.raises(InputError, match="nothing of Nv, Nr, Nd"):
        refuse_unseen(small)


def test_two_steady_turns_to_either_side_show_the_rudder():
    runs = [trial(turn(angle), duration=400.0, name=f"turn {angle}") for angle in (20, -20)]
    refuse_unseen(problem(runs, free=YAW))


def test_without_velocities_a_zigzag_holds_what_it_does_not_show():
    """Surge is hidden in the noise of the positions; sway, yaw and rudder are not, and are not given up for it."""
    asked = problem([trial(zigzag(20))], seen=("motion.r", "motion.psi", "motion.x", "motion.y"))
    assert refuse_unseen(asked) == ("derivatives.Xvv",)
    kept = asked.without(refuse_unseen(asked))
    assert kept.free == tuple(name for name in asked.free if name != "derivatives.Xvv")
    assert kept.parameters(kept.prior_mean)[kept.model.parameter_names.index("derivatives.Xvv")] == TRUTH["Xvv"]
    assert len(kept.prior_mean) == len(kept.prior_error) == len(kept.free)
    assert equation_error(kept).standard_errors.shape == (len(kept.free),)


def test_an_acceleration_term_that_was_asked_for_and_does_not_show_is_refused():
    straight = problem([trial(lambda t: 0.0, name="straight")], free=("Xvv", "Nrdot"))
    with pytest.raises(InputError, match="shows nothing of Nrdot;"):
        refuse_unseen(straight)
