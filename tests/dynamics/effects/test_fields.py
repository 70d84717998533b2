"""Changing current and wind: against momentum by hand, against the steady effects, and where a stopped ship lies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.inference.prior import candidate_explanations
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import MASS, RHO, RHO_AIR, SIDE, STATES, X_G, L, added_forces, card_with, forces, ship, state, values

FIELD = {"speed_mps": 0.0, "direction_deg": 0.0, "entry_time_s": 20.0}
WIND = {"speed_mps": 12.0, "direction_deg": 35.0}


def test_the_momentum_of_the_ships_own_mass_is_that_over_the_ground() -> None:
    """At rest in water that begins to move: (m + m_x) u' + m a = 0, and so in sway and yaw, by the card's table."""
    model = ship({"current_field": FIELD})
    box = 0.5 * RHO * L**3
    m, mx = MASS * box, 42e-5 * box
    wanted = ["motion.udot", "motion.vdot", "motion.rdot"]
    at = {"motion.u": 0.0, "propeller.speed": 0.0, "current.speed": 1.5}
    udot, _, _ = values(model, wanted, {**at, "current.direction": 0.0})
    np.testing.assert_allclose(udot, -(1.5 / 20.0) * m / (m + mx), rtol=1e-5)
    _, vdot, rdot = values(model, wanted, {**at, "current.direction": math.pi / 2})
    moment, inertia = box * L, 39.2e-5 + 43.8e-5
    mass = np.array([
        [m + 748e-5 * box, m * X_G * L + 9.354e-5 * moment], [m * X_G * L - 4.646e-5 * moment, inertia * box * L**2]
    ])  # fmt: skip
    expected = np.linalg.solve(mass, -(1.5 / 20.0) * m * np.array([1.0, X_G * L]))
    np.testing.assert_allclose([vdot, rdot], expected, rtol=1e-5)


def test_a_step_of_the_current_moves_the_ground_speed_gradually_and_in_the_end_wholly() -> None:
    running = Running(Integrator(ship({"current_field": FIELD})), {"propeller.speed": 0.0}, {"initial.u": 0.0})
    running.order({"current.speed": 1.0, "current.direction": math.pi / 2})
    running.run(2400.0)
    run = running.trajectory()
    speed = run["motion.sog"]
    assert 0 <= speed[np.searchsorted(run.t, 0.1)] < 0.005
    every = speed[:: len(speed) // 40]
    assert every[1] < 0.8 and np.all(np.diff(every) > -1e-3) and speed[-1] == pytest.approx(1.0, abs=0.05)


def test_in_a_steady_current_nothing_but_the_kinematics_differs() -> None:
    given = {"speed_mps": 1.2, "direction_deg": 80.0}
    names = ["motion.xdot", "motion.ydot", "force.X", "force.Y", "force.N"]
    water = {"current_field.north_reached": 1.2 * math.cos(math.radians(80)),
             "current_field.east_reached": 1.2 * math.sin(math.radians(80))}  # fmt: skip
    at = {**STATES[0], "motion.psi": 0.7}
    field = values(ship({"current_field": given}), names, {**at, **water})
    np.testing.assert_allclose(field, values(ship({"current": given}), names, at), rtol=1e-9)
    start = ship({"current_field": given})
    assert [start[f"initial.current_{side}"].start for side in ("north", "east")] == pytest.approx(list(water.values()))


@pytest.mark.parametrize("kind", ["current", "wind"])
def test_a_search_does_not_try_what_another_effect_of_the_card_takes_the_inputs_of(kind: str) -> None:
    with_field = card_with({f"{kind}_field": {"speed_mps": 1.0, "direction_deg": 0.0}})
    assert kind in candidate_explanations(card_with(), "order")
    assert kind not in candidate_explanations(with_field, "order")
    assert not EFFECTS[f"{kind}_field"].tried(card_with())


@pytest.mark.parametrize("kind", ["current", "wind"])
def test_components_are_added_to_speed_and_direction(kind: str) -> None:
    sign = 1.0 if kind == "current" else -1.0  # a wind is named by where it comes from
    model = ship({f"{kind}_field": {"speed_mps": 2.0, "direction_deg": 30.0}})
    names = ["force.X", "force.Y", "force.N"]
    at = {**STATES[0], "motion.psi": 0.4, "current_field.north_reached": 0.3, "current_field.east_reached": 0.1}
    at = {key: value for key, value in at.items() if key in model}
    angle = math.radians(30.0)
    components = {f"{kind}.north": sign * 2 * math.cos(angle), f"{kind}.east": sign * 2 * math.sin(angle)}
    by_direction = values(model, names, at)
    by_components = values(model, names, {**at, **components, f"{kind}.speed": 0.0})
    np.testing.assert_allclose(by_components, by_direction, rtol=1e-9)


def test_without_yaw_rate_the_wind_is_that_of_the_centroid() -> None:
    at = {**state(7.0, 0.6, 0.0), "motion.psi": 0.7}
    spread = {**WIND, "superstructure_share": 0.3, "superstructure_forward_m": -60.0}
    centred = {**WIND, "centroid_forward_m": -18.0}
    np.testing.assert_allclose(added_forces("wind_field", spread, at), added_forces("wind", centred, at), rtol=1e-7)


def test_air_damps_the_swing_as_the_integral_over_the_side_says() -> None:
    """In a beam wind V: dN/dr = -rho c_Y A_L V L^2/12, by d(v^2)/dr = -2 v x."""
    model = ship({"wind_field": {"speed_mps": 15.0, "direction_deg": 90.0, "still_air": 1.0}})
    bare = ship()
    small = 1e-6
    N = [forces(model, state(0.0, 0.0, rate))[2] - forces(bare, state(0.0, 0.0, rate))[2] for rate in (small, -small)]
    slope = (N[0] - N[1]) / (2 * small)
    assert slope == pytest.approx(-RHO_AIR * 0.8 * SIDE * 15.0 * L**2 / 12, rel=1e-3)


@pytest.mark.parametrize(("forward", "bow"), [(-60.0, 1), (60.0, -1)])
def test_a_stopped_ship_turns_its_low_end_into_the_wind(forward: float, bow: int) -> None:
    """Superstructure aft: the bow comes into a wind from the north; forward: the stern."""
    given = {"speed_mps": 15.0, "direction_deg": 0.0, "superstructure_share": 0.3, "superstructure_forward_m": forward}
    integrator = Integrator(ship({"wind_field": given}))
    headings = []
    for heading in (20.0, 90.0, 160.0):
        start = {"initial.u": 0.0, "initial.psi": math.radians(heading)}
        running = Running(integrator, {"propeller.speed": 0.0}, start)
        running.run(5400.0)
        headings.append(math.degrees(running.state("motion.psi")))
    assert np.ptp(headings) < 1.0
    assert bow * (90.0 - headings[0]) > 5.0
