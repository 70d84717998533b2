"""Stability, steady turning and the IMO criteria of a ship, and stability of a craft with thrusters."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tank2sim.analysis.ensemble.results import EnsembleRequest, stability_bands
from tank2sim.analysis.ensemble.steering import Grid
from tank2sim.analysis.stability.craft import craft_stability
from tank2sim.analysis.stability.study import stability_study
from tank2sim.api.ensemble import EnsembleOptions
from tank2sim.cards import CraftCard
from tank2sim.native.compiler import find_compiler
from tank2sim.results.craft_stability import CraftStabilityResult
from tank2sim.results.stability import StabilityResult
from tank2sim.simulation.integrator import NO_COMPILER

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel


def judge_stability(
    ship: Vessel, speed_mps: float | None, *, spirals: bool, ensemble: EnsembleOptions
) -> StabilityResult:
    """Stability of a ship, with an ensemble if it has members. Raises as :meth:`.Ship.stability`."""
    study = stability_study(ship.model, speed_mps, spirals=spirals)
    compiler = () if find_compiler() else (NO_COMPILER,)
    study = replace(study, notices=tuple(dict.fromkeys([*ship.model.notices, *study.notices, *compiler])))
    if ensemble.members:
        curves = (speed_mps, Grid.of(ship.model, study.responses[0])) if study.responses else None
        request = EnsembleRequest(ensemble.members, ensemble.seed)
        with ensemble.computing() as executor:
            bands = stability_bands(ship.manoeuvring(), study.imo, request, executor, curves)
        study = replace(study, ensemble=bands)
    return StabilityResult(study, ship)


def judge_craft_stability(ship: Vessel, speed_mps: float | None) -> CraftStabilityResult:
    """Stability of a craft. Raises as :meth:`.Ship.stability`."""
    assert isinstance(ship.card, CraftCard)
    return CraftStabilityResult(craft_stability(ship.card, speed_mps), ship)
