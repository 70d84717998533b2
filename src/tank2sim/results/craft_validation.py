"""Result of ``validate`` for a craft with thrusters: free-running predictions of its trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.parts import KeyFigure, Section, records_table
from tank2sim.answer.result import Result
from tank2sim.cards import SteeredCard
from tank2sim.identification.craft.fit import PREDICTED_S
from tank2sim.identification.craft.study import CraftValidationStudy


@dataclass(frozen=True, eq=False, repr=False)
class CraftValidationResult(Result[CraftValidationStudy]):
    """Free-running predictions of trials by a craft's card.

    Parameters
    ----------
    study : CraftValidationStudy
    card : SteeredCard, optional
        None if the result was read from its JSON; ``ship`` is its ship.
    paths : tuple of Path
        Files of all trials.
    """

    study: CraftValidationStudy
    card: SteeredCard | None = None
    paths: tuple[Path, ...] = ()
    command: ClassVar[str] = "validate"

    @property
    def determination(self) -> dict[str, float]:
        """R^2 of u, v and r of all predictions, next to the motion smoothed with the card."""
        return self.study.determination

    @property
    def title(self) -> str:
        """The craft."""
        return f"{self.study.ship}: validation"

    @property
    def headline(self) -> tuple[str, ...]:
        """R^2 of the velocities, and the errors of position and heading after a prediction."""
        study = self.study
        words = ", ".join(f"{name} {value:.3f}" for name, value in study.determination.items())
        count, trials = sum(one.predictions for one in study.trials.values()), len(study.trials)
        ends = {"m": study.end_distance_m, "deg": study.end_heading_deg}
        errors = " and ".join(f"{value:.3g} {unit}" for unit, value in ends.items() if value is not None)
        return (
            f"{study.ship}: {count} free-running predictions of up to {PREDICTED_S:g} s of {trials} "
            f"trial{'s' * (trials != 1)}: R^2 of {words}.",
            *([f"Rms error of position and heading at the ends of predictions: {errors}."] if errors else []),
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """R^2, and the errors at the ends of predictions."""
        ends = {"Error of position": (self.study.end_distance_m, "m")}
        ends["Error of heading"] = (self.study.end_heading_deg, "deg")
        return [
            *(KeyFigure(label=f"R^2 of {name}", value=round(one, 3)) for name, one in self.determination.items()),
            *(
                KeyFigure(label=label, value=value, unit=unit, note=f"rms, after up to {PREDICTED_S:g} s")
                for label, (value, unit) in ends.items()
                if value is not None
            ),
        ]

    @property
    def sections(self) -> Sequence[Section]:
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
        return [
            Section(
                heading="Predictions",
                text=f"Each prediction of {PREDICTED_S:g} s is driven by the recorded revolutions. It begins in the "
                "state that a filter has found, and uses nothing measured later.",
                tables=[records_table(caption, self.study.trials, first="trial", fields=fields)],
            )
        ]
