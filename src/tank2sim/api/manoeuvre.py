"""Simulated manoeuvres of a ship, with bands over an ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from tank2sim.analysis.manoeuvre import study_manoeuvre
from tank2sim.api.ensemble import FEW, FEW_IN_LANES, EnsembleOptions
from tank2sim.dynamics.simulator_interface import external_inputs, with_external_forces
from tank2sim.errors import InputError
from tank2sim.results.manoeuvre import ManoeuvreResult
from tank2sim.simulation.manoeuvres import Manoeuvre, PullOut
from tank2sim.simulation.run import simulate

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel


def simulate_manoeuvre(
    ship: Vessel,
    manoeuvre: Manoeuvre,
    words: str,
    duration_s: float | None,
    ensemble: EnsembleOptions,
    external: Mapping[str, float] | None = None,
) -> ManoeuvreResult:
    """Simulate a manoeuvre of a ship, called by its `words`, with an ensemble if it has members.

    Parameters
    ----------
    ship, manoeuvre, words
        What is simulated, and what it is called.
    duration_s : float or None
        None: as long as the manoeuvre needs.
    ensemble : EnsembleOptions
        Size, seed and computer of the ensemble.
    external : mapping, optional
        As in :meth:`.Ship.simulate`.

    Raises
    ------
    InputError
        As :meth:`.Ship.simulate`.
    """
    if external and ensemble.members:
        raise InputError("external", "", "cannot act on an ensemble", "leave out either the members or the force")
    inputs = external_inputs(external or {}, rolls="force.K" in ship.model)
    model = with_external_forces(ship.model) if inputs else ship.model
    run = simulate(model, manoeuvre, duration_s=duration_s, inputs=inputs)
    other = None
    if isinstance(manoeuvre, PullOut):
        other = simulate(model, PullOut(-manoeuvre.rudder), duration_s=duration_s, inputs=inputs)
    particulars = getattr(ship.card, "ship", None)
    study = study_manoeuvre(ship.model, words, run, particulars, other)
    if ensemble.members:
        from tank2sim.analysis.ensemble.results import EnsembleRequest, manoeuvre_bands
        from tank2sim.simulation.lane_figures import runs_in_lanes

        length = duration_s, float(run.trajectory.t[-1])
        request = EnsembleRequest(ensemble.members, ensemble.seed)
        with ensemble.computing(FEW_IN_LANES if runs_in_lanes(manoeuvre, duration_s) else FEW) as executor:
            bands = manoeuvre_bands(ship.manoeuvring(), manoeuvre, length, request, executor)
        study = replace(study, ensemble=bands)
    return ManoeuvreResult(study, run, ship)
