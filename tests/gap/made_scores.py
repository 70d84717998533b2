"""Explanations with scores typed by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from tank2sim.gap.inference.fit import ExplanationFit
from tests.gap.toy import Toy
from tests.gap.toy_likelihood import LOGS

CALM = SimpleNamespace(belief=SimpleNamespace(waves=None))
"""A likelihood of which a verdict reads no more."""

FORCE, DRAG, BIAS, LAG, LATE, PLAY, BAND = range(2, 9)
FOUR = (0, FORCE, DRAG, LAG)
"""Places of effects in :data:`.toy.NAMES`: two of forces, and of the steering gear."""


def fit(score: float, *indices: int, sure: float = 10.0, width: float = 0.8) -> ExplanationFit:
    """An explanation whose sizes are 1 and so many standard errors."""
    count = len(indices)
    logs = np.append(LOGS[:-1], np.log(width))
    return ExplanationFit(
        Toy((None,) * count, indices=indices), np.ones(count), np.eye(count) / sure**2, logs, score, np.zeros(2)
    )
