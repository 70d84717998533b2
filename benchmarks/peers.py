"""tank2sim beside other libraries of ship manoeuvring, in one run: set-up, speed and accuracy as ratios to ours.

Manoeuvres of 600 s: a turn with 35 deg of rudder and a 20/20 zigzag. Ships of one hull where the peer's model allows:
shipmmg has the MMG model of the KVLCC2 (Yasukawa and Yoshimura 2015), tank2sim a third-order Abkowitz model of her from
other tests; length, speed and rate of the rudder are the same, the equations are not, so their diameters differ and
only speed and numerical accuracy compare. vessel-manoeuvring-models (VMM) has the Mariner of the same tests as
tank2sim: one ship, one set of equations, and the figures are to agree. CommonOcean's vessels have no rudder: theirs is
a turn by a yaw moment, for speed alone. Each is called as its documentation shows, and measured twice: as delivered,
and at equal accuracy, the coarsest step or tolerance at which one twice (a step) or ten times (a tolerance) finer moves
the figure by less than ``ACCURACY``. The figure is the tactical diameter of a turn, the second overshoot of a zigzag.
Times are of a core, medians of rounds in which all take turns. A peer that is not installed is skipped.

    pip install tank2sim[peers]
    python benchmarks/peers.py [--rounds N] [--json FILE]
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
from peer_ships import ABKOWITZ, DURATION_S, HEADING, MARINER, PEERS, RUDDER, Case, mariner_card

from tank2sim.cards import read_card
from tank2sim.dynamics import Model, build
from tank2sim.files import write_whole
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre, Turn, Zigzag
from tank2sim.simulation.run import Run, simulate

ACCURACY = 1e-4  # of the figure: 0.01 %
SETUPS = 5
DELIVERED = "as delivered"

PACKAGES = {
    "shipmmg": "shipmmg",
    "VMM": "vessel-manoeuvring-models",
    "CommonOcean": "commonocean-vessel-models",
}
MODULES = {"shipmmg": "shipmmg", "VMM": "vessel_manoeuvring_models", "CommonOcean": "vesselmodels"}
BESIDES = {"VMM": ("sympy", "pandas", "statsmodels", "sklearn", "dill", "plotly", "matplotlib", "IPython")}
"""Modules that a peer imports and does not ask pip for."""

NOT_COMPARED = {
    "PythonVehicleSimulator": "not on the Python package index; its catalogue has no Mariner",
    "MCSimPython": "ships of generalised forces for dynamic positioning, linear damping: no rudder, no manoeuvre",
    "MSSpy": "0.0.1 on the package index holds no code",
    "MarineSystemSim": "a ship of generalised forces without numbers for any ship",
}
"""Libraries that were looked at and have nothing to compare, and why."""

CAN = {
    "tank2sim": "Abkowitz and linear; rudder gear; turn, zigzag, spiral, pull-out, stop; identification; FMU 2 and 3",
    "shipmmg": "MMG 3-DOF and Nomoto's; rudder as a list of angles; zigzag; Nomoto's K and T by least squares; no FMU",
    "VMM": "any 3-DOF equations in sympy; rudder as a table; zigzag not with pandas 2; regression, Kalman filter",
    "CommonOcean": "point mass to 3-DOF of forces; no rudder, no manoeuvres, no identification, no FMU",
}
"""What each has, by the public functions and documentation of the versions printed."""

READY = {
    "tank2sim": "from tank2sim.cards import read_card; from tank2sim.dynamics import build\n"
    "from tank2sim.simulation.run import simulate; from tank2sim.simulation.integrator import Integrator\n"
    "Integrator(build(read_card('kvlcc2-captive')))",
    "shipmmg": "from shipmmg.mmg_3dof import simulate_mmg_3dof, zigzag_test_mmg_3dof",
    "VMM": "from vessel_manoeuvring_models.models import vmm_mariner\n"
    "from vessel_manoeuvring_models.models.vessels import mariner",
    "CommonOcean": "from scipy.integrate import odeint\n"
    "from vesselmodels.vessel_dynamics_3F import vessel_dynamics_3f\n"
    "from vesselmodels.parameters_vessel_1 import parameters_vessel_1; parameters_vessel_1()",
}
"""What a fresh Python does before the first manoeuvre."""


@dataclass(frozen=True)
class Row:
    """What was measured of a case at one level.

    `change` is the relative distance of the figure from `against`: the finest level, or a reference; `us_per_s` and
    `us_per_evaluation` are the core time of the call, in us, per simulated second and per right-hand side; `times_ours`
    is the median ratio to tank2sim at the same manoeuvre and kind of level.
    """

    library: str
    ship: str
    manoeuvre: str
    level: str
    setting: str
    figure: float
    change: float
    against: str
    us_per_s: float
    us_per_evaluation: float | None
    times_ours: float


def reason_to_skip(peer: str) -> str:
    """Why a peer cannot be measured here; empty if it can."""
    if importlib.util.find_spec(MODULES[peer]) is None:
        return f"{PACKAGES[peer]} is not installed (the extra 'peers')"
    if lacking := [name for name in BESIDES.get(peer, ()) if importlib.util.find_spec(name) is None]:
        return f"{PACKAGES[peer]} needs {', '.join(lacking)}, which it does not install (the extra 'peers')"
    return ""


def ours() -> list[Case]:
    """tank2sim's KVLCC2, and the Mariner as VMM has her: the whole call, with every output and all figures."""
    ship, other = build(read_card("kvlcc2-captive")), build(mariner_card())
    turn, zigzag = Turn(RUDDER), Zigzag(HEADING, HEADING)
    return [
        _own(ABKOWITZ, ship, "turn", turn, _diameter, _four_a_step),
        _own(ABKOWITZ, ship, "zigzag", zigzag, _overshoot),
        _own(MARINER, other, "turn", turn, _diameter, _four_a_step),
    ]


def _own(
    ship: str,
    model: Model,
    name: str,
    manoeuvre: Manoeuvre,
    figure: Callable[[Run], float],
    evaluations: Callable[[Run], int] | None = None,
) -> Case:
    @cache
    def prepared(step: float) -> tuple[Model, Integrator]:
        stepped = replace(model, step_s=step)
        return stepped, Integrator(stepped)

    def run(step: float) -> Run:
        stepped, integrator = prepared(step)
        return simulate(stepped, manoeuvre, duration_s=DURATION_S, integrator=integrator)

    steps = tuple(16 * model.step_s / 2**k for k in range(8))
    return Case("tank2sim", ship, name, "step, s", steps, model.step_s, run, figure, None, evaluations)


def _four_a_step(run: Run) -> int:
    return 4 * (len(run.trajectory.t) - 1)


def _diameter(run: Run) -> float:
    diameter = run.figures["tactical_diameter_m"]
    assert isinstance(diameter, float)
    return diameter


def _overshoot(run: Run) -> float:
    overshoots = run.figures["overshoots_deg"]
    assert isinstance(overshoots, list)
    return float(overshoots[1])


def accurate_level(case: Case) -> tuple[float, bool]:
    """The coarsest level from which on every finer one moves the figure by less than `ACCURACY`; whether there is one.

    Judged on the whole row of levels, for a coarse one may agree with the next by chance; else the finest level.
    """
    figures = np.array([case.figure(case.run(level)) for level in case.levels])
    moved = np.flatnonzero(~(np.abs(np.diff(figures) / figures[1:]) < ACCURACY))
    first = int(moved[-1]) + 1 if len(moved) else 0
    return case.levels[first], first < len(case.levels) - 1


def measured(cases: Sequence[Case], rounds: int) -> list[Row]:
    """Every case as delivered and at equal accuracy, in rounds in which all take turns."""
    jobs = []
    for case in cases:
        level, reached = accurate_level(case)
        jobs += [(case, DELIVERED, case.delivered)]
        jobs += [(case, "equal accuracy" if reached else "finest, accuracy not reached", level)]
    seconds: list[list[float]] = [[] for _ in jobs]
    for _ in range(rounds):
        for taken, (case, _, level) in zip(seconds, jobs, strict=True):
            begun = time.process_time()
            case.run(level)
            taken.append(time.process_time() - begun)
    own = {
        (case.ship, case.manoeuvre, name == DELIVERED): taken
        for taken, (case, name, _) in zip(seconds, jobs, strict=True)
        if case.library == "tank2sim"
    }
    rows = []
    for taken, (case, name, level) in zip(seconds, jobs, strict=True):
        usual = own[ABKOWITZ, case.manoeuvre, name == DELIVERED]
        rows.append(_row(case, name, level, (taken, own.get((case.ship, case.manoeuvre, name == DELIVERED), usual))))
    return rows


def _row(case: Case, name: str, level: float, seconds: tuple[list[float], list[float]]) -> Row:
    taken, own = seconds
    run = case.run(level)
    figure, seconds_each = case.figure(run), statistics.median(taken)
    each = seconds_each / case.evaluations(run) * 1e6 if case.evaluations else None
    finest = case.reference() if case.reference else case.figure(case.run(case.levels[-1]))
    ratio = statistics.median(a / b for a, b in zip(taken, own, strict=True))
    setting = case.as_delivered if name == DELIVERED and case.as_delivered else f"{case.setting} {level:.3g}"
    us, against = seconds_each / DURATION_S * 1e6, "reference" if case.reference else "finest"
    change = abs(figure / finest - 1)
    return Row(case.library, case.ship, case.manoeuvre, name, setting, figure, change, against, us, each, ratio)


def setups(libraries: Sequence[str], repetitions: int) -> dict[str, float]:
    """Seconds of a core of a fresh Python until a ship is ready, compilers with it; ours also with nothing compiled."""

    def once(code: str, environment: dict[str, str]) -> float:
        timed = f"import os; begun = sum(os.times()[:4])\n{code}\nprint(sum(os.times()[:4]) - begun)"
        done = subprocess.run(
            [sys.executable, "-c", timed], env=environment, capture_output=True, text=True, check=True
        )
        return float(done.stdout.split()[-1])

    here = dict(os.environ)
    found: dict[str, list[float]] = {"tank2sim, nothing compiled yet": [], **{name: [] for name in libraries}}
    for _ in range(repetitions):
        for name in libraries:
            found[name].append(once(READY[name], here))
        with tempfile.TemporaryDirectory() as empty:
            first = once(READY["tank2sim"], here | {"XDG_CACHE_HOME": empty})
            found["tank2sim, nothing compiled yet"].append(first)
    return {name: statistics.median(seconds) for name, seconds in found.items()}


EXPLAINED = (
    "turn: rudder 35 deg to starboard, figure: tactical diameter; zigzag: 20/20, figure: second overshoot",
    f"equal accuracy: the coarsest setting from which on every finer one moves the figure by less than {ACCURACY:.2%}",
    "  (a step half, a tolerance a tenth of the one before); without one: the finest setting that was tried",
    "off: distance of the figure from that of the finest setting that was tried, or from a reference: the same ship,",
    "  a call for each leg, ended by an event at a tight tolerance; the finest setting itself may be far from it",
    "us/s, us/eval: us of one core for each simulated second, and for each evaluation of the equations of motion",
    "ratio: time over tank2sim's at the same manoeuvre and kind of setting, and of the same ship where both have her",
    "ship, model: figures of one ship with one model are to agree; KVLCC2 by MMG and by Abkowitz are two models of her",
    "  from different tests, whose figures differ whatever the accuracy",
)
"""What the columns of the table are, as it is printed."""


def show(rows: Sequence[Row], ready: dict[str, float]) -> None:
    """Print both tables, and what their columns are."""
    print(f"\n{'set-up in a fresh Python':34}{'core s':>8}{'ratio':>8}")
    for name, seconds in ready.items():
        print(f"{name:34}{seconds:8.2f}{seconds / ready['tank2sim']:8.2f}")
    print(
        f"\n{'library':12}{'ship, model':22}{'600 s':8}{'at':30}{'setting':20}{'figure':>11}{'off':>19}"
        f"{'us/s':>9}{'us/eval':>9}{'ratio':>9}"
    )
    for row in rows:
        each = "" if row.us_per_evaluation is None else f"{row.us_per_evaluation:.3g}"
        unit = "m" if row.manoeuvre == "turn" else "deg"
        print(
            f"{row.library:12}{row.ship:22}{row.manoeuvre:8}{row.level:30}{row.setting:20}{row.figure:7.5g} {unit:3}"
            f"{100 * row.change:8.4f} % {row.against:9}{row.us_per_s:9.3g}{each:>9}{row.times_ours:9.3g}"
        )
    print("", *EXPLAINED, sep="\n")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=11, help="how often each is timed")
    parser.add_argument("--json", type=Path, help="write the figures here too")
    chosen = parser.parse_args(arguments)
    print(f"Python {platform.python_version()}, {platform.machine()}; tank2sim {version('tank2sim')}")
    cases, libraries = ours(), ["tank2sim"]
    for peer, of_peer in PEERS.items():
        if reason := reason_to_skip(peer):
            print(f"{peer}: skipped, {reason}")
            continue
        print(f"{peer}: {PACKAGES[peer]} {version(PACKAGES[peer])}")
        cases += of_peer()
        libraries.append(peer)
    rows, ready = measured(cases, chosen.rounds), setups(libraries, min(SETUPS, chosen.rounds))
    show(rows, ready)
    print("\nwhat each has:", *(f"  {name}: {CAN[name]}" for name in libraries), sep="\n")
    print("not compared:", *(f"  {name}: {reason}" for name, reason in NOT_COMPARED.items()), sep="\n")
    if chosen.json:
        write_whole(chosen.json, json.dumps({"rows": [asdict(row) for row in rows], "set_up_s": ready}, indent=1))


if __name__ == "__main__":
    main()
