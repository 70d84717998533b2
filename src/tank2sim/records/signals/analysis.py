"""All that is asked of the signals of one trial: group a of Krezelewski & Misiag, section 4.1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.errors import InputError
from tank2sim.records.signals.columns import SignalName, find_signal
from tank2sim.records.signals.correlation import Autocorrelation, Correlation, autocorrelation, cross_correlation
from tank2sim.records.signals.sampling import Series, even_series
from tank2sim.records.signals.spectra import Spectrum, Transfer, spectrum, transfer_function
from tank2sim.records.signals.statistics import (
    Density,
    Normality,
    Stationarity,
    mean_and_deviation,
    normality,
    probability_density,
    stationarity,
)
from tank2sim.records.trials import RUDDERS, Trial

_YAW_RATE = "r_radps"


@dataclass(frozen=True, eq=False)
class Randomness:
    """What is known of a signal that varies; see the functions of the same names."""

    correlation: Autocorrelation
    stationarity: Stationarity
    normality: Normality
    density: Density
    spectrum: Spectrum


@dataclass(frozen=True, eq=False)
class ColumnAnalysis:
    """One signal: its values, their mean and standard deviation in SI, and the rest if it is not constant."""

    series: Series
    randomness: Randomness | None

    @property
    def mean(self) -> float:
        """Mean value, SI; of a direction that on the circle."""
        return mean_and_deviation(self.series.name, self.series.values)[0]

    @property
    def standard_deviation(self) -> float:
        """Root of the mean square about the mean, SI; of a direction that on the circle."""
        return mean_and_deviation(self.series.name, self.series.values)[1]


@dataclass(frozen=True, eq=False)
class Steering:
    """How the yaw rate follows the rudder: `rudder` is the signal taken for it, angle before order."""

    rudder: str
    correlation: Correlation
    transfer: Transfer
    notices: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class TrialAnalysis:
    """The signals of one trial, and rudder to yaw rate where both are there and move."""

    trial: Trial
    columns: tuple[ColumnAnalysis, ...]
    steering: Steering | None
    notices: tuple[str, ...]


@dataclass(frozen=True)
class SignalSettings:
    """What a user chooses: the columns (none: all), the longest gap to bridge, the length of spectral segments."""

    columns: Sequence[str] = ()
    max_gap_s: float | None = None
    segment_s: float | None = None


def analyse(trial: Trial, settings: SignalSettings) -> TrialAnalysis:
    """Analyse the signals of a trial.

    Raises
    ------
    InputError
        A signal asked for by name cannot be analysed; of all signals, those that cannot are left out with a notice,
        and it is raised if none is left.
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
                notices.append(f"{SignalName(name).file} is left out: it {error.problem}; {error.remedy}")
        if not series:
            raise InputError(trial.path, "", "no signal of it can be analysed", notices[-1])
    columns = tuple(_analysed(item, settings.segment_s) for item in series.values())
    notices += [notice for item in series.values() for notice in item.notices]
    return TrialAnalysis(trial, columns, _steering(series, settings.segment_s), tuple(notices))


def _analysed(series: Series, segment_s: float | None) -> ColumnAnalysis:
    if series.constant:
        return ColumnAnalysis(series, None)
    correlation = autocorrelation(series)
    return ColumnAnalysis(
        series,
        Randomness(
            correlation,
            stationarity(series, correlation),
            normality(series, correlation),
            probability_density(series),
            spectrum(series, segment_s),
        ),
    )


def _steering(series: dict[str, Series], segment_s: float | None) -> Steering | None:
    rudder = next((name for name in RUDDERS if name in series and not series[name].constant), None)
    if rudder is None or _YAW_RATE not in series or series[_YAW_RATE].constant:
        return None
    source, result = series[rudder], series[_YAW_RATE]
    correlation = cross_correlation(source, result)
    transfer = transfer_function(source, result, segment_s)
    return Steering(rudder, correlation, transfer, _cautions(correlation, transfer, source.step_s))


def _cautions(correlation: Correlation, transfer: Transfer, step_s: float) -> tuple[str, ...]:
    messages = []
    segment = transfer.averaging.samples * step_s
    lag = correlation.largest[0]
    if abs(lag) > 0.1 * segment:
        messages.append(
            f"the yaw rate is most like the rudder of {lag:.3g} s before, which is long for spectral segments of "
            f"{segment:.3g} s: gain and coherence come out low; a longer --segment helps"
        )
    if not np.any(transfer.sure):
        messages.append("no coherence of rudder and yaw rate is above chance: the transfer function says nothing")
    return tuple(messages)
