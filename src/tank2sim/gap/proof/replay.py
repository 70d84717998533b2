"""Trials replayed: free running over their whole length with the recorded inputs, by the given and improved cards."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, input_record
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.trials import Trial
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS

_LEAST_NOISE = 1e-6
"""Noise of a record without any, SI: all its signals then weigh alike. Project choice."""


@dataclass(frozen=True, eq=False)
class TrialReplays:
    """How trials are replayed.

    Parameters
    ----------
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    executor : Executor, optional
        Follows several trials at once; the result does not depend on it.
    """

    noise: Mapping[str, float]
    executor: Executor | None = None
    _begun: dict[tuple[Trial, str, str], Callable[[], _Followed]] = field(default_factory=dict, repr=False)

    def by_cards(
        self,
        card: SteeredCard,
        improved: SteeredCard,
        measured: Measured,
        held_out: bool,
        corrected: Measured | None = None,
    ) -> tuple[Passed, ...]:
        """Each trial as measured and as both cards' models simulate it; see :func:`replay_trials`."""
        given, after = self.begin(card, measured), self.begin(improved, corrected or measured)
        results = []
        for before, then in zip(given, after, strict=True):
            old, new = before(), then()
            simulated = new.simulated + np.nan_to_num(old.record.readings - new.record.readings)
            results.append(_passed(old.record, old.seen, self.noise, held_out, (old.simulated, simulated)))
        return tuple(results)

    def with_black_box(self, results: Sequence[Passed], box: SteeredCard, measured: Measured) -> tuple[Passed, ...]:
        """The same replays with the simulation of each trial by a black box's card."""
        followed = {each.record.name: each for each in (wait() for wait in self.begin(box, measured))}
        boxed = []
        for result in results:
            simulated = followed[result.name]
            columns = dict(zip(simulated.seen, simulated.simulated.T, strict=True))
            boxed.append(replace(result, black_box={name: columns[name] for name in result.noise}))
        return tuple(boxed)

    def begin(self, card: SteeredCard, measured: Measured) -> list[Callable[[], _Followed]]:
        """Begin to follow each trial, the longest first; return the functions that wait for them.

        The card's model simulates each from the initial state that fits it best, and once.
        """
        driven_by, noise = measured.driven_by, dict(self.noise)
        for trial in sorted(measured.trials, key=lambda trial: -len(trial.time_s)):
            if (key := (trial, card.text, driven_by)) not in self._begun:
                follow = partial(_follow, card, driven_by, noise, trial)
                self._begun[key] = cache(follow) if self.executor is None else self.executor.submit(follow).result
        return [self._begun[trial, card.text, driven_by] for trial in measured.trials]


def replay_trials(
    card: SteeredCard,
    improved: SteeredCard,
    measured: Measured,
    noise: Mapping[str, float],
    held_out: bool,
    corrected: Measured | None = None,
) -> tuple[Passed, ...]:
    """Each trial as measured and as both cards' models simulate it, from the initial state that fits the record best.

    Measurements are compared as they are, at :data:`INSTANTS` instants in L/u0 or as often as they were sampled, so
    that `noise` is per reading.

    Parameters
    ----------
    card, improved : SteeredCard
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
    return TrialReplays(noise).by_cards(card, improved, measured, held_out, corrected)


@dataclass(frozen=True, eq=False)
class _Followed:
    """A trial as a card's model simulates it: readings (m, ny) of the variables `seen`."""

    record: InputRecord
    seen: tuple[str, ...]
    simulated: Array


def _follow(card: SteeredCard, driven_by: str, noise: Mapping[str, float], trial: Trial) -> _Followed:
    replayer = replayer_of(card, driven_by, noise)
    p = replayer.model.parameter_values()
    record, start = replayer.fit_record(input_record(replayer, trial), p)
    return _Followed(record, replayer.seen, replayer.motion(record, start, p))


_REPLAYERS: dict[tuple[str, str, tuple[tuple[str, float], ...]], Replayer] = {}
"""The last replayer of this process, by the card's text, what drives the rudder and the noise."""


def replayer_of(card: SteeredCard, driven_by: str, noise: Mapping[str, float]) -> Replayer:
    """The replayer of a card, kept for the next trial; `driven_by` and `noise` as in :class:`.open_loop.Replayer`."""
    key = card.text, driven_by, tuple(noise.items())
    if key not in _REPLAYERS:
        _REPLAYERS.clear()
        _REPLAYERS[key] = Replayer(card, driven_by, noise)
    return _REPLAYERS[key]


def replay_by_card(card: SteeredCard, measured: Measured) -> tuple[Passed, ...]:
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
