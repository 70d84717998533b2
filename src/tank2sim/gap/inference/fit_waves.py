"""Whether waves act on the ship, and how strong they are: a narrow band of accelerations fitted with an explanation."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import minimize

from tank2sim.arrays import Array
from tank2sim.gap.inference.batch import BLOCKS_PER_SHIP_TIME
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.wave_band import WaveBand

LONGEST, SHORTEST = float(BLOCKS_PER_SHIP_TIME), 2.2
"""Periods of waves that are sought, in blocks (project choice): one L/u0, beyond which a ship manoeuvres, to hardly
more than two blocks, below which means over blocks do not show a period."""

FREQUENCIES, LEVELS, DAMPING = 6, (1.0, 3.0), 0.1
"""Bands to begin with (project choice): frequencies, acceleration times period over 2 pi in noises of a sensor, and
damping ratio: of the order of an ocean's spectrum."""

DAMPINGS = (0.02, 0.5)
"""Least and largest damping ratio (project choice): a swell; a band so broad that it is another gust."""

WEAKEST = 1e-3
"""Least level over that to begin with (project choice): an axis on which no waves act."""

WAVES_DECREASE = 30.0
"""Decrease of the score from which waves are taken to act (project choice): that of five numbers by Schwarz's criterion
for some hundred independent measurements."""


STEPS, CONVERGED = 12, 0.5
"""Most steps of the search for a band, and the decrease of the score by a step at which it stops (project choice)."""


def fit_waves(likelihood: Likelihood, fit: ExplanationFit) -> WaveBand | None:
    """The accelerations by waves that explain the measurements best with an explanation; None if there are none.

    Parameters
    ----------
    likelihood : Likelihood
        With or without waves; those that it has are one of the beginnings.
    fit : ExplanationFit
        Its noise is kept; its parameters follow linearly.
    """
    motion = likelihood.motion
    highest, lowest = (2 * np.pi / (blocks * motion.block_s) for blocks in (SHORTEST, LONGEST))
    noise = motion.errors[:3]

    score = likelihood.cost_of_waves(fit)

    def band(logs: Array) -> WaveBand:
        frequency = float(np.exp(logs[3]))
        return WaveBand(np.exp(logs[:3]) * noise * frequency, frequency, float(np.exp(-logs[4])) / frequency)

    begins = [
        np.log([level, level, level, frequency, DAMPING])
        for frequency, level in product(np.geomspace(lowest, highest, FREQUENCIES), LEVELS)
    ]
    known = likelihood.belief.waves
    if known is not None:
        damping = 1 / (known.time * known.frequency)
        begins.append(np.log([*known.level / noise / known.frequency, known.frequency, damping]))
    scores = [score(band(logs)) for logs in begins]
    without = score(None)
    if min(scores) > without:
        return None
    low = np.log([*3 * [WEAKEST], lowest, DAMPINGS[0]])
    high = np.log([*3 * [1 / WEAKEST], highest, DAMPINGS[1]])
    best = minimize(
        lambda logs: score(band(logs)),
        begins[int(np.argmin(scores))],
        method="L-BFGS-B",
        bounds=list(zip(low, high, strict=True)),
        options={"maxiter": STEPS, "eps": 1e-3, "ftol": CONVERGED / max(abs(without), 1.0)},
    )
    return band(best.x) if best.fun < without - WAVES_DECREASE else None
