"""Made-up trials with a known truth: a zigzag-like or turning motion by quadrature, with sensor noise.

Nothing of it is shared with what is tested: the yaw follows Nomoto's equation by exact steps of a first-order lag on a
grid ten times as fine as the record, the sway and the speed are functions of r, and the track is their sum.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tank2sim.records.trials import Trial

NOISE = {"u_mps": 0.02, "v_mps": 0.02, "r_radps": np.deg2rad(0.03), "psi_rad": np.deg2rad(0.1), "x_m": 0.6, "y_m": 0.6}
NONE = dict.fromkeys(NOISE, 0.0)


def motion(kind: str = "zigzag", *, duration: float = 400.0, step: float = 0.1, heading: float = 0.5) -> dict:
    """Time, rudder (rad, to starboard) and motion of a ship of 160 m at 7.7 m/s: SI, right in every sign."""
    fine = step / 10
    t = np.arange(0, duration + fine / 2, fine)
    if kind == "zigzag":
        period = 160.0
        delta = np.deg2rad(20) * np.sign(np.sin(2 * np.pi * (t - 10) / period)) * (t > 10)
    elif kind == "turn":
        delta = np.deg2rad(25) * (t > 15)
    elif kind == "turn_port":
        delta = -np.deg2rad(25) * (t > 15)
    else:
        delta = np.zeros_like(t)
    gain, lag = 0.045, 15.0
    r = np.zeros_like(t)
    decay = np.exp(-fine / lag)
    for k in range(1, len(t)):
        r[k] = gain * delta[k - 1] + (r[k - 1] - gain * delta[k - 1]) * decay
    psi = heading + np.concatenate([[0], np.cumsum((r[1:] + r[:-1]) / 2) * fine])
    u = 7.7 - 6000 * r**2
    v = -60 * r
    east, north = u * np.sin(psi) + v * np.cos(psi), u * np.cos(psi) - v * np.sin(psi)
    x = np.concatenate([[0], np.cumsum((north[1:] + north[:-1]) / 2) * fine])
    y = np.concatenate([[0], np.cumsum((east[1:] + east[:-1]) / 2) * fine])
    every = slice(None, None, 10)
    motions = {"delta_rad": delta, "u_mps": u, "v_mps": v, "r_radps": r, "psi_rad": psi, "x_m": x, "y_m": y}
    return {"t_s": t[every], **{name: values[every] for name, values in motions.items()}}


def trial(signals: dict, *, seed: int = 1, noise: dict = NOISE, columns: dict | None = None) -> Trial:
    """The record of a motion: with white noise, under the column names of the project's CSV in degrees."""
    rng = np.random.default_rng(seed)
    noisy = {
        name: values + noise.get(name, 0.0) * rng.standard_normal(len(values))
        for name, values in signals.items()
        if name != "t_s"
    }
    names = {"delta_rad": "delta_deg", "r_radps": "r_degps", "psi_rad": "psi_deg"} if columns is None else columns
    return Trial(Path("made_up.csv"), np.asarray(signals["t_s"]), noisy, columns=names)
