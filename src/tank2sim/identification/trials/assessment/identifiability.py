"""Identifiability of the free parameters by trials, before and after the fit.

The derivatives of an Abkowitz model drift: where sway and yaw are nearly proportional, as in every zigzag, only a
combination of ``Nv`` and ``Nr`` is determined (Hwang 1980, J. Ship Research 26; Abkowitz 1980, Trans. SNAME 88).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from tank2sim.arrays import Array, Unbounded
from tank2sim.cards.terms import Term, parse_term
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import correlation_matrix
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error, weights_of
from tank2sim.identification.trials.methods.weak_form import MEASURED_STATES, WeakForm
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, scaled_prior
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.notices import Notice

CLOSE_CORRELATION = 0.95
"""Correlation of a reported pair of parameters: their difference has 39 times the variance of their sum."""

WEAK = 0.1
"""Share of the prior's information below which the trials do not see a direction (project choice)."""

PART = 0.3
"""Least component of a direction for its parameter to be named (project choice)."""

_ALONE = 1e-6
"""Share of the prior's information that remains in "the data alone": it keeps matrices regular."""

LEAST_OF_LINEAR = 1e-3
"""The same measure for linear terms, which no other term replaces: terms absent from a linear model enlarge the
residuals and would hide a clear change of speed (project choice; a straight run shows 1e-24)."""

STILL = {"motion.u": 0.002, "motion.v": 0.002, "motion.r": 0.002, "rudder": 0.002}
"""Standard deviation below which a signal counts as constant: u, v over u0, r L/u0, rudder in rad (project choice:
0.1 deg of drift or rudder, a tenth of the smallest manoeuvre's)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class IdentifiabilityStudy:
    """How well the trials determine the parameters (k), in units of the prior's standard errors.

    Parameters
    ----------
    parameters : tuple of str
    condition : float
        Largest over smallest singular value.
    singular_values : array (k,)
        Of the weighted sensitivities, falling; below 1 the prior has more information than the trials.
    correlation : array (k, k)
        By the trials alone.
    correlated_pairs : tuple of (str, str, float)
        The closest first.
    unseen : tuple of tuple of str
        Combinations of parameters that the trials do not determine.
    notices : tuple of Notice
    """

    parameters: tuple[str, ...]
    condition: Unbounded
    singular_values: Array
    correlation: Array
    correlated_pairs: tuple[tuple[str, str, float], ...]
    unseen: tuple[tuple[str, ...], ...]
    notices: tuple[Notice, ...]


def identifiability(problem: Problem, estimate: Estimate) -> IdentifiabilityStudy:
    """Identifiability of the parameters after a fit, by the information of the estimate and its scale of the prior."""
    unit = scaled_prior(problem, estimate.prior_scale)
    information = estimate.information * np.outer(unit, unit)
    values, vectors = np.linalg.eigh(information)
    singular = np.sqrt(np.maximum(values, 0.0))[::-1]
    alone = correlation_matrix(np.asarray(np.linalg.inv(information + _ALONE * np.eye(len(unit))), dtype=np.float64))
    names = tuple(_short(name) for name in estimate.free)
    above = np.argwhere(np.triu(np.abs(alone) > CLOSE_CORRELATION, 1))
    pairs = sorted(((names[a], names[b], float(alone[a, b])) for a, b in above), key=lambda pair: -abs(pair[2]))
    unseen = _directions(names, vectors[:, values < WEAK])
    return IdentifiabilityStudy(
        parameters=names,
        condition=float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf,
        singular_values=singular,
        correlation=np.round(alone, 7),
        correlated_pairs=tuple(pairs),
        unseen=unseen,
        notices=(*_pair_messages(pairs), *_direction_messages(unseen)),
    )


def share_from_trials(problem: Problem, estimate: Estimate) -> Array:
    """Share of each parameter's information (k,) from the trials: 1 - (variance after / variance before)."""
    unit = scaled_prior(problem, estimate.prior_scale)
    after = np.linalg.inv(estimate.information * np.outer(unit, unit) + problem.known)
    return np.asarray(1 - np.diag(after) / np.diag(np.linalg.inv(problem.known)))


def refuse_unseen(problem: Problem) -> tuple[str, ...]:
    """Return the free parameters that the trials do not show; raise if a necessary one is among them.

    A manoeuvring trial must show sway, yaw and rudder: unseen linear derivatives of these are refused, and so are
    acceleration derivatives, which are free only on request. Other unseen parameters are returned, to be held at their
    prior means: a zigzag need not show the effect of speed, in particular without a log.

    A parameter is seen if a large change (:func:`_large`) moves the mean accelerations of the weak form by one standard
    deviation of the residuals, all windows taken together. A signal that moves no more than its noise counts as
    constant, and the constant part of a term that needs motion is not counted, because a constant force has the same
    effect.

    Raises InputError: With the refused parameters, and the motions that show them.
    """
    estimate = equation_error(problem, settings=EquationErrorSettings(rounds=2))
    form = WeakForm(problem)
    inverse = weights_of(form, form.at(estimate.values)).inverse
    quiet = WeakForm(problem.with_runs(tuple(_quietened(form, place) for place in range(len(problem.runs)))))
    jacobian = quiet.at(estimate.values).jacobian
    size = _large(problem, estimate.values)
    missing = []
    for place, name in enumerate(problem.free):
        term, column = parse_term(_short(name)), jacobian[:, :, place]
        if _needs_motion(term):
            column = column - column.mean(axis=0)
        shown = size[place] * inverse @ column.T
        if form.seen[place] and np.sum(shown**2) < (LEAST_OF_LINEAR if _linear(term) else 1.0):
            missing.append(name)
    refused = [name for name in missing if _needed(parse_term(_short(name)))]
    if refused:
        runs = ", ".join(dict.fromkeys(run.origin for run in problem.runs))
        raise InputError(runs, "", f"shows nothing of {', '.join(map(_short, refused))}", _remedy(refused))
    return tuple(missing)


def _needs_motion(term: Term | None) -> bool:
    """True for a derivative of a force that is zero straight ahead at the card's speed."""
    return term is not None and any((term.v, term.r, term.d, term.u))


def _needed(term: Term | None) -> bool:
    """True for a derivative that every manoeuvre shows, or that is free only on request."""
    return term is not None and (bool(term.acceleration) or (_linear(term) and not term.u))


def _large(problem: Problem, values: Array) -> Array:
    """A large change of each free parameter (k,): its prior error, its value, or the value of the largest linear
    derivative of the same force, whichever is largest. In the prime system terms of one force have coefficients of
    one size."""
    size = np.maximum(problem.prior_error, np.abs(values))
    model = problem.model.parameters_by_name(problem.parameters(values))
    terms = {name: term for name in model if (term := parse_term(_short(name))) is not None}
    for place, name in enumerate(problem.free):
        if name in terms and not terms[name].acceleration:
            same = [model[key] for key, term in terms.items() if term.force == terms[name].force and _linear(term)]
            size[place] = max(size[place], *np.abs(same), 0.0)
    return size


def _linear(term: Term | None) -> bool:
    return term is not None and not term.acceleration and term.v + term.r + term.d + term.u == 1


def _quietened(form: WeakForm, place: int) -> SampledRun:
    """A run in which every signal that moves no more than its noise is constant."""
    run, motion = form.runs[place].run, form.runs[place].motion
    model = form.problem.model
    speed, length = (model.defaults[f"ship.{name}"] for name in ("speed", "length"))
    signals = motion.smooth.copy()
    units = (speed, speed, speed / length)
    for column, (name, unit, noise) in enumerate(zip(MEASURED_STATES, units, motion.remaining_noise, strict=False)):
        if signals[:, column].std() < max(3 * noise, STILL[name] * unit):
            signals[:, column] = signals[:, column].mean()
    signals[np.isnan(motion.velocities).any(axis=1), :3] = np.nan
    inputs = run.inputs.copy()
    if "rudder.command" in model.input_names:
        rudder = inputs[:, model.input_names.index("rudder.command")]
        if rudder.std() < STILL["rudder"]:
            rudder[:] = rudder.mean()
    return replace(run, inputs=inputs, measured=signals, seen=MEASURED_STATES)


def _remedy(missing: list[str]) -> str:
    terms = [term for name in missing if (term := parse_term(_short(name))) is not None]
    motions = {"v": "sway", "r": "yaw", "d": "rudder", "u": "speed"}
    needed = [word for letter, word in motions.items() if any(getattr(term, letter) for term in terms)]
    verb = "changes" if len(needed) == 1 else "change"
    moving = f"add a run in which {_listed(needed)} {verb}, or " if needed else ""
    return f"{moving}hold them at the card's values: {' '.join(map(_short, missing))}"


def _directions(names: tuple[str, ...], vectors: Array) -> tuple[tuple[str, ...], ...]:
    """The parameters in each of the unseen directions (k, m), mixed so that each has as few as possible."""
    count = vectors.shape[1]
    if not count:
        return ()
    pivots = qr(vectors.T, pivoting=True, mode="r")[1][:count]
    mixture = vectors @ np.linalg.inv(vectors[pivots])
    mixture = mixture / np.abs(mixture).max(axis=0)
    return tuple(
        tuple(names[place] for place in np.argsort(-np.abs(column), kind="stable") if abs(column[place]) > PART)
        for column in mixture.T
    )


def _pair_messages(pairs: Sequence[tuple[str, str, float]]) -> Iterator[Notice]:
    """Messages on correlated pairs, one for each cause."""
    drifting: list[str] = []
    remaining: list[str] = []
    for first, second, value in pairs:
        a, b = parse_term(first), parse_term(second)
        drifts = a is not None and b is not None and _drift(a, b)
        (drifting if drifts else remaining).append(f"{first} and {second} ({value:.3f})")
    if drifting:
        cause = "sway and yaw are nearly proportional in these trials"
        yield Notice(f"the estimates of {_listed(drifting)} are correlated, and drift together: {cause}")
    if remaining:
        yield Notice(f"the estimates of {_listed(remaining)} are correlated: the trials hardly distinguish them")


def _drift(first: Term, second: Term) -> bool:
    """True if the terms differ only by sway in place of yaw."""
    same = first.force == second.force and (first.d, first.u) == (second.d, second.u) and first.name != second.name
    return same and not (first.acceleration or second.acceleration) and first.v + first.r == second.v + second.r


def _direction_messages(unseen: tuple[tuple[str, ...], ...]) -> Iterator[Notice]:
    if single := [direction[0] for direction in unseen if len(direction) == 1]:
        yield Notice(f"the trials show next to nothing of {_listed(single)}: the prior remains")
    if several := [_listed(list(direction)) for direction in unseen if len(direction) > 1]:
        yield Notice(f"the trials determine only a combination of {'; of '.join(several)}")


def _listed(words: list[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1] if words else "") if part)


def _short(name: str) -> str:
    return name.removeprefix("derivatives.")
