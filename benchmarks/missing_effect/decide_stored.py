"""Compare deciders on stored searches: the posterior with each of its constants halved and doubled.

    python benchmarks/missing_effect/decide_stored.py FOLDER TRUTH.csv [FOLDER TRUTH.csv ...]

FOLDER is what ``store_searches.py`` wrote, TRUTH.csv the truth of its cases. Printed are, for each setting: cases whose
most probable set is the truth; where it is among those that are named; cases with an effect that is not there; the mean
log score of the probability stated for the first set; and, for the setting of the program, how often the first set was
right by its probability.
"""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.special import softmax
from score import SAME, rate

from tank2sim.gap.inference.prior import PRICE
from tank2sim.gap.search.decision import LISTED, TEMPER

BINS = np.linspace(0.0, 1.0, 11)
NEVER = 1e-3
"""Least probability in a log score: one case must not outweigh all others."""


@dataclass(frozen=True)
class Stored:
    """A stored search and what was hidden."""

    hidden: frozenset[str]
    outside: bool
    fits: list[dict]

    def decided(self, price: float, temper: float) -> tuple[list[frozenset[str]], float, bool]:
        """Sets that are named, the most probable first, its probability, and whether a name is withheld."""
        compared = [fit for fit in self.fits if fit["significant"] or not fit["effects"]]
        scores = np.array([fit["score"] + price * len(fit["effects"]) for fit in compared])
        shares = softmax(-0.5 * scores / temper)
        order = np.argsort(-shares)
        listed = order[: int(np.searchsorted(np.cumsum(shares[order]), LISTED)) + 1]
        strange = bool(compared[order[0]].get("strange"))
        return [same(compared[place]["effects"]) for place in listed], float(shares[order[0]]), strange


def same(effects: list[str]) -> frozenset[str]:
    """Names of effects, one for each that has two."""
    return frozenset(SAME.get(name, name) for name in effects if name)


def read(folder: Path, truth: Path) -> list[Stored]:
    """All stored searches of a folder."""
    with truth.open(newline="", encoding="utf-8") as file:
        rows = {row["case"]: row for row in csv.DictReader(file)}
    found = []
    for path in sorted(folder.glob("case_*.json")):
        row, search = rows[path.stem], json.loads(path.read_text(encoding="utf-8"))
        found.append(Stored(same(row["effects"].split("+")), row["verdict"] == "outside", search["fits"]))
    return found


def judged(stored: list[Stored], price: float, temper: float) -> np.ndarray:
    """A row a search: whether the first set is right, is among the named, holds a wrong name, and its probability."""
    rows = []
    for one in stored:
        named, probability, strange = one.decided(price, temper)
        right = strange if one.outside else named[0] == one.hidden and not strange
        wrong = not strange and bool(named[0] - one.hidden)
        rows.append((right, right or (one.hidden in named and not one.outside), wrong, probability))
    return np.array(rows, dtype=float)


def main() -> int:
    """Print the comparison."""
    if len(sys.argv) < 3 or len(sys.argv) % 2 == 0:
        print(__doc__)
        return 2
    pairs = zip(sys.argv[1::2], sys.argv[2::2], strict=True)
    stored = [one for folder, truth in pairs for one in read(Path(folder), Path(truth))]
    print(f"{len(stored)} stored searches")
    print("price  temper  exact            among the named  wrong name       log score")
    settings = [(PRICE, TEMPER), (PRICE / 2, TEMPER), (2 * PRICE, TEMPER), (PRICE, TEMPER / 2), (PRICE, 2 * TEMPER)]
    for price, temper in settings:
        right, among, wrong, stated = judged(stored, price, temper).T
        score = np.mean(np.log(np.maximum(np.where(right == 1, stated, 1 - stated), NEVER)))
        shown = (rate(int(column.sum()), len(stored)) for column in (right, among, wrong))
        print(f"{price:5.3g}  {temper:6.3g}  {'  '.join(f'{text:15}' for text in shown)}  {score:.2f}")
    right, _, _, stated = judged(stored, PRICE, TEMPER).T
    print("stated      cases  mean stated  right")
    for low, high in pairwise(BINS):
        inside = (stated > low) & (stated <= high)
        if inside.any():
            count = int(inside.sum())
            print(f"{low:.1f} to {high:.1f}  {count:5d}  {stated[inside].mean():11.2f}  {right[inside].mean():.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
