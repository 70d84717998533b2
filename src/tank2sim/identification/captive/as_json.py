"""A complete reduction as plain data, for JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from tank2sim.cards.scaling import Scales
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.plot_data import plots_as_json
from tank2sim.identification.captive.reduction import ForceResult, Reduction, is_resistance
from tank2sim.identification.captive.repeats import repeats
from tank2sim.identification.captive.result_card import Contents
from tank2sim.identification.captive.tables import by_the_papers_order, prediction_errors, terms_of_heel
from tank2sim.identification.captive.uncertainty_budget import (
    BUDGET_SOURCES,
    COVERAGE_FACTOR,
    blockage_speed,
    sources_not_stated,
    uncertainty_budget,
)
from tank2sim.records.campaigns import Campaign


def reduction_as_json(reduction: Reduction, card: Contents, warnings: tuple[str, ...]) -> dict[str, Any]:
    """A complete reduction; ``derivatives`` and ``rigid_body`` are those of the card, which has none of the heel."""
    campaign = reduction.campaign
    found: dict[str, Any] = {
        "campaign": str(campaign.path),
        "model": campaign.model.model_dump(exclude_none=True),
        "test": campaign.test.model_dump(exclude_none=True),
        "conventions": {
            "scaling": "prime",
            "speed_scale": "instantaneous",
            "yaw_rate_terms": "hydrodynamic",
            "rudder_sign": "starboard",
            "speed_mps": campaign.test.speed_mps,
        },
        "rigid_body": {"mass": card.mass, "yaw_inertia": card.yaw_inertia, "x_G": card.x_G},
        "derivatives": {name: _derivative(reduction, card, name) for name in card.entries},
        "heel_derivatives": {
            name: _measured(
                reduction, name, reduction.derivatives[name].value, reduction.derivatives[name].standard_error
            )
            for name in terms_of_heel(reduction)
        },
        "uncertainty_budget": _budget(reduction),
        "missing": card.missing,
        "warnings": warnings,
        "methods": {force: _methods(result) for force, result in reduction.forces.items()},
        "selection": {
            force: [asdict(choice) for choice in result.selection.choices] for force, result in reduction.forces.items()
        },
        "spread": {force: _spread(result) for force, result in reduction.forces.items()},
        "systematic_errors": [{**asdict(error), "message": error.message} for error in reduction.systematic],
        "force_delay": _delay(reduction),
        "alignment": asdict(reduction.alignment) | {"shown": reduction.alignment.shown}
        if reduction.alignment
        else None,
        "trends": [asdict(trend) for result in reduction.forces.values() for trend in result.trends],
        "symmetry": {force: asdict(result.asymmetry) for force, result in reduction.forces.items() if result.asymmetry},
        "leave_one_out": {
            force: [{**asdict(row), "error": row.error} for row in result.left_out]
            for force, result in reduction.forces.items()
        },
        "prediction_errors": prediction_errors(reduction),
        "oscillations": [asdict(row) for row in reduction.oscillations],
        "third_order": [asdict(cubic) for cubic in reduction.cubics],
        "runs": [_run(campaign, run) for run in reduction.runs],
        "plots": plots_as_json(reduction),
        "not_used": reduction.not_used,
        "faults": [str(fault) for fault in reduction.faults],
    }
    repeated = repeats(campaign, reduction.runs)
    found["repeats"] = asdict(repeated) if repeated else None
    if is_resistance(campaign) and "X0" in reduction.derivatives:
        resistance = reduction.derivatives["X0"]
        found["resistance"] = {"X0": {"value": resistance.value, "standard_error": resistance.standard_error}}
    return found


def _budget(reduction: Reduction) -> dict[str, Any]:
    """The budget after ITTC 7.5-02-06-04: standard uncertainties (prime) and shares of the variance by source."""
    campaign = reduction.campaign
    return {
        "coverage_factor": COVERAGE_FACTOR,
        "sources": BUDGET_SOURCES,
        "not_stated": sources_not_stated(reduction),
        "blockage_speed_relative": blockage_speed(campaign.model, campaign.tank, campaign.test),
        "derivatives": {
            row.name: {
                "value": row.value,
                "combined": row.combined,
                "expanded": row.expanded,
                "parts": row.parts,
                "shares": row.shares,
            }
            for row in uncertainty_budget(reduction)
        },
    }


def _delay(reduction: Reduction) -> dict[str, Any] | None:
    """The delay of the forces behind the motion, s; None if the campaign cannot show it."""
    if reduction.delay is None:
        return None
    corrected = any(error.corrected for error in reduction.systematic)
    return {**asdict(reduction.delay), "corrected": corrected}


def _derivative(reduction: Reduction, card: Contents, name: str) -> dict[str, Any]:
    entry = card.entries[name]
    if name in card.estimated:
        found = {"value": entry.value, "standard_error": entry.standard_error}
        return found | {"origin": "estimated", "source": entry.how}
    return _measured(reduction, name, entry.value, entry.standard_error)


def _measured(reduction: Reduction, name: str, value: float, error: float) -> dict[str, Any]:
    derivative = reduction.derivatives[name]
    found: dict[str, Any] = {"value": value, "standard_error": error}
    found |= {"origin": "measured", "type_a": derivative.type_a, "type_b": derivative.type_b}
    if stepped := by_the_papers_order(reduction, name):
        found["paper_order"] = asdict(stepped)
    return found


def _methods(result: ForceResult) -> dict[str, Any]:
    solution, steps = result.solution, result.stepwise
    return {
        "regression": {
            "names": solution.names,
            "values": solution.values,
            "standard_errors": solution.standard_errors,
            "covariance": solution.covariance,
            "condition": solution.condition,
            "variance_inflation": solution.inflation,
            "held_within": result.selection.equations.prior,
        },
        "paper_order": {
            "names": steps.names,
            "values": steps.values,
            "standard_errors": steps.standard_errors,
            "found_in": steps.found_in,
        },
        "disagreements": [asdict(difference) for difference in result.disagreements],
    }


def _spread(result: ForceResult) -> dict[str, Any]:
    spread, unit = result.selection.spread, result.selection.equations.unit
    zero = float(np.sqrt(spread.zero_variance))
    return {
        "noise_factor": spread.noise,
        "zero_error_prime": zero,
        "zero_error_si": zero * unit,
        "gain_error": float(np.sqrt(spread.gain_variance)),
        "by_type": {kind: float(np.sqrt(variance)) for kind, variance in spread.by_type.items()},
    }


def _run(campaign: Campaign, run: ReducedRun) -> dict[str, Any]:
    """A run with its harmonics, prime with its own speed."""
    motion = run.motion
    scales = Scales(campaign.test.water_density_kgpm3, campaign.model.length_m, motion.mean_speed_mps)
    harmonics: dict[str, Any] = {}
    for force, fit in run.fits.items():
        unit = scales.force * (scales.length if force == "N" else 1.0)
        errors = np.sqrt(np.diag(fit.covariance))
        harmonics[force] = {
            label: {"value": value / unit, "standard_error": error / unit}
            for label, value, error in zip(run.labels, fit.coefficients, errors, strict=True)
        }
    return {
        "name": run.run.name,
        "type": run.run.type,
        "speed_mps": motion.mean_speed_mps,
        "frequency_radps": motion.frequency_radps,
        "periods": motion.periods,
        "v_amplitude_mps": motion.amplitude(motion.v_mps),
        "r_amplitude_radps": motion.amplitude(motion.r_radps),
        "v_mean_mps": float(np.mean(motion.v_mps)),
        "rudder_rad": float(np.mean(motion.delta_rad)),
        "harmonics": harmonics,
    }
