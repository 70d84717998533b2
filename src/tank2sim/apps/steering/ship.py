"""The ship in a page: the equations of the model as JavaScript, and the numbers that the page needs to steer it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from tank2sim.apps.bridge.study import ORDERS_AHEAD, SHARES
from tank2sim.dynamics.autopilot_loop import AUTOPILOT_ORDER
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Input, Model, Variable
from tank2sim.fmu.interface import interface
from tank2sim.native.javascript import javascript_function
from tank2sim.simulation.manoeuvres import FULL_ASTERN
from tank2sim.simulation.thruster_manoeuvres import thruster_commands, thruster_sides
from tank2sim.simulation.trajectory import TIMES_BEYOND
from tank2sim.units import UNITS, from_si

UNBOUNDED = 1e300
"""Bound of a variable without one."""

_LARGEST_RUDDER = math.radians(35.0)
"""End of the rudder slider where a card states no largest angle: the hard-over of IMO MSC.137(76)."""

MOST_AHEAD, MOST_ASTERN = 1.2, -1.0
"""Ends of the engine slider, in nominal revolutions. Project choice: the little overload that engines allow, and as
much astern as ahead."""

GHOST_STEERS, GHOST_RATE = "ghost.steers", "ghost.rudder_rate"
"""Inputs of a model that can follow a measured rudder (:func:`ship_following_angle`)."""

COURSE = "heading.command"
"""Input of the autopilot in the page."""

_SMALL = {"deg": 1.0, "knots": 0.1, "rpm": 1.0}
"""By what a control moves at a time, in the unit shown. Project choice."""


@dataclass(frozen=True, kw_only=True)
class Control:
    """An input that the user sets: `factor` times its SI value is shown in `unit`; bounds are in that unit."""

    name: str
    label: str
    unit: str
    factor: float
    start: float
    step: float
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True, kw_only=True)
class TelegraphOrder:
    """An order of the engine telegraph: its revolutions (rad/s, negative astern), and the button's words and column."""

    name: str
    short: str
    side: str
    column: int
    value: float

    @property
    def rpm(self) -> float:
        """Revolutions, rpm."""
        return from_si("n_rpm", self.value)


@dataclass(frozen=True, kw_only=True)
class Thruster:
    """A fixed thruster of a craft: its input, the side to which it turns the craft when it pushes ahead (1 starboard,
    -1, or 0), and the bounds of its orders, rad/s."""

    name: str
    label: str
    side: float
    minimum: float
    maximum: float


def thrusters_of(model: Model) -> list[Thruster]:
    """Thrusters that push a craft ahead, if they steer it by their difference; else none."""
    sides = thruster_sides(model)
    if not {1.0, -1.0} <= set(sides.values()):
        return []
    found = []
    for command in thruster_commands(model):
        if command.name in sides:
            assert command.minimum is not None and command.maximum is not None
            bounds = {"minimum": command.minimum, "maximum": command.maximum}
            found.append(Thruster(name=command.name, label=_label(command.name), side=sides[command.name], **bounds))
    return found


def levers_of(model: Model) -> list[Control]:
    """The two levers over all thrusters of a craft: what they have in common, and port less starboard; rpm."""
    thrusters = thrusters_of(model)
    if not thrusters:
        return []
    rpm = from_si("n_rpm", 1.0)
    low, high = max(one.minimum for one in thrusters) * rpm, min(one.maximum for one in thrusters) * rpm
    shared: dict[str, Any] = {"unit": "rpm", "factor": rpm, "step": _SMALL["rpm"], "start": 0.0}
    return [
        Control(name="surge", label="Both thrusters", minimum=low, maximum=high, **shared),
        Control(name="turn", label="Turn", minimum=low - high, maximum=high - low, **shared),
    ]


def telegraph_of(model: Model) -> list[TelegraphOrder]:
    """Orders of the telegraph from full astern to full sea speed; empty without an engine.

    Names and shares of the nominal revolutions are as on the wheelhouse poster; full astern is
    :data:`tank2sim.simulation.manoeuvres.FULL_ASTERN` of the nominal revolutions, and the orders below it have the
    shares of full astern that those ahead have of full ahead.
    """
    if "propeller.speed" not in model.input_names:
        return []
    nominal = model["propeller.speed"]
    assert isinstance(nominal, Input)
    sea, *harbour = zip(ORDERS_AHEAD, SHARES, strict=True)
    full = harbour[0][1]
    astern, ahead = [], []
    for column, (name, share) in enumerate(reversed(harbour), start=2):
        short = name.removesuffix(" ahead")
        value = nominal.start * share
        ahead.append(TelegraphOrder(name=name, short=short, side="ahead", column=column, value=value))
        back = -nominal.start * FULL_ASTERN * share / full
        astern.append(TelegraphOrder(name=f"{short} astern", short=short, side="astern", column=column, value=back))
    stop = TelegraphOrder(name="Stop", short="Stop", side="", column=1, value=0.0)
    fastest = TelegraphOrder(
        name=sea[0], short="Sea", side="ahead", column=len(ahead) + 2, value=nominal.start * sea[1]
    )
    return [*reversed(astern), stop, *ahead, fastest]


def ship_equations(model: Model) -> str:
    """The equations of a model as JavaScript: an object `EQUATIONS` of functions that fill their last argument.

    ``constants(p, c)`` are the terms of the parameters alone, ``rates(x, u, p, c, d)``, ``outputs(x, u, p, y)`` and
    ``initial(p, x)`` as in the FMU, and ``trimmed(x, u, p, next)`` is a step of Newton's method to steady motion.

    Parameters
    ----------
    model : Model
    """
    x, u, p = model.x, model.u, model.p
    shorter, symbols, values = ca.extract_parametric(model.rates, p)
    none = ca.SX(0, 1)
    constants = ca.vertcat(none, *symbols)
    functions: dict[str, tuple[list[ca.SX], ca.SX]] = {
        "constants": ([p], ca.vertcat(none, *values)),
        "rates": ([x, u, p, constants], shorter),
        "outputs": ([x, u, p], model.output(x, u, p)),
        "initial": ([p], model.initial(p)),
    }
    if model.trim_step is not None:
        functions["trimmed"] = ([x, u, p], model.trim_step(x, u, p))
    texts = [
        javascript_function(ca.Function(name, arguments, [ca.densify(result)], {"cse": True}), name)
        for name, (arguments, result) in functions.items()
    ]
    return f"const EQUATIONS = (() => {{\n{''.join(texts)}return {{{', '.join(functions)}}};\n}})();\n"


def ship_tables(model: Model, drawn: Iterable[str] = ()) -> dict[str, Any]:
    """Numbers that :func:`ship_equations` need: places of the variables by name, starts, and bounds.

    Parameters
    ----------
    model : Model
    drawn : iterable of str
        Parameters in which the members of a page differ.
    """
    places = _places(model, drawn)
    described = interface(model)
    set_by_page = (described.by_name[name] for name, (block, _) in places.items() if block in "up")
    bounds = {each.name: each.accepted or (each.minimum, each.maximum) for each in set_by_page}
    return {
        "places": places,
        "bounds": {name: list(map(_bound, ends, (-UNBOUNDED, UNBOUNDED))) for name, ends in bounds.items()},
        "inputs": model.input_values().tolist(),
        "parameters": model.parameter_values().tolist(),
        "constants": ca.vertcat(ca.SX(0, 1), *ca.extract_parametric(model.rates, model.p)[1]).numel(),
        "outputs": len(model.outputs),
        "limits": [TIMES_BEYOND * UNITS[state.unit].extent for state in model.states],
        "nominal": [state.nominal for state in model.states],
        "trimSwitch": model.parameter_names.index("initial.trim") if "initial.trim" in model.parameter_names else None,
    }


def _bound(value: float | None, without: float) -> float:
    return without if value is None else value


def _places(model: Model, drawn: Iterable[str]) -> dict[str, tuple[str, int]]:
    """Name of a variable that the page reads or sets to its block (``x``, ``u``, ``p``, ``y``) and its place there."""
    rest = {*model.state_names, *model.input_names, *model.parameter_names}
    blocks = {
        "x": model.state_names,
        "u": model.input_names,
        "p": model.parameter_names,
        "y": [name if name not in rest else "" for name in model.outputs],
    }
    wanted = ("initial.", "motion.", "rudder.", "thrusters.", "steering.failed", "propeller.", "validity")
    named = {*model.input_names, *drawn, AUTOPILOT_ORDER}
    return {
        name: (block, place)
        for block, names in blocks.items()
        for place, name in enumerate(names)
        if name in named or name.startswith(wanted)
    }


def ship_following_angle(model: Model) -> Model:
    """The model of a page whose rudder can follow a measured angle, past the steering gear.

        d(delta)/dt = rate of the gear,  or ``ghost.rudder_rate`` (rad/s) while ``ghost.steers``

    Rates that are constant between readings bring the rudder to each of them exactly, so that the angle is straight
    between them as in :func:`tank2sim.identification.trials.problem.sampled_runs.prepare`.
    """
    steers = Input(name=GHOST_STEERS, unit="1", description="True: the rudder follows a measured angle", boolean=True)
    rate = Input(
        name=GHOST_RATE, unit="rad/s", description="Measured rate of the rudder, positive to starboard", nominal=0.05
    )
    followed = model.extend(steers, rate)
    return followed.redefine("rudder.rate", lambda gear: gear * (1 - steers.symbol) + rate.symbol * steers.symbol)


def controls(model: Model) -> list[Control]:
    """The inputs of a ship that a hand sets: rudder and engine first, then what the card's effects take."""
    others = {GHOST_RATE, COURSE}
    found = [
        _control(model, variable) for variable in model.inputs if not variable.boolean and variable.name not in others
    ]
    first = ("rudder.command", "propeller.speed")
    return sorted(found, key=lambda variable: first.index(variable.name) if variable.name in first else len(first))


def _control(model: Model, variable: Input) -> Control:
    unit, factor = shown_in(variable, "m/s" if thrusters_of(model) and variable.unit == "m/s" else None)
    low, high = _bounds(variable)
    if variable.name == "rudder.command":
        limits = [parameter.start for parameter in model.parameters if parameter.name == "steering.max_angle"]
        high = limits[0] if limits else _LARGEST_RUDDER
        low = -high
    if variable.name == "propeller.speed":
        low, high = MOST_ASTERN * variable.start, MOST_AHEAD * variable.start
    return Control(
        name=variable.name,
        label=_label(variable.name),
        unit=unit,
        factor=factor,
        start=variable.start,
        step=_SMALL.get(unit, 0.1),
        minimum=None if low is None else round(low * factor, 6),
        maximum=None if high is None else round(high * factor, 6),
    )


def _bounds(variable: Input) -> tuple[float | None, float | None]:
    """Bounds of an input, SI: for inputs that an effect takes from its surroundings, the bounds of a card, which the
    model lacks."""
    known = [
        parameter
        for effect in EFFECTS.values()
        for parameter in effect.parameters
        if parameter.input_name == variable.name
    ]
    if not known:
        return variable.minimum, variable.maximum
    lowest = known[0].minimum
    return variable.minimum if callable(lowest) else lowest, known[0].maximum


def _label(name: str) -> str:
    known = {
        "rudder.command": "Rudder",
        "propeller.speed": "Engine",
        "current.direction": "Current towards",
        "wind.direction": "Wind from",
    }
    if name.startswith("thrusters."):
        _, thruster, what = name.split(".")
        words = thruster if what == "command" else f"{thruster} {what.removesuffix('_command')}"
        return words.replace("_", " ").capitalize()
    return known.get(name, name.replace(".", " ").replace("_", " ").capitalize())


def shown_in(variable: Variable, unit: str | None = None) -> tuple[str, float]:
    """The unit in which a reader sees a variable, and its factor; speeds in knots, angles in deg."""
    displays = UNITS[variable.unit].displays
    chosen = unit or variable.display_unit or next(iter(displays), None)
    if chosen is None or chosen not in displays:
        return variable.unit, 1.0
    return chosen, displays[chosen]
