"""Derivatives from steady turning tests of made-up rotating arms, upright and at a heel: coverage of 95 % intervals.

python benchmarks/rotating_arm.py [--seeds 40]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.rotating_arm import HEEL, TRUTH, write_arm

FIRST_SEED = 30000


def main() -> int:
    """Print both; 1 if a share is not within 90 to 98 %."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    seeds = parser.parse_args().seeds
    good = True
    with tempfile.TemporaryDirectory() as name:
        for words, ship in (("upright", TRUTH), ("with tests at a heel", TRUTH | HEEL)):
            inside: dict[str, list[bool]] = {key: [] for key in ship}
            for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                random = np.random.default_rng(seed)
                truth = {key: value * random.uniform(0.85, 1.15) for key, value in ship.items()}
                found = reduce_campaign(read_campaign(write_arm(Path(name), truth, seed))).derivatives
                for key, value in truth.items():
                    inside[key].append(abs(found[key].value - value) < 1.96 * found[key].standard_error)
            share = float(np.mean(list(inside.values())))
            worst = min(inside, key=lambda key: np.mean(inside[key]))
            print(
                f"{words}: {len(ship)} derivatives of {seeds} made-up hulls, {100 * share:.1f} % of 95 % intervals have"
            )
            print(f"  the truth; fewest {worst}, {100 * np.mean(inside[worst]):.0f} %")
            good &= 0.90 <= share <= 0.98
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
