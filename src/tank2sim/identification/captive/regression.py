"""Generalised least squares over a campaign, with a zero error and a gain error of each run.

The covariance of a run's coefficients is ``noise`` times its within-run covariance, plus ``zero_variance`` for its
mean, plus ``gain_variance`` times the outer product of the coefficients that its gauge showed: a gauge that reads 0.5 %
more in one run than in the next errs in all harmonics of that run together. The factors are found by restricted maximum
likelihood over the campaign (REML; Patterson & Thompson 1971), so that the scatter from run to run, not only that
within a run, determines how well a derivative is known.

The gain errors widen the standard errors and do not weight the runs: the weights are the likeliest without them. With
them a misfit of (3.8) in one harmonic could be attributed to the gain of the run, to the detriment of the harmonics
that fit.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import chdtrc

from tank2sim.arrays import Array
from tank2sim.identification.captive.equations import CampaignEquations
from tank2sim.identification.conditioning import column_norms, scaled_condition

_NOISE_RANGE = (math.log(1e-3), math.log(1e4))
"""Natural logarithms of the factor on the within-run covariance."""
_ZERO_RANGE = (-25.0, 25.0)
"""Natural logarithms of the factor on a zero variance at the start."""
_LEAST_GAIN = 1e-8
"""Variance of the gain, 0.01 %, at which the likelihood must exceed that without gain errors."""
_GAIN = 1e-5
"""Variance of the gain from which the search begins: 0.3 %, between good gauges (0.1 %) and poor ones (1 %)."""
_GAIN_RANGE = (-20.0, 4.5)
"""Natural logarithms of the factor on it: from none to gains that differ by 3 % from run to run. Such gains cost the
likelihood 1000 a run where a force is not explained at all; with 10 % the cost of 100 would be below the cost of
noise in a campaign with a gross error, and all forces would be attributed to errors of gain about zero."""
_FEWEST_RUNS = 8
_CLEARLY = 0.05
"""Probability of the gain in likelihood if all types of run scatter alike, below which each gets its own variance."""


@dataclass(frozen=True)
class Spread:
    """Scatter of the runs of a campaign."""

    noise: float  # Factor on the within-run covariances; 1 if they are complete
    zero_variance: float  # Variance of the zero error from run to run, in ``Equations.unit`` squared
    # Type of run to its own variance, where the types differ; it includes the misfit of (3.8)
    by_type: Mapping[str, float] = field(default_factory=dict)
    gain_variance: float = 0.0  # Variance of the gauge's relative gain from run to run
    weights: Spread | None = None  # Spread that weights the runs, if different

    def zeros(self, equations: CampaignEquations) -> Array:
        """Variance of the zero error of each run, (runs,)."""
        if not self.by_type:
            return np.full(len(equations.runs), self.zero_variance)
        return np.array([self.by_type.get(run.run.type, self.zero_variance) for run in equations.runs])

    def weighted(self, equations: CampaignEquations, columns: Array) -> Array:
        """Columns (rows, n) multiplied by an inverse root of the covariance of the equations."""
        result: Array = columns / math.sqrt(self.noise)
        for direction, sizes, variances in self._common_errors(equations):
            share = 1.0 - np.sqrt(self.noise / (self.noise + variances * sizes))
            along = equations.run_sums(direction[:, None] * result) * (share / sizes)[:, None]
            result = result - direction[:, None] * along[equations.run_of_row]
        return result

    def run_roots(self, equations: CampaignEquations) -> list[Array]:
        """A root of the covariance of each run's coefficients, in ``Equations.unit``."""
        roots: list[Array] = [math.sqrt(self.noise) * root for root in equations.roots]
        for direction, sizes, variances in self._common_errors(equations):
            along = (np.sqrt(1.0 + variances * sizes / self.noise) - 1.0) / sizes
            for place, rows in enumerate(equations.rows):
                block, root = direction[rows], roots[place]
                roots[place] = root + np.outer(root @ block, along[place] * block)
        return roots

    def log_determinant(self, equations: CampaignEquations) -> float:
        """Logarithm of the determinant of the covariance of the weighted equations."""
        total = len(equations.values) * math.log(self.noise)
        for _, sizes, variances in self._common_errors(equations):
            total += float(np.sum(np.log1p(variances * sizes / self.noise)))
        return total

    def _common_errors(self, equations: CampaignEquations) -> Iterator[tuple[Array, Array, Array]]:
        """Errors common to a run: direction (rows,), its squared norm in each run, and its variance (runs,).

        The covariance is noise R (I + g g' gain/noise) R', R R' = I + z z' zero/noise, g the inverse of R times the
        gauge's coefficients: the errors are removed in sequence.
        """
        zeros, sizes = self.zeros(equations), equations.zero_sizes
        yield equations.zero, sizes, zeros
        if self.gain_variance:
            zero, gauge = equations.zero, equations.gauge
            share = (1.0 - np.sqrt(self.noise / (self.noise + zeros * sizes))) / sizes
            gauge = gauge - zero * (equations.run_sums(zero * gauge) * share)[equations.run_of_row]
            yield gauge, np.maximum(equations.run_sums(gauge**2), 1e-300), np.full(len(sizes), self.gain_variance)


@dataclass(frozen=True, eq=False)
class Solution:
    """Derivatives of one force from a set of equations."""

    names: tuple[str, ...]  # Names of the terms
    values: Array  # (terms,): Prime
    covariance: Array  # (terms, terms): Covariance of the values
    spread: Spread  # With which they were weighted
    condition: float  # Scaled condition number of the weighted design
    inflation: Array  # (terms,): Variance inflation factors: variance of a term over its variance as the only term

    @property
    def standard_errors(self) -> Array:
        """Standard errors of the values, (terms,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def ratios(self) -> Array:
        """Value over standard error, (terms,)."""
        return self.values / np.maximum(self.standard_errors, 1e-300)

    def value(self, name: str) -> float:
        """Value of a term; 0 for an absent term."""
        return float(self.values[self.names.index(name)]) if name in self.names else 0.0

    def error(self, name: str) -> float:
        """Standard error of one term."""
        return float(self.standard_errors[self.names.index(name)])


def solve(equations: CampaignEquations, spread: Spread) -> Solution:
    """Weighted least squares by QR; the covariance follows from `spread`, also with other weights."""
    weights = spread.weights
    solution = efficient_solution(equations, weights or spread)
    if weights is None or not equations.names:
        return replace(solution, spread=spread)
    scatter = np.sum(scatters(equations, spread), axis=0) + equations.prior_rows.T @ equations.prior_rows
    return replace(solution, spread=spread, covariance=solution.covariance @ scatter @ solution.covariance)


def moved_terms(changed: CampaignEquations, solution: Solution) -> dict[str, float]:
    """Change of each term of a solution (prime) if its equations are `changed`, with the same spread."""
    moved = solve(changed, solution.spread).values - solution.values
    return {name: float(shift) for name, shift in zip(changed.names, moved, strict=True)}


def scatters(equations: CampaignEquations, spread: Spread) -> Array:
    """Covariance of each run's contribution to the weighted normal equations' right-hand side, (runs, terms, terms)."""
    design = (spread.weights or spread).weighted(equations, equations.design)
    covariances = run_covariances(equations, spread)
    pairs = zip(equations.rows, covariances, strict=True)
    return np.array([design[rows].T @ covariance @ design[rows] for rows, covariance in pairs])


def run_covariances(equations: CampaignEquations, spread: Spread) -> list[Array]:
    """Covariance of the weighted equations of each run, (rows, rows): unity if the weights follow from the spread."""
    if spread.weights is None:
        return [np.eye(len(root)) for root in equations.roots]
    # Both are roots of covariances of the same coefficients, one of the weights and one of the spread.
    pairs = zip(spread.weights.run_roots(equations), spread.run_roots(equations), strict=True)
    roots = (np.linalg.solve(of_weights, of_spread) for of_weights, of_spread in pairs)
    return [np.asarray(root @ root.T, dtype=np.float64) for root in roots]


def efficient_solution(equations: CampaignEquations, spread: Spread) -> Solution:
    """Generalised least squares by QR: weighted by a known spread with its gain errors."""
    design, values = weighted_system(equations, spread)
    if not equations.names:
        return Solution((), np.zeros(0), np.zeros((0, 0)), spread, 1.0, np.zeros(0))
    norms = column_norms(design)
    q, r = np.linalg.qr(design / norms)
    inverse = np.linalg.pinv(r)
    estimate = inverse @ (q.T @ values) / norms
    spreading = inverse @ inverse.T
    return Solution(
        names=equations.names,
        values=estimate,
        covariance=spreading / np.outer(norms, norms),
        spread=spread,
        condition=scaled_condition(design),
        inflation=np.diag(spreading).copy(),
    )


def weighted_system(equations: CampaignEquations, spread: Spread) -> tuple[Array, Array]:
    """Design and right-hand side of unit variance, the rows of the prior last."""
    weighted = spread.weighted(equations, np.column_stack([equations.design, equations.values]))
    prior = equations.prior_rows
    return np.vstack([weighted[:, :-1], prior]), np.concatenate([weighted[:, -1], np.zeros(len(prior))])


def fitted_spread(equations: CampaignEquations, *, by_type: bool = True) -> Spread:
    """The spread of largest restricted likelihood for these terms.

    All types of run share one zero variance, unless the likelihood is clearly higher with one each: tests at large
    angles, for example, may not follow (3.8). Where every run is a single reading (averages, steady runs alone) the two
    factors cannot be distinguished, and the factor on the noise within a run is 1.
    """
    single = len(equations.values) == len(equations.runs)
    common, least = _best(equations, {"": _starting_zero(equations)}, single)
    counts = Counter[str](run.run.type for run in equations.runs)
    types = [kind for kind, count in counts.items() if count >= _FEWEST_RUNS]
    if not by_type or len(types) < 2:
        return _with_gain(equations, common, single)
    # The start is each type alone: a common spread is a local minimum.
    starts = {
        kind: _starting_zero(equations.of_runs([n for n, run in enumerate(equations.runs) if run.run.type == kind]))
        for kind in types
    }
    separate, lower = _best(equations, starts, single)
    clearly = chdtrc(len(types) - 1, max(least - lower, 0.0)) < _CLEARLY
    return _with_gain(equations, separate if clearly else common, single)


def _best(equations: CampaignEquations, start: Mapping[str, float], single: bool) -> tuple[Spread, float]:
    """Likeliest spread without gain errors, zero variances by type in `start` ("": all), and -2 log likelihood."""
    kinds, variances = list(start), np.array([*start.values()])
    types = [run.run.type for run in equations.runs]
    of_run = np.array([kinds.index(kind) if kind in start else -1 for kind in types]) if "" not in start else None
    likelihood = _ZeroLikelihood.of(equations)

    def scatter(logs: Array) -> tuple[float, Array, Array]:
        """Noise, zero variances by kind, and of each run; a kind with few runs has their geometric mean."""
        found = variances * np.exp(logs[1:])
        usual = math.exp(float(np.mean(np.log(found))))
        if of_run is None:
            return (1.0 if single else math.exp(logs[0])), found, np.full(len(types), found[0])
        return (1.0 if single else math.exp(logs[0])), found, np.append(found, usual)[of_run]

    def criterion(logs: Array) -> tuple[float, Array]:
        noise, _, zeros = scatter(logs)
        value, by_noise, by_zeros = likelihood(noise, zeros)
        share = by_zeros * zeros
        if of_run is None:
            slopes = np.array([share.sum()])
        else:
            by_kind = np.bincount(of_run % (len(kinds) + 1), share, len(kinds) + 1)
            slopes = by_kind[:-1] + by_kind[-1] / len(kinds)
        return value, np.append(0.0 if single else by_noise * noise, slopes)

    bounds = [_NOISE_RANGE] + [_ZERO_RANGE] * len(start)
    found = minimize(criterion, np.zeros(len(bounds)), jac=True, method="L-BFGS-B", bounds=bounds)
    noise, by_kind, _ = scatter(found.x)
    usual = math.exp(float(np.mean(np.log(by_kind))))
    by_type = {} if "" in start else dict(zip(kinds, map(float, by_kind), strict=True))
    return Spread(noise, usual, by_type), float(found.fun)


@dataclass(frozen=True, eq=False)
class _ZeroLikelihood:
    """-2 log of the restricted likelihood of a spread without gain errors, with its slopes.

    Along the zero error the coefficients of a run have the variance s_i = noise + zero_i z_i' z_i, across it the noise
    alone: there all runs together are one triangular system, which holds for every spread.
    """

    along: Array  # (runs, columns + 1): Design and right-hand side of each run along its zero error
    # (columns + 1, columns + 1): Design and right-hand side of all runs across their zero errors, as a triangle
    across: Array
    prior: Array  # (terms, columns + 1)
    sizes: Array  # (runs,): z_i' z_i
    count: int  # Equations across

    @classmethod
    def of(cls, equations: CampaignEquations) -> _ZeroLikelihood:
        """The likelihood of the equations of a campaign."""
        columns = np.column_stack([equations.design, equations.values])
        sizes = equations.zero_sizes
        along = equations.run_sums(equations.zero[:, None] * columns) / np.sqrt(sizes)[:, None]
        rest = columns - equations.zero[:, None] * (along / np.sqrt(sizes)[:, None])[equations.run_of_row]
        prior = equations.prior_rows
        prior = np.column_stack([prior, np.zeros(len(prior))])
        across = np.asarray(np.linalg.qr(rest, mode="r"), dtype=np.float64)
        return cls(along, across, prior, sizes, len(columns) - len(sizes))

    def __call__(self, noise: float, zeros: Array) -> tuple[float, float, Array]:
        """Value, slope by the noise, and slopes by the zero variance of each run, (runs,)."""
        variances = noise + zeros * self.sizes
        runs, across = len(variances), len(self.across)
        system = np.vstack([self.along / np.sqrt(variances)[:, None], self.across / math.sqrt(noise), self.prior])
        q, residual, restricted = _restricted(system[:, :-1], system[:, -1])
        determinant = self.count * math.log(noise) + float(np.sum(np.log(variances)))
        # For each row: 1 less its leverage less its squared residual.
        free = np.sum(q**2, axis=1) + residual**2
        by_run = (1.0 - free[:runs]) / variances
        rest = (self.count - float(np.sum(free[runs : runs + across]))) / noise
        return determinant + restricted, rest + float(np.sum(by_run)), by_run * self.sizes


def _with_gain(equations: CampaignEquations, base: Spread, single: bool) -> Spread:
    """The likeliest spread with gain errors, weighted by `base`; `base` if gain errors do not raise the likelihood."""
    if _criterion(equations, replace(base, gain_variance=_LEAST_GAIN)) >= _criterion(equations, base):
        return base

    def spread(logs: Array) -> Spread:
        noise = base.noise * (1.0 if single else math.exp(logs[0]))
        factor = math.exp(logs[1])
        by_type = {kind: variance * factor for kind, variance in base.by_type.items()}
        return Spread(noise, base.zero_variance * factor, by_type, _GAIN * math.exp(logs[2]), base)

    bounds = [_NOISE_RANGE, _ZERO_RANGE, _GAIN_RANGE]
    found = minimize(
        lambda logs: _criterion(equations, spread(logs)),
        np.zeros(len(bounds)),
        method="L-BFGS-B",
        bounds=bounds,
        options={"eps": 1e-4},
    )
    return spread(found.x)


def _criterion(equations: CampaignEquations, spread: Spread) -> float:
    """-2 log of the restricted likelihood."""
    return spread.log_determinant(equations) + _restricted(*weighted_system(equations, spread))[2]


def _restricted(design: Array, values: Array) -> tuple[Array, Array, float]:
    """Orthonormal columns of a design of unit variance, residuals, their squares plus log det of the information."""
    norms = column_norms(design)
    q, r = np.linalg.qr(design / norms)
    residual = values - q @ (q.T @ values)
    information = 2 * float(np.sum(np.log(np.abs(np.diag(r)) * norms + 1e-300)))
    return q, residual, information + float(residual @ residual)


def _starting_zero(equations: CampaignEquations) -> float:
    """Mean square misfit of the runs' means in an ordinary fit."""
    means = equations.first_rows
    roots = np.array([root[0, 0] for root in equations.roots])
    design, values = equations.design[means] * roots[:, None], equations.values[means] * roots
    residual = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    return float(max(float(residual @ residual) / max(1, len(residual) - design.shape[1] // 2), 1e-24))


_UNLIKELY = 1e-4


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """Prediction of a run from all other runs."""

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
