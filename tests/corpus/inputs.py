"""Small good inputs to every command, made here with numpy or, where only the program makes them, by the program."""

from __future__ import annotations

import functools
import json
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from tests.apps.logs.made_logs import candump_lines, frame, nmea_lines
from tests.corpus.mutations import Files
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.rotating_arm import HEEL, TRUTH, write_arm
from tests.identification.captive_mmg.tank import KVLCC2, STATED, write_campaign

MODELS = Path(__file__).resolve().parents[2] / "models"


def trial(rudder_deg: float, seconds: float, switch_deg: float | None, seed: int) -> bytes:
    """A turn, or a zigzag that reverses at a heading, of a linear ship like the Mariner, with white noise; 2 Hz."""
    speed, begin, length, step = 7.7175, 7.7175, 160.93, 0.5
    mass = np.array([[798e-5 + 748e-5, -0.023 * 798e-5 + 9.354e-5], [-0.023 * 798e-5 - 4.646e-5, 39.2e-5 + 43.8e-5]])
    damping = np.array([[-1160e-5, -499e-5], [-264e-5, -166e-5]])
    rudder_force = np.array([-278e-5, 139e-5])
    rng = np.random.default_rng(seed)
    state, pose, rudder, order, rows = np.zeros(2), np.zeros(3), 0.0, rudder_deg, []
    for number in range(int(seconds / step)):
        noise = rng.normal(0, (0.02, 0.02, 0.01, 0.05, 0.3, 0.3))
        rows.append((number * step, order, rudder, speed + noise[0], state[0] * speed + noise[1],
                     np.degrees(state[1] * speed / length) + noise[2], np.degrees(pose[2]) + noise[3],
                     pose[0] + noise[4], pose[1] + noise[5]))  # fmt: skip
        if switch_deg is not None and np.degrees(pose[2]) * np.sign(order) >= switch_deg:
            order = -order
        rudder += float(np.clip(order - rudder, -5 * step, 5 * step))
        change = np.linalg.solve(mass, damping @ state + rudder_force * np.radians(rudder))
        state = state + change * step * speed / length
        sway, yaw = state[0] * speed, state[1] * speed / length
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        speed += step * (0.01 * (begin - speed) - 90 * yaw**2)
        pose = pose + step * np.array([speed * cos - sway * sin, speed * sin + sway * cos, yaw])
    header = "t_s,delta_order_deg,delta_deg,u_mps,v_mps,r_degps,psi_deg,x_m,y_m"
    return _csv(["made up"], header, rows)


def _csv(comments: list[str], header: str, rows: list[tuple[float, ...]]) -> bytes:
    lines = [f"# {text}" for text in comments] + [header] + [",".join(f"{cell:.7g}" for cell in row) for row in rows]
    return ("\n".join(lines) + "\n").encode()


def simman(rows: int = 200) -> bytes:
    """Like a SIMMAN file of HSVA: a title, and rows of twelve numbers."""
    t = np.arange(rows) * 0.05
    psi, zero = 5 * np.sin(t / 3), np.zeros(rows)
    table = np.column_stack([t, 1.18 * t, zero, psi, zero + 1.18, zero, np.gradient(psi, t), zero, 10 * np.cos(t),
                             zero + 10.2, zero + 41, zero + 1.02])  # fmt: skip
    text = " HSVA, experimental data CPMC\n KVLCC2\n Z10/5\n Time series of motions\n"
    return (text + "\n".join("".join(f"{cell:20.9f}" for cell in row) for row in table) + "\n").encode()


def craft_trial() -> bytes:
    """A trial of the Otter: revolutions of both thrusters, position and heading; ahead, then a circle to starboard."""
    rows = ["t_s,x_m,y_m,psi_deg,n_port_rpm,n_starboard_rpm"]
    step, speed, rate = 0.5, 1.3, math.radians(6.6)
    for k in range(60):
        turned = max(0.0, step * (k - 20)) * rate
        north = speed * step * min(k, 20) + speed / rate * math.sin(turned)
        east = speed / rate * (1 - math.cos(turned))
        rows.append(
            f"{step * k},{north:.3f},{east:.3f},{math.degrees(turned):.2f},{600 + 50 * (k > 20)},{600 - 50 * (k > 20)}"
        )
    return ("\n".join(rows) + "\n").encode()


@functools.cache
def plain() -> Files:
    """Inputs that nothing has to compute."""
    oscillating = np.sin(np.linspace(0, 40, 400))
    campaign = {f"tank/{name}": data for name, data in _campaign().items()} | _averages()
    return {
        **campaign,
        "zigzag.csv": trial(20, 150, 20, 1),
        "turn.csv": trial(35, 200, None, 2),
        "other.csv": trial(-20, 150, 20, 3),
        "hsva.dat": simman(),
        "card.toml": (MODELS / "mariner" / "ship.toml").read_bytes(),
        "tanker.toml": (MODELS / "kvlcc2-captive" / "ship.toml").read_bytes(),
        "surge.toml": (MODELS / "wilinski-zellman" / "ship.toml").read_bytes(),
        "craft.toml": (MODELS / "otter" / "ship.toml").read_bytes(),
        "craft.csv": craft_trial(),
        "glider.toml": (MODELS / "kulikovsky-velikanov" / "ship.toml").read_bytes(),
        "rig.toml": (MODELS / "alyshev" / "ship.toml").read_bytes(),
        "steering.toml": (MODELS / "poznyakov-yudin" / "steering.toml").read_bytes(),
        "tows.csv": (MODELS / "wilinski-zellman" / "tows.csv").read_bytes(),
        "programme.csv": (MODELS / "kulikovsky-velikanov" / "programme.csv").read_bytes(),
        "orders.csv": b"t_s,delta_order_deg\n0,10\n20,-10\n40,0\n60,0\n",
        "tank.toml": TANK.encode(),
        "captive_runs.toml": CAPTIVE_RUNS.encode(),
        "track.csv": b"x_m,y_m\n0,0\n2000,0\n3000,1500\n6000,1500\n",
        "captive.toml": AVERAGES,
        "averages.csv": _csv([], "beta,delta,U,X,Y,N", [
            (b, d, 1.2, -0.016 - 1e-5 * d * d, 0.005 * b - 0.0003 * d, 0.002 * b + 0.0001 * d)
            for b, d in [(b, 0.0) for b in range(-8, 9, 2)] + [(0.0, d) for d in range(-20, 21, 5)]
        ])[0:],
        "voyage.csv": frame().iloc[::4].to_csv(index=False).encode(),
        "voyage.nmea": "\n".join(nmea_lines()[:2400]).encode() + b"\n",
        "voyage.log": "\n".join(list(candump_lines())[:3000]).encode() + b"\n",
        "digits.csv": _digits(),
        "brackets.log": b"# frames\n" + b"".join(_brackets(line) for line in list(candump_lines())[:3000]),
        "mixed.nmea": _mixed(nmea_lines()[:2400]),
        "noise.csv": _csv([], "t_s,delta_deg,r_degps", [(i * 0.5, 0.0, float(r)) for i, r in enumerate(oscillating)]),
    }  # fmt: skip


def _digits() -> bytes:
    """The voyage with its clock in digits, and -999 for some headings."""
    table = frame().iloc[::4]
    moments = pd.to_datetime(table["utc"])
    table.insert(0, "date", moments.dt.strftime("%d%m%y"))
    table["utc"] = moments.dt.strftime("%H%M%S")
    table.loc[::40, "heading_deg"] = -999
    return table.to_csv(index=False).encode()


def _brackets(line: str) -> bytes:
    """A line of candump -L as candump -t a writes it."""
    stamp, bus, frame_text = line.split()
    name, data = frame_text.split("#")
    return f" {stamp}  {bus}  {name}   [8]  {' '.join(data[k : k + 2] for k in range(0, 16, 2))}\n".encode()


def _mixed(lines: list[str]) -> bytes:
    """Sentences two in a line, rudders as transducers, some without a checksum, and unknown ones."""
    text = [line.partition("*")[0] if "ROT" in line else line for line in lines]
    text = [
        line.replace("$AGRSA,", "$IIXDR,A,").partition(",A,,")[0] + ",D,RUDDER" if "RSA" in line else line
        for line in text
    ]
    return "".join(a + b + "\n" for a, b in zip(text[::2], text[1::2], strict=True)).encode() + b"$PABC,1.5,A\n" * 40


AVERAGES = b"""[model]
name = "averages"
length_m = 7.0
beam_m = 1.2
draught_m = 0.45
mass_kg = 3100.0
x_G_m = 0.24
[test]
water_density_kgpm3 = 1000.0
gravity_mps2 = 9.81
speed_mps = 1.2
force_convention = "hydrodynamic"
[averages]
file = "averages.csv"
scaling = "prime"
rudder_sign = "starboard"
[averages.columns]
drift_deg = "beta"
rudder_deg = "delta"
speed_mps = "U"
X = "X"
Y = "Y"
N = "N"
"""


TANK = """format = "tank2sim-tank/1"
[carriage]
length_m = 240.0
waiting_s = 600.0
[mechanism]
sway_amplitude_m = 2.0
heading_amplitude_deg = 35.0
drift_deg = 20.0
cycles = 3
[gauges]
Y_range_N = 300.0
noise_share = 0.005
zero_share = 0.001
rate_hz = 20.0
[model]
length_m = 4.0
[tank]
breadth_m = 10.0
"""

CAPTIVE_RUNS = """[model]
name = "model"
length_m = 4.0
mass_kg = 240.0
[test]
speed_mps = 1.2
force_convention = "on_gauge"
[[runs]]
file = "a.csv"
type = "static_drift"
drift_deg = 6.0
[[runs]]
file = "b.csv"
type = "static_rudder"
rudder_deg = -20.0
[[runs]]
file = "c.csv"
type = "pure_sway"
frequency_radps = 0.6
amplitude_m = 0.3
[[runs]]
file = "d.csv"
type = "pure_yaw"
frequency_radps = 0.6
yaw_rate_amplitude_degps = 5.0
"""


def _averages() -> Files:
    """Tables of a rotating arm with heel, and of a tank with thrust, torque and normal force of the rudder."""
    with tempfile.TemporaryDirectory() as folder:
        write_arm(Path(folder) / "arm", TRUTH | HEEL)
        (Path(folder) / "mmg").mkdir()
        path = write_campaign(Path(folder) / "mmg", KVLCC2, torque=True)
        path.write_text(STATED + path.read_text())
        files = [file for part in ("arm", "mmg") for file in sorted((Path(folder) / part).iterdir())]
        return {f"{file.parent.name}/{file.name}": file.read_bytes() for file in files}


def _campaign() -> Files:
    with tempfile.TemporaryDirectory() as folder:
        path = write(Campaign(seed=6, size="linear", rate_hz=2.0), Path(folder)).path
        return {
            file.name: file.read_bytes() for file in sorted(path.parent.iterdir()) if file.suffix in (".csv", ".toml")
        }


def shortened(content: bytes) -> bytes:
    """A JSON result whose long lists are a few entries long: mutations then reach what carries the meaning."""

    def short(value: object) -> object:
        if isinstance(value, dict):
            return {key: short(item) for key, item in value.items()}
        return (
            [short(item) for item in (value[:40] if isinstance(value, list) and len(value) > 40 else value)]
            if isinstance(value, list)
            else value
        )

    return json.dumps(short(json.loads(content))).encode()


def thinned(content: bytes, step: int) -> bytes:
    """A CSV with every so-manieth row, its comments and its header."""
    lines = content.decode().splitlines()
    head = next(number for number, line in enumerate(lines) if not line.startswith("#")) + 1
    return "\n".join(lines[:head] + lines[head::step]).encode() + b"\n"


Make = Callable[[list[str], str], bytes]
"""Runs the command with these arguments among the plain inputs, and gives what it wrote into a file of this name."""

RESULTS: dict[str, list[str]] = {
    "simulate.json": ["simulate", "card.toml", "--manoeuvre", "zigzag:20/20", "--duration", "300"],
    "audit.json": ["audit", "zigzag.csv"],
    "tow.json": ["tow", "tows.csv"],
    "reduce.json": ["reduce", "captive.toml"],
    "stability.json": ["stability", "card.toml", "--no-spirals"],
    "compare.json": ["compare", "card.toml", "tanker.toml", "--members", "0"],
    "validate.json": ["validate", "card.toml", "zigzag.csv", "--members", "0"],
    "influence.json": ["influence", "card.toml", "--figures", "K_per_s"],
    "design.json": ["design", "card.toml", "--figures", "steady_radius_m@20", "--hours", "3", "--members", "0"],
    "glide.json": ["glide", "glider.toml", "--angles", "-30", "--programme", "programme.csv"],
    "autopilot.json": ["autopilot", "card.toml"],
    "signals.json": ["signals", "zigzag.csv"],
    "identify.json": ["identify", "card.toml", "zigzag.csv", "--holdout", "turn.csv", "--structure", "linear",
                      "--members", "0", "--method", "equation_error"],
}  # fmt: skip
"""Results that `report` makes a page of, and how they come about."""
