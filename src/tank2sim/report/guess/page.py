"""The page of a guessed ship: figures before and after, what is settled and what stays open."""

from __future__ import annotations

import altair as alt

from tank2sim.answer.charts.parts import Chart
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, notices_section
from tank2sim.report.json_values import Json

_FIGURES = (
    "Nine of ten ships lie in each interval: wide by the dimensions alone, narrow by the figures that were given, too. "
    "Figures that were not given are predictions."
)
_NUMBERS = (
    "A number is settled where the figures take half of its variance away or more. Open numbers have the errors of the "
    "prior: manoeuvres of another kind than those given may depend on them."
)
_HELP = (
    "Mean share of the variance of all figures not given that one more figure would take away, measured with the usual "
    "error, by the covariances of the ships found."
)


def guess_page(found: Json) -> Page:
    """The page, from the JSON of ``tank2sim guess``."""
    figures, dimensions = found["figures"], found["dimensions"]
    size = f"{dimensions['length_m']:g} x {dimensions['beam_m']:g} x {dimensions['draught_m']:g} m"
    given = sum(entry["given"] is not None for entry in figures.values())
    settled = [name for name, row in found["parameters"].items() if row["settled"]]
    cards = [_key_figure(key, figures[key]) for key in _FIRST if key in figures]
    note = f"{len(settled)} of {len(found['parameters'])} numbers are settled by them"
    cards.append(KeyFigure(label="Figures given", value=given, note=note))
    if found["next_figures"]:
        best, share = next(iter(found["next_figures"].items()))
        note = f"takes {100 * share:.0f} % of the variance of the others away"
        cards.append(KeyFigure(label="Would help most", value=_named(best), note=note))
    parts = [
        Section(
            heading="Figures",
            text=_FIGURES,
            charts=[Illustration(chart=figures_chart(found))],
            tables=[_figure_table(found)],
        ),
        Section(heading="What the figures settle", text=_NUMBERS, tables=[_number_table(found)]),
    ]
    if found["next_figures"]:
        parts.append(Section(heading="Which further figure would help most", text=_HELP, tables=[_help(found)]))
    parts += notices_section(found["notices"])
    subtitle = f"{size}, block coefficient {dimensions['block']:g}, {dimensions['speed_kn']:g} kn"
    name = "A guessed ship" if found["ship"] == "guessed ship" else f"{found['ship']}: a guess"
    verdict = _verdict(figures, given)
    return Page(title=name, subtitle=subtitle, verdict=verdict, figures=cards, sections=parts)


_FIRST = ("tactical_diameter@turn35", "overshoot_1@zigzag10", "overshoot_1@zigzag20")
"""The figures at the top of the page."""


def _key_figure(key: str, entry: Json) -> KeyFigure:
    found = entry["found"]
    note = f"{format_number(found['p5'], 3)} to {format_number(found['p95'], 3)} {entry['unit']}, nine of ten ships"
    name = _named(key)
    return KeyFigure(label=name[:1].upper() + name[1:], value=found["p50"], unit=entry["unit"], note=note)


def _verdict(figures: Json, given: int) -> str:
    """How far the figures given narrow those that were not."""
    others = {key: entry for key, entry in figures.items() if entry["given"] is None}
    if not given:
        return "A ship of these dimensions, and no more: more figures would narrow the intervals below."
    text = f"A ship of these dimensions that has the {given} figures given"
    if not others:
        return f"{text}."
    narrower = [
        1 - (entry["found"]["p95"] - entry["found"]["p5"]) / (before["p95"] - before["p5"])
        for entry in others.values()
        if (before := entry["by_dimensions"])["p95"] > before["p5"]
    ]
    share = 100 * sum(narrower) / len(narrower) if narrower else 0.0
    return f"{text}. They make the intervals of the others {share:.0f} % narrower in the mean."


_MANOEUVRES = {"turn35": "turn 35°", "zigzag10": "zigzag 10/10", "zigzag20": "zigzag 20/20"}


def _named(key: str) -> str:
    """A figure as a reader sees it: ``overshoot_1@zigzag10`` is ``zigzag 10/10: overshoot 1``."""
    figure, _, manoeuvre = key.partition("@")
    return f"{_MANOEUVRES.get(manoeuvre, manoeuvre)}: {figure.replace('_', ' ')}"


def figures_chart(found: Json) -> alt.TopLevelMixin:
    """Intervals of each figure over the median found: by the dimensions alone, with the figures, and as given."""
    rows = []
    anything = any(entry["given"] is not None for entry in found["figures"].values())
    ways = [("by dimensions", "by_dimensions"), *([("with the figures", "found")] if anything else [])]
    for key, entry in found["figures"].items():
        middle = entry["found"]["p50"]
        label = f"{_named(key)}, {format_number(middle, 3)} {entry['unit']}"
        for kind, name in ways:
            band = entry[name]
            rows.append({"figure": label, "kind": kind, "low": band["p5"] / middle, "high": band["p95"] / middle})
        if entry["given"] is not None:
            share = entry["given"] / middle
            rows.append({"figure": label, "kind": "given", "low": share, "high": share})
    base = Chart(alt.Data(values=rows))
    title = "times the median"
    x = alt.X("low:Q", title=title, scale=alt.Scale(type="log", nice=False), axis=alt.Axis(format="~g"))
    y = alt.Y("figure:N", title=None, sort=None, axis=alt.Axis(labelExpr="split(datum.label, ': ')"))
    legend = alt.Legend() if anything else None
    colour = alt.Color("kind:N", title=None, sort=["by dimensions", "with the figures", "given"], legend=legend)
    offset = alt.YOffset("kind:N", sort=["by dimensions", "with the figures", "given"])
    bars = base.transform_filter("datum.kind != 'given'").mark_bar(height=6)
    points = base.transform_filter("datum.kind == 'given'").mark_point(filled=True, size=50)
    layers = [bars.encode(x=x, x2="high:Q", y=y, color=colour, yOffset=offset)]
    if anything:
        layers.append(points.encode(x=x, y=y, color=colour))
    chart: alt.TopLevelMixin = alt.layer(*layers).properties(
        width=560, height=36 * len(found["figures"]), title="Figures that nine of ten such ships have"
    )
    return chart


def _figure_table(found: Json) -> Table:
    heads = ("figure", "unit", "given", "± standard error", "by dimensions, 5 %", "95 %", "found, 5 %", "50 %", "95 %")
    rows: list[list[Cell]] = []
    for key, entry in found["figures"].items():
        before, after = entry["by_dimensions"], entry["found"]
        given = entry["given"], entry["standard_error"]
        rows.append(
            [_named(key), entry["unit"], *given, before["p5"], before["p95"], *(after[q] for q in ("p5", "p50", "p95"))]
        )
    return Table(caption="Figures, m and deg", columns=[Column(title=head) for head in heads], rows=rows, folded=True)


def _number_table(found: Json) -> Table:
    heads = ("number", "by dimensions", "± standard error", "with the figures", "± standard error", "")
    rows: list[list[Cell]] = [
        [
            name,
            *(row[key] for key in ("by_dimensions", "by_dimensions_standard_error", "value", "standard_error")),
            "settled" if row["settled"] else "open",
        ]
        for name, row in found["parameters"].items()
    ]
    return Table(caption="Numbers of the card, prime", columns=[Column(title=head) for head in heads], rows=rows)


def _help(found: Json) -> Table:
    rows: list[list[Cell]] = [[_named(key), 100 * share] for key, share in found["next_figures"].items()]
    columns = [Column(title="figure"), Column(title="variance gone", unit="%", digits=2)]
    return Table(caption="One more figure", columns=columns, rows=rows)
