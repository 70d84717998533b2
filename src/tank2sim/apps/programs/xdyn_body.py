"""Equations of a ship or craft in the plane as xdyn has them, and read back from their text.

xdyn adds -C_RB nu of the rigid body by itself, and no C_A. So X, Y and N are the right-hand sides of the card's model
without what xdyn adds: exact whatever the card's conventions are. Where the added masses are not symmetric, or an
effect acts on accelerations, X, Y and N are the written matrix times the accelerations of the model.

A ship that rolls (:mod:`tank2sim.dynamics.roll`) heels about the axis of x alone: psi' = r cos(phi), v along the heeled
axis of y, no pitch and no heave. A body of xdyn that turns with a blocked pitch rate q does not stay level, for theta'
= q cos(phi) - r sin(phi). So w and q follow the heel, v and r of xdyn are

    v = V cos^2(phi),  w = -V sin(phi) cos(phi),  r = R cos^2(phi),  q = R sin(phi) cos(phi)

with V and R of the card, and X to N are the written mass times the accelerations that follow. Rounding is held off by a
spring and a damper in Z and M.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.apps.programs.xdyn_expressions import XDYN_STATES, Definitions, read_expressions
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, SteeredCard
from tank2sim.dynamics.hull import Hull, prime_motion
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Quantity, Variable
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.simulation.trajectory import Trajectory

LEVELLING = 0.5
"""Natural frequency (rad/s) of depth and pitch of a body that is not level: project choice, slow against the step."""

ROLLED_STATES = {name: f"{name}(t)" for name in ("v", "w", "q", "r", "theta", "z")}
"""States of xdyn that the card's ship has not, or has in other axes, to their spelling."""


def rolled_motion(s: dict[str, ca.SX], phi: ca.SX) -> tuple[ca.SX, ca.SX]:
    """V and R of the card from xdyn's v, w, q, r and the heel."""
    upright, heeled = ca.cos(phi), ca.sin(phi)
    return s["v"] - s["w"] * heeled / upright, s["r"] + s["q"] * heeled / upright


def level_motion(V: ca.SX, R: ca.SX, phi: ca.SX) -> dict[str, ca.SX]:
    """xdyn's states of a level ship from V and R of the card and the heel."""
    upright, heeled = ca.cos(phi), ca.sin(phi)
    found = {"v": V * upright**2, "w": -V * heeled * upright, "r": R * upright**2, "q": R * heeled * upright}
    return found | {"theta": ca.SX(0), "z": ca.SX(0)}


def rolled_forces(model: Model, s: dict[str, ca.SX], rigid: Array, total: Array) -> dict[str, ca.SX]:
    """X, Y, Z (N), K, M, N (N m) of xdyn's `s` for diagonal matrices `rigid` and `total` (6,)."""
    names = ("motion.u", "motion.v", "motion.r", "motion.phi", "motion.p")
    u, V, R, phi, p = (model.symbol(name) for name in names)
    udot, Vdot, Rdot, pdot = (model.symbol(f"motion.{name}dot") for name in "uvrp")
    level = level_motion(V, R, phi)
    changes = ca.vertcat(V, R, phi), ca.vertcat(Vdot, Rdot, p)
    rate = {name: ca.jtimes(level[name], *changes) for name in "vwrq"}
    sinking = s["v"] * ca.sin(phi) + s["w"] * ca.cos(phi)
    pitching = s["q"] * ca.cos(phi) - s["r"] * ca.sin(phi)
    rate["w"] -= 2 * LEVELLING * sinking + LEVELLING**2 * s["z"]
    rate["q"] -= 2 * LEVELLING * pitching + LEVELLING**2 * s["theta"]
    rates = [udot, rate["v"], rate["w"], pdot, rate["q"], rate["r"]]
    moved = ca.vertcat(*(float(mass) * value for mass, value in zip(total, rates, strict=True)))
    forces = moved - by_xdyn(rigid, u, p, s)
    return dict(zip("XYZKMN", ca.vertsplit(forces), strict=True))


def by_xdyn(rigid: Array, u: ca.SX, p: ca.SX, s: dict[str, ca.SX]) -> ca.SX:
    """-C_RB nu (6,) of a diagonal matrix `rigid` (6,) with one mass: what xdyn adds."""
    mass, (x, y, z) = float(rigid[0]), (float(value) for value in rigid[3:])
    v, w, q, r = (s[name] for name in "vwqr")
    return ca.vertcat(
        mass * (v * r - w * q),
        mass * (w * p - u * r),
        mass * (u * q - v * p),
        (y - z) * q * r,
        (z - x) * r * p,
        (x - y) * p * q,
    )


def rolled_rates(model: Model, forces: ca.SX, rigid: Array, total: Array) -> dict[str, ca.SX]:
    """``udot``, ``vdot``, ``pdot``, ``rdot`` of a model's level ship by xdyn's `forces` (6,)."""
    names = ("motion.u", "motion.v", "motion.r", "motion.phi", "motion.p")
    u, V, R, phi, p = (model.symbol(name) for name in names)
    level = level_motion(V, R, phi)
    rates = ca.SX(ca.DM(1 / np.asarray(total))) * (forces + by_xdyn(rigid, u, p, level))
    found = {"udot": rates[0], "pdot": rates[3]}
    for name, row, value in (("v", 1, V), ("r", 5, R)):
        slope = ca.jacobian(level[name], value)
        found[f"{name}dot"] = (rates[row] - ca.jacobian(level[name], phi) * p) / slope
    return found


# First parts of the names of inputs that are orders; all others are constants of the file
_ORDERS = ("rudder.", "propeller.", "thrusters.")


_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])  # Surge, sway and yaw among u v w p q r
_ROLL_RADIUS = 0.05  # Radius of roll over L where it is blocked: xdyn asks for an inertia and does not use it


@dataclass(frozen=True)
class XdynBody:
    """Equations of a body in the plane, as xdyn has them."""

    # `rigid`, `added`: (6, 6): Mass matrices in the order u v w p q r about midships, kg, kg m, kg m2
    rigid: Array
    added: Array
    # Name to expression, each in names before it; X to N are the forces (N, N m), 0 where they are missing
    texts: Mapping[str, str]
    data: Mapping[str, tuple[Variable, float]]  # Name to the model's variable and its value
    commands: Mapping[str, Variable]  # Name to the variable that is a command
    density: float  # kg/m3; ``rho`` in the expressions
    blocked: str  # States that are held at zero


def values_at(model: Model, names: Sequence[str], run: Trajectory) -> Array:
    """Variables of a model (n, names) at the rows of a run."""
    values = model.expand(model.symbols(names))
    function = ca.Function("at", [model.x, model.u, model.p], [values])
    columns = function(run.x.T, run.u.T, ca.repmat(ca.DM(model.parameter_values()), 1, len(run.t)))
    return np.array(columns).T


def written_body(card: SteeredCard, model: Model, run: Trajectory) -> XdynBody:
    """The equations of a model, checked at the rows of a run."""
    values = model.defaults
    rigid, stated = _masses(model, values, run)
    total = (stated + stated.T) / 2
    states: dict[str, ca.SX] = {}
    if "motion.phi" in model:
        rigid, total, blocked = np.diag(np.diag(rigid)), np.diag(np.diag(total)), ""
        states = {name: ca.SX.sym(name) for name in ROLLED_STATES}
        wanted = rolled_forces(model, states, np.diag(rigid), np.diag(total))
    else:
        blocked = "wpq"
        forces = _planar_forces(model, run, stated[_PLANAR], total[_PLANAR])
        wanted = dict(zip("XYN", ca.vertsplit(forces), strict=True))
    model = model.with_constants(name for name, value in values.items() if value == 0 and name != "ship.x_G")
    texts, data, commands = _written(card, model, wanted, states, values)
    return XdynBody(rigid, total - rigid, texts, data, commands, values["ship.water_density"], blocked)


def _masses(model: Model, values: Mapping[str, float], run: Trajectory) -> tuple[Array, Array]:
    """M_RB and its sum with the added masses (6, 6), which need not be symmetric; heave, roll and pitch are guessed."""
    names = [f"inertia.{name}" for name in ("surge", "sway", "sway_yaw", "yaw_sway", "yaw")]
    surge, sway, sway_yaw, yaw_sway, yaw = values_at(model, names, run)[0]
    mass, lever, length = values["ship.mass"], values["ship.mass"] * values["ship.x_G"], values["ship.length"]
    roll = values.get("ship.roll_inertia", mass * (_ROLL_RADIUS * length) ** 2)
    # Any yaw inertia does, for the sum alone acts: xdyn wants a matrix that is positive.
    own = max(values["ship.yaw_inertia"], 1.1 * lever**2 / mass)
    rigid = np.diag([mass, mass, mass, roll, own, own])
    rigid[1, 5] = rigid[5, 1] = lever
    stated = np.diag([surge, sway, mass, roll, own, yaw])
    stated[1, 5], stated[5, 1] = sway_yaw, yaw_sway
    return rigid, stated


def _planar_forces(model: Model, run: Trajectory, stated: Array, total: Array) -> ca.SX:
    """X, Y, N of xdyn for the mass matrices (3, 3) of the card and of the file."""
    forces, rates = [f"force.{name}" for name in "XYN"], [f"motion.{name}dot" for name in "uvr"]
    acting, moving = values_at(model, forces, run), values_at(model, rates, run) @ stated.T
    if np.allclose(acting, moving, rtol=0, atol=1e-9 * np.abs(acting).max()):
        share, names = np.eye(3) if np.array_equal(stated, total) else total @ np.linalg.inv(stated), forces
    else:  # an effect acts on accelerations
        share, names = total, rates
    known = (model.symbol(name) for name in ("ship.mass", "ship.x_G", "motion.u", "motion.v", "motion.r"))
    return ca.sparsify(ca.DM(share)) @ model.symbols(names) - ca.vcat(inertial_forces(*known))


def _needed(model: Model, names: Iterable[str]) -> tuple[list[Quantity], list[Variable]]:
    """Quantities on which `names` depend, each after what it uses, and the other variables."""
    quantities: dict[str, Quantity] = {}
    others: dict[str, Variable] = {}

    def visit(name: str) -> None:
        variable = model[name]
        if not isinstance(variable, Quantity):
            others[name] = variable
        elif name not in quantities:
            for used in variable.uses.values():
                visit(used)
            quantities[name] = variable

    for name in names:
        visit(name)
    return list(quantities.values()), list(others.values())


def _motion_terms(card: SteeredCard, model: Model) -> dict[str, ca.SX]:
    """v', r' and Du' of a ship by name, the variables of its polynomial."""
    if not isinstance(card, ManoeuvringCard):
        return {}
    symbols = {variable.name: variable.symbol for variable in model.variables}
    hull = Hull(card.model.kind == "linear", card.model.speed_scale == "nominal", False, symbols)
    speed = hull["ship.speed"] if hull.linear or hull.nominal_scale else hull.speed
    return dict(zip(("vp", "rp", "du"), prime_motion(hull, speed), strict=True))


def _clocks(model: Model) -> set[str]:
    """States that are the time."""
    return {one.name for one in model.states if ca.is_equal(model.expand(model.symbol(one.derivative)), ca.SX(1))}


def _written(
    card: SteeredCard, model: Model, wanted: Mapping[str, ca.SX], states: dict[str, ca.SX], values: Mapping[str, float]
) -> tuple[dict[str, str], dict[str, tuple[Variable, float]], dict[str, Variable]]:
    """Expressions by name, with the data and commands that they use; `states` belong to a ship that rolls."""
    terms = _motion_terms(card, model)
    beforehand = ("motion.speed", "low_speed.share") if terms else ()
    symbols = ca.symvar(ca.vcat([*terms.values(), *wanted.values()]))
    quantities, others = _needed(model, [*beforehand, *(one.name() for one in symbols if one.name() in model)])
    found = Definitions()
    fixed = XDYN_STATES | dict.fromkeys(_clocks(model), "t") | {"ship.water_density": "rho"}
    named: dict[str, ca.SX] = {}
    if states:
        sway, turning = found.new_name("sway"), found.new_name("turning")
        fixed |= {"motion.v": sway, "motion.r": turning}
        named = dict(zip((sway, turning), rolled_motion(states, model.symbol("motion.phi")), strict=True))
    variables = (*others, *quantities)
    spelt = {one.name: fixed.get(one.name) or found.new_name(one.name) for one in variables}
    definitions = {spelt[one.name]: one.value for one in quantities}
    named |= {spelt[name]: definitions[spelt[name]] for name in beforehand}
    named |= {found.new_name(name): value for name, value in terms.items()}
    named |= definitions
    numbers = {spelt[one.name]: values[one.name] for one in others if one.name in values}
    every = [*(one.symbol for one in variables), *states.values()]
    spellings = [*spelt.values(), *(ROLLED_STATES[name] for name in states)]
    found.add(every, spellings, {**named, **wanted}, numbers)
    words = found.used_by(wanted)
    used = {spelt[one.name]: one for one in others if spelt[one.name] in words and one.name not in fixed}
    texts = {name: text for name, text in found.texts.items() if name in words}
    return texts, *_data_and_commands(used, model, values)


def _data_and_commands(
    used: Mapping[str, Variable], model: Model, values: Mapping[str, float]
) -> tuple[dict[str, tuple[Variable, float]], dict[str, Variable]]:
    """Variables by their spellings: those with a known value, and the orders."""
    known = {one.name: one.start for one in model.inputs if not one.name.startswith(_ORDERS)} | dict(values)
    data = {name: (one, known[one.name]) for name, one in used.items() if one.name in known}
    return data, {name: one for name, one in used.items() if name not in data}


def _at_any_time(value: ca.SX, _: ca.SX) -> ca.SX:
    return value


def read_back(model: Model, body: XdynBody) -> Model:
    """The model with the motion that follows from the body's text, without a current."""
    symbols = {
        spelling.removesuffix("(t)"): model.symbol(name) for name, spelling in XDYN_STATES.items() if name in model
    }
    rolls = not body.blocked
    seen = symbols | (level_motion(symbols["v"], symbols["r"], symbols["phi"]) if rolls else {})
    known: dict[str, Any] = {name: partial(_at_any_time, value) for name, value in seen.items()}
    known |= {name: value for name, (_, value) in body.data.items()} | {"rho": body.density}
    known |= {name: variable.symbol for name, variable in body.commands.items()}
    known["t"] = next((model.symbol(clock) for clock in _clocks(model)), ca.SX(0))
    read = read_expressions(body.texts, known)
    forces, total = ca.vcat([read.get(name, ca.SX(0)) for name in "XYZKMN"]), body.rigid + body.added
    u, v, r, psi = (symbols[name] for name in ("u", "v", "r", "psi"))
    if rolls:
        values = rolled_rates(model, forces, np.diag(body.rigid), np.diag(total))
        v, r = v * ca.cos(symbols["phi"]), r * ca.cos(symbols["phi"])
    else:
        mass, lever = body.rigid[0, 0], body.rigid[1, 5]
        planar = forces[[0, 1, 5]] + ca.vcat(inertial_forces(mass, lever / mass, u, v, r))
        rates = ca.DM(np.linalg.inv(total[_PLANAR])) @ planar
        values = dict(zip(("udot", "vdot", "rdot"), ca.vertsplit(rates), strict=True))
    values |= dict(zip(("xdot", "ydot"), earth_velocity(u, v, psi), strict=True)) | {"psidot": r}
    for name, value in values.items():
        model = model.redefine(f"motion.{name}", partial(_at_any_time, value))
    return model
