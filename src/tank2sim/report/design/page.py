"""The page of a designed campaign: figures against the usual matrix, where the runs are, what matters, and the runs."""

from __future__ import annotations

from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, notices_section
from tank2sim.report.design.charts import certainty_charts, figure_words, run_planes
from tank2sim.report.json_values import Json
from tank2sim.units import in_words

_FIGURES = (
    "Standard errors of the figures of the ship that the reduction of the tests will give, from the errors of the "
    "gauges alone, by the plan and by the usual matrix in the same time, but at least once. The ratio of variances is "
    "a mean over the ships that the card may be.\n\nErrors common to the whole campaign (calibration, alignment, "
    "scale) are the same in both."
)
_RUNS = (
    "The area of a point is the number of runs. Runs marked as checks are there to show whether a polynomial of third "
    "order holds between the extremes."
)
_COEFFICIENTS = (
    "Standard errors of the coefficients (prime), and the share of the variance of each figure that would go if one of "
    "them were known exactly."
)


def campaign_design_page(found: Json) -> Page:
    """The page, from the JSON of ``tank2sim design`` of a campaign."""
    needed, hours = found["hours_for_usual_certainty"], found["hours"]
    model, reach = found["model"], found["range"]
    cards = [
        KeyFigure(label="Runs", value=len(found["runs"]), note=f"in {found['hours_used']:.3g} h"),
        KeyFigure(
            label="Time for the certainty of the usual matrix",
            value="none found" if needed is None else 100 * needed / hours,
            unit="" if needed is None else "%",
            note="" if needed is None else f"{needed:.3g} h in place of {hours:.3g} h",
        ),
    ]
    cards += [_key_figure(name, row) for name, row in found["figures"].items()]
    subtitle = (
        f"model {model['length_m']:.3g} m at {model['speed_mps']:.3g} m/s; drift to {reach['drift_deg']:.3g} deg, "
        f"rudder to {reach['rudder_deg']:.3g} deg, r' to {reach['yaw_rate_prime']:.2g}"
    )
    charts = [Illustration(chart=chart, half=True) for chart in certainty_charts(found, "hours", "h")]
    sections = [
        Section(heading="Certainty of the figures", text=_FIGURES, charts=charts, tables=[figure_table(found)]),
        Section(
            heading="Where the runs are",
            text=_RUNS,
            charts=[Illustration(chart=chart, half=True) for chart in run_planes(found)],
        ),
        Section(heading="Coefficients that matter", text=_COEFFICIENTS, tables=[coefficient_table(found)]),
        Section(heading="The plan", tables=[_runs(found)]),
        *notices_section(found["notices"]),
    ]
    return Page(
        title=f"{found['ship']}: the next captive campaign",
        subtitle=subtitle,
        verdict=_verdict(needed, hours, "h", "the usual matrix"),
        figures=cards,
        sections=sections,
    )


def _key_figure(name: str, row: Json) -> KeyFigure:
    unit = in_words(name.partition("@")[0])[1]
    label = figure_words(name)
    note = f"± {row['design']:.2g}; usual programme ± {row['usual']:.2g}"
    return KeyFigure(label=label[:1].upper() + label[1:], value=row["value"], unit=unit, note=note)


def _verdict(needed: float | None, whole: float, unit: str, usual: str) -> str:
    if needed is None:
        return f"In {whole:.3g} {unit} the plan does not reach the certainty of {usual}."
    return (
        f"The plan reaches in {needed:.3g} {unit} the certainty that {usual} has in {whole:.3g} {unit}: "
        f"{100 * needed / whole:.0f} % of the time."
    )


def figure_table(found: Json) -> Table:
    """Figures with their standard errors by the design and by the usual programme."""
    rows: list[list[Cell]] = [
        [
            figure_words(name),
            row["value"],
            row["design"],
            row["usual"],
            row["design"] / row["usual"],
            row["variance_ratio"],
        ]
        for name, row in found["figures"].items()
    ]
    heads = ("figure", "value", "design", "usual", "ratio", "ratio of variances")
    return Table(
        caption="Figures and their standard errors",
        columns=[Column(title=head, digits=4) for place, head in enumerate(heads)],
        rows=rows,
    )


def coefficient_table(found: Json) -> Table:
    """Coefficients with their standard errors and shares, those with the largest share first."""
    names = list(found["figures"])
    order = sorted(
        found["coefficients"].items(), key=lambda item: -max(item[1]["share_of_variance"].values(), default=0.0)
    )
    rows: list[list[Cell]] = []
    for name, row in order:
        shares: list[Cell] = [
            None if (share := row["share_of_variance"].get(figure)) is None else 100 * share for figure in names
        ]
        rows.append([name, row["value"], row["design"], row["usual"], *shares])
    return Table(
        caption="Coefficients",
        columns=[
            Column(title=""),
            Column(title="value"),
            Column(title="design", digits=3),
            Column(title="usual", digits=3),
            *(Column(title=figure_words(figure), unit="%", digits=2) for figure in names),
        ],
        rows=rows,
    )


def _runs(found: Json) -> Table:
    heads = {
        "run": ("run", ""),
        "type": ("type", ""),
        "drift_deg": ("drift", "deg"),
        "rudder_deg": ("rudder", "deg"),
        "frequency_radps": ("frequency", "rad/s"),
        "sway_amplitude_m": ("sway amplitude", "m"),
        "yaw_rate_amplitude_degps": ("yaw rate", "deg/s"),
        "heading_amplitude_deg": ("heading", "deg"),
        "cycles": ("cycles", ""),
        "record_s": ("record", "s"),
        "tank_min": ("tank", "min"),
        "purpose": ("purpose", ""),
    }
    rows: list[list[Cell]] = [
        [run[key].replace("_", " ") if key == "type" else run[key] for key in heads] for run in found["runs"]
    ]
    columns = [Column(title=title, unit=unit, digits=3) for title, unit in heads.values()]
    return Table(caption="Runs in their order", columns=columns, rows=rows)


_TRIAL = (
    "Standard errors of the figures before the trial, after the plan, and after the usual set in the same time, as far "
    "as the errors of the card and of the sensors go. Windows of the records have an unknown first state and unknown "
    "constant disturbances, as wind and waves make."
)


def trial_design_page(found: Json) -> Page:
    """The page, from the JSON of ``tank2sim design --trial``."""
    needed, minutes = found["minutes_for_usual_certainty"], found["minutes"]
    cards = [
        KeyFigure(
            label="Manoeuvres",
            value=sum(row["repeats"] for row in found["manoeuvres"]),
            note=f"in {found['minutes_used']:.3g} min",
        ),
        KeyFigure(
            label="Time for the certainty of the usual set",
            value="none found" if needed is None else 100 * needed / minutes,
            unit="" if needed is None else "%",
            note="" if needed is None else f"{needed:.3g} min in place of {minutes:.3g} min",
        ),
    ]
    cards += [_key_figure(name, row) for name, row in found["figures"].items()]
    figures: list[list[Cell]] = [
        [figure_words(name), row["value"], row["before"], row["design"], row["usual"], row["design"] / row["usual"]]
        for name, row in found["figures"].items()
    ]
    heads = ("figure", "value", "before", "design", "usual", "ratio")
    manoeuvres: list[list[Cell]] = [list(row.values()) for row in found["manoeuvres"]]
    coefficients: list[list[Cell]] = [
        [name, row["standard_error"], row["design"], row["usual"]] for name, row in found["coefficients"].items()
    ]
    sections = [
        Section(
            heading="Certainty of the figures",
            text=_TRIAL,
            charts=[Illustration(chart=chart, half=True) for chart in certainty_charts(found, "minutes", "min")],
            tables=[
                Table(
                    caption="Figures and their standard errors",
                    columns=[Column(title=head, digits=3) for head in heads],
                    rows=figures,
                )
            ],
        ),
        Section(
            heading="The plan",
            tables=[
                Table(
                    caption="Manoeuvres",
                    columns=[
                        Column(title="manoeuvre"),
                        Column(title="repeats"),
                        Column(title="length", unit="s"),
                        Column(title="with approach", unit="min", digits=3),
                        Column(title="orders"),
                    ],
                    rows=manoeuvres,
                )
            ],
        ),
        Section(
            heading="Coefficients",
            text="Standard errors before the trial (prime), and after it over those before.",
            tables=[
                Table(
                    caption="Coefficients",
                    columns=[Column(title=head, digits=3) for head in ("", "before", "design", "usual")],
                    rows=coefficients,
                )
            ],
        ),
        *notices_section(found["notices"]),
    ]
    usual = found["usual_set"]
    subtitle = f"usual set: {', '.join(usual['manoeuvres'])}, {usual['minutes']:.3g} min"
    return Page(
        title=f"{found['ship']}: the next sea trial",
        subtitle=subtitle,
        verdict=_verdict(needed, minutes, "min", "the usual set"),
        figures=cards,
        sections=sections,
    )
