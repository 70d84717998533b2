"""Cards of craft compared: by coefficients in SI, and by what thrusters can do."""

from __future__ import annotations

import pytest

import tank2sim as t2s
from tank2sim.errors import InputError


@pytest.fixture(scope="module")
def otter() -> t2s.Ship:
    return t2s.load("otter")


def test_what_differs_is_found_in_si_and_in_the_figures(otter) -> None:
    changed = otter.replace({"derivatives.Xu": 1.1 * otter.card.derivatives["Xu"]})
    found = t2s.compare([otter, changed], members=0)
    apart = found.coefficients.query("difference_percent != 0").set_index("coefficient")
    assert list(apart.index) == ["Xu"]
    assert apart.loc["Xu", "reference"] == pytest.approx(otter.card.derivatives["Xu"])
    assert apart.loc["Xu", "difference_percent"] == pytest.approx(-10)
    speeds = found.figures.query("figure == 'final_speed_mps'")["value"].to_list()
    assert speeds[0] / speeds[1] == pytest.approx(1.1, rel=1e-3)  # the otter's surge is linear
    turns = found.figures.query("figure == 'steady_rate_degps'")["value"].to_list()
    assert turns[0] > 0 > turns[2] and turns[0] == pytest.approx(-turns[2])


def test_thrust_is_compared_and_the_place_of_a_thruster_does_not_agree_by_chance(otter) -> None:
    found = t2s.compare([otter, otter.replace({"thrusters.0.ahead_Ns2": 0.0133})], members=0)
    rows = found.coefficients.set_index("coefficient")
    assert rows.loc["thrusters.port.ahead", "difference_percent"] == pytest.approx(20, rel=0.01)
    assert rows["standard_errors"].isna()["thrusters.port.y"]
    assert found.summary["compared"].to_list() == [1]


@pytest.mark.slow
def test_errors_of_the_card_give_deviations(otter) -> None:
    found = t2s.compare([otter, otter], members=6)
    speed = found.figures.query("figure == 'final_speed_mps'").iloc[0]
    # 2 % of Xu and of both thrust curves: sqrt(2^2 + 1 + 1) % at most, and six members
    assert 0.005 < speed["standard_deviation"] / speed["value"] < 0.06


def test_a_ship_and_a_craft_of_another_size_are_refused(otter) -> None:
    with pytest.raises(InputError, match="rudder"):
        t2s.compare([otter, "mariner"], members=0)
    with pytest.raises(InputError, match=r"ship\.length_m"):
        t2s.compare([otter, otter.replace({"ship.length_m": 2.5})], members=0)
