"""Result of ``signals``: statistics and spectra of the signals of trials, and a filter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.answer.charts.motion import columns_chart, measured_histories
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, table
from tank2sim.answer.result import Result
from tank2sim.apps.signals.charts import (
    autocorrelation_chart,
    cross_correlation_chart,
    density_chart,
    effect_chart,
    spectrum_chart,
    transfer_chart,
)
from tank2sim.apps.signals.study import FilterStudy, SignalsStudy, SignalStudy, Steering, TrialSignals
from tank2sim.notices import Notice
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.statistics import Stationary
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
        import pandas as pd

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
        return pd.DataFrame(rows)

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
        import pandas as pd

        varying = []
        for record in self.study.trials:
            for name, signal in _varying(record):
                if name == column and trial in (None, PurePath(record.trial).stem) and signal.spectrum:
                    keys = ("frequency_hz", "density", "low", "high")
                    return pd.DataFrame({key: getattr(signal.spectrum, key) for key in keys})
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
        varying = self._varying_signals
        steady = sum(map(_is_stationary, varying))
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
        steady = sum(map(_is_stationary, varying))
        figures = [KeyFigure(label="Stationary signals", value=f"{steady} of {len(varying)}")]
        correlations = [signal.autocorrelation for signal in varying if signal.autocorrelation]
        if correlations:
            time_s = max(one.correlation_time_s for one in correlations)
            count = min(one.effective_count for one in correlations)
            note = "of the slowest signal: the basis of its mean"
            figures.append(KeyFigure(label="Longest correlation time", value=float(f"{time_s:.3g}"), unit="s"))
            figures.append(KeyFigure(label="Independent samples, fewest", value=float(f"{count:.3g}"), note=note))
        steering = [trial.rudder_to_yaw_rate for trial in self.study.trials if trial.rudder_to_yaw_rate]
        if steering:
            lag_s = float(f"{steering[0].cross_correlation.lag_of_largest_s:.3g}")
            note = "lag of the largest correlation" + (" in the first trial" if len(self.study.trials) > 1 else "")
            figures.append(KeyFigure(label="Yaw rate after the rudder", value=lag_s, unit="s", note=note))
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


def _varying(trial: TrialSignals) -> list[tuple[str, SignalStudy]]:
    return [(name, signal) for name, signal in trial.columns.items() if not signal.constant]


def _is_stationary(signal: SignalStudy) -> bool:
    return signal.stationarity is not None and signal.stationarity.verdict is Stationary.YES


def _signal(column: str) -> SignalName:
    """The signal of a column of a trial file."""
    return SignalName(to_si(column, 1.0)[0])


def _filter_section(applied: FilterStudy) -> Section:
    runs = {"as measured": applied.before, applied.name: applied.after}
    title = f"{_signal(applied.column).words} before and after"
    response = effect_chart(applied.name, applied.effect, title=f"Effect of {applied.name}")
    drawn = [Illustration(chart=response, name="filter_response")]
    if chart := columns_chart(runs, title, measured=("as measured",), height_px=300):
        drawn.append(Illustration(chart=chart, name="filter_signal"))
    return Section(heading="Filter", text=f"{applied.sentence}.", charts=drawn)


def _trial_section(label: str, trial: TrialSignals) -> Section:
    charts = []
    if chart := measured_histories(trial.histories, title=f"Measured: {label}"):
        charts.append(Illustration(chart=chart, name=f"{label}_histories"))
    if trial.rudder_to_yaw_rate:
        charts += _steering_charts(label, trial.rudder_to_yaw_rate)
    return Section(heading=label, tables=[_statistics(label, trial)], charts=charts)


def _steering_charts(label: str, steering: Steering) -> list[Illustration]:
    rudder, rate = _signal(steering.rudder), _signal("r_degps")
    transfer = transfer_chart(rudder, rate, steering.transfer, title=f"From {rudder.words} to {rate.words}")
    title = f"Cross-correlation of {rudder.words} and {rate.words}"
    correlation = cross_correlation_chart(rudder, rate, steering.cross_correlation, title=title)
    return [
        Illustration(
            chart=transfer,
            name=f"{label}_transfer",
            caption="Gain and phase where the coherence is above chance, with 95 % intervals. In a zigzag the rudder "
            "follows the heading, and only a high coherence shows the ship's own response.",
        ),
        Illustration(
            chart=correlation,
            name=f"{label}_cross_correlation",
            caption="Red: the lag of the largest. Dotted: 95 % of the coefficients of two independent signals are "
            "smaller. Right: the yaw rate comes after the rudder.",
        ),
    ]


def _signals_section(label: str, trial: TrialSignals) -> Section:
    charts = [chart for name, signal in _varying(trial) for chart in _signal_charts(label, _signal(name), signal)]
    heading = f"Each signal of {label}"
    return Section(heading=heading, text=_HOW, charts=charts, tables=[_tests(label, trial)], folded=True)


def _signal_charts(label: str, name: SignalName, signal: SignalStudy) -> Iterator[Illustration]:
    """Density, autocorrelation and spectrum of a signal, side by side."""
    stem, subject = f"{label}_{name.stem}", name.words[:1].upper() + name.words[1:]
    if signal.probability_density:
        yield Illustration(
            chart=density_chart(name, signal.probability_density, title=f"{subject}: probability density"),
            caption="Kernel estimate next to the normal density of the same mean and standard deviation.",
            half=True,
            name=f"{stem}_density",
        )
    if signal.autocorrelation:
        yield Illustration(
            chart=autocorrelation_chart(name, signal.autocorrelation, title=f"{subject}: autocorrelation"),
            caption="Red: the correlation time.",
            half=True,
            name=f"{stem}_autocorrelation",
        )
    if signal.spectrum:
        yield Illustration(
            chart=spectrum_chart(name, signal.spectrum, title=f"{subject}: spectrum"),
            caption="The band is the 95 % confidence interval at each frequency.",
            half=True,
            name=f"{stem}_spectrum",
        )


def _statistics(label: str, trial: TrialSignals) -> Table:
    rows: list[list[Cell]] = []
    for name, signal in trial.columns.items():
        row: list[Cell] = [name, f"{signal.mean:.4g}", f"{signal.standard_deviation:.4g}"]
        if signal.autocorrelation and signal.stationarity and signal.normality and signal.spectrum:
            row += [signal.autocorrelation.correlation_time_s, signal.stationarity.verdict.value]
            row += [signal.normality.verdict, signal.spectrum.peak_in_words]
        else:
            row += [None, "constant", "-", "-"]
        rows.append(row)
    notes = []
    if any(signal.on_circle for signal in trial.columns.values()):
        notes.append("Mean and standard deviation of directions are on the circle, 0 to 360 deg.")
    notes.append("corr.: correlation time. normal: tested on samples two correlation times apart, number in brackets.")
    tested = [signal.stationarity for signal in trial.columns.values() if signal.stationarity]
    notes += dict.fromkeys(f"{found.verdict.value}: {found.meaning}" for found in tested)
    if trial.rudder_to_yaw_rate:
        notes.append(_steering_text(trial.rudder_to_yaw_rate))
    heads = ("column", "mean", "std", "corr. (s)", "stationarity", "normal", "peak (Hz)")
    return replace(table(label, heads, rows, *notes), wide=True)


def _steering_text(steering: Steering) -> str:
    correlation, transfer = steering.cross_correlation, steering.transfer
    return (
        f"{_signal(steering.rudder).words} to yaw rate: correlation {correlation.largest:.2f} at a lag of "
        f"{correlation.lag_of_largest_s:.3g} s; coherence above chance ({transfer.coherence_by_chance:.2f}) at "
        f"{int(transfer.sure.sum())} of {len(transfer.sure)} frequencies"
    )


def _tests(label: str, trial: TrialSignals) -> Table:
    heads: list[str | Column] = ["signal", Column(title="independent samples", digits=3)]
    heads += ["stationarity", "Dickey-Fuller p", "KPSS p", "normal", "least p", "skewness", "excess kurtosis"]
    rows: list[list[Cell]] = []
    for name, signal in _varying(trial):
        if signal.autocorrelation and signal.stationarity and signal.normality:
            level, normal = signal.stationarity.about_level, signal.normality
            tests: list[Cell] = [signal.stationarity.verdict.value, level.dickey_fuller, level.kpss, normal.verdict]
            shape: list[Cell] = [min(normal.p_values.values(), default=None), normal.skewness, normal.excess_kurtosis]
            rows.append([_signal(name).words, signal.autocorrelation.effective_count, *tests, *shape])
    return table(f"Tests of {label}", heads, rows, digits=2, on_screen=False)
