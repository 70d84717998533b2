"""The JSON of a gap in words: the verdict, its probability, objections to it, sizes with their errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from tank2sim.answer.numbers import format_column, format_number
from tank2sim.answer.parts import Cell
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.proof.cross_check import MUCH
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING
from tank2sim.report.json_values import Json, as_number
from tank2sim.units import in_words, to_si

GOOD = 1.5
"""Misfit in noise units up to which a model is said to follow the measurements (project choice): its own error is
then about as large as the noise, sqrt(1.5^2 - 1) = 1.1."""


AS_LIKELY_AS_NOT = 0.5
"""Probability from which an effect that is not named is mentioned (project choice)."""

MOVED = 3
"""Coefficients that are named in the verdict: those that moved most (project choice)."""


def effect_in_words(name: str) -> str:
    """Name of an effect for a reader: ``rudder_bias`` is "rudder bias"."""
    return name.replace("_", " ")


def trial_name(file: str) -> str:
    """Name of a trial from that of its file."""
    return PurePath(file).stem


def or_nan(value: float | None) -> float:
    """A number of the JSON; nan for null."""
    return math.nan if value is None else value


def effects_of(explanation: str) -> list[str]:
    """Effects of one of ``alternatives``: ``current + wind``; none of ``none``."""
    return [] if explanation == "none" else explanation.split(" + ")


def set_misfit(found: Json, version: str, *, held_out: bool) -> float | None:
    """Root mean square of the misfits of all fitting (or held-out) trials, noise units; None without any.

    `version` is ``before``, ``after`` or ``black_box``; inf where a simulation exceeded all bounds.
    """
    misfits = [trial["misfit"] for trial in found["trials"] if trial["held_out"] == held_out]
    if not misfits or (version == "black_box" and not all(version in misfit for misfit in misfits)):
        return None
    return float(np.sqrt(np.mean([as_number(misfit.get(version)) ** 2 for misfit in misfits])))


def verdict_in_words(found: Json) -> str:
    """What was found, in a sentence or two, and what is to be said against it."""
    return " ".join([found_in_words(found), *(f"Caution: {caution}." for caution in found["cautions"])])


def probabilities_in_words(found: Json) -> list[str]:
    """What each probability is of: an effect, in whatever company, and one explanation as a whole.

    Not the last where the trials are still missed by far, or an effect without the evidence for a name is as probable
    as not: something more may be missing then.
    """
    effects = found["effects"]
    if not effects:
        return []
    each = "; ".join(f"{effect_in_words(effect['name'])} {as_percent(effect['confidence'])}" for effect in effects)
    names = [effect["name"] for effect in effects]
    messages = [f"probability that the effect is there, alone or with another one: {each}"]
    more = _unnamed(found)
    if more:
        likely = ", ".join(map(effect_in_words, more))
        messages.append(f"fits a little better, without the evidence that a name needs: {likely}")
    whole = next((rival for rival in found["rivals"] if set(rival["effects"]) == set(names)), None)
    after = set_misfit(found, "after", held_out=False)
    if whole is not None and not more and (after is None or after <= MUCH):
        alone = f"{effect_in_words(names[0])} alone" if len(names) == 1 else _joined(names)
        messages.append(
            f"probability that {alone} is all that is missing, among the explanations compared: "
            f"{as_percent(whole['probability'])}"
        )
    return messages


def sizes_of_candidates(found: Json) -> list[Json]:
    """The effects of an ambiguous verdict next to the first explanation, of the size that each would have.

    Each has the keys of an entry of ``effects``.
    """
    sizes = found["next_test"]["candidates"] if found["next_test"] else {}
    known = {effect["name"] for effect in found["effects"]}
    unknown = dict.fromkeys(name for text in found["alternatives"] for name in effects_of(text) if name not in known)
    return [{"name": name, **sizes[name], "confidence": _sure(found, name)} for name in unknown if name in sizes]


def _unnamed(found: Json) -> list[str]:
    """Effects that are neither named nor candidates, and that are as probably there as not by the scores."""
    known = {effect["name"] for effect in found["effects"]}
    known |= {name for text in found["alternatives"] for name in effects_of(text)}
    every = dict.fromkeys(name for rival in found["rivals"] for name in rival["effects"] if name not in known)
    return [name for name in every if _sure(found, name) >= AS_LIKELY_AS_NOT]


def _sure(found: Json, name: str) -> float:
    return min(sum(or_nan(rival["probability"]) for rival in found["rivals"] if name in rival["effects"]), 1.0)


def _joined(names: Sequence[str]) -> str:
    return " with ".join(map(effect_in_words, names)) or "nothing"


def as_percent(probability: float | None) -> str:
    """A probability in words of %, never 0 and 99 at most: an effect that was not tried may look the same."""
    if probability is None or not math.isfinite(probability):
        return "unknown"
    percent = 100 * probability
    return "< 1 %" if percent < 1 else f"{min(percent, 99.0):.0f} %"


def found_in_words(found: Json) -> str:
    """What was found, in a sentence or two."""
    verdict, effects = found["verdict"], found["effects"]
    after = set_misfit(found, "after", held_out=False)
    follows = "" if after is None else f" follows the fitting trials to {noises(after)}"
    if verdict == MISSING and effects:
        names = " and ".join(_with_values(effect) for effect in effects)
        known = [EFFECTS[effect["name"]] for effect in effects if effect["name"] in EFFECTS]
        text = " ".join(effect.description for effect in known)
        if len(known) == len(effects) and all(effect.acts_on == "sensor" for effect in known):
            return f"A sensor is at fault, not the model: {names}. {text}".strip()
        sentences = [f"The model lacks {'an effect' if len(effects) == 1 else 'effects'}: {names}.", text]
        return " ".join([*filter(None, sentences), *_refitted(found)])
    if verdict == AMBIGUOUS:
        named = [[effect["name"] for effect in effects]] if effects else []
        candidates = [*named, *map(effects_of, found["alternatives"])]
        names = ", or ".join(dict.fromkeys(map(_joined, candidates)))
        missing = "Something is" if all(candidates) else "Something may be"
        sentence = f"{missing} missing, but these data do not distinguish several explanations: {names}."
        first = [f"The improved card has {_joined(named[0])}."] if named and len(candidates) > 1 else []
        return " ".join([sentence, *first, *_refitted(found)])
    if verdict == COEFFICIENTS:
        return " ".join(["The coefficients of the card explain the gap: no effect is missing.", *_refitted(found)])
    if verdict == NO_EFFECT_MISSING:
        good = after is None or after <= GOOD
        remainder = "" if good else ", which is more than noise, but no effect explains the rest better than none"
        return f"No missing effect shows in these data{': the card as given' + follows + remainder if follows else ''}."
    sentence = (
        "Something is missing that no tried effect explains: what is left has a pattern of its own, "
        "and no name is given although some effect always fits a little."
    )
    return " ".join([sentence, *([f"It acts most in {place_of_cause(found)}."] if found["acting"] else [])])


EQUATION_WORDS = {
    "surge": "the force ahead",
    "sway": "the force to the side",
    "yaw": "the turning moment",
    "track": "the motion over the ground",
    "heading": "heading against yaw rate",
}
"""Words of the equations in which a model is wrong."""


def place_of_cause(found: Json) -> str:
    """The equation, time and trial in which what is missing acts most, and its size; of a JSON that has one."""
    first = found["acting"][0]
    begin, end = or_nan(first["t_start_s"]), or_nan(first["t_end_s"])
    sizes = [
        f"{format_number(or_nan(first[key]) / 1e3, 3)} {unit}"
        for key, unit in (("force_N", "kN"), ("moment_Nm", "kN m"))
        if key in first
    ]
    sizes.append(f"{or_nan(first['standard_errors']):.2g} standard errors")
    words = EQUATION_WORDS.get(first["equation"], first["equation"])
    return f"{words}, from {begin:.0f} s to {end:.0f} s of {trial_name(first['trial'])} (rms {', '.join(sizes)})"


def _refitted(found: Json) -> list[str]:
    """That coefficients were fitted, too, those that moved most, and what the effect does without them."""
    coefficients = found.get("coefficients") or []
    if not coefficients:
        return []
    sizes = {
        entry["name"]: abs(or_nan(entry["value"]) - or_nan(entry["before"])) / or_nan(entry["standard_error_before"])
        for entry in coefficients
    }
    most = sorted(sizes, key=sizes.__getitem__, reverse=True)[:MOVED]
    moved = ", ".join(f"{name} by {sizes[name]:.1f}" for name in most)
    several = len(found["effects"]) > 1
    company = (" with them" if several else " with it") if found["effects"] else ""
    words = (
        f"{len(coefficients)} coefficients of the card were fitted{company}: "
        f"most moved {moved} of their standard errors"
    )
    alone = found["misfit"].get("effect_alone")
    if alone:
        key = "holdout" if alone.get("holdout") is not None else "fit"
        group = "held-out" if key == "holdout" else "fitting"
        effects = "effects" if several else "effect"
        words += f"; with the {effects} alone the misfit of the {group} trials would be {noises(as_number(alone[key]))}"
    return [f"{words}."]


def _with_values(effect: Json) -> str:
    values = []
    for name in effect["parameters"]:
        words, value, unit, _ = parameter_cells(effect, name)
        values.append(f"{words} {value}{'' if unit == '-' else f' {unit}'}")
    words = effect_in_words(effect["name"])
    if effect.get("by_trial"):
        speeds = [or_nan(row["speed_mps"]) for row in effect["by_trial"]]
        values.insert(0, f"of each trial its own, {min(speeds):.2g} to {max(speeds):.2g} m/s")
    return f"{words} ({', '.join(values)})" if values else words


def verdict_context(found: Json) -> list[str]:
    """Confidence, rivals and place, a paragraph each."""
    verdict, equation = found["verdict"], found["equation"]
    messages = [f"{text[0].upper()}{text[1:]}." for text in probabilities_in_words(found)]
    if found["alternatives"] and verdict != AMBIGUOUS:
        names = "; ".join(_joined(effects_of(text)) for text in found["alternatives"])
        messages.append(f"What else it could be: {names}. These data cannot distinguish them.")
    elif found["effects"] and verdict == MISSING:
        company = "it" if len(found["effects"]) == 1 else "each of them"
        messages.append(f"What else it could be: none of the explanations without {company} comes near.")
    if verdict != NO_EFFECT_MISSING and equation:
        messages.append(f"The gap is in {_EQUATIONS.get(equation, equation)}.")
    return messages


_EQUATIONS = {
    "surge": "surge: the force ahead",
    "sway": "sway: the force to the side",
    "yaw": "yaw: the turning moment",
    "actuator": "the steering gear or the propeller: what the orders become",
    "kinematics": "the motion over the ground",
    "sensor": "the measurements",
}


def parameter_cells(effect: Json, key: str) -> list[Cell]:
    """Words, value with its standard error, unit and meaning of a parameter.

    Parameters
    ----------
    effect : dict
        An entry of ``effects``.
    key : str
        One of its ``parameters``.
    """
    words, unit = parameter_in_words(effect["name"], key)
    text = f"{meaning(effect['name'], key)}{'' if key in effect['standard_errors'] else ' (held)'}"
    shown = with_error(or_nan(effect["parameters"][key]), or_nan(effect["standard_errors"].get(key)))
    return [words, shown, unit or "-", text]


def parameter_in_words(effect: str, key: str) -> tuple[str, str]:
    """Words and unit of a parameter by its name in a file; a direction is reported to be that from or towards which."""
    words, unit = in_words(key)
    description = meaning(effect, key)
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


def meaning(effect: str, key: str) -> str:
    """What a parameter of an effect is, by its name in a file."""
    known = EFFECTS[effect].parameters if effect in EFFECTS else ()
    name = to_si(key, 0.0)[0]
    return next((parameter.description for parameter in known if parameter.name == name), "")


def noises(misfit: float) -> str:
    """A misfit as a multiple of the noise."""
    return f"{format_number(misfit, 3)} times the noise" if math.isfinite(misfit) else "no end: the simulation ran away"
