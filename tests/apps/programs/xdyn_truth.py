"""The independent evaluator of xdyn's grammar and planar dynamics, with its trees compiled, for what is exported."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tank2sim.dynamics.model import Model

NOT_EXPRESSIONS = {"model", "name", "reference frame", "commands"}


def evaluator_module(data: Path) -> ModuleType:
    """The evaluator of the shared data; its strict parser refuses what xdyn would drop."""
    path = data / "simulators" / "xdyn" / "evaluator.py"
    if not path.is_file():
        pytest.skip(f"the evaluator of xdyn's grammar is missing: {path}")
    pytest.importorskip("yaml")
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
    import yaml

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
    import yaml

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
