"""The verdict from the scores: a posterior over sets of effects, and one decision by the probability asked for.

A score T is -2 log of the evidence of an explanation, its coefficients, noise and form integrated out. The posterior of
a set of k effects is proportional to

    exp(-(T + PRICE k) / (2 TEMPER))

The most probable set is named. If it is probable enough that all its effects are missing, it is named alone; otherwise
together with the smallest list of sets that holds :data:`LISTED` of the probability. Some set is always the most
probable: where the innovations of the best are not noise, a name would be a guess, and is withheld.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, ndtr, softmax

from tank2sim.arguments import FALSE_DISCOVERY
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.residuals import estimates
from tank2sim.gap.diagnosis.strangeness import Strange, find_strangeness
from tank2sim.gap.improve_card import changed_derivatives
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.hypothesis import parameter_places
from tank2sim.gap.inference.prior import GEAR, PRICE
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY
from tank2sim.gap.search.explanations import Search

TEMPER = 3.0
"""Scores are divided by this before they become probabilities (project choice): trials hold less information than
their scores suggest, for noise is coloured and formulas have errors. benchmarks/gap.py compares claimed and true
effects."""

LISTED = 0.9
"""Probability that the sets hold which are named together where none is sure enough to be named alone."""

LIKELY = 0.5
"""An effect less probable than this is not named alone, whatever is asked for (project choice)."""

SUREST = 0.99
"""Largest probability of an effect: one outside the library may look the same (project choice)."""

STANDARD_ERRORS = 3.0
"""A set is compared if each of its effects exceeds so many of its standard errors."""


@dataclass(frozen=True, eq=False)
class Decision:
    """The verdict and its basis.

    Parameters
    ----------
    verdict : str
        One of :data:`.result.GAP_VERDICTS`.
    best : ExplanationFit
        The explanation that is named, "none" among them; the best of all where a name is withheld.
    alike : tuple of ExplanationFit
        Other explanations that must be named with it, the most probable first.
    probabilities : mapping
        Probabilities of each explanation that was fitted, by its effects.
    strange : tuple of Strange
        Where the innovations of the best are not noise.
    """

    verdict: str
    best: ExplanationFit
    alike: tuple[ExplanationFit, ...]
    probabilities: dict[tuple[str, ...], float]
    strange: tuple[Strange, ...] = ()

    def confidence(self, effect: str) -> float:
        """Probability that an effect is among the missing ones."""
        return self.probability_of_all([effect])

    def probability_of_all(self, names: Collection[str]) -> float:
        """Probability that all these effects are among the missing ones."""
        return float(min(sum(p for effects, p in self.probabilities.items() if {*names} <= {*effects}), SUREST))


def decide(search: Search, false_discovery: float = FALSE_DISCOVERY) -> Decision:
    """Return the verdict that the scores of a search support.

    Parameters
    ----------
    search : Search
    false_discovery : float
        Largest probability with which a set that is named alone may hold an effect that is not missing, 1 -
        :data:`SUREST` to 1 - :data:`LIKELY`: of all that are named alone, no larger share is wrong on average.
    """
    compared = [fit for fit in search.fits if is_significant(fit)]
    probabilities = posterior(compared)
    ranked = sorted(compared, key=lambda fit: -probabilities[fit.hypothesis.effects])
    best = ranked[0]
    effects, strange = best.hypothesis.effects, find_strangeness(search.likelihood, best)
    decision = Decision(MISSING if effects else NO_EFFECT_MISSING, best, (), probabilities, strange)
    if effects and decision.probability_of_all(effects) < 1 - false_discovery:
        listed = np.cumsum([probabilities[fit.hypothesis.effects] for fit in ranked])
        rivals = ranked[1 : max(int(np.searchsorted(listed, LISTED)) + 1, 2)]
        decision = replace(decision, verdict=AMBIGUOUS, alike=tuple(rivals))
    return replace(decision, verdict=OUTSIDE_LIBRARY) if strange else decision


def enough_to_name(false_discovery: float = FALSE_DISCOVERY) -> float:
    """Decrease of the score by one more effect from which it is named alone, beyond the penalty of its parameters.

    Parameters
    ----------
    false_discovery : float
        As of :func:`decide`.
    """
    return PRICE + 2 * TEMPER * float(np.log((1 - false_discovery) / false_discovery))


def posterior(fits: list[ExplanationFit]) -> dict[tuple[str, ...], float]:
    """Probability of each explanation, by its effects; they sum to 1."""
    shares = softmax([-0.5 * (fit.score + PRICE * len(fit.hypothesis.effects)) / TEMPER for fit in fits])
    return {fit.hypothesis.effects: float(share) for fit, share in zip(fits, shares, strict=True)}


def is_significant(fit: ExplanationFit) -> bool:
    """Whether each effect has an amplitude that is more than :data:`STANDARD_ERRORS` from its absence.

    One that only changes derivatives of the card, or its data of the steering gear, must change one of them by as
    many standard errors of the *card*: less is within the card's uncertainty.
    """
    return all(_is_effect_significant(fit, name) for name in fit.hypothesis.effects)


def _is_effect_significant(fit: ExplanationFit, name: str) -> bool:
    """Whether one effect of a fit is far enough from its absence, and changes its card by enough."""
    errors = np.sqrt(np.diag(fit.covariance))
    sizes = [
        abs(value - estimate.parameter.absent) / error if error > 0 else np.inf
        for estimate, value, error in zip(fit.hypothesis.estimated, fit.theta, errors, strict=True)
        if estimate.effect == name and estimate.is_amplitude and estimate.run is None
    ]
    if max(sizes, default=np.inf) < STANDARD_ERRORS:
        return False
    if name in fit.hypothesis.each and not _differs_from_zero(fit, name):
        return False
    values = next(values for effect, values, _ in estimates(fit) if effect == name)
    if change_of_derivatives(fit.hypothesis.card, name, values) < STANDARD_ERRORS:
        return False
    return not (EFFECTS[name].in_place_of and _change_of_gear(fit, name, values) < STANDARD_ERRORS)


def _differs_from_zero(fit: ExplanationFit, name: str) -> bool:
    """Whether winds or currents of the single trials are together beyond :data:`STANDARD_ERRORS` (Wald's test)."""
    places = parameter_places(fit.hypothesis.estimated, name, by_trial=True)
    sizes = fit.theta[places]
    statistic = float(sizes @ np.linalg.solve(fit.covariance[np.ix_(places, places)], sizes))
    return bool(chdtrc(len(places), statistic) < 2 * ndtr(-STANDARD_ERRORS))


def change_of_derivatives(card: SteeredCard, name: str, values: Mapping[str, float]) -> float:
    """Largest change of a derivative of the card by an effect, in standard errors of the card.

    Infinite for an effect that changes none.

    Parameters
    ----------
    card : SteeredCard
    name : str
        Name of the effect.
    values : mapping
        Its parameters, SI.
    """
    if not EFFECTS[name].changes_on(card):
        return float(np.inf)
    changes = [
        abs(after - card.derivatives.get(term, 0.0)) / error if (error := card.standard_error(term)) > 0 else np.inf
        for term, after, *_ in changed_derivatives(card, name, values, {})
    ]
    return max(changes, default=0.0)


def _change_of_gear(fit: ExplanationFit, name: str, values: Mapping[str, float]) -> float:
    """Change of the card's steering-gear data for the worse, in standard errors; infinite if the card states none."""
    ((key, value),) = values.items()
    worse = next((parameter.worse for parameter in EFFECTS[name].parameters if parameter.name == key), 0)
    stated = getattr(fit.hypothesis.card.steering_gear, key, None)
    if stated is None:
        return float(np.inf)
    change = float((value - stated) / (GEAR * stated))
    return change * worse if worse else abs(change)
