"""The page of measured signals: statistics of each, the response of the yaw rate to the rudder, the effect of a
filter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import PurePath

import altair as alt

from tank2sim.answer.charts.columns import measured_histories
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import vector
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.statistics import Stationary
from tank2sim.report.json_values import Json
from tank2sim.report.signals.charts import (
    autocorrelation_chart,
    cross_correlation_chart,
    density_chart,
    effect_chart,
    spectrum_chart,
    transfer_chart,
)
from tank2sim.units import to_si

ChartKey = tuple[str, str]
"""Label of a trial and subject of a chart: ``("zigzag", "r_density")``; of a filter the label is ``filter``."""

_FILTER = "filter"
_UNITS = {"rad": "rad", "radps": "rad/s", "mps": "m/s", "m": "m"}

_SIDE_BY_SIDE = ("_density", "_autocorrelation", "_spectrum")
"""Endings of the subjects of charts of a single signal."""

_HOW = (
    "Mean and standard deviation of directions are those on the circle. "
    "Stationarity: augmented Dickey-Fuller and KPSS tests, whose null hypotheses are opposite, at 5 %. Normality is "
    "tested on samples two correlation times apart (their number in brackets): neighbours repeat each other, and all "
    "samples together make the tests reject what is normal. Spectra: Welch, Hann windows that overlap by half; 95 % "
    "limits by chi-square with the effective degrees of freedom."
)


def signals_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim signals``."""
    trials = found["trials"]
    sections: list[Section] = []
    if (applied := found.get("filter")) and "before" in applied:
        charts = [Illustration(chart=chart) for _, chart in _filter_charts(applied)]
        sections.append(Section(heading="Filter", text=applied["sentence"], charts=charts))
    for label, trial in zip(trial_labels(trials), trials, strict=True):
        steering = trial["rudder_to_yaw_rate"] or {"notices": ()}
        sections.append(
            Section(
                heading=label,
                tables=[_signals(trial["columns"])],
                charts=_illustrations(_trial_charts(label, trial)),
                notes=[*trial["notices"], *steering["notices"]],
            )
        )
    for label, trial in zip(trial_labels(trials), trials, strict=True):
        sections.append(
            Section(
                heading=f"Each signal of {label}",
                text=_HOW,
                charts=_illustrations(_signal_charts(label, trial)),
                tables=[_tests(trial["columns"])],
                folded=True,
            )
        )
    title = f"Signals of {_name(trials[0])}" if len(trials) == 1 else f"Signals of {len(trials)} trials"
    columns = [column for trial in trials for column in trial["columns"].values()]
    return Page(
        title=title,
        subtitle="Statistics and spectra of what was measured",
        verdict=_verdict(columns),
        figures=_figures(trials, columns),
        sections=sections,
    )


def _verdict(columns: Sequence[Json]) -> str:
    varying = [column for column in columns if not column["constant"]]
    steady = sum(map(_is_stationary, varying))
    if not varying:
        return "No signal varies."
    if steady == len(varying):
        return "All signals that vary are stationary: their means and spectra describe the record."
    return (
        f"{steady} of {len(varying)} signals that vary are stationary. Of the others mean and spectrum say little: "
        "they drift over the record, as those of a manoeuvre do."
    )


def _figures(trials: Sequence[Json], columns: Sequence[Json]) -> list[KeyFigure]:
    varying = [column for column in columns if not column["constant"]]
    steady = sum(map(_is_stationary, varying))
    figures = [KeyFigure(label="Stationary signals", value=f"{steady} of {len(varying)}")]
    counts = [column["effective_count"] for column in varying if column.get("effective_count") is not None]
    if counts:
        slow = max(varying, key=lambda column: column.get("correlation_time_s") or 0.0)
        time_s = slow["correlation_time_s"]
        figures.append(KeyFigure(label="Longest correlation time", value=float(f"{time_s:.3g}"), unit="s"))
        note = "of the slowest signal: what its mean rests on"
        figures.append(KeyFigure(label="Independent samples, fewest", value=float(f"{min(counts):.3g}"), note=note))
    lags = [steering["cross_correlation"] for trial in trials if (steering := trial["rudder_to_yaw_rate"])]
    if lags:
        lag_s = float(f"{lags[0]['lag_of_largest_s']:.3g}")
        note = "lag of the largest correlation" + (" in the first trial" if len(trials) > 1 else "")
        figures.append(KeyFigure(label="Yaw rate after the rudder", value=lag_s, unit="s", note=note))
    return figures


def _illustrations(charts: Iterator[tuple[ChartKey, alt.TopLevelMixin]]) -> list[Illustration]:
    return [
        Illustration(chart=chart, caption=_caption(key[1]), half=key[1].endswith(_SIDE_BY_SIDE))
        for key, chart in charts
    ]


def signals_charts(found: Json) -> dict[ChartKey, alt.TopLevelMixin]:
    """Return the charts of the page: a filter's two; of each trial its histories and two of rudder and yaw rate; three
    of each signal that varies."""
    trials = found["trials"]
    labelled = list(zip(trial_labels(trials), trials, strict=True))
    charts = dict(_filter_charts(found["filter"]) if found.get("filter") else ())
    for drawn in (_trial_charts, _signal_charts):
        charts |= {key: chart for label, trial in labelled for key, chart in drawn(label, trial)}
    return charts


def trial_labels(trials: Sequence[Json]) -> list[str]:
    """Return a name for each trial, numbered where files of several folders have one name."""
    names = [_name(trial) for trial in trials]
    return [
        name if names.count(name) == 1 else f"{name}_{names[: place + 1].count(name)}"
        for place, name in enumerate(names)
    ]


def _name(trial: Json) -> str:
    return PurePath(str(trial["trial"])).stem


def _signal(column: str) -> SignalName:
    """The signal of a column of a trial file."""
    return SignalName(to_si(column, 1.0)[0])


def _is_stationary(column: Json) -> bool:
    return not column["constant"] and column["stationarity"]["verdict"] == Stationary.YES.value


def _trial_charts(label: str, trial: Json) -> Iterator[tuple[ChartKey, alt.TopLevelMixin]]:
    if trial.get("histories") and (chart := measured_histories(trial["histories"], title=f"Measured: {label}")):
        yield (label, "histories"), chart
    if steering := trial["rudder_to_yaw_rate"]:
        pair = _signal(steering["rudder"]), _signal("r_degps")
        title = f"From {pair[0].words} to {pair[1].words}"
        yield (label, "transfer"), transfer_chart(*pair, steering, title=title)
        title = f"Cross-correlation of {pair[0].words} and {pair[1].words}"
        correlation = steering["cross_correlation"]
        yield (label, "cross_correlation"), cross_correlation_chart(*pair, correlation, title=title)


def _signal_charts(label: str, trial: Json) -> Iterator[tuple[ChartKey, alt.TopLevelMixin]]:
    """Correlation and spectrum of each signal side by side, and its density."""
    for file, column in trial["columns"].items():
        if column["constant"]:
            continue
        name = _signal(file)
        stem, subject = name.stem, name.words[:1].upper() + name.words[1:]
        density, spectrum = column["probability_density"], column["spectrum"]
        yield (label, f"{stem}_density"), density_chart(name, density, title=f"{subject}: probability density")
        yield (
            (label, f"{stem}_autocorrelation"),
            autocorrelation_chart(name, column, title=f"{subject}: autocorrelation"),
        )
        yield (label, f"{stem}_spectrum"), spectrum_chart(name, spectrum, title=f"{subject}: spectrum")


def _filter_charts(applied: Json) -> Iterator[tuple[ChartKey, alt.TopLevelMixin]]:
    text, column = applied["name"], applied["column"]
    name, (si, factor) = _signal(column), to_si(column, 1.0)
    shown = Signal(
        name=si,
        title=name.words,
        unit=_UNITS.get(si.rpartition("_")[2], "1"),
        display_unit="rpm" if name.unit == "rpm" else None,
    )
    before, after = (
        History(
            label=label,
            time_s=vector(applied[key]["t_s"]),
            values={si: factor * vector(applied[key][column])},
            measured=key == "before",
        )
        for key, label in (("before", "as measured"), ("after", text))
    )
    yield (_FILTER, "response"), effect_chart(text, applied, title=f"What {text} does")
    title = f"{name.words} before and after"
    yield (_FILTER, "signal"), history_chart([before, after], [shown], title=title, height_px=300)


def _caption(kind: str) -> str:
    captions = {
        "density": "Kernel estimate next to the normal density of the same mean and standard deviation.",
        "cross_correlation": "Red: the lag of the largest. Dotted: what 95 % of the coefficients of two independent "
        "signals stay within. Right: the yaw rate comes after the rudder.",
        "correlation": "Red: the correlation time.",
        "spectrum": "The band is the 95 % confidence interval at each frequency.",
        "transfer": "Gain and phase where the coherence is above chance, with 95 % intervals. In a zigzag the rudder "
        "follows the heading, and only what is highly coherent is the ship's own response.",
    }
    return next((caption for end, caption in captions.items() if kind.endswith(end)), "")


def _signals(columns: Json) -> Table:
    heads = [
        Column(title="signal"),
        Column(title="unit"),
        Column(title="mean"),
        Column(title="standard deviation"),
        Column(title="correlation time", unit="s", digits=3),
        Column(title="independent samples", digits=3),
        Column(title="main peak", unit="Hz"),
    ]
    rows: list[list[Cell]] = [
        [
            _signal(file).words,
            column["unit"],
            f"{column['mean']:.4g}",
            f"{column['standard_deviation']:.4g}",
            column.get("correlation_time_s"),
            column.get("effective_count"),
            "constant" if column["constant"] else column["spectrum"].get("peak_in_words"),
        ]
        for file, column in columns.items()
    ]
    return Table(caption="Signals", columns=heads, rows=rows)


def _tests(columns: Json) -> Table:
    heads = [
        Column(title="signal"),
        Column(title="stationarity"),
        Column(title="Dickey-Fuller p", digits=2),
        Column(title="KPSS p", digits=2),
        Column(title="normal"),
        Column(title="least p", digits=2),
        Column(title="skewness", digits=2),
        Column(title="excess kurtosis", digits=2),
    ]
    rows: list[list[Cell]] = []
    for file, column in columns.items():
        if column["constant"]:
            continue
        level, normal = column["stationarity"]["p_values"]["about_level"], column["normality"]
        least = min((value for value in normal["p_values"].values() if value is not None), default=None)
        tests: list[Cell] = [column["stationarity"]["verdict"], level["dickey_fuller"], level["kpss"]]
        shape: list[Cell] = [normal["verdict"], least, normal["skewness"], normal["excess_kurtosis"]]
        rows.append([_signal(file).words, *tests, *shape])
    return Table(caption="Tests", columns=heads, rows=rows)
