"""Trials replayed by one card, for those who only want to see how it follows them."""

from __future__ import annotations

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.gap.replay import passed
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.measured import Measured
from tank2sim.identification.trials.runs import SEEN
from tank2sim.records.audit.noise import estimated_noise

_LEAST = 1e-6
"""Noise of a record without any, SI: all its signals then weigh alike. A choice of ours."""


def replayed(card: ManoeuvringCard, measured: Measured) -> tuple[Passed, ...]:
    """Each trial, free running with its recorded inputs over its whole length, from the state that suits it best.

    Signals are weighed by the noise that they state or show.

    Raises
    ------
    InputError
        A trial is too short, or none of its signals can be compared.
    """
    squares: dict[str, list[float]] = {}
    for trial in measured.trials:
        for signal, deviation in estimated_noise(trial).items():
            if signal in SEEN:
                squares.setdefault(SEEN[signal], []).append(deviation**2)
    noise = {name: max(float(np.sqrt(np.mean(values))), _LEAST) for name, values in squares.items()}
    return passed(card, card, measured, noise, held_out=True)
