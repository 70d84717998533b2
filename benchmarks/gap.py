"""The gap workflow judged on made-up trials: how often the missing effect is named, and how often a wrong one is.

The trials are of gap_truth, a generator that shares no code with the program: seven manoeuvres of one of its four
ships at 10 Hz (the Mariner unless another is asked for), written to files and read from them as a user's are. Parts:

singles    each effect of the library alone, at the strength at which one would call it real; the card exact
weak       the same at a quarter of the strength and with twice the noise
pairs      two effects of different kinds at once
none       nothing missing: sensor noise alone, every coefficient of the true ship 2 % off the card's (each by itself,
           or in groups), gusts, waves, and both together
outsiders  what the library does not hold
by_trial   winds and currents drawn for each trial, alone and with another effect
next_to_unknown  an effect of the library next to what it does not hold: the known one is to be named
process    singles with gusts and coefficients 2 % off, with waves, or with coefficients 2 % off in groups, by turns

A set is *right* if exactly the truth is named (none where there is none, outside the library where it is);
*undecided* if honestly so: the truth is among those that the trials cannot tell apart, or what is not named is below
the size that the program itself says could hide; *half* if one of two is named; *misnamed* if anything else is named;
*none* if nothing is, though it should show; *outside* if a name was withheld though the library has it.
Seeds begin where those end on which thresholds were settled. With --keep an interrupted run goes on where it ended.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from gap_truth import EFFECTS, FIT, HOLDOUT, HULLS, OUTSIDERS, Made, Setting, make, sampled, write, wrong_card
from scipy.stats import binomtest

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.errors import InputError
from tank2sim.files import write_whole
from tank2sim.gap.diagnosis.residuals import estimates
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.gap.outcome.export import NOISE_FLOOR, in_file_units
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY
from tank2sim.gap.search.decision import decide, enough_to_name
from tank2sim.gap.search.detection_limit import could_hide
from tank2sim.gap.search.explanations import search
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import measured

FIRST_SEED = 101
"""Thresholds were settled on seeds below this."""

PAIRS = (
    *(("current", "rudder_bias"), ("current", "cross_flow_drag"), ("current", "gyro_bias"), ("current", "flow_memory")),
    *(("wind", "rudder_stall"), ("wind", "hull_fouling"), ("wind", "rudder_rate_limit"), ("wave_drift", "rudder_lag")),
    *(("bank_suction", "turning_drag"), ("propeller_side_force", "log_scale"), ("engine_droop", "rudder_backlash")),
    *(("engine_droop", "heading_offset"), ("rudder_bias", "added_yaw_inertia"), ("rudder_stall", "log_misalignment")),
    *(("rudder_effectiveness", "antenna_lever_arm"), ("rudder_slipstream", "gyro_scale")),
    *(("rudder_rate_limit", "linear_sway_damping"), ("rudder_lag", "cross_flow_drag"), ("rudder_dead_band", "current")),
    *(("cross_flow_drag", "hull_fouling"), ("cubic_yaw_damping", "rudder_bias"), ("shallow_water", "current")),
    *(("roll_coupling", "log_lever_arm"), ("flow_memory", "rudder_time_offset"), ("hull_fouling", "gyro_bias")),
    *(("asymmetric_turning", "rudder_rate_limit"), ("linear_yaw_damping", "wind"), ("trim", "engine_droop")),
)
NOTHING_MISSING = (
    *(("none", "exact"), ("none", "independent"), ("none", "correlated"), ("gusts", "exact"), ("waves", "exact")),
    *(("gusts", "independent"), ("waves", "correlated")),
)
PROCESSES = (("gusts", "independent"), ("waves", "exact"), ("none", "correlated"))
BY_TRIAL = (("wind",), ("current",), ("wind", "rudder_lag"), ("current", "cross_flow_drag"))
NEXT_TO_UNKNOWN = (("cross_flow_drag", "out_tug"), ("wind", "out_oscillation"))
PARTS = ("singles", "weak", "pairs", "none", "outsiders", "process", "by_trial", "next_to_unknown")
OUTCOMES = ("right", "undecided", "half", "misnamed", "none", "outside")
NONE_PER_SEED = 2
"""So many sets of each kind with nothing missing for each seed: five seeds make 70."""

SAME = {"water_depth": "shallow_water"}
"""Effects that the program names by another's name: it states what a depth does as a magnification."""

FALLING = ("max_rate_degps", "depth_m")
"""Parameters that are the smaller, the stronger the effect."""

BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
PROVED = 1.3
"""Held-out misfit, over the noise, up to which a gap counts as closed."""


@dataclass(frozen=True)
class Said:
    """What was hidden in a set, and what was said of it; parameters as files have them."""

    group: str
    truth: dict[str, dict[str, float]]
    verdict: str
    named: list[str]
    alternatives: list[list[str]]
    confidence: dict[str, float]
    found: dict[str, dict[str, float]]
    hides: dict[str, dict[str, float]]
    seconds: float
    scores: list[tuple[list[str], float]] = field(default_factory=list)
    strange: list[tuple[str, str, float]] = field(default_factory=list)
    held_out: float | None = None

    @property
    def there(self) -> dict[str, dict[str, float]]:
        """What was hidden, by the names that the program has."""
        return {SAME.get(name, name): values for name, values in self.truth.items()}

    @property
    def outcome(self) -> str:
        """One of :data:`OUTCOMES`."""
        truth, named = set(self.there), set(self.named)
        outsider = bool(truth & set(OUTSIDERS))
        if outsider and not truth <= set(OUTSIDERS):
            known = truth - set(OUTSIDERS)
            return "right" if named == known else "outside" if not named else "half" if named < known else "misnamed"
        if self.verdict == OUTSIDE_LIBRARY:
            return "right" if outsider else "outside"
        if self.verdict in (NO_EFFECT_MISSING, COEFFICIENTS) and not truth:
            return "right"
        if not outsider and named <= truth and all(self._hidden(name) for name in truth - named):
            return "right" if self.verdict == MISSING and named == truth else "undecided"
        if self.verdict in (NO_EFFECT_MISSING, COEFFICIENTS):
            return "none"
        if self.verdict == AMBIGUOUS and truth and truth in map(set, self.alternatives):
            return "undecided"
        return "half" if truth > named else "misnamed"

    def _hidden(self, effect: str) -> bool:
        """Whether an effect is below the size that could hide."""
        values, sizes = self.there[effect], self.hides.get(effect, {})
        return bool(sizes) and all(
            name in values and (values[name] >= size if name in FALLING else abs(values[name]) <= size)
            for name, size in sizes.items()
        )

    @property
    def in_words(self) -> str:
        """The verdict and its names."""
        told = " or ".join("+".join(names) for names in (self.named, *self.alternatives))
        return (
            told
            if self.verdict in (MISSING, AMBIGUOUS)
            else {NO_EFFECT_MISSING: "none"}.get(self.verdict, self.verdict)
        )


def settings(part: str, seeds: Sequence[int], ship: str) -> Iterator[tuple[str, Setting]]:
    """The sets of a part with a ship, each with the group of which it is counted."""
    yield from ((group, replace(setting, ship=ship)) for group, setting in _settings(part, seeds))


def _settings(part: str, seeds: Sequence[int]) -> Iterator[tuple[str, Setting]]:
    for seed in seeds:
        if part == "singles":
            yield from ((part, Setting((name,), seed)) for name in EFFECTS)
        elif part == "weak":
            yield from ((part, Setting((name,), seed, strength=0.25, noise=2.0)) for name in EFFECTS)
        elif part == "pairs":
            yield from ((part, Setting(pair, seed)) for pair in PAIRS)
        elif part == "by_trial":
            yield from ((part, Setting(names, seed, by_trial=True)) for names in BY_TRIAL)
        elif part == "next_to_unknown":
            yield from ((part, Setting(names, seed)) for names in NEXT_TO_UNKNOWN)
        elif part == "outsiders":
            yield from ((part, Setting((name,), seed)) for name in OUTSIDERS)
        elif part == "process":
            for place, name in enumerate(EFFECTS):
                process, card = PROCESSES[(seed + place) % len(PROCESSES)]
                group = f"process: {_disturbed(process, card)}"
                yield group, Setting((name,), seed, process=process, coefficients=card)
        else:
            for process, card in NOTHING_MISSING:
                for own in range(NONE_PER_SEED * (seed - 1) + 1, NONE_PER_SEED * seed + 1):
                    yield f"none: {_disturbed(process, card)}", Setting((), own, process=process, coefficients=card)


def _disturbed(process: str, coefficients: str) -> str:
    words = [process] if process != "none" else []
    words += [f"2 % {coefficients}"] if coefficients != "exact" else []
    return ", ".join(words) or "noise"


def key(setting: Setting, args: argparse.Namespace) -> str:
    """Name of a set's file."""
    words = ("+".join(setting.effects) or "none", setting.seed, setting.strength, setting.noise)
    more = [*(["proved"] if args.prove else []), *([f"{args.hertz}Hz"] if args.hertz < 10 else [])]
    more += [f"wrong{args.wrong_card}"] if args.wrong_card else []
    more += ["by_trial"] if setting.by_trial else []
    more += [setting.ship] if setting.ship != "mariner" else []
    return "_".join(map(str, (*words, setting.process, setting.coefficients, *more)))


def judged(group: str, setting: Setting, prove: bool, hertz: int, wrong: float) -> Said:
    """Make a set, write it, read it, and look for what is missing."""
    (made,) = make([replace(setting, manoeuvres=FIT + HOLDOUT if prove else FIT)])
    made = sampled(made, hertz)
    with TemporaryDirectory() as name:
        folder = Path(name)
        write(made, folder)
        if wrong:
            (folder / "ship.toml").write_text(wrong_card(made, wrong / 100), encoding="utf-8")
        card = read_card(folder / "ship.toml")
        assert isinstance(card, ManoeuvringCard)
        files = {part: [folder / f"{name}.csv" for name in names] for part, names in (("fit", FIT), ("held", HOLDOUT))}
        return (_proved if prove else _decided)(group, made, card, files)


def _decided(group: str, made: Made, card: ManoeuvringCard, files: dict[str, list[Path]]) -> Said:
    begin = time.perf_counter()
    found = search(likelihood_from_card(card, measured(files["fit"], card)))
    decision = decide(found)
    hides = could_hide(found, decision.best, enough_to_name())
    seconds = time.perf_counter() - begin
    named = estimates(decision.best) if decision.verdict in (MISSING, AMBIGUOUS) else []
    return Said(
        group=group,
        truth=made.parameters,
        verdict=decision.verdict,
        named=[name for name, *_ in named],
        alternatives=[list(fit.hypothesis.effects) for fit in decision.alike] if named else [],
        confidence={name: decision.confidence(name) for name, *_ in named},
        found={name: _in_file(values) for name, values, _ in named},
        hides={name: _in_file(sizes) for name, sizes in hides.items()},
        seconds=seconds,
        scores=[(list(fit.hypothesis.effects), float(fit.score)) for fit in found.fits],
        strange=[(one.kind, one.trial, one.excess) for one in decision.strange],
    )


def _proved(group: str, made: Made, card: ManoeuvringCard, files: dict[str, list[Path]]) -> Said:
    begin = time.perf_counter()
    gap = run_gap_workflow(card, measured(files["fit"], card), measured(files["held"], card), GapOptions(workers=1))
    return Said(
        group=group,
        truth=made.parameters,
        verdict=gap.verdict,
        named=[one.name for one in gap.effects],
        alternatives=[list(names) for names in gap.alternatives],
        confidence={one.name: one.confidence for one in gap.effects},
        found={one.name: _in_file(one.parameters) for one in gap.effects},
        hides={name: _in_file(sizes) for name, sizes in gap.could_hide.items()},
        seconds=time.perf_counter() - begin,
        scores=[(list(one.effects), one.loss) for one in gap.rivals],
        held_out=gap.misfit("after", held_out=True),
    )


def _in_file(values: Mapping[str, float]) -> dict[str, float]:
    return dict(in_file_units(name, float(value)) for name, value in values.items())


def run(chosen: Sequence[tuple[str, Setting]], args: argparse.Namespace) -> list[Said]:
    """Judge all sets, those excepted that are kept already."""
    done, waiting = [], {}
    begin = time.perf_counter()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(args.workers, context) as pool:
        for group, setting in chosen:
            kept = args.keep / f"{key(setting, args)}.json" if args.keep else None
            if kept and kept.exists():
                done.append(Said(**{**json.loads(kept.read_text(encoding="utf-8")), "group": group}))
            else:
                waiting[pool.submit(judged, group, setting, args.prove, args.hertz, args.wrong_card)] = setting, kept
        try:
            for number, future in enumerate(as_completed(waiting), 1):
                setting, kept = waiting[future]
                told = f"{time.perf_counter() - begin:6.0f} s  {number}/{len(waiting)}  {key(setting, args)}: "
                try:
                    said = future.result()
                except InputError as error:
                    print(f"{told}{error}", flush=True)
                    continue
                if kept:
                    write_whole(kept, json.dumps(asdict(said), indent=1) + "\n")
                done.append(said)
                print(f"{told}{said.outcome}: {said.in_words}  ({said.seconds:.0f} s)", flush=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return done


def show_counts(sets: Sequence[Said]) -> None:
    """Outcomes by group, and their rates with 95 % Wilson intervals."""
    groups = list(dict.fromkeys(one.group for one in sets))
    print(
        f"\n{'':34s}{'sets':>6s}" + "".join(f"{name:>11s}" for name in OUTCOMES) + f"{'s a set: min, median, max':>28s}"
    )
    for group in groups:
        those = [one for one in sets if one.group == group]
        counts = Counter(one.outcome for one in those)
        seconds = [one.seconds for one in those]
        told = f"{min(seconds):.1f}, {np.median(seconds):.1f}, {max(seconds):.1f}"
        print(f"{group:34s}{len(those):6d}" + "".join(f"{counts[name]:11d}" for name in OUTCOMES) + f"{told:>28s}")
    print(f"\n{'rate, 95 % interval (Wilson)':34s}{'right':>24s}{'right or undecided':>24s}{'misnamed':>24s}")
    for group in groups:
        outcomes = [one.outcome for one in sets if one.group == group]
        wanted = (("right",), ("right", "undecided"), ("misnamed",))
        rates = [_rate(sum(one in names for one in outcomes), len(outcomes)) for names in wanted]
        print(f"{group:34s}" + "".join(f"{rate:>24s}" for rate in rates))


def _rate(count: int, of: int) -> str:
    low, high = binomtest(count, of).proportion_ci(method="wilson")
    return f"{100 * count / of:.1f} % ({100 * low:.1f}-{100 * high:.1f})"


def show_confusions(sets: Sequence[Said]) -> None:
    """What was said where the truth was not named alone."""
    print("\nwhat was said of those that are not right (the truth: what was said, how often)")
    for group in dict.fromkeys(one.group for one in sets):
        those = [one for one in sets if one.group == group and one.outcome != "right"]
        if those:
            print(f"  {group}")
        for truth in dict.fromkeys("+".join(one.truth) or "none" for one in those):
            own = [one for one in those if ("+".join(one.truth) or "none") == truth]
            cells = Counter(f"{one.in_words} [{one.outcome}]" for one in own).most_common()
            print(f"    {truth}: " + "; ".join(f"{said} {count}" for said, count in cells))


def show_reliability(sets: Sequence[Said]) -> None:
    """Confidence claimed for each effect that was named, against how often it was there."""
    claims = [(own, name in one.there) for one in sets for name, own in one.confidence.items()]
    print("\nconfidence claimed    effects named    mean claimed    there (95 % interval)")
    for low, high in pairwise(BINS):
        inside = [(own, there) for own, there in claims if low <= own < high or own == high == 1.0]
        if inside:
            mean = np.mean([own for own, _ in inside])
            there = _rate(sum(there for _, there in inside), len(inside))
            print(f"{low:6.2f} to {high:4.2f} {len(inside):21d} {mean:15.3f}    {there}")


def show_proof(sets: Sequence[Said]) -> None:
    """How far the gap was closed on trials that were held out."""
    print(f"\nheld-out misfit after, over the noise floor         median    within {PROVED:g}")
    named = [one for one in sets if one.held_out is not None and one.named]
    for words, some in (
        ("an effect was named", named),
        ("rightly", [one for one in named if one.outcome == "right"]),
        ("one of several", [one for one in named if one.verdict == AMBIGUOUS]),
        ("wrongly", [one for one in named if one.outcome in ("half", "misnamed")]),
    ):
        if some:
            over = np.array([one.held_out for one in some], float) / NOISE_FLOOR
            print(f"{words:49s} {np.median(over):8.2f}    {_rate(int((over <= PROVED).sum()), len(some))}")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="sets of each kind (default 5)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, metavar="N", help=f"default {FIRST_SEED}")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="sets with these effects alone (none: without any)")
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS, help="default: all")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep what was said, a file a set; resume from it")
    parser.add_argument("--hertz", type=int, choices=(10, 5, 2, 1), default=10, help="rows of a record a second (10)")
    parser.add_argument("--ship", choices=tuple(HULLS), default="mariner", help="ship of the generator (mariner)")
    percent = "each derivative of the card off by a normal error of P %% of it, which the card states"
    parser.add_argument("--wrong-card", type=float, default=0.0, metavar="P", help=percent)
    parser.add_argument("--prove", action="store_true", help="the whole workflow, proved on held-out trials")
    return parser.parse_args()


def main() -> int:
    args = arguments()
    if args.keep:
        args.keep.mkdir(parents=True, exist_ok=True)
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    chosen = [
        (group, setting)
        for part in args.part
        for group, setting in settings(part, seeds, args.ship)
        if not args.only or set(setting.effects or ("none",)) & set(args.only)
    ]
    sets = run(chosen, args)
    if not sets:
        print("no set was judged")
        return 1
    show_counts(sets)
    show_confusions(sets)
    show_reliability(sets)
    if args.prove:
        show_proof(sets)
    return 0


if __name__ == "__main__":
    sys.exit(main())
