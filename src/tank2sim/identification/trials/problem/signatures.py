"""The trials that a card was fitted to, written on it with some of their rows, by which a copy is known again."""

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
    """A card's text with trials, at the size of its ship, among its ``[[fitted_trials]]``; each once."""
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
    """Name on the card of the fitted trial whose record this is, whatever its file is called; None if it is none.

    `trial` is at the size of the card's ship. See :func:`tank2sim.records.same_record.same_record` for what it may
    differ by.
    """
    return next((one.name for one in card.fitted_trials if one.t_s and same_record(_record(one), trial)), None)


def _record(fitted: FittedTrial) -> Trial:
    signals = {name: np.array(values) for name, values in fitted.signals.items()}
    return Trial(Path(fitted.name), np.array(fitted.t_s), signals)
