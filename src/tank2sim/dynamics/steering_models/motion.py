"""A steering model as a ship that moves: the form's two equations with kinematics and a rudder that follows orders."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.kinematics import planar_kinematics, started, yaw_rate
from tank2sim.dynamics.model import Model, Parameter, Quantity, State
from tank2sim.dynamics.steering_gear import steering_gear
from tank2sim.dynamics.steering_models.form import SteeringForm
from tank2sim.notices import Notice

_STEPS_PER_LENGTH = 200
"""Integration steps while the ship covers its own length, as of the other ships."""

_OUTPUTS = (
    *("motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "motion.speed", "motion.beta"),
    *("motion.rdot", "motion.betadot", "rudder.angle"),
)


def steering_model(
    name: str, form: SteeringForm, coefficients: Mapping[str, float], length_m: float, speed_mps: float
) -> Model:
    """The model of a ship at a constant speed, (1) of paper 4 with the terms of `form`.

    Its variables are named as for every ship (``motion.beta`` is a state here, and ``motion.u``, ``motion.v``
    follow from it), so that manoeuvres, figures and steady turns work on it alike.

    `name`: the ship. `form`: the equations. `coefficients`: values by name, parameters ``coefficients.*``; those with a
    default may be left out. `length_m`, `speed_mps`: l and v. Raises ValueError: a coefficient without default is not
    given, or one is given that the form does not have.
    """
    known = {coefficient.name: coefficient.default for coefficient in form.coefficients}
    values = known | dict(coefficients)
    wrong = [name for name, value in values.items() if value is None or name not in known]
    if wrong:
        raise ValueError(f"{form.name}: missing or unknown: {', '.join(wrong)}")
    beta = State(
        "motion.beta",
        "rad",
        "Drift angle, positive when the water meets the port bow: v = -speed sin(beta)",
        display_unit="deg",
        nominal=0.2,
        derivative="motion.betadot",
        steady=True,
    )
    drift = started(beta, "Drift angle at the start")
    states, starts = zip(drift, yaw_rate(nominal_radps=0.01), strict=True)
    own = (
        Parameter(f"coefficients.{one.name}", "1", one.description, start=float(values[one.name] or 0.0))
        for one in form.coefficients
    )
    constants = (*_ship(length_m, speed_mps), *starts, *own)
    gear, notices = steering_gear(None, length_m / speed_mps)
    given = (*states, *constants, *gear)
    motion = (*states, *_quantities(form, {variable.name: variable.symbol for variable in given}))
    position = planar_kinematics({variable.name: variable for variable in motion})
    empty = Model(
        name=name,
        description=f"{name}: {form.title}, steering at a constant speed",
        step_s=length_m / speed_mps / _STEPS_PER_LENGTH,
        notices=(*notices, Notice("the speed of a steering model does not fall in a turn")),
    )
    return empty.extend(*position, *motion, *gear, *constants, outputs=_OUTPUTS)


def _ship(length_m: float, speed_mps: float) -> tuple[Parameter, ...]:
    def speed(name: str, description: str) -> Parameter:
        return Parameter(name, "m/s", description, start=speed_mps, nominal=speed_mps)

    return (
        Parameter("ship.length", "m", "Length L", start=length_m, nominal=length_m),
        speed("ship.speed", "Speed v, which stays constant"),
        speed("ship.slowest", "Lowest speed at which the model holds"),
        speed("ship.fastest", "Highest speed at which the model holds"),
    )


def _quantities(form: SteeringForm, symbols: Mapping[str, ca.SX]) -> tuple[Quantity, ...]:
    """Rates of the states ``motion.beta``, ``motion.r``, and the velocities in the ship's axes."""
    beta, r = symbols["motion.beta"], symbols["motion.r"]
    speed = symbols["ship.speed"]
    per_second = speed / symbols["ship.length"]
    own_coefficients = {
        coefficient.name: symbols[f"coefficients.{coefficient.name}"] for coefficient in form.coefficients
    }
    sway, yaw = form.rates(own_coefficients, beta, r / per_second, symbols["rudder.effective"])

    return (
        Quantity("motion.betadot", "rad/s", "Rate of the drift angle", sway * per_second),
        Quantity("motion.rdot", "rad/s2", "Yaw acceleration, positive to starboard", yaw * per_second**2),
        Quantity("motion.u", "m/s", "Surge velocity, positive forward", speed * ca.cos(beta)),
        Quantity("motion.v", "m/s", "Sway velocity, positive to starboard", -speed * ca.sin(beta)),
        Quantity("motion.speed", "m/s", "Speed through the water", speed),
    )
