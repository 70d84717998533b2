"""Result of ``guess``: a ship guessed from dimensions and the figures of a wheelhouse poster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tank2sim.answer.charts.parts import series_look
from tank2sim.answer.charts.rows import RowPlot, names_of, row_layers, runs_of
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, layered
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, data_frame, records_table, table
from tank2sim.answer.result import Result
from tank2sim.apps.guess.study import GuessedFigure, GuessStudy
from tank2sim.cards import ManoeuvringCard
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_FIRST = ("tactical_diameter_m@35", "overshoot_1_deg@10/10", "overshoot_1_deg@20/20")
"""Figures at the top of the page."""

_MANOEUVRES = {"35": "turn 35°", "10/10": "zigzag 10/10", "20/20": "zigzag 20/20"}


@dataclass(frozen=True, eq=False, repr=False)
class GuessResult(Result[GuessStudy]):
    """A guessed ship: the card with its covariance, what the figures settle, and what is predicted.

    Parameters
    ----------
    study : GuessStudy
    card : ManoeuvringCard, optional
        The card; ``card.save("ship.toml")`` writes it and its covariance. None if the result was read from its JSON.
    """

    study: GuessStudy
    card: ManoeuvringCard | None = None
    command: ClassVar[str] = "guess"

    @property
    def title(self) -> str:
        """The ship."""
        return "A guessed ship" if self.study.ship == "guessed ship" else f"{self.study.ship}: a guess"

    @property
    def subtitle(self) -> str:
        """Dimensions and speed."""
        size = self.study.dimensions
        return (
            f"{size['length_m']:g} x {size['beam_m']:g} x {size['draught_m']:g} m, block coefficient "
            f"{size['block']:g}, {size['speed_kn']:g} kn"
        )

    @property
    def figures(self) -> pd.DataFrame:
        """Figures by key (m, deg): given, and quantiles of 5, 50 and 95 % by the dimensions alone and found."""
        rows = []
        for key, figure in self.study.figures.items():
            before, after = figure.by_dimensions, figure.found
            spread = {"by_dimensions_p5": before.p5, "by_dimensions_p50": before.p50, "by_dimensions_p95": before.p95}
            found = {"p5": after.p5, "p50": after.p50, "p95": after.p95}
            rows.append({"figure": key, "given": figure.given, **spread, **found})
        return data_frame(rows, index="figure")

    @property
    def headline(self) -> tuple[str, ...]:
        """Numbers that the figures settle, and how far they narrow the other figures."""
        study, given, settled = self.study, self._given, self._settled
        if not given:
            return (f"{study.ship}: no figures were given, so the dimensions alone define the intervals.",)
        which = f"{len(settled) or 'none'} of {len(study.parameters)} numbers of the card"
        which += f" ({', '.join(settled)})" if settled else ""
        words = f"{given} {'figure was' if given == 1 else 'figures were'} given, which "
        words += f"{'settles' if given == 1 else 'settle'} {which}"
        others = [figure for figure in study.figures.values() if figure.given is None]
        narrower = [1 - _width(figure) for figure in others if figure.by_dimensions.p95 > figure.by_dimensions.p5]
        if not narrower:
            return (f"{study.ship}: {words}.",)
        share = 100 * float(np.mean(narrower))
        return (f"{study.ship}: {words}. The intervals of figures not given are {share:.0f} % narrower on average.",)

    @property
    def _given(self) -> int:
        return sum(figure.given is not None for figure in self.study.figures.values())

    @property
    def _settled(self) -> list[str]:
        return [name for name, number in self.study.parameters.items() if number.settled]

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The best-known figures, the number of those given, and the one that would help most."""
        study = self.study
        cards = [_key_figure(key, study.figures[key]) for key in _FIRST if key in study.figures]
        note = f"{len(self._settled)} of {len(study.parameters)} numbers are settled by them"
        cards.append(KeyFigure("Figures given", self._given, note=note))
        if study.next_figures:
            best, share = next(iter(study.next_figures.items()))
            note = f"removes {100 * share:.0f} % of the variance of the others"
            cards.append(KeyFigure("Would help most", _named(best), note=note))
        return cards

    @property
    def sections(self) -> Sequence[Section]:
        """Figures, numbers of the card, and the figures that would help most."""
        return [self._figures(), self._numbers(), *([self._next()] if self.study.next_figures else [])]

    def _figures(self) -> Section:
        found: list[list[Cell]] = []
        prior: list[list[Cell]] = []
        for key, figure in self.study.figures.items():
            before, after = figure.by_dimensions, figure.found
            given = figure.given, figure.standard_error
            found.append([_named(key), figure.unit, *given, after.p5, after.p50, after.p95])
            prior.append([_named(key), figure.unit, before.p5, before.p50, before.p95])
        heads = ("figure", "unit", "given", "standard error", "5 %", "50 %", "95 %")
        prior_heads = ("figure", "unit", "5 %", "50 %", "95 %")
        return Section(
            "Figures",
            text="Nine of ten ships lie in each interval. Intervals are wide for the dimensions alone, and narrower "
            "for ships that also have the figures given. Figures that were not given are predictions.",
            charts=[Illustration(figures_chart(self.study))],
            tables=[
                table("Figures: nine of ten ships lie between 5 and 95 %", heads, found),
                table("The same by the dimensions alone", prior_heads, prior),
            ],
        )

    def _numbers(self) -> Section:
        words = {
            "by_dimensions": "prior",
            "by_dimensions_standard_error": "prior standard error",
            "value": "found",
            "standard_error": "standard error",
            "settled": "",
        }
        return Section(
            "Numbers that the figures settle",
            text="A number is settled if the figures remove at least half of its variance. The other numbers have the "
            "errors of the prior; manoeuvres of another kind than those given may depend on them.",
            tables=[records_table("Numbers of the card, prime", self.study.parameters, first="number", fields=words)],
        )

    def _next(self) -> Section:
        rows: list[list[Cell]] = [[_named(key), 100 * share] for key, share in self.study.next_figures.items()]
        return Section(
            "Further figures that would help most",
            text="Mean share of the variance of all figures not given that one more figure would remove. The figure is "
            "measured with the usual error; covariances come from the ships found.",
            tables=[table("One more figure", ("figure", "variance removed (%)"), rows, digits=2)],
        )


def _width(figure: GuessedFigure) -> float:
    """Width of the interval found, over the width by the dimensions alone."""
    return (figure.found.p95 - figure.found.p5) / (figure.by_dimensions.p95 - figure.by_dimensions.p5)


def _key_figure(key: str, figure: GuessedFigure) -> KeyFigure:
    name, found = _named(key), figure.found
    note = f"{format_number(found.p5, 3)} to {format_number(found.p95, 3)} {figure.unit}, nine of ten ships"
    return KeyFigure(name[:1].upper() + name[1:], found.p50, figure.unit, note=note)


def _named(key: str) -> str:
    """A figure as a reader sees it: ``overshoot_1_deg@10/10`` is ``zigzag 10/10: overshoot 1``."""
    figure, _, manoeuvre = key.partition("@")
    return f"{_MANOEUVRES.get(manoeuvre, manoeuvre)}: {in_words(figure)[0]}"


def figures_chart(study: GuessStudy) -> ChartSpec:
    """Intervals of each figure over the median found: by the dimensions alone, with the figures, and as given.

    Parameters
    ----------
    study : GuessStudy
    """
    anything = any(figure.given is not None for figure in study.figures.values())
    rows: list[ChartRecord] = []
    points: list[ChartRecord] = []
    for key, figure in study.figures.items():
        middle = figure.found.p50
        label = f"{_named(key)}, {format_number(middle, 3)} {figure.unit}"
        ways = {"by dimensions": figure.by_dimensions, **({"with the figures": figure.found} if anything else {})}
        for kind, band in ways.items():
            rows.append({"name": label, "run": kind, "low": band.p5 / middle, "high": band.p95 / middle})
        if figure.given is not None:
            points.append({"name": label, "run": "given", "v": figure.given / middle})
    kinds = [*runs_of(rows), *runs_of(points)]
    bars = RowPlot(
        rows,
        across=PlotAxis("times the median", log=True, nice=False, form="~g"),
        shown={"name:N": "figure", "run:N": "it is"},
        look=series_look(kinds, as_points=kinds),
        side={"labelExpr": "split(datum.label, ': ')"},
        apart=True,
    )
    given = replace(bars, rows=points, names=names_of(rows), apart=False)
    return layered(
        [*row_layers(bars, span_px=6), *row_layers(given, filled=True, size=50)],
        size=(560, 36 * len(study.figures)),
        title="Figures that nine of ten such ships have",
    )
