"""The page of measured signals: what each is like, how the yaw rate follows the rudder, what a filter does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.records.signals.analysis import ColumnAnalysis, TrialAnalysis
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.effect import Filtered
from tank2sim.records.signals.sampling import Series
from tank2sim.records.signals.statistics import Stationary
from tank2sim.report.kit.motion_charts import History, Signal, history_chart
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable
from tank2sim.report.signals.charts import (
    autocorrelation_chart,
    cross_correlation_chart,
    density_chart,
    effect_chart,
    spectrum_chart,
    transfer_chart,
)

ChartKey = tuple[str, str]
"""Label of a trial, and what a chart shows of it: ``("zigzag", "r_density")``; of a filter the label is empty."""

_FILTER = ""
_UNITS = {"rad": "rad", "radps": "rad/s", "mps": "m/s", "m": "m"}

_HOW = (
    "Mean and standard deviation of directions are those on the circle. "
    "Stationarity: augmented Dickey-Fuller and KPSS tests, whose null hypotheses are opposite, at 5 %. Normality is "
    "tested on samples two correlation times apart (their number in brackets): neighbours repeat each other, and all "
    "samples together make the tests reject what is normal. Spectra: Welch, Hann windows that overlap by half; 95 % "
    "limits by chi-square with the effective degrees of freedom."
)


def trial_labels(analyses: Sequence[TrialAnalysis]) -> list[str]:
    """A name for each trial, numbered where files of several folders have one name."""
    names = [analysis.trial.name for analysis in analyses]
    return [
        name if names.count(name) == 1 else f"{name}_{names[: place + 1].count(name)}"
        for place, name in enumerate(names)
    ]


def chart_name(key: ChartKey) -> str:
    """Stem of the file of a chart's picture."""
    return f"{key[0] or 'filter'}_{key[1]}"


def signals_charts(
    analyses: Sequence[TrialAnalysis], filtering: tuple[Series, str, Filtered] | None
) -> dict[ChartKey, alt.TopLevelMixin]:
    """The charts: three of each signal that varies, two of rudder and yaw rate, two of a filter.

    Parameters
    ----------
    analyses : sequence of TrialAnalysis
        What was found.
    filtering : (Series, str, Filtered) or None
        A signal before, the filter's name, and after.
    """
    charts: dict[ChartKey, alt.TopLevelMixin] = {}
    for label, analysis in zip(trial_labels(analyses), analyses, strict=True):
        for column in analysis.columns:
            if (found := column.randomness) is None:
                continue
            name = SignalName(column.series.name)
            stem, of = name.stem, f"{name.words}, {label}"
            charts[label, f"{stem}_density"] = density_chart(name, found.density, title=f"Probability density of {of}")
            charts[label, f"{stem}_correlation"] = autocorrelation_chart(
                name, found.correlation, title=f"Autocorrelation of {of}"
            )
            charts[label, f"{stem}_spectrum"] = spectrum_chart(name, found.spectrum, title=f"Spectrum of {of}")
        if steering := analysis.steering:
            pair = SignalName(steering.rudder), SignalName("r_radps")
            of = f"{pair[0].words} and {pair[1].words}, {label}"
            charts[label, "cross_correlation"] = cross_correlation_chart(
                *pair, steering.correlation, title=f"Cross-correlation of {of}"
            )
            title = f"From {pair[0].words} to {pair[1].words}, {label}"
            charts[label, "transfer"] = transfer_chart(*pair, steering.transfer, title=title)
    if filtering:
        charts |= _filter_charts(*filtering)
    return charts


def signals_page(
    analyses: Sequence[TrialAnalysis], charts: Mapping[ChartKey, alt.TopLevelMixin], filter_text: str
) -> Page:
    """The page; `charts` as :func:`signals_charts` gives them, `filter_text` what the filter does, in words."""
    columns = [column for analysis in analyses for column in analysis.columns]
    steady = [c for c in columns if c.randomness and c.randomness.stationarity.verdict is Stationary.YES]
    figures = [
        KeyFigure(label="Trials", value=len(analyses)),
        KeyFigure(label="Signals", value=len(columns)),
        KeyFigure(label="Stationary", value=len(steady), note="of these signals"),
    ]
    sections: list[PageSection] = []
    for label, analysis in zip(trial_labels(analyses), analyses, strict=True):
        steering = analysis.steering
        notes = [*analysis.notices, *(steering.notices if steering else ())]
        of_trial = {kind: chart for (trial, kind), chart in charts.items() if trial == label}
        sections.append(
            PageSection(
                heading=label,
                text="" if sections else _HOW,
                tables=[_signals(analysis), _tests(analysis)],
                charts=[Illustration(chart=chart, caption=_caption(kind)) for kind, chart in of_trial.items()],
                notes=notes,
            )
        )
    if filter_text:
        illustrations = [Illustration(chart=chart) for (trial, _), chart in charts.items() if trial == _FILTER]
        sections.append(PageSection(heading="Filter", text=filter_text, charts=illustrations))
    title = analyses[0].trial.name if len(analyses) == 1 else f"{len(analyses)} trials"
    return Page(title=title, subtitle="Measured signals", figures=figures, sections=sections)


def _filter_charts(before: Series, text: str, filtered: Filtered) -> dict[ChartKey, alt.TopLevelMixin]:
    name = SignalName(before.name)
    shown = Signal(
        name=before.name,
        title=name.words,
        unit=_UNITS.get(before.name.rpartition("_")[2], "1"),
        display_unit="rpm" if name.unit == "rpm" else None,
    )
    after = filtered.series
    runs = [
        History(label="as measured", time_s=before.time_s, values={before.name: before.values}, measured=True),
        History(label=text, time_s=after.time_s, values={before.name: after.values}),
    ]
    return {
        (_FILTER, "response"): effect_chart(text, filtered.effect, title=f"What {text} does"),
        (_FILTER, "signal"): history_chart(runs, [shown], title=f"{name.words} before and after", height_px=300),
    }


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


def _signals(analysis: TrialAnalysis) -> PageTable:
    heads = [
        Column(title="signal"),
        Column(title="unit"),
        Column(title="mean"),
        Column(title="standard deviation"),
        Column(title="correlation time", unit="s", digits=3),
        Column(title="independent samples", digits=3),
        Column(title="main peak", unit="Hz"),
    ]
    return PageTable(caption="Signals", columns=heads, rows=[_row(column) for column in analysis.columns])


def _row(column: ColumnAnalysis) -> list[Cell]:
    name = SignalName(column.series.name)
    row: list[Cell] = [
        name.words,
        name.unit,
        f"{name.factor * column.mean:.4g}",
        f"{name.factor * column.standard_deviation:.4g}",
    ]
    if (found := column.randomness) is None:
        return [*row, None, None, "constant"]
    correlation = found.correlation
    peak = found.spectrum.peak_in_words
    return [*row, correlation.correlation_time_s, correlation.effective_count, peak]


def _tests(analysis: TrialAnalysis) -> PageTable:
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
    for column in analysis.columns:
        if (found := column.randomness) is None:
            continue
        steady, normal = found.stationarity, found.normality
        least = min(normal.p_values.values()) if normal.p_values else None
        tests: list[Cell] = [steady.verdict.value, steady.level.dickey_fuller, steady.level.kpss]
        shape: list[Cell] = [normal.verdict, least, normal.skewness, normal.excess_kurtosis]
        rows.append([SignalName(column.series.name).words, *tests, *shape])
    return PageTable(caption="Tests", columns=heads, rows=rows)
