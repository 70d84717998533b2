"""Trials of another ship than the card's: refused; no alarm on measured ships and ships with unknown effects."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.cards import read_card
from tank2sim.identification.trials.assessment.other_ship import (
    RudderEffect,
    _beyond,
    _mean,
    far_from_card,
    other_ship,
)
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.records.trials import Trial
from tests.identification.trials.made_up_ship import TRUTH, problem, trial, turn, zigzag


def of_other_size(run: Trial, size: float) -> Trial:
    """The same motion by a ship `size` times as long at the same speed, which takes as much longer for it."""
    scale = {"r_radps": 1 / size, "x_m": size, "y_m": size}
    signals = {name: scale.get(name, 1.0) * values for name, values in run.signals.items()}
    return replace(run, time_s=size * run.time_s, signals=signals)


@pytest.mark.parametrize(("size", "words"), [(0.5, "more than"), (2.0, "less than")])
def test_a_ship_of_half_or_twice_the_length_is_reported_by_its_trial(size: float, words: str) -> None:
    runs = [trial(zigzag(20), name="own"), of_other_size(trial(zigzag(15), name="other"), size)]
    reported = other_ship(problem(runs))
    (alone,) = (one for one in reported if one.startswith("by other "))
    assert words in alone
    assert not any(one.startswith("by own ") for one in reported)


def test_a_rudder_of_the_other_sign_is_told_from_another_ship() -> None:
    other = {**TRUTH, "Yd": -TRUTH["Yd"], "Nd": -TRUTH["Nd"]}
    runs = [trial(zigzag(20), name="a", truth=other), trial(zigzag(10), name="b", truth=other)]
    assert any("rudder_sign" in one for one in other_ship(problem(runs)))


def test_wide_errors_of_a_card_do_not_widen_the_test() -> None:
    known = problem([of_other_size(trial(zigzag(20), name="other"), 0.5)])
    wide = replace(known, prior_error=100 * known.prior_error)
    assert other_ship(wide) == other_ship(known) != ()


def test_an_estimate_whose_coefficients_are_several_times_their_size_away_is_no_result() -> None:
    known = problem([trial(zigzag(20), name="own")])
    known = replace(known, prior_error=0.05 * np.abs(known.prior_mean))
    found = equation_error(known)
    assert far_from_card(known, replace(found, prior_scale={"Y": 10.0, "N": 10.0})) == ()  # half their size
    (far,) = far_from_card(known, replace(found, prior_scale={"Y": 10.0, "N": 80.0}))
    assert "yaw" in far and "sway" not in far
    place = known.free.index("derivatives.Nd")
    values = found.values.copy()
    values[place] *= 0.2
    (far,) = far_from_card(known, replace(found, values=values, prior_scale={}))
    assert far.startswith("Nd is 0.2")


@pytest.mark.parametrize("rudder_deg", [35, -35])
def test_one_turn_of_few_readings_raises_no_alarm(rudder_deg: int) -> None:
    """The rudder is at its angle in all windows: yaw rate and mean explain it."""
    assert other_ship(problem([trial(turn(rudder_deg, begin_s=0.0), step=5.0, duration=200.0)])) == ()


@pytest.mark.parametrize("off", [0.0, 0.3])
def test_the_cards_own_ship_and_a_run_without_rudder_raise_no_alarm(off):
    runs = [trial(zigzag(10), name="a"), trial(turn(30), name="b"), trial(lambda t: 0.0, name="straight")]
    assert other_ship(problem(runs, off=off)) == ()


@pytest.mark.parametrize(
    "every", [pytest.param(1, marks=pytest.mark.long), pytest.param(5, marks=pytest.mark.slow)], ids=["all", "some"]
)
def test_measured_ships_and_ships_with_an_unknown_effect_raise_no_alarm(data: Path, every: int) -> None:
    folder = data / "data"
    kvlcc2, esso = read_card("kvlcc2-captive"), read_card("esso-osaka-estimated")
    asked = [(kvlcc2, sorted((folder / basin).glob("*.dat"))) for basin in ("kvlcc2_hsva", "kvlcc2_marin")]
    asked += [(esso, sorted(folder.glob(f"esso_osaka/{kind}/*.csv"))) for kind in ("zigzag", "turning", "random")]
    cases = [path for path in sorted((folder / "gap_cases").glob("case_*")) if path.is_dir()]
    asked += [(read_card(str(case / "ship.toml")), sorted(case.glob("*.csv"))) for case in cases]
    for card, files in asked[::every]:
        trials = measured(files, card)
        assert other_ship(problem_from_card(card, trials.trials, trials.driven_by)) == (), files[0].parent


@pytest.mark.slow
@pytest.mark.parametrize("tanker", ["kvlcc2", "kvlcc2-captive", "kvlcc2-mmg"])
def test_a_mariner_is_no_tanker_by_whatever_equations(data: Path, tanker: str) -> None:
    card = read_card(tanker)
    trials = measured([data / f"data/gap_cases/case_1/zigzag{angle}.csv" for angle in ("20_20", "10_10")], card)
    assert other_ship(problem_from_card(card, trials.trials, trials.driven_by))


@pytest.mark.slow
def test_a_mariner_is_no_tanker_in_any_structure(data: Path) -> None:
    trials = measured(
        [data / f"data/gap_cases/case_1/zigzag{angle}.csv" for angle in ("20_20", "10_10")], read_card("kvlcc2-captive")
    )
    for name in ("card", "cross_flow"):
        assert other_ship(
            problem_from_card(STRUCTURES[name].start(read_card("kvlcc2-captive")), trials.trials, trials.driven_by)
        )


def effect(measured: float, error: float = 0.0, modelled: float = 1.0, its_error: float = 0.0) -> RudderEffect:
    return RudderEffect(measured, modelled, np.diag([error, its_error]) ** 2)


@pytest.mark.parametrize(
    ("measured", "error", "words"),
    [
        (2.4, 0.0, ""),  # less 2 is 0.4, and errors of 10 % of the larger coefficient are 0.24
        (2.6, 0.0, "more than 2 times"),
        (2.6, 0.2, ""),
        (0.45, 0.0, ""),  # less 1/2 is -0.05, its error 0.05
        (0.38, 0.0, "less than 0.5 times"),
        (0.38, 0.06, ""),
        (0.02, 0.03, "less than 0.5 times"),
        (-0.05, 0.03, "less than 0.5 times"),  # by chance of the other sign
        (-0.5, 0.03, "to the other side"),
        (-3.0, 0.03, "to the other side"),
    ],
)
def test_a_rudder_is_another_ships_by_its_size_beyond_two_errors_of_both(measured, error, words) -> None:
    """Of a card's 1: the difference to twice and half of it, over the errors of scatter and of any model, 10 %."""
    found = _beyond("a", [effect(measured, error)], 2.0)
    assert (words in found) if words else found == ""


def test_a_card_whose_rudder_turns_to_the_other_side_is_compared_by_size_too() -> None:
    assert effect(-2.0, 0.0, -1.0).less(2.0) == (0.0, pytest.approx(0.2))
    assert effect(-1.0, 0.0, -1.0).less(0.5) == (0.5, pytest.approx(0.1))
    assert _beyond("a", [effect(-1.0, 0.03, -1.0)], 2.0) == ""
    assert "more than" in _beyond("a", [effect(5.0, 0.03, -0.3)], 2.0)
    assert "to the other side" in _beyond("a", [effect(-1.0, 0.03, 1.0)], 2.0)
    assert effect(3.0, 0.3, 1.0, 0.2).less(2.0) == (1.0, pytest.approx(np.hypot(np.hypot(0.3, 0.4), 0.3)))


@pytest.mark.parametrize(("error", "determined"), [(0.24, True), (0.26, False)])
@pytest.mark.parametrize("modelled", [1.0, -1.0])
def test_a_trial_shows_the_rudder_where_the_cards_own_part_is_known_to_a_quarter(error, determined, modelled) -> None:
    assert effect(1.0, 0.0, modelled, error).determined == determined


def test_means_of_trials_have_the_errors_of_their_scatter_if_that_is_larger() -> None:
    assert _mean([(1.0, 0.1), (2.0, 0.1)]) == (pytest.approx(1.5), pytest.approx(0.5))  # Birge: as they differ
    assert _mean([(1.0, 0.5), (1.1, 0.5)]) == (pytest.approx(1.05), pytest.approx(0.5 / np.sqrt(2)))
    assert _mean([(1.0, 0.1), (2.0, 0.2)])[0] == pytest.approx(1.2)
    assert _mean([(1.0, 0.1)]) == (1.0, pytest.approx(0.1))


@pytest.mark.parametrize(("ratio", "far"), [(2.6, False), (2.8, True), (0.3, False), (0.2, True), (-0.5, True)])
def test_an_estimate_is_far_from_a_card_whose_rudder_is_two_and_a_half_times_as_strong_by_two_errors(
    ratio, far
) -> None:
    """Errors of 8 % of the card's moment: 0.16 either way of 2.5 and 0.4."""
    known = problem([trial(zigzag(20), name="own")])
    place, sizes = known.free.index("derivatives.Nd"), np.abs(known.prior_mean)
    known = replace(known, prior_error=0.05 * sizes)
    values = known.prior_mean.copy()
    values[place] *= ratio
    found = SimpleNamespace(prior_scale={"Y": 1.0, "N": 1.0}, values=values, standard_errors=0.08 * sizes)
    assert bool(far_from_card(known, found)) == far


def test_where_the_cards_own_part_does_not_show_its_derivative_takes_its_place() -> None:
    at_rest = RudderEffect(3.0, 0.2, np.array([[0.04, 0.01], [0.01, 0.09]])).of_card_at_rest
    assert (at_rest.measured, at_rest.modelled) == (3.0, 1.0)
    np.testing.assert_array_equal(at_rest.covariance, [[0.04, 0.0], [0.0, 0.0]])


@pytest.mark.parametrize(("times", "far"), [(19.0, False), (21.0, True)])
@pytest.mark.parametrize("letter", ["Y", "N"])
def test_an_estimate_is_far_from_a_card_at_a_difference_of_twice_its_coefficients(letter, times, far) -> None:
    """Errors of 10 % of its coefficients, widened by so many times, next to errors of 1 % of the other equation."""
    known = problem([trial(zigzag(20), name="own")])
    shares = [0.1 if name.startswith(f"derivatives.{letter}") else 0.01 for name in known.free]
    known = replace(known, prior_error=np.array(shares) * np.abs(known.prior_mean))
    other = {"Y": "N", "N": "Y"}[letter]
    found = SimpleNamespace(prior_scale={letter: times, other: 1.0}, values=known.prior_mean, standard_errors=shares)
    assert bool(far_from_card(known, found)) == far


def test_readings_without_noise_raise_neither_alarm_nor_fault(tmp_path) -> None:
    ship, card = t2s.load("kvlcc2"), read_card("kvlcc2")
    for name, run in (("zigzag", ship.zigzag(20, 20)), ("other", ship.zigzag(10, 10)), ("turn", ship.turn(25))):
        run.to_csv(tmp_path / f"{name}.csv")
        table = pd.read_csv(tmp_path / f"{name}.csv", comment="#")
        table.iloc[::5].to_csv(tmp_path / f"{name}.csv", index=False)
    given = measured(sorted(tmp_path.glob("*.csv")), card)
    assert not other_ship(problem_from_card(card, given.trials, given.driven_by))
