"""The study of a gap in words: the verdict, its probability, objections to it, sizes with their errors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import PurePath

from tank2sim.answer.numbers import format_column, format_number
from tank2sim.answer.parts import Cell
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.outcome.study import EffectFound, GapStudy
from tank2sim.gap.proof.cross_check import MUCH
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY, Rival
from tank2sim.units import in_words, to_si

GOOD = 1.5
"""Misfit in noise units up to which a model is said to follow the measurements (project choice): its own error is
then about as large as the noise, sqrt(1.5^2 - 1) = 1.1."""

AS_LIKELY_AS_NOT = 0.5
"""Probability from which an effect that is not named is mentioned (project choice)."""

WORTH_A_WORD = 0.01
"""Probability from which an explanation without a named effect is mentioned (project choice)."""

MOVED = 3
"""Coefficients that are named in the verdict: the largest changes (project choice)."""


def effect_in_words(name: str) -> str:
    """Name of an effect for a reader: ``rudder_bias`` is "rudder bias"."""
    return name.replace("_", " ")


def trial_name(file: str) -> str:
    """Name of a trial from its file."""
    return PurePath(file).stem


def effects_of(explanation: str) -> list[str]:
    """Effects of one of ``alternatives``: ``current + wind``; none of ``none``."""
    return [] if explanation == "none" else explanation.split(" + ")


def capital(text: str) -> str:
    """A sentence with a capital letter and a full stop."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def probabilities_in_words(study: GapStudy) -> list[str]:
    """Probability of each effect, in any company, and of the explanation as a whole.

    The last is left out where the trials are still missed by far, or where an unnamed effect is as probable as not:
    something more may be missing then. Where nothing is named, the probability that nothing is missing.
    """
    if not study.effects:
        return _nothing_in_percent(study)
    each = "; ".join(f"{effect_in_words(effect.name)} {as_percent(effect.confidence)}" for effect in study.effects)
    what = "the effect is there, alone or with another one" if len(study.effects) == 1 else "each effect is there"
    more = _unnamed(study)
    also = f"As likely as not in addition, though not in the most probable explanation: {', '.join(more)}."
    return [f"Probability that {what}: {each}.", *([also] if more else _whole_in_percent(study))]


def _whole_in_percent(study: GapStudy) -> list[str]:
    """Probability that the named effects are all that is missing; nothing where the trials are still missed by far."""
    names = [effect.name for effect in study.effects]
    whole = next((rival for rival in study.rivals if set(rival.effects) == set(names)), None)
    after = study.set_misfit("after", held_out=False)
    if whole is None or (after is not None and after > MUCH):
        return []
    missing = f"{effect_in_words(names[0])} alone is" if len(names) == 1 else f"{_together(names)} are"
    probability = as_percent(whole.probability)
    return [f"Probability that {missing} all that is missing, among the explanations compared: {probability}."]


def probability_of_none(study: GapStudy) -> float | None:
    """Probability that nothing is missing, 0 to 1, for a verdict that says so.

    None for other verdicts, and where an explanation is more probable whose name simulations withheld.
    """
    likeliest = max(study.rivals, key=_by_probability, default=None)
    if study.verdict not in (NO_EFFECT_MISSING, COEFFICIENTS) or likeliest is None or likeliest.effects:
        return None
    return likeliest.probability


def _nothing_in_percent(study: GapStudy) -> list[str]:
    """How sure it is that nothing is missing, and what is most probable otherwise."""
    probability = probability_of_none(study)
    if probability is None:
        return []
    likeliest = max((rival for rival in study.rivals if rival.effects), key=_by_probability, default=None)
    sentence = f"Probability that no tried effect is missing: {as_percent(probability)}"
    if study.alternatives:
        sentence += ", if the coefficients may be so far off"
    if likeliest is not None and likeliest.probability >= WORTH_A_WORD:
        sentence += f"; most probable otherwise: {_together(likeliest.effects)} ({as_percent(likeliest.probability)})"
    return [f"{sentence}."]


def _by_probability(rival: Rival) -> float:
    return rival.probability


def sizes_of_candidates(study: GapStudy) -> list[EffectFound]:
    """Effects of the other explanations of an ambiguous verdict, each of the size that it would have."""
    sizes = study.next_test.candidates if study.next_test else {}
    known = {effect.name for effect in study.effects}
    unknown = dict.fromkeys(name for text in study.alternatives for name in effects_of(text) if name not in known)
    return [
        EffectFound(
            name=name,
            parameters=sizes[name].parameters,
            standard_errors=sizes[name].standard_errors,
            confidence=_probability(study, name),
        )
        for name in unknown
        if name in sizes
    ]


def _unnamed(study: GapStudy) -> list[str]:
    """Effects in words that are neither named nor candidates, and as probable as not next to different others."""
    known = {effect.name for effect in study.effects}
    known |= {name for text in study.alternatives for name in effects_of(text)}
    others = dict.fromkeys(name for rival in study.rivals for name in rival.effects if name not in known)
    return [effect_in_words(name) for name in others if _probability(study, name) >= AS_LIKELY_AS_NOT]


def _probability(study: GapStudy, name: str) -> float:
    return min(sum(rival.probability for rival in study.rivals if name in rival.effects), 1.0)


def _together(names: Sequence[str]) -> str:
    if not names:
        return "no effect, with other coefficients of the card"
    first, *others = map(effect_in_words, names)
    return f"{first} with {_listed(others)}" if others else first


def _listed(words: Iterable[str]) -> str:
    """Words in a sentence: ``a, b and c``."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def as_percent(probability: float) -> str:
    """A probability in words of %, never 0 and 99 at most: an effect that was not tried may look the same."""
    if not math.isfinite(probability):
        return "unknown"
    percent = 100 * probability
    return "< 1 %" if percent < 1 else f"{min(percent, 99.0):.0f} %"


def found_in_words(study: GapStudy) -> str:
    """The finding, in a sentence or two."""
    if study.verdict == MISSING and study.effects:
        return _missing_in_words(study)
    if study.verdict == AMBIGUOUS:
        return _ambiguous_in_words(study)
    if study.verdict == COEFFICIENTS:
        return " ".join([f"The coefficients of the card explain the gap: {_no_effect(study)}.", *_refitted(study)])
    if study.verdict == NO_EFFECT_MISSING:
        return _nothing_in_words(study)
    return _unknown_in_words(study)


def _missing_in_words(study: GapStudy) -> str:
    """What the model lacks, and which sensors are at fault."""
    sensors = [effect for effect in study.effects if _of_sensor(effect.name)]
    lacking = [effect for effect in study.effects if effect not in sensors]
    sentences = []
    if lacking:
        names = _listed(map(_with_values, lacking))
        sentences.append(f"The model lacks {'an effect' if len(lacking) == 1 else 'effects'}: {names}.")
    if sensors:
        at_fault = "A sensor is at fault" if len(sensors) == 1 else "Sensors are at fault"
        model = "" if lacking else ", not the model"
        sentences.append(f"{at_fault}{model}: {_listed(map(_with_values, sensors))}.")
    described = (EFFECTS[effect.name].description for effect in (*lacking, *sensors) if effect.name in EFFECTS)
    return " ".join([*sentences, *described, *_refitted(study)])


def _of_sensor(name: str) -> bool:
    return name in EFFECTS and EFFECTS[name].acts_on == "sensor"


def _ambiguous_in_words(study: GapStudy) -> str:
    """The sets of effects among which the data do not decide, and the one that the improved card has."""
    named = [[effect.name for effect in study.effects]] if study.effects else []
    candidates = [*named, *map(effects_of, study.alternatives)]
    names = ", or ".join(dict.fromkeys(map(_together, candidates)))
    missing = "Something is" if all(candidates) else "Something may be"
    sentence = f"{missing} missing, but these data do not distinguish several explanations: {names}."
    first = [f"The improved card has {_together(named[0])}."] if named and len(candidates) > 1 else []
    return " ".join([sentence, *first, *_refitted(study)])


def _nothing_in_words(study: GapStudy) -> str:
    """How well the card follows as it is, and what a coefficient that moved may be instead."""
    after = study.set_misfit("after", held_out=False)
    if after is None:
        return "No missing effect shows in these data."
    remainder = "" if after <= GOOD else ", which is more than noise, but no effect explains the rest"
    follows = f"the card as given follows the fitting trials to {noises(after)}{remainder}"
    doubt = "" if not study.alternatives else f" With other coefficients {_no_effect(study)}."
    return f"No missing effect shows in these data: {follows}.{doubt}"


def _unknown_in_words(study: GapStudy) -> str:
    """Where something acts that has no name, or the record that is in doubt first."""
    acting = study.acting[0].trial if study.acting else ""
    doubts = [one for one in study.record_doubts if trial_name(acting) == one.trial]
    if doubts:
        found = "; ".join(f"{one.column}: {one.likely_truth}" for one in doubts)
        return (
            f"The record of {doubts[0].trial} is in doubt, before any effect of the ship is: the misfit is in it, and "
            f"the audit finds in {found}. Correct it and search again."
        )
    sentence = "Something is missing that no tried effect explains: the remaining misfit has a pattern, but no name."
    return " ".join([sentence, *([f"The cause acts most in {place_of_cause(study)}."] if study.acting else [])])


def _no_effect(study: GapStudy) -> str:
    """That no effect shows beyond the coefficients, or which one it may be instead."""
    names = " or ".join(_together(effects_of(text)) for text in study.alternatives)
    unless = f", unless it is {names}, which these trials cannot distinguish from an error of the card"
    return f"no effect shows beyond them{unless if names else ''}"


EQUATION_WORDS = {
    "surge": "the force ahead",
    "sway": "the force to the side",
    "yaw": "the turning moment",
    "track": "the motion over the ground",
    "heading": "heading against yaw rate",
}
"""Words of the equations in which a model is wrong."""


def place_of_cause(study: GapStudy) -> str:
    """The equation, time and trial in which the cause acts most, and its size; for a study that has one."""
    first = study.acting[0]
    sizes = [
        f"{format_number(size / 1e3, 3)} {unit}"
        for size, unit in ((first.force_N, "kN"), (first.moment_Nm, "kN m"))
        if size is not None
    ]
    sizes.append(f"{format_number(first.standard_errors, 2)} standard errors")
    words = EQUATION_WORDS.get(first.equation, first.equation)
    when = f"from {first.t_start_s:.0f} s to {first.t_end_s:.0f} s of {trial_name(first.trial)}"
    return f"{words}, {when} (rms {', '.join(sizes)})"


def _refitted(study: GapStudy) -> list[str]:
    """The fitted coefficients that moved most, and the misfit by the effect without them."""
    if not study.coefficients:
        return []
    several = len(study.effects) > 1
    company = (" with them" if several else " with it") if study.effects else ""
    most = sorted(study.coefficients, key=lambda entry: entry.moved, reverse=True)[:MOVED]
    moved = ", ".join(f"{entry.name} by {entry.moved:.1f}" for entry in most)
    words = f"{len(study.coefficients)} coefficients of the card were fitted{company}: "
    words += f"the largest changes are {moved} of their standard errors"
    if alone := study.misfit.effect_alone:
        group, misfit = ("fitting", alone.fit) if alone.holdout is None else ("held-out", alone.holdout)
        effects = "effects" if several else "effect"
        size = noises(math.inf if misfit is None else misfit)
        words += f"; with the {effects} alone the misfit of the {group} trials would be {size}"
    return [f"{words}."]


def _with_values(effect: EffectFound) -> str:
    values = [
        f"{words} {value}{'' if unit == '-' else f' {unit}'}"
        for words, value, unit, _ in (parameter_cells(effect, name) for name in effect.parameters)
    ]
    if effect.by_trial:
        speeds = [row.speed_mps for row in effect.by_trial]
        values.insert(0, f"of each trial its own, {min(speeds):.2g} to {max(speeds):.2g} m/s")
    words = effect_in_words(effect.name)
    return f"{words} ({', '.join(values)})" if values else words


def verdict_context(study: GapStudy) -> list[str]:
    """Probabilities, other explanations and place, a paragraph each."""
    sentences = probabilities_in_words(study)
    if study.effects and study.verdict == MISSING:
        sentences.append(_likeliest_without(study))
    if study.alternatives and study.verdict == COEFFICIENTS:
        names = " or ".join(_together(effects_of(text)) for text in study.alternatives)
        sentences.append(f"These trials cannot distinguish coefficients that are off from {names}.")
    if study.verdict == OUTSIDE_LIBRARY:
        sentences += _best_of_tried(study)
    if study.verdict != NO_EFFECT_MISSING and study.equation:
        sentences.append(f"The gap is in {_EQUATIONS.get(study.equation, study.equation)}.")
    return sentences


def _best_of_tried(study: GapStudy) -> list[str]:
    """The explanation that would have been named if nothing else were in the trials."""
    best = max(study.rivals, key=_by_probability, default=None)
    if best is None or not best.effects:
        return []
    return [
        f"The most probable of what was tried is {_together(best.effects)}. It leaves too much unexplained to be named."
    ]


def _likeliest_without(study: GapStudy) -> str:
    """The most probable explanation that lacks an effect of the named ones, if it is worth a word."""
    named = {effect.name for effect in study.effects}
    without = "without it" if len(named) == 1 else "without one of them"
    others = [rival for rival in study.rivals if not named <= {*rival.effects}]
    likeliest = max(others, key=_by_probability, default=None)
    if likeliest is None or likeliest.probability < WORTH_A_WORD:
        return f"No explanation {without} has a probability of {as_percent(WORTH_A_WORD)} or more."
    words = _together(likeliest.effects) if likeliest.effects else "nothing is missing"
    return f"Most probable explanation {without}: {words} ({as_percent(likeliest.probability)})."


_EQUATIONS = {
    "surge": "surge: the force ahead",
    "sway": "sway: the force to the side",
    "yaw": "yaw: the turning moment",
    "actuator": "the steering gear or the propeller: how they follow the orders",
    "kinematics": "the motion over the ground",
    "sensor": "the measurements",
}


def parameter_cells(effect: EffectFound, key: str) -> list[Cell]:
    """Words, value with its standard error, unit and meaning of one of an effect's parameters."""
    words, unit = parameter_in_words(effect.name, key)
    text = f"{meaning(effect.name, key)}{'' if key in effect.standard_errors else ' (held)'}"
    shown = with_error(effect.parameters[key], effect.standard_errors.get(key, math.nan))
    return [words, shown, unit or "-", text]


def parameter_in_words(effect: str, key: str) -> tuple[str, str]:
    """Words and unit of a parameter by its name in a file; a direction says whether it is from or towards."""
    words, unit = in_words(key)
    description = meaning(effect, key)
    way = next((word for word in ("from", "towards") if f"direction {word} which" in description), "")
    return f"{words} {way}".strip(), unit


def with_error(value: float, error: float) -> str:
    """A value and its standard error with two figures of the error: ``121.3 ± 2.1``; the value alone without one."""
    if not math.isfinite(value):
        return "?"
    if not (math.isfinite(error) and error > 0):
        return format_number(value, 4)
    digits = 2
    if value and abs(value) > error:
        digits += math.floor(math.log10(abs(value))) - math.floor(math.log10(error))
    return " ± ".join(format_column([float(value), float(error)], digits))


def meaning(effect: str, key: str) -> str:
    """Description of a parameter of an effect, by its name in a file."""
    known = EFFECTS[effect].parameters if effect in EFFECTS else ()
    name = to_si(key, 0.0)[0]
    return next((parameter.description for parameter in known if parameter.name == name), "")


def noises(misfit: float) -> str:
    """A misfit as a multiple of the noise."""
    return f"{format_number(misfit, 3)} times the noise" if math.isfinite(misfit) else "no end: the simulation ran away"
