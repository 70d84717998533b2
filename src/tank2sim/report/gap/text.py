"""What a gap is in words: the verdict, how sure it is, what is to be said against it, sizes with their errors."""

from __future__ import annotations

import math

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.outcome.export import estimate_in_file, in_file_units
from tank2sim.gap.proof.cross_check import proof_cautions
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, Gap, Named
from tank2sim.report.kit.numbers import format_column, format_number
from tank2sim.report.kit.page import Cell
from tank2sim.units import in_words, to_si

GOOD = 1.5
"""Misfit in noise units up to which a model is said to follow the measurements (project choice): its own error is
then about as large as the noise, sqrt(1.5^2 - 1) = 1.1."""


def effect_in_words(name: str) -> str:
    """Name of an effect for a reader: ``rudder_bias`` is "rudder bias"."""
    return name.replace("_", " ")


def verdict_in_words(gap: Gap) -> str:
    """What was found, in a sentence or two, and what is to be said against it."""
    return " ".join([_found(gap), *(f"Caution: {caution}." for caution in proof_cautions(gap))])


def probabilities_in_words(gap: Gap) -> list[str]:
    """What each probability is of: an effect, in whatever company, and one explanation as a whole."""
    if not gap.effects:
        return []
    each = "; ".join(f"{effect_in_words(effect.name)} {as_percent(effect.confidence)}" for effect in gap.effects)
    names = tuple(effect.name for effect in gap.effects)
    messages = [f"probability that the effect is there, alone or with another one: {each}"]
    whole = next((rival for rival in gap.rivals if set(rival.effects) == set(names)), None)
    if whole is not None:
        alone = f"{effect_in_words(names[0])} alone" if len(names) == 1 else " with ".join(map(effect_in_words, names))
        messages.append(
            f"probability that {alone} is all that is missing, among the explanations compared: "
            f"{as_percent(whole.probability)}"
        )
    return messages


def sizes_of_candidates(gap: Gap) -> list[Named]:
    """The effects of an ambiguous verdict next to the first explanation, of the size that each would have."""
    sizes = gap.next_test.sizes if gap.next_test is not None else {}
    known = {effect.name for effect in gap.effects}
    unknown = dict.fromkeys(name for names in gap.alternatives for name in names if name not in known)
    return [Named(name, *sizes[name], _sure(gap, name)) for name in unknown if name in sizes]


def _sure(gap: Gap, name: str) -> float:
    return min(sum(rival.probability for rival in gap.rivals if name in rival.effects), 1.0)


def as_percent(probability: float) -> str:
    """A probability in words of %, never 0 or 100: nothing is that sure."""
    if not math.isfinite(probability):
        return "unknown"
    percent = 100 * probability
    return "< 1 %" if percent < 1 else "> 99 %" if percent > 99 else f"{percent:.0f} %"


def _found(gap: Gap) -> str:
    after = gap.misfit("after", held_out=False)
    follows = "" if after is None else f" follows the fitting trials to {noises(after)}"
    if gap.verdict == MISSING and gap.effects:
        names = " and ".join(_with_values(effect) for effect in gap.effects)
        text = " ".join(EFFECTS[effect.name].description for effect in gap.effects if effect.name in EFFECTS)
        if all(effect.name in EFFECTS and EFFECTS[effect.name].acts_on == "sensor" for effect in gap.effects):
            return f"A sensor is at fault, not the model: {names}. {text}".strip()
        return f"The model lacks {'an effect' if len(gap.effects) == 1 else 'effects'}: {names}. {text}".strip()
    if gap.verdict == AMBIGUOUS:
        candidates = dict.fromkeys(
            [*([tuple(effect.name for effect in gap.effects)] if gap.effects else []), *gap.alternatives]
        )
        names = ", or ".join(" with ".join(map(effect_in_words, candidate)) for candidate in candidates)
        return f"Something is missing, but these data do not distinguish several effects: {names}."
    if gap.verdict == NO_EFFECT_MISSING:
        good = after is None or after <= GOOD
        remainder = "" if good else ", which is more than noise, but no effect explains the rest better than none"
        return f"No missing effect shows in these data{': the card as given' + follows + remainder if follows else ''}."
    return (
        "Something is missing that no effect of the library explains: what is left has a pattern of its own, "
        "and no name is given although some effect always fits a little."
    )


def _with_values(effect: Named) -> str:
    values = []
    for name in effect.parameters:
        words, value, unit, _ = parameter_cells(effect, name)
        values.append(f"{words} {value}{'' if unit == '-' else f' {unit}'}")
    return f"{effect_in_words(effect.name)} ({', '.join(values)})" if values else effect_in_words(effect.name)


def verdict_context(gap: Gap) -> list[str]:
    """Confidence, rivals and place, a paragraph each."""
    messages = [f"{text[0].upper()}{text[1:]}." for text in probabilities_in_words(gap)]
    if gap.alternatives and gap.verdict != AMBIGUOUS:
        names = "; ".join(" with ".join(map(effect_in_words, alternative)) for alternative in gap.alternatives)
        messages.append(f"What else it could be: {names}. These data cannot distinguish them.")
    elif gap.effects and gap.verdict == MISSING:
        messages.append("What else it could be: none of the explanations without it comes near.")
    if gap.verdict != NO_EFFECT_MISSING and gap.equation:
        messages.append(f"The gap is in {_EQUATIONS.get(gap.equation, gap.equation)}.")
    return messages


_EQUATIONS = {
    "surge": "surge: the force ahead",
    "sway": "sway: the force to the side",
    "yaw": "yaw: the turning moment",
    "actuator": "the steering gear or the propeller: what the orders become",
    "kinematics": "the motion over the ground",
    "sensor": "the measurements",
}


def parameter_cells(effect: Named, name: str) -> list[Cell]:
    """Words, value with its standard error, unit and meaning of a parameter."""
    key, value = estimate_in_file(name, effect.parameters[name])
    words, unit = parameter_in_words(effect.name, key)
    error = in_file_units(name, effect.standard_errors[name])[1] if name in effect.standard_errors else math.nan
    text = f"{meaning(effect.name, name)}{'' if name in effect.standard_errors else ' (held)'}"
    return [words, with_error(value, error), unit or "-", text]


def parameter_in_words(effect: str, key: str) -> tuple[str, str]:
    """Words and unit of a parameter by its name in a file; a direction is reported to be that from or towards which."""
    words, unit = in_words(key)
    description = meaning(effect, to_si(key, 0.0)[0])
    way = next((word for word in ("from", "towards") if f"direction {word} which" in description), "")
    return f"{words} {way}".strip(), unit


def with_error(value: float, error: float) -> str:
    """A value and its standard error with two figures of the error: ``121.3 ± 2.1``; the value alone without one."""
    if not (math.isfinite(error) and error > 0):
        return format_number(value, 4)
    digits = 2
    if value and abs(value) > error:
        digits += math.floor(math.log10(abs(value))) - math.floor(math.log10(error))
    return " ± ".join(format_column([float(value), float(error)], digits))


def meaning(effect: str, parameter: str) -> str:
    """What a parameter of an effect is."""
    known = EFFECTS[effect].parameters if effect in EFFECTS else ()
    return next((parameter_known.description for parameter_known in known if parameter_known.name == parameter), "")


def noises(misfit: float) -> str:
    """A misfit as a multiple of the noise."""
    return f"{format_number(misfit, 3)} times the noise" if math.isfinite(misfit) else "no end: the simulation ran away"
