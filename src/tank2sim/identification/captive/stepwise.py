"""The paper's order: linear terms from the simplest tests, held fixed while more complex tests give further terms.

Paper 2, sections 4 and 5. The covariance of the terms held fixed propagates to the further terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.terms import known_term
from tank2sim.identification.captive.equations import SPEED_RANGE, CampaignEquations
from tank2sim.identification.captive.regression import Solution, Spread, fitted_spread
from tank2sim.identification.conditioning import COLLINEAR, column_norms, scaled_condition
from tank2sim.records.campaign_form import RunType

_STEPS: tuple[tuple[RunType, str], ...] = (
    ("static_drift", "v"),
    ("static_rudder", "d"),
    ("pure_sway", "v"),
    ("pure_yaw", "r"),
    ("yaw_with_drift", "vr"),
    ("drift_and_rudder", "vd"),
    ("steady_turn", "vrd"),
)
"""Type of run, and the motions whose terms it gives, in the order of the steps."""

_ALONE = (("static_drift", "v"), ("static_rudder", "d"), ("pure_yaw", "r"))
"""Types of run in one motion alone."""

_LEAST_SPREAD = 0.5
"""Least standard error of a difference, relative to the regression's: smaller differences do not matter."""


@dataclass(frozen=True, eq=False)
class Stepwise:
    """Result of the paper's order for one force."""

    names: tuple[str, ...]  # Terms in the order of their estimation
    values: Array
    standard_errors: Array
    found_in: tuple[str, ...]  # Type of run that gave each term


@dataclass(frozen=True)
class Disagreement:
    """A term on which the methods differ: ``ratio`` is the difference over its standard error."""

    name: str
    stepwise: float
    together: float
    ratio: float


def stepwise(equations: CampaignEquations, spread: Spread, test_speed_mps: float) -> Stepwise:
    """The terms of a force in the paper's order, with the weights of the whole campaign.

    The steps use the upright runs at the test speed; runs at other speeds give the terms in Du, and runs at a heel
    the terms of the heel, last.
    """
    names: list[str] = []
    found_in: list[str] = []
    values, covariance = np.zeros(0), np.zeros((0, 0))
    for kind, motions in (*_STEPS, ("", "vrduphi")):
        places = [
            place
            for place, run in enumerate(equations.runs)
            if not kind
            or (
                run.run.type == kind
                and abs(run.motion.mean_speed_mps / test_speed_mps - 1) <= SPEED_RANGE
                and not run.motion.heel_rad
            )
        ]
        if not places:
            continue
        part = equations.of_runs(places)
        new = _new_terms(part, spread, set(names), motions)
        if not new:
            continue
        held = part.of_terms(names).design
        chosen = part.of_terms(new)
        weighted = spread.weighted(part, np.column_stack([chosen.design, held, part.values]))
        prior = chosen.prior_rows
        weighted = np.vstack([weighted, np.hstack([prior, np.zeros((len(prior), len(names) + 1))])])
        design, fixed, target = weighted[:, : len(new)], weighted[:, len(new) : -1], weighted[:, -1]
        norms = column_norms(design)
        inverse = np.linalg.pinv(design / norms) / norms[:, None]
        values = np.concatenate([values, inverse @ (target - fixed @ values)])
        covariance = _joint_covariance(covariance, inverse, inverse @ fixed)
        names += new
        found_in += [kind or "all"] * len(new)
    errors: Array = np.sqrt(np.diag(covariance))
    return Stepwise(tuple(names), values, errors, tuple(found_in))


def _is_independent(column: Array, others: Array) -> bool:
    """True if a column (rows,) is not a combination of `others` (rows, n), to the rounding of a fit."""
    norms = np.linalg.norm(others, axis=0)
    scaled = others / np.where(norms > 0, norms, 1.0)
    remainder = column - scaled @ np.linalg.lstsq(scaled, column, rcond=None)[0]
    return bool(np.linalg.norm(remainder) > 1e-6 * np.linalg.norm(column))


def scatter_within_tests(equations: CampaignEquations) -> Spread:
    """The spread of the runs if each type of test has its own linear terms.

    A contradiction between types of test then does not count as scatter.
    """
    columns, names = [equations.design], list(equations.names)
    kinds = np.array([run.run.type for run in equations.runs])[equations.run_of_row]
    for kind, letter in (*_ALONE, ("drift_and_rudder", "v"), ("steady_turn", "r")):
        name = equations.force + letter
        if name not in equations.names or not np.any(kinds == kind):
            continue
        column = np.where(kinds == kind, equations.design[:, equations.names.index(name)], 0.0)
        # A type of test that holds all of the term's motion has no linear term of its own: the likelihood of a
        # dependent column would come from rounding errors.
        if _is_independent(column, np.hstack(columns)):
            columns.append(column[:, None])
            names.append(f"{name} {kind}")
    if len(names) > len(equations.values):
        return fitted_spread(equations, by_type=False)
    return fitted_spread(replace(equations, names=tuple(names), design=np.hstack(columns)), by_type=False)


def _joint_covariance(held: Array, inverse: Array, leaning: Array) -> Array:
    """Covariance of the held and the new terms, which depend on the held terms by -`leaning`."""
    across = -held @ leaning.T
    covariance = inverse @ inverse.T + leaning @ held @ leaning.T
    return np.block([[held, across], [across.T, covariance]])


def _new_terms(part: CampaignEquations, spread: Spread, found: set[str], motions: str) -> list[str]:
    """New terms that the step's motions excite in these runs, and that the runs can distinguish."""
    reach = np.abs(spread.weighted(part, part.design)).max(axis=0)
    new: list[str] = []
    for name, reached in zip(part.names, reach, strict=True):
        term = known_term(name.partition(" ")[0])
        letters = set("".join(term.powers)) | set(term.acceleration)
        if name in found or reached < 1e-6 or not letters <= set(motions):
            continue
        trial = part.of_terms([*new, name])
        if len(trial.values) > len(new) and scaled_condition(spread.weighted(trial, trial.design)) <= COLLINEAR:
            new.append(name)
    return new


def disagreements(steps: Stepwise, together: Solution, names: Sequence[str], limit: float) -> tuple[Disagreement, ...]:
    """The terms in `names` on which the paper's order and the regression differ by more than `limit` standard errors.

    The regression is efficient, so that the variance of the difference is the difference of the variances (Hausman
    1978).
    """
    found = []
    for name, value, error in zip(steps.names, steps.values, steps.standard_errors, strict=True):
        if name not in names:
            continue
        best = together.error(name) ** 2
        spread = np.sqrt(max(error**2 - best, _LEAST_SPREAD**2 * best))
        ratio = (value - together.value(name)) / spread
        if abs(ratio) > limit:
            found.append(Disagreement(name, float(value), together.value(name), float(ratio)))
    return tuple(found)
