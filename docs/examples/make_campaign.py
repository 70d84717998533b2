"""A made-up captive campaign whose truth is known: what a tank would measure on a model of the Mariner.

``python docs/examples/make_campaign.py campaign`` writes ``campaign/campaign.toml`` and a CSV file for each run.
Nothing here was measured: forces are those of the bundled card (Chislett and Strom-Tejsen 1965), the rest is made up.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from tank2sim.cards import read_card
from tank2sim.cards.terms import known_term

CARD = read_card("mariner")
SCALE = 25.0
DENSITY = 1000.0
RATE_HZ = 10.0
PERIODS = 4
NOISE = {"X": 0.5, "Y": 1.5, "N": 4.0}  # N and N m: about 1 % of the largest forces
ZERO_ERROR = 0.1  # of each run, in parts of the noise
RESISTANCE = -0.5 * CARD.derivatives["Xu"]  # prime, at the speed of the test: as of a resistance by u^2

LENGTH = CARD.ship.length_m / SCALE
SPEED = CARD.model.speed_mps / math.sqrt(SCALE)  # by Froude's law
MASS, INERTIA, X_G = (
    CARD.rigid_body.mass * DENSITY / 2 * LENGTH**3,
    CARD.rigid_body.yaw_inertia * DENSITY / 2 * LENGTH**5,
    CARD.rigid_body.x_G * LENGTH,
)

HEAD = f"""\
# Made up by docs/examples/make_campaign.py from the card of the Mariner; nothing here was measured.
[model]
name = "Mariner 1:{SCALE:g}, made up"
length_m = {LENGTH:.6g}
beam_m = {CARD.ship.beam_m / SCALE:.6g}
draught_m = {CARD.ship.draught_m / SCALE:.6g}
mass_kg = {MASS:.6g}
yaw_inertia_kgm2 = {INERTIA:.6g}
x_G_m = {X_G:.6g}
scale = {SCALE:g}

[test]
water_density_kgpm3 = {DENSITY:g}
speed_mps = {SPEED:.6g}
force_convention = "on_model"    # the force of the mechanism on the model
inertia_speed = "axial"

[tank]
breadth_m = 12.0
depth_m = 5.5
"""


def runs() -> list[dict[str, object]]:
    """The sheet of each run, by the keys of ``[[runs]]``."""
    found: list[dict[str, object]] = []
    for drift in (-12, -9, -6, -3, 0, 3, 6, 9, 12):
        found.append({"type": "static_drift", "drift_deg": drift, "rudder_deg": 0})
    for rudder in (-35, -25, -15, -7, 7, 15, 25, 35):
        found.append({"type": "static_rudder", "drift_deg": 0, "rudder_deg": rudder})
    for frequency in (0.4, 0.6):
        for share in (0.06, 0.12, 0.2):
            amplitude = {"frequency_radps": frequency, "amplitude_m": round(share * SPEED / frequency, 4)}
            found.append({"type": "pure_sway", **amplitude})
        for share in (0.2, 0.4, 0.6):
            rate = {"frequency_radps": frequency, "yaw_rate_amplitude_degps": round(share * 57.3 * SPEED / LENGTH, 3)}
            found.append({"type": "pure_yaw", **rate})
            for drift in (-8, 4, 10):
                found.append({"type": "yaw_with_drift", "drift_deg": drift, **rate})
    return [{"file": f"{number:02d}_{one['type']}.csv", **one} for number, one in enumerate(found, start=1)]


def motion(run: dict[str, object]) -> dict[str, np.ndarray]:
    """How the mechanism moves the model: the carriage keeps the speed ahead (in yaw the speed along its way)."""
    w = float(run.get("frequency_radps", 0.0))
    duration = PERIODS * 2 * math.pi / w if w else 15.0
    t = np.arange(round(duration * RATE_HZ)) / RATE_HZ
    drift, zero = math.radians(float(run.get("drift_deg", 0.0))), np.zeros_like(t)
    u, v = zero + SPEED * math.cos(drift), zero - SPEED * math.sin(drift)
    y, psi, r, v_dot, r_dot = zero, zero + drift, zero, zero, zero
    if run["type"] == "pure_sway":
        a = float(run["amplitude_m"])
        y, v, v_dot = a * np.sin(w * t), a * w * np.cos(w * t), -a * w * w * np.sin(w * t)
        u = zero + SPEED
    elif w:
        a = math.radians(float(run["yaw_rate_amplitude_degps"]))
        r, r_dot = a * np.cos(w * t), -a * w * np.sin(w * t)
        y, psi = -SPEED * a / w**2 * np.cos(w * t), psi + a / w * np.sin(w * t)
    rudder = zero + math.radians(float(run.get("rudder_deg", 0.0)))
    return {"t": t, "y": y, "psi": psi, "u": u, "v": v, "r": r, "v_dot": v_dot, "r_dot": r_dot, "rudder": rudder}


def forces(m: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What the mechanism must do (N, N m): move the mass, (3.1) of the manual, against the water, (3.8)."""
    U = np.hypot(m["u"], m["v"])
    scale = DENSITY / 2 * LENGTH**2 * U**2
    prime = {"v": m["v"] / U, "r": m["r"] * LENGTH / U, "d": m["rudder"], "u": (m["u"] - SPEED) / U}
    acceleration = {"u": 0.0 * U, "v": m["v_dot"] * LENGTH / U**2, "r": m["r_dot"] * LENGTH**2 / U**2}
    water = {name: np.zeros_like(U) for name in "XYN"}
    for name, value in CARD.derivatives.items():
        term = known_term(name)
        powers = {"v": term.v, "r": term.r, "d": term.d, "u": term.u}
        size = (
            acceleration[term.acceleration]
            if term.acceleration
            else math.prod(prime[p] ** n for p, n in powers.items())
        )
        water[term.force] = water[term.force] + value * size
    # The model is towed without a propeller: the thrust that balances the resistance at the test speed is missing.
    water["X"] -= RESISTANCE * (SPEED / U) ** 2
    # Of the card's derivatives by r the ship's own inertia is a part ("total"); the water knows nothing of it.
    mass, x_G = CARD.rigid_body.mass, CARD.rigid_body.x_G
    water["X"] -= mass * prime["v"] * prime["r"] + mass * x_G * prime["r"] ** 2
    water["Y"] += mass * prime["r"]
    water["N"] += mass * x_G * prime["r"]
    sideways = m["v_dot"] + m["u"] * m["r"]
    return {
        "X": MASS * (-m["v"] * m["r"] - X_G * m["r"] ** 2) - scale * water["X"],
        "Y": MASS * (sideways + X_G * m["r_dot"]) - scale * water["Y"],
        "N": INERTIA * m["r_dot"] + MASS * X_G * sideways - scale * LENGTH * water["N"],
    }


def write(folder: Path) -> int:
    """Write the campaign; how many runs it has."""
    folder.mkdir(parents=True, exist_ok=True)
    chance = np.random.default_rng(1965)
    sheets = [HEAD]
    for run in runs():
        m = motion(run)
        measured = [
            force + NOISE[name] * (chance.normal(size=len(force)) + ZERO_ERROR * chance.normal())
            for name, force in forces(m).items()
        ]
        columns = [m["t"], m["y"], np.degrees(m["psi"]), m["v"], np.degrees(m["r"]), np.hypot(m["u"], m["v"])]
        np.savetxt(
            folder / str(run["file"]),
            np.column_stack([*columns, np.degrees(m["rudder"]), *measured]),
            delimiter=",",
            header="t_s,y_m,psi_deg,v_mps,r_degps,speed_mps,delta_deg,X_N,Y_N,N_Nm",
            comments="",
            fmt="%.6g",
        )
        lines = [f"{key} = {value!r}".replace("'", '"') for key, value in run.items()]
        sheets.append("\n".join(["[[runs]]", *lines]) + "\n")
    (folder / "campaign.toml").write_text("\n".join(sheets), encoding="utf-8")
    return len(sheets) - 1


if __name__ == "__main__":
    target = Path(sys.argv[1])
    print(f"{target}: campaign.toml and {write(target)} runs, made up")
