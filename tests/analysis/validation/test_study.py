"""Validation by trials: verdicts, U_val, other ships; cards compared by trajectories: differences that are put in."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.analysis.validation.comparison import compare_cards, labels_of
from tank2sim.analysis.validation.standard_trials import member_spread, members, ship_of, standard_trials
from tank2sim.analysis.validation.study import ComparisonOutcome, Validated, made_card, validate_card, verify
from tank2sim.cards import ManoeuvringCard, read_card, revised
from tank2sim.cards.covariance import Covariance, covariance_file
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.records.trials import Trial
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

pytestmark = pytest.mark.slow

NOISE = {"u_mps": 0.02, "v_mps": 0.02, "r_radps": 2e-4, "psi_rad": 1e-3, "x_m": 0.5, "y_m": 0.5}


def trial_of(card, name: str, manoeuvre, seed: int = 0) -> Trial:
    run = simulate(build(card), manoeuvre).trajectory
    times = np.arange(-20.0, run.t[-1], 0.5)
    rng = np.random.default_rng(seed)
    signals = {}
    for signal, deviation in NOISE.items():
        variable = "motion." + signal.rpartition("_")[0]
        values = np.interp(times, run.t, run[variable])
        if signal == "x_m":
            values += np.minimum(times, 0.0) * run["motion.u"][0]
        signals[signal] = values + deviation * rng.standard_normal(len(times))
    signals["delta_rad"] = np.where(times < 0, 0.0, np.interp(times, run.t, run["rudder.angle"]))
    return Trial(Path(f"{name}.csv"), times, signals, noise=NOISE)


def read_once_a_second(trial: Trial, offset: float) -> Trial:
    """The rudder's order in place of its angle, in rows a second apart that begin `offset` after one of the trial.

    The order is the sign of the rudder's motion: it changes where the rudder begins to move.
    """
    times = np.arange(trial.time_s[0] + 1.0 + offset, trial.time_s[-1], 1.0)
    angle, size = trial.signals["delta_rad"], np.max(np.abs(trial.signals["delta_rad"]))
    moves = np.abs(np.diff(angle)) > 1e-4
    order = np.zeros(len(angle))
    for row in range(1, len(angle)):
        order[row] = math.copysign(size, angle[row] - angle[row - 1]) if moves[row - 1] else order[row - 1]
    shown = order[np.searchsorted(trial.time_s, times, side="right") - 1]
    signals = {
        name: np.interp(times, trial.time_s, values) for name, values in trial.signals.items() if name != "delta_rad"
    }
    return replace(trial, time_s=times, signals={**signals, "delta_order_rad": shown})


@pytest.fixture(scope="module")
def trials(mariner_card):
    manoeuvres = {"turn": Turn(math.radians(20)), "zigzag": Zigzag(math.radians(20), math.radians(20))}
    return [trial_of(mariner_card, name, one) for name, one in manoeuvres.items()]


def test_a_trial_of_the_ship_herself_is_validated(mariner_card, trials) -> None:
    found = validate_card(mariner_card, trials, 12)
    assert len(found.figures) == 9
    # 2 % of each coefficient is assumed: that is what u_input is of
    assert all(one.outcome is ComparisonOutcome.VALIDATED for one in found.figures if one.name != "overshoot_2_deg"), [
        (one.name, one.error, one.uncertainty) for one in found.figures
    ]
    for one in found.figures:
        assert one.numerical < 0.05 * one.uncertainty
        assert one.error == pytest.approx(one.simulated - one.measured)
    assert any("lower bound" in notice for notice in found.notices)


def test_a_trial_of_a_ship_with_another_rudder_is_refuted(mariner_card, trials) -> None:
    rudder = 0.6 * mariner_card.derivatives["Nd"]
    found = validate_card(revised(mariner_card, {"Nd": (rudder, 0.02 * rudder)}), trials[:1], 8)
    rows = {one.name: one for one in found.figures}
    assert rows["advance_m"].outcome is ComparisonOutcome.REFUTED and rows["advance_m"].error > 0
    assert "not validated" in found.verdict


def test_without_members_nothing_is_known_of_the_inputs_and_no_figure_is_judged(mariner_card, trials) -> None:
    found = validate_card(mariner_card, trials[1:], 0)
    assert found.figures and all(
        one.outcome is ComparisonOutcome.OPEN and one.uncertainty is None for one in found.figures
    )


@pytest.mark.parametrize("once_a_second", [False, True])
def test_the_errors_of_an_exact_card_are_as_large_as_the_uncertainty_of_the_data(mariner_card, once_a_second) -> None:
    """Where only orders are known, once a second, the ship goes 2 m on average before the row that shows the order."""
    ratios = []
    manoeuvres = {"turn": Turn(math.radians(20)), "zigzag": Zigzag(math.radians(20), math.radians(20))}
    for seed, offset in enumerate((0.1, 0.35, 0.6, 0.85)):
        records = [trial_of(mariner_card, name, manoeuvre, seed) for name, manoeuvre in manoeuvres.items()]
        if once_a_second:
            records = [read_once_a_second(record, offset) for record in records]
        ratios += [figure.error / figure.data for figure in validate_card(mariner_card, records, 0).figures]
    assert len(ratios) == 36
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.5, ratios
    assert np.max(np.abs(ratios)) < 5.0


def test_repeats_enter_the_uncertainty_of_the_data(mariner_card, trials) -> None:
    again = trial_of(mariner_card, "again", Turn(math.radians(20.4)), seed=1)
    alone, repeated, both = (
        {figure.trial: figure for figure in validate_card(mariner_card, those, 0).figures if figure.name == "advance_m"}
        for those in (trials[:1], [again], [trials[0], again])
    )
    between = (alone["turn"].measured - repeated["again"].measured) / math.sqrt(2)  # deviation of one of two runs
    assert both["turn"].data == pytest.approx(math.hypot(alone["turn"].data, between))
    assert abs(between) > alone["turn"].data and both["turn"].inputs is None


def test_the_validation_uncertainty_is_twice_the_root_of_the_squares() -> None:
    one = Validated("t", "turn", "advance_m", 100.0, 108.0, numerical=1.0, inputs=2.0, data=2.0)
    assert one.uncertainty == pytest.approx(6.0) and one.outcome is ComparisonOutcome.REFUTED
    assert replace(one, simulated=105.0).outcome is ComparisonOutcome.VALIDATED
    assert replace(one, simulated=105.0, required_percent=5.0).outcome is ComparisonOutcome.UNCERTAIN
    assert replace(one, inputs=None).outcome is ComparisonOutcome.OPEN
    assert replace(one, simulated=None).outcome is ComparisonOutcome.REFUTED
    assert replace(one, simulated=105.0, made_card=True).outcome is ComparisonOutcome.FITTED
    assert replace(one, made_card=True).outcome is ComparisonOutcome.REFUTED


def test_the_step_hardly_matters_and_a_coarse_one_does(mariner_card) -> None:
    ship = ship_of(mariner_card)
    fine, *_ = verify(ship, 0)
    coarse_model = replace(ship.model, step_s=20 * ship.model.step_s)
    coarse, *_ = verify(replace(ship, model=coarse_model, integrator=type(ship.integrator)(coarse_model)), 0)
    own, rough = ({(one.trial, one.name): one for one in rows} for rows in (fine, coarse))
    key = ("zigzag 20/20", "overshoot_1_deg")
    assert own[key].U_num < 1e-3 < rough[key].U_num
    assert own[key].deviation is None


def test_without_a_trial_nothing_is_validated(mariner_card) -> None:
    assert validate_card(mariner_card, []).verdict.startswith("not validated")


def test_trials_that_made_a_card_are_known_by_its_source(mariner_card, trials) -> None:
    how = "PMM tests of a turn; identified by tank2sim (output_error, cross_flow) from zigzag, Z_35_05"
    own = replace(mariner_card, ship=mariner_card.ship.model_copy(update={"source": how}))
    assert made_card(own, "zigzag") and made_card(own, "Z_35_05")
    assert not any(made_card(own, name) for name in ("turn", "zig", "Z_35", "35_05", "Z_35_05_b"))
    found = validate_card(own, trials, 0)
    assert ComparisonOutcome.VALIDATED not in {one.outcome for one in found.figures if one.trial == "zigzag"}
    assert all(not one.made_card for one in found.figures if one.trial == "turn")
    assert any("zigzag: the card was identified from this trial" in notice for notice in found.notices)


@pytest.fixture(scope="module")
def esso() -> ManoeuvringCard:
    card = read_card("esso-osaka-estimated", {"environment.gravity_mps2": 9.80665}).manoeuvring()
    return replace(card, effects=())


@pytest.fixture(scope="module")
def scaled(esso) -> ManoeuvringCard:
    """The same ship 100 times as long, by Froude's law."""
    assert esso.propulsion is not None and esso.ship.draught_m is not None
    sizes = {"length_m": 300.0, "beam_m": 48.9, "draught_m": 100 * esso.ship.draught_m, "propeller_diameter_m": 8.4}
    model = esso.model.model_copy(update={"speed_mps": 3.2, "valid_speed_mps": (1.5, 5.5)})
    propulsion = esso.propulsion.model_copy(update={"nominal_radps": esso.propulsion.nominal_radps / 10})
    return replace(esso, ship=esso.ship.model_copy(update=sizes), model=model, propulsion=propulsion)


@pytest.fixture(scope="module")
def found(esso, scaled):
    return compare_cards([esso, scaled], 6)


def test_a_model_and_her_ship_make_the_same_tracks_at_one_size(found) -> None:
    assert [trial.name for trial in found.trials][-1] == "full astern stop"
    for trial in found.trials:
        for name, row in trial.figures.items():
            assert row.values[1] == pytest.approx(row.values[0], rel=2e-5, abs=1e-5), (trial.name, name)
        one, two = trial.tracks
        assert two.x_m[-1] == pytest.approx(one.x_m[-1], rel=2e-4, abs=1e-3)
        assert two.t_s[-1] == pytest.approx(one.t_s[-1], rel=2e-4)


def test_members_are_the_same_ships_at_both_sizes_and_again(found, esso) -> None:
    first, second = found.trials[0].figures["advance_m"].standard_deviations
    assert first and second == pytest.approx(first, rel=1e-3)
    ship = ship_of(esso)
    assert members(esso, ship.model, 3)[0] == members(esso, ship.model, 5)[0][:3]


def test_members_vary_together_as_the_covariance_next_to_the_card_says(mariner_card, tmp_path) -> None:
    errors = {"Yv": (-1160e-5, 2e-4), "Nv": (-264e-5, 1e-4)}
    card = revised(mariner_card, errors)
    _, alone = members(card, build(card), 1)
    assert "independent" in alone[0]
    path = tmp_path / "ship.toml"
    matrix = np.array([[4e-8, 2e-8], [2e-8, 1e-8]])  # correlation 1
    covariance_file(path).write_text(Covariance(("derivatives.Yv", "derivatives.Nv"), matrix).as_text())
    path.write_text(f"# covariance: {covariance_file(path).name}\n{card.text}")
    together = read_card(str(path))
    drawn, reported = members(together, build(together), 5)
    for member in drawn:
        assert member["derivatives.Yv"] + 1160e-5 == pytest.approx(2 * (member["derivatives.Nv"] + 264e-5), rel=1e-6)
    assert "go together" in reported[0]


def test_the_summary_counts_what_is_beyond_two_errors(found, esso) -> None:
    # One card at two sizes has no second number that could agree or differ.
    (summary,) = found.summary
    assert summary.compared == 0 and summary.beyond_two_standard_errors == 0 and summary.rms_standard_errors is None
    assert summary.same_number > 20


def test_a_stronger_rudder_turns_in_less_room(esso) -> None:
    stronger = {**esso.derivatives, "Nd": 1.3 * esso.derivatives["Nd"]}
    found = compare_cards([esso, replace(esso, derivatives=stronger)], 0)
    diameter = found.trials[0].figures["tactical_diameter_m"]
    assert diameter.differences[0] < 0 and diameter.differences_standard_errors == (None,)
    (rudder,) = [row.differences[0] for row in found.coefficients if row.name == "Nd"]
    assert rudder.standard_errors == pytest.approx(0.3 * 0.0015 / (math.sqrt(2) * 0.0006))


def test_more_members_take_no_more_memory(mariner_card) -> None:
    """A motion of some thousand rows is 1 MB: of each member the figures alone may stay."""

    def peak(count: int) -> int:
        tracemalloc.start()
        compare_cards([mariner_card, mariner_card], count)
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return taken

    peak(1)  # what is computed once and kept
    assert peak(12) < peak(2) + 2e6


def test_one_card_alone_is_refused(esso) -> None:
    with pytest.raises(InputError, match="two cards"):
        compare_cards([esso])


def test_the_spread_is_that_of_normal_figures_and_needs_nearly_all_members() -> None:
    values = 10 + 2 * np.random.default_rng(1).standard_normal(4000)
    runs = [{"a_m": float(value)} for value in values]
    assert member_spread(runs)["a_m"] == pytest.approx(2.0, rel=0.05)
    assert member_spread([*runs[:8], {}, {}]) == {}
    assert math.isclose(member_spread([*runs[:9], {}])["a_m"], member_spread(runs[:9])["a_m"])


def test_turns_keep_to_what_every_gear_allows(mariner_card, esso) -> None:
    gear = mariner_card.steering_gear.model_copy(update={"max_angle_rad": math.radians(30)})
    ships = [ship_of(esso), ship_of(replace(mariner_card, steering_gear=gear))]
    trials = standard_trials(ships)
    assert "turn 30 deg to port" in trials and "full astern stop" not in trials


def test_other_ships_and_other_sizes_are_reported(esso, found, mariner_card) -> None:
    assert any("of another size than" in one for one in found.notices)
    two = compare_cards([mariner_card, read_card("kvlcc2-captive")], 0)
    assert any("another form" in one and "breadth" in one for one in two.notices)
    same = compare_cards([mariner_card, mariner_card], 0)
    assert not any("another" in one for one in same.notices)


def test_a_card_is_called_by_its_folder_also_from_within_it(tmp_path, monkeypatch) -> None:
    card = read_card("mariner").manoeuvring()
    (tmp_path / "trawler").mkdir()
    monkeypatch.chdir(tmp_path / "trawler")
    own = [replace(card, source=source) for source in ("ship.toml", "../other.toml", "./ship.toml")]
    assert labels_of([card, *own]) == ("mariner", "trawler (2)", "other", "trawler (4)")
