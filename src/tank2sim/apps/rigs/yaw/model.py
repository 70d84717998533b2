"""A body that a motor turns in a tank: (3) of paper 3 (Alyshev 2019), with its motor, current loop and encoder.

    (J_zz + lambda) dw/dt = k_t I - f_c sgn w - f_1 w - f_662 w |w|,   T_c dI/dt + I = u

In air lambda and f_662 are zero. Beyond (3), and as the paper's energy method has them: added inertia and damping that
differ between accelerating (a) and braking (d), lambda_662 |w|^1.5 and f_662 |w|, with sgn(dw/dt) sgn(w) >= 0 for a;
walls, lambda_66l and f_66l, as functions of the distances of bow and stern; and the moment of gravity of a body mounted
off the axis. psi and r = w are positive clockwise seen from above, as everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import casadi as ca

from tank2sim.apps.rigs.yaw.card import TankWalls, YawRig
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State

# A thousandth of a second, the step of a rig's digital controller; the fastest of the model, the knee of the dry
# friction, is stable up to twenty times that.
_STEP_S = 0.001
# Rate at which the dry friction is fully there, rad/s: a thousandth of the paper's. A jump of sgn at zero would let
# the body at rest tremble by the step of integration.
_KNEE_RADPS = 2.5e-4


TORQUE_CONSTANT_NMPA = 0.051
"""k_t of the paper's motor."""

UNKNOWN_RIG = YawRig(inertia_kgm2=1.0, torque_constant_NmpA=1.0)
"""A rig before its identification: the first two numbers are placeholders for the estimates."""


def friction(rate: ca.SX, coulomb: ca.SX, viscous: ca.SX, quadratic: ca.SX) -> ca.SX:
    """Moment against the motion of (3) in N m, at a rate in rad/s.

    Odd in the rate; sgn w is tanh(w / 2.5e-4 rad/s).
    """
    return coulomb * ca.tanh(rate / _KNEE_RADPS) + rate * (viscous + quadratic * ca.fabs(rate))


def wall_nearness(heading: Any, walls: TankWalls) -> tuple[Any, Any]:
    """1/(l_a + 1) and 1/(l_f + 1) at a heading (rad): distances, in m, of bow and stern to the nearest wall."""
    near = []
    for half in (walls.body_length_m / 2, -walls.body_length_m / 2):
        x, y = walls.x_m + half * ca.cos(heading), walls.y_m + half * ca.sin(heading)
        distance = ca.fmin(walls.length_m / 2 - ca.fabs(x), walls.breadth_m / 2 - ca.fabs(y))
        near.append(1 / (distance + 1))
    return near[0], near[1]


def wall_terms(
    heading: ca.SX, walls: TankWalls, coefficients: Mapping[str, ca.SX] | None = None
) -> tuple[ca.SX, ca.SX]:
    """lambda_66l (kg m2) and f_66l (N m s) at a heading; coefficients by name (``wall.bow_inertia``), or the walls'."""
    values: Mapping[str, Any] = coefficients or {name: start for name, _, start, _ in _wall_rows(walls)}
    bow, stern = wall_nearness(heading, walls)
    return (
        values["wall.bow_inertia"] * bow + values["wall.stern_inertia"] * stern,
        values["wall.bow_damping"] * bow + values["wall.stern_damping"] * stern,
    )


def yaw_rig_model(name: str, rig: YawRig, *, with_current_loop: bool = True) -> Model:
    """The rig as a model of the body `name`; the tunable parameters start with the values of `rig`.

    The input is ``motor.command`` (A), and the current follows; `with_current_loop` False makes it ``motor.current``
    itself, as a record has it.
    """
    parameters = {parameter.name: parameter for parameter in _parameters(rig)}
    p = {key: parameter.symbol for key, parameter in parameters.items()}
    heading = State(
        "motion.psi",
        "rad",
        "Yaw angle of the body, + clockwise seen from above",
        derivative="motion.psidot",
        start=p["initial.psi"],
    )
    rate = State(
        "motion.r",
        "rad/s",
        "Yaw rate, + clockwise seen from above",
        nominal=0.1,
        derivative="motion.rdot",
        start=p["initial.r"],
    )
    motor = _current_loop(p) if with_current_loop else _recorded_current()
    pulse = 2 * math.pi / p["encoder.pulses"]
    quantities = [
        Quantity("motion.psidot", "rad/s", "Rate of the yaw angle", value=rate.symbol),
        *_mechanics(heading.symbol, rate.symbol, motor.current, p, rig.walls),
        Quantity(
            "encoder.angle",
            "rad",
            "Yaw angle as the encoder counts it, whole pulses",
            value=ca.floor(heading.symbol / pulse) * pulse,
        ),
        *motor.quantities,
    ]
    outputs = [heading.name, rate.name, "motion.rdot", "encoder.angle", "moment.motor", "moment.resistance"]
    return Model(
        name=name,
        description="Body turned by a motor about a fixed vertical axis, equation (3) of Alyshev (2019)",
        states=(heading, rate, *motor.states),
        inputs=motor.inputs,
        parameters=tuple(parameters.values()),
        quantities=tuple(quantities),
        outputs=(*outputs, *(state.name for state in motor.states)),
        step_s=_STEP_S,
    )


class _Motor(NamedTuple):
    """The current, and the variables that it follows from."""

    current: ca.SX
    inputs: tuple[Input, ...]
    states: tuple[State, ...] = ()
    quantities: tuple[Quantity, ...] = ()


def _recorded_current() -> _Motor:
    recorded = Input("motor.current", "A", "Current of the motor, + turns clockwise")
    return _Motor(recorded.symbol, (recorded,))


def _current_loop(p: dict[str, ca.SX]) -> _Motor:
    command = Input("motor.command", "A", "Current asked of the amplifier, + turns clockwise")
    current = State(
        "motor.current",
        "A",
        "Current of the motor, + turns clockwise",
        derivative="motor.current_rate",
        start=0.0,
        trim=command.symbol,
    )
    limit = p["motor.max_current"]
    allowed = ca.fmax(-limit, ca.fmin(limit, command.symbol))
    loop = Quantity(
        "motor.current_rate",
        "A/s",
        "Rate of the current: the amplifier's loop is a first-order lag",
        value=(allowed - current.symbol) / p["motor.lag"],
    )
    return _Motor(current.symbol, (command,), (current,), (loop,))


def _mechanics(
    heading: ca.SX, rate: ca.SX, current: ca.SX, p: dict[str, ca.SX], walls: TankWalls | None
) -> tuple[Quantity, ...]:
    """Moments and the acceleration that they give."""
    wall_inertia, wall_damping = wall_terms(heading, walls, p) if walls else (ca.SX(0), ca.SX(0))
    motor = p["motor.torque_constant"] * current
    gravity = -p["gravity.moment"] * ca.sin(heading - p["gravity.angle"])
    sign, magnitude = ca.sign(rate), ca.fabs(rate)

    def resistance(quadratic: ca.SX) -> ca.SX:
        return friction(rate, p["friction.coulomb"], p["friction.viscous"] + wall_damping, quadratic)

    speeding = motor + gravity - resistance(p["friction.quadratic"])
    # The body accelerates if it does so with the coefficients of accelerating. Where it would brake with these and
    # accelerate with the coefficients of braking, it does neither.
    accelerates = sign * speeding >= 0
    slowing = motor + gravity - resistance(p["friction.quadratic_braking"])
    slowing = sign * ca.fmin(0, sign * slowing)
    moment = ca.if_else(accelerates, speeding, slowing)
    rated = ca.if_else(accelerates, p["added.inertia_accelerating"], p["added.inertia_braking"])
    # |w|^1.5, written so that its derivative at rest is finite.
    total = p["body.inertia"] + p["added.inertia"] + wall_inertia + rated * magnitude * ca.sqrt(magnitude + 1e-12)
    resisting = ca.if_else(
        accelerates, resistance(p["friction.quadratic"]), resistance(p["friction.quadratic_braking"])
    )
    return (
        Quantity("moment.motor", "N.m", "Moment of the motor, + clockwise", value=motor),
        Quantity("moment.gravity", "N.m", "Moment of gravity, + clockwise", value=gravity),
        Quantity(
            "moment.resistance", "N.m", "Moment of friction and water, + when it acts counterclockwise", value=resisting
        ),
        Quantity("motion.rdot", "rad/s2", "Yaw acceleration, + clockwise", nominal=0.1, value=moment / total),
    )


_BOUNDS: dict[str, tuple[float | None, float | None]] = {
    "body.inertia": (0.0, None),
    "motor.lag": (1e-3, 1e3),
    "motor.max_current": (0.0, None),
    "encoder.pulses": (4.0, 1e9),
}
"""Where a parameter means something, if not everywhere."""


def _parameters(rig: YawRig) -> tuple[Parameter, ...]:
    inertia, friction_unit = "kg.m2", "Moment of friction and water that "
    rows = [
        ("body.inertia", inertia, rig.inertia_kgm2, "Yaw inertia of the body with the rotor"),
        ("added.inertia", inertia, rig.added_inertia_kgm2, "Added yaw inertia lambda_661; 0 in air"),
        ("added.inertia_accelerating", inertia, rig.inertia_accelerating_kgm2, "Further, at 1 rad/s, accelerating"),
        ("added.inertia_braking", inertia, rig.inertia_braking_kgm2, "Further, at 1 rad/s, braking"),
        ("friction.coulomb", "N.m", rig.coulomb_Nm, friction_unit + "does not depend on the rate"),
        ("friction.viscous", "N.m.s", rig.viscous_Nms, friction_unit + "is proportional to the rate"),
        ("friction.quadratic", "N.m.s2", rig.quadratic_Nms2, friction_unit + "grows as its square, accelerating"),
        ("friction.quadratic_braking", "N.m.s2", rig.quadratic_braking, "The same, braking"),
        ("motor.torque_constant", "N.m/A", rig.torque_constant_NmpA, "Moment of the motor per current"),
        ("motor.lag", "s", rig.current_lag_s, "Time constant of the current loop"),
        ("motor.max_current", "A", rig.max_current_A, "Largest current asked of the motor"),
        ("gravity.moment", "N.m", rig.gravity_Nm, "Largest moment of gravity"),
        ("gravity.angle", "rad", rig.gravity_angle_rad, "Heading at which the body hangs at rest"),
        ("encoder.pulses", "1", rig.pulses_per_turn, "Pulses of the encoder per turn"),
    ]
    rows += _wall_rows(rig.walls) if rig.walls else []
    starts = [("initial.psi", "rad", "Yaw angle at the beginning"), ("initial.r", "rad/s", "Yaw rate at the beginning")]
    return (
        *(
            Parameter(
                name,
                unit,
                description,
                start=start,
                nominal=abs(start) or 1.0,
                minimum=_BOUNDS.get(name, (None, None))[0],
                maximum=_BOUNDS.get(name, (None, None))[1],
            )
            for name, unit, start, description in rows
        ),
        *(Parameter(n, unit, text, start=0.0, tunable=False) for n, unit, text in starts),
    )


def _wall_rows(walls: TankWalls) -> list[tuple[str, str, float, str]]:
    return [
        ("wall.bow_inertia", "kg.m2", walls.bow_inertia_kgm2, "Added inertia by the wall at the bow"),
        ("wall.stern_inertia", "kg.m2", walls.stern_inertia_kgm2, "Added inertia by the wall at the stern"),
        ("wall.bow_damping", "N.m.s", walls.bow_damping_Nms, "Damping by the wall at the bow"),
        ("wall.stern_damping", "N.m.s", walls.stern_damping_Nms, "Damping by the wall at the stern"),
    ]
