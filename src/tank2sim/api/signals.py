"""Statistics, spectra and filters of the signals of trials, as a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import PositiveArgument, checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.trial import TrialPaths, TrialRecord, trials_of
from tank2sim.arrays import Columns
from tank2sim.errors import InputError
from tank2sim.records.audit.study import MEASURED_SAMPLES
from tank2sim.records.signals.analysis import ColumnAnalysis, SignalSettings, Steering, TrialAnalysis, analyse
from tank2sim.records.signals.as_json import analysis_as_json, effect_as_json
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, HELD_COLUMNS, SignalName, file_columns, find_signal
from tank2sim.records.signals.effect import Filtered
from tank2sim.records.signals.requests import FilterRequest, parse_filter
from tank2sim.records.signals.sampling import Series, even_series
from tank2sim.records.signals.writing import thinned, with_filtered
from tank2sim.records.thinning import drawn_columns
from tank2sim.records.trials import Trial

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

_CORRELATION_NOTE = (
    "corr.: correlation time. normal: tested on samples two correlation times apart, their number in brackets."
)


@dataclass(frozen=True, eq=False)
class FilteredSignal:
    """A filter applied to a trial.

    Parameters
    ----------
    request : FilterRequest
    before : Series
        The (first) signal before, SI.
    after : Filtered
        The same signal after, and what the filter does to amplitude and phase.
    sentence : str
        What was filtered by what, in words.
    trial : Trial
        The trial with the filtered signals.
    """

    request: FilterRequest
    before: Series
    after: Filtered
    sentence: str
    trial: Trial


class SignalsResult(OldResult):
    """Statistics and spectra of the signals of trials, and a filter.

    Parameters
    ----------
    analyses : sequence of TrialAnalysis
        SI and radians.
    filtering : FilteredSignal, optional
    """

    command = "signals"

    def __init__(self, analyses: Sequence[TrialAnalysis], filtering: FilteredSignal | None = None) -> None:
        self.analyses, self.filtering = tuple(analyses), filtering
        notices = []
        for analysis in analyses:
            prefix = f"{analysis.trial.name}: " if len(analyses) > 1 else ""
            steering = analysis.steering.notices if analysis.steering else ()
            notices += [prefix + notice for notice in (*analysis.notices, *steering)]
        self.notices = tuple(notices)

    @property
    def statistics(self) -> pd.DataFrame:
        """A row each signal: trial, column, unit, mean, standard deviation, correlation time (s), tests, peak (Hz).

        Mean and standard deviation are in the unit of the column, of directions on the circle. Of a constant column
        all after the standard deviation is missing; ``peak_hz`` is missing where the spectrum has no peak.
        """
        import pandas as pd

        rows = []
        for trial, column in self._columns():
            name, found = SignalName(column.series.name), column.randomness
            row = [trial.name, name.file, name.unit, name.factor * column.mean, name.factor * column.standard_deviation]
            if found is None:
                rows.append([*row, None, None, None, None])
            else:
                peak = found.spectrum.peak
                tests = found.correlation.correlation_time_s, found.stationarity.verdict.value, found.normality.normal
                rows.append([*row, *tests, peak.frequency_hz if peak else None])
        heads = ["trial", "column", "unit", "mean", "standard_deviation", "correlation_time_s", "stationarity"]
        return pd.DataFrame(rows, columns=[*heads, "normal", "peak_hz"])

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

        for record, analysis in self._columns():
            name, found = SignalName(analysis.series.name), analysis.randomness
            if found and name.file == column and trial in (None, record.name):
                square = name.factor**2
                columns = {key: square * getattr(found.spectrum, key) for key in ("density", "low", "high")}
                return pd.DataFrame({"frequency_hz": found.spectrum.frequency_hz, **columns})
        varying = (SignalName(each.series.name).file for _, each in self._columns() if each.randomness)
        raise LookupError(f"no spectrum of {column}; there are: {', '.join(dict.fromkeys(varying))}")

    @property
    def filtered(self) -> TrialRecord | None:
        """The trial with the filtered signal; None without a filter."""
        return TrialRecord(self.filtering.trial) if self.filtering else None

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        content: dict[str, object] = {
            "trials": [analysis_as_json(each) | {"histories": _histories(each)} for each in self.analyses]
        }
        if done := self.filtering:
            column = SignalName(done.before.name).file
            content["filter"] = {
                "name": done.request.text,
                "column": column,
                "sentence": done.sentence,
                **effect_as_json(done.after.effect),
                "before": _history(done.before),
                "after": _history(done.after.series),
            }
        return content

    @property
    def headline(self) -> tuple[str, ...]:
        """The filter, if there is one."""
        return (self.filtering.sentence,) if self.filtering else ()

    @property
    def tables(self) -> tuple[Table, ...]:
        """Statistics, one table a trial."""
        return tuple(_table(analysis) for analysis in self.analyses)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Density, correlation and spectrum of each signal, rudder to yaw rate, and the filter, by file stem."""
        from tank2sim.report.signals.page import signals_charts

        return {"_".join(key): chart for key, chart in signals_charts(self.to_dict()).items()}

    def _columns(self) -> list[tuple[Trial, ColumnAnalysis]]:
        return [(analysis.trial, column) for analysis in self.analyses for column in analysis.columns]


@checked
def signals(
    trials: TrialPaths,
    columns: str | Sequence[str] = (),
    *,
    max_gap_s: PositiveArgument | None = None,
    segment_s: PositiveArgument | None = None,
    filter: str | None = None,
) -> SignalsResult:
    """Mean, spread, correlation time, stationarity, normality and spectra of the signals of trials.

    Parameters
    ----------
    trials : path, TrialRecord, or sequence of them
        A folder means the trials in it.
    columns : sequence of str
        Only these (``"r_degps"``); by default all.
    max_gap_s : float, optional
        Longest gap to bridge by straight lines, s; by default five steps.
    segment_s : float, optional
        Length of the spectral segments, s; by default eight segments, longer ones of slow signals.
    filter : str, optional
        A filter for the only column of the only trial, as on the command line: ``"lowpass:0.5"`` (Hz),
        ``"savgol:11,3"``; ``"decimate:5"`` thins the whole trial.

    Raises
    ------
    InputError
        A file is at fault, a column is missing or cannot be analysed, or the filter does not fit.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> file = tempfile.mkdtemp() + "/zigzag.csv"
    >>> text = t2s.load("mariner").zigzag(20, 20).to_csv(file)
    >>> found = t2s.signals(file, ["r_degps"], filter="lowpass:0.1")
    >>> list(found.statistics["column"])
    ['r_degps']
    >>> "r_degps" in found.filtered.df
    True
    """
    settings = SignalSettings(tuple([columns] if isinstance(columns, str) else columns), max_gap_s, segment_s)
    request = parse_filter(filter) if filter else None
    read = trials_of(trials)
    done = _filter(read, request, settings) if request else None
    return SignalsResult([analyse(trial, settings) for trial in read], done)


def _filter(trials: Sequence[Trial], request: FilterRequest, settings: SignalSettings) -> FilteredSignal:
    if len(trials) != 1:
        raise InputError("--filter", "", f"filters one trial, and {len(trials)} are given", "filter them one by one")
    trial = trials[0]
    if len(settings.columns) != 1 and not (request.thins and not settings.columns):
        remedy = "filter each column in a separate run; decimate takes no --column, for it thins the whole trial"
        raise InputError("--filter", "", "filters the one column named by --column", remedy)
    if request.thins:
        if settings.columns:
            raise InputError("--column", "", f"{request.text} thins the whole trial", "leave --column out")
        names = [name for name in trial.signals if name not in HELD_COLUMNS]
    else:
        names = [find_signal(settings.columns[0], trial)]
    before = [even_series(trial, name, settings.max_gap_s) for name in names]
    after = [request.apply(series) for series in before]
    what = "all columns but orders" if request.thins else SignalName(names[0]).file
    sentence = f"{what} filtered by {request.text}: {after[0].effect.sentence}"
    changed = thinned(trial, after, sentence) if request.thins else with_filtered(trial, after[0], sentence)
    return FilteredSignal(request, before[0], after[0], sentence, changed)


def _histories(analysis: TrialAnalysis) -> Columns:
    """The signals of a trial over time in the units of its columns, thinned to draw."""
    shown = {"t_s", *(SignalName(column.series.name).file for column in analysis.columns)}
    columns = {name: values for name, values in file_columns(analysis.trial).items() if name in shown}
    return drawn_columns(columns, MEASURED_SAMPLES, peaks=True)


def _history(series: Series) -> Columns:
    """A signal over time in the unit of its column, thinned to draw."""
    name = SignalName(series.name)
    return drawn_columns({"t_s": series.time_s, name.file: name.factor * series.values}, peaks=True)


def _table(analysis: TrialAnalysis) -> Table:
    notes = [_CORRELATION_NOTE]
    if any(column.series.name in DIRECTION_COLUMNS for column in analysis.columns):
        notes.insert(0, "mean and std of directions: on the circle, 0 to 360 deg.")
    verdicts = [column.randomness.stationarity.verdict for column in analysis.columns if column.randomness]
    notes += [f"{verdict}: {verdict.meaning}" for verdict in dict.fromkeys(verdicts)]
    if analysis.steering:
        notes.append(_steering_text(analysis.steering))
    columns = ("", "mean", "std", "corr. (s)", "stationarity", "normal", "peak (Hz)")
    return screen_table(analysis.trial.name, columns, [_row(column) for column in analysis.columns], tuple(notes))


def _row(column: ColumnAnalysis) -> list[object]:
    name = SignalName(column.series.name)
    row: list[object] = [name.file]
    row += [f"{name.factor * value:.4g}" for value in (column.mean, column.standard_deviation)]
    if (found := column.randomness) is None:
        return [*row, None, "constant", "-", "-"]
    peak = found.spectrum.peak_in_words
    return [*row, found.correlation.correlation_time_s, found.stationarity.verdict.value, found.normality.verdict, peak]


def _steering_text(steering: Steering) -> str:
    lag, coefficient = steering.correlation.largest
    sure = steering.transfer.sure
    return (
        f"{SignalName(steering.rudder).words} to yaw rate: correlation {coefficient:.2f} at a lag of {lag:.3g} s; "
        f"coherence above chance ({steering.transfer.significant:.2f}) at {int(sure.sum())} of {len(sure)} frequencies"
    )
