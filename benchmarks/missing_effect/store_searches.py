"""Store the fitted searches of cases, so that deciders can be compared in seconds on the same fits.

    python benchmarks/missing_effect/store_searches.py CASES FOLDER [--workers N]

CASES is a folder that ``cases.py`` wrote. Of each search FOLDER gets ``case_0001.json``: all explanations with their
scores (-2 log of the evidence), the width of the card's errors and what rules ask of them, where the innovations of the
best are not noise, and what the scores decide today. What is there already is kept. ``decide_stored.py`` reads them.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import json
import math
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

import tank2sim as t2s
from tank2sim.arguments import MOST_EFFECTS
from tank2sim.gap.diagnosis.strangeness import find_strangeness
from tank2sim.gap.inference.prior import candidate_explanations, likelihood_from_card
from tank2sim.gap.search.decision import decide, is_significant
from tank2sim.gap.search.explanations import Search, search
from tank2sim.gap.workflow import nonlinear_card
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import above_low_speed, polynomial_over_trials


def stored(found: Search) -> dict[str, object]:
    """What a decider needs of a search."""
    decision = decide(found)
    ahead = {id(fit) for fit in (*found.fits[:6], found.none)}
    fits = [
        {
            "effects": fit.hypothesis.effects,
            "score": fit.score,
            "width": fit.width,
            "parameters": len(fit.theta),
            "significant": is_significant(fit),
            "strange": [asdict(one) for one in find_strangeness(found.likelihood, fit)] if id(fit) in ahead else None,
        }
        for fit in found.fits
        if math.isfinite(fit.score)
    ]
    return {
        "fits": fits,
        "waves": found.likelihood.belief.waves is not None,
        "trials": len(found.likelihood.motion.names),
        "readings": int(found.likelihood.count),
        "decision": {
            "verdict": decision.verdict,
            "best": decision.best.hypothesis.effects,
            "alike": [fit.hypothesis.effects for fit in decision.alike],
        },
    }


def store(folder: Path, target: Path) -> str:
    """Search one case and write what was found; return a line about it."""
    begun = time.perf_counter()
    card = nonlinear_card(t2s.load(folder / "ship.toml").card)
    fitted = measured(sorted((folder / "fit").glob("*.csv")), card)
    card = polynomial_over_trials(card, fitted.trials)
    fitted = above_low_speed(card, fitted)
    names = candidate_explanations(card, fitted.driven_by)
    found = search(likelihood_from_card(card, fitted), names=names, most=MOST_EFFECTS)
    part = target.with_suffix(".part")
    part.write_text(json.dumps(stored(found)), encoding="utf-8")
    part.rename(target)
    best = "+".join(found.fits[0].hypothesis.effects) or "none"
    return f"{folder.name}: {best}, {len(found.fits)} fits, {time.perf_counter() - begun:.0f} s"


def main() -> int:
    """Store all searches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    places = [path.parent for path in sorted(asked.cases.glob("*/ship.toml"))]
    todo = [(place, asked.folder / f"{place.name}.json") for place in places]
    todo = [(place, target) for place, target in todo if not target.exists()]
    with ProcessPoolExecutor(asked.workers, multiprocessing.get_context("spawn")) as pool:
        for future in as_completed([pool.submit(store, *pair) for pair in todo]):
            print(future.result(), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
