"""Slow components taken out: polynomials in time."""

from __future__ import annotations

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.signals.effect import Filtered, FilterEffect, effect_frequencies
from tank2sim.records.signals.sampling import Series

HIGHEST_DEGREE = 10
"""Project choice: higher polynomials are high-pass filters with bad ends; a Butterworth filter is better."""


def detrend(series: Series, degree: int) -> Filtered:
    """The signal less the polynomial of `degree` in time that fits it best (0: its mean, 1: a straight line).

    What it does to a wave depends on where in the record its crests are; the stated effect is the mean over all such
    places, the part of the wave that stays a wave of this frequency. It has no phase.

    Raises
    ------
    InputError
        The degree is not from 0 to 10.
    """
    if not 0 <= degree <= HIGHEST_DEGREE:
        problem = f"{degree} is not a degree of a trend"
        raise InputError("detrend", "", problem, f"give 0 (the mean) to {HIGHEST_DEGREE}, or use highpass")
    count = len(series.values)
    across = np.linspace(-1.0, 1.0, count)
    trend = np.polynomial.Legendre.fit(across, series.values, degree)(across)
    grid = effect_frequencies(series)
    gain = _kept(across, degree, grid * series.step_s)
    whole = np.flatnonzero(gain > 0.9)
    clear = f"above {grid[whole[0]]:.3g} Hz" if whole.size else "nowhere"
    sentence = f"no phase shift, takes out what is slower than the record; 90 % of the amplitude stays {clear}"
    effect = FilterEffect(grid, gain.astype(np.complex128), np.zeros(len(grid)), (0.0, 0.0), sentence)
    return Filtered(series.with_values(series.values - trend), effect)


def _kept(across: Array, degree: int, cycles_a_sample: Array) -> Array:
    """1 - |P e|^2/n of waves e of n samples, with P the projection on polynomials: real, from 0 to 1."""
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(across, degree))
    time = np.arange(len(across))
    parts = [basis.T @ np.exp(2j * np.pi * cycles * time) for cycles in cycles_a_sample]
    kept: Array = 1.0 - np.sum(np.abs(np.array(parts)) ** 2, axis=1) / len(across)
    return np.clip(kept, 0.0, 1.0)
