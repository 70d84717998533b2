"""Conditioning of linear least-squares problems."""

from __future__ import annotations

import numpy as np

from tank2sim.arrays import Array

COLLINEAR = 30.0
"""Scaled condition number of a design matrix from which its columns can no longer be distinguished by data of ordinary
accuracy (Belsley, Kuh & Welsch 1980, Regression Diagnostics, ch. 3). That of the normal matrix is its square, 900."""

SINGULAR_CONDITION = 1e7
"""Scaled condition number of a design matrix from which double precision does not solve its normal equations."""


def column_norms(design: Array) -> Array:
    """Euclidean norm of each column of a design matrix (rows, unknowns); 1 in place of 0."""
    norms = np.linalg.norm(design, axis=0)
    return np.where(norms > 0, norms, 1.0)


def scaled_condition(design: Array) -> float:
    """Condition number of a design matrix (rows, unknowns) whose columns are scaled to equal length.

    Infinite with fewer rows than unknowns: the singular values then omit the undetermined directions.
    """
    if design.shape[0] < design.shape[1]:
        return np.inf
    return float(np.linalg.cond(design / column_norms(design)))


def correlation_matrix(covariance: Array) -> Array:
    """Correlations (unknowns, unknowns) of a covariance matrix; 0 next to an unknown without variance."""
    variance = np.diag(covariance)
    deviation = np.sqrt(np.where(variance > 0, variance, 1.0))
    matrix: Array = covariance / np.outer(deviation, deviation)
    np.fill_diagonal(matrix, 1.0)
    return matrix
