"""The page of single captive runs: Fourier coefficients, averaged cycles, forces over time, residuals, repeats."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.parts import (
    NUMBER,
    Chart,
    axis_above,
    data,
    records,
    series_look,
    stacked,
    vector,
)
from tank2sim.answer.charts.picture import History, Signal, history_chart
from tank2sim.answer.charts.theme import BAND_OPACITY
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.report.json_values import Json

_FORCES = {"X": "X (N)", "Y": "Y (N)", "N": "N (N m)"}
_KEYS = {"X": "N", "Y": "N", "N": "Nm"}


@dataclass(frozen=True, kw_only=True)
class CycleSeries:
    """A run's averaged cycle: `phase_deg` (n,), and by force its ``mean``, ``deviation`` and ``fit``, (n,) each."""

    label: str
    phase_deg: ArrayLike
    forces: Mapping[str, Mapping[str, ArrayLike]]


def run_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim run``."""
    runs = found["runs"]
    odd = [row for row in found["repeats"] if row["chance"] < _ODD]
    faults = sum(len(run["faults"]) for run in runs)
    figures = [
        *_derivative_figures(runs),
        KeyFigure(label="Runs", value=len(runs), note=", ".join(dict.fromkeys(_words(run["type"]) for run in runs))),
        KeyFigure(label="Speed", value=runs[0]["speed_mps"], unit="m/s"),
        KeyFigure(label="Periods", value=sum(run["periods"] for run in runs)),
        KeyFigure(label="Faults", value=faults, verdict=Verdict.FAILED if faults else Verdict.PASSED),
    ]
    if found["repeats"]:
        verdict = Verdict.CAUTION if odd else Verdict.PASSED
        figures.append(KeyFigure(label="Coefficients in which repeats differ", value=len(odd), verdict=verdict))
    sections: list[Section] = []
    charts = run_charts(found)
    for heading, stem, caption in (
        ("Averaged cycle", "cycle", "Points: mean by phase; shaded: ± one standard deviation; line: harmonics."),
        ("Forces over time", "forces", "Points: readings; lines: harmonics and trend."),
        ("Residual", "residual", "What harmonics and trend leave."),
    ):
        shown = [Illustration(chart=chart, caption=caption) for key, chart in charts.items() if key.startswith(stem)]
        if shown:
            sections.append(Section(heading=heading, charts=shown))
    text = (
        "F = mean + cos_n cos(n omega t) + sin_n sin(n omega t), t from a moment of the greatest leading velocity (v "
        "in pure sway, else r). X, Y, N as recorded in the hydrodynamic sense; X_water, Y_water, N_water without the "
        "inertia of the model. Errors include coloured noise within the run."
    )
    tables = [_coefficients(run) for run in runs]
    sections.insert(len(sections) - 2, Section(heading="Fourier coefficients", text=text, tables=tables))
    if derivatives := [run for run in runs if run["derivatives"]]:
        heading = "Derivatives of the run alone"
        sections.insert(1, Section(heading=heading, tables=[_derivatives(derivatives)]))
    if found["repeats"]:
        sections.insert(1, Section(heading="Repeats", tables=[_repeats(found["repeats"])]))
    sections += notices_section(found["notices"])
    title = ", ".join(str(run["name"]).rpartition("/")[2] for run in runs)
    return Page(
        title=f"Run: {title}",
        subtitle="Captive run, reduced by itself",
        verdict=_verdict(runs, len(found["repeats"]), len(odd)),
        figures=figures,
        sections=sections,
    )


def _verdict(runs: Sequence[Json], compared: int, odd: int) -> str:
    """Whether the runs are good, and which derivative each is surest of."""
    faults = sum(len(run["faults"]) for run in runs)
    parts = [
        f"{faults} {'fault' if faults == 1 else 'faults'}: not to be used as recorded."
        if faults
        else "No fault is found."
    ]
    if compared:
        parts.append(
            f"The repeats differ by more than their noise in {odd} of {compared} coefficients."
            if odd
            else "The repeats differ by no more than their noise."
        )
    if surest := _surest(runs[0]):
        name = surest[0]
        value, error = (runs[0]["derivatives"][key][name] for key in ("values", "standard_errors"))
        percent = 100 * abs(error / value)
        parts.append(f"By the {'first ' if len(runs) > 1 else ''}run alone {name} is known to {percent:.2g} %.")
    return " ".join(parts)


def _surest(run: Json) -> list[str]:
    """Names of the derivatives of a run alone, the one with the least relative standard error first."""
    found = run["derivatives"]
    if not found:
        return []
    errors = found["standard_errors"]
    known = [name for name, value in found["values"].items() if value and errors.get(name)]
    return sorted(known, key=lambda name: abs(errors[name] / found["values"][name]))


def _derivative_figures(runs: Sequence[Json]) -> list[KeyFigure]:
    """The two surest derivatives of a run that is alone."""
    if len(runs) > 1:
        return []
    return [
        KeyFigure(
            label=f"{name}, times 10⁵",
            value=1e5 * runs[0]["derivatives"]["values"][name],
            note=f"standard error {format_number(1e5 * runs[0]['derivatives']['standard_errors'][name], 2)}",
        )
        for name in _surest(runs[0])[:2]
    ]


_ODD = 0.01


def run_charts(found: Json) -> dict[str, alt.TopLevelMixin]:
    """Return the charts by file stem: averaged cycles of all runs, forces over time and residual of each."""
    charts: dict[str, alt.TopLevelMixin] = {}
    labels = _labels(found["runs"])
    series = [
        CycleSeries(
            label=label,
            phase_deg=[math.degrees(phase) for phase in run["cycles"]["Y"]["phase_rad"]],
            forces=run["cycles"],
        )
        for label, run in zip(labels, found["runs"], strict=True)
        if run["cycles"]
    ]
    if series:
        charts["cycle"] = cycle_chart(series, title="Averaged cycle")
    for place, (label, run) in enumerate(zip(labels, found["runs"], strict=True), start=1):
        history = run["history"]
        time = vector(history["t_s"])
        measured = {force: vector(history[f"{force}_{unit}"]) for force, unit in _KEYS.items()}
        fitted = {force: vector(history[f"{force}_fit_{unit}"]) for force, unit in _KEYS.items()}
        residual = {force: vector(history[f"{force}_residual_{unit}"]) for force, unit in _KEYS.items()}
        signals = [Signal(name=force, title=force, unit="N.m" if force == "N" else "N") for force in _FORCES]
        lines = [
            History(label="measured", time_s=time, values=measured, measured=True),
            History(label="fit", time_s=time, values=fitted),
        ]
        charts[f"forces_{place}"] = history_chart(lines, signals, title=f"Forces: {label}")
        rest = [History(label="residual", time_s=time, values=residual)]
        charts[f"residual_{place}"] = history_chart(rest, signals, title=f"Residual: {label}", height_px=80)
    return charts


def cycle_chart(series: Sequence[CycleSeries], *, title: str = "", height_px: int = 200) -> alt.VConcatChart:
    """Averaged cycles over the phase of the motion, one panel a force, in bands of one standard deviation.

    Parameters
    ----------
    series : sequence of CycleSeries
        In one colour each.
    title : str
        Of the chart.
    height_px : int
        Height of one panel.
    """
    labels = [each.label for each in series]
    look = series_look(labels, as_points=labels)
    panels = []
    for place, (force, up) in enumerate(_FORCES.items()):
        last = place == len(_FORCES) - 1
        axis = alt.Axis(title="phase (deg)") if last else alt.Axis(title=None, labels=False, ticks=False)
        x = alt.X("x:Q", scale=alt.Scale(domain=[0, 360], nice=False), axis=axis)
        y = alt.Y("v:Q", scale=alt.Scale(zero=False), axis=axis_above(up))
        points, lines = [], []
        for each in series:
            cycle = each.forces[force]
            phase, mean, fit = vector(each.phase_deg), _numbers(cycle["mean"]), _numbers(cycle["fit"])
            spread = np.nan_to_num(_numbers(cycle["deviation"]))
            points += records(each.label, {"x": phase, "v": mean, "low": mean - spread, "high": mean + spread})
            lines += records(each.label, {"x": phase, "v": fit})
        area = Chart(data(points)).mark_area(opacity=BAND_OPACITY, clip=True)
        colour = look.colour.copy()
        if len(series) > 1:
            colour.legend = alt.Legend(title=None, symbolOpacity=1)  # it is shared, and would be as faint as the band
        band = area.encode(x=x, y=alt.Y("low:Q", axis=axis_above(up)), y2="high:Q", color=colour)
        line = Chart(data(lines)).mark_line(clip=True).encode(x=x, y=y, color=look.colour, order="i:Q")
        tooltip = [
            alt.Tooltip("run:N", title="run"),
            alt.Tooltip("x:Q", title="phase (deg)", format=NUMBER),
            alt.Tooltip("v:Q", title=up, format=NUMBER),
        ]
        mark = Chart(data(points)).mark_point(clip=True, size=14)
        dots = mark.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        panels.append(alt.layer(band, line, dots).properties(width=640, height=height_px))
    return stacked(panels, title=title, description=f"Forces over the phase of the motion of {', '.join(labels)}.")


def _numbers(values: Json) -> np.ndarray:
    return np.array([math.nan if value is None else value for value in values], dtype=float)


def _labels(runs: Sequence[Json]) -> list[str]:
    names = [str(run["name"]) for run in runs]
    return [name if names.count(name) == 1 else f"{name} ({place})" for place, name in enumerate(names, start=1)]


def _words(kind: str) -> str:
    return kind.replace("_", " ")


def _coefficients(run: Json) -> Table:
    heads = ("signal", "unit", "order", "cos", "±", "sin", "±", "amplitude", "±")
    columns = [
        *(Column(title=head) for head in heads),
        Column(title="phase", unit="deg"),
        Column(title="±", unit="deg"),
    ]
    keys = ("signal", "unit", "order", "cosine", "cosine_error", "sine", "sine_error", "amplitude", "amplitude_error")
    rows: list[list[Cell]] = [
        [
            *(each[key] for key in keys),
            math.degrees(each["phase_rad"]) if each["order"] else None,
            math.degrees(each["phase_error_rad"]) if each["order"] else None,
        ]
        for each in run["coefficients"]
    ]
    return Table(caption=f"Fourier coefficients: {run['name']}", columns=columns, rows=rows)


def _derivatives(runs: Sequence[Json]) -> Table:
    rows: list[list[Cell]] = [
        [run["name"], name, 1e5 * value, 1e5 * run["derivatives"]["standard_errors"][name]]
        for run in runs
        for name, value in run["derivatives"]["values"].items()
    ]
    columns = [Column(title=title) for title in ("run", "", "value", "±")]
    return Table(caption="Prime system, times 10⁵; at this frequency and amplitude", columns=columns, rows=rows)


def _repeats(repeats: Sequence[Json]) -> Table:
    rows: list[list[Cell]] = [
        [
            *(row[key] for key in ("signal", "part", "order", "mean", "deviation", "expected", "chance")),
            Verdict.CAUTION if row["chance"] < _ODD else Verdict.PASSED,
        ]
        for row in repeats
    ]
    titles = ("force", "", "order", "mean", "deviation of a run", "explained by noise", "chance", "")
    return Table(caption="Repeats", columns=[Column(title=title) for title in titles], rows=rows)
