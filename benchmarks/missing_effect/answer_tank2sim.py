"""Answer the benchmark of missing effects with tank2sim.

    python benchmarks/missing_effect/answer_tank2sim.py FOLDER -o answers.csv [--workers N]

Cases that are in the file of answers are not answered again: an interrupted run goes on where it ended.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import csv
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import tank2sim as t2s
from tank2sim.gap.result import AMBIGUOUS, MISSING, OUTSIDE_LIBRARY

COLUMNS = ("case", "verdict", "effects", "confidence", "confidences", "held_out_misfit", "alternatives")


def answer(folder: Path) -> dict[str, str]:
    """The answer to one case."""
    ship = t2s.load(folder / "ship.toml")
    trials, held = ([*sorted((folder / part).glob("*.csv"))] for part in ("fit", "holdout"))
    found = t2s.find_gap(ship, trials, holdout=held, workers=1)
    gap = found.gap
    named = gap.verdict in (MISSING, AMBIGUOUS)
    misfit = gap.misfit("after", held_out=True)
    return {
        "case": folder.name,
        "verdict": "missing" if named else "outside" if gap.verdict == OUTSIDE_LIBRARY else "none",
        "effects": "+".join(effect.name for effect in gap.effects) if named else "",
        "confidence": f"{min(effect.confidence for effect in gap.effects):.4f}" if named and gap.effects else "",
        "confidences": "+".join(f"{effect.confidence:.4f}" for effect in gap.effects) if named else "",
        "held_out_misfit": "" if misfit is None else f"{misfit:.4g}",
        "alternatives": " ".join("+".join(names) for names in gap.alternatives),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    args = parser.parse_args()
    begun = args.output.exists()
    with args.output.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if not begun:
            writer.writeheader()
        done = {row["case"] for row in csv.DictReader(args.output.open(encoding="utf-8"))} if begun else set()
        folders = [path.parent for path in sorted(args.folder.glob("*/ship.toml")) if path.parent.name not in done]
        with ProcessPoolExecutor(args.workers, multiprocessing.get_context("spawn")) as pool:
            for number, future in enumerate(as_completed([pool.submit(answer, folder) for folder in folders]), 1):
                row = future.result()
                writer.writerow(row)
                file.flush()
                print(f"{number}/{len(folders)} {row['case']}: {row['verdict']} {row['effects']}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
