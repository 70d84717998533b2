"""Forces from outside the model, as inputs: lines, fenders, tugs, anchors, and whatever else a simulator computes."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.model import Input, Model
from tank2sim.errors import InputError

EXTERNAL_INPUTS = tuple(f"external.{name}" for name in ("X", "Y", "N", "x", "y"))
"""Inputs of :func:`with_external_forces`."""

EXTERNAL_INPUTS_OF_ROLL = ("external.K", "external.z")
"""Further inputs of a ship that rolls."""


def with_external_forces(model: Model) -> Model:
    """The model with inputs for a force and a moment from outside, zero unless set.

    ``external.X``, ``external.Y`` (N, positive forward and to starboard) act at the point ``external.x``,
    ``external.y`` (m, forward of midships and to starboard of the centreline); ``external.N`` (N m, positive to
    starboard) is a moment in addition. About midships the moment is N + x Y - y X. They are added to ``force.X``,
    ``force.Y`` and ``force.N``, after all effects, so that no effect scales them. A model without these quantities is
    returned as it is.

    A ship that rolls also has ``external.z`` (m, the point below the origin) and ``external.K`` (N m, positive to
    starboard); its rolling moment is K - z Y, added to ``force.K``.
    """
    if not all(f"force.{name}" in model for name in "XYN"):
        return model
    length, speed, mass = (model.parameter_values()[model.parameter_names.index(f"ship.{name}")] for name in _SHIP)
    force = float(mass * speed**2 / length) / 100  # the order of a ship's resistance at the speed of expansion
    described = (
        ("N", "External surge force at external.x, external.y, positive forward"),
        ("N", "External sway force at external.x, external.y, positive to starboard"),
        ("N.m", "External yaw moment, in addition to that of the force at its point, positive to starboard"),
        ("m", "Point of the external force forward of midships"),
        ("m", "Point of the external force to starboard of the centreline"),
    )
    usual = (force, force, force * float(length) / 4, float(length) / 4, float(length) / 20)
    inputs = [
        Input(name=name, unit=unit, description=description, nominal=nominal)
        for name, (unit, description), nominal in zip(EXTERNAL_INPUTS, described, usual, strict=True)
    ]
    X, Y, N, x, y = (variable.symbol for variable in inputs)
    forced = with_forces(model.extend(*inputs), X=X, Y=Y, N=N + x * Y - y * X)
    if "force.K" not in model:
        return forced
    of_roll = (
        ("N.m", "External rolling moment, in addition to that of the force at its point, positive to starboard"),
        ("m", "Point of the external force below the origin"),
    )
    rolling = [
        Input(name=name, unit=unit, description=description, nominal=nominal)
        for name, (unit, description), nominal in zip(
            EXTERNAL_INPUTS_OF_ROLL, of_roll, (force * float(length) / 20, float(length) / 20), strict=True
        )
    ]
    K, z = (variable.symbol for variable in rolling)
    return forced.extend(*rolling).redefine("force.K", lambda moment: moment + K - z * Y)


def external_inputs(given: Mapping[str, float], *, rolls: bool = False) -> dict[str, float]:
    """Inputs of the model by name, from ``X``, ``Y`` (N), ``N`` (N m), ``x`` and ``y`` (m).

    Parameters
    ----------
    given : mapping
    rolls : bool
        Of a ship that rolls, which also has ``K`` (N m) and ``z`` (m).

    Raises
    ------
    InputError
        A key is none of these.
    """
    inputs = {f"external.{name}": float(value) for name, value in given.items()}
    for name in inputs:
        if name not in (*EXTERNAL_INPUTS, *(EXTERNAL_INPUTS_OF_ROLL if rolls else ())):
            remedy = "X and Y (N), N (N m), x and y (m) are known"
            if name in EXTERNAL_INPUTS_OF_ROLL:
                remedy = "it acts on a ship that rolls: give [roll] on the card"
            raise InputError("external", name.removeprefix("external."), "is not an external force", remedy)
    return inputs


_SHIP = ("length", "speed", "mass")
