"""Samples of the posterior of an output-error estimate, by Hamiltonian or ensemble Monte Carlo.

The density is the one of :mod:`.output_error`: the prior, the captive tests, and the sum of squares of whitened
residuals. The initial states of all pieces are integrated out in their linearisation at the estimate, in which they
move by the size of the noise alone. One density is one simulation of all pieces; its exact gradient is one adjoint
simulation.

Residuals with model error are correlated for far longer than the noise model says. The trials' density is therefore
stretched about the estimate until its curvature matches the robust covariance (the curvature adjustment of Ribatet,
Cooley and Davison 2012, Statistica Sinica 22).
"""

from __future__ import annotations

import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import count

import casadi as ca
import numpy as np
from scipy.linalg import eigh

from tank2sim.arrays import Array
from tank2sim.errors import ArgumentError
from tank2sim.identification.trials.methods.output_error import Shooting, cut, whitened, whitening_transposed
from tank2sim.identification.trials.options import DRAWS_OF_CHAIN, Sampler
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, scaled_prior
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.notices import Notice, caution
from tank2sim.simulation.rows import Chain
from tank2sim.simulation.scheme import runge_kutta_step

CHAINS = 4
"""Independent chains, the number for which the limit of R-hat is stated (Vehtari et al. 2021, Bayesian Analysis 16)."""

LARGEST_R_HAT = 1.01
"""Largest R-hat of converged chains (Vehtari et al. 2021)."""

FEWEST_EFFECTIVE = 400
"""Effective sample size from which R-hat and quantiles are reliable with four chains (Vehtari et al. 2021)."""

TUNE = 100
"""Draws in which the step of the Hamiltonian sampler adapts; coordinates are scaled by the estimate's covariance, so
that its mass matrix has little left to learn (project choice)."""

EVERY_STEPS = 20
"""Steps of the ensemble's walkers between two kept ones: a third of their autocorrelation time (project choice)."""

DIFFERENCE = 1e-3
"""Step of second derivatives, in standard deviations: their error is far below what a scale needs (project choice)."""

LEAST_CURVATURE = 0.1
"""Smallest curvature in units of the linearised model's: a scale of three deviations (project choice)."""

LEAST_LIKELY = 1e8
"""Sum of squares in place of one that is infinite, which ends a Hamiltonian trajectory (project choice)."""


@dataclass(frozen=True, eq=False)
class PosteriorSamples:
    """Samples of the posterior."""

    free: tuple[str, ...]  # The k parameters
    values: Array  # (chains, draws, k): In the units of the model's parameters
    # `r_hat`, `effective`: (k,): Rank-normalised split R-hat, and bulk effective sample size (Vehtari et al. 2021).
    r_hat: Array
    effective: Array
    sampler: Sampler  # One of :data:`.options.Sampler`
    simulations: int  # Simulations of all trials; one with its adjoint is one

    @property
    def flat(self) -> Array:
        """All draws (chains * draws, k)."""
        return self.values.reshape(-1, len(self.free))

    @property
    def mean(self) -> Array:
        """Means (k,)."""
        return np.asarray(self.flat.mean(axis=0))

    @property
    def covariance(self) -> Array:
        """Covariance (k, k)."""
        return np.atleast_2d(np.cov(self.flat.T))

    @property
    def converged(self) -> bool:
        """The chains agree and are long enough."""
        return bool(self.r_hat.max() < LARGEST_R_HAT and self.effective.min() >= FEWEST_EFFECTIVE)

    @property
    def notices(self) -> list[Notice]:
        """How it was sampled; first of all, that the chains have not converged."""
        worst, least = int(np.argmax(self.r_hat)), int(np.argmin(self.effective))
        reached = (
            f"R-hat is {self.r_hat[worst]:.4f} or less (of {self.free[worst]}), the effective sample size "
            f"{self.effective[least]:.0f} or more (of {self.free[least]})"
        )
        words = Notice(f"posterior of {len(self.free)} parameters by {self.sampler}, {len(self.flat)} draws: {reached}")
        if self.converged:
            return [words]
        wanted = f"below {LARGEST_R_HAT} and {FEWEST_EFFECTIVE} or more are wanted: give more draws"
        return [caution(f"NOT CONVERGED: {words}; {wanted}")]


def check_sampler(name: Sampler) -> None:
    """Raise ArgumentError for a sampler whose library is not installed."""
    for library in ("nutpie" if name == "nuts" else "emcee", "arviz"):
        if find_spec(library) is None:
            raise ArgumentError("posterior", "", f"{library} is not installed", "pip install 'tank2sim[posterior]'")


class LogPosterior:
    """Logarithm of the posterior's density, up to a constant, and its gradient, in scaled coordinates z (k,).

    The parameters are the estimate + root @ z, reflected at the model's bounds: the folded density is the truncated
    one, and its trajectories do not end at a bound.

    `problem`: k free parameters. `estimate`: By output error, with its `motion`. `robust`: Stretch the trials' density
    to the curvature of the estimate's covariance.
    """

    def __init__(self, problem: Problem, estimate: Estimate, *, robust: bool = True):
        assert estimate.motion is not None
        self.problem, self.estimate = problem, estimate
        self.center = estimate.values
        self.errors = scaled_prior(problem, estimate.prior_scale)  # before the trials
        known = problem.before(self.center, self.errors)[0]
        self.stretch = _stretch(estimate, known) if robust else np.eye(len(self.center))
        curvature = self.stretch.T @ estimate.information @ self.stretch + known
        self.root = np.linalg.cholesky(np.linalg.inv(curvature))  # a first one, for the differences of the exact one
        self.lowest, self.highest = problem.bounds
        shooting = Shooting(problem)
        adjoint = Chain(adjoint_step(problem))
        runs = zip(problem.runs, estimate.motion.starts, strict=True)
        self.runs = [_Run(shooting, adjoint, run, starts, estimate) for run, starts in runs]
        pull = sum(run.cost_and_gradient(self.center)[1] for run in self.runs)
        self.level = pull - self.stretch.T @ pull  # the mode stays the estimate, where prior and trials balance
        self._count = count()
        self.root = self.root @ np.linalg.cholesky(np.linalg.inv(self._curvature()))

    @property
    def simulations(self) -> int:
        """Number of evaluations, this one included."""
        return next(self._count)

    def values(self, z: Array) -> Array:
        """Parameters (k,) at `z` (k,)."""
        return self._reflected(self.center + self.root @ z)[0]

    def __call__(self, z: Array) -> float:
        """Log density at `z` (k,); -inf where the motion leaves all bounds."""
        values = self.values(z)
        away = values - self.center
        at = self.center + self.stretch @ away
        next(self._count)
        before = self.problem.before(values, self.errors)[2]
        return -0.5 * (before + float(self.level @ away) + sum(run.cost(at) for run in self.runs))

    def with_gradient(self, z: Array) -> tuple[float, Array]:
        """Log density and its gradient by `z`; where the motion leaves all bounds, very small with gradient 0."""
        values, signs = self._reflected(self.center + self.root @ z)
        away = values - self.center
        at = self.center + self.stretch @ away
        next(self._count)
        _, pull, cost = self.problem.before(values, self.errors)
        cost, pull = cost + float(self.level @ away), 2 * pull + self.level
        for run in self.runs:
            run_cost, by = run.cost_and_gradient(at)
            cost, pull = cost + run_cost, pull + self.stretch.T @ by
        if not np.isfinite(cost) or cost > LEAST_LIKELY:
            return -0.5 * LEAST_LIKELY, np.zeros_like(z)
        return -0.5 * cost, -0.5 * (self.root.T @ (signs * pull))

    def _curvature(self) -> Array:
        """Negative second derivative (k, k) of the log density at the estimate, by z: the scale of the sampler."""
        steps = DIFFERENCE * np.eye(len(self.center))
        slopes = [self.with_gradient(step)[1] - self.with_gradient(-step)[1] for step in steps]
        curvature = -np.array(slopes) / (2 * DIFFERENCE)
        size, vectors = np.linalg.eigh((curvature + curvature.T) / 2)
        return np.asarray((vectors * np.maximum(size, LEAST_CURVATURE)) @ vectors.T)

    def _reflected(self, values: Array) -> tuple[Array, Array]:
        """Values within the bounds, reflected at them, and the sign of their derivative."""
        values, signs = values.copy(), np.ones_like(values)
        for _ in range(8):  # a narrow range may need several; a draw that needs more is at its bound
            below, above = values < self.lowest, values > self.highest
            if not (below | above).any():
                break
            values = np.where(below, 2 * self.lowest - values, np.where(above, 2 * self.highest - values, values))
            signs = np.where(below | above, -signs, signs)
        return np.clip(values, self.lowest, self.highest), signs


class _Run:
    """Sum of squares of a run with its initial states integrated out, and its gradient by the parameters."""

    def __init__(self, shooting: Shooting, adjoint: Chain, run: SampledRun, starts: Array, estimate: Estimate):
        assert estimate.motion is not None
        self.shooting, self.adjoint, self.starts = shooting, adjoint, starts
        self.pieces = cut(shooting.problem, run, estimate.motion.piece_s)
        self.noise, self.center, self.wide = estimate.motion.noise, estimate.values, shooting.wide
        shot = shooting.shot(self.pieces, starts, self.center, self.noise)
        J = shooting.linearised(self.pieces, shot, self.center, self.noise)[1]
        nx = starts.shape[1]
        self.by_state = np.ascontiguousarray(J[:, :, :nx])  # (pieces, samples, nx)
        transposed = self.by_state.transpose(0, 2, 1)
        self.covariance = np.linalg.inv(transposed @ self.by_state + np.diag(1 / self.wide**2))  # of initial states
        self.follow = -self.covariance @ (transposed @ J[:, :, nx:])  # (pieces, nx, k), their change with parameters

    def cost(self, values: Array) -> float:
        """Sum of squares, inf where the motion leaves all bounds."""
        return self._profile(values)[0]

    def cost_and_gradient(self, values: Array) -> tuple[float, Array]:
        """Sum of squares and its gradient (k,)."""
        cost, white_pull, start_pull, states, residuals = self._profile(values)
        if not np.isfinite(cost):
            return cost, np.zeros(len(values))
        pull = whitening_transposed(residuals, white_pull.reshape(residuals.shape), self.noise)
        p, h = self.shooting.problem.parameters(values), np.array([self.pieces.run.step_s])
        nx, k = states.shape[2], len(values)
        gradient = np.zeros(k)
        for piece, follow in enumerate(self.follow):
            rows = slice(None, None, -1)
            arguments = states[piece, rows], self.pieces.inputs[piece, rows], pull[piece, rows]
            found = self.adjoint.run(np.zeros(nx + k), *arguments, p, h)[-1]
            gradient += found[nx:] + follow.T @ (found[:nx] + start_pull[piece])
        return cost, gradient

    def _profile(self, values: Array) -> tuple[float, Array, Array, Array, Array]:
        """Cost, its derivatives by whitened residuals and (directly) by initial states, states and residuals."""
        starts = self.starts + self.follow @ (values - self.center)
        shot = self.shooting.shot(self.pieces, starts, values, self.noise)
        states, residuals = shot.states, shot.residuals
        if not np.isfinite(shot.cost):
            return np.inf, residuals, starts, states, residuals
        white = whitened(residuals, residuals, self.noise).reshape(len(starts), -1)
        away = (starts - self.pieces.starts) / self.wide
        pull = (self.by_state.transpose(0, 2, 1) @ white[:, :, None])[:, :, 0] + away / self.wide
        step = (self.covariance @ pull[:, :, None])[:, :, 0]
        cost = float(np.sum(white**2) + np.sum(away**2) - np.sum(pull * step))
        by_white = 2 * (white - (self.by_state @ step[:, :, None])[:, :, 0])
        return cost, by_white, 2 * (away - step / self.wide) / self.wide, states, residuals


def adjoint_step(problem: Problem) -> ca.Function:
    """``adjoint(z, x, u, pull, p, h) -> z before``: a row of an adjoint simulation, run from the last row to the first.

    z (nx + k) is the derivative of a cost by the state after the row, and the share of later rows in its derivative by
    the parameters; `pull` (ny) is the derivative by the observed values of the row.
    """
    model, nx = problem.model, len(problem.model.states)
    theta = ca.vcat([model.symbol(name) for name in problem.free])
    z, h = ca.SX.sym("z", nx + len(problem.free)), ca.SX.sym("h")
    seen = model.expand(ca.vcat([model.symbol(name) for name in problem.seen]))
    pull = ca.SX.sym("pull", seen.numel())
    following = runge_kutta_step(model)(model.x, model.u, model.p, h)
    total = ca.dot(following, z[:nx]) + ca.dot(seen, pull)
    before = ca.vertcat(ca.gradient(total, model.x), z[nx:] + ca.gradient(total, theta))
    return ca.Function("adjoint", [z, model.x, model.u, pull, model.p, h], [ca.densify(before)], {"cse": True})


def _stretch(estimate: Estimate, before: Array) -> Array:
    """Factor C (k, k) on the distance from the estimate in the trials' density.

    The scatter J of the gradient, with which the robust covariance of the estimate was computed, takes the place of the
    trials' information I under the noise model: C.T @ I @ C = I @ J^-1 @ I, the Godambe information.
    """
    size = np.sqrt(np.diag(estimate.covariance))
    scale = np.outer(size, size)
    information, known = estimate.information * scale, before * size[:, None] * size
    whole = information + known
    scatter = whole @ (estimate.covariance / scale) @ whole - known
    # With the eigenvectors V of J against I: V.T I V = 1, V.T J V = diag(ratio), and C = V diag(ratio^-1/2) V^-1.
    ratio, vectors = eigh((scatter + scatter.T) / 2, information + 1e-9 * np.eye(len(size)))  # 1e-9: negligible
    stretch = vectors @ (np.maximum(ratio, 1.0)[:, None] ** -0.5 * np.linalg.inv(vectors))
    return np.asarray(size[:, None] * stretch / size)


def sample_posterior(
    problem: Problem,
    estimate: Estimate,
    sampler: Sampler = "nuts",
    draws: int = DRAWS_OF_CHAIN,
    *,
    seed: int = 0,
    robust: bool = True,
) -> PosteriorSamples:
    """Sample the posterior about an estimate of output error.

    `problem`, `estimate`, `robust`: As for :class:`LogPosterior`. `sampler`: "nuts": the no-U-turn sampler with exact
    gradients (Hoffman and Gelman 2014, J. Mach. Learn. Res. 15; library nutpie); "ensemble": walkers that move along
    differences of others, without gradients (ter Braak 2006, Stat. Comput. 16; library emcee). `draws`: Kept draws of
    each chain; of each walker :data:`WALKER_SHARE` of it. Raises InputError: The library of the sampler is not
    installed.
    """
    check_sampler(sampler)
    density = LogPosterior(problem, estimate, robust=robust)
    chains = (_nuts if sampler == "nuts" else _ensemble)(density, draws, seed)
    values = np.array([[density.values(z) for z in chain] for chain in chains])
    with warnings.catch_warnings():  # of a version to come
        warnings.simplefilter("ignore", FutureWarning)
        import arviz
    return PosteriorSamples(
        free=problem.free,
        values=values,
        r_hat=np.array([float(arviz.rhat(values[:, :, place])) for place in range(values.shape[2])]),
        effective=np.array([float(arviz.ess(values[:, :, place])) for place in range(values.shape[2])]),
        sampler=sampler,
        simulations=density.simulations,
    )


def _nuts(density: LogPosterior, draws: int, seed: int) -> Array:
    """Chains (chains, draws, k) of the no-U-turn sampler in scaled coordinates."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        import nutpie
        from nutpie.compiled_pyfunc import from_pyfunc
    k = len(density.center)
    model = from_pyfunc(
        ndim=k,
        make_logp_fn=lambda: density.with_gradient,
        make_expand_fn=lambda *_: lambda z: {"z": np.asarray(z)},
        expanded_dtypes=[np.dtype("float64")],
        expanded_shapes=[(k,)],
        expanded_names=["z"],
        make_initial_point_fn=lambda chain_seed: np.random.default_rng(chain_seed).standard_normal(k),
    )
    cores = min(CHAINS, os.cpu_count() or 1)
    settings = {"draws": draws, "tune": TUNE, "chains": CHAINS, "cores": cores, "seed": seed}
    found = nutpie.sample(model, **settings, progress_bar=False, save_warmup=False)
    return np.asarray(found.posterior["z"].values)


def _ensemble(density: LogPosterior, draws: int, seed: int) -> Array:
    """Walkers (walkers, draws, k) of the ensemble sampler in scaled coordinates, after half of the steps."""
    import emcee

    k = len(density.center)
    walkers = max(2 * k + 2, 32)
    rng = np.random.RandomState(seed)  # the library takes the state of this generator
    kept = max(10, round(CHAINS * draws / walkers))
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # a simulation is machine code: threads run in parallel
        moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]  # as the library's manual advises
        sampler = emcee.EnsembleSampler(walkers, k, density, moves=moves, pool=threads)
        begin = emcee.State(rng.standard_normal((walkers, k)), random_state=rng.get_state())
        begin = sampler.run_mcmc(begin, kept * EVERY_STEPS, store=False)
        sampler.run_mcmc(begin, kept, thin_by=EVERY_STEPS)
    return np.asarray(sampler.get_chain()).transpose(1, 0, 2)
