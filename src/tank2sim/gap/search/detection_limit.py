"""Detection limits: the size of each effect below which the trials could not show it.

By the linear screen, at the noise of the best explanation and at other noises of little additional cost: without the
effect the noise is estimated as well, and may absorb an effect as a slow sensor error or an unmodelled force, and wider
coefficients of the card may absorb it. An effect that is not linear in its size is evaluated again at the size that was
found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.kalman_filter import FORCE_STATES
from tank2sim.gap.inference.likelihood import COUNTED, WIDTHS, Likelihood
from tank2sim.gap.search.decision import STANDARD_ERRORS, change_of_derivatives
from tank2sim.gap.search.explanations import Search
from tank2sim.gap.search.screening import Screen, Variant, resized, variants_at

_Sizes = dict[str, dict[str, float]]

SIZES = (1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0)
"""Shares of its typical value at which an effect without amplitude is tested for visibility."""

LOUDER = 3.0
"""Factor on the level of one slow error or force, or on the width of the card's coefficients, of the noises that may
hide an effect (project choice)."""

SURE = float(ndtri(0.95))
"""Standard deviations by which a size must exceed the threshold, to show in 95 of 100 such sets of trials."""

_BEYOND_CARD = STANDARD_ERRORS + SURE
"""Standard errors of the card by which an effect must change a derivative: its estimate errs by one of them."""

_ROUNDS = 2
"""Iterations on the size at which an effect shows, or is beyond the errors of the card (project choice): it need not be
linear in it."""

_NEAR = 1.2
"""A size that the next round would change by less than this factor is found."""


def could_hide(search: Search, best: ExplanationFit, enough: float) -> _Sizes:
    """Effect to {parameter: size} below which the trials could not show it, in addition to the effects of `best`.

    Parameters
    ----------
    search : Search
    best : ExplanationFit
        The explanation with the effects that are taken as present.
    enough : float
        Decrease of the score that an additional effect needs, beyond its penalty.

    Returns
    -------
    dict
        Of several shapes the size at which the one that hides best does. For an effect without amplitude, the value
        furthest from being visible at which it still is not.
    """
    likelihood = search.likelihood
    sized = [
        _beyond_rest(likelihood, variant)
        for variant in search.variants
        if variant.amplitudes and variant.effect not in best.hypothesis.effects
    ]
    for _ in range(_ROUNDS):
        shares = _shares(likelihood, [best], sized, enough)
        sized = [_at_its_size(likelihood, *pair) for pair in zip(sized, shares, strict=True)]
    shares = _shares(likelihood, [best, *_louder(likelihood, best)], sized, enough)
    sizes: _Sizes = {}
    for variant, variant_shares in zip(sized, shares, strict=True):
        for amplitude, share in zip(variant.amplitudes, variant_shares, strict=True):
            parameter = variant.hypothesis.estimated[amplitude].parameter
            largest = max(abs(parameter.lowest(variant.hypothesis.card)), abs(parameter.maximum))
            size = min(_beyond_card(variant, amplitude, float(abs(variant.theta[amplitude]) * share)), largest)
            known = sizes.setdefault(variant.effect, {})
            known[parameter.name] = max(size, known.get(parameter.name, 0.0))
    # The first of several typical shapes is the likeliest.
    replacing = {variant.effect: variant for variant in reversed(search.variants) if not variant.amplitudes}
    unseen = [variant for name, variant in replacing.items() if name not in best.hypothesis.effects]
    for variant in (variant for variant in unseen if not variant.hypothesis.recorded):
        value = _hidden_value(likelihood, best, variant, enough)
        if value is not None:
            sizes[variant.effect] = {variant.hypothesis.estimated[0].parameter.name: value}
    return sizes


def _beyond_card(variant: Variant, amplitude: int, size: float) -> float:
    """The size of an amplitude, at least the one that changes a derivative by more than the card may be wrong.

    A smaller one is within the errors of the card, and is not named (:func:`.decision.is_significant`).
    """
    hypothesis, theta = variant.hypothesis, variant.theta.copy()
    for _ in range(_ROUNDS):
        theta[amplitude] = np.copysign(size, variant.theta[amplitude])
        names = [estimate.parameter.name for estimate in hypothesis.estimated]
        change = change_of_derivatives(hypothesis.card, variant.effect, dict(zip(names, theta.tolist(), strict=True)))
        if change >= _BEYOND_CARD or change == 0.0:
            return size
        size *= _BEYOND_CARD / change
    return size


def _at_its_size(likelihood: Likelihood, variant: Variant, shares: Array) -> Variant:
    """The variant at the size at which it shows, if that differs from its own."""
    if np.all(np.abs(np.log(shares)) <= np.log(_NEAR)):
        return variant
    return _beyond_rest(likelihood, resized(likelihood, variant, shares))


def _beyond_rest(likelihood: Likelihood, variant: Variant) -> Variant:
    """The variant without what it adds where its wind or current is none: still air slows a ship as well."""
    if not EFFECTS[variant.effect].surroundings:
        return variant
    at_rest = variant.theta.copy()
    for place in variant.amplitudes:
        at_rest[place] = variant.hypothesis.estimated[place].parameter.absent
    driving, shown = likelihood.added(variant.hypothesis, at_rest)
    return replace(variant, driving=variant.driving - driving[..., None], shown=variant.shown - shown[..., None])


def _louder(likelihood: Likelihood, best: ExplanationFit) -> Iterator[ExplanationFit]:
    """Copies of a fit with the level of one slow sensor error, of one unmodelled force, or the width of the
    coefficients increased, and one with the largest width."""
    low, high = likelihood.belief.bounds
    sensors = len(likelihood.motion.seen)
    for place in (*range(sensors, 2 * sensors), *range(3 * sensors, 3 * sensors + FORCE_STATES)):
        logs = best.logs.copy()
        logs[place] += np.log(LOUDER)
        yield replace(best, logs=np.clip(logs, low, high))
    for width in {min(LOUDER * best.width, WIDTHS[1]), WIDTHS[1]}:
        if width > best.width:
            yield replace(best, logs=np.append(best.logs[:-1], np.log(width)))


def _shares(
    likelihood: Likelihood, noises: Sequence[ExplanationFit], every: Sequence[Variant], enough: float
) -> list[Array]:
    """Shares of each variant's amplitudes, each alone, at which it would show even at the noise that hides it best."""
    first = Screen(likelihood, noises[0], every)
    screens = [first, *(first.at(noise) for noise in noises[1:])]
    shares = []
    for place, variant in enumerate(every):
        priced = int(np.count_nonzero(variant.hypothesis.prior[1] == 0))
        least = enough + priced * np.log(likelihood.count / COUNTED)
        columns = screens[0].places[place]
        largest = np.zeros(len(columns))
        for screen in screens:
            remaining = least - (screen.cost - screens[0].cost)
            if remaining > 0:
                sizes = np.sqrt(np.maximum(np.diag(screen.gram)[columns], 1e-12))
                largest = np.maximum(largest, (np.sqrt(remaining) + SURE) / sizes)
        shares.append(largest)
    return shares


def _hidden_value(likelihood: Likelihood, best: ExplanationFit, variant: Variant, enough: float) -> float | None:
    """For an effect without amplitude: the tried value nearest to the limit of visibility that is not visible."""
    tried = variants_at(likelihood, variant, SIZES)
    if not tried:
        return None
    screen = Screen(likelihood, best, tried)
    least = enough + len(variant.theta) * np.log(likelihood.count / COUNTED)
    seen = [screen.gram[places[0], places[0]] for places in screen.places]
    hidden = [(size, float(v.theta[0])) for size, v in zip(seen, screen.every, strict=True) if size < least]
    return max(hidden)[1] if hidden else None
