"""Cards by trajectories: Froude's law, differences that are put in, and ensembles that can be repeated."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.validation.comparison import compare_cards, labels_of
from tank2sim.analysis.validation.standard_trials import member_spread, members, ship_of, standard_trials
from tank2sim.cards import ManoeuvringCard, read_card, revised
from tank2sim.cards.covariance import Covariance, covariance_file
from tank2sim.dynamics import build
from tank2sim.errors import InputError

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def esso() -> ManoeuvringCard:
    card = read_card("esso-osaka-estimated", {"environment.gravity_mps2": 9.80665})
    assert isinstance(card, ManoeuvringCard)
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
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    (tmp_path / "trawler").mkdir()
    monkeypatch.chdir(tmp_path / "trawler")
    own = [replace(card, source=source) for source in ("ship.toml", "../other.toml", "./ship.toml")]
    assert labels_of([card, *own]) == ("mariner", "trawler (2)", "other", "trawler (4)")
