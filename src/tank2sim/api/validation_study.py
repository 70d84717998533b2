"""Validation of a card: figures judged, the model documented and verified, trials replayed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.analysis.stability.imo import imo_criteria
from tank2sim.analysis.validation.documentation import model_documentation
from tank2sim.analysis.validation.standard_trials import TrialShip, drawn_ships, ship_of
from tank2sim.analysis.validation.study import NOTHING_VALIDATED, verify
from tank2sim.analysis.validation.study import validate_card as validate_figures
from tank2sim.arrays import Array, Columns
from tank2sim.cards import ManoeuvringCard, SteeredCard
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.errors import InputError
from tank2sim.gap.outcome.export import signal_display_name
from tank2sim.gap.proof.replay import replay_by_card
from tank2sim.gap.result import Passed
from tank2sim.identification.craft.first_values import PREDICTED_S
from tank2sim.identification.craft.study import predict_trials
from tank2sim.identification.trials.assessment.other_ship import evidence_of_other_ship
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.notices import Notice, caution
from tank2sim.records.same_record import refuse_copies
from tank2sim.records.thinning import drawn_columns
from tank2sim.records.trials import Trial
from tank2sim.results.validation import CardValue, SignalError, TrialReplay, ValidationStudy
from tank2sim.simulation.integrator import NO_COMPILER

REPLAY_SAMPLES = 240
"""Samples of each trial in the JSON, for charts. Project choice: a chart is a few hundred pixels wide, and the record
itself is the file."""


def validate_ship(
    card: SteeredCard, records: Sequence[Trial], members: int, required_percent: float
) -> tuple[ValidationStudy, SteeredCard, tuple[Path, ...]]:
    """The study, the card and the files of trials; `members`, `required_percent`: as of :func:`.validate`."""
    ready = ship_of(card)
    more = _of_craft(card, records) if card.thrusters else _of_ship(ready, records, members, required_percent)
    study = _documented(ready, members)
    drawn = drawn_ships(card, more.pop("runs", {}))
    if drawn and study.drawn:
        more["drawn"] = replace(drawn, figures={**drawn.figures, **study.drawn.figures})
    notices = (*ready.model.notices, *more.pop("notices"), *study.notices)
    return replace(study, notices=notices, **more), card, tuple(trial.path for trial in records)


def _of_craft(card: SteeredCard, records: Sequence[Trial]) -> dict[str, Any]:
    """Fields of the study of a craft that are from its trials."""
    if not records:
        return {"notices": ()}
    alike = refuse_copies(records)
    predictions, notices = predict_trials(card, records)
    count, named = sum(one.predictions for one in predictions.trials.values()), len(predictions.trials)
    found = ", ".join(f"{name} {value:.3f}" for name, value in predictions.determination.items())
    verdict = f"{count} free-running predictions of up to {PREDICTED_S:g} s of {named} trial{'s' * (named != 1)}"
    return {"predictions": predictions, "verdict": f"{verdict}: R^2 of {found}", "notices": (*alike, *notices)}


def _of_ship(ready: TrialShip, records: Sequence[Trial], members: int, required_percent: float) -> dict[str, Any]:
    """Fields of the study of a ship that are from its trials."""
    card = ready.card.manoeuvring()
    given = measured(records, card) if records else Measured((), "angle", ())
    found = validate_figures(card, given.trials, members, required_percent)
    notices = [*given.notices, *found.notices]
    if records and (evidence := evidence_of_other_ship(card, given)):
        notices.insert(len(given.notices), caution(f"these look like trials of another ship: {'; '.join(evidence)}"))
    replays, not_replayed = _replays(card, given)
    return {
        "verdict": found.verdict,
        "counts": found.counts,
        "figures": found.figures,
        "one_sided": found.one_sided,
        "runs": found.runs,
        "imo": tuple(imo_criteria(ready.model)),
        "replays": replays,
        "notices": (*notices, *not_replayed),
    }


def _documented(ready: TrialShip, members: int) -> ValidationStudy:
    """Document and verify a ship or craft."""
    card, model = ready.card, ready.model
    verified, troubles, runs = verify(ready, members)
    compiler = () if ready.integrator.compiled else (NO_COMPILER,)
    return ValidationStudy(
        ship=card.ship.name,
        source=card.ship.source,
        documentation=model_documentation(card, model),
        coefficients=_coefficients(card),
        steered_by=card.steered_by,
        propulsion=bool(card.propulsion or card.thrusters),
        verdict=NOTHING_VALIDATED,
        counts={},
        figures=(),
        members=members,
        verification=verified,
        imo=(),
        replays=(),
        notices=(*troubles, *compiler),
        drawn=drawn_ships(card, runs),
    )


def _replays(card: ManoeuvringCard, given: Measured) -> tuple[tuple[TrialReplay, ...], list[Notice]]:
    """Replay each trial by itself, so that a trial that cannot be replayed spoils no other; and notices on these."""
    found: list[TrialReplay] = []
    notices: list[Notice] = []
    for trial in given.trials:
        try:
            found += map(_replay, replay_by_card(card, Measured((trial,), given.driven_by, ())))
        except InputError as error:
            notices.append(Notice(f"{trial.name}: not replayed: {error.problem}"))
    return tuple(found), notices


def _replay(replay: Passed) -> TrialReplay:
    names = {name: signal_display_name(name) for name in replay.measured if name in replay.before}

    def columns(values: Mapping[str, Array]) -> Columns:
        in_file = {column.file: column.factor * values[name] for name, column in names.items()}
        return drawn_columns({"t_s": replay.time_s, **in_file}, REPLAY_SAMPLES)

    return TrialReplay(
        trial=replay.name,
        errors=tuple(_replay_error(replay, name) for name in replay.noise),
        measured=columns(replay.measured),
        simulated=columns(replay.before),
    )


_ANGLES = ("motion.r", "motion.psi", "motion.cog", "motion.phi")
_UNITS = {"motion.r": "deg/s", "motion.psi": "deg", "motion.cog": "deg", "motion.phi": "deg"}
_UNITS |= dict.fromkeys(("motion.x", "motion.y"), "m")


def _replay_error(replay: Passed, name: str) -> SignalError:
    """Root mean square error of a signal, also in per cent of its range, and the noise of its measurement."""
    factor = math.degrees(1.0) if name in _ANGLES else 1.0
    known = np.isfinite(replay.measured[name])
    measured, simulated = replay.measured[name][known], replay.before[name][known]
    error, spread = float(np.sqrt(np.mean((simulated - measured) ** 2))), float(np.ptp(measured))
    return SignalError(
        signal=name.removeprefix("motion."),
        unit=_UNITS.get(name, "m/s"),
        rms_error=factor * error,
        percent_of_range=100 * error / spread if spread > 0 else None,
        noise=factor * replay.noise[name],
    )


def _coefficients(card: SteeredCard) -> dict[str, CardValue]:
    """The derivatives of a card with their standard errors, prime or SI."""
    return {
        name: CardValue(
            value=card.derivatives[name], standard_error=card.standard_error(name), stated=name in card.uncertainty
        )
        for name in (*ALL_TERMS, *(name for name in card.derivatives if name not in ALL_TERMS))
        if card.derivatives.get(name)
    }
