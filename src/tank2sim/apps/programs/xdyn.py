"""A ship or craft as a body of xdyn: its forces as expressions, its mass matrices, and commands for manoeuvres.

``centre of inertia`` is the origin, midships, and m x_G is in the matrix: xdyn then solves the card's own equations.
Heave, roll and pitch are blocked, unless the card's ship rolls (:mod:`tank2sim.apps.programs.xdyn_body`). xdyn gives a
body no states of its own: rudder, engine and whatever else has a lag are commands, with the history of tank2sim's own
run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from tank2sim.apps.programs.program_files import ProgramFiles, figure_changes
from tank2sim.apps.programs.xdyn_body import XdynBody, read_back, values_at, written_body
from tank2sim.arrays import Array
from tank2sim.cards import Card, SteeredBy, SteeredCard
from tank2sim.cards.small_craft import cruising_revolutions
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model, State
from tank2sim.errors import InputError
from tank2sim.escaping import one_line
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, StraightRun
from tank2sim.simulation.trajectory import Trajectory

_TURN_RAD, _ZIGZAG_RAD = math.radians(35.0), math.radians(20.0)

_DIFFERENCE = 0.3
"""Difference of a craft's turn over its cruising revolutions, a wide turn of any craft (project choice)."""

_VISCOSITY = 1.19e-6  # Kinematic viscosity of sea water at 15 degrees, m2/s: xdyn asks for it and does not use it here
# Unit of a command to its unit in the file and the factor to that; any other is SI, and 1 for xdyn
_UNITS = {"rad": ("deg", math.degrees(1.0)), "rad/s": ("rpm", 30 / math.pi)}
_ON_LINE = 1e-9  # Distance from a straight line (SI) below which a row of a table is left out


def xdyn_files(card: Card) -> ProgramFiles:
    """A ship or craft as files of xdyn: ``ship.yml``, and ``turn_commands.yml`` and ``zigzag_commands.yml`` of a ship.

    Raises InputError: The card is none of a ship or craft that manoeuvres, or an effect has no expression in xdyn.
    """
    given = card.steered()
    model = build(given)
    runs = _runs(given, model)
    first = next(iter(runs.values()))
    try:
        body = written_body(given, model, first)
    except ValueError as error:
        raise given.fault("effects", f"cannot be written: {error}", "leave the effect out") from None
    after = read_back(model, body)
    files = {"ship.yml": ship_text(given, body, first)}
    files |= {f"{name}_commands.yml": _commands_text(name, body, run) for name, run in runs.items()}
    return ProgramFiles(
        files=files,
        use=_use(files, model, body),
        losses=tuple(_losses(model, after, body, first)),
        changes=figure_changes(given, model, after),
    )


def _runs(card: SteeredCard, model: Model) -> dict[str, Trajectory]:
    """The manoeuvres of the commands, by name."""
    if card.steered_by is SteeredBy.THRUSTERS:
        n = cruising_revolutions(card)
        try:
            return {"turn": simulate(model, DifferenceTurn(_DIFFERENCE * n)).trajectory}
        except InputError:  # no thrusters on both sides
            return {"straight": simulate(model, StraightRun(n)).trajectory}
    largest = model.defaults.get("steering.max_angle", _TURN_RAD)
    turn, zigzag = Turn(min(_TURN_RAD, largest)), Zigzag(min(_ZIGZAG_RAD, largest), _ZIGZAG_RAD)
    return {"turn": simulate(model, turn).trajectory, "zigzag": simulate(model, zigzag).trajectory}


def _losses(model: Model, after: Model, body: XdynBody, run: Trajectory) -> Iterator[str]:
    """Parts of a card that xdyn lacks."""
    lagging = [one.name for one in body.commands.values() if isinstance(one, State)]
    if lagging:
        yield (
            f"xdyn gives a body no states of its own: lags and limits of {', '.join(lagging)} are in the tables alone; "
            "any other command acts at once"
        )
    ground = ["motion.xdot", "motion.ydot"]
    drift = np.hypot(*(values_at(model, ground, run) - values_at(after, ground, run)).T).max()
    if drift > _ON_LINE:
        yield (
            f"the current of up to {drift:.3g} m/s does not carry the ship over the ground: xdyn 4 has none, LOTUSim's "
            "has models of its own (constant UW current)"
        )


def _block(place: int, lines: Iterable[str]) -> str:
    return "".join(f"{' ' * place}{line}\n" for line in lines)


def _lines(values: Mapping[str, tuple[float, str]]) -> list[str]:
    return [f"{name}: {{value: {value!r}, unit: {unit}}}" for name, (value, unit) in values.items()]


def _matrix(matrix: Array) -> list[str]:
    return [f"row {row}: {values}" for row, values in enumerate((matrix + 0.0).tolist(), start=1)]


_SHIP = """\
# {name}: a body of xdyn, written by tank2sim convert from a ship card.
# xdyn (-C_RB nu) adds the rigid body's part of the equations; X, Y and N are all others, added mass included.
# SI, rad; rudder and yaw rate positive to starboard; u, v through the water; origin midships.
rotations convention: [psi, theta', phi'']
environmental constants:
{environment}environment models:
  - model: no waves
    constant sea elevation in NED frame: {{value: 0, unit: m}}
bodies:
  - name: ship
    position of body frame relative to mesh:
{mesh}    initial position of body frame relative to NED:
{position}    initial velocity of body frame relative to NED:
{velocity}    dynamics:
        hydrodynamic forces calculation point in body frame:
{origin}        centre of inertia: # the point where moments are summed; the centre of gravity is in the matrix
{inertia}        mass: {{value: {mass!r}, unit: kg}}
        rigid body inertia matrix at the center of gravity and projected in the body frame:
{rigid}        added mass matrix at the center of gravity and projected in the body frame:
{added}    external forces: []
    controlled forces:
      - model: maneuvering
        name: hull
        reference frame:
{frame}        commands: [{commands}]
{equations}{blocked}output:
   - format: csv
     filename: out.csv
     data: [t, x(ship), y(ship), psi(ship), u(ship), v(ship), r(ship)]
"""


def ship_text(card: SteeredCard, body: XdynBody, run: Trajectory) -> str:
    """``ship.yml`` of a body that begins as a run does."""
    start = {name: (float(run[f"motion.{name}"][0]), "m/s") for name in "uv"} | {"w": (0.0, "m/s")}
    start |= {"p": (0.0, "rad/s"), "q": (0.0, "rad/s"), "r": (float(run["motion.r"][0]), "rad/s")}
    place = {name: (float(run[f"motion.{name}"][0]), "m") for name in "xy"} | {"z": (0.0, "m")}
    angles = {"phi": (0.0, "rad"), "theta": (0.0, "rad"), "psi": (float(run["motion.psi"][0]), "rad")}
    origin = dict.fromkeys("xyz", (0.0, "m"))
    still = origin | dict.fromkeys(("phi", "theta", "psi"), (0.0, "rad"))
    environment = {
        "g": (card.environment.gravity_mps2, "m/s^2"),
        "rho": (body.density, "kg/m^3"),
        "nu": (_VISCOSITY, "m^2/s"),
    }
    return _SHIP.format(
        name=one_line(card.ship.name),
        environment=_block(4, _lines(environment)),
        mesh=_block(8, ["frame: mesh", *_lines(still)]),
        position=_block(8, ["frame: NED", *_lines(place | angles)]),
        velocity=_block(8, ["frame: ship", *_lines(start)]),
        origin=_block(12, _lines(origin)),
        inertia=_block(12, ["frame: ship", *_lines(origin)]),
        mass=float(body.rigid[0, 0]),
        rigid=_block(12, _matrix(body.rigid)),
        added=_block(12, _matrix(body.added)),
        frame=_block(12, ["frame: ship", *_lines(still)]),
        commands=", ".join(body.commands),
        equations=_block(8, _equations(body)),
        blocked=_block(4, _blocked(body)),
    )


def _equations(body: XdynBody) -> Iterator[str]:
    """Forces, what they are made of, and data."""
    yield from (f"{name}: {body.texts.get(name, '0')}" for name in "XYZKMN")
    yield "# what they are made of (vp, rp, du: v', r' and the change of speed, prime system)"
    yield from (f"{name}: {text}" for name, text in body.texts.items() if name not in "XYZKMN")
    yield "# numbers of the card"
    for name, (variable, value) in body.data.items():
        yield f"{name}: {value!r} # {one_line(variable.description)} ({variable.unit})"


def _blocked(body: XdynBody) -> Iterator[str]:
    if body.blocked:
        yield from ("blocked dof:", "   from YAML:")
    for state in body.blocked:
        yield f"     - {{state: {state}, t: [0, 1e6], value: [0, 0], interpolation: linear}}"


def _commands_text(manoeuvre: str, body: XdynBody, run: Trajectory) -> str:
    """A table of all commands in a run."""
    columns = np.array([run[variable.name] for variable in body.commands.values()]).T
    rows = _corners(run.t, columns)
    lines = [f"# The {manoeuvre} of tank2sim, behind the lags and limits of the card.", "commands:", "  - name: hull"]
    lines.append(f"    t: {_numbers(run.t[rows])}")
    for column, (name, variable) in zip(columns.T, body.commands.items(), strict=True):
        unit, factor = _UNITS.get(variable.unit, ("1", 1.0))
        lines.append(f"    {name}: {{unit: {unit}, values: {_numbers(factor * column[rows])}}}")
    return "\n".join(lines) + "\n"


def _numbers(values: Array) -> str:
    return f"[{', '.join(f'{value:.12g}' for value in values)}]"


def _corners(t: Array, values: Array) -> list[int]:
    """Rows between which all columns (n, k) of a table are straight."""
    kept, last = [0], len(t) - 1
    for k in range(1, last):
        share = (t[k] - t[kept[-1]]) / (t[k + 1] - t[kept[-1]])
        line = values[kept[-1]] + share * (values[k + 1] - values[kept[-1]])
        if np.abs(line - values[k]).max(initial=0.0) > _ON_LINE:
            kept.append(k)
    return [*kept, last]


def _use(files: Iterable[str], model: Model, body: XdynBody) -> str:
    tables = [name for name in files if name != "ship.yml"]
    names, step = " and ".join(f"`{name}`" for name in tables), f"{model.step_s:g}"
    if body.blocked:
        held = "Heave, roll and pitch are blocked, so that no mesh, gravity or hydrostatics is needed."
    else:
        held = (
            "Roll is free, with the card's restoring moment in K; Z and M keep depth and pitch at zero. No mesh,\n"
            "gravity or hydrostatics is needed. `sway` and `turning` are the card's v and r."
        )
    return f"""\
```text
xdyn ship.yml {tables[0]} --dt {step} --tend 600
```

`ship.yml` is the body, {names} its commands: xdyn reads all files that it is given as one input.
The motion is written to `out.csv` (`output` at the end of `ship.yml`): do not give that name with `-o` as well.
{held}
Commands (rudder positive to starboard; a program that sends them gives rad and rad/s):
{", ".join(f"`hull({name})`" for name in body.commands)}.
Write another table for a manoeuvre of your own, or run `xdyn-for-cs ship.yml --dt {step}` and send them. LOTUSim's xdyn
(6 and later) also reads them from a CSV file: a section `controllers` with `type: csv`, `path`, `time column name`,
`separator` and, under `commands`, a column for each name.

The numbers at the end of `hull` are the card's: change one, and the force changes. Long terms of numbers alone are
worked out.
"""
