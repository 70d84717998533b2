"""Information of planned captive runs about the coefficients, by the regression that ``reduce`` makes of them.

Each run is made up without noise, from the coefficients known beforehand, and goes through the same reduction to
harmonics and the same equations (:mod:`tank2sim.identification.captive.equations`). Only the covariance of its
harmonics is not estimated from scatter but follows from the stated errors of the gauges.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tank2sim.apps.design.captive_runs import PlannedRun, RunGroup
from tank2sim.apps.design.study import GaugeStudy
from tank2sim.arrays import Array
from tank2sim.cards.terms import parse_term
from tank2sim.identification.captive.equations import (
    CampaignEquations,
    campaign_equations,
    candidate_terms,
    excited,
    rigid_body_force,
    term_history,
)
from tank2sim.identification.captive.harmonics import ReducedRun, reduced_run
from tank2sim.identification.captive.regression import Spread, scatters
from tank2sim.identification.captive.selection import RATIOS
from tank2sim.records.campaign_form import ModelSection, RunSheet, TankSection, TankTest, UncertaintySection
from tank2sim.records.campaigns import Campaign
from tank2sim.records.captive_record import FORCE_COLUMNS, CaptiveRun

_READINGS, _CYCLES = 24, 6
"""Readings a period of made-up runs, and their periods at most; the noise is scaled to readings and length of the run:
over whole periods information grows with their number."""

_UNKNOWN = 10.0
"""Standard deviation of unknown coefficients, over the largest linear one of the ship. Project
choice: in the prime system coefficients are of one size, and ten times as much is as good as unknown; it only keeps the
information of a plan without such runs invertible."""


@dataclass(frozen=True, kw_only=True)
class PlannedCampaign:
    """A model in a tank, with the coefficients known beforehand.

    `derivatives`: prime; `gauges`: ``X``, ``Y``, ``N`` to the errors of the gauge; `gain_relative`, `rate_hz`: error of
    the gain from run to run; independent readings a second.
    """

    model: ModelSection
    speed_mps: float
    water_density_kgpm3: float
    gravity_mps2: float
    derivatives: Mapping[str, float]
    gauges: Mapping[str, GaugeStudy]
    gain_relative: float
    rate_hz: float

    @property
    def campaign(self) -> Campaign:
        """The campaign without runs, with forces as the gauges read them."""
        return Campaign(
            path=Path("design"),
            model=self.model,
            test=TankTest(
                water_density_kgpm3=self.water_density_kgpm3,
                gravity_mps2=self.gravity_mps2,
                speed_mps=self.speed_mps,
                force_convention="on_gauge",
            ),
            tank=TankSection(),
            uncertainty=UncertaintySection(),
            full_scale=None,
            runs=(),
        )

    def made_up(self, run: PlannedRun) -> ReducedRun:
        """A run as it would be reduced: motion, and forces without noise."""
        still = reduced_run(self._record(run, None))
        return reduced_run(self._record(run, self._forces(still)))

    def largest_forces(self, run: PlannedRun) -> dict[str, float]:
        """Largest X, Y (N) and N (N m) that the gauges show in a run."""
        forces = self._forces(reduced_run(self._record(run, None)))
        return {force: float(np.max(np.abs(values))) for force, values in forces.items()}

    def _forces(self, still: ReducedRun) -> dict[str, Array]:
        """Forces on the gauges over the record, hydrodynamic sense: the water's, less the inertia of the body."""
        campaign = self.campaign
        inertial = rigid_body_force(campaign, still.motion)
        found = {}
        for force in FORCE_COLUMNS:
            total = -inertial[force]
            for term in candidate_terms(force):
                value = self.derivatives.get(term.name, 0.0)
                if value and term.acceleration != "u":  # no run of a carriage at constant speed has du/dt
                    total = total + value * term_history(campaign, still.motion, term.name)
            found[force] = total
        return found

    def _record(self, run: PlannedRun, forces: Mapping[str, Array] | None) -> CaptiveRun:
        cycles = min(run.cycles, _CYCLES) if run.oscillates else 1
        length = cycles * 2 * math.pi / run.frequency_radps if run.oscillates else run.record_s
        count = _READINGS * cycles
        time = np.arange(count) * length / count
        phase, ones = run.frequency_radps * time, np.ones(count)
        swing, drifting = run.velocity * np.cos(phase), -run.speed_mps * math.sin(run.drift_rad) * ones
        made = forces or dict.fromkeys(FORCE_COLUMNS, 0.0 * ones)
        return CaptiveRun(
            name=run.type,
            type=run.type,
            sheet=RunSheet(file=run.type, type=run.type),
            time_s=time,
            v_mps=swing if run.motion == "sway" else drifting,
            r_radps=swing if run.motion == "yaw" else 0.0 * ones,
            speed_mps=run.speed_mps * ones,
            delta_rad=run.rudder_rad * ones,
            X_N=made["X"],
            Y_N=made["Y"],
            N_Nm=made["N"],
        )

    def _with_noise(self, reduced: ReducedRun, run: PlannedRun) -> ReducedRun:
        """The run with the covariance of its harmonics by the stated noise: as many independent readings as it has."""
        inverse = np.asarray(np.linalg.inv(reduced.basis.T @ reduced.basis), dtype=np.float64)
        thinning = len(reduced.run.time_s) / (run.record_s * self.rate_hz)
        fits = {
            force: replace(fit, covariance=inverse * self.gauges[force].noise ** 2 * thinning)
            for force, fit in reduced.fits.items()
        }
        return replace(reduced, fits=fits)

    def spread(self, equations: CampaignEquations) -> Spread:
        """The stated errors from run to run."""
        gauge = self.gauges[equations.force]
        return Spread(1.0, (gauge.zero / equations.unit) ** 2, gain_variance=self.gain_relative**2)

    def information(self, groups: Sequence[RunGroup]) -> dict[str, tuple[tuple[str, ...], Array]]:
        """Force to the names (k,) of the terms that the runs excite, and the information (n, k, k) of each group."""
        runs = [run for group in groups for run in group]
        reduced = [self._with_noise(self.made_up(run), run) for run in runs]
        group_of_run = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        found = {}
        for force in FORCE_COLUMNS:
            terms = [term for term in candidate_terms(force) if excited(self.campaign, reduced, term)]
            names = tuple(term.name for term in terms)
            equations = campaign_equations(self.campaign, reduced, force, names)
            each = scatters(equations, self.spread(equations))
            total = np.zeros((len(groups), *each.shape[1:]))
            np.add.at(total, group_of_run, each)
            found[force] = (names, total)
        return found

    def prior(self, names: Sequence[str]) -> Array:
        """Information (k, k) before the tests: the ratios of known ships that `reduce` takes, others unknown."""
        sizes = {name: abs(value) for name, value in self.derivatives.items() if name[0] in "YN"}
        unknown = _UNKNOWN * max(sizes.get(name, 0.0) for name in ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd"))
        widths = []
        for name in names:
            reference, ratio = RATIOS.get(name[1:], ("", 0.0))
            width = ratio * sizes.get(name[0] + reference, 0.0)
            widths.append(width if width and parse_term(name) else unknown)
        return np.diag(np.array(widths) ** -2.0)
