"""How well ships are guessed from dimensions and figures: made-up ships of five forms, and the bundled ships.

A made-up ship is drawn from the prior of its dimensions; its advance, tactical diameter and 10/10 overshoots are given
with errors drawn of their standard errors. Counted are the figures not given (transfer, 20/20 overshoots): how often
the interval of 90 % holds the true one, and how far the median is off. The bundled ships, whose hulls and models are no
draws of the prior, are given their own simulated figures at 35 deg of rudder and 10/10.

    python benchmarks/guess.py [--ships N] [--members N]
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.apps.guess.prior import ShipDimensions, prior_card
from tank2sim.apps.guess.study import (
    FIGURE_KEYS,
    POSTER_MANOEUVRES,
    GivenFigure,
    PosterFigures,
    conditioned,
    default_error,
)
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.run import simulate
from tank2sim.units import KNOT_MPS

FORMS = {
    "tanker": ShipDimensions(length_m=320, beam_m=58, draught_m=20.8, block=0.81, speed_kn=15.5),
    "container": ShipDimensions(length_m=280, beam_m=40, draught_m=13.5, block=0.62, speed_kn=20),
    "bulk carrier": ShipDimensions(length_m=180, beam_m=30, draught_m=10.5, block=0.80, speed_kn=14),
    "cargo": ShipDimensions(length_m=160, beam_m=23.2, draught_m=7.5, block=0.60, speed_kn=15),
    "ferry": ShipDimensions(length_m=150, beam_m=25, draught_m=6.5, block=0.56, speed_kn=18),
}
GIVEN = ("advance_m@35", "tactical_diameter_m@35", "overshoot_1_deg@10/10", "overshoot_2_deg@10/10")
BUNDLED = {"kvlcc2": 0.81, "mariner": 0.60, "esso-osaka-ship": 0.83}


def given_of(truth: dict[str, float], stream: np.random.Generator | None) -> list[GivenFigure]:
    found = []
    for key in GIVEN:
        manoeuvre, name = FIGURE_KEYS[key]
        error = default_error(name, truth[key])
        noise = 0.0 if stream is None else float(stream.normal()) * error
        found.append(GivenFigure(manoeuvre, name, max(truth[key] + noise, 0.2 * truth[key]), error))
    return found


def truths(card: ManoeuvringCard, count: int) -> list[dict[str, float]]:
    draws, _ = draws_of(card, 987)
    values = np.array([list(draws.member(number).values()) for number in range(3 * count)])
    figures = PosterFigures(card, draws.names).at(values)
    rows = [{key: float(column[row]) for key, column in figures.items()} for row in range(len(values))]
    return [row for row in rows if all(math.isfinite(value) and value > 0 for value in row.values())][:count]


def bundled(name: str) -> tuple[ShipDimensions, dict[str, float]]:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    model, figures = build(card), {}
    for manoeuvre, driven in POSTER_MANOEUVRES.items():
        run = single_figures(simulate(model, driven).figures)
        for key, (of, figure) in FIGURE_KEYS.items():
            if of == manoeuvre:
                figures[key] = run[figure]
    size = {key: float(getattr(card.ship, key)) for key in ("length_m", "beam_m", "draught_m")}
    return ShipDimensions(**size, block=BUNDLED[name], speed_kn=card.model.speed_mps / KNOT_MPS), figures


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--ships", type=int, default=8)
    parser.add_argument("--members", type=int, default=800)
    asked = parser.parse_args()
    inside: dict[str, list[bool]] = {key: [] for key in FIGURE_KEYS}
    off: dict[str, list[float]] = {key: [] for key in FIGURE_KEYS}
    refused = 0
    for form, ship in FORMS.items():
        card, stream = prior_card(ship, form), np.random.default_rng(5)
        for truth in truths(card, asked.ships):
            try:
                found = conditioned(card, given_of(truth, stream), asked.members, 1)
            except InputError:
                refused += 1
                continue
            for key, values in found.after.items():
                low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
                inside[key].append(bool(low <= truth[key] <= high))
                off[key].append(middle / truth[key] - 1)
    print(f"{len(FORMS)} forms, {asked.ships} ships each, {asked.members} members; refused {refused}")
    for key in FIGURE_KEYS:
        words = "given" if key in GIVEN else "not given"
        share, error = 100 * np.mean(inside[key]), 100 * np.sqrt(np.mean(np.square(off[key])))
        print(f"  {key:27} {words:9} {share:5.1f} % in the interval of 90 %, median off by {error:.1f} % rms")
    for name in BUNDLED:
        ship, truth = bundled(name)
        try:
            found = conditioned(prior_card(ship, name), given_of(truth, None), asked.members, 1)
        except InputError as error:
            print(f"  {name}: {error}")
            continue
        parts = []
        for key, values in found.after.items():
            low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
            if key not in GIVEN:
                parts.append(f"{key} {truth[key]:.4g} ({middle:.4g}, {low:.4g} to {high:.4g})")
        print(f"  {name}: {'; '.join(parts)}")
    hidden = [value for key in FIGURE_KEYS if key not in GIVEN for value in inside[key]]
    print(f"figures not given: {100 * np.mean(hidden):.1f} % of {len(hidden)} in the interval of 90 %")
    return 0 if 0.8 <= np.mean(hidden) <= 0.97 else 1


if __name__ == "__main__":
    sys.exit(main())
