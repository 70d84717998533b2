"""Cards as bodies of xdyn against tank2sim: accelerations at random states, and ten minutes of turns and zigzags.

The files are read by an evaluator of xdyn's grammar that shares no code with tank2sim (``simulators/xdyn/evaluator.py``
of the data folder) and refuses what xdyn would drop. Both sides are integrated by Runge-Kutta with one step and the
rudder of the tables; next to it is how far the path by the table is from that with tank2sim's own gear. xdyn itself was
not run.
"""

from __future__ import annotations

import importlib.util
import math
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np
import yaml

from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.apps.programs.xdyn import xdyn_files
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.simulation.manoeuvres import Manoeuvre, Turn, Zigzag
from tank2sim.simulation.run import simulate

EVALUATOR = (
    Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared"))
    / "simulators"
    / "xdyn"
    / "evaluator.py"
)
SHIPS = ("mariner", "mariner-nominal", "kvlcc2", "kvlcc2-l7", "kvlcc2-mmg", "kvlcc2-l7-mmg", "esso-osaka", "container")
ORDERS = {"turn": Turn(math.radians(35)), "zigzag": Zigzag(math.radians(20), math.radians(20))}
DURATION_S = 600.0
RATES = ("motion.udot", "motion.vdot", "motion.rdot")

NOT_EXPRESSIONS = {"model", "name", "reference frame", "commands"}


def evaluator_module(path: Path) -> ModuleType:
    """The evaluator of a file, with compiled trees; its strict parser refuses what xdyn would drop."""
    spec = importlib.util.spec_from_file_location("xdyn_evaluator", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.Force = lambda node, env: CompiledForce(module, node, env)  # type: ignore[attr-defined]
    return module


class CompiledForce:
    """The evaluator's trees of a force model as a function of Python, on numbers or arrays."""

    def __init__(self, module: ModuleType, node: Mapping[str, Any], env: Mapping[str, float], of: Any = math) -> None:
        self.name, self.states = node["name"], module.STATES
        self.commands = list(node["commands"])
        trees = {key: module.Parser(text).tree for key, text in node.items() if key not in NOT_EXPRESSIONS}
        self.keys = set(trees)
        lines: list[str] = []
        done: set[str] = {*env, "t", *self.commands}

        def spelt(tree: Any) -> str:
            if tree[0] == "number":
                return repr(tree[1])
            if tree[0] == "name":
                if tree[1] not in done:
                    line = f"    d_{tree[1]} = {spelt(trees[tree[1]])}"
                    lines.append(line)
                    done.add(tree[1])
                return f"d_{tree[1]}"
            if tree[0] == "call":
                if tree[1] in module.FUN:
                    return f"{'abs' if tree[1] == 'abs' else f'm.{tree[1]}'}({spelt(tree[2])})"
                assert tree[1] in module.STATES and tree[2] == ("name", "t")
                return f"s[{tree[1]!r}]"
            return f"({spelt(tree[1])} {'**' if tree[0] == '^' else tree[0]} {spelt(tree[2])})"

        for key in "XYZKMN":
            spelt(("name", key))
        given = [f"    d_{name} = {value!r}" for name, value in env.items()]
        given += ["    d_t = t", *(f"    d_{name} = c[{name!r}]" for name in self.commands)]
        source = "\n".join(["def f(s, t, c):", *given, *lines, "    return d_X, d_Y, d_Z, d_K, d_M, d_N"])
        space: dict[str, Any] = {"m": of}
        exec(source, space)
        self.function = space["f"]

    def wrench(self, states: Mapping[str, Any], t: Any, commands: Mapping[str, Any]) -> np.ndarray:
        X, Y, _, _, _, N = self.function(states, t, commands)
        return np.array(np.broadcast_arrays(X, Y, N))


def written_rates(module: ModuleType, ship: str, states: Mapping[str, Any], t: Any, commands: Mapping[str, Any]) -> Any:
    """udot, vdot, rdot (3, n) by the file: (M_RB + M_A) a = F - C_RB nu, and the forces (3, n)."""
    document = yaml.safe_load(ship)
    body = document["bodies"][0]
    (node,) = body["controlled forces"]
    env = {key: float(one["value"]) for key, one in document["environmental constants"].items()}
    given = dict.fromkeys(module.STATES, 0.0) | dict(states)
    force = CompiledForce(module, node, env, np)
    F = force.wrench(given, t, commands)
    rigid, added = mass_matrices(body)
    m, lever = rigid[0, 0], rigid[1, 5]
    u, v, r = (np.asarray(given[name], float) for name in "uvr")
    by_xdyn = np.array([(m * v + lever * r) * r, -m * u * r, -lever * u * r])
    pick = np.ix_([0, 1, 5], [0, 1, 5])
    return np.linalg.solve((rigid + added)[pick], F + by_xdyn), F


def mass_matrices(body: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """M_RB and M_A (6, 6) of a body."""

    def matrix(name: str) -> np.ndarray:
        rows = body["dynamics"][f"{name} matrix at the center of gravity and projected in the body frame"]
        return np.array([rows[f"row {row}"] for row in range(1, 7)], float)

    return matrix("rigid body inertia"), matrix("added mass")


def commands_of(document: Mapping[str, Any]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times and values (SI) of each command."""
    scale = {"deg": math.pi / 180, "rpm": math.pi / 30, "1": 1.0}
    (entry,) = document["commands"]
    return {
        name: (np.array(entry["t"], float), scale[str(one["unit"])] * np.array(one["values"], float))
        for name, one in entry.items()
        if isinstance(one, dict)
    }


def free_run(module: ModuleType, text: str, t_end: float, dt: float) -> np.ndarray:
    """x y z phi theta psi u v w p q r (n, 12) of a body with six free motions, by Runge-Kutta."""
    document = yaml.safe_load(text)
    body = document["bodies"][0]
    assert "blocked dof" not in body
    env = {key: float(one["value"]) for key, one in document["environmental constants"].items()}
    force, tables = CompiledForce(module, body["controlled forces"][0], env), commands_of(document)
    rigid, added = mass_matrices(body)
    inverse = np.linalg.inv(rigid + added)

    def rate(t: float, s: np.ndarray) -> np.ndarray:
        phi, theta, psi = s[3:6]
        states = dict(zip("x y z phi theta psi u v w p q r".split(), s.tolist(), strict=True))
        given = {name: float(np.interp(t, *table)) for name, table in tables.items()}
        velocity, turning = s[6:9], s[9:]
        momentum = rigid @ s[6:]
        added_by_xdyn = np.concatenate(
            [np.cross(momentum[:3], turning), np.cross(momentum[:3], velocity) + np.cross(momentum[3:], turning)]
        )
        F = np.array([float(value) for value in force.function(states, t, given)])
        return np.concatenate([*kinematics(phi, theta, psi, velocity, turning), inverse @ (F + added_by_xdyn)])

    velocity = body["initial velocity of body frame relative to NED"]
    start = np.array([0.0] * 6 + [float(velocity[name]["value"]) for name in "uvwpqr"])
    return runge_kutta(rate, start, t_end, dt)


def kinematics(phi: float, theta: float, psi: float, velocity: np.ndarray, turning: np.ndarray) -> list[np.ndarray]:
    """Rates of position (NED) and of roll, pitch and yaw."""
    sf, cf, st, ct, sp, cp = (f(a) for a in (phi, theta, psi) for f in (math.sin, math.cos))
    to_earth = np.array(
        [
            [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
            [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
            [-st, ct * sf, ct * cf],
        ]
    )
    to_rates = np.array([[1, sf * st / ct, cf * st / ct], [0, cf, -sf], [0, sf / ct, cf / ct]])
    return [to_earth @ velocity, to_rates @ turning]


def runge_kutta(rate: Callable[[float, np.ndarray], np.ndarray], s: np.ndarray, t_end: float, dt: float) -> np.ndarray:
    """States (n, ...) at steps dt."""
    t, out = 0.0, [s]
    while t < t_end - 1e-9:
        k1 = rate(t, s)
        k2 = rate(t + dt / 2, s + dt / 2 * k1)
        k3 = rate(t + dt / 2, s + dt / 2 * k2)
        k4 = rate(t + dt, s + dt * k3)
        s, t = s + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + dt
        out.append(s)
    return np.array(out)


def model_run(model: Model, tables: Mapping[str, tuple[np.ndarray, np.ndarray]], t_end: float, dt: float) -> np.ndarray:
    """States of motion (n, k) of the model by Runge-Kutta, in its order, with other states and inputs by tables."""
    rows = [place for place, name in enumerate(model.state_names) if name.startswith("motion.")]
    p = model.parameter_values()
    x, u = np.array(model.initial(p)).ravel(), model.input_values()
    held = [
        (x, model.state_names.index(name), table)
        if name in model.state_names
        else (u, model.input_names.index(name), table)
        for name, table in tables.items()
    ]

    def rate(t: float, s: np.ndarray) -> np.ndarray:
        x[rows] = s
        for values, place, table in held:
            values[place] = np.interp(t, *table)
        return np.array(model.rhs(x, u, p)).ravel()[rows]

    return runge_kutta(rate, x[rows].copy(), t_end, dt)


def motions(model: Model, count: int) -> dict[str, np.ndarray]:
    """Random motions ahead and astern, with what turns and steers at random, by name of the model's state or input."""
    rng = np.random.default_rng(7)
    speed, length = (
        next(one.start for one in model.parameters if one.name == f"ship.{key}") for key in ("speed", "length")
    )
    found = {
        "motion.u": rng.uniform(-0.4 * speed, 1.2 * speed, count),
        "motion.v": rng.normal(0, 0.25 * speed, count),
        "motion.r": rng.normal(0, 0.4 * speed / length, count),
        "motion.psi": rng.uniform(-3, 3, count),
    }
    for state in model.states:
        if not state.name.startswith(("motion.", "waves.")):
            found[state.name] = rng.normal(0, 0.4, count) * state.nominal
    for one in model.inputs:
        if one.name.startswith(("propeller.", "thrusters.")):
            found[one.name] = rng.uniform(-1.2, 1.2, count) * max(abs(one.start), 1.0)
    return found


def accelerations(model: Model, given: Mapping[str, np.ndarray]) -> np.ndarray:
    """udot, vdot, rdot (3, n) of the model."""
    count = len(given["motion.u"])
    x = np.tile(np.array(model.initial(model.parameter_values())).reshape(-1, 1), count)
    u = np.tile(model.input_values().reshape(-1, 1), count)
    for name, values in given.items():
        if name in model.state_names:
            x[model.state_names.index(name)] = values
        else:
            u[model.input_names.index(name)] = values
    wanted = model.expand(ca.vcat([model.symbol(name) for name in RATES]))
    return np.array(ca.Function("f", [model.x, model.u, model.p], [wanted])(x, u, ca.DM(model.parameter_values())))


def commanded(text: str, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The values of `given` under the names of the commands of the file."""
    return {name.replace(".", "_"): values for name, values in given.items() if name.replace(".", "_") in text}


def motion_difference(evaluator: ModuleType, ship: str, model: Model, count: int) -> float:
    """Largest difference of udot, vdot or rdot at random motions, over the largest of each."""
    given = motions(model, count)
    states = {name.removeprefix("motion."): given[name] for name in given if name.startswith("motion.")}
    found, _ = written_rates(evaluator, ship, states, 0.0, commanded(ship, given))
    expected = accelerations(model, given)
    return float((np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)).max())


def together(files: ProgramFiles, manoeuvre: str) -> str:
    """The body and the commands of a manoeuvre as one input."""
    return f"{files.files['ship.yml']}{files.files[f'{manoeuvre}_commands.yml']}"


def model_tables(model: Model, text: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The tables of a file by the names of the model."""
    names = {name.replace(".", "_"): name for name in (*model.state_names, *model.input_names)}
    return {names[name]: table for name, table in commands_of(yaml.safe_load(text)).items()}


def path_differences(evaluator: ModuleType, model: Model, text: str, manoeuvre: Manoeuvre) -> tuple[float, float]:
    """Largest distance (m) of the file's path from the model's by the same table, and of that from its own gear's."""
    dt = 0.5 if "rudder.command" in model else 0.1
    if "motion.phi" in model:
        found = free_run(evaluator, text, DURATION_S, dt)[:, :2]
    else:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ship.yml"
            path.write_text(text, encoding="utf-8")
            found = evaluator.simulate(path, DURATION_S, dt)[:, 1:3]
    by_table = model_tables(model, text)
    expected = model_run(model, by_table, DURATION_S, dt)[:, :2]
    # The table ends with tank2sim's run, and so does the comparison with it.
    run, step = simulate(model, manoeuvre).trajectory, model.step_s
    end = min(DURATION_S, run.t[-1])
    finely = model_run(model, by_table, end, step)[::10, :2]
    t = 10 * step * np.arange(int(end / step / 10))
    own = np.array([[run.at(f"motion.{axis}", time) for axis in "xy"] for time in t])
    return float(np.hypot(*(found - expected).T).max()), float(np.hypot(*(finely[: len(t)] - own).T).max())


def main() -> None:
    """Print the differences of each card."""
    if not EVALUATOR.is_file():
        sys.exit(f"{EVALUATOR} is missing; TANK2SIM_DATA names the folder of simulators")
    evaluator = evaluator_module(EVALUATOR)
    print(f"{'card':16s} {'acceleration':>12s} {'':8s} {'path (m)':>9s} {'table (m)':>9s}")
    worst = {"planar": 0.0, "rolling": 0.0}
    largest_rate, largest_table = 0.0, 0.0
    for name in SHIPS:
        card = read_card(name)
        model, files = build(card), xdyn_files(card)
        rolls = "motion.phi" in model
        rate = math.nan if rolls else motion_difference(evaluator, str(files.files["ship.yml"]), model, 1000)
        for words, manoeuvre in ORDERS.items():
            path, table = path_differences(evaluator, model, together(files, words), manoeuvre)
            print(f"{name:16s} {rate:12.1e} {words:8s} {path:9.1e} {table:9.1e}")
            kind = "rolling" if rolls else "planar"
            worst[kind], largest_table = max(worst[kind], path), max(largest_table, table)
        largest_rate = max(largest_rate, 0.0 if rolls else rate)
    print(
        f"largest: acceleration {largest_rate:.1e} of the largest; path {worst['planar']:.1e} m, of a ship that rolls ",
        end="",
    )
    print(f"{worst['rolling']:.1e} m; by the table in place of the gear {largest_table:.1e} m")


if __name__ == "__main__":
    main()
