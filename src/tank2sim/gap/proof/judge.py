"""What free-running simulations say of the names that scores from instant to instant support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.proof.cross_check import MUCH, NEAR_NOISE, closes_gap
from tank2sim.gap.proof.improvement import BETTER, Proof, Prover, most_are_closer
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY, Passed, misfit_of
from tank2sim.gap.search.explanations import Search
from tank2sim.gap.search.model_choice import (
    EVIDENCE_NEEDED,
    Decision,
    decide,
    decide_as_good,
    decide_for,
    decide_without,
    doubtful_effects,
    makes_the_card_right,
    with_one_more,
)

TRIES = 4
"""Explanations that are simulated at most, one after the other (project choice)."""

DECISIVE = 40.0
"""Difference of the scores of "none" and of a name (-2 log probability) from which simulations with coefficients alone
are not asked for (project choice: odds of 1 to e^20)."""

CLEARLY = 0.7
"""Largest share of the misfit that may remain where a second explanation, or one next to something unknown, is named
(project choice)."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A decision after the simulations with its names.

    Parameters
    ----------
    decision : Decision
    proof : Proof
        Proof of the named effects.
    withheld : tuple of str
        Names that brought no simulation closer.
    by_simulation : str
        What is to be said of a name that simulations alone gave.
    """

    decision: Decision
    proof: Proof
    withheld: tuple[str, ...] = ()
    by_simulation: str = ""


@dataclass(frozen=True, eq=False)
class Judge:
    """Decides by free-running simulations between explanations that a search has scored.

    Parameters
    ----------
    prover : Prover
    false_discovery : float
        As in :func:`.model_choice.decide`.
    """

    prover: Prover
    false_discovery: float
    _proofs: dict[ExplanationFit, Proof] = field(default_factory=dict, init=False)

    def judge(self, search: Search, decision: Decision) -> Judged:
        """The decision after free-running simulations with what it names.

        An explanation that fits best from instant to instant, and with which no simulation comes closer, is excluded,
        and the remaining ones are judged again, :data:`TRIES` times at most. What comes after another was excluded, or
        acts next to something that no effect explains, must close the gap clearly (:data:`CLEARLY`); nothing is named
        without. An effect that gained little must bring the fitted trials closer, and one more is named that brings
        them much closer, also where the scores name none. A name whose score is not far ahead of none
        (:data:`DECISIVE`) must also follow the fitted trials as closely as the card's coefficients alone, fitted to
        them; where these do as well with one that is far off (:data:`.refit.FAR`), both are said.

        Parameters
        ----------
        search : Search
        decision : Decision
            By the scores.
        """
        withheld: list[str] = []
        excluded: list[ExplanationFit] = []
        remaining, current = search, decision
        for _ in range(TRIES):
            if not current.best.hypothesis.effects:
                break
            judged = self.with_more(remaining, self.with_fewer(remaining, current))
            current = judged.decision
            unknown = current.verdict == OUTSIDE_LIBRARY
            if self._is_closer(search, judged, clearly=bool(withheld) or unknown):
                if self._coefficients_do_as_well(search, judged):
                    current = decide_as_good(remaining, current, search.none, self.false_discovery)
                verdict = (AMBIGUOUS if current.alike else MISSING) if unknown else current.verdict
                return Judged(replace(current, verdict=verdict), judged.proof, tuple(withheld))
            if not unknown:
                withheld.append(" and ".join(current.best.hypothesis.effects))
            excluded.append(current.best)
            remaining = replace(remaining, fits=tuple(fit for fit in remaining.fits if fit is not current.best))
            current = decide(remaining, self.false_discovery, excluded)
        return self._without_name(search, decision, tuple(withheld))

    def with_fewer(self, search: Search, decision: Decision) -> Judged:
        """The decision, with its proof, without its doubtful effects that bring the fitted trials no closer.

        An effect stays without which a coefficient would be far off (:data:`.refit.FAR`): that takes its place.
        """
        judged = self._proved(decision)
        for name in doubtful_effects(search, decision.best):
            fewer = decide_without(search, decision, name, self.false_discovery)
            if fewer is not decision:
                of_fewer = self.with_fewer(search, fewer)
                far = of_fewer.proof.is_farther_off(judged.proof)
                if of_fewer.proof.misfit <= judged.proof.misfit and not far:
                    return of_fewer
        return judged

    def with_more(self, search: Search, judged: Judged) -> Judged:
        """The same, or a decision for one effect more, which scores as well and is followed more closely.

        That is, the fitted trials are missed by less than :data:`CLEARLY` of what they were, where this is not near the
        noise (:data:`.cross_check.NEAR_NOISE`); or by :data:`.improvement.BETTER` less, where the coefficients of the
        card would else be off by more than their standard errors; or by no more, where one of them would else be far
        off (:data:`.refit.FAR`) and the score is better by :data:`.model_choice.EVIDENCE_NEEDED`. Where the score is
        only as good, the coefficient and the effect are explanations that these data do not distinguish.
        """
        decision, reached = judged.decision, judged.proof.misfit
        if decision.verdict == OUTSIDE_LIBRARY:
            return judged
        for larger in with_one_more(search, decision.best)[:TRIES]:
            limit = 1 - BETTER if makes_the_card_right(larger, decision.best) else CLEARLY
            if limit == CLEARLY and reached < NEAR_NOISE:
                continue
            more = decide_for(search, larger, decision.best, self.false_discovery)
            if more.verdict == OUTSIDE_LIBRARY:
                continue
            of_more = self._proved(more)
            closer = of_more.proof.misfit < limit * reached
            takes_its_place = limit > CLEARLY and judged.proof.is_farther_off(of_more.proof)
            if takes_its_place and larger.score < decision.best.score - EVIDENCE_NEEDED:
                closer |= of_more.proof.misfit <= reached
            if closer and most_are_closer(judged.proof.results, of_more.proof.results):
                return of_more
            if takes_its_place and of_more.proof.misfit <= max(reached, NEAR_NOISE):
                alike = (decision.best, *decision.alike)
                return replace(of_more, decision=replace(decision, verdict=AMBIGUOUS, best=larger, alike=alike))
        return judged

    def _is_closer(self, search: Search, judged: Judged, *, clearly: bool) -> bool:
        """Whether simulations with the names are closer than without, and than with other coefficients alone."""
        proof = judged.proof
        closes = _closes_clearly(proof.results) if clearly else closes_gap(proof.results)
        if not closes or search.none.score - judged.decision.best.score >= DECISIVE:
            return closes
        return proof.misfit < max((1 + BETTER) * self._of(search.none).misfit, NEAR_NOISE)

    def _coefficients_do_as_well(self, search: Search, judged: Judged) -> bool:
        """Whether a coefficient far off follows the trials as closely as a name with a score not far ahead."""
        if search.none.score - judged.decision.best.score >= DECISIVE or search.none in judged.decision.alike:
            return False
        alone = self._of(search.none)
        return alone.is_farther_off(judged.proof) and alone.misfit <= max(
            (1 + BETTER) * judged.proof.misfit, NEAR_NOISE
        )

    def _without_name(self, search: Search, decision: Decision, withheld: tuple[str, ...]) -> Judged:
        """The decision where no explanation is left whose effects can be named."""
        proof = self._of(search.none)
        if decision.verdict == NO_EFFECT_MISSING:
            more = self.with_more(search, Judged(decision, proof))
            if more.decision is not decision:
                return more
        if decision.best.hypothesis.effects:
            follows = not decision.strange and misfit_of(proof.results, "after") <= MUCH
            decision = replace(decision, verdict=NO_EFFECT_MISSING if follows else OUTSIDE_LIBRARY)
        return Judged(decision, proof, withheld)

    def _proved(self, decision: Decision) -> Judged:
        return Judged(decision, self._of(decision.best))

    def _of(self, best: ExplanationFit) -> Proof:
        """The proof of an explanation, which may be asked for again."""
        if best not in self._proofs:
            self._proofs[best] = self.prover.prove(best)
        return self._proofs[best]


def _closes_clearly(results: Sequence[Passed]) -> bool:
    """Whether a gap that is far above the noise becomes clearly smaller."""
    before, after = (misfit_of(results, version) for version in ("before", "after"))
    return before > MUCH and after < CLEARLY * before and closes_gap(results, CLEARLY)
