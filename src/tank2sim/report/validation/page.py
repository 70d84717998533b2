"""The validation report of a simulation model, with the statements that ITTC 7.5-02-06-03 asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.validation.study import ComparisonOutcome
from tank2sim.answer.charts.columns import motions
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR
from tank2sim.report.json_values import Json
from tank2sim.report.validation.charts import COMPARISON_ERRORS, comparison_error_chart
from tank2sim.results.imo import imo_section
from tank2sim.units import in_words

_METHOD = (
    "E = S − D is the simulated less the measured figure. U_val = 2 √(u_num² + u_input² + u_D²) is what numerics, "
    "coefficients and data leave open, with 95 % probability (ASME V&V 20; ITTC 7.5-03-01-01). Where |E| ≤ U_val the "
    "error of the model is hidden in U_val, and the figure is validated at that level; where |E| > U_val the model "
    "errs by about E. A level above the required one is of little use: such a figure counts as too uncertain. A trial "
    "that the card was identified from can refute it, and not validate it: its figures are only fitted."
)
_SOURCES_OF_U = (
    "u_num comes from repeating the simulation with half the step (three times the change, Roache's factor for two "
    "grids, at the first order); u_input from ships drawn within the standard errors of the card, with "
    "their covariance where one is next to it; u_D from evaluating the trial again with its noise and "
    "simulating it from there, from the errors of the measured point (1 % of the length), of the heading's zero "
    "(0.25 deg) and of the times of the orders, and from repeats of one manoeuvre where there are any."
)
_CLOSED_LOOP = (
    "Turns and zigzags are steered as the manoeuvre asks, from the measured state at the execute, with the rudder rate "
    "and the delay of the record."
)
_REPLAY = (
    "Each trial is simulated freely over its whole length with the recorded rudder and revolutions, from the initial "
    "state that suits it best. Errors add up in position; no verdict is taken from these."
)
_NUMERICAL = (
    "Classical Runge-Kutta of the fourth order with a fixed step. The change of each figure when the step is halved, "
    "the numerical uncertainty from it, and the deviation by the errors of the coefficients."
)


def validation_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim validate``."""
    return Page(
        title=found["ship"],
        subtitle="Validation of the manoeuvring simulation model, in the manner of ITTC 7.5-02-06-03",
        verdict=found["verdict"],
        figures=_figures(found),
        sections=[
            _comparison(found["figures"], found["verdict"]),
            *([_standards(found["imo"])] if found["imo"] else []),
            *([_replays(found["replays"])] if found["replays"] else []),
            *([_method(found["figures"])] if found["figures"] else []),
            _verification(found["verification"]),
            _documentation(found["documentation"]),
            _coefficients(found["coefficients"]),
            _causes(found["propulsion"]),
            *notices_section(found["notices"]),
        ],
    )


def _figures(found: Json) -> list[KeyFigure]:
    figures, counts = found["figures"], found["counts"]
    if not figures:
        shown = [KeyFigure(label="Validation", value="none", verdict=Verdict.CAUTION, note="no trial to compare with")]
    else:
        validated = counts[ComparisonOutcome.VALIDATED]
        incomplete = Verdict.FAILED if counts[ComparisonOutcome.REFUTED] else Verdict.CAUTION
        verdict = Verdict.PASSED if validated == len(figures) else incomplete
        value = f"{validated} of {len(figures)}"
        shown = [KeyFigure(label="Figures validated", value=value, verdict=verdict)]
        errors = [
            abs(figure["error"] / figure["measured"])
            for figure in figures
            if figure["error"] is not None and figure["measured"]
        ]
        levels = [figure["level_percent"] for figure in figures if figure["level_percent"] is not None]
        if errors:
            shown.append(KeyFigure(label="Median error |E|", value=100 * float(np.median(errors)), unit="% of D"))
        if levels:
            shown.append(KeyFigure(label="Median level U_val", value=float(np.median(levels)), unit="% of D"))
    numerical = [abs(row["U_num"] / row["value"]) for row in found["verification"] if row["U_num"] and row["value"]]
    if numerical:
        shown.append(KeyFigure(label="Largest numerical uncertainty", value=100 * max(numerical), unit="%"))
    return shown


def _documentation(items: Mapping[str, str]) -> Section:
    table = Table(
        caption="Documentation asked for by ITTC 7.5-02-06-03.",
        columns=[Column(title="item"), Column(title="here")],
        rows=[[item, text] for item, text in items.items()],
    )
    return Section(heading="The simulation model", tables=[table])


def _coefficients(coefficients: Mapping[str, Json]) -> Section:
    rows: list[list[Cell]] = [
        [
            name,
            1000 * row["value"],
            1000 * row["standard_error"],
            100 * row["standard_error"] / abs(row["value"]),
            "stated" if row["stated"] else "assumed",
        ]
        for name, row in coefficients.items()
    ]
    columns = [
        Column(title="coefficient"),
        Column(title="value"),
        Column(title="standard error", digits=3),
        Column(title="of the value", unit="%", digits=3),
        Column(title="error"),
    ]
    text = f"Where the card states no standard error, {DEFAULT_RELATIVE_ERROR:.0%} of the value is assumed."
    caption = "Prime system, rudder positive to starboard, times 1000."
    return Section(heading="Coefficients", text=text, tables=[Table(caption=caption, columns=columns, rows=rows)])


def _verification(verified: Sequence[Json]) -> Section:
    rows: list[list[Cell]] = []
    for row in verified:
        value, deviation = row["value"], row["deviation"]
        percent = None if deviation is None or not value else 100 * deviation / abs(value)
        texts = _text(value), _text(row["halving"], 2), _text(row["U_num"], 2), _text(deviation, 3)
        rows.append([row["trial"], _named(row["name"]), *texts, percent])
    columns = [
        Column(title="trial"),
        Column(title="figure"),
        Column(title="value"),
        Column(title="by half the step", digits=2),
        Column(title="U_num", digits=2),
        Column(title="u_input", digits=3),
        Column(title="u_input", unit="%", digits=3),
    ]
    table = Table(caption="Standard trials at the speed of expansion in calm water.", columns=columns, rows=rows)
    return Section(heading="Verification and uncertainty of the simulation", text=_NUMERICAL, tables=[table])


def _comparison(figures: Sequence[Json], verdict: str) -> Section:
    if not figures:
        text = "No turning circle or zigzag was given: the model is documented and verified here, and not validated."
        return Section(heading="Validation", text=text, notes=[verdict])
    manoeuvres = {figure["trial"]: figure["manoeuvre"] for figure in figures}
    numbers = {trial: number for number, trial in enumerate(manoeuvres, start=1)}
    rows: list[list[Cell]] = [
        [
            f"{numbers[figure['trial']]}: {_named(figure['name'])}",
            *(_text(figure[key]) for key in ("measured", "simulated", "error")),
            *(_text(figure[key], 3) for key in ("inputs", "data", "uncertainty")),
            figure["level_percent"],
            figure["outcome"],
        ]
        for figure in figures
    ]
    benchmark = Table(
        caption="Benchmark data.",
        columns=[Column(title="no."), Column(title="trial"), Column(title="manoeuvre, as recognised")],
        rows=[[numbers[trial], trial, manoeuvre] for trial, manoeuvre in manoeuvres.items()],
    )
    columns = [
        *(Column(title=title) for title in ("no.: figure", "D", "S", "E")),
        *(Column(title=title, digits=2) for title in ("u_input", "u_D")),
        Column(title="U_val", digits=3),
        Column(title="level", unit="%", digits=3),
        Column(title="verdict"),
    ]
    table = Table(caption="Errors and their uncertainty.", columns=columns, rows=rows, folded=True)
    chart = Illustration(chart=comparison_error_chart(figures, numbers), caption=COMPARISON_ERRORS)
    text = f"{verdict[:1].upper()}{verdict[1:]}."
    return Section(heading="Validation", text=text, tables=[benchmark, table], charts=[chart])


def _method(figures: Sequence[Json]) -> Section:
    """How the verdicts come about."""
    shares = (100 * figure["numerical"] / abs(figure["measured"]) for figure in figures if figure["measured"])
    numerical = f"u_num is {format_number(max(shares, default=0.0), 2)} % of D at most."
    level = f"The level is U_val in per cent of D; required here: {figures[0]['required_percent']:g} %."
    text = f"{_METHOD} {level}\n\n{_SOURCES_OF_U} {numerical}\n\n{_CLOSED_LOOP}"
    return Section(heading="Method", text=text)


def _text(value: float | None, digits: int = 4) -> str | None:
    """A number for a column of many units, whose numbers share no decimals."""
    return None if value is None else format_number(value, digits)


def _named(name: str) -> str:
    words, unit = in_words(name)
    return f"{words} ({unit})" if unit else words


def _replays(replays: Sequence[Json]) -> Section:
    keys = ("signal", "unit", "rms_error", "percent_of_range", "noise")
    rows: list[list[Cell]] = [
        [replay["trial"], *(error[key] for key in keys)] for replay in replays for error in replay["errors"]
    ]
    columns = [
        Column(title="trial"),
        Column(title="signal"),
        Column(title="unit"),
        Column(title="rms error", digits=3),
        Column(title="of its range", unit="%", digits=3),
        Column(title="noise", digits=2),
    ]
    charts = [
        chart
        for replay in replays
        for chart in motions(
            replay["trial"], {key: replay[key] for key in ("measured", "simulated")}, measured=["measured"]
        )
    ]
    table = Table(caption="Free-running replays with the recorded inputs.", columns=columns, rows=rows)
    return Section(heading="Replays", text=_REPLAY, tables=[table], charts=charts)


def _standards(criteria: Sequence[Json]) -> Section:
    text = "Figures of the model next to the standards; they hold as far as the figures above are validated."
    found = [ImoCriterion(**criterion) for criterion in criteria]
    return imo_section(found, heading="Standard manoeuvres", text=text)


_CAUSES = (
    "Forces that the structure has not: higher orders, heel, flow memory, interaction of rudder and propeller.",
    "Coefficients that no test of the source excites, or that are estimated (see the source and the comments).",
    "Scale effects between model and ship, in resistance, wake and rudder flow.",
    "Weather, current, depth and loading of the trials, as far as no effect of the card holds them.",
    "Errors of the coefficients that go together, where no covariance is next to the card.",
)
_NO_PROPULSION = "Engine and propeller: the card has none, so loss of revolutions in a turn is in the coefficients."


def _causes(propulsion: bool) -> Section:
    rows: list[list[Cell]] = [[cause] for cause in (*_CAUSES, *([] if propulsion else [_NO_PROPULSION]))]
    text = (
        "Potential causes of an error E (7.5-02-06-03). The command influence gives the dependence of each figure on "
        "each coefficient (sensitivity), the command gap looks for the missing effect."
    )
    table = Table(caption="Potential causes of prediction error.", columns=[Column(title="cause")], rows=rows)
    return Section(heading="Causes of error and sensitivity", text=text, tables=[table])
