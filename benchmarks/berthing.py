"""Berthing of the 3 m Esso Osaka model: median position error 100 s after a measured state, over the length.

The card is identified here from turns and zigzags, in which no propeller turns astern: once with the thrust astern as
the mirror of that ahead, and once with the share that is published of this ship. Or it is the one that is given. The
measured rudder, revolutions and wind are its inputs; each window starts in the measured state. Needs the data folder.

``python benchmarks/berthing.py [CARD ...]``
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.cards.form import ASTERN_THRUST, EffectEntry
from tank2sim.dynamics.model import Input
from tank2sim.records.reading import read_trial_file
from tank2sim.records.trials import Trial
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[1] / ".." / "shared")) / "data"
WINDOW_S, STRIDE_S, STEP_S = 100.0, 10.0, 0.5
STATES = {"u_mps": "u", "v_mps": "v", "r_radps": "r", "psi_rad": "psi", "x_m": "x", "y_m": "y"}
SMOOTHED_S = 1.0


def at(trial: Trial, name: str, time: float) -> float:
    """A signal at a time: the mean over a second, but the rudder and revolutions as they are."""
    values = trial.signals[name]
    if name in ("delta_rad", "n_radps"):
        return float(np.interp(time, trial.time_s, values))
    near = np.abs(trial.time_s - time) <= SMOOTHED_S / 2
    if name == "wind_direction_rad":
        return float(np.angle(np.nanmean(np.exp(1j * values[near]))))
    return float(np.nanmean(values[near]))


def errors(ship: t2s.Ship, trial: Trial) -> Iterator[tuple[float, float]]:
    """Position error after each window, in lengths: of the model, and of a ship that keeps its first velocity."""
    integrator = Integrator(ship.model)
    length = ship.manoeuvring().ship.length_m
    orders_of = [integrator.model[name] for name in ("rudder.command", "propeller.speed")]
    limits = [order.accepted_range for order in orders_of if isinstance(order, Input)]
    for begin in np.arange(0.0, trial.time_s[-1] - WINDOW_S, STRIDE_S):
        first = {name: at(trial, name, begin) for name in STATES}
        start = {f"initial.{state}": first[name] for name, state in STATES.items()}
        start["initial.rudder_angle"] = at(trial, "delta_rad", begin)
        running = Running(integrator, {}, start)
        for time in np.arange(begin, begin + WINDOW_S, STEP_S):
            orders = [at(trial, name, time + STEP_S / 2) for name in ("delta_rad", "n_radps")]
            rudder, revolutions = (float(np.clip(order, *limit)) for order, limit in zip(orders, limits, strict=True))
            inputs = {"rudder.command": rudder, "propeller.speed": revolutions}
            if "wind.speed" in integrator.model:
                inputs["wind.speed"] = at(trial, "wind_speed_mps", time)
                inputs["wind.direction"] = at(trial, "wind_direction_rad", time)
            running.order(inputs)
            running.run(STEP_S)
        reached = complex(running.state("motion.x"), running.state("motion.y"))
        truth = complex(at(trial, "x_m", begin + WINDOW_S), at(trial, "y_m", begin + WINDOW_S))
        velocity = complex(first["u_mps"], first["v_mps"]) * np.exp(1j * first["psi_rad"])
        straight = complex(first["x_m"], first["y_m"]) + velocity * WINDOW_S
        yield abs(reached - truth) / length, abs(straight - truth) / length


def identified() -> t2s.Ship:
    """The card of turns and zigzags, from the one that was estimated before any trial."""
    folder = DATA / "esso_osaka"
    return t2s.identify("esso-osaka-estimated", [*folder.glob("turning/*.csv"), *folder.glob("zigzag/*.csv")]).ship


def with_published_astern(ship: t2s.Ship) -> t2s.Ship:
    """The ship with the thrust astern of Miyauchi et al. (2022)."""
    astern = EffectEntry(name="astern_thrust", parameters={"factor": ASTERN_THRUST})
    return t2s.Ship(replace(ship.manoeuvring(), effects=(*ship.manoeuvring().effects, astern)))


def main() -> None:
    """Print the median position error of each run and of all."""
    paths = sorted((DATA / "esso_osaka_berthing").glob("*.csv"))
    if not paths:
        sys.exit(f"needs {DATA / 'esso_osaka_berthing'} (set TANK2SIM_DATA)")
    if names := sys.argv[1:]:
        cards = {name: t2s.load(name) for name in names}
    else:
        ship = identified()
        cards = {"thrust astern as ahead": ship, "thrust astern as published": with_published_astern(ship)}
    trials = [read_trial_file(path) for path in paths]
    for name, ship in cards.items():
        print(name)
        found = [np.array(list(errors(ship, trial))) for trial in trials]
        for path, run in zip(paths, found, strict=True):
            print(f"  {path.stem}: {len(run)} windows, {np.median(run[:, 0]):.2f} L")
        model, straight = np.median(np.concatenate(found), axis=0)
        print(f"  median position error after {WINDOW_S:g} s {model:.2f} L, first velocity kept {straight:.2f} L")


if __name__ == "__main__":
    main()
