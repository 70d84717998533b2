"""Seconds for the influence coefficients of 60 parameters on 5 figures: exact slopes and 10 % differences together.

The Mariner with steering gear, propulsion and the effects below has 60 parameters. Prints the time with nothing
compiled before, and again; and the tuning of three figures by the fewest and by the most uncertain parameters.
"""

from __future__ import annotations

import os
import tempfile
import time

from tank2sim.analysis.influence.card_influence import InfluenceStudy, influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import FEWEST, UNCERTAIN, Means
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.cards import ManoeuvringCard, parse_card, read_card

FIGURES = ("criterion_C", "steady_radius_m@20", "advance_m@35", "tactical_diameter_m@35", "overshoot_1_deg@20/20")

MORE = """
[propulsion]
nominal_rpm = 84.0
Xnn = 77e-5

[[effects]]
name = "cross_flow_drag"
[effects.parameters]
drag_coefficient = 0.1

[[effects]]
name = "rudder_slipstream"
[effects.parameters]
gain = 0.1

[[effects]]
name = "hull_fouling"
[effects.parameters]
X_prime = -1e-4

[[effects]]
name = "current"
[effects.parameters]
speed_mps = 0.3
direction_deg = 60.0

[[effects]]
name = "propeller_side_force"
[effects.parameters]
Y_prime = 1e-5
N_prime = -1e-5

[[effects]]
name = "rudder_bias"
[effects.parameters]
angle_deg = 0.5
"""

WISHES = ("steady_radius_m@20=620", "overshoot_1_deg@20/20<=7.7", "advance_m@35=575")


def ship() -> ManoeuvringCard:
    card = parse_card(read_card("mariner").text + MORE, "mariner with effects")
    assert isinstance(card, ManoeuvringCard)
    return card


def timed() -> tuple[float, InfluenceStudy]:
    begin = time.perf_counter()
    result = influence(Study(ship(), [parse_figure(text) for text in FIGURES]))
    return time.perf_counter() - begin, result


def main() -> None:
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        first, result = timed()
        again, _ = timed()
        print(f"{len(result.parameters)} parameters on {len(FIGURES)} figures, slopes and 10 % differences (aim: 5 s)")
        print(f"nothing compiled before: {first:5.2f} s")
        print(f"again:                   {again:5.2f} s")
        wishes = [parse_target(text) for text in WISHES]
        for by in (FEWEST, UNCERTAIN):
            begin = time.perf_counter()
            found = tune(Study(read_card_of_the_mariner(), [wish.figure for wish in wishes]), wishes, Means(by=by))
            seconds = time.perf_counter() - begin
            told = f"{len(found.parameters)} moved, reached {found.reached}"
            print(f"tuning {len(wishes)} figures, {by}: {seconds:.1f} s, {told}")


def read_card_of_the_mariner() -> ManoeuvringCard:
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    return card


if __name__ == "__main__":
    main()
