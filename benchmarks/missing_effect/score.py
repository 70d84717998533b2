"""Score answers to the benchmark of missing effects.

    python benchmarks/missing_effect/score.py ANSWERS.csv TRUTH.csv

ANSWERS.csv has the columns ``case``, ``verdict`` (``none``, ``missing``, ``outside``) and ``effects`` (names of the
catalogue joined by ``+``; empty unless something is missing), and, if the program has them, ``confidence`` (0 to 1, of
the names), ``confidences`` (of each name, joined by ``+``; used instead of ``confidence``), ``alternatives`` (sets of
names joined by ``+``, with blanks between, at most three) and ``held_out_misfit`` (root mean square of simulated less
measured over the noise of one reading, of the trials held out, with what was found). A case that is not answered counts
as wrong.

Printed are, with 95 % Wilson intervals: cases answered exactly (verdict and all names); precision and recall of names;
cases with a name that is not there; for answers with a confidence, how often the names were there.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

SAME = {"water_depth": "shallow_water"}
"""A depth and the magnification that it makes are one effect."""

MOST = 3
"""Alternatives that count: whoever gives all has said nothing."""

BINS = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


@dataclass(frozen=True)
class Scored:
    """One case: what was hidden and what was answered."""

    truth: Mapping[str, str]
    answer: Mapping[str, str]

    @property
    def hidden(self) -> set[str]:
        """Effects that are there."""
        return _names(self.truth["effects"])

    @property
    def named(self) -> set[str]:
        """Effects that were named."""
        return _names(self.answer.get("effects") or "")

    @property
    def exact(self) -> bool:
        """Whether verdict and names are right."""
        return self.answer.get("verdict") == self.truth["verdict"] and self.named == self.hidden

    @property
    def among(self) -> bool:
        """Whether the answer is exact, or the truth is one of at most :data:`MOST` alternatives given with it."""
        others = (self.answer.get("alternatives") or "").split()[:MOST]
        return self.exact or any(_names(other) == self.hidden for other in others)

    @property
    def claims(self) -> list[tuple[float, bool]]:
        """Confidence of each name, and whether it is there; empty without confidences."""
        names = [SAME.get(name, name) for name in (self.answer.get("effects") or "").split("+") if name]
        each = (self.answer.get("confidences") or "").split("+")
        if each == [""]:
            each = [self.answer.get("confidence") or ""] * len(names)
        return [
            (float(confidence), name in self.hidden) for name, confidence in zip(names, each, strict=True) if confidence
        ]

    @property
    def misnamed(self) -> bool:
        """Whether an effect was named that is not there."""
        return bool(self.named - self.hidden)


def _names(text: str) -> set[str]:
    return {SAME.get(name, name) for name in text.split("+") if name}


def read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def rate(count: int, of: int) -> str:
    """A share in per cent with its 95 % interval."""
    if not of:
        return "-"
    low, high = binomtest(count, of).proportion_ci(method="wilson")
    return f"{100 * count / of:3.0f} % ({100 * low:.0f}-{100 * high:.0f})"


def show(title: str, scored: Sequence[Scored]) -> None:
    """A line of the table."""
    named, there = sum(len(one.named) for one in scored), sum(len(one.named & one.hidden) for one in scored)
    hidden = sum(len(one.hidden) for one in scored)
    cells = (
        rate(sum(one.exact for one in scored), len(scored)),
        rate(sum(one.among for one in scored), len(scored)),
        rate(there, named),
        rate(there, hidden),
        rate(sum(one.misnamed for one in scored), len(scored)),
    )
    print(f"{title:22s}{len(scored):6d}" + "".join(f"{cell:>18s}" for cell in cells))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("answers", type=Path)
    parser.add_argument("truth", type=Path)
    args = parser.parse_args()
    answers = {row["case"]: row for row in read_rows(args.answers)}
    scored = [Scored(row, answers.get(row["case"], {})) for row in read_rows(args.truth)]
    titles = ("exact", "or alternative", "precision", "recall", "wrong name")
    print(f"{'':22s}{'cases':>6s}" + "".join(f"{title:>18s}" for title in titles))
    show("all", scored)
    for column in ("group", "hertz", "ship"):
        for value in dict.fromkeys(one.truth[column] for one in scored):
            some = [one for one in scored if one.truth[column] == value]
            show(f"{value} Hz" if column == "hertz" else value, some)
    claims = [claim for one in scored for claim in one.claims]
    for low, high in pairwise(BINS):
        inside = [there for confidence, there in claims if low < confidence <= high]
        if inside:
            print(f"names claimed with {low:.2f} to {high:.2f}: {len(inside)}, there {rate(sum(inside), len(inside))}")
    misfits = [float(one.answer["held_out_misfit"]) for one in scored if one.answer.get("held_out_misfit")]
    if misfits:
        print(f"held-out misfit over the noise: median {np.median(misfits):.2f}, worst {max(misfits):.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
