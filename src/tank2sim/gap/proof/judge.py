"""Free-running simulations of the names that the scores support: they report, and veto a name that closes no gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tank2sim.cards.card import SteeredCard
from tank2sim.gap.proof.cross_check import MUCH, NEAR_NOISE, closes_gap
from tank2sim.gap.proof.improvement import Proof, Prover
from tank2sim.gap.proof.refit import effects_like
from tank2sim.gap.result import (
    AMBIGUOUS,
    COEFFICIENTS,
    MISSING,
    NO_EFFECT_MISSING,
    OUTSIDE_LIBRARY,
    Passed,
    misfit_of,
)
from tank2sim.gap.search.decision import Decision
from tank2sim.gap.search.explanations import Search

CLEARLY = 0.7
"""Largest share of the misfit that may remain where effects are named next to something unknown, or a wind or current
by simulation alone (project choice)."""

EXPLAINED = 0.2
"""Coefficients explain a gap that they reduce to less than this share, or to noise (project choice)."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A decision after the simulations with its names."""

    decision: Decision
    proof: Proof  # Proof of the named effects
    withheld: str = ""  # Names withheld because they brought no simulation closer
    by_simulation: str = ""  # Sentence about a name that simulations alone gave

    def alternatives(self, card: SteeredCard) -> tuple[tuple[str, ...], ...]:
        """Sets that the trials do not distinguish from what is named, or from the coefficients that explain the gap."""
        if self.proof.named.estimated:
            return tuple(fit.hypothesis.effects for fit in self.decision.alike)
        if self.decision.verdict == OUTSIDE_LIBRARY:
            return ()
        return tuple((name,) for name in effects_like(card, self.proof.coefficients))


def judge(prover: Prover, search: Search, decision: Decision) -> Judged:
    """The decision with the proof of what it names, by the fitted trials.

    Names with which the simulations come no closer are withheld; next to something that no effect explains, they must
    come clearly closer (:data:`CLEARLY`). Where nothing is named, the fitted trials say whether the coefficients of
    the card explain the gap.

    Parameters
    ----------
    prover : Prover
    search : Search
    decision : Decision
        By the scores.
    """
    effects, withheld = decision.best.hypothesis.effects, ""
    if effects:
        proof = prover.prove(decision.best)
        unknown = decision.verdict == OUTSIDE_LIBRARY
        if unknown and _closes_clearly(proof.results):
            return Judged(replace(decision, verdict=AMBIGUOUS if decision.alike else MISSING), proof)
        if not unknown and closes_gap(proof.results):
            return Judged(decision, proof)
        withheld = "" if unknown else " and ".join(effects)
    proof = prover.prove(search.none)
    return Judged(replace(decision, verdict=_verdict_without_name(decision, proof)), proof, withheld)


def _verdict_without_name(decision: Decision, proof: Proof) -> str:
    """Whether the trials are followed to the noise without an effect, with other coefficients, or not at all."""
    before, after = (misfit_of(proof.results, version) for version in ("before", "after"))
    unknown = bool(decision.strange) and after > NEAR_NOISE
    refitted = proof.coefficients and before > MUCH and closes_gap(proof.results)
    if not unknown and refitted and after <= max(MUCH, EXPLAINED * before):
        return COEFFICIENTS
    return OUTSIDE_LIBRARY if unknown or after > MUCH else NO_EFFECT_MISSING


def _closes_clearly(results: Sequence[Passed]) -> bool:
    """Whether a gap that is far above the noise becomes clearly smaller."""
    before, after = (misfit_of(results, version) for version in ("before", "after"))
    return before > MUCH and after < CLEARLY * before and closes_gap(results, CLEARLY)
