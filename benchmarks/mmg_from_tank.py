"""The MMG method's coefficients from captive tests: coverage on made-up tanks, and HMRI's KVLCC2 against the paper's.

The tanks are without and with torque, with two propellers, and with errors common to all tests, stated in the campaign.

python benchmarks/mmg_from_tank.py [--seeds 100]
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import tank2sim as t2s
from tank2sim.identification.captive_mmg.card_text import estimated_masses
from tank2sim.identification.captive_mmg.steady_tests import read_steady_tests
from tests.identification.captive_mmg.tank import (
    KVLCC2,
    TORQUE,
    hmri_campaign,
    ship_like_the_kvlcc2,
    with_common_errors,
    write_campaign,
)

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("TANK2SIM_DATA", ROOT.parent / "shared"))
FIRST_SEED = 20000


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    seeds = parser.parse_args().seeds
    with tempfile.TemporaryDirectory() as name:
        inside, sizes = _coverage(Path(name), seeds)
        print(f"{seeds} made-up tanks: {100 * np.mean(list(inside.values())):.1f} % of 95 % intervals have the truth;")
        worst = min(inside, key=lambda key: np.mean(inside[key]))
        print(f"  fewest {worst}, {100 * np.mean(inside[worst]):.0f} %")
        for key in ("w_P0", "t_P", "t_R", "a_H", "x_H", "eps", "kappa", "l_R", "gamma_R_plus", "gamma_R_minus"):
            print(f"  {key}: standard error {np.median(sizes[key]):.2g} in the median")
        for words, made in (
            ("with torque", {"torque": True}),
            ("two propellers and rudders", {"y": 0.05}),
            ("with stated common errors", {"common": True}),
        ):
            more, _ = _coverage(Path(name), seeds, **made)
            print(f"{words}: {100 * np.mean([found for every in more.values() for found in every]):.1f} %")
        if not (DATA / "data").is_dir():
            print(f"HMRI: measured data are missing, no folder {DATA / 'data'} (set TANK2SIM_DATA)")
            return
        result = t2s.reduce_to_mmg(hmri_campaign(DATA, Path(name)))
    print(f"HMRI, {len(result.fit.tests.names)} conditions; in brackets the paper's of another model:")
    for key, paper in KVLCC2.items():
        found = result.coefficients.get(key)
        if found and found.origin == "measured":
            print(f"  {key}: {found.value:.3g} ± {found.standard_error:.2g} ({paper:g})")
    print(f"  x_R + a_H x_H: {result.fit.yaw_arm()[0]:.3f} ± {result.fit.yaw_arm()[1]:.3f} (-0.645)")


def _coverage(
    folder: Path, seeds: int, *, torque: bool = False, y: float = 0.0, common: bool = False
) -> tuple[dict[str, list[bool]], dict[str, list[float]]]:
    """Whether 95 % intervals of what was measured have the truth, and standard errors, by coefficient."""
    inside: dict[str, list[bool]] = {}
    sizes: dict[str, list[float]] = {}
    masses = estimated_masses(read_steady_tests(write_campaign(folder, KVLCC2)))
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        truth = ship_like_the_kvlcc2(seed, masses) | (TORQUE if torque else {})
        path = write_campaign(folder, truth, seed, torque=torque, y=y)
        found = t2s.reduce_to_mmg(with_common_errors(path, seed) if common else path).coefficients
        for key, value in truth.items():
            inside.setdefault(key, []).append(abs(found[key].value - value) < 1.96 * found[key].standard_error)
            sizes.setdefault(key, []).append(found[key].standard_error)
    return inside, sizes


if __name__ == "__main__":
    main()
