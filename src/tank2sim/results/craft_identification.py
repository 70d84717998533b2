"""Result of ``identify`` for a craft with thrusters: coefficients and thrust curves with a verdict on each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, records_table, table
from tank2sim.answer.result import Result
from tank2sim.cards import SteeredCard
from tank2sim.identification.craft.fit import CoefficientVerdict, CraftFit, FreePrediction
from tank2sim.identification.craft.study import CandidateTrial, CraftIdentificationStudy
from tank2sim.identification.trials.study import ParameterEstimate
from tank2sim.results.identification import parameter_chart

_IN_ERRORS = (
    "Value less the card's in the card's standard errors, with the interval of 95 %, and the share of the "
    "information that is from the trials."
)


@dataclass(frozen=True, eq=False, repr=False)
class CraftIdentificationResult(Result[CraftIdentificationStudy]):
    """Coefficients and thrust curves of a craft.

    Parameters
    ----------
    study : CraftIdentificationStudy
    card : SteeredCard, optional
        The card found; ``card.save("better.toml")`` writes it, and ``ship`` is its ship.
    fit : CraftFit, optional
    predictions : tuple of FreePrediction
        Those of held-out trials. All are missing if the result was read from its JSON.
    """

    study: CraftIdentificationStudy
    card: SteeredCard | None = None
    fit: CraftFit | None = None
    predictions: tuple[FreePrediction, ...] = ()
    command: ClassVar[str] = "identify"
    subject: ClassVar[str] = "coefficients from trials"

    @property
    def determination(self) -> dict[str, float] | None:
        """R^2 of u, v and r of all 30 s predictions of held-out trials, next to the smoothed motion."""
        return self.study.determination

    @property
    def next_trials(self) -> tuple[CandidateTrial, ...]:
        """Manoeuvres of five minutes; the first would determine most of the coefficients that these trials do not."""
        return self.study.next_trials

    @property
    def subtitle(self) -> str:
        """Trials and method."""
        return f"{', '.join(self.study.trials)}; {self.study.method.replace('_', ' ')}"

    @property
    def headline(self) -> tuple[str, ...]:
        """How many coefficients the trials determine, how well held-out trials are predicted, and what to run next."""
        study = self.study
        lines = [
            f"{study.ship}: {_trials(len(study.trials))} {self._determined} of {len(study.coefficients)} "
            f"coefficients, {self._identified} of them within a quarter of their value."
        ]
        if study.determination:
            words = ", ".join(f"{name} {value:.3f}" for name, value in study.determination.items())
            lines.append(f"Free-running predictions of up to 30 s of held-out trials: R^2 of {words}.")
        if study.next_trials and study.next_trials[0].determines:
            best = study.next_trials[0]
            lines.append(f"Next: {best.words}; it would determine {', '.join(best.determines)}.")
        return tuple(lines)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Coefficients determined, and R^2 of the predictions."""
        count = len(self.study.coefficients)
        return [
            KeyFigure("Coefficients determined", f"{self._determined} of {count}"),
            KeyFigure("Within a quarter of their value", f"{self._identified} of {count}"),
            *(
                KeyFigure(f"R^2 of {name}", round(value, 3), note="predictions of held-out trials")
                for name, value in (self.study.determination or {}).items()
            ),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Coefficients and next trials, and the response of thrusters to orders."""
        responses = self.study.order_responses
        heading = "Response to orders"
        fields = dict.fromkeys(("lag_s", "lag_error_s", "dead_band_rpm", "dead_band_error_rpm"), "")
        fields |= {"rest_rpm": "rested at", "turning_rpm": "turned at"}
        shown = [records_table(heading, responses, first="thruster", fields=fields)] if responses else []
        parts = "A is constant, B goes with the sine of the heading and C with its cosine (shown less true)."
        found = [] if self.study.compass is None else [records_table("Compass", [self.study.compass], folded=False)]
        return [
            *craft_sections(self.study),
            *([Section(heading, tables=shown)] if shown else []),
            *([Section("Deviation of the compass", text=parts, tables=found)] if found else []),
        ]

    @property
    def _determined(self) -> int:
        return sum(one.verdict is not CoefficientVerdict.PRIOR for one in self.study.coefficients.values())

    @property
    def _identified(self) -> int:
        return sum(one.verdict is CoefficientVerdict.IDENTIFIED for one in self.study.coefficients.values())


def craft_sections(study: CraftIdentificationStudy) -> list[Section]:
    """Return the section with each coefficient, the verdict on it, and the five minutes that would determine more."""
    heads: list[str | Column] = ["coefficient (SI)", "value", Column("standard error", digits=2)]
    rows: list[list[Cell]] = [
        [name, one.value, one.standard_error, one.before, one.prior_standard_error, one.verdict.value, one.by]
        for name, one in study.coefficients.items()
    ]
    tables = [table("Coefficients", [*heads, "card", "error of the card", "verdict", "mostly by"], rows, folded=False)]
    if study.next_trials:
        orders: list[list[Cell]] = [[one.words, ", ".join(one.determines) or None] for one in study.next_trials]
        further = (Column("five minutes of (port/starboard, % of full)"), "would determine")
        tables.append(table("Next five minutes", further, orders))
    by_trials = {
        name: ParameterEstimate(
            value=one.value,
            standard_error=one.standard_error,
            before=one.before,
            before_standard_error=one.prior_standard_error,
            prior_standard_error=one.prior_standard_error,
            share_from_trials=1 - (one.standard_error / one.prior_standard_error) ** 2,
        )
        for name, one in study.coefficients.items()
        if one.prior_standard_error > 0
    }
    chart = parameter_chart(by_trials, title="Coefficients")
    text = (
        "Identified: the standard error is at most a quarter of the value. Bounded: the trials have at least halved "
        "the standard error of the card. Not determined: the value is the card's."
    )
    charts = [Illustration(chart, caption=_IN_ERRORS, name="coefficients")]
    return [Section("Coefficients determined by the trials", text=text, tables=tables, charts=charts)]


def _trials(count: int) -> str:
    return "1 trial determines" if count == 1 else f"{count} trials determine"
