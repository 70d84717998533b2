"""Two searches as one result: the second was made on the card that the first improved."""

from __future__ import annotations

from dataclasses import replace

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.result import AMBIGUOUS, Gap, Named, Passed, Refitted
from tank2sim.notices import Notice


def combine_passes(first: Gap, further: Gap) -> Gap:
    """The result with the effects of both searches.

    Parameters
    ----------
    first : Gap
        Result of the given card.
    further : Gap
        Result of the card that `first` improved, with the same trials; its effects act on the ship.
    """
    refitted = {coefficient.name: coefficient for coefficient in further.coefficients}
    of_given = {coefficient.name: coefficient for coefficient in first.coefficients}
    coefficients = tuple(
        replace(
            coefficient,
            before=of_given[name].before,
            standard_error_before=of_given[name].standard_error_before,
        )
        if name in of_given
        else coefficient
        for name, coefficient in refitted.items()
        if name.partition(".")[0] not in {effect.name for effect in first.effects}
    )
    named, added = ([effect.name for effect in gap.effects] for gap in (first, further))
    alternatives = [(*names, *added) for names in first.alternatives]
    alternatives += [(*named, *names) for names in further.alternatives]
    return replace(
        further,
        card=first.card,
        verdict=AMBIGUOUS if alternatives else further.verdict,
        base=further.base if further.coefficients else first.base,
        effects=(*(_updated(effect, refitted) for effect in first.effects), *further.effects),
        coefficients=coefficients or first.coefficients,
        effect_alone={},  # of all effects together without coefficients no simulation was made
        alternatives=tuple(alternatives),
        rivals=tuple(replace(rival, effects=(*named, *rival.effects)) for rival in further.rivals),
        where=first.where,
        equation=first.equation,
        passed=tuple(_joined(*pair) for pair in zip(first.passed, further.passed, strict=True)),
        figures_before=first.figures_before,
        missing_force=first.missing_force,
        agreement={**first.agreement, **further.agreement},
        next_test=further.next_test or first.next_test,
        notices=tuple(dict.fromkeys((*further.notices, *_of_names(first, further)))),
    )


def without_effect(smaller: Gap, both: Gap, dropped: str) -> Gap:
    """The result of a search for the effects of two searches without one of them, `dropped`.

    Parameters
    ----------
    smaller : Gap
        Of a search for these effects alone: what it says of rivals, and of what could hide, is of `both`, and no effect
        is surer than there.
    both : Gap
        Result of both searches together.
    dropped : str
        The effect that is superfluous with the others.
    """
    sure = {effect.name: effect.confidence for effect in both.effects}
    names = " and ".join(effect.name for effect in smaller.effects)
    notice = f"{dropped}: found first, and superfluous with {names}, which follow the trials as closely without it"
    return replace(
        smaller,
        effects=tuple(
            replace(effect, confidence=min(effect.confidence, sure[effect.name])) for effect in smaller.effects
        ),
        rivals=both.rivals,
        could_hide=both.could_hide,
        missing_force=both.missing_force,
        notices=tuple(dict.fromkeys((*smaller.notices, Notice(notice)))),
    )


def _of_names(first: Gap, further: Gap) -> list[Notice]:
    names = (" and ".join(effect.name for effect in gap.effects) for gap in (first, further))
    before, after = names
    return [
        Notice(
            f"{after}: found on the card improved by {before}, which left more than noise; explanations were compared "
            f"next to {before}, whose probability is from the first search"
        )
    ]


def _updated(effect: Named, refitted: dict[str, Refitted]) -> Named:
    """An effect with its parameters as they were fitted again together with those of the second search."""
    known = {parameter.name: f"{effect.name}.{parameter.stem}" for parameter in EFFECTS[effect.name].parameters}
    found = {name: refitted[place] for name, place in known.items() if place in refitted and name in effect.parameters}
    values = {**effect.parameters, **{name: entry.value for name, entry in found.items()}}
    errors = {**effect.standard_errors, **{name: entry.standard_error for name, entry in found.items()}}
    return replace(effect, parameters=values, standard_errors=errors)


def _joined(first: Passed, further: Passed) -> Passed:
    return replace(further, before=first.before)
