"""Coefficients and thrust curves of a craft with thrusters from trials with recorded revolutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.cards import SteeredCard
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.craft.card import estimated_numbers, identified_craft
from tank2sim.identification.craft.fit import FreePrediction, fit_craft, predict_free
from tank2sim.identification.craft.order_response import order_responses
from tank2sim.identification.craft.problem import craft_driven_by, craft_problem
from tank2sim.identification.craft.study import study_craft
from tank2sim.identification.trials.problem.estimation_problem import SearchReport, silent
from tank2sim.records.same_record import refuse_copies
from tank2sim.records.trials import Trial
from tank2sim.results.craft_identification import CraftIdentificationResult


def identify_craft(
    card: SteeredCard, fitted: Sequence[Trial], held: Sequence[Trial], progress: SearchReport = silent
) -> CraftIdentificationResult:
    """Identify hull and thrust curves of a craft with thrusters from trials with position, heading and revolutions.

    Parameters
    ----------
    card : SteeredCard
        Mass and places of the thrusters are taken as exact, all else with the stated standard errors or wide ones.
    fitted, held : sequence of Trial
        Trials to fit, and trials only to predict (:func:`.read_craft_trial`).
    progress : callable
        Called with each better estimate.

    Raises
    ------
    InputError
        A file is at fault, or a trial is given twice.
    """
    if not fitted:
        raise ArgumentError("trials", "", "is empty", "give trials, or a folder with CSV files")
    read = [*fitted, *held]
    alike = (*refuse_copies(fitted), *refuse_copies(fitted, held))
    problem, driven_by = craft_problem(card, read), craft_driven_by(card, read)
    runs = problem.runs
    try:
        # A step of the search may be one to an unstable craft. Threads of the linear algebra only wait for each other.
        with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
            fit = fit_craft(problem.with_runs(runs[: len(fitted)]), progress)
    except np.linalg.LinAlgError:
        remedy = "check mass, thrust curves and damping of the card, and the places and signs of the thrusters"
        raise InputError(card.source, "", "does not move as the trials do, not even roughly", remedy) from None
    predictions = predict_free(fit, runs[len(fitted) :]) if held else []
    responses = order_responses(card, fitted)
    names = [run.name for run in runs[len(fitted) :]]
    found = identified_craft(card, fit, responses)
    estimated = estimated_numbers(card, fit)
    places = list(estimated.values())
    covariance = by_file_name(found, list(estimated), fit.estimate.covariance[np.ix_(places, places)])
    held_out: dict[str, FreePrediction | None] = dict.fromkeys(names)
    held_out |= {prediction.run.name: prediction for prediction in predictions}
    study = study_craft(card, found, fit, held_out, responses, driven_by)
    study = replace(study, notices=(*alike, *study.notices))
    return CraftIdentificationResult(study, replace(found, covariance=covariance), fit, tuple(predictions))
