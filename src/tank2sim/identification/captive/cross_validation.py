"""Leave-one-out cross-validation: prediction errors outside the fit, and the influence of each run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from tank2sim.identification.captive.equations import CampaignEquations
from tank2sim.identification.captive.regression import (
    Spread,
    run_covariances,
    scatters,
    solve,
    weighted_system,
)
from tank2sim.identification.conditioning import column_norms

_UNLIKELY = 1e-4


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """Prediction of a run from all other runs."""

    # `run`, `type`: Its name and type
    run: str
    type: str
    # `measured`, `predicted`: The water's force, by 1/2 rho L^2 u0^2 (N: L^3): mean in a steady run, part in phase with
    # the velocity in an oscillating run; predicted with the derivatives of all other runs
    measured: float
    predicted: float
    # `error`, `standard_error`: Predicted less measured, and its standard error
    error: float
    standard_error: float
    chance: float  # Probability of at least this misfit of all coefficients
    misfit: float  # Root mean square misfit of all coefficients, in standard errors
    # `gap`, `size`: Norm of that misfit, and the larger norm of the coefficients measured and predicted; units as
    # `measured`
    gap: float
    size: float
    influence: float  # Largest change of a derivative without the run, in standard errors
    moved: str  # Name of that derivative

    @property
    def unlikely(self) -> bool:
        """True if the probability of the misfit is below one in ten thousand."""
        return self.chance < _UNLIKELY


def leave_one_out(equations: CampaignEquations, spread: Spread) -> tuple[LeftOut, ...]:
    """Leave out each run in turn, with the spread of the whole campaign.

    A single solution serves all runs: its share is subtracted from the normal equations. A run without which a term is
    not determined has no row.
    """
    if not equations.names:
        return ()
    weights = spread.weights or spread
    design, values = weighted_system(equations, weights)
    norms = column_norms(design)
    design = design / norms
    normal, right = design.T @ design, design.T @ values
    whole = np.linalg.pinv(normal)
    estimate, errors = whole @ right, solve(equations, spread).standard_errors * norms
    prior = design[len(equations.values) :]
    scatter = scatters(equations, spread) / np.outer(norms, norms)
    together = np.sum(scatter, axis=0) + prior.T @ prior
    found = []
    blocks = [design[rows] for rows in equations.rows]
    remaining = normal - np.array([block.T @ block for block in blocks])
    determined = np.linalg.cond(remaining) <= 1e10
    inverses = np.linalg.inv(np.where(determined[:, None, None], remaining, np.eye(len(norms))))
    covariances, roots = run_covariances(equations, spread), weights.run_roots(equations)
    for place, rows in enumerate(equations.rows):
        if not determined[place]:
            continue
        block, target, inverse = blocks[place], values[rows], inverses[place]
        without = inverse @ (right - block.T @ target)
        shift = np.abs(without - estimate) / np.maximum(errors, 1e-300)
        largest = int(np.argmax(shift))
        prediction_covariance = block @ inverse @ (together - scatter[place]) @ inverse @ block.T
        misfit_covariance = covariances[place] + prediction_covariance
        root = roots[place]
        row = 1 if equations.runs[place].run.oscillates else 0
        shown, expected = root @ target, root @ (block @ without)
        misfit = target - block @ without
        squares = float(misfit @ np.linalg.solve(misfit_covariance, misfit))
        found.append(
            LeftOut(
                run=equations.runs[place].run.name,
                type=equations.runs[place].run.type,
                measured=float(shown[row]),
                predicted=float(expected[row]),
                error=float(expected[row]) - float(shown[row]),
                standard_error=float(np.sqrt((root @ misfit_covariance @ root.T)[row, row])),
                chance=float(chdtrc(len(target), squares)),
                misfit=float(np.sqrt(squares / len(target))),
                gap=float(np.linalg.norm(shown - expected)),
                size=float(max(np.linalg.norm(shown), np.linalg.norm(expected))),
                influence=float(shift[largest]),
                moved=equations.names[largest],
            )
        )
    return tuple(found)
