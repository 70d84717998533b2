"""Whether the trial that `gap` proposes decides: ambiguous cases, with the proposed manoeuvre sailed and added, twice.

    python benchmarks/missing_effect/next_trial.py [--cases N] [--seed S] [--workers N]

Each case has one or two trials of one ship with one hidden effect at full strength, 2 rows a second. Where the answer
is ambiguous, the independent generator (``gap_truth``) sails the orders of ``next_test.csv`` with the true ship, the
trial is added, and `gap` is asked again; at most twice. Printed are the cases that were ambiguous, how many of them
then have a single answer, how many of those are right, and what became of each.
"""

from __future__ import annotations

import argparse
import csv
import math
import multiprocessing
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from gap_truth import EFFECTS, HULLS, Setting, make, sampled, write
from gap_truth.manoeuvres import MANOEUVRES, Manoeuvre
from gap_truth.ship import MARINER
from scipy.stats import binomtest

import tank2sim as t2s
from tank2sim.gap.result import AMBIGUOUS, Gap, NextTest

POOR = (("zigzag10_10",), ("turn20_port",), ("zigzag20_20",), ("pullout_stbd", "straight"), ("accel", "zigzag10_10"))
"""Trials of a case: a choice of this benchmark, too few to distinguish all effects."""

HERTZ, OFTEN, MORE = 2, 10, 2
"""Rows a second, and in a trial that is to show the instants of its orders; trials that are added at most."""


@dataclass(frozen=True)
class Outcome:
    """A case: its hidden effect, and after each decision the verdict and the names."""

    hidden: str
    answers: tuple[tuple[str, str], ...]
    manoeuvres: tuple[str, ...]

    @property
    def ambiguous(self) -> bool:
        """Whether the first trials left several explanations."""
        return self.answers[0][0] == AMBIGUOUS

    @property
    def decided(self) -> bool:
        """Whether one answer was left at the end."""
        return self.answers[-1][0] != AMBIGUOUS

    @property
    def right(self) -> bool:
        """Whether it is the hidden effect."""
        return self.decided and self.answers[-1][1] == self.hidden


def decide(number: int, seed: int) -> Outcome:
    """One case, from its draw to its last answer."""
    generator = np.random.default_rng([seed, number])
    setting = Setting(
        (str(generator.choice(EFFECTS)),),
        seed=int(generator.integers(2**31)),
        manoeuvres=POOR[int(generator.integers(len(POOR)))],
        ship=str(generator.choice(list(HULLS))),
    )
    answers: list[tuple[str, str]] = []
    sailed: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(sampled(make([setting])[0], HERTZ), folder)
        while True:
            trials = sorted(folder.glob("*.csv"))
            found: Gap = t2s.find_gap(t2s.load(folder / "ship.toml"), trials, workers=1).gap
            answers.append((found.verdict, "+".join(effect.name for effect in found.effects)))
            if found.verdict != AMBIGUOUS or found.next_test is None or len(sailed) == MORE:
                return Outcome(setting.effects[0], tuple(answers), tuple(sailed))
            trial = f"next_{len(sailed) + 1}"
            MANOEUVRES[trial] = ordered(found.next_test, setting)
            sailed.append(found.next_test.manoeuvre)
            hertz = OFTEN if found.next_test.needs_instants else HERTZ
            write(sampled(make([replace(setting, manoeuvres=(trial,))])[0], hertz), folder)


def ordered(test: NextTest, setting: Setting) -> Manoeuvre:
    """The manoeuvre of orders in CSV (s, deg to starboard, rpm), in the generator's units of the Mariner."""
    lines = [line for line in test.orders.splitlines() if not line.startswith("#")]
    rows = [{key: float(value) for key, value in row.items() if value} for row in csv.DictReader(lines)]
    time, hull = setting.hull.time, setting.hull
    rpm = MARINER.rpm / hull.rpm
    steps = [(round(row["t_s"] / time, 6), row["delta_order_deg"]) for row in rows]
    revolutions = [(round(row["t_s"] / time, 6), row["n_rpm"] * rpm) for row in rows if "n_rpm" in row]
    changes = [step for before, step in zip([(0.0, 0.0), *steps], steps, strict=False) if step[1] != before[1]]
    begun = revolutions[0][1] if revolutions else MARINER.rpm
    return Manoeuvre(
        heading_deg=math.degrees(test.heading_rad),
        duration_s=rows[-1]["t_s"] / time,
        orders=tuple(changes),
        revolutions=tuple(revolutions),
        start_rpm=begun,
        start_speed_mps=MARINER.speed_mps * begun / MARINER.rpm,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=60, metavar="N", help="cases that are drawn (60)")
    parser.add_argument("--seed", type=int, default=11, metavar="S", help="of the draw (11)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers, multiprocessing.get_context("spawn")) as pool:
        outcomes = []
        for outcome in pool.map(decide, range(args.cases), [args.seed] * args.cases):
            outcomes.append(outcome)
            if outcome.ambiguous:
                steps = "; ".join(f"{verdict} {names}" for verdict, names in outcome.answers)
                print(f"{outcome.hidden}: {steps} (sailed: {', '.join(outcome.manoeuvres) or 'nothing'})", flush=True)
    first = [outcome for outcome in outcomes if outcome.ambiguous]
    decided, right = (sum(getattr(outcome, key) for outcome in first) for key in ("decided", "right"))
    print(f"{len(first)} of {len(outcomes)} cases ambiguous with their first trials")
    for what, count in (("one answer after at most two more", decided), ("and the right one", right)):
        if first:
            low, high = binomtest(count, len(first)).proportion_ci(method="wilson")
            print(f"{what}: {count} of {len(first)}, {count / len(first):.0%} ({low:.0%}-{high:.0%})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
