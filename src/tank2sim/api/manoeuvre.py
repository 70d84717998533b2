"""Simulated manoeuvres of a ship, with bands over an ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, named_numbers, verb
from tank2sim.arguments import PROCESSES, EnsembleSize, Seed
from tank2sim.errors import ArgumentError
from tank2sim.files import TABLE
from tank2sim.quantities import Duration

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.manoeuvre import ManoeuvreResult
    from tank2sim.simulation.manoeuvres import Manoeuvre


@verb(
    "a manoeuvre: turn, zigzag, pull-out, spiral, stop, orders of a file",
    Output("-o", TABLE, "Write the motion as a trial.", lambda result, path: {path: result.to_csv()}, "RUN.csv"),
    options={"manoeuvre": "--manoeuvre"},
    texts={"external": named_numbers("external", "Y=20000 x=-15")},
    name="simulate",
    results=("tank2sim.results.manoeuvre:ManoeuvreResult",),
)
def simulate_manoeuvre(
    ship: Vessel,
    manoeuvre: str | Manoeuvre,
    *,
    duration_s: Duration | None = None,
    external: Mapping[str, float] | None = None,
    members: EnsembleSize = 0,
    seed: Seed = 0,
    executor: str = PROCESSES,
) -> ManoeuvreResult:
    """Simulate a manoeuvre of a ship, executed at t = 0, and its figures.

    Parameters
    ----------
    ship : Vessel
    manoeuvre : str or Manoeuvre
        turn:35, turn:-35, zigzag:20/20, zigzag:-10/10, pullout:20, spiral, spiral:20, stop, stop:-60 or
        file:orders.csv; for a craft with thrusters straight:600, difference:200, difference:-200, spin:400, stop,
        stop:-600 or file:orders.csv. Angles in deg, positive to starboard; revolutions in rpm.
    duration_s : float, optional
        Length of the run, s; by default as long as the manoeuvre needs.
    external : mapping, optional
        Constant force from outside: X and Y (N, positive forward and to starboard) at x and y (m, forward of midships
        and to starboard), with an additional moment N (N m, positive to starboard): ``{"Y": 20000, "x": -15}``, on the
        command line ``Y=20000 x=-15``.
    members : int
        Ships drawn from the standard errors of the card, for bands of 5, 50 and 95 %: 100 for a first look, 2000 for
        figures to report; 0 for none.
    seed : int
        Seed of the drawn ships.
    executor : str
        Where the drawn ships are simulated: ``processes`` of this machine, or a cluster, ``dask://host:port``.

    Raises
    ------
    InputError
        The text is not a manoeuvre, the ship has no rudder or thrusters, the motion leaves all bounds, or `external`
        has an unknown key or comes with an ensemble.

    Notes
    -----
    `manoeuvre` may also be an object of :mod:`tank2sim.simulation.manoeuvres`, whose angles are in radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> run = t2s.load("mariner").simulate("turn:35")
    >>> round(run.figures["advance_lengths"], 1)
    3.5
    """
    from tank2sim.analysis.ensemble.results import manoeuvre_bands
    from tank2sim.analysis.manoeuvre import study_manoeuvre
    from tank2sim.api.ensemble import FEW, FEW_IN_LANES, EnsembleOptions
    from tank2sim.dynamics.simulator_interface import external_inputs, with_external_forces
    from tank2sim.results.manoeuvre import ManoeuvreResult
    from tank2sim.simulation.lane_figures import runs_in_lanes
    from tank2sim.simulation.manoeuvres import PullOut, parse_manoeuvre
    from tank2sim.simulation.run import simulate

    if isinstance(manoeuvre, str):
        words, parsed = manoeuvre, parse_manoeuvre(manoeuvre)
    elif hasattr(manoeuvre, "words"):
        words, parsed = manoeuvre.words, manoeuvre
    else:
        raise ArgumentError("manoeuvre", "", f"is of the type {type(manoeuvre).__name__}", "give a text, as 'turn:35'")
    ensemble = EnsembleOptions(members, seed, executor)
    if external and members:
        raise ArgumentError("external", "", "cannot act on an ensemble", "leave out either the members or the force")
    inputs = external_inputs(external or {}, rolls="force.K" in ship.model)
    model = with_external_forces(ship.model) if inputs else ship.model
    run = simulate(model, parsed, duration_s=duration_s, inputs=inputs)
    other = None
    if isinstance(parsed, PullOut):
        other = simulate(model, PullOut(-parsed.rudder), duration_s=duration_s, inputs=inputs)
    study = study_manoeuvre(ship.model, words, run, getattr(ship.card, "ship", None), other)
    length = duration_s, float(run.trajectory.t[-1])
    few = FEW_IN_LANES if runs_in_lanes(parsed, duration_s) else FEW
    bands = ensemble.drawn(lambda *request: manoeuvre_bands(ship.steered(), parsed, length, *request), few)
    return ManoeuvreResult(replace(study, ensemble=bands), run, ship)
