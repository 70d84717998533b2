"""A rotating arm that tests a third-order hull: steady drift, rudder, turning and all together, as a table of averages.

Written from (3.8) of paper 2 in plain numpy, without code of the package. The gauge carries the body: its readings lack
m (v r + x_G r^2) ahead and hold m u r and m x_G u r against the turn.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

RHO, L, B, D, MASS, X_G, IZ = 1000.0, 4.97, 0.70, 0.266, 590.0, -0.11, 700.0
NOISE = {"X": 0.3, "Y": 0.5, "N": 0.8}
TRUTH = {
    "X0": -0.0009, "Xvv": -0.0024, "Xrr": 0.0006, "Xdd": -0.0016, "Xvr": 0.0052,
    "Yv": -0.0116, "Yr": 0.0024, "Yd": -0.0028, "Yvvv": -0.081, "Yrrr": 0.0006, "Yvvr": 0.021, "Yvrr": -0.012,
    "Nv": -0.0037, "Nr": -0.0018, "Nd": 0.0014, "Nvvv": 0.004, "Nrrr": -0.0007, "Nvvr": -0.017, "Nvrr": 0.002,
    "Yrdd": -0.0007, "Nrdd": 0.0004, "Yvvd": -0.006, "Nvvd": 0.003, "Yddd": 0.0009, "Nddd": -0.0004,
}  # fmt: skip
"""Prime, by 1/2 rho L^2 U^2; rudder positive to starboard."""
HEEL = {
    "Xphiphi": -0.0004, "Yphi": -0.0006, "Yvvphi": 0.046, "Yvphiphi": 0.013, "Yrrphi": 0.009, "Yrphiphi": -0.004,
    "Nphi": -0.0003, "Nvvphi": -0.019, "Nvphiphi": -0.0054, "Nrrphi": -0.0039, "Nrphiphi": 0.0024,
}  # fmt: skip
"""Of the heel, rad, positive to starboard."""


def conditions() -> np.ndarray:
    """U (m/s), beta (rad), r', delta (rad)."""
    deg, U = np.radians, 1.3
    rows = [(U, deg(b), 0, 0) for b in range(-18, 19, 3)] + [(U, 0, 0, deg(d)) for d in range(-35, 36, 5) if d]
    rows += [(U, 0, r, 0) for r in (-0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8)]
    rows += [(U, deg(b), r, 0) for b in (-12, -6, 6, 12, 18) for r in (-0.6, -0.3, 0.3, 0.6)]
    rows += [(U, 0, r, deg(d)) for r in (-0.6, -0.3, 0.3, 0.6) for d in (-30, -15, 15, 30)]
    rows += [(U, deg(b), 0, deg(d)) for b in (-12, -6, 6, 12) for d in (-30, -15, 15, 30)]
    rows += [(U, deg(b), r, deg(d)) for b in (-8, 8) for r in (-0.5, 0.5) for d in (-20, 20)]
    return np.array(rows)


def at_heel() -> np.ndarray:
    """:func:`conditions`, and straight, drifting and turning at heels of 5 and 10 deg to both sides: phi (rad) last."""
    deg, U = np.radians, 1.3
    motions = [(b, 0) for b in (-12, -6, 0, 6, 12)] + [(0, r) for r in (-0.6, -0.3, 0.3, 0.6)]
    heeled = [(U, deg(b), r, 0, deg(heel)) for heel in (-10, -5, 5, 10) for b, r in motions]
    upright = conditions()
    return np.vstack([np.column_stack([upright, np.zeros(len(upright))]), heeled])


def gauges(truth: dict[str, float], U, beta, r, delta, phi=0.0) -> dict[str, np.ndarray]:
    """Readings X, Y (N) and N (N m), positive as the water pushes the model; `r` is r'."""
    v = -np.sin(beta)
    unit, total = 0.5 * RHO * L**2 * U**2, {"X": 0.0, "Y": 0.0, "N": 0.0}
    for name, value in truth.items():
        term = np.ones_like(U)
        for letter in name[1:].replace("0", "").replace("phi", "f"):
            term = term * {"v": v, "r": r, "d": delta, "f": phi}[letter]
        total[name[0]] = total[name[0]] + value * term
    rate, sway, ahead = r * U / L, v * U, U * np.cos(beta)
    return {
        "X": unit * total["X"] + MASS * (sway * rate + X_G * rate**2),
        "Y": unit * total["Y"] - MASS * ahead * rate,
        "N": L * unit * total["N"] - MASS * X_G * ahead * rate,
    }


def write_arm(
    folder: Path, truth: dict[str, float], seed: int = 0, *, noise: float = 1.0, column: str = "prime"
) -> Path:
    """``campaign.toml`` and its table; random errors of `noise` times :data:`NOISE`; yaw rate prime or in deg/s."""
    random = np.random.default_rng(seed)
    U, beta, r, delta, *heel = (at_heel() if "Yphi" in truth else conditions()).T
    read = gauges(truth, U, beta, r, delta, *heel)
    measured = [read[key] + noise * NOISE[key] * random.standard_normal(len(U)) for key in "XYN"]
    rate = r if column == "prime" else np.degrees(r * U / L)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "runs.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["U", "beta", "r", "delta", "X", "Y", "N", *(["phi"] if heel else [])])
        angles = map(np.degrees, heel)
        table.writerows(np.column_stack([U, np.degrees(beta), rate, np.degrees(delta), *measured, *angles]).tolist())
    key = "yaw_rate_prime" if column == "prime" else "yaw_rate_degps"
    path = folder / "campaign.toml"
    path.write_text(f"""
[model]
name = "Arm ship"
length_m = {L}
beam_m = {B}
draught_m = {D}
mass_kg = {MASS}
yaw_inertia_kgm2 = {IZ}
x_G_m = {X_G}
[test]
speed_mps = 1.3
force_convention = "on_gauge"
[averages]
file = "runs.csv"
scaling = "dimensional"
[averages.columns]
drift_deg = "beta"
rudder_deg = "delta"
speed_mps = "U"
{key} = "r"
{'heel_deg = "phi"' if heel else ""}
X = "X"
Y = "Y"
N = "N"
""")
    return path
