"""Captive tests of the same ship as equations in the free parameters of a model, to be fitted together with trials.

Every run's means and harmonics of X, Y and N are compared with the model's forces along the measured motion,
Froude-scaled and prime. A tank differs from a free-running ship: a gain of each force, an offset of X (propeller and
friction differ from the ship's) and the place of the moment's reference point are uncertain parameters, eliminated
by their priors (Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63: model discrepancy, here of these few forms).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.scaling import Scales
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.errors import InputError
from tank2sim.identification.captive.equations import axial_speed, rigid_body_force
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.records.campaigns import Campaign
from tank2sim.records.captive_record import FORCE_COLUMNS

GAIN_ERROR = 0.05
"""Standard error of the gain of each force between tank and ship: Froude-scaled forces of one hull in different tanks
differ by 5 to 10 % (SIMMAN 2008 and 2014, captive data of the KVLCC2). Project choice within that."""

SURGE_OFFSET = 1e-3
"""Standard error of a constant X' between tank and ship: resistance and thrust of a model differ from the ship's.
Project choice: as large as the resistance itself."""

RUDDER_GAIN_ERROR = 0.15
"""Relative standard error of the rudder's forces between tank and ship: they follow the square of the inflow, and the
loading of the propeller differs (HMRI's revolutions are 4 to 5 % below HSVA's and MARIN's by Froude's law, which is 5 %
of force). Project choice: three times that, for wakes differ, too."""

REFERENCE_ERROR = 0.01
"""Standard error of the reference point of the moment, in ship lengths. Project choice: 7 cm of a 7 m model."""

LEAST_NOISE = 1e-3
"""Least noise of a force, as a share of the standard deviation of all that was measured of it: gauges are calibrated to
0.1 % at best (project choice)."""

SAME_FORM = 0.05
"""Relative difference of L/B and L/T from which a campaign is of another ship. Project choice: models are built to
1 mm, draughts are set to 1 %."""

ROWS_A_PERIOD = 48
"""Instants of a period at which the model's forces are evaluated: the third harmonic, of cubic products, is resolved
eight times."""


@dataclass(frozen=True, eq=False)
class CaptiveRuns:
    """Reduced runs of a campaign, from which :func:`captive_tests` makes equations for any model of the ship."""

    campaign: Campaign
    runs: tuple[ReducedRun, ...]  # Means and harmonics of each run's forces


@dataclass(frozen=True, eq=False)
class CaptiveTests:
    """Equations of a campaign in the k free parameters of a model."""

    # ``forces(motion, p) -> (F, J, R)``: the water's X', Y', N' at one instant, their slopes by the free parameters,
    # and the rudder's part of them
    forces: ca.Function
    # (9, instants): u, v, r, rudder angle, dv/dt, dr/dt, propeller speed over its nominal one, and the run's scales of
    # force and moment (N, N m); ship size, SI
    motion: Array
    projection: sparse.csr_matrix  # (m/3, instants): Histories of a force to means and harmonics, run by run
    measured: Array  # (m,): Coefficients of all runs, of X', then of Y' and N'
    force: NDArray[np.int64]  # (m,): 0, 1, 2 for X, Y, N
    mean: NDArray[np.bool_]  # (m,): True for a mean, False for a harmonic
    noise: Array  # (3,): Standard deviation of the residual of each force, prime
    columns: NDArray[np.int64]  # (k,): Columns of J that belong to the free parameters
    source: CaptiveRuns  # What the equations were made from

    def residuals(self, p: Array) -> tuple[Array, Array]:
        """Residuals (m,), model less measured, and their slopes (m, k), prime, at the model's parameters `p`."""
        residuals, slopes, _ = self._linearised(p)
        return residuals, slopes

    def _linearised(self, p: Array) -> tuple[Array, Array, Array]:
        """Residuals (m,), slopes (m, k), effects (m, 6) of the tank-to-ship parameters per standard error."""
        instants = self.motion.shape[1]
        values, slopes, rudder = map(np.array, self.forces.map(instants)(self.motion, p))
        slopes = slopes.reshape(3, instants, -1)[:, :, self.columns]
        forces, jacobian, by_rudder = (
            np.concatenate([self.projection @ of_force for of_force in of_forces])
            for of_forces in (values, slopes, rudder)
        )
        effects = [np.where(self.force == place, GAIN_ERROR * forces, 0.0) for place in range(3)]
        effects.append(np.where((self.force == 0) & self.mean, SURGE_OFFSET, 0.0))
        sway = np.zeros(len(forces))
        sway[self.force == 2] = forces[self.force == 1]  # the same coefficients of each run, in the same order
        effects += [REFERENCE_ERROR * sway, RUDDER_GAIN_ERROR * by_rudder]
        return forces - self.measured, jacobian, np.column_stack(effects)

    def of(self, places: Sequence[int]) -> CaptiveTests:
        """The same equations in some of the free parameters."""
        return replace(self, columns=self.columns[list(places)])

    def normal(self, p: Array) -> tuple[Array, Array, float]:
        """Information (k, k), gradient (k,) and cost, the uncertain parameters between tank and ship eliminated."""
        residual, jacobian, between = self._linearised(p)
        weight = 1 / self.noise[self.force]
        whole = np.column_stack([residual, jacobian]) * weight[:, None]
        between *= weight[:, None]
        inner = np.eye(between.shape[1]) + between.T @ between
        across = between.T @ whole
        gram = whole.T @ whole - across.T @ np.linalg.solve(inner, across)
        return gram[1:, 1:], gram[1:, 0], float(gram[0, 0])

    def with_noise_at(self, p: Array) -> CaptiveTests:
        """The same with the root mean square residual of each force at `p` as its noise, less the fitted terms."""
        residual, jacobian = self.residuals(p)
        noise = []
        for place in range(3):
            rows = self.force == place
            used = min(jacobian[rows].any(axis=0).sum(), rows.sum() // 2)
            least = LEAST_NOISE * float(np.std(self.measured[rows]))
            noise.append(max(least, float(np.sqrt(np.sum(residual[rows] ** 2) / max(rows.sum() - used, 1)))))
        return replace(self, noise=np.array(noise))


def captive_tests(card: ManoeuvringCard, model: Model, free: Sequence[str], source: CaptiveRuns) -> CaptiveTests:
    """The equations of a campaign's runs in the free parameters of a model.

    `card`: Card of the ship, at the size of `model`. `model`: Driven by the rudder's angle or order. `free`: Names of
    the k free parameters. Raises InputError: The campaign is of a ship of other proportions.
    """
    campaign, runs = source.campaign, source.runs
    _refuse_other_form(card, campaign)
    ratio = card.ship.length_m / campaign.model.length_m
    motions, projections, measured = [], [], []
    for run in runs:
        kept, projection = _thinned(run)
        motions.append(_motion(card, campaign, run, ratio)[:, kept])
        projections.append(projection)
        inertial, scales = rigid_body_force(campaign, run.motion), campaign.scales_at(run.motion.mean_speed_mps)
        added = {name: run.projected(inertial[name][:, None])[:, 0] for name in FORCE_COLUMNS}
        total = {name: run.fits[name].coefficients[: run.regressed] + added[name] for name in FORCE_COLUMNS}
        measured.append([values / scales.unit(name) for name, values in total.items()])
    every = np.concatenate(measured, axis=1)
    return CaptiveTests(
        forces=_water_forces(model, free),
        motion=np.hstack(motions),
        projection=sparse.block_diag(projections, format="csr"),
        measured=every.ravel(),
        force=np.repeat(np.arange(3), every.shape[1]),
        mean=np.tile(np.concatenate([np.arange(run.regressed) == 0 for run in runs]), 3),
        noise=0.02 * every.std(axis=1),
        columns=np.arange(len(free)),
        source=source,
    )


def _refuse_other_form(card: ManoeuvringCard, campaign: Campaign) -> None:
    for key in ("beam_m", "draught_m"):
        size, tested = getattr(card.ship, key), getattr(campaign.model, key)
        if not size or not tested:
            continue
        of_card, of_model = card.ship.length_m / size, campaign.model.length_m / tested
        if abs(of_model / of_card - 1) > SAME_FORM:
            problem = f"length over {key.removesuffix('_m')} is {of_model:.4g}, and {of_card:.4g} on {card.source}"
            raise InputError(campaign.path, f"model.{key}", problem, "give the campaign of a model of this ship")


def _thinned(run: ReducedRun) -> tuple[NDArray[np.int64], Array]:
    """Rows of a run at which its motion is evaluated, and the projection of histories there to mean and harmonics."""
    rows = len(run.motion.time_s)
    stride = max(1, rows // (ROWS_A_PERIOD * max(run.motion.periods, 1))) if run.run.oscillates else rows
    kept = np.arange(0, rows, stride, dtype=np.int64)
    basis = run.basis[kept] if run.run.oscillates else np.ones((len(kept), 1))
    projection = np.asarray(np.linalg.pinv(basis)[: run.regressed], dtype=np.float64)
    return kept, projection


def _motion(card: ManoeuvringCard, campaign: Campaign, run: ReducedRun, ratio: float) -> Array:
    """Motion (9, rows) at the ship's size by Froude's law, see :class:`CaptiveTests`."""
    motion, root = run.motion, np.sqrt(ratio)
    ones = np.ones(len(motion.time_s))
    turning = 1.0
    if run.run.propeller_radps and campaign.test.propeller_radps:
        turning = run.run.propeller_radps / campaign.test.propeller_radps
    revolutions = turning * campaign.test.speed_mps * root / card.model.speed_mps
    scales = Scales(card.environment.water_density_kgpm3, card.ship.length_m, motion.mean_speed_mps * root)
    return np.vstack(
        [
            axial_speed(motion) * root * ones,
            motion.v_mps * root,
            motion.r_radps / root,
            motion.delta_rad * ones,
            motion.vdot_mps2,
            motion.rdot_radps2 / ratio,
            revolutions * ones,
            scales.force * ones,
            scales.force * scales.length * ones,
        ]
    )


def _water_forces(model: Model, free: Sequence[str]) -> ca.Function:
    """The water's X', Y', N' at one instant of a captive run, with slopes by the free parameters."""
    names = ("u", "v", "r", "delta", "vdot", "rdot", "revolutions", "force_scale", "moment_scale")
    motion = ca.SX.sym("motion", len(names))
    u, v, r, delta, vdot, rdot, revolutions, force_scale, moment_scale = ca.vertsplit(motion)
    mass, x_G = model.symbol("ship.mass"), model.symbol("ship.x_G")
    surge, sway, yaw = inertial_forces(mass, x_G, u, v, r)
    added = {name: model.symbol(f"inertia.{name}") for name in ("sway", "sway_yaw", "yaw_sway", "yaw")}
    lever = mass * x_G
    X = model.symbol("force.X") - surge
    Y = model.symbol("force.Y") - sway - (added["sway"] - mass) * vdot - (added["sway_yaw"] - lever) * rdot
    inertia = model.symbol("ship.yaw_inertia")
    N = model.symbol("force.N") - yaw - (added["yaw_sway"] - lever) * vdot - (added["yaw"] - inertia) * rdot
    forces = ca.vertcat(X / force_scale, Y / force_scale, N / moment_scale)
    scales = {"X": force_scale, "Y": force_scale, "N": moment_scale}
    by_rudder = [model.symbol(f"rudder.{name}") / scale for name, scale in scales.items()]
    both = model.expand(ca.vertcat(forces, *by_rudder))
    driven = {"motion.u": u, "motion.v": v, "motion.r": r, "rudder.angle": delta, "rudder.command": delta}
    if "propulsion.nominal_speed" in model:
        turning = revolutions * model.symbol("propulsion.nominal_speed")
        driven |= {"propeller.speed": turning, "propeller.speed_actual": turning}
    for symbols, variables in ((model.x, model.states), (model.u, model.inputs)):  # all others have their start values
        both = ca.substitute(both, symbols, ca.vcat([driven.get(each.name, ca.SX(each.start)) for each in variables]))
    forces, rudder = ca.vertsplit(both, 3)
    slopes = ca.jacobian(forces, ca.vcat([model.symbol(name) for name in free]))
    return ca.Function("captive", [motion, model.p], [forces, slopes, rudder], {"cse": True})
