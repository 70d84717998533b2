"""Speeds that the engine holds straight ahead, against roots of the printed polynomial and against long simulations."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.analysis.stability.study import steady_speeds
from tank2sim.bundled import bundled_cards
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.ship import Ship
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from ...dynamics.effects.ships import N0, U0, card_with, mariner_text, ship

HUMP = {"hump_resistance": {"X_prime": -4.0e-3, "speed_mps": 6.3, "width_mps": 0.4}}


def surge_of_the_mariner(u: float) -> float:
    """X' straight ahead, as printed (Chislett and Strom-Tejsen 1965), in U = u, and the hump added above."""
    du = (u - 7.7175) / u
    hump = -4.0e-3 * math.exp(-0.5 * ((u - 6.3) / 0.4) ** 2)
    return -184e-5 * du - 110e-5 * du**2 - 215e-5 * du**3 + hump


def test_the_speeds_of_a_ship_with_a_deep_hump_are_the_roots_of_its_surge_force() -> None:
    from scipy.optimize import brentq

    grid = np.linspace(5.5, 9.0, 3000)
    forces = [surge_of_the_mariner(float(u)) for u in grid]
    rows = [row for row in range(len(grid) - 1) if forces[row] * forces[row + 1] < 0]
    roots = [(brentq(surge_of_the_mariner, grid[row], grid[row + 1]), forces[row] > 0) for row in rows]
    assert [stable for _, stable in roots] == [True, False, True]
    found = steady_speeds(ship(HUMP))
    assert [one.stable for one in found] == [True, False, True]
    assert [one.speed_mps for one in found] == pytest.approx([root for root, _ in roots], rel=1e-9)


@pytest.mark.slow
def test_a_ship_with_two_speeds_goes_at_the_one_it_comes_to() -> None:
    straight = mariner_text(**{name: f"{name} = 0.0" for name in ("Y0", "Y0u", "Y0uu", "N0", "N0u", "N0uu")})
    integrator = Integrator(ship({**HUMP, "engine_lag": {"time_constant_s": 10.0}}, straight))
    low, _, high = (one.speed_mps for one in steady_speeds(integrator.model))
    for start, reached in ((0.5 * U0, low), (1.1 * U0, high)):
        running = Running(integrator, {"propeller.speed": N0}, {"initial.u": start})
        running.run(3000.0)
        assert running.state("motion.u") == pytest.approx(reached, abs=0.05)


@pytest.mark.slow  # with the IMO manoeuvres
def test_stability_marks_a_ship_with_two_speeds_in_its_first_line() -> None:
    result = Ship(card_with(HUMP)).stability(spirals=False)
    assert repr(result).startswith("CHECK")
    assert [one.stable for one in result.study.steady_speeds] == [True, False, True]


@pytest.mark.slow
def test_no_bundled_ship_has_two_speeds() -> None:
    cards = [card for card in map(read_card, bundled_cards()) if isinstance(card, ManoeuvringCard)]
    assert len(cards) >= 10
    for card in cards:
        stable = [one for one in steady_speeds(build(card)) if one.stable]
        identified = card.ship.name.startswith("Esso Osaka") and "estimated" not in card.source
        # the Esso Osaka's surge force does not vanish below twice the speed of expansion: measured at few speeds
        assert len(stable) == (0 if identified else 1)
