"""What ``tank2sim reduce`` costs next to plain numpy doing the same least squares; its memory for 5 million rows.

Prints, for a campaign of 78 runs and 113 000 rows, the processor time of reading and reduction in a running
interpreter and of whole processes, each the best of several that alternate, and the ratios; and the largest memory of
the command on a made-up campaign of 5 million rows. The plain program reads the same files, finds the frequencies, fits
harmonics and trends, projects the same terms and solves one weighted regression for each force: no check of a record,
no choice of terms, no scatter between runs, no prediction of runs left out. The campaign of 78 runs is the made-up one
with known truth in the data folder (TANK2SIM_DATA, else ../shared beside the project).

python benchmarks/reduce.py [--no-memory]
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
REPEATS = 7
AIM_RATIO = 2.0
AIM_GB = 1.5
ROWS = 5_000_000
RATE_HZ = 10.0
OSCILLATING = ("pure_sway", "pure_yaw", "yaw_with_drift")
TERMS = {
    "X": ("0", "vv", "rr", "dd", "vr"),
    "Y": ("0", "v", "r", "d", "vvv", "rrr", "ddd", "vrr", "vvr", "vdot", "rdot"),
    "N": ("0", "v", "r", "d", "vvv", "rrr", "ddd", "vrr", "vvr", "vdot", "rdot"),
}


def harmonics(time_s: np.ndarray, frequency: float, count: int) -> np.ndarray:
    """1, cos(wt), sin(wt), cos(2wt), ..., (rows, 1 + 2 count)."""
    waves = [wave(k * frequency * time_s) for k in range(1, count + 1) for wave in (np.cos, np.sin)]
    return np.column_stack([np.ones_like(time_s), *waves])


def rate(basis: np.ndarray, frequency: float) -> np.ndarray:
    """Rate of change of harmonics."""
    slopes, orders = np.zeros_like(basis), frequency * np.arange(1, basis.shape[1] // 2 + 1)
    slopes[:, 1::2], slopes[:, 2::2] = -orders * basis[:, 2::2], orders * basis[:, 1::2]
    return slopes


def frequency_of(time_s: np.ndarray, signal: np.ndarray) -> float:
    """Highest line of the spectrum, then four Gauss-Newton steps on three harmonics."""
    count = len(signal)
    spectrum = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(count), 4 * count))
    spectrum[:2] = 0
    found = 2 * np.pi * np.argmax(spectrum) / (4 * count * (time_s[1] - time_s[0]))
    time_s = time_s - time_s.mean()
    for _ in range(4):
        basis = harmonics(time_s, found, 3)
        fit = np.linalg.lstsq(basis, signal, rcond=None)[0]
        slope = time_s * (rate(basis, 1.0) @ fit)
        slope -= basis @ np.linalg.lstsq(basis, slope, rcond=None)[0]
        found += slope @ (signal - basis @ fit) / (slope @ slope)
    return float(found)


def plain(path: Path) -> dict[str, float]:  # noqa: PLR0915
    """Derivatives (prime) by numpy alone."""
    form = tomllib.loads(path.read_text())
    model, test = form["model"], form["test"]
    length, density = model["length_m"], test.get("water_density_kgpm3", 1000.0)
    mass, arm, inertia = model["mass_kg"], model.get("x_G_m", 0.0), model["yaw_inertia_kgm2"]
    sense = {"on_model": -1.0, "on_gauge": 1.0, "hydrodynamic": 1.0}[test["force_convention"]]
    carried = test["force_convention"] != "hydrodynamic"
    rows: dict[str, list[np.ndarray]] = {force: [] for force in TERMS}
    values: dict[str, list[np.ndarray]] = {force: [] for force in TERMS}
    for run in form["runs"]:
        file = path.parent / run["file"]
        with file.open() as opened:
            names = opened.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        at = {name: names.index(name) for name in names}
        seconds, used = table[:, at["t_s"]], 1
        moving = np.ones((len(seconds), 1))
        slopes = np.zeros_like(moving)
        basis = moving
        if run["type"] in OSCILLATING:
            leading = table[:, at["v_mps" if run["type"] == "pure_sway" else "r_radps"]]
            frequency, used = frequency_of(seconds, leading), 7
            step = seconds[1] - seconds[0]
            periods = int(len(seconds) * step * frequency / (2 * np.pi) + 0.02)
            kept = min(len(seconds), round(periods * 2 * np.pi / frequency / step))
            table, seconds = table[-kept:], seconds[-kept:]
            moving = harmonics(seconds, frequency, 3)
            slopes = rate(moving, frequency)
            basis = harmonics(seconds, frequency, 5)
        basis = np.column_stack([basis, np.linspace(-1, 1, len(seconds))])
        motion = table[:, [at[name] for name in ("v_mps", "r_radps", "speed_mps", "delta_rad")]]
        fit = np.linalg.lstsq(moving, motion, rcond=None)[0]
        v, r, speed, delta = (moving @ fit).T
        v_dot, r_dot = (slopes @ fit[:, :2]).T
        unit = 0.5 * density * length**2
        powers = {"v": v / speed, "r": r * length / speed, "d": delta}
        histories = {"vdot": unit * length * v_dot, "rdot": unit * length**2 * r_dot}
        for name in dict.fromkeys(term for terms in TERMS.values() for term in terms if "dot" not in term):
            history = unit * speed**2
            for letter in name.replace("0", ""):
                history = history * powers[letter]
            histories[name] = history
        forces = sense * table[:, [at["X_N"], at["Y_N"], at["N_Nm"]]]
        if carried:
            forces[:, 0] -= mass * (v * r + arm * r**2)
            forces[:, 1] += mass * (v_dot + arm * r_dot + speed * r)
            forces[:, 2] += inertia * r_dot + mass * arm * (v_dot + speed * r)
        solved = np.linalg.lstsq(basis, np.column_stack([*histories.values(), forces]), rcond=None)[0]
        left = np.std(forces - basis @ solved[:, -3:], axis=0)
        columns = dict(zip(histories, solved[:used].T, strict=False))
        for place, (force, terms) in enumerate(TERMS.items()):
            rows[force].append(np.column_stack([columns[term] for term in terms]) / left[place])
            values[force].append(solved[:used, -3 + place] / left[place])
    found = {}
    for force, terms in TERMS.items():
        design = np.vstack(rows[force]) * (length if force == "N" else 1.0)
        solution = np.linalg.lstsq(design, np.concatenate(values[force]), rcond=1e-10)[0]
        np.linalg.pinv(design.T @ design)  # the covariance
        found |= dict(zip((force + term for term in terms), map(float, solution), strict=True))
    return found


def speed(path: Path) -> bool:
    """Ratio of processor times; whether it is within the aim."""
    sys.path.insert(0, str(ROOT))
    from tank2sim.identification.captive.reduction import reduce_campaign
    from tank2sim.records.campaigns import read_campaign

    ours, theirs = [], []
    for _ in range(REPEATS):
        start = time.process_time()
        by_numpy = plain(path)
        theirs.append(time.process_time() - start)
        start = time.process_time()
        found = reduce_campaign(read_campaign(path)).derivatives
        ours.append(time.process_time() - start)
    ratio = min(ours) / min(theirs)
    print(f"78 runs: {min(ours):.2f} s, plain numpy {min(theirs):.2f} s of processor: {ratio:.2f} times")
    linear = ("Yv", "Yr", "Yd", "Nv", "Nr", "Nd", "Yvdot", "Nrdot")
    apart = max(abs(by_numpy[name] / found[name].value - 1) for name in linear)
    print(f"  the linear derivatives of the two differ by at most {100 * apart:.1f} %")
    with tempfile.TemporaryDirectory() as folder:
        program = "from tank2sim.cli import main; main()"
        command = [sys.executable, "-c", program, "reduce", str(path), "-o", f"{folder}/card.toml"]
        reference = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'benchmarks')!r})\n"]
        reference[-1] += f"from pathlib import Path; import reduce; reduce.plain(Path({str(path)!r}))"
        processes = [[_processor_s(each) for each in (command, reference)] for _ in range(REPEATS)]
    whole, numpy_alone = np.min(processes, axis=0)
    print(f"  whole processes: {whole:.2f} s, plain numpy {numpy_alone:.2f} s: {whole / numpy_alone:.1f} times")
    return ratio < AIM_RATIO and apart < 0.05


def _processor_s(command: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def memory() -> bool:
    """Largest memory of the command on millions of rows; whether it is within the aim."""
    sys.path.insert(0, str(ROOT))
    from tests.identification.captive.generator import Campaign, write

    with tempfile.TemporaryDirectory() as name:
        probe = write(Campaign(seed=5, rate_hz=RATE_HZ), Path(name) / "probe").path.parent
        rows = _rows(probe)
        big = write(Campaign(seed=5, rate_hz=RATE_HZ * ROWS / rows), Path(name) / "big").path
        rows = _rows(big.parent)
        program = "import resource; from tank2sim.cli import main\ntry:\n    main()\nfinally:\n    "
        program += "print('PEAK', resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
        command = [sys.executable, "-c", program, "reduce", str(big), "-o", f"{name}/card.toml"]
        found = subprocess.run(command, check=True, capture_output=True, text=True)
    peak = int(found.stdout.rpartition("PEAK")[2]) / 1024**2
    print(f"{rows / 1e6:.2f} million rows: at most {peak:.2f} GB")
    return peak < AIM_GB


def _rows(folder: Path) -> int:
    return sum(file.read_bytes().count(b"\n") - 1 for file in folder.glob("*.csv"))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-memory", action="store_true")
    without_memory = parser.parse_args().no_memory
    data = Path(os.environ.get("TANK2SIM_DATA", ROOT.parent / "shared")) / "data" / "pmm_synthetic_12"
    good = True
    if data.is_dir():
        good = speed(data / "campaign.toml")
    else:
        print(f"no campaign: there is no folder {data} (set TANK2SIM_DATA)")
    return 0 if (without_memory or memory()) and good else 1


if __name__ == "__main__":
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    sys.exit(main())
