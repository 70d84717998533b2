"""The numbers of Krezelewski and Misiag, beside what the program has: terms of the models, section 5, PMM by (4.4).

The paper has no tables. Its printed numbers are those of section 5; the formulas are tried on made-up oscillations of
known derivatives, written out here. Ends with 1 if a number that should be reproduced is not.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from paper_numbers import PaperNumbers

from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS
from tank2sim.dynamics.rigid_body import inertia, rigid_body_accelerations
from tank2sim.identification.captive import tank_conditions as tank
from tank2sim.identification.captive.harmonics import reduced_run
from tank2sim.identification.captive.oscillation import oscillations
from tank2sim.records.campaigns import read_campaign

LENGTH, MASS, INERTIA, X_G, SPEED, DENSITY = 4.0, 400.0, 420.0, 0.1, 1.2, 1000.0
SWAY = {"Yv": -250.0, "Yvdot": -330.0, "Nv": -300.0, "Nvdot": 25.0}
YAW = {"Yr": 90.0, "Yrdot": -30.0, "Nr": -420.0, "Nrdot": -310.0}
OMEGA, AMPLITUDE = 0.6, 0.1
GRAVITY = 9.81


def terms(number: PaperNumbers) -> None:
    """Terms of (3.8)."""
    number.heading("(3.8), terms")
    for equation, force, count in (("a", "X", 16), ("b", "Y", 22), ("c", "N", 22)):
        number(f"(3.8{equation}), terms of {force}", count, len(ABKOWITZ_TERMS[force]), 0)
    number.heading("(3.7) against a solution of the mass matrix, largest difference")
    added = {"Xudot": -20.0, **{name: {**SWAY, **YAW}[name] for name in ("Yvdot", "Yrdot", "Nvdot", "Nrdot")}}
    own = inertia(MASS, X_G, INERTIA, added)
    matrix = np.array([[own.sway, own.sway_yaw], [own.yaw_sway, own.yaw]])
    apart = np.array(rigid_body_accelerations(own, 3.0, -5.0, 7.0)[1:]) - np.linalg.solve(matrix, [-5.0, 7.0])
    number("v', r'", 0, float(np.abs(apart).max()), 1e-12)


def section_5(number: PaperNumbers) -> None:
    """Scales and limits."""
    number.heading("Section 5")
    for model_m, length, reynolds in ((4.0, 55.25, 410.7), (2.0, 110.5, 1161.6)):
        ratio = tank.FroudeScaling(221 / model_m)
        number(f"221 m tanker, {model_m:g} m model: lambda", length, ratio.length, 1e-9)
        number(f"221 m tanker, {model_m:g} m model: ratio of Reynolds numbers", reynolds, ratio.reynolds, 0.05)
        found = (ratio.speed, ratio.frequency, ratio.force, ratio.moment)
        for words, power, own in zip(("speed and time", "omega", "force", "moment"), (0.5, -0.5, 3, 4), found,
                                     strict=True):  # fmt: skip
            number(f"221 m tanker, {model_m:g} m model: {words}, power of lambda", power, math.log(own, length), 1e-9)
    number("shortest model, m", 4, tank.SHORTEST_MODEL_M, 0)
    short = next(iter(tank.model_length(2.0))).message
    number("between 4 m and 2 m models, %", 10, 10 if "about 10 %" in short else math.nan, 0)
    number("largest zeta = omega U/g", 0.1, tank.LARGEST_FREQUENCY_PARAMETER, 0)
    period = tank.shortest_period_s(SPEED, GRAVITY)
    omega = 2 * math.pi / period
    number("zeta at the shortest period", 0.1, tank.brard_number(omega, SPEED, GRAVITY), 1e-12)
    froude_squared = SPEED**2 / (GRAVITY * LENGTH)
    number("omega' Fn^2 there", 0.1, tank.reduced_frequency(omega, SPEED, LENGTH) * froude_squared, 1e-12)
    trim = next(iter(tank.trim(0.04, 4.0))).message
    number("1 % of trim changes Y_r or N_r, %", 7.5, 7.5 if "1 % changed one of them by 7.5 %" in trim else math.nan, 0)


def oscillation(folder: Path) -> Mapping[str, float]:
    """Derivatives (prime) that the program finds in one pure sway and one pure yaw of known SI derivatives."""
    time = np.arange(0, 5 * 2 * np.pi / OMEGA, 0.05)
    velocity, zero = AMPLITUDE * np.cos(OMEGA * time), np.zeros_like(time)
    rate = -AMPLITUDE * OMEGA * np.sin(OMEGA * time)
    place = AMPLITUDE / OMEGA * np.sin(OMEGA * time)
    # (4.3) and its like for yaw: the force of the mechanism on the model
    Y = (MASS - SWAY["Yvdot"]) * rate - SWAY["Yv"] * velocity
    N = (MASS * X_G - SWAY["Nvdot"]) * rate - SWAY["Nv"] * velocity
    sway = (place, zero, velocity, zero, Y, N)
    Y = (MASS * X_G - YAW["Yrdot"]) * rate - (YAW["Yr"] - MASS * SPEED) * velocity
    N = (INERTIA - YAW["Nrdot"]) * rate - (YAW["Nr"] - MASS * X_G * SPEED) * velocity
    yaw = (zero, place, zero, velocity, Y, N)
    text = f'[model]\nname = "made up"\nlength_m = {LENGTH}\nmass_kg = {MASS}\nyaw_inertia_kgm2 = {INERTIA}\n'
    text += f'x_G_m = {X_G}\n[test]\nspeed_mps = {SPEED}\nforce_convention = "on_model"\n'
    header = "t_s,y_m,psi_rad,v_mps,r_radps,speed_mps,delta_rad,X_N,Y_N,N_Nm"
    for kind, (y, psi, v, r, force, moment) in {"sway": sway, "yaw": yaw}.items():
        table = np.column_stack([time, y, psi, v, r, zero + SPEED, zero, zero, force, moment])
        np.savetxt(folder / f"{kind}.csv", table, "%.15g", ",", header=header, comments="")
        text += f'[[runs]]\nfile = "{kind}.csv"\ntype = "pure_{kind}"\n'
    (folder / "campaign.toml").write_text(text)
    campaign = read_campaign(folder / "campaign.toml")
    return {
        name: value
        for row in oscillations(campaign, [reduced_run(run) for run in campaign.runs])
        for name, value in row.values.items()
    }


def unit(name: str) -> float:
    """SI value of a prime derivative of 1: 1/2 rho times powers of length and speed."""
    arm, turn = name[0] == "N", name[1] == "r"
    power, speed = (3, 0) if name.endswith("dot") else (2, 1)
    return 0.5 * DENSITY * LENGTH ** (power + arm + turn) * SPEED**speed


def mechanism(number: PaperNumbers) -> None:
    """(4.4) and its like for yaw."""
    number.heading("(4.4) and its like for yaw, derivatives from made-up oscillations, SI")
    with TemporaryDirectory() as folder:
        found = oscillation(Path(folder))
    for name, value in {**SWAY, **YAW}.items():
        number(name, value, found[name] * unit(name), 1e-6 * abs(value))


def numbers(number: PaperNumbers) -> None:
    """Every number."""
    terms(number)
    section_5(number)
    mechanism(number)


def main() -> int:
    number = PaperNumbers()
    numbers(number)
    return number.end()


if __name__ == "__main__":
    sys.exit(main())
