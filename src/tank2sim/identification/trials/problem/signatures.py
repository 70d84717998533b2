"""The trials that a card was fitted to: a signature of each in the card, by which a copy is recognised."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import FittedTrial
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.records.same_record import same_record, signature
from tank2sim.records.trials import Trial


def with_fitted_trials(text: str, source: str, trials: Sequence[Trial]) -> str:
    """A card's text with trials, at the size of its ship, added to its ``[[fitted_trials]]``; each once."""
    card = parse_card(text, source)
    assert isinstance(card, ManoeuvringCard)
    new = []
    for trial in trials:
        if fitted_as(card, trial) is None:
            time, signals = signature(trial)
            new.append(FittedTrial(name=trial.name, t_s=time, signals=signals))
    if not new:
        return text
    return changed_text(text, source, {"fitted_trials": [trial.model_dump() for trial in (*card.fitted_trials, *new)]})


def fitted_as(card: ManoeuvringCard, trial: Trial) -> str | None:
    """Name on the card of the fitted trial with the same record, whatever the name of its file; None if there is none.

    `trial` is at the size of the card's ship. :func:`tank2sim.records.same_record.same_record` states the tolerance.
    """
    return next(
        (fitted.name for fitted in card.fitted_trials if fitted.t_s and same_record(_record(fitted), trial)), None
    )


def _record(fitted: FittedTrial) -> Trial:
    signals = {name: np.array(values) for name, values in fitted.signals.items()}
    return Trial(Path(fitted.name), np.array(fitted.t_s), signals)
