"""Coefficients and thrust curves of a craft with thrusters from trials in which its revolutions were recorded."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arguments import checked
from tank2sim.cards import Card, CraftCard
from tank2sim.dynamics.vessel import Vessel, as_vessel
from tank2sim.errors import InputError
from tank2sim.identification.craft.card import identified_craft
from tank2sim.identification.craft.fit import FreePrediction, fit_craft, predict_free
from tank2sim.identification.craft.order_response import order_responses
from tank2sim.identification.craft.problem import craft_driven_by, craft_problem
from tank2sim.identification.craft.study import study_craft
from tank2sim.identification.trials.problem.estimation_problem import SearchReport, silent
from tank2sim.records.craft_trials import read_craft_trial
from tank2sim.records.same_record import refuse_copies
from tank2sim.results.craft_identification import CraftIdentificationResult

CraftTrialPaths = str | Path | Sequence[str | Path]
"""Trials: a file, a folder with CSV files, or several of them."""


@checked
def identify_craft(
    card: Vessel | Card | str | Path,
    trials: CraftTrialPaths,
    *,
    holdout: CraftTrialPaths = (),
    progress: SearchReport = silent,
) -> CraftIdentificationResult:
    """Identify hull and thrust curves of a craft with thrusters from trials with position, heading and revolutions.

    The trials are those that :func:`tank2sim.log` cuts: columns ``t_s``, ``x_m``, ``y_m``, ``psi_deg`` and, of each
    thruster, ``n_<name>_rpm``; ``r_degps`` is used where it is there. A current and a mean wind are estimated for each
    trial.

    Parameters
    ----------
    card : Vessel, Card, str or path
        Of kind ``small_craft``: mass and places of the thrusters are taken as exact, all else with the standard errors
        that it states, or wide ones.
    trials, holdout : path or sequence of paths
        Trials to fit, and trials only to predict; a folder means the CSV files in it.
    progress : callable
        Called with each better estimate.

    Raises
    ------
    InputError
        The card is of another kind, a file is at fault, or a trial is given twice.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import tank2sim as t2s
    >>> otter, folder = t2s.load("otter"), Path(tempfile.mkdtemp())
    >>> for name in ("straight:600", "spin:400", "difference:300"):
    ...     rows = otter.simulate(name, duration_s=10).df[::40]
    ...     rows.to_csv(folder / f"{name.partition(':')[0]}.csv", index=False)
    >>> found = t2s.identify_craft(otter, folder)
    >>> abs(found.card.thrusters[0].ahead_Ns2 / 0.01108 - 1) < 0.05
    True
    """
    ship = as_vessel(card)
    if not isinstance(ship.card, CraftCard):
        raise InputError(ship.card.source, "model.kind", "is not small_craft", "t2s.identify takes cards of ships")
    fitted, held = craft_trial_files(trials), craft_trial_files(holdout)
    if not fitted:
        raise InputError("trials", "", "there are none", "give trial files, or a folder with CSV files")
    twice = {path.resolve() for path in fitted} & {path.resolve() for path in held}
    if twice:
        raise InputError(sorted(twice)[0], "", "is fitted and held out", "give it once")
    read = [read_craft_trial(path, ship.card.thrusters) for path in (*fitted, *held)]
    alike = (*refuse_copies(read[: len(fitted)]), *refuse_copies(read[: len(fitted)], read[len(fitted) :]))
    problem, driven_by = craft_problem(ship.card, read), craft_driven_by(ship.card, read)
    runs = problem.runs
    try:
        # A step of the search may be one to an unstable craft. Threads of the linear algebra only wait for each other.
        with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
            fit = fit_craft(problem.with_runs(runs[: len(fitted)]), progress)
    except np.linalg.LinAlgError:
        remedy = "check mass, thrust curves and damping of the card, and the places and signs of the thrusters"
        raise InputError(ship.card.source, "", "does not move as the trials do, not even roughly", remedy) from None
    predictions = predict_free(fit, runs[len(fitted) :]) if held else []
    responses = order_responses(ship.card, read[: len(fitted)])
    names = [run.name for run in runs[len(fitted) :]]
    found = identified_craft(ship.card, fit, responses)
    held_out: dict[str, FreePrediction | None] = dict.fromkeys(names)
    held_out |= {prediction.run.name: prediction for prediction in predictions}
    study = study_craft(ship.card, found, fit, held_out, responses, driven_by)
    study = replace(study, notices=(*alike, *study.notices))
    return CraftIdentificationResult(study, found, fit, tuple(predictions))


def craft_trial_files(paths: CraftTrialPaths) -> list[Path]:
    """The files of paths, those of folders in the order of their names."""
    given: Iterable[str | Path] = [paths] if isinstance(paths, str | Path) else paths
    found: list[Path] = []
    for path in map(Path, given):
        found += sorted(path.glob("*.csv")) if path.is_dir() else [path]
    return found
