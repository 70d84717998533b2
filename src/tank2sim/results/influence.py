"""Results of ``influence``: coefficients of each number on a card, the card tuned to targets, and their charts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tank2sim.analysis.influence.card_influence import FigureErrors, InfluenceStudy
from tank2sim.analysis.influence.figures import figure_label
from tank2sim.analysis.tuning.result import FEWEST, TunedStudy, TunedTarget
from tank2sim.answer.charts.matrix import Matrix
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_chart, row_layers
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layered
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, records_frame, table
from tank2sim.arrays import Array
from tank2sim.cards import Card
from tank2sim.errors import ArgumentError
from tank2sim.results.ensembles import EnsembleResult, figures_section
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

ROWS = 15
"""Parameters in the printed tables, the most influential; the page has all. Project choice: a screen of them."""

TABLE_FIGURES = 3
"""Figures in a printed table of coefficients. Project choice: with pairs of coefficients they fit in 80 columns."""

PAGE_FIGURES = 4
"""Figures in a table of all coefficients: as many as a sheet of paper is wide. Project choice."""

_COEFFICIENTS = (
    "K is the change of a figure in per cent when one number on the card grows by 10 %. Bars are by exact slopes "
    "(10 c/F dF/dc), points by computing the ship again with 10 % more; where they differ, the figure is curved.\n\n"
    "Slopes of steady turns and straight courses are by the implicit function theorem, slopes of manoeuvres by forward "
    "sensitivities through the events, whose times move, too."
)


@dataclass(frozen=True, eq=False, repr=False)
class InfluenceResult(EnsembleResult[InfluenceStudy]):
    """Influence of each number on a card on figures of the ship.

    Parameters
    ----------
    study : InfluenceStudy
    ship : Ship, optional
        The ship (:class:`tank2sim.Ship`); None if the result was read from its JSON.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").influence("steady_radius_m@20")
    >>> float(found.coefficients.loc["derivatives.Nd", "steady_radius_m@20"].round(1))
    -7.6
    """

    study: InfluenceStudy
    ship: Any = None
    command: ClassVar[str] = "influence"
    subject: ClassVar[str] = "influence coefficients"

    @property
    def subtitle(self) -> str:
        """Numbers of parameters and figures."""
        return f"Parameters: {len(self.study.parameters)}. Figures: {len(self.study.figures)}."

    @property
    def figures(self) -> pd.DataFrame:
        """The figures by name, in the units of their names: value and standard error."""
        return records_frame(self.study.figures, ("value", "standard_error"), index="figure")

    @property
    def parameters(self) -> pd.DataFrame:
        """The numbers of the card by dotted key, as its file has them: value and standard error."""
        return records_frame(self.study.parameters, ("value", "standard_error"), index="parameter")

    @property
    def coefficients(self) -> pd.DataFrame:
        """K %, the change of a figure (columns) for 10 % more of a number of the card (rows), by exact slopes."""
        return self._frame(self.study.exact)

    @property
    def differences(self) -> pd.DataFrame:
        """As :attr:`coefficients`, computed with 10 % more; nan where the changed ship does not show the figure."""
        return self._frame(self.study.difference)

    @property
    def variance_shares(self) -> pd.DataFrame:
        """Share of the variance of each figure (columns) that would go if a number (rows) were known exactly."""
        return self._frame(self.study.shares)

    def _frame(self, values: Array) -> pd.DataFrame:
        import pandas as pd

        index = pd.Index(list(self.study.parameters), name="parameter")
        return pd.DataFrame(values.T, index=index, columns=list(self.study.figures))

    @property
    def headline(self) -> tuple[str, ...]:
        """The most influential number of the first figures, or how many targets tuning has met."""
        if self.study.tuned:
            return self._tuned_headline(self.study.tuned)
        parts = []
        for row, text in list(enumerate(self.study.figures))[:3]:
            if order := most_influential(self.study, row):
                change = f"{self.study.exact[row][order[0]]:+.2g} %".replace("-", "−")
                parts.append(f"{figure_label(text)} by {self.study.names[order[0]]} ({change})")
        if not parts:
            return (f"{self.study.ship}: no number of the card moves these figures.",)
        return (f"{self.study.ship}: most influential numbers, for 10 % more: {'; '.join(parts)}.",)

    def _tuned_headline(self, tuned: TunedStudy) -> tuple[str, ...]:
        times = tuned.agreed_times
        joint = () if times is None else (f"The agreed variation was taken {times:+.3g} times.",)
        if tuned.reached:
            count = len(tuned.parameters)
            return (f"{self.study.ship}: every target is met by changing {count} numbers within their bounds.", *joint)
        return (f"{self.study.ship}: {tuned.contradiction_text}.", *joint)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Each figure with its standard error, or with its target."""
        return [self._key_figure(text, figure) for text, figure in self.study.figures.items()]

    def _key_figure(self, text: str, figure: FigureErrors) -> KeyFigure:
        label, unit, tuned = figure_label(text), _unit(text), self.study.tuned
        if tuned is None or text not in tuned.figures:
            note = f"standard error {format_number(figure.standard_error, 2)}"
            return KeyFigure(label, figure.value, unit, note=note)
        note, verdict = f"was {figure.value:.5g} before tuning", Verdict.NONE
        if text in (targets := _targets_of(tuned)):
            target, verdict = targets[text]
            note = f"was {figure.value:.5g}, target {target.relation} {target.wanted:g}"
        return KeyFigure(label, tuned.figures[text], unit, verdict=verdict, note=note)

    @property
    def sections(self) -> Sequence[Section]:
        """The tuning, coefficients, errors of the figures, the agreed variation, all numbers, the ensemble."""
        study = self.study
        return [
            *([self._tuning(study.tuned)] if study.tuned else []),
            self._coefficients(),
            self._uncertainty(),
            *([self._agreed()] if study.agreed else []),
            self._all_coefficients(),
            *([_moves(study.tuned)] if study.tuned else []),
            *([figures_section(study.ensemble)] if study.ensemble else []),
        ]

    def _tuning(self, tuned: TunedStudy) -> Section:
        targets, rows = _targets_of(tuned), []
        for text, figure in self.study.figures.items():
            target, verdict = targets.get(text, (None, None))
            wanted = f"{target.relation} {target.wanted:g}" if target else None
            rows.append([figure_label(text), wanted, figure.value, tuned.figures.get(text), _unit(text), verdict])
        notes = [] if tuned.reached else ["The nearest figures are shown, in least squares of relative misses."]
        moves: list[list[Cell]] = [
            [move.name, move.before, move.after, move.standard_errors] for move in tuned.parameters.values()
        ]
        return Section(
            "Tuning",
            text=f"By the {'fewest' if tuned.by == FEWEST else 'most uncertain'} parameters, each within "
            f"{tuned.within_standard_errors:g} standard errors of the card.",
            charts=[Illustration(moves_chart(tuned))] if tuned.parameters else [],
            tables=[
                table(
                    "Figures before and after",
                    ("figure", "target", "before", "after", "unit", "verdict"),
                    rows,
                    *notes,
                    digits=5,
                ),
                table(
                    f"Parameters changed: {len(moves)}, the largest moves first",
                    ("parameter", "before", "after", "move (standard errors)"),
                    moves[:ROWS],
                    digits=5,
                ),
            ],
        )

    def _coefficients(self) -> Section:
        """Charts, and coefficients of the most influential parameters, a few figures in each table."""
        data, figures = self.study, list(self.study.figures)
        largest = np.nan_to_num(np.abs(data.exact)).max(axis=0)
        order = [place for place in np.argsort(-largest, kind="stable") if largest[place] > 0][:ROWS]
        tables = []
        for rows in _parts(len(data.figures), TABLE_FIGURES):
            cells: list[list[Cell]] = [
                [data.names[k], *(_pair(data.exact[row, k], data.difference[row, k]) for row in rows)] for k in order
            ]
            heads = ("parameter", *(figures[row] for row in rows))
            tables.append(table("K %: change for 10 % more, by exact slopes | by the 10 % difference", heads, cells))
        drawn = influence_charts(data)
        charts = [Illustration(chart, half=len(drawn) > 1) for chart in drawn]
        return Section("Influence coefficients", text=_COEFFICIENTS, charts=charts, tables=tables)

    def _uncertainty(self) -> Section:
        rows: list[list[Cell]] = []
        for text, figure in self.study.figures.items():
            relative = 100 * abs(figure.standard_error / figure.value) if figure.value else None
            error = figure.standard_error
            shares = sorted(figure.share_of_variance.items(), key=lambda item: -item[1])[:3]
            names = [f"{self.study.parameters[key].name} {100 * share:.0f} %" for key, share in shares if share]
            rows.append([figure_label(text), figure.value, _unit(text), error, relative, ", ".join(names)])
        heads = ("figure", "value", "unit", "standard error", "relative (%)", "most of it from")
        known = any(figure.standard_error > 0 for figure in self.study.figures.values())
        return Section(
            f"Errors of the figures{', standard errors assumed' * self.study.assumed_errors}",
            text=f"By the delta method: {self.study.standard_errors}. The share of a number is the part of the "
            "variance that would go if it were known exactly; shares of correlated numbers overlap.",
            charts=[Illustration(variance_chart(self.study))] if known else [],
            tables=[table("Figures and their standard errors", heads, rows)],
        )

    def _agreed(self) -> Section:
        agreed = self.study.agreed
        assert agreed is not None
        changes: list[list[Cell]] = [
            [self.study.parameters[key].name, percent] for key, percent in agreed.percent.items()
        ]
        figures: list[list[Cell]] = [
            [figure_label(text), *asdict(change).values()] for text, change in agreed.figures.items()
        ]
        heads = ("figure", "by exact slopes (%)", "by 10 % differences (%)", "direct (%)")
        return Section(
            "Agreed variation",
            text="All these numbers change together. To first order a figure changes by the sum of Kc K / 10; the "
            "direct change is read from the changed ship.",
            tables=[
                table("Agreed changes", ("parameter", "Kc (%)"), changes, on_screen=False),
                table("Change of the figures by the agreed variation", heads, figures),
            ],
        )

    def _all_coefficients(self) -> Section:
        data, tables, figures = self.study, list[Table](), list(self.study.figures)
        for caption, K in (("K by exact slopes", data.exact), ("K by the 10 % difference", data.difference)):
            for rows in _parts(len(data.figures), PAGE_FIGURES):
                labels = [figure_label(figures[row]) for row in rows]
                part = f", from {labels[0]} on" if len(rows) < len(data.figures) else ""
                tables.append(_all_of(f"{caption}{part}", data, K, rows))
        return Section("Coefficients of all parameters", tables=tables)


@dataclass(frozen=True, eq=False, repr=False)
class TuningResult(InfluenceResult):
    """A card tuned to figures, and its influence coefficients before.

    Parameters
    ----------
    study : InfluenceStudy
        With what was tuned.
    ship : Ship, optional
        The ship before.
    tuned_card : Card, optional
        The tuned card; None if the targets cannot be reached, or the result was read from its JSON.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> tuning = t2s.load("mariner").tune("steady_radius_m@20=640", by="fewest")
    >>> list(tuning.moves.index)
    ['derivatives.Nd']
    >>> round(tuning.targets.loc["steady_radius_m@20=640", "after"])
    640
    """

    tuned_card: Card | None = None

    @property
    def tuned(self) -> TunedStudy:
        """Targets, moves and figures after."""
        assert self.study.tuned is not None
        return self.study.tuned

    @property
    def reached(self) -> bool:
        """True if all targets are met."""
        return self.tuned.reached

    @property
    def card(self) -> Card:
        """The tuned card, with the part of the covariance that still holds; ``card.save("tuned.toml")`` writes it.

        Raises
        ------
        InputError
            The targets cannot be reached, or the result was read from its JSON.
        """
        if not self.reached:
            remedy = "widen within, state bounds, or give a nearer target"
            raise ArgumentError("targets", "", self.tuned.contradiction_text, remedy)
        if self.tuned_card is None:
            raise ArgumentError("targets", "", "the JSON of a result has no card", "tune the card again")
        return self.tuned_card

    @property
    def tuned_ship(self) -> Any:
        """The ship of the tuned card (:class:`tank2sim.Ship`). Raises as :attr:`card`."""
        return type(self.ship)(self.card)

    @property
    def targets(self) -> pd.DataFrame:
        """The targets by their text, in the units of the figures: value before and after."""
        return records_frame(self.tuned.targets, ("before", "after"), index="target")

    @property
    def moves(self) -> pd.DataFrame:
        """The numbers of the card that changed, as its file has them: before, after, the move in standard errors."""
        return records_frame(self.tuned.parameters, ("before", "after", "standard_errors"), index="parameter")


def _targets_of(tuned: TunedStudy) -> dict[str, tuple[TunedTarget, Verdict]]:
    """Figure to its target, and whether that is met."""
    return {
        target.figure: (target, Verdict.FAILED if text in tuned.contradiction else Verdict.PASSED)
        for text, target in tuned.targets.items()
    }


def _unit(text: str) -> str:
    return in_words(text.partition("@")[0])[1]


def _parts(count: int, most: int) -> list[range]:
    """Places of `count` figures in tables of at most `most`, as even as it goes."""
    each = -(-count // -(-count // most))
    return [range(first, min(first + each, count)) for first in range(0, count, each)]


def _pair(exact: float, difference: float) -> str:
    return " | ".join(f"{round(value, 2) + 0.0:+.2f}" if math.isfinite(value) else "-" for value in (exact, difference))


def _all_of(caption: str, data: InfluenceStudy, K: Array, rows: Sequence[int]) -> Table:
    figures = list(data.figures)
    heads = [Column(figure_label(figures[row]), "%", digits=3) for row in rows]
    cells: list[list[Cell]] = [
        [name, *(_rounded(K[row, place]) for row in rows)] for place, name in enumerate(data.names)
    ]
    return table(caption, (Column("parameter"), *heads), cells, on_screen=False)


def _rounded(value: float) -> float | None:
    return float(np.round(value, 3)) + 0.0 if math.isfinite(value) else None


def _moves(tuned: TunedStudy) -> Section:
    rows: list[list[Cell]] = [
        [key, move.before, move.after, move.standard_errors] for key, move in tuned.parameters.items()
    ]
    heads = ("key", "before", "after", "move (standard errors)")
    caption = "Parameters that changed, as the card's file has them"
    return Section("Numbers that tuning changed", tables=[table(caption, heads, rows, digits=6, on_screen=False)])


EXACT, DIFFERENCE = "exact slope", "10 % difference"

_MOST_ROWS = 24
"""Parameters in a chart of all figures, or of tuning. The table has all."""

_MOST_BARS = 12
"""Parameters in the chart of one figure: those that move it most. Project choice: two charts side by side are half a
screen high."""

_WIDTH = 600
_NAMES = {"labelLimit": 320}
"""Room for the names of parameters and figures, px: ``cross_flow_drag.drag_coefficient`` needs 220 in a wide font."""


def most_influential(result: InfluenceStudy, row: int) -> list[int]:
    """Places of the parameters with the largest K % on one figure, largest first."""
    sizes = np.nan_to_num(np.abs(result.exact[row]))
    order = [int(place) for place in np.argsort(-sizes, kind="stable") if sizes[place] > 1e-3 * sizes.max()]
    return order[:_MOST_BARS]


def influence_charts(result: InfluenceStudy) -> list[ChartSpec]:
    """One chart for each figure, of the parameters that move it most: bars by exact slopes, points by the 10 %
    difference."""
    return [_bars(result, row) for row in range(len(result.figures))]


def _bars(result: InfluenceStudy, row: int) -> ChartSpec:
    order = most_influential(result, row)
    names = [result.names[place] for place in order]
    values = {EXACT: result.exact[row], DIFFERENCE: result.difference[row]}
    both = {
        run: [
            {"run": run, "name": result.names[place], "v": plain(sizes[place])}
            | {"exact": plain(values[EXACT][place]), "step": plain(values[DIFFERENCE][place])}
            for place in order
        ]
        for run, sizes in values.items()
    }
    look = series_look([EXACT, DIFFERENCE], as_points=[EXACT, DIFFERENCE])
    exact = RowPlot(
        both[EXACT],
        across=PlotAxis("K (%)", zero=True, ticks=4),
        shown={"name:N": "parameter", "exact:Q": f"K, {EXACT} (%)", "step:Q": f"K, {DIFFERENCE} (%)"},
        look=look,
        side=_NAMES,
    )
    bars = row_layers(exact, mark="bar", height=9, opacity=0.65)
    difference = replace(exact, rows=both[DIFFERENCE], rules=[Rule([0.0])])
    points = row_layers(difference, size=34, strokeWidth=1.6)
    figure = figure_label(list(result.figures)[row])
    return layered(
        [*bars, *points],
        size=(_WIDTH, 19 * len(names)),
        title=f"Influence on {figure}",
        description=f"K per cent of {len(names)} parameters on {figure}, by exact slopes and by a 10 % difference.",
    )


def variance_chart(result: InfluenceStudy) -> ChartSpec:
    """Share of each parameter in the variance of each figure, as a heat map of those with 1 % of any."""
    shares = 100 * result.shares
    order = [int(k) for k in np.argsort(-shares.max(axis=0), kind="stable") if shares[:, k].max() >= 1][:_MOST_ROWS]
    names = [result.names[place] for place in order]
    figures = [figure_label(text) for text in result.figures]
    rows: list[ChartRecord] = [
        {"figure": figures[row], "name": result.names[place], "share": plain(float(shares[row, place]))}
        for row in range(len(figures))
        for place in order
    ]
    return layered(
        Matrix(
            colour="share",
            rows=figures,
            columns=names,
            names=("figure", "name"),
            scale={"domain": [0, max(10.0, float(shares.max(initial=0.0)))], "scheme": "blues"},
            legend={"title": "share of the variance (%)"},
            side=_NAMES | {"ticks": False},
            foot=_NAMES | {"labelAngle": -90, "ticks": False},
            shown={"figure:N": "figure", "name:N": "parameter", "share:Q": ("share (%)", ".1f")},
            written=False,
        ).layers,
        size=(_WIDTH, 28 * len(figures)),
        data={"values": rows},
        title="Standard errors that the figures' errors follow from",
        description=f"Shares of {len(names)} parameters in the variances of {len(figures)} figures.",
    )


def moves_chart(tuned: TunedStudy) -> ChartSpec:
    """Numbers that tuning changed, in standard errors of the card, with the bounds."""
    rows: list[ChartRecord] = [
        {"name": one.name, "v": plain(one.standard_errors), "before": plain(one.before), "after": plain(one.after)}
        for one in tuned.parameters.values()
        if one.standard_errors is not None
    ][:_MOST_ROWS]
    within = tuned.within_standard_errors
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis("move (standard errors of the card)", zero=True),
            side=_NAMES,
            rules=[Rule([0.0]), Rule([-within, within], style="limit", dash=(5, 3))],
            shown={
                "name:N": "parameter",
                "before:Q": ("before", ".6~g"),
                "after:Q": ("after", ".6~g"),
                "v:Q": ("standard errors", ".3f"),
            },
        ),
        title="What tuning changed",
        described=f"Moves of {len(rows)} parameters in standard errors; the bounds are at {within:g}.",
        width_px=_WIDTH,
        mark="bar",
    )
