"""The tank engineer's day on made-up campaigns with known truth: delays, files of other tanks, one run at once.

Prints the error of the estimated delay and the coverage of 95 % intervals of dampings and added masses for several
delays of the forces; how far memory of the flow is taken for a delay; the largest difference of derivatives between
files of eight formats; and the seconds of `tank2sim run` with its page.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.records.tank_files import FORMATS, converted

DELAYS_S = (-0.03, 0.0, 0.0015, 0.03, 0.1)
SEEDS = range(200, 220)
NAMES = ("Yv", "Nv", "Yr", "Nr", "Yvdot", "Yrdot", "Nvdot", "Nrdot")


def delays(folder: Path) -> bool:
    """Coverage of the derivatives and error of the delay, for each delay."""
    good = True
    for delay in DELAYS_S:
        ratios, of_delay, corrected = [], [], 0
        for seed in SEEDS:
            written = write(Campaign(seed=seed, rate_hz=10.0, force_delay_s=delay), folder / f"{delay} {seed}")
            found = reduce_campaign(read_campaign(written.path))
            derivatives = found.derivatives
            ratios += [(derivatives[n].value - written.derivatives[n]) / derivatives[n].standard_error for n in NAMES]
            of_delay.append(1e3 * (found.delay.size - delay))
            corrected += any(error.corrected for error in found.systematic)
        covered = float(np.mean(np.abs(ratios) < 1.96))
        good &= 0.9 <= covered <= 0.985
        print(
            f"delay {1e3 * delay:+.1f} ms: found within {np.sqrt(np.mean(np.square(of_delay))):.2f} ms rms, corrected "
            f"in {corrected} of {len(SEEDS)}; 95 % intervals of {len(NAMES)} derivatives cover {100 * covered:.1f} %"
        )
    return good


def formats(folder: Path) -> bool:
    """Largest difference of a derivative from the plain files, over its standard error."""
    written = write(Campaign(seed=5, size="linear", rate_hz=5.0), folder / "plain")
    plain = reduce_campaign(read_campaign(written.path)).derivatives
    largest = 0.0
    for name in FORMATS:
        found = reduce_campaign(read_campaign(converted(written.path, folder / name, name))).derivatives
        largest = max(largest, *(abs(found[n].value - plain[n].value) / plain[n].standard_error for n in plain))
    print(f"{len(FORMATS)} formats: derivatives differ by at most {largest:.1e} standard errors")
    return largest < 1e-6


def one_run(folder: Path) -> bool:
    """Seconds of the command for one run, its coefficients alone and with its page."""
    written = write(Campaign(seed=3, rate_hz=100.0), folder / "run")
    begin = [sys.executable, "-c", "from tank2sim.cli import main; main()", "run", "yaw_01.csv"]
    end = ["--campaign", "campaign.toml", "-o", "h.csv"]
    seconds = []
    for more in ([], ["--page", "run.html"]):
        start = time.perf_counter()
        subprocess.run([*begin, *end, *more], cwd=written.path.parent, check=True, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - start)
    rows = sum(1 for _ in (written.path.parent / "yaw_01.csv").open()) - 1
    print(f"one run of {rows} readings: {seconds[0]:.1f} s, with its page {seconds[1]:.1f} s")
    return seconds[1] < 30


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return 0 if all([one_run(folder), formats(folder), delays(folder)]) else 1


if __name__ == "__main__":
    sys.exit(main())
