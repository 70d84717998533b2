"""What may be said of the scores: a name, none, several names, or that nothing in the library fits.

An explanation needs a score well below that of "none"; a second effect one well below that of the best single effect.
All that is as good as the best is named next to it. And something always fits: where the innovations of the best
explanation are not noise, a name would be a guess, and is withheld.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2, gamma

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
"""By how much the score must fall for an effect more: odds of exp(5) = 150 to 1 in its favour, "very strong" by Kass
and Raftery (1995), Bayes Factors, J. Am. Stat. Assoc. 90, whose 2 log(odds) this is."""

ALIKE = EVIDENCE_NEEDED
"""Explanations within this of the best are as good."""

OF_ONE_KIND = {"actuator": 0.25, "force": 0.1}
"""Share of the whole gain that a second effect of the same kind must have (project choice): less is what the first
one's formula may be wrong by, beyond what :data:`.forms.FORM` covers."""

LIKELY = 0.5
"""A name less probable than this is none (project choice): then all that have :data:`RIVAL` of its probability are
named."""

RIVAL = 0.1
"""Share of the best name's probability that makes another one its rival (project choice): odds of 10 to 1, from which
Jeffreys (1961), Theory of Probability, calls evidence strong."""

STANDARD_ERRORS = 3.0
"""An effect is named if its size exceeds so many of its standard errors."""

TEMPER = 3.0
"""Scores are divided by this before they become probabilities (project choice): trials have less to say than their
scores, for noise has colour and formulas have errors. benchmarks/gap.py prints what was claimed next to what was
there."""


SUREST = 0.99
"""No name is surer than this: something outside the library may look like it (project choice)."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What is said.

    Parameters
    ----------
    verdict : str
        One of :data:`.result.VERDICTS`.
    best : ExplanationFit
        The explanation that is named, "none" among them; the best of all where a name is withheld.
    alike : tuple of ExplanationFit
        Others that are as good.
    probabilities : mapping
        Of each explanation that was fitted, by its effects.
    strange : tuple of Strange
        Where the innovations of the best are not noise.
    """

    verdict: str
    best: ExplanationFit
    alike: tuple[ExplanationFit, ...]
    probabilities: dict[tuple[str, ...], float]
    strange: tuple[Strange, ...]

    def confidence(self, effect: str) -> float:
        """Probability that an effect is among what is missing."""
        return _confidence(self.probabilities, effect)


@dataclass(frozen=True)
class Strange:
    """A place where the innovations are not noise.

    Parameters
    ----------
    what : str
        ``passage`` or ``push`` (a time in one trial, by innovations or by the force that is left over), ``trial`` (a
        whole one) or ``period`` (an oscillation in all).
    trial : str
        Empty for a period.
    begin_s, end_s : float
        In the trial's own time; for a period both are its length.
    excess : float
        -2 log of the probability that noise does as much anywhere, as a score.
    """

    what: str
    trial: str
    begin_s: float
    end_s: float
    excess: float


def decide(search: Search) -> Decision:
    """What the scores of a search allow to say."""
    none = search.none
    best = none
    single = next((fit for fit in search.fits if len(fit.explained.effects) == 1 and stands_out(fit)), None)
    pair = next((fit for fit in search.fits if len(fit.explained.effects) == 2 and stands_out(fit)), None)
    if single is not None and single.score < none.score - EVIDENCE_NEEDED:
        best = single
    if pair is not None:
        worth = max(EVIDENCE_NEEDED, _share(pair) * (none.score - pair.score))
        best = pair if pair.score < min(one.score for one in (best, single) if one is not None) - worth else best
    scores = np.array([fit.score for fit in search.fits]) / TEMPER
    weights = np.exp(-0.5 * scores - logsumexp(-0.5 * scores))
    probabilities = {fit.explained.effects: float(w) for fit, w in zip(search.fits, weights, strict=True)}
    behind = ALIKE
    if any(_confidence(probabilities, name) < LIKELY for name in best.explained.effects):
        behind = max(ALIKE, -2 * TEMPER * np.log(RIVAL))
    alike = tuple(
        fit
        for fit in search.fits
        if fit is not best
        and fit.score < best.score + behind
        and stands_out(fit)
        and not set(fit.explained.effects) > set(best.explained.effects)
        and len(fit.explained.effects) <= max(len(best.explained.effects), 1)
        and best is not none
    )
    strange = strangeness(search.likelihood, best)
    verdict = NO_EFFECT_MISSING if best is none else AMBIGUOUS if alike else MISSING
    return Decision(OUTSIDE_LIBRARY if strange else verdict, best, alike, probabilities, strange)


def _confidence(probabilities: Mapping[tuple[str, ...], float], effect: str) -> float:
    return float(min(sum(p for effects, p in probabilities.items() if effect in effects), SUREST))


def _share(pair: ExplanationFit) -> float:
    """Share of the whole gain that the second of two effects must have."""
    kinds = {EFFECTS[name].looks_like for name in pair.explained.effects}
    return OF_ONE_KIND.get(kinds.pop(), 0.0) if len(kinds) == 1 else 0.0


def stands_out(fit: ExplanationFit) -> bool:
    """Whether each effect has an amplitude that is more than :data:`STANDARD_ERRORS` from its absence.

    One that only changes derivatives of the card, or what it states of the steering gear, must change one of them by as
    many of *its* standard errors: less is what the card may be wrong by.
    """
    errors = np.sqrt(np.diag(fit.covariance))
    for name in fit.explained.effects:
        sizes = [
            abs(value - one.parameter.absent) / error if error > 0 else np.inf
            for one, value, error in zip(fit.explained.asked, fit.theta, errors, strict=True)
            if one.effect == name and one.parameter.absent is not None and one.parameter.default is None
        ]
        if sizes and max(sizes) < STANDARD_ERRORS:
            return False
        if EFFECTS[name].changes and _change(fit, name) < STANDARD_ERRORS:
            return False
        if EFFECTS[name].in_place_of and _change_of_gear(fit, name) < STANDARD_ERRORS:
            return False
    return True


def _change(fit: ExplanationFit, name: str) -> float:
    """Largest change of a derivative of the card by an effect, in standard errors of the card."""
    card = fit.explained.card
    values = next(values for effect, values, _ in estimates(fit) if effect == name)
    changes = [
        abs(after - card.derivatives.get(term, 0.0)) / error if (error := card.standard_error(term)) > 0 else np.inf
        for term, after, *_ in changed_derivatives(card, name, values, {})
    ]
    return max(changes, default=0.0)


def _change_of_gear(fit: ExplanationFit, name: str) -> float:
    """Change of what the card states of the steering gear, in its standard errors; infinite if it states nothing."""
    ((_, values, _),) = [one for one in estimates(fit) if one[0] == name]
    ((parameter, value),) = values.items()
    stated = getattr(fit.explained.card.steering_gear, parameter, None)
    return float(np.inf) if stated is None else float(abs(value - stated) / (GEAR * stated))


_WINDOWS = (6, 12, 24, 48)
"""Lengths of the passages that are looked at, in blocks: 0.75 to 6 L/u0 (project choice)."""

RARE = {"passage": 3e-3, "period": 1e-12, "trial": 1e-6, "push": 1e-9}
"""Probability in all trials together below which noise is no explanation (ours, on made-up trials with nothing missing:
innovations are not quite normal, and not quite white where the sea or the wind has a colour of its own)."""

NEIGHBOURS = (3.0, 12.0)
"""A line is compared with the spectrum from here to there on both sides, in steps of one over the length of the longest
run: beyond the width of the window's own peak."""

LOWEST = 4
"""Below this line of the padded spectrum are trends, which passages tell."""

PADDED = 512
"""Points of the periodograms: at least as many as blocks in a run, so that a line is not missed between two of them."""


def strangeness(likelihood: Likelihood, fit: ExplanationFit) -> tuple[Strange, ...]:
    """Where the innovations of an explanation are not noise, the strangest first."""
    e = likelihood.innovations(fit)
    found = [*_passages(likelihood, e), *_periods(likelihood, e), *_disagreements(likelihood, fit)]
    found += _pushes(likelihood, fit)
    rare = [one for one in found if one.excess > -2 * np.log(RARE[one.what])]
    return tuple(sorted(rare, key=lambda one: -one.excess))


def _passages(likelihood: Likelihood, e: Array) -> list[Strange]:
    """The strangest passage of each trial: sums of squares over windows, against chi squared.

    Noise of another colour than the filter's (waves) makes these sums vary more than they should, everywhere alike; by
    how much is given by the middle of their spread, and their degrees of freedom are fewer by as much
    (Satterthwaite).
    """
    motion = likelihood.motion
    squares, counts = (e**2).sum(axis=2), likelihood.known.sum(axis=2)
    strangest = {name: Strange("passage", name, 0.0, 0.0, -np.inf) for name in motion.names}
    for length in (window for window in _WINDOWS if window <= motion.blocks):
        sums, degrees = (
            np.array([np.convolve(run, np.ones(length), "valid") for run in one]) for one in (squares, counts)
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
    """The passage of all trials with the largest force that nobody modelled, next to what that force commonly is.

    Gusts and waves push at all times alike; a tug pushes once. The filter follows both, and its innovations tell
    neither. A window holds as many independent values of the force as it holds twice its time constant.
    """
    motion, found = likelihood.motion, []
    states, spread = likelihood.smoothed(fit)
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
            seen = whole & (sums > SEEN**2 * known)  # beyond what the smoother may be wrong by
            ratio = np.where(seen, sums / max(float(np.median(sums[whole])), 1e-300) * chi2.median(count), 0.0)
            run, place = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            log_p = chi2.logsf(ratio[run, place], count) + np.log(FORCE_STATES * inside.sum() / length)
            begin, end = motion.times[run][[place, place + length - 1]]
            excess = float(min(-2 * log_p, MOST))
            found.append(Strange("push", motion.names[run], float(begin), float(end), excess))
    return sorted(found, key=lambda one: -one.excess)[:1]


SEEN = 3.0
"""A force that nobody modelled counts if it exceeds so many of its own standard deviations."""

NORMAL_MEDIAN = 0.6745
"""Median of the absolute deviation of a normal variable, in its standard deviations."""

MOST = 1e4
"""An excess beyond this is this: probabilities that small underflow."""


def _periods(likelihood: Likelihood, e: Array) -> list[Strange]:
    """The strongest line in each signal's spectrum, of the innovations of all trials: means of as many exponentials.

    A line stands out from its own neighbourhood; waves and gusts have a band, and that is noise.
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
        said = trial_consistency(values)
        name = max(values, key=lambda one: abs(values[one][0] - said.mean) / values[one][1])
        times = likelihood.motion.times[likelihood.motion.names.index(name)]
        excess = float(min(-2 * np.log(max(said.p, 1e-300)), MOST))
        last = likelihood.motion.lengths[likelihood.motion.names.index(name)] - 1
        found.append(Strange("trial", name, float(times[0]), float(times[last]), excess))
    return found
