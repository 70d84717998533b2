"""Explanations fitted to one set of trials: each once, many at a time by any executor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from threading import Lock
from uuid import uuid4

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.inference.batch import MeasuredBatch
from tank2sim.gap.inference.fit import Belief, ExplanationFit, NuisanceParameters
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.likelihood import Likelihood

StageReport = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Proposal:
    """An explanation to be fitted.

    Parameters
    ----------
    thetas : mapping
        Effect to its parameters to begin with.
    starts : sequence of arrays
        Noises to choose from to begin with.
    rounds : sequence of int
    limit : float
        See :meth:`.likelihood.Likelihood.at_best`.
    """

    thetas: dict[str, Array]
    starts: Sequence[Array]
    rounds: Sequence[int]
    limit: float = np.inf

    @property
    def effects(self) -> tuple[str, ...]:
        """In the order of the library: the same set is the same explanation."""
        return tuple(sorted(self.thetas, key=list(EFFECTS).index))


class Known:
    """Explanations by their effects, each made once."""

    def __init__(self, none: Hypothesis):
        self.none = none
        self._made: dict[tuple[str, ...], Hypothesis] = {(): none}

    def __call__(self, *effects: str) -> Hypothesis:
        """The card with these effects."""
        if effects not in self._made:
            self._made[effects] = Hypothesis(self.none.card, self.none.driven_by, effects, self.none.model)
        return self._made[effects]


@dataclass(frozen=True, eq=False)
class _Sent:
    """What another process needs to make the same likelihood."""

    token: str
    card: ManoeuvringCard
    driven_by: str
    motion: MeasuredBatch
    coefficients: NuisanceParameters
    belief: Belief


class Fitting:
    """Fits explanations to one likelihood.

    Parameters
    ----------
    likelihood : Likelihood
    known : Known
    progress : callable
        Told what is being fitted.
    executor : Executor, optional
        Fits several explanations at once; the result does not depend on it.
    """

    def __init__(self, likelihood: Likelihood, known: Known, progress: StageReport, executor: Executor | None):
        self.likelihood, self.known, self.progress, self.executor = likelihood, known, progress, executor
        self.found: dict[tuple[str, ...], ExplanationFit] = {}
        none = likelihood.none
        parts = none.card, none.driven_by, likelihood.motion, likelihood.coefficients, likelihood.belief
        self._sent = _Sent(uuid4().hex, *parts)

    def fit(self, proposals: Sequence[Proposal]) -> None:
        """Fit what is proposed, and keep the better of it and what was found before."""
        if self.executor is None:
            for proposal in proposals:
                self.progress(" and ".join(proposal.effects) or "the card as it is")
                self._keep(proposal, _fitted(self.likelihood, self.known, proposal))
            return
        waiting = [(proposal, self.executor.submit(_fitted_there, self._sent, proposal)) for proposal in proposals]
        for one, future in waiting:
            self.progress(" and ".join(one.effects) or "the card as it is")
            self._keep(one, future.result())

    def _keep(self, proposal: Proposal, found: ExplanationFit) -> None:
        before = self.found.get(proposal.effects)
        if before is None or found.score < before.score:
            self.found[proposal.effects] = replace(found, explained=self.known(*proposal.effects))

    def best(self, count: int | None = None) -> ExplanationFit:
        """The best so far, of all or of those with so many effects; raises ValueError if there is none."""
        chosen = [one for one in self.found.values() if count is None or len(one.explained.effects) == count]
        return min(chosen, key=lambda one: one.score)

    def has(self, count: int) -> bool:
        """Whether one with so many effects was fitted."""
        return any(len(effects) == count for effects in self.found)


def thetas_of(fit: ExplanationFit) -> dict[str, Array]:
    """Parameters of a fit by effect."""
    names = [one.effect for one in fit.explained.asked]
    return {
        effect: fit.theta[[place for place, name in enumerate(names) if name == effect]]
        for effect in fit.explained.effects
    }


def _fitted(likelihood: Likelihood, known: Known, proposal: Proposal) -> ExplanationFit:
    effects = proposal.effects
    theta = np.concatenate([np.zeros(0), *(proposal.thetas[effect] for effect in effects)])
    return likelihood.at_best(known(*effects), theta, proposal.starts, proposal.rounds, proposal.limit)


_THERE: dict[str, tuple[Likelihood, Known]] = {}
"""In a worker: the likelihood of the last search it was sent."""

_ONE = Lock()
"""Threads of one executor share what is above."""


def _fitted_there(sent: _Sent, proposal: Proposal) -> ExplanationFit:
    with _ONE:
        if sent.token not in _THERE:
            ship = sent.card, sent.driven_by
            known = next((one for _, one in _THERE.values() if (one.none.card, one.none.driven_by) == ship), None)
            none = known.none if known else Hypothesis(*ship)
            _THERE.clear()
            likelihood = Likelihood(sent.motion, none, sent.coefficients, sent.belief)
            _THERE[sent.token] = likelihood, known or Known(none)
        there = _THERE[sent.token]
    found = _fitted(*there, proposal)
    return replace(found, explained=None)  # type: ignore[arg-type]  # CasADi's functions stay where they are
