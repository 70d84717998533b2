"""Checks of a named effect: against a mere refit, trial by trial, and the agreement of the trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.reading import revised
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, difference_slopes, input_record
from tank2sim.gap.result import AMBIGUOUS, MISSING, Gap, Passed, misfit_of
from tank2sim.identification.trials.methods.gauss_newton import least_squares_steps
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.notices import Notice, caution

_LINEAR = ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd", "Xu")
"""Terms of the linear black box: sway velocity, yaw rate and rudder in Y and N, speed in X."""

_STEPS = 4
"""Gauss-Newton steps of a fit; the last one begins at the result of another."""

TRIED = 3
"""Terms that are fitted to choose one of them (project choice: far from the truth the linearised gain errs)."""

MUCH = 3.0
"""Misfit in noise units beyond which a name must reduce the gap (project choice): below, noise is most of it."""

CLOSES = 0.9
"""Largest ratio of the misfit after to that before, as the median over all signals of all trials (project choice)."""

REMAINS = 1.5
"""Misfit in noise units from which a gap remains and is reported (project choice): the misfit beyond the noise is then
as large as the noise, sqrt(1.5^2 - 1) = 1.1."""

NEAR_NOISE = 1.2
"""Misfit in noise units up to which no simulation is closer than another (project choice): many coefficients follow a
few trials a little better than they should."""

ACTS_FROM = 0.3
"""Root mean square difference of two simulations, in noise units, from which an effect acts in a trial (project choice:
far less than shows): a stall shows in hard turns alone."""

REACH = 1e-3
"""Differences by a coefficient are taken over this share of the largest linear one (project choice: rounding and
curvature are both far below the noise)."""


@dataclass(frozen=True)
class BlackBox:
    """A linear model fitted in place of an effect.

    Parameters
    ----------
    card : SteeredCard
        The given one with some linear derivatives changed.
    values : mapping
        Name of each changed derivative to its change, prime.
    """

    card: SteeredCard
    values: Mapping[str, float]


def black_box(card: SteeredCard, measured: Measured, noise: Mapping[str, float], count: int) -> BlackBox:
    """Fit a linear black box: as many terms of :data:`_LINEAR` as an effect has parameters.

    The terms are chosen one after another by their gain, and fitted by output error to the whole trials; at the end
    the initial states are estimated and the terms fitted again. The minimised quantity is the reported misfit, so that
    the black box follows the trials as well as it can.

    Parameters
    ----------
    card : SteeredCard
        As given.
    measured : Measured
        Fitting trials only.
    noise : mapping
        Variable to the standard deviation of one reading, SI.
    count : int
        Number of terms, at most as in :data:`_LINEAR`.
    """
    replayer = Replayer(card, measured.driven_by, noise)
    fit = _Fit(replayer, [input_record(replayer, trial) for trial in measured.trials])
    linear = tuple(name for name in _LINEAR if f"derivatives.{name}" in replayer.model)
    reach = REACH * max(abs(card.derivatives.get(name, 0.0)) for name in linear)
    if count <= 0 or not np.isfinite(fit.misfit((), np.zeros(0))).all():
        return BlackBox(card, {})
    names: tuple[str, ...] = ()
    found = np.zeros(0)
    while len(names) < min(count, len(linear)):
        names, found = _add_term(fit, names, found, linear, reach)
    fit.update_starts(names, found)
    found = fit.minimise(names, found, reach)[0]
    values = dict(zip(names, map(float, found), strict=True))
    derivatives = {
        name: (card.derivatives.get(name, 0.0) + change, card.standard_error(name)) for name, change in values.items()
    }
    return BlackBox(revised(card, derivatives, comment="linear black box"), values)


def _add_term(
    fit: _Fit, names: tuple[str, ...], values: Array, linear: Sequence[str], reach: float
) -> tuple[tuple[str, ...], Array]:
    """The terms with an additional one, and their changes: the best of the :data:`TRIED` with most linearised gain."""
    remaining = [name for name in linear if name not in names]
    every = (*names, *remaining)
    at = np.append(values, np.zeros(len(remaining)))
    residual = fit.misfit(every, at)
    slopes = difference_slopes(lambda changes: fit.misfit(every, changes), at, residual, np.full(len(every), reach))
    costs = []
    for place in range(len(names), len(every)):
        J = slopes[:, [*range(len(names)), place]]
        unexplained = residual - J @ np.linalg.lstsq(J, residual, rcond=None)[0]
        costs.append(float(unexplained @ unexplained))
    tried = [(*names, remaining[place]) for place in np.argsort(costs)[:TRIED]]
    fits = [(terms, *fit.minimise(terms, np.append(values, 0.0), reach)) for terms in tried]
    best, changes, _ = min(fits, key=lambda candidate: candidate[2])
    return best, changes


class _Fit:
    """Residuals of all trials, in noise units, by changes of derivatives."""

    def __init__(self, replayer: Replayer, records: Sequence[InputRecord]):
        self.replayer, self.records = replayer, records
        # From the first seconds: an initial state fitted with a wrong model would compensate its errors.
        p = replayer.model.parameter_values()
        self.starts = [replayer.guess_initial_state(record, p) for record in records]

    def update_starts(self, names: Sequence[str], changes: Array) -> None:
        """Find the initial states and the instants of the orders again."""
        p = self._parameters(names, changes)
        fits = [self.replayer.fit_record(record, p) for record in self.records]
        self.records, self.starts = [record for record, _ in fits], [start for _, start in fits]

    def misfit(self, names: Sequence[str], changes: Array) -> Array:
        """(Simulated less measured)/noise of all measurements."""
        p = self._parameters(names, changes)
        pairs = zip(self.records, self.starts, strict=True)
        return np.concatenate([self.replayer.away(record, start, p) for record, start in pairs])

    def minimise(self, names: Sequence[str], start: Array, reach: float) -> tuple[Array, float]:
        """Changes of least misfit, and its sum of squares."""

        def misfit(changes: Array) -> Array:
            return self.misfit(names, changes)

        def slopes(at: Array, residual: Array) -> Array:
            return difference_slopes(misfit, at, residual, np.full(len(at), reach))

        at, residual = least_squares_steps(misfit, (start, misfit(start)), slopes, _STEPS, 1e-3)
        return at, float(residual @ residual)

    def _parameters(self, names: Sequence[str], changes: Array) -> Array:
        model = self.replayer.model
        moved = {f"derivatives.{name}": change for name, change in zip(names, changes, strict=True)}
        return model.parameter_values({name: model.defaults[name] + float(change) for name, change in moved.items()})


def closes_gap(passed: Sequence[Passed], limit: float = CLOSES) -> bool:
    """Whether the improved card follows the trials better: a name that does not reduce the gap is a guess.

    All trials together must be missed by less. Where they are missed by far (:data:`MUCH`), also by the median ratio of
    misfits after and before, for one diverging simulation would dominate a mean: over all signals of all trials in
    which the simulations differ by :data:`ACTS_FROM`, for an effect may act in few of them, and that one of them misses
    by :data:`REMAINS`. Near the noise (:data:`NEAR_NOISE`) neither is closer. `limit` is the largest median.
    """
    before, after = (misfit_of(passed, version) for version in ("before", "after"))
    if before < NEAR_NOISE and after < NEAR_NOISE:
        return True
    if after >= before and np.isfinite(before):
        return False
    if min(before, after) < MUCH:
        return True
    changed = [
        _ratio(replay.misfit("before", name), replay.misfit("after", name))
        for replay in passed
        for name in replay.seen
        if max(replay.misfit("before", name), replay.misfit("after", name)) > REMAINS and _differs(replay, name)
    ]
    return bool(changed and np.median(changed) < limit)


def _ratio(before: float, after: float) -> float:
    """Misfit after to that before, which may be infinite."""
    if before == after:
        return 1.0
    return after / before if np.isfinite(before) else 0.0


def _differs(replay: Passed, name: str) -> bool:
    """Whether simulations before and after differ in a signal where it was measured."""
    known = np.isfinite(replay.measured[name])
    before, after = replay.before[name][known], replay.after[name][known]
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        return True
    return bool(np.sqrt(np.mean(np.square((after - before) / replay.noise[name]))) > ACTS_FROM)


def worse_trials(passed: Sequence[Passed], tolerance: float = 0.05) -> tuple[str, ...]:
    """Names of the trials that the improved card follows worse than the given one, by more than chance.

    Parameters
    ----------
    passed : sequence of Passed
        Fitting and held-out trials alike.
    tolerance : float
        Share of the misfit before (at least of 1, the noise) by which the misfit after may be larger. The default of
        0.05 is a project choice: the estimated size of a true effect is not exact either.
    """
    pairs = [(replay.name, replay.misfit("before"), replay.misfit("after")) for replay in passed]
    return tuple(name for name, before, after in pairs if after > before + tolerance * max(before, 1.0))


_BETTER = 0.05
"""A black box follows better if its misfit is smaller by this share (project choice), as in :func:`worse_trials`."""


IMPOSSIBLE = 10.0
"""Standard errors of the given card beyond which a coefficient is not off by chance (project choice: those of cards
whose errors are true move by up to 4)."""


NEAR_A_BOUND = 1e-4
"""Share of the range of a parameter within which it lies at a bound (project choice: a search ends there exactly)."""


def proof_cautions(gap: Gap) -> tuple[Notice, ...]:
    """Objections to a verdict: coefficients further off than their errors allow, sizes at the bound of what is
    possible, the remaining share of the gap, and a mere refit that follows better.

    The last two are of a name, by the held-out trials, or by the fitting ones where none was held out. The share that
    remains is the root of the mean square beyond the noise after, over that before.
    """
    return (*_impossible_coefficients(gap), *_impossible_sizes(gap), *_cautions_of_name(gap))


def _impossible_coefficients(gap: Gap) -> tuple[Notice, ...]:
    farthest = max(gap.coefficients, key=lambda coefficient: coefficient.moved, default=None)
    if farthest is None or farthest.moved < IMPOSSIBLE:
        return ()
    return (
        caution(
            f"{farthest.name} is {farthest.moved:.0f} of its standard errors from the given card: the card may be of "
            "another ship or loading, have a number or sign in another unit or convention, or state too small errors; "
            "what is named may be due to that"
        ),
    )


def _impossible_sizes(gap: Gap) -> tuple[Notice, ...]:
    """Amplitudes at a bound of their parameter."""
    found = []
    for effect in gap.effects:
        for parameter in EFFECTS[effect.name].parameters:
            value = effect.parameters.get(parameter.name)
            bounds = parameter.lowest(gap.card), parameter.maximum
            if value is None or parameter.absent is None or parameter.absent in bounds:
                continue
            if min(abs(value - bound) for bound in bounds) < NEAR_A_BOUND * (bounds[1] - bounds[0]):
                found.append(
                    caution(
                        f"{parameter.name} of {effect.name} lies at the bound of what is possible: the card may be of "
                        "another ship or have numbers in other units"
                    )
                )
    return tuple(found)


def _cautions_of_name(gap: Gap) -> tuple[Notice, ...]:
    held = any(replay.held_out for replay in gap.passed)
    before, after, box = (gap.misfit(version, held_out=held) for version in ("before", "after", "black_box"))
    if gap.verdict not in (MISSING, AMBIGUOUS) or not gap.effects or before is None or after is None:
        return ()
    group, notices = f"the {'held-out' if held else 'fitting'} trials", []
    if round(after, 6) > REMAINS:
        begin = "named, but" if gap.verdict == MISSING else "with the best of them"
        notices.append(caution(_what_remains(before, after, group, begin)))
    if box is not None and box < (1 - _BETTER) * after:
        notices.append(
            caution(
                f"a linear black box with as many coefficients follows {group} better (misfit {box:.3g} against "
                f"{after:.3g}): the name explains less than a mere refit does"
            )
        )
    return tuple(notices)


def _what_remains(before: float, after: float, group: str, begin: str) -> str:
    if not np.isfinite(after):
        return f"{begin} the simulation of one of {group} diverges: something more is missing, or the form differs"
    share = np.sqrt((after**2 - 1) / (before**2 - 1)) if before > 1 else np.inf
    much = f"{100 * share:.0f} % of the gap of {group} remains" if share < 1 else f"the gap of {group} is not smaller"
    return (
        f"{begin} {much} (misfit {after:.3g} in noise units, before {before:.3g}): something more is missing, or its "
        "form differs"
    )
