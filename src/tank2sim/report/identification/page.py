"""The page of an identification: what the trials taught, and how well trials that were not fitted are predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.identification.trials.as_json import estimate_rows, figure_rows, following_rows, replays, structure_rows
from tank2sim.identification.trials.assessment.comparison import Comparison
from tank2sim.identification.trials.assessment.evaluation import TURN_FIGURE_NAMES, pooled
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.methods.posterior import scaled_prior
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.report.identification.charts import (
    BeforeAfter,
    figure_chart,
    history_grid,
    track_grid,
    window_chart,
)
from tank2sim.report.identification.parameter_charts import (
    Parameters,
    correlation_chart,
    parameter_chart,
    singular_value_chart,
)
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict

FITTED, HELD_OUT = "fitted", "held out"

MOST_TRIALS = 12
"""Trials of which tracks and histories are shown: those with the largest error of yaw rate. More are hard to look at,
and make the page slow (project choice)."""

_PER_SHEET = 6
"""Trials in one picture of histories: as many as are readable on a sheet of paper."""


def pairs_of(card: ManoeuvringCard, result: Identification, trials: Measured) -> tuple[BeforeAfter, ...]:
    """Each trial next to `card`, the one that was given, and next to the card found."""
    return tuple(BeforeAfter(before=before, after=after) for before, after in replays(card, result, trials))


def identification_charts(
    result: Identification, fitted: Sequence[BeforeAfter], held: Sequence[BeforeAfter] = ()
) -> dict[str, alt.TopLevelMixin]:
    """File stem to chart; `fitted` and `held` as :func:`pairs_of` gives them."""
    charts: dict[str, alt.TopLevelMixin] = {}
    sets = _sets(result)
    errors = {word: (before.following, after.following) for word, (before, after) in sets.items()}
    charts["windows"] = window_chart(errors, title="Error over windows of five ship lengths, of each signal")
    if chart := figure_chart(
        {word: (before.figures, after.figures) for word, (before, after) in sets.items()},
        title="Figures of turns and zigzags, in closed loop",
    ):
        charts["figures"] = chart
    for word, pairs in ((HELD_OUT, held), (FITTED, fitted)):
        if pairs:
            stem, shown = word.replace(" ", "_"), _worst(pairs, sets[word][1])
            if tracks := track_grid(shown, title=f"Tracks of trials {word}"):
                charts[f"tracks_{stem}"] = tracks
            for first in range(0, len(shown), _PER_SHEET):
                part = f"_{first // _PER_SHEET + 1}" if first else ""
                sheet = shown[first : first + _PER_SHEET]
                charts[f"histories_{stem}{part}"] = history_grid(sheet, title=f"Motions of trials {word}")
    known, estimate = result.identifiability, result.estimate
    names = [name.removeprefix("derivatives.") for name in estimate.free]
    # The prior as the fit took it: widened where the trials demanded.
    prior = scaled_prior(result.problem, estimate.prior_scale)
    parameters = Parameters(
        names=names,
        values=estimate.values,
        errors=estimate.standard_errors,
        prior=result.problem.prior_mean,
        prior_errors=prior,
        share=known.share,
    )
    charts["parameters"] = parameter_chart(parameters, title="Parameters: estimate and prior with 95 % intervals")
    charts["correlation"] = correlation_chart(known, title="Correlation of the parameters, by the trials alone")
    charts["singular_values"] = singular_value_chart(known, title="Information of the trials: singular values")
    return charts


def identification_page(result: Identification, charts: Mapping[str, alt.TopLevelMixin]) -> Page:
    """The page; `charts` as :func:`identification_charts` gives them."""

    def drawn(*stems: str) -> list[Illustration]:
        return [
            Illustration(chart=chart, caption=_CAPTIONS.get(stem.partition("_")[0], ""))
            for stem, chart in charts.items()
            if stem.startswith(stems)
        ]

    sections = [
        PageSection(
            heading="How well trials are followed",
            text=_FOLLOWED,
            charts=drawn("windows"),
            tables=[_table("Yaw rate, error over windows", ("trial", "", "before", "now"), following_rows(result))],
        )
    ]
    if tables := _figure_tables(result):
        sections.append(
            PageSection(heading="Figures of manoeuvres", text=_FIGURES, charts=drawn("figures"), tables=tables)
        )
    for word in (HELD_OUT, FITTED):
        stem = word.replace(" ", "_")
        if charts_there := drawn(f"tracks_{stem}", f"histories_{stem}"):
            count = len(_sets(result)[word][1].following)
            text = f"The {MOST_TRIALS} of {count} trials with the largest error of yaw rate."
            sections.append(
                PageSection(heading=f"Trials {word}", text=text if count > MOST_TRIALS else "", charts=charts_there)
            )
    sections.append(
        PageSection(
            heading="Parameters",
            text=_PARAMETERS + _widened(result),
            charts=drawn("parameters", "correlation", "singular_values"),
            tables=[_table("Parameters, ± one standard error", _PARAMETER_HEADS, estimate_rows(result))],
            notes=result.identifiability.notices,
        )
    )
    if structures := structure_rows(result):
        table = _table("Yaw-rate error over windows of trials left out of the fit, %", _STRUCTURE_HEADS, structures)
        sections.append(PageSection(heading="Structure, by cross-validation", tables=[table]))
    if result.notices:
        rows: list[list[object]] = [[notice] for notice in result.notices]
        sections.append(
            PageSection(heading="Notices", tables=[_table("What was repaired, scaled and assumed", ("",), rows)])
        )
    subtitle = f"Coefficients from free-running trials by {result.estimate.method.replace('_', ' ')}"
    return Page(title=result.card.ship.name, subtitle=subtitle, figures=_key_figures(result), sections=sections)


_FOLLOWED = (
    "The model is given the recorded rudder over windows of five ship lengths, each begun from the state that suits "
    "the record best. The error is a root mean square, as a share of the signal's."
)
_FIGURES = (
    "Turns and zigzags are simulated in closed loop from the measured state at the execute: the rudder of a zigzag is "
    "reversed by the simulated heading, with the lag that the controller of the trial had."
)
_PARAMETERS = (
    "Estimates are in the units of the card (prime system for derivatives). Intervals of the estimates hold for the "
    "residuals as they are, coloured and with what the model lacks."
)
_PARAMETER_HEADS = ("", "found", "before", "from trials")
_STRUCTURE_HEADS = ("structure", "one at a time, mean", "those of largest amplitude")
_CAPTIONS = {
    "figures": "Grey: as measured. Bars: interval in which the figure is expected with 95 % probability. "
    "Figures that a simulation did not reach are not drawn.",
    "tracks": "Turns and zigzags in closed loop, others with the recorded rudder. The scale is that of the record and "
    "of the card found: the card before may leave the panel.",
    "histories": "Turns and zigzags in closed loop, others with the recorded rudder. Drift angle positive when the "
    "water comes from port.",
    "parameters": "In standard errors of the prior, as the fit took it.",
    "singular": "Sensitivities of all that was measured, in units of the prior. Below the red line the prior "
    "determines more than the trials.",
}


def _sets(result: Identification) -> dict[str, tuple[Comparison, Comparison]]:
    sets = {FITTED: (result.before, result.fit)}
    if result.holdout and result.before_holdout:
        sets[HELD_OUT] = (result.before_holdout, result.holdout)
    return sets


def _worst(pairs: Sequence[BeforeAfter], comparison: Comparison) -> list[BeforeAfter]:
    """The trials with the largest error of yaw rate, in their own order, where there are too many for a picture."""
    errors = {
        trial.name: trial.relative("motion.r") if "motion.r" in trial.windows else 0.0 for trial in comparison.following
    }
    kept = {pair.name for pair in sorted(pairs, key=lambda pair: -errors.get(pair.name, 0.0))[:MOST_TRIALS]}
    return [pair for pair in pairs if pair.name in kept]


def _key_figures(result: Identification) -> list[KeyFigure]:
    sets = _sets(result)
    word = HELD_OUT if HELD_OUT in sets else FITTED
    before, after = sets[word]
    figures = [
        KeyFigure(label="Trials fitted", value=len(result.problem.runs)),
        KeyFigure(label="Trials held out", value=len(result.holdout.following) if result.holdout else 0),
        KeyFigure(label="Coefficients", value=len(result.estimate.free), note=f"{len(result.card.effects)} effects"),
        _compared(
            "Yaw-rate error",
            word,
            "%",
            *(100 * pooled(comparison.following, "motion.r") for comparison in (before, after)),
        ),
    ]
    for label, unit, names in (
        ("Overshoot error", "deg", ("overshoot_1_deg", "overshoot_2_deg")),
        ("Advance error", "%", TURN_FIGURE_NAMES[:1]),
    ):
        old, new = (_rms(comparison, names, 100 if unit == "%" else 1) for comparison in (before, after))
        if not np.isnan(new):
            figures.append(_compared(label, word, unit, old, new))
    return figures


def _compared(label: str, word: str, unit: str, before: float, after: float) -> KeyFigure:
    worse = Verdict.CAUTION if after > before else Verdict.NONE
    note = f"rms; before {before:.3g} {unit}" if np.isfinite(before) else "rms; before: not reached"
    return KeyFigure(label=f"{label}, {word}", value=float(f"{after:.3g}"), unit=unit, verdict=worse, note=note)


def _rms(comparison: Comparison, names: Sequence[str], factor: float) -> float:
    errors = [factor * figure.error for figure in comparison.figures if figure.name in names]
    known = [error for error in errors if not np.isnan(error)]
    return float(np.sqrt(np.mean(np.square(known)))) if known else np.nan


def _widened(result: Identification) -> str:
    wide = {group: factor for group, factor in result.estimate.prior_scale.items() if factor > 1}
    if not wide:
        return ""
    text = ", ".join(f"{group} {factor:.3g} times" for group, factor in sorted(wide.items()))
    return f" The card's standard errors were widened as the trials demanded: {text}."


def _figure_tables(result: Identification) -> list[PageTable]:
    heads = ("trial", "figure", "measured", "before", "now", "error", "95 %")
    tables = []
    for word in (HELD_OUT, FITTED):
        # Degrees and metres are not of one size: in one column the digits of the one would hide the other's errors.
        for ending, caption in (("_deg", "overshoots in deg"), ("_m", "distances in m, with their error in %")):
            rows = [
                [trial, str(name).rpartition("_")[0].replace("_", " "), *cells]
                for trial, group, name, *cells in figure_rows(result)
                if group == word and str(name).endswith(ending)
            ]
            if rows:
                tables.append(_table(f"Trials {word}: {caption}", heads, rows))
    return tables


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> PageTable:
    cells: list[list[Cell]] = [
        [value if isinstance(value, float | int | str) else None for value in row] for row in rows
    ]
    return PageTable(caption=caption, columns=[Column(title=head) for head in heads], rows=cells)
