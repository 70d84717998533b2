"""Each run predicted from all the others: what a model is worth where it was not fitted, and which runs pull it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from tank2sim.arrays import Array
from tank2sim.identification.captive.equations import CampaignEquations
from tank2sim.identification.captive.regression import (
    Spread,
    run_covariance,
    scatters,
    solve,
    weighted_system,
)
from tank2sim.identification.conditioning import column_norms

_UNLIKELY = 1e-4


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """One run left out.

    Parameters
    ----------
    run, type : str
        Its name and type.
    measured, predicted : float
        The water's force, by 1/2 rho L^2 u0^2 (N: L^3): its mean in a steady run, its part in phase with the velocity
        in an oscillating one; predicted from the derivatives of all other runs.
    standard_error : float
        Of the difference of the two.
    chance : float
        Probability of a misfit of all its coefficients as large as this or larger.
    misfit : float
        Root mean square misfit of all its coefficients, in standard errors.
    gap, size : float
        Norm of that misfit, and the larger norm of the coefficients measured and predicted; units as `measured`.
    influence : float
        The most that leaving it out moves a derivative, in standard errors.
    moved : str
        Which derivative that is.
    """

    run: str
    type: str
    measured: float
    predicted: float
    standard_error: float
    chance: float
    misfit: float
    gap: float
    size: float
    influence: float
    moved: str

    @property
    def error(self) -> float:
        """Predicted less measured."""
        return self.predicted - self.measured

    @property
    def unlikely(self) -> bool:
        """It does not belong with the others, but by a chance of one in ten thousand."""
        return self.chance < _UNLIKELY


def leave_one_out(equations: CampaignEquations, spread: Spread) -> tuple[LeftOut, ...]:
    """Every run left out in turn, with the spread of the whole campaign.

    One solve serves all: leaving a run out takes its share from the normal equations. A run without which a term
    cannot be found is not told.
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
    ends = [*equations.first_rows[1:], len(equations.values)]
    for place, (start, end) in enumerate(zip(equations.first_rows, ends, strict=True)):
        own, target = design[start:end], values[start:end]
        rest = normal - own.T @ own
        if np.linalg.cond(rest) > 1e10:
            continue
        inverse = np.linalg.inv(rest)
        without = inverse @ (right - own.T @ target)
        shift = np.abs(without - estimate) / np.maximum(errors, 1e-300)
        most = int(np.argmax(shift))
        by_others = own @ inverse @ (together - scatter[place]) @ inverse @ own.T
        misfit_covariance = run_covariance(equations, spread, place) + by_others
        root = weights.run_root(equations, place)
        which = 1 if equations.runs[place].run.oscillates else 0
        shown, expected = root @ target, root @ (own @ without)
        squares = _squares(target - own @ without, misfit_covariance)
        found.append(
            LeftOut(
                run=equations.runs[place].run.name,
                type=equations.runs[place].run.type,
                measured=float(shown[which]),
                predicted=float(expected[which]),
                standard_error=float(np.sqrt((root @ misfit_covariance @ root.T)[which, which])),
                chance=float(chdtrc(end - start, squares)),
                misfit=float(np.sqrt(squares / (end - start))),
                gap=float(np.linalg.norm(shown - expected)),
                size=float(max(np.linalg.norm(shown), np.linalg.norm(expected))),
                influence=float(shift[most]),
                moved=equations.names[most],
            )
        )
    return tuple(found)


def _squares(misfit: Array, covariance: Array) -> float:
    return float(misfit @ np.linalg.solve(covariance, misfit))
