"""``tank2sim signals``: statistics, spectra and filters of the signals of trials."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click
from rich.markup import escape

from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.errors import InputError
from tank2sim.files import writable_folder, write_together
from tank2sim.records.reading import read_trial
from tank2sim.records.signals.analysis import ColumnAnalysis, SignalSettings, TrialAnalysis, analyse
from tank2sim.records.signals.as_json import analysis_as_json, effect_as_json
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, HELD_COLUMNS, SignalName, find_signal
from tank2sim.records.signals.effect import Filtered
from tank2sim.records.signals.requests import REQUEST_FORMS, FilterRequest, parse_filter
from tank2sim.records.signals.sampling import Series, even_series
from tank2sim.records.signals.writing import thinned, trial_text, with_filtered
from tank2sim.records.trials import Trial


@click.command("signals")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRIAL...")
@click.option("--column", "columns", multiple=True, metavar="NAME", help="Only this column (r_degps, ...); repeatable.")
@click.option("--max-gap", "max_gap_s", type=click.FloatRange(min=0, min_open=True), metavar="S",
              help="Longest gap to bridge, s; by default five steps.")  # fmt: skip
@click.option("--segment", "segment_s", type=click.FloatRange(min=0, min_open=True), metavar="S",
              help="Length of spectral segments, s; by default eight, longer ones of slow signals.")  # fmt: skip
@click.option("--filter", "filter_text", metavar="F", help=f"Filter the column: {REQUEST_FORMS}.")
@click.option("--out", type=click.Path(path_type=Path), metavar="FILTERED.csv", help="Write the trial so filtered.")
@click.option("--plot", type=click.Path(path_type=Path, file_okay=False), metavar="DIR", help="Charts, signals.html.")
@json_option
def command(trials: tuple[Path, ...], *, filter_text: str | None, **more: object) -> None:
    """Tell mean, spread, correlation time, stationarity, normality and spectra of the signals of each TRIAL.

    Tests of normality are made on samples two correlation times apart: neighbours repeat each other, and all samples
    together make the tests reject what is normal.
    """
    out, plot, json_file = (_path(more.pop(key)) for key in ("out", "plot", "json_file"))
    settings = SignalSettings(**more)  # type: ignore[arg-type]  # click has checked them
    request = parse_filter(filter_text) if filter_text else None
    if out and request is None:
        raise InputError("--out", "", "needs a filter", "say which with --filter, such as --filter lowpass:0.5")
    read = [read_trial(path) for path in trials]
    filtering = _filtering(read, request, settings) if request else None
    analyses = [analyse(trial, settings) for trial in read]
    files: dict[Path, str | bytes] = {}
    if out and filtering:
        files[out] = filtering.text
    if json_file:
        files[json_file] = json_text(_as_json(analyses, filtering))
    pictures = _pictures(analyses, filtering, plot) if plot else {}
    write_together({**files, **pictures}, inputs=trials, outputs=[out, json_file, *pictures])
    for analysis in analyses:
        _show(analysis)
    if filtering:
        screen.print(f"{escape(filtering.told)}", soft_wrap=True)


@dataclass(frozen=True)
class _Filtering:
    """A signal before, the filter's name, and after; a sentence about it, and the trial file that it makes."""

    before: Series
    name: str
    after: Filtered
    told: str
    text: str


def _path(value: object) -> Path | None:
    assert value is None or isinstance(value, Path)
    return value


def _filtering(trials: list[Trial], request: FilterRequest, settings: SignalSettings) -> _Filtering:
    if len(trials) != 1:
        raise InputError("--filter", "", f"filters one trial, and {len(trials)} are given", "filter them one by one")
    trial = trials[0]
    if len(settings.columns) != 1 and not (request.thins and not settings.columns):
        remedy = "give each column a run of its own; decimate takes no --column, for it thins the whole trial"
        raise InputError("--filter", "", "filters the one column named by --column", remedy)
    if request.thins:
        if settings.columns:
            raise InputError("--column", "", f"{request.text} thins the whole trial", "leave --column out")
        names = [name for name in trial.signals if name not in HELD_COLUMNS]
    else:
        names = [find_signal(settings.columns[0], trial)]
    before = [even_series(trial, name, settings.max_gap_s) for name in names]
    results = [request.apply(one) for one in before]
    what = "all columns but orders" if request.thins else SignalName(names[0]).file
    message = f"{what} filtered by {request.text}: {results[0].effect.sentence}"
    new = thinned(trial, results, message) if request.thins else with_filtered(trial, results[0], message)
    text = trial_text(new, [f"tank2sim signals, from {trial.path.name}", message])
    return _Filtering(before[0], request.text, results[0], message, text)


def _as_json(analyses: list[TrialAnalysis], filtering: _Filtering | None) -> dict[str, object]:
    result: dict[str, object] = {"trials": [analysis_as_json(analysis) for analysis in analyses]}
    if filtering:
        column = SignalName(filtering.before.name).file
        result["filter"] = {"name": filtering.name, "column": column, **effect_as_json(filtering.after.effect)}
    return result


def _pictures(analyses: list[TrialAnalysis], filtering: _Filtering | None, folder: Path) -> dict[Path, str | bytes]:
    """A picture of each chart, and the page that has them all."""
    from tank2sim.report.kit.charts import chart_png
    from tank2sim.report.kit.page import render_page
    from tank2sim.report.signals.page import picture_name, signals_charts, signals_page

    writable_folder(folder)
    charts = signals_charts(analyses, (filtering.before, filtering.name, filtering.after) if filtering else None)
    pictures: dict[Path, str | bytes] = {folder / picture_name(key): chart_png(chart) for key, chart in charts.items()}
    page = signals_page(analyses, charts, filtering.told if filtering else "")
    return {**pictures, folder / "signals.html": render_page(page)}


def _show(analysis: TrialAnalysis) -> None:
    heads = ["", "mean", "std", "corr. (s)", "stationarity", "normal", "peak (Hz)"]
    show_table(analysis.trial.name, heads, [_row(column) for column in analysis.columns])
    if any(column.series.name in DIRECTION_COLUMNS for column in analysis.columns):
        screen.print("mean and std of directions: on the circle, 0 to 360 deg.")
    screen.print(
        "corr.: correlation time. normal: tested on samples two correlation times apart, their number in brackets.",
        soft_wrap=True,
    )
    found = [column.randomness.stationarity.verdict for column in analysis.columns if column.randomness]
    for verdict in dict.fromkeys(found):
        screen.print(f"{verdict}: {verdict.meaning}", soft_wrap=True)
    notices = list(analysis.notices)
    if steering := analysis.steering:
        lag, coefficient = steering.correlation.largest
        transfer = steering.transfer
        sure = transfer.sure
        screen.print(
            f"{escape(SignalName(steering.rudder).words)} to yaw rate: correlation {coefficient:.2f} at a lag of "
            f"{lag:.3g} s; coherence above chance ({transfer.significant:.2f}) at {int(sure.sum())} of {len(sure)} "
            "frequencies",
            soft_wrap=True,
        )
        notices += steering.notices
    show_notices(notices)


def _row(column: ColumnAnalysis) -> list[object]:
    name = SignalName(column.series.name)
    row: list[object] = [name.file, *(f"{name.factor * one:.4g}" for one in (column.mean, column.standard_deviation))]
    if (found := column.randomness) is None:
        return [*row, None, "constant", "-", "-"]
    peak = found.spectrum.peak_in_words
    return [*row, found.correlation.correlation_time_s, found.stationarity.verdict.value, found.normality.verdict, peak]
