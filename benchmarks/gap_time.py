"""Wall time, time of the processors and memory of `tank2sim gap`, on cases of benchmarks/missing_effect/cases.py.

    python benchmarks/gap_time.py FOLDER [--cases N] [--first]

Each case is a whole process, as a user begins it: seven fitted trials and six held out, the whole library, results and
page written. The last column is the wall time over that of the same command with one effect alone (`--effects`), which
reads, replays and writes as much. Modules are compiled to bytecode beforehand, as an installer does. With --first the
first one finds no compiled kernels, as in a fresh installation.
"""

from __future__ import annotations

import argparse
import compileall
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import tank2sim

ONE = "rudder_bias"


def timed(folder: Path, output: Path, environment: dict[str, str], options: Sequence[str] = ()) -> tuple[float, float]:
    """Wall time and time of the processors (s) of one search."""
    trials, held = ([str(path) for path in sorted((folder / part).glob("*.csv"))] for part in ("fit", "holdout"))
    command = [sys.executable, "-m", "tank2sim", "gap", str(folder / "ship.toml"), *trials, "--holdout", *held]
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [*command, "-o", str(output), *options], check=True, capture_output=True, env=os.environ | environment
    )
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=6, metavar="N", help="the first N cases")
    parser.add_argument("--first", action="store_true", help="the first one without compiled kernels")
    args = parser.parse_args()
    folders = [path.parent for path in sorted(args.folder.glob("*/ship.toml"))][: args.cases]
    compileall.compile_dir(str(Path(tank2sim.__file__).parent), quiet=1)
    print(f"{os.cpu_count()} processors")
    print(f"{'case':12} {'wall, s':>8} {'processors, s':>14} {'one effect, s':>14} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as temporary:
        environment = {"XDG_CACHE_HOME": temporary} if args.first else {}
        for place, folder in enumerate(folders):
            wall, processors = timed(folder, Path(temporary) / f"whole_{place}", environment)
            one, _ = timed(folder, Path(temporary) / f"one_{place}", environment, ("--effects", ONE))
            print(f"{folder.name:12} {wall:8.1f} {processors:14.1f} {one:14.1f} {wall / one:6.2f}", flush=True)
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest process: {largest:.0f} MB")


if __name__ == "__main__":
    main()
