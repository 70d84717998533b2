"""Results of the gap workflow as JSON, and its parameters in the units of cards and readers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.files import plain_json
from tank2sim.gap.diagnosis.error_intervals import acting, contradiction, missing_force_intervals
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.gap.outcome.lacking import missing_as_json
from tank2sim.gap.proof.cross_check import proof_cautions
from tank2sim.gap.result import NO_EFFECT_MISSING, Gap, Named, NextTest, Passed, Refitted
from tank2sim.identification.trials.assessment.evaluation import FigureComparison
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import Indices, drawn_columns, thin_points
from tank2sim.units import from_si, in_words, to_si

NEXT_TEST_FILE = "next_test.csv"
"""File next to ``gap.json`` with the orders of the next test."""

NOISE_FLOOR = 1.0
"""Misfit of a perfect model: it is counted in standard deviations of the measurement noise."""

_MOST_PASSAGES = 24
"""Number of reported intervals in which the model is wrong, the most significant (project choice)."""

_REPLAY_SAMPLES = 140
"""Samples of a trial in the JSON, without extremes: as many as its line in a small panel has."""

_IN_FILE = {"rad": "deg", "radps": "degps"}

MANY_HIDDEN = 0.25
"""Share of the effects that would not show at their usual size, from which "no missing effect" says little (project
choice: of varied manoeuvres a tenth does not show, of the first 50 s of one turn two fifths, of 10 s nearly all)."""


def gap_as_json(gap: Gap, files: Mapping[str, str] | None = None) -> dict[str, Any]:
    """All results, in the form of ``gap.json``; angles in degrees, None for values that are not finite.

    Parameters
    ----------
    gap : Gap
    files : mapping, optional
        Name of a trial to that of its file; by default ``<name>.csv``, of the trial format.
    """
    names = {replay.name: (files or {}).get(replay.name, f"{replay.name}.csv") for replay in gap.passed}
    cautions = (*proof_cautions(gap), *hidden_effects_caution(gap))
    found: dict[str, Any] = plain_json(
        {
            "ship": gap.card.ship.name,
            "verdict": gap.verdict,
            "effects": [
                _effect(effect, {replay.name for replay in gap.passed if replay.held_out}) for effect in gap.effects
            ],
            "coefficients": [_coefficient(coefficient) for coefficient in gap.coefficients],
            "alternatives": [joined(alternative) for alternative in gap.alternatives],
            "where": _where(gap, names),
            "acting": _acting(gap, names),
            "equation": gap.equation,
            "misfit": _misfit(gap),
            "could_hide": {effect: _in_file(sizes) for effect, sizes in hidden(gap).items()},
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
            "missing_force": missing_as_json(missing_force_intervals(gap), names),
            "missing_signal": missing_as_json(contradiction(gap), names),
            "replays": [_replay(replay, names[replay.name]) for replay in gap.passed],
            "cautions": list(cautions),
            "notices": [*cautions, *gap.notices],
        }
    )
    return found


def hidden(gap: Gap) -> dict[str, Mapping[str, float]]:
    """Detection limits by effect, except of those that were named or are alternatives."""
    possible = {effect.name for effect in gap.effects} | {name for names in gap.alternatives for name in names}
    return {effect: sizes for effect, sizes in gap.could_hide.items() if effect not in possible}


def replaces(effect: str, key: str) -> bool:
    """Whether a parameter replaces a property that the ship has anyway, so that "up to" has no meaning.

    Parameters
    ----------
    effect : str
        Key of :data:`tank2sim.dynamics.effects.EFFECTS`.
    key : str
        Name of the parameter in a file.
    """
    known = EFFECTS[effect].parameters if effect in EFFECTS else ()
    return any(entry.name == to_si(key, 0.0)[0] and entry.absent is None for entry in known)


def hidden_in_words(effect: str, parameter: str, size: float) -> str:
    """``angle up to 0.25 deg would not show``, or ``max rate of 5 deg/s in place of the card's would not show``."""
    key, value = in_file_units(parameter, size)
    words, unit = in_words(key)
    text = f"{value:.2g}{f' {unit}' if unit else ''}"
    if replaces(effect, key):
        return f"{words} of {text} in place of the card's would not show"
    return f"{words} up to {text} would not show"


def joined(effects: Sequence[str]) -> str:
    """Effects of one explanation as one name: ``current + wind``; ``none`` without any."""
    return " + ".join(effects) or "none"


def signal_display_name(variable: str) -> SignalName:
    """The signal of a trial that measures a variable of the model: ``motion.psi`` is ``psi_deg`` in a file."""
    signals = {name: signal for signal, name in OBSERVED_SIGNALS.items()}
    return SignalName(signals.get(variable, variable.removeprefix("motion.")))


def in_file_units(name: str, value: float) -> tuple[str, float]:
    """Name and value of an effect's parameter in the units of a card, from SI: degrees in place of radians."""
    stem, _, suffix = name.rpartition("_")
    key = f"{stem}_{_IN_FILE[suffix]}" if stem and suffix in _IN_FILE else name
    return key, from_si(key, value)


def estimate_in_file(name: str, value: float) -> tuple[str, float]:
    """As :func:`in_file_units`, a direction from 0 to 360 deg."""
    return in_file_units(name, value % (2 * math.pi) if name == "direction_rad" else value)


class EffectParameterName(NamedTuple):
    """A variable of a model that holds a parameter of an effect: the effect's name, the parameter's in SI."""

    effect: str
    parameter: str


def effect_parameter_name(variable: str) -> EffectParameterName:
    """The parameter that a variable of a model holds: ``current.direction`` is ``direction_rad`` of ``current``."""
    for effect in EFFECTS.values():
        for parameter, name in effect.model_names().items():
            if name == variable:
                return EffectParameterName(effect.name, parameter)
    effect_name, _, parameter = variable.rpartition(".")
    return EffectParameterName(effect_name, parameter)


def measured_in(trial: Passed) -> tuple[str, ...]:
    """The measured variables of a trial."""
    return tuple(name for name in trial.noise if np.isfinite(trial.measured[name]).any())


def paired_figures(gap: Gap) -> list[tuple[FigureComparison | None, FigureComparison]]:
    """Each figure of a turn or zigzag, before (None if not found) and after; the same where no effect was added."""
    old = {(figure.trial, figure.name): figure for figure in gap.figures_before}
    return [(old.get((figure.trial, figure.name)), figure) for figure in gap.figures_after or gap.figures_before]


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


_FORCE_KEYS = {"surge": "force_N", "sway": "force_N", "yaw": "moment_Nm"}
"""Key of the root mean square of what is missing in an equation."""


def _acting(gap: Gap, names: Mapping[str, str]) -> list[dict[str, object]]:
    found: list[dict[str, object]] = []
    for interval in acting(gap)[:_MOST_PASSAGES]:
        force = {_FORCE_KEYS[interval.equation]: _finite(interval.force)} if interval.equation in _FORCE_KEYS else {}
        found.append(
            {
                "trial": names.get(interval.trial, f"{interval.trial}.csv"),
                "equation": interval.equation,
                "t_start_s": _time(interval.t_start_s),
                "t_end_s": _time(interval.t_end_s),
                "standard_errors": _finite(interval.size),
                **force,
            }
        )
    return found


def _figures(gap: Gap, names: Mapping[str, str]) -> list[dict[str, object]]:
    return [
        {
            "trial": names.get(after.trial, after.trial),
            "figure": after.name,
            "measured": _finite(after.measured),
            "before": _finite(before.predicted if before else None),
            "after": _finite(after.predicted),
        }
        for before, after in paired_figures(gap)
    ]


def _effect(effect: Named, held_out: set[str]) -> dict[str, object]:
    return {
        "name": effect.name,
        "parameters": _in_file(effect.parameters, estimate_in_file),
        "standard_errors": _in_file(effect.standard_errors),
        "confidence": _finite(effect.confidence),
        "by_trial": _by_trial(effect, held_out),
    }


def _by_trial(effect: Named, held_out: set[str]) -> list[dict[str, object]]:
    return [
        {
            "trial": trial,
            "held_out": trial in held_out,
            **_in_file({"speed_mps": found.speed_mps, "direction_rad": found.direction_rad}, estimate_in_file),
            "standard_errors": _in_file(
                {"speed_mps": found.speed_error_mps, "direction_rad": found.direction_error_rad}
            ),
        }
        for trial, found in effect.by_trial.items()
    ]


def _coefficient(coefficient: Refitted) -> dict[str, object]:
    return {name: _finite(value) if isinstance(value, float) else value for name, value in asdict(coefficient).items()}


def _in_file(
    values: Mapping[str, float], convert: Callable[[str, float], tuple[str, float]] = in_file_units
) -> dict[str, float | None]:
    return {key: _finite(value) for key, value in (convert(*item) for item in values.items())}


def _misfit(gap: Gap) -> dict[str, object]:
    noise = {}
    for variable, (sigma, origin) in gap.noise.items():
        name = signal_display_name(variable)
        noise[name.file] = {"sigma": _finite(name.factor * sigma), "from": origin}
    sets, alone = {"fit": False, "holdout": True}, gap.effect_alone
    return {
        "noise": noise,
        "noise_floor": NOISE_FLOOR,
        **({"in_waves": _waves(gap.waves)} if gap.waves else {}),
        **{
            version: {word: _finite(gap.misfit(version, held_out=held)) for word, held in sets.items()}
            for version in ("before", "after", "black_box")
        },
        **({"effect_alone": {key: _finite(value) for key, value in alone.items()}} if alone else {}),
    }


def _waves(waves: WaveBand) -> dict[str, object]:
    moved = {signal_display_name(variable): sigma for variable, sigma in waves.motion.items()}
    return {
        "period_s": _finite(waves.period_s),
        "motion": {name.file: _finite(name.factor * sigma) for name, sigma in moved.items()},
    }


def _trial(replay: Passed, file: str) -> dict[str, object]:
    versions = ("before", "after", *(("black_box",) if replay.black_box else ()))
    return {
        "trial": file,
        "held_out": replay.held_out,
        "misfit": {version: _finite(replay.misfit(version)) for version in versions} if measured_in(replay) else {},
        "signals": {
            signal_display_name(variable).file: {
                version: _finite(replay.misfit(version, variable)) for version in versions
            }
            for variable in measured_in(replay)
        },
    }


def _agreement(gap: Gap, names: Mapping[str, str]) -> dict[str, object]:
    agreement: dict[str, object] = {}
    for variable, trials in gap.agreement.items():
        effect, parameter = effect_parameter_name(variable)
        agreement[f"{effect}.{in_file_units(parameter, 0.0)[0]}"] = {
            names.get(trial, trial): {
                "value": _finite(estimate_in_file(parameter, value)[1]),
                "standard_error": _finite(in_file_units(parameter, error)[1]),
            }
            for trial, (value, error) in trials.items()
        }
    return agreement


def _replay(replay: Passed, file: str) -> dict[str, object]:
    """Columns of what was measured and of both simulations at the same instants, thinned to draw."""
    names = {variable: signal_display_name(variable) for variable in measured_in(replay)}
    versions = {"measured": replay.measured, "before": replay.before, "found": replay.after}
    kept = _drawn_rows(replay)
    return {"trial": file, "held_out": replay.held_out} | {
        key: drawn_columns(
            {"t_s": replay.time_s[kept]}
            | {name.file: name.factor * values[variable][kept] for variable, name in names.items()},
            len(kept),
        )
        for key, values in versions.items()
    }


def _drawn_rows(replay: Passed) -> Indices:
    """Instants of a trial that are kept: evenly spread ones, those of seldom measured signals, and all extremes."""
    kept = even = thin_points([replay.time_s], _REPLAY_SAMPLES)
    for variable in measured_in(replay):
        measured = replay.measured[variable]
        known = np.flatnonzero(np.isfinite(measured))
        columns = [measured, *(version[variable] - measured for version in (replay.before, replay.after))]
        seldom = np.isfinite(measured[even]).sum() < min(len(known), _REPLAY_SAMPLES / 2)
        extremes = thin_points([column[known] for column in columns], _REPLAY_SAMPLES if seldom else 1)
        kept = np.union1d(kept, known[extremes])
    return kept


def _next_test(test: NextTest | None) -> dict[str, object] | None:
    if test is None:
        return None
    expected = {manoeuvre: _finite(score) for manoeuvre, score in test.expected.items()}
    sizes = {
        name: {"parameters": _in_file(values, estimate_in_file), "standard_errors": _in_file(errors)}
        for name, (values, errors) in test.sizes.items()
    }
    return {
        "manoeuvre": test.manoeuvre,
        "orders": NEXT_TEST_FILE,
        "heading_deg": round(math.degrees(test.heading_rad), 6),
        "needs_instants": test.needs_instants,
        "why": test.why,
        "expected": expected,
        "candidates": sizes,
    }


def _time(value: float) -> float | None:
    """To the microsecond, far below any sample's distance: adding up steps leaves errors in the last digits."""
    return _finite(round(value, 6) + 0.0 if math.isfinite(value) else value)  # + 0.0 turns -0.0 into 0.0


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def hidden_effects_caution(gap: Gap) -> tuple[str, ...]:
    """Number of effects that would not show at their usual size, if none is missing and these are many; else empty."""
    if gap.verdict != NO_EFFECT_MISSING:
        return ()
    known = [
        hidden for name, sizes in gap.could_hide.items() if (hidden := _is_hidden(gap.card, name, sizes)) is not None
    ]
    if not known or sum(known) <= MANY_HIDDEN * len(known):
        return ()
    return (f"{sum(known)} of {len(known)} effects would not show in these data at their usual size",)


def _is_hidden(card: ManoeuvringCard, name: str, sizes: Mapping[str, float]) -> bool | None:
    """Whether an effect would not show at its usual size in any of its amplitudes; None without a usual size."""
    typical = {parameter.name: parameter.typical_values(card) for parameter in EFFECTS[name].parameters}
    pairs = [(size, max(map(abs, typical[key]))) for key, size in sizes.items() if typical[key]]
    return all(size >= usual for size, usual in pairs) if pairs else None
