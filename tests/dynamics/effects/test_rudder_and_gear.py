"""Rudder forces and the steering gear with effects, against plain numpy and exact solutions."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.gear import CONTACT
from tank2sim.simulation.scheme import runge_kutta_step

from .ships import FORCES, N0, RHO, STATES, U0, L, forces, mariner_text, ship, values

DEG = np.pi / 180


def rudder_force(at: dict[str, float], delta: float | None = None) -> np.ndarray:
    """Force of the bare ship less that with the rudder midships: all that the rudder does."""
    turned = at if delta is None else {**at, "rudder.angle": delta}
    return forces(ship(), turned) - forces(ship(), {**at, "rudder.angle": 0.0})


def with_rudder(multiplier: float, at: dict[str, float]) -> np.ndarray:
    return forces(ship(), at) + (multiplier - 1) * rudder_force(at)


@pytest.mark.parametrize("at", STATES)
def test_rudder_effectiveness_multiplies_all_that_the_rudder_does(at) -> None:
    found = forces(ship({"rudder_effectiveness": {"factor": -0.25}}), at)
    np.testing.assert_allclose(found, with_rudder(0.75, at), rtol=1e-9)


@pytest.mark.parametrize("at", STATES)
def test_the_slipstream_keeps_up_the_rudder_as_speed_is_lost(at) -> None:
    found = forces(ship({"rudder_slipstream": {"gain": 1.5}}), at)
    np.testing.assert_allclose(found, with_rudder(1 + 1.5 * (1 - at["motion.u"] / U0), at), rtol=1e-9)


@pytest.mark.parametrize(
    ("speed", "turns", "gain", "expected"),
    [
        (0.8, 1.0, 0.8, 1.21),
        (0.8, 0.5, 0.8, 0.7225),
        (0.8, 0.0, 0.8, 0.36),
        (0.8, -0.5, 0.8, 0.36),
        (0.8, 0.0, 3.0, 0.0),
    ],
)
def test_the_jet_follows_the_revolutions(speed: float, turns: float, gain: float, expected: float) -> None:
    at = {**STATES[0], "motion.u": speed * U0, "motion.v": 0.0, "propeller.speed": turns * N0}
    jet, half = (ship({"rudder_slipstream": {"gain": gain, "jet": share}}) for share in (1.0, 0.5))
    bare, whole, mixed = (values(model, ["rudder.Y", "rudder.N"], at) for model in (ship(), jet, half))
    np.testing.assert_allclose(whole, expected * bare, atol=1e-9 * abs(bare).max())
    np.testing.assert_allclose(mixed, (expected + 1 + gain * (1 - speed)) / 2 * bare, atol=1e-9 * abs(bare).max())


def test_the_jet_and_the_loss_of_speed_are_the_same_to_first_order() -> None:
    at = {**STATES[0], "motion.u": (1 - 1e-4) * U0, "motion.v": 0.0}
    jet, loss = (ship({"rudder_slipstream": {"gain": 0.8, "jet": share}}) for share in (1.0, 0.0))
    bare, first, second = (values(model, ["rudder.Y", "rudder.N"], at) for model in (ship(), jet, loss))
    np.testing.assert_allclose(first - bare, second - bare, rtol=1e-3)


@pytest.mark.parametrize(("angle_deg", "lost"), [(15.0, 0.0), (-22.5, 0.2), (30.0, 0.4), (21.25, 0.4 * 5 / 32)])
def test_a_rudder_loses_its_share_over_five_degrees_past_stall(angle_deg: float, lost: float) -> None:
    at = {**STATES[0], "rudder.angle": angle_deg * DEG}
    found = forces(ship({"rudder_stall": {"angle_deg": 20.0, "loss": 0.4}}), at)
    np.testing.assert_allclose(found, with_rudder(1 - lost, at), rtol=1e-9)


@pytest.mark.parametrize(("angle_deg", "lost"), [(19.0, 0.0), (-25.0, 0.2), (31.0, 0.4)])
@pytest.mark.parametrize("drag", [0.0, 0.25])
def test_a_stalled_rudder_keeps_the_drag_that_it_is_said_to_keep(angle_deg: float, lost: float, drag: float) -> None:
    at = {**STATES[0], "rudder.angle": angle_deg * DEG}
    stall = {"angle_deg": 20.0, "loss": 0.4, "width_deg": 10.0, "drag": drag}
    found, bare = (
        values(model, ["rudder.X", "rudder.Y", "rudder.N"], at) for model in (ship({"rudder_stall": stall}), ship())
    )
    np.testing.assert_allclose(found / bare, [1 - drag * lost, 1 - lost, 1 - lost], rtol=1e-9)


def test_a_biased_rudder_is_a_rudder_at_another_angle() -> None:
    at = {**STATES[0], "rudder.angle": 0.1}
    found = forces(ship({"rudder_bias": {"angle_deg": 2.0}}), at)
    np.testing.assert_allclose(found, forces(ship(), {**at, "rudder.angle": 0.1 + 2 * DEG}), rtol=1e-12)
    assert values(ship({"rudder_bias": {"angle_deg": 2.0}}), ["rudder.angle"], at) == 0.1


def rate(effects: dict[str, dict[str, float]], command: float, angle: float, text: str | None = None) -> float:
    return float(values(ship(effects, text), ["rudder.rate"], {"rudder.command": command, "rudder.angle": angle})[0])


WITHOUT_LIMIT = mariner_text(max_rate_degps="")


@pytest.mark.parametrize("text", [None, WITHOUT_LIMIT])
def test_the_rate_limit_takes_the_place_of_the_cards(text: str | None) -> None:
    for k in (2.0, 20.0):
        effects = {"rudder_rate_limit": {"max_rate_degps": k}}
        assert rate(effects, 0.6, 0.0, text) == pytest.approx(min(k * DEG, 0.6))
        assert rate(effects, -0.6, 0.0, text) == pytest.approx(-min(k * DEG, 0.6))
        assert rate(effects, 0.01, 0.0, text) == pytest.approx(0.01)
    model = ship({"rudder_rate_limit": {"max_rate_degps": 2.0}})
    assert "steering.max_rate" not in model and "steering.max_angle" in model


def test_the_lag_takes_the_place_of_the_cards() -> None:
    assert rate({"rudder_lag": {"time_constant_s": 4.0}}, 0.1, 0.02) == pytest.approx(0.08 / 4)
    model = ship({"rudder_lag": {"time_constant_s": 4.0}})
    assert "steering.time_constant" not in model and model.step_s == ship().step_s
    assert ship({"rudder_lag": {"time_constant_s": 0.2}}).step_s <= 0.2 / 5
    nothing = mariner_text(time_constant_s="")
    assert any("no time constant" in notice for notice in ship(text=nothing).notices)
    assert not ship({"rudder_lag": {"time_constant_s": 4.0}}, nothing).notices


def test_the_gear_does_not_act_within_its_dead_band() -> None:
    band = {"rudder_dead_band": {"half_width_deg": 2.0}}
    assert rate(band, 0.1 + 1.9 * DEG, 0.1) == 0.0 and rate(band, 0.1 - 1.9 * DEG, 0.1) == 0.0
    assert rate(band, 0.1 + 3.0 * DEG, 0.1) == pytest.approx(1.0 * DEG)
    assert rate(band, 0.1 - 3.0 * DEG, 0.1) == pytest.approx(-1.0 * DEG)
    assert rate(band, 0.6, 0.0) == pytest.approx(5 * DEG)  # a large error still has the gear's full rate


def test_the_rudder_follows_the_gear_by_the_play_operator() -> None:
    """Order up, down and up again: the rudder is max(min(.)) of the gear's angle -+ b/2."""
    model = ship({"rudder_backlash": {"width_deg": 4.0}})
    step, p = runge_kutta_step(model), model.parameter_values()
    x = np.array(model.initial(p)).ravel()
    x[model.state_names.index("motion.u")] = U0
    gear, rudder = (model.state_names.index(name) for name in ("rudder_backlash.gear", "rudder.angle"))
    played, worst, fastest = 0.0, 0.0, 0.0
    for order in 0.2 * np.sin(np.linspace(0, 3 * np.pi, 3000)) * np.linspace(1, 0.3, 3000):
        before = x[gear]
        x = np.array(step(x, model.input_values({"rudder.command": order}), p, model.step_s)).ravel()
        played = min(max(played, x[gear] - 2 * DEG), x[gear] + 2 * DEG)
        worst, fastest = max(worst, abs(x[rudder] - played)), max(fastest, abs(x[gear] - before) / model.step_s)
    assert worst < 1.1 * fastest * CONTACT * 160.93 / U0  # the contact gives by its own time
    assert abs(x[rudder] - x[gear]) == pytest.approx(2 * DEG, rel=0.02)


def test_two_stages_of_lag_follow_the_exact_solution() -> None:
    """Step of 2 deg: delta = d (1 - (T1 e^(-t/T1) - T2 e^(-t/T2))/(T1 - T2))."""
    model = ship({"telemotor_lag": {"time_constant_s": 0.4}})
    step, p, u = runge_kutta_step(model), model.parameter_values(), model.input_values({"rudder.command": 2 * DEG})
    assert model.step_s <= 0.4 / 5
    x, t = np.array(model.initial(p)).ravel(), 0.0
    place = model.state_names.index("rudder.angle")
    while t < 2.0:
        x = np.array(step(x, u, p, model.step_s)).ravel()
        t += model.step_s
        exact = 2 * DEG * (1 - (1.0 * np.exp(-t / 1.0) - 0.4 * np.exp(-t / 0.4)) / 0.6)
        assert x[place] == pytest.approx(exact, abs=1e-4 * DEG)


def test_a_failed_gear_still_holds_the_rudder() -> None:
    for effects in (
        {"rudder_rate_limit": {"max_rate_degps": 2.0}},
        {"rudder_lag": {"time_constant_s": 4.0}},
        {"rudder_backlash": {"width_deg": 4.0}},
        {"telemotor_lag": {"time_constant_s": 4.0}},
    ):
        at = {"rudder.command": 0.3, "rudder.angle": 0.1, "telemotor_lag.order": 0.2, "steering.failed": 1.0}
        at |= {"rudder_backlash.gear": 0.1}
        model = ship(effects)
        assert values(model, ["rudder.rate"], {key: value for key, value in at.items() if key in model}) == 0.0


def test_the_rudders_share_of_the_force_is_what_the_forces_hold() -> None:
    model = ship()
    names = ["rudder.X", "rudder.Y", "rudder.N", *FORCES]
    for at in STATES:
        found = values(model, names, at)
        midships = values(model, names, {**at, "rudder.angle": 0.0})
        np.testing.assert_allclose(found[:3], found[3:] - midships[3:], rtol=1e-9, atol=1e-6)
        np.testing.assert_array_equal(midships[:3], 0.0)


def foil(at: dict[str, float], loading: float, straightening: float, lever: float) -> np.ndarray:
    """X, Y, N of the rudder as a foil in the slipstream, with the Mariner's Yd, Nd, Xdd (rudder to starboard) and
    revolutions; N and Y also hold the force amidships at the nominal loading."""
    u, v, r, delta = (at[name] for name in ("motion.u", "motion.v", "motion.r", "rudder.angle"))
    speed = np.hypot(u, v)
    inflow = speed + loading * (U0 * at.get("propeller.speed", N0) / N0 - speed)
    lift = inflow**2 * np.sin(delta + np.arctan(straightening * (v + lever * L * r) / inflow))
    side = lift * np.cos(delta)
    return 0.5 * RHO * L**2 * np.array([-95e-5 * lift * np.sin(delta), -278e-5 * side, L * 139e-5 * side])


def amidships(at: dict[str, float], straightening: float, lever: float) -> np.ndarray:
    """To first order the foil's force at delta = 0 and the nominal loading."""
    u, v, r = (at[name] for name in ("motion.u", "motion.v", "motion.r"))
    side = straightening * (v + lever * L * r) * np.hypot(u, v)
    return 0.5 * RHO * L**2 * np.array([0.0, -278e-5 * side, L * 139e-5 * side])


LOADED = [(0.0, 0.0, 0.0), (0.6, 0.5, -0.8), (1.1, 0.2, -2.0)]


@pytest.mark.parametrize("at", STATES)
@pytest.mark.parametrize(("loading", "straightening", "lever"), LOADED)
@pytest.mark.parametrize("measured", [0.0, 0.4, 1.0])
def test_the_loaded_rudder_is_a_foil_in_the_propellers_jet_next_to_a_share_of_the_polynomial(
    at, loading, straightening, lever, measured
) -> None:
    given = {"loading": loading, "straightening": straightening, "lever": lever} | (
        {"measured": measured} if measured else {}
    )
    rudder = ["rudder.X", "rudder.Y", "rudder.N"]
    now, nominal = (foil(at, share, straightening, lever) for share in (loading, 0.0))
    replaced = now - amidships(at, straightening, lever)
    added = values(ship(), rudder, at) + now - nominal
    expected = (1 - measured) * replaced + measured * added
    np.testing.assert_allclose(values(ship({"loaded_rudder": given}), rudder, at), expected, rtol=1e-9)


@pytest.mark.parametrize("measured", [0.0, 1.0])
def test_the_loaded_rudder_leaves_the_linear_derivatives_of_the_hull_as_measured(measured: float) -> None:
    model = ship({"loaded_rudder": {"loading": 0.6, "straightening": 0.5, "lever": -0.8, "measured": measured}})
    straight = {"motion.u": U0, "motion.v": 1e-4, "motion.r": 1e-6, "rudder.angle": 0.0}
    side = values(model, ["rudder.Y", "rudder.N"], straight)
    hard = values(model, ["rudder.Y", "rudder.N"], {**straight, "rudder.angle": 0.3})
    assert np.all(np.abs(side) < 1e-4 * np.abs(hard))


def test_the_loaded_rudder_stays_finite_at_rest_and_astern() -> None:
    model = ship({"loaded_rudder": {"loading": 0.6, "straightening": 0.5, "lever": -0.8}})
    for at in ({"motion.u": 0.0, "motion.v": 0.01}, {"motion.u": 2.0, "propeller.speed": -N0}):
        state = {"motion.v": 0.0, "motion.r": 0.0, "rudder.angle": 0.2, **at}
        assert np.isfinite(values(model, ["rudder.X", "rudder.Y", "rudder.N"], state)).all()


@pytest.mark.parametrize("turns", [0.0, -1.0])
def test_the_loaded_rudder_at_rest_has_a_twentieth_of_the_speed_as_its_flow(turns: float) -> None:
    """Nothing flows over it, or the propeller draws it astern: 1/2 rho L^2 (u0/20)^2 sin(delta) cos(delta) Y_d."""
    model = ship({"loaded_rudder": {"loading": 0.6, "straightening": 0.0, "lever": -0.8}})
    at = {"motion.u": 0.0, "motion.v": 0.0, "motion.r": 0.0, "rudder.angle": 0.3, "propeller.speed": turns * N0}
    (Y,) = values(model, ["rudder.Y"], at)
    least = 0.5 * RHO * L**2 * (U0 / 20) ** 2
    assert pytest.approx(-278e-5 * least * np.sin(0.3) * np.cos(0.3), rel=1e-6) == Y


def test_the_slipstream_is_the_loaded_rudder_for_small_losses_of_speed_without_cross_flow() -> None:
    """So one includes the other, and they are not sought together."""
    assert EFFECTS["loaded_rudder"].includes == ("rudder_slipstream",)
    at = {"motion.u": 0.999 * U0, "motion.v": 0.0, "motion.r": 0.0, "rudder.angle": 0.01}
    loaded = ship({"loaded_rudder": {"loading": 0.3, "straightening": 0.0, "lever": 0.0, "measured": 1.0}})
    slipstream = ship({"rudder_slipstream": {"gain": 0.6}})
    bare, first, second = (values(model, ["rudder.Y", "rudder.N"], at) for model in (ship(), loaded, slipstream))
    np.testing.assert_allclose(first - bare, second - bare, rtol=0.01)
