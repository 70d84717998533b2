"""The card of a craft compared with other trials than those it was identified from: free-running predictions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.cards import SteeredCard
from tank2sim.errors import InputError
from tank2sim.identification.craft.fit import PREDICTION_LEAD_S, SHORTEST_PREDICTION_S, predict_by_card
from tank2sim.identification.craft.problem import craft_problem
from tank2sim.identification.craft.study import CraftValidationStudy, study_predictions
from tank2sim.records.same_record import refuse_copies
from tank2sim.records.trials import Trial


def validate_craft(
    card: SteeredCard, trials: Sequence[Trial]
) -> tuple[CraftValidationStudy, SteeredCard, tuple[Path, ...]]:
    """Predict trials of a craft by its card and recorded revolutions, from the state of a filter after ten seconds.

    Parameters
    ----------
    card : SteeredCard
    trials : sequence of Trial
        Trials (:func:`.read_craft_trial`).

    Raises
    ------
    InputError
        There is no trial, a file is at fault, none is long enough, or the card does not move as the trials do.
    """
    if not trials:
        remedy = "give trials that tank2sim log cut and identify did not fit"
        raise InputError("trials", "", "there are none, and a craft is validated by what it did", remedy)
    alike, problem = refuse_copies(trials), craft_problem(card, trials)
    try:
        with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
            predictions = predict_by_card(problem)
    except np.linalg.LinAlgError:
        remedy = "identify the card from trials first"
        raise InputError(card.source, "", "does not move as the trials do, not even roughly", remedy) from None
    if not predictions:
        least = PREDICTION_LEAD_S + SHORTEST_PREDICTION_S
        raise InputError("trials", "", f"none is longer than {least:g} s", "give longer ones")
    paths = tuple(trial.path for trial in trials)
    return study_predictions(card, [str(path) for path in paths], predictions, alike), card, paths
