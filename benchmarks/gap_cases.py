"""The eight worked cases of the gap workflow, whose truth is known, and how long all manoeuvres together take.

Each case is a Mariner with something hidden (or nothing, or something that no library holds): seven trials to find it,
six to prove it. Prints the verdict, what was found beside the truth, and the misfit in units of the noise (1 is noise)
before and after, fitted and held out. Then the time in which all thirteen manoeuvres of one case are asked for the
whole library and all pairs, after a first short search that loads what Python loads once. The cases are in the data
folder (TANK2SIM_DATA, else ../shared beside the project).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import json
import sys
import time
from pathlib import Path

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.gap.outcome.export import estimate_in_file, in_file_units
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import measured

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data" / "gap_cases"
CASES = range(1, 9)
TIMED = 8
"""Two effects are hidden in this case: the search is longest where pairs matter."""


def main() -> int:
    args = _arguments()
    if not DATA.is_dir():
        print(f"no cases: there is no folder {DATA} (set TANK2SIM_DATA)")
        return 0
    right = 0
    for case in args.cases:
        right += _case(case, args.workers)
    print(f"{right} of {len(args.cases)} as the truth has it")
    if not args.no_timing:
        _timed(args.workers)
    return 0 if right == len(args.cases) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="*", type=int, choices=CASES, default=list(CASES), metavar="N", help="1 to 8")
    parser.add_argument("--no-timing", action="store_true", help="do not time the thirteen manoeuvres")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    return parser.parse_args()


def _truth(case: int) -> tuple[dict, ManoeuvringCard]:
    truth = json.loads((DATA / f"case_{case}-truth.json").read_text(encoding="utf-8"))
    card = read_card(DATA / f"case_{case}" / "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    return truth, card


def _files(case: int, names: list[str]) -> list[Path]:
    return [DATA / f"case_{case}" / f"{name}.csv" for name in names]


def _case(case: int, workers: int) -> bool:
    """Prints one case; whether verdict and effects are those of the truth."""
    truth, card = _truth(case)
    begin = time.perf_counter()
    fitted, held = (measured(_files(case, truth[part]), card) for part in ("fit", "holdout"))
    gap = run_gap_workflow(card, fitted, held, GapOptions(workers=workers))
    took = time.perf_counter() - begin
    hidden = " + ".join(truth["parameters"])
    named = " + ".join(one.name for one in gap.effects) or "-"
    right = gap.verdict == truth["verdict"] and {one.name for one in gap.effects} == set(truth["effects"])
    print(f"case {case}  hidden: {hidden}   said: {gap.verdict}, {named}   {'' if right else 'NOT THE TRUTH'}")
    if gap.alternatives:
        print("   cannot be told from: " + "; ".join(" + ".join(names) for names in gap.alternatives))
    if truth["fair_alternatives"]:
        print("   fair alternatives by the truth: " + ", ".join(truth["fair_alternatives"]))
    _show_parameters(gap, truth["parameters"])
    misfits = [_misfit(gap, which, held_out) for held_out in (False, True) for which in ("before", "after")]
    print("   misfit before, after: fitted {}, {}; held out {}, {}".format(*misfits) + f"   {took:.1f} s", flush=True)
    return right


def _show_parameters(gap: Gap, truth: dict[str, dict[str, float]]) -> None:
    for one in gap.effects:
        for name, value in one.parameters.items():
            own, found = estimate_in_file(name, value)
            error = in_file_units(name, one.standard_errors[name])[1] if name in one.standard_errors else None
            spread = f" +- {error:.2g}" if error is not None else ""
            true = truth.get(one.name, {}).get(own)
            beside = f"truth {true:.5g}" if true is not None else "not in the truth"
            print(f"   {one.name}.{own}: {found:.5g}{spread}, {beside}   (confidence {one.confidence:.3f})")


def _misfit(gap: Gap, which: str, held_out: bool) -> str:
    value = gap.misfit(which, held_out=held_out)
    return "-" if value is None else f"{value:.2f}"


def _timed(workers: int) -> None:
    """All thirteen manoeuvres, the whole library and all pairs; reading included."""
    truth, card = _truth(TIMED)
    names = truth["fit"] + truth["holdout"]
    none = measured([], card)
    run_gap_workflow(
        card, measured(_files(TIMED, truth["fit"][:1]), card), none, GapOptions(effects=("current",), workers=workers)
    )
    begin = time.perf_counter()
    fitted = measured(_files(TIMED, names), card)
    read = time.perf_counter() - begin
    gap = run_gap_workflow(card, fitted, none, GapOptions(workers=workers))
    took = time.perf_counter() - begin
    named = " + ".join(one.name for one in gap.effects) or "-"
    rows = sum(len(trial.time_s) for trial in fitted.trials)
    print(f"all {len(names)} manoeuvres of case {TIMED} ({rows} rows), whole library and pairs, {workers} processes: ")
    print(f"   {took:.1f} s, of it reading {read:.1f} s; said: {gap.verdict}, {named}")


if __name__ == "__main__":
    sys.exit(main())
