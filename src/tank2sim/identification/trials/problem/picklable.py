"""Problems for other processes: a model cannot be sent, because of its symbols, and is rebuilt from its card."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.problem_from_card import driven_model, fit_driven_by, with_captive
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

Task = TypeVar("Task")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class PicklableShip:
    """The text of a model's card, and the rudder signal that drives the model."""

    card: str  # TOML
    # ``angle`` or ``order`` (:func:`tank2sim.identification.trials.problem.problem_from_card.driven_model`)
    driven_by: str

    def model(self) -> Model:
        """The model; built once in each process."""
        return _model(self)

    def manoeuvring_card(self) -> ManoeuvringCard:
        """The card."""
        card = parse_card(self.card, "card")
        assert isinstance(card, ManoeuvringCard)
        return card


@lru_cache(maxsize=8)
def _model(ship: PicklableShip) -> Model:
    return driven_model(ship.manoeuvring_card(), ship.driven_by)


@dataclass(frozen=True, eq=False)
class Portable:
    """A :class:`Problem` with a :class:`PicklableShip` in place of its model."""

    ship: PicklableShip
    free: tuple[str, ...]
    prior_mean: Array
    prior_error: Array
    runs: tuple[SampledRun, ...]
    prior_inverse: Array | None = None
    captive: CaptiveRuns | None = None

    def problem(self) -> Problem:
        """The problem with its model."""
        model = self.ship.model()
        problem = Problem(
            model, self.free, self.prior_mean, self.prior_error, self.runs, prior_inverse=self.prior_inverse
        )
        return with_captive(problem, self.ship.manoeuvring_card(), self.captive)

    def with_runs(self, runs: tuple[SampledRun, ...]) -> Portable:
        """The problem with other runs."""
        return replace(self, runs=runs)


def portable(problem: Problem, card: ManoeuvringCard, driven_by: str) -> Portable:
    """Return a problem in its portable form.

    `problem`: Set up by :func:`tank2sim.identification.trials.problem.problem_from_card.problem_from_card`.
    `driven_by`: The arguments with which it was set up. Raises ValueError: The problem's model differs from the model
    of the card.
    """
    ship = PicklableShip(card.text, fit_driven_by(card, driven_by))
    if ship.model().parameter_names != problem.model.parameter_names:
        raise ValueError("the problem was set up for another card")
    return Portable(
        ship,
        problem.free,
        problem.prior_mean,
        problem.prior_error,
        problem.runs,
        problem.prior_inverse,
        problem.captive.source if problem.captive else None,
    )


def map_tasks(work: Callable[[Task], _Result], tasks: Iterable[Task], executor: Executor | None) -> Iterator[_Result]:
    """Results in the order of the tasks: one after the other here, or by any executor."""
    return map(work, tasks) if executor is None else executor.map(work, tasks)
