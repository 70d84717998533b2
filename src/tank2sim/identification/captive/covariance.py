"""The covariance of the derivatives that a campaign gave: scatter within each force, stated errors across all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.captive.reduction import Reduction, common_shifts


def reduction_covariance(reduction: Reduction, names: Sequence[str]) -> Array:
    """Covariance (k, k), prime, of the derivatives `names` that the campaign gave.

    Type A is that of the regression of each force, whose errors are independent. An error common to many runs (Type B,
    or shown by the campaign itself) moves the derivatives of all three forces together: the outer product of what they
    move by.
    """
    places = {name: place for place, name in enumerate(names)}
    covariance = np.zeros((len(names), len(names)))
    shifts: dict[str, Array] = {}
    for result in reduction.forces.values():
        solution = result.solution
        own = [place for place, name in enumerate(solution.names) if name in places]
        rows = [places[solution.names[place]] for place in own]
        covariance[np.ix_(rows, rows)] += solution.covariance[np.ix_(own, own)]
        for source, moved in common_shifts(reduction.campaign, result).items():
            shift = shifts.setdefault(source, np.zeros(len(names)))
            for name, by in moved.items():
                if name in places:
                    shift[places[name]] = by
    for shift in shifts.values():
        covariance += np.outer(shift, shift)
    return (covariance + covariance.T) / 2
