"""Result of ``reduce``: hydrodynamic derivatives from captive tests, their certainty and how they were found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.vega import ChartSpec
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    data_frame,
    records_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.cards import Card, parse_card
from tank2sim.cards.covariance import Covariance
from tank2sim.errors import InputError
from tank2sim.identification.captive.plot_data import ForcePlot, HarmonicsPlot, ReductionPlot
from tank2sim.identification.captive.reduction import Reduction, reduction_covariance
from tank2sim.identification.captive.result_card import Contents, reduced_card_text
from tank2sim.identification.captive.study import ReductionStudy
from tank2sim.results.captive_charts import (
    Residual,
    derivative_certainty_chart,
    force_chart,
    harmonic_chart,
    loop_chart,
    residual_chart,
)

if TYPE_CHECKING:
    import pandas as pd

_FORCES = {"X": "surge force", "Y": "sway force", "N": "yaw moment"}
_LOOPS = {"Y": "Y of the water (N)", "N": "N of the water (N m)"}
_LEFT_OUT = ("collinear", "not determined")
"""Reasons for which a term that the runs excite is not in the result."""

_FEWEST_RUNS = 3
"""Least number of runs of a type whose range gives a scale for the error of their prediction."""

_POOR_PREDICTION = 20.0
"""Error of predicted runs, % of their range, above which it is marked. Project choice."""

_AGAINST_MOTION = "Points: measured, bars: their 95 % intervals. Lines: the fit; shaded: its 95 % band."
_CERTAINTY = "A derivative whose standard error is as large as its value (red) shows its order of magnitude only."


@dataclass(frozen=True, eq=False, repr=False)
class ReductionResult(Result[ReductionStudy]):
    """Hydrodynamic derivatives from captive tests.

    Parameters
    ----------
    study : ReductionStudy
    reduction : Reduction, optional
        None if the result was read from its JSON.
    contents : Contents, optional
        Contents of the card: measured values and published estimates.
    """

    study: ReductionStudy
    reduction: Reduction | None = None
    contents: Contents | None = None
    command: ClassVar[str] = "reduce"
    procedure: ClassVar[str] = "Captive model tests, reduced"

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files of the runs."""
        folder = Path(self.study.campaign).parent
        runs = self.reduction.campaign.runs if self.reduction else ()
        return tuple(folder / run.name.partition(" line ")[0] for run in runs)

    @cached_property
    def card(self) -> Card:
        """The card found, with the covariance of the measured values; ``card.save("ship.toml")`` writes it.

        Raises
        ------
        InputError
            No ship has these derivatives, or the result was read from its JSON.
        """
        if self.reduction is None or self.contents is None:
            raise InputError(self.study.campaign, "", "was not read with this result", "reduce the campaign again")
        card = parse_card(
            reduced_card_text(self.reduction, self.contents, self.study.card_scale or 1.0), "the reduced card"
        )
        # Estimates are independent of the measured values.
        entries, estimated = self.contents.entries, self.contents.estimated
        names = [name for name in entries if name in self.reduction.derivatives and name not in estimated]
        matrix = reduction_covariance(self.reduction, names)
        return replace(card, covariance=Covariance(tuple(f"derivatives.{name}" for name in names), matrix))

    @property
    def derivatives(self) -> pd.DataFrame:
        """Derivatives by name: prime value, standard error, origin; rudder positive to starboard."""
        every = self.study.derivatives | self.study.heel_derivatives
        return records_frame(every, ("value", "standard_error", "origin"), index="name")

    @property
    def budget(self) -> pd.DataFrame:
        """Uncertainty budget by derivative (ITTC 7.5-02-06-04): share of the variance of each source; prime
        ``combined`` and ``expanded`` (k = 2) uncertainty."""
        rows = [
            {"name": row.name, "value": row.value, "combined": row.combined, "expanded": row.expanded, **row.shares}
            for row in self.study.uncertainty_budget.derivatives.values()
        ]
        return data_frame(rows, index="name")

    @property
    def title(self) -> str:
        """The model."""
        return str(self.study.model["name"])

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of derivatives, errors of predicted runs, and the size of the card."""
        text = f"{self._measured} of {len(self.study.derivatives)} derivatives are measured"
        if lost := self._lost:
            text += f"; {lost} of them {'is' if lost == 1 else 'are'} smaller than the standard error"
        if worst := self._worst_predictions():
            errors = ", ".join(f"{_FORCES[force]} within {percent:.2g} %" for force, (percent, _) in worst.items())
            text += f". Each run is predicted from all the others, as a share of the range: {errors}"
        return (f"{text}.", *self._size())

    @property
    def _measured(self) -> int:
        return sum(found.origin == "measured" for found in self.study.derivatives.values())

    @property
    def _lost(self) -> int:
        """Measured derivatives that are smaller than their standard errors."""
        rows = (found for found in self.study.derivatives.values() if found.origin == "measured")
        return sum(abs(found.value) < found.standard_error for found in rows if found.standard_error is not None)

    def _size(self) -> list[str]:
        """The size of the card, if the campaign states a ship and the card is of the model."""
        length, scale = self.study.model["length_m"], self.study.model.get("scale")
        if self.study.card_scale is not None or not isinstance(scale, float) or not isinstance(length, float):
            return []
        return [
            f'The card is of the model, {length:.4g} m long; scale="ship" makes a card of the ship, '
            f"{length * scale:.4g} m long."
        ]

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Derivatives measured and estimated, errors of predicted runs."""
        study = self.study
        estimated = [name for name, found in study.derivatives.items() if found.origin == "estimated"]
        return [
            KeyFigure(
                "Derivatives measured",
                f"{self._measured} of {len(study.derivatives)}",
                note=f"by {len(study.runs)} runs; {len(study.not_used)} left out",
            ),
            *(
                KeyFigure(
                    f"{_FORCES[force].capitalize()} predicted within",
                    float(f"{percent:.2g}"),
                    "%",
                    verdict=Verdict.CAUTION if percent > _POOR_PREDICTION else Verdict.NONE,
                    note=f"of its range, in {kind}, the worst type of run",
                )
                for force, (percent, kind) in self._worst_predictions().items()
            ),
            KeyFigure(
                "Derivatives estimated",
                len(estimated),
                verdict=Verdict.CAUTION if estimated else Verdict.NONE,
                note=", ".join(estimated) or "none",
            ),
        ]

    def _predictions(self) -> dict[str, dict[str, float]]:
        """Root mean square error of predicted runs, % of their range, by type of run and force."""
        return {
            kind.replace("_", " "): {
                force: 100 * error.relative for force, error in errors.items() if error.relative == error.relative
            }
            for kind, errors in self.study.prediction_errors.items()
            if any(error.runs >= _FEWEST_RUNS for error in errors.values())
        }

    def _worst_predictions(self) -> dict[str, tuple[float, str]]:
        """The largest prediction error of each force, % of its range, and the type of these runs."""
        found: dict[str, tuple[float, str]] = {}
        for force in _FORCES:
            errors = [(percents[force], kind) for kind, percents in self._predictions().items() if force in percents]
            if errors:
                found[force] = max(errors)
        return found

    @property
    def sections(self) -> Sequence[Section]:
        """Derivatives, forces against motion, predicted runs, terms left out, the budget."""
        title = "Certainty of the derivatives"
        certainty = Illustration(
            derivative_certainty_chart(self.study.derivatives, title=title), caption=_CERTAINTY, name="certainty"
        )
        return [
            Section(
                "Derivatives",
                text="One weighted regression over the whole campaign; in the table, next to it the tests one after "
                "the other.",
                tables=[self._derivatives()],
                charts=[certainty],
            ),
            *self._against_motion(),
            self._predicted(),
            *self._left_out(),
            self._budget(),
        ]

    def _derivatives(self) -> Table:
        rows: list[list[Cell]] = []
        for name, found in (self.study.derivatives | self.study.heel_derivatives).items():
            steps = found.paper_order
            stepwise: list[Cell] = [None, None, ""]
            if steps:
                stepwise = [1e5 * steps.value, 1e5 * steps.standard_error, steps.found_in.replace("_", " ")]
            rows.append([name, 1e5 * found.value, 1e5 * found.standard_error, *stepwise, found.origin])
        heads = ("derivative", "whole campaign", "±", "test by test", "±", "from tests", "origin")
        caption = f"Derivatives from {len(self.study.runs)} runs (prime, times 10⁵, rudder to starboard)"
        return table(caption, heads, rows)

    def _against_motion(self) -> list[Section]:
        """A section for each force and its angles and amplitudes, and one for the loops."""
        loops = "Loops of the oscillating runs"
        groups: dict[str, list[Illustration]] = {}
        for stem, plot in self.study.plots.items():
            words = _FORCES.get(stem.rpartition("_")[2])
            heading = f"{words.capitalize()} against motion" if words else loops
            half = isinstance(plot, ForcePlot)
            groups.setdefault(heading, []).append(Illustration(_plot_chart(plot), half=half, name=stem))
        return [
            Section(heading, text="" if heading == loops else _AGAINST_MOTION, charts=charts, folded=heading == loops)
            for heading, charts in groups.items()
        ]

    def _predicted(self) -> Section:
        residuals = [
            Residual(run=row.run, kind=row.type.replace("_", " "), force=force, value=-row.error / row.standard_error)
            for force, rows in self.study.leave_one_out.items()
            for row in rows
        ]
        chart = residual_chart(residuals, title="Each run against its prediction from all the others")
        rows: list[list[Cell]] = [
            [kind, *(percents.get(force) for force in _FORCES)] for kind, percents in self._predictions().items()
        ]
        excited = [choice.name for choice in self.study.choices if choice.reason == "not excited"]
        heads = ("runs of type", *(f"{force} (%)" for force in _FORCES))
        caption = "Leave-one-out: root mean square error of each run predicted from the others, % of the force's range"
        note = f"Not excited by any run: {', '.join(excited)}"
        return Section(
            "Each run predicted from the others",
            tables=[table(caption, heads, rows, note, digits=2)],
            charts=[Illustration(chart, name="residuals")],
        )

    def _left_out(self) -> list[Section]:
        choices = [choice for choice in self.study.choices if choice.reason in _LEFT_OUT]
        fields = {"name": "term", "reason": "", "explanation": "why"}
        found = records_table("Terms that the runs excite and that were left out", choices, fields=fields)
        return [Section("Which terms, and why", tables=[found], folded=True)] if choices else []

    def _budget(self) -> Section:
        budget = self.study.uncertainty_budget
        sources: Mapping[str, str] = budget.sources
        rows: list[list[Cell]] = [
            [
                name,
                1e5 * row.value,
                *(100 * row.shares[source] for source in sources),
                1e5 * row.combined,
                1e5 * row.expanded,
            ]
            for name, row in budget.derivatives.items()
        ]
        columns = [
            *(Column("derivative"), Column("value")),
            *(Column(source, "%", digits=3) for source in sources),
            *(Column("combined", digits=3), Column("expanded, k = 2", digits=3)),
        ]
        notes = []
        if budget.not_stated:
            notes.append(f"Not stated in [uncertainty], and taken as zero: {', '.join(budget.not_stated)}.")
        if budget.blockage_speed_relative and "blockage_relative" in budget.not_stated:
            percent = 100 * budget.blockage_speed_relative
            notes.append(f"By Schuster's formula the walls raise the speed past the model by {percent:.2g} %.")
        caption = "Shares of the variance; values and uncertainties prime, times 10⁵"
        return Section(
            "Uncertainty budget",
            text="After ITTC 7.5-02-06-04: the combined uncertainty is the standard error of the result.",
            tables=[
                table(caption, columns, rows, on_screen=False),
                table("Sources", ("source", "cause"), [list(pair) for pair in sources.items()], on_screen=False),
            ],
            notes=notes,
            folded=True,
        )


def _plot_chart(plot: ReductionPlot) -> ChartSpec:
    if isinstance(plot, HarmonicsPlot):
        return harmonic_chart(plot)
    return force_chart(plot) if isinstance(plot, ForcePlot) else loop_chart(plot, _LOOPS)
