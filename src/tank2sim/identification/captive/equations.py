"""The linear equations of a campaign: the contribution of each term of (3.8) to each harmonic of each run.

A run's reduction to harmonics is linear, so that the same reduction of the regressors v, v^3, v r^2, dv/dt, ... gives
the exact equations for any motion, without a small-amplitude expansion.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.cards.scaling import Scales
from tank2sim.cards.terms import Term, known_term
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, ACCELERATION_TERMS
from tank2sim.dynamics.rigid_body import inertia, inertial_forces
from tank2sim.errors import InputError
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.motion import CaptiveMotion
from tank2sim.records.campaigns import Campaign

SPEED_RANGE = 0.03
"""Relative change of the speed between runs from which terms in Du are candidates, and within which a run counts as
at the test speed. Project choice: 3 % of speed is 6 % of force, and carriages hold 0.1 %."""
_ACTIVE = 1e-3
"""A term is excited if its product of motions reaches this share of the product of the campaign's largest motions."""


HEEL_TERMS = {
    "X": ("Xphiphi",),
    "Y": ("Yphi", "Yvvphi", "Yvphiphi", "Yrrphi", "Yrphiphi"),
    "N": ("Nphi", "Nvvphi", "Nvphiphi", "Nrrphi", "Nrphiphi"),
}
"""Terms of the heel that steady tests at a heel show, by Son and Nomoto (1982), Naval Architecture and Ocean
Engineering 20, 73-83."""


def candidate_terms(force: str, *, heeled: bool = False) -> tuple[Term, ...]:
    """Terms of (3.8) and acceleration terms of one force, in their order; with `heeled` the terms of the heel last."""
    names = (*ABKOWITZ_TERMS[force], *(name for name in ACCELERATION_TERMS if name[0] == force))
    names += HEEL_TERMS[force] if heeled else ()
    return tuple(map(known_term, names))


@dataclass(frozen=True, eq=False, kw_only=True)
class CampaignEquations:
    """Weighted equations of one force over a campaign: rows are coefficients of runs, columns are terms."""

    force: str  # ``X``, ``Y`` or ``N``
    names: tuple[str, ...]  # Names of the columns
    design: Array  # (rows, columns): Each run's block is multiplied by the inverse root of its within-run covariance
    values: Array  # (rows,): The water's force, weighted in the same way
    zero: Array  # (rows,): Effect of a zero error of 1 common to a run, weighted
    # (rows,): The gauge's force, with the reaction of the body's inertia, weighted: the effect of a gain error of 1
    # common to a run
    gauge: Array
    run_of_row: NDArray[np.int64]  # (rows,): Index of each row's run in `runs`
    runs: tuple[ReducedRun, ...]  # The runs
    unit: float  # Force or moment by which rows are made non-dimensional before weighting, N or N m
    roots: tuple[Array, ...]  # Cholesky root of each run's within-run covariance, in `unit`
    # Term to the standard deviation (prime) of its prior about zero; other terms are free
    prior: Mapping[str, float] = field(default_factory=dict)

    def held(self, prior: Mapping[str, float]) -> CampaignEquations:
        """The equations with a prior about zero on some terms."""
        return replace(self, prior=prior)

    @property
    def prior_rows(self) -> Array:
        """The prior as weighted equations with right-hand side zero, (terms with a prior, columns)."""
        places = [place for place, name in enumerate(self.names) if name in self.prior]
        rows = np.zeros((len(places), len(self.names)))
        rows[np.arange(len(places)), places] = [1.0 / self.prior[self.names[place]] for place in places]
        return rows

    def of_terms(self, names: Sequence[str]) -> CampaignEquations:
        """The equations with the columns `names` only."""
        places = [self.names.index(name) for name in names]
        return replace(self, names=tuple(names), design=self.design[:, places])

    def of_runs(self, places: Sequence[int]) -> CampaignEquations:
        """The equations of the runs `places` only."""
        rows = np.flatnonzero(np.isin(self.run_of_row, places))
        renumbered = {place: number for number, place in enumerate(places)}
        return replace(
            self,
            design=self.design[rows],
            values=self.values[rows],
            zero=self.zero[rows],
            gauge=self.gauge[rows],
            run_of_row=np.array([renumbered[place] for place in self.run_of_row[rows]], dtype=np.int64),
            runs=tuple(self.runs[place] for place in places),
            roots=tuple(self.roots[place] for place in places),
        )

    @cached_property
    def first_rows(self) -> NDArray[np.int64]:
        """Row at which each run begins."""
        return np.searchsorted(self.run_of_row, np.arange(len(self.runs)))

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Rows of each run."""
        ends = [*self.first_rows[1:].tolist(), len(self.values)]
        return tuple(slice(start, end) for start, end in zip(self.first_rows.tolist(), ends, strict=True))

    @cached_property
    def zero_sizes(self) -> Array:
        """Squared norm of each run's rows of `zero`, (runs,)."""
        return self.run_sums(self.zero**2)

    def run_sums(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum over the rows of each run, (runs, ...)."""
        return np.add.reduceat(rows, self.first_rows, axis=0)


def campaign_equations(
    campaign: Campaign, runs: Sequence[ReducedRun], force: str, names: Sequence[str]
) -> CampaignEquations:
    """The equations of a force for the named terms (or trend terms, ``Yv w2``).

    Raises InputError: The inertia of a yaw run must be removed and the campaign does not give it.
    """
    scales = campaign.scales
    unit = scales.unit(force)
    keys = _known_by(campaign, names)
    sizes = np.array([run.regressed for run in runs])
    ends = np.cumsum(sizes)
    system = np.empty((ends[-1], len(names) + 3))
    roots: list[Array] = [np.empty(0)] * len(runs)
    for size in np.unique(sizes).tolist():  # runs of as many coefficients together
        alike: list[int] = np.flatnonzero(sizes == size).tolist()
        fits = [runs[place].fits[force] for place in alike]
        covariances = np.array([fit.covariance[:size, :size] for fit in fits]) / unit**2
        gauges = np.array([fit.coefficients[:size] for fit in fits]) / unit
        projected = np.array([_projected_terms(campaign, runs[place], force, names, keys) for place in alike]) / unit
        zeros = np.broadcast_to(np.eye(size)[:, 0], gauges.shape)
        right = np.stack([gauges + projected[..., -1], zeros, gauges], axis=-1)
        root = np.linalg.cholesky(covariances)
        weighted = np.linalg.solve(root, np.concatenate([projected[..., :-1], right], axis=-1))
        for place, block, its_root in zip(alike, weighted, root, strict=True):
            system[ends[place] - size : ends[place]] = block
            roots[place] = its_root
    return CampaignEquations(
        force=force,
        names=tuple(names),
        design=system[:, :-3].copy(),
        values=system[:, -3].copy(),
        zero=system[:, -2].copy(),
        gauge=system[:, -1].copy(),
        run_of_row=np.repeat(np.arange(len(runs), dtype=np.int64), sizes),
        runs=tuple(runs),
        unit=unit,
        roots=tuple(roots),
    )


def axial_speed(motion: CaptiveMotion) -> Array:
    """u = U cos(beta), (rows,), m/s."""
    return np.sqrt(motion.speed_mps**2 - motion.v_mps**2)


def rigid_body_force(campaign: Campaign, motion: CaptiveMotion) -> Mapping[str, Array]:
    """Correction of a measured force (hydrodynamic sense) to the water's force, N and N m: (3.1) of paper 2.

    Zero if the inertia is already removed from the campaign's forces.
    """
    if campaign.inertia_removed:
        return {force: np.zeros(len(motion.time_s)) for force in "XYN"}
    model = campaign.model
    if motion.accelerates[1] and model.yaw_inertia_kgm2 is None:
        remedy = "add the yaw inertia about midships of the body that the gauges carry"
        raise InputError(campaign.path, "model.yaw_inertia_kgm2", "is missing, and there are yaw tests", remedy)
    body = inertia(model.mass_kg, model.x_G_m, model.yaw_inertia_kgm2 or 0.0, dict.fromkeys(ACCELERATION_TERMS, 0.0))
    # Paper 2 has u = U in its oscillations (2.2, 2.3).
    by_paper = campaign.test.inertia_speed == "test" and motion.periods
    u = motion.speed_mps if by_paper else axial_speed(motion)
    surge, sway, yaw = inertial_forces(model.mass_kg, model.x_G_m, u, motion.v_mps, motion.r_radps)
    return {
        "X": -surge,
        "Y": body.sway * motion.vdot_mps2 + body.sway_yaw * motion.rdot_radps2 - sway,
        "N": body.yaw_sway * motion.vdot_mps2 + body.yaw * motion.rdot_radps2 - yaw,
    }


def _known_by(campaign: Campaign, names: Sequence[str]) -> list[Hashable]:
    """By what projections of terms are kept: all that they depend on but the motion; last the inertia of the body."""
    model, test = campaign.model, campaign.test
    ship = (test.water_density_kgpm3, model.length_m, test.speed_mps)
    body = (model.mass_kg, model.x_G_m, model.yaw_inertia_kgm2, test.inertia_speed, campaign.inertia_removed)
    return [*((ship, name[1:]) for name in names), body]


def _projected_terms(
    campaign: Campaign, run: ReducedRun, force: str, names: Sequence[str], keys: Sequence[Hashable]
) -> Array:
    """Mean and harmonics (regressed, names + 1) of each term of prime value 1 and of the rigid body; N or N m."""
    known = run.motion.projections
    *of_terms, body = keys
    histories = {
        key: term_history(campaign, run.motion, f"Y{name[1:]}")
        for key, name in zip(of_terms, names, strict=True)
        if key not in known
    }
    if (body, force) not in known:
        histories |= {(body, of): history for of, history in rigid_body_force(campaign, run.motion).items()}
    if histories:
        known |= dict(zip(histories, run.projected(np.array([*histories.values()]).T).T, strict=True))
    found = np.array([*(known[key] for key in of_terms), known[body, force]]).T
    if force == "N":
        found[:, :-1] *= campaign.model.length_m
    return found


def term_history(campaign: Campaign, motion: CaptiveMotion, name: str) -> Array:
    """Force of a term whose prime value is 1, (rows,), N or N m."""
    spelt, _, trend = name.partition(" ")
    term = known_term(spelt)
    model, u0 = campaign.model, campaign.test.speed_mps
    density, length = campaign.test.water_density_kgpm3, model.length_m
    if term.acceleration:
        scale = Scales(density, length, u0).derivative(term)
        history = scale * (motion.vdot_mps2 if term.acceleration == "v" else motion.rdot_radps2)
    else:
        powers = [motion.v_mps] * term.v + [motion.r_radps] * term.r + [motion.delta_rad] * term.d
        if term.u:
            powers += [axial_speed(motion) - u0] * term.u
        history = np.asarray(Scales(density, length, motion.speed_mps).derivative(term))
        for factor in powers:
            history = history * factor
        history = history * motion.heel_rad**term.phi
    if trend:
        history = history * (motion.frequency_radps * length / u0) ** 2
    return np.broadcast_to(history, len(motion.time_s))


def excited(campaign: Campaign, runs: Sequence[ReducedRun], term: Term) -> bool:
    """True if the motion of a run excites the term."""
    u0, length = campaign.test.speed_mps, campaign.model.length_m
    if term.acceleration == "u":
        return False
    if term.acceleration:
        return any(
            run.motion.accelerates["vr".index(term.acceleration)]
            and run.run.type == ("pure_sway" if term.acceleration == "v" else run.run.type)
            for run in runs
        )
    if term.u and not speeds_differ(campaign, runs):
        return False
    powers = np.array([term.v, term.r, term.d, term.u, term.phi])
    motions = np.array([_largest_motions(run.motion, u0, length) for run in runs])
    # The largest motions of one run count as simultaneous: a coarse bound is enough to detect a missing motion.
    products, bound = np.prod(motions**powers, axis=1), np.prod(motions.max(axis=0) ** powers)
    return bool(np.any(products > _ACTIVE * bound))


def _largest_motions(motion: CaptiveMotion, u0: float, length: float) -> list[float]:
    """Largest v', r', rudder angle, change of speed U (a change of u by drift alone does not determine Du), heel."""
    change = abs(motion.mean_speed_mps / u0 - 1)
    v, r, delta = motion.largest
    return [v / u0, r * length / u0, delta, change if change > SPEED_RANGE else 0.0, abs(motion.heel_rad)]


def speeds_differ(campaign: Campaign, runs: Sequence[ReducedRun]) -> bool:
    """True if the runs' speeds differ by more than :data:`SPEED_RANGE` of the test speed."""
    speeds = [run.motion.mean_speed_mps for run in runs]
    return max(speeds) - min(speeds) > SPEED_RANGE * campaign.test.speed_mps
