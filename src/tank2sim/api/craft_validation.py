"""A craft's card against trials that did not make it: free-running predictions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.answer.parts import Table
from tank2sim.api.craft_identification import CraftTrialPaths, craft_trial_files
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import CraftCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.identification.craft.fit import (
    PREDICTED_S,
    PREDICTION_LEAD_S,
    SHORTEST_PREDICTION_S,
    FreePrediction,
    determination,
    predict_by_card,
)
from tank2sim.identification.craft.problem import craft_problem
from tank2sim.records.craft_trials import read_craft_trial
from tank2sim.records.same_record import refuse_copies

NOT_ITS_OWN = (
    "a trial that the card was identified from shows how well it was fitted, and not how well the card predicts"
)
"""Notice of each validation: a card of a craft does not say what it was identified from."""


class CraftValidationResult(OldResult):
    """Free-running predictions of trials by a craft's card.

    Parameters
    ----------
    ship : Ship
    paths : sequence of Path
        Of all trials.
    predictions : sequence of FreePrediction
        Of those that are long enough.
    """

    command = "validate"

    def __init__(
        self, ship: Ship, paths: Sequence[Path], predictions: Sequence[FreePrediction], alike: Sequence[str] = ()
    ) -> None:
        self.ship, self.paths, self.predictions = ship, tuple(paths), tuple(predictions)
        known = {entry.run.file for entry in self.predictions}
        short = [path.name for path in self.paths if str(path) not in known]
        least = PREDICTION_LEAD_S + SHORTEST_PREDICTION_S
        self.notices = (
            *doubts(ship.card),
            *alike,
            *([f"not longer than {least:g} s, and not predicted: {', '.join(short)}"] if short else []),
            NOT_ITS_OWN,
        )

    @property
    def determination(self) -> dict[str, float]:
        """R^2 of u, v and r of all predictions, next to the motion smoothed with the card."""
        predicted = np.concatenate([entry.predicted for entry in self.predictions])
        smoothed = np.concatenate([entry.smoothed for entry in self.predictions])
        return dict(zip("uvr", map(float, determination(predicted, smoothed)), strict=True))

    def _rows(self) -> list[list[object]]:
        rows = []
        for entry in self.predictions:
            rms = np.sqrt(((entry.predicted - entry.smoothed) ** 2).mean(axis=0))
            rows.append([entry.run.name, len(entry.ends), rms[0], rms[1], math.degrees(rms[2]), *_at_ends([entry])])
        return [[row[0], *(None if value is None else float(value) for value in row[1:])] for row in rows]

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        place, heading = _at_ends(self.predictions)
        keys = ("predictions", "rms_u_mps", "rms_v_mps", "rms_r_degps", "end_distance_m", "end_heading_deg")
        return {
            "ship": self.ship.name,
            "determination": self.determination,
            "end_distance_m": place,
            "end_heading_deg": heading,
            "trials": {str(name): dict(zip(keys, row, strict=True)) for name, *row in self._rows()},
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """R^2 of the velocities, and the errors of position and heading after a prediction."""
        place, heading = _at_ends(self.predictions)
        words = ", ".join(f"{name} {value:.3f}" for name, value in self.determination.items())
        count, trials = sum(len(entry.ends) for entry in self.predictions), len(self.predictions)
        after = "" if place is None else f"; at their end {place:.3g} m"
        after += "" if heading is None else f" and {heading:.3g} deg" if after else f"; at their end {heading:.3g} deg"
        return (
            f"{self.ship.name}: {count} free-running predictions of up to {PREDICTED_S:g} s of {trials} "
            f"trial{'s' * (trials != 1)}: R^2 of {words}",
            f"rms error of position and heading next to what was measured{after}",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Root mean square errors of each trial."""
        heads = ("trial", "predictions", "u (m/s)", "v (m/s)", "r (deg/s)", "place (m)", "heading (deg)")
        return (screen_table("Rms errors: of the motion, and at the end of each prediction", heads, self._rows()),)


def _at_ends(predictions: Sequence[FreePrediction]) -> tuple[float | None, float | None]:
    """Rms distance (m) and heading error (deg) at the ends of predictions; None where nothing was measured there."""
    ends = np.concatenate([entry.ends for entry in predictions])
    distance = np.hypot(ends[:, 0], ends[:, 1])
    turned = np.degrees((ends[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    return _rms(distance), _rms(turned)


def _rms(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if len(known) else None


def validate_craft(ship: Ship, trials: CraftTrialPaths) -> CraftValidationResult:
    """Predict trials of a craft by its card and recorded revolutions, from the state of a filter after ten seconds.

    Parameters
    ----------
    ship : Ship
        Of a card of kind ``small_craft``.
    trials : path or sequence of paths
        As those of :func:`tank2sim.identify_craft`.

    Raises
    ------
    InputError
        There is no trial, a file is at fault, none is long enough, or the card does not move as the trials do.
    """
    card = ship.card
    assert isinstance(card, CraftCard)
    paths = craft_trial_files(trials)
    if not paths:
        remedy = "give trials that tank2sim log cut and identify did not fit"
        raise InputError("trials", "", "there are none, and a craft is validated by what it did", remedy)
    read = [read_craft_trial(path, card.thrusters) for path in paths]
    alike, problem = refuse_copies(read), craft_problem(card, read)
    try:
        with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
            predictions = predict_by_card(problem)
    except np.linalg.LinAlgError:
        remedy = "identify the card from trials first"
        raise InputError(card.source, "", "does not move as the trials do, not even roughly", remedy) from None
    if not predictions:
        least = PREDICTION_LEAD_S + SHORTEST_PREDICTION_S
        raise InputError("trials", "", f"none is longer than {least:g} s", "give longer ones")
    return CraftValidationResult(ship, paths, predictions, alike)
