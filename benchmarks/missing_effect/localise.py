"""Whether `gap` finds where in which trial an effect acts: its intervals against the forces of the generator.

    python benchmarks/missing_effect/localise.py [--cases N] [--seed S] [--workers N]

The cases of ``cases.py`` with the same seed in which effects are hidden. The independent generator (``gap_truth``)
has the forces that they add along the true motion; a force acts where its square exceeds half of its mean square over
the fitted trials. Scored are, at 10 Hz, the equations (surge, sway, yaw) for which `gap` gives intervals: precision,
recall and F1 of the time. Cases whose effects add no force (current, sensors) or that are not named exactly are counted
and not scored.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import multiprocessing
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cases import Case, draw_cases, write_case
from gap_truth.acting import added_forces
from gap_truth.manoeuvres import FIT
from score import SAME

import tank2sim as t2s
from tank2sim.gap.result import Acting

EQUATIONS = ("surge", "sway", "yaw")
TICK_S = 0.1


@dataclass(frozen=True)
class Located:
    """A case: its effects, those named, and seconds found rightly, found wrongly and missed."""

    name: str
    hidden: str
    named: str
    right: float
    wrong: float
    missed: float

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; nan without intervals."""
        whole = 2 * self.right + self.wrong + self.missed
        return 2 * self.right / whole if self.right + self.wrong else float("nan")


def locate(case: Case) -> Located:
    """Search one case and compare its intervals."""
    forces = {name: force for name, force in added_forces(case.setting).items() if name in FIT}
    with tempfile.TemporaryDirectory() as folder:
        row = write_case(case, Path(folder))
        place = Path(folder) / case.name
        ship = t2s.load(place / "ship.toml")
        gap = t2s.find_gap(ship, sorted((place / "fit").glob("*.csv")), workers=1).gap
    named = sorted(effect.name for effect in gap.effects)
    hidden = sorted(name for name in row["effects"].split("+") if name)
    exact = [SAME.get(name, name) for name in named] == [SAME.get(name, name) for name in hidden]
    seconds = compared(gap.at_work, forces) if exact else (0.0, 0.0, 0.0)
    return Located(case.name, "+".join(hidden), "+".join(named), *seconds)


def compared(intervals: tuple[Acting, ...], forces: dict[str, np.ndarray]) -> tuple[float, float, float]:
    """Seconds found rightly, found wrongly and missed, over the equations that have intervals."""
    counts = np.zeros(3)
    for place, equation in enumerate(EQUATIONS):
        of_equation = [one for one in intervals if one.equation == equation]
        usual = np.mean(np.concatenate([force[:, place] for force in forces.values()]) ** 2)
        if not (of_equation and usual):  # a record that is early adds no force, and gap has the forces of the delay
            continue
        for trial, force in forces.items():
            acts = force[:, place] ** 2 > 0.5 * usual
            t = TICK_S * np.arange(len(force))
            found = np.zeros(len(force), bool)
            for one in of_equation:
                if one.trial == trial:
                    found |= (t >= one.t_start_s) & (t <= one.t_end_s)
            counts += [np.sum(found & acts), np.sum(found & ~acts), np.sum(~found & acts)]
    right, wrong, missed = TICK_S * counts
    return float(right), float(wrong), float(missed)


def main() -> int:
    """Print the scores."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=40, metavar="N", help="cases drawn, of which some hide nothing")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the draw")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    asked = parser.parse_args()
    cases = [case for case in draw_cases(asked.cases, asked.seed) if case.group in ("single", "weak", "pair")]
    found: list[Located] = []
    with ProcessPoolExecutor(asked.workers, multiprocessing.get_context("spawn")) as pool:
        for future in as_completed([pool.submit(locate, case) for case in cases]):
            one = future.result()
            found.append(one)
            print(f"{one.name} {one.hidden}: named {one.named or 'none'}, F1 {one.f1:.2f}", flush=True)
    scored = [one for one in found if np.isfinite(one.f1)]
    right, wrong, missed = (sum(getattr(one, part) for one in scored) for part in ("right", "wrong", "missed"))
    print(f"{len(found)} cases with effects, {len(scored)} named exactly with intervals")
    print(f"of all seconds: precision {right / (right + wrong):.2f}, recall {right / (right + missed):.2f}, ", end="")
    print(f"F1 {2 * right / (2 * right + wrong + missed):.2f}")
    of_cases = np.array([one.f1 for one in scored])
    print(f"F1 of a case: median {np.median(of_cases):.2f}, least {of_cases.min():.2f}")
    print(f"0.85 or more in {np.sum(of_cases >= 0.85)} of {len(scored)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
