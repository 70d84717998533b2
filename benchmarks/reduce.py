"""How long ``tank2sim reduce`` takes on a campaign of 78 runs and 113 000 rows, interpreter start and reading included.

Prints seconds of wall time: the best of several runs, and all of them. The campaign is the made-up one with known truth
in the data folder (TANK2SIM_DATA, else ../shared beside the project).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

AIM_S = 5.0
REPEATS = 5


def main() -> int:
    root = Path(__file__).resolve().parents[1]
    data = Path(os.environ.get("TANK2SIM_DATA", root.parent / "shared")) / "data" / "pmm_synthetic_12"
    if not data.is_dir():
        print(f"no campaign: there is no folder {data} (set TANK2SIM_DATA)")
        return 0
    program = "from tank2sim.cli import main; main()"
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(REPEATS):
            start = time.perf_counter()
            subprocess.run(
                [sys.executable, "-c", program, "reduce", str(data / "campaign.toml"), "-o", f"{folder}/card.toml"],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            times.append(time.perf_counter() - start)
    print(f"reduce, 78 runs: {min(times):.2f} s (aim {AIM_S:g}); all: {', '.join(f'{t:.2f}' for t in times)}")
    return 0 if min(times) < AIM_S else 1


if __name__ == "__main__":
    sys.exit(main())
