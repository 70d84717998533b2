"""A ship as the hull of dp-ship, a case of the Open Simulation Platform: its FMU with the case's names, and the system.

In the case two azimuth thrusters (magnitude F and angle a each) and a bow tunnel (F_3) move the hull. At places
(x_i, y_i), forward and to starboard of midships, that is::

    X = sum F_i cos a_i      Y = sum F_i sin a_i + F_3      N = sum (x_i F_i sin a_i - y_i F_i cos a_i) + x_3 F_3

The controller, the allocation and the observer of the case belong to a vessel of 107 m and 2365 t. For another ship the
places of thrusters go with the length, gains and the largest rate of thrust with mass and inertia. The observer has no
parameters: what it hears of the thrust is scaled by the same ratios, so that it sees the accelerations of its vessel.
The FMUs of the case were not run here.

The hull of another case, gunnerus-dp, has vectors of six: surge, sway and yaw (members 1, 2 and 6) are the ship's, the
others zero. Forces act at midships in the ship's axes. The water moves by ``Current_Velocity[1..2]`` (m/s, in the
ship's axes) over the ground: the ship's forces are of its motion through the water, and its place and velocity are over
the ground.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from itertools import product

import casadi as ca

from tank2sim.apps.programs.program_files import ProgramFiles, to_digits, value_at
from tank2sim.cards.card import Card, SteeredCard
from tank2sim.dynamics.build import build
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.surroundings import in_calm
from tank2sim.dynamics.model import Input, Model, Quantity, same_symbol
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.interface import Interface, interface
from tank2sim.fmu.osp import Group
from tank2sim.fmu.provenance import documents_of
from tank2sim.fmu.templates import render
from tank2sim.simulation.thruster_manoeuvres import thruster_commands

CASE_STEP_S = 0.04
CASE_LENGTH_M = 107.0
CASE_INERTIA = (3.31e6, 3.29e9)
"""Mass in sway (kg) and inertia in yaw (kg m2) of the case's vessel, with added masses."""

CASE_PLACES_M = ((-45.0, -7.0), (-45.0, 7.0), (53.0, 0.0))
"""Places of the port and the starboard azimuth thruster and of the bow tunnel in the case's vessel."""

_GAINS = {"Kpx": 2e4, "Kpy": 2e4, "Kdx": 5e5, "Kdy": 5e5, "Kix": 750.0, "Kiy": 750.0}
_YAW_GAINS = {"Kppsi": 1.5e8, "Kdpsi": 1e9, "Kipsi": 5e4}
_LIMITS = {"Fmax": 1e7, "uFmax": 2000.0}


@dataclass(frozen=True)
class CasePart:
    """A simulator of the case: its name, file, and initial values."""

    name: str
    file: str
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CaseJoint:
    """A connection of two variables, with a factor where the second hears the first scaled."""

    start: str
    start_variable: str
    end: str
    end_variable: str
    factor: float | None = None


def case_system(
    hull: str, length_m: float, mass_kg: float, inertia_kgm2: float
) -> tuple[list[CasePart], list[CaseJoint]]:
    """Simulators of the case with their values for a ship, and connections.

    `hull`: File of the ship's FMU; `length_m`, `mass_kg`, `inertia_kgm2`: Of the ship: mass in sway and inertia in yaw
    with added masses.
    """
    length, by_mass, by_inertia = length_m / CASE_LENGTH_M, mass_kg / CASE_INERTIA[0], inertia_kgm2 / CASE_INERTIA[1]
    gains = {name: value * by_mass for name, value in _GAINS.items()}
    gains |= {name: value * by_inertia for name, value in _YAW_GAINS.items()}
    (x1, y1), (x2, y2), (x3, _) = CASE_PLACES_M
    places = {"x1": x1, "y1": y1, "x2": x2, "y2": y2, "x3": x3}
    thrust = {name: value * max(by_mass, by_inertia / length) for name, value in _LIMITS.items()}
    allocation = {name: value * length for name, value in places.items()} | thrust
    parts = [
        CasePart("DP Controller", "DPController.fmu", to_digits(gains, 6)),
        CasePart("Observer", "NLPobserver.fmu"),
        CasePart("Reference Generator", "ReferenceGenerator.fmu"),
        CasePart("Thrust Allocation", "ThMPC.fmu", to_digits(allocation, 6)),
        CasePart("Ship", hull),
    ]
    joints = [
        CaseJoint(start, name, end, other)
        for start, names, end, others in _JOINTS
        for name, other in zip(names.split(), others.split(), strict=True)
    ]
    ratios = to_digits({"Fxg": 1 / by_mass, "Fyg": 1 / by_mass, "Mzg": 1 / by_inertia}, 6)
    for place, (name, factor) in enumerate(ratios.items(), 1):
        joints.append(CaseJoint("Thrust Allocation", name, "Observer", f"tau[{place}]", factor))
    return parts, joints


_REFERENCES = "x_ref y_ref psi_ref dx_ref dy_ref dpsi_ref"
# Simulator, its variables, another simulator, and the variables that hear them
_JOINTS = (
    ("Thrust Allocation", "F1c F2c F3c", "Ship", "Thrust_d[1] Thrust_d[2] Thrust_d[3]"),
    ("Thrust Allocation", "alpha1 alpha2", "Ship", "input[1] input[2]"),
    ("Ship", "q[1] q[2] q[3]", "Observer", "y[1] y[2] y[3]"),
    ("Observer", "y_hat[1] y_hat[2] y_hat[3]", "DP Controller", "x y psi"),
    ("Observer", "v_hat[1] v_hat[2] v_hat[3]", "DP Controller", "dx dy dpsi"),
    ("Reference Generator", _REFERENCES, "DP Controller", _REFERENCES),
    ("DP Controller", "Controlx Controly ControlMz", "Thrust Allocation", "refx refy refMz"),
)


HULL = "hull"
"""Name of the model and stem of its files."""

_LEAST_DRAG, _LARGEST_DRAG = 0.3, 30.0
"""Bounds of drag coefficients of sway and yaw at low speed. A hull has 0.6 to 1.6 (cross flow); with less the ship
swings under the case's controller, and with more the card has no bounded force at rest (project choice)."""

_STILL_PUSH = 1e-3
"""Largest thrust at rest that counts as none, over a hundredth of the ship's weight (project choice)."""


def osp_files(card: Card) -> ProgramFiles:
    """The folder of a ship in the case dp-ship: FMU, groups of variables, and the system of the whole case.

    Raises InputError: The ship does not lie still without orders, its hull does not damp motions at low speed, or a
    compiler is missing.
    """
    ship = card.steered()
    mass, inertia = _inertia(ship)
    files, damping = _hull_files(ship, hull_model(ship), _groups)
    parts, joints = case_system(f"{HULL}.fmu", ship.ship.length_m, mass, inertia)
    values = {"parts": parts, "joints": joints, "step": CASE_STEP_S, "version": version("tank2sim")}
    return ProgramFiles(
        files={
            **files,
            "OspSystemStructure.xml": render("OspCaseStructure.xml", values),
            "SystemStructure.ssd": render("OspCase.ssd.xml", values),
        },
        use=_USE,
        losses=(
            f"gains and limits of the case are scaled, to {mass / CASE_INERTIA[0]:.3g} times its mass and "
            f"{ship.ship.length_m:.4g} m; this was not run with the FMUs of the case",
            f"{damping}; a hull of 2365 t with 0.18 and 0.46 1/s stayed within 2 m, and with a sixth it swung by 20 to "
            "40 m",
            "rudder and propellers of the card stay as inputs, at zero: the case's thrusters move the ship",
            "waves and current of the case are in its own hull: give them to this one by effects of the card",
        ),
    )


def _hull_files(
    card: SteeredCard, model: Model, groups: Callable[[Interface], tuple[Group, ...]]
) -> tuple[dict[str, str | bytes], str]:
    """The FMU of a hull and its groups, by file, and how it damps low speeds, in words."""
    sway, yaw = low_speed_damping(card, model)
    made = make_fmu(model, fmi=2, documents=replace(documents_of(card), card_text=None))
    described = render("OspModelDescription.xml", {"groups": groups(interface(model))})
    damping = f"the hull damps sway at 0.3 m/s by {sway:.2g} 1/s, and yaw by {yaw:.2g} 1/s with that at its ends"
    return {f"{model.name}.fmu": made.content, f"{model.name}_OspModelDescription.xml": described}, damping


def resting_model(card: SteeredCard, name: str) -> Model:
    """The model of a card, named so, that starts at rest at the origin with stopped engines."""
    model = build(card)
    starts = [one for one in model.parameter_names if one.startswith("initial.") and one != "initial.trim"]
    model = replace(model.with_values(dict.fromkeys(starts, 0.0)), name=name)
    engines = {"propeller.speed", *(command.name for command in thruster_commands(model))}
    stopped = (same_symbol(one, replace(one, start=0.0)) if one.name in engines else one for one in model.inputs)
    return replace(model, inputs=tuple(stopped))


def hull_model(card: SteeredCard) -> Model:
    """The model of a card at rest with the case's names: ``Thrust_d[1..3]``, ``input[1..2]``, ``q[1..3]``."""
    model = resting_model(card, HULL)
    scale = card.ship.length_m / CASE_LENGTH_M
    force = card.scales.mass * 1e-3
    words = {1: "port azimuth thruster", 2: "starboard azimuth thruster"}
    words[3] = "bow tunnel thruster, positive to starboard"
    thrusts = [
        Input(name=f"Thrust_d[{place}]", unit="N", description=f"Force of the {text}", nominal=force)
        for place, text in words.items()
    ]
    angles = [
        Input(name=f"input[{place}]", unit="rad", description=f"Angle of the {words[place]}, from ahead to starboard")
        for place in (1, 2)
    ]
    forces = [
        (one.symbol * ca.cos(angle.symbol), one.symbol * ca.sin(angle.symbol))
        for one, angle in zip(thrusts, angles, strict=False)
    ]
    forces.append((ca.SX(0), thrusts[2].symbol))
    moments = [scale * (x * Y - y * X) for (x, y), (X, Y) in zip(CASE_PLACES_M, forces, strict=True)]
    outputs = [
        Quantity(name=name, unit=unit, description=text, value=model.symbol(f"motion.{state}"))
        for name, state, unit, text in (
            ("q[1]", "x", "m", "North position"),
            ("q[2]", "y", "m", "East position"),
            ("q[3]", "psi", "rad", "Heading, not wrapped"),
        )
    ]
    model = model.extend(*thrusts, *angles, *outputs, outputs=[one.name for one in outputs])
    return with_forces(model, X=sum(X for X, _ in forces), Y=sum(Y for _, Y in forces), N=sum(moments))


def _inertia(card: SteeredCard) -> tuple[float, float]:
    """Mass in sway (kg) and inertia in yaw (kg m2), with added masses."""
    body, known = card.body_si, card.derivatives
    units = (1.0, 1.0) if card.thrusters else (float(card.scales.mass), float(card.scales.inertia))
    return (
        body["mass"] - known.get("Yvdot", 0.0) * units[0],
        body["yaw_inertia"] - known.get("Nrdot", 0.0) * units[1],
    )


def low_speed_damping(card: SteeredCard, model: Model) -> tuple[float, float]:
    """Damping of sway and yaw in calm water at 0.3 m/s (of yaw at the ends), 1/s.

    Raises InputError: There is none, or the ship pushes itself at rest.
    """
    model = in_calm(model)
    length, draught = card.ship.length_m, card.ship.draught_m
    if draught is None:
        raise card.fault("ship.draught_m", "is missing, and damping at low speed is judged by it", "add it")
    pressure = 0.5 * card.environment.water_density_kgpm3 * length * draught
    still = abs(value_at(model, "force.X", {}))
    weight = card.body_si["mass"] * card.environment.gravity_mps2
    if "propeller.speed" not in model.input_names and still > _STILL_PUSH * weight / 100:
        problem = f"is missing, and the ship pushes itself with {still:.3g} N at rest: its engine cannot be stopped"
        raise card.fault("propulsion", problem, "add [propulsion] to the card")
    sizes = tuple(product((0.3, 1.0), (1, -1)))
    sway = {(v, side): -side * value_at(model, "force.Y", {"motion.v": side * v}) for v, side in sizes}
    yaw = {(v, side): -side * value_at(model, "force.N", {"motion.r": side * 2 * v / length}) for v, side in sizes}
    for words, found, lever in (("sway", sway, 1.0), ("yaw", yaw, length / 8)):
        drag = [force / (pressure * lever * v**2) for (v, _), force in found.items()]
        if not all(_LEAST_DRAG <= value <= _LARGEST_DRAG for value in drag):
            problem = f"damp {words} with drag coefficients of {min(drag):.3g} to {max(drag):.3g} at 0.3 to 1 m/s"
            remedy = (
                "a hull has about 1, and the case's controller cannot hold others: give cross_flow_drag, or low_speed"
            )
            raise card.fault("derivatives", problem, remedy)
    mass, inertia = _inertia(card)
    return sway[0.3, 1] / (mass * 0.3), yaw[0.3, 1] / (inertia * 0.6 / length)


def _groups(described: Interface) -> tuple[Group, ...]:
    """The groups of the case's hull, in the order in which the case joins their variables."""

    def group(kind: str, name: str, *members: str, groups: tuple[Group, ...] = ()) -> Group:
        return Group(kind, name, tuple((described.by_name[member], "") for member in members), groups)

    position = (
        group("LinearDisplacement", "position_linear", "q[1]", "q[2]"),
        group("AngularDisplacement", "position_angular", "q[3]"),
    )
    # The allocation of the case has the tunnel's force in a group of moments; only the place counts.
    thrust = (
        group("Force", "thrust_main", "Thrust_d[1]", "Thrust_d[2]"),
        group("Force", "thrust_bow", "Thrust_d[3]"),
    )
    return (
        group("Generic", "position", groups=position),
        group("Generic", "thrust", groups=thrust),
        group("AngularDisplacement", "azimuthAngle", "input[1]", "input[2]"),
    )


_USE = """Copy the files into a copy of the folder `dp-ship` of the demo cases of the Open Simulation Platform, over its
`OspSystemStructure.xml` and `SystemStructure.ssd`. Open the folder with `cosim` or the demo application:

```text
cosim run OspSystemStructure.xml --duration 600
```

`hull.fmu` (FMI 2, Co-Simulation) takes the place of `OSOM.fmu`: forces of the two azimuth thrusters `Thrust_d[1]`,
`Thrust_d[2]` (N) at angles `input[1]`, `input[2]` (rad, from ahead to starboard), force of the bow tunnel `Thrust_d[3]`
(N, to starboard); north, east (m) and heading (rad, not wrapped) `q[1]`, `q[2]`, `q[3]`. All start at zero, steps are
of 0.04 s. Way-points are inputs of the Reference Generator (`x_wp`, `x_tp`, ...), as in the case's scenarios.

`tank2sim check hull.fmu --for osp` looks at its description and groups. It has the variables of the case and not of
the card: the two cannot be compared."""


VESSEL = "VesselModel"
"""Name of the model and stem of its files, as in the case."""

_PLANE = (1, 2, 6)
_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")

# Variable and group of the case -> kinds and units of its linear and its angular half.
_INPUTS = {
    "Thrust": ("thrust", "Force", "N", "Torque", "N.m"),
    "Wave_Forces": ("wave_forces", "Force", "N", "Torque", "N.m"),
    "Current_Velocity": ("current_velocity", "LinearVelocity", "m/s", "AngularVelocity", "rad/s"),
}
_OUTPUTS = {
    "Vessel_Position": ("position", "LinearDisplacement", "m", "AngularDisplacement", "rad"),
    "Vessel_Velocity": ("velocity", "LinearVelocity", "m/s", "AngularVelocity", "rad/s"),
    "Vessel_Acceleration": ("acceleration", "LinearAcceleration", "m/s2", "AngularAcceleration", "rad/s2"),
}


def gunnerus_files(card: Card) -> ProgramFiles:
    """The hull of the case gunnerus-dp: FMU and groups of variables.

    Raises InputError: As :func:`.osp_files`.
    """
    ship = card.steered()
    files, damping = _hull_files(ship, gunnerus_model(ship), gunnerus_groups)
    return ProgramFiles(
        files=files,
        use=f"""Put both files into `gunnerus-dp/fmus` of the demo cases of the Open Simulation Platform, in place of
`{VESSEL}.fmu` and its description. Steps are of 0.1 s; all variables start at zero.""",
        losses=(
            "gains of the case belong to the R/V Gunnerus: set the controller's for this ship",
            "heave, roll and pitch are zero",
            "the current is taken in the ship's axes, because the case calls its first member surge",
            damping,
        ),
    )


def _members(variable: str, linear: str, _: str, angular: str) -> Iterator[tuple[str, str, str]]:
    """Names, units and descriptions of the six members of a variable of the case, by its units."""
    for place, axis in enumerate(_AXES, 1):
        yield f"{variable}[{place}]", linear if place < 4 else angular, f"{variable} in {axis}"


def gunnerus_model(card: SteeredCard) -> Model:
    """The model of a card at rest with the names of the case."""
    model = resting_model(card, VESSEL)
    inputs = {
        name: Input(name=name, unit=unit, description=text)
        for variable, (_, _, *units) in _INPUTS.items()
        for name, unit, text in _members(variable, *units)
    }
    along, across = (inputs[f"Current_Velocity[{place}]"].symbol for place in (1, 2))
    place = model.symbols(["motion.x", "motion.y", "motion.psi"])
    velocity = model.symbols(["motion.u", "motion.v", "motion.r"]) + ca.vertcat(along, across, 0)
    acceleration = model.symbols(["motion.udot", "motion.vdot", "motion.rdot"])
    outputs = []
    for (variable, (_, _, *units)), values in zip(_OUTPUTS.items(), (place, velocity, acceleration), strict=True):
        six = ca.SX.zeros(6)
        six[[axis - 1 for axis in _PLANE]] = values
        outputs += [
            Quantity(name=name, unit=unit, description=text, value=ca.SX(value))
            for (name, unit, text), value in zip(_members(variable, *units), ca.vertsplit(six), strict=True)
        ]
    X, Y, N = (inputs[f"Thrust[{axis}]"].symbol + inputs[f"Wave_Forces[{axis}]"].symbol for axis in _PLANE)
    psi = model.symbol("motion.psi")
    moved = (
        model.extend(*inputs.values(), *outputs, outputs=[one.name for one in outputs])
        .redefine("motion.xdot", lambda rate: rate + along * ca.cos(psi) - across * ca.sin(psi))
        .redefine("motion.ydot", lambda rate: rate + along * ca.sin(psi) + across * ca.cos(psi))
    )
    return with_forces(moved, X=X, Y=Y, N=N)


def gunnerus_groups(described: Interface) -> tuple[Group, ...]:
    """The groups of the case: six variables each, and the outputs of the plane alone as well."""

    def group(variable: str, name: str, kinds: tuple[str, str], places: tuple[int, ...]) -> Group:
        parts = {"linear": [one for one in places if one < 4], "angular": [one for one in places if one > 3]}
        return Group(
            "Generic",
            name,
            groups=tuple(
                Group(kind, f"{name}_{part}", tuple((described.by_name[f"{variable}[{one}]"], "") for one in members))
                for kind, (part, members) in zip(kinds, parts.items(), strict=True)
            ),
        )

    every, found = tuple(range(1, 7)), []
    for variable, (name, first, _, second, _) in _INPUTS.items():
        found.append(group(variable, name, (first, second), every))
    for variable, (name, first, _, second, _) in _OUTPUTS.items():
        found.append(group(variable, f"{name}_6dof", (first, second), every))
        found.append(group(variable, f"{name}_3dof", (first, second), _PLANE))
    return tuple(found)
