"""The verdict from the scores: one explanation, none, several, or none in the library.

An explanation needs a score well below that of "none", and each further effect one well below that without it.
All that are as good as the best are named next to it. Some explanation always fits best: where the innovations of the
best explanation are not noise, a name would be a guess, and is withheld.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2, gamma, norm

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.residuals import each_trial, estimates
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.kalman_filter import FORCE_STATES
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import GEAR
from tank2sim.gap.outcome.improve_card import changed_derivatives
from tank2sim.gap.proof.cross_check import trial_consistency
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY
from tank2sim.gap.search.explanations import Search

EVIDENCE_NEEDED = 10.0
"""Decrease of the score that an additional effect needs: odds of exp(5) = 150 to 1 in its favour, "very strong" by Kass
and Raftery (1995), Bayes Factors, J. Am. Stat. Assoc. 90, whose 2 log(odds) this is."""

ALIKE = EVIDENCE_NEEDED
"""Explanations within this of the best are as good."""

SAME_KIND_SHARE = {"actuator": 0.25, "force": 0.1}
"""Share of the whole gain that a second effect of the same kind must have (project choice): less is the
formula error of the first, beyond :data:`.form_error.FORM`."""

BELIEVABLE = 0.5
"""Width of the card's coefficients, in their standard errors, below which an explanation makes them as good as the card
states (project choice: of 18 made-up ships most have 0.1 to 0.6 with all their effects, and 1.7 to 2.5 where
coefficients take the place of one)."""

LESS_WRONG = 0.5
"""Share of the coefficients' width below which a larger explanation makes a card right that is else off by more than
its standard errors (project choice)."""

DOUBTFUL, DOUBTFUL_IF_RIGHT = 60.0, 25.0
"""Gains below which one of several effects is judged by simulation as well (project choice: names that were wrong
gained up to 46 next to others in made-up trials); the second for an effect that makes the card right, for coefficients
that are far off follow the trials as closely in its place."""

LIKELY = 0.5
"""An effect less probable than this is not named alone (project choice): all explanations with at least
:data:`RIVAL` of its probability are then named."""

RIVAL = 0.1
"""Share of the best explanation's probability that makes another one its rival (project choice): odds of 10 to 1, from
which Jeffreys (1961), Theory of Probability, calls evidence strong."""

STANDARD_ERRORS = 3.0
"""An effect is named if its size exceeds so many of its standard errors."""

TEMPER = 3.0
"""Scores are divided by this before they become probabilities (project choice): trials hold less information than
their scores suggest, for noise is coloured and formulas have errors. benchmarks/gap.py compares claimed and true
effects."""


IN_WAVES = 2.0
"""Factor on the evidence that names need, and on :data:`TEMPER`, where waves were found (project choice): means over
blocks do not follow them whole, and what remains is coloured. The same where the best explanation has an effect that
swings (roll): its frequency and damping adapt to the colour of random forces."""

SUREST = 0.99
"""Largest probability of an effect: one outside the library may look the same (project choice)."""


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
        Other explanations that are as good.
    probabilities : mapping
        Probabilities of each explanation that was fitted, by its effects.
    strange : tuple of Strange
        Where the innovations of the best are not noise.
    """

    verdict: str
    best: ExplanationFit
    alike: tuple[ExplanationFit, ...]
    probabilities: dict[tuple[str, ...], float]
    strange: tuple[Strange, ...]

    def confidence(self, effect: str) -> float:
        """Probability that an effect is among the missing ones."""
        return _confidence(self.probabilities, effect)


@dataclass(frozen=True)
class Strange:
    """A place where the innovations are not noise.

    Parameters
    ----------
    kind : str
        ``passage`` or ``push`` (a time in one trial, by innovations or by the remaining force), ``trial`` (a
        whole one) or ``period`` (an oscillation in all).
    trial : str
        Empty for a period.
    begin_s, end_s : float
        In the trial's own time; for a period both are its length.
    excess : float
        -2 log of the probability that noise alone reaches this anywhere, as a score.
    """

    kind: str
    trial: str
    begin_s: float
    end_s: float
    excess: float


def decide(search: Search, false_discovery: float = 1 - LIKELY, excluded: Sequence[ExplanationFit] = ()) -> Decision:
    """Return the verdict that the scores of a search support.

    Where the simplest explanation has an effect that is less probable than :data:`RIVAL`, for what fits much better is
    within the uncertainty of the card, nothing is named.

    Parameters
    ----------
    search : Search
    false_discovery : float
        Largest probability with which a single name may be wrong, 1 - :data:`SUREST` to 1 - :data:`LIKELY`. An effect
        whose own is larger is one of several candidates, so that of all names that are given alone no larger share is
        wrong on average.
    excluded : sequence of ExplanationFit
        Explanations that are not in the search any more, for simulations with them are not closer. One that holds the
        effects of such a one and more must be ahead of it as well.
    """
    none = search.none
    best = none
    needed = _doubt(search) * EVIDENCE_NEEDED
    least = none.score  # of all that need fewer effects
    counts = [len(fit.hypothesis.effects) for fit in search.fits]
    for count in range(1, max(counts) + 1):
        of_count = [fit for fit, number in zip(search.fits, counts, strict=True) if number == count]
        larger = next(filter(is_significant, of_count), None)
        if larger is None or (count > 1 and larger is not of_count[0]):
            continue  # what fits better is within the uncertainty of the card
        share = 0.0 if _is_within_the_card(larger, best) else _share(larger, best)
        smaller = [fit.score for fit in excluded if {*fit.hypothesis.effects} < {*larger.hypothesis.effects}]
        if larger.score < min([least, *smaller]) - max(needed, share * (none.score - larger.score)):
            best = larger
        least = min(least, larger.score)
    decision = _decision(search, best, false_discovery)
    improbable = any(decision.confidence(name) < RIVAL for name in best.hypothesis.effects)
    return _decision(search, none, false_discovery) if improbable else decision


def decide_without(search: Search, decision: Decision, name: str, false_discovery: float) -> Decision:
    """The decision for the best explanation without one of its effects; the same where that was not fitted.

    What holds the effect next to others of the explanation is no longer compared with it.

    Parameters
    ----------
    search : Search
    decision : Decision
    name : str
        Name of the effect.
    false_discovery : float
        As in :func:`decide`.
    """
    names = {*decision.best.hypothesis.effects} - {name}
    kept = tuple(
        fit for fit in search.fits if name not in fit.hypothesis.effects or not names & {*fit.hypothesis.effects}
    )
    smaller = next((fit for fit in kept if {*fit.hypothesis.effects} == names), None)
    if smaller is None or not names or not is_significant(smaller):
        return decision
    return _decision(replace(search, fits=kept), smaller, false_discovery)


def with_one_more(search: Search, best: ExplanationFit) -> tuple[ExplanationFit, ...]:
    """Explanations with one effect more than the best that score as well (within :data:`ALIKE`), the best first."""
    score, effects = best.score + _doubt(search) * ALIKE, {*best.hypothesis.effects}
    return tuple(
        fit
        for fit in search.fits
        if fit.score < score
        and effects < {*fit.hypothesis.effects}
        and len(fit.hypothesis.effects) == len(effects) + 1
        and is_significant(fit)
    )


def makes_the_card_right(larger: ExplanationFit, best: ExplanationFit) -> bool:
    """Whether the coefficients of the card are off by more than their standard errors with an explanation, and by less
    than half as much (:data:`LESS_WRONG`) with a larger one."""
    return best.width > 1.0 and larger.width < LESS_WRONG * best.width


def decide_for(search: Search, larger: ExplanationFit, best: ExplanationFit, false_discovery: float) -> Decision:
    """The decision for a larger explanation in place of the best.

    What simulations say counts as the evidence that a name needs: the best is as much less probable. Where the larger
    one makes the card right, what does not is no longer compared with it.

    Parameters
    ----------
    search : Search
    larger, best : ExplanationFit
    false_discovery : float
        As in :func:`decide`.
    """
    right = makes_the_card_right(larger, best)
    behind = {fit: np.inf for fit in search.fits if right and not makes_the_card_right(fit, best)}
    behind[best] = larger.score + _doubt(search) * EVIDENCE_NEEDED
    fits = tuple(replace(fit, score=behind[fit]) if fit in behind else fit for fit in search.fits)
    return _decision(replace(search, fits=fits), larger, false_discovery)


def decide_as_good(search: Search, decision: Decision, other: ExplanationFit, false_discovery: float) -> Decision:
    """The decision where another explanation, that scores worse, follows the trials as closely: it is as probable.

    Parameters
    ----------
    search : Search
    decision : Decision
    other : ExplanationFit
        Explanation of the search that is simpler than the best.
    false_discovery : float
        As in :func:`decide`.
    """
    fits = tuple(replace(fit, score=decision.best.score) if fit is other else fit for fit in search.fits)
    equal = _decision(replace(search, fits=fits), decision.best, false_discovery)
    return replace(decision, verdict=AMBIGUOUS, alike=(*decision.alike, other), probabilities=equal.probabilities)


def doubtful_effects(search: Search, best: ExplanationFit) -> tuple[str, ...]:
    """Effects of an explanation without which it scores worse by less than :data:`DOUBTFUL`, or by less than
    :data:`DOUBTFUL_IF_RIGHT` where they make the card right; the smallest gain first.

    Empty for a single effect.
    """
    effects, doubt = {*best.hypothesis.effects}, _doubt(search, best)
    gains = {}
    for fit in search.fits:
        lacking = effects - {*fit.hypothesis.effects}
        if len(lacking) == 1 and 1 < len(effects) == len(fit.hypothesis.effects) + 1:
            gain, right = fit.score - best.score, makes_the_card_right(best, fit)
            if gain < doubt * (DOUBTFUL_IF_RIGHT if right else DOUBTFUL):
                gains[lacking.pop()] = gain
    return tuple(sorted(gains, key=gains.__getitem__))


def _decision(search: Search, best: ExplanationFit, false_discovery: float) -> Decision:
    """What is said with an explanation: those that are as good, the probabilities of all, and the verdict."""
    none, doubt = search.none, _doubt(search, best)
    temper = doubt * TEMPER
    scores = np.array([fit.score for fit in search.fits]) / temper
    weights = np.exp(-0.5 * scores - logsumexp(-0.5 * scores))
    probabilities = {fit.hypothesis.effects: float(w) for fit, w in zip(search.fits, weights, strict=True)}
    behind = doubt * ALIKE
    unsure = {name for name in best.hypothesis.effects if _confidence(probabilities, name) < 1 - false_discovery}
    if unsure:
        behind = max(behind, -2 * temper * np.log(RIVAL))
    alike = tuple(
        fit
        for fit in search.fits
        if fit is not best
        and fit.score < best.score + behind
        and is_significant(fit)
        and not set(fit.hypothesis.effects) > set(best.hypothesis.effects)
        and len(fit.hypothesis.effects) <= max(len(best.hypothesis.effects), 1)
        and best is not none
    )
    if unsure and not alike:
        alike = tuple(fit for fit in search.fits if not unsure & set(fit.hypothesis.effects))[:1]
    strange = find_strangeness(search.likelihood, best)
    verdict = NO_EFFECT_MISSING if best is none else AMBIGUOUS if alike else MISSING
    return Decision(OUTSIDE_LIBRARY if strange else verdict, best, alike, probabilities, strange)


def _doubt(search: Search, best: ExplanationFit | None = None) -> float:
    swings = best is not None and any(EFFECTS[name].resonant for name in best.hypothesis.effects)
    return IN_WAVES if search.likelihood.belief.waves or swings else 1.0


def _confidence(probabilities: Mapping[tuple[str, ...], float], effect: str) -> float:
    return float(min(sum(p for effects, p in probabilities.items() if effect in effects), SUREST))


def _is_within_the_card(larger: ExplanationFit, best: ExplanationFit) -> bool:
    """Whether the coefficients of the card are off by more than their standard errors with the best explanation so far,
    and by much less with a larger one: what a formula leaves is small against its force, and does not need that."""
    return best.width > 1.0 and larger.width < BELIEVABLE


def _share(larger: ExplanationFit, smaller: ExplanationFit) -> float:
    """Share of the gain by effects that a smaller explanation lacks and that look like others of the larger one."""
    kinds = {name: EFFECTS[name].looks_like for name in larger.hypothesis.effects}
    alike = [
        kind
        for name, kind in kinds.items()
        if name not in smaller.hypothesis.effects and kind in [kinds[other] for other in kinds if other != name]
    ]
    return max((SAME_KIND_SHARE.get(kind, 0.0) for kind in alike), default=0.0)


def is_significant(fit: ExplanationFit) -> bool:
    """Whether each effect has an amplitude that is more than :data:`STANDARD_ERRORS` from its absence.

    One that only changes derivatives of the card, or its data of the steering gear, must change one of them by as
    many standard errors of the *card*: less is within the card's uncertainty.
    """
    errors = np.sqrt(np.diag(fit.covariance))
    for name in fit.hypothesis.effects:
        sizes = [
            abs(value - estimate.parameter.absent) / error if error > 0 else np.inf
            for estimate, value, error in zip(fit.hypothesis.estimated, fit.theta, errors, strict=True)
            if estimate.effect == name and estimate.is_amplitude and estimate.run is None
        ]
        if sizes and max(sizes) < STANDARD_ERRORS:
            return False
        if name in fit.hypothesis.each and not _differs_from_zero(fit, name):
            return False
        if EFFECTS[name].changes_on(fit.hypothesis.card) and _change(fit, name) < STANDARD_ERRORS:
            return False
        if EFFECTS[name].in_place_of and _change_of_gear(fit, name) < STANDARD_ERRORS:
            return False
    return True


def _differs_from_zero(fit: ExplanationFit, name: str) -> bool:
    """Whether winds or currents of the single trials are together beyond :data:`STANDARD_ERRORS` (Wald's test)."""
    places = [
        place
        for place, estimate in enumerate(fit.hypothesis.estimated)
        if estimate.effect == name and estimate.run is not None
    ]
    sizes = fit.theta[places]
    statistic = float(sizes @ np.linalg.solve(fit.covariance[np.ix_(places, places)], sizes))
    return bool(chi2.logsf(statistic, len(places)) < norm.logsf(STANDARD_ERRORS) + np.log(2))


def _change(fit: ExplanationFit, name: str) -> float:
    """Largest change of a derivative of the card by an effect, in standard errors of the card."""
    card = fit.hypothesis.card
    values = next(values for effect, values, _ in estimates(fit) if effect == name)
    changes = [
        abs(after - card.derivatives.get(term, 0.0)) / error if (error := card.standard_error(term)) > 0 else np.inf
        for term, after, *_ in changed_derivatives(card, name, values, {})
    ]
    return max(changes, default=0.0)


def _change_of_gear(fit: ExplanationFit, name: str) -> float:
    """Change of the card's steering-gear data for the worse, in standard errors; infinite if the card states none."""
    ((_, values, _),) = [found for found in estimates(fit) if found[0] == name]
    ((key, value),) = values.items()
    worse = next((parameter.worse for parameter in EFFECTS[name].parameters if parameter.name == key), 0)
    stated = getattr(fit.hypothesis.card.steering_gear, key, None)
    if stated is None:
        return float(np.inf)
    change = float((value - stated) / (GEAR * stated))
    return change * worse if worse else abs(change)


_WINDOWS = (6, 12, 24, 48)
"""Lengths of the passages that are looked at, in blocks: 0.75 to 6 L/u0 (project choice)."""

RARE = {"passage": 3e-3, "period": 1e-12, "trial": 1e-6, "push": 1e-9}
"""Probability in all trials together below which noise is not an explanation (project choice, on synthetic trials
with nothing missing: innovations are not quite normal, nor quite white where waves or wind are coloured)."""

NEIGHBOURS = (3.0, 12.0)
"""A line is compared with the spectrum between these two distances on both sides, in steps of one over the length of
the longest run: beyond the width of the window's own peak."""

LOWEST = 4
"""Below this line of the padded spectrum are trends, which passages detect."""

PADDED = 512
"""Points of the periodograms: at least as many as blocks in a run, so that a line is not missed between two of them."""


def find_strangeness(likelihood: Likelihood, fit: ExplanationFit) -> tuple[Strange, ...]:
    """Places where the innovations of an explanation are not noise, the least probable first."""
    e = likelihood.innovations(fit)
    found = [*_passages(likelihood, e), *_periods(likelihood, e), *_disagreements(likelihood, fit)]
    found += _pushes(likelihood, fit)
    rare = [strange for strange in found if strange.excess > -2 * np.log(RARE[strange.kind])]
    return tuple(sorted(rare, key=lambda strange: -strange.excess))


def _passages(likelihood: Likelihood, e: Array) -> list[Strange]:
    """The strangest passage of each trial: sums of squares over windows, against chi squared.

    Noise of another colour than the filter's (waves) makes these sums vary more than they should, everywhere alike; the
    median of their spread gives the factor, by which their degrees of freedom are reduced (Satterthwaite).
    """
    motion = likelihood.motion
    squares, counts = (e**2).sum(axis=2), likelihood.known.sum(axis=2)
    strangest = {name: Strange("passage", name, 0.0, 0.0, -np.inf) for name in motion.names}
    for length in (window for window in _WINDOWS if window <= motion.blocks):
        sums, degrees = (
            np.array([np.convolve(run, np.ones(length), "valid") for run in rows]) for rows in (squares, counts)
        )
        whole = degrees > 0
        deviation = float(np.median(np.abs(sums[whole] - degrees[whole]))) / NORMAL_MEDIAN
        excess_spread = max(1.0, deviation**2 / (2 * float(np.mean(degrees[whole]))))
        log_p = np.where(whole, chi2.logsf(sums / excess_spread, np.maximum(degrees, 1) / excess_spread), 0.0)
        for run, name in enumerate(motion.names):
            place = int(np.argmin(log_p[run]))
            excess = float(np.minimum(-2 * (log_p[run, place] + np.log(counts.size)), MOST))
            if excess > strangest[name].excess:
                last = min(place + length, motion.lengths[run]) - 1  # a window may reach beyond a shorter run
                begin, end = motion.times[run][[place, last]]
                strangest[name] = Strange("passage", name, float(begin), float(end), excess)
    return list(strangest.values())


def _pushes(likelihood: Likelihood, fit: ExplanationFit) -> list[Strange]:
    """The passage of all trials with the largest unmodelled force, relative to its common size.

    Gusts and waves act at all times alike; a tug pushes once. The filter follows both, and its innovations show
    neither. A window holds as many independent values of the force as it holds twice its time constant.
    """
    motion, found = likelihood.motion, []
    states, spread = likelihood.smooth(fit)
    inside = motion.inside
    for axis, time in enumerate(fit.noise.force_s):
        squares = np.where(inside, states[..., 6 + axis] ** 2, 0.0)
        for length in (window for window in _WINDOWS[1:] if window <= motion.blocks):
            window = np.ones(length)
            sums = np.array([np.convolve(run, window, "valid") for run in squares])
            whole = np.array([np.convolve(run, window, "valid") for run in inside.astype(float)]) > length - 0.5
            if not whole.any():
                continue
            count = max(1.0, length * motion.block_s / (2 * time))
            known = np.array([np.convolve(run, window, "valid") for run in spread[..., axis, axis]])
            seen = whole & (sums > SEEN**2 * known)  # beyond the error of the smoother
            ratio = np.where(seen, sums / max(float(np.median(sums[whole])), 1e-300) * chi2.median(count), 0.0)
            run, place = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            log_p = chi2.logsf(ratio[run, place], count) + np.log(FORCE_STATES * inside.sum() / length)
            begin, end = motion.times[run][[place, place + length - 1]]
            excess = float(min(-2 * log_p, MOST))
            found.append(Strange("push", motion.names[run], float(begin), float(end), excess))
    return sorted(found, key=lambda push: -push.excess)[:1]


SEEN = 3.0
"""An unmodelled force counts if it exceeds this many of its standard deviations."""

NORMAL_MEDIAN = 0.6745
"""Median of the absolute deviation of a normal variable, in its standard deviations."""

MOST = 1e4
"""Upper limit of an excess: smaller probabilities underflow."""


def _periods(likelihood: Likelihood, e: Array) -> list[Strange]:
    """The strongest line in each signal's spectrum, of the innovations of all trials: means of as many exponentials.

    A line exceeds its neighbourhood; waves and gusts have a broad band, which is noise.
    """
    motion, found = likelihood.motion, []
    size = max(PADDED, motion.blocks)
    near, far = (round(width * size / motion.blocks) for width in NEIGHBOURS)
    ring = np.concatenate([np.ones(far - near), np.zeros(2 * near + 1), np.ones(far - near)])
    for signal in range(e.shape[2]):
        spectra = []
        for run, length in enumerate(motion.lengths):
            window = np.hanning(length)
            known = likelihood.known[run, :length, signal]
            if known.any():
                shown = np.abs(np.fft.rfft(e[run, :length, signal] * window, size)) ** 2
                spectra.append(shown / np.sum(window[known] ** 2))
        if not spectra:
            continue
        mean = np.mean(spectra, axis=0)
        around = np.convolve(np.pad(mean, far, mode="reflect"), ring / ring.sum(), "valid")
        above = (mean / np.maximum(around, 1.0))[LOWEST:]
        place = int(np.argmax(above))
        log_p = gamma.logsf(len(spectra) * above[place], len(spectra)) + np.log(mean.size * e.shape[2])
        period = size * motion.block_s / (LOWEST + place)
        found.append(Strange("period", "", period, period, float(min(-2 * log_p, MOST))))
    return found


def _disagreements(likelihood: Likelihood, fit: ExplanationFit) -> list[Strange]:
    """The trial that is furthest from the others about a parameter, where they disagree: Cochran's Q."""
    found = []
    for values in each_trial(likelihood, fit).values():
        if len(values) < 2:
            continue
        consistency = trial_consistency(values)
        name = max(values, key=lambda trial: abs(values[trial][0] - consistency.mean) / values[trial][1])
        times = likelihood.motion.times[likelihood.motion.names.index(name)]
        excess = float(min(-2 * np.log(max(consistency.p, 1e-300)), MOST))
        last = likelihood.motion.lengths[likelihood.motion.names.index(name)] - 1
        found.append(Strange("trial", name, float(times[0]), float(times[last]), excess))
    return found
