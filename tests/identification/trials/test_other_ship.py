"""Trials of another ship than the card's: refused; no alarm on measured ships and ships with unknown effects."""

from pathlib import Path

import pytest

from tank2sim.cards import read_card
from tank2sim.identification.trials.assessment.other_ship import other_ship
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tests.identification.trials.made_up_ship import TRUTH, problem, trial, turn, zigzag


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_rudder_moment_far_off_the_cards_is_reported_by_its_trial(factor):
    other = {**TRUTH, "Nd": factor * TRUTH["Nd"]}
    runs = [trial(zigzag(20), name="own"), trial(zigzag(15), name="other", truth=other)]
    (reported,) = (one for one in other_ship(problem(runs)) if one.startswith("other"))
    assert float(reported.split()[2]) == pytest.approx(factor, rel=0.5)
    assert not any(one.startswith("own") for one in other_ship(problem(runs)))


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
def test_a_mariner_is_no_tanker(data: Path) -> None:
    trials = measured(
        [data / f"data/gap_cases/case_1/zigzag{angle}.csv" for angle in ("20_20", "10_10")], read_card("kvlcc2-captive")
    )
    for name in ("card", "cross_flow"):
        assert other_ship(
            problem_from_card(STRUCTURES[name].start(read_card("kvlcc2-captive")), trials.trials, trials.driven_by)
        )
