"""Designed trials: within the time, at least as good as the usual set, and less certain with worse sensors."""

from functools import cache

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.design.command import design_trial
from tank2sim.cards import read_card
from tank2sim.errors import InputError
from tank2sim.gap.outcome.next_test import Explanation, SailedShip
from tank2sim.gap.outcome.next_test_candidates import candidate_manoeuvres

FIGURES = "steady_radius_m@20,K_prime"
SENSORS = {"r_degps": 0.05, "psi_deg": 0.2, "u_mps": 0.02, "v_mps": 0.02}


@cache
def trial(minutes=None, factor=1.0):
    sensors = {column: factor * size for column, size in SENSORS.items()}
    return design_trial("mariner", figures=FIGURES, minutes=minutes, sensors=sensors)


@pytest.mark.slow
def test_the_plan_keeps_the_time_and_is_as_good_as_the_usual_set():
    found = trial()
    assert found.design.minutes_used <= found.design.minutes
    assert found.manoeuvres["repeats"] @ found.manoeuvres["total_min"] == pytest.approx(
        found.design.minutes_used, rel=1e-3
    )
    assert (found.figures["design"] <= 1.02 * found.figures["usual"]).all()
    assert (found.figures["usual"] < found.figures["before"]).all()
    assert found.design.usual_minutes == pytest.approx(found.design.minutes)


@pytest.mark.slow
def test_more_time_and_better_sensors_make_figures_more_certain():
    assert (trial(minutes=80.0).figures["design"] < trial().figures["design"]).all()
    ratio = trial(factor=2.0).figures["usual"] / trial().figures["usual"]
    assert ((ratio > 1.2) & (ratio < 2.0001)).all()


@pytest.mark.slow
def test_orders_are_files_that_simulate_takes(tmp_path):
    found = trial()
    assert set(found.orders) == set(found.manoeuvres["orders"])
    for name, row in found.manoeuvres.reset_index().set_index("orders").iterrows():
        (tmp_path / name).write_text(found.orders[name], encoding="utf-8")
        run = t2s.load("mariner").simulate(f"file:{tmp_path / name}")
        assert run.figures["duration_s"] == pytest.approx(row["duration_s"], rel=1e-6)


def test_the_information_of_a_manoeuvre_is_that_of_the_differences_of_its_readings():
    """Without unknown first states it would be J'J; they and the disturbances only take from it."""
    card = read_card("esso-osaka")
    covariance = np.diag([0.1 * card.derivatives["Nr"], 0.1 * card.derivatives["Nd"]]) ** 2
    ship = SailedShip(
        Explanation("card", card, ("derivatives.Nr", "derivatives.Nd"), covariance), {"motion.r": 1e-3}, 0.0
    )
    of = [each for each in candidate_manoeuvres(card, 12.0) if each.manoeuvre in ("turn:35", "zigzag:20/20")]
    orders, information = ship.information(of, 12.0)
    _, motion = ship.sail(of, 12.0)
    slopes = ship.predict(of, orders, motion).slopes
    assert information.shape == (2, 2, 2)
    for place, each in enumerate(information):
        J = slopes[place].reshape(-1, 2)
        assert np.linalg.eigvalsh(each).min() > 0
        assert np.linalg.eigvalsh(J.T @ J - each).min() > -1e-9 * np.trace(J.T @ J)


@pytest.mark.slow
def test_a_ship_that_is_unstable_on_a_straight_course_is_marked():
    """The KVLCC2 is (C' < 0), the Mariner is not."""
    unstable = design_trial("kvlcc2-captive", figures="steady_radius_m@20", sensors=SENSORS)
    assert any("LINEARISED" in notice for notice in unstable.cautions) and unstable.design.unstable
    assert not design_trial("mariner", figures="steady_radius_m@20", minutes=8.0, sensors=SENSORS).design.unstable


@pytest.mark.parametrize(
    ("options", "words"),
    [
        pytest.param({"minutes": 0.01}, "minutes", marks=pytest.mark.slow),
        ({"minutes": -5.0}, "minutes"),
        ({"sensors": {"q_degps": 1.0}}, "q_degps"),
        ({"sensors": {"r_degps": 0.0}}, "r_degps"),
        ({"sensors": {}}, "sensors"),
        ({"figures": "nothing@35"}, "figures"),
    ],
)
def test_a_trial_that_cannot_be_designed_is_refused(options, words):
    with pytest.raises(InputError) as caught:
        design_trial("mariner", **{"figures": FIGURES, **options})
    assert words in str(caught.value)
