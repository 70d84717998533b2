"""The uncertainty budget of a campaign after ITTC 7.5-02-06-04: each derivative's variance by its causes.

The variance of the regression is divided exactly: its weights applied to the covariance of the noise within runs, of
the zero errors and of the gains from run to run, and to the prior. Errors common to the campaign (Type B) add their
squares. The combined standard uncertainty is the root of the sum, which is the standard error of the result; expanded
uncertainty is twice that (95 %, ITTC 7.5-02-06-04; JCGM 100:2008, 6.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.captive.reduction import Reduction
from tank2sim.identification.captive.regression import Solution, efficient_solution
from tank2sim.identification.captive.selection import Selection
from tank2sim.records.campaign_form import ModelSection, TankSection, TankTest, UncertaintySection

COVERAGE_FACTOR = 2.0
"""k of the expanded uncertainty: 95 % (ITTC 7.5-02-06-04)."""

BUDGET_SOURCES = {
    "random": "noise within the runs",
    "repeatability": "zero error from run to run, and what (3.8) does not follow",
    "calibration": "gauges: their calibration, and gain from run to run",
    "alignment": "zero of the drift angle and of the rudder",
    "timing": "delay of the forces behind the motion",
    "speed": "carriage speed",
    "inertia": "mass and yaw inertia that are removed",
    "blockage": "speed of the water past the model between the walls",
    "prior": "third-order terms that the runs hardly show",
}
"""Sources of the budget, in its order, in words."""

_SOURCE_OF = {
    "calibration_relative": "calibration",
    "alignment": "alignment",
    "alignment_rad": "alignment",
    "rudder_rad": "alignment",
    "force_delay": "timing",
    "force_delay_s": "timing",
    "speed_relative": "speed",
    "mass_relative": "inertia",
    "yaw_inertia_relative": "inertia",
    "blockage_relative": "blockage",
}


@dataclass(frozen=True, kw_only=True)
class BudgetRow:
    """The budget of one derivative, prime."""

    name: str
    value: float
    # `combined`, `expanded`: Standard uncertainty, and :data:`COVERAGE_FACTOR` times that
    combined: float
    expanded: float
    # `parts`, `shares`: Source, a key of :data:`BUDGET_SOURCES`, to its standard uncertainty, and to its share of the
    # variance; the shares add up to 1
    parts: Mapping[str, float]
    shares: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class UncertaintyBudget:
    """The uncertainty budget after ITTC 7.5-02-06-04, prime."""

    coverage_factor: float
    sources: dict[str, str]  # Source to its words
    not_stated: tuple[str, ...]  # Keys of ``[uncertainty]`` that the campaign does not state
    # Relative increase of the speed past the model by the walls; None if a size is missing
    blockage_speed_relative: float | None
    derivatives: dict[str, BudgetRow]  # Derivative to its budget


def uncertainty_budget(reduction: Reduction) -> UncertaintyBudget:
    """The budget of each derivative that the campaign gives."""
    campaign, derivatives = reduction.campaign, {}
    for result in reduction.forces.values():
        parts = regression_parts(result.selection, result.solution)
        for place, name in enumerate(result.solution.names):
            if name not in reduction.derivatives:
                continue
            found = reduction.derivatives[name]
            variances = dict.fromkeys(BUDGET_SOURCES, 0.0)
            for source, sizes in parts.items():
                variances[source] += float(sizes[place])
            for source, size in found.type_b.items():
                variances[_SOURCE_OF.get(source, "calibration")] += size**2
            total = sum(variances.values())
            combined = float(np.sqrt(total))
            derivatives[name] = BudgetRow(
                name=name,
                value=found.value,
                combined=combined,
                expanded=COVERAGE_FACTOR * combined,
                parts={source: float(np.sqrt(variance)) for source, variance in variances.items()},
                shares={source: variance / total if total else 0.0 for source, variance in variances.items()},
            )
    return UncertaintyBudget(
        coverage_factor=COVERAGE_FACTOR,
        sources=BUDGET_SOURCES,
        not_stated=sources_not_stated(reduction),
        blockage_speed_relative=blockage_speed(campaign.model, campaign.tank, campaign.test),
        derivatives=derivatives,
    )


def regression_parts(selection: Selection, solution: Solution) -> dict[str, Array]:
    """Variance of each term by cause, (terms,): ``random``, ``repeatability``, ``calibration`` (gain from run to run)
    and ``prior``.

    The estimate is C X' S S b with the weights S; b has the covariance noise I + zero z z' + gain g g'. All parts are
    widened alike for the finite number of runs (Student's t).
    """
    equations, spread = selection.equations, solution.spread
    weights = spread.weights or spread
    inverse = efficient_solution(equations, weights).covariance
    design = weights.weighted(equations, equations.design)
    twice = weights.weighted(equations, design) @ inverse
    common = weights.weighted(equations, np.column_stack([equations.zero, equations.gauge]))
    zero, gauge = (equations.run_sums(design * common[:, [place]]) @ inverse for place in (0, 1))
    parts = {
        "random": spread.noise * np.sum(twice**2, axis=0),
        "repeatability": spread.zeros(equations) @ zero**2,
        "calibration": spread.gain_variance * np.sum(gauge**2, axis=0),
        "prior": np.sum((equations.prior_rows @ inverse) ** 2, axis=0),
    }
    return {cause: selection.widening**2 * variances for cause, variances in parts.items()}


def sources_not_stated(reduction: Reduction) -> tuple[str, ...]:
    """Keys of ``[uncertainty]`` that the campaign does not state, and that no data show: taken as zero."""
    stated = reduction.campaign.uncertainty.model_fields_set
    shown = {"force_delay_s"} if reduction.delay is not None and reduction.delay.alike else set()
    return tuple(key for key in UncertaintySection.model_fields if key not in stated | shown)


def blockage_speed(model: ModelSection, tank: TankSection, test: TankTest) -> float | None:
    """Relative increase of the speed of the water past the model by the tank's walls; None if a number is missing.

    m / (1 - m - Fnh^2), the mean flow of Schuster's formula (ITTC 7.5-02-02-01), m the share of the section that the
    model fills (as a box of B x T), Fnh the Froude number by depth.
    """
    if model.beam_m is None or model.draught_m is None or tank.breadth_m is None or tank.depth_m is None:
        return None
    share = model.beam_m * model.draught_m / (tank.breadth_m * tank.depth_m)
    left = 1.0 - share - test.speed_mps**2 / (test.gravity_mps2 * tank.depth_m)
    return share / left if left > 0 else None
