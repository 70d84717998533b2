"""Ensembles of a craft with thrusters."""

from dataclasses import replace

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards.covariance import Covariance


@pytest.fixture(scope="module")
def otter():
    """An Otter whose numbers have stated errors of 3 to 5 %."""
    errors = {"uncertainty.Nr": 1.5, "uncertainty.Nrabsr": 2.0, "uncertainty.Xu": 4.0}
    return t2s.load("otter").replace(errors | {"thrusters.0.uncertainty.ahead_Ns2": 3e-4})


def test_bands_of_a_turn_agree_with_the_errors_by_exact_slopes(otter) -> None:
    """Two ways from the same card: drawn craft that are simulated, and slopes of the motion by each number."""
    figure = "steady_rate_degps@difference:200"
    expected = otter.influence([figure]).study.figures[figure].standard_error
    band = otter.simulate("difference:200", members=100).study.ensemble.figures["steady_rate_degps"]
    assert band.standard_deviation == pytest.approx(expected, rel=0.2)


def test_bands_over_time_are_of_revolutions_and_not_of_a_rudder(otter) -> None:
    histories = otter.simulate("spin:300", members=4).study.ensemble.histories
    assert {"n_port_rpm", "n_starboard_rpm"} < set(histories) and "delta_deg" not in histories
    assert histories["n_port_rpm"].p50[-1] == pytest.approx(300, rel=0.01)


def test_a_craft_without_a_mass_matrix_is_not_used(otter) -> None:
    """Drawn added masses of the size of the whole inertia, some of which make it negative."""
    heavy = otter.replace({"uncertainty.Nrdot": 60.0})
    ensemble = heavy.simulate("difference:200", members=30).study.ensemble
    assert 0 < ensemble.usable < 30
    assert any("positive" in why for why in ensemble.unusable)


def test_errors_of_thrust_and_drag_that_go_together_cancel_in_the_speed(tmp_path) -> None:
    """More thrust by 5 % with more drag by as much leaves the speed; with less drag both add up."""
    errors = {f"thrusters.{number}.uncertainty.ahead_Ns2": 0.05 * 0.01108 for number in (0, 1)}
    card = t2s.load("otter").replace({"uncertainty.Xu": 0.05 * 77.55, **errors}).card
    names = ("derivatives.Xu", "thrusters.0.ahead_Ns2", "thrusters.1.ahead_Ns2")
    spread = {}
    for drag in (-1.0, 1.0):  # Xu is negative
        sizes = np.array([drag * 0.05 * 77.55, *errors.values()])
        replace(card, covariance=Covariance(names, np.outer(sizes, sizes))).save(tmp_path / "otter.toml")
        figures = t2s.load(tmp_path / "otter.toml").simulate("straight:600", members=30).study.ensemble.figures
        spread[drag] = figures["final_speed_mps"].standard_deviation
    assert spread[-1.0] < 0.3 * spread[1.0]


def test_a_covariance_that_does_not_agree_with_a_thruster_is_refused(tmp_path) -> None:
    card = t2s.load("otter").replace({"thrusters.0.uncertainty.ahead_Ns2": 3e-4}).card
    covariance = Covariance(("thrusters.0.ahead_Ns2",), np.array([[1e-6]]))
    replace(card, covariance=covariance).save(tmp_path / "otter.toml")
    with pytest.raises(t2s.InputError) as raised:
        t2s.load(tmp_path / "otter.toml").simulate("straight:600", members=3)
    assert raised.value.place == "thrusters.0.uncertainty.ahead_Ns2"
