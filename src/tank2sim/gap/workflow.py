"""The gap workflow: locate the gap, screen and fit possible effects, decide, add the effect, and check it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.special import softmax
from threadpoolctl import threadpool_limits

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import EffectEntry
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.executors import executing, processes_to_begin
from tank2sim.gap.diagnosis.misfit_location import equation_of, figures, places
from tank2sim.gap.diagnosis.residuals import (
    each_trial,
    effects_at_work,
    estimates,
    force_lacking,
    surroundings_by_trial,
)
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.inference.prior import candidate_explanations, likelihood_from_card
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.gap.outcome.combine import combine_passes, without_effect
from tank2sim.gap.outcome.correct_sensors import correct_sensor_faults
from tank2sim.gap.outcome.improve_card import Found, add_effects_to_card, at_rest
from tank2sim.gap.outcome.next_test import Explanation, next_test
from tank2sim.gap.outcome.refit import effects_like, refit_coefficients
from tank2sim.gap.outcome.surroundings import (
    ByTrial,
    CommonSurroundings,
    fit_common_surroundings,
    fit_surroundings,
    with_surroundings,
)
from tank2sim.gap.proof.cross_check import MUCH, BlackBox, black_box, closes_gap, trial_consistency, worse_trials
from tank2sim.gap.proof.replay import TrialReplays
from tank2sim.gap.result import (
    AMBIGUOUS,
    COEFFICIENTS,
    MISSING,
    NO_EFFECT_MISSING,
    OUTSIDE_LIBRARY,
    Gap,
    Named,
    NextTest,
    Passed,
    Refitted,
    Rival,
    Surroundings,
)
from tank2sim.gap.search.detection_limit import could_hide
from tank2sim.gap.search.explanations import Search, search
from tank2sim.gap.search.model_choice import (
    EVIDENCE_NEEDED,
    LIKELY,
    TEMPER,
    Decision,
    Strange,
    decide,
    decide_for,
    decide_without,
    doubtful_effects,
    makes_the_card_right,
    with_one_more,
)
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    above_low_speed,
    lowered_bound_notice,
    polynomial_over_trials,
)
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.identification.trials.problem.structures import structure_that_adds
from tank2sim.records.trials import Trial

RIVALS = 12
"""Explanations that are reported."""

BETTER = 0.05
"""Share by which the misfit of the fitted trials must fall for coefficients to be refitted together with an effect
(project choice): less, and the given ones are kept."""

BETTER_FROM = 1.1
"""Misfit in noise units of the fitted trials from which a refit of the coefficients is tried (project choice)."""

EXPLAINED = 0.2
"""Coefficients explain a gap that they reduce to less than this share, or to noise (project choice)."""

TRIES = 4
"""Explanations that are simulated at most, one after the other (project choice)."""

NEAR_NOISE = 1.2
"""Misfit in noise units of the fitted trials up to which a name is not compared with coefficients alone (project
choice): many coefficients follow a few trials a little better than they should."""

DECISIVE = 40.0
"""Difference of the scores of "none" and of a name (-2 log probability) from which simulations with coefficients alone
are not asked for (project choice: odds of 1 to e^20)."""

CLEARLY = 0.7
"""Largest share of the misfit that may remain where a second explanation, or one next to something unknown, is named
(project choice)."""

PREDICTS = 0.5
"""Share of the misfit of the second half of a trial that a wind or current fitted to its first half may leave, as the
median over the trials, where it is named by simulation alone (project choice): two numbers to a trial imitate much
else, without predicting what comes."""

DOUBT = 1e-3
"""Probability below which trials that disagree about a parameter are reported."""


MOST_EFFECTS = 4
"""Effects that are named at most: more parameters than these are rarely determined by a day of trials (project
choice)."""

AGAIN = 1.5
"""Misfit in noise units of the fitted trials from which more effects are sought (project choice): what remains is then
as large as the noise."""


@dataclass(frozen=True)
class GapOptions:
    """Options of the search for the missing effect.

    Parameters
    ----------
    effects : tuple of str, optional
        Effects to try; by default the whole library.
    without : tuple of str
        Effects not to try.
    max_effects : int
        Effects named at most, 1 to :data:`MOST_EFFECTS`.
    workers : int, optional
        Processes; by default as many as there are processors.
    false_discovery : float
        Largest probability with which a name that is given alone may be wrong, 0.01 to 0.5.
    """

    effects: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    max_effects: int = MOST_EFFECTS
    workers: int | None = None
    false_discovery: float = 1 - LIKELY


def run_gap_workflow(
    card: ManoeuvringCard,
    fitted: Measured,
    held: Measured,
    options: GapOptions | None = None,
    progress: StageReport = lambda text: None,
    executor: Executor | None = None,
) -> Gap:
    """Find where a card's model and trials differ, name the missing effect, add it, and check it.

    Parameters
    ----------
    card : ManoeuvringCard
        The ship as it is known.
    fitted, held : Measured
        Trials that name the effect, and trials that only prove it (may be none).
    options : GapOptions, optional
    progress : callable
        Called with the name of each stage.
    executor : Executor, optional
        For fitting explanations; by default processes of this machine.

    Raises
    ------
    InputError
        A trial is too short or measures too little, or a requested effect cannot be tried on this card.
    """
    options = options or GapOptions()
    given, card = card, polynomial_over_trials(card, (*fitted.trials, *held.trials))
    fitted, held = above_low_speed(card, fitted), above_low_speed(card, held)
    if card.roll is not None:
        fitted, held = _without_heel(fitted), _without_heel(held)
    # Small matrices: threads of the linear algebra library would wait for each other.
    with threadpool_limits(limits=1, user_api="blas"), _processes(options, executor) as pool:
        gap, trials = _search_once(card, (fitted, held), options, progress, pool)
        without = gap.base
        while _seeks_more(gap, options):
            named = tuple(effect.name for effect in gap.effects)
            known = dict.fromkeys([*named, *(name for names in gap.alternatives for name in names)])
            most = options.max_effects - len(named)
            wanted = None if options.effects is None else tuple(name for name in options.effects if name not in known)
            if wanted == () or gap.improved is card:
                break
            simpler = [name for effect in known for name in EFFECTS[effect].includes]
            excluded = (*options.without, *known, *simpler)
            more = replace(options, effects=wanted, without=excluded, max_effects=most)
            further, found_trials = _search_once(gap.improved, trials, more, progress, pool, without)
            if not _adds(gap, further, 1 - options.false_discovery):
                break
            both = combine_passes(gap, further)
            smaller = _smaller(card, (fitted, held), (gap, both), options, pool)
            gap, trials = smaller or (both, found_trials)
        return replace(gap, notices=(*lowered_bound_notice(given, card), *gap.notices))


def _without_heel(group: Measured) -> Measured:
    """Trials of a ship that rolls, without the heel that they measured.

    Roll follows from the measured motion, whose errors excite it; the filter corrects the motion alone, and heel would
    show an oscillation that is not the ship's.
    """
    if not any("phi_rad" in trial.signals for trial in group.trials):
        return group
    trials = tuple(
        replace(trial, signals={name: values for name, values in trial.signals.items() if name != "phi_rad"})
        for trial in group.trials
    )
    notice = "heel is computed and not compared: only what it changes of the motion in the plane is seen"
    return replace(group, trials=trials, notices=(*group.notices, notice))


def _search_once(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    options: GapOptions,
    progress: StageReport,
    pool: Executor | None,
    without: ManoeuvringCard | None = None,
) -> tuple[Gap, tuple[Measured, Measured]]:
    """One search, the decision and its proof; and the trials with the winds and currents that were found.

    `without` is the card without the effects that an earlier search found.
    """
    names = _names(card, trials[0], options)
    found = search(likelihood_from_card(card, trials[0], without), progress, pool, names, most=options.max_effects)
    decision = decide(found, options.false_discovery)
    progress("proving")
    replays = TrialReplays({name: sigma for name, (sigma, _) in _noise(found, decision.best, trials[0]).items()}, pool)
    judged = _judge_by_simulation(card, trials, found, decision, replays, options.false_discovery)
    judged = _surroundings_by_simulation(card, trials, found, judged, replays, names)
    progress("where and how much")
    return _assemble_gap(card, trials, found, judged, replays)


def _seeks_more(gap: Gap, options: GapOptions) -> bool:
    """Whether effects of the ship were named, also as one of several that look alike, and the fitted trials are still
    missed."""
    if gap.verdict not in (MISSING, AMBIGUOUS) or not all(gap.alternatives):
        return False
    if not 0 < len(gap.effects) < options.max_effects:
        return False
    if any(EFFECTS[effect.name].acts_on == "sensor" for effect in gap.effects):
        return False  # the trials would have to be corrected first
    return _misfit_of(gap.passed, "after", held_out=False) > AGAIN


def _adds(gap: Gap, further: Gap, likely: float) -> bool:
    """Whether a search on the improved card named effects of the ship, each with a probability of `likely` at least,
    that bring it closer."""
    if further.verdict != MISSING or any(EFFECTS[effect.name].acts_on == "sensor" for effect in further.effects):
        return False
    before, after = (_misfit_of(result.passed, "after", held_out=False) for result in (gap, further))
    return min(effect.confidence for effect in further.effects) >= likely and after < (1 - BETTER) * before


def _smaller(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    passes: tuple[Gap, Gap],
    options: GapOptions,
    pool: Executor | None,
) -> tuple[Gap, tuple[Measured, Measured]] | None:
    """The result without an effect of the first search that those of the second make superfluous; None without one.

    The first search seeks one or two effects where more may be missing, and can name one in place of another. The
    others, fitted together to the card as given, must then follow the fitted trials as closely as all.

    Parameters
    ----------
    card, trials
        As given.
    passes : tuple of Gap
        Of the first search, and of both together.
    """
    first, both = passes
    reached = _misfit_of(both.passed, "after", held_out=False)
    for dropped in first.effects:
        others = tuple(effect.name for effect in both.effects if effect.name != dropped.name)
        again, found_trials = _search_once(card, trials, replace(options, effects=others), lambda text: None, pool)
        same = again.verdict == MISSING and {effect.name for effect in again.effects} == set(others)
        if same and _misfit_of(again.passed, "after", held_out=False) <= (1 + BETTER) * reached:
            return without_effect(again, both, dropped.name), found_trials
    return None


def _names(card: ManoeuvringCard, fitted: Measured, options: GapOptions) -> tuple[str, ...]:
    possible = candidate_explanations(card, fitted.driven_by)
    for name in options.effects or ():
        if name not in possible:
            have = any(entry.name == name for entry in card.effects)
            why = "is on the card already" if have else "cannot be tried on this card and these trials"
            raise InputError("--effects", "", f"{name} {why}", f"possible are: {', '.join(possible)}")
    names = tuple(name for name in options.effects or possible if name not in options.without)
    if not names:
        raise InputError("--without", "", "leaves no effect to look for", f"possible are: {', '.join(possible)}")
    return names


@contextmanager
def _processes(options: GapOptions, executor: Executor | None) -> Iterator[Executor | None]:
    count = processes_to_begin(options.workers)
    if executor is not None or count == 1:
        yield executor
        return
    with executing(workers=count) as pool:
        yield pool


def _assemble_gap(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    judged: _Judged,
    replays: TrialReplays,
) -> tuple[Gap, tuple[Measured, Measured]]:
    """The results that follow from the decision, and the trials with the winds and currents that were found."""
    fitted, held = trials
    decision, estimated, proof = judged.decision, judged.estimated, judged.proof
    box = _begin_black_box(card, proof, estimated, replays)
    hidden = could_hide(found, decision.best, EVIDENCE_NEEDED)
    noise = _noise(found, decision.best, fitted)
    if decision.verdict == NO_EFFECT_MISSING:
        before, after = (_misfit_of(proof.results, version) for version in ("before", "after"))
        if (
            proof.coefficients
            and before > MUCH
            and closes_gap(proof.results)
            and after <= max(MUCH, EXPLAINED * before)
        ):
            decision = replace(decision, verdict=COEFFICIENTS)
        elif after > MUCH:
            decision = replace(decision, verdict=OUTSIDE_LIBRARY)
    sensors = _sensor_faults(estimated)
    force = force_lacking(found.likelihood, found.none)
    every = (*fitted.trials, *held.trials)
    agreement = each_trial(found.likelihood, decision.best) if estimated else {}
    improved, results = proof.improved, _with_black_box(proof, box().card, replays) if box else proof.results
    gap = Gap(
        card=card,
        improved=improved,
        base=proof.base,
        verdict=decision.verdict,
        effects=tuple(
            Named(*effect, decision.confidence(effect[0]), proof.by_trial.get(effect[0], {})) for effect in estimated
        ),
        coefficients=proof.coefficients,
        effect_alone=proof.effect_alone,
        alternatives=tuple(fit.hypothesis.effects for fit in decision.alike) if estimated else (),
        rivals=_rivals(found, decision),
        where=places(results),
        equation=equation_of([name for name, *_ in estimated], improved, force, results),
        noise=noise,
        waves=found.likelihood.belief.waves,
        passed=tuple(results),
        figures_before=figures(card, every, results, "before"),
        figures_after=figures(improved, _after(every, fitted, held, sensors), results, "after"),
        missing_force=force,
        at_work=effects_at_work(found.likelihood, decision.best) if estimated else (),
        could_hide=hidden,
        agreement=agreement,
        next_test=_next(card, found, decision, replays.noise),
        notices=_notices(
            card, replace(judged, decision=decision), agreement, (fitted, held), found.likelihood.belief.waves
        ),
    )
    return gap, proof.trials


@dataclass(frozen=True, eq=False)
class _Judged:
    """A decision after the simulations with its names, the names that brought none closer, and what is to be said of a
    name that simulations alone gave."""

    decision: Decision
    estimated: list[Found]
    proof: _Proof
    withheld: tuple[str, ...] = ()
    by_simulation: str = ""


def _judge_by_simulation(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    decision: Decision,
    replays: TrialReplays,
    share: float,
) -> _Judged:
    """The decision after free-running simulations with what it names.

    An explanation that fits best from instant to instant, and with which no simulation comes closer, is excluded, and
    the remaining ones are judged again, :data:`TRIES` times at most. What comes after another was excluded, or acts
    next to something that no effect explains, must close the gap clearly (:data:`CLEARLY`); nothing is named without.
    An effect that gained little must bring the fitted trials closer (:func:`_with_fewer`), and one more is named that
    brings them much closer (:func:`_with_more`), also where the scores name none. A name whose score is not far ahead
    of none (:data:`DECISIVE`) must also follow the fitted trials as closely as the card's coefficients alone, fitted to
    them.
    `share` is the option ``false_discovery``.
    """
    withheld: list[str] = []
    excluded: list[ExplanationFit] = []
    alone: _Proof | None = None
    remaining, current = found, decision
    for _ in range(TRIES):
        if not current.best.hypothesis.effects:
            break
        judged = _with_fewer(card, trials, remaining, current, replays, share)
        judged = _with_more(card, trials, remaining, judged, replays, share)
        current, estimated, proof = judged.decision, judged.estimated, judged.proof
        unknown = current.verdict == OUTSIDE_LIBRARY
        closes = _closes_clearly(proof.results) if withheld or unknown else closes_gap(proof.results)
        if closes and found.none.score - current.best.score < DECISIVE:
            alone = alone or _prove(card, trials, _NamedEffects([], {}), replays, found, found.none)
            with_effects, without = (_misfit_of(each.results, "after", held_out=False) for each in (proof, alone))
            closes = with_effects < max((1 + BETTER) * without, NEAR_NOISE)
        if closes:
            verdict = (AMBIGUOUS if current.alike else MISSING) if unknown else current.verdict
            return _Judged(replace(current, verdict=verdict), estimated, proof, tuple(withheld))
        if not unknown:
            withheld.append(" and ".join(current.best.hypothesis.effects))
        excluded.append(current.best)
        remaining = replace(remaining, fits=tuple(fit for fit in remaining.fits if fit is not current.best))
        current = decide(remaining, share, excluded)
    proof = alone or _prove(card, trials, _NamedEffects([], {}), replays, found, found.none)
    if decision.verdict == NO_EFFECT_MISSING:
        more = _with_more(card, trials, found, _Judged(decision, [], proof), replays, share)
        if more.decision is not decision:
            return more
    if decision.best.hypothesis.effects:
        follows = not decision.strange and _misfit_of(proof.results, "after") <= MUCH
        decision = replace(decision, verdict=NO_EFFECT_MISSING if follows else OUTSIDE_LIBRARY)
    return _Judged(decision, [], proof, tuple(withheld))


def _with_fewer(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    decision: Decision,
    replays: TrialReplays,
    share: float,
) -> _Judged:
    """The decision, with its proof, without its doubtful effects that bring the fitted trials no closer."""
    judged = _prove_decision(card, trials, found, decision, replays)
    for name in doubtful_effects(found, decision.best):
        fewer = decide_without(found, decision, name, share)
        if fewer is not decision:
            of_fewer = _with_fewer(card, trials, found, fewer, replays, share)
            if _reached(of_fewer) <= _reached(judged):
                return of_fewer
    return judged


def _with_more(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    judged: _Judged,
    replays: TrialReplays,
    share: float,
) -> _Judged:
    """The same, or a decision for one effect more, which scores as well and is followed more closely.

    That is, the fitted trials are missed by less than :data:`CLEARLY` of what they were, where this is not near the
    noise (:data:`NEAR_NOISE`); or by :data:`BETTER` less, where the coefficients of the card would else be off by more
    than their standard errors.
    """
    decision, reached = judged.decision, _reached(judged)
    if decision.verdict == OUTSIDE_LIBRARY:
        return judged
    for larger in with_one_more(found, decision.best)[:TRIES]:
        limit = 1 - BETTER if makes_the_card_right(larger, decision.best) else CLEARLY
        if limit == CLEARLY and reached < NEAR_NOISE:
            continue
        more = decide_for(found, larger, decision.best, share)
        if more.verdict == OUTSIDE_LIBRARY:
            continue
        of_more = _prove_decision(card, trials, found, more, replays)
        closer = _reached(of_more) < limit * reached
        if closer and _most_are_closer(judged.proof.results, of_more.proof.results):
            return of_more
    return judged


def _prove_decision(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    decision: Decision,
    replays: TrialReplays,
) -> _Judged:
    """A decision with its effects as they are written on a card, and their proof."""
    by_formula = found.likelihood.by_formula(decision.best)
    estimated = estimates(by_formula)
    by_trial = surroundings_by_trial(by_formula, found.likelihood.motion.names)
    proof = _prove(card, trials, _NamedEffects(estimated, by_trial), replays, found, decision.best)
    return _Judged(decision, estimated, proof)


def _reached(judged: _Judged) -> float:
    """Misfit of the fitted trials, noise units."""
    return _misfit_of(judged.proof.results, "after", held_out=False)


def _surroundings_by_simulation(
    card: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    found: Search,
    judged: _Judged,
    replays: TrialReplays,
    names: Sequence[str],
) -> _Judged:
    """The decision, or in its place a wind or current of each trial that simulations follow much more closely with.

    A weak force that lasts turns a ship within minutes and is not seen from instant to instant, where random forces
    of the same size explain it as well. So where the trials are still missed by far (:data:`MUCH`), each wind or
    current that was not recorded is fitted to the free-running simulations. It is named if less than :data:`CLEARLY`
    of the misfit of the decision is left, and if the first half of the trials predicts the second (:data:`PREDICTS`).
    """
    reached = _misfit_of(judged.proof.results, "after")
    surroundings = [name for name in names if EFFECTS[name].surroundings and name not in found.none.hypothesis.recorded]
    if reached <= MUCH or any(EFFECTS[name].surroundings for name, *_ in judged.estimated):
        return judged
    tried: dict[str, tuple[ExplanationFit, CommonSurroundings, _Proof]] = {}
    alone = {fit.hypothesis.effects: fit for fit in reversed(found.fits)}
    fits = {name: alone[name,] for name in surroundings if (name,) in alone}
    at_sea = [add_effects_to_card(card, [(name, at_rest(name), {})]) for name in fits]
    arguments = at_sea, [trials[0]] * len(fits), fits, [dict(replays.noise)] * len(fits)
    each = map if replays.executor is None else replays.executor.map
    for (name, fit), common in zip(fits.items(), each(fit_common_surroundings, *arguments), strict=True):
        if np.median(common.predicted) < PREDICTS:
            named = _NamedEffects([(name, common.values, common.errors)], {name: common.by_trial})
            proof = _prove(card, trials, named, replays, found, fit)
            if _misfit_of(proof.results, "after") < CLEARLY * reached and closes_gap(proof.results, CLEARLY):
                tried[name] = _at(fit, common, found.likelihood.motion.names), common, proof
    if not tried:
        return judged
    proofs: dict[tuple[str, ...], _Proof] = {(): judged.proof}
    proofs |= {(name,): proof for name, (*_, proof) in tried.items()}
    best, *others = sorted(tried, key=lambda name: _misfit_of(tried[name][2].results, "after"))
    fit, common, proof = tried[best]
    alike = tuple(
        tried[name][0]
        for name in others
        if CLEARLY * _misfit_of(tried[name][2].results, "after") < _misfit_of(proof.results, "after")
    )
    decision = replace(
        judged.decision,
        verdict=AMBIGUOUS if alike else MISSING,
        best=fit,
        alike=alike,
        probabilities=_probabilities_by_simulation(card, trials[0], proofs),
    )
    if not alike and decision.confidence(best) < LIKELY:
        return judged
    estimated: list[Found] = [(best, common.values, common.errors)]
    said = (
        f"{best}: named by free-running simulations, not from instant to instant; fitted to the first half of each "
        f"trial, it leaves {np.median(common.predicted):.0%} of the misfit of the second half (median)"
    )
    return _Judged(decision, estimated, proof, judged.withheld, said)


def _at(fit: ExplanationFit, common: CommonSurroundings, trials: Sequence[str]) -> ExplanationFit:
    """A fit with the wind or current that simulations gave in the place of its own."""
    parts = {
        name: one.speed_mps * np.array([np.cos(one.direction_rad), np.sin(one.direction_rad)])
        for name, one in common.by_trial.items()
    }
    mean = Surroundings.of_parts(np.mean(list(parts.values()), axis=0), np.zeros(2))
    same = {"speed_mps": mean.speed_mps, "direction_rad": mean.direction_rad, **common.values}
    theta = [
        same.get(one.parameter.name, value) if one.run is None else parts[trials[one.run]][one.axis]
        for one, value in zip(fit.hypothesis.estimated, fit.theta, strict=True)
    ]
    return replace(fit, theta=np.array(theta))


def _probabilities_by_simulation(
    card: ManoeuvringCard, fitted: Measured, proofs: Mapping[tuple[str, ...], _Proof]
) -> dict[tuple[str, ...], float]:
    """Probability of each explanation by the misfits of the fitted trials.

    Their errors are of an unknown size and independent once in a passage of L/u0; an explanation has two numbers to a
    trial, or none, which cost what Schwarz's criterion asks.

    Parameters
    ----------
    card : ManoeuvringCard
        For L/u0.
    fitted : Measured
        T trials.
    proofs : mapping
        Names of the winds and currents of an explanation to the replays with it, of the fitted trials first.
    """
    passage = card.ship.length_m / card.model.speed_mps
    readings = np.array([(trial.time_s[-1] - trial.time_s[0]) / passage for trial in fitted.trials])
    scores = []
    for effects, proof in proofs.items():
        misfits = np.array([result.misfit("after") for result in proof.results if not result.held_out])
        numbers = 2 * len(fitted.trials) * len(effects)
        scores.append(2 * readings @ np.log(np.maximum(misfits, 1.0)) + numbers * np.log(np.sum(readings)))
    logs = -0.5 * np.array(scores) / TEMPER
    return dict(zip(proofs, map(float, softmax(logs)), strict=True))


def _closes_clearly(results: Sequence[Passed]) -> bool:
    """Whether a gap that is far above the noise becomes clearly smaller, in the trials held out as well."""
    before, after = (_misfit_of(results, version) for version in ("before", "after"))
    held = [result for result in results if result.held_out]
    alike = not held or _misfit_of(held, "after") < CLEARLY * _misfit_of(held, "before")
    return before > MUCH and after < CLEARLY * before and alike and closes_gap(results, CLEARLY)


@dataclass(frozen=True, eq=False)
class _NamedEffects:
    """Effects with their parameters, and the winds and currents of single trials."""

    estimated: list[Found]
    by_trial: ByTrial


@dataclass(frozen=True, eq=False)
class _Proof:
    """An improved card, all trials replayed by both cards, and what was fitted together with the effects."""

    trials: tuple[Measured, Measured]
    by_trial: ByTrial
    base: ManoeuvringCard
    improved: ManoeuvringCard
    results: list[Passed]
    coefficients: tuple[Refitted, ...] = ()
    effect_alone: Mapping[str, float] = field(default_factory=dict)


def _prove(
    card: ManoeuvringCard,
    given: tuple[Measured, Measured],
    named: _NamedEffects,
    replays: TrialReplays,
    found: Search,
    best: ExplanationFit,
) -> _Proof:
    """The card with the effects, and with coefficients fitted together with them if fitted trials are then followed
    better by :data:`BETTER`; replays by both cards.

    Winds and currents of single trials belong to the trials; those of a trial held out are fitted to itself.
    """
    estimated, by_trial = named.estimated, named.by_trial
    alone = add_effects_to_card(card, estimated)
    trials, by_trial = _in_surroundings(alone, given, by_trial, replays.noise)
    sensors = _sensor_faults(estimated)
    results = _replay_all(card, alone, trials, sensors, replays)
    proof = _Proof(trials, by_trial, card, alone, results)
    if _misfit_of(results, "after", held_out=False) > BETTER_FROM:
        estimates_with = found.likelihood.coefficients_with(best)
        refitted, base = refit_coefficients(card, found.likelihood.none.model, estimates_with)
        joint = add_effects_to_card(base, estimated)
        trials, by_trial = _in_surroundings(joint, given, by_trial, replays.noise)
        joint_results = _replay_all(card, joint, trials, sensors, replays)
        misfits = [_misfit_of(group, "after", held_out=False) for group in (results, joint_results)]
        if misfits[1] < (1 - BETTER) * misfits[0] and _most_are_closer(results, joint_results):
            keys = {"fit": False, "holdout": True} if trials[1].trials else {"fit": False}
            of_effect = {key: _misfit_of(results, "after", held_out=held) for key, held in keys.items()}
            proof = _Proof(trials, by_trial, base, joint, joint_results, refitted, of_effect if estimated else {})
    return proof


def _begin_black_box(
    card: ManoeuvringCard, proof: _Proof, estimated: Sequence[Found], replays: TrialReplays
) -> Callable[[], BlackBox] | None:
    """A black box with as many coefficients as the named effects have parameters, fitted by another process if there is
    one; none without effects."""
    if not estimated:
        return None
    count = max(sum(len(errors) for *_, errors in estimated), 1)
    arguments = card, proof.trials[0], dict(replays.noise), count
    if replays.executor is None:
        return partial(black_box, *arguments)
    return replays.executor.submit(black_box, *arguments).result


def _with_black_box(proof: _Proof, box: ManoeuvringCard, replays: TrialReplays) -> list[Passed]:
    """The replays of a proof, and by the card of a black box."""
    boxed: list[Passed] = []
    for group, held_out in zip(proof.trials, (False, True), strict=True):
        of_group = [result for result in proof.results if result.held_out == held_out]
        boxed += replays.with_black_box(of_group, box, group) if of_group else []
    return boxed


def _in_surroundings(
    card: ManoeuvringCard, trials: tuple[Measured, Measured], by_trial: ByTrial, sigmas: Mapping[str, float]
) -> tuple[tuple[Measured, Measured], ByTrial]:
    """Trials in the winds and currents that were found for them, and those, with the ones of the trials held out."""
    if not by_trial:
        return trials, by_trial
    held = fit_surroundings(card, trials[1], tuple(by_trial), sigmas) if trials[1].trials else {}
    every = {name: {**found, **held.get(name, {})} for name, found in by_trial.items()}
    return (with_surroundings(trials[0], every), with_surroundings(trials[1], every)), every


def _replay_all(
    card: ManoeuvringCard,
    improved: ManoeuvringCard,
    trials: tuple[Measured, Measured],
    sensors: Sequence[Found],
    replays: TrialReplays,
) -> list[Passed]:
    """All trials replayed by both cards."""
    results: list[Passed] = []
    for group, held_out in zip(trials, (False, True), strict=True):
        if group.trials:
            corrected = _corrected(group, sensors)
            results += replays.by_cards(card, improved, group, held_out, corrected)
    return results


def _most_are_closer(before: Sequence[Passed], after: Sequence[Passed]) -> bool:
    """Whether at least half of the fitted trials are followed no worse: coefficients hold in all of them, and must not
    follow what happened in one."""
    pairs = [pair for pair in zip(before, after, strict=True) if not pair[0].held_out]
    return bool(np.median([new.misfit("after") / old.misfit("after") for old, new in pairs]) <= 1.0)


def _misfit_of(results: Sequence[Passed], version: str, *, held_out: bool | None = None) -> float:
    """Root mean square of the misfits of trials, noise units; of all, or of those held out or fitted."""
    chosen = [result.misfit(version) for result in results if held_out is None or result.held_out == held_out]
    return float(np.sqrt(np.mean(np.square(chosen))))


def _sensor_faults(estimated: Sequence[Found]) -> list[Found]:
    return [effect for effect in estimated if EFFECTS[effect[0]].acts_on == "sensor"]


def _corrected(group: Measured, sensors: Sequence[Found]) -> Measured | None:
    if not sensors:
        return None
    return replace(group, trials=tuple(correct_sensor_faults(trial, sensors) for trial in group.trials))


def _after(every: Sequence[Trial], fitted: Measured, held: Measured, sensors: Sequence[Found]) -> Sequence[Trial]:
    groups = (_corrected(group, sensors) or group for group in (fitted, held))
    return [trial for group in groups for trial in group.trials] if sensors else every


def _noise(found: Search, best: ExplanationFit, fitted: Measured) -> dict[str, tuple[float, str]]:
    """Standard deviation of one reading of each variable: white and slow noise and the motion in waves together, SI."""
    motion, noise = found.likelihood.motion, best.noise
    stated = {
        OBSERVED_SIGNALS[name]: value
        for trial in fitted.trials
        for name, value in trial.noise.items()
        if name in OBSERVED_SIGNALS
    }
    readings = motion.fine * motion.averaged
    waves = found.likelihood.belief.waves
    in_waves = waves.motion if waves else {}
    sizes = {}
    for place, name in enumerate(motion.seen):
        sigma = float(np.sqrt(noise.white[place] ** 2 * readings + noise.slow[place] ** 2))
        size, origin = (stated[name], "stated") if name in stated else (sigma, "estimated")
        sizes[name] = float(np.hypot(size, in_waves.get(name, 0.0))), origin
    return sizes


def _rivals(found: Search, decision: Decision) -> tuple[Rival, ...]:
    """The best explanations, and none; the probability of those that simulations excluded is 0."""
    least = found.fits[0].score
    shown = [*found.fits[:RIVALS]]
    shown += [found.none] if found.none not in shown else []
    return tuple(
        Rival(fit.hypothesis.effects, fit.score - least, decision.probabilities.get(fit.hypothesis.effects, 0.0))
        for fit in shown
    )


def _next(card: ManoeuvringCard, found: Search, decision: Decision, noise: Mapping[str, float]) -> NextTest | None:
    """The manoeuvre that would distinguish the explanations that these trials could not."""
    if decision.verdict != AMBIGUOUS:
        return None
    rivals = [_explanation(card, found, fit) for fit in (decision.best, *decision.alike)]
    return next_test(rivals, noise, unsure_s=float(found.likelihood.motion.unsure_s.max()))


def _explanation(card: ManoeuvringCard, found: Search, fit: ExplanationFit) -> Explanation:
    """A card with an explanation's effects, and the covariance of its uncertain parameters."""
    entries = [
        EffectEntry(name=name, parameters={**at_rest(name), **values}, uncertainty=dict(errors))
        for name, values, errors in estimates(fit)
    ]
    whole = replace(card, effects=(*card.effects, *entries))
    coefficients = found.likelihood.coefficients
    # An effect may take the place of a parameter: of the gear's time constant, for a lag.
    kept = [place for place, name in enumerate(coefficients.names) if name in fit.hypothesis.model]
    shared_by_trials = [place for place, estimate in enumerate(fit.hypothesis.estimated) if estimate.run is None]
    variables = [fit.hypothesis.estimated[place].variable for place in shared_by_trials]
    names = (*variables, *(coefficients.names[place] for place in kept))
    shared = coefficients.spread(fit.width)[kept]
    spread = np.zeros((len(names), len(names)))
    count = len(variables)
    spread[count:, count:] = shared @ shared.T
    spread[:count, :count] = fit.covariance[np.ix_(shared_by_trials, shared_by_trials)]
    return Explanation(" and ".join(fit.hypothesis.effects) or "none", whole, names, spread)


def _notices(
    card: ManoeuvringCard,
    judged: _Judged,
    agreement: Mapping[str, Mapping[str, tuple[float, float]]],
    trials: tuple[Measured, Measured],
    waves: WaveBand | None,
) -> tuple[str, ...]:
    decision, results, withheld = judged.decision, judged.proof.results, judged.withheld
    own_surroundings = tuple(judged.proof.by_trial) if trials[1].trials else ()
    notices = [*trials[0].notices, *trials[1].notices]
    notices += [_of_waves(waves)] if waves else []
    notices += [judged.by_simulation] if judged.by_simulation else []
    notices += [_in_words(strange) for strange in decision.strange]
    notices += [
        f"{names}: fits best from instant to instant, but simulations with it are not closer than without: not named"
        for names in withheld
    ]
    if own_surroundings:
        notices.append(
            f"{' and '.join(own_surroundings)} of the trials held out: fitted to each of them, two numbers to a "
            "record; all else is as the fitting trials have it"
        )
    if card.effects:
        have = ", ".join(entry.name for entry in card.effects)
        notices.append(f"{have}: kept as on the card, and not sought")
    remaining = float(np.sqrt(np.mean([result.misfit("after") ** 2 for result in results])))
    if decision.verdict != OUTSIDE_LIBRARY and remaining > MUCH:
        notices.append(
            f"the trials are still missed by {remaining:.3g} times the noise: random forces (gusts, waves), "
            "coefficients that are off, or something more that is missing; the standard errors do not cover it"
        )
        if structure := structure_that_adds(card, decision.best.hypothesis.effects):
            notices.append(
                f"identify with --structure {structure} fits {' and '.join(decision.best.hypothesis.effects)} to the "
                "trials together with the hull's derivatives, from the card as it was given"
            )
    notices += [
        f"{name}: the same to these trials as {coefficient.name}, which was refitted by {coefficient.moved:.2g} of its "
        "standard errors"
        for name, coefficient in effects_like(
            judged.proof.coefficients, {name for name, *_ in judged.estimated}
        ).items()
    ]
    if decision.verdict in (MISSING, AMBIGUOUS):
        notices += [f"{name}: the improved card follows it worse than the given one" for name in worse_trials(results)]
    for variable, values in agreement.items():
        if len(values) > 1 and (said := trial_consistency(values)).p < DOUBT:
            notices.append(f"the trials do not agree about {variable} (Cochran Q {said.q:.3g}, p {said.p:.1g})")
    return tuple(dict.fromkeys(notices))


def _of_waves(waves: WaveBand) -> str:
    speed, rate = waves.motion["motion.v"], np.rad2deg(waves.motion["motion.r"])
    return (
        f"waves or a swell with a period of {waves.period_s:.3g} s move the ship in the fitted trials (standard "
        f"deviation {speed:.2g} m/s in sway, {rate:.2g} deg/s in yaw): counted as noise, not as a missing effect; "
        f"{' and '.join(name for name, effect in EFFECTS.items() if effect.resonant)}, which they hide, is not sought"
    )


def _in_words(strange: Strange) -> str:
    when = f"from {strange.begin_s:.0f} to {strange.end_s:.0f} s"
    if strange.kind == "period":
        return f"all trials: an oscillation with a period of {strange.begin_s:.3g} s that nothing in the library causes"
    return f"{strange.trial}: {when} a motion of the ship that nothing in the library explains"


__all__ = ["AMBIGUOUS", "MISSING", "NO_EFFECT_MISSING", "OUTSIDE_LIBRARY", "GapOptions", "run_gap_workflow"]
