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

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.apps.programs.program_files import ProgramFiles
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
        CasePart("DP Controller", "DPController.fmu", _rounded(gains)),
        CasePart("Observer", "NLPobserver.fmu"),
        CasePart("Reference Generator", "ReferenceGenerator.fmu"),
        CasePart("Thrust Allocation", "ThMPC.fmu", _rounded(allocation)),
        CasePart("Ship", hull),
    ]
    axes = ("x", "y", "psi")
    joints = []
    for ends, names in (
        (("Thrust Allocation", "Ship"), [(f"F{place}c", f"Thrust_d[{place}]") for place in (1, 2, 3)]),
        (("Thrust Allocation", "Ship"), [(f"alpha{place}", f"input[{place}]") for place in (1, 2)]),
        (("Ship", "Observer"), [(f"q[{place}]", f"y[{place}]") for place in (1, 2, 3)]),
        (("Observer", "DP Controller"), [(f"y_hat[{place}]", axis) for place, axis in enumerate(axes, 1)]),
        (("Observer", "DP Controller"), [(f"v_hat[{place}]", f"d{axis}") for place, axis in enumerate(axes, 1)]),
        (("Reference Generator", "DP Controller"), [(f"{d}{axis}_ref",) * 2 for d, axis in product(("", "d"), axes)]),
        (("DP Controller", "Thrust Allocation"), [(f"Control{axis}", f"ref{axis}") for axis in ("x", "y", "Mz")]),
    ):
        joints += [CaseJoint(ends[0], start, ends[1], end) for start, end in names]
    ratios = _rounded({"Fxg": 1 / by_mass, "Fyg": 1 / by_mass, "Mzg": 1 / by_inertia})
    for place, (name, factor) in enumerate(ratios.items(), 1):
        joints.append(CaseJoint("Thrust Allocation", name, "Observer", f"tau[{place}]", factor))
    return parts, joints


def _rounded(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.6g}") for name, value in values.items()}


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
    model, (mass, inertia) = hull_model(ship), _inertia(ship)
    sway, yaw = low_speed_damping(ship, model)
    made = make_fmu(model, fmi=2, documents=replace(documents_of(ship), card_text=None))
    parts, joints = case_system(f"{HULL}.fmu", ship.ship.length_m, mass, inertia)
    values = {"parts": parts, "joints": joints, "step": CASE_STEP_S, "version": version("tank2sim")}
    return ProgramFiles(
        files={
            f"{HULL}.fmu": made.content,
            f"{HULL}_OspModelDescription.xml": render("OspModelDescription.xml", {"groups": _groups(interface(model))}),
            "OspSystemStructure.xml": render("OspCaseStructure.xml", values),
            "SystemStructure.ssd": render("OspCase.ssd.xml", values),
        },
        use=_USE,
        losses=(
            f"gains and limits of the case are scaled, to {mass / CASE_INERTIA[0]:.3g} times its mass and "
            f"{ship.ship.length_m:.4g} m; this was not run with the FMUs of the case",
            f"the hull damps sway at 0.3 m/s by {sway:.2g} 1/s, and yaw by {yaw:.2g} 1/s with that at its ends; a hull "
            "of 2365 t with 0.18 and 0.46 1/s stayed within 2 m, and with a sixth it swung by 20 to 40 m",
            "rudder and propellers of the card stay as inputs, at zero: the case's thrusters move the ship",
            "waves and current of the case are in its own hull: give them to this one by effects of the card",
        ),
    )


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
    words = ("port azimuth thruster", "starboard azimuth thruster", "bow tunnel thruster, positive to starboard")
    thrusts = [
        Input(name=f"Thrust_d[{place}]", unit="N", description=f"Force of the {text}", nominal=force)
        for place, text in enumerate(words, 1)
    ]
    angles = [
        Input(name=f"input[{place}]", unit="rad", description=f"Angle of the {text}, from ahead to starboard")
        for place, text in enumerate(words[:2], 1)
    ]
    forces = [
        (one.symbol * ca.cos(angle.symbol), one.symbol * ca.sin(angle.symbol))
        for one, angle in zip(thrusts, angles, strict=False)
    ]
    forces.append((ca.SX(0), thrusts[2].symbol))
    moments = [scale * (x * Y - y * X) for (x, y), (X, Y) in zip(CASE_PLACES_M, forces, strict=True)]
    outputs = [
        Quantity(name=f"q[{place}]", unit=unit, description=text, value=model.symbol(name))
        for place, (name, unit, text) in enumerate(
            (
                ("motion.x", "m", "North position"),
                ("motion.y", "m", "East position"),
                ("motion.psi", "rad", "Heading, not wrapped"),
            ),
            1,
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
    names = [f"force.{letter}" for letter in "XYN"]
    function = ca.Function(
        "forces", [model.x, model.u, model.p], [model.expand(ca.vcat([model.symbol(name) for name in names]))]
    )

    def forces(**motion: float) -> Any:
        x = np.array(model.initial(model.parameter_values())).ravel()
        for letter, value in motion.items():
            x[model.state_names.index(f"motion.{letter}")] = value
        return np.array(function(x, model.input_values(), model.parameter_values())).ravel()

    still = abs(forces()[0])
    weight = card.body_si["mass"] * card.environment.gravity_mps2
    if "propeller.speed" not in model.input_names and still > _STILL_PUSH * weight / 100:
        problem = f"is missing, and the ship pushes itself with {still:.3g} N at rest: its engine cannot be stopped"
        raise card.fault("propulsion", problem, "add [propulsion] to the card")
    sizes = tuple(product((0.3, 1.0), (1, -1)))
    sway = {(v, side): -side * forces(v=side * v)[1] for v, side in sizes}
    yaw = {(v, side): -side * forces(r=side * 2 * v / length)[2] for v, side in sizes}
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
    model = gunnerus_model(ship)
    sway, yaw = low_speed_damping(ship, model)
    made = make_fmu(model, fmi=2, documents=replace(documents_of(ship), card_text=None))
    return ProgramFiles(
        files={
            f"{VESSEL}.fmu": made.content,
            f"{VESSEL}_OspModelDescription.xml": render(
                "OspModelDescription.xml", {"groups": gunnerus_groups(interface(model))}
            ),
        },
        use=f"""Put both files into `gunnerus-dp/fmus` of the demo cases of the Open Simulation Platform, in place of
`{VESSEL}.fmu` and its description. Steps are of 0.1 s; all variables start at zero.""",
        losses=(
            "gains of the case belong to the R/V Gunnerus: set the controller's for this ship",
            "heave, roll and pitch are zero",
            "the current is taken in the ship's axes, because the case calls its first member surge",
            f"the hull damps sway at 0.3 m/s by {sway:.2g} 1/s, and yaw by {yaw:.2g} 1/s with that at its ends",
        ),
    )


def gunnerus_model(card: SteeredCard) -> Model:
    """The model of a card at rest with the names of the case."""
    model = resting_model(card, VESSEL)
    inputs = {
        f"{name}[{place}]": Input(
            name=f"{name}[{place}]", unit=first if place < 4 else second, description=f"{name} in {axis}"
        )
        for name, (_, _, first, _, second) in _INPUTS.items()
        for place, axis in enumerate(_AXES, 1)
    }
    along, across = (inputs[f"Current_Velocity[{place}]"].symbol for place in (1, 2))
    shown = {
        "Vessel_Position": [model.symbol(f"motion.{name}") for name in ("x", "y", "psi")],
        "Vessel_Velocity": [
            model.symbol("motion.u") + along,
            model.symbol("motion.v") + across,
            model.symbol("motion.r"),
        ],
        "Vessel_Acceleration": [model.symbol(f"motion.{name}") for name in ("udot", "vdot", "rdot")],
    }
    outputs = []
    for name, (_, _, first, _, second) in _OUTPUTS.items():
        values = dict(zip(_PLANE, shown[name], strict=True))
        outputs += [
            Quantity(
                name=f"{name}[{place}]",
                unit=first if place < 4 else second,
                description=f"{name} in {axis}",
                value=ca.SX(values.get(place, 0.0)),
            )
            for place, axis in enumerate(_AXES, 1)
        ]
    X, Y, N = (sum(inputs[f"{name}[{place}]"].symbol for name in ("Thrust", "Wave_Forces")) for place in _PLANE)
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
