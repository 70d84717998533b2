"""Steady glides, paths and ranges of an underwater glider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.errors import ArgumentError
from tank2sim.quantities import Area, Mass, SlantAngle, WaterDepth

if TYPE_CHECKING:
    from tank2sim.apps.rigs.glider.path import GlideProgramme
    from tank2sim.apps.rigs.glider.result import GlideResult
    from tank2sim.dynamics.vessel import Vessel

BUNDLED_GLIDER = "kulikovsky-velikanov"
"""Name of the bundled glider."""


@verb(
    "an underwater glider: glides, paths, range",
    default_ship=BUNDLED_GLIDER,
    options={"angles_deg": "--angles"},
    results=("tank2sim.apps.rigs.glider.result:GlideResult",),
)
def glide(
    ship: Vessel,
    angles_deg: SlantAngle | Sequence[SlantAngle] = (),
    *,
    roll_deg: SlantAngle = 0.0,
    buoyancy_kg: Mass | None = None,
    reference_area_m2: Area | None = None,
    programme: GlideProgramme | str | Path | None = None,
    as_printed: bool = False,
    budget_kg: Mass | None = None,
    depth_m: WaterDepth | None = None,
    views: bool = True,
) -> GlideResult:
    """Fly an underwater glider: steady glides, the path of a programme, the best glides and their range.

    The transient model flies the programme, too, and shows how far it ends from the path of steady glides.

    Parameters
    ----------
    ship : Vessel
        An underwater glider.
    angles_deg : float or sequence of float
        Path angles of steady glides, deg, + to climb, - to dive.
    roll_deg : float
        Roll of these glides, deg, + starboard side down.
    buoyancy_kg : float, optional
        Size of the net buoyancy of these glides, kg; by default as on the card.
    reference_area_m2 : float, optional
        Reference area of the coefficients, m2, in place of the card's.
    programme : path or GlideProgramme, optional
        Programme to fly: a CSV with the columns duration_s, path_angle_deg or pitch_deg, roll_deg, buoyancy_kg.
    as_printed : bool
        Also solve the equations of Kulikovsky & Velikanov as they are printed.
    budget_kg : float, optional
        Ballast that the pump can expel in all, kg, for the range; needs a depth.
    depth_m : float, optional
        Depth of the dives for the range, m; needs a budget.
    views : bool
        Also compare steady glides with the transient model, for programmes of different speed.

    Raises
    ------
    InputError
        The card is not one of a glider, an angle or a step cannot be flown, the programme is at fault, or roll or
        buoyancy is given without the angles that it belongs to.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("kulikovsky-velikanov").glide([-25, -30], views=False)
    >>> found.glides["speed_mps"].round(2).tolist()
    [0.2, 0.24]
    """
    import numpy as np

    from tank2sim.apps.rigs.glider.card import GliderCard
    from tank2sim.apps.rigs.glider.path import read_programme
    from tank2sim.apps.rigs.glider.result import GlideResult
    from tank2sim.apps.rigs.glider.study import GlideQuestion, study_glider

    card = ship.card
    if not isinstance(card, GliderCard):
        remedy = f"a card of kind glider is needed, such as {BUNDLED_GLIDER}"
        raise card.fault("model.kind", f"is {card.model.kind}", remedy)
    if reference_area_m2 is not None:
        card = ship.replace({"glider.reference_area_m2": reference_area_m2}).card
        assert isinstance(card, GliderCard)
    used_by = {"roll_deg": bool(roll_deg), "buoyancy_kg": buoyancy_kg is not None}
    used_by["as_printed"] = as_printed and programme is None
    angles = np.atleast_1d(np.asarray(angles_deg, dtype=float))
    for argument in filter(used_by.get, used_by if not angles.size else ()):
        raise ArgumentError(argument, "", "is of steady glides", "give their path angles as well (angles_deg=30)")
    question = GlideQuestion(
        angles_rad=tuple(np.radians(angles).tolist()),
        roll_rad=math.radians(roll_deg),
        buoyancy_kg=buoyancy_kg,
        programme=read_programme(programme) if isinstance(programme, str | Path) else programme,
        as_printed=as_printed,
        budget_kg=budget_kg,
        depth_m=depth_m,
        views=views,
    )
    return GlideResult(study_glider(card, question))
