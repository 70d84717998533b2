"""All that is asked of the signals of one trial: group a of Krezelewski & Misiag, section 4.1."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arguments import numbers_in
from tank2sim.arrays import Columns, Number
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, SignalName, file_columns, find_signal
from tank2sim.records.signals.filtering import (
    Filtered,
    FilterEffect,
    FilterType,
    butterworth,
    decimate,
    detrend,
    savitzky_golay,
    smoothing_spline,
)
from tank2sim.records.signals.sampling import Series, even_series
from tank2sim.records.signals.spectra import Spectrum, Transfer, spectrum, transfer_function
from tank2sim.records.signals.statistics import (
    Autocorrelation,
    Correlation,
    Density,
    Normality,
    Stationarity,
    autocorrelation,
    cross_correlation,
    mean_and_deviation,
    normality,
    probability_density,
    stationarity,
)
from tank2sim.records.thinning import MEASURED_SAMPLES, drawn_columns
from tank2sim.records.trials import RUDDERS, Trial

_YAW_RATE = "r_radps"


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalStudy:
    """A signal in the unit of its column.

    Parameters
    ----------
    mean, standard_deviation : float
        Of directions on the circle.
    on_circle : bool
        Whether it is a direction.
    constant : bool
        A constant signal has none of the following.
    spectrum : Spectrum, optional
        In the square of the unit over Hz.
    """

    unit: str
    samples: int
    step_s: float
    mean: Number
    standard_deviation: Number
    on_circle: bool
    constant: bool
    autocorrelation: Autocorrelation | None = None
    stationarity: Stationarity | None = None
    normality: Normality | None = None
    probability_density: Density | None = None
    spectrum: Spectrum | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Steering:
    """How the yaw rate follows the rudder.

    Parameters
    ----------
    rudder : str
        Column taken for the rudder, angle before order.
    transfer : Transfer
        Yaw rate over rudder angle, 1/s.
    """

    rudder: str
    cross_correlation: Correlation
    transfer: Transfer
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialSignals:
    """The signals of one trial.

    Parameters
    ----------
    trial : str
        The file.
    columns : dict
        Signals by their columns in the trial format.
    rudder_to_yaw_rate : Steering or None
        None where one of both is missing or does not move.
    histories : dict
        The signals over time, thinned to draw.
    """

    trial: str
    columns: dict[str, SignalStudy]
    rudder_to_yaw_rate: Steering | None
    notices: tuple[Notice, ...]
    histories: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class FilterStudy:
    """A filter applied to a signal.

    Parameters
    ----------
    name : str
        The filter as it was asked for.
    column : str
        The (first) signal filtered.
    sentence : str
        The signal, the filter and its effect in words.
    before, after : dict
        The signal over time in the unit of its column, thinned to draw.
    """

    name: str
    column: str
    sentence: str
    effect: FilterEffect
    before: Columns
    after: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalsStudy:
    """Statistics and spectra of the signals of trials, and a filter."""

    trials: tuple[TrialSignals, ...]
    filter: FilterStudy | None = None


@dataclass(frozen=True)
class SignalSettings:
    """Columns to analyse (none: all), longest gap to bridge, and length of spectral segments."""

    columns: Sequence[str] = ()
    max_gap_s: float | None = None
    segment_s: float | None = None


def analyse(trial: Trial, settings: SignalSettings) -> TrialSignals:
    """Analyse the signals of a trial.

    InputError if a signal asked for by name cannot be analysed; of all signals, those that cannot are left out with a
    notice, and it is raised if none is left.
    """
    notices = list(trial.notices)
    series: dict[str, Series] = {}
    if settings.columns:
        for asked in settings.columns:
            name = find_signal(asked, trial)
            series[name] = even_series(trial, name, settings.max_gap_s)
    else:
        for name in trial.signals:
            try:
                series[name] = even_series(trial, name, settings.max_gap_s)
            except InputError as error:
                notices.append(Notice(f"{SignalName(name).file} is left out: it {error.problem}; {error.remedy}"))
        if not series:
            raise trial.fault("", "no signal of it can be analysed", notices[-1])
    notices += [notice for item in series.values() for notice in item.notices]
    whole = file_columns(trial)
    columns = {SignalName(name).file: _analysed(item, settings.segment_s) for name, item in series.items()}
    return TrialSignals(
        trial=str(trial.path),
        columns=columns,
        rudder_to_yaw_rate=_steering(series, settings.segment_s),
        notices=tuple(notices),
        histories=drawn_columns(
            {"t_s": whole["t_s"], **{name: whole[name] for name in columns}}, MEASURED_SAMPLES, peaks=True
        ),
    )


def filtered(text: str, sentence: str, before: Series, after: Filtered) -> FilterStudy:
    """Study of a filter by its text, the sentence on it, the signal before and after."""
    return FilterStudy(
        name=text,
        column=SignalName(before.name).file,
        sentence=sentence,
        effect=after.effect,
        before=_history(before),
        after=_history(after.series),
    )


def _history(series: Series) -> Columns:
    name = SignalName(series.name)
    return drawn_columns({"t_s": series.time_s, name.file: name.factor * series.values}, peaks=True)


def _analysed(series: Series, segment_s: float | None) -> SignalStudy:
    name = SignalName(series.name)
    mean, deviation = mean_and_deviation(series.name, series.values)
    found = SignalStudy(
        unit=name.unit,
        samples=len(series.values),
        step_s=series.step_s,
        mean=name.factor * mean,
        standard_deviation=name.factor * deviation,
        on_circle=series.name in DIRECTION_COLUMNS,
        constant=series.constant,
    )
    if series.constant:
        return found
    correlation = autocorrelation(series)
    return replace(
        found,
        autocorrelation=correlation,
        stationarity=stationarity(series, correlation).in_unit(name.factor),
        normality=normality(series, correlation),
        probability_density=probability_density(series).in_unit(name.factor),
        spectrum=spectrum(series, segment_s).in_unit(name.factor),
    )


def _steering(series: dict[str, Series], segment_s: float | None) -> Steering | None:
    rudder = next((name for name in RUDDERS if name in series and not series[name].constant), None)
    if rudder is None or _YAW_RATE not in series or series[_YAW_RATE].constant:
        return None
    source, result = series[rudder], series[_YAW_RATE]
    correlation = cross_correlation(source, result)
    transfer = transfer_function(source, result, segment_s)
    return Steering(
        rudder=SignalName(rudder).file,
        cross_correlation=correlation,
        transfer=transfer,
        notices=tuple(_cautions(correlation, transfer, source.step_s)),
    )


def _cautions(correlation: Correlation, transfer: Transfer, step_s: float) -> Iterator[Notice]:
    segment = transfer.averaging.samples_in_segment * step_s
    lag = correlation.lag_of_largest_s
    if abs(lag) > 0.1 * segment:
        yield Notice(
            f"the yaw rate is most like the rudder of {lag:.3g} s before, which is long for spectral segments of "
            f"{segment:.3g} s: gain and coherence come out low; a longer segment_s helps"
        )
    if not np.any(transfer.sure):
        yield Notice("no coherence of rudder and yaw rate is above chance: the transfer function says nothing")


REQUEST_FORMS = (
    "lowpass:HZ, highpass:HZ, bandpass:HZ,HZ (each also with ,causal), savgol:SAMPLES,DEGREE, spline:HZ, "
    "detrend:DEGREE, decimate:FACTOR"
)
"""Analyses that may be asked for."""


@dataclass(frozen=True)
class FilterRequest:
    """A filter asked for by name, as it was written; `thins` is True if it changes the times of the samples."""

    text: str
    apply: Callable[[Series], Filtered]
    thins: bool = False


def parse_filter(text: str) -> FilterRequest:
    """Read a filter's name and its numbers.

    InputError if the filter does not exist, or its numbers are not as many and of the kind that it takes.
    """
    kind, _, parameters = text.strip().partition(":")
    numbers, _, last = parameters.rpartition(",")
    causal = last.strip() == "causal" and kind in set(FilterType)
    count, whole, apply = _FILTERS.get(kind, (0, False, butterworth))
    given = numbers_in(numbers if causal else parameters, (count,))
    if not given or (whole and not all(number.is_integer() for number in given)):
        raise ArgumentError("filter", "", f"{text!r} is not a filter", f"write one of {REQUEST_FORMS}")
    if apply is butterworth:
        return FilterRequest(text, lambda series: butterworth(series, FilterType(kind), given, causal=causal))
    kept = [int(number) if whole else number for number in given]
    return FilterRequest(text, lambda series: apply(series, *kept), thins=apply is decimate)


_FILTERS: dict[str, tuple[int, bool, Callable[..., Filtered]]] = {
    "lowpass": (1, False, butterworth),
    "highpass": (1, False, butterworth),
    "bandpass": (2, False, butterworth),
    "savgol": (2, True, savitzky_golay),
    "spline": (1, False, smoothing_spline),
    "detrend": (1, True, detrend),
    "decimate": (1, True, decimate),
}
"""Filter to how many numbers it takes, whether they are whole, and its function."""
