"""The gap workflow on measurements: what it names where nobody knows the whole truth. It prints what was found.

Esso Osaka, 3 m model on a pond, in measured wind. For each day of trials: the card (as it is estimated, and as it is
identified, wind given, from the trials of other days), its wind and the record of the wind taken away. Is wind what is
named, and with which speed and direction beside the mean of those measured? Then the misfit of the card without wind,
with what was named (or fits best, where a name was withheld), with the wind fitted alone, and with the measured wind
given back. Of each run the longest part in the card's range of speeds, free running; the last run of a day is held out.

KVLCC2: what the card lacks by four of HSVA's zigzags, proved on the three others and on MARIN's runs; and what a card
lacks that was identified from the four, by the other three, proved on MARIN's.

The measurements are in the data folder (TANK2SIM_DATA, else ../shared beside the project).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import tomlkit
from identify_esso_osaka import FIXED, spans

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.residuals import estimates, surroundings_by_trial
from tank2sim.gap.improve_card import Found, add_effects_to_card, in_short
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.gap.outcome.export import joined
from tank2sim.gap.proof.correct_sensors import correct_sensor_faults
from tank2sim.gap.proof.replay import replay_trials
from tank2sim.gap.proof.surroundings import with_surroundings
from tank2sim.gap.result import Gap, Passed
from tank2sim.gap.search.explanations import search
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials import identify as identification
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.identification.trials.problem.problem_from_card import free_parameters
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.records.trials import Trial, unwrapped, window, with_signals

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data"

DAYS = ("14-Oct-2020", "14-Sep-2020", "31-Jul-2020")
"""Two days of turns and one of zigzags; within a day the wind is taken to be one."""

STRUCTURE = "cross_flow"
"""Of cards that are identified: the one that follows both ships best (identify_esso_osaka.py, identify_kvlcc2.py)."""

HELD = (*FIXED, "wind.still_air")
"""Not identified: see there; and trials in wind tell next to nothing of the resistance of still air."""

WIND = ("wind_speed_mps", "wind_direction_rad", "wind_rel_speed_mps", "wind_rel_direction_rad")

KNOWN = ("05_01", "10_10_P", "20_10_S", "35_05")
UNKNOWN = ("10_05", "10_10_S", "25_05")
"""Zigzags of HSVA, halved so that each half has small and large angles."""

KINDS = ("estimated", "identified", "bundled")

NAMED = "what was named"
"""Row of a table."""

RIVALS = 3
"""Explanations of which the loss is told."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ship", nargs="+", choices=("esso", "kvlcc2-captive"), default=("esso", "kvlcc2-captive"))
    parser.add_argument("--days", nargs="+", choices=DAYS, default=DAYS, help="of the Esso Osaka")
    parser.add_argument("--card", nargs="+", choices=KINDS, default=KINDS[:2])
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    args = parser.parse_args()
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # a motion that runs away is counted as such
    for ship, folder, run in (("esso", "esso_osaka", _esso_osaka), ("kvlcc2-captive", "kvlcc2_hsva", _kvlcc2)):
        if ship in args.ship and (DATA / folder).is_dir():
            run(args)
        elif ship in args.ship:
            print(f"no trials: there is no folder {DATA / folder} (set TANK2SIM_DATA)")
    return 0


# -- Esso Osaka ----------------------------------------------------------------------------------------------------


def _esso_osaka(args: argparse.Namespace) -> None:
    card = read_card("esso-osaka-estimated")
    assert isinstance(card, ManoeuvringCard)
    everything = measured(sorted((DATA / "esso_osaka").glob("*/*.csv")), card)
    trials = [_longest_part(trial, card.model.speed_range_mps[0]) for trial in everything.trials]
    for day in args.days:
        own = [trial for trial in trials if day in trial.name and not trial.name.startswith("random")]
        others = [trial for trial in trials if day not in trial.name]
        print(f"\nEsso Osaka, {day}: {len(own)} runs, {', '.join(f'{_length(one):.0f} s' for one in own)}")
        print(f"   wind as measured: {_mean_wind(own)}")
        for kind in args.card:
            windy = _card_of(kind, card, replace(everything, trials=tuple(others)))
            print(f"  card as {kind}")
            _without_wind(windy, replace(everything, trials=tuple(own), notices=()), args.workers)


def _card_of(kind: str, estimated: ManoeuvringCard, others: Measured) -> ManoeuvringCard:
    """A card with wind: as estimated, as identified from the trials of other days, or the bundled one, which was
    identified with the measured wind from the trials of all days."""
    if kind == "identified":
        return _identified(estimated, others, HELD)
    bundled = read_card("esso-osaka")
    assert isinstance(bundled, ManoeuvringCard)
    return estimated if kind == "estimated" else bundled


def _longest_part(trial: Trial, slowest: float) -> Trial:
    """The longest time of a run in the card's range of speeds, the wind's direction continuous."""
    begin, end = max(spans(trial, slowest), key=lambda span: span[1] - span[0])
    direction = unwrapped(trial.signals["wind_direction_rad"])
    return window(with_signals(trial, {"wind_direction_rad": direction}, "wind made continuous"), begin, end)


def _length(trial: Trial) -> float:
    return float(trial.time_s[-1] - trial.time_s[0])


def _mean_wind(trials: Sequence[Trial]) -> str:
    """Mean vector over all trials, and of each trial."""
    vectors = [trial.signals["wind_speed_mps"] * np.exp(1j * trial.signals["wind_direction_rad"]) for trial in trials]
    each = ", ".join(_polar(complex(np.nanmean(one))) for one in vectors)
    return f"{_polar(complex(np.nanmean(np.concatenate(vectors))))} (each run: {each})"


def _polar(vector: complex) -> str:
    return f"{abs(vector):.2f} m/s from {np.degrees(np.angle(vector)) % 360:.0f} deg"


def _identified(card: ManoeuvringCard, trials: Measured, hold: Sequence[str] = ()) -> ManoeuvringCard:
    there = free_parameters(STRUCTURES[STRUCTURE].start(card))
    held = tuple(name.removeprefix("derivatives.") for name in hold if name in there)
    options = identification.IdentificationOptions(structure=STRUCTURE, members=0, hold=held)
    return identification.identify_trials(card, trials, options=options).card


def _without_wind(windy: ManoeuvringCard, whole: Measured, workers: int) -> None:
    """What is said when the wind is taken away, and what closes the gap."""
    calm = _calm(windy)
    blind = replace(whole, trials=tuple(_unmeasured(trial) for trial in whole.trials))
    begin = time.perf_counter()
    gap = run_gap_workflow(
        calm,
        replace(whole, trials=whole.trials[:-1]),
        replace(whole, trials=whole.trials[-1:]),
        GapOptions(workers=workers),
    )
    print("   with the record of the wind, and a card without:")
    _show(gap, time.perf_counter() - begin)
    misfits = [gap.misfit(version, held_out=held) for held in (False, True) for version in ("before", "after")]
    print("   misfit fitted {:.3g} -> {:.3g}, held out {:.3g} -> {:.3g}; without the record:".format(*misfits))
    fitted, held = replace(blind, trials=blind.trials[:-1]), replace(blind, trials=blind.trials[-1:])
    begin = time.perf_counter()
    gap = run_gap_workflow(calm, fitted, held, GapOptions(workers=workers))
    _show(gap, time.perf_counter() - begin)
    alone = next(
        fit
        for fit in search(likelihood_from_card(calm, fitted), names=("wind",), most=1).fits
        if fit.hypothesis.effects
    )
    found = estimates(alone)
    values = found[0][1]
    if "speed_mps" in values:
        print(f"   wind fitted alone: {_polar(values['speed_mps'] * np.exp(1j * values['direction_rad']))}")
    else:
        by_trial = surroundings_by_trial(alone, [trial.name for trial in fitted.trials])["wind"]
        each = [_polar(one.speed_mps * np.exp(1j * one.direction_rad)) for one in by_trial.values()]
        print(f"   wind fitted alone, of each run its own: {', '.join(each)}")
        found = [("wind", {"speed_mps": 0.0, "direction_rad": 0.0, **values}, found[0][2])]
        own = with_surroundings(fitted, {"wind": by_trial})
        blind = replace(blind, trials=(*own.trials, *held.trials))
    models = {
        "without wind": (calm, []),
        **_named(gap, fitted),
        "the wind fitted alone": (calm, found),
    }
    own_winds = {effect.name: effect.by_trial for effect in gap.effects if effect.by_trial}
    for effect, by_trial in own_winds.items():
        each = [_polar(one.speed_mps * np.exp(1j * one.direction_rad)) for one in by_trial.values()]
        print(f"   {effect} as named, of each run: {', '.join(each)}")
    in_winds = with_surroundings(blind, own_winds)
    rows = {words: _passed(gap, *model, in_winds if words == NAMED else blind) for words, model in models.items()}
    rows["the measured wind"] = _passed(gap, windy, [], whole)
    last = whole.trials[-1].name
    _table(calm, rows, {"fitted": lambda name: name != last, "held out": lambda name: name == last})


def _calm(card: ManoeuvringCard) -> ManoeuvringCard:
    document = tomlkit.parse(card.text)
    kept = [entry for entry in document["effects"] if entry["name"] != "wind"]
    del document["effects"]
    if kept:
        effects = tomlkit.aot()
        for entry in kept:
            effects.append(entry)
        document["effects"] = effects
    calm = parse_card(tomlkit.dumps(document), card.source)
    assert isinstance(calm, ManoeuvringCard)
    return calm


def _unmeasured(trial: Trial) -> Trial:
    return with_signals(trial, dict.fromkeys(name for name in WIND if name in trial.signals), "wind left out")


# -- KVLCC2 --------------------------------------------------------------------------------------------------------


def _kvlcc2(args: argparse.Namespace) -> None:
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    known, unknown = (
        measured([DATA / "kvlcc2_hsva" / f"HSVA_CPMC_KVLCC2_Z_{name}.dat" for name in names], card)
        for names in (KNOWN, UNKNOWN)
    )
    marin = measured(sorted((DATA / "kvlcc2_marin").glob("*.dat")), card)
    if "estimated" in args.card:
        print("\nKVLCC2, bundled card: named by four zigzags of HSVA")
        held = replace(unknown, trials=unknown.trials + marin.trials, notices=())
        _kvlcc2_gap(card, known, held, args.workers)
    if "identified" in args.card:
        print(f"\nKVLCC2, card identified from those four ({STRUCTURE}): named by the other three")
        _kvlcc2_gap(_identified(card, known), unknown, marin, args.workers)


def _kvlcc2_gap(card: ManoeuvringCard, fitted: Measured, held: Measured, workers: int) -> None:
    begin = time.perf_counter()
    gap = run_gap_workflow(card, fitted, held, GapOptions(workers=workers))
    _show(gap, time.perf_counter() - begin)
    whole = replace(fitted, trials=fitted.trials + held.trials)
    models = {"as given": (card, []), **_named(gap, fitted)}
    rows = {words: _passed(gap, *model, whole) for words, model in models.items()}
    own = {trial.name for trial in fitted.trials}
    groups: dict[str, Callable[[str], bool]] = {"fitted": lambda name: name in own}
    if any("HSVA" in trial.name for trial in held.trials):
        groups["HSVA held out"] = lambda name: name not in own and "HSVA" in name
    groups["MARIN held out"] = lambda name: "HSVA" not in name
    _table(card, rows, groups)


# -- both ----------------------------------------------------------------------------------------------------------


def _show(gap: Gap, seconds: float) -> None:
    named = "; ".join(f"{one.name}: {_in_short(one.name, one.parameters, one.standard_errors)}" for one in gap.effects)
    print(f"   said: {gap.verdict}{'; ' if named else ''}{named}   ({seconds:.0f} s)")
    if gap.alternatives:
        print("   cannot be told from: " + "; ".join(joined(names) for names in gap.alternatives))
    told = [one for place, one in enumerate(gap.rivals) if place < RIVALS or not one.effects]
    print("   score above the best: " + ", ".join(f"{joined(one.effects)} {one.loss:.0f}" for one in told))
    if gap.where:
        place = gap.where[0]
        when = f"{place.t_start_s:.0f} to {place.t_end_s:.0f} s"
        print(f"   most of the misfit: {place.signal} of {place.trial}, {when} ({place.share_of_misfit:.0%})")
        print(f"   {gap.equation}")
    for notice in gap.notices:
        if "no tried effect" in notice or "do not agree" in notice or "worse" in notice:
            print(f"   {notice}")


def _in_short(name: str, values: Mapping[str, float], errors: Mapping[str, float]) -> str:
    if "direction_rad" in values:
        values = {**values, "direction_rad": values["direction_rad"] % (2 * np.pi)}
    return in_short(name, values, errors)


def _named(gap: Gap, fitted: Measured) -> dict[str, tuple[ManoeuvringCard, list[Found]]]:
    """What was named, or, where a name was withheld, what fits best all the same."""
    if gap.effects:
        return {NAMED: (gap.card, [(one.name, one.parameters, one.standard_errors) for one in gap.effects])}
    names = gap.rivals[0].effects
    if not names:
        return {}
    fits = search(likelihood_from_card(gap.card, fitted), names=names, most=len(names)).fits
    best = estimates(next(fit for fit in fits if set(fit.hypothesis.effects) == set(names)))
    for name, values, errors in best:
        print(f"   not named, though it fits best: {name}: {_in_short(name, values, errors)}")
    return {"what fits best, not named": (gap.card, best)}


def _passed(gap: Gap, card: ManoeuvringCard, found: list[Found], trials: Measured) -> tuple[Passed, ...]:
    """Trials simulated freely with a card and what was found on top, faults of sensors taken away."""
    sigmas = {name: sigma for name, (sigma, _) in gap.noise.items()}
    sensors = [one for one in found if EFFECTS[one[0]].acts_on == "sensor"]
    mended = (
        replace(trials, trials=tuple(correct_sensor_faults(trial, sensors) for trial in trials.trials))
        if sensors
        else None
    )
    return replay_trials(card, add_effects_to_card(card, found), trials, sigmas, False, mended)


def _table(
    card: ManoeuvringCard, rows: Mapping[str, Sequence[Passed]], groups: Mapping[str, Callable[[str], bool]]
) -> None:
    """Root mean squares of all misfits over the noise, of the yaw rate's over itself, of the position's over L."""
    print(f"   {'misfit: /noise, r %, position/L':32s}" + "".join(f"{name:>26s}" for name in groups))
    for words, results in rows.items():
        told = ""
        for chosen in groups.values():
            some = [one for one in results if chosen(one.name)]
            noise = np.sqrt(np.mean([one.misfit("after") ** 2 for one in some]))
            yaw = _relative(some, ("motion.r",)) * 100
            away = _size(some, ("motion.x", "motion.y")) * np.sqrt(2) / card.ship.length_m
            told += f"{noise:12.1f}{yaw:7.0f}{away:7.2f}"
        print(f"   {words:32s}{told}", flush=True)


def _size(results: Sequence[Passed], names: Sequence[str], *, measured_itself: bool = False) -> float:
    """Root mean square of an error, or of what was measured, over all readings of some variables."""
    values = [
        one.measured[name] if measured_itself else one.after[name] - one.measured[name]
        for one in results
        for name in names
        if name in one.noise
    ]
    return float(np.sqrt(np.nanmean(np.concatenate(values) ** 2))) if values else np.nan


def _relative(results: Sequence[Passed], names: Sequence[str]) -> float:
    return _size(results, names) / _size(results, names, measured_itself=True)


if __name__ == "__main__":
    sys.exit(main())
