"""What a filter does to amplitude and phase: as numbers over frequency, and as a sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array, ComplexArray
from tank2sim.records.signals.sampling import Series

_FREQUENCIES = 400


@dataclass(frozen=True, eq=False)
class FilterEffect:
    """Frequency response of a filter, and where its ends are not to be believed.

    Parameters
    ----------
    frequency_hz : array (m,)
        Rising, from one period a record to below the Nyquist frequency.
    response : complex array (m,)
        Output over input; a negative angle: the output comes later. Its unit is 1, or 1/s of a derivative.
    group_delay_s : array (m,)
        Delay of a packet of waves about a frequency.
    distorted_ends_s : (float, float)
        Distorted time at the begin and at the end of the record.
    explanation : str
        The same in words.
    """

    frequency_hz: Array
    response: ComplexArray
    group_delay_s: Array
    distorted_ends_s: tuple[float, float]
    explanation: str

    @property
    def gain(self) -> Array:
        """Amplitude of the output over that of the input."""
        return np.abs(self.response)

    @property
    def phase_rad(self) -> Array:
        """Angle of the response, negative: later. Continuous, and within half a turn where the gain is largest.

        Without delay it is not made continuous: it is 0, or half a turn where waves come out upside down.
        """
        angle: Array = np.angle(self.response)
        if not self.group_delay_s.any():
            return np.where(angle < 1e-6 - math.pi, math.pi, angle)
        phase: Array = np.unwrap(angle)
        turn = 2.0 * math.pi
        return phase - turn * round(float(phase[np.argmax(self.gain)]) / turn)

    def at(self, frequency_hz: float) -> complex:
        """Response at a frequency (Hz), between those given by straight lines over the logarithm of frequency."""
        place, known = math.log(frequency_hz), np.log(self.frequency_hz)
        return complex(np.interp(place, known, self.response.real), np.interp(place, known, self.response.imag))


@dataclass(frozen=True, eq=False)
class Filtered:
    """A filtered signal and what the filter did to it."""

    series: Series
    effect: FilterEffect


def effect_frequencies(series: Series) -> Array:
    """Frequencies (Hz) at which an effect is reported, evenly spread over their logarithm, (400,)."""
    # Not quite to Nyquist, where low-pass filters have a zero and no phase.
    grid: Array = np.geomspace(1.0 / series.duration_s, 0.499 * series.rate_hz, _FREQUENCIES)
    return grid


def decibel(gain: float) -> str:
    """A gain in words: ``-6 dB``."""
    return f"{20.0 * math.log10(max(gain, 1e-10)):+.2g} dB"
