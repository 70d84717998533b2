"""What the gap workflow found, as JSON; and its parameters as a card and a reader have them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.error_intervals import acting, contradiction, missing_force_intervals
from tank2sim.gap.proof.cross_check import proof_cautions
from tank2sim.gap.result import Gap, MissingForce, MissingSignal, Named, NextTest, Passed
from tank2sim.identification.trials.assessment.evaluation import FigureComparison
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.signals.columns import SignalName
from tank2sim.units import from_si, in_words

NEXT_TEST_FILE = "next_test.csv"
"""File next to ``gap.json`` with the orders of the next test."""

NOISE_FLOOR = 1.0
"""Misfit of a perfect model: it is counted in standard deviations of the measurement noise."""

_MOST_PASSAGES = 24
"""Passages in which the model is wrong that are reported, the most telling (project choice)."""

_IN_FILE = {"rad": "deg", "radps": "degps"}


def gap_as_json(gap: Gap, files: Mapping[str, str] | None = None) -> dict[str, object]:
    """All that was found, in the form of ``gap.json``; angles in degrees, what is not finite is None.

    Parameters
    ----------
    gap : Gap
    files : mapping, optional
        Trial's name to its file's; by default that of the trial format, ``<name>.csv``.
    """
    names = {replay.name: (files or {}).get(replay.name, f"{replay.name}.csv") for replay in gap.passed}
    return {
        "verdict": gap.verdict,
        "effects": [_effect(effect) for effect in gap.effects],
        "alternatives": [joined(alternative) for alternative in gap.alternatives],
        "where": _where(gap, names),
        "acting": _acting(gap, names),
        "equation": gap.equation,
        "misfit": _misfit(gap),
        "could_hide": {
            effect: {
                in_file_units(name, size)[0]: _finite(in_file_units(name, size)[1]) for name, size in sizes.items()
            }
            for effect, sizes in hidden(gap).items()
        },
        "could_hide_in_words": {
            effect: "; ".join(hidden_in_words(effect, name, size) for name, size in sizes.items())
            for effect, sizes in hidden(gap).items()
        },
        "next_test": _next_test(gap.next_test),
        "rivals": [
            {"effects": list(rival.effects), "loss": _finite(rival.loss), "probability": _finite(rival.probability)}
            for rival in gap.rivals
        ],
        "trials": [_trial(replay, names[replay.name]) for replay in gap.passed],
        "figures": _figures(gap, names),
        "agreement": _agreement(gap, names),
        "missing_force": _missing(missing_force_intervals(gap)),
        "missing_signal": _missing(contradiction(gap)),
        "notices": [*proof_cautions(gap), *gap.notices],
    }


def hidden(gap: Gap) -> dict[str, Mapping[str, float]]:
    """What could be there without showing; what was named, or may be what is missing, is not among it."""
    possible = {effect.name for effect in gap.effects} | {name for names in gap.alternatives for name in names}
    return {effect: sizes for effect, sizes in gap.could_hide.items() if effect not in possible}


def replaces(effect: str, parameter: str) -> bool:
    """Whether a parameter stands in place of something that the ship has anyway, so that there is no "up to"."""
    known = EFFECTS[effect].parameters if effect in EFFECTS else ()
    return any(one.name == parameter and one.absent is None for one in known)


def hidden_in_words(effect: str, parameter: str, size: float) -> str:
    """``angle up to 0.25 deg would not show``, or ``max rate of 5 deg/s in place of the card's would not show``."""
    own, value = in_file_units(parameter, size)
    words, unit = in_words(own)
    text = f"{value:.2g}{f' {unit}' if unit else ''}"
    if replaces(effect, parameter):
        return f"{words} of {text} in place of the card's would not show"
    return f"{words} up to {text} would not show"


def joined(effects: tuple[str, ...]) -> str:
    """Effects of one explanation as one name: ``current + wind``; ``none`` without any."""
    return " + ".join(effects) or "none"


def signal_display_name(variable: str) -> SignalName:
    """The signal of a trial that measures a variable of the model: ``motion.psi`` is ``psi_deg`` in a file."""
    signals = {own: signal for signal, own in OBSERVED_SIGNALS.items()}
    return SignalName(signals.get(variable, variable.removeprefix("motion.")))


def in_file_units(name: str, value: float) -> tuple[str, float]:
    """Name and value of an effect's parameter as a card has them, from those in SI: degrees in place of radians."""
    stem, _, suffix = name.rpartition("_")
    own = f"{stem}_{_IN_FILE[suffix]}" if stem and suffix in _IN_FILE else name
    return own, from_si(own, value)


def estimate_in_file(name: str, value: float) -> tuple[str, float]:
    """As :func:`in_file_units`, a direction from 0 to 360 deg."""
    return in_file_units(name, value % (2 * math.pi) if name == "direction_rad" else value)


class Meant(NamedTuple):
    """A variable of a model that holds a parameter of an effect: the effect's name, the parameter's in SI."""

    effect: str
    parameter: str


def meant(variable: str) -> Meant:
    """The parameter that a variable of a model holds: ``current.direction`` is ``direction_rad`` of ``current``."""
    for effect in EFFECTS.values():
        for parameter, own in effect.model_names().items():
            if own == variable:
                return Meant(effect.name, parameter)
    effect_name, _, parameter = variable.rpartition(".")
    return Meant(effect_name, parameter)


def measured_in(trial: Passed) -> tuple[str, ...]:
    """The variables of which a trial has measurements."""
    return tuple(name for name in trial.noise if np.isfinite(trial.measured[name]).any())


def paired_figures(gap: Gap) -> list[tuple[FigureComparison | None, FigureComparison]]:
    """Each figure of a turn or zigzag, before (None if it is not there) and after; the same where nothing was added."""
    old = {(one.trial, one.name): one for one in gap.figures_before}
    return [(old.get((one.trial, one.name)), one) for one in gap.figures_after or gap.figures_before]


def _where(gap: Gap, names: Mapping[str, str]) -> list[dict[str, object]]:
    return [
        {
            "trial": names.get(place.trial, f"{place.trial}.csv"),
            "signal": signal_display_name(place.signal).file,
            "t_start_s": _time(place.t_start_s),
            "t_end_s": _time(place.t_end_s),
            "share_of_misfit": _finite(place.share),
        }
        for place in gap.where
    ]


def _acting(gap: Gap, names: Mapping[str, str]) -> list[dict[str, object]]:
    return [
        {
            "trial": names.get(one.trial, f"{one.trial}.csv"),
            "equation": one.equation,
            "t_start_s": _time(one.t_start_s),
            "t_end_s": _time(one.t_end_s),
            "standard_errors": _finite(one.size),
        }
        for one in acting(gap)[:_MOST_PASSAGES]
    ]


def _figures(gap: Gap, names: Mapping[str, str]) -> list[dict[str, object]]:
    return [
        {
            "trial": names.get(now.trial, now.trial),
            "figure": now.name,
            "measured": _finite(now.measured),
            "before": _finite(before.predicted if before else None),
            "after": _finite(now.predicted),
        }
        for before, now in paired_figures(gap)
    ]


def _effect(one: Named) -> dict[str, object]:
    return {
        "name": one.name,
        "parameters": {own: _finite(there) for own, there in _each(one.parameters, wrapped=True)},
        "standard_errors": {own: _finite(there) for own, there in _each(one.standard_errors, wrapped=False)},
        "confidence": _finite(one.confidence),
    }


def _each(values: Mapping[str, float], *, wrapped: bool) -> list[tuple[str, float]]:
    convert = estimate_in_file if wrapped else in_file_units
    return [convert(name, value) for name, value in values.items()]


def _misfit(gap: Gap) -> dict[str, object]:
    noise = {}
    for variable, (sigma, origin) in gap.noise.items():
        name = signal_display_name(variable)
        noise[name.file] = {"sigma": _finite(name.factor * sigma), "from": origin}
    sets = {"fit": False, "holdout": True}
    return {
        "noise": noise,
        "noise_floor": NOISE_FLOOR,
        **{
            which: {word: _finite(gap.misfit(which, held_out=held)) for word, held in sets.items()}
            for which in ("before", "after", "black_box")
        },
    }


def _trial(one: Passed, file: str) -> dict[str, object]:
    whiches = ("before", "after", *(("black_box",) if one.black_box else ()))
    return {
        "trial": file,
        "held_out": one.held_out,
        "misfit": {which: _finite(one.misfit(which)) for which in whiches} if measured_in(one) else {},
        "signals": {
            signal_display_name(variable).file: {which: _finite(one.misfit(which, variable)) for which in whiches}
            for variable in measured_in(one)
        },
    }


def _agreement(gap: Gap, names: Mapping[str, str]) -> dict[str, object]:
    told: dict[str, object] = {}
    for variable, trials in gap.agreement.items():
        effect, parameter = meant(variable)
        told[f"{effect}.{in_file_units(parameter, 0.0)[0]}"] = {
            names.get(trial, trial): {
                "value": _finite(estimate_in_file(parameter, value)[1]),
                "standard_error": _finite(in_file_units(parameter, error)[1]),
            }
            for trial, (value, error) in trials.items()
        }
    return told


def _missing(what: MissingForce | MissingSignal | None) -> dict[str, object] | None:
    if what is None:
        return None
    key = {"equation": what.equation} if isinstance(what, MissingForce) else {"quantity": what.quantity}
    explained = {state: _finite(share) for state, share in what.explained.items()}
    return {**key, "explaining": what.explaining, "explained": explained}


def _next_test(test: NextTest | None) -> dict[str, object] | None:
    if test is None:
        return None
    expected = {manoeuvre: _finite(score) for manoeuvre, score in test.expected.items()}
    sizes = {
        name: {
            "parameters": {own: _finite(there) for own, there in _each(values, wrapped=True)},
            "standard_errors": {own: _finite(there) for own, there in _each(errors, wrapped=False)},
        }
        for name, (values, errors) in test.sizes.items()
    }
    told = {"manoeuvre": test.manoeuvre, "orders": NEXT_TEST_FILE, "why": test.why}
    return {**told, "expected": expected, "candidates": sizes}


def _time(value: float) -> float | None:
    """To the microsecond, far below any sample's distance: adding up steps leaves errors in the last digits."""
    return _finite(round(value, 6) + 0.0 if math.isfinite(value) else value)  # + 0.0 turns -0.0 into 0.0


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None
