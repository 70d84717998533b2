"""A real craft from its logs to its card: runs of a BlueBoat (15 kg, two thrusters) that others measured.

The logs are read as they are: the channels are found in one of them and serve for all. Held out are three runs that
were chosen by their names before any fit: random steps (224), mixed (230), astern (233). Printed: what `tank2sim log`
finds, the seconds of each command, and R^2 of u, v, r of predictions of 30 s of the runs held out.

    python benchmarks/blueboat.py [--rotate]   # with --rotate three more choices of held-out runs

The logs are not in the checkout; the script reads them from TANK2SIM_DATA.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import tank2sim as t2s
from tank2sim.cards import parse_card
from tank2sim.errors import InputError

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data" / "blueboat"
HELD_OUT = ("224", "230", "233")
OTHERS_HELD_OUT = (("216", "222", "232"), ("218", "226", "234"), ("220", "221", "230"))
RUNS = ("216", "218", "220", "221", "222", "224", "226", "230", "232", "233", "234")
CHANNELS_FROM = "220"
"""The run that shows speed ahead and turns well."""

CARD = """format = "tank2sim-ship/1"
[ship]
name = "BlueBoat"
source = "mass and places of the thrusters by the maker; all else a guess"
length_m = 1.2
[model]
kind = "small_craft"
speed_mps = 1.5
[rigid_body]
mass = 15.0
yaw_inertia = 3.0
x_G = 0.0
[derivatives]
Xudot = -1.5
Yvdot = -10.0
Nrdot = -2.0
Xu = -5.0
Xuabsu = -10.0
Yv = -20.0
Yvabsv = -100.0
Nr = -3.0
Nrabsr = -5.0
"""
THRUSTER = """[[thrusters]]
name = "{name}"
y_m = {y_m}
ahead_Ns2 = 0.0005
astern_Ns2 = 0.00025
max_rpm = 3000
time_constant_s = 0.25
"""


def first_card() -> t2s.Ship:
    """The craft as one knows it before the runs."""
    thrusters = THRUSTER.format(name="port", y_m=-0.285) + THRUSTER.format(name="starboard", y_m=0.285)
    return t2s.Ship(parse_card(CARD + thrusters, "blueboat.toml"))


def main() -> None:
    """Print the figures."""
    if not DATA.is_dir():
        print(f"no logs in {DATA}")
        return
    with tempfile.TemporaryDirectory() as name:
        trials = cut_runs(Path(name))
        for held in (HELD_OUT, *(OTHERS_HELD_OUT if "--rotate" in sys.argv else ())):
            identified(trials, held)


def cut_runs(folder: Path) -> dict[str, list[Path]]:
    """The trials of each run, with the channels that one of them shows."""
    begin = time.perf_counter()
    found = t2s.log(DATA / f"fixed_00000{CHANNELS_FROM}.csv", folder / CHANNELS_FROM)
    print(f"log of {CHANNELS_FROM}: {time.perf_counter() - begin:.1f} s")
    for channel in found.voyage.channels.channels:
        if channel.use:
            print(f"  {channel.quantity}: {channel.sign:+d} {channel.stream}, zero {channel.offset:g}: {channel.why}")
    trials = {}
    for run in RUNS:
        if run != CHANNELS_FROM:
            channels = folder / CHANNELS_FROM / "channels.toml"
            t2s.log(DATA / f"fixed_00000{run}.csv", folder / run, channels=channels)
        trials[run] = sorted((folder / run).glob("*.csv"))
        print(f"  run {run}: {len(trials[run])} trials")
    return trials


def identified(trials: dict[str, list[Path]], held: tuple[str, ...]) -> None:
    """Print what is found without some runs, and how well these are predicted."""
    begin = time.perf_counter()
    fitted = [file for run, files in trials.items() if run not in held for file in files]
    try:
        result = t2s.identify(first_card(), fitted, holdout=[file for run in held for file in trials[run]])
    except InputError as error:
        print(f"without {', '.join(held)}, {time.perf_counter() - begin:.1f} s: {error}")
        return
    study = result.study
    print(
        f"identify without {', '.join(held)}, by {study.method}: {time.perf_counter() - begin:.1f} s; {study.compass}"
    )
    for name, entry in study.coefficients.items():
        print(f"  {name}: {entry.value:.4g} ± {entry.standard_error:.2g}, {entry.verdict}")
    print(f"R^2 over 30 s of {', '.join(held)}: {study.determination}")


if __name__ == "__main__":
    main()
