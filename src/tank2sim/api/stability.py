"""Stability, steady turning and the IMO criteria of a ship, and stability of a craft with thrusters."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.arguments import PROCESSES, EnsembleSize, Seed
from tank2sim.quantities import Speed

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.stability import CraftStabilityResult, StabilityResult


@verb(
    "course stability, steady turning, IMO criteria",
    name="stability",
    results=(
        "tank2sim.results.stability:StabilityResult",
        "tank2sim.results.stability:CraftStabilityResult",
    ),
)
def judge_stability(
    ship: Vessel,
    speed_mps: Speed | None = None,
    *,
    spirals: bool = True,
    members: EnsembleSize = 0,
    seed: Seed = 0,
    executor: str = PROCESSES,
) -> StabilityResult | CraftStabilityResult:
    """Judge straight-line stability, steady turning and the IMO criteria of a ship.

    A craft with thrusters has steady turns by the difference of its revolutions, no spirals and no IMO criteria.

    Parameters
    ----------
    ship : Vessel
    speed_mps : float, optional
        Speed on the straight course, m/s; by default the speed of the card.
    spirals : bool
        Simulate the spirals on the steady-turning diagram.
    members : int
        Ships drawn from the standard errors of the card, for the probability of meeting each criterion and bands of 5,
        50 and 95 %: 100 for a first look, 2000 for figures to report; 0 for none.
    seed : int
        Seed of the drawn ships.
    executor : str
        Where the drawn ships are simulated: ``processes`` of this machine, or a cluster, ``dask://host:port``.

    Raises
    ------
    InputError
        The ship holds no straight course.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.load("mariner").stability(spirals=False).stable
    True
    """
    from tank2sim.analysis.ensemble.questions import ShipText
    from tank2sim.analysis.ensemble.results import growth_bands, stability_bands
    from tank2sim.analysis.ensemble.steering import Grid
    from tank2sim.analysis.stability.craft import OfCraft, craft_stability
    from tank2sim.analysis.stability.study import stability_study
    from tank2sim.api.ensemble import EnsembleOptions
    from tank2sim.cards import SteeredBy
    from tank2sim.results.stability import CraftStabilityResult, StabilityResult
    from tank2sim.simulation.integrator import compiler_notices

    ensemble = EnsembleOptions(members, seed, executor)
    card = ship.steered()
    if card.steered_by is SteeredBy.THRUSTERS:
        craft = craft_stability(card, speed_mps)
        speed = craft.straight_run.speed_mps
        bands = ensemble.drawn(lambda *request: growth_bands(card, OfCraft(ShipText.of(card), speed), *request))
        return CraftStabilityResult(replace(craft, ensemble=bands), ship)
    study = stability_study(ship.model, speed_mps, spirals=spirals)
    curves = (speed_mps, Grid.of(ship.model, study.responses[0])) if members and study.responses else None
    bands = ensemble.drawn(lambda request, pool: stability_bands(card, study.imo, request, pool, curves))
    notices = tuple(dict.fromkeys([*ship.model.notices, *study.notices, *compiler_notices()]))
    return StabilityResult(replace(study, notices=notices, ensemble=bands), ship)
