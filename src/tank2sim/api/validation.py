"""A card validated against trials in the manner of ITTC 7.5-02-06-03, as a result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.analysis.stability.imo import ImoCriterion, imo_criteria
from tank2sim.analysis.validation.documentation import model_documentation
from tank2sim.analysis.validation.standard_trials import MEMBERS, TrialShip, ship_of
from tank2sim.analysis.validation.study import REQUIRED, Validated, Validation, Verified, verify
from tank2sim.analysis.validation.study import validate_card as validate_figures
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import PositiveArgument, SmallEnsemble, checked
from tank2sim.api.craft_validation import validate_craft
from tank2sim.api.result import OldResult, screen_table, section_charts
from tank2sim.api.ship import Ship, as_ship
from tank2sim.api.trial import TrialPaths, trial_files, trials_of
from tank2sim.arrays import Array, Columns
from tank2sim.cards import Card, CraftCard, ManoeuvringCard
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.errors import InputError
from tank2sim.gap.outcome.export import signal_display_name
from tank2sim.gap.proof.replay import replay_by_card
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.assessment.other_ship import evidence_of_other_ship
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.marks import CHECK
from tank2sim.records.thinning import drawn_columns
from tank2sim.results.craft_validation import CraftValidationResult
from tank2sim.simulation.integrator import NO_COMPILER
from tank2sim.units import in_words

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd


REPLAY_SAMPLES = 240
"""Samples of each trial in the JSON, for charts. Project choice: a chart is a few hundred pixels wide, and the record
itself is the file."""


@dataclass(frozen=True, eq=False)
class Replays:
    """Trials replayed, and why others could not be."""

    replayed: tuple[Passed, ...]
    notices: tuple[str, ...]


class ValidationResult(OldResult):
    """Figures of a ship's trials next to those simulated, with the validation uncertainty.

    Parameters
    ----------
    ready : TrialShip
        Card and model.
    trials : Measured
        At the size of the card's ship.
    validation : Validation
    members : int
        Size of the ensemble of the verification.
    """

    command = "validate"

    def __init__(self, ready: TrialShip, trials: Measured, validation: Validation, members: int) -> None:
        self.ready, self.trials, self.validation = ready, trials, validation
        self.verified, troubles = verify(ready, members)
        self.criteria: tuple[ImoCriterion, ...] = tuple(imo_criteria(ready.model))
        replays = _replay(ready.manoeuvring, trials)
        self.replays = replays.replayed
        compiler = () if ready.integrator.compiled else (NO_COMPILER,)
        findings = (*validation.notices, *troubles, *replays.notices)
        self.notices = (*ready.model.notices, *trials.notices, *findings, *compiler)

    @property
    def ship(self) -> Ship:
        """The ship."""
        return Ship(self.ready.card)

    @property
    def verdict(self) -> str:
        """How many figures are validated, too uncertain, only fitted, not validated or open."""
        return self.validation.verdict

    @property
    def figures(self) -> pd.DataFrame:
        """Compared figures, a row each, in the unit of the name: measured D, simulated S, E = S - D, U_val, outcome."""
        import pandas as pd

        rows = [
            (row.trial, row.manoeuvre, row.name, *_numbers(row), str(row.outcome)) for row in self.validation.figures
        ]
        columns = ["trial", "manoeuvre", "figure", "measured", "simulated", "error", "uncertainty", "outcome"]
        return pd.DataFrame(rows, columns=columns)

    @property
    def verification(self) -> pd.DataFrame:
        """Figures of standard trials, a row each: value, numerical uncertainty U_num, deviation by the inputs."""
        import pandas as pd

        rows = [(row.trial, row.name, row.value, row.numerical, row.deviation) for row in self.verified]
        return pd.DataFrame(rows, columns=["trial", "figure", "value", "numerical", "deviation"])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        card, model = self.ready.manoeuvring, self.ready.model
        return {
            "kind": "validate",
            "ship": card.ship.name,
            "source": card.ship.source,
            "documentation": model_documentation(card, model),
            "coefficients": _coefficients(card),
            "propulsion": card.propulsion is not None,
            **self.validation.as_json(),
            "verification": [{**vars(row), "U_num": row.numerical} for row in self.verified],
            "imo": [asdict(criterion) for criterion in self.criteria],
            "replays": [_replay_as_json(replay) for replay in self.replays],
            "notices": self.notices,
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """The verdict, and the largest numerical uncertainty."""
        verdict = f"{self.ready.card.ship.name}: {self.verdict}"
        shares = _numerical_percent(self.verified)
        if not shares:
            return (verdict,)
        return (
            verdict,
            f"Numerical uncertainty of {len(shares)} figures of standard trials: {max(shares):.2g} % at most",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figure by figure; none without a turning circle or a zigzag among the trials."""
        rows: list[list[object]] = [
            [
                row.trial,
                " ".join(part for part in in_words(row.name) if part),
                *_numbers(row),
                str(row.outcome),
            ]
            for row in self.validation.figures
        ]
        if not rows:
            return ()
        columns = ("trial", "figure", "measured", "simulated", "E", "U_val", "verdict")
        return (screen_table("E = simulated less measured, and the validation uncertainty", columns, rows),)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Comparison errors, and track and histories of each replay."""
        return section_charts(self.layout().sections)


@checked
def validate(
    card: Ship | Card | str | Path,
    trials: TrialPaths = (),
    *,
    members: SmallEnsemble = MEMBERS,
    required_percent: PositiveArgument = REQUIRED,
) -> ValidationResult | CraftValidationResult:
    """Validate a ship in the manner of ITTC 7.5-02-06-03 by trials that did not make its card, figure by figure.

    A trial that the card was identified from can only refute it. A craft with thrusters is validated by free-running
    predictions of its trials, without `members` and `required_percent`.

    Parameters
    ----------
    card : Ship, Card, str or path
    trials : path, TrialRecord, or sequence of them
        Turning circles and zigzags; a folder means the trials in it. Without any, the model is documented and
        verified.
    members : int
        Ships drawn within the errors of the card for u_input; 0 for none: no figure can then be judged.
    required_percent : float
        U_reqd in per cent of each measured figure.

    Raises
    ------
    InputError
        The card is not one of a ship that manoeuvres, or a file is at fault.
    """
    if isinstance(as_ship(card).card, CraftCard):
        return validate_craft(as_ship(card), trial_files(trials))
    ship = as_ship(card).manoeuvring()
    records = trials_of(trials)
    given = measured(records, ship) if records else Measured((), "angle", ())
    found = validate_figures(ship, given.trials, members, required_percent)
    if records and (evidence := evidence_of_other_ship(ship, given)):
        notice = f"{CHECK} these look like trials of another ship: {'; '.join(evidence)}"
        found = replace(found, notices=(notice, *found.notices))
    return ValidationResult(ship_of(ship), given, found, members)


def _replay(card: ManoeuvringCard, given: Measured) -> Replays:
    """Replay each trial by itself, so that a trial that cannot be replayed spoils no other."""
    found: list[Passed] = []
    notices: list[str] = []
    for trial in given.trials:
        try:
            found += replay_by_card(card, Measured((trial,), given.driven_by, ()))
        except InputError as error:
            notices.append(f"{trial.name}: not replayed: {error.problem}")
    return Replays(tuple(found), tuple(notices))


def _replay_as_json(replay: Passed) -> dict[str, object]:
    """A trial as measured and as simulated, thinned to draw; columns as in a trial file."""
    names = {name: signal_display_name(name) for name in replay.measured if name in replay.before}

    def columns(values: Mapping[str, Array]) -> Columns:
        in_file = {column.file: column.factor * values[name] for name, column in names.items()}
        return drawn_columns({"t_s": replay.time_s, **in_file}, REPLAY_SAMPLES)

    errors = [_replay_error(replay, name) for name in replay.noise]
    runs = {"measured": columns(replay.measured), "simulated": columns(replay.before)}
    return {"trial": replay.name, "errors": errors, **runs}


_ANGLES = ("motion.r", "motion.psi", "motion.cog", "motion.phi")
_UNITS = {"motion.r": "deg/s", "motion.psi": "deg", "motion.cog": "deg", "motion.phi": "deg"}
_UNITS |= dict.fromkeys(("motion.x", "motion.y"), "m")


def _replay_error(replay: Passed, name: str) -> dict[str, str | float | None]:
    """Root mean square error of a signal, also in per cent of its range, and the noise of its measurement."""
    factor = math.degrees(1.0) if name in _ANGLES else 1.0
    known = np.isfinite(replay.measured[name])
    measured, simulated = replay.measured[name][known], replay.before[name][known]
    error, spread = float(np.sqrt(np.mean((simulated - measured) ** 2))), float(np.ptp(measured))
    return {
        "signal": name.removeprefix("motion."),
        "unit": _UNITS.get(name, "m/s"),
        "rms_error": factor * error,
        "percent_of_range": 100 * error / spread if spread > 0 else None,
        "noise": factor * replay.noise[name],
    }


def _coefficients(card: ManoeuvringCard) -> dict[str, dict[str, float | bool | None]]:
    """The derivatives of a card with their standard errors, prime; `stated` is false where the error is assumed."""
    return {
        name: {
            "value": card.derivatives[name],
            "standard_error": card.standard_error(name),
            "stated": name in card.uncertainty,
        }
        for name in (*ALL_TERMS, *(name for name in card.derivatives if name not in ALL_TERMS))
        if card.derivatives.get(name)
    }


def _numbers(row: Validated) -> tuple[float | None, ...]:
    """D, S, E and U_val."""
    return row.measured, row.simulated, row.error, row.uncertainty


def _numerical_percent(verified: Sequence[Verified]) -> list[float]:
    """U_num of each figure in per cent of its value."""
    return [100 * abs(row.numerical / row.value) for row in verified if row.numerical is not None and row.value]
