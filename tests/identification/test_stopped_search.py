"""A search that is stopped at its start is never called identified, by any estimator."""

from __future__ import annotations

import craft_log
import numpy as np
import pytest
from scipy.optimize import OptimizeResult

import tank2sim as t2s
from tank2sim.apps.rigs import search
from tank2sim.apps.rigs.tow import output_error as tow
from tank2sim.apps.rigs.yaw import output_error as yaw
from tank2sim.errors import InputError
from tank2sim.identification.craft import first_values
from tank2sim.identification.trials.methods import gauss_newton
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.gauss_newton import StoppedSearchError, is_minimum
from tank2sim.identification.trials.methods.kalman import kalman
from tank2sim.identification.trials.methods.output_error import output_error
from tests.apps.rigs.tow.made_tows import tows_of
from tests.craft_trials import written
from tests.identification.trials import made_up_ship, pushed_ship


@pytest.fixture
def stopped(monkeypatch):
    """No step of any search succeeds."""
    monkeypatch.setattr(gauss_newton, "MOST_ATTEMPTS", 0)


@pytest.mark.parametrize("method", [output_error, equation_error], ids=lambda method: method.__name__)
def test_a_stopped_search_of_a_ship_is_refused(stopped, method) -> None:
    problem = made_up_ship.problem([made_up_ship.trial(made_up_ship.zigzag(20), duration=120.0)])
    with pytest.raises(StoppedSearchError, match="could not take a step"):
        method(problem)


def test_a_stopped_filter_of_a_ship_is_refused(stopped) -> None:
    problem = pushed_ship.pushed_problem(1)[0]
    with pytest.raises(StoppedSearchError, match="Kalman"):
        kalman(problem)


def test_a_stopped_search_of_a_craft_is_refused(stopped, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(first_values, "least_squares", _stays)
    craft = craft_log.random_craft(np.random.default_rng(7))
    paths = written(tmp_path, craft, ["spin"])
    with pytest.raises(InputError, match="could not take a step"):
        t2s.identify(craft_log.first_card(craft, np.random.default_rng(5)), paths)


def test_a_search_that_begins_at_the_minimum_need_not_move() -> None:
    assert is_minimum(np.diag([4.0, 1.0]), np.array([0.2, -0.1]))
    # Pressed against its bound, the first unknown cannot follow its gradient.
    bounded = np.array([0.0, 5.0]), np.array([0.0, -np.inf]), np.array([np.inf, np.inf])
    assert is_minimum(np.eye(2), np.array([50.0, 0.1]), bounded=bounded)
    assert not is_minimum(np.eye(2), np.array([-50.0, 0.1]), bounded=bounded)


def _stays(residuals, start, jacobian, *_, **__) -> OptimizeResult:
    """A search that does not move."""
    fun, jac = residuals(start), jacobian(start)
    return OptimizeResult(x=np.array(start), fun=fun, jac=jac, grad=jac.T @ fun, success=True, active_mask=0)


def test_a_stopped_search_of_tows_gives_no_fit(monkeypatch) -> None:
    times = np.linspace(0, 60, 31)
    tows = tows_of(times, 0.2 * np.tanh(times / 20))
    assert tow.fit_speeds(tows, 11.6, tow.TowModel(("B3",))) is not None
    monkeypatch.setattr(search, "least_squares", _stays)
    assert tow.fit_speeds(tows, 11.6, tow.TowModel(("B3",))) is None


def test_a_stopped_search_of_a_yaw_rig_gives_no_fit(monkeypatch) -> None:
    design = np.random.default_rng(1).normal(size=(20, 3))

    def evaluate(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return design @ (unknown - 1.0), design

    assert yaw._search(evaluate, np.zeros(3), 1) is not None
    monkeypatch.setattr(search, "least_squares", _stays)
    assert yaw._search(evaluate, np.zeros(3), 1) is None
    assert yaw._search(evaluate, np.ones(3), 1) is not None  # a minimum from the beginning
