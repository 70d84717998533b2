"""Steady tests that cannot be those of a ship: impossible sizes, and signs and units that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.campaign_form import CampaignFile

_RUDDER_AREA = (0.002, 0.1)
"""Range of the area of one rudder over L d. Project choice: ships have 0.01 to 0.04 (the KVLCC2 0.017), one of two
half of it; an area of the ship next to the length of its model is hundreds of times too large."""
_RUDDER_HEIGHT = 1.5
"""Largest height of a rudder over the draught. Project choice: it ends at the keel, and a part may be out of the
water."""
_DIAMETER = (0.1, 1.5)
"""Range of D_P over the draught. Project choice: merchant ships have 0.4 to 0.8, a fast hull of little draught 1."""
_AT_STERN = (-0.65, -0.25)
"""Range of the place of propeller and rudder over L. Project choice: both are about the after perpendicular, -0.5; the
method is of a propeller in the wake of the hull and a rudder in its race."""
_K_T_AT_REST = (0.05, 1.2)
"""Range of K_T at J = 0. Project choice: from Wageningen B screws of a pitch ratio of 0.5 to 1.4, 0.2 to 0.65, a
factor of two and more away."""


def refuse_impossible_sizes(form: CampaignFile, path: Path) -> None:
    """Raise InputError for the first size or place of propeller or rudder that no ship has."""
    for key, problem, remedy in _impossible_sizes(form):
        raise InputError(path, key, problem, remedy)


def _impossible_sizes(form: CampaignFile) -> Iterator[tuple[str, str, str]]:
    model, rudder, propeller = form.model, form.rudder, form.propeller
    assert rudder is not None and model.draught_m and model.rudder_area_m2 and model.propeller_diameter_m
    draught = model.draught_m
    of_model = "give that of the model"
    share = model.rudder_area_m2 / (model.length_m * draught)
    if not _RUDDER_AREA[0] <= share <= _RUDDER_AREA[1]:
        problem = f"is {share:.2g} times length_m times draught_m; ships have 0.01 to 0.04"
        yield "model.rudder_area_m2", problem, of_model
    if rudder.height_m > _RUDDER_HEIGHT * draught:
        yield "rudder.height_m", f"is {rudder.height_m / draught:.2g} times draught_m", of_model
    share = model.propeller_diameter_m / draught
    if not _DIAMETER[0] <= share <= _DIAMETER[1]:
        yield "model.propeller_diameter_m", f"is {share:.2g} times draught_m; ships have 0.4 to 0.8", of_model
    for key, place in (("propeller.x_P", propeller.x_P), ("rudder.x_R", rudder.x_R)):
        if not _AT_STERN[0] <= place <= _AT_STERN[1]:
            where = "forward" if place > 0 else "abaft"
            problem = f"is {abs(place):.3g} L {where} of midships" if place else "is at midships"
            remedy = "over L, positive forward of midships: at the stern it is about -0.5"
            yield key, problem, remedy


def refuse_other_curve(points: Array, path: Path) -> None:
    """Raise InputError for open-water points that are not K_T of a propeller.

    `points` (points, 2 or more): J, K_T; `path`: File of the campaign, for the message.
    """
    J, K_T = points[:, :2].T
    remedy = "name the column of K_T = T/(rho n² D⁴), positive ahead"
    first, last = int(np.argmin(J)), int(np.argmax(J))
    if not K_T[first] > K_T[last]:
        problem = (
            f"is {K_T[first]:.3g} at J = {J[first]:.3g} and {K_T[last]:.3g} at J = {J[last]:.3g}; K_T falls with J"
        )
        raise InputError(path, "open_water.K_T", problem, remedy)
    at_rest = float(np.polyfit(J, K_T, 2)[-1])
    if not _K_T_AT_REST[0] <= at_rest <= _K_T_AT_REST[1]:
        problem = f"is {at_rest:.3g} at J = 0; propellers have 0.2 to 0.65"
        raise InputError(path, "open_water.K_T", problem, remedy)


def refuse_astern(form: CampaignFile, path: Path, revolutions: Array, thrusts: dict[str, Array]) -> None:
    """Raise InputError if the propeller turns, or pushes, astern in most conditions.

    `path`: File of the campaign, for the message; `revolutions` (conditions,): rad/s; `thrusts`: ``thrust``, and
    ``thrust_left`` of two, to its values, N, (conditions,).
    """
    for key, values in {"propeller": revolutions, **thrusts}.items():
        if not np.median(values) > 0:
            what = "the propeller turns" if key == "propeller" else "the propeller pushes"
            remedy = "both are positive ahead: change the sign of the column"
            raise InputError(path, place_of_column(form, key), f"{what} astern in most conditions", remedy)


def place_of_column(form: CampaignFile, key: str) -> str:
    """Where a campaign names a column: its key in ``[averages.columns]``, without a unit, and heading, or ``runs``."""
    if form.averages is None:
        return f"runs, column {key}"
    given = form.averages.columns.model_dump(exclude_none=True)
    headings = [heading for name, heading in given.items() if name == key or name.startswith(f"{key}_r")]
    headings += [given["yaw_rate_prime"]] if key == "yaw_rate" and "yaw_rate_prime" in given else []
    return f"averages.columns.{key}" + "".join(f" (column {heading})" for heading in headings)
