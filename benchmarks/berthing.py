"""Berthing of the 3 m Esso Osaka model: median position error 100 s after a measured state, over the length.

The card is identified here from turns and zigzags, in which no propeller turns astern: with the thrust astern as the
mirror of that ahead, with the share of it that is published of this ship, with its published thrust and side force
astern by the advance ratio (as the bundled cards have it), and with the forces at low speed up to 0.9 of u0 as well. Or
it is the one that is given. The
measured rudder, revolutions and wind are its inputs; each window starts in the measured state. Needs the data folder.

At the end, where the error comes from: median errors after 20 s with the propeller astern and ahead, and a propeller
walk and share of the thrust astern that are fitted to two of the runs (errors after 20 s) and tried on the third.

``python benchmarks/berthing.py [CARD ...]``
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import tomlkit

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
SHORT_S = 20.0
START, STEPS = np.array([0.0, 0.0, ASTERN_THRUST]), np.array([-2e-3, 1e-3, -0.1])
"""Y' and N' of the walk and the share astern where the fit begins, and the steps of its slopes."""


def at(trial: Trial, name: str, time: float) -> float:
    """A signal at a time: the mean over a second, but the rudder and revolutions as they are."""
    values = trial.signals[name]
    if name in ("delta_rad", "n_radps"):
        return float(np.interp(time, trial.time_s, values))
    near = np.abs(trial.time_s - time) <= SMOOTHED_S / 2
    if name == "wind_direction_rad":
        return float(np.angle(np.nanmean(np.exp(1j * values[near]))))
    return float(np.nanmean(values[near]))


def windows(ship: t2s.Ship, trial: Trial, duration: float) -> Iterator[tuple[float, dict[str, float], Running]]:
    """Begin of each window, the measured state there, and the run of the model at its end."""
    integrator = Integrator(ship.model)
    orders_of = [integrator.model[name] for name in ("rudder.command", "propeller.speed")]
    limits = [order.accepted_range for order in orders_of if isinstance(order, Input)]
    for begin in np.arange(0.0, trial.time_s[-1] - duration, STRIDE_S):
        first = {name: at(trial, name, begin) for name in STATES}
        start = {f"initial.{state}": first[name] for name, state in STATES.items()}
        start["initial.rudder_angle"] = at(trial, "delta_rad", begin)
        running = Running(integrator, {}, start)
        for time in np.arange(begin, begin + duration, STEP_S):
            orders = [at(trial, name, time + STEP_S / 2) for name in ("delta_rad", "n_radps")]
            rudder, revolutions = (float(np.clip(order, *limit)) for order, limit in zip(orders, limits, strict=True))
            inputs = {"rudder.command": rudder, "propeller.speed": revolutions}
            if "wind.speed" in integrator.model:
                inputs["wind.speed"] = at(trial, "wind_speed_mps", time)
                inputs["wind.direction"] = at(trial, "wind_direction_rad", time)
            running.order(inputs)
            running.run(STEP_S)
        yield float(begin), first, running


def errors(ship: t2s.Ship, trial: Trial) -> Iterator[tuple[float, float]]:
    """Position error after each window, in lengths: of the model, and of a ship that keeps its first velocity."""
    length = ship.manoeuvring().ship.length_m
    for begin, first, running in windows(ship, trial, WINDOW_S):
        reached = complex(running.state("motion.x"), running.state("motion.y"))
        truth = complex(at(trial, "x_m", begin + WINDOW_S), at(trial, "y_m", begin + WINDOW_S))
        velocity = complex(first["u_mps"], first["v_mps"]) * np.exp(1j * first["psi_rad"])
        straight = complex(first["x_m"], first["y_m"]) + velocity * WINDOW_S
        yield abs(reached - truth) / length, abs(straight - truth) / length


def short_errors(ship: t2s.Ship, trial: Trial) -> np.ndarray:
    """After 20 s, (n, 6): errors of x, y (lengths), heading (rad), u (m/s), r (rad/s), and mean revolutions (1/s)."""
    length, found = ship.manoeuvring().ship.length_m, []
    for begin, _, running in windows(ship, trial, SHORT_S):
        end = begin + SHORT_S
        x, y, psi, u, r = (
            running.state(f"motion.{STATES[name]}") - at(trial, name, end)
            for name in ("x_m", "y_m", "psi_rad", "u_mps", "r_radps")
        )
        turning = np.mean([at(trial, "n_radps", time) for time in np.arange(begin, end, STEP_S)]) / (2 * np.pi)
        found.append([x / length, y / length, (psi + np.pi) % (2 * np.pi) - np.pi, u, r, turning])
    return np.array(found)


def print_causes(ship: t2s.Ship, trials: list[Trial]) -> None:
    """Print errors after 20 s, and what a propeller walk fitted to other runs does to each; `ship` has none."""

    def with_walk(values: np.ndarray) -> t2s.Ship:
        Y, N, factor = map(float, values)
        thrust = EffectEntry(name="astern_thrust", parameters={"factor": factor})
        return with_astern(ship, thrust, EffectEntry(name="propeller_walk", parameters={"Y_prime": Y, "N_prime": N}))

    first = [short_errors(with_walk(START), trial) for trial in trials]
    every = np.concatenate(first)
    print(f"errors after {SHORT_S:g} s with the thrust astern as published, model less measured, medians:")
    for words, chosen in (("astern", every[:, 5] < -1), ("ahead", every[:, 5] > 1)):
        u, r, psi = np.median(every[chosen][:, [3, 4, 2]], axis=0)
        turned = f"r {np.degrees(r):+.2f} deg/s, heading {np.degrees(psi):+.1f} deg"
        print(f"  propeller {words}, {chosen.sum()} windows: u {u:+.3f} m/s, {turned}")
    slopes = [
        np.stack(
            [
                (short_errors(with_walk(START + step), trial)[:, :3] - before[:, :3]).ravel() / STEPS[place]
                for place, step in enumerate(np.diag(STEPS))
            ],
            axis=1,
        )
        for trial, before in zip(trials, first, strict=True)
    ]
    held_out = []
    for left, trial in enumerate(trials):
        others = [place for place in range(len(trials)) if place != left]
        slope = np.concatenate([slopes[place] for place in others]) * np.abs(STEPS)
        missed = np.concatenate([first[place][:, :3].ravel() for place in others])
        fitted = START + np.linalg.lstsq(slope, -missed, rcond=None)[0] * np.abs(STEPS)
        held_out.append(np.array(list(errors(with_walk(fitted), trial)))[:, 0])
        Y, N, factor = fitted
        print(f"  without run {left + 1}: Y' {Y:.1e}, N' {N:.2e}, share astern {factor:.2f}; its", end=" ")
        print(f"error after {WINDOW_S:g} s {np.median(held_out[-1]):.2f} L")
    print(f"  median of held-out windows {np.median(np.concatenate(held_out)):.2f} L")


ASTERN_EFFECTS = {"propeller_astern", "astern_thrust"}
"""Effects of the bundled cards that act with the propeller astern alone."""


def identified(low_speed_mps: float | None = None, kinds: Sequence[str] = ("turning", "zigzag")) -> t2s.Ship:
    """The card of these kinds of runs, from the one that was estimated before any trial, or from that with another
    bound of the forces at low speed (m/s)."""
    folder = DATA / "esso_osaka"
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "ship.toml"
        content = tomlkit.parse(t2s.load("esso-osaka-estimated").manoeuvring().text)
        if low_speed_mps is not None:
            content["model"]["low_speed_below_mps"] = low_speed_mps
        path.write_text(tomlkit.dumps(content), encoding="utf-8")
        return t2s.identify(path, [file for kind in kinds for file in folder.glob(f"{kind}/*.csv")]).ship


def with_astern(ship: t2s.Ship, *astern: EffectEntry, low_speed_mps: float | None = None) -> t2s.Ship:
    """The ship with these effects astern in place of its own, and another bound of the forces at low speed (m/s)."""
    card = ship.manoeuvring()
    changed = {} if low_speed_mps is None else {"low_speed_below_mps": low_speed_mps}
    others = tuple(entry for entry in card.effects if entry.name not in ASTERN_EFFECTS)
    return t2s.Ship(replace(card, model=card.model.model_copy(update=changed), effects=(*others, *astern)))


def main() -> None:
    """Print the median position error of each run and of all."""
    paths = sorted((DATA / "esso_osaka_berthing").glob("*.csv"))
    if not paths:
        sys.exit(f"needs {DATA / 'esso_osaka_berthing'} (set TANK2SIM_DATA)")
    if names := sys.argv[1:]:
        cards = {name: t2s.load(name) for name in names}
    else:
        ship = identified()
        share = EffectEntry(name="astern_thrust", parameters={"factor": ASTERN_THRUST})
        published = EffectEntry(name="propeller_astern", parameters={"side_force": 1.0})
        cards = {
            "thrust astern as ahead": with_astern(ship),
            "thrust astern as published": with_astern(ship, share),
            "thrust and side force astern as published": with_astern(ship, published),
            "the same, forces at low speed below 0.28 m/s": with_astern(ship, published, low_speed_mps=0.28),
            "the same, identified so": with_astern(identified(0.28), published),
            "as published, identified from random runs as well": with_astern(
                identified(kinds=("turning", "zigzag", "random")), published
            ),
        }
    trials = [read_trial_file(path) for path in paths]
    for name, ship in cards.items():
        print(name)
        found = [np.array(list(errors(ship, trial))) for trial in trials]
        for path, run in zip(paths, found, strict=True):
            print(f"  {path.stem}: {len(run)} windows, {np.median(run[:, 0]):.2f} L")
        model, straight = np.median(np.concatenate(found), axis=0)
        print(f"  median position error after {WINDOW_S:g} s {model:.2f} L, first velocity kept {straight:.2f} L")
    if not names:
        print_causes(cards["thrust astern as ahead"], trials)


if __name__ == "__main__":
    main()
