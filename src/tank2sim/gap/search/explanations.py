"""The search for the explanation: none, single effects, pairs; screened together, then each fitted by itself; then
more effects on top of the best pair, one at a time.

The screen is linear and at one noise, the fit is not and estimates the noise again; so the screen only proposes. It is
evaluated at the noise of "none" (large, for it must cover the missing effect), and again at the noise of the best
explanation so far. Pairs are screened as pairs, for with two effects missing the best single one is often neither of
them; and each effect of the best pair is tried with all other effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS, nearly_like
from tank2sim.errors import InputError
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_all import Fitting, HypothesisCache, Proposal, StageReport, refit, thetas_of
from tank2sim.gap.inference.fit_waves import fit_waves
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import PRICE, candidate_explanations
from tank2sim.gap.search.screening import Screen, Screened, Variant, variants

FIRST_SINGLES, FIRST_PAIRS = 6, 2
SINGLES, PAIRS, WITH_THE_BEST, SWAPS = 8, 3, 3, 1
"""Number of proposals of each screen that are fitted (project choice)."""

WAVES_WITH_NONE = 2
"""Times that waves are fitted with the card as it is, the noise after each: the one takes its share from the other."""

COMPARABLE = 0.5
"""Share of the largest gain in the screen from which a single effect is fitted (project choice): a gain is linear in
the effect, and of a large effect it is wrong by a share of itself."""

WORTH = 5.0
"""Proposals whose gain in the screen is further below 0 are not fitted; nor is more sought on top of a set that gained
less with its last effect (project choice)."""

NARROW = 0.3
"""Width of the coefficients, in their standard errors, at which the screen is asked as well where the best explanation
needs more than one (project choice: of made-up ships most have 0.1 to 0.6 with all their effects)."""

HOPELESS = 100.0
"""Proposals whose gain, or whose score in the first fit, is this far behind the best of their kind are not fitted
(project choice)."""

MUCH_BETTER = 50.0
"""An explanation that is better by this than the one about whose motion all are linear is the next to be linear about
(project choice): a score is then wrong by up to a fifth of this, the difference that decides."""

_FAR = 300.0
"""The noise of an explanation this far behind the best, at the noise of the best, is not estimated, and it is not tried
again (project choice)."""

ROUNDS_OF_NONE, ROUNDS, LAST_ROUNDS = (15,), (0, 8), (15,)
"""Most iterations on the noise after each solution for the parameters, see :meth:`.likelihood.Likelihood.at_best`. In
steps of its scale a score is known to some 3 after 5, to 1 after 8, to 0.1 after 12."""

SAME_NOISE = (0,)
"""Rounds that estimate the parameters alone, at the best of the given noises."""

CLOSE = 30.0
"""Explanations within this of the best are fitted once more at the end (project choice)."""


@dataclass(frozen=True, eq=False)
class Search:
    """Result of the search.

    Parameters
    ----------
    likelihood : Likelihood
        Linear about the motion of the best explanation.
    fits : tuple of ExplanationFit
        Every explanation that was fitted, "none" among them, the best (lowest score) first.
    variants : tuple of Variant
        All effects at their typical sizes.
    """

    likelihood: Likelihood
    fits: tuple[ExplanationFit, ...]
    variants: tuple[Variant, ...]

    @property
    def none(self) -> ExplanationFit:
        """The card as it is."""
        return next(fit for fit in self.fits if not fit.hypothesis.effects)


def search(
    likelihood: Likelihood,
    progress: StageReport = lambda text: None,
    executor: Executor | None = None,
    names: Sequence[str] | None = None,
    *,
    most: int = 2,
) -> Search:
    """Find the explanations that fit the trials best.

    Parameters
    ----------
    likelihood : Likelihood
    progress : callable
        Called with the name of each explanation that is fitted.
    executor : Executor, optional
        Fits several explanations at once.
    names : sequence of str, optional
        Effects to try; by default all that can be tried.
    most : int
        Effects together, at least 1.

    Raises
    ------
    FloatingPointError
        Forces along the measured motion are not finite with the best explanation.
    """
    hypotheses = HypothesisCache(likelihood.none, likelihood.motion)
    believed = likelihood.belief.logs
    rough = Fitting(likelihood, hypotheses, progress, executor)
    chosen = candidate_explanations(likelihood.none.card, likelihood.none.driven_by) if names is None else names
    begun = rough.begin([Proposal({}, [believed], ROUNDS_OF_NONE)])
    by_effect = {name: _variants(likelihood, hypotheses, name) for name in chosen}
    rough.finish(begun)
    for _ in range(WAVES_WITH_NONE):
        likelihood = likelihood.with_waves(fit_waves(likelihood, rough.best()))
        if likelihood.belief.waves is None:
            break
        rough = Fitting(likelihood, hypotheses, progress, executor)
        rough.fit([Proposal({}, [believed], ROUNDS_OF_NONE)])
    likelihood = likelihood.with_scale(likelihood.noise_scale(rough.best()))
    rough = Fitting(likelihood, hypotheses, progress, executor, rough.found)
    if likelihood.belief.waves is not None:
        chosen = tuple(name for name in chosen if not EFFECTS[name].resonant) or chosen
    every = tuple(variant for name in chosen for variant in by_effect[name])
    none = rough.best()
    first = Screen(likelihood, none, every)
    proposed = [*first.singles()[:FIRST_SINGLES], *(first.pairs()[:FIRST_PAIRS] if most > 1 else ())]
    rough.fit(_proposals(rough, proposed, [none.logs, believed], least=2))
    fitting = _about_best(rough)
    for stage in (_explore, _let_surroundings_differ, _add_more):
        reached = fitting.best().score
        stage(fitting, every, most)
        if fitting.best().score < reached - MUCH_BETTER:
            fitting = _about_best(fitting)
    _polish(fitting)
    _fit_nearly_alike(fitting, every)
    fits = sorted(fitting.found.values(), key=lambda fit: fit.score)
    return Search(fitting.likelihood, tuple(fits), every)


def _about_best(fitting: Fitting) -> Fitting:
    """All explanations, and "none", fitted again about the motion of the best, whose residual is small."""
    best, none = fitting.best(), fitting.found[()]
    kept = [fit for fit in fitting.found.values() if fit.score < best.score + HOPELESS and fit.hypothesis.effects]
    likelihood = fitting.likelihood.about(best)
    if likelihood.belief.waves is not None:
        likelihood = likelihood.with_waves(fit_waves(likelihood, best))
    nearer = likelihood.at_best(best.hypothesis, best.theta, [best.logs], LAST_ROUNDS)
    likelihood = likelihood.with_scale(likelihood.noise_scale(nearer))
    about = Fitting(likelihood, fitting.hypotheses, fitting.progress, fitting.executor)
    about.fit(
        [Proposal({}, [nearer.logs, none.logs, likelihood.belief.logs], ROUNDS_OF_NONE)]
        + [refit(fit, [nearer.logs, fit.logs], ROUNDS) for fit in kept]
    )
    return about


def _variants(likelihood: Likelihood, hypotheses: HypothesisCache, name: str) -> tuple[Variant, ...]:
    """Variants of an effect; none if the card lacks its data (revolutions, for an effect of the propeller)."""
    try:
        return variants(likelihood, hypotheses(name))
    except InputError:
        return ()


def _explore(fitting: Fitting, every: Sequence[Variant], most: int) -> None:
    """Singles, pairs and swaps at the noise of the best so far."""
    best = fitting.best()
    starts = [best.logs, fitting.likelihood.belief.logs]
    second = Screen(fitting.likelihood, replace(fitting.best(0), logs=best.logs), every)
    singles, pairs = second.singles(), second.pairs() if most > 1 else ()
    enough = min(singles[0].gain - HOPELESS, COMPARABLE * singles[0].gain)
    proposed = [single for single in singles[:SINGLES] if single.gain > enough]
    proposed += [pair for pair in pairs[:PAIRS] if pair.gain > singles[0].gain]
    if len(best.hypothesis.effects) < min(most, 2):
        _fit_more(fitting, best, every)
    fitting.fit(_proposals(fitting, proposed, starts, least=1, limit=best.score + _FAR))
    if (now := fitting.best()).hypothesis.effects != best.hypothesis.effects and len(now.hypothesis.effects) < most:
        _fit_more(fitting, now, every)
    if not fitting.has(2) or fitting.best(2).score > fitting.best(1).score - WORTH:
        return
    pair = fitting.best(2)
    alone = [Screened({name: theta}, 0.0) for name, theta in thetas_of(pair).items()]
    swapped = [*alone, *_with_one_swapped(fitting, pair, every)]
    fitting.fit(_proposals(fitting, swapped, [pair.logs], limit=pair.score + _FAR))


def _let_surroundings_differ(fitting: Fitting, every: Sequence[Variant], most: int) -> None:
    """Winds and currents that differ from trial to trial, alone, together, and next to the best explanation."""
    chosen = dict.fromkeys(variant.effect for variant in every)
    unknown = [name for name in chosen if EFFECTS[name].surroundings and name not in fitting.hypotheses.recorded]
    if fitting.hypotheses.runs < 2:
        return
    best = fitting.best()
    sets = _sets_in_surroundings(fitting, best, unknown, most)
    starts = [best.logs, fitting.likelihood.belief.logs]
    common = [fit for fit in fitting.found.values() if set(unknown) & set(fit.hypothesis.effects)]
    limit, each = best.score + _FAR, tuple(unknown)
    fitting.fit([Proposal(thetas, starts, ROUNDS, limit, each=each) for thetas in sets])
    # The form that is the same in all trials, at the noise of the one that took its place: a score that has converged
    # is lower than one that has not.
    fitting.fit(
        [refit(fit, [now.logs], ROUNDS) for fit in common if (now := fitting.found[fit.hypothesis.effects]) is not fit]
    )
    if most == 1 or not fitting.has(1):
        return
    best = fitting.best(1)
    if best.hypothesis.each and (not fitting.has(2) or best.score < fitting.best(2).score + _FAR):
        fitting.fit(
            [
                Proposal(proposed.thetas, [best.logs], ROUNDS, best.score + _FAR, each=best.hypothesis.each)
                for proposed in _on_top_of(fitting, best, every)[:WITH_THE_BEST]
                if proposed.gain > -WORTH
            ]
        )


def _sets_in_surroundings(
    fitting: Fitting, best: ExplanationFit, unknown: Sequence[str], most: int
) -> list[dict[str, Array]]:
    """Each wind or current by trial, both together, and each with an effect of the best; still to begin with."""
    still = {name: _still(fitting.hypotheses(name, each=(name,))) for name in unknown}
    sets = [{name: still[name]} for name in unknown]
    if most == 1:
        return sets
    if len(unknown) > 1:
        sets.append(still)
    others = {effect: theta for effect, theta in thetas_of(best).items() if effect not in unknown}
    return [*sets, *({effect: theta, name: still[name]} for effect, theta in others.items() for name in unknown)]


def _add_more(fitting: Fitting, every: Sequence[Variant], most: int) -> None:
    """More effects on the best set of two or more while each gains :data:`WORTH`, and the sets without each of the
    others, or with another in its place, of which one may be the best now."""
    extended: set[tuple[str, ...]] = set()
    while True:
        best = fitting.best()
        effects = best.hypothesis.effects
        if not 2 <= len(effects) < most or effects in extended:
            return
        extended.add(effects)
        _fit_more(fitting, best, every)
        larger = fitting.best()
        if larger.score > best.score - WORTH:
            return
        thetas = thetas_of(larger)
        smaller = [{name: theta for name, theta in thetas.items() if name != dropped} for dropped in thetas]
        _fit_near(fitting, [Screened(parts, 0.0) for parts in smaller], larger)
        _fit_near(fitting, _with_one_swapped(fitting, fitting.best(), every), fitting.best())


def _with_one_swapped(fitting: Fitting, fit: ExplanationFit, every: Sequence[Variant]) -> list[Screened]:
    """Sets with another effect in the place of each of a fit's: those that the screen likes best, or nearly alike."""
    swapped = _nearly_alike(fitting, fit, every)
    for dropped in (thetas := thetas_of(fit)):
        kept = {name: theta for name, theta in thetas.items() if name != dropped}
        theta = np.concatenate([*kept.values(), np.zeros(0)])
        without = fitting.hypotheses(*kept, each=fit.hypothesis.each)
        base = replace(fit, hypothesis=without, theta=theta, covariance=np.zeros((len(theta), len(theta))))
        others = [variant for variant in every if variant.effect != dropped]
        swapped += _on_top_of(fitting, base, others)[:SWAPS]
    return swapped


def _fit_more(fitting: Fitting, best: ExplanationFit, every: Sequence[Variant]) -> None:
    """The best with each effect that the screen proposes; asked again with narrow coefficients where those are off."""
    _fit_near(fitting, _on_top_of(fitting, best, every)[:WITH_THE_BEST], best)
    if best.width > 1.0:
        narrow = replace(best, logs=np.append(best.logs[:-1], np.log(NARROW)))
        _fit_near(fitting, _on_top_of(fitting, narrow, every)[:WITH_THE_BEST], narrow)


def _fit_near(fitting: Fitting, screened: Sequence[Screened], best: ExplanationFit) -> None:
    """Fit proposals from the noise of the best, with the winds and currents that differ there between trials."""
    starts, limit = [best.logs, fitting.likelihood.belief.logs], best.score + _FAR
    chosen = _proposals(fitting, screened, starts, limit=limit)
    fitting.fit([replace(proposal, each=best.hypothesis.each) for proposal in chosen])


def _still(hypothesis: Hypothesis) -> Array:
    """Parameters of a wind or current of zero in each trial."""
    return np.where([estimate.run is None for estimate in hypothesis.estimated], hypothesis.prior[0], 0.0)


def _polish(fitting: Fitting) -> None:
    """Refit the best with a converged noise, all others at this noise, and those that are then close once more.

    Scores at noises that have not converged differ by more than explanations do. An explanation that shares an effect
    with the best is also tried from the best's parameters, and one whose shape lies at a bound from its typical shape:
    a descent may have stopped at another minimum.
    """
    fitting.fit([refit(fitting.best(), [fitting.best().logs], LAST_ROUNDS)])
    converged = fitting.best()
    near = [fit for fit in fitting.found.values() if fit.score < fitting.best().score + CLOSE and _at_a_bound(fit)]
    fitting.fit([Proposal(_of_typical_shape(fit), [fit.logs], ROUNDS, each=fit.hypothesis.each) for fit in near])
    best = fitting.best()
    within = [fit for fit in fitting.found.values() if fit.score < best.score + _FAR or not fit.hypothesis.effects]
    fitting.fit(_at_the_noise_of(best, within))
    best = fitting.best()
    close = [
        fit
        for effects, fit in fitting.found.items()
        if fit is not converged and (fit.score < best.score + CLOSE or fit is fitting.best(len(effects)))
    ]
    fitting.fit([refit(fit, [fit.logs, best.logs], LAST_ROUNDS) for fit in close])


def _at_the_noise_of(best: ExplanationFit, fits: Sequence[ExplanationFit]) -> list[Proposal]:
    """Each single effect of the best, and all others from their own parameters and from the parameters of the best."""
    best_thetas, each = thetas_of(best), best.hypothesis.each
    begins = [({name: theta}, each) for name, theta in best_thetas.items() if len(best_thetas) > 1]
    for fit in fits:
        thetas = thetas_of(fit)
        begins += [(thetas, fit.hypothesis.each)] if fit is not best else []
        if len(thetas) > 1:
            alike = {name for name in thetas if (name in fit.hypothesis.each) == (name in each)}
            mixed = {name: best_thetas.get(name, theta) if name in alike else theta for name, theta in thetas.items()}
            begins.append((mixed, fit.hypothesis.each))
    return [Proposal(thetas, [best.logs], SAME_NOISE, each=differ) for thetas, differ in begins]


def _fit_nearly_alike(fitting: Fitting, every: Sequence[Variant]) -> None:
    """The most probable with the effect that shows nearly as one of its own in the place of that one."""
    best = min(fitting.found.values(), key=lambda fit: fit.score + PRICE * len(fit.hypothesis.effects))
    alike = _nearly_alike(fitting, best, every)
    fitting.fit([Proposal(one.thetas, [best.logs], ROUNDS, each=best.hypothesis.each) for one in alike])


def _nearly_alike(fitting: Fitting, fit: ExplanationFit, every: Sequence[Variant]) -> list[Screened]:
    """A fit's set with the effect that shows nearly as one of its own in the place of that one, at its typical size:
    the screen is linear, and may have proposed either alone."""
    chosen, thetas = {variant.effect for variant in every}, thetas_of(fit)
    swapped = []
    for name in thetas:
        other = nearly_like(name)
        if other not in chosen or other in thetas:
            continue
        hypothesis = fitting.hypotheses(other)
        sizes = [estimate.parameter.typical_values(hypothesis.card)[0] for estimate in hypothesis.estimated]
        kept = {effect: theta for effect, theta in thetas.items() if effect != name}
        swapped.append(Screened(kept | {other: np.array(sizes)}, 0.0))
    return swapped


def _shapes(fit: ExplanationFit) -> NDArray[np.bool_]:
    """Mask of the parameters that give an effect its shape, and that every card with it must state (k,)."""
    return np.array(
        [
            estimate.run is None and not estimate.is_amplitude and estimate.parameter.default is None
            for estimate in fit.hypothesis.estimated
        ],
        dtype=bool,
    )


def _at_a_bound(fit: ExplanationFit) -> bool:
    """Whether a parameter of the shape lies at one of its bounds."""
    low, high = fit.hypothesis.bounds
    return bool(np.any(_shapes(fit) & ((fit.theta <= low) | (fit.theta >= high))))


def _of_typical_shape(fit: ExplanationFit) -> dict[str, Array]:
    """Parameters of a fit by effect; shape parameters take the likeliest of their typical values."""
    card = fit.hypothesis.card
    typical = [
        estimate.parameter.typical_values(card)[0] if shape else value
        for estimate, shape, value in zip(fit.hypothesis.estimated, _shapes(fit), fit.theta, strict=True)
    ]
    return thetas_of(replace(fit, theta=np.array(typical)))


def _on_top_of(fitting: Fitting, base: ExplanationFit, every: Sequence[Variant]) -> list[Screened]:
    """Each effect in addition to the effects of `base`."""
    proposals = Screen(fitting.likelihood, base, every).singles()
    return [Screened({**thetas_of(base), **proposal.thetas}, proposal.gain) for proposal in proposals]


def _proposals(
    fitting: Fitting,
    screened: Sequence[Screened],
    starts: Sequence[np.ndarray],
    least: int = 0,
    limit: float = np.inf,
) -> list[Proposal]:
    """Proposals not fitted yet with a sufficient gain, or among the first `least`; no two forms of one effect."""
    proposals: dict[tuple[str, ...], Proposal] = {}
    for place, proposed in enumerate(screened):
        if any(name in EFFECTS[other].includes for other in proposed.thetas for name in proposed.thetas):
            continue
        proposal = Proposal(proposed.thetas, starts, ROUNDS, limit)
        if proposal.effects not in fitting.found and (proposed.gain > -WORTH or place < least):
            proposals.setdefault(proposal.effects, proposal)
    return list(proposals.values())
