"""Test whether trials are of the ship of the card, by the yaw acceleration that the rudder gives the ship.

Another ship turns several times faster or slower at the same rudder, however well a fit of all coefficients follows it.
Both the measured mean yaw accelerations (of the weak form) and the accelerations of the card's model along the
measured motion are regressed on rudder and yaw rate. The two coefficients of the rudder are equal for the card's
ship, whatever its equations, and errors that the card states do not widen the test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.weak_form import WeakForm
from tank2sim.identification.trials.problem.estimation_problem import BLOCK, Estimate, Problem
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

FACTOR = 2.0
"""Least ratio, either way, of the yaw acceleration by the rudder in all trials to the card's. It is 0.4 to 1.5 on
HSVA's and MARIN's KVLCC2, the Esso Osaka in wind and ships with an unknown effect, 4 where a Mariner's trials meet
a card of the KVLCC2. Project choice."""

FACTOR_ALONE = 2.5
"""The same by one trial alone, which a gust can distort. Project choice."""

FACTOR_UNCLEAR = 4.0
"""The same next to the card's own derivative, where gusts or another ship's drift hide the rudder's part of the card's
accelerations: 0.3 to 3.2 on the KVLCC2 and the Esso Osaka, 0.16 where a tanker meets the Mariner's card. Project
choice."""

ERRORS = 2.0
"""Standard errors either way: an interval of 95 %."""

SEVERAL_TIMES = 2.0
"""Difference of coefficients over their size, median of an equation, from which an estimate is of another ship: the
KVLCC2's from a Mariner's trials differ 11 times, cards by regression formulas from measured ones by half (project
choice)."""

RUDDER = "derivatives.Nd"

_LEAST_RUDDER = np.deg2rad(1.0)
"""Standard deviation of the rudder below which a run does not show its moment, also of the rudder's part that yaw
rate and mean do not explain (project choice)."""

_OVERLAP = 2.0
"""Windows of the weak form overlap by half: their errors count as half as many."""

_MODEL_ERROR = 0.1
"""Relative error of either coefficient however smooth the record: they differ by up to that on ships with an unknown
effect (project choice)."""

_UNEXPLAINED = 0.25
"""Relative standard error of the coefficient of the card's own accelerations from which a trial does not show the
rudder's part: 0.01 to 0.2 on zigzags in a basin, 0.3 and more of the Esso Osaka in gusts (project choice)."""

_NUDGE = 0.01
"""Change of the rudder (rad) by which the card's own derivative is found: small against its stall."""

_RESPONSE = 2.0
"""Ship lengths after a move of the rudder in which its moment shows: later in a turn drift and speed decide
(project choice)."""


def other_ship(problem: Problem) -> tuple[str, ...]:
    """Evidence that the runs are not of the card's ship, in sentences; empty if there is none."""
    if "rudder.command" not in problem.model.input_names:
        return ()
    rudder = problem.model.input_names.index("rudder.command")
    trials: dict[str, list[SampledRun]] = {}
    for run in problem.runs:  # parts of one trial are reported by their times
        if run.inputs[:, rudder].std() > _LEAST_RUDDER:
            trials.setdefault(run.name.partition(" at ")[0], []).append(run)
    found = {name: effect for name, runs in trials.items() if (effect := _effect(problem, runs)) is not None}
    clear = {name: effect for name, effect in found.items() if effect.determined}
    if whole := _beyond("all trials together", list(clear.values()), FACTOR) if clear else "":
        return (whole,)
    alone = [_beyond(name, [effect], FACTOR_ALONE) for name, effect in clear.items()]
    alone += [
        _beyond(name, [effect.of_card_at_rest], FACTOR_UNCLEAR) for name, effect in found.items() if name not in clear
    ]
    return tuple(filter(None, alone))


def evidence_of_other_ship(card: ManoeuvringCard, trials: Measured) -> tuple[str, ...]:
    """Evidence that trials are not of the card's ship; empty also where they cannot be compared with it."""
    try:
        return other_ship(problem_from_card(card, trials.trials, trials.driven_by))
    except InputError:
        return ()


def not_of_ship(card: ManoeuvringCard, trials: Measured, evidence: Sequence[str], remedy: str) -> InputError:
    """The refusal of trials that are not of the card's ship by `evidence`; `remedy` says what to do."""
    names = ", ".join(trial.name for trial in trials.trials)
    reasons = "; ".join((*evidence, *(doubt.rstrip(".") for doubt in doubts(card))))
    return InputError(names, "", f"not trials of the ship of {card.source}: {reasons}", remedy)


def far_from_card(fitted: Problem, estimate: Estimate) -> tuple[str, ...]:
    """Evidence in an estimate: coefficients of sway or yaw, or the rudder's moment, that are another ship's.

    `fitted`: With the standard errors of the card. `estimate`: Its ``prior_scale`` has the factors on these errors that
    the trials demand, by equation (``Y``, ``N``).
    """
    far = []
    for letter, what in (("Y", "sway"), ("N", "yaw")):
        shares = [
            error / abs(mean)
            for group, mean, error in zip(fitted.groups, fitted.prior_mean, fitted.prior_error, strict=True)
            if group == letter
        ]
        times = estimate.prior_scale.get(letter, 1.0) * float(np.median(shares)) if shares else 0.0
        if times > SEVERAL_TIMES:
            far.append(f"coefficients of {what} differ from the card's by {times:.2g} times their size")
    if RUDDER in fitted.free and (mean := fitted.prior_mean[place := fitted.free.index(RUDDER)]):
        ratio, error = estimate.values[place] / mean, abs(estimate.standard_errors[place] / mean)
        if ratio - ERRORS * error > FACTOR_ALONE or ratio + ERRORS * error < 1 / FACTOR_ALONE:
            far.append(f"Nd is {ratio:.2g} ± {ERRORS * error:.2g} times the card's")
    return tuple(far)


def _beyond(name: str, effects: Sequence[RudderEffect], factor: float) -> str:
    """A sentence if the rudder is certainly more than `factor` times as strong as the card's, or as weak, else ""."""
    stronger, its_error = _mean([effect.less(factor) for effect in effects])
    weaker, error = _mean([effect.less(1 / factor) for effect in effects])
    measured, of_measured = _mean([effect.less(0.0) for effect in effects])
    if stronger > ERRORS * its_error and measured > ERRORS * of_measured:
        return f"by {name} the rudder gives more than {factor:g} times the yaw acceleration that the card has"
    if weaker > -ERRORS * error:
        return ""
    if measured < -ERRORS * of_measured:
        return f"by {name} the rudder turns the ship to the other side: check the rudder_sign of card and trials"
    return f"by {name} the rudder gives less than {1 / factor:g} times the yaw acceleration that the card has"


def _mean(values_and_errors: list[tuple[float, float]]) -> tuple[float, float]:
    """Weighted mean of values with standard errors, and its standard error widened by excess scatter (Birge 1932)."""
    values, errors = np.array(values_and_errors).T
    weights = 1 / errors**2
    mean = float(np.sum(weights * values) / np.sum(weights))
    birge = float(np.sum(weights * (values - mean) ** 2)) / max(len(values) - 1, 1)
    return mean, float(np.sqrt(max(birge, 1.0) / np.sum(weights)))


@dataclass(frozen=True, eq=False)
class RudderEffect:
    """Yaw acceleration by the rudder in one trial: regression coefficients over the card's own derivative."""

    # `measured`, `modelled`: Coefficients of the measured accelerations and of the accelerations of the card along the
    # same motion
    measured: float
    modelled: float
    covariance: Array  # (2, 2): Covariance of the two coefficients

    @property
    def determined(self) -> bool:
        """True if yaw rate and rudder explain the card's own accelerations: gusts and noise of the drift do not."""
        return bool(np.sqrt(self.covariance[1, 1]) < _UNEXPLAINED * abs(self.modelled))

    @property
    def of_card_at_rest(self) -> RudderEffect:
        """The same next to the card's own derivative, where its accelerations along the motion do not show it."""
        return RudderEffect(self.measured, 1.0, self.covariance * np.outer([1, 0], [1, 0]))

    def less(self, factor: float) -> tuple[float, float]:
        """The measured coefficient less `factor` times the card's, and its standard error (Fieller 1954).

        Where drift hides the side of both, they are compared by size.
        """
        weights = np.array([1.0, -factor])
        model = _MODEL_ERROR * max(abs(self.measured), abs(factor * self.modelled))
        error = np.hypot(np.sqrt(weights @ self.covariance @ weights), model)
        side = -1.0 if max(self.measured, self.modelled) < 0 else 1.0
        return side * (self.measured - factor * self.modelled), float(error)


def _effect(problem: Problem, runs: Sequence[SampledRun]) -> RudderEffect | None:
    """The yaw acceleration by the rudder in runs; None where they do not show it."""
    found = _responses(problem, runs)
    if found is None:
        return None
    X, Y, block, by_rudder = found
    slope = float(np.mean(by_rudder)) if len(X) > X.shape[1] else 0.0
    if not slope or np.linalg.matrix_rank(X) < X.shape[1] or not np.isfinite(Y).all():
        return None
    half = np.linalg.inv(np.linalg.qr(X).R)  # X'X has the square of the condition of X, and may be singular
    inverse = half @ half.T
    if 1 / (inverse[0, 0] * len(X)) < _LEAST_RUDDER**2:  # a turn of few readings: yaw rate and mean have all of it
        return None
    coefficients = inverse @ X.T @ Y
    left = Y - X @ coefficients
    shares = np.array([inverse[0] @ X[block == name].T @ left[block == name] for name in np.unique(block)])
    spare = len(X) - X.shape[1]
    by_blocks = shares.T @ shares * len(X) / spare  # Liang and Zeger 1986; of one block it is 0
    by_windows = inverse[0, 0] * (left.T @ left) / spare * _OVERLAP
    covariance = by_blocks if np.trace(by_blocks) > np.trace(by_windows) else by_windows
    measured, modelled = coefficients[0] / slope
    return RudderEffect(float(measured), float(modelled), covariance / slope**2)


def _responses(problem: Problem, runs: Sequence[SampledRun]) -> tuple[Array, Array, Array, Array] | None:
    """Windows after moves of the rudder: regressors (n, 2 + runs), accelerations as measured and by the card (n, 2),
    the number of the block of each (n,), and the card's own derivative by the rudder (n,); None without velocities."""
    rudder = problem.model.input_names.index("rudder.command")
    one, nudge = problem.without(problem.free[1:]), np.zeros(len(problem.model.input_names))
    nudge[rudder] = _NUDGE
    both = tuple(runs), tuple(replace(run, inputs=run.inputs + nudge) for run in runs)
    try:
        form, nudged = (WeakForm(one.with_runs(each)) for each in both)
    except InputError:
        return None
    per_block = max(1, round(BLOCK * problem.ship_time / form.half))
    lead = round(_RESPONSE * problem.ship_time / form.half)
    found = []
    at, by = (each.at(one.prior_mean).residuals[:, 2] for each in (form, nudged))
    for number, (windowed, span) in enumerate(zip(form.runs, form.spans, strict=True)):
        angle = windowed.averaging @ windowed.run.inputs[:-1, rudder]
        yaw_rate = windowed.averaging @ windowed.middle[:, 2]
        moves = [np.ptp(angle[max(0, place - lead) : place + 1]) for place in range(len(angle))]
        kept = np.array(moves, dtype=float) > _LEAST_RUDDER
        mean = np.eye(len(form.runs))[[number] * len(angle)]
        measured = windowed.change[:, 2]
        columns = (
            np.column_stack([angle, yaw_rate, mean]),
            np.column_stack([measured, measured - at[span]]),
            span.start + np.arange(len(angle)) // per_block,
            (at[span] - by[span]) / _NUDGE,
        )
        found.append([column[kept] for column in columns])
    regressors, accelerations, block, slope = (np.concatenate(columns) for columns in zip(*found, strict=True))
    return regressors, accelerations, block, slope
