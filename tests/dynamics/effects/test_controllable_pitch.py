"""A propeller with controllable pitch: published curves, thrust by hand, and a ship that is stopped by its pitch."""

from __future__ import annotations

import math
from functools import cache

import casadi as ca
import numpy as np
import pytest

from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects.controllable_pitch import (
    b_series_thrust,
    b_series_torque,
    pitch_thrust,
    pitch_torque,
)
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import N0, RHO, U0, L, added_forces, mariner_text, ship, state, values

PITCH = {"pitch": 0.8, "design_pitch": 0.8}
MMG = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")
ADDED = '\n[[effects]]\nname = "controllable_pitch"\nparameters = {pitch = 0.72, design_pitch = 0.72}\n'


def mmg_ship(text: str = MMG + ADDED) -> Model:
    return build(parse_card(text, "ship.toml"))


@cache
def at_pitches() -> ca.Function:
    """K_T and K_Q of J, pitch and the share of the thrust astern."""
    J, pitch, astern = ca.SX.sym("J"), ca.SX.sym("pitch"), ca.SX.sym("astern")
    blades = ca.SX(0.55), ca.SX(4)
    thrust, torque = pitch_thrust(J, pitch, *blades, astern), pitch_torque(J, pitch, *blades)
    return ca.Function("at_pitches", [J, pitch, astern], [thrust, torque])


def at_pitch(J: float, pitch: float, astern: float = 0.7) -> float:
    return float(at_pitches()(J, pitch, astern)[0])


def test_the_series_is_near_the_open_water_curve_of_a_tankers_propeller() -> None:
    """KP458 of the KVLCC2, P/D 0.721, A_E/A_0 0.431, Z 4: K_T of Yasukawa and Yoshimura (2015), of another series."""
    for J in (0.0, 0.2, 0.4, 0.6):
        assert b_series_thrust(J, 0.721, 0.431, 4) == pytest.approx(0.2931 - 0.2753 * J - 0.1385 * J**2, abs=0.02)


@pytest.mark.parametrize(
    ("at", "thrust", "torque"),
    [
        ((0.55, 0.8, 0.65, 5), 0.1574409603, 0.02300639701),
        ((0.3, 1.2, 0.4, 3), 0.3737088289, 0.06412075962),
        ((0.9, 1.1, 0.9, 6), 0.1445084552, 0.03016430948),
    ],
)
def test_the_series_has_the_values_of_another_transcription_of_its_polynomials(at, thrust, torque) -> None:
    """J, P/D, A_E/A_0 and Z; K_T and K_Q at a Reynolds number of 2e6 by a public program with its own tables."""
    assert b_series_thrust(*at) == pytest.approx(thrust, rel=1e-9)
    assert b_series_torque(*at) == pytest.approx(torque, rel=1e-9)


@pytest.mark.parametrize(
    ("more", "order", "pitch", "per_passage"),
    [
        ({}, 0.9, 0.85, 0.05 / 0.05),  # the lag of a twentieth of a passage
        ({}, -0.8, 0.8, -2 * 0.8 / 0.7),  # all the way astern in 0.7 passages
        ({}, 1.3, -0.8, 2 * 0.8 / 0.7),
        ({"reversal_s": 3 * L / U0, "time_constant_s": 0.1 * L / U0}, -0.8, 0.8, -2 * 0.8 / 3),
        ({"reversal_s": 3 * L / U0, "time_constant_s": 0.1 * L / U0}, 0.81, 0.8, 0.1),
    ],
)
def test_the_pitch_goes_to_its_order_by_lag_and_time_of_reversal(more, order, pitch, per_passage) -> None:
    at = {**state(U0, 0.0, 0.0), "propeller.pitch": order, "propeller.pitch_actual": pitch}
    (rate,) = values(ship({"controllable_pitch": {**PITCH, **more}}), ["propeller.pitch_rate"], at)
    assert rate == pytest.approx(per_passage * U0 / L, rel=1e-9)


def test_a_propeller_of_which_nothing_is_said_has_four_blades_of_55_percent_and_a_slip_of_30() -> None:
    said = {**PITCH, "blades": 4, "area_ratio": 0.55, "astern": 0.7, "advance_share": 0.7}
    other = {**PITCH, "blades": 5, "area_ratio": 0.7, "astern": 0.5, "advance_share": 0.6}
    for pitch in (1.1, -0.6):
        at = {**state(5.0, 0.0, 0.0), "propeller.pitch_actual": pitch, "propeller.speed": N0}
        usual, stated, another = (added_forces("controllable_pitch", one, at)[0] for one in (PITCH, said, other))
        assert usual == pytest.approx(stated, rel=1e-12) != pytest.approx(another, rel=1e-3)


@pytest.mark.parametrize(("pitch", "turns"), [(1.1, -0.5), (-0.6, 0.0), (0.5, 0.01)])
def test_a_propeller_that_stops_or_turns_astern_has_no_thrust_by_its_pitch(pitch: float, turns: float) -> None:
    """n < 0 is no order of such a propeller; below 2 % of the revolutions J is held, and n^2 is nothing."""
    at = {**state(5.0, 0.0, 0.0), "propeller.pitch_actual": pitch, "propeller.speed": turns * N0}
    X = added_forces("controllable_pitch", PITCH, at)[0]
    J = min(0.7 * 0.8 * 5.0 / U0 / 0.02, 1.6)
    change = (at_pitch(J, pitch) - at_pitch(J, 0.8)) / at_pitch(0.56, 0.8)
    expected = 0.5 * RHO * L**2 * U0**2 * 77e-5 * max(turns, 0.0) ** 2 * change
    assert pytest.approx(expected, rel=1e-9, abs=1e-6) == X


def test_thrust_has_no_step_over_the_pitch_and_falls_with_it() -> None:
    for J in (0.0, 0.3, 0.7):
        pitches = np.linspace(-1.4, 1.4, 281)
        thrust = np.array([at_pitch(J, pitch) for pitch in pitches])
        assert np.all(np.diff(thrust) > 0) and np.max(np.diff(thrust)) < 0.01
    assert at_pitch(0.0, 0.0) == 0.0
    assert at_pitch(0.0, -0.9) == pytest.approx(-0.7 * at_pitch(0.0, 0.9))
    # blades at zero pitch are plates across the stream: T = 1/2 rho u^2 1.17 A_E, A_E = 0.55 pi/4 D^2
    assert at_pitch(0.6, 0.0) == pytest.approx(-0.5 * 0.6**2 * 1.17 * 0.55 * math.pi / 4)
    assert at_pitch(0.5, 0.9) == pytest.approx(b_series_thrust(0.5, 0.9, 0.55, 4))


def test_a_polynomial_gains_the_difference_of_the_thrusts_and_nothing_at_its_design_pitch() -> None:
    for u, pitch, share in ((5.0, 1.1, 1.0), (3.0, -0.6, 0.8), (0.0, 0.3, 0.5)):
        at = {**state(u, 0.0, 0.0), "propeller.pitch_actual": pitch, "propeller.speed": share * N0}
        J_0 = 0.7 * 0.8
        J = J_0 * (u / U0) / share
        change = (at_pitch(J, pitch) - at_pitch(J, 0.8)) / at_pitch(J_0, 0.8)
        expected = 0.5 * RHO * L**2 * U0**2 * 77e-5 * share**2 * change
        np.testing.assert_allclose(
            added_forces("controllable_pitch", PITCH, at), [expected, 0, 0], rtol=1e-9, atol=1e-3
        )
    designed = {**state(6.0, 0.3, 0.002), "propeller.pitch_actual": 0.8}
    np.testing.assert_array_equal(added_forces("controllable_pitch", PITCH, designed), 0.0)


@pytest.mark.slow
def test_a_negative_pitch_stops_the_ship_with_the_propeller_turning_ahead() -> None:
    model = ship({"controllable_pitch": PITCH})
    running = Running(Integrator(model), {"propeller.speed": N0, "propeller.pitch": -0.8}, {})
    running.run(3.0)
    swift = 2 * 0.8 / (0.7 * L / U0)
    assert running.state("propeller.pitch_actual") == pytest.approx(0.8 - 3.0 * swift, abs=0.01)
    running.run(900.0)
    assert running.state("motion.u") < 0.0
    assert running.state("propeller.pitch_actual") == pytest.approx(-0.8, abs=1e-6)


def test_on_an_mmg_card_the_thrust_and_the_race_on_the_rudder_change() -> None:
    model, bare = mmg_ship(), mmg_ship(MMG)
    u, n, D = 0.9, 10.0, 0.216
    at = {"motion.u": u, "propeller.speed": 2 * math.pi * n}
    J = 0.6 * u / (n * D)
    names = ["propeller.thrust", "rudder.inflow"]
    for pitch in (0.72, 1.0, 0.5):
        found, without = values(model, names, {**at, "propeller.pitch_actual": pitch}), values(bare, names, at)
        change = 1000.0 * n**2 * D**4 * (at_pitch(J, pitch) - at_pitch(J, 0.72))
        assert found[0] - without[0] == pytest.approx(change, rel=1e-9, abs=1e-9)
        assert np.sign(found[1] - without[1]) == np.sign(pitch - 0.72)
    with pytest.raises(InputError, match=r"advance_share: acts on nothing"):
        mmg_ship(MMG + ADDED.replace("}", ", advance_share = 0.6}"))


@pytest.mark.parametrize("share", [0.01, 0.03, -0.5])
def test_on_an_mmg_card_J_is_held_below_two_percent_of_the_revolutions(share: float) -> None:
    model, bare = mmg_ship(), mmg_ship(MMG)
    nominal, D, u = 11.8516, 0.216, 0.03
    at = {"motion.u": u, "propeller.speed": 2 * math.pi * share * nominal}
    found = values(model, ["propeller.thrust"], {**at, "propeller.pitch_actual": 1.0})
    without = values(bare, ["propeller.thrust"], at)
    J = 0.6 * u / (max(share, 0.02) * nominal * D)
    assert J < 1.6
    change = 1000.0 * (max(share, 0.0) * nominal) ** 2 * D**4 * (at_pitch(J, 1.0) - at_pitch(J, 0.72))
    assert found[0] - without[0] == pytest.approx(change, rel=1e-4, abs=1e-9)


def test_torque_and_thrust_of_the_series_have_the_efficiency_of_good_propellers() -> None:
    """One of P/D = 1 has its best in open water near 0.7."""
    efficiency = [
        J / (2 * math.pi) * b_series_thrust(J, 1.0, 0.55, 4) / b_series_torque(J, 1.0, 0.55, 4)
        for J in np.arange(0.1, 1.0, 0.05)
    ]
    assert 0.65 < max(efficiency) < 0.75
    assert min(efficiency) > 0


def torque_at_pitch(J: float, pitch: float) -> float:
    return float(at_pitches()(J, pitch, 0.7)[1])


def test_torque_is_least_at_zero_pitch_and_has_no_step_there_at_rest() -> None:
    pitches = np.linspace(-1.4, 1.4, 281)
    torques = np.array([torque_at_pitch(0.0, pitch) for pitch in pitches])
    assert np.argmin(torques) == 140 and np.max(np.abs(np.diff(torques))) < 0.003
    # 1/2 rho C_D A_E (2 pi n 0.35 D)^2 0.35 D over rho n^2 D^5
    idle = 0.5 * 0.01 * 0.55 * math.pi / 4 * (0.7 * math.pi) ** 2 * 0.35
    assert torque_at_pitch(0.4, 0.0) == pytest.approx(idle)
    assert torque_at_pitch(0.4, 0.9) == pytest.approx(b_series_torque(0.4, 0.9, 0.55, 4))


@pytest.mark.parametrize("with_torque", [True, False])
def test_torque_and_power_of_an_mmg_card_change_by_the_series_or_are_those_of_it(with_torque: bool) -> None:
    curve = "[propeller]\nq_0 = 0.034\nq_1 = -0.025\nq_2 = -0.01\neta_R = 1.01" if with_torque else "[propeller]"
    model = mmg_ship(MMG.replace("[propeller]", curve, 1) + ADDED)
    u, n, D = 0.9, 10.0, 0.216
    J = 0.6 * u / (n * D)
    unit = 1000.0 * n**2 * D**5
    for pitch in (0.72, 1.0, -0.5):
        at = {"motion.u": u, "propeller.speed": 2 * math.pi * n, "propeller.pitch_actual": pitch}
        Q, power = values(model, ["propeller.torque", "propeller.power"], at)
        if with_torque:
            own = (0.034 - 0.025 * J - 0.01 * J**2) / 1.01
            K_Q = own + (torque_at_pitch(J, pitch) - torque_at_pitch(J, 0.72)) / 1.01
        else:
            K_Q = torque_at_pitch(J, pitch)
        assert pytest.approx(unit * K_Q, rel=1e-9) == Q
        assert power == pytest.approx(2 * math.pi * n * Q)
    assert {"propeller.torque", "propeller.power"} <= set(model.outputs)


def test_a_polynomial_has_torque_where_its_card_states_the_diameter() -> None:
    stated = mariner_text(draught_m="draught_m = 7.468\npropeller_diameter_m = 6.7")
    u, pitch, share = 5.0, 1.1, 0.8
    at = {**state(u, 0.0, 0.0), "propeller.pitch_actual": pitch, "propeller.speed": share * N0}
    Q, power = values(ship({"controllable_pitch": PITCH}, stated), ["propeller.torque", "propeller.power"], at)
    K_Q = torque_at_pitch(0.7 * 0.8 * (u / U0) / share, pitch)
    assert pytest.approx(RHO * (share * N0 / (2 * math.pi)) ** 2 * 6.7**5 * K_Q, rel=1e-9) == Q
    assert power == pytest.approx(share * N0 * Q)
    assert "propeller.torque" not in ship({"controllable_pitch": PITCH})


def test_validity_falls_below_the_pitches_of_the_series() -> None:
    model = ship({"controllable_pitch": PITCH})
    factors = [
        values(model, ["validity_by.pitch"], {**state(6.0, 0.0, 0.0), "propeller.pitch_actual": pitch})[0]
        for pitch in (0.8, 0.5, 0.25, 0.0, -0.6)
    ]
    assert factors == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0])


def test_a_ship_without_engine_and_an_order_in_degrees_are_refused() -> None:
    with pytest.raises(InputError, match=r"propulsion: is missing"):
        ship({"controllable_pitch": PITCH}, mariner_text().split("[propulsion]")[0])
    with pytest.raises(InputError) as caught:
        ship({"controllable_pitch": PITCH}).input_values({"propeller.pitch": 20.0})
    assert caught.value.place == "propeller.pitch"
