"""Free-running trials to fit and to hold out, at the size of a ship."""

from __future__ import annotations

from tank2sim.api.trial import TrialPaths, trial_files, trials_of
from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.identification.trials.problem.signatures import fitted_as
from tank2sim.records.same_record import refuse_copies

__all__ = ["TrialPaths", "fitted_and_held", "trial_files"]


def fitted_and_held(trials: TrialPaths, holdout: TrialPaths, card: ManoeuvringCard) -> tuple[Measured, Measured]:
    """Trials to be fitted and those of `holdout`, at the size of the card's ship.

    Raises
    ------
    InputError
        A file is at fault (:func:`tank2sim.identification.trials.problem.prepare_trials.measured`), or two have one
        name or are one record, also where one of them is held out; or the card was fitted to one that is held out.
    """
    fitted, held = measured(trials_of(trials), card), measured(trials_of(holdout), card)
    for trial in held.trials:
        if trial.name in {other.name for other in fitted.trials}:
            raise InputError(trial.path, "", "is both fitted and held out", "hold out what is not fitted")
    refuse_copies(fitted.trials, held.trials)
    for trial in held.trials:
        if (name := fitted_as(card, trial)) is not None:
            problem = f"is held out, and {card.source} was fitted to it: it is the record of {name}"
            raise InputError(trial.path, "", problem, "hold out what the card was not fitted to")
    return fitted, held
