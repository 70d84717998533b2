"""Result of ``compare``: cards of one ship compared by coefficients and by trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS, CoefficientRow
from tank2sim.analysis.validation.comparison import CardComparison, CardSummary, ComparedFigure, TrialComparison
from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import plain, series_look, with_unit
from tank2sim.answer.charts.rows import RowPlot, names_of, row_chart, row_layers
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layered, stacked
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    data_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.results.ensembles import members_frame
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_FigurePercent = tuple[str, str, str, float, float | None]
"""Card, trial, figure in words, difference from the reference in per cent, and in standard errors."""


_MOST = 10
"""Coefficients of each card on the screen; JSON and page have all. Project choice: they fit a screen."""

_SHOWN = ("advance_m", "tactical_diameter_m", "overshoot_1_deg", "overshoot_2_deg", "track_reach_m")
_SHOWN_OF_CRAFT = ("final_speed_mps", "steady_diameter_m", "steady_rate_degps", "final_rate_degps")
"""Figures in the table of all trials."""

_COEFFICIENTS_OF_SHIPS = (
    "Prime system, in the convention of the first card, the sign of its rudder included. A coefficient belongs to the "
    "speed about which forces are expanded, to the speed that makes them non-dimensional, and to the inertial terms "
    "that it includes. Where cards differ in these, the forces are expanded again to the third order, and the standard "
    "errors with them. "
)
_COEFFICIENTS = (
    "A difference is divided by the root of both variances: beyond 2 it is unlikely to be chance. Coefficients "
    "identical to the reference are not compared."
)
_ASSUMED = "An asterisk marks a standard error that the card does not state: 2 % of the value."
_TRIALS = "Simulated in calm water from the same approach speed, at the size of the first card's ship."
_DEVIATIONS = (
    " In brackets: standard deviation of each figure when the card's coefficients are drawn within their errors. z: "
    "difference over the root of both variances."
)
_PERCENT = "Points: difference from the reference."
_BARS = " Bars: plus and minus two standard deviations, by the errors of both cards."


@dataclass(frozen=True, eq=False, repr=False)
class ComparisonResult(Result[CardComparison]):
    """Cards of one ship compared; the first is the reference.

    Parameters
    ----------
    study : CardComparison
        In the convention and at the size of the reference.
    ships : tuple of Ship
        Empty if the result was read from its JSON.
    """

    study: CardComparison
    ships: tuple[Any, ...] = ()
    command: ClassVar[str] = "compare"

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the cards in the tables, the reference first."""
        return tuple(card.label for card in self.study.cards)

    @property
    def summary(self) -> pd.DataFrame:
        """By card but the reference (index): coefficients compared, the same number, beyond 2 standard errors, rms."""
        return data_frame([asdict(summary) for summary in self.study.summary], index="card")

    @property
    def coefficients(self) -> pd.DataFrame:
        """A row each coefficient and card but the reference, in the reference's convention (prime; of effects SI).

        Those of craft are in SI.

        ``difference_percent`` is in per cent of the reference's size, ``standard_errors`` the difference over the root
        of both variances; missing where they cannot be compared.
        """
        rows = [
            (label, row.name, row.cards[0].value, row.cards[place].value, apart.percent, apart.standard_errors)
            for place, label in self._others()
            for row in self.study.rows
            for apart in [row.differences[place - 1]]
        ]
        columns = ["card", "coefficient", "reference", "value", "difference_percent", "standard_errors"]
        return data_frame(rows, columns=columns)

    @cached_property
    def members(self) -> pd.DataFrame:
        """The ships of the ensembles, one row each, with their ``card``: the numbers drawn, by the dotted keys of the
        card and as its file has them; figures of the standard trials at the size of the reference, named
        ``trial: figure``; and whether any trial could be run (``usable``).

        Raises
        ------
        InputError
            There are no members, or the result was read from its JSON.
        """
        import pandas as pd

        drawn = self.study.drawn or (None,)
        frames = [members_frame(ships, self.study.members) for ships in drawn]
        return pd.concat(dict(zip(self.labels, frames, strict=True)), names=["card", "member"]).reset_index("card")

    @property
    def figures(self) -> pd.DataFrame:
        """Figures of the standard trials, a row each with its card: value, standard deviation, difference from the
        reference, the same in standard errors; in the unit of the figure's name."""
        rows = [
            (trial.name, name, label, value, deviation, apart, errors)
            for trial in self.study.trials
            for name, row in trial.figures.items()
            for label, value, deviation, apart, errors in zip(
                self.labels,
                row.values,
                row.standard_deviations,
                (None, *row.differences),
                (None, *row.differences_standard_errors),
                strict=True,
            )
        ]
        columns = ["trial", "figure", "card", "value", "standard_deviation", "difference", "standard_errors"]
        return data_frame(rows, columns=columns)

    @property
    def title(self) -> str:
        """The ship of the reference."""
        return self.study.cards[0].ship

    @property
    def subtitle(self) -> str:
        """The cards."""
        return f"Comparison of cards: {', '.join(self.labels)}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Coefficients of each card that differ from the reference, and the figure that differs most."""
        return (*map(self._compared_in_words, self.study.summary), *self._largest_in_words())

    def _compared_in_words(self, summary: CardSummary) -> str:
        if not summary.compared and summary.same_number:
            same = f"all {summary.same_number} coefficients are the reference's own numbers"
            return f"{summary.card} against {self.labels[0]}: {same}."
        rms = summary.rms_standard_errors
        text = "" if rms is None else f", rms {rms:.3g} (1 by chance)"
        text += f"; {summary.same_number} more are the reference's own numbers" if summary.same_number else ""
        return (
            f"{summary.card} against {self.labels[0]}: {summary.beyond_two_standard_errors} of {summary.compared} "
            f"coefficients differ by more than {BEYOND_STANDARD_ERRORS:g} standard errors{text}."
        )

    def _largest_in_words(self) -> list[str]:
        """The figure that differs most between the reference and another card."""
        percents = self._percents()
        if not percents:
            return []
        label, trial, figure, percent, _ = max(percents, key=lambda row: abs(row[3]))
        if not percent:
            return ["No figure of the manoeuvres differs."]
        text = f"{label} differs from {self.labels[0]} most in the {figure} of the {trial}: {percent:+.3g} %."
        sure = [z for *_, z in percents if z is not None]
        beyond = sum(abs(z) > BEYOND_STANDARD_ERRORS for z in sure)
        many = f"{beyond} of {len(sure)} figures differ by more than {BEYOND_STANDARD_ERRORS:g} standard deviations."
        return [f"{text} {many}" if sure else text]

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The figure of each card that differs most from the reference, and coefficients beyond two standard errors."""
        percents, figures = self._percents(), []
        for label in self.labels[1:]:
            own = [row for row in percents if row[0] == label]
            if own:
                _, trial, figure, percent, _ = max(own, key=lambda row: abs(row[3]))
                value = float(f"{percent:.3g}")
                note = f"{trial}: {figure}"
                figures.append(KeyFigure(f"{label}: largest difference", value, "%", note=note))
        return [*figures, *map(_beyond, self.study.summary)]

    @property
    def sections(self) -> Sequence[Section]:
        """Tracks, figures, coefficients and cards."""
        fields = {"label": "card", "ship": "", "source": ""}
        cards = records_table("Cards, the reference first", self.study.cards, fields=fields, on_screen=False)
        return [*self._tracks(), *self._figures(), self._coefficients(), Section("Cards", tables=[cards])]

    def _others(self) -> list[tuple[int, str]]:
        return list(enumerate(self.labels))[1:]

    def _percents(self) -> list[_FigurePercent]:
        """Differences of the figures that both cards show."""
        return [
            (label, trial.name, in_words(name)[0], 100 * apart / abs(first), z)
            for trial in self.study.trials
            for name, row in trial.figures.items()
            for first in [row.values[0]]
            for label, apart, z in zip(self.labels[1:], row.differences, row.differences_standard_errors, strict=True)
            if apart is not None and first and not name.endswith("_lengths")
        ]

    def _tracks(self) -> list[Section]:
        charts = []
        for trial in self.study.trials:
            tracks = [TrackData(one.card, x_m=one.x_m, y_m=one.y_m, time_s=one.t_s) for one in trial.tracks]
            if tracks:
                chart = track_chart(tracks, title=trial.name[:1].upper() + trial.name[1:], height_px=400)
                charts.append(Illustration(chart, half=True, name="tracks"))
        return [Section("Tracks", charts=charts)] if charts else []

    def _figures(self) -> list[Section]:
        """Differences of the figures from the reference's, all manoeuvres in one chart."""
        percents = self._percents()
        if not percents:
            return []
        chart = _percent_chart(
            percents, self.labels, ", standard errors assumed" * any(card.assumed_errors for card in self.study.cards)
        )
        drawn_within_errors = any(z is not None for *_, z in percents)
        text, caption = _TRIALS + _DEVIATIONS * drawn_within_errors, _PERCENT + _BARS * drawn_within_errors
        drawn = Illustration(chart, caption=caption, name="figures_of_manoeuvres")
        shown = _SHOWN_OF_CRAFT if self.study.craft else _SHOWN
        rows: list[list[Cell]] = [
            [trial.name, with_unit(*in_words(name)), *_with_deviations(row)]
            for trial in self.study.trials
            for name, row in trial.figures.items()
            if name in shown
        ]
        heads = [Column("trial"), Column("figure"), *map(Column, self.labels)]
        main = table("Main figures" + " (standard deviation)" * drawn_within_errors, heads, rows)
        tables = [main, *map(self._trial_table, self.study.trials)]
        return [Section("Figures of manoeuvres", text=text, charts=[drawn], tables=tables)]

    def _trial_table(self, trial: TrialComparison) -> Table:
        heads = [Column("figure"), Column("unit"), *map(Column, self.labels)]
        for label in self.labels[1:]:
            heads += [Column(f"{label}: difference"), Column("z", digits=3)]
        rows: list[list[Cell]] = []
        for name, row in trial.figures.items():
            if name.endswith("_lengths"):  # the figure in m has the same differences
                continue
            cells: list[Cell] = [*in_words(name), *_with_deviations(row)]
            for apart, z in zip(row.differences, row.differences_standard_errors, strict=True):
                cells += [None if apart is None else format_number(apart, 3), z]
            rows.append(cells)
        return table(f"Figures of the {trial.name}", heads, rows, folded=True, on_screen=False)

    def _coefficients(self) -> Section:
        study = self.study
        size, factor = (", SI", 1.0) if study.craft else (" (values and errors times 1000)", 1000.0)
        tables = [
            *(one for place, label in self._others() if (one := self._farthest(place, label)).rows),
            *self._differing(f"Coefficients that differ{size}", study.coefficients, factor),
            *self._differing("Parameters of effects that differ, SI", study.effects, 1.0),
        ]
        alike = sum(_on_all(row) and not _differs(row) for row in study.rows)
        alone = [row.name for row in study.rows if not _on_all(row)]
        texts = [("In SI units. " if study.craft else _COEFFICIENTS_OF_SHIPS) + _COEFFICIENTS, _ASSUMED]
        texts += [f"{alike} numbers are the same on all cards."] * bool(alike)
        texts += [f"Not on all cards: {', '.join(alone)}."] * bool(alone)
        charts = []
        if any(summary.compared for summary in study.summary):
            caption = f"Lines at {BEYOND_STANDARD_ERRORS:g} standard errors."
            charts.append(Illustration(_errors_chart(study.rows, self.labels), caption=caption, name="coefficients"))
        return Section("Coefficients", text="\n\n".join(texts), tables=tables, charts=charts)

    def _farthest(self, place: int, label: str) -> Table:
        every = [(row, row.differences[place - 1]) for row in self.study.rows]
        known = [(abs(found.standard_errors), row, found) for row, found in every if found.standard_errors is not None]
        # Without any standard error (two languages) by their share.
        by_share = [(abs(found.percent), row, found) for row, found in every if found.percent]
        farthest = sorted(known or by_share, key=lambda entry: -entry[0])[:_MOST]
        rows: list[list[Cell]] = [
            [row.name, row.cards[0].value, row.cards[place].value, found.percent, found.standard_errors]
            for _, row, found in farthest
        ]
        heads = ("coefficient", Column(self.labels[0]), Column(label), "difference (%)", "standard errors")
        return table(f"Farthest apart: {label}", heads, rows)

    def _differing(self, caption: str, every: Sequence[CoefficientRow], factor: float) -> list[Table]:
        heads: list[str | Column] = ["coefficient"]
        for label in self.labels:
            heads += [Column(label, digits=6), Column("s.e.", digits=3)]
        for label in self.labels[1:]:
            heads += [Column(f"{label}: difference", "%", digits=3), Column("z", digits=3)]
        rows = [_coefficient_row(row, factor) for row in every if _on_all(row) and _differs(row)]
        return [table(caption, [*heads, "remark"], rows, on_screen=False)] if rows else []


def _on_all(row: CoefficientRow) -> bool:
    return all(card.value is not None for card in row.cards)


def _differs(row: CoefficientRow) -> bool:
    return any(apart.percent for apart in row.differences)


def _beyond(summary: CardSummary) -> KeyFigure:
    compared, beyond = summary.compared, summary.beyond_two_standard_errors
    rms = summary.rms_standard_errors
    note = "no standard errors" if rms is None else f"rms {rms:.3g} standard errors"
    note += f"; {summary.same_number} more taken over" if summary.same_number else ""
    return KeyFigure(
        f"{summary.card}: coefficients beyond {BEYOND_STANDARD_ERRORS:g}",
        f"{beyond} of {compared}" if compared else "none compared",
        verdict=_verdict(compared, beyond),
        note=note,
    )


def _verdict(compared: int, beyond: int) -> Verdict:
    """One in twenty differs by more by chance alone."""
    if not compared:
        return Verdict.NONE
    return Verdict.PASSED if beyond <= 0.05 * compared + 1 else Verdict.CAUTION


def _coefficient_row(row: CoefficientRow, factor: float) -> list[Cell]:
    cells: list[Cell] = [row.name]
    for card in row.cards:
        error = None if card.standard_error is None else factor * card.standard_error
        shown: Cell = error if card.stated or error is None else f"{error:.3g}*"
        cells += [None if card.value is None else factor * card.value, shown]
    for difference in row.differences:
        cells += [difference.percent, difference.standard_errors]
    return [*cells, ("; ".join(dict.fromkeys(difference.why for difference in row.differences if difference.why)))]


def _with_deviations(row: ComparedFigure) -> list[str | None]:
    """The value of each card with its standard deviation in brackets."""
    return [
        None
        if value is None
        else format_number(value)
        if deviation is None
        else f"{format_number(value)} ({format_number(deviation, 2)})"
        for value, deviation in zip(row.values, row.standard_deviations, strict=True)
    ]


def _errors_chart(coefficients: Sequence[CoefficientRow], labels: Sequence[str]) -> ChartSpec:
    """Differences of all coefficients in standard errors, a row each, a shape and colour for each card."""
    rows = [
        {"name": row.name, "v": difference.standard_errors, "run": label}
        for row in coefficients
        for label, difference in zip(labels[1:], row.differences, strict=True)
        if difference.standard_errors is not None
    ]
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis("difference (standard errors)", zero=True),
            look=series_look(labels[1:], as_points=labels[1:]),
            rules=[Rule([-BEYOND_STANDARD_ERRORS, BEYOND_STANDARD_ERRORS], style="limit")],
            shown={"run:N": "card", "name:N": "coefficient", "v:Q": "standard errors"},
        ),
        title="Differences in standard errors",
        described=f"Differences of {len(names_of(rows))} coefficients from {labels[0]} in standard errors.",
        step_px=15,
        filled=True,
    )


def _percent_chart(percents: Sequence[_FigurePercent], labels: Sequence[str], assumed: str) -> ChartSpec:
    """Differences in per cent of the reference's figure: a panel a manoeuvre, a row a figure, a shape and colour for
    each card. `assumed` is added to the title."""
    panels: dict[str, list[ChartRecord]] = {}
    ends = []
    for label, name, figure, percent, z in percents:
        trial = name.replace(" deg to", "")
        row: ChartRecord = {"run": label, "name": figure, "whole": f"{trial}: {figure}", "v": plain(percent)}
        if z:
            row |= {"low": plain(percent * (1 - 2 / abs(z))), "high": plain(percent * (1 + 2 / abs(z)))}
        ends += [float(row[key]) for key in ("v", "low", "high") if row.get(key) is not None]
        panels.setdefault(trial, []).append(row)
    across = PlotAxis("", domain=(min(0.0, *ends), max(0.0, *ends)))
    look = series_look(labels[1:], as_points=labels[1:])
    shown = {"run:N": "card", "whole:N": "figure", "v:Q": "difference (%)"}
    drawn = []
    for trial, rows in panels.items():
        layers = row_layers(RowPlot(rows, across=across, look=look, shown=shown, rules=[Rule([0.0])]), filled=True)
        title = {"text": trial, "anchor": "start", "fontSize": 11}
        drawn.append(layered(layers, size=(560, {"step": 16}), title=title))
    return stacked(
        drawn,
        title=f"Difference of the figures from {labels[0]}, %{assumed}",
        description=f"Differences of {len(percents)} figures from {labels[0]} in per cent.",
    )
