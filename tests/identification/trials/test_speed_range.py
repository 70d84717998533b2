"""The range of speeds of the trials is written on a card; the polynomial is used as far down as before."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.identification.trials.assessment.evaluation import comparison_windows
from tank2sim.identification.trials.identify import identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card

from .made_up_ship import CARD, LENGTH, SPEED, TRUTH, trial, turn, zigzag

OFF = {"Nd": 1.25, "Nr": 0.8, "Yv": 1.2, "Xu": 0.8}


def off_card(model: str = "") -> ManoeuvringCard:
    """The made-up ship's card with some derivatives off, all others certain, and more lines in its ``[model]``."""
    lines, errors = [], []
    for line in CARD.splitlines():
        name = line.partition(" = ")[0]
        lines.append(f"{name} = {TRUTH[name] * OFF[name]}" if name in OFF else line)
        if name in TRUTH:
            errors.append(f"{name} = {0.25 * abs(TRUTH[name]) if name in OFF else 0.0}")
    text = "\n".join([*lines, "[uncertainty]", *errors]).replace("[rigid_body]", f"{model}\n[rigid_body]")
    card = parse_card(text, "off.toml")
    assert isinstance(card, ManoeuvringCard)
    return card


@pytest.mark.slow
def test_a_turn_slower_than_the_trials_fitted_ends_where_the_ship_does() -> None:
    """The made-up ship's equations are its polynomial at all speeds."""
    fitted = trial(zigzag(15, 45.0), name="fitted", duration=220.0, step=0.5, noise=0.0)
    held = trial(turn(30), name="held", duration=400.0, step=0.5, noise=0.0)
    known = off_card()
    card = identify_trials(
        known, Measured((fitted,), "angle", ()), None, IdentificationOptions(method="equation_error")
    ).card
    slowest = card.model.speed_range_mps[0]
    assert slowest > fitted.signals["u_mps"].min() - 0.1, "the range is that of the trials"
    assert held.signals["u_mps"].min() < 0.8 * slowest, "the turn goes well below it"
    assert card.model.low_speed_bound_mps == known.model.low_speed_bound_mps == 0.5 * SPEED
    (passage,) = comparison_windows(problem_from_card(card, (held,), "angle", whole=True), card, (held,), {})
    inside = (held.time_s > passage.model_time_s[0]) & (held.time_s < passage.model_time_s[-1])
    apart = [
        np.interp(held.time_s, passage.model_time_s, passage.simulated[f"motion.{axis}"]) - held.signals[f"{axis}_m"]
        for axis in "xy"
    ]
    assert np.hypot(*apart)[inside].max() < 0.05 * LENGTH
    assert parse_card(card.text, "again.toml").model == card.model


@pytest.mark.slow
def test_the_range_is_written_in_the_units_of_the_card() -> None:
    """Whatever its comments speak of."""
    turned = trial(turn(30), name="turned", duration=220.0, step=0.5, noise=0.0)
    stated = "# once: valid_drift_rad = 0.02\nvalid_drift_deg = 1.0\nvalid_rudder_rad = 0.1\nlow_speed_below_mps = 2.0"
    known = off_card(stated)
    card = identify_trials(
        known, Measured((turned,), "angle", ()), None, IdentificationOptions(method="equation_error")
    ).card
    drift = np.arctan2(np.abs(turned.signals["v_mps"]), turned.signals["u_mps"]).max()
    assert card.model.valid_drift_rad == pytest.approx(drift, rel=0.05)
    assert card.model.valid_rudder_rad == pytest.approx(np.deg2rad(30.0), rel=0.01)
    written = tomllib.loads(card.text)["model"]
    assert {"valid_drift_deg", "valid_rudder_rad", "low_speed_below_mps"} < set(written)
    assert not {"valid_drift_rad", "valid_rudder_deg"} & set(written)
    assert card.model.low_speed_bound_mps == known.model.low_speed_bound_mps == 2.0
