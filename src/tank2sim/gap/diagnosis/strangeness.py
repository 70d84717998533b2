"""Where the innovations of an explanation are not noise: a passage, a push, a period, a trial of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri

from tank2sim.arrays import Array
from tank2sim.gap.diagnosis.residuals import each_trial
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.kalman_filter import FORCE_STATES
from tank2sim.gap.inference.likelihood import Likelihood


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


def _log_chance(statistic: Array, degrees: Array | float) -> Array:
    """Logarithm of the probability that chi squared of these degrees of freedom is larger (as the arguments)."""
    with np.errstate(divide="ignore"):
        logarithm: Array = np.log(chdtrc(degrees, statistic))
    return logarithm


def _window_sums(rows: Array, length: int) -> Array:
    """Sums over each window of a length (R, T - length + 1) of rows (R, T)."""
    return np.array([np.convolve(row, np.ones(length), "valid") for row in rows])


def _passages(likelihood: Likelihood, e: Array) -> list[Strange]:
    """The strangest passage of each trial: sums of squares over windows, against chi squared.

    Noise of another colour than the filter's (waves) makes these sums vary more than they should, everywhere alike; the
    median of their spread gives the factor, by which their degrees of freedom are reduced (Satterthwaite).
    """
    motion = likelihood.motion
    squares, counts = (e**2).sum(axis=2), likelihood.known.sum(axis=2)
    strangest = {name: Strange("passage", name, 0.0, 0.0, -np.inf) for name in motion.names}
    for length in (window for window in _WINDOWS if window <= motion.blocks):
        sums, degrees = _window_sums(squares, length), _window_sums(counts, length)
        whole = degrees > 0
        deviation = float(np.median(np.abs(sums[whole] - degrees[whole]))) / NORMAL_MEDIAN
        excess_spread = max(1.0, deviation**2 / (2 * float(np.mean(degrees[whole]))))
        log_p = np.where(whole, _log_chance(sums / excess_spread, np.maximum(degrees, 1) / excess_spread), 0.0)
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
            sums = _window_sums(squares, length)
            whole = _window_sums(inside.astype(float), length) > length - 0.5
            if not whole.any():
                continue
            count = max(1.0, length * motion.block_s / (2 * time))
            known = SEEN**2 * _window_sums(spread[..., axis, axis], length)
            seen = whole & (sums > known)  # beyond the error of the smoother
            ratio = np.where(seen, sums / max(float(np.median(sums[whole])), 1e-300) * chdtri(count, 0.5), 0.0)
            run, place = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            log_p = _log_chance(ratio[run, place], count) + np.log(FORCE_STATES * inside.sum() / length)
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
        log_p = _log_chance(2 * len(spectra) * above[place], 2 * len(spectra)) + np.log(mean.size * e.shape[2])
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


OUTLYING = 3.0
"""A trial is named as an outlier if it is this many standard errors from the mean of all others (project choice)."""


@dataclass(frozen=True)
class TrialConsistency:
    """Agreement of the estimates of single trials.

    Parameters
    ----------
    mean, standard_error : float
        Weighted by the inverse squares of the standard errors.
    q, p : float
        Cochran's Q, and the probability of one as large if all trials have the same true value.
    outliers : tuple of str
        Trials that are :data:`OUTLYING` standard errors or more from all the others, the farthest first.
    """

    mean: float
    standard_error: float
    q: float
    p: float
    outliers: tuple[str, ...]


def trial_consistency(trials: Mapping[str, tuple[float, float]]) -> TrialConsistency:
    """Cochran's Q of estimates from single trials.

    Cochran (1954), The combination of estimates from different experiments, Biometrics 10: Q = sum w (value - mean)^2
    with w = 1/standard error^2 is chi-square distributed with one degree of freedom less than there are trials.

    Parameters
    ----------
    trials : mapping
        Name of a trial to (value, standard error); the error is positive. One without a finite error is left out.

    Raises
    ------
    ValueError
        No trial has a finite standard error.
    """
    kept = {name: pair for name, pair in trials.items() if np.isfinite(pair).all()}
    if not kept:
        raise ValueError("no trial determines the value")
    values, errors = np.array(list(kept.values())).T
    weights = errors**-2.0
    mean = float(weights @ values / weights.sum())
    q = float(weights @ (values - mean) ** 2)
    p = float(chdtrc(len(kept) - 1, q)) if len(kept) > 1 else 1.0
    away = {}
    if len(kept) > 1:
        remaining_weights = weights.sum() - weights
        remaining_mean = (weights @ values - weights * values) / remaining_weights
        z = np.abs(values - remaining_mean) / np.sqrt(1 / weights + 1 / remaining_weights)
        away = dict(zip(kept, map(float, z), strict=True))
    outliers = sorted((name for name, z in away.items() if z >= OUTLYING), key=lambda name: -away[name])
    return TrialConsistency(mean, float(weights.sum() ** -0.5), q, p, tuple(outliers))
