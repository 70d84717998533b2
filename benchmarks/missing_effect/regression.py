"""The regression that the baselines share: what the model's forces leave over, and what each effect would add.

From the trials of a case and its card alone. Motions are smoothed and differentiated (Savitzky-Golay), the rudder is
that of the card's steering gear; the residuals are those of the three equations of motion (prime, over the speed u0)
and of the three of kinematics. Every effect is a group of columns, linear in its parameters: text-book forms, each with
the force that it adds or with the error that it makes in a sensor. Shared by stepwise regression, SINDy and the random
forest; nothing of it is of tank2sim.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

Array = NDArray[np.float64]
Card = Mapping[str, Mapping[str, float]]

EQUATIONS = 6
"""Surge, sway, yaw; heading, north, east."""

WINDOW = 0.35
"""Window of the smoothing over L/u0."""

EACH = 0.12
"""One row in this share of L/u0 is kept: nearer rows are not independent."""


@dataclass(frozen=True, eq=False)
class Regression:
    """Residuals (rows,) over their noise, and the columns (rows, parameters) of each effect."""

    residual: Array
    columns: dict[str, Array]


@dataclass(frozen=True, eq=False)
class _Trial:
    """A trial's smoothed motion: SI, radians, (n,) each; accelerations and measured rates of heading and position."""

    card: Card
    u: Array
    v: Array
    r: Array
    psi: Array
    rudder: Array
    rudder_rate: Array
    rpm: Array
    accelerations: Array  # (3, n)
    measured_rates: Array  # (3, n)

    @property
    def speed(self) -> Array:
        return np.hypot(self.u, self.v)

    def prime(self) -> tuple[Array, Array, Array]:
        """u' = (u - u0)/U, v', r'."""
        length, nominal = self.card["ship"]["length_m"], self.card["model"]["speed_mps"]
        return (self.u - nominal) / self.speed, self.v / self.speed, self.r * length / self.speed


def read_regression(folder: Path) -> Regression:
    """The regression of all trials of a case that may be fitted."""
    card = tomllib.loads((folder / "ship.toml").read_text(encoding="utf-8"))
    trials = [_read(path, card) for path in sorted((folder / "fit").glob("*.csv"))]
    residuals = [_residuals(trial) for trial in trials]
    every = np.concatenate(residuals, axis=1)
    noise = 1.4826 * np.median(np.abs(every - np.median(every, axis=1, keepdims=True)), axis=1) + 1e-12
    columns: dict[str, list[Array]] = {}
    for trial in trials:
        for name, column in _columns(trial).items():
            columns.setdefault(name, []).append((column / noise[:, None, None]).reshape(-1, column.shape[-1]))
    return Regression(
        np.concatenate([(residual / noise[:, None]).ravel() for residual in residuals]),
        {name: np.concatenate(parts) for name, parts in columns.items()},
    )


def _read(path: Path, card: Card) -> _Trial:
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    values = dict(zip(header, np.array(rows, float).T, strict=True))
    time, step = values["t_s"], float(np.median(np.diff(values["t_s"])))
    passage = card["ship"]["length_m"] / card["model"]["speed_mps"]
    window = 2 * max(round(WINDOW * passage / step / 2), 2) + 1

    def smooth(signal: Array, derivative: int = 0) -> Array:
        return np.asarray(savgol_filter(signal, window, 3, deriv=derivative, delta=step), float)

    u, v, r, psi = values["u_mps"], values["v_mps"], np.radians(values["r_degps"]), np.radians(values["psi_deg"])
    rudder = _gear(card, np.radians(values["delta_order_deg"]), step)
    kept = slice(window, len(time) - window, max(1, round(EACH * passage / step)))
    parts = {"u": u, "v": v, "r": r, "psi": psi, "rudder": rudder, "rpm": values["n_rpm"]}
    return _Trial(
        card,
        **{name: smooth(part)[kept] for name, part in parts.items()},
        rudder_rate=smooth(rudder, 1)[kept],
        accelerations=np.array([smooth(part, 1)[kept] for part in (u, v, r)]),
        measured_rates=np.array([smooth(part, 1)[kept] for part in (psi, values["x_m"], values["y_m"])]),
    )


def _gear(card: Card, order: Array, step: float) -> Array:
    """Angle of the rudder by the card's gear: first order within its rate."""
    gear, angle = card["steering_gear"], order.copy()
    rate, substeps = np.radians(gear["max_rate_degps"]), max(1, round(4 * step / gear["time_constant_s"]))
    for row in range(1, len(order)):
        now = angle[row - 1]
        for _ in range(substeps):
            now += step / substeps * float(np.clip((order[row - 1] - now) / gear["time_constant_s"], -rate, rate))
        angle[row] = now
    return angle


def _forces(trial: _Trial) -> tuple[Array, Array, Array]:
    """X', Y', N' (3, n) of hull and rudder, and the rudder's slope by its angle."""
    u, v, r = trial.prime()
    d = -trial.rudder  # the card's rudder is positive to port
    hull, steering, slope = (np.zeros((3, len(u))) for _ in range(3))
    for name, value in trial.card["derivatives"].items():
        if name.endswith("dot"):
            continue
        p, q, s, t = (name[1:].count(letter) for letter in "uvrd")
        row, moving = "XYN".index(name[0]), value * u**p * v**q * r**s
        (steering if t else hull)[row] += moving * d**t
        if t:
            slope[row] -= moving * t * d ** (t - 1)
    ratio = trial.rpm / trial.card["propulsion"]["nominal_rpm"]
    nominal = (trial.card["model"]["speed_mps"] / trial.speed) ** 2
    hull[0] += trial.card["propulsion"]["Xnn"] * (ratio * np.abs(ratio) - 1) * nominal
    return hull, steering, slope


def _residuals(trial: _Trial) -> Array:
    """Of the six equations (6, n): mass times acceleration less the forces, and measured rates less those of the log
    and the gyro."""
    card, length, nominal = trial.card, trial.card["ship"]["length_m"], trial.card["model"]["speed_mps"]
    hull, steering, _ = _forces(trial)
    made = np.einsum("ij,jn->in", _mass(card), trial.accelerations * np.array([[1.0], [1.0], [length]])) * length
    forces = (made - (hull + steering) * trial.speed**2) / nominal**2
    cos, sin = np.cos(trial.psi), np.sin(trial.psi)
    known = np.array([trial.r, trial.u * cos - trial.v * sin, trial.u * sin + trial.v * cos])
    return np.concatenate([forces, trial.measured_rates - known])


def _mass(card: Card) -> Array:
    body, terms = card["rigid_body"], card["derivatives"]
    centre = body["mass"] * body["x_G"]
    return np.array(
        [
            [body["mass"] - terms["Xudot"], 0.0, 0.0],
            [0.0, body["mass"] - terms["Yvdot"], centre - terms["Yrdot"]],
            [0.0, centre - terms["Nvdot"], body["yaw_inertia"] - terms["Nrdot"]],
        ]
    )


def _columns(trial: _Trial) -> dict[str, Array]:
    """Of each effect: (6, n, parameters)."""
    card, nominal, length = trial.card, trial.card["model"]["speed_mps"], trial.card["ship"]["length_m"]
    _, steering, slope = _forces(trial)
    u, v, r = trial.prime()
    q = (trial.speed / nominal) ** 2
    one, zero = np.ones_like(u), np.zeros_like(u)
    ratio = trial.rpm / card["propulsion"]["nominal_rpm"]
    cos, sin = np.cos(trial.psi), np.sin(trial.psi)
    strips = [(x, (v + x * r) * np.abs(v + x * r)) for x in np.linspace(-0.475, 0.475, 20)]
    accelerations = trial.accelerations * np.array([[1.0], [1.0], [length]]) * length / nominal**2
    terms = card["derivatives"]
    stalled = (np.abs(trial.rudder) > np.radians(22.0)).astype(float)

    def force(X: Array = zero, Y: Array = zero, N: Array = zero) -> Array:
        return np.array([X, Y, N, zero, zero, zero])

    def motion(heading: Array = zero, north: Array = zero, east: Array = zero) -> Array:
        return np.array([zero, zero, zero, heading, north, east])

    by = {
        "current": [motion(north=one), motion(east=one)],
        "wind": [force(cos, -sin), force(sin, cos), force(N=np.sin(2 * trial.psi)), force(N=np.cos(2 * trial.psi))],
        "bank_suction": [force(Y=q), force(N=q)],
        "propeller_side_force": [force(Y=ratio**2), force(N=ratio**2)],
        "engine_droop": [force(X=ratio**2 * (1 - trial.u / nominal))],
        "rudder_bias": [force(*(slope * q))],
        "rudder_effectiveness": [force(*(steering * q))],
        "rudder_slipstream": [force(*(steering * q * (ratio * nominal / trial.speed - 1)))],
        "rudder_stall": [force(zero, *(steering[1:] * q * stalled))],
        "rudder_lag": [force(*(slope * q * trial.rudder_rate))],
        "cross_flow_drag": [
            force(zero, q * sum(part for _, part in strips) / 20, q * sum(x * part for x, part in strips) / 20)
        ],
        "hull_fouling": [force(X=(trial.u / nominal) ** 2)],
        "asymmetric_turning": [force(Y=q * r**2), force(N=q * r**2)],
        "cubic_yaw_damping": [force(Y=q * r**3), force(N=q * r**3)],
        "sway_yaw_coupling": [force(Y=q * v * r**2), force(N=q * v * r**2)],
        "turning_drag": [force(X=q * v * r)],
        "added_yaw_inertia": [force(N=accelerations[2])],
        "added_sway_mass": [force(Y=accelerations[1])],
        "linear_yaw_damping": [force(zero, q * terms["Yr"] * r, q * terms["Nr"] * r)],
        "linear_sway_damping": [force(zero, q * terms["Yv"] * v, q * terms["Nv"] * v)],
        "shallow_water": [
            force(
                zero,
                q * (terms["Yv"] * v + terms["Yr"] * r) + terms["Yvdot"] * accelerations[1],
                q * (terms["Nv"] * v + terms["Nr"] * r) + terms["Nrdot"] * accelerations[2],
            )
        ],
        "gyro_bias": [motion(heading=one)],
        "gyro_scale": [motion(heading=trial.r)],
        "heading_offset": [motion(zero, trial.u * sin + trial.v * cos, -trial.u * cos + trial.v * sin)],
        "log_scale": [motion(zero, trial.u * cos - trial.v * sin, trial.u * sin + trial.v * cos)],
        "log_lever_arm": [motion(zero, trial.r * sin, -trial.r * cos)],
        "antenna_lever_arm": [
            motion(zero, -trial.r * sin, trial.r * cos),
            motion(zero, -trial.r * cos, -trial.r * sin),
        ],
    }
    return {name: np.stack(columns, axis=-1) for name, columns in by.items()}
