"""The page of a captive campaign: derivatives, how they were found, and every chart of the reduction."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.identification.captive.tables import LEFT_OUT, prediction_rows
from tank2sim.report.captive.charts import (
    Across,
    ForceLoop,
    ForceSeries,
    Harmonics,
    Residual,
    derivative_certainty_chart,
    force_chart,
    harmonic_chart,
    loop_chart,
    residual_chart,
)
from tank2sim.report.json_values import Json

_FORCES = {"X": "surge force", "Y": "sway force", "N": "yaw moment"}


def reduction_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim reduce``."""
    derivatives = found["derivatives"]
    estimated = [name for name, derivative in derivatives.items() if derivative["origin"] == "estimated"]
    measured = len(derivatives) - len(estimated)
    runs = len(found["runs"])
    worst = _worst_predictions(found["prediction_errors"])
    figures = [
        KeyFigure(
            label="Derivatives measured",
            value=f"{measured} of {len(derivatives)}",
            note=f"by {runs} runs; {len(found['not_used'])} left out",
        ),
        *(
            KeyFigure(
                label=f"{_FORCES[force].capitalize()} predicted within",
                value=float(f"{percent:.2g}"),
                unit="%",
                note=f"of its range, in {kind}, the worst type of run",
            )
            for force, (percent, kind) in worst.items()
        ),
        KeyFigure(
            label="Derivatives estimated",
            value=len(estimated),
            verdict=Verdict.CAUTION if estimated else Verdict.NONE,
            note=", ".join(estimated) or "none",
        ),
    ]
    charts = reduction_charts(found)
    certainty = charts.pop("certainty")
    residuals = charts.pop("residuals")
    every = derivatives | found.get("heel_derivatives", {})
    sections = [
        Section(
            heading="Derivatives",
            text="One weighted regression over the whole campaign; in the table, next to it the tests one after the "
            "other.",
            tables=[_derivatives(every)],
            charts=[Illustration(chart=certainty, caption=_CERTAINTY)],
            notes=found["warnings"],
        ),
        *_chart_sections(charts),
        Section(
            heading="Each run predicted from the others",
            text="Root mean square error, % of the force's range.",
            tables=[_predictions(found["prediction_errors"])],
            charts=[Illustration(chart=residuals)],
        ),
        *_left_out(found["selection"]),
        *_budget(found.get("uncertainty_budget")),
    ]
    return Page(
        title=found["model"]["name"],
        subtitle="Captive model tests, reduced",
        verdict=_verdict(measured, len(derivatives), worst),
        figures=figures,
        sections=sections,
    )


_CERTAINTY = "A derivative whose standard error is as large as its value (red) shows its order of magnitude only."


def _worst_predictions(errors: Json) -> dict[str, tuple[float, str]]:
    """The largest prediction error of each force, % of its range, and the type of the runs that have it."""
    found: dict[str, tuple[float, str]] = {}
    for kind, percents in prediction_rows(errors).items():
        for force, percent in percents.items():
            if force in _FORCES and percent is not None and percent > found.get(force, (0.0, ""))[0]:
                found[force] = percent, kind.replace("_", " ")
    return {force: found[force] for force in _FORCES if force in found}


def _verdict(measured: int, count: int, worst: Mapping[str, tuple[float, str]]) -> str:
    text = f"{measured} of {count} derivatives are measured"
    if not worst:
        return f"{text}."
    errors = ", ".join(f"{_FORCES[force]} within {percent:.2g} %" for force, (percent, _) in worst.items())
    return f"{text}. Each run is predicted from all the others, as a share of the range: {errors}."


def reduction_charts(found: Json) -> dict[str, alt.TopLevelMixin]:
    """Return the charts by file stem: fits with bands, harmonics, loops, residuals."""
    charts: dict[str, alt.TopLevelMixin] = {stem: _plot_chart(plot) for stem, plot in found["plots"].items()}
    residuals = [
        Residual(
            run=row["run"],
            kind=row["type"].replace("_", " "),
            force=force,
            value=-row["error"] / row["standard_error"],
        )
        for force, rows in found["leave_one_out"].items()
        for row in rows
    ]
    title = "Each run against its prediction from all the others"
    return {
        "certainty": derivative_certainty_chart(found["derivatives"], title="Certainty of the derivatives"),
        **charts,
        "residuals": residual_chart(residuals, title=title),
    }


def _plot_chart(plot: Json) -> alt.TopLevelMixin:
    title = plot["title"]
    if plot["kind"] == "harmonics":
        return harmonic_chart([Harmonics(**run) for run in plot["runs"]], plot["up"], title=title)
    across = Across(title=plot["across"], unit=plot["unit"])
    if plot["kind"] == "force":
        return force_chart([ForceSeries(**series) for series in plot["series"]], across, plot["up"], title=title)
    loops = [
        ForceLoop(
            label=loop["label"],
            motion=loop["measured"]["motion"],
            forces={force: loop["measured"][force] for force in _LOOPS},
            fitted_motion=loop["fitted"]["motion"],
            fitted={force: loop["fitted"][force] for force in _LOOPS},
        )
        for loop in plot["loops"]
    ]
    return loop_chart(loops, across, _LOOPS, title=title)


_LOOPS = {"Y": "Y of the water (N)", "N": "N of the water (N m)"}


def _derivatives(derivatives: Json) -> Table:
    rows: list[list[Cell]] = []
    for name, derivative in derivatives.items():
        stepwise: list[Cell] = [None, None, ""]
        if steps := derivative.get("paper_order"):
            stepwise = [1e5 * steps["value"], 1e5 * steps["standard_error"], steps["found_in"].replace("_", " ")]
        regression = 1e5 * derivative["value"], 1e5 * derivative["standard_error"]
        rows.append([name, *regression, *stepwise, derivative["origin"]])
    heads = ("", "regression", "±", "test by test", "±", "from tests", "origin")
    columns = [Column(title=head) for head in heads]
    return Table(caption="Derivatives, prime system, times 10⁵", columns=columns, rows=rows)


def _budget(budget: Json) -> list[Section]:
    """The uncertainty budget; nothing for a result of an older version."""
    if not budget:
        return []
    sources: Mapping[str, str] = budget["sources"]
    rows: list[list[Cell]] = [
        [
            name,
            1e5 * row["value"],
            *(100 * row["shares"][source] for source in sources),
            1e5 * row["combined"],
            1e5 * row["expanded"],
        ]
        for name, row in budget["derivatives"].items()
    ]
    columns = [
        *(Column(title=""), Column(title="value")),
        *(Column(title=source, unit="%", digits=3) for source in sources),
        *(Column(title="combined", digits=3), Column(title="expanded, k = 2", digits=3)),
    ]
    meanings: list[list[Cell]] = [[source, words] for source, words in sources.items()]
    tables = [
        Table(caption="Shares of the variance; values and uncertainties prime, times 10⁵", columns=columns, rows=rows),
        Table(caption="Sources", columns=[Column(title=""), Column(title="")], rows=meanings),
    ]
    notes = []
    if budget["not_stated"]:
        notes.append(f"Not stated in [uncertainty], and taken as zero: {', '.join(budget['not_stated'])}.")
    if budget["blockage_speed_relative"] and "blockage_relative" in budget["not_stated"]:
        percent = 100 * budget["blockage_speed_relative"]
        notes.append(f"By Schuster's formula the walls raise the speed past the model by {percent:.2g} %.")
    text = "After ITTC 7.5-02-06-04: the combined uncertainty is the standard error of the result."
    return [Section(heading="Uncertainty budget", text=text, tables=tables, notes=notes, folded=True)]


def _left_out(selection: Json) -> list[Section]:
    rows: list[list[Cell]] = [
        [choice["name"], choice["reason"], choice["explanation"]]
        for choices in selection.values()
        for choice in choices
        if choice["reason"] in LEFT_OUT
    ]
    if not rows:
        return []
    columns = [Column(title=head) for head in ("term", "reason", "why")]
    text = "Terms that the runs excite and that are not in the card."
    table = Table(caption="Left out", columns=columns, rows=rows)
    return [Section(heading="Which terms, and why", text=text, tables=[table], folded=True)]


def _predictions(errors: Json) -> Table:
    rows: list[list[Cell]] = [
        [kind.replace("_", " "), *(percent.get(force) for force in _FORCES)]
        for kind, percent in prediction_rows(errors).items()
    ]
    columns = [Column(title="runs of type"), *(Column(title=force, unit="%", digits=2) for force in _FORCES)]
    return Table(caption="Prediction errors", columns=columns, rows=rows)


_AGAINST_MOTION = "Points: measured, bars: their 95 % intervals. Lines: the fit; shaded: its 95 % band."


def _chart_sections(charts: Mapping[str, alt.TopLevelMixin]) -> list[Section]:
    """A section for each force and its angles and amplitudes, one for what concerns all."""
    groups: dict[str, list[Illustration]] = {}
    for stem, chart in charts.items():
        words = _FORCES.get(stem.rpartition("_")[2])
        heading = f"{words.capitalize()} against motion" if words else _LOOPS_HEADING
        illustration = Illustration(chart=chart, half=bool(words) and not stem.startswith("harmonics"))
        groups.setdefault(heading, []).append(illustration)
    return [
        Section(
            heading=heading,
            text="" if heading == _LOOPS_HEADING else _AGAINST_MOTION,
            charts=illustrations,
            folded=heading == _LOOPS_HEADING,
        )
        for heading, illustrations in groups.items()
    ]


_LOOPS_HEADING = "Loops of the oscillating runs"
