"""Trials replayed: free running over their whole length with the recorded inputs, by the given and improved cards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, input_record
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import driven_model
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.audit.noise import record_noise

_LEAST_NOISE = 1e-6
"""Noise of a record without any, SI: all its signals then weigh alike. Project choice."""


def replay_trials(
    card: ManoeuvringCard,
    improved: ManoeuvringCard,
    measured: Measured,
    noise: Mapping[str, float],
    held_out: bool,
    corrected: Measured | None = None,
) -> tuple[Passed, ...]:
    """Each trial as measured and as both cards' models simulate it, from the initial state that fits the record best.

    Measurements are compared as they are, at :data:`INSTANTS` instants in L/u0 or as often as they were sampled, so
    that `noise` is that of one reading.

    Parameters
    ----------
    card, improved : ManoeuvringCard
        As given, and with the effects found.
    measured : Measured
        As recorded.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    held_out : bool
        Whether these trials are held out.
    corrected : Measured, optional
        The same trials without the faults of sensors that were found. The improved card then follows these; its motion
        is shown as the faulty sensor would, with the correction added back, so that it is comparable with the
        recorded signals and its misfit is that in the corrected data.

    Raises
    ------
    InputError
        A trial is too short, or has none of the signals in `noise`.
    """
    replayers = {True: _replayer(card, measured, noise)}
    replayers[False] = replayers[True] if improved is card else _replayer(improved, measured, noise)
    corrected_trials = {trial.name: trial for trial in corrected.trials} if corrected is not None else {}
    results = []
    for trial in measured.trials:
        record = input_record(replayers[True], trial)
        before = _simulated(replayers[True], record, noise)
        after = before
        if improved is not card or trial.name in corrected_trials:
            better = input_record(replayers[False], corrected_trials.get(trial.name, trial))
            after = _simulated(replayers[False], better, noise) + np.nan_to_num(record.readings - better.readings)
        results.append(_passed(record, replayers[True].seen, noise, held_out, (before, after)))
    return tuple(results)


def replay_by_card(card: ManoeuvringCard, measured: Measured) -> tuple[Passed, ...]:
    """Each trial, free running with its recorded inputs over its whole length, from the state that fits it best.

    Signals are weighted by their stated or estimated noise.

    Raises
    ------
    InputError
        A trial is too short, or none of its signals can be compared.
    """
    squares: dict[str, list[float]] = {}
    for trial in measured.trials:
        for signal, deviation in record_noise(trial).items():
            if signal in OBSERVED_SIGNALS:
                squares.setdefault(OBSERVED_SIGNALS[signal], []).append(deviation**2)
    noise = {name: max(float(np.sqrt(np.mean(values))), _LEAST_NOISE) for name, values in squares.items()}
    return replay_trials(card, card, measured, noise, held_out=True)


def with_black_box(
    results: Sequence[Passed], box: ManoeuvringCard, measured: Measured, noise: Mapping[str, float]
) -> tuple[Passed, ...]:
    """The same replays with the simulation of each trial by a black box's card; `noise` weighs its initial states."""
    replayer = _replayer(box, measured, noise)
    trials = {trial.name: trial for trial in measured.trials}
    boxed = []
    for result in results:
        simulated = _simulated(replayer, input_record(replayer, trials[result.name]), noise)
        columns = dict(zip(replayer.seen, simulated.T, strict=True))
        boxed.append(replace(result, black_box={name: columns[name] for name in result.noise}))
    return tuple(boxed)


def _replayer(card: ManoeuvringCard, measured: Measured, noise: Mapping[str, float]) -> Replayer:
    model = driven_model(card, measured.driven_by)
    return Replayer(
        card, measured.driven_by, [name for name in OBSERVED_SIGNALS.values() if name in noise and name in model]
    )


def _simulated(replayer: Replayer, record: InputRecord, noise: Mapping[str, float]) -> Array:
    p = replayer.model.parameter_values()
    sigma = np.array([noise[name] for name in replayer.seen])
    return replayer.motion(record, replayer.fit_initial_state(record, sigma, p), p)


def _passed(
    record: InputRecord, seen: Sequence[str], noise: Mapping[str, float], held_out: bool, simulated: tuple[Array, Array]
) -> Passed:
    measured_names = [name for place, name in enumerate(seen) if not np.isnan(record.readings[:, place]).all()]

    def columns(values: Array) -> dict[str, Array]:
        return {name: values[:, seen.index(name)] for name in measured_names}

    before, after = simulated
    return Passed(
        name=record.name,
        held_out=held_out,
        time_s=record.times,
        noise={name: noise[name] for name in measured_names},
        measured=columns(record.readings),
        before=columns(before),
        after=columns(after),
    )
