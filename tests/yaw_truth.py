"""Records of a body turned in a tank, by scipy's integrator: no code is shared with the program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Truth:
    """Coefficients of (3) and beyond, SI; the motion that is asked for, and the loop that follows it."""

    total: float = 0.0504
    coulomb: float = 7.9e-4
    viscous: float = 117.4e-4
    quadratic: float = 381e-4
    braking_quadratic: float | None = None
    inertia_a: float = 0.0
    inertia_d: float = 0.0
    gravity: float = 0.0
    gravity_angle: float = 0.0
    wall_inertia: float = 0.0
    wall_damping: float = 0.0
    length: float = 0.67
    kt: float = 0.051
    top: float = np.pi / 12
    rise: float = 40 / 9
    humps: int = 2
    reversing: bool = False
    stiffness: float = 20.0
    damping: float = 30.0

    @property
    def jumps(self) -> bool:
        """Accelerating and braking differ."""
        return bool(self.inertia_a or self.inertia_d or self.braking_quadratic)

    def rate(self, t: float) -> float:
        """The seven segments as they are printed, and the rest."""
        period = 4 * self.rise
        hump = min(int(t // period), self.humps - 1)
        t = t - hump * period
        t3, wm = self.rise, self.top * (-1 if self.reversing and hump % 2 else 1)
        t1, t2, t4 = t3 / 6, 5 * t3 / 6, 2 * t3
        t5, t6, t7 = t4 + t1, t4 + t2, t4 + t1 + t2
        k = wm / (t2**2 + t3**2 - t1**2 - 2 * t2 * t3 + 2 * t1 * t2)
        if t <= t1:
            return k * t**2
        if t <= t2:
            return 2 * k * t1 * t - k * t1**2
        if t <= t3:
            return -k * (t - t3) ** 2 + wm
        if t <= t4:
            return wm
        if t <= t5:
            return -k * (t - t4) ** 2 + wm
        if t <= t6:
            return -2 * k * (t - t5) * (t5 - t4) - k * (t5 - t4) ** 2 + wm
        return k * (t - t7) ** 2 if t <= t7 else 0.0

    def walls(self, psi: float) -> float:
        """1/(l_a + 1) + 1/(l_f + 1) in the middle of 1.6 m x 1.4 m: bow and stern are equally far."""
        c, s = abs(np.cos(psi)), abs(np.sin(psi))
        return 2 / (1 + min(0.8 - self.length / 2 * c, 0.7 - self.length / 2 * s))

    def acceleration(self, psi: float, w: float, current: float) -> float:
        near, sign = self.walls(psi), np.sign(w)
        drive = self.kt * current - self.gravity * np.sin(psi - self.gravity_angle)
        rough = {True: self.quadratic, False: self.braking_quadratic or self.quadratic}

        def moment(accelerating: bool) -> float:
            lost = self.coulomb * np.tanh(w / 2.5e-4) + (self.viscous + self.wall_damping * near) * w
            return drive - lost - rough[accelerating] * w * abs(w)

        accelerating = moment(True) * sign >= 0
        rated = self.inertia_a if accelerating else self.inertia_d
        total = self.total + self.wall_inertia * near + rated * abs(w) ** 1.5
        return (moment(True) if accelerating else sign * min(0.0, sign * moment(False))) / total


def record(truth: Truth, every_s: float = 0.005) -> dict[str, np.ndarray]:
    """Time, angle, rate and current of a body in a loop that lags a little behind the programme."""

    def rates(t: float, z: np.ndarray) -> list[float]:
        psi, w, current, wanted = z
        asked = truth.stiffness * (wanted - psi) + truth.damping * (truth.rate(t) - w)
        return [w, truth.acceleration(psi, w, current), (asked - current) / 0.055, truth.rate(t)]

    end = 4 * truth.rise * truth.humps
    times = np.arange(0.0, end, every_s)
    if truth.jumps:  # which an integrator that controls its error would creep along
        return by_steps(rates, times)
    found = solve_ivp(rates, (0, end), [0.0] * 4, "LSODA", times, rtol=1e-9, atol=1e-11, max_step=0.02)
    return {"t": times, "psi": found.y[0], "w": found.y[1], "I": found.y[2]}


def by_steps(rates, times: np.ndarray) -> dict[str, np.ndarray]:
    """Classical Runge-Kutta at the times of the record."""
    h, z = times[1] - times[0], np.zeros(4)
    path = [z]
    for t in times[:-1]:
        k1 = np.array(rates(t, z))
        k2 = np.array(rates(t + h / 2, z + h / 2 * k1))
        k3 = np.array(rates(t + h / 2, z + h / 2 * k2))
        k4 = np.array(rates(t + h, z + h * k3))
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        path.append(z)
    columns = np.array(path).T
    return {"t": times, "psi": columns[0], "w": columns[1], "I": columns[2]}


def written(path: Path, truth: Truth, columns: dict[str, np.ndarray] | None = None, **comments: object) -> Path:
    """The record as a file of the program's format."""
    own = columns or record(truth)
    reported = {
        "programme": "reversing" if truth.reversing else "unidirectional",
        "max_rate_radps": truth.top,
        "rise_s": truth.rise,
        "humps": truth.humps,
        "torque_constant_NmpA": truth.kt,
        **comments,
    }
    lines = [f"# {key}: {value}" for key, value in reported.items() if value is not None]
    rows = [f"{t:.6f},{p:.12g},{i:.12g}" for t, p, i in zip(own["t"], own["psi"], own["I"], strict=True)]
    path.write_text("\n".join([*lines, "t_s,phi_rad,current_A", *rows]) + "\n")
    return path


def mirrored(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same motion to the other side."""
    return {key: values if key == "t" else -values for key, values in columns.items()}


__all__ = ["Truth", "mirrored", "record", "replace", "written"]
