"""Stand-ins for the FMUs of OSP's case dp-ship, with its names and constant outputs; and a controller for the hull."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca
import numpy as np
from lxml import etree

from tank2sim.dynamics.model import Input, Model, Parameter, Quantity
from tank2sim.fmu.export import write_fmu

SPACE = "{http://opensimulationplatform.com/MSMI/OSPSystemStructure}"
AXES = ("x", "y", "psi")
THRUST = {"F1c": 3e5, "F2c": 2e5, "F3c": 1e5, "alpha1": 0.3, "alpha2": -0.2, "Fxg": 4e5, "Fyg": 1.5e5, "Mzg": 6e6}

# FMU -> inputs, outputs with their values, parameters: the names of the case, as its own description lists them.
PARTNERS: dict[str, tuple[Sequence[str], Mapping[str, float], Sequence[str]]] = {
    "ThMPC": (("refx", "refy", "refMz"), THRUST, ("x1", "y1", "x2", "y2", "x3", "uFmax", "Fmax")),
    "NLPobserver": (
        [f"{name}[{place}]" for name in ("y", "tau") for place in (1, 2, 3)],
        {f"{name}[{place}]": 0.0 for name in ("y_hat", "v_hat") for place in (1, 2, 3)},
        (),
    ),
    "ReferenceGenerator": (
        ("x_wp", "y_wp", "psi_wp"),
        {f"{d}{axis}_ref": 0.0 for d in ("", "d") for axis in AXES},
        (),
    ),
    "DPController": (
        [f"{d}{axis}{end}" for d in ("", "d") for axis in AXES for end in ("", "_ref")],
        {f"Control{axis}": 0.0 for axis in ("x", "y", "Mz")},
        [f"K{kind}{axis}" for kind in "pdi" for axis in AXES],
    ),
}


def write_partner(name: str, folder: Path) -> None:
    """Write the stand-in of an FMU of the case."""
    inputs, outputs, parameters = PARTNERS[name]
    model = Model(
        name=name,
        description=f"Stand-in of {name}",
        states=(),
        inputs=tuple(Input(name=one, unit="1", description=one, minimum=-1e15, maximum=1e15) for one in inputs),
        parameters=tuple(
            Parameter(name=one, unit="1", description=one, start=0.0, minimum=-1e15, maximum=1e15) for one in parameters
        ),
        quantities=tuple(
            Quantity(name=one, unit="1", description=one, minimum=-1e15, maximum=1e15, value=ca.SX(value))
            for one, value in outputs.items()
        ),
        outputs=tuple(outputs),
        step_s=0.04,
    )
    write_fmu(model, folder / f"{name}.fmu", fmi=2)


def initial_values(system: bytes | str, simulator: str) -> dict[str, float]:
    """Initial values of a simulator in OspSystemStructure.xml."""
    root = etree.fromstring(system if isinstance(system, bytes) else system.encode())
    (part,) = (one for one in root.iter(f"{SPACE}Simulator") if one.get("name") == simulator)
    return {one.get("variable"): float(one[0].get("value")) for one in part.iter(f"{SPACE}InitialValue")}


class Controller:
    """A position controller with gains, places and limits as OspSystemStructure.xml gives them to the case's FMUs.

    Proportional, derivative and integral in north, east and yaw, turned into the ship's axes; shares of least squares
    for the thrusters once a second, each component changing at most by ``uFmax``.
    """

    def __init__(self, system: str):
        gains, thrust = initial_values(system, "DP Controller"), initial_values(system, "Thrust Allocation")
        self.gains = [np.array([gains[f"K{kind}{axis}"] for axis in AXES]) for kind in "pdi"]
        rows = [
            [1, 0, 1, 0, 0],
            [0, 1, 0, 1, 1],
            [-thrust["y1"], thrust["x1"], -thrust["y2"], thrust["x2"], thrust["x3"]],
        ]
        self.shares, self.limit = np.linalg.pinv(np.array(rows, dtype=float)), thrust["uFmax"]
        self.sum, self.wanted, self.parts = np.zeros(3), np.zeros(5), np.zeros(5)

    def step(self, error: np.ndarray, error_rate: np.ndarray, heading: float, time: float, step: float) -> list[float]:
        """F1, F2, F3 (N) and the two angles (rad), from errors in north, east and yaw."""
        if round(time / step) % round(1 / step) == 0:
            self.sum += error
            earth = self.gains[0] * error + self.gains[1] * error_rate + self.gains[2] * self.sum
            cos, sin = math.cos(heading), math.sin(heading)
            body = [cos * earth[0] + sin * earth[1], cos * earth[1] - sin * earth[0], earth[2]]
            self.wanted = self.shares @ body
        self.parts = self.parts + np.clip(self.wanted - self.parts, -self.limit * step, self.limit * step)
        x1, y1, x2, y2, bow = self.parts
        return [math.hypot(x1, y1), math.hypot(x2, y2), bow, math.atan2(y1, x1), math.atan2(y2, x2)]
