"""Azimuth thrusters: forces by hand, the turn of the units, and what a pilot does with them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import U0, B, L, added_forces, ship, state

FORCE, NOMINAL = 4e5, 150.0 * 2 * math.pi / 60
GIVEN = {
    "revolutions_1_rpm": 100.0,
    "angle_1_deg": 30.0,
    "force_N": FORCE,
    "nominal_rpm": 150.0,
    "time_constant_s": 5.0,
    "max_rate_degps": 12.0,
}


@pytest.mark.parametrize("motion", [(0.0, 0.0, 0.0), (3.0, -0.4, 0.006), (-1.0, 0.2, -0.01)])
def test_forces_are_those_of_two_thrusts_at_their_places(motion: tuple[float, float, float]) -> None:
    u, v, r = motion
    shares, angles, places = (0.8, -0.5), (0.6, 2.5), ((-70.0, 6.0), (-71.0, -5.0))
    at = state(u, v, r)
    wanted = np.zeros(3)
    for unit, (s, a, (x, y)) in enumerate(zip(shares, angles, places, strict=True), 1):
        at |= {f"azimuth.revolutions_actual_{unit}": s * NOMINAL, f"azimuth.angle_actual_{unit}": a}
        met = (u - y * r) * math.cos(a) + (v + x * r) * math.sin(a)
        T = FORCE * s * (s - met / (U0 / 0.7)) if s > 0 else -0.6 * FORCE * s**2
        X, Y = T * math.cos(a), T * math.sin(a)
        wanted += [X, Y, x * Y - y * X]
    where = {"forward_1_m": -70.0, "starboard_1_m": 6.0, "forward_2_m": -71.0, "starboard_2_m": -5.0}
    np.testing.assert_allclose(added_forces("azimuths", {**GIVEN, **where}, at), wanted, rtol=1e-8, atol=1e-3)


def test_units_at_the_stern_are_placed_by_length_and_beam_where_the_card_gives_none() -> None:
    at = {**state(0.0, 0.0, 0.0), "azimuth.revolutions_actual_1": NOMINAL, "azimuth.angle_actual_1": math.pi / 2}
    X, Y, N = added_forces("azimuths", GIVEN, at)
    assert pytest.approx([0.0, FORCE, -0.46 * L * FORCE], abs=1e-3) == [X, Y, N]
    ahead = added_forces("azimuths", GIVEN, {**at, "azimuth.angle_actual_1": 0.0})
    np.testing.assert_allclose(ahead, [FORCE, 0.0, -0.25 * B * FORCE], atol=1e-3)


def test_a_unit_turns_at_its_largest_rate_and_its_revolutions_lag() -> None:
    running = Running(
        Integrator(ship({"azimuths": GIVEN})), {"azimuth.angle_1": math.pi, "azimuth.revolutions_1": 0.0}, {}
    )
    running.run(5.0)
    begun, lag = math.radians(30.0), math.exp(-1.0)
    assert running.state("azimuth.angle_actual_1") == pytest.approx(begun + 5.0 * math.radians(12.0), abs=1e-6)
    assert running.state("azimuth.revolutions_actual_1") == pytest.approx(100.0 * 2 * math.pi / 60 * lag, rel=1e-4)
    running.run(60.0)
    assert running.state("azimuth.angle_actual_1") == pytest.approx(math.pi, abs=1e-6)


def test_units_put_across_turn_a_stopped_ship_and_push_the_stern_that_way() -> None:
    across = {"azimuth.angle_1": math.pi / 2, "azimuth.angle_2": math.pi / 2}
    turning = {f"azimuth.revolutions_{unit}": 0.6 * NOMINAL for unit in (1, 2)}
    running = Running(
        Integrator(ship({"azimuths": GIVEN})), {**across, **turning, "propeller.speed": 0.0}, {"initial.u": 0.0}
    )
    running.run(120.0)
    assert running.state("motion.psi") < -0.05  # stern to starboard, bow to port
    assert running.state("motion.v") > 0
