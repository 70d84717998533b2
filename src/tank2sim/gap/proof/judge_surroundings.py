"""Winds and currents of single trials that free-running simulations name where scores from instant to instant do not.

A weak force that lasts turns a ship within minutes and is not seen from instant to instant, where random forces of the
same size explain it as well.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import softmax

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.improve_card import add_effects_to_card, at_rest
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.proof.cross_check import MUCH, closes_gap
from tank2sim.gap.proof.improvement import NamedEffects, Proof, Prover
from tank2sim.gap.proof.judge import CLEARLY, Judged
from tank2sim.gap.proof.surrounded_trial import STEP_SHARE, SurroundedTrial, largest_speed, typical_speed
from tank2sim.gap.result import AMBIGUOUS, MISSING, Surroundings, misfit_of
from tank2sim.gap.search.decision import LIKELY, TEMPER
from tank2sim.gap.search.explanations import Search
from tank2sim.identification.trials.problem.prepare_trials import Measured

PREDICTS = 0.5
"""Share of the misfit of the second half of a trial that a wind or current fitted to its first half may leave, as the
median over the trials, where it is named by simulation alone (project choice): two numbers to a trial imitate much
else, without predicting what comes."""

REMAINS_OF_MOST = 1 / 3
"""Share of the misfit that may remain where most of a gap is closed (project choice: a wave drift with another formula
left 0.1 to 0.2 in made-up trials; what is named in place of the wind on the Esso Osaka leaves 0.7 or more)."""

_TURNS = 15
"""Turns of initial state and surroundings, each at the last of the other, at most (project choice)."""

_SETTLED = 3e-3
"""A turn that moves the surroundings by less than this share of the typical speed is the last (project choice)."""

_CONVERGED = 1e-3
"""Share by which a step lowers the sum of squares of all trials together when it is the last (project choice: initial
states are found again after it)."""


@dataclass(frozen=True, eq=False)
class _Simulated:
    """A wind or current of each trial by free-running simulations.

    Parameters
    ----------
    fit : ExplanationFit
        With the values of the simulations.
    proof : Proof
    predicted : float
        Share of the misfit of the second half of a trial that remains with what was fitted to its first half, median.
    """

    fit: ExplanationFit
    proof: Proof
    predicted: float

    @property
    def misfit(self) -> float:
        """Misfit of the fitted trials, noise units."""
        return misfit_of(self.proof.results, "after")


def judge_surroundings(prover: Prover, search: Search, judged: Judged, names: Sequence[str]) -> Judged:
    """The decision, or in its place a wind or current of each trial that simulations follow much more closely with.

    Where the trials are still missed by far (:data:`.cross_check.MUCH`), each wind or current that was not recorded is
    fitted to the free-running simulations. It is named if less than :data:`.judge.CLEARLY` of the misfit of the
    decision is left, and if the first half of the trials predicts the second (:data:`PREDICTS`). Not in place of
    effects that close most of the gap (:data:`REMAINS_OF_MOST`): two numbers to a trial follow what their formulas
    leave.

    Parameters
    ----------
    prover : Prover
    search : Search
    judged : Judged
    names : sequence of str
        Effects that are sought.
    """
    reached = misfit_of(judged.proof.results, "after")
    if reached <= MUCH or any(EFFECTS[name].surroundings for name, *_ in judged.proof.named.estimated):
        return judged
    if _closes_most(judged):
        return judged
    simulated = _simulated(prover, search, names)
    tried = {name: found for name, found in simulated.items() if found.misfit < CLEARLY * reached}
    if not tried:
        return judged
    best, *others = sorted(tried, key=lambda name: tried[name].misfit)
    found = tried[best]
    before = judged.decision.best.hypothesis.effects if judged.proof.named.estimated else ()
    proofs: dict[tuple[str, ...], Proof] = {
        before: judged.proof,
        **{(name,): found.proof for name, found in tried.items()},
    }
    alike = tuple(tried[name].fit for name in others if CLEARLY * tried[name].misfit < found.misfit)
    decision = replace(
        judged.decision,
        verdict=AMBIGUOUS if alike else MISSING,
        best=found.fit,
        alike=alike,
        probabilities=probabilities_by_simulation(prover.card, prover.trials[0], proofs, by_trial=tuple(tried)),
    )
    if not alike and decision.confidence(best) < LIKELY:
        return judged
    by_simulation = (
        f"{best}: named by free-running simulations, not from instant to instant; fitted to the first half of each "
        f"trial, it leaves {found.predicted:.0%} of the misfit of the second half (median)"
    )
    return Judged(decision, found.proof, judged.withheld, by_simulation)


def _closes_most(judged: Judged) -> bool:
    """Whether effects of the ship were named that close most of the gap."""
    effects = judged.decision.best.hypothesis.effects
    if judged.decision.verdict not in (MISSING, AMBIGUOUS) or any(
        EFFECTS[name].acts_on == "sensor" for name in effects
    ):
        return False
    results = judged.proof.results
    return misfit_of(results, "after") < REMAINS_OF_MOST * misfit_of(results, "before")


def _simulated(prover: Prover, search: Search, names: Sequence[str]) -> dict[str, _Simulated]:
    """Each wind or current that was not recorded, fitted to the simulations, where it predicts and closes the gap."""
    fits = {fit.hypothesis.effects: fit for fit in reversed(search.fits)}
    recorded = search.none.hypothesis.recorded
    sought = [name for name in names if EFFECTS[name].surroundings and name not in recorded and (name,) in fits]
    at_sea = [add_effects_to_card(prover.card, [(name, at_rest(name), {})]) for name in sought]
    fitted, replays = prover.trials[0], prover.replays
    each = map if replays.executor is None else replays.executor.map
    arguments = at_sea, [fitted] * len(sought), sought, [dict(replays.noise)] * len(sought)
    found = {}
    for name, common in zip(sought, each(fit_common_surroundings, *arguments), strict=True):
        if common is None or common.strongest_mps > largest_speed(name):
            continue  # a wind that never blows imitates something else
        if (predicted := float(np.median(common.predicted))) >= PREDICTS:
            continue
        fit = fits[name,]
        named = NamedEffects([(name, common.values, common.errors)], {name: common.by_trial})
        proof = prover.prove(fit, named)
        if closes_gap(proof.results, CLEARLY):
            found[name] = _Simulated(_at(fit, common, search.likelihood.motion.names), proof, predicted)
    return found


def _at(fit: ExplanationFit, common: CommonSurroundings, trials: Sequence[str]) -> ExplanationFit:
    """A fit with the wind or current that simulations gave in the place of its parameters."""
    parts = {
        name: at.speed_mps * np.array([np.cos(at.direction_rad), np.sin(at.direction_rad)])
        for name, at in common.by_trial.items()
    }
    mean = Surroundings.of_parts(np.mean(list(parts.values()), axis=0), np.zeros(2))
    same = {"speed_mps": mean.speed_mps, "direction_rad": mean.direction_rad, **common.values}
    theta = [
        same.get(estimate.parameter.name, value) if estimate.run is None else parts[trials[estimate.run]][estimate.axis]
        for estimate, value in zip(fit.hypothesis.estimated, fit.theta, strict=True)
    ]
    return replace(fit, theta=np.array(theta))


def probabilities_by_simulation(
    card: SteeredCard, fitted: Measured, proofs: Mapping[tuple[str, ...], Proof], by_trial: Collection[str]
) -> dict[tuple[str, ...], float]:
    """Probability of each explanation by the misfits of the fitted trials.

    Their errors are of an unknown size and independent once in a passage of L/u0; an explanation has two numbers to a
    trial, or none, which cost what Schwarz's criterion asks.

    Parameters
    ----------
    card : SteeredCard
        For L/u0.
    fitted : Measured
        T trials.
    proofs : mapping
        Effects of an explanation to the replays of the fitted trials with it.
    by_trial : collection of str
        Winds and currents that have two numbers of their own in each trial.
    """
    passage = card.ship.length_m / card.model.speed_mps
    readings = np.array([(trial.time_s[-1] - trial.time_s[0]) / passage for trial in fitted.trials])
    scores = []
    for effects, proof in proofs.items():
        misfits = np.array([result.misfit("after") for result in proof.results])
        numbers = 2 * len(fitted.trials) * sum(name in by_trial for name in effects)
        scores.append(2 * readings @ np.log(np.maximum(misfits, 1.0)) + numbers * np.log(np.sum(readings)))
    logs = -0.5 * np.array(scores) / TEMPER
    return dict(zip(proofs, map(float, softmax(logs)), strict=True))


@dataclass(frozen=True, eq=False)
class CommonSurroundings:
    """A wind or current that acts in all trials, in each with a speed and direction of its own, found by simulation.

    Parameters
    ----------
    effect : str
        Its name.
    values, errors : mapping
        Coefficients of its forces, which hold in all trials, by the names of the parameters, SI, with standard errors.
    by_trial : mapping
        Name of each trial to its wind or current.
    predicted : array (trials,)
        Root mean square of simulated less measured over the second half of each trial, with the wind or current fitted
        to the first half, over that without any.
    """

    effect: str
    values: Mapping[str, float]
    errors: Mapping[str, float]
    by_trial: Mapping[str, Surroundings]
    predicted: Array

    @property
    def strongest_mps(self) -> float:
        """The largest speed in a trial, m/s."""
        return max(at.speed_mps for at in self.by_trial.values())


def fit_common_surroundings(
    card: SteeredCard, measured: Measured, effect: str, noise: Mapping[str, float]
) -> CommonSurroundings | None:
    """One effect of the surroundings with the coefficients of its forces, which are the same in all trials.

    None where, with the usual coefficients, what is fitted to the first half of a trial makes the second half worse in
    most of them: that would not be a wind or current.

    By least squares of the free-running simulations of all trials together. A trial weighs as many independent
    readings as its errors hold, in units of their own size; the coefficients are normal beforehand with the spreads of
    the effect.

    Parameters
    ----------
    card : SteeredCard
        With the effect, whose wind or current is an input of its model.
    measured : Measured
        The trials.
    effect : str
        Its name.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    """
    trials = [SurroundedTrial(card, measured.driven_by, trial, (effect,), noise) for trial in measured.trials]
    together = _AllTrials(card, effect, trials)
    at = together.begin()
    if np.median(together.predicted(at)) >= 1:
        return None
    return together.fit(at)


class _AllTrials:
    """Least squares of all trials; unknowns (k + 2 trials,): k coefficients, currents north and east, m/s."""

    def __init__(self, card: SteeredCard, effect: str, trials: Sequence[SurroundedTrial]):
        self.effect, self.trials, self._card = effect, trials, card
        self._shared = [parameter for parameter in EFFECTS[effect].parameters if parameter.spread_value(card)]
        self._centre = np.array([parameter.value({}, card) for parameter in self._shared])
        self._spread = np.array([parameter.spread_value(card) for parameter in self._shared])
        self._weights = np.ones(len(trials))

    def _parameters(self, at: Array) -> Array:
        """Parameters of the model with the coefficients (k, or more of which the first k)."""
        names = EFFECTS[self.effect].model_names()
        values = {names[parameter.name]: float(value) for parameter, value in zip(self._shared, at, strict=False)}
        return self.trials[0].replayer.model.parameter_values(values)

    def _parts(self, at: Array, place: int) -> Array:
        return at[len(self._shared) + 2 * place :][:2]

    def begin(self) -> Array:
        """The usual coefficients, and the wind or current of each trial that fits it best with these."""
        p = self._parameters(self._centre)
        return np.concatenate([self._centre, *(trial.parts(p) for trial in self.trials)])

    def predicted(self, at: Array) -> Array:
        """:attr:`CommonSurroundings.predicted`."""
        absent = np.array(
            [
                value if parameter.absent is None else parameter.absent
                for parameter, value in zip(self._shared, self._centre, strict=True)
            ]
        )
        with_effect, without = self._parameters(at), self._parameters(absent)
        return np.array(
            [trial.predicted(self._parts(at, place), with_effect, without) for place, trial in enumerate(self.trials)]
        )

    def residuals(self, at: Array) -> Array:
        """Weighted errors of all trials, and the coefficients' distance from the usual ones."""
        p = self._parameters(at)
        away = [
            weight * trial.away(self._parts(at, place), p)
            for place, (trial, weight) in enumerate(zip(self.trials, self._weights, strict=True))
        ]
        return np.concatenate([*away, (at[: len(self._shared)] - self._centre) / self._spread])

    def slopes(self, at: Array) -> Array:
        """Derivatives of :meth:`residuals` by the unknowns: a trial's wind moves this trial alone."""
        p, k = self._parameters(at), len(self._shared)
        blocks = np.zeros((sum(trial.count for trial in self.trials) + k, len(at)))
        row = 0
        for place, (trial, weight) in enumerate(zip(self.trials, self._weights, strict=True)):
            rows, parts = slice(row, row + trial.count), self._parts(at, place)
            now = trial.away(parts, p)
            blocks[rows, k + 2 * place : k + 2 * place + 2] = weight * trial.slopes(parts, p, now)
            for column, step in enumerate(STEP_SHARE * self._spread):
                moved = at[:k].copy()
                moved[column] += step
                blocks[rows, column] = weight * (trial.away(parts, self._parameters(moved)) - now) / step
            row += trial.count
        blocks[row:, :k] = np.diag(1 / self._spread)
        return blocks

    def fit(self, at: Array) -> CommonSurroundings:
        """From first values: weights and initial states in turn with the unknowns, until these settle."""
        anywhere = np.full(2 * len(self.trials), np.inf)
        low = np.concatenate([[parameter.lowest(self._card) for parameter in self._shared], -anywhere])
        high = np.concatenate([[parameter.maximum for parameter in self._shared], anywhere])
        typical = typical_speed(self._card, self.effect)
        scale = np.concatenate([self._spread, np.full(2 * len(self.trials), typical)])
        for _ in range(_TURNS):
            p = self._parameters(at)
            self._weights = np.array(
                [trial.weight(self._parts(at, place), p) for place, trial in enumerate(self.trials)]
            )
            solved = least_squares(self.residuals, at, self.slopes, bounds=(low, high), x_scale=scale, ftol=_CONVERGED)
            moved, at = float(np.max(np.abs(solved.x - at) / scale)), solved.x
            for place, trial in enumerate(self.trials):
                trial.begin(self._parts(at, place), self._parameters(at))
            if moved < _SETTLED:
                break
        errors = np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))
        names = [parameter.name for parameter in self._shared]
        return CommonSurroundings(
            self.effect,
            dict(zip(names, map(float, at), strict=False)),
            dict(zip(names, map(float, errors), strict=False)),
            {
                trial.name: Surroundings.of_parts(self._parts(at, place), self._parts(errors, place))
                for place, trial in enumerate(self.trials)
            },
            self.predicted(at),
        )
