"""Interface of a ship in a simulator: inputs for external forces, and outputs for displays."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import casadi as ca

from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.surroundings import relative_air
from tank2sim.dynamics.model import Input, Model, Quantity
from tank2sim.errors import ArgumentError

_FORCES = (("X", "N", "Surge force"), ("Y", "N", "Sway force"), ("N", "N.m", "Yaw moment"))

_SIDES = {"X": "forward", "Y": "to starboard", "N": "to starboard"}

# x and X would be one variable where names do not know case, as in Unreal Engine.
EXTERNAL_INPUTS = tuple(f"external.{name}" for name in ("X", "Y", "N", "point_x", "point_y"))
"""Inputs of :func:`with_external_forces`."""

EXTERNAL_INPUTS_OF_ROLL = ("external.K", "external.point_z")
"""Further inputs of a ship that rolls."""


def force_shares(before: Model, after: Model, name: str) -> tuple[Quantity, ...]:
    """Quantities ``<name>.X``, ``.Y``, ``.N`` of what `after` has more than `before` in ``force.*``: N, N and N m.

    None for a force that is the same in both.
    """
    shares = []
    for letter, unit, description in _FORCES:
        old, new = (model[f"force.{letter}"] for model in (before, after))
        assert isinstance(old, Quantity) and isinstance(new, Quantity)
        if ca.is_equal(old.value, new.value, 1) or f"{name}.{letter}" in after:
            continue
        shares.append(
            Quantity(
                f"{name}.{letter}",
                unit,
                f"{description} by {name}, positive {_SIDES[letter]}",
                new.value - old.value,
                nominal=old.nominal,
            )
        )
    return tuple(shares)


def with_simulator_interface(model: Model) -> Model:
    """The model with the inputs of :func:`.with_external_forces` and the outputs that displays and hosts ask for.

    ``motion.heading`` (rad, 0 to 2 pi, clockwise from north), ``wind.relative_speed`` and ``wind.relative_direction``
    (from, clockwise from the bow, 0 to 2 pi) of a ship with a wind, and forces by origin, ``rudder.X``, ``rudder.Y``,
    ``rudder.N``, those of propellers of an MMG ship and of each effect that adds a force (``wind.Y``). A model that is
    not of a ship is returned as it is.
    """
    if not all(f"force.{name}" in model for name in "XYN") or "motion.psi" not in model:
        return model
    model = with_external_forces(model)
    added = tuple(quantity for quantity in _displays(model) if quantity.name not in model)
    parts = [one.name for one in model.quantities if _is_part_of_force(one) and one.name not in model.outputs]
    return model.extend(*added, outputs=[*(quantity.name for quantity in added), *parts])


def _is_part_of_force(quantity: Quantity) -> bool:
    origin, _, axis = quantity.name.rpartition(".")
    return axis in ("X", "Y", "N") and origin.partition(".")[0] != "force" and quantity.unit in ("N", "N.m")


def _displays(model: Model) -> Iterator[Quantity]:
    yield _bearing("motion.heading", "Heading, clockwise from north, 0 to 360 deg", model.symbol("motion.psi"))
    if "wind.speed" not in model:
        return
    speed, direction = model.symbol("wind.speed"), model.symbol("wind.direction")
    north, east = -speed * ca.cos(direction), -speed * ca.sin(direction)
    if "wind.north" in model:
        north, east = north + model.symbol("wind.north"), east + model.symbol("wind.east")
    forward, starboard = relative_air(model, north, east)
    yield Quantity(
        "wind.relative_speed",
        "m/s",
        "Speed of the wind relative to the ship",
        ca.sqrt(forward**2 + starboard**2 + _STILL_MPS**2),
        display_unit="knots",
        nominal=10.0,
    )
    from_bow = ca.atan2(-starboard, -forward + _STILL_MPS * (forward**2 + starboard**2 < _STILL_MPS**2))
    description = "Direction from which the relative wind comes, clockwise from the bow, 0 to 360 deg"
    yield _bearing("wind.relative_direction", description, from_bow)


_STILL_MPS = 1e-8
"""Relative wind below which its direction is dead ahead: far below any wind. Project choice."""


def _bearing(name: str, description: str, angle: ca.SX) -> Quantity:
    turn = 2 * math.pi
    return Quantity(
        name,
        "rad",
        description,
        angle - turn * ca.floor(angle / turn),
        display_unit="deg",
        minimum=0.0,
        maximum=2 * math.pi,
    )


def with_external_forces(model: Model) -> Model:
    """The model with inputs for a force and a moment from outside, zero unless set.

    ``external.X``, ``external.Y`` (N, positive forward and to starboard) act at the point ``external.point_x``,
    ``external.point_y`` (m, forward of midships and to starboard of the centreline); ``external.N`` (N m, positive to
    starboard) is a moment in addition. About midships the moment is N + x Y - y X. They are added to ``force.X``,
    ``force.Y`` and ``force.N``, after all effects, so that no effect scales them. A model without these quantities is
    returned as it is.

    A ship that rolls also has ``external.point_z`` (m, the point below the origin) and ``external.K`` (N m, positive to
    starboard); its rolling moment is K - z Y, added to ``force.K``.
    """
    if not all(f"force.{name}" in model for name in "XYN"):
        return model
    length, speed, mass = (model.defaults[f"ship.{name}"] for name in ("length", "speed", "mass"))
    force = mass * speed**2 / length / 100  # the order of a ship's resistance at the speed of expansion
    at, besides = "at external.point_x, external.point_y", "in addition to the moment of the force at its point"
    outside = "Point of the external force"
    described = (
        ("external.X", "N", f"External surge force {at}, positive forward", force),
        ("external.Y", "N", f"External sway force {at}, positive to starboard", force),
        ("external.N", "N.m", f"External yaw moment, {besides}, positive to starboard", force * length / 4),
        ("external.point_x", "m", f"{outside} forward of midships", length / 4),
        ("external.point_y", "m", f"{outside} to starboard of the centreline", length / 20),
        ("external.K", "N.m", f"External rolling moment, {besides}, positive to starboard", force * length / 20),
        ("external.point_z", "m", f"{outside} below the origin", length / 20),
    )
    inputs = [Input(*words, nominal=nominal) for *words, nominal in described]
    X, Y, N, x, y, K, z = (variable.symbol for variable in inputs)
    forced = with_forces(model.extend(*inputs[:5]), X=X, Y=Y, N=N + x * Y - y * X)
    if "force.K" not in model:
        return forced
    return forced.extend(*inputs[5:]).redefine("force.K", lambda moment: moment + K - z * Y)


def external_inputs(given: Mapping[str, float], *, rolls: bool = False) -> dict[str, float]:
    """Inputs of the model by name, from ``X``, ``Y`` (N), ``N`` (N m), ``x`` and ``y`` (m).

    Parameters
    ----------
    given : mapping
    rolls : bool
        True for a ship that rolls, which also has ``K`` (N m) and ``z`` (m).

    Raises
    ------
    InputError
        A key is none of these.
    """
    of_roll = dict(zip(("K", "z"), EXTERNAL_INPUTS_OF_ROLL, strict=True))
    known = dict(zip(("X", "Y", "N", "x", "y"), EXTERNAL_INPUTS, strict=True)) | (of_roll if rolls else {})
    for name in given:
        if name not in known:
            remedy = "X and Y (N), N (N m), x and y (m) are known"
            if name in of_roll:
                remedy = "it acts on a ship that rolls: give [roll] on the card"
            raise ArgumentError("external", name, "is not an external force", remedy)
    return {known[name]: float(value) for name, value in given.items()}
