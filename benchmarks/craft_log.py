"""Made-up craft with two thrusters from their logs to their cards: coverage of the estimates, and free predictions.

Each seed makes another craft (2.5 to 5.5 m, hull, thrust curves, lag and dead band drawn at random), its voyage of ten
minutes in a current and gusts, and a log of position, heading and revolutions at 5 Hz with the slow errors of a
receiver and a compass. `tank2sim log` cuts it, every third trial is held out, and `identify` begins with a card whose
numbers are off by 40 %. Printed: how many of the main coefficients lie within two standard errors of the truth, and
R^2 of u, v, r of predictions of 30 s of held-out trials, all next to the truth. The simulation here shares no code with
tank2sim.

    python benchmarks/craft_log.py [NUMBER OF CRAFT] [FIRST SEED]

With the measured data it repeats this for the made-up craft of `shared/data/logs`, which another program wrote: by
revolutions, and by orders alone.
"""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.cards import parse_card
from tank2sim.errors import InputError

LOGS = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data" / "logs"
MAIN = ("ahead", "astern", "Xu", "Xuabsu", "Yv", "Yvabsv", "Nr", "Nrabsr")
STEP = 0.02


def random_craft(rng: np.random.Generator) -> dict[str, float]:
    """A craft with two thrusters; SI."""
    length = rng.uniform(2.5, 5.5)
    mass = 2.0 * length**3 * rng.uniform(0.8, 1.2)
    arm = 0.21 * length
    inertia = mass * (0.25 * length) ** 2 * rng.uniform(0.9, 1.3)
    full = mass * rng.uniform(1.2, 2.2)  # N, both thrusters
    rpm = rng.uniform(1200, 2500)
    top = 0.5 * math.sqrt(9.81 * length) * rng.uniform(0.7, 1.1)
    side = 0.5 * 1000 * length * 0.06 * length
    radps = rpm * math.pi / 30
    loss = rng.uniform(0.02, 0.08) * full / 2 / top / radps
    linear = rng.uniform(0.2, 0.45)
    resistance = full - 2 * loss * radps * top
    return {
        "length": length,
        "mass": mass,
        "inertia": inertia,
        "x_G": rng.uniform(-0.01, 0.01) * length,
        "Xudot": -rng.uniform(0.04, 0.09) * mass,
        "Yvdot": -rng.uniform(0.5, 0.9) * mass,
        "Yrdot": rng.uniform(-0.03, 0.03) * mass * length,
        "Nrdot": -rng.uniform(0.4, 0.8) * inertia,
        "Xu": -linear * resistance / top,
        "Xuabsu": -(1 - linear) * resistance / top**2,
        "Yv": -side * rng.uniform(0.1, 0.3),
        "Yvabsv": -side * rng.uniform(0.7, 1.3),
        "Yr": rng.uniform(-0.1, 0.1) * side * length / 2,
        "Nv": rng.uniform(-0.1, 0.02) * side * length / 2,
        "Nr": -side * length**2 * rng.uniform(0.05, 0.1),
        "Nrabsr": -side * length**3 / 32 * rng.uniform(0.8, 1.6),
        "Nrabsu": -side * length**2 * rng.uniform(0.03, 0.06),
        "arm": arm,
        "rpm": rpm,
        "ahead": full / 2 / radps**2,
        "astern": full / 2 / radps**2 * rng.uniform(0.5, 0.8),
        "loss": loss,
        "lag": rng.uniform(0.15, 0.5),
        "dead_band": rng.uniform(0.02, 0.06),
        "cruise": 0.75 * top,
    }


def voyage_orders(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """(seconds, port, starboard) of a voyage: rest, acceleration, turns, spins, going astern, random steps."""
    found = [(12.0, 0.0, 0.0), (25.0, 0.7, 0.7)]
    for side in (1, -1, 1, -1, 1, -1):
        found.append((rng.uniform(5, 9), 0.65 + 0.15 * side, 0.65 - 0.15 * side))
    found += [(20.0, 0.45, 0.45), (22.0, 1.0, 1.0), (18.0, 0.0, 0.0)]
    for _ in range(14):
        found.append((rng.uniform(4, 8), rng.uniform(-0.5, 0.9), rng.uniform(-0.5, 0.9)))
    found += [(16.0, 0.0, 0.0), (24.0, 0.5, -0.5), (22.0, -0.45, 0.45), (20.0, -0.6, -0.6), (12.0, 0.0, 0.0)]
    found += [(22.0, 0.75, 0.75), (40.0, 0.6, 0.9), (20.0, 0.6, 0.6), (45.0, 0.85, 0.55), (24.0, 0.5, 0.5)]
    for side in (-1, 1, -1, 1, -1):
        found.append((rng.uniform(6, 10), 0.55 + 0.2 * side, 0.55 - 0.2 * side))
    return [*found, (18.0, 0.0, 0.0)]


def rates(c: dict[str, float], nu: np.ndarray, n: np.ndarray, force: np.ndarray) -> np.ndarray:
    """du/dt, dv/dt, dr/dt by Fossen's matrices written out; `force` X, Y, N of the wind."""
    u, v, r = nu
    m, g = c["mass"], c["x_G"]
    M = np.array(
        [
            [m - c["Xudot"], 0, 0],
            [0, m - c["Yvdot"], m * g - c["Yrdot"]],
            [0, m * g - c["Yrdot"], c["inertia"] - c["Nrdot"]],
        ]
    )
    M_A = np.array([[-c["Xudot"], 0, 0], [0, -c["Yvdot"], -c["Yrdot"]], [0, -c["Yrdot"], -c["Nrdot"]]])
    a = M_A @ nu
    coriolis = np.array([-m * (v + g * r) * r - a[1] * r, m * u * r + a[0] * r, m * g * u * r + a[1] * u - a[0] * v])
    damping = np.array(
        [
            c["Xu"] * u + c["Xuabsu"] * u * abs(u),
            c["Yv"] * v + c["Yvabsv"] * v * abs(v) + c["Yr"] * r,
            c["Nv"] * v + c["Nr"] * r + c["Nrabsr"] * r * abs(r) + c["Nrabsu"] * r * abs(u),
        ]
    )
    k = np.where(n > 0, c["ahead"], c["astern"])
    T = k * n * np.abs(n) - c["loss"] * np.maximum(n, 0) * u
    tau = np.array([T.sum(), 0.0, c["arm"] * (T[0] - T[1])])
    return np.linalg.solve(M, tau + damping + force - coriolis)


class Weather:
    """Current and wind of a voyage: means, and gusts and wander of the current as they come."""

    def __init__(self, c: dict[str, float], rng: np.random.Generator) -> None:
        self.current = rng.uniform(0.0, 0.2) * np.array([1, 1]) * rng.choice([-1, 1], 2)
        self.wind, self.direction = rng.uniform(0, 4), rng.uniform(0, math.tau)
        self.front, self.side, self.length = 0.06 * c["length"] ** 2, 0.1 * c["length"] ** 2, c["length"]

    def rates(self, c: dict[str, float], s: np.ndarray, n: np.ndarray, gust: float, drift: np.ndarray) -> np.ndarray:
        """Rates of north, east, heading, u, v, r at a state, revolutions, a gust (m/s) and a change of the current."""
        psi, u, v, r = s[2:]
        north = u * math.cos(psi) - v * math.sin(psi) + self.current[0] + drift[0]
        east = u * math.sin(psi) + v * math.cos(psi) + self.current[1] + drift[1]
        air = -(self.wind + gust) * np.array([math.cos(self.direction), math.sin(self.direction)]) - [north, east]
        along = air[0] * math.cos(psi) + air[1] * math.sin(psi)
        across = -air[0] * math.sin(psi) + air[1] * math.cos(psi)
        fast = math.hypot(along, across)
        X, Y = 0.6 * 0.7 * self.front * fast * along, 0.6 * 0.9 * self.side * fast * across
        force = np.array([X, Y, 0.03 * self.length * Y])
        return np.array([north, east, r, *rates(c, s[3:], n, force)])

    def stepped(self, c: dict[str, float], s: np.ndarray, n: np.ndarray, gust: float, drift: np.ndarray) -> np.ndarray:
        """The state a step later, by the midpoint rule: its error is far below the noise."""
        middle = s + STEP / 2 * self.rates(c, s, n, gust, drift)
        return np.asarray(s + STEP * self.rates(c, middle, n, gust, drift))


def simulated(c: dict[str, float], rng: np.random.Generator, weather: Weather | None = None) -> dict[str, np.ndarray]:
    """Motion of a voyage every 0.2 s: time, position, heading, velocities through the water, revolutions, orders."""
    weather = weather or Weather(c, rng)
    gust, drift = 0.0, np.zeros(2)
    state = np.array([0.0, 0.0, rng.uniform(-3, 3), 0.0, 0.0, 0.0])
    n = np.zeros(2)
    rows = []
    t = 0.0
    full = c["rpm"] * math.pi / 30
    for seconds, port, starboard in voyage_orders(rng):
        order = np.array([port, starboard])
        goal = np.where(np.abs(order) > c["dead_band"], order, 0.0) * full
        for _ in range(round(seconds / STEP)):
            if round(t / STEP) % 10 == 0:
                rows.append([t, *state, *n, *order])
            gust += -gust * STEP / 8 + 0.2 * weather.wind * math.sqrt(2 * STEP / 8) * rng.normal()
            drift += -drift * STEP / 200 + 0.02 * math.sqrt(2 * STEP / 200) * rng.normal(size=2)
            n = goal + (n - goal) * math.exp(-STEP / c["lag"])
            state = weather.stepped(c, state, n, gust, drift)
            t += STEP
    table = np.array(rows).T
    names = ("t", "x", "y", "psi", "u", "v", "r", "n_port", "n_starboard", "order_port", "order_starboard")
    return dict(zip(names, table, strict=True))


def by_truth(c: dict[str, float], weather: Weather, motion: dict[str, np.ndarray], at: np.ndarray) -> np.ndarray:
    """u, v, r (n, 3) at times by the true craft from the true state before the first, in the mean wind and current.

    No estimate from a log can predict better than this, which knows all but the gusts to come.
    """
    begin = max(0, int(np.searchsorted(motion["t"], at[0] - 1e-6)) - 1)
    state = np.array([motion[name][begin] for name in ("x", "y", "psi", "u", "v", "r")])
    t, found, calm = motion["t"][begin], [], np.zeros(2)
    while t < at[-1] + STEP:
        found.append([t, *state[3:]])
        n = np.array([np.interp(t + STEP, motion["t"], motion[name]) for name in ("n_port", "n_starboard")])
        state = weather.stepped(c, state, n, 0.0, calm)
        t += STEP
    table = np.array(found).T
    return np.column_stack([np.interp(at, table[0], column) for column in table[1:]])


def coloured(rng: np.random.Generator, count: int, white: float, slow: float, time_s: float) -> np.ndarray:
    """White noise and a first-order Gauss-Markov one, every 0.2 s."""
    phi = math.exp(-0.2 / time_s)
    found = np.empty(count)
    value = slow * rng.normal()
    for place in range(count):
        found[place] = value
        value = phi * value + slow * math.sqrt(1 - phi**2) * rng.normal()
    return found + white * rng.normal(size=count)


def log_text(motion: dict[str, np.ndarray], c: dict[str, float], rng: np.random.Generator) -> str:
    """The log: UTC, latitude, longitude, heading, revolutions and orders."""
    count = len(motion["t"])
    x = motion["x"] + coloured(rng, count, 0.02, 0.15, 30)
    y = motion["y"] + coloured(rng, count, 0.02, 0.15, 30)
    psi = np.degrees(motion["psi"]) + coloured(rng, count, 0.25, 0.4, 40)
    begin = datetime(2024, 5, 4, 9, 30, tzinfo=UTC)
    radius = 6371000.0
    latitude = 54.3 + np.degrees(x / radius)
    longitude = 10.1 + np.degrees(y / (radius * math.cos(math.radians(54.3))))
    lines = ["timestamp,latitude,longitude,heading_deg,rpm_port,rpm_stbd,thruster_port,thruster_stbd"]
    rpm = [
        motion[name] * 30 / math.pi + coloured(rng, count, 4.0, 2.0, 20) * c["rpm"] / 1800
        for name in ("n_port", "n_starboard")
    ]
    for k in range(count):
        stamp = (begin + timedelta(seconds=float(motion["t"][k]))).isoformat(timespec="milliseconds")
        lines.append(
            f"{stamp.replace('+00:00', 'Z')},{latitude[k]:.8f},{longitude[k]:.8f},{psi[k] % 360:.2f},{rpm[0][k]:.1f},"
            f"{rpm[1][k]:.1f},{motion['order_port'][k]:.3f},{motion['order_starboard'][k]:.3f}"
        )
    return "\n".join(lines) + "\n"


def first_card(c: dict[str, float], rng: np.random.Generator) -> t2s.Ship:
    """A card with mass and places right and all else off by 40 %."""

    def off(name: str) -> float:
        return c[name] * math.exp(0.4 * rng.normal())

    hull = "\n".join(
        f"{name} = {off(name)!r}"
        for name in ("Xudot", "Yvdot", "Nrdot", "Xu", "Xuabsu", "Yv", "Yvabsv", "Nr", "Nrabsr")
    )
    ahead, astern = max(off("ahead"), 0.8 * c["ahead"]), off("astern")
    thrusters = "\n".join(
        f'[[thrusters]]\nname = "{name}"\ny_m = {side * c["arm"]!r}\nahead_Ns2 = {ahead!r}\nastern_Ns2 = {astern!r}\n'
        f"max_rpm = {1.05 * c['rpm']!r}"
        for name, side in (("port", -1), ("starboard", 1))
    )
    text = f"""format = "tank2sim-ship/1"
[ship]
name = "made up"
source = "made up"
length_m = {c["length"]!r}
[model]
kind = "small_craft"
speed_mps = {0.4 * c["cruise"]!r}
[rigid_body]
mass = {c["mass"]!r}
yaw_inertia = {c["inertia"]!r}
x_G = {c["x_G"]!r}
[derivatives]
{hull}
{thrusters}
"""
    return t2s.Ship(parse_card(text, "first.toml"))


def judged(
    card: t2s.Ship,
    paths: list[Path],
    truth: dict[str, float],
    motion: dict[str, np.ndarray],
    begin: datetime,
    first_held: int = 2,
) -> tuple[dict[str, float], list[np.ndarray], list[np.ndarray]]:
    """Error over standard error of the main coefficients, predictions with the true motion, and their times (n,)."""
    held = paths[first_held::3]
    fitted = [path for path in paths if path not in held]
    found = t2s.identify(card, fitted, holdout=held)
    fit = found.fit
    errors = {}
    for name, value, error in zip(fit.problem.free, fit.estimate.values, fit.estimate.standard_errors, strict=True):
        last = name.rpartition(".")[2]
        if last in truth:
            errors[last] = (value - truth[last]) / error
    pairs, times = [], []
    for entry in found.predictions:
        path = next(path for path in held if path.stem == entry.run.name)
        stamp = next(line for line in path.read_text().splitlines() if line.startswith("# begins"))
        first = datetime.fromisoformat(stamp.split(": ", 1)[1].replace("Z", "+00:00"))
        at = (first - begin).total_seconds() + entry.run.times[entry.rows]
        true = np.column_stack([np.interp(at, motion["t"], motion[name]) for name in "uvr"])
        pairs.append(np.stack([entry.predicted, true]))
        times.append(at)
    return errors, pairs, times


def r_squared(pairs: list[np.ndarray]) -> np.ndarray:
    """R^2 of u, v, r of all predictions together."""
    both = np.concatenate(pairs, axis=1)
    predicted, true = both
    return 1 - ((predicted - true) ** 2).sum(axis=0) / ((true - true.mean(axis=0)) ** 2).sum(axis=0)


def shared_craft_numbers() -> dict[str, float]:
    """The true craft of the shared logs, as :func:`random_craft` has one."""
    v = json.loads((LOGS / "usv_22-truth.json").read_text(encoding="utf-8"))["vessel"]
    d, thrust, per = v["damping"], v["thrusters"], (30 / math.pi) ** 2
    return {
        "length": v["length_m"],
        "mass": v["mass_kg"],
        "inertia": v["yaw_inertia_kgm2"],
        "x_G": v["x_G_m"],
        **v["added_mass"],
        **{"Xu": d["Xu"], "Xuabsu": d["Xuu"], "Yv": d["Yv"], "Yvabsv": d["Yvv"], "Nr": d["Nr"], "Nrabsr": d["Nrr"]},
        "arm": thrust["y_m"][1],
        "rpm": thrust["max_rpm"],
        "ahead": thrust["ahead_N_per_rpm2"] * per,
        "astern": thrust["astern_N_per_rpm2"] * per,
        "cruise": 2.0,
    }


def shared_craft(folder: Path) -> None:
    """The craft of the shared logs: from its CSV by revolutions, from an ArduPilot and a PX4 log by orders alone.

    Held out are a zigzag, a spin and a turn.
    """
    truth = json.loads((LOGS / "usv_22-truth.json").read_text(encoding="utf-8"))
    thrust, c = truth["vessel"]["thrusters"], shared_craft_numbers()
    table = np.genfromtxt(LOGS / "usv_22-truth.csv", delimiter=",", names=True)
    motion = {"t": table["t_s"], "u": table["u_mps"], "v": table["v_mps"], "r": np.radians(table["r_degps"])}
    begin = datetime.fromisoformat(truth["t_zero_utc"].replace("Z", "+00:00"))
    off = math.exp(0.4 * np.random.default_rng(1).normal())  # the lag is known no better than the rest
    ordered = f"max_rpm = {c['rpm']!r}\ntime_constant_s = {off * thrust['time_constant_s']!r}"
    ordered += f"\ndead_band_rpm = {thrust['dead_band_command'] * c['rpm']!r}"
    text = first_card(c, np.random.default_rng(0)).card.text
    by_orders = text.replace(f"max_rpm = {1.05 * c['rpm']!r}", ordered)
    for name, card, more in (
        ("voyage.csv", text, ()),
        ("voyage.bin", by_orders, ("time_constant",)),
        ("voyage.ulg", by_orders, ("time_constant",)),
    ):
        paths = trials(LOGS / "usv_22" / name, folder / name.replace(".", "_"))
        known = {k: c[k] for k in MAIN} | dict.fromkeys(more, thrust["time_constant_s"])
        errors, pairs, _ = judged(t2s.Ship(parse_card(card, "first.toml")), paths, known, motion, begin, first_held=1)
        print(
            f"usv_22/{name}:", ", ".join(f"{key} {error:+.1f}" for key, error in errors.items()), "standard errors off"
        )
        print(f"usv_22/{name}: R^2 of u, v, r:", ", ".join(f"{value:.3f}" for value in r_squared(pairs)), flush=True)


def trials(log: Path, folder: Path) -> list[Path]:
    """The trials that `tank2sim log` cuts of a log."""
    return sorted(path for path in t2s.log(log).save(folder) if path.suffix == ".csv")


def made_up_craft(number: int, first: int) -> None:
    """Print the figures of so many craft, from a seed on."""
    every, all_pairs, each, refused = [], [], [], 0
    bounds, each_bound = [], []
    begin_s = time.process_time()
    for seed in range(first, first + number):
        rng = np.random.default_rng(seed)
        craft = random_craft(rng)
        weather = Weather(craft, rng)
        motion = simulated(craft, rng, weather)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "voyage.csv").write_text(log_text(motion, craft, rng), encoding="utf-8")
            paths = trials(folder / "voyage.csv", folder / "voyage")
            begin = datetime(2024, 5, 4, 9, 30, tzinfo=UTC)
            truth = {name: craft[name] for name in MAIN}
            try:
                errors, pairs, times = judged(first_card(craft, rng), paths, truth, motion, begin)
            except InputError as refusal:
                refused += 1
                print(seed, "refused:", refusal, flush=True)
                continue
        every.append(errors)
        all_pairs += pairs
        each.append(r_squared(pairs))
        best = [pair.copy() for pair in pairs]
        for pair, at in zip(best, times, strict=True):
            breaks = np.flatnonzero(np.diff(at) > 0.3) + 1  # a prediction ends, and another begins
            pair[0] = np.concatenate([by_truth(craft, weather, motion, part) for part in np.split(at, breaks)])
        bounds += best
        each_bound.append(r_squared(best))
        off = {name: round(float(error), 1) for name, error in errors.items()}
        print(
            seed, off, each[-1].round(3), "at best", each_bound[-1].round(3), f"wind {weather.wind:.1f} m/s", flush=True
        )
    within = {name: np.mean([abs(errors[name]) <= 2 for errors in every]) for name in MAIN}
    total = np.mean(list(within.values()))
    print(f"{number} craft, {refused} refused; within two standard errors of the truth: {100 * total:.0f} %")
    print(", ".join(f"{name} {100 * share:.0f} %" for name, share in within.items()))
    print("R^2 of u, v, r, all predictions together:", ", ".join(f"{value:.3f}" for value in r_squared(all_pairs)))
    print("median of the craft:", ", ".join(f"{value:.3f}" for value in np.median(each, axis=0)))
    miss = [
        np.sqrt(np.mean((np.concatenate(p, axis=1)[0] - np.concatenate(p, axis=1)[1]) ** 2, axis=0))
        for p in (all_pairs, bounds)
    ]
    print("rms errors (m/s, m/s, rad/s):", miss[0].round(4), "; by the true craft:", miss[1].round(4))
    print("the same by the true craft in the mean wind:", ", ".join(f"{value:.3f}" for value in r_squared(bounds)))
    print("median of the craft:", ", ".join(f"{value:.3f}" for value in np.median(each_bound, axis=0)))
    print(f"time of a core for each: {(time.process_time() - begin_s) / number:.0f} s")


def main() -> None:
    """Print the figures of a number of made-up craft, and of the shared one."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    if number:
        made_up_craft(number, int(sys.argv[2]) if len(sys.argv) > 2 else 1000)
    if LOGS.is_dir():
        with tempfile.TemporaryDirectory() as name:
            shared_craft(Path(name))


if __name__ == "__main__":
    main()
