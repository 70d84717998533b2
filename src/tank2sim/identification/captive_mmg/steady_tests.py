"""Steady captive tests (drift, rudder, turning, load variation) as the regression of the MMG method takes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.errors import InputError
from tank2sim.files import named_in
from tank2sim.identification.captive.harmonics import reduced_run
from tank2sim.identification.captive.run_faults import record_faults, reduced_faults
from tank2sim.notices import Notice
from tank2sim.records.averages import read_columns
from tank2sim.records.campaign_form import CampaignFile, OpenWaterSection
from tank2sim.records.campaigns import Campaign, read_campaign, read_campaign_form, together
from tank2sim.records.captive_record import FORCE_COLUMNS, CaptiveRun

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
    of_model = "give the model's"
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


CHANNELS = ("X", "Y", "N", "T", "F_N")
"""Surge and sway force (N), yaw moment (N m), thrust (N), normal force of the rudder (N, positive to port)."""
LEFT = ("T_left", "F_N_left")
"""Thrust and normal force on the left side of a ship with two propellers and rudders; T and F_N are of the right."""
TORQUE = "Q"
"""The channel of the propeller's torque (N m), which comes after the others if it was measured."""
_K_Q_OVER_K_T = (0.03, 0.3)
"""Range of K_Q over K_T at the lowest J. Project choice: the KVLCC2's is 0.10 at J = 0 (HMRI), and no usual screw is a
factor of three away; 10 K_Q is."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SteadyTests:
    """Steady conditions of one campaign and the open-water curve of its propeller."""

    path: Path  # File of the campaign
    form: CampaignFile  # What it states
    names: tuple[str, ...]  # File of each condition, and line in a table of averages
    # (conditions, 5): u, v (m/s), r (rad/s), rudder angle (rad, positive to starboard), revolutions (rad/s)
    motion: Array
    # (conditions, 5 to 7): :attr:`channels`, as a gauge on the model shows them: of the water, and of the body's own
    # inertia in turning
    readings: Array
    open_water: Array  # (points, 2 or 3): J, K_T, and K_Q if the torque was measured
    remarks: tuple[Notice, ...]  # Remarks from reading the files

    @property
    def channels(self) -> tuple[str, ...]:
        """:data:`CHANNELS`, and :data:`LEFT` of two sides, or :data:`TORQUE` if it was measured."""
        others = LEFT if self.form.propeller.number == 2 else (TORQUE,)
        return (*CHANNELS, *others)[: self.readings.shape[1]]

    @property
    def speed_mps(self) -> Array:
        """U, m/s, (conditions,)."""
        return np.hypot(self.motion[:, 0], self.motion[:, 1])

    @property
    def yaw_rate_prime(self) -> Array:
        """r L/U, (conditions,)."""
        return self.motion[:, 2] * self.form.model.length_m / self.speed_mps


def read_steady_tests(path: Path) -> SteadyTests:
    """The conditions of a campaign with thrust and normal force: rows of ``[averages]``, or means of steady runs.

    Raises InputError: A file is at fault, or the campaign lacks what the MMG method needs: thrust, normal force,
    revolutions, the open-water curve, and the sizes of model, propeller and rudder.
    """
    form = read_campaign_form(path)
    _refuse_missing(form, path)
    refuse_impossible_sizes(form, path)
    campaign = read_campaign(path)
    steady = [run for run in campaign.runs if not run.oscillates]
    if faults := [fault for run in steady for fault in islice(_faults(campaign, run), 1)]:
        raise together(faults, can_leave_out=False)
    with_torque = _have_torque(steady, path)
    _refuse_heel(steady, path)
    tests = SteadyTests(
        path=path,
        form=form,
        names=tuple(run.name for run in steady),
        motion=np.array([_motion(run) for run in steady]),
        readings=np.array([_readings(run, form) for run in steady]),
        open_water=_open_water(form, path, with_torque=with_torque),
        remarks=(*campaign.remarks, *_oscillating(campaign)),
    )
    readings = dict(zip(tests.channels, tests.readings.T, strict=True))
    thrusts = {"thrust": "T", "thrust_left": "T_left"}
    refuse_astern(
        form, path, tests.motion[:, 4], {key: readings[name] for key, name in thrusts.items() if name in readings}
    )
    return tests


def _refuse_heel(runs: Sequence[CaptiveRun], path: Path) -> None:
    if heeled := next((run.name for run in runs if run.heel_rad), ""):
        problem = f"{heeled} has a heel; the method is of an upright hull"
        raise InputError(path, "averages.columns.heel_rad", problem, "reduce such tests to a polynomial")


def _have_torque(runs: Sequence[CaptiveRun], path: Path) -> bool:
    """Whether the torque was measured; InputError if in some of the runs only."""
    without = [run.name for run in runs if run.torque_Nm is None]
    if 0 < len(without) < len(runs):
        problem = f"{without[0]} has no torque, and others have"
        raise InputError(path, "runs", problem, "record it in all runs, or in none")
    return not without


def _faults(campaign: Campaign, run: CaptiveRun) -> Iterator[InputError]:
    """Faults of a steady run; those that only its reduction shows come last."""
    if not run.is_average:
        yield from _lacking(run)
    yield from record_faults(campaign, run)
    if not run.is_average:
        yield from reduced_faults(reduced_run(run))


def _oscillating(campaign: Campaign) -> Iterator[Notice]:
    """A notice of the runs that the method does not take."""
    if names := [run.name for run in campaign.runs if run.oscillates]:
        yield Notice(f"Left out, because MMG takes steady tests: {len(names)} oscillating runs, {names[0]} first.")


def _refuse_missing(form: CampaignFile, path: Path) -> None:
    """Raise InputError for the first thing that the MMG method needs and the campaign does not state."""
    needed: dict[str, tuple[object, str]] = {}
    if form.averages is not None:
        columns = form.averages.columns
        needed |= {
            "averages.columns.thrust": (columns.thrust, "the wake follows from the thrust: name its column"),
            "averages.columns.rudder_normal_force": (
                columns.rudder_normal_force,
                "it separates the rudder from the hull: name its column",
            ),
            "test.propeller_radps": (
                columns.propeller_radps or form.test.propeller_radps,
                "give propeller_rps, or a column propeller_rps",
            ),
        }
    elif not form.runs:
        remedy = "give one row a condition in a table, with [averages.columns], or a file a condition in [[runs]]"
        raise InputError(path, "averages", "is missing: MMG takes averages of steady tests", remedy)
    needed |= {
        "open_water": (form.open_water, "give J and K_T of the propeller, or a file of them"),
        "rudder": (form.rudder, "give height_m, and aspect_ratio or f_alpha"),
        "model.beam_m": (form.model.beam_m, "the added masses are estimated from it: add it"),
        "model.draught_m": (form.model.draught_m, "add it"),
        "model.propeller_diameter_m": (form.model.propeller_diameter_m, "add it"),
        "model.rudder_area_m2": (form.model.rudder_area_m2, "add the area of the rudder"),
    }
    if form.propeller.number == 2:
        needed |= _needed_of_two(form, path)
    for place, (value, remedy) in needed.items():
        if value is None:
            raise InputError(path, place, "is missing, and the MMG method needs it", remedy)
    assert form.rudder is not None
    if (form.rudder.aspect_ratio is None) == (form.rudder.f_alpha is None):
        given = "both are given" if form.rudder.f_alpha else "neither is given"
        raise InputError(path, "rudder.f_alpha", f"and aspect_ratio: {given}", "give one of the two")


def _needed_of_two(form: CampaignFile, path: Path) -> dict[str, tuple[object, str]]:
    """Missing data of two propellers and rudders: place, content, remedy."""
    if form.averages is None:
        raise InputError(path, "propeller.number", "is 2, and there are [[runs]]", "give their means in [averages]")
    columns = form.averages.columns
    if columns.torque is not None:
        remedy = "leave the column out"
        raise InputError(path, "averages.columns.torque", "is of one of two propellers", remedy)
    return {
        "propeller.y_P": (form.propeller.y_P, "give the place of the right propeller over L"),
        "rudder.y_R": (form.rudder and form.rudder.y_R, "give the place of the right rudder over L"),
        "averages.columns.thrust_left": (columns.thrust_left, "thrust is for the right propeller: name both columns"),
        "averages.columns.rudder_normal_force_left": (
            columns.rudder_normal_force_left,
            "rudder_normal_force is for the right rudder: name both columns",
        ),
    }


def _lacking(run: CaptiveRun) -> Iterator[InputError]:
    """Data that a steady run lacks for the MMG method."""
    remedy = "record it, or name its column in [columns]"
    needed = {"thrust_N": run.thrust_N, "rudder_normal_force_N": run.rudder_normal_force_N}
    for column, values in needed.items():
        if values is None:
            yield InputError(run.name, "header", f"there is no column {column}, which the MMG method needs", remedy)
    if not run.propeller_radps:
        remedy = "give a column propeller_rps, or propeller_rps of the run or [test]"
        yield InputError(run.name, "header", "there are no revolutions, which the MMG method needs", remedy)


def _motion(run: CaptiveRun) -> tuple[float, ...]:
    """u, v (m/s), r (rad/s), rudder (rad), revolutions (rad/s) of a steady run."""
    assert run.propeller_radps is not None
    speed, drift = float(np.mean(run.speed_mps)), run.sheet.drift_rad
    if not run.is_average or drift is None:
        drift = float(-np.arcsin(np.clip(np.mean(run.v_mps) / speed, -1.0, 1.0)))
    u, v = speed * np.cos(drift), -speed * np.sin(drift)
    return u, v, float(np.mean(run.r_radps)), float(np.mean(run.delta_rad)), run.propeller_radps


def _readings(run: CaptiveRun, form: CampaignFile) -> tuple[float, ...]:
    """Means as the force of the model on its gauge, positive as the water pushes it."""
    forces = np.array([np.mean(run.force(force)) for force in FORCE_COLUMNS])
    if form.test.force_convention == "hydrodynamic":
        u, v, r, _, _ = _motion(run)
        forces += inertial_forces(form.model.mass_kg, form.model.x_G_m, u, v, r)
    others = [run.thrust_N, run.rudder_normal_force_N]
    if form.propeller.number == 2:
        others += [run.thrust_left_N, run.rudder_normal_force_left_N]
    others.append(run.torque_Nm)
    return *map(float, forces), *(float(np.mean(values)) for values in others if values is not None)


def _curves(
    section: OpenWaterSection, path: Path, given: Mapping[str, str | list[float]]
) -> Mapping[str, Sequence[float]]:
    """Points of the open-water curves: the lists given, or the columns of the file with the headings given."""
    headings = {key: heading for key, heading in given.items() if isinstance(heading, str)}
    lists = {key: points for key, points in given.items() if not isinstance(points, str)}
    if section.file is None:
        if headings:
            raise InputError(path, f"open_water.{next(iter(headings))}", "is missing", "give lists, or a file of them")
        return lists
    if lists:
        raise InputError(
            path, f"open_water.{next(iter(lists))}", "is a list, and a file is given", "give one of the two"
        )
    with named_in(path, path.parent / section.file):
        return read_columns(path.parent / section.file, headings)


def _open_water(form: CampaignFile, path: Path, *, with_torque: bool) -> Array:
    section = form.open_water
    assert section is not None
    given = {"J": section.J, "K_T": section.K_T}
    if with_torque:
        if section.K_Q is None:
            remedy = "give K_Q of the open-water test, or leave the torque out"
            raise InputError(path, "open_water.K_Q", "is missing, and the torque was measured", remedy)
        given["K_Q"] = section.K_Q
    values = _curves(section, path, given)
    for key, points in values.items():
        if len(points) != len(values["J"]):
            problem = f"has {len(points)} values and J {len(values['J'])}"
            raise InputError(path, f"open_water.{key}", problem, f"give a {key} for each J")
    if len(set(values["J"])) < 4:
        remedy = "a quadratic and its error need four"
        raise InputError(path, "open_water.J", "has less than four different values", remedy)
    table = np.column_stack([values[key] for key in given])
    refuse_other_curve(table, path)
    if with_torque:
        table[:, 2] *= section.K_Q_factor
        first = int(np.argmin(np.abs(table[:, 0])))
        low, high = _K_Q_OVER_K_T
        if not low * table[first, 1] < table[first, 2] < high * table[first, 1]:
            problem = f"is {table[first, 2]:.3g} next to K_T = {table[first, 1]:.3g} at J = {table[first, 0]:.3g}"
            raise InputError(path, "open_water.K_Q", problem, "if the column is 10 K_Q, give K_Q_factor = 0.1")
    return table
