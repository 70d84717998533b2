"""Whether a named effect deserves its name: against a mere refit, trial by trial, and whether the trials agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import revised
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, difference_slopes, downhill, input_record
from tank2sim.gap.result import AMBIGUOUS, MISSING, Gap, Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS

_LINEAR = ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd", "Xu")
"""Terms of the linear black box: sway velocity, yaw rate and rudder in Y and N, speed in X."""

_STEPS = 4
"""Gauss-Newton steps of a fit; the last one begins where another ended."""

TRIED = 3
"""Terms that are fitted to choose one of them (ours: far from the truth the linearised gain errs)."""

MUCH = 3.0
"""Misfit in noise units beyond which a name must close something of the gap (project choice): below, noise is most of
it."""

CLOSES = 0.9
"""Share of the misfit before that may be left after, in the middle of all signals of all trials (project choice)."""

REACH = 1e-3
"""Differences by a coefficient are taken over this share of the largest linear one (ours: rounding and curvature are
both far below the noise)."""


@dataclass(frozen=True)
class BlackBox:
    """A linear model fitted in place of an effect.

    Parameters
    ----------
    card : ManoeuvringCard
        The given one with some linear derivatives changed.
    values : mapping
        Name of each changed derivative to its change, prime.
    """

    card: ManoeuvringCard
    values: Mapping[str, float]


def black_box(card: ManoeuvringCard, measured: Measured, noise: Mapping[str, float], count: int) -> BlackBox:
    """What a mere refit would reach: as many linear terms of :data:`_LINEAR` as an effect has parameters.

    The terms are chosen one after another by what they gain, and fitted by output error to the whole trials; at the end
    the initial states are settled and the terms fitted again. What is made least is the very misfit that is shown
    afterwards, so that the black box does as well as it can.

    Parameters
    ----------
    card : ManoeuvringCard
        As given.
    measured : Measured
        Fitting trials only.
    noise : mapping
        Variable to the standard deviation of one reading, SI.
    count : int
        Number of terms, at most those of :data:`_LINEAR`.
    """
    replayer = Replayer(card, measured.driven_by, [name for name in OBSERVED_SIGNALS.values() if name in noise])
    fit = _Fit(replayer, [input_record(replayer, trial) for trial in measured.trials], noise)
    linear = tuple(name for name in _LINEAR if f"derivatives.{name}" in replayer.model)
    reach = REACH * max(abs(card.derivatives.get(name, 0.0)) for name in linear)
    if count <= 0 or not np.isfinite(fit.misfit((), np.zeros(0))).all():
        return BlackBox(card, {})
    names: tuple[str, ...] = ()
    found = np.zeros(0)
    while len(names) < min(count, len(linear)):
        names, found = _one_more(fit, names, found, linear, reach)
    fit.settle(names, found)
    found = fit.found(names, found, reach)[0]
    values = dict(zip(names, map(float, found), strict=True))
    derivatives = {
        name: (card.derivatives.get(name, 0.0) + change, card.standard_error(name)) for name, change in values.items()
    }
    return BlackBox(revised(card, derivatives, comment="linear black box"), values)


def _one_more(
    fit: _Fit, names: tuple[str, ...], values: Array, linear: Sequence[str], reach: float
) -> tuple[tuple[str, ...], Array]:
    """The terms with one more, and their changes: the best of the :data:`TRIED` that promise most if it were linear."""
    rest = [name for name in linear if name not in names]
    every = (*names, *rest)
    at = np.append(values, np.zeros(len(rest)))
    there = fit.misfit(every, at)
    slopes = difference_slopes(lambda changes: fit.misfit(every, changes), at, there, np.full(len(every), reach))
    left = []
    for place in range(len(names), len(every)):
        J = slopes[:, [*range(len(names)), place]]
        unexplained = there - J @ np.linalg.lstsq(J, there, rcond=None)[0]
        left.append(float(unexplained @ unexplained))
    tried = [(*names, rest[place]) for place in np.argsort(left)[:TRIED]]
    fits = [(one, *fit.found(one, np.append(values, 0.0), reach)) for one in tried]
    best, changes, _ = min(fits, key=lambda one: one[2])
    return best, changes


class _Fit:
    """Residuals of all trials, in noise units, by changes of derivatives."""

    def __init__(self, replayer: Replayer, records: Sequence[InputRecord], noise: Mapping[str, float]):
        self.replayer, self.records = replayer, records
        self.sigma = np.array([noise[name] for name in replayer.seen])
        # As read off the first seconds: an initial state that suits a wrong model keeps it where it is.
        p = replayer.model.parameter_values()
        self.starts = [replayer.first(record, self.sigma, p) for record in records]

    def settle(self, names: Sequence[str], changes: Array) -> None:
        """Find the initial states again."""
        p = self._parameters(names, changes)
        self.starts = [self.replayer.settled(record, self.sigma, p) for record in self.records]

    def misfit(self, names: Sequence[str], changes: Array) -> Array:
        """(Simulated less measured)/noise of all that was measured."""
        p = self._parameters(names, changes)
        parts = []
        for record, start in zip(self.records, self.starts, strict=True):
            residual = (self.replayer.motion(record, start, p) - record.readings) / self.sigma
            parts.append(residual[~np.isnan(record.readings)])
        return np.concatenate(parts)

    def found(self, names: Sequence[str], start: Array, reach: float) -> tuple[Array, float]:
        """Changes of least misfit, and its sum of squares."""

        def misfit(changes: Array) -> Array:
            return self.misfit(names, changes)

        at, there = start, misfit(start)
        for _ in range(_STEPS):
            before = float(there @ there)
            at, there = downhill(misfit, at, there, difference_slopes(misfit, at, there, np.full(len(at), reach)))
            if before - float(there @ there) < 1e-3 * before:
                break
        return at, float(there @ there)

    def _parameters(self, names: Sequence[str], changes: Array) -> Array:
        model = self.replayer.model
        values = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
        moved = {f"derivatives.{name}": change for name, change in zip(names, changes, strict=True)}
        return model.parameter_values({name: values[name] + float(change) for name, change in moved.items()})


def closes(passed: Sequence[Passed]) -> bool:
    """Whether the improved card follows the trials any better: a name that closes nothing of the gap is a guess.

    By the middle of the ratios of misfits after and before, over all signals of all trials, for a simulation that runs
    away in one of them outweighs all others in a mean.
    """
    rms = [np.array([replay.misfit(which) for replay in passed]) for which in ("before", "after")]
    if min(np.sqrt(np.mean(one**2)) for one in rms) < MUCH:
        return True
    shown = [(replay, name) for replay in passed for name in replay.noise if np.isfinite(replay.measured[name]).any()]
    pairs = [(one.misfit("before", name), one.misfit("after", name)) for one, name in shown]
    ratios = [1.0 if before == after else after / before if np.isfinite(before) else 0.0 for before, after in pairs]
    return bool(np.median(ratios) < CLOSES)


def worse(passed: Sequence[Passed], tolerance: float = 0.05) -> tuple[str, ...]:
    """Names of the trials that the improved card follows worse than the given one, by more than chance.

    Parameters
    ----------
    passed : sequence of Passed
        Fitting and held-out trials alike.
    tolerance : float
        Share of the misfit before (at least of 1, the noise) by which the misfit after may be larger. The default of
        0.05 is ours: the estimated size of a true effect is not exact either.
    """
    pairs = [(replay.name, replay.misfit("before"), replay.misfit("after")) for replay in passed]
    return tuple(name for name, before, after in pairs if after > before + tolerance * max(before, 1.0))


REMAINS = 1.5
"""Misfit in noise units from which a part of the gap is said to remain (project choice): what is left beyond the
noise is then as large as the noise, sqrt(1.5^2 - 1) = 1.1."""

EVEN = 0.5
"""A probability below which the opposite is likelier."""

_BETTER = 0.05
"""A black box follows better if its misfit is smaller by this share (project choice), as in :func:`worse`."""


def proof_cautions(gap: Gap) -> tuple[str, ...]:
    """What is to be said against a name: how much of the gap remains, and whether a mere refit does better.

    Both are asked of the held-out trials, or of the fitting ones where none was held out. The share that remains is the
    root of the mean square beyond the noise after, over that before.
    """
    held = any(replay.held_out for replay in gap.passed)
    before, after, box = (gap.misfit(which, held_out=held) for which in ("before", "after", "black_box"))
    if gap.verdict not in (MISSING, AMBIGUOUS) or not gap.effects or before is None or after is None:
        return ()
    of, told = f"the {'held-out' if held else 'fitting'} trials", []
    least = min(gap.effects, key=lambda one: one.confidence)
    if gap.verdict == MISSING and least.confidence < EVEN:
        told.append(
            f"{least.name} is named as the simplest explanation, but those without it are likelier together: its "
            f"probability is {least.confidence:.2g}"
        )
    if round(after, 6) > REMAINS:
        told.append(
            _what_remains(before, after, of, "named, but" if gap.verdict == MISSING else "with the best of them")
        )
    if box is not None and box < (1 - _BETTER) * after:
        told.append(
            f"a linear black box with as many coefficients follows {of} better (misfit {box:.3g} against {after:.3g}): "
            "the name explains less than a mere refit does"
        )
    return tuple(told)


def _what_remains(before: float, after: float, of: str, begin: str) -> str:
    if not np.isfinite(after):
        return f"{begin} the simulation of one of {of} runs away: something more is missing, or the form differs"
    share = np.sqrt((after**2 - 1) / (before**2 - 1)) if before > 1 else np.inf
    much = f"{100 * share:.0f} % of the gap of {of} remains" if share < 1 else f"the gap of {of} is no smaller"
    return (
        f"{begin} {much} (misfit {after:.3g} in noise units, before {before:.3g}): something more is missing, or its "
        "form differs"
    )


OUTLYING = 3.0
"""A trial is named as an outlier if it lies this many standard errors from what all others say (project choice)."""


@dataclass(frozen=True)
class TrialConsistency:
    """Whether trials, each for itself, want the same value.

    Parameters
    ----------
    mean, standard_error : float
        Weighted by the inverse squares of the standard errors.
    q, p : float
        Cochran's Q, and the probability of one as large if all trials have the same true value.
    outliers : tuple of str
        Trials that lie :data:`OUTLYING` standard errors or more from all the others, the farthest first.
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
        raise ValueError("no trial tells the value")
    values, errors = np.array(list(kept.values())).T
    weights = errors**-2.0
    mean = float(weights @ values / weights.sum())
    q = float(weights @ (values - mean) ** 2)
    p = float(chi2.sf(q, len(kept) - 1)) if len(kept) > 1 else 1.0
    away = {}
    if len(kept) > 1:
        others = weights.sum() - weights
        rest = (weights @ values - weights * values) / others
        z = np.abs(values - rest) / np.sqrt(1 / weights + 1 / others)
        away = dict(zip(kept, map(float, z), strict=True))
    outliers = sorted((name for name, z in away.items() if z >= OUTLYING), key=lambda name: -away[name])
    return TrialConsistency(mean, float(weights.sum() ** -0.5), q, p, tuple(outliers))
