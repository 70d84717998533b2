"""Free-running trials: the files that are meant, and the records brought to a ship's size."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.identification.trials.problem.signatures import fitted_as
from tank2sim.records.reading import READERS, looks_like_a_trial
from tank2sim.records.same_record import refuse_copies

TrialPaths = Sequence[str | Path] | str | Path


def trial_files(given: TrialPaths) -> list[Path]:
    """The files that are meant: a folder stands for the trials in it.

    Raises
    ------
    InputError
        A folder holds no trial.
    """
    found: list[Path] = []
    for path in [Path(given)] if isinstance(given, str | Path) else map(Path, given):
        inside = sorted(file for file in path.glob("*") if looks_like_a_trial(file)) if path.is_dir() else [path]
        if not inside:
            endings = ", ".join(dict.fromkeys(ending for reader in READERS.values() for ending in reader.suffixes))
            raise InputError(path, "", "holds no trial", f"a folder with trials ({endings}) was expected")
        found += inside
    return found


def fitted_and_held(trials: TrialPaths, holdout: TrialPaths, card: ManoeuvringCard) -> tuple[Measured, Measured]:
    """Trials to be fitted and held out, at the size of the card's ship.

    Raises
    ------
    InputError
        A file is at fault (:func:`tank2sim.identification.trials.problem.prepare_trials.measured`), or two have one
        name or are one record, also where one of them is held out; or the card was fitted to one that is held out.
    """
    fitted, held = measured(trial_files(trials), card), measured(trial_files(holdout), card)
    for trial in held.trials:
        if trial.name in {other.name for other in fitted.trials}:
            raise InputError(trial.path, "", "is both fitted and held out", "hold out what is not fitted")
    refuse_copies(fitted.trials, held.trials)
    for trial in held.trials:
        if (name := fitted_as(card, trial)) is not None:
            problem = f"is held out, and {card.source} was fitted to it: it is the record of {name}"
            raise InputError(trial.path, "", problem, "hold out what the card was not fitted to")
    return fitted, held
