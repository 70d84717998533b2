"""Ensembles of a craft with thrusters."""

import pytest

import tank2sim as t2s


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
