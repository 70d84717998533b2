"""Filters by name, as a user writes them: ``lowpass:0.5``, ``savgol:11,3``, ``detrend:1``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tank2sim.errors import ArgumentError, InputError
from tank2sim.records.signals.filtering import (
    Filtered,
    FilterType,
    butterworth,
    decimate,
    detrend,
    savitzky_golay,
    smoothing_spline,
)
from tank2sim.records.signals.sampling import Series

REQUEST_FORMS = (
    "lowpass:HZ, highpass:HZ, bandpass:HZ,HZ (each also with ,causal), savgol:SAMPLES,DEGREE, spline:HZ, "
    "detrend:DEGREE, decimate:FACTOR"
)
"""What may be asked for."""


@dataclass(frozen=True)
class FilterRequest:
    """A filter asked for by name.

    Parameters
    ----------
    text : str
        As it was written.
    apply : callable
        The filter.
    thins : bool
        True if it changes the times of the samples.
    """

    text: str
    apply: Callable[[Series], Filtered]
    thins: bool = False


def parse_filter(text: str) -> FilterRequest:
    """Read a filter's name and its numbers.

    Raises
    ------
    InputError
        The filter does not exist, or its numbers are not as many and of the kind that it takes.
    """
    kind, _, parameters = text.strip().partition(":")
    words = [word.strip() for word in parameters.split(",") if word.strip()]
    causal = bool(words) and words[-1] == "causal" and kind in set(FilterType)
    try:
        numbers = [float(word) for word in (words[:-1] if causal else words)]
        whole = [int(number) for number in numbers if number == int(number)]
    except (ValueError, OverflowError):
        raise _refusal(text) from None
    match kind, len(numbers), len(whole) == len(numbers):
        case ("lowpass" | "highpass", 1, _) | ("bandpass", 2, _):
            return FilterRequest(text, lambda series: butterworth(series, FilterType(kind), numbers, causal=causal))
        case "savgol", 2, True:
            return FilterRequest(text, lambda series: savitzky_golay(series, whole[0], whole[1]))
        case "spline", 1, _:
            return FilterRequest(text, lambda series: smoothing_spline(series, numbers[0]))
        case "detrend", 1, True:
            return FilterRequest(text, lambda series: detrend(series, whole[0]))
        case "decimate", 1, True:
            return FilterRequest(text, lambda series: decimate(series, whole[0]), thins=True)
    raise _refusal(text)


def _refusal(text: str) -> InputError:
    return ArgumentError("filter", "", f"{text!r} is not a filter", f"write one of {REQUEST_FORMS}")
