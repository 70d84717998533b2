"""Effects on cards that state no more than a length: estimates, and that they are reported."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.particulars import model_particular

from .ships import MASS, STATES, TYPICAL, WAVES, L, card_with, forces, mariner_text, ship

OPTIONAL = (
    *("beam_m", "draught_m", "block_coefficient", "projected_area_front_m2", "projected_area_side_m2"),
    *("projected_area", "water_depth_m", "metacentric_height_m"),
)
MINIMAL = mariner_text(**dict.fromkeys(OPTIONAL, "")).split("[propulsion]")[0]
BEAM, DRAUGHT = L / 7, L / 17.5
BLOCK = 0.5 * MASS * L**2 / (BEAM * DRAUGHT)


@pytest.mark.slow
def test_every_effect_that_needs_no_engine_is_on_a_minimal_card() -> None:
    for name in EFFECTS:
        if name not in (
            "propeller_walk",
            "engine_lag",
            "engine_telegraph",
            "astern_thrust",
            "propeller_astern",
            "twin_orders",
            "controllable_pitch",
        ):
            assert np.all(np.isfinite(forces(ship({name: TYPICAL[name]}, MINIMAL + WAVES), STATES[0])))
    card = card_with(text=MINIMAL)
    assert all(
        effect.tried(card)
        for name, effect in EFFECTS.items()
        if effect.sought and name not in ("water_depth", "engine_lag")
    )


@pytest.mark.parametrize(
    ("name", "stated"),
    [
        ("wind", {"projected_area_front_m2": 0.6 * BEAM**2, "projected_area_side_m2": 0.055 * L**2}),
        ("wave_drift", {"beam_m": BEAM}),
        ("cross_flow_drag", {"draught_m": DRAUGHT}),
        ("trim", {"draught_m": DRAUGHT}),
        ("water_depth", {"beam_m": BEAM, "draught_m": DRAUGHT, "block_coefficient": BLOCK}),
    ],
)
def test_an_estimate_is_reported_with_its_number_and_acts_as_if_stated(name: str, stated: dict[str, float]) -> None:
    more = "".join(f"{key} = {value!r}\n" for key, value in stated.items())
    known = ship({name: TYPICAL[name]}, MINIMAL.replace("[ship]\n", f"[ship]\n{more}"))
    guessed = ship({name: TYPICAL[name]}, MINIMAL)
    at = {**STATES[0], "motion.psi": 0.4}
    np.testing.assert_allclose(forces(guessed, at), forces(known, at), rtol=1e-12)
    reported = [notice for notice in guessed.notices if notice not in known.notices]
    assert len(reported) == len(stated)
    for notice, (key, value) in zip(reported, stated.items(), strict=True):
        assert key in notice and "typical" in notice
        assert float(re.search(r" as ([\d.e+]+)", notice)[1]) == pytest.approx(value, rel=5e-3)


def test_an_estimate_is_reported_once() -> None:
    model = ship({"cross_flow_drag": TYPICAL["cross_flow_drag"], "trim": TYPICAL["trim"]}, MINIMAL)
    assert len([notice for notice in model.notices if "draught_m" in notice]) == 1


def test_estimates_go_by_what_the_card_states() -> None:
    card = card_with(text=MINIMAL.replace("[ship]\n", "[ship]\nbeam_m = 30.0\n"))
    assert model_particular(card, "draught_m") == pytest.approx(12.0)
    assert model_particular(card, "projected_area_front_m2") == pytest.approx(540.0)
    # the Mariner's own dimensions and mass give the fullness of a cargo liner
    assert model_particular(card_with(text=mariner_text(block_coefficient="")), "block_coefficient") == pytest.approx(
        0.6, abs=0.03
    )


def test_wind_coefficients_are_less_certain_on_estimated_areas() -> None:
    known, guessed = card_with(), card_with(text=MINIMAL)
    spreads = {one.name: one for one in EFFECTS["wind"].parameters}
    for name, value, error in (
        ("surge_coefficient", 0.7, 0.15),
        ("sway_coefficient", 0.8, 0.15),
        ("yaw_coefficient", 0.1, 0.05),
    ):
        assert spreads[name].spread_value(known) == error
        assert spreads[name].spread_value(guessed) == pytest.approx(np.sqrt(error**2 + (0.4 * value) ** 2))
