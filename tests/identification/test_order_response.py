"""Lag and dead band of thrusters from orders and revolutions, against a first-order lag that is solved here."""

from pathlib import Path

import craft_log
import numpy as np
import pytest

from tank2sim.cards import parse_card
from tank2sim.identification.craft.order_response import order_responses
from tank2sim.records.trials import Trial

FULL = 1800 * np.pi / 30


@pytest.fixture(scope="module")
def card():
    rng = np.random.default_rng(7)
    craft = craft_log.random_craft(rng)
    text = craft_log.first_card(craft, rng).card.text
    return parse_card(text.replace(f"max_rpm = {1.05 * craft['rpm']!r}", "max_rpm = 1800.0"), "first.toml")


def trial(shares: list[float], *, lag: float = 0.4, band: float = 0.04, gain: float = 1.0, noise: float = 0.3) -> Trial:
    """Orders of 4 s each, read five times a second at an instant that the orders do not know; both thrusters alike."""
    rng = np.random.default_rng(3)
    fine, n, rows = 0.01, 0.0, []
    orders = np.repeat(np.array(shares) * FULL, 403)
    for k, order in enumerate(orders):
        if k % 20 == 0:
            rows.append([k * fine, order, n])
        goal = gain * order if abs(order) > band * FULL else 0.0
        n = goal + (n - goal) * np.exp(-fine / lag)
    time, order, n = np.array(rows).T
    n = n + noise * rng.normal(size=len(n))
    signals = {
        f"{what}_{name}_radps": values
        for name in ("port", "starboard")
        for what, values in (("order", order), ("n", n))
    }
    return Trial(Path("trial.csv"), time, signals)


def test_lag_and_dead_band_are_found_with_their_errors(card) -> None:
    found = order_responses(card, [trial([0.5, 0.03, -0.4, 0.05, 0.7, -0.02, 0.3, -0.06], gain=0.95)])
    response = found["port"]
    assert abs(response.lag_s - 0.4) < 2 * response.lag_error_s < 0.15
    value, error = response.dead_band
    assert (response.rest_radps, response.turning_radps) == pytest.approx((0.03 * FULL, 0.05 * FULL), rel=1e-3)
    assert abs(value - 0.04 * FULL) < 2 * error
    assert found["starboard"] == response  # one thruster twice on the card


def test_without_small_orders_the_dead_band_is_not_determined(card) -> None:
    response = order_responses(card, [trial([0.5, -0.4, 0.2, 0.7, -0.3])])["port"]
    assert response.dead_band is None
    assert response.turning_radps == pytest.approx(0.2 * FULL, rel=1e-3)


def test_a_thruster_without_a_dead_band_has_none(card) -> None:
    response = order_responses(card, [trial([0.5, 0.02, -0.4, 0.04, 0.7], band=0.0)])["port"]
    assert response.dead_band is None
    assert response.turning_radps == pytest.approx(0.02 * FULL, rel=1e-3)


def test_orders_alone_have_no_response(card) -> None:
    ordered = trial([0.5, 0.02, -0.4])
    alone = {name: values for name, values in ordered.signals.items() if name.startswith("order")}
    assert order_responses(card, [Trial(ordered.path, ordered.time_s, alone)]) == {}
