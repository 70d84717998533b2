"""The page of an identification: what the trials taught, and how well trials that were not fitted are predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.identification.trials.as_json import (
    SET_KEYS,
    estimate_rows,
    figure_error,
    figure_rows,
    following_rows,
    parameters_of,
    pooled_error,
    posterior_rows,
    relative_error,
    structure_rows,
)
from tank2sim.identification.trials.assessment.evaluation import TURN_FIGURE_NAMES
from tank2sim.report.identification.charts import figure_chart, history_grid, track_grid, window_chart
from tank2sim.report.identification.parameter_charts import (
    correlation_chart,
    parameter_chart,
    posterior_chart,
    singular_value_chart,
)
from tank2sim.report.json_values import Json

FITTED, HELD_OUT = "fitted", "held out"

MOST_TRIALS = 12
"""Trials of which tracks and histories are shown: those with the largest error of yaw rate. More are hard to look at,
and make the page slow (project choice)."""

_PER_SHEET = 6
"""Trials in one picture of histories: as many as are readable on a sheet of paper."""


def identification_charts(found: Json) -> dict[str, alt.TopLevelMixin]:
    """Return the charts of the JSON by file stem."""
    charts: dict[str, alt.TopLevelMixin] = {}
    windows = _sets(found["errors_over_windows"])
    charts["windows"] = window_chart(windows, title="Error over windows of five ship lengths, of each signal")
    figures = {word: found["figures"][SET_KEYS[word]] for word in windows}
    if chart := figure_chart(figures, title="Figures of turns and zigzags, in closed loop"):
        charts["figures"] = chart
    for word in (HELD_OUT, FITTED):
        trials = [trial for trial in found["replays"] if trial["held_out"] == (word == HELD_OUT)]
        if trials:
            stem, shown = word.replace(" ", "_"), _worst(trials, windows[word])
            if tracks := track_grid(shown, title=f"Tracks of trials {word}"):
                charts[f"tracks_{stem}"] = tracks
            for first in range(0, len(shown), _PER_SHEET):
                part = f"_{first // _PER_SHEET + 1}" if first else ""
                sheet = shown[first : first + _PER_SHEET]
                charts[f"histories_{stem}{part}"] = history_grid(sheet, title=f"Motions of trials {word}")
    known, parameters = found["identifiability"], parameters_of(found)
    charts["parameters"] = parameter_chart(parameters, title="Parameters: estimate and prior with 95 % intervals")
    if found["posterior"]:
        title = "Samples of the posterior, next to a normal distribution"
        charts["posterior"] = posterior_chart(parameters, found["posterior"], title=title)
    charts["correlation"] = correlation_chart(known, title="Correlation of the parameters, by the trials alone")
    charts["singular_values"] = singular_value_chart(
        known["singular_values"], title="Information of the trials: singular values"
    )
    return charts


def identification_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim identify``."""
    charts = identification_charts(found)

    def drawn(*stems: str) -> list[Illustration]:
        return [
            Illustration(chart=chart, caption=_CAPTIONS.get(stem.partition("_")[0], ""))
            for stem, chart in charts.items()
            if stem.startswith(stems)
        ]

    sections: list[Section] = []
    for word in (HELD_OUT, FITTED):
        stem = word.replace(" ", "_")
        if charts_there := drawn(f"tracks_{stem}", f"histories_{stem}"):
            count = len(found["errors_over_windows"][SET_KEYS[word]])
            text = f"The {MOST_TRIALS} of {count} trials with the largest error of yaw rate."
            sections.append(
                Section(
                    heading=f"Trials {word}",
                    text=text if count > MOST_TRIALS else "",
                    charts=charts_there,
                    folded=bool(sections),
                )
            )
    if tables := _figure_tables(found):
        sections.append(Section(heading="Figures of manoeuvres", text=_FIGURES, charts=drawn("figures"), tables=tables))
    sections.append(
        Section(
            heading="Error of each signal",
            text=_FOLLOWED,
            charts=drawn("windows"),
            tables=[_table("Yaw rate, error over windows", ("trial", "", "before", "now"), following_rows(found))],
        )
    )
    sections.append(
        Section(
            heading="Parameters",
            text=_PARAMETERS + _widened(found["prior_scale"]),
            charts=drawn("parameters", "correlation", "singular_values"),
            tables=[_table("Parameters, ± one standard error", _PARAMETER_HEADS, estimate_rows(found))],
            notes=found["identifiability"]["notices"],
        )
    )
    if posterior := found["posterior"]:
        sections.append(
            Section(
                heading="Posterior",
                text=_POSTERIOR.format(**posterior) + ("" if posterior["converged"] else _NOT_CONVERGED),
                charts=drawn("posterior"),
                tables=[_table(f"{posterior['draws']} draws", _POSTERIOR_HEADS, posterior_rows(found))],
            )
        )
    if structures := structure_rows(found):
        table = _table("Yaw-rate error over windows of trials left out of the fit, %", _STRUCTURE_HEADS, structures)
        sections.append(Section(heading="Structure, by cross-validation", tables=[table]))
    if found["notices"]:
        rows: list[list[object]] = [[notice] for notice in found["notices"]]
        sections.append(
            Section(
                heading="What was repaired, scaled and assumed", tables=[_table("Notices", ("",), rows)], folded=True
            )
        )
    subtitle = f"Coefficients from free-running trials by {found['method'].replace('_', ' ')}"
    return Page(
        title=found["ship"],
        subtitle=subtitle,
        verdict=_verdict(found),
        figures=_key_figures(found),
        sections=sections,
    )


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
_POSTERIOR = (
    "{draws} draws in {chains} chains by the sampler {sampler}, {simulations} simulations of all trials. R-hat "
    "compares the chains: converged ones have less than 1.01. The effective size is the number of independent draws "
    "that are worth as much."
)
_NOT_CONVERGED = " THESE CHAINS HAVE NOT CONVERGED: their intervals are not to be relied upon."
_POSTERIOR_HEADS = ("", "95 %", "R-hat", "effective size")
_STRUCTURE_HEADS = ("structure", "one at a time, mean", "those of largest amplitude")
_CAPTIONS = {
    "figures": "Grey: as measured. Bars: interval in which the figure is expected with 95 % probability. "
    "Figures that a simulation did not reach are not drawn.",
    "tracks": "Turns and zigzags in closed loop, others with the recorded rudder. The scale is that of the record and "
    "of the card found: the card before may leave the panel.",
    "histories": "Turns and zigzags in closed loop, others with the recorded rudder. Drift angle positive when the "
    "water comes from port.",
    "parameters": "In standard errors of the prior, as the fit took it.",
    "posterior": "Lines: intervals that hold 95 % (thin) and half (thick) of the draws, point: their median. Grey: "
    "95 % of a normal distribution.",
    "singular": "Sensitivities of all that was measured, in units of the prior. Below the red line the prior "
    "determines more than the trials.",
}


def _sets(entries: Mapping[str, Json]) -> dict[str, Json]:
    """Words for a set of trials to its entries, without a set that has none."""
    return {word: entries[key] for word, key in SET_KEYS.items() if entries[key]}


def _worst(trials: Sequence[Json], windows: Sequence[Json]) -> list[Json]:
    """The trials with the largest error of yaw rate, in their own order, where there are too many for a picture."""
    errors = {
        trial["trial"]: relative_error(trial["found"]["r_degps"]) for trial in windows if "r_degps" in trial["found"]
    }
    worst = sorted(trials, key=lambda trial: -errors.get(trial["trial"], 0.0))[:MOST_TRIALS]
    kept = {trial["trial"] for trial in worst}
    return [trial for trial in trials if trial["trial"] in kept]


def _key_figures(found: Json) -> list[KeyFigure]:
    windows = found["errors_over_windows"]
    word = HELD_OUT if windows[SET_KEYS[HELD_OUT]] else FITTED
    trials, compared = windows[SET_KEYS[word]], found["figures"][SET_KEYS[word]]
    effects = f"{len(found['effects_of_card'])} effects"
    held_out = len(windows[SET_KEYS[HELD_OUT]])
    figures = [
        _compared("Yaw-rate error", word, "%", *(100 * pooled_error(trials, key) for key in ("before", "found"))),
    ]
    for label, unit, names in (
        ("Overshoot error", "deg", ("overshoot_1_deg", "overshoot_2_deg")),
        ("Advance error", "%", TURN_FIGURE_NAMES[:1]),
    ):
        figures_named = [figure for figure in compared if figure["figure"] in names]
        old, new = (_rms(figures_named, key, 100 if unit == "%" else 1) for key in ("before", "predicted"))
        if not np.isnan(new):
            figures.append(_compared(label, word, unit, old, new))
    return [
        *figures,
        KeyFigure(
            label="Trials held out",
            value=held_out,
            verdict=Verdict.NONE if held_out else Verdict.CAUTION,
            note=f"{len(windows[SET_KEYS[FITTED]])} were fitted",
        ),
        KeyFigure(label="Numbers fitted", value=len(found["identifiability"]["parameters"]), note=effects),
    ]


def _verdict(found: Json) -> str:
    """How the card found follows trials, next to the card before; those held out, where there are any."""
    windows = found["errors_over_windows"]
    word = HELD_OUT if windows[SET_KEYS[HELD_OUT]] else FITTED
    before, after = (100 * pooled_error(windows[SET_KEYS[word]], key) for key in ("before", "found"))
    if not np.isfinite(after):
        return ""
    better = "better than" if after < before else "no better than"
    text = f"The card found follows the yaw rate of the trials {word} within {after:.3g} % (rms), {better} the card "
    text += f"before ({before:.3g} %)." if np.isfinite(before) else "before."
    return text if word == HELD_OUT else f"{text} None was held out, so this card is untested."


def _compared(label: str, word: str, unit: str, before: float, after: float) -> KeyFigure:
    worse = Verdict.CAUTION if after > before else Verdict.NONE
    note = f"rms; before {before:.3g} {unit}" if np.isfinite(before) else "rms; before: not reached"
    return KeyFigure(label=f"{label}, {word}", value=float(f"{after:.3g}"), unit=unit, verdict=worse, note=note)


def _rms(figures: Sequence[Json], key: str, factor: float) -> float:
    errors = [factor * figure_error(figure, key) for figure in figures if figure[key] is not None]
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else np.nan


def _widened(scale: Mapping[str, float]) -> str:
    wide = {group: factor for group, factor in scale.items() if factor > 1}
    if not wide:
        return ""
    text = ", ".join(f"{group} {factor:.3g} times" for group, factor in sorted(wide.items()))
    return f" The card's standard errors were widened as the trials demanded: {text}."


def _figure_tables(found: Json) -> list[Table]:
    heads = ("trial", "figure", "measured", "before", "now", "error", "95 %")
    tables = []
    for word in (HELD_OUT, FITTED):
        # Degrees and metres are not of one size: in one column the digits of the one would hide the other's errors.
        for ending, caption in (("_deg", "overshoots in deg"), ("_m", "distances in m, with their error in %")):
            rows = [
                [trial, str(name).rpartition("_")[0].replace("_", " "), *cells]
                for trial, group, name, *cells in figure_rows(found)
                if group == word and str(name).endswith(ending)
            ]
            if rows:
                tables.append(_table(f"Trials {word}: {caption}", heads, rows))
    return tables


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> Table:
    cells: list[list[Cell]] = [
        [value if isinstance(value, float | int | str) else None for value in row] for row in rows
    ]
    return Table(caption=caption, columns=[Column(title=head) for head in heads], rows=cells)
