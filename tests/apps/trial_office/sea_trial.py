"""A sea trial of the Mariner made by other code: Chislett's equations written anew, a Runge-Kutta step, noise."""

from __future__ import annotations

import functools
import math
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np

CARD = Path(__file__).parents[3] / "models" / "mariner" / "ship.toml"
STEP_S = 0.5
APPROACH_S = 150.5  # between two rows
NOISE = {"x_m": 1.0, "y_m": 1.0, "psi_deg": 0.1, "u_mps": 0.05, "delta_deg": 0.2}
"""Of the sensors, as in the document of the test cases."""


class Mariner:
    """The ship in a wind (speed in m/s, from deg) and a current (speed, towards deg), all over the ground."""

    def __init__(self, wind: tuple[float, float] = (0.0, 0.0), current: tuple[float, float] = (0.0, 0.0)):
        card = tomllib.loads(CARD.read_text(encoding="utf-8"))
        self.wind, self.current = wind, current
        self.length, self.speed = card["ship"]["length_m"], card["model"]["speed_mps"]
        self.beam, self.density = card["ship"]["beam_m"], card["environment"]["water_density_kgpm3"]
        body, self.terms = card["rigid_body"], dict(card["derivatives"])
        m, x_g = body["mass"], body["x_G"]
        added = {name: self.terms.pop(name, 0.0) for name in ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")}
        rows = {name: ["XYN".index(name[0]), *map(name[1:].count, "uvrd")] for name in self.terms}
        self.rows, *powers = np.array(list(rows.values())).T
        self.powers, self.values = np.array(powers), np.array(list(self.terms.values()))
        self.surge_mass = m - added["Xudot"]
        self.mass = np.array(
            [
                [m - added["Yvdot"], m * x_g - added["Yrdot"]],
                [m * x_g - added["Nvdot"], body["yaw_inertia"] - added["Nrdot"]],
            ]
        )

    def rates(self, state: np.ndarray, order: float) -> np.ndarray:
        """Rates of u, v, r (through the water), x, y (over it), psi, delta (starboard positive)."""
        u, v, r, _, _, psi, delta = state
        total = math.hypot(u, v)
        signs = np.array([(u - self.speed) / total, v / total, r * self.length / total, -delta])
        products = self.values * np.prod(signs[:, None] ** self.powers, axis=0)
        surge, sway, yaw = np.bincount(self.rows, products, minlength=3)
        water = 0.5 * self.density * self.length**2 * total**2
        force = np.array([surge, sway, yaw * self.length]) * water + self._wind(state)
        mass = 0.5 * self.density * self.length**3
        udot = force[0] / (mass * self.surge_mass)
        scale = np.array([[1, self.length], [self.length, self.length**2]])
        vdot, rdot = np.linalg.solve(mass * self.mass * scale, force[1:])
        turn = float(np.clip(order - delta, -math.radians(5) * STEP_S, math.radians(5) * STEP_S)) / STEP_S
        cos, sin = math.cos(psi), math.sin(psi)
        return np.array([udot, vdot, rdot, u * cos - v * sin, u * sin + v * cos, r, turn])

    def _wind(self, state: np.ndarray) -> np.ndarray:
        """Fossen's wind on a ship without an area on its card: 0.6 B^2 in front, 0.055 L^2 at the side."""
        u, v, _, _, _, psi, _ = state
        speed, origin = self.wind[0], math.radians(self.wind[1])
        if not speed:
            return np.zeros(3)
        towards, drift = math.radians(self.current[1]), self.current[0]
        cos, sin = math.cos(psi), math.sin(psi)
        north = -speed * math.cos(origin) - (u * cos - v * sin + drift * math.cos(towards))
        east = -speed * math.sin(origin) - (u * sin + v * cos + drift * math.sin(towards))
        ahead, side = north * cos + east * sin, east * cos - north * sin
        strength = math.hypot(ahead, side)
        front, flank = 0.6 * self.beam**2, 0.055 * self.length**2
        pressure = 0.5 * 1.225
        yaw = -pressure * flank * self.length * 0.1 * 2 * ahead * side
        return np.array([0.7 * pressure * front * strength * ahead, 0.8 * pressure * flank * strength * side, yaw])

    def run(self, orders: Callable[[float, np.ndarray], float | None], longest_s: float = 3000.0) -> np.ndarray:
        """Rows of t, u, v, r, x, y, psi, delta, order until `orders` gives none; a helmsman keeps the course before."""
        state, rows = np.array([self.speed, 0, 0, 0, 0, 0, 0.0]), []
        integral = 0.0
        for number in range(int(longest_s / STEP_S)):
            time = number * STEP_S
            order: float | None
            if time < APPROACH_S:
                integral += state[5] * STEP_S
                order = float(np.clip(-1.5 * state[5] - 25 * state[2] - 0.01 * integral, -0.3, 0.3))
            else:
                order = orders(time - APPROACH_S, state)
            if order is None:
                break
            rows.append([time, *state, order])
            slopes = [self.rates(state, order)]
            for share in (0.5, 0.5, 1.0):
                slopes.append(self.rates(state + share * STEP_S * slopes[-1], order))
            state = state + STEP_S / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
        return np.array(rows)


def turn(rudder_deg: float, turned_deg: float = 720.0) -> Callable[[float, np.ndarray], float | None]:
    """Orders of a turning circle."""

    def orders(_: float, state: np.ndarray) -> float | None:
        return None if abs(math.degrees(state[5])) > turned_deg + 1 else math.radians(rudder_deg)

    return orders


def zigzag(rudder_deg: float, heading_deg: float) -> Callable[[float, np.ndarray], float | None]:
    """Orders of a zigzag with five executes."""
    done: list[float] = []

    def orders(time: float, state: np.ndarray) -> float | None:
        side = math.copysign(1.0, rudder_deg) * (-1) ** (len(done) + 0)
        if side * math.degrees(state[5]) >= heading_deg:
            done.append(time)
        return None if len(done) >= 5 else math.radians(rudder_deg) * (-1) ** len(done)

    return orders


def write_record(
    path: Path, rows: np.ndarray, ship: Mariner, seed: int, *, with_wind: bool = True, tide: float = 0.0
) -> Path:
    """A record at 1 Hz with noise, as a trial CSV; the current falls by `tide` (m/s) over the record."""
    generator = np.random.default_rng(seed)
    rows = rows[:: round(1 / STEP_S)]
    time = rows[:, 0]
    towards = math.radians(ship.current[1])
    way = ship.current[0] * time - 0.5 * tide * time**2 / time[-1]
    columns = {
        "t_s": time,
        "x_m": rows[:, 4] + way * math.cos(towards),
        "y_m": rows[:, 5] + way * math.sin(towards),
        "psi_deg": np.degrees(rows[:, 6]),
        "u_mps": rows[:, 1],
        "delta_deg": np.degrees(rows[:, 7]),
        "delta_order_deg": np.degrees(rows[:, 8]),
    }
    for name, size in NOISE.items():
        columns[name] = columns[name] + size * generator.standard_normal(len(time))
    if ship.wind[0] and with_wind:
        columns["wind_speed_mps"] = np.full(len(time), ship.wind[0])
        columns["wind_direction_deg"] = np.full(len(time), ship.wind[1])
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, fmt="%.6g", delimiter=",", header=",".join(columns), comments="")
    return path


@functools.cache
def turning(
    wind: tuple[float, float], current: tuple[float, float], rudder_deg: float, turned_deg: float
) -> np.ndarray:
    """The motion through the water; without a wind it is the same in any current."""
    return Mariner(wind, current).run(turn(rudder_deg, turned_deg))


def turns(folder: Path, ship: Mariner, *, turned_deg: float = 720.0, **options: object) -> list[Path]:
    """Turning circles to both sides."""
    return [
        write_record(
            folder / f"turn_{name}.csv",
            turning(ship.wind, ship.current if ship.wind[0] else (0.0, 0.0), rudder, turned_deg),
            ship,
            seed,
            **options,  # type: ignore[arg-type]
        )
        for seed, (name, rudder) in enumerate({"starboard": 35.0, "port": -35.0}.items())
    ]
