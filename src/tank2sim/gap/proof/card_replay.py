"""Trials replayed by one card, for those who only want to see how it follows them."""

from __future__ import annotations

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.gap.proof.replay import replay_trials
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.audit.noise import record_noise

_LEAST = 1e-6
"""Noise of a record without any, SI: all its signals then weigh alike. Project choice."""


def replay_by_card(card: ManoeuvringCard, measured: Measured) -> tuple[Passed, ...]:
    """Each trial, free running with its recorded inputs over its whole length, from the state that suits it best.

    Signals are weighed by the noise that they state or show.

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
    noise = {name: max(float(np.sqrt(np.mean(values))), _LEAST) for name, values in squares.items()}
    return replay_trials(card, card, measured, noise, held_out=True)
