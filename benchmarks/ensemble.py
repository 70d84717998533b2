"""How fast an ensemble is: turns of 600 s of the Mariner, 2 % on each of her coefficients, against a loop by hand in C.

The loop by hand (``ensemble/turns.c`` about ``fmu_step/mariner.c``) steps the same members with the same coefficients
and keeps only where each ends, one ship after the other. The ensemble is the whole way: members drawn, turns run in the
lanes of vector registers, figures read off, histories kept for their bands; next to it the same turns by single
runs, as they are made where there are no lanes, and 10/10 zigzags. All run by turns in one process; then an ensemble of
10 000 with all its bands on the processors of this machine, and the memory that it takes. Rates are by processor time:
what else the machine does is no part of them. The members' last speeds must agree, to the single precision in which
histories are kept. With ``--steps`` it prints instead what longer integration steps and single precision change of
the figures of 4000 members after the first 2000.

With ``--peers`` it prints what a turn takes in other programs, all by turns in one process: the loop by hand, the same
equations in JAX and in diffrax, and shipmmg's turn of the KVLCC2 at its default tolerance (of its own equations; it has
no Mariner), next to the ensemble with the model's step and at the fastest pace. One that is not installed is skipped.
With ``--dask`` it prints how much faster two workers of a Dask cluster are than one; with ``--users`` what a member of
each kind of ensemble takes in lanes and by single runs.

    python benchmarks/ensemble.py [--members N] [--rounds N] [--steps | --peers | --dask | --users]
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from tank2sim.analysis.ensemble import questions
from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import (
    ENSEMBLE_SIGNALS,
    OfCriteria,
    OfFigures,
    OfManoeuvre,
    ShipText,
    fastest_pace,
)
from tank2sim.analysis.ensemble.results import EnsembleRequest, manoeuvre_bands
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.executors import executing
from tank2sim.native.compiler import FLAGS, SHARED_SUFFIX, require_compiler
from tank2sim.native.lanes import widest_lanes
from tank2sim.simulation.bands import figure_bands, history_bands
from tank2sim.simulation.ensemble import KEPT, Draws, Ensemble, Question, _prepared, ensemble
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag, parse_manoeuvre
from tank2sim.simulation.run import simulate

HERE = Path(__file__).parent
DURATION, RUDDER, SEED = 600.0, np.radians(35.0), 1
AIM, MEMORY_MB, AGREEMENT = 3.0, 500, 1e-6


def by_hand(folder: Path) -> ctypes.CDLL:
    library = folder / f"turns{SHARED_SUFFIX}"
    sources = [str(HERE / "ensemble" / "turns.c"), str(HERE / "fmu_step" / "mariner.c")]
    visible = [flag for flag in FLAGS if not flag.startswith("-fvisibility")]
    command = [*require_compiler("the benchmark"), *visible, "-shared", *sources, "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


def hand_loop(library: ctypes.CDLL, ships: np.ndarray, steps: int, h: float) -> np.ndarray:
    ends = np.empty((len(ships), 7))
    array = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    library.turns.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_double, ctypes.c_double, array, array]
    library.turns.restype = None
    library.turns(len(ships), steps, h, float(RUDDER), ships, ends)
    return ends


def numbers_of(card: ManoeuvringCard, draws: Draws, members: int) -> np.ndarray:
    """The numbers of ``Ship`` in mariner.h of each member."""
    from fmu_step import ship_numbers  # slow to import, and every process imports this file

    model = build(card)
    own = np.array(ship_numbers(model))
    derivatives = [name for name in model.parameter_names if name.startswith("derivatives.")]
    ships = np.tile(own, (members, 1))
    for member in range(members):
        for name, value in draws.member(member).items():
            ships[member, len(own) - len(derivatives) + derivatives.index(name)] = value
    return ships


def seconds_of_processors() -> float:
    """Processor time of this process and of those that it began and that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def hand_on_all(library: ctypes.CDLL, ships: np.ndarray, h: float) -> float:
    """Processor time of a turn of the loop by hand, s, while all processors run it: they may share what one has."""
    parts = 16 * (os.cpu_count() or 1)
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        begun = time.process_time()
        list(threads.map(lambda _: hand_loop(library, ships, round(DURATION / h), h), range(parts)))
        return (time.process_time() - begun) / (parts * len(ships))


def on_all(question: OfManoeuvre, draws: Draws, members: int) -> tuple[Ensemble, float, float]:
    """An ensemble with its bands on processes that begin with it, and the time that passes and that processors work."""
    begun, worked = time.perf_counter(), seconds_of_processors()
    question = replace(question, pace=fastest_pace(question, draws))
    with executing() as executor:
        found = ensemble(question, draws, members, executor)
    figure_bands(found)
    history_bands(found, question.times, tuple(ENSEMBLE_SIGNALS))
    return found, time.perf_counter() - begun, seconds_of_processors() - worked


def single_runs(card: ManoeuvringCard, draws: Draws, members: int) -> float:
    """Processor time of a turn that is simulated by itself with every step kept, s."""
    model = build(card)
    integrator = Integrator(model)
    begun = time.process_time()
    for member in range(members):
        simulate(
            model, Turn(float(RUDDER)), duration_s=DURATION, parameters=draws.member(member), integrator=integrator
        )
    return (time.process_time() - begun) / members


def other_paces() -> None:
    """The largest change of a figure by the chosen pace, and figures that it gives to ships or takes from them."""
    ten = float(np.radians(10.0))
    for name in ("mariner", "kvlcc2", "esso-osaka-ship"):
        card = read_card(name)
        assert isinstance(card, ManoeuvringCard)
        draws, _ = draws_of(card, SEED)
        for told, manoeuvre in (("turn", Turn(float(RUDDER))), ("10/10 zigzag", Zigzag(ten, ten))):
            usual = OfManoeuvre(ShipText.of(card), manoeuvre, None, np.zeros(0))
            pace = fastest_pace(usual, draws)
            own, other = (ensemble(one, draws, 6000).figures for one in (usual, replace(usual, pace=pace)))
            flips = sum(int(np.sum(np.isnan(own[figure]) != np.isnan(other[figure]))) for figure in own)
            worst = max(float(np.nanmax(np.abs(other[figure] / own[figure] - 1))) for figure in own)
            precision = "single" if pace.single else "double"
            print(
                f"{name}, {told}: {pace.step_factor} times the step, {precision} precision; figures change by at most "
                f"{worst:.1e} of themselves, {flips} come or go"
            )


def peers(rounds: int, part: int = 512) -> None:
    """Processor time of a turn in each program, and how the last motions differ from those of the loop by hand."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    draws, _ = draws_of(card, SEED)
    h = build(card).step_s
    steps, ships = round(DURATION / h), numbers_of(card, draws, part)
    usual = OfManoeuvre(ShipText.of(card), Turn(float(RUDDER)), DURATION, np.zeros(0))
    fastest = replace(usual, pace=fastest_pace(usual, draws))

    def lanes(question: OfManoeuvre) -> Callable[[], None]:
        ask = question.prepared()
        values = draws.members(0, part).values
        return lambda: (ask(part, dict(zip(draws.names, values.T, strict=True)), 0), None)[1]

    with tempfile.TemporaryDirectory() as name:
        library = by_hand(Path(name))
        ends = hand_loop(library, ships, steps, h)
        ours = "lanes, double precision, the model's step, figures", "lanes at the fastest pace, figures"
        jobs: dict[str, tuple[int, Callable[[], object]]] = {
            "loop by hand in C": (part, lambda: hand_loop(library, ships, steps, h)),
            ours[0]: (part, lanes(usual)),
            ours[1]: (part, lanes(fastest)),
        }
        for package in ("jax", "diffrax"):
            if importlib.util.find_spec("jax") is None or importlib.util.find_spec(package) is None:
                print(f"{package}: skipped, it is not installed (pip install jax diffrax)")
                continue
            import ensemble_jax

            if package == "jax":
                told, turns = "JAX, the model's step", ensemble_jax.runge_kutta_turns(steps, h, float(RUDDER))
            else:
                told = f"diffrax, Tsit5, relative tolerance {ensemble_jax.RELATIVE:g}"
                turns = ensemble_jax.diffrax_turns(DURATION, float(RUDDER))
            off = np.max(np.abs(turns(ships) - ends) / np.max(np.abs(ends), axis=0))
            print(f"{told}: motions at the end are within {off:.1e} of those of the loop by hand")
            jobs[told] = part, partial(turns, ships)
        if importlib.util.find_spec("shipmmg") is None:
            print("shipmmg: skipped, it is not installed (the extra 'peers')")
        else:
            from peer_ships import of_shipmmg

            turn = of_shipmmg()[0]
            jobs["shipmmg, KVLCC2 by MMG, default tolerance"] = 1, partial(turn.run, turn.delivered)
        seconds: dict[str, list[float]] = {told: [] for told in jobs}
        for number in range(rounds + 1):
            for told, (count, job) in jobs.items():
                begun = time.process_time()
                job()
                if number:  # in the first round things are loaded and compiled
                    seconds[told].append((time.process_time() - begun) / count)
    print(f"processor time of a turn of {DURATION:g} s, {part} at once, medians of {rounds} rounds by turns")
    for told, taken in seconds.items():
        ratios = [statistics.median(a / b for a, b in zip(taken, seconds[one], strict=True)) for one in ours]
        print(f"  {told:52} {1e3 * statistics.median(taken):8.3f} ms, {ratios[0]:7.2f} and {ratios[1]:7.2f} times ours")


def on_dask(members: int) -> bool:
    """The ensemble on one and on two workers of Dask, and whether both give the figures of this process."""
    if importlib.util.find_spec("distributed") is None:
        print("skipped: Dask is not installed (the extra 'dask')")
        return True
    from distributed import Client, LocalCluster

    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    draws, _ = draws_of(card, SEED)
    usual = OfManoeuvre(ShipText.of(card), Turn(float(RUDDER)), DURATION, np.linspace(0, DURATION, 201))
    question = replace(usual, pace=fastest_pace(usual, draws))
    here, taken, worked, same = ensemble(question, draws, members).figures, [], [], True
    for workers in (1, 2):
        with (
            LocalCluster(workers, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster, set_as_default=False) as client,
            executing(cluster.scheduler_address.replace("tcp", "dask")) as executor,
        ):
            ensemble(question, draws, KEPT + 2048 * workers, executor, batch=128)  # libraries are loaded
            before, begun = sum(client.run(time.process_time).values()), time.perf_counter()
            there = ensemble(question, draws, members, executor).figures
            taken.append(time.perf_counter() - begun)
            worked.append(sum(client.run(time.process_time).values()) - before)
        same &= all(np.array_equal(there[name], values, equal_nan=True) for name, values in here.items())
    print(f"{members} turns on Dask with 1 and 2 workers: {taken[0]:.1f} and {taken[1]:.1f} s")
    print(f"  2 workers are {taken[0] / taken[1]:.2f} times as fast as 1")
    print(f"  processor time of the workers {worked[0]:.1f} and {worked[1]:.1f} s: {worked[0] / worked[1]:.2f}")
    print(f"  figures are {'' if same else 'not '}those of this process to the bit")
    return same


def users(rounds: int, together: int = 256, alone: int = 4) -> None:
    """Processor time of a member of the ensembles of each command, in lanes and by single runs."""
    mariner, tanker = (read_card(name) for name in ("mariner", "esso-osaka-ship"))
    assert isinstance(mariner, ManoeuvringCard) and isinstance(tanker, ManoeuvringCard)
    ship, other_ship, ten, none = ShipText.of(mariner), ShipText.of(tanker), float(np.radians(10.0)), np.zeros(0)
    asked: dict[str, tuple[ManoeuvringCard, Question]] = {
        "simulate --members, turn:35": (mariner, OfManoeuvre(ship, Turn(float(RUDDER)), None, none)),
        "simulate --members, zigzag:10/10": (mariner, OfManoeuvre(ship, Zigzag(ten, ten), None, none)),
        "simulate --members, stop (Esso Osaka)": (tanker, OfManoeuvre(other_ship, Stop(), None, none)),
        "simulate --members, spiral": (mariner, OfManoeuvre(ship, parse_manoeuvre("spiral"), None, none)),
        "stability --members, all IMO criteria": (mariner, OfCriteria(ship)),
        "the same with a stop (Esso Osaka)": (tanker, OfCriteria(other_ship)),
        "influence --members, advance and overshoot": (
            mariner,
            OfFigures(ship, ("advance_m@35", "overshoot_1_deg@10/10")),
        ),
    }
    usual = questions.lanes_of
    print(f"processor time of a member, {together} in lanes, {alone} by single runs, medians of {rounds} rounds")
    for told, (card, question) in asked.items():
        draws, _ = draws_of(card, SEED)
        fast: list[float] = []
        slow: list[float] = []
        for _ in range(rounds + 1):  # in the first one things are loaded and compiled
            for lanes_of, count, taken in ((usual, together, fast), (lambda _: None, alone, slow)):
                with patch.object(questions, "lanes_of", lanes_of):
                    _prepared.cache_clear()
                    ensemble(question, draws, 1)  # the model is built before the time
                    begun = time.process_time()
                    ensemble(question, draws, count)
                    taken.append((time.process_time() - begun) / count)
        one, other = 1e3 * statistics.median(fast[1:]), 1e3 * statistics.median(slow[1:])
        print(f"  {told:45} {one:7.3f} and {other:7.2f} ms, {other / one:.1f} times")


def bands_of_readme(card: ManoeuvringCard) -> None:
    """The bands of the manual for ``tank2sim simulate mariner --manoeuvre turn:35 --members 100 --seed 3``."""
    turn, asked = Turn(float(RUDDER)), EnsembleRequest(100, 3)
    run = simulate(build(card), turn)
    bands = manoeuvre_bands(card, turn, (None, float(run.trajectory.t[-1])), asked).figures
    told = [f"{name} {bands[name].p5:.0f} to {bands[name].p95:.0f}" for name in ("advance_m", "tactical_diameter_m")]
    print(f"{asked.members} ships, seed {asked.seed}, 5 and 95 %: {', '.join(told)}")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--members", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=15)
    for other in ("--steps", "--peers", "--dask", "--users"):
        parser.add_argument(other, action="store_true")
    return parser.parse_args()


def whole(members: int, rounds: int) -> int:
    """The ensemble next to the loop by hand and single runs, and one of `members` from beginning to end."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    draws, _ = draws_of(card, SEED)
    question = OfManoeuvre(ShipText.of(card), Turn(float(RUDDER)), DURATION, np.linspace(0, DURATION, 201))
    h = build(card).step_s
    steps, part = round(DURATION / h), 256
    ships = numbers_of(card, draws, part)
    ten = float(np.radians(10.0))
    zigzags = OfManoeuvre(ShipText.of(card), Zigzag(ten, ten), None, question.times)
    for each in (question, zigzags):
        ensemble(each, draws, 4)
    hand, ours, zigzag, single = [], [], [], []
    with tempfile.TemporaryDirectory() as name:
        library = by_hand(Path(name))
        for _ in range(rounds):
            begun = time.process_time()
            ends = hand_loop(library, ships, steps, h)
            middle = time.process_time()
            found = ensemble(question, draws, part)
            hand.append((middle - begun) / part)
            after = time.process_time()
            ours.append((after - middle) / part)
            ensemble(zigzags, draws, part)
            zigzag.append((time.process_time() - after) / part)
            single.append(single_runs(card, draws, 8))
        assert found.histories is not None
        last = found.histories[:, 4, -1]
        difference = float(np.max(np.abs(last - ends[:, 3].astype(np.float32)) / np.abs(last)))
        ratio = statistics.median(a / b for a, b in zip(hand, ours, strict=True))
        print(f"Mariner, turns of {DURATION:g} s, {steps} steps; time of one core, {rounds} rounds by turns")
        print(f"  loop by hand {1e3 * statistics.median(hand):6.2f} ms a turn")
        print(f"  ensemble     {1e3 * statistics.median(ours):6.2f} ms a turn, {ratio:.2f} of the rate   (aim {AIM})")
        print(f"  single runs  {1e3 * statistics.median(single):6.2f} ms a turn; lanes: {widest_lanes()}")
        print(f"  ensemble of 10/10 zigzags {1e3 * statistics.median(zigzag):6.2f} ms each, with four overshoots")
        print(f"  surge velocities at the end differ by {difference:.1e} relative (kept in single precision)")
        # The loop by hand before and after, for what else the machine does then.
        before = hand_on_all(library, ships, h)
        found, taken, worked = on_all(question, draws, members)
        by_loop = (before + hand_on_all(library, ships, h)) / 2
    largest = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    share = by_loop * members / worked
    diameter = figure_bands(found)["tactical_diameter_m"]
    print(f"{members} turns, {os.cpu_count()} processes, beginning and end and all: {taken:.1f} s")
    each = 1e3 * worked / members
    print(
        f"  processors work {worked:.1f} s, {each:.2f} ms a turn; by hand {1e3 * by_loop:.2f}: {share:.2f} of the rate"
    )
    print(f"  tactical diameter {diameter.low:.0f} to {diameter.high:.0f} m, median {diameter.median:.0f} m")
    print(f"  largest process {largest / 1024:.0f} MB   (must be below {MEMORY_MB})")
    bands_of_readme(card)
    return 0 if ratio >= AIM and largest / 1024 < MEMORY_MB and difference < AGREEMENT else 1


def main() -> int:
    asked = arguments()
    if asked.steps:
        other_paces()
    elif asked.peers:
        peers(asked.rounds)
    elif asked.users:
        users(asked.rounds)
    elif asked.dask:
        return 0 if on_dask(asked.members) else 1
    else:
        return whole(asked.members, asked.rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
