"""Study of a gap made from the results of the workflow, and parameters in the units of cards and readers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.error_intervals import acting, contradiction, missing_force_intervals
from tank2sim.gap.improve_card import estimate_in_file, in_file_units
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.gap.outcome.lacking import lacking_study
from tank2sim.gap.outcome.study import (
    ActingInterval,
    DecidingTest,
    EffectFound,
    EffectSize,
    FoundSurroundings,
    GapFigure,
    GapMisfit,
    GapReplay,
    GapStudy,
    MisfitBySet,
    MisfitNoise,
    TrialEstimate,
    TrialMisfit,
    WaveMotion,
)
from tank2sim.gap.proof.cross_check import proof_cautions
from tank2sim.gap.result import NO_EFFECT_MISSING, Acting, Gap, MisfitPlace, Named, NextTest, Passed
from tank2sim.notices import Notice, caution
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import Indices, drawn_columns, thin_points
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.units import in_words, to_si

NEXT_TEST_FILE = "next_test.csv"
"""File next to ``gap.json`` with the orders of the next test."""

NOISE_FLOOR = 1.0
"""Misfit of a perfect model: it is counted in standard deviations of the measurement noise."""

_MOST_PASSAGES = 24
"""Number of reported intervals in which the model is wrong, the most significant (project choice)."""

_REPLAY_SAMPLES = 140
"""Samples of a trial in the JSON, without extremes: as many as its line in a small panel has."""

MANY_HIDDEN = 0.25
"""Share of the effects that would not show at their usual size, from which "no missing effect" says little (project
choice: of varied manoeuvres a tenth does not show, of the first 50 s of one turn two fifths, of 10 s nearly all)."""


def gap_study(gap: Gap, files: Mapping[str, str] | None = None) -> GapStudy:
    """Return the study of a gap; angles in degrees.

    Parameters
    ----------
    gap : Gap
    files : mapping, optional
        Name of a trial to its file; by default ``<name>.csv``.
    """
    names = {replay.name: (files or {}).get(replay.name, f"{replay.name}.csv") for replay in gap.passed}
    held_out = {replay.name for replay in gap.passed if replay.held_out}
    return GapStudy(
        ship=gap.card.ship.name,
        verdict=gap.verdict,
        effects=tuple(_effect(effect, held_out) for effect in gap.effects),
        coefficients=gap.coefficients,
        alternatives=tuple(joined(alternative) for alternative in gap.alternatives),
        where=tuple(_place(place, names) for place in gap.where),
        acting=tuple(_interval(interval, names) for interval in acting(gap)[:_MOST_PASSAGES]),
        equation=gap.equation,
        misfit=_misfit(gap),
        could_hide={effect: _in_file(sizes) for effect, sizes in hidden(gap).items()},
        could_hide_in_words={
            effect: "; ".join(hidden_in_words(effect, name, size) for name, size in sizes.items())
            for effect, sizes in hidden(gap).items()
        },
        next_test=_next_test(gap.next_test) if gap.next_test else None,
        rivals=gap.rivals,
        trials=tuple(_trial(replay, names[replay.name]) for replay in gap.passed),
        figures=_figures(gap, names),
        agreement=_agreement(gap, names),
        missing_force=lacking_study(missing_force_intervals(gap), names),
        missing_signal=lacking_study(contradiction(gap), names),
        replays=tuple(_replay(replay, names[replay.name]) for replay in gap.passed),
        notices=(*proof_cautions(gap), *hidden_effects_caution(gap), *gap.notices),
        record_doubts=gap.doubts,
        card_objections=gap.objections,
    )


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


def _place(place: MisfitPlace, names: Mapping[str, str]) -> MisfitPlace:
    """A place with its file, its column and rounded times."""
    return replace(
        place,
        trial=names.get(place.trial, f"{place.trial}.csv"),
        signal=signal_display_name(place.signal).file,
        t_start_s=_time(place.t_start_s),
        t_end_s=_time(place.t_end_s),
    )


def _interval(interval: Acting, names: Mapping[str, str]) -> ActingInterval:
    return ActingInterval(
        trial=names.get(interval.trial, f"{interval.trial}.csv"),
        equation=interval.equation,
        t_start_s=_time(interval.t_start_s),
        t_end_s=_time(interval.t_end_s),
        standard_errors=interval.size,
        force_N=_finite(interval.force) if interval.equation in ("surge", "sway") else None,
        moment_Nm=_finite(interval.force) if interval.equation == "yaw" else None,
    )


def _figures(gap: Gap, names: Mapping[str, str]) -> tuple[GapFigure, ...]:
    """Each figure of a turn or zigzag before and after; the same where no effect was added."""
    old = {(figure.trial, figure.name): figure.predicted for figure in gap.figures_before}
    return tuple(
        GapFigure(
            trial=names.get(figure.trial, figure.trial),
            figure=figure.name,
            measured=figure.measured,
            before=_finite(old.get((figure.trial, figure.name))),
            after=_finite(figure.predicted),
        )
        for figure in gap.figures_after or gap.figures_before
    )


def _effect(effect: Named, held_out: set[str]) -> EffectFound:
    by_trial = [
        FoundSurroundings(
            trial=trial,
            held_out=trial in held_out,
            speed_mps=found.speed_mps,
            direction_deg=estimate_in_file("direction_rad", found.direction_rad)[1],
            speed_error_mps=found.speed_error_mps,
            direction_error_deg=math.degrees(found.direction_error_rad),
        )
        for trial, found in effect.by_trial.items()
    ]
    return EffectFound(
        name=effect.name,
        parameters=_in_file(effect.parameters, estimate_in_file),
        standard_errors=_in_file(effect.standard_errors),
        confidence=effect.confidence,
        by_trial=tuple(by_trial),
    )


def _in_file(
    values: Mapping[str, float], convert: Callable[[str, float], tuple[str, float]] = in_file_units
) -> dict[str, float]:
    return dict(convert(*item) for item in values.items())


def _misfit(gap: Gap) -> GapMisfit:
    alone = {key: _finite(value) for key, value in gap.effect_alone.items()}

    def of(version: str) -> MisfitBySet:
        fit, held = (_finite(gap.misfit(version, held_out=held_out)) for held_out in (False, True))
        return MisfitBySet(fit=fit, holdout=held)

    return GapMisfit(
        noise={
            name.file: MisfitNoise(sigma=name.factor * sigma, origin=origin)
            for name, (sigma, origin) in ((signal_display_name(key), noise) for key, noise in gap.noise.items())
        },
        before=of("before"),
        after=of("after"),
        black_box=of("black_box"),
        in_waves=_waves(gap.waves) if gap.waves else None,
        effect_alone=MisfitBySet(fit=alone.get("fit"), holdout=alone.get("holdout")) if alone else None,
        noise_floor=NOISE_FLOOR,
    )


def _waves(waves: WaveBand) -> WaveMotion:
    moved = {signal_display_name(variable): sigma for variable, sigma in waves.motion.items()}
    return WaveMotion(period_s=waves.period_s, motion={name.file: name.factor * sigma for name, sigma in moved.items()})


def _trial(replay: Passed, file: str) -> TrialMisfit:
    versions = ("before", "after", *(("black_box",) if replay.black_box else ()))
    return TrialMisfit(
        trial=file,
        held_out=replay.held_out,
        misfit={version: replay.misfit(version) for version in versions} if replay.seen else {},
        signals={
            signal_display_name(variable).file: {version: replay.misfit(version, variable) for version in versions}
            for variable in replay.seen
        },
    )


def _agreement(gap: Gap, names: Mapping[str, str]) -> dict[str, dict[str, TrialEstimate]]:
    agreement = {}
    for variable, trials in gap.agreement.items():
        effect, parameter = effect_parameter_name(variable)
        agreement[f"{effect}.{in_file_units(parameter, 0.0)[0]}"] = {
            names.get(trial, trial): TrialEstimate(
                value=estimate_in_file(parameter, value)[1], standard_error=in_file_units(parameter, error)[1]
            )
            for trial, (value, error) in trials.items()
        }
    return agreement


def _replay(replay: Passed, file: str) -> GapReplay:
    """Columns of what was measured and of both simulations at the same instants, thinned to draw."""
    names = {variable: signal_display_name(variable) for variable in replay.seen}
    kept = _drawn_rows(replay)
    measured, before, found = (
        drawn_columns(
            {"t_s": replay.time_s[kept]}
            | {name.file: name.factor * values[variable][kept] for variable, name in names.items()},
            len(kept),
        )
        for values in (replay.measured, replay.before, replay.after)
    )
    return GapReplay(trial=file, held_out=replay.held_out, measured=measured, before=before, found=found)


def _drawn_rows(replay: Passed) -> Indices:
    """Instants of a trial that are kept: evenly spread ones, instants of seldom measured signals, and all extremes."""
    kept = even = thin_points([replay.time_s], _REPLAY_SAMPLES)
    for variable in replay.seen:
        measured = replay.measured[variable]
        known = np.flatnonzero(np.isfinite(measured))
        columns = [measured, *(version[variable] - measured for version in (replay.before, replay.after))]
        seldom = np.isfinite(measured[even]).sum() < min(len(known), _REPLAY_SAMPLES / 2)
        extremes = thin_points([column[known] for column in columns], _REPLAY_SAMPLES if seldom else 1)
        kept = np.union1d(kept, known[extremes])
    return kept


def _next_test(test: NextTest) -> DecidingTest:
    return DecidingTest(
        manoeuvre=test.manoeuvre,
        orders=NEXT_TEST_FILE,
        heading_deg=round(math.degrees(test.heading_rad), 6),
        needs_instants=test.needs_instants,
        why=test.why,
        expected={name: score if math.isfinite(score) else math.nan for name, score in test.expected.items()},
        candidates={
            name: EffectSize(parameters=_in_file(values, estimate_in_file), standard_errors=_in_file(errors))
            for name, (values, errors) in test.sizes.items()
        },
    )


def _time(value: float) -> float:
    """To the microsecond, far below any sample's distance: adding up steps leaves errors in the last digits."""
    return round(value, 6) + 0.0 if math.isfinite(value) else value  # + 0.0 turns -0.0 into 0.0


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def hidden_effects_caution(gap: Gap) -> tuple[Notice, ...]:
    """Number of effects that would not show at their usual size, if none is missing and these are many; else empty."""
    if gap.verdict != NO_EFFECT_MISSING:
        return ()
    known = [
        hidden for name, sizes in gap.could_hide.items() if (hidden := _is_hidden(gap.card, name, sizes)) is not None
    ]
    if not known or sum(known) <= MANY_HIDDEN * len(known):
        return ()
    return (caution(f"{sum(known)} of {len(known)} effects would not show in these data at their usual size"),)


def _is_hidden(card: SteeredCard, name: str, sizes: Mapping[str, float]) -> bool | None:
    """Whether an effect would not show at its usual size in any of its amplitudes; None without a usual size."""
    typical = {parameter.name: parameter.typical_values(card) for parameter in EFFECTS[name].parameters}
    pairs = [(size, max(map(abs, typical[key]))) for key, size in sizes.items() if typical[key]]
    return all(size >= usual for size, usual in pairs) if pairs else None
