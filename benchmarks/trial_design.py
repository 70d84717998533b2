"""Designed sea trials of bundled ships, made up and identified: is the certainty of the figures as predicted, and what
time is saved against the usual set?

The true ship has every derivative off by a draw of 5 %, which is what the card states as its standard errors. The
shortest plan that is predicted to be as certain as the usual set (turns with 35 deg to both sides, zigzags 10/10 and
20/20), or the plan of the same time where none is shorter, and the usual set itself are simulated with the true ship,
read with white noise once a second, under constant forces as of a quarter of a degree of rudder, and fitted by
``identify`` from the card; the figures of the ships found are compared with those of the true one.

    python benchmarks/trial_design.py [DRAWS]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.apps.design.figure_slopes import both_sides
from tank2sim.apps.design.trial_design import TrialManoeuvre
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance import not_referring
from tank2sim.cards.reading import revised
from tank2sim.errors import InputError

SHIPS = ("mariner", "esso-osaka", "kvlcc2-captive")
FIGURES = ("advance_m@35", "tactical_diameter_m@35", "overshoot_1_deg@10/10", "overshoot_1_deg@20/20")
OFF = 0.05
NOISE = {"u_mps": 0.05, "v_mps": 0.05, "r_degps": 0.02, "psi_deg": 0.2, "x_m": 1.0, "y_m": 1.0}
"""Of a ship; a model of a few metres has a hundredth of the lengths, a tenth of the speeds and ten times
the rates."""


def _noise(card: ManoeuvringCard) -> dict[str, float]:
    if card.ship.length_m > 10:
        return NOISE
    factors = {"u_mps": 0.1, "v_mps": 0.1, "r_degps": 10.0, "psi_deg": 1.0, "x_m": 0.01, "y_m": 0.01}
    return {column: size * factors[column] for column, size in NOISE.items()}


def main() -> int:
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    for name in SHIPS:
        began = time.perf_counter()
        card = parse_card(not_referring(read_card(name).text), name)  # without its covariance
        assert isinstance(card, ManoeuvringCard)
        free = {key: value for key, value in card.derivatives.items() if value and not key.endswith("dot")}
        card = revised(card, {key: (value, OFF * abs(value)) for key, value in free.items()})
        first = t2s.design_trial(card, figures=FIGURES, sensors=_noise(card))
        needed = first.design.minutes_needed
        plan = (
            first
            if needed is None
            else t2s.design_trial(card, figures=FIGURES, sensors=_noise(card), minutes=needed + 0.01)
        )
        manoeuvres = {
            "plan": [each for each, repeats in plan.design.manoeuvres for _ in range(repeats)],
            "usual": list(first.design.usual),
        }
        errors: dict[str, list[np.ndarray]] = {"plan": [], "usual": []}
        for seed in range(draws):
            draw = np.random.default_rng([seed, 17])
            true = revised(
                card, {key: (value * (1 + OFF * draw.standard_normal()), 0.0) for key, value in free.items()}
            )
            try:
                both = {kind: _errors(card, true, each, draw) for kind, each in manoeuvres.items()}
            except InputError as fault:
                print(f"  {name}, draw {seed}: left out, {fault}")
                continue
            for kind, value in both.items():
                errors[kind].append(value)
        predicted = {"plan": plan.design.standard_errors, "usual": first.design.usual_standard_errors}
        share = 1.0 if needed is None else needed / first.design.minutes
        print(
            f"{name}: {len(manoeuvres['plan'])} manoeuvres, {plan.design.minutes_used:.3g} min against "
            f"{first.design.minutes:.3g} min of the usual set "
            f"({'no shorter plan' if needed is None else f'{100 * share:.0f} %'})"
        )
        rms = {kind: np.sqrt(np.mean(np.square(values), axis=0)) for kind, values in errors.items()}
        for row, figure in enumerate(FIGURES):
            print(
                f"  {figure:24s} before {plan.design.prior_errors[row]:.3g}; predicted {predicted['plan'][row]:.3g} "
                f"and {predicted['usual'][row]:.3g}; rms error {rms['plan'][row]:.3g} and {rms['usual'][row]:.3g}"
            )
        plan_ratio, usual_ratio = (
            np.sqrt(np.mean(np.square(np.array(errors[kind]) / predicted[kind]))) for kind in ("plan", "usual")
        )
        print(f"  errors over those predicted, rms: plan {plan_ratio:.2g}, usual set {usual_ratio:.2g}")
        print(f"  {time.perf_counter() - began:.0f} s", flush=True)
    return 0


def _errors(
    card: ManoeuvringCard, true: ManoeuvringCard, manoeuvres: Sequence[TrialManoeuvre], draw: np.random.Generator
) -> np.ndarray:
    """Errors of the figures of the ship that ``identify`` finds from made-up trials of the true one."""
    ship = t2s.Ship(true)
    with tempfile.TemporaryDirectory() as name:
        folder, files = Path(name), []
        for number, each in enumerate(manoeuvres):
            (folder / "orders.csv").write_text(each.orders, encoding="utf-8")
            manoeuvre = each.manoeuvre or f"file:{folder / 'orders.csv'}"
            gusts = {name: size * draw.standard_normal() for name, size in _gusts(card).items()}
            frame = ship.simulate(manoeuvre, duration_s=each.duration_s, external=gusts).df
            times = np.arange(0.0, each.duration_s, 1.0)
            rows = {"t_s": times, "delta_order_deg": _held(times, frame), "delta_deg": _at(times, frame, "delta_deg")}
            for column, size in _noise(card).items():
                rows[column] = _at(times, frame, column) + size * draw.standard_normal(len(times))
            files.append(folder / f"trial_{number}.csv")
            table = np.column_stack(list(rows.values()))
            np.savetxt(files[-1], table, fmt="%.8g", delimiter=",", header=",".join(rows), comments="")
        found = t2s.identify(card, files, structure="card", members=0, trust_card=True).card
    assert isinstance(found, ManoeuvringCard)
    sides = [side for text in FIGURES for side in both_sides(parse_figure(text))]
    difference = Study(found, sides).base - Study(true, sides).base
    mean: np.ndarray = difference.reshape(len(FIGURES), 2).mean(axis=1)
    return mean


def _gusts(card: ManoeuvringCard) -> dict[str, float]:
    """Standard deviations of constant forces (N) and of the moment (N m): those of 0.25 deg of rudder."""
    speed, length = card.model.speed_mps, card.ship.length_m
    force = 0.5 * card.environment.water_density_kgpm3 * length**2 * speed**2 * np.radians(0.25)
    sway, yaw = abs(card.derivatives["Yd"]) * force, abs(card.derivatives["Nd"]) * force * length
    return {"X": sway, "Y": sway, "N": yaw}


def _at(times: np.ndarray, frame: object, column: str) -> np.ndarray:
    return np.interp(times, frame["t_s"], frame[column])  # type: ignore[index]


def _held(times: np.ndarray, frame: object) -> np.ndarray:
    """The order in force at each time."""
    place = np.searchsorted(frame["t_s"], times, side="right") - 1  # type: ignore[index]
    return np.asarray(frame["delta_order_deg"])[place]  # type: ignore[index]


if __name__ == "__main__":
    sys.exit(main())
