"""Spectra with confidence limits, the main peak, and the transfer function from one signal to another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal, stats

from tank2sim.arrays import Array, ComplexArray, Mask
from tank2sim.errors import ArgumentError, InputError
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.sampling import Series, at_common_times
from tank2sim.records.signals.statistics import autocorrelation

CONFIDENCE = 0.95

_SEGMENTS = 8
"""Segments by default, each overlapping half of the next; project choice between scatter and resolution."""

# In a default segment: a first-order spectrum bends at 1/(2 pi correlation time), three steps (project choice)
_CORRELATION_TIMES = 20.0

_FEWEST_IN_SEGMENT = 10


@dataclass(frozen=True)
class Averaging:
    """How a record was cut into segments: Hann windows that overlap by half (Welch 1967).

    - `segments`: Number of segments.
    - `degrees_of_freedom`: Degrees of freedom of a spectrum's chi-square distribution: two a segment, less what their
      overlap shares.
    """

    samples_in_segment: int
    segments: int
    degrees_of_freedom: float


@dataclass(frozen=True)
class Peak:
    """The largest peak of a spectrum.

    - `frequency_hz`: Where it is, to within the distance of two frequencies of the spectrum.
    - `density`: Its height.
    - `distinct`: True if it rises above what surrounds it by more than scatter can (see :func:`spectrum`).
    - `at_lowest_frequency`: True if it is at the lowest frequency, where it cannot be distinguished from a slow drift.
    """

    frequency_hz: float
    density: float
    distinct: bool
    at_lowest_frequency: bool


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided power spectral density; its integral over frequency is the variance.

    - `frequency_hz` (m,): Above zero and below the Nyquist frequency, where the estimate would have half the degrees of
      freedom.
    - `density`, `low`, `high` (m,): The density (unit squared over Hz), and its 95 % confidence limits by chi-square at
      each frequency.
    - `peak`: None if the density only falls or only rises.
    - `peak_in_words`: Frequency of the main peak (Hz), and whether it is one.
    """

    frequency_hz: Array
    density: Array
    low: Array
    high: Array
    averaging: Averaging
    peak: Peak | None
    peak_in_words: str

    def in_unit(self, factor: float) -> Spectrum:
        """The spectrum of the signal times a factor."""
        square = factor**2
        return replace(
            self,
            density=square * self.density,
            low=square * self.low,
            high=square * self.high,
            peak=replace(self.peak, density=square * self.peak.density) if self.peak else None,
        )


@dataclass(frozen=True, eq=False)
class Transfer:
    """Linear response of one signal to another, estimated as cross spectrum over spectrum of the input.

    What the output has next to the response (noise, wind) does not bias it unless it comes back in the input: in a
    zigzag the rudder follows the heading, and the estimate holds where the coherence is high only.

    - `frequency_hz` (m,): As in :class:`Spectrum`.
    - `response` (m,): Output over input; a negative angle: the output comes later.
    - `coherence` (m,): Part of the output's power that is a linear response to the input, 0 to 1.
    - `error` (m,): Standard error of the gain over the gain, and of the phase in rad (Bendat & Piersol 2010, eq. 9.90
      and 9.91): sqrt(1 - coherence) / sqrt(coherence * degrees of freedom).
    - `cross_density` (m,): Cross spectral density, product of the units over Hz.
    - `coherence_by_chance`: Coherence that 95 % of estimates stay below where there is none.
    - `half_width_95` (m,): Half the 95 % interval of the gain's logarithm and of the phase (rad), by Student's t: the
      segments are few. It holds where the output mostly is the response: low coherences that are high by chance have
      gains that are high by chance.
    - `sure` (m,): Whether the coherence, its median over three neighbours, is above chance: one alone is above now and
      then.
    """

    frequency_hz: Array
    response: ComplexArray
    coherence: Array
    error: Array
    cross_density: ComplexArray
    coherence_by_chance: float
    half_width_95: Array
    sure: Mask
    averaging: Averaging

    @property
    def gain(self) -> Array:
        """Size of the response, output unit over input unit."""
        return np.abs(self.response)

    @property
    def phase_rad(self) -> Array:
        """Its angle, between -pi and pi: where there is no coherence nothing says how many turns it has made."""
        return np.angle(self.response)


def spectrum(series: Series, segment_s: float | None = None) -> Spectrum:
    """Welch's spectrum, the mean taken off each segment.

    A peak is called distinct if its lower confidence limit, at 5 % over all frequencies together, is above the
    surroundings: the geometric mean of the medians over the octave below and the octave above, which on a spectrum
    that is any power of the frequency is the spectrum itself.

    `series`: What to analyse; `segment_s`: Length of a segment; by default eight of them cover the record, or
    twenty correlation times if these are longer, but at most half the record.

    Raises InputError: The segment is shorter than ten samples or longer than half the record.
    """
    averaging = _averaging([series], segment_s)
    frequency, density = signal.welch(series.values, **_options(series, averaging))
    inner = _inner(averaging)
    tail = (1.0 - CONFIDENCE) / 2.0
    freedom = averaging.degrees_of_freedom
    low, high = (freedom / stats.chi2.ppf(p, freedom) for p in (1.0 - tail, tail))
    peak = _peak(frequency[inner], density[inner], freedom)
    return Spectrum(
        frequency_hz=frequency[inner],
        density=density[inner],
        low=low * density[inner],
        high=high * density[inner],
        averaging=averaging,
        peak=peak,
        peak_in_words=_in_words(peak),
    )


def _in_words(peak: Peak | None) -> str:
    if peak is None:
        return "none"
    if peak.at_lowest_frequency:
        return f"{peak.frequency_hz:.3g} or below"
    return f"{peak.frequency_hz:.3g}" + ("" if peak.distinct else ", not distinct")


def transfer_function(source: Series, result: Series, segment_s: float | None = None) -> Transfer:
    """Transfer function from `source` to `result` of one trial; segments and errors as of :func:`spectrum`."""
    source, result = at_common_times(source, result)
    averaging = _averaging([source, result], segment_s)
    if averaging.segments < 2:
        problem = "is the only segment, and one segment has a coherence of 1 whatever the signals"
        raise InputError(source.source, "segment", problem, "give a shorter segment_s")
    options = _options(source, averaging)
    inner = _inner(averaging)
    frequency, power = signal.welch(source.values, **options)
    _, cross = signal.csd(source.values, result.values, **options)
    _, coherence = signal.coherence(source.values, result.values, **options)
    names = " and ".join(SignalName(item.name).file for item in (source, result))
    if not np.all(power[inner] > 0):
        raise InputError(source.source, f"columns {names}", "have no power at some frequency", "leave them out")
    kept = np.clip(coherence[inner], 1e-12, 1.0)
    error = np.sqrt((1.0 - kept) / (kept * averaging.degrees_of_freedom))
    # Of n independent averages the coherence of nothing exceeds c with probability (1 - c)^(n - 1) (Goodman 1957).
    significant = 1.0 - (1.0 - CONFIDENCE) ** (1.0 / (averaging.degrees_of_freedom / 2.0 - 1.0))
    return Transfer(
        frequency_hz=frequency[inner],
        response=cross[inner] / power[inner],
        coherence=kept,
        error=error,
        cross_density=cross[inner],
        coherence_by_chance=significant,
        half_width_95=error * stats.t.ppf((1.0 + CONFIDENCE) / 2.0, max(averaging.degrees_of_freedom - 2.0, 1.0)),
        sure=signal.medfilt(kept, 3) > significant,
        averaging=averaging,
    )


def _averaging(signals: Sequence[Series], segment_s: float | None) -> Averaging:
    """How signals of the same times are cut."""
    series = signals[0]
    count = len(series.values)
    if segment_s is None:
        slowest = max(autocorrelation(item).correlation_time_s for item in signals)
        # Segments of n samples that begin every n/2: (segments + 1) n/2 samples.
        samples = min(
            count // 2, max(2 * count // (_SEGMENTS + 1), round(_CORRELATION_TIMES * slowest / series.step_s))
        )
    else:
        samples = round(segment_s / series.step_s)
    if not _FEWEST_IN_SEGMENT <= samples <= count // 2:
        allowed = f"{_FEWEST_IN_SEGMENT * series.step_s:.4g} to {count // 2 * series.step_s:.4g} s"
        problem = f"{samples * series.step_s:.4g} s is not a length of a segment of {series.source}"
        raise ArgumentError("segment_s", "", problem, f"give {allowed}")
    hop = samples - samples // 2
    segments = (count - samples) // hop + 1
    window = signal.get_window("hann", samples)
    shared = 0.0
    # Welch 1967: variance of the mean of segments, of which the j-th next shares a part of the window.
    for later in range(1, min(segments, -(-samples // hop))):
        part = float(window[: samples - later * hop] @ window[later * hop :]) / float(window @ window)
        shared += 2.0 * (segments - later) / segments * part**2
    return Averaging(samples, segments, 2.0 * segments / (1.0 + shared))


def _options(series: Series, averaging: Averaging) -> dict[str, object]:
    samples = averaging.samples_in_segment
    return {
        "fs": series.rate_hz, "window": "hann", "nperseg": samples, "noverlap": samples // 2, "detrend": "constant",
    }  # fmt: skip


def _inner(averaging: Averaging) -> slice:
    """Frequencies except for zero and, of an even number of samples, Nyquist."""
    samples = averaging.samples_in_segment
    return slice(1, samples // 2 if samples % 2 == 0 else samples // 2 + 1)


def _peak(frequency: Array, density: Array, freedom: float) -> Peak | None:
    # With zero on both sides the ends can be peaks; the last frequency is none of interest.
    places = [place - 1 for place in signal.find_peaks(np.concatenate([[0.0], density]))[0]]
    if not places:
        return None
    place = max(places, key=lambda item: float(density[item]))
    top = float(frequency[place])
    below = density[(frequency >= top / 2) & (frequency < top)]
    above = density[(frequency > top) & (frequency <= 2 * top)]
    lowest = bool(place == 0)
    distinct = False
    if not lowest and above.size:
        # The median of a chi-square variable is below its mean.
        around = float(np.sqrt(np.median(below) * np.median(above))) * freedom / stats.chi2.median(freedom)
        sure = freedom / stats.chi2.ppf(1.0 - (1.0 - CONFIDENCE) / len(frequency), freedom)
        distinct = bool(sure * density[place] > around)
    return Peak(top, float(density[place]), distinct, lowest)
