"""Made-up voyages of ships from their logs: the tactical diameter of a turn that was not fitted.

Each ship is the bundled Mariner with every derivative off by some 4 %, in a current of 0 to 0.7 m/s and a wind of 3 to
8 m/s with gusts. Her log has position, speed and course over ground, heading, rate of turn, rudder and revolutions with
white and slowly wandering noise, with or without the speed through the water. ``tank2sim log`` cuts it, the bundled
card is fitted to the zigzag and the small turn, and the turn of 35 deg is predicted: by the default of ``identify`` and
by output error. Then the same without wind.

``python benchmarks/ship_log.py 6 101`` takes 6 ships from seed 101; ``6 101 residuals/card,residuals/cross_flow`` fits
each in these structures instead of the one that `identify` chooses.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import tank2sim as t2s
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.reading import revised
from tank2sim.dynamics import build

STEP = 0.5
METRES, KNOT = 111_200.0, 1852 / 3600
AIR = 1.225
FRONT_M2, SIDE_M2 = 350.0, 1300.0
"""Areas of a cargo ship of this size in the wind; force coefficients of 0.7 ahead, 0.8 abeam, 0.1 of yaw (round)."""
METHODS = ("residuals", "output_error")


def wandering(rng: np.random.Generator, count: int, white: float, slow: float, time_s: float) -> np.ndarray:
    """White noise of deviation `white` and Gauss-Markov noise of deviation `slow`."""
    kept = np.exp(-STEP / time_s)
    values = np.empty(count)
    values[0] = rng.normal()
    for k in range(1, count):
        values[k] = kept * values[k - 1] + np.sqrt(1 - kept**2) * rng.normal()
    return white * rng.normal(size=count) + slow * values


def true_ship(rng: np.random.Generator) -> ManoeuvringCard:
    """The Mariner with every hydrodynamic derivative off by a standard deviation of 4 %."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    changed = {
        name: (value * (1 + 0.04 * rng.normal()), 0.02 * abs(value))
        for name, value in card.derivatives.items()
        if not name.endswith("dot")
    }
    return revised(card, changed)


class Helm:
    """Orders of the voyage: straight, zigzag, straight, hard turn, straight, small turn, straight."""

    def __init__(self, rng: np.random.Generator, heading: float) -> None:
        side, other = rng.choice([-1.0, 1.0], 2)
        self.zigzag = np.radians(rng.choice([10.0, 15.0, 20.0])) * side
        self.turns = [(35.0 * other, 190.0), (-other * rng.choice([15.0, 20.0]), 75.0)]
        self.hold, self.phase, self.since, self.reversals, self.order = heading, 0, 0.0, 0, 0.0

    def rudder(self, t: float, psi: float, rate: float) -> float:
        """Ordered rudder, rad; the voyage is over in phase 7."""
        self.since += STEP
        if self.phase == 1:
            if (psi - self.hold) * np.sign(self.order) > abs(self.zigzag):
                self.reversals += 1
                self.order = -self.order
            if self.reversals < 4:
                return self.order
            self._next(psi)
        elif self.phase in (3, 5):
            angle, change = self.turns[(self.phase - 3) // 2]
            if abs(psi - self.hold) < np.radians(change):
                return float(np.radians(angle))
            self._next(psi)
        elif self.since > 80.0:
            self._next(psi)
            self.order = self.zigzag
            return self.rudder(t, psi, rate) if self.phase < 7 else 0.0
        return float(np.clip(-6.0 * rate, -0.05, 0.05))

    def _next(self, psi: float) -> None:
        self.phase, self.since, self.hold = self.phase + 1, 0.0, psi


def voyage(seed: int, density: float = AIR) -> tuple[dict[str, np.ndarray], np.random.Generator, tuple[float, float]]:
    """States of a voyage at each step, SI, in air of `density`; the generator for the noise; current (m/s, deg)."""
    rng = np.random.default_rng(seed)
    card = true_ship(rng)
    model = build(card)
    p, names = model.parameter_values(), model.state_names
    place = {name: names.index(f"motion.{name}") for name in ("u", "v", "r", "psi", "x", "y")}
    x = np.array(model.initial(p)).ravel()
    u = model.input_values()
    command = model.input_names.index("rudder.command")
    half = 0.5 * 1025.0 * card.ship.length_m
    L, d, body = card.ship.length_m, card.derivatives, card.rigid_body
    inertia = (
        half * L**2 * np.array([body.mass - d["Xudot"], body.mass - d["Yvdot"], (body.yaw_inertia - d["Nrdot"]) * L**2])
    )
    speed, towards = rng.uniform(0.0, 0.7), rng.uniform(0, 2 * np.pi)
    wind, blows_to = rng.uniform(3.0, 8.0), rng.uniform(0, 2 * np.pi)
    gust = 1 + wandering(rng, 4000, 0.0, 0.1, 40.0)
    turned = wandering(rng, 4000, 0.0, 0.1, 60.0)
    x[place["psi"]] = rng.uniform(-np.pi, np.pi)
    helm = Helm(rng, x[place["psi"]])
    water = speed * np.array([np.cos(towards), np.sin(towards)])

    def rates(x: np.ndarray, k: int) -> np.ndarray:
        f = np.array(model.rhs(x, u, p)).ravel()
        f[place["x"]] += water[0]
        f[place["y"]] += water[1]
        psi = x[place["psi"]]
        air = wind * gust[k] * np.array([np.cos(blows_to + turned[k]), np.sin(blows_to + turned[k])])
        air = air - f[[place["x"], place["y"]]]
        ahead, side = air @ [np.cos(psi), np.sin(psi)], air @ [-np.sin(psi), np.cos(psi)]
        push = 0.5 * density * np.hypot(ahead, side)
        force = push * np.array([0.7 * FRONT_M2 * ahead, 0.8 * SIDE_M2 * side, 0.0])
        force[2] = -0.1 * SIDE_M2 * L * push * side * ahead / max(np.hypot(ahead, side), 1.0)
        f[[place["u"], place["v"], place["r"]]] += force / inertia
        return f

    rows = []
    for k in range(4000):
        u[command] = helm.rudder(k * STEP, x[place["psi"]], x[place["r"]])
        if helm.phase == 7:
            break
        now = rates(x, k)
        rows.append(
            [x[place[n]] for n in place]
            + [now[place["x"]], now[place["y"]], x[names.index("rudder.angle")], u[command]]
        )
        half_way = rates(x + 0.5 * STEP * now, k)
        middle = rates(x + 0.5 * STEP * half_way, k)
        x = x + STEP / 6 * (now + 2 * half_way + 2 * middle + rates(x + STEP * middle, k))
    columns = (*place, "north", "east", "rudder", "order")
    return dict(zip(columns, np.array(rows).T, strict=True)), rng, (speed, float(np.degrees(towards)))


def write_log(motion: dict[str, np.ndarray], rng: np.random.Generator, path: Path, *, through_water: bool) -> None:
    """The log as a CSV at 2 Hz."""
    n = len(motion["u"])
    latitude = 54.0 + (motion["x"] + wandering(rng, n, 0.35, 0.8, 60.0)) / METRES
    longitude = 10.0 + (motion["y"] + wandering(rng, n, 0.35, 0.8, 60.0)) / METRES / np.cos(np.radians(54.0))
    sog = np.hypot(motion["north"], motion["east"]) + wandering(rng, n, 0.04, 0.02, 20.0)
    cog = np.degrees(np.arctan2(motion["east"], motion["north"])) + wandering(rng, n, 0.4, 0.2, 20.0)
    table = {
        "utc": [pd.Timestamp(1_700_000_000 + k * STEP, unit="s").strftime("%Y-%m-%dT%H:%M:%S.%fZ") for k in range(n)],
        "latitude": latitude.round(7),
        "longitude": longitude.round(7),
        "sog_kn": (sog / KNOT).round(2),
        "cog_deg": (cog % 360).round(1),
        "heading_deg": ((np.degrees(motion["psi"]) + wandering(rng, n, 0.05, 0.15, 90.0)) % 360).round(2),
        "rot_deg_min": (60 * (np.degrees(motion["r"]) + wandering(rng, n, 0.012, 0.002, 30.0))).round(1),
        "rudder_deg": (np.degrees(motion["rudder"]) + wandering(rng, n, 0.12, 0.1, 120.0)).round(1),
        "rudder_order_deg": np.degrees(motion["order"]).round(1),
        "shaft_rpm": (84.0 + wandering(rng, n, 0.25, 0.1, 60.0)).round(1),
    }
    if through_water:
        table["stw_kn"] = ((motion["u"] + wandering(rng, n, 0.03, 0.03, 40.0)) / KNOT).round(2)
    pd.DataFrame(table).to_csv(path, index=False)


def held_out(log: Path, folder: Path, methods: tuple[str, ...]) -> dict[str, tuple[float, str]]:
    """Error of the tactical diameter of the hard turn, %, by the bundled card ("card") and by each method."""
    paths = [path for path in t2s.log(log).save(folder) if path.suffix == ".csv"]
    held = [path for path in paths if "turn" in path.stem and abs(float(path.stem.rpartition("_")[2])) > 30]
    fitted = [path for path in paths if path not in held and ("zigzag" in path.stem or "turn" in path.stem)]
    found: dict[str, tuple[float, str]] = {}
    for name in methods:
        begin = time.process_time()
        method, _, structure = name.partition("/")
        structured = {"structure": structure} if structure else {}
        fit = t2s.identify("mariner", fitted, holdout=held[:1], method=method, members=0, **structured)
        said = fit.to_dict()
        (figure,) = (entry for entry in said["figures"]["holdout"] if entry["figure"] == "tactical_diameter_m")
        before, now = (100 * ((figure[key] or np.nan) / figure["measured"] - 1) for key in ("before", "predicted"))
        found["card"] = before, ""
        current = fit.identification.current
        water = ""
        if current is not None:
            towards = np.degrees(current.direction_rad)
            water = f", {current.speed_mps:.2f} m/s to {towards:.0f} deg within {current.standard_error_mps:.2f}"
        seconds = time.process_time() - begin
        found[name] = now, f"{said['method']}, {said['structure']}, {seconds:.0f} s of processors{water}"
    return found


def main(count: int = 6, first: int = 101, methods: tuple[str, ...] = METHODS) -> None:
    """Print each voyage and the root mean squares."""
    for through_water, air in ((True, AIR), (False, AIR), (False, 0.0)):
        errors: dict[str, list[float]] = {}
        print(
            f"speed through the water {'in' if through_water else 'not in'} the log, {'wind' if air else 'no wind'}; "
            "error of the tactical diameter, %"
        )
        for seed in range(first, first + count):
            with tempfile.TemporaryDirectory() as name:
                motion, rng, (speed, towards) = voyage(seed, air)
                log = Path(name) / "voyage.csv"
                write_log(motion, rng, log, through_water=through_water)
                found = held_out(log, Path(name) / "voyage", methods)
            print(f"  seed {seed}, current {speed:.2f} m/s to {towards:.0f} deg:", flush=True)
            for key, (error, words) in found.items():
                errors.setdefault(key, []).append(error)
                print(f"    {key:14s}{error:+7.1f}  {words}", flush=True)
        for key, values in errors.items():
            known = np.array(values)[np.isfinite(values)]
            rms, within = np.sqrt(np.mean(known**2)), int((np.abs(known) < 5).sum())
            print(f"  {key:14s} rms {rms:.1f}, mean {known.mean():+.1f}, within 5 %: {within} of {len(values)}")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:3]), *([tuple(sys.argv[3].split(","))] if len(sys.argv) > 3 else []))
