"""The arithmetic of influence coefficients, against closed forms and against the tables of Poznyakov and Yudin."""

from __future__ import annotations

import math

import pytest

from tank2sim.analysis.influence.percent import changed_together, combined_percent, difference_percent

K = {
    **{"Cyb": 1.85, "Cyw": -1.73, "Cybb": 0.0, "Cyd": -0.8, "Cybw": 0.85, "Cyww": 0.0},
    **{"Cmb": -5.8, "Cmw": 7.1, "Cmww": 0.85, "Cmd": -3.63, "Cmbbw": 1.8, "Cmbww": 0.3},
}
"""Table 3 as printed: change of the radius, %, for 10 % of each coefficient."""

KC = {
    **{"Cyb": 0.62, "Cyw": -2.153, "Cybb": 20.1529, "Cyd": -0.401, "Cybw": 0.8781, "Cyww": 4.8633},
    **{"Cmb": 1.6676, "Cmw": 1.356, "Cmww": 5.1959, "Cmd": -0.551, "Cmbbw": -0.737, "Cmbww": 0.4026},
}
"""Table 4: change of each coefficient, %, with 1 % of draught."""


def test_ten_per_cent_of_a_power_law_changes_it_by_the_power_of_1_1() -> None:
    found = difference_percent(lambda c: c["a"] ** 2 / c["b"] + 0 * c["idle"], {"a": 3.0, "b": 0.5, "idle": 2.0})
    assert found == pytest.approx({"a": 21.0, "b": 100 * (1 / 1.1 - 1), "idle": 0.0})
    assert math.isnan(difference_percent(lambda c: c["a"] - 3.0, {"a": 3.0})["a"])


def test_the_agreed_variation_gives_404_m_with_the_right_pairing_and_410_6_with_the_slip_of_the_print() -> None:
    assert 399.6 * (1 + combined_percent(K, KC) / 100) == pytest.approx(404.0, abs=0.1)
    slip = K | {"Cybb": 0.85, "Cybw": 0.0}
    assert combined_percent(slip, KC) == pytest.approx(2.75, abs=0.01)
    assert 399.6 * (1 + combined_percent(slip, KC) / 100) == pytest.approx(410.6, abs=0.1)


def test_coefficients_of_an_agreed_variation_move_together_and_the_others_stay() -> None:
    assert changed_together({"a": 2.0, "b": -4.0, "c": 1.0}, {"a": 1.0, "b": -5.0}, 2.0) == pytest.approx(
        {"a": 2.04, "b": -3.6, "c": 1.0}
    )
