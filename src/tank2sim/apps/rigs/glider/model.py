"""Underwater glider with mass and added mass: the motion between the steady glides of paper 5.

The paper (Kulikovsky and Velikanov 2012) strings steady glides together and neglects all inertia. Here the same forces
move a mass with its added mass; straight steady glides are equilibria of u and w, and turns differ from the paper's by
the added mass alone. As in the paper the attitude is prescribed: pitch and roll follow their orders, whatever moment
that takes, and the hull heads where it goes (no sideslip). Ballast that is taken in or pushed out does not change the
mass that is accelerated: it is less than 1 % of it.
"""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.dynamics.glider_forces import (
    Attitude,
    drag_coefficient,
    forces,
    glider_accelerations,
    lift_coefficient,
    momentum,
)
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State
from tank2sim.notices import Notice
from tank2sim.units import rounded_down

SMALL_INCIDENCE = math.radians(10.0)
"""The coefficients are fits at "small incidence" (paper, before (6)); that this ends at 10 deg is project choice."""

LARGEST_INCIDENCE = math.radians(30.0)
"""Beyond it the coefficients stay what they are there. Project choice: at rest and when it turns over a glider moves
across its hull, where polynomials of alpha would give drags of hundreds; held, C_D is at most 9, and the motion of
such moments is a rough guess, for which ``validity`` is 0."""

# A Runge-Kutta step of this share of the fastest time constant errs by less than 1e-5 of its motion, and is stable at
# several times the usual speed.
_STEP_SHARE = 0.15

_PITCH = 0.5
"""Pitch of the dive in which an FMU starts, 28.6 deg: the paper's sample dives at 30 deg have 27.8 deg."""


def glider_warnings(card: GliderCard) -> tuple[Notice, ...]:
    """Messages about a card: a displaced volume that does not carry its mass, and an area that is V^(2/3).

    Both are so in the paper's own data.
    """
    glider, density = card.glider, card.environment.water_density_kgpm3
    messages = []
    light = density * glider.volume_m3 - glider.mass_kg
    if abs(light) > 0.02 * glider.mass_kg:
        messages.append(
            f"the card contradicts itself: {glider.volume_m3:g} m3 displace {density * glider.volume_m3:.4g} kg and "
            f"the mass is {glider.mass_kg:g} kg, a net buoyancy of {light:+.3g} kg where the glider has "
            f"{glider.buoyancy_kg:g} kg ({glider.mass_kg:g} kg displace {glider.mass_kg / density:.4g} m3); mass and "
            "net buoyancy are used as they are, the volume in the ballast (1) alone"
        )
    if math.isclose(glider.reference_area_m2, glider.volume_m3 ** (2 / 3), rel_tol=1e-3):
        messages.append(
            f"the coefficients are referred to V^(2/3) = {glider.reference_area_m2:.4g} m2; those of gliders are by "
            "custom referred to the frontal area, with which speeds are higher by the root of the ratio: state the "
            "area that belongs to them in glider.reference_area_m2"
        )
    return tuple(map(Notice, messages))


def glider_model(card: GliderCard) -> Model:
    """The transient model of a glider.

    Inputs are the orders ``buoyancy.command`` (kg, + light), ``pitch.command`` (rad, + nose up) and ``roll.command``
    (rad, + starboard down); states the position (x north, y east, z down), the course psi, the body velocities u
    (forward) and w (down) and what the orders have become. A glider that climbs has its lift down: rolled to starboard
    it turns to port.
    """
    inputs, parameters = _inputs(card), _parameters(card)
    states = _states(
        card, {variable.name: variable for variable in inputs}, {parameter.name: parameter for parameter in parameters}
    )
    symbols = {state.name: state.symbol for state in (*states, *inputs, *parameters)}
    quantities = (*_rates_of_orders(symbols), *_dynamics(symbols, card))
    return Model(
        name=card.ship.name,
        description="Underwater glider with prescribed attitude, mass and added mass, after Kulikovsky and Velikanov",
        states=states,
        inputs=inputs,
        parameters=parameters,
        quantities=quantities,
        outputs=(
            *("motion.x", "motion.y", "motion.z", "motion.psi", "motion.u", "motion.w"),
            *("motion.speed", "motion.incidence", "motion.path_angle", "motion.psidot"),
            *("motion.udot", "motion.wdot"),
            *("buoyancy.mass", "pitch.angle", "roll.angle", "force.lift", "force.drag", "validity"),
        ),
        step_s=_step(card),
        notices=(
            *glider_warnings(card),
            Notice("the attitude is prescribed, the glider does not slip sideways, and its added masses are estimates"),
        ),
    )


def _inputs(card: GliderCard) -> tuple[Input, ...]:
    def angle(name: str, description: str, start: float, nominal: float) -> Input:
        half = math.pi / 2
        return Input(
            f"{name}.command",
            "rad",
            description,
            display_unit="deg",
            start=start,
            nominal=nominal,
            minimum=-half,
            maximum=half,
        )

    return (
        Input(
            "buoyancy.command",
            "kg",
            "Ordered net buoyancy, displaced mass less own mass: + rises, - sinks",
            start=-card.glider.buoyancy_kg,
            nominal=card.glider.buoyancy_kg,
        ),
        angle("pitch", "Ordered pitch, + nose up", -_PITCH, _PITCH),
        angle("roll", "Ordered roll, + starboard side down", 0.0, 0.1),
    )


def _parameters(card: GliderCard) -> tuple[Parameter, ...]:
    glider = card.glider

    def constant(name: str, unit: str, description: str, start: float, least: float = 0.0) -> Parameter:
        return Parameter(name, unit, description, start=start, nominal=abs(start) or 1.0, minimum=least)

    def initial(name: str, unit: str, description: str, start: float = 0.0) -> Parameter:
        return Parameter(f"initial.{name}", unit, description, start=start, tunable=False)

    seconds = "Time in which {} comes within 37 % of its order"
    return (
        constant("glider.mass", "kg", "Mass with the ballast", glider.mass_kg),
        constant("glider.added_mass_axial", "kg", "Added mass along the hull", glider.added_mass_axial_kg),
        constant(
            "glider.added_mass_normal", "kg", "Added mass across the hull, up and down", glider.added_mass_normal_kg
        ),
        constant("glider.reference_area", "m2", "Area to which the coefficients refer", glider.reference_area_m2),
        constant("glider.lift_slope", "1", "C_L by incidence, 1/rad", glider.lift_slope),
        constant("glider.lift_quadratic", "1", "C_L by incidence times its size, 1/rad^2", glider.lift_quadratic),
        constant("glider.drag_zero", "1", "C_D without incidence", glider.drag_zero),
        constant("glider.drag_quadratic", "1", "C_D by incidence squared, 1/rad^2", glider.drag_quadratic),
        constant("glider.water_density", "kg/m3", "Density of the water", card.environment.water_density_kgpm3),
        constant("glider.gravity", "m/s2", "Acceleration of gravity", card.environment.gravity_mps2),
        constant("buoyancy.time_constant", "s", seconds.format("the buoyancy"), glider.buoyancy_time_constant_s, 1e-3),
        constant("pitch.time_constant", "s", seconds.format("the pitch"), glider.pitch_time_constant_s, 1e-3),
        constant("roll.time_constant", "s", seconds.format("the roll"), glider.roll_time_constant_s, 1e-3),
        initial("x", "m", "North of the origin at the start"),
        initial("y", "m", "East of the origin at the start"),
        initial("z", "m", "Below the origin at the start"),
        initial("psi", "rad", "Course at the start, clockwise from north"),
        initial("u", "m/s", "Velocity along the hull at the start, + forward", _usual_speed(card)),
        initial("w", "m/s", "Velocity across the hull at the start, + down"),
        initial("buoyancy", "kg", "Net buoyancy at the start, + light", -glider.buoyancy_kg),
        initial("pitch", "rad", "Pitch at the start, + nose up", -_PITCH),
        initial("roll", "rad", "Roll at the start, + starboard side down"),
        Parameter(
            "initial.trim",
            "1",
            "True: start in the steady glide of the inputs given (initial.u and .w are then a first guess)",
            boolean=True,
            start=0.0,
            tunable=False,
        ),
    )


def _usual_speed(card: GliderCard) -> float:
    """About the speed of the dive in which the model starts, m/s: |m0| g sin(pitch) = drag without incidence."""
    glider = card.glider
    pull = glider.buoyancy_kg * card.environment.gravity_mps2 * math.sin(_PITCH)
    return math.sqrt(2 * pull / (card.environment.water_density_kgpm3 * glider.reference_area_m2 * glider.drag_zero))


def _step(card: GliderCard) -> float:
    """Step of integration, s: 1, 2, 5 times a power of ten; fastest is rho S v C_L'/(2 (m + A33)) or a control."""
    glider = card.glider
    grip = (
        0.5 * card.environment.water_density_kgpm3 * glider.reference_area_m2 * _usual_speed(card) * glider.lift_slope
    )
    incidence = (glider.mass_kg + glider.added_mass_normal_kg) / grip
    controls = (glider.buoyancy_time_constant_s, glider.pitch_time_constant_s, glider.roll_time_constant_s)
    return rounded_down(_STEP_SHARE * min(incidence, *controls))


def _states(card: GliderCard, inputs: dict[str, Input], parameters: dict[str, Parameter]) -> tuple[State, ...]:
    def motion(name: str, unit: str, description: str, steady: bool = False, nominal: float = 1.0) -> State:
        return State(
            f"motion.{name}",
            unit,
            description,
            nominal=nominal,
            derivative=f"motion.{name}dot",
            start=parameters[f"initial.{name}"].symbol,
            steady=steady,
            display_unit="deg" if unit == "rad" else None,
        )

    def ordered(name: str, what: str, description: str, nominal: float) -> State:
        order = inputs[f"{name}.command"]
        return State(
            f"{name}.{what}",
            order.unit,
            description,
            nominal=nominal,
            derivative=f"{name}.rate",
            start=parameters[f"initial.{name}"].symbol,
            trim=order.symbol,
            display_unit=order.display_unit,
        )

    speed = _usual_speed(card)
    return (
        motion("x", "m", "Position north of the origin"),
        motion("y", "m", "Position east of the origin"),
        motion("z", "m", "Depth below the origin"),
        motion("psi", "rad", "Course, clockwise from north, continuous"),
        motion("u", "m/s", "Velocity through the water along the hull, + forward", True, speed),
        motion("w", "m/s", "Velocity through the water across the hull, + down", True, 0.1 * speed),
        ordered("buoyancy", "mass", "Net buoyancy, displaced mass less own mass: + rises", card.glider.buoyancy_kg),
        ordered("pitch", "angle", "Pitch, + nose up", 0.5),
        ordered("roll", "angle", "Roll, + starboard side down", 0.1),
    )


def _rates_of_orders(symbols: dict[str, ca.SX]) -> list[Quantity]:
    """Each control follows its order with a first-order lag."""
    return [
        Quantity(
            f"{name}.rate",
            unit,
            f"Rate of the {name}",
            nominal=nominal,
            value=(symbols[f"{name}.command"] - symbols[state]) / symbols[f"{name}.time_constant"],
        )
        for name, state, unit, nominal in (
            ("buoyancy", "buoyancy.mass", "kg/s", 0.01),
            ("pitch", "pitch.angle", "rad/s", 0.1),
            ("roll", "roll.angle", "rad/s", 0.01),
        )
    ]


def _dynamics(symbols: dict[str, ca.SX], card: GliderCard) -> list[Quantity]:
    at = Attitude(*(symbols[name] for name in ("motion.u", "motion.w", "pitch.angle", "roll.angle")))
    incidence = ca.atan2(at.w, at.u)
    held = ca.fmax(-LARGEST_INCIDENCE, ca.fmin(LARGEST_INCIDENCE, incidence))
    half = 0.5 * symbols["glider.water_density"] * symbols["glider.reference_area"]
    lift_area = half * lift_coefficient(held, symbols["glider.lift_slope"], symbols["glider.lift_quadratic"])
    drag_area = half * drag_coefficient(held, symbols["glider.drag_zero"], symbols["glider.drag_quadratic"])
    carried = momentum(at, *(symbols[f"glider.{name}"] for name in ("mass", "added_mass_axial", "added_mass_normal")))
    force = forces(at, lift_area, drag_area, symbols["buoyancy.mass"] * symbols["glider.gravity"])
    pitching, rolling = (
        (symbols[f"{name}.command"] - symbols[f"{name}.angle"]) / symbols[f"{name}.time_constant"]
        for name in ("pitch", "roll")
    )
    others = ca.jacobian(carried, at.pitch) * pitching + ca.jacobian(carried, at.roll) * rolling
    udot, wdot, turn = ca.vertsplit(glider_accelerations(at, carried, force, others))
    weight = card.glider.buoyancy_kg * card.environment.gravity_mps2
    worth = (LARGEST_INCIDENCE - abs(incidence)) / (LARGEST_INCIDENCE - SMALL_INCIDENCE)
    course = symbols["motion.psi"]

    def quantity(name: str, unit: str, description: str, value: ca.SX, nominal: float = 1.0) -> Quantity:
        shown = {"rad": "deg", "rad/s": "deg/s"}.get(unit)
        return Quantity(name, unit, description, value=value, nominal=nominal, display_unit=shown)

    return [
        quantity("motion.xdot", "m/s", "Velocity north", at.horizontal * ca.cos(course)),
        quantity("motion.ydot", "m/s", "Velocity east", at.horizontal * ca.sin(course)),
        quantity("motion.zdot", "m/s", "Velocity down", -at.climb),
        quantity("motion.psidot", "rad/s", "Rate of the course, + to starboard", turn, 0.01),
        quantity("motion.udot", "m/s2", "Acceleration along the hull", udot, 0.01),
        quantity("motion.wdot", "m/s2", "Acceleration across the hull", wdot, 0.01),
        quantity("motion.speed", "m/s", "Speed through the water", at.speed, _usual_speed(card)),
        quantity("motion.incidence", "rad", "Incidence, + when the flow comes from below", incidence, 0.1),
        quantity("motion.path_angle", "rad", "Angle of the path, + up", ca.atan2(at.climb, at.horizontal), 0.5),
        quantity(
            "force.lift", "N", "Lift, + when it acts towards the back of the glider", lift_area * at.speed**2, weight
        ),
        quantity("force.drag", "N", "Drag, + when it acts against the motion", drag_area * at.speed**2, 0.5 * weight),
        Quantity(
            "validity",
            "1",
            "1 up to 10 deg of incidence, where the coefficients hold, falling to 0 at 30 deg",
            minimum=0.0,
            maximum=1.0,
            value=ca.fmin(1, ca.fmax(0, worth)),
        ),
    ]
