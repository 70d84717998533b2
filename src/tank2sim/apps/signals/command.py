"""Statistics, spectra and filters of the signals of trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.errors import ArgumentError
from tank2sim.files import TABLE
from tank2sim.quantities import GapLength

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.apps.signals.result import SignalsResult
    from tank2sim.apps.signals.study import FilterRequest, FilterStudy, SignalSettings
    from tank2sim.records.trials import Trial


def _written(result: SignalsResult, path: Path) -> dict[Path, str | bytes]:
    if result.filtered is None:
        raise ArgumentError("output", "", "needs a filter", 'say which, such as filter="lowpass:0.5"')
    return {path: result.filtered.to_csv()}


def _unwritten(result: SignalsResult) -> str:
    return "" if result.filtered is None else "the filtered trial is not written: add -o FILTERED.csv"


@verb(
    "statistics, spectra and filters of a record",
    Output("-o", TABLE, "Write the trial with the filtered column.", _written, "FILTERED.csv", unwritten=_unwritten),
    results=("tank2sim.apps.signals.result:SignalsResult",),
)
def signals(
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame],
    columns: str | Sequence[str] = (),
    *,
    max_gap_s: GapLength | None = None,
    segment_s: GapLength | None = None,
    filter: str | None = None,
) -> SignalsResult:
    """Mean, spread, correlation time, stationarity, normality and spectra of the signals of trials.

    Parameters
    ----------
    trials : path, TrialRecord, DataFrame, or sequence of them
        A folder means the trials in it.
    columns : sequence of str
        Columns to analyse (``"r_degps"``); by default all.
    max_gap_s : float, optional
        Longest gap to bridge by straight lines, s; by default five steps.
    segment_s : float, optional
        Length of the spectral segments, s; by default eight segments, longer ones of slow signals.
    filter : str, optional
        Filter of the only column of the only trial: lowpass:HZ, highpass:HZ, bandpass:HZ,HZ (each also with ,causal),
        savgol:SAMPLES,DEGREE, spline:HZ, detrend:DEGREE, or decimate:FACTOR, which thins the whole trial.

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
    from tank2sim.api.trial import TrialRecord, trials_of
    from tank2sim.apps.signals.result import SignalsResult
    from tank2sim.apps.signals.study import SignalSettings, SignalsStudy, analyse, parse_filter

    settings = SignalSettings(tuple([columns] if isinstance(columns, str) else columns), max_gap_s, segment_s)
    request = parse_filter(filter) if filter else None
    read = trials_of(trials)
    study, changed = _filter(read, request, settings) if request else (None, None)
    analysed = tuple(analyse(trial, settings) for trial in read)
    return SignalsResult(SignalsStudy(trials=analysed, filter=study), TrialRecord(changed) if changed else None)


def _only_trial(trials: Sequence[Trial], request: FilterRequest, settings: SignalSettings) -> Trial:
    """The trial of a filter; ArgumentError unless it is one, with one column, or none if the filter thins it."""
    if len(trials) != 1:
        raise ArgumentError("filter", "", f"filters one trial, and {len(trials)} are given", "filter them one by one")
    if request.thins and settings.columns:
        raise ArgumentError("columns", "", f"{request.text} thins the whole trial", "leave the column out")
    if len(settings.columns) != 1 and not request.thins:
        remedy = "filter each column in a separate run; decimate takes no column: it thins the whole trial"
        raise ArgumentError("filter", "", "filters one column, which must be named", remedy)
    return trials[0]


def _filter(trials: Sequence[Trial], request: FilterRequest, settings: SignalSettings) -> tuple[FilterStudy, Trial]:
    """Study of a filter, and the trial with the filtered signals."""
    from tank2sim.apps.signals.study import filtered
    from tank2sim.records.signals.columns import HELD_COLUMNS, SignalName, find_signal
    from tank2sim.records.signals.sampling import even_series
    from tank2sim.records.signals.writing import thinned, with_filtered

    trial = _only_trial(trials, request, settings)
    every = [name for name in trial.signals if name not in HELD_COLUMNS]
    names = every if request.thins else [find_signal(settings.columns[0], trial)]
    before = [even_series(trial, name, settings.max_gap_s) for name in names]
    after = [request.apply(series) for series in before]
    what = "all columns but orders" if request.thins else SignalName(names[0]).file
    sentence = f"{what} filtered by {request.text}: {after[0].effect.explanation}"
    changed = thinned(trial, after, sentence) if request.thins else with_filtered(trial, after[0], sentence)
    return filtered(request.text, sentence, before[0], after[0]), changed
