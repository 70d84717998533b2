"""A tank that tests a ship by the equations of Yasukawa and Yoshimura (2015), written here once more in plain numpy."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

RHO, L, B, D, MASS, X_G = 1000.0, 7.0, 1.27, 0.46, 3270.0, 0.25
D_P, A_R, H_R, F_ALPHA, X_P, X_R = 0.216, 0.0539, 0.345, 2.747, -0.48, -0.5
NOISE = {"X": 0.4, "Y": 1.0, "N": 2.5, "T": 0.25, "F": 0.4, "Q": 0.01, "K": 0.002, "K_Q": 0.0002}
TORQUE = {"q_0": 0.0318, "q_1": -0.0221, "q_2": -0.0138, "eta_R": 1.012}
KVLCC2 = {
    "R0": 0.022, "Xvv": -0.040, "Xvr": 0.002, "Xrr": 0.011, "Xvvvv": 0.771,
    "Yv": -0.315, "Yr": 0.083, "Yvvv": -1.607, "Yvvr": 0.379, "Yvrr": -0.391, "Yrrr": 0.008,
    "Nv": -0.137, "Nr": -0.049, "Nvvv": -0.030, "Nvvr": -0.294, "Nvrr": 0.055, "Nrrr": -0.013,
    "mx": 0.022, "my": 0.223,
    "k_0": 0.2931, "k_1": -0.2753, "k_2": -0.1385, "t_P": 0.22, "w_P0": 0.40, "C_1": 2.0, "C_2_plus": 1.6,
    "C_2_minus": 1.1, "t_R": 0.387, "a_H": 0.312, "x_H": -0.464, "eps": 1.09, "kappa": 0.50, "l_R": -0.710,
    "gamma_R_plus": 0.640, "gamma_R_minus": 0.395,
}  # fmt: skip


def conditions() -> np.ndarray:
    """U (m/s), beta (rad), r', delta (rad), n (1/s): load variation, rudder, drift, drift with rudder, turning."""
    deg, U, n = np.radians, 1.179, 10.4
    rows = [(U, 0, 0, 0, n * load) for load in (0.5, 0.7, 0.85, 1, 1.15, 1.3, 1.6)]
    rows += [(U, 0, 0, deg(d), n * load) for load in (0.8, 1, 1.4) for d in range(-35, 36, 5) if d]
    rows += [(U, deg(b), 0, 0, n) for b in (-20, -16, -12, -8, -4, 4, 8, 12, 16, 20)]
    rows += [(U, deg(b), 0, deg(d), n) for b in (-16, -8, 8, 16) for d in (-30, -15, 15, 30)]
    rows += [(U, deg(b), r, 0, n) for r in (-0.8, -0.5, -0.25, 0.25, 0.5, 0.8) for b in (-16, -8, 0, 8, 16)]
    rows += [(U, deg(b), r, deg(d), n) for r in (-0.5, 0.5) for b in (-8, 8) for d in (-25, 25)]
    return np.array(rows)


def side(p: dict[str, float], motion, delta, n, *, y: float = 0.0, mirror: float = 1.0) -> dict[str, np.ndarray]:
    """Thrust T, normal force F (N, to port) and torque Q (N m) of a propeller and rudder `y` L to starboard.

    `motion` is U, beta, r'; the numbers of the ship are those of the right side, and mirrored on the left.
    """
    U, beta, r = motion
    ahead = U * (np.cos(beta) - y * r)
    beta_P = beta - X_P * r
    C_2 = np.where(mirror * beta_P > 0, p["C_2_plus"], p["C_2_minus"])
    kept = (1 - p["w_P0"]) * (1 + (1 - np.exp(-p["C_1"] * np.abs(beta_P))) * (C_2 - 1))
    J = ahead * kept / (n * D_P)
    K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J**2
    T = RHO * n**2 * D_P**4 * K_T
    eta = D_P / H_R
    race = (1 + p["kappa"] * (np.sqrt(1 + 8 * K_T / (np.pi * J**2)) - 1)) ** 2
    u_R = p["eps"] * ahead * kept * np.sqrt(eta * race + 1 - eta)
    beta_R = beta - p["l_R"] * r
    v_R = U * np.where(mirror * beta_R > 0, p["gamma_R_plus"], p["gamma_R_minus"]) * beta_R
    F = 0.5 * RHO * A_R * F_ALPHA * (u_R**2 + v_R**2) * np.sin(delta - np.arctan2(v_R, u_R))
    q = {**TORQUE, **p}
    return {"T": T, "F": F, "Q": RHO * n**2 * D_P**5 * (q["q_0"] + q["q_1"] * J + q["q_2"] * J**2) / q["eta_R"]}


def forces(p: dict[str, float], U, beta, r, delta, n, *, y: float = 0.0) -> dict[str, np.ndarray]:
    """Gauge readings X, Y (N), N (N m) of a model in steady motion, thrust T, normal force F (N) and torque Q.

    With `y` it has two propellers and rudders, that far to either side; TL and FL are of the left one.
    """
    u, v = np.cos(beta), -np.sin(beta)  # prime
    unit = 0.5 * RHO * L * D * U**2
    right = side(p, (U, beta, r), delta, n, y=y)
    sides = [(right, y), (side(p, (U, beta, r), delta, n, y=-y, mirror=-1.0), -y)] if y else [(right, 0.0)]
    hull_X = -p["R0"] + p["Xvv"] * v**2 + p["Xvr"] * v * r + p["Xrr"] * r**2 + p["Xvvvv"] * v**4
    hull_Y, hull_N = (
        p[f"{f}v"] * v + p[f"{f}r"] * r + p[f"{f}vvv"] * v**3 + p[f"{f}vvr"] * v**2 * r
        + p[f"{f}vrr"] * v * r**2 + p[f"{f}rrr"] * r**3
        for f in "YN"
    )  # fmt: skip
    m, x_G = MASS / (0.5 * RHO * L**2 * D), X_G / L
    X = unit * (hull_X + (m + p["my"]) * v * r + x_G * m * r**2)
    Y = unit * (hull_Y - (m + p["mx"]) * u * r)
    N = L * unit * (hull_N - x_G * m * u * r)
    for each, place in sides:
        push, drag = (1 - p["t_P"]) * each["T"], (1 - p["t_R"]) * each["F"] * np.sin(delta)
        X = X + push - drag
        Y = Y - (1 + p["a_H"]) * each["F"] * np.cos(delta)
        N = N - L * (X_R + p["a_H"] * p["x_H"]) * each["F"] * np.cos(delta) - L * place * (push - drag)
    return {"X": X, "Y": Y, "N": N, **right} | ({"TL": sides[1][0]["T"], "FL": sides[1][0]["F"]} if y else {})


def write_campaign(
    folder: Path,
    p: dict[str, float],
    seed: int = 0,
    *,
    noise: float = 1.0,
    rows=None,
    rudder_zero: float = 0.0,
    torque: bool = False,
    y: float = 0.0,
) -> Path:
    """``campaign.toml`` and its tables in a folder; random errors of standard deviation `noise` times :data:`NOISE`."""
    random, at = np.random.default_rng(seed), conditions() if rows is None else rows
    U, beta, r, delta, n = at.T
    read = forces(p, U, beta, r, delta + rudder_zero, n, y=y)
    J = np.linspace(0, 0.9, 19)
    K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J**2 + noise * NOISE["K"] * random.standard_normal(len(J))
    with (folder / "runs.csv").open("w", newline="") as file:
        table = csv.writer(file)
        keys = ["X", "Y", "N", "T", "F", *(["TL", "FL"] if y else [])]
        table.writerow(["U", "beta", "r", "delta", "rps", *keys])
        measured = [read[key] + noise * NOISE[key[0]] * random.standard_normal(len(U)) for key in keys]
        table.writerows(np.column_stack([U, np.degrees(beta), r, np.degrees(delta), n, *measured]).tolist())
    with (folder / "water.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("J", "K_T"), *zip(J.tolist(), K_T.tolist(), strict=True)])
    if torque:
        q, random_of_torque = {**TORQUE, **p}, np.random.default_rng([seed, 7])
        of_K_Q = noise * NOISE["K_Q"] * random_of_torque.standard_normal(len(J))
        K_Q = q["q_0"] + q["q_1"] * J + q["q_2"] * J**2 + of_K_Q
        add_torque(folder, read["Q"] + noise * NOISE["Q"] * random_of_torque.standard_normal(len(U)), K_Q)
    path = folder / "campaign.toml"
    path.write_text(f"""
[model]
name = "Tank ship"
length_m = {L}
beam_m = {B}
draught_m = {D}
mass_kg = {MASS}
x_G_m = {X_G}
propeller_diameter_m = {D_P}
rudder_area_m2 = {A_R}
[test]
speed_mps = 1.179
force_convention = "on_gauge"
[open_water]
file = "water.csv"
{'K_Q = "10K_Q"' if torque else ""}
{"K_Q_factor = 0.1" if torque else ""}
[propeller]
x_P = {X_P}
{f"number = 2{chr(10)}y_P = {y}" if y else ""}
[rudder]
height_m = {H_R}
f_alpha = {F_ALPHA}
x_R = {X_R}
{f"y_R = {y}" if y else ""}
[averages]
file = "runs.csv"
scaling = "dimensional"
[averages.columns]
drift_deg = "beta"
rudder_deg = "delta"
speed_mps = "U"
yaw_rate_prime = "r"
propeller_rps = "rps"
X = "X"
Y = "Y"
N = "N"
thrust = "T"
rudder_normal_force = "F"
{'torque = "Q"' if torque else ""}
{f'thrust_left = "TL"{chr(10)}rudder_normal_force_left = "FL"' if y else ""}
""")
    return path


def read_rows(folder: Path, name: str = "runs.csv") -> tuple[list[str], np.ndarray]:
    """Heads and numbers of a table."""
    heads, *rows = (folder / name).read_text().splitlines()
    return heads.split(","), np.array([[float(cell) for cell in row.split(",")] for row in rows])


def write_rows(folder: Path, heads: list[str], table: np.ndarray, name: str = "runs.csv") -> None:
    """Write a table in the place of the one that was read."""
    (folder / name).write_text("\n".join(",".join(row) for row in [heads, *(map(repr, r) for r in table.tolist())]))


def add_torque(folder: Path, torque: np.ndarray, K_Q: np.ndarray) -> None:
    """A column of torque in the table, and one of 10 K_Q in that of the open-water test."""
    for name, heading, values in (("runs.csv", "Q", torque), ("water.csv", "10K_Q", 10 * K_Q)):
        heads, table = read_rows(folder, name)
        write_rows(folder, [*heads, heading], np.column_stack([table, values]), name)


def hmri_campaign(data: Path, folder: Path) -> Path:
    """HMRI's campaign with its columns of thrust and normal force, and the sizes of the KVLCC2 at 1:46.426."""
    source = data / "data" / "kvlcc2_captive_hmri"
    text = (source / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('"captive.csv"', f'"{source / "captive.csv"}"')
    sizes = f"propeller_diameter_m = {9.86 / 46.426}\nrudder_area_m2 = {112.5 / 46.426**2}\n"
    water = f'[open_water]\nfile = "{source / "open_water_characteristics_captive.csv"}"\nK_T = "Kt"\n'
    rudder = f"[propeller]\nx_P = -0.48\n[rudder]\nheight_m = {15.8 / 46.426}\nf_alpha = 2.747\n"
    text = text.replace("[test]", f"{sizes}{water}{rudder}[test]")
    text = text.replace('rudder_sign = "port"', 'rudder_sign = "port"\nnormal_force_sign = "starboard"')
    columns = 'propeller_rps = "rps"\nthrust = "TX\'"\nrudder_normal_force = "RY\'"\n'
    (folder / "campaign.toml").write_text(f"{text.rstrip()}\n{columns}", encoding="utf-8")
    return folder / "campaign.toml"


def as_runs(folder: Path, seed: int = 0, *, readings: int = 40, on_model: bool = False) -> Path:
    """The campaign of :func:`write_campaign` in `folder` with a file for each condition, of noisy readings about it.

    `on_model` records the forces of the mechanism on the model.
    """
    random = np.random.default_rng([seed, 9])
    sheet = (folder / "campaign.toml").read_text().partition("[averages]")[0]
    with (folder / "runs.csv").open() as file:
        rows = [{key: float(cell) for key, cell in row.items()} for row in csv.DictReader(file)]
    for place, row in enumerate(rows):
        beta, delta = np.radians(row["beta"]), np.radians(row["delta"])
        kind = "static_drift" if not delta else "drift_and_rudder" if beta else "static_rudder"
        kind = "steady_turn" if row["r"] else kind
        sheet += (
            f'[[runs]]\nfile = "{place}.csv"\ntype = "{kind}"\ndrift_deg = {row["beta"]}\nrudder_deg = {row["delta"]}\n'
        )
        names = {"X": "X_N", "Y": "Y_N", "N": "N_Nm", "T": "thrust_N", "F": "rudder_normal_force_N"}
        columns = {"t_s": 0.5 * np.arange(readings), "speed_mps": np.full(readings, row["U"])}
        columns |= {
            "r_radps": np.full(readings, row["r"] * row["U"] / L),
            "propeller_rps": np.full(readings, row["rps"]),
        }
        for key, name in names.items():
            noise = random.standard_normal(readings)
            sign = -1 if on_model and key in "XYN" else 1
            columns[name] = sign * row[key] + 3 * NOISE[key] * (noise - noise.mean())
        with (folder / f"{place}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([list(columns), *np.column_stack(list(columns.values())).tolist()])
    sheet = sheet.replace('"on_gauge"', '"on_model"') if on_model else sheet
    (folder / "campaign.toml").write_text(sheet)
    return folder / "campaign.toml"


def ship_like_the_kvlcc2(seed: int, masses: dict[str, tuple[float, float]]) -> dict[str, float]:
    """Every coefficient off by up to 15 %; m_x and m_y off `masses`, estimate and standard error by name, by chance."""
    random = np.random.default_rng(seed)
    truth = {name: value * random.uniform(0.85, 1.15) for name, value in KVLCC2.items()}
    for name, key in (("Xudot", "mx"), ("Yvdot", "my")):
        truth[key] = -masses[name][0] + masses[name][1] * random.standard_normal()
    return truth


STATED = """[uncertainty]
calibration_relative = 0.01
alignment_deg = 0.4
rudder_deg = 0.5
speed_relative = 0.01
blockage_relative = 0.005
mass_relative = 0.01
"""


def with_common_errors(path: Path, seed: int) -> Path:
    """The campaign with errors common to all its rows, of the sizes that it states; the sign of each by chance."""
    random = np.random.default_rng([seed, 5])
    heads, table = read_rows(path.parent)
    U, beta, r = table[:, 0].copy(), np.radians(table[:, 1]), table[:, 2].copy()
    u, v, rate = U * np.cos(beta), -U * np.sin(beta), r * U / 7.0
    mass = 3270.0 * 0.01 * random.standard_normal()
    table[:, 5] += mass * (v * rate + 0.25 * rate**2)
    table[:, 6] -= mass * u * rate
    table[:, 7] -= mass * 0.25 * u * rate
    table[:, 5:] *= 1 + 0.01 * random.standard_normal(5)
    table[:, 1] += 0.4 * random.standard_normal()
    table[:, 3] += 0.5 * random.standard_normal()
    table[:, 0] *= 1 + np.hypot(0.01, 0.005) * random.standard_normal()
    table[:, 2] = rate * 7.0 / table[:, 0]
    write_rows(path.parent, heads, table)
    path.write_text(STATED + path.read_text())
    return path
