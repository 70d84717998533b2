"""Result of ``validate``: figures of trials next to simulated ones, with the validation uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.validation.one_sided import OneSidedError
from tank2sim.analysis.validation.study import ComparisonOutcome, Validated, Verified
from tank2sim.answer.charts.motion import motions
from tank2sim.answer.charts.parts import with_unit
from tank2sim.answer.charts.rows import RowPlot, names_of, row_layers
from tank2sim.answer.charts.vega import SIDE, ChartSpec, PlotAxis, Rule, channel, layer, layered
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    records_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.arrays import Columns, Number
from tank2sim.cards import SteeredBy, SteeredCard
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR
from tank2sim.identification.craft.first_values import PREDICTED_S
from tank2sim.identification.craft.study import PredictionStudy
from tank2sim.notices import Notice
from tank2sim.results.ensembles import members_frame
from tank2sim.results.imo import imo_section
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_COMPARISON_ERRORS = (
    "Points: error E of the simulation. Bars: plus and minus its uncertainty U_val; a point within its bar is "
    "validated, if the bar is short enough. The number names the trial."
)
"""Caption of the chart of comparison errors."""


_METHOD = (
    "E = S − D is the simulated less the measured figure. U_val = 2 √(u_num² + u_input² + u_D²) is the uncertainty by "
    "numerics, coefficients and data, with 95 % probability (ASME V&V 20; ITTC 7.5-03-01-01). Where |E| ≤ U_val the "
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
_STANDARDS = "Figures of the model next to the standards; they hold as far as the figures above are validated."
_CAUSES = (
    "Forces that the structure lacks: higher orders, heel, flow memory, interaction of rudder and propeller.",
    "Coefficients that no test of the source excites, or that are estimated (see the source and the comments).",
    "Scale effects between model and ship, in resistance, wake and rudder flow.",
    "Weather, current, depth and loading of the trials, as far as no effect of the card holds them.",
    "Errors of the coefficients that go together, where no covariance is next to the card.",
)
_NO_PROPULSION = "Engine and propeller: the card has none, so loss of revolutions in a turn is in the coefficients."
_SENSITIVITY = (
    "Potential causes of an error E (7.5-02-06-03). The command influence gives the dependence of each figure on "
    "each coefficient (sensitivity), the command gap looks for the missing effect."
)


@dataclass(frozen=True, kw_only=True)
class CardValue:
    """A derivative (prime) with its standard error; `stated` is false where the error is assumed."""

    value: float
    standard_error: float
    stated: bool


@dataclass(frozen=True, kw_only=True)
class SignalError:
    """Root mean square error of a signal in `unit`, also in per cent of its range (None for a constant one), and the
    noise of its measurement in `unit`."""

    signal: str
    unit: str
    rms_error: Number
    percent_of_range: float | None
    noise: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialReplay:
    """A trial as measured and as simulated, thinned to draw; columns as in a trial file."""

    trial: str
    errors: tuple[SignalError, ...]
    measured: Columns
    simulated: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class ValidationStudy:
    """Validation of a card.

    `ship`, `source`: name of the ship, and source of its coefficients; `documentation`: statements on the model by
    item; `coefficients`: derivatives by name; `steered_by`: coefficients of a craft with thrusters are in SI, others
    are prime; `propulsion`: whether the card has propulsion; `counts`: number of figures by outcome; `members`: size of
    the ensemble for u_input; `verification`: figures of standard trials; `predictions`: trials of a craft with
    thrusters; `one_sided`: figures whose errors are on one side in nearly all trials, the most significant first;
    `kind`: always ``validate``; `drawn`: the members (:class:`.DrawnShips`), not part of the JSON.
    """

    ship: str
    source: str
    documentation: dict[str, str]
    coefficients: dict[str, CardValue]
    steered_by: SteeredBy
    propulsion: bool
    verdict: str
    counts: dict[str, int]
    figures: tuple[Validated, ...]
    members: int
    verification: tuple[Verified, ...]
    imo: tuple[ImoCriterion, ...]
    replays: tuple[TrialReplay, ...]
    notices: tuple[Notice, ...]
    predictions: PredictionStudy | None = None
    one_sided: tuple[OneSidedError, ...] = ()
    kind: str = "validate"
    drawn: Annotated[Any, Field(exclude=True)] = None


@dataclass(frozen=True, eq=False, repr=False)
class ValidationResult(Result[ValidationStudy]):
    """Figures of a ship's trials next to those simulated, with the validation uncertainty.

    Parameters
    ----------
    study : ValidationStudy
    card : SteeredCard, optional
        None if the result was read from its JSON; ``ship`` is its ship.
    paths : tuple of Path
        Files of the trials.
    """

    study: ValidationStudy
    card: SteeredCard | None = None
    paths: tuple[Path, ...] = ()
    command: ClassVar[str] = "validate"
    procedure: ClassVar[str] = "Validation of the manoeuvring simulation model, in the manner of ITTC 7.5-02-06-03"
    subject: ClassVar[str] = "validation"

    @property
    def verdict(self) -> str:
        """How many figures are validated, too uncertain, only fitted, not validated or open."""
        return self.study.verdict

    @property
    def figures(self) -> pd.DataFrame:
        """Compared figures, a row each, in the unit of the name: measured D, simulated S, E = S - D, U_val, outcome."""
        names = ("trial", "manoeuvre", "name", "measured", "simulated", "error", "uncertainty", "outcome")
        frame = records_frame(self.study.figures, names).rename(columns={"name": "figure"})
        return frame.assign(outcome=frame["outcome"].map(str))

    @cached_property
    def members(self) -> pd.DataFrame:
        """The ships of the ensemble, one row each: the numbers drawn, by the dotted keys of the card and as its file
        has them; figures of the trials and of the standard trials, named ``trial: figure``; and whether any trial could
        be run (``usable``).

        Raises
        ------
        InputError
            There are no members, or the result was read from its JSON.
        """
        return members_frame(self.study.drawn, self.study.members)

    @property
    def verification(self) -> pd.DataFrame:
        """Figures of standard trials, a row each: value, numerical uncertainty U_num, deviation by the inputs."""
        frame = records_frame(self.study.verification, ("trial", "name", "value", "U_num", "deviation"))
        return frame.rename(columns={"name": "figure", "U_num": "numerical"})

    @property
    def headline(self) -> tuple[str, ...]:
        """The verdict, and the largest numerical uncertainty."""
        shares = self._numerical_percent
        numerical = f"Numerical uncertainty of {len(shares)} figures of standard trials: {max(shares, default=0):.2g} %"
        return (
            f"{self.study.ship}: {self.verdict}.",
            *([f"Rms error at the ends of predictions: {ends}."] if (ends := self._ends) else []),
            *([f"{numerical} at most."] if shares else []),
        )

    @property
    def _ends(self) -> str:
        """Errors of position and heading at the ends of predictions in words; empty without any."""
        found = self.study.predictions
        errors = {"m": found.end_distance_m, "deg": found.end_heading_deg} if found else {}
        return " and ".join(f"{value:.3g} {unit}" for unit, value in errors.items() if value is not None)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Figures validated, median error and level, and the numerical uncertainty."""
        figures, shown = self.study.figures, self._outcomes()
        errors = [100 * abs(one.error / one.measured) for one in figures if one.error is not None and one.measured]
        levels = [one.level_percent for one in figures if one.level_percent is not None]
        for label, values in (("Median error |E|", errors), ("Median level U_val", levels)):
            if values:
                shown.append(KeyFigure(label, float(np.median(values)), "% of D"))
        if self._numerical_percent:
            value = max(self._numerical_percent)
            shown.append(KeyFigure("Largest numerical uncertainty", value, "%"))
        return shown

    def _outcomes(self) -> list[KeyFigure]:
        """Figures validated, or the errors of predictions."""
        count, counts = len(self.study.figures), self.study.counts
        if count:
            validated = counts[ComparisonOutcome.VALIDATED.value]
            incomplete = Verdict.FAILED if counts[ComparisonOutcome.REFUTED.value] else Verdict.CAUTION
            verdict = Verdict.PASSED if validated == count else incomplete
            return [KeyFigure("Figures validated", f"{validated} of {count}", verdict=verdict)]
        if (found := self.study.predictions) is None:
            return [KeyFigure("Validation", "none", verdict=Verdict.CAUTION, note="no trial to compare with")]
        shown = [KeyFigure(f"R^2 of {name}", round(one, 3)) for name, one in found.determination.items()]
        ends = {"position": (found.end_distance_m, "m"), "heading": (found.end_heading_deg, "deg")}
        for name, (value, unit) in ends.items():
            if value is not None:
                note = f"rms, after up to {PREDICTED_S:g} s"
                shown.append(KeyFigure(f"Error of {name}", value, unit, note=note))
        return shown

    @property
    def sections(self) -> Sequence[Section]:
        """Figures, standards, replays, method, verification, documentation, coefficients, causes of errors."""
        study = self.study
        return [
            _predictions(study.predictions) if study.predictions else self._comparison(),
            *([self._standards()] if study.imo else []),
            *([self._replays()] if study.replays else []),
            *([_method(study.figures)] if study.figures else []),
            self._verification(),
            self._documentation(),
            self._coefficients(),
            self._causes(),
        ]

    @property
    def _numerical_percent(self) -> list[float]:
        """U_num of each figure in per cent of its value."""
        return [100 * abs(row.U_num / row.value) for row in self.study.verification if row.U_num and row.value]

    def _comparison(self) -> Section:
        figures = self.study.figures
        if not figures:
            given = "trial" if self.study.steered_by is SteeredBy.THRUSTERS else "turning circle or zigzag"
            text = f"No {given} was given: the model is documented and verified, and not validated."
            return Section("Validation", text=text)
        manoeuvres = {figure.trial: figure.manoeuvre for figure in figures}
        numbers = {trial: number for number, trial in enumerate(manoeuvres, start=1)}
        rows: list[list[Cell]] = [
            [
                f"{numbers[one.trial]}: {with_unit(*in_words(one.name))}",
                *map(_digits, (one.measured, one.simulated, one.error)),
                *(_digits(value, 3) for value in (one.inputs, one.data, one.uncertainty)),
                one.level_percent,
                one.outcome.value,
            ]
            for one in figures
        ]
        heads = ("no.: figure", "D", "S", "E", "u_input", "u_D", "U_val", Column("level", "%", digits=3))
        caption = "E = simulated S less measured D, and its uncertainty"
        benchmark: list[list[Cell]] = [[numbers[trial], trial, what] for trial, what in manoeuvres.items()]
        return Section(
            "Validation",
            tables=[
                table("Trials", ("no.", "trial", "manoeuvre, as recognised"), benchmark, folded=False),
                replace(table(caption, [*heads, "verdict"], rows, folded=True), wide=True),
                *_one_sided(self.study.one_sided),
            ],
            charts=[
                Illustration(_comparison_error_chart(figures, numbers), caption=_COMPARISON_ERRORS, name="validation")
            ],
        )

    def _standards(self) -> Section:
        section = imo_section(self.study.imo, heading="Standard manoeuvres", text=_STANDARDS)
        charts = [replace(chart, name="standard_manoeuvres") for chart in section.charts]
        return replace(section, tables=[replace(one, on_screen=False) for one in section.tables], charts=charts)

    def _replays(self) -> Section:
        rows: list[list[Cell]] = [
            [replay.trial, one.signal, one.unit, one.rms_error, one.percent_of_range, one.noise]
            for replay in self.study.replays
            for one in replay.errors
        ]
        heads = ("trial", "signal", "unit", "rms error", "error over range (%)", "noise")
        charts = [
            replace(chart, name="replays")
            for replay in self.study.replays
            for chart in motions(
                replay.trial, {"measured": replay.measured, "simulated": replay.simulated}, measured=["measured"]
            )
        ]
        errors = table("Free-running replays with the recorded inputs", heads, rows, digits=3, on_screen=False)
        return Section("Replays", text=_REPLAY, tables=[errors], charts=charts)

    def _verification(self) -> Section:
        rows: list[list[Cell]] = [
            [
                row.trial,
                with_unit(*in_words(row.name)),
                _digits(row.value),
                *(_digits(value, 2) for value in (row.halving, row.U_num)),
                _digits(row.deviation, 3),
                None if row.deviation is None or not row.value else 100 * row.deviation / abs(row.value),
            ]
            for row in self.study.verification
        ]
        heads = ("trial", "figure", "value", "by half the step", "U_num", "u_input")
        relative = Column("u_input", "%", digits=3)
        caption = "Standard trials at the speed of expansion in calm water"
        tables = [table(caption, [*heads, relative], rows, on_screen=False)]
        return Section("Verification and uncertainty of the simulation", text=_NUMERICAL, tables=tables)

    def _documentation(self) -> Section:
        rows = list(self.study.documentation.items())
        caption = "Documentation asked for by ITTC 7.5-02-06-03"
        return Section("The simulation model", tables=[table(caption, ("item", "statement"), rows, on_screen=False)])

    def _coefficients(self) -> Section:
        prime = self.study.steered_by is SteeredBy.RUDDER
        factor, caption = (1000, "Prime system, rudder positive to starboard, times 1000") if prime else (1, "SI")
        rows: list[list[Cell]] = [
            [
                name,
                factor * row.value,
                factor * row.standard_error,
                100 * row.standard_error / abs(row.value),
                "stated" if row.stated else "assumed",
            ]
            for name, row in self.study.coefficients.items()
        ]
        errors = [Column("standard error", digits=3), Column("error over value", "%", digits=3)]
        tables = [table(caption, ["coefficient", "value", *errors, "error"], rows, on_screen=False)]
        text = f"Where the card states no standard error, {DEFAULT_RELATIVE_ERROR:.0%} of the value is assumed."
        return Section("Coefficients", text=text, tables=tables)

    def _causes(self) -> Section:
        causes = (*_CAUSES, *([] if self.study.propulsion else [_NO_PROPULSION]))
        tables = [table("Potential causes of errors", ("cause",), [[cause] for cause in causes], on_screen=False)]
        return Section("Causes of error and sensitivity", text=_SENSITIVITY, tables=tables)


def _predictions(found: PredictionStudy) -> Section:
    """Root mean square errors of each trial."""
    fields = {
        "predictions": "",
        "rms_u_mps": "u",
        "rms_v_mps": "v",
        "rms_r_degps": "r",
        "end_distance_m": "position",
        "end_heading_deg": "heading",
    }
    caption = "Rms errors of the motion, and of position and heading at the end of each prediction"
    return Section(
        "Predictions",
        text=f"Each prediction of {PREDICTED_S:g} s is driven by the recorded revolutions. It begins in the state that "
        "a filter has found, and uses nothing measured later.",
        tables=[records_table(caption, found.trials, first="trial", fields=fields)],
    )


def _one_sided(errors: Sequence[OneSidedError]) -> list[Table]:
    """Figures whose errors are on one side in nearly all trials."""
    rows: list[list[Cell]] = [
        [
            with_unit(*in_words(error.name)),
            f"{error.same_side} of {error.trials}",
            error.mean_error,
            error.mean_percent,
            error.probability,
        ]
        for error in errors
    ]
    percent = Column("mean error", "% of D", digits=2)
    heads = ("figure", "errors on one side", Column("mean E", digits=3), percent, Column("p", digits=2))
    caption = "Errors to one side (sign test; p corrected for the number of figures)"
    return [table(caption, heads, rows, on_screen=False)] if rows else []


def _method(figures: Sequence[Validated]) -> Section:
    """How the verdicts come about."""
    shares = (100 * figure.numerical / abs(figure.measured) for figure in figures if figure.measured)
    numerical = f"u_num is {format_number(max(shares, default=0.0), 2)} % of D at most."
    level = f"The level is U_val in per cent of D; required here: {figures[0].required_percent:g} %."
    text = f"{_METHOD} {level}\n\n{_SOURCES_OF_U} {numerical}\n\n{_CLOSED_LOOP}"
    return Section("Method", text=text)


def _digits(value: float | None, digits: int = 4) -> str | None:
    """A number for a column of many units, whose numbers share no decimals."""
    return None if value is None else format_number(value, digits)


def _comparison_error_chart(figures: Sequence[Validated], numbers: Mapping[str, int]) -> ChartSpec:
    """E of each figure next to plus and minus U_val, in per cent of D.

    `numbers` of the trials by name.
    """
    rows = [
        {
            "name": f"{numbers[figure.trial]}: {in_words(figure.name)[0]}",
            "trial": figure.trial,
            "v": 100 * figure.error / abs(figure.measured),
            "least": -(figure.level_percent or 0.0),
            "most": figure.level_percent or 0.0,
            "run": figure.outcome.value,
        }
        for figure in figures
        if figure.error is not None and figure.measured
    ]
    across = PlotAxis("per cent of the measured figure", zero=True)
    y = channel("name:N", sort=names_of(rows), title=None, axis=SIDE | {"labelLimit": 170})
    bars = layer("bar", rows, {"x": across.channel("least"), "x2": "most", "y": y}, style="uncertainty", height=14)
    shown = {"trial:N": "trial", "name:N": "figure", "v:Q": "E (%)", "most:Q": "U_val (%)"}
    side = {"labelLimit": 170}
    points = row_layers(RowPlot(rows, across=across, shown=shown, side=side, rules=[Rule([0.0])]), filled=True, size=80)
    return layered(
        [bars, *points],
        size=(520, {"step": 24}),
        title="Comparison error and validation uncertainty",
        description=f"Comparison error of {len(rows)} figures next to the validation uncertainty.",
    )
