"""First values of a craft's coefficients, from the velocities that its positions give.

A filter that knows neither wind nor current explains a poor card by random accelerations, and its search may stay
there. Equation error and then output error of short pieces need no card that moves like the craft: they begin near the
truth (Morelli and Klein 2016, Aircraft System Identification, 2nd ed., 11.3).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error
from tank2sim.identification.trials.methods.kalman_pass import velocities_of
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

PIECE_S = 5.0
"""Length of the pieces of output error, s: several time constants of a small craft (project choice)."""

_SEEN = ("motion.u", "motion.v", "motion.r", "motion.psi")


def estimate_by_velocities(problem: Problem) -> Estimate | None:
    """Estimate by output error of the velocities; None where the records are too short or the search fails.

    Parameters
    ----------
    problem : Problem
        By :func:`.craft_problem`.
    """
    posed = problem.with_runs(tuple(_by_velocities(run) for run in problem.runs))
    try:
        first = equation_error(posed, settings=EquationErrorSettings(scale_prior=False))
        found = output_error(posed, first.values, OutputErrorSettings(piece_s=PIECE_S, scale_prior=False))
    except (InputError, np.linalg.LinAlgError):
        return None
    return found if np.isfinite(found.values).all() else None


def _by_velocities(run: SampledRun) -> SampledRun:
    """The run with velocities over the ground in place of positions."""
    instants = np.arange(len(run.measured))
    columns = {}
    for name in ("motion.x", "motion.y", "motion.psi"):
        column = run.column(name)
        known = np.isfinite(column)
        columns[name] = np.interp(instants, instants[known], column[known])
    derived = velocities_of(columns, run.step_s)
    gyro = run.column("gyro.rate")
    derived["motion.r"] = np.where(np.isfinite(gyro), gyro, derived["motion.r"])
    derived["motion.psi"] = columns["motion.psi"]
    return replace(run, measured=np.column_stack([derived[name] for name in _SEEN]), seen=_SEEN)
