"""Motions and mean drift forces of a hull in regular waves, computed from its mesh by the extra ``tank2sim[waves]``.

Capytaine (Ancellin and Dias 2019, Capytaine: a Python-based linear potential flow solver, Journal of Open Source
Software 4, 1341) solves diffraction and radiation at rest in deep water; its mean drift is computed in the far field,
after Maruo (1960) and Newman (1967).
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import parse_card
from tank2sim.cards.wave_table import DRIFT_COLUMNS, MIRRORED, WAVE_MOTIONS, motion_columns, wave_table
from tank2sim.dynamics.effects.effect import card_particular
from tank2sim.errors import InputError
from tank2sim.files import refuse_missing

DIRECTIONS_DEG = tuple(float(angle) for angle in range(0, 181, 15))
"""Directions of a table, deg: drift forces and motions change little within 15 deg. Project choice."""

FREQUENCIES, LONGEST, SHORTEST = 24, 12.0, 0.125
"""Frequencies of a table, from waves of 12 L to L/8 or as short as the mesh can show: project choice."""

ROLL_GYRADIUS, ROLL_DAMPING = 0.375, 0.05
"""Radius of gyration in roll over the beam, and damping of roll by friction and eddies over the critical one, in
addition to that by waves, where they are not stated: project choices."""

_THETA = 361  # directions of the far field, 1 deg: of the waves that a hull of 8 wave lengths sends out
_BEYOND = 0.2  # the solver interpolates in them, and asks for more than the full circle, rad

# From the solver's axes (x forward, y to port, z up, motion over that of exp(-i w t)) to the ship's: x alike, y and z
# of the other sign, the rotations about them too.
_SOLVER_AXES = {"surge": 1.0, "sway": -1.0, "heave": -1.0, "roll": 1.0, "pitch": -1.0, "yaw": -1.0}
_SOLVER_FORCES = {"X": ("drift_force_surge", 1.0), "Y": ("drift_force_sway", -1.0), "N": ("drift_force_yaw", -1.0)}


@dataclass(frozen=True)
class HullInWaves:
    """What the mesh does not show of a hull, and what is to be computed."""

    metacentric_height_m: float  # GM, m
    # `roll_gyradius_m`, `pitch_gyradius_m`: Radii of gyration about the centre of gravity, m; the yaw radius is taken
    # as the pitch radius.
    roll_gyradius_m: float
    pitch_gyradius_m: float
    roll_damping: float = ROLL_DAMPING  # Damping of roll over the critical one, in addition to that by waves
    frequencies_radps: Sequence[float] | None = None  # Rising; by default :data:`FREQUENCIES` of them
    # From 0 to 180 in equal steps, the direction from which the waves come, clockwise from the bow.
    directions_deg: Sequence[float] = DIRECTIONS_DEG


def hull_of(card: ManoeuvringCard, given: Mapping[str, Any]) -> HullInWaves:
    """What a card knows of a hull, with what is `given` in its place (names of :class:`HullInWaves`).

    Raises InputError: metacentric height or beam is neither given nor on the card, or the height is not above zero.
    """
    height = given.get("metacentric_height_m", card.ship.metacentric_height_m)
    if height is None or height <= 0:
        problem = "is missing" if height is None else f"is {height:g}: the ship has no stable upright position"
        raise card.fault("ship.metacentric_height_m", problem, "the motions in waves need it, above zero")
    own: dict[str, Any] = {"metacentric_height_m": height}
    if "roll_gyradius_m" not in given:
        own["roll_gyradius_m"] = ROLL_GYRADIUS * card_particular(
            card, "beam_m", "the radius of gyration in roll needs it"
        )
    body = card.rigid_body
    about_gravity = body.yaw_inertia / body.mass - body.x_G**2
    own["pitch_gyradius_m"] = card.ship.length_m * float(np.sqrt(max(about_gravity, 0.0)))
    return HullInWaves(**{**own, **given})


def read_hull(path: str | Path) -> Any:
    """The wetted part of a hull as a body of the solver, with its lid.

    `path`: mesh in m (``gdf``, ``hst``, ``pnl``, ``mar``, ``stl``, ``obj``, ``vtk``): x forward of midships, y to port,
    z above the waterline. Raises InputError: the library is not installed, or the file is missing, broken, or no closed
    hull about the origin.
    """
    try:
        solver = importlib.import_module("capytaine")
    except ImportError:
        remedy = "install it with: pip install 'tank2sim[waves]'"
        raise InputError(path, "", "needs the library capytaine, which is not installed", remedy) from None
    refuse_missing(Path(path))
    try:
        mesh = solver.load_mesh(str(path)).immersed_part()
        body = solver.FloatingBody(
            mesh=mesh, dofs=solver.rigid_body_dofs(rotation_center=(0, 0, 0)), lid_mesh=mesh.generate_lid()
        )
        volume = float(body.volume)
    except Exception as error:  # the solver and its readers of meshes have errors of their own
        problem = f"cannot be read as a mesh ({' '.join(str(error).split())})"
        raise InputError(path, "", problem, "give a closed hull in m, the waterline at z = 0") from None
    if not volume > 0:
        problem = f"has a volume of {volume:.4g} m3 below z = 0"
        raise InputError(path, "", problem, "its normals must point into the water, and the waterline be at z = 0")
    return body


def wave_rows(body: Any, hull: HullInWaves, density: float, gravity: float, length: float) -> tuple[list[str], Array]:
    """Columns and rows of ``[waves]`` (:mod:`tank2sim.cards.wave_table`) of a hull.

    `body`: as :func:`read_hull` returns it; `density`, `gravity`, `length`: density of the water, kg/m^3; gravity,
    m/s^2; L, m, for the default frequencies.
    """
    solver, rao = (importlib.import_module(f"capytaine{part}") for part in ("", ".post_pro.rao"))
    drift = importlib.import_module("capytaine.post_pro.mean_drift_force")
    array = importlib.import_module("xarray")
    mass = density * float(body.volume)
    buoyancy = np.asarray(body.center_of_buoyancy, dtype=float)
    height = buoyancy[2] + float(body.transversal_metacentric_radius) - hull.metacentric_height_m
    body.center_of_mass = np.array([buoyancy[0], 0.0, height])
    body.mass = mass
    frequencies = _frequencies(body, hull, gravity, length)
    directions = np.asarray(hull.directions_deg, dtype=float)
    towards = np.radians(180.0 - directions)  # where the waves run to, counter-clockwise from the bow
    asked = array.Dataset(
        coords={
            "omega": frequencies,
            "wave_direction": towards,
            "radiating_dof": list(body.dofs),
            "theta": np.linspace(-_BEYOND, 2 * np.pi + _BEYOND, _THETA),
            "rho": density,
            "g": gravity,
            "water_depth": np.inf,
        }
    )
    found = solver.BEMSolver(method="indirect").fill_dataset(asked, body, hydrostatics=False, progress_bar=False)
    inertia = _inertia(mass, np.array([buoyancy[0], 0.0, height]), hull)
    names = list(body.dofs)
    stiffness = body.compute_hydrostatic_stiffness(rho=density, g=gravity)
    found["inertia_matrix"] = (("influenced_dof", "radiating_dof"), inertia)
    found["hydrostatic_stiffness"] = stiffness
    roll = names.index("Roll")
    added = float(found.added_mass.sel(influenced_dof="Roll", radiating_dof="Roll").mean())
    critical = 2 * np.sqrt((inertia[roll, roll] + added) * float(stiffness.values[roll, roll]))
    damping = np.zeros((6, 6))
    damping[roll, roll] = hull.roll_damping * critical
    dissipation = array.DataArray(
        damping, dims=("influenced_dof", "radiating_dof"), coords={"influenced_dof": names, "radiating_dof": names}
    )
    answer = rao.rao(found, dissipation=dissipation)
    forces = drift.far_field_mean_drift_force(answer, found)
    order = np.argsort(np.argsort(towards))  # the solver returns its directions rising
    mirrors = np.sin(towards) > 1e-6  # of a hull alike to both sides, which its panels may not quite be
    grid = np.meshgrid(frequencies, directions, indexing="ij")
    columns, values = ["frequency_radps", "direction_deg"], list(grid)
    for motion in WAVE_MOTIONS:
        amplitude = _SOLVER_AXES[motion] * answer.sel(radiating_dof=motion.capitalize()).values.conj()[:, order]
        amplitude = amplitude * (mirrors if motion in MIRRORED else 1.0)
        columns += motion_columns(motion)
        values += [np.abs(amplitude), np.degrees(np.angle(amplitude))]
    for force, (name, sign) in _SOLVER_FORCES.items():
        columns.append(DRIFT_COLUMNS[force])
        mean = sign * forces[name].values[:, order, order].real
        values.append(mean * (mirrors if force in MIRRORED else 1.0))
    return columns, np.stack([column.ravel() for column in values], axis=1)


def _frequencies(body: Any, hull: HullInWaves, gravity: float, length: float) -> Array:
    if hull.frequencies_radps is not None:
        return np.asarray(hull.frequencies_radps, dtype=float)
    shortest = max(float(body.minimal_computable_wavelength), SHORTEST * length)
    lowest, highest = (np.sqrt(2 * np.pi * gravity / wave) for wave in (LONGEST * length, shortest))
    return np.geomspace(lowest, highest, FREQUENCIES)


def _inertia(mass: float, centre: Array, hull: HullInWaves) -> Array:
    """Mass matrix (6, 6) about the origin, in the axes of the solver."""
    x, y, z = centre
    arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    own = np.diag([hull.roll_gyradius_m**2, hull.pitch_gyradius_m**2, hull.pitch_gyradius_m**2])
    return mass * np.block([[np.eye(3), -arm], [arm, own - arm @ arm]])


def _check_grid(hull: HullInWaves, path: str | Path) -> None:
    """Raise InputError if what is asked for is not a table that a card may have."""
    frequencies = (1.0, 2.0) if hull.frequencies_radps is None else hull.frequencies_radps
    rows = [(frequency, direction, 0.0) for frequency in frequencies for direction in hull.directions_deg]
    try:
        wave_table(["frequency_radps", "direction_deg", DRIFT_COLUMNS["X"]], rows)
    except ValueError as error:
        raise InputError(path, "", str(error), "give other frequencies_radps or directions_deg") from None


_DIGITS = 5
"""Significant digits of the numbers on a card: far beyond what a mesh of panels resolves. Project choice."""


def card_in_waves(card: ManoeuvringCard, path: str | Path, hull: HullInWaves) -> ManoeuvringCard:
    """The card with the table ``[waves]`` of the hull with the mesh at `path`, in place of one that it has.

    Raises InputError: as :func:`read_hull`; or the mesh is not of a hull of the card's length.
    """
    body = read_hull(path)
    ends = body.mesh.vertices[:, 0]
    length = float(np.ptp(ends))
    if not 0.8 < length / card.ship.length_m < 1.25:
        problem = f"is {length:.4g} m long, and the ship {card.ship.length_m:.4g} m"
        raise InputError(path, "", problem, "give the mesh in m, at the size of the ship")
    _check_grid(hull, path)
    columns, rows = wave_rows(
        body, hull, card.environment.water_density_kgpm3, card.environment.gravity_mps2, card.ship.length_m
    )
    return parse_card(with_waves_section(card.text, f"Capytaine, {Path(path).name}", columns, rows), card.source)  # type: ignore[return-value]


def with_waves_section(text: str, source: str, columns: Sequence[str], rows: Array) -> str:
    """The text of a card with ``[waves]`` at its end.

    `text`: text of the card; a table that it has is replaced; `source`: where the numbers come from; `rows`:
    (n, len(columns)).
    """
    document = tomlkit.parse(text)
    document.pop("waves", None)
    lines = [", ".join(f"{value:.{_DIGITS}g}" for value in row) for row in rows]
    names = ", ".join(f'"{name}"' for name in columns)
    table = "".join(f"  [{line}],\n" for line in lines)
    quoted = tomlkit.string(source).as_string()
    return (
        f"{tomlkit.dumps(document).rstrip()}\n\n[waves]\nsource = {quoted}\ncolumns = [{names}]\nrows = [\n{table}]\n"
    )
