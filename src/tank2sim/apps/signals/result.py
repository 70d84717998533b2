"""Result of ``signals``: statistics and spectra of the signals of trials, and a filter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.motion import columns_chart
from tank2sim.answer.charts.parts import LINE_SAMPLES, POINT_SAMPLES, with_unit
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis, Rule
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.apps.signals.study import FilterStudy, SignalsStudy, SignalStudy, Steering, TrialSignals
from tank2sim.arrays import Array
from tank2sim.notices import Notice
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.filtering import FilterEffect
from tank2sim.records.signals.spectra import Spectrum, Transfer
from tank2sim.records.signals.statistics import Autocorrelation, Correlation, Density, Stationary
from tank2sim.records.thinning import thin_line, thin_points
from tank2sim.units import to_si

if TYPE_CHECKING:
    import pandas as pd


_HOW = (
    "Mean and standard deviation of directions are those on the circle. Stationarity: augmented Dickey-Fuller and "
    "KPSS tests, whose null hypotheses are opposite, at 5 %. Normality is tested on samples two correlation times "
    "apart (their number in brackets): neighbours repeat each other, and all samples together make the tests reject a "
    "normal signal. Spectra: Welch, Hann windows that overlap by half; 95 % limits by chi-square with the effective "
    "degrees of freedom."
)


@dataclass(frozen=True, eq=False, repr=False)
class SignalsResult(Result[SignalsStudy]):
    """Statistics and spectra of the signals of trials, and a filter.

    Parameters
    ----------
    study : SignalsStudy
    filtered : TrialRecord, optional
        The trial with the filtered signal; None without a filter, or if the result was read from its JSON.
    """

    study: SignalsStudy
    filtered: Any | None = None
    command: ClassVar[str] = "signals"

    @property
    def statistics(self) -> pd.DataFrame:
        """A row each signal: trial, column, unit, mean, standard deviation, correlation time (s), tests, peak (Hz).

        Mean and standard deviation are in the unit of the column, of directions on the circle. A constant column has
        nothing after the standard deviation; ``peak_hz`` is missing where the spectrum has no peak.
        """
        rows = [
            {
                "trial": PurePath(trial.trial).stem,
                "column": name,
                "unit": column.unit,
                "mean": column.mean,
                "standard_deviation": column.standard_deviation,
                "correlation_time_s": column.autocorrelation.correlation_time_s if column.autocorrelation else None,
                "stationarity": column.stationarity.verdict.value if column.stationarity else None,
                "normal": column.normality.normal if column.normality else None,
                "peak_hz": column.spectrum.peak.frequency_hz if column.spectrum and column.spectrum.peak else None,
            }
            for trial in self.study.trials
            for name, column in trial.columns.items()
        ]
        return data_frame(rows)

    def spectrum(self, column: str, trial: str | None = None) -> pd.DataFrame:
        """One-sided power spectral density of a column: ``frequency_hz``, ``density`` and its 95 % limits (per Hz).

        Parameters
        ----------
        column : str
            Name in the trial file: ``r_degps``; the density is then in (deg/s)^2/Hz.
        trial : str, optional
            Name of the trial; by default the first that has the column.

        Raises
        ------
        LookupError
            No signal that varies has this name.
        """
        varying = []
        for record in self.study.trials:
            for name, signal in _varying(record):
                if name == column and trial in (None, PurePath(record.trial).stem) and signal.spectrum:
                    keys = ("frequency_hz", "density", "low", "high")
                    return data_frame({key: getattr(signal.spectrum, key) for key in keys})
                varying.append(name)
        raise LookupError(f"no spectrum of {column}; there are: {', '.join(dict.fromkeys(varying))}")

    @property
    def title(self) -> str:
        """The trial, or how many there are."""
        trials = self.study.trials
        return f"Signals of {self._labels[0]}" if len(trials) == 1 else f"Signals of {len(trials)} trials"

    @property
    def subtitle(self) -> str:
        """The kind of analysis."""
        return "Statistics and spectra of measured signals"

    @property
    def headline(self) -> tuple[str, ...]:
        """The filter, if there is one, and how many signals are stationary."""
        filtered = (self.study.filter.sentence,) if self.study.filter else ()
        steady, varying = self._steady, self._varying_signals
        if not varying:
            return (*filtered, "No signal varies.")
        if steady == len(varying):
            return (*filtered, "All signals that vary are stationary: their means and spectra describe the record.")
        return (
            *filtered,
            f"{steady} of {len(varying)} signals that vary are stationary. Mean and spectrum of the others say little: "
            "they drift over the record, as in a manoeuvre.",
        )

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Changes made to the signals, and limits of their analysis."""
        notices: list[Notice] = []
        for label, trial in zip(self._labels, self.study.trials, strict=True):
            steering = trial.rudder_to_yaw_rate.notices if trial.rudder_to_yaw_rate else ()
            said = (*trial.notices, *steering)
            notices += [notice.of(label) for notice in said] if len(self.study.trials) > 1 else said
        return tuple(notices)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Stationary signals, the slowest of them, and the lag of the yaw rate."""
        varying = self._varying_signals
        figures = [KeyFigure("Stationary signals", f"{self._steady} of {len(varying)}")]
        correlations = [signal.autocorrelation for signal in varying if signal.autocorrelation]
        if correlations:
            time_s = max(one.correlation_time_s for one in correlations)
            count = min(one.effective_count for one in correlations)
            note = "of the slowest signal: the basis of its mean"
            figures.append(KeyFigure("Longest correlation time", float(f"{time_s:.3g}"), "s"))
            figures.append(KeyFigure("Independent samples, fewest", float(f"{count:.3g}"), note=note))
        steering = [trial.rudder_to_yaw_rate for trial in self.study.trials if trial.rudder_to_yaw_rate]
        if steering:
            lag_s = float(f"{steering[0].cross_correlation.lag_of_largest_s:.3g}")
            note = "lag of the largest correlation" + (" in the first trial" if len(self.study.trials) > 1 else "")
            figures.append(KeyFigure("Yaw rate after the rudder", lag_s, "s", note=note))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """The filter, each trial, and each of its signals."""
        trials = list(zip(self._labels, self.study.trials, strict=True))
        return [
            *([_filter_section(self.study.filter)] if self.study.filter else []),
            *(_trial_section(label, trial) for label, trial in trials),
            *(_signals_section(label, trial) for label, trial in trials),
        ]

    @property
    def _labels(self) -> list[str]:
        """Names of the trials, numbered where files of several folders have one name."""
        names = [PurePath(trial.trial).stem for trial in self.study.trials]
        return [
            name if names.count(name) == 1 else f"{name}_{names[: place + 1].count(name)}"
            for place, name in enumerate(names)
        ]

    @property
    def _varying_signals(self) -> list[SignalStudy]:
        return [signal for trial in self.study.trials for _, signal in _varying(trial)]

    @property
    def _steady(self) -> int:
        """Number of stationary signals."""
        tests = [signal.stationarity for signal in self._varying_signals if signal.stationarity]
        return sum(test.verdict is Stationary.YES for test in tests)


def _varying(trial: TrialSignals) -> list[tuple[str, SignalStudy]]:
    return [(name, signal) for name, signal in trial.columns.items() if not signal.constant]


def _signal(column: str) -> SignalName:
    """The signal of a column of a trial file."""
    return SignalName(to_si(column, 1.0)[0])


def _filter_section(applied: FilterStudy) -> Section:
    runs = {"as measured": applied.before, applied.name: applied.after}
    title = f"{_signal(applied.column).words} before and after"
    response = effect_chart(applied.name, applied.effect)
    drawn = [Illustration(response, name="filter_response")]
    if chart := columns_chart(runs, title, measured=("as measured",), height_px=300):
        drawn.append(Illustration(chart, name="filter_signal"))
    return Section("Filter", text=f"{applied.sentence}.", charts=drawn)


def _trial_section(label: str, trial: TrialSignals) -> Section:
    charts = []
    if chart := columns_chart({"measured": trial.histories}, title=f"Measured: {label}"):
        charts.append(Illustration(chart, name=f"{label}_histories"))
    if trial.rudder_to_yaw_rate:
        charts += _steering_charts(label, trial.rudder_to_yaw_rate)
    return Section(label, tables=[_statistics(label, trial)], charts=charts)


def _steering_charts(label: str, steering: Steering) -> list[Illustration]:
    rudder, rate = _signal(steering.rudder), _signal("r_degps")
    transfer = transfer_chart(rudder, rate, steering.transfer)
    correlation = cross_correlation_chart(rudder, rate, steering.cross_correlation)
    return [
        Illustration(
            transfer,
            name=f"{label}_transfer",
            caption="Gain and phase where the coherence is above chance, with 95 % intervals. In a zigzag the rudder "
            "follows the heading, and only a high coherence shows the ship's own response.",
        ),
        Illustration(
            correlation,
            name=f"{label}_cross_correlation",
            caption="Red: the lag of the largest. Dotted: 95 % of the coefficients of two independent signals are "
            "smaller. Right: the yaw rate comes after the rudder.",
        ),
    ]


def _signals_section(label: str, trial: TrialSignals) -> Section:
    charts = [chart for name, signal in _varying(trial) for chart in _signal_charts(label, _signal(name), signal)]
    heading = f"Each signal of {label}"
    return Section(heading, text=_HOW, charts=charts, tables=[_tests(label, trial)], folded=True)


def _signal_charts(label: str, name: SignalName, signal: SignalStudy) -> Iterator[Illustration]:
    """Density, autocorrelation and spectrum of a signal, side by side."""
    described = {
        "density": "Kernel estimate next to the normal density of the same mean and standard deviation.",
        "autocorrelation": "Red: the correlation time.",
        "spectrum": "The band is the 95 % confidence interval at each frequency.",
    }
    charts = {
        "density": signal.probability_density and density_chart(name, signal.probability_density),
        "autocorrelation": signal.autocorrelation and autocorrelation_chart(name, signal.autocorrelation),
        "spectrum": signal.spectrum and spectrum_chart(name, signal.spectrum),
    }
    for kind, chart in charts.items():
        if chart:
            yield Illustration(chart, caption=described[kind], half=True, name=f"{label}_{name.stem}_{kind}")


def _statistics(label: str, trial: TrialSignals) -> Table:
    rows = [_statistics_row(name, signal) for name, signal in trial.columns.items()]
    tested = [signal.stationarity for signal in trial.columns.values() if signal.stationarity]
    circle = any(signal.on_circle for signal in trial.columns.values())
    notes = [
        *(["Mean and standard deviation of directions are on the circle, 0 to 360 deg."] if circle else []),
        "corr.: correlation time. normal: tested on samples two correlation times apart, number in brackets.",
        *dict.fromkeys(f"{found.verdict.value}: {found.meaning}" for found in tested),
        *([_steering_text(trial.rudder_to_yaw_rate)] if trial.rudder_to_yaw_rate else []),
    ]
    heads = ("column", "mean", "std", "corr. (s)", "stationarity", "normal", "peak (Hz)")
    return replace(table(label, heads, rows, *notes), wide=True)


def _statistics_row(name: str, signal: SignalStudy) -> list[Cell]:
    row: list[Cell] = [name, f"{signal.mean:.4g}", f"{signal.standard_deviation:.4g}"]
    if signal.autocorrelation and signal.stationarity and signal.normality and signal.spectrum:
        row += [signal.autocorrelation.correlation_time_s, signal.stationarity.verdict.value]
        return [*row, signal.normality.verdict, signal.spectrum.peak_in_words]
    return [*row, None, "constant", "-", "-"]


def _steering_text(steering: Steering) -> str:
    correlation, transfer = steering.cross_correlation, steering.transfer
    return (
        f"{_signal(steering.rudder).words} to yaw rate: correlation {correlation.largest:.2f} at a lag of "
        f"{correlation.lag_of_largest_s:.3g} s; coherence above chance ({transfer.coherence_by_chance:.2f}) at "
        f"{int(transfer.sure.sum())} of {len(transfer.sure)} frequencies"
    )


def _tests(label: str, trial: TrialSignals) -> Table:
    heads: list[str | Column] = ["signal", Column("independent samples", digits=3)]
    heads += ["stationarity", "Dickey-Fuller p", "KPSS p", "normal", "least p", "skewness", "excess kurtosis"]
    rows: list[list[Cell]] = []
    for name, signal in _varying(trial):
        if signal.autocorrelation and signal.stationarity and signal.normality:
            level, normal = signal.stationarity.about_level, signal.normality
            tests: list[Cell] = [signal.stationarity.verdict.value, level.dickey_fuller, level.kpss, normal.verdict]
            shape: list[Cell] = [min(normal.p_values.values(), default=None), normal.skewness, normal.excess_kurtosis]
            rows.append([_signal(name).words, signal.autocorrelation.effective_count, *tests, *shape])
    return table(f"Tests of {label}", heads, rows, digits=2, on_screen=False)


_LEAST_DECIBEL = -120.0
_PHASE = "phase (deg), below zero: later"
_DOTTED = (2, 3)


def _subject(name: SignalName) -> str:
    return name.words[:1].upper() + name.words[1:]


def density_chart(name: SignalName, density: Density) -> ChartSpec:
    """Probability density of a signal next to the normal one."""
    curves = {"estimated": density.density, "normal": density.normal}
    series = [PlotSeries(label, x=density.values, y=curve) for label, curve in curves.items()]
    up = PlotAxis(with_unit("probability density", f"1/({name.unit})"), zero=True)
    across = PlotAxis(with_unit(name.words, name.unit), nice=False)
    return curve_chart(Plot(series, up=up), across, title=f"{_subject(name)}: probability density")


def autocorrelation_chart(name: SignalName, found: Autocorrelation) -> ChartSpec:
    """Autocorrelation against the lag, the correlation time marked."""
    title, label = f"{_subject(name)}: autocorrelation", f"{name.words} with itself"
    described = f"Autocorrelation of {name.words}; the upright line is the correlation time."
    return _correlation(found, label, ([0.0], found.correlation_time_s), title, described)


def cross_correlation_chart(first: SignalName, second: SignalName, found: Correlation) -> ChartSpec:
    """Cross-correlation against the lag, with its largest value and the bound of two independent signals."""
    bound, title = found.bound_if_independent, f"Cross-correlation of {first.words} and {second.words}"
    described = f"Correlation of {second.words} with {first.words} against the lag."
    label = f"{second.words} after {first.words}"
    return _correlation(found, label, ([-bound, 0.0, bound], found.lag_of_largest_s), title, described)


def _correlation(
    found: Autocorrelation | Correlation, label: str, marks: tuple[Sequence[float], float], title: str, described: str
) -> ChartSpec:
    """Coefficients against the lag, with levels and a lag (s) that are marked."""
    levels, lag_s = marks
    rules = [Rule(levels, dash=_DOTTED), Rule([lag_s], upright=True, style="limit", dash=_DOTTED)]
    series = [PlotSeries(label, x=found.lag_s, y=found.coefficient)]
    up = PlotAxis("correlation coefficient", domain=(-1.0, 1.0))
    across = PlotAxis("lag (s)", nice=False)
    return curve_chart(Plot(series, up=up, rules=rules), across, title=title, described=described)


def spectrum_chart(name: SignalName, spectrum: Spectrum) -> ChartSpec:
    """Power spectral density with its 95 % confidence band, both axes logarithmic."""
    kept = thin_line([np.log10(np.maximum(spectrum.density, np.finfo(float).tiny))], LINE_SAMPLES)
    kept = kept[spectrum.low[kept] > 0]  # what is exactly zero has no place on a logarithmic scale
    series = PlotSeries(
        name.words,
        x=spectrum.frequency_hz[kept],
        y=spectrum.density[kept],
        low=spectrum.low[kept],
        high=spectrum.high[kept],
    )
    up = PlotAxis(f"power density (({name.unit})²/Hz)", log=True, form=".0e", ticks=8)
    return curve_chart(
        Plot([series], up=up),
        PlotAxis("frequency (Hz)", log=True, nice=False, form="~g"),
        title=f"{_subject(name)}: spectrum",
        described=f"Power spectral density of {name.words} with its 95 % confidence band.",
    )


def transfer_chart(source: SignalName, result: SignalName, transfer: Transfer) -> ChartSpec:
    """Gain (1/s), phase and coherence against frequency; gain and phase with 95 % intervals, where coherence is
    above chance."""
    frequency, gain, phase, coherence = transfer.frequency_hz, transfer.gain, transfer.phase_rad, transfer.coherence
    sure = np.flatnonzero(transfer.sure)
    kept = sure[thin_points([np.log10(gain[sure]), phase[sure]], POINT_SAMPLES)]
    # A wider interval than a whole gain only stretches the axis.
    error = np.minimum(transfer.half_width_95[kept], 1.0)
    gain, phase, half = gain[kept], np.rad2deg(phase[kept]), np.rad2deg(error)
    label = f"{source.words} to {result.words}"

    def points(values: Array, low: Array, high: Array) -> list[PlotSeries]:
        return [PlotSeries(label, x=frequency[kept], y=values, low=low, high=high, points=True)]

    plots = [
        Plot(
            points(gain, gain * np.exp(-error), gain * np.exp(error)),
            up=PlotAxis(with_unit("gain", "1/s"), log=True, form="~g"),
            height_px=150,
        ),
        Plot(
            points(phase, phase - half, phase + half),
            up=PlotAxis(_PHASE, domain=(-180.0, 180.0), ticks=[-180, -90, 0, 90, 180]),
            height_px=150,
        ),
        Plot(
            [PlotSeries(label, x=frequency, y=coherence)],
            up=PlotAxis("coherence; dotted: by chance", domain=(0.0, 1.0)),
            height_px=150,
            rules=[Rule([transfer.coherence_by_chance], style="limit", dash=_DOTTED)],
        ),
    ]
    described = f"Transfer function from {label}: gain and phase with 95 % intervals, and coherence."
    return curve_panels(
        plots, _frequency(frequency), title=f"From {source.words} to {result.words}", described=described
    )


def effect_chart(label: str, effect: FilterEffect) -> ChartSpec:
    """Gain (dB), phase (deg) and group delay (s) of the filter `label` against frequency."""
    frequency, gain, phase, delay = effect.frequency_hz, effect.gain, effect.phase_rad, effect.group_delay_s
    decibel = np.maximum(20.0 * np.log10(np.maximum(gain, 1e-30)), _LEAST_DECIBEL)
    # Where nothing passes, the phase is rounding.
    phase = np.where(decibel > _LEAST_DECIBEL, np.rad2deg(phase), np.nan)
    plots = [
        Plot([PlotSeries(label, x=frequency, y=curve)], up=PlotAxis(up), height_px=130)
        for up, curve in {"gain (dB)": decibel, _PHASE: phase, "group delay (s)": delay}.items()
    ]
    described = f"Gain, phase and group delay of {label}."
    return curve_panels(plots, _frequency(frequency), title=f"Effect of {label}", described=described)


def _frequency(values: Array) -> PlotAxis:
    span = float(values[0]), float(values[-1])
    return PlotAxis("frequency (Hz)", log=True, domain=span, nice=False, form="~g")
