"""The card with named effects, with coefficients fitted together with them where this helps, and its replays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.reading import revised
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.gap.diagnosis.residuals import estimates, surroundings_by_trial
from tank2sim.gap.improve_card import Found, add_effects_to_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.proof.correct_sensors import correct_sensor_faults
from tank2sim.gap.proof.refinement import CoefficientPrior, refined_coefficients
from tank2sim.gap.proof.refit import refit_coefficients
from tank2sim.gap.proof.replay import TrialReplays
from tank2sim.gap.proof.surrounded_trial import ByTrial
from tank2sim.gap.proof.surroundings import fit_surroundings, with_surroundings
from tank2sim.gap.result import Passed, Refitted, misfit_of
from tank2sim.identification.craft.problem import within_physics
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import with_polynomial_down_to

BETTER = 0.05
"""Share by which the misfit of the fitted trials must fall for coefficients to be refitted together with an effect
(project choice): less, and the given ones are kept."""

BETTER_FROM = 1.1
"""Misfit in noise units of the fitted trials from which a refit of the coefficients is tried (project choice)."""


@dataclass(frozen=True, eq=False)
class NamedEffects:
    """Effects with their parameters, and the winds and currents of single trials."""

    estimated: Sequence[Found] = ()
    by_trial: ByTrial = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Proof:
    """An improved card, and the trials replayed by it and by the given one."""

    # Fitted trials and trials held out, in the winds and currents that were found for them.
    trials: tuple[Measured, Measured]
    named: NamedEffects
    # `base`, `improved`: Card without the effects, its coefficients refitted where the fitted trials are then followed
    # better, and the same card with the effects.
    base: SteeredCard
    improved: SteeredCard
    # Replays of the fitted trials; trials held out follow once they are opened (:meth:`Prover.open_holdout`).
    results: list[Passed]
    coefficients: tuple[Refitted, ...] = ()  # Coefficients of the base that differ from the given card's
    width: float = 1.0  # Factor on the standard errors of the given card with which the filter fitted the coefficients
    # Misfit of the effects without refitted coefficients, noise units: ``fit``, and ``holdout`` once that is opened;
    # empty where the coefficients are the given ones.
    effect_alone: Mapping[str, float] = field(default_factory=dict)

    @property
    def misfit(self) -> float:
        """Misfit of the fitted trials with the improved card, noise units."""
        return misfit_of(self.results, "after", held_out=False)


@dataclass(frozen=True, eq=False)
class Prover:
    """Proofs of explanations, by replays of the fitted trials; trials held out are opened for the last one."""

    card: SteeredCard  # The given card
    trials: tuple[Measured, Measured]  # Fitted trials and trials held out
    likelihood: Likelihood  # Likelihood of the fitted trials
    replays: TrialReplays
    # Speed (m/s) down to which the cards' polynomials are used in trials held out, where it is below their own.
    lowest_mps: float = math.inf

    def begin(self) -> None:
        """Begin the replays by the given card, which depend on no explanation."""
        fitted, held = self.trials
        self.replays.begin(self.card, fitted)
        self.replays.begin(self._lowered(self.card), held)

    def prove(self, best: ExplanationFit, named: NamedEffects | None = None) -> Proof:
        """The card with the effects of an explanation, and with coefficients fitted together with them if fitted trials
        are then followed better by :data:`BETTER`; replays of the fitted trials by both cards.

        Parameters
        ----------
        best : ExplanationFit
        named : NamedEffects, optional
            Effects in place of those that the explanation estimates.
        """
        card, likelihood = self.card, self.likelihood
        found = likelihood.by_formula(best)
        if named is None:
            named = NamedEffects(estimates(found), surroundings_by_trial(found, likelihood.motion.names))
        proof = self._replayed(card, card, named)
        if proof.misfit <= BETTER_FROM:
            return proof
        try:
            refitted, base = refit_coefficients(card, self._model, likelihood.coefficients_with(found))
        except InputError:
            return proof  # no craft has these coefficients
        joint = self._replayed(card, base, proof.named)
        if joint.misfit >= (1 - BETTER) * proof.misfit or not most_are_closer(proof.results, joint.results):
            return proof
        alone = {"fit": proof.misfit} if named.estimated else {}
        return replace(joint, coefficients=refitted, width=found.width, effect_alone=alone)

    def refine(self, proof: Proof) -> Proof:
        """The proof with its coefficients refined by simulations of the fitted trials, if these are then closer.

        Their standard errors and covariance remain the filter's, and the named effects keep their values.
        """
        at_card = {entry.name: entry for entry in proof.coefficients}
        names = tuple(
            name
            for name, entry in at_card.items()
            if proof.base.derivatives.get(name) and entry.standard_error_before > 0
        )
        if not names or proof.misfit <= BETTER_FROM:
            return proof
        spread = np.array([at_card[name].standard_error_before for name in names]) * max(proof.width, 1.0)
        tops = (self._model[f"derivatives.{name}"].maximum for name in names)
        highest = np.array([math.inf if top is None else top for top in tops])
        prior = CoefficientPrior(names, np.array([at_card[name].before for name in names]), spread, highest)
        sensors = sensor_faults(proof.named.estimated)
        faultless = corrected(proof.trials[0], sensors) or proof.trials[0]
        replays = self.replays
        found = refined_coefficients(proof.improved, prior, faultless, replays.noise, replays.executor)
        values = dict(zip(names, map(float, found), strict=True))
        errors = {name: (value, at_card[name].standard_error) for name, value in values.items()}
        base = replace(revised(proof.base, errors, comment="refined by simulations"), covariance=proof.base.covariance)
        refined = self._replayed(self.card, base, proof.named)
        if refined.misfit >= proof.misfit:
            return proof
        coefficients = tuple(replace(entry, value=values.get(entry.name, entry.value)) for entry in proof.coefficients)
        return replace(refined, coefficients=coefficients, width=proof.width, effect_alone=proof.effect_alone)

    def open_holdout(self, proof: Proof) -> Proof:
        """The proof with the trials held out, which the named effects have not seen.

        Winds and currents of single trials belong to the trials; a trial held out has its own, fitted to itself.
        """
        fitted, held = proof.trials
        if not held.trials:
            return proof
        named = proof.named
        card, base, improved = (self._lowered(each) for each in (self.card, proof.base, proof.improved))
        if named.by_trial:
            found = fit_surroundings(improved, held, tuple(named.by_trial), self.replays.noise)
            named = replace(
                named, by_trial={name: {**at, **found.get(name, {})} for name, at in named.by_trial.items()}
            )
            held = with_surroundings(held, named.by_trial)
        faultless = corrected(held, sensor_faults(named.estimated))
        alone = dict(proof.effect_alone)
        with_effects = add_effects_to_card(card, named.estimated) if alone else improved
        for each in (improved, with_effects):
            self.replays.begin(each, faultless or held)
        results = [*proof.results, *self.replays.by_cards(card, improved, held, True, faultless)]
        if alone:
            alone["holdout"] = misfit_of(self.replays.by_cards(card, with_effects, held, True, faultless), "after")
        return replace(
            proof,
            trials=(fitted, held),
            named=named,
            base=base,
            improved=improved,
            results=results,
            effect_alone=alone,
        )

    @property
    def _model(self) -> Model:
        """The card's model, the coefficients of a craft within what one can have."""
        model = self.likelihood.none.model
        return within_physics(model) if self.card.steered_by is SteeredBy.THRUSTERS else model

    def _lowered(self, card: SteeredCard) -> SteeredCard:
        """The card as trials held out need it, which may be slower than those fitted."""
        return with_polynomial_down_to(card.manoeuvring(), self.lowest_mps) if self.lowest_mps < math.inf else card

    def _replayed(self, card: SteeredCard, base: SteeredCard, named: NamedEffects) -> Proof:
        """The fitted trials by the given card and by a base with effects, in the winds and currents that were found."""
        improved = add_effects_to_card(base, named.estimated)
        fitted, held = self.trials
        fitted = with_surroundings(fitted, named.by_trial) if named.by_trial else fitted
        faultless = corrected(fitted, sensor_faults(named.estimated))
        results = list(self.replays.by_cards(card, improved, fitted, False, faultless))
        return Proof((fitted, held), named, base, improved, results)


def most_are_closer(before: Sequence[Passed], after: Sequence[Passed]) -> bool:
    """Whether at least half of the fitted trials are followed no worse: coefficients hold in all of them, and must not
    follow what happened in one."""
    pairs = zip(before, after, strict=True)
    return bool(np.median([new.misfit("after") / old.misfit("after") for old, new in pairs]) <= 1.0)


def sensor_faults(estimated: Sequence[Found]) -> list[Found]:
    """The effects that falsify measurements, not the motion of the ship."""
    return [effect for effect in estimated if EFFECTS[effect[0]].acts_on == "sensor"]


def corrected(group: Measured, sensors: Sequence[Found]) -> Measured | None:
    """Trials without the faults of their sensors; None without faults."""
    if not sensors:
        return None
    return replace(group, trials=tuple(correct_sensor_faults(trial, sensors) for trial in group.trials))
