"""Thrusters, azimuth units, tugs, the engine's telegraph and thrust astern: by hand and by the clock."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import N0, RHO, U0, B, G, L, T, added_forces, ship, state

TELEGRAPH = {"time_constant_s": 4.0, "start_s": 6.0, "reversal_s": 25.0}


@pytest.mark.parametrize(("name", "forward"), [("bow_tunnel_thruster", 60.0), ("stern_tunnel_thruster", -70.0)])
def test_a_thruster_pushes_its_end_to_the_side_of_its_order_and_fades_with_speed(name: str, forward: float) -> None:
    given = {"command": 0.5, "force_N": 2e5, "forward_m": forward, "half_speed_mps": 1.5}
    for u, left in ((0.0, 1.0), (1.5, 0.5), (-1.5, 0.5), (4.5, 0.1)):
        found = added_forces(name, given, state(u, 0.0, 0.0))
        np.testing.assert_allclose(found, [0.0, 1e5 * left, forward * 1e5 * left], rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "given", "input_name", "wrong"),
    [
        ("bow_tunnel_thruster", {"command": 0.0}, "bow_tunnel_thruster.command", 50.0),
        ("tugs", {"force_1_N": 0.0, "direction_1_deg": 0.0}, "tug.force_2", -1.0),
        ("wind", {"speed_mps": 0.0, "direction_deg": 0.0}, "wind.speed", 500.0),
        ("current", {"speed_mps": 0.0, "direction_deg": 0.0}, "current.speed", -30.0),
        ("finite_depth", {"depth_m": 50.0}, "water.depth", 1e6),
    ],
)
def test_an_order_that_nothing_can_follow_is_refused(
    name: str, given: dict[str, float], input_name: str, wrong: float
) -> None:
    model = ship({name: given})
    with pytest.raises(InputError) as caught:
        model.input_values({input_name: wrong})
    assert caught.value.place == input_name


@pytest.mark.parametrize(("name", "side"), [("bow_tunnel_thruster", 1), ("stern_tunnel_thruster", -1)])
def test_a_thruster_of_which_nothing_is_said_is_one_of_the_ships_size_at_its_end(name: str, side: int) -> None:
    """6e-5 rho g L^2 T at 0.42 L, half of it left at 0.038 sqrt(g L): about 100 N/m2 of L T and 3 knots."""
    whole = 6e-5 * RHO * G * L**2 * T
    assert 80 < whole / (L * T) < 140
    for u, left in ((0.0, 1.0), (0.038 * math.sqrt(G * L), 0.5)):
        found = added_forces(name, {"command": -1.0}, state(u, 0.0, 0.0))
        np.testing.assert_allclose(found, [0.0, -whole * left, -side * 0.42 * L * whole * left], rtol=1e-6, atol=1e-3)


def test_tugs_without_places_are_forward_and_aft_by_turns() -> None:
    for tug in (1, 2, 3, 4):
        given = {"force_1_N": 0.0, "direction_1_deg": 0.0, f"force_{tug}_N": 1e5, f"direction_{tug}_deg": 90.0}
        found = added_forces("tugs", given, state(0.5, 0.0, 0.0))
        place = 0.45 * L * (1 if tug % 2 else -1)
        np.testing.assert_allclose(found, [0.0, 1e5, place * 1e5], rtol=1e-6, atol=1e-3)


def test_thrusters_turn_a_stopped_ship_on_the_spot() -> None:
    model = ship({"bow_tunnel_thruster": {"command": 1.0}, "stern_tunnel_thruster": {"command": -1.0}})
    running = Running(Integrator(model), {"propeller.speed": 0.0}, {"initial.u": 0.0})
    running.run(300.0)
    assert running.state("motion.psi") > 0.2
    assert math.hypot(running.state("motion.x"), running.state("motion.y")) < 0.1 * L


def test_tugs_are_forces_at_their_points() -> None:
    given = {
        "force_1_N": 2e5, "direction_1_deg": 90.0, "forward_1_m": 60.0, "starboard_1_m": 10.0,
        "force_4_N": 3e5, "direction_4_deg": 150.0, "forward_4_m": -50.0, "starboard_4_m": -8.0,
    }  # fmt: skip
    X4, Y4 = 3e5 * math.cos(math.radians(150)), 3e5 * 0.5
    expected = [X4, 2e5 + Y4, 60.0 * 2e5 - 50.0 * Y4 + 8.0 * X4]
    np.testing.assert_allclose(added_forces("tugs", given, state(1.0, 0.1, 0.0)), expected, rtol=1e-6)


def revolutions(before: float, order: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and revolutions over the nominal ones after an order, from a ship whose engine runs at `before`."""
    model = ship({"engine_telegraph": TELEGRAPH})
    start = {"initial.u": U0 if before else 0.0, "initial.propeller_speed": before * N0}
    running = Running(Integrator(model), {"propeller.speed": order * N0}, start)
    running.run(duration)
    run = running.trajectory()
    return run.t, run["propeller.speed_actual"] / N0


def test_a_stopped_engine_starts_after_its_time() -> None:
    t, n = revolutions(0.0, 0.5, 60.0)
    first = t[np.argmax(n > 0.005)]
    assert 0.85 * 6.0 < first < 1.1 * 6.0
    assert n[-1] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("before", [1.0, -0.5])
def test_an_engine_is_stopped_before_it_is_reversed(before: float) -> None:
    order = -0.6 * np.sign(before)
    t, n = revolutions(before, order, 120.0)
    turned = t[np.argmax(n * np.sign(order) > 0.005)]
    assert 0.9 * 25.0 < turned < 1.1 * 25.0
    assert np.interp(12.0, t, np.abs(n)) < 0.06  # by 4 s of time constant
    assert n[-1] == pytest.approx(order, abs=1e-3)


def test_another_order_to_the_same_side_acts_at_once() -> None:
    t, n = revolutions(1.0, 0.5, 20.0)
    np.testing.assert_allclose(n, 0.5 + 0.5 * np.exp(-t / 4.0), atol=2e-3)


def test_an_engine_in_trim_turns_as_ordered() -> None:
    model = ship({"engine_telegraph": TELEGRAPH})
    running = Running(Integrator(model), {"propeller.speed": 0.7 * N0}, {"initial.trim": 1.0})
    assert running.state("engine_telegraph.speed") == pytest.approx(0.7 * N0, rel=1e-9)


def test_astern_a_propeller_has_its_share_of_the_thrust_ahead() -> None:
    whole = 77e-5 * 0.5 * RHO * L**2 * U0**2
    found = added_forces("astern_thrust", {"factor": 0.6}, {**state(3.0, 0.0, 0.0), "propeller.speed": -0.5 * N0})
    np.testing.assert_allclose(found, [whole * 0.4 * 0.25, 0.0, 0.0], rtol=1e-6, atol=1e-3)
    ahead = added_forces("astern_thrust", {"factor": 0.6}, {**state(3.0, 0.0, 0.0), "propeller.speed": 0.5 * N0})
    np.testing.assert_array_equal(ahead, [0.0, 0.0, 0.0])


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
