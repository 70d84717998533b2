"""Time of a core that a fresh Python needs to import tank2sim and to run the first command, next to an empty Python.

Each figure is the median of several processes, taken in turn. What is compiled is compiled before.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys

RUNS = 7
COMMANDS = {
    "python, nothing imported": [sys.executable, "-c", "pass"],
    "import tank2sim": [sys.executable, "-c", "import tank2sim"],
    "import numpy, pandas": [sys.executable, "-c", "import numpy, pandas"],
    'tank2sim.load("mariner")': [sys.executable, "-c", 'import tank2sim; tank2sim.load("mariner")'],
    "tank2sim simulate mariner": [sys.executable, "-m", "tank2sim", "simulate", "mariner", "--manoeuvre", "turn:35"],
    "tank2sim --help": [sys.executable, "-m", "tank2sim", "--help"],
}


def core_seconds(command: list[str]) -> float:
    """Time of a core (user and system) of one process and its children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    for command in COMMANDS.values():
        core_seconds(command)
    seconds: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(RUNS):
        for name, command in COMMANDS.items():
            seconds[name].append(core_seconds(command))
    empty = statistics.median(seconds["python, nothing imported"])
    for name, values in seconds.items():
        median = statistics.median(values)
        print(f"{name:28} {median:6.3f} s of a core, {median / empty:5.1f} times an empty Python")


if __name__ == "__main__":
    main()
