"""A pull-out ends on a straight course if the ship is stable, whatever asymmetry it has."""

from __future__ import annotations

import math

import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate


@pytest.mark.parametrize("side", [20, -20])
def test_a_stable_ship_with_a_neutral_rudder_off_zero_keeps_no_yaw_rate(side: int) -> None:
    card = read_card("mariner")  # stable; Y0 and N0 are not zero
    run = simulate(build(card), parse_manoeuvre(f"pullout:{side}"))
    # N and Y of v and the rudder vanish with r = 0: from the linear terms of the card, rudder to starboard
    d = card.derivatives
    determinant = d["Yv"] * d["Nd"] - d["Nv"] * d["Yd"]
    neutral = (d["Nv"] * d["Y0"] - d["Yv"] * d["N0"]) / determinant
    assert run.figures["neutral_rudder_deg"] == pytest.approx(math.degrees(neutral), abs=0.02)
    assert abs(run.figures["neutral_rudder_deg"]) > 0.5
    assert abs(run.figures["residual_rate_degps"]) < 0.01 * abs(run.figures["steady_rate_degps"])


def test_an_unstable_ship_keeps_turning_to_its_side() -> None:
    model = build(read_card("kvlcc2-captive"))
    left, right = (simulate(model, parse_manoeuvre(f"pullout:{side}")).figures for side in (-20, 20))
    assert right["residual_rate_degps"] > 0.1 and left["residual_rate_degps"] < -0.1
    assert right["neutral_rudder_deg"] == pytest.approx(left["neutral_rudder_deg"])
