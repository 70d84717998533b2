"""Explanations fitted to one set of trials: each once, many at a time by any executor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from uuid import uuid4

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.inference.batch import MeasuredBatch
from tank2sim.gap.inference.fit import Belief, ExplanationFit, NuisanceParameters
from tank2sim.gap.inference.hypothesis import Hypothesis, TrialSurroundings
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
    each : tuple of str
        Effects whose wind or current differs from trial to trial; names that are not in `thetas` have no meaning.
    """

    thetas: dict[str, Array]
    starts: Sequence[Array]
    rounds: Sequence[int]
    limit: float = np.inf
    each: tuple[str, ...] = ()

    @property
    def effects(self) -> tuple[str, ...]:
        """Names in the order of the library: the same set is the same explanation."""
        return tuple(sorted(self.thetas, key=list(EFFECTS).index))

    @property
    def parameter_count(self) -> int:
        """Number of its parameters."""
        return sum(map(len, self.thetas.values()))


Begun = tuple[Proposal, Callable[[], ExplanationFit]]
"""A proposal, and the function that waits for its fit."""


class HypothesisCache:
    """Hypotheses by their effects, each built once.

    Parameters
    ----------
    none : Hypothesis
        The card without an effect.
    motion : MeasuredBatch, optional
        Motion of the trials: their number, and the winds and currents that they recorded.
    """

    def __init__(self, none: Hypothesis, motion: MeasuredBatch | None = None):
        self.none, self.runs = none, 0 if motion is None else len(motion.names)
        recorded = set() if motion is None else set(motion.recorded)
        self.recorded = tuple(
            name
            for name, effect in EFFECTS.items()
            if effect.surroundings and set(effect.model_names().values()) & recorded
        )
        self._made: dict[tuple[tuple[str, ...], tuple[str, ...]], Hypothesis] = {((), ()): none}

    def __call__(self, *effects: str, each: tuple[str, ...] = ()) -> Hypothesis:
        """The card with these effects; the wind or current of those in `each` differs from trial to trial."""
        key = effects, (each := tuple(name for name in each if name in effects))
        if key not in self._made:
            none, recorded = self.none, tuple(name for name in effects if name in self.recorded)
            given = TrialSurroundings(each, recorded, self.runs)
            self._made[key] = Hypothesis(none.card, none.driven_by, effects, none.model, given)
        return self._made[key]


@dataclass(frozen=True, eq=False)
class _LikelihoodParts:
    """The data from which another process builds the same likelihood."""

    token: str
    card: SteeredCard
    driven_by: str
    motion: MeasuredBatch
    coefficients: NuisanceParameters
    belief: Belief
    scale: Array


class Fitting:
    """Fits explanations to one likelihood.

    Parameters
    ----------
    likelihood : Likelihood
    hypotheses : HypothesisCache
    progress : callable
        Called with the name of each explanation that is fitted.
    executor : Executor, optional
        Fits several explanations at once; the result does not depend on it.
    found : mapping, optional
        Fits to begin with, by their effects.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        hypotheses: HypothesisCache,
        progress: StageReport,
        executor: Executor | None,
        found: Mapping[tuple[str, ...], ExplanationFit] | None = None,
    ):
        self.likelihood, self.hypotheses, self.progress, self.executor = likelihood, hypotheses, progress, executor
        self.found: dict[tuple[str, ...], ExplanationFit] = dict(found or {})
        none = likelihood.none
        parts = likelihood.motion, likelihood.coefficients, likelihood.belief, likelihood.scale
        self._parts = _LikelihoodParts(uuid4().hex, none.card, none.driven_by, *parts)

    def fit(self, proposals: Sequence[Proposal]) -> None:
        """Fit the proposals, and keep the better of each and of any earlier fit of the same effects."""
        self.finish(self.begin(proposals))

    def begin(self, proposals: Sequence[Proposal]) -> list[Begun]:
        """Hand the proposals to the executor, if there is one, those with most to be done first."""
        if self.executor is None:
            return [(proposal, partial(_fit, self.likelihood, self.hypotheses, proposal)) for proposal in proposals]
        longest = sorted(enumerate(proposals), key=lambda each: (-sum(each[1].rounds), -each[1].parameter_count))
        begun = {
            place: (proposal, self.executor.submit(_fit_in_worker, self._parts, proposal).result)
            for place, proposal in longest
        }
        return [begun[place] for place in range(len(proposals))]

    def finish(self, begun: Sequence[Begun]) -> None:
        """Wait for the fits, and keep the better of each and of any earlier fit of the same effects.

        Parameters
        ----------
        begun : sequence of Begun
            As of :meth:`begin`.
        """
        for proposal, fitted in begun:
            self.progress(" and ".join(proposal.effects) or "the card as it is")
            self._keep(proposal, fitted())

    def _keep(self, proposal: Proposal, found: ExplanationFit) -> None:
        before = self.found.get(proposal.effects)
        if before is None or found.score < before.score:
            self.found[proposal.effects] = replace(
                found, hypothesis=self.hypotheses(*proposal.effects, each=proposal.each)
            )

    def best(self, count: int | None = None) -> ExplanationFit:
        """The best fit so far, of all or of those with `count` effects; raises ValueError if there is none."""
        chosen = [fit for fit in self.found.values() if count is None or len(fit.hypothesis.effects) == count]
        return min(chosen, key=lambda fit: fit.score)

    def has(self, count: int) -> bool:
        """Whether an explanation with `count` effects was fitted."""
        return any(len(effects) == count for effects in self.found)


def refit(fit: ExplanationFit, starts: Sequence[Array], rounds: Sequence[int]) -> Proposal:
    """The proposal to fit an explanation again, from its parameters.

    Parameters
    ----------
    fit : ExplanationFit
    starts, rounds
        As in :class:`Proposal`.
    """
    return Proposal(thetas_of(fit), starts, rounds, each=fit.hypothesis.each)


def thetas_of(fit: ExplanationFit) -> dict[str, Array]:
    """Parameters of a fit by effect."""
    names = np.array([parameter.effect for parameter in fit.hypothesis.estimated])
    return {effect: fit.theta[names == effect] for effect in fit.hypothesis.effects}


def _fit(likelihood: Likelihood, hypotheses: HypothesisCache, proposal: Proposal) -> ExplanationFit:
    """The fit of a proposal; with an infinite score where its forces along the measured motion are not finite."""
    effects, starts = proposal.effects, proposal.starts
    theta = np.concatenate([np.zeros(0), *(proposal.thetas[effect] for effect in effects)])
    hypothesis = hypotheses(*effects, each=proposal.each)
    try:
        return likelihood.at_best(hypothesis, theta, starts, proposal.rounds, proposal.limit)
    except FloatingPointError:
        nothing = np.zeros(len(likelihood.coefficients.names))
        return ExplanationFit(hypothesis, theta, np.zeros((len(theta), len(theta))), starts[0], np.inf, nothing)


_LIKELIHOODS: dict[str, tuple[Likelihood, HypothesisCache]] = {}
"""In a worker: the likelihood of the last search that it received."""

_LOCK = Lock()
"""Threads of one executor share the dictionary above."""


def _same_trials(cache: HypothesisCache, ship: tuple[SteeredCard, str], sent: _LikelihoodParts) -> bool:
    """Whether hypotheses were built for the same ship and trials."""
    new = HypothesisCache(cache.none, sent.motion)
    known = cache.none.card, cache.none.driven_by
    return known == ship and (cache.runs, cache.recorded) == (new.runs, new.recorded)


def _fit_in_worker(sent: _LikelihoodParts, proposal: Proposal) -> ExplanationFit:
    with _LOCK:
        if sent.token not in _LIKELIHOODS:
            ship = sent.card, sent.driven_by
            hypotheses = next((cache for _, cache in _LIKELIHOODS.values() if _same_trials(cache, ship, sent)), None)
            none = hypotheses.none if hypotheses else Hypothesis(*ship)
            _LIKELIHOODS.clear()
            likelihood = Likelihood(sent.motion, none, sent.coefficients, sent.belief, sent.scale)
            _LIKELIHOODS[sent.token] = likelihood, hypotheses or HypothesisCache(none, sent.motion)
        likelihood_and_hypotheses = _LIKELIHOODS[sent.token]
    found = _fit(*likelihood_and_hypotheses, proposal)
    return replace(found, hypothesis=None)  # type: ignore[arg-type]  # CasADi's functions stay where they are
