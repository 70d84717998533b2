"""The range of speeds of the trials on a card, and how far down its polynomial is used."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.covariance import Covariance
from tank2sim.dynamics import build
from tank2sim.identification.trials.assessment.evaluation import comparison_windows
from tank2sim.identification.trials.identify import identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    above_low_speed,
    lowered_bound_notice,
    polynomial_over_trials,
    problem_from_card,
    slowest_speed,
)
from tank2sim.records.trials import Trial

from .made_up_ship import CARD, LENGTH, SPEED, TRUTH, trial, turn, zigzag

MODELS = Path(__file__).parents[3] / "models"
SHIP_TIME_S = 160.93 / 7.7175


def card(**model: object) -> ManoeuvringCard:
    """The Mariner without a stated range, or with these keys of [model]."""
    text = (MODELS / "mariner" / "ship.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("valid_speed_mps", "low_speed_below_mps"))]
    place = lines.index("[model]") + 1
    lines[place:place] = [f"{key} = {value}" for key, value in model.items()]
    made = parse_card("\n".join(lines), "ship.toml")
    assert isinstance(made, ManoeuvringCard)
    return made


def slowing(lowest_mps: float, signals: tuple[str, ...] = ("u_mps", "v_mps")) -> Trial:
    """A run that slows from 7.7 m/s to its lowest speed on a straight line to the north-east."""
    time = np.arange(0.0, 600.0, 0.5)
    speed = lowest_mps + (7.7 - lowest_mps) * np.exp(-time / 60.0)
    way = np.concatenate([[0.0], np.cumsum(0.25 * (speed[1:] + speed[:-1]))])
    known = {"u_mps": speed, "v_mps": 0.0 * speed, "x_m": way / np.sqrt(2.0), "y_m": way / np.sqrt(2.0)}
    return Trial(Path("slowing.csv"), time, {name: known[name] for name in signals})


def test_the_bound_is_below_the_slowest_trial() -> None:
    lowered = polynomial_over_trials(card(), [slowing(3.0), slowing(2.6)])
    assert lowered.model.low_speed_bound_mps == pytest.approx(0.95 * 2.6, rel=0.01)
    assert lowered.model.valid_speed_mps is None  # what it is valid for is stated by nobody
    assert lowered_bound_notice(card(), lowered)


def test_a_lower_bound_leaves_the_covariance_as_it_is() -> None:
    known = Covariance(("derivatives.Yv", "derivatives.Nr"), np.diag([1e-8, 4e-10]), None)
    lowered = polynomial_over_trials(replace(card(), covariance=known), [slowing(2.6)])
    assert lowered.model.low_speed_bound_mps < 2.6 and lowered.covariance is known


@pytest.mark.parametrize("signals", [("u_mps", "v_mps"), ("x_m", "y_m")])
def test_the_slowest_speed_is_that_of_the_log_or_of_the_track(signals: tuple[str, ...]) -> None:
    assert slowest_speed(slowing(2.6, signals), SHIP_TIME_S) == pytest.approx(2.6, rel=0.01)


def test_the_polynomial_acts_at_the_slowest_speed_of_the_trials() -> None:
    def rates(of: ManoeuvringCard) -> np.ndarray:
        model = build(of)
        parameters = model.parameter_values()
        states = np.array(model.initial(parameters)).ravel()
        states[[model.state_names.index(name) for name in ("motion.u", "motion.v", "motion.r")]] = 2.6, -0.4, 0.01
        return np.array(model.rhs(states, model.input_values(), parameters)).ravel()

    lowered = polynomial_over_trials(card(), [slowing(2.6)])
    polynomial = card(low_speed_below_mps=0.5)
    assert rates(lowered) == pytest.approx(rates(polynomial), abs=1e-12)
    assert rates(card()) != pytest.approx(rates(polynomial), rel=0.05)


@pytest.mark.parametrize(
    ("given", "trials"),
    [
        (card(valid_speed_mps=[3.9, 9.0]), [slowing(2.6)]),
        (card(low_speed_below_mps=3.0), [slowing(2.6)]),
        (card(), [slowing(5.0)]),
        (card(), [slowing(0.1)]),
    ],
    ids=["a stated range", "a stated bound", "no slower than the bound", "a stop"],
)
def test_a_stated_range_and_stops_leave_the_card_as_it_is(given: ManoeuvringCard, trials: list[Trial]) -> None:
    assert polynomial_over_trials(given, trials) is given
    assert lowered_bound_notice(given, given) == ()


@pytest.mark.parametrize("signals", [("u_mps", "v_mps"), ("x_m", "y_m")])
def test_what_is_slower_than_the_end_of_the_polynomial_is_cut_off(signals: tuple[str, ...]) -> None:
    whole, stop = slowing(2.6, signals), slowing(0.1, signals)
    kept = above_low_speed(card(low_speed_below_mps=1.0), Measured((whole, stop), "angle", ("read",)))
    assert kept.trials[0] is whole
    assert kept.trials[1].time_s[0] == 0.0
    assert kept.trials[1].time_s[-1] == pytest.approx(60.0 * np.log(7.6 / 0.9), rel=0.03)  # where the speed is 1 m/s
    assert all(len(values) == len(kept.trials[1].time_s) for values in kept.trials[1].signals.values())
    assert len(kept.notices) == 2


def test_a_trial_of_low_speeds_alone_and_one_without_speeds_stay_whole() -> None:
    group = Measured((slowing(0.1), slowing(2.6, ())), "angle", ())
    assert above_low_speed(card(low_speed_below_mps=7.0), group) is group


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
