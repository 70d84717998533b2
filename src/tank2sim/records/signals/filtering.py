"""Filters and smoothers, each with its effect on amplitude and phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy import interpolate, signal

from tank2sim.arrays import Array, ComplexArray
from tank2sim.errors import InputError
from tank2sim.records.signals.sampling import FEWEST_SAMPLES, Series

ORDER = 4
"""Order of a Butterworth filter if none is given: 24 dB an octave, and twice that forwards and backwards."""

# Part of the sum of a filter's impulse response that is still to come where its ends are called undistorted
_SETTLED = 0.01

HIGHEST_DEGREE = 10
"""Project choice: higher polynomials are high-pass filters with bad ends; a Butterworth filter is better."""


class FilterType(StrEnum):
    """Pass band of a filter."""

    LOW = "lowpass"
    HIGH = "highpass"
    BAND = "bandpass"


def butterworth(
    series: Series, kind: FilterType, cutoff_hz: Sequence[float], *, order: int = ORDER, causal: bool = False
) -> Filtered:
    """Butterworth filter, forwards and backwards without shift of phase, or forwards alone as a measuring chain does.

    `series`: What to filter; `kind`: Low, high or band pass; `cutoff_hz`: Where one pass has -3 dB; forwards and
    backwards together have -6 dB there; `order`: Order of one pass; in a band pass, of each of its sides; `causal`:
    Forwards alone; it begins as if the signal had always had its first value.

    Raises InputError: A frequency is not between one period a record and the Nyquist frequency, or they do not rise.
    """
    edges = [_within(series, kind.value, edge) for edge in cutoff_hz]
    if len(edges) != (2 if kind is FilterType.BAND else 1) or sorted(set(edges)) != edges:
        raise InputError(
            kind.value, "", "takes one frequency, a band two that rise", "write lowpass:0.5, bandpass:0.1,1"
        )
    sections = signal.butter(
        order, edges if kind is FilterType.BAND else edges[0], kind.value, fs=series.rate_hz, output="sos"
    )
    settling, grid = _settling(sections, series), effect_frequencies(series)
    response = _sections_response(sections, grid, series)
    if causal:
        first = signal.sosfilt_zi(sections) * series.values[0]
        values = signal.sosfilt(sections, series.values, zi=first)[0]
        effect = FilterEffect(grid, response, _sections_delay(sections, grid, series), (settling, 0.0), "")
        return Filtered(series.with_values(values), replace(effect, explanation=_causal_sentence(effect, kind, edges)))
    # Reflected as far as the filter remembers, the record's ends are least disturbed.
    reach = min(len(series.values) - 1, max(1, round(settling / series.step_s)))
    values = signal.sosfiltfilt(sections, series.values, padlen=reach)
    where = " and ".join(f"{edge:.3g}" for edge in edges)
    sentence = f"no phase shift, {decibel(0.5)} at {where} Hz, ends distorted over {settling:.3g} s"
    response = np.abs(response) ** 2 + 0j
    effect = FilterEffect(grid, response, np.zeros(len(grid)), (settling, settling), sentence)
    return Filtered(series.with_values(values), effect)


def savitzky_golay(series: Series, samples: int, degree: int, *, derivative: int = 0) -> Filtered:
    """Savitzky-Golay: a polynomial fitted to `samples` about each, and its value or derivative there.

    `series`: What to smooth; `samples`: Length of the window, odd; at most the record; `degree`: Degree of the
    polynomial, below `samples`; `derivative`: 0 for the value, 1 or more for the derivative by time, in unit/s and so
    on.

    Raises InputError: These do not fit each other.
    """
    if samples % 2 == 0 or not degree < samples <= len(series.values) or not 0 <= derivative <= degree:
        problem = f"{samples} samples of degree {degree} do not fit a record of {len(series.values)}"
        raise InputError(
            series.source,
            "filter savgol",
            problem,
            "give an odd number of samples above the degree, such as savgol:11,3",
        )
    values = signal.savgol_filter(series.values, samples, degree, deriv=derivative, delta=series.step_s)
    taps = signal.savgol_coeffs(samples, degree, deriv=derivative, delta=series.step_s)
    grid = effect_frequencies(series)
    response = _centred_response(taps, grid, series)
    half = samples // 2 * series.step_s
    found = next(iter(grid[np.abs(response) / (2.0 * np.pi * grid) ** derivative < 0.5].tolist()), None)
    limit = f"{decibel(0.5)} at {found:.3g} Hz" if found else "more than half the amplitude at all frequencies"
    what = f"derivative of order {derivative} without delay" if derivative else "no phase shift"
    text = f"{what}, {limit}, side lobes above, some upside down; fit one-sided over {half:.3g} s at both ends"
    return Filtered(series.with_values(values), FilterEffect(grid, response, np.zeros(len(grid)), (half, half), text))


def smoothing_spline(series: Series, cutoff_hz: float) -> Filtered:
    """Cubic smoothing spline whose weight of curvature halves the amplitude at `cutoff_hz`.

    Of densely sampled values it is a filter of gain 1/(1 + (f/cutoff)^4) and no phase (Silverman 1984), which makes
    the weight in samples 1/(2 pi cutoff step)^4. Its response is measured here, from what it makes of an impulse.

    Raises InputError: The frequency is not between one period a record and the Nyquist frequency.
    """
    _within(series, "spline", cutoff_hz)
    count = len(series.values)
    weight = (2.0 * math.pi * cutoff_hz * series.step_s) ** -4.0
    across = np.arange(float(count))
    values = interpolate.make_smoothing_spline(across, series.values, lam=weight)(across)
    # 12 decay lengths of its kernel, sqrt(2)/(2 pi cutoff), to each side of the impulse.
    half = min(count, 10 + round(12 * math.sqrt(2.0) / (2.0 * math.pi * cutoff_hz * series.step_s)))
    places = np.arange(2.0 * half + 1)
    taps = interpolate.make_smoothing_spline(places, np.where(places == half, 1.0, 0.0), lam=weight)(places)
    grid = effect_frequencies(series)
    response = _centred_response(taps, grid, series)
    end = 1.0 / (2.0 * math.pi * cutoff_hz) * math.sqrt(2.0) * math.log(1.0 / _SETTLED)
    text = f"no phase shift, {decibel(0.5)} at {cutoff_hz:.3g} Hz, ends freer over {end:.3g} s"
    return Filtered(series.with_values(values), FilterEffect(grid, response, np.zeros(len(grid)), (end, end), text))


def decimate(series: Series, factor: int) -> Filtered:
    """Every `factor`-th sample, after a low pass forwards and backwards that keeps what is above the new Nyquist out.

    The filter is as in scipy.signal.decimate, Chebyshev with 0.05 dB ripple to 0.8 of the new Nyquist frequency, but
    of order 7: one of even order has its ripple at zero frequency too, and would take 1 % off a steady heading.

    Raises InputError: The factor is below 2 or leaves fewer than 50 samples.
    """
    if factor < 2 or len(series.values) // factor < FEWEST_SAMPLES:
        problem = f"every {factor}th of {len(series.values)} samples"
        raise InputError(
            series.source, "filter decimate", problem, f"give 2 or more that leaves {FEWEST_SAMPLES} samples"
        )
    edge = 0.8 / factor
    zeros, poles, gain = signal.cheby1(7, 0.05, edge, output="zpk")
    sections = signal.zpk2sos(zeros, poles, gain)
    values = signal.decimate(series.values, factor, ftype=signal.dlti(zeros, poles, gain), zero_phase=True)
    grid = effect_frequencies(series)
    response = np.abs(_sections_response(sections, grid, series)) ** 2 + 0j
    settling = _settling(sections, series)
    kept = edge * series.rate_hz / 2.0
    nyquist = series.rate_hz / factor / 2.0
    text = (
        f"no phase shift, one sample in {factor}: amplitudes kept to {kept:.3g} Hz, nothing above {nyquist:.3g} Hz; "
        f"ends distorted over {settling:.3g} s"
    )
    thinner = replace(series, step_s=factor * series.step_s, values=values)
    return Filtered(thinner, FilterEffect(grid, response, np.zeros(len(grid)), (settling, settling), text))


def _within(series: Series, filter_name: str, frequency_hz: float) -> float:
    low, high = 1.0 / series.duration_s, series.rate_hz / 2.0
    if not low < frequency_hz < high:
        problem = f"{frequency_hz:g} Hz is not between one period a record and half the sampling rate"
        raise InputError(
            series.source, f"filter {filter_name}", problem, f"give a frequency from {low:.3g} to {high:.3g} Hz"
        )
    return float(frequency_hz)


def _sections_response(sections: Array, grid: Array, series: Series) -> NDArray[np.complex128]:
    return np.asarray(signal.sosfreqz(sections, worN=grid, fs=series.rate_hz)[1])


def _sections_delay(sections: Array, grid: Array, series: Series) -> Array:
    delays = [signal.group_delay((row[:3], row[3:]), w=grid, fs=series.rate_hz)[1] for row in sections]
    return np.asarray(series.step_s * np.sum(delays, axis=0))


def _centred_response(taps: Array, grid: Array, series: Series) -> NDArray[np.complex128]:
    """Response of an odd number of taps, the middle one at the present sample."""
    response: NDArray[np.complex128] = signal.freqz(taps, worN=grid, fs=series.rate_hz)[1]
    return np.asarray(response * np.exp(2j * np.pi * grid * series.step_s * (len(taps) // 2)))


def _settling(sections: Array, series: Series) -> float:
    """Time (s) after which 1 % of the impulse response, summed by size, is still to come; at most the record."""
    impulse = np.zeros(len(series.values))
    impulse[0] = 1.0
    size = np.cumsum(np.abs(signal.sosfilt(sections, impulse)))
    return float(np.searchsorted(size, (1.0 - _SETTLED) * size[-1])) * series.step_s


def _causal_sentence(effect: FilterEffect, kind: FilterType, edges: Sequence[float]) -> str:
    # Stated well inside of the passband: an octave from the edge, or in the middle of the band.
    frequency = {
        FilterType.LOW: edges[0] / 2,
        FilterType.HIGH: edges[0] * 2,
        FilterType.BAND: math.sqrt(edges[0] * edges[-1]),
    }[kind]
    frequency = min(max(frequency, float(effect.frequency_hz[0])), float(effect.frequency_hz[-1]))
    place = int(np.argmin(np.abs(effect.frequency_hz - frequency)))
    phase = float(effect.phase_rad[place])
    shift = -phase / (2.0 * math.pi * frequency)
    way = (
        f"delays {frequency:.3g} Hz by {shift:.3g} s"
        if shift >= 0
        else f"brings {frequency:.3g} Hz {-shift:.3g} s early"
    )
    where = " and ".join(f"{edge:.3g}" for edge in edges)
    packets = float(effect.group_delay_s[place])
    return (
        f"{way} ({math.degrees(phase):.0f} deg; packets of such waves by {packets:.3g} s), "
        f"{decibel(math.sqrt(0.5))} at {where} Hz, begin distorted over {effect.distorted_ends_s[0]:.3g} s"
    )


def detrend(series: Series, degree: int) -> Filtered:
    """The signal less the polynomial of `degree` in time that fits it best (0: its mean, 1: a straight line).

    What it does to a wave depends on where in the record its crests are; the stated effect is the mean over all such
    places, the part of the wave that stays a wave of this frequency. It has no phase.

    Raises InputError: The degree is not from 0 to 10.
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


_FREQUENCIES = 400


@dataclass(frozen=True, eq=False)
class FilterEffect:
    """Frequency response of a filter, and where its ends are not to be believed.

    - `frequency_hz` (m,): Rising, from one period a record to below the Nyquist frequency.
    - `response` (m,): Output over input; a negative angle: the output comes later. Its unit is 1, or 1/s of a
      derivative.
    - `group_delay_s` (m,): Delay of a packet of waves about a frequency.
    - `distorted_ends_s`: Distorted time at the begin and at the end of the record.
    - `explanation`: The same in words.
    """

    frequency_hz: Array
    response: ComplexArray
    group_delay_s: Array
    distorted_ends_s: tuple[float, float]
    explanation: str

    @property
    def gain(self) -> Array:
        """Amplitude of the output over the amplitude of the input."""
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
    return np.asarray(np.geomspace(1.0 / series.duration_s, 0.499 * series.rate_hz, _FREQUENCIES))


def decibel(gain: float) -> str:
    """A gain in words: ``-6 dB``."""
    return f"{20.0 * math.log10(max(gain, 1e-10)):+.2g} dB"
