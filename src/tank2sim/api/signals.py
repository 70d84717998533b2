"""Statistics, spectra and filters of the signals of trials."""

from __future__ import annotations

from collections.abc import Sequence

from tank2sim.api.trial import TrialPaths, TrialRecord, trials_of
from tank2sim.arguments import PositiveArgument, checked
from tank2sim.errors import InputError
from tank2sim.records.signals.analysis import FilterStudy, SignalSettings, SignalsStudy, analyse, filtered
from tank2sim.records.signals.columns import HELD_COLUMNS, SignalName, find_signal
from tank2sim.records.signals.requests import FilterRequest, parse_filter
from tank2sim.records.signals.sampling import even_series
from tank2sim.records.signals.writing import thinned, with_filtered
from tank2sim.records.trials import Trial
from tank2sim.results.signals import SignalsResult


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
    study, changed = _filter(read, request, settings) if request else (None, None)
    analysed = tuple(analyse(trial, settings) for trial in read)
    return SignalsResult(SignalsStudy(trials=analysed, filter=study), TrialRecord(changed) if changed else None)


def _filter(trials: Sequence[Trial], request: FilterRequest, settings: SignalSettings) -> tuple[FilterStudy, Trial]:
    """Study of a filter, and the trial with the filtered signals."""
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
    sentence = f"{what} filtered by {request.text}: {after[0].effect.explanation}"
    changed = thinned(trial, after, sentence) if request.thins else with_filtered(trial, after[0], sentence)
    return filtered(request.text, sentence, before[0], after[0]), changed
