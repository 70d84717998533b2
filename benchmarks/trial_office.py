"""How well ``trials`` predicts full load: made-up ships in ballast, in wind and current, with errors of the card.

``python benchmarks/trial_office.py --ships 30`` prints for the Mariner and the KVLCC2 (MMG) the median error of each
figure as run, by plain R = T F/B with current and wind in T, and of the report, and how often its 95 % intervals hold.
``--hidden-loading`` prints the same in calm water for other hidden errors: four coefficients 4 to 10 % off, to either
side, Yv and Nr in ballast another 6 to 8 %, and the KVLCC2 in 0.6 draughts with 3 m of trim.
Then FS Bitumen No. 1 (trial of 2014, full load): its 20/20 zigzags as ``guess`` predicts them from its turns and 10/10.
With the measured turns of the Esso Osaka model (``TANK2SIM_DATA``) it prints their scatter before and after correction.

The truth: six coefficients 6 % off (one standard deviation) from the card that the office has, Yv and Nr in ballast
another 7 %; ballast of 0.7 draughts and 1.2 m of trim (Mariner), 0.65 and 2 m (KVLCC2); 8 m/s of wind and 0.5 m/s of
current from any direction; records at 1 Hz with noise of 1 m, 0.1 deg, 0.05 m/s, 0.2 deg.
"""

from __future__ import annotations

import argparse
import math
import os
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.apps.trial_office.notes import TrialNotes
from tank2sim.apps.trial_office.study import study_trials
from tank2sim.cards import ManoeuvringCard
from tank2sim.cards.reading import revised
from tank2sim.dynamics import build
from tank2sim.gap.improve_card import add_effects_to_card
from tank2sim.records.trials import Trial
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running

BALLAST = {"mariner": (0.7, 1.2), "kvlcc2-mmg": (0.65, 2.0)}
HIDDEN = {"mariner": (0.7, 1.2), "kvlcc2-mmg": (0.6, 3.0)}
NOISE = {"x_m": 1.0, "y_m": 1.0, "psi_rad": math.radians(0.1), "u_mps": 0.05, "delta_rad": math.radians(0.2)}
APPROACH_S = 150.5
MANOEUVRES = {
    f"{name} {side}": made(sign)
    for side, sign in (("starboard", 1.0), ("port", -1.0))
    for name, made in {
        "turn": lambda sign: Turn(sign * math.radians(35)),
        "zigzag10": lambda sign: Zigzag(sign * math.radians(10), math.radians(10)),
        "zigzag20": lambda sign: Zigzag(sign * math.radians(20), math.radians(20)),
    }.items()
}


def perturbed(
    card: ManoeuvringCard, chance: np.random.Generator, share: float | tuple[float, float], *names: str
) -> ManoeuvringCard:
    """The card with other coefficients: normal with a standard deviation of `share`, or within two shares by size."""
    known = [name for name in names if name in card.derivatives]
    if isinstance(share, tuple):
        errors = chance.uniform(*share, len(known)) * chance.choice([-1.0, 1.0], len(known))
    else:
        errors = share * chance.standard_normal(len(known))
    values = {name: card.derivatives[name] * (1 + error) for name, error in zip(known, errors, strict=True)}
    return revised(card, {name: (value, 0.02 * abs(value)) for name, value in values.items()})


def record(
    card: ManoeuvringCard, name: str, current: np.ndarray, wind: tuple[float, float], chance: np.random.Generator
) -> Trial:
    """A record of a manoeuvre after an approach on a course that a helmsman keeps."""
    model, manoeuvre = build(card), MANOEUVRES[name]
    running = Running(Integrator(model), {"wind.speed": wind[0], "wind.direction": wind[1]})
    while running.time < APPROACH_S:
        helm = -running.state("motion.psi") - 20 * running.state("motion.r")
        running.order({"rudder.command": float(np.clip(helm, -0.2, 0.2))})
        running.run(0.5)
    if isinstance(manoeuvre, Turn):
        running.order({"rudder.command": manoeuvre.rudder})
        side = math.copysign(1.0, manoeuvre.rudder)
        goal = running.state("motion.psi") + side * math.radians(721.0)
        running.run_until("motion.psi", goal, rising=side > 0, at_most=4000.0)
    else:
        manoeuvre.drive(running, 1.0 + card.ship.length_m / card.model.speed_mps, None)
    run = running.trajectory()
    time = np.arange(0.0, run.t[-1])
    places = {
        "x_m": "motion.x",
        "y_m": "motion.y",
        "psi_rad": "motion.psi",
        "u_mps": "motion.u",
        "delta_rad": "rudder.angle",
    }
    signals = {key: np.interp(time, run.t, run[variable]) for key, variable in places.items()}
    for key, speed in zip(("x_m", "y_m"), current, strict=True):
        signals[key] = signals[key] + speed * time
    for key, size in NOISE.items():
        signals[key] = signals[key] + size * chance.standard_normal(len(time))
    before = np.searchsorted(run.t, time, side="right") - 1
    signals["delta_order_rad"] = run["rudder.command"][before]
    signals |= {"wind_speed_mps": np.full(len(time), wind[0]), "wind_direction_rad": np.full(len(time), wind[1])}
    return Trial(Path(f"{name}.csv"), time, signals)


def one_ship(name: str, number: int, *, hidden: bool) -> tuple[list[tuple[str, Mapping[str, float]]], float]:
    """Rows of a figure's true value, as run, by plain T F/B, in the report with its interval; error of the current."""
    chance = np.random.default_rng([number, len(name)])
    card = t2s.load(name).card
    assert isinstance(card, ManoeuvringCard)
    share, trim = (HIDDEN if hidden else BALLAST)[name]
    draught = share * card.ship.draught_m
    if hidden:
        truth = perturbed(card, chance, (0.04, 0.10), "Yv", "Yr", "Nv", "Nr")
    else:
        truth = perturbed(card, chance, 0.06, "Yv", "Yr", "Nv", "Nr", "Yd", "Nd")
    loaded = {"mean_draught_m": draught, "trim_m": trim}
    light = add_effects_to_card(truth, [("loading", loaded, {}), ("wind", {}, {})])
    ballast = perturbed(light, chance, (0.06, 0.08) if hidden else 0.07, "Yv", "Nr")
    towards, wind = chance.uniform(0, math.tau), (0.0 if hidden else 8.0, chance.uniform(0, math.tau))
    current = (0.0 if hidden else 0.5) * np.array([math.cos(towards), math.sin(towards)])
    records = [record(ballast, manoeuvre, current, wind, chance) for manoeuvre in MANOEUVRES]
    notes = TrialNotes(draught_fore_m=draught - trim / 2, draught_aft_m=draught + trim / 2)
    found, _, _ = study_trials(card, records, notes, 40)
    full, empty = build(card), build(add_effects_to_card(card, [("loading", loaded, {})]))
    rows = []
    model = build(truth)
    for trial in records:
        manoeuvre = MANOEUVRES[trial.name]
        true, after, before = (single_figures(simulate(one, manoeuvre).figures) for one in (model, full, empty))
        for figure in found.figures:
            if figure.trial != trial.name or figure.full_load is None or figure.name.startswith("time"):
                continue
            values = {
                "true": true[figure.name],
                "as run": figure.as_run,
                "plain": figure.as_run * after[figure.name] / before[figure.name],
                "report": figure.full_load,
                "low": figure.low,
                "high": figure.high,
            }
            kind = "" if trial.name.startswith("turn") else f"{trial.name.split()[0]} "
            rows.append((f"{kind}{figure.name}", values))
    assert found.current is not None
    return rows, float(np.hypot(*(found.current.vector - current)))


def measured_turns(folder: Path) -> None:
    """Scatter of the measured turns of the Esso Osaka model, as run and corrected."""
    found = t2s.trial_office(folder, ship="esso-osaka", members=0)
    groups = defaultdict(list)
    for one in found.study.figures:
        if one.name in ("advance_m", "tactical_diameter_m"):
            groups[one.name, one.side, one.manoeuvre].append((one.as_run, one.without_current, one.calm))
    for name in ("advance_m", "tactical_diameter_m"):
        pairs = np.array([np.array(rows) for (own, _, _), rows in groups.items() if own == name and len(rows) == 2])
        spread = np.sqrt(np.mean((pairs[:, 0] - pairs[:, 1]) ** 2, axis=0) / 2)
        print(f"Esso Osaka model, pairs of turns, {name}: deviation as run, without current, calm {spread.round(2)} m")


def published_ship() -> None:
    """20/20 overshoots of FS Bitumen No. 1 by its dimensions, turns and 10/10 zigzags (means of both sides)."""
    dimensions = {"length_m": 99.0, "beam_m": 18.0, "draught_m": 5.70, "block": 0.738, "speed_kn": 14.5}
    turn = "advance_m=275.5 tactical_diameter_m=308.4 transfer_m=166.3"
    found = t2s.guess(**dimensions, turn35=turn, zigzag10="overshoot_1_deg=6.95 overshoot_2_deg=10.65").figures
    for number, measured in ((1, (20.9, 19.2)), (2, (17.8, 19.4))):
        low, middle, high = (found.loc[f"overshoot_{number}_deg@20/20", key] for key in ("p5", "p50", "p95"))
        shown = f"{middle:.1f} deg, 90 % from {low:.1f} to {high:.1f}"
        print(f"FS Bitumen No. 1, 20/20 overshoot {number}: {shown}; measured {measured[0]} and {measured[1]}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--ships", type=int, default=30, help="made-up ships of each card")
    parser.add_argument("--hidden-loading", action="store_true", help="hidden errors alone, in calm water")
    asked = parser.parse_args()
    count = asked.ships
    for name in BALLAST:
        groups, currents = defaultdict(list), []
        for number in range(count):
            rows, error = one_ship(name, number, hidden=asked.hidden_loading)
            currents.append(error)
            for key, values in rows:
                groups[key].append(values)
        print(f"{name}: current, error in the median {np.median(currents):.4f} m/s, at most {np.max(currents):.4f}")
        every, pooled = [], []
        print("  median errors as run, by plain T F/B, and of the report:")
        for key, values in groups.items():
            true, *others = (
                np.array([one[field] for one in values]) for field in ("true", "as run", "plain", "report")
            )
            inside = [one["low"] <= one["true"] <= one["high"] for one in values]
            every += inside
            unit = 1.0 if key.endswith("deg") else 100 / true
            kind = "deg" if key.endswith("deg") else "%"
            away = [np.abs(other - true) * unit for other in others]
            pooled += [(kind, row) for row in zip(*away, strict=True)]
            errors = " ".join(f"{np.median(one):7.2f}" for one in away)
            print(f"  {key:34} {errors} {kind}; in the interval {100 * np.mean(inside):.0f} %")
        print(f"  all: in the interval {100 * np.mean(every):.0f} %")
        for kind in ("%", "deg"):
            chosen = np.array([row for unit, row in pooled if unit == kind])
            medians = " ".join(f"{value:7.2f}" for value in np.median(chosen, axis=0))
            print(f"  all in {kind:31} {medians} {kind}")
    published_ship()
    data = Path(os.environ.get("TANK2SIM_DATA", "../shared")) / "data" / "esso_osaka" / "turning"
    if data.is_dir():
        measured_turns(data)


if __name__ == "__main__":
    main()
