"""Trials of a made-up craft, by the integration of the benchmark, which shares no code with tank2sim."""

from __future__ import annotations

from pathlib import Path

import craft_log
import numpy as np

ROWS = {
    "straight": [(12.0, 0.7, 0.7), (8.0, 0.0, 0.0)],
    "spin": [(10.0, 0.5, -0.5), (10.0, -0.4, 0.4)],
    "astern": [(10.0, -0.5, -0.5), (8.0, 0.4, 0.4)],
    "steps": [(5.0, 0.8, 0.3), (5.0, 0.1, 0.7), (5.0, 0.6, 0.6), (5.0, 0.9, -0.2), (8.0, 0.2, 0.8), (6.0, 0.7, 0.4)],
    "zigzag": [
        (6.0, 0.7, 0.5),
        (5.0, 0.45, 0.75),
        (5.0, 0.75, 0.45),
        (5.0, 0.45, 0.75),
        (6.0, 0.9, 0.5),
        (6.0, 0.3, 0.7),
    ],
}

PLACE = -1.4
THRUST = 0.03  # N s^2
LEGS = [(8, 0.6, 0), (7, 0.6, 20), (7, 0.8, -20), (6, 0.8, 10), (8, 0.0, 0), (6, 0.9, -25), (6, 0.4, 25), (7, 1.0, 0)]


def written(
    folder: Path,
    craft: dict[str, float],
    names: list[str],
    *,
    scale: float = 1.0,
    ordered: bool = False,
    current: tuple[float, float] = (0.0, 0.0),
) -> list[Path]:
    """Trials by the integration of the benchmark, without wind, with 1 cm and 0.1 deg of noise.

    With revolutions, or `ordered` with orders alone; `current` is towards north and east, m/s.
    """
    rng, paths = np.random.default_rng(11), []
    full = craft["rpm"] * np.pi / 30
    for name in names:
        state, n, rows, t = np.zeros(6), np.zeros(2), [], 0.0
        for seconds, *orders in ROWS[name]:
            goal = np.array(orders) * full
            for _ in range(round(seconds / 0.02)):
                if round(t / 0.02) % 10 == 0:
                    rows.append([t, *state[:3], *(orders if ordered else n)])
                n = goal + (n - goal) * np.exp(-0.02 / craft["lag"])
                psi, u, v, r = state[2:]
                north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
                speed = [north + current[0], east + current[1], r]
                state = state + 0.02 * np.array([*speed, *craft_log.rates(craft, state[3:], n, np.zeros(3))])
                t += 0.02
        table = np.array(rows)
        table[:, 1:3] += 0.01 * rng.normal(size=(len(table), 2))
        table[:, 3] = np.degrees(table[:, 3]) + 0.1 * rng.normal(size=len(table))
        table[:, 4:] *= 1.0 if ordered else scale * 30 / np.pi
        path = folder / f"{name}.csv"
        driven = "order_port,order_starboard" if ordered else "n_port_rpm,n_starboard_rpm"
        np.savetxt(path, table, delimiter=",", header=f"t_s,x_m,y_m,psi_deg,{driven}", comments="")
        paths.append(path)
    return paths


def outboard_trial(path: Path, craft: dict[str, float], columns: str = "n_rpm,delta_deg", side: float = 1.0) -> Path:
    """A trial by the integration of the benchmark; the helm's angle is positive where the craft turns to starboard."""
    rng, full = np.random.default_rng(2), craft["rpm"] * np.pi / 30
    state, n, angle, t, rows = np.zeros(6), 0.0, 0.0, 0.0, []
    for seconds, share, degrees in LEGS:
        for _ in range(round(seconds / 0.02)):
            if round(t / 0.02) % 10 == 0:
                rows.append([t, *state[:3], n * 30 / np.pi, side * np.degrees(angle)])
            n += (share * full - n) * 0.02 / 0.3
            angle += (np.radians(degrees) - angle) * 0.02 / 0.4
            T = THRUST * n * abs(n)
            push = np.array([T * np.cos(angle), -T * np.sin(angle), -PLACE * T * np.sin(angle)])  # the stern to port
            psi, u, v, r = state[2:]
            speed = [u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r]
            state = state + 0.02 * np.array([*speed, *craft_log.rates(craft, state[3:], np.zeros(2), push)])
            t += 0.02
    table = np.array(rows)
    table[:, 1:3] += 0.01 * rng.normal(size=(len(table), 2))
    table[:, 3] = np.degrees(table[:, 3]) + 0.1 * rng.normal(size=len(table))
    np.savetxt(path, table, delimiter=",", header=f"t_s,x_m,y_m,psi_deg,{columns}", comments="")
    return path
