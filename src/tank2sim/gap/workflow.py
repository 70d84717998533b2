"""The gap workflow: locate the gap, screen and fit possible effects, decide, add the effect, and check it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arguments import FALSE_DISCOVERY, MOST_EFFECTS
from tank2sim.cards.card import Card, ManoeuvringCard, SteeredBy, SteeredCard
from tank2sim.cards.examination import doubts
from tank2sim.cards.form import EffectEntry
from tank2sim.errors import ArgumentError
from tank2sim.executors import executing, processes_to_begin
from tank2sim.gap.diagnosis.misfit_location import equation_of, figures, places
from tank2sim.gap.diagnosis.residuals import (
    each_trial,
    effects_at_work,
    estimates,
    force_lacking,
)
from tank2sim.gap.improve_card import Found, at_rest
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.inference.hypothesis import parameter_places
from tank2sim.gap.inference.prior import candidate_explanations, likelihood_from_card
from tank2sim.gap.outcome.next_test import Explanation, next_test
from tank2sim.gap.outcome.notices import gap_notices, of_tried_effects
from tank2sim.gap.proof.card_fitness import improvement_objections
from tank2sim.gap.proof.cross_check import BlackBox, black_box
from tank2sim.gap.proof.improvement import Proof, Prover, corrected, sensor_faults
from tank2sim.gap.proof.judge import Judged, judge
from tank2sim.gap.proof.judge_surroundings import judge_surroundings
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
    Rival,
)
from tank2sim.gap.search.decision import Decision, decide, enough_to_name
from tank2sim.gap.search.detection_limit import could_hide
from tank2sim.gap.search.explanations import CLOSE, Search, search
from tank2sim.identification.trials.assessment.other_ship import evidence_of_other_ship, not_of_ship
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    above_low_speed,
    lowered_bound_notice,
    polynomial_over_trials,
)
from tank2sim.notices import Notice
from tank2sim.records.trials import Trial
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS

_Result = TypeVar("_Result")

RIVALS = 12
"""Explanations that are reported at most, besides none (project choice)."""


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
        Effects named at most, 1 to :data:`.MOST_EFFECTS`.
    workers : int, optional
        Processes; by default as many as there are processors.
    false_discovery : float
        Largest probability with which a set that is named alone may hold an effect that is not missing, 0.01 to 0.5.
    force : bool
        Write the improved card in spite of objections.
    black_box : bool
        Compare the named effects with a linear black box.
    """

    effects: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    max_effects: int = MOST_EFFECTS
    workers: int | None = None
    false_discovery: float = FALSE_DISCOVERY
    force: bool = False
    black_box: bool = False


def nonlinear_card(card: Card) -> SteeredCard:
    """Return the card, if a missing effect can be sought for it.

    Raises
    ------
    InputError
        It is not of a ship with a rudder or a craft with thrusters, or its equations are linear.
    """
    vessel = card.steered()
    if vessel.model.kind == "linear":
        remedy = 'set kind = "abkowitz"; its missing third-order terms are then zero'
        raise vessel.fault("model.kind", "is linear, and most effects are not part of such a model", remedy)
    return vessel


def run_gap_workflow(
    card: SteeredCard,
    fitted: Measured,
    held: Measured,
    options: GapOptions | None = None,
    progress: StageReport = lambda text: None,
    executor: Executor | None = None,
) -> Gap:
    """Find where a card's model and trials differ, name the missing effect, add it, and check it.

    Parameters
    ----------
    card : SteeredCard
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
        A trial is too short or measures too little, a requested effect cannot be tried on this card, or the card's
        forces along the measured motion are not finite.
    """
    options = options or GapOptions()
    of_card, lowest = tuple(doubts(card)), math.inf
    if card.steered_by is SteeredBy.RUDDER:
        given = card.manoeuvring()
        card = ship = polynomial_over_trials(given, fitted.trials)
        lowest = polynomial_over_trials(given, (*fitted.trials, *held.trials)).model.low_speed_bound_mps
        of_card = (*of_card, *lowered_bound_notice(given, ship))
        fitted, held = _of_ship(ship, fitted), _of_ship(ship, held)
        if evidence := evidence_of_other_ship(ship, fitted):
            remedy = "give the card and the trials of one ship, in the same units and signs"
            raise not_of_ship(ship, fitted, evidence, remedy)
    elif options.black_box:
        raise ArgumentError("black_box", "", "is not for a craft with thrusters", "leave it out")
    # Small matrices: threads of the linear algebra library would wait for each other.
    with threadpool_limits(limits=1, user_api="blas"), _processes(options, executor) as pool:
        names = _names(card, fitted, options)
        try:
            found = search(likelihood_from_card(card, fitted), progress, pool, names, most=options.max_effects)
        except FloatingPointError as error:
            problem = f"gives no finite forces along the motion of the trials ({error})"
            remedy = "check the units of its numbers and of the trials' columns"
            raise card.fault("", problem, remedy) from None
        decision = decide(found, options.false_discovery)
        progress("proving")
        noise = {name: sigma for name, (sigma, _) in _noise(found, decision.best, fitted).items()}
        prover = Prover(card, (fitted, held), found.likelihood, TrialReplays(noise, pool), lowest)
        prover.begin()
        judged = judge_surroundings(prover, found, judge(prover, found, decision), names)
        if judged.decision.verdict in (MISSING, AMBIGUOUS, COEFFICIENTS):
            progress("refining the coefficients")
            judged = replace(judged, proof=prover.refine(judged.proof))
        opened = replace(judged, proof=prover.open_holdout(judged.proof))  # the verdict is fixed
        progress("where and how much")
        gap = _assemble_gap(prover, found, opened, options)
        tried = of_tried_effects(names, candidate_explanations(card, fitted.driven_by))
        progress("trying the improved card")
        return replace(
            gap,
            notices=(*of_card, *tried, *gap.notices),
            objections=improvement_objections(card, gap.improved, gap.passed),
        )


def _of_ship(card: ManoeuvringCard, group: Measured) -> Measured:
    """Trials in the range of a card's polynomial, without heel where the ship rolls: errors of the motion excite it."""
    group = above_low_speed(card, group)
    if card.roll is None or not any("phi_rad" in trial.signals for trial in group.trials):
        return group
    trials = tuple(
        replace(trial, signals={name: values for name, values in trial.signals.items() if name != "phi_rad"})
        for trial in group.trials
    )
    notice = "heel is computed and not compared: only what it changes of the motion in the plane is seen"
    return replace(group, trials=trials, notices=(*group.notices, Notice(notice)))


def _names(card: SteeredCard, fitted: Measured, options: GapOptions) -> tuple[str, ...]:
    possible = candidate_explanations(card, fitted.driven_by)
    for name in options.effects or ():
        if name not in possible:
            have = any(entry.name == name for entry in card.effects)
            why = "is on the card already" if have else "cannot be tried on this card and these trials"
            raise ArgumentError("effects", "", f"{name} {why}", f"possible are: {', '.join(possible)}")
    names = tuple(name for name in options.effects or possible if name not in options.without)
    if not names:
        raise ArgumentError("without", "", "leaves no effect to look for", f"possible are: {', '.join(possible)}")
    return names


@contextmanager
def _processes(options: GapOptions, executor: Executor | None) -> Iterator[Executor | None]:
    count = processes_to_begin(options.workers)
    if executor is not None or count == 1:
        yield executor
        return
    with executing(workers=count) as pool:
        yield pool


def _assemble_gap(prover: Prover, found: Search, judged: Judged, options: GapOptions) -> Gap:
    """The results that follow from the decision."""
    card, (fitted, held), replays = prover.card, prover.trials, prover.replays
    decision, proof = judged.decision, judged.proof
    estimated = proof.named.estimated
    box = _begin_black_box(card, proof, replays) if options.black_box else None
    figures_before = _begun(replays, figures, card, (*fitted.trials, *held.trials), proof.results, "before")
    faultless = _without_sensor_faults(prover.trials, sensor_faults(estimated))
    figures_after = _begun(replays, figures, proof.improved, faultless, proof.results, "after")
    hidden = could_hide(found, decision.best, enough_to_name(options.false_discovery))
    force = force_lacking(found.likelihood, found.none)
    agreement = each_trial(found.likelihood, decision.best) if estimated else {}
    waves = found.likelihood.belief.waves
    results = _with_black_box(proof, box().card, replays) if box else proof.results
    return Gap(
        card=card,
        improved=proof.improved,
        base=proof.base,
        verdict=decision.verdict,
        effects=tuple(
            Named(*effect, decision.confidence(effect[0]), proof.named.by_trial.get(effect[0], {}))
            for effect in estimated
        ),
        coefficients=proof.coefficients,
        effect_alone=proof.effect_alone,
        alternatives=judged.alternatives(card),
        rivals=_rivals(found, decision),
        where=places(results),
        equation=equation_of([name for name, *_ in estimated], proof.improved, force, results),
        noise=_noise(found, decision.best, fitted),
        waves=waves,
        passed=tuple(results),
        figures_before=figures_before(),
        figures_after=figures_after(),
        missing_force=force,
        at_work=effects_at_work(found.likelihood, decision.best) if estimated else (),
        could_hide=hidden,
        agreement=agreement,
        next_test=_next(card, found, decision, replays.noise),
        notices=gap_notices(card, judged, agreement, prover.trials, waves),
        doubts=fitted.doubts,
    )


def _begin_black_box(card: SteeredCard, proof: Proof, replays: TrialReplays) -> Callable[[], BlackBox] | None:
    """A black box with as many coefficients as the effects have parameters, fitted apart if possible; else none."""
    if not proof.named.estimated:
        return None
    count = max(sum(len(errors) for *_, errors in proof.named.estimated), 1)
    arguments = card, proof.trials[0], dict(replays.noise), count
    return _begun(replays, black_box, *arguments)


def _begun(replays: TrialReplays, function: Callable[..., _Result], *arguments: object) -> Callable[[], _Result]:
    """A function that waits for a result, which is computed apart if possible."""
    if replays.executor is None:
        return partial(function, *arguments)
    return replays.executor.submit(function, *arguments).result


def _with_black_box(proof: Proof, box: SteeredCard, replays: TrialReplays) -> list[Passed]:
    """The replays of a proof, and by the card of a black box."""
    boxed: list[Passed] = []
    for group, held_out in zip(proof.trials, (False, True), strict=True):
        of_group = [result for result in proof.results if result.held_out == held_out]
        boxed += replays.with_black_box(of_group, box, group) if of_group else []
    return boxed


def _without_sensor_faults(groups: Sequence[Measured], sensors: Sequence[Found]) -> list[Trial]:
    """All trials, without the faults of their sensors."""
    return [trial for group in groups for trial in (corrected(group, sensors) or group).trials]


def _noise(found: Search, best: ExplanationFit, fitted: Measured) -> dict[str, tuple[float, str]]:
    """Standard deviation of one reading of each variable: white and slow noise and the motion in waves together, SI."""
    motion, noise = found.likelihood.motion, best.noise
    stated = {
        OBSERVED_SIGNALS[name]: value
        for trial in fitted.trials
        for name, value in trial.noise.items()
        if name in OBSERVED_SIGNALS
    }
    waves = found.likelihood.belief.waves
    in_waves = waves.motion if waves else {}
    sizes = {}
    for place, name in enumerate(motion.seen):
        sigma = float(np.sqrt(noise.white[place] ** 2 * motion.readings + noise.slow[place] ** 2))
        size, origin = (stated[name], "stated") if name in stated else (sigma, "estimated")
        sizes[name] = float(np.hypot(size, in_waves.get(name, 0.0))), origin
    return sizes


def _rivals(found: Search, decision: Decision) -> tuple[Rival, ...]:
    """The most probable explanations, and none, the best score first; those that were not compared have 0.

    Further behind none than :data:`.explanations.CLOSE`, a fit was given up before its noise was found.
    """
    chances = {fit.hypothesis.effects: decision.probabilities.get(fit.hypothesis.effects, 0.0) for fit in found.fits}
    likeliest = {*sorted(chances, key=lambda effects: -chances[effects])[:RIVALS], ()}
    settled = [fit for fit in found.fits if fit.score < found.none.score + CLOSE]
    shown = [fit for fit in settled if fit.hypothesis.effects in likeliest]
    return tuple(
        Rival(fit.hypothesis.effects, fit.score - shown[0].score, chances[fit.hypothesis.effects]) for fit in shown
    )


def _next(card: SteeredCard, found: Search, decision: Decision, noise: Mapping[str, float]) -> NextTest | None:
    """The manoeuvre that would distinguish the explanations that these trials could not."""
    if decision.verdict != AMBIGUOUS or card.steered_by is SteeredBy.THRUSTERS:
        return None
    rivals = [_explanation(card, found, fit) for fit in (decision.best, *decision.alike)]
    return next_test(rivals, noise, unsure_s=float(found.likelihood.motion.unsure_s.max()))


def _explanation(card: SteeredCard, found: Search, fit: ExplanationFit) -> Explanation:
    """A card with an explanation's effects, and the covariance of its uncertain parameters."""
    entries = [
        EffectEntry(name=name, parameters={**at_rest(name), **values}, uncertainty=dict(errors))
        for name, values, errors in estimates(fit)
    ]
    whole = replace(card, effects=(*card.effects, *entries))
    coefficients = found.likelihood.coefficients
    # An effect may take the place of a parameter: of the gear's time constant, for a lag.
    kept = [place for place, name in enumerate(coefficients.names) if name in fit.hypothesis.model]
    shared_by_trials = parameter_places(fit.hypothesis.estimated)
    variables = [fit.hypothesis.estimated[place].variable for place in shared_by_trials]
    names = (*variables, *(coefficients.names[place] for place in kept))
    shared = coefficients.spread(fit.width)[kept]
    spread = np.zeros((len(names), len(names)))
    count = len(variables)
    spread[count:, count:] = shared @ shared.T
    spread[:count, :count] = fit.covariance[np.ix_(shared_by_trials, shared_by_trials)]
    return Explanation(" and ".join(fit.hypothesis.effects) or "none", whole, names, spread)


__all__ = ["AMBIGUOUS", "MISSING", "NO_EFFECT_MISSING", "OUTSIDE_LIBRARY", "GapOptions", "run_gap_workflow"]
