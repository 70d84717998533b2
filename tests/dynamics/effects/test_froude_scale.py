"""What a search of the library needs: where effects vanish, the sizes from which it begins, and how they scale."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics import Model, build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.sensors import correct_reading
from tank2sim.simulation.scheme import runge_kutta_step

from .ships import N0, B, L, T, card_with, mariner_text

RATES = [f"motion.{name}" for name in ("udot", "vdot", "rdot", "xdot", "ydot")]
SENSORS = ("u", "v", "r", "psi", "x", "y")
FROUDE = 23.0


SHIP = build(card_with())


def with_values(name: str, given: Mapping[str, float], card: ManoeuvringCard) -> Model:
    return EFFECTS[name].apply(SHIP, given, card)


def readings(model: Model) -> list[str]:
    """What a recorder would take from this ship: each sensor, or the variable where none is at fault."""
    return [f"sensor.{name}" if f"sensor.{name}" in model else f"motion.{name}" for name in SENSORS]


def first_values(name: str, card: ManoeuvringCard) -> dict[str, float]:
    """Where a search begins: the first of the typical values of each required parameter."""
    required = EFFECTS[name].required()
    return {one.name: one.typical_values(card)[0] for one in EFFECTS[name].parameters if one.name in required}


@functools.cache
def smaller(scale: float = FROUDE) -> ManoeuvringCard:
    """The Mariner as a model, by Froude's law: lengths over the scale, speeds over its root."""
    root = np.sqrt(scale)
    return card_with(
        text=mariner_text(
            length_m=f"length_m = {L / scale}",
            beam_m=f"beam_m = {B / scale}",
            draught_m=f"draught_m = {T / scale}",
            projected_area_front_m2=f"projected_area_front_m2 = {400.0 / scale**2}",
            projected_area_side_m2=f"projected_area_side_m2 = {1500.0 / scale**2}",
            speed_mps=f"speed_mps = {7.7175 / root}",
            valid_speed_mps="",
            nominal_rpm=f"nominal_rpm = {84.0 * root}",
        )
    )


@functools.cache
def vanishing(name: str) -> Model:
    """The Mariner with an effect whose parameters are absent where they can be, and typical elsewhere."""
    card = card_with()
    absent = {one.name: one.absent for one in EFFECTS[name].parameters if one.absent is not None}
    return with_values(name, {**first_values(name, card), **absent}, card)


@functools.cache
def seen(model: Model) -> ca.Function:
    names = [*RATES, "rudder.rate", *readings(model)]
    expression = model.expand(ca.vcat([model.symbol(name) for name in names]))
    return ca.Function("seen", [model.x, model.u, model.p], [expression])


def seen_of(model: Model, at: Mapping[str, float]) -> np.ndarray:
    """Rates and readings where `at` says; states and inputs that it does not name are 0 and at their start."""
    x = [at.get(name, 0.0) for name in model.state_names]
    u = model.input_values({name: at[name] for name in model.input_names if name in at})
    return np.array(seen(model)(x, u, model.parameter_values())).ravel()


GIVEN = [name for name, effect in EFFECTS.items() if not effect.sought]
"""What is given, and never sought in trials."""

CAN_VANISH = [name for name, effect in EFFECTS.items() if any(one.absent is not None for one in effect.parameters)]


# Without play a contact is left, which takes a tenth of a second: its rates are others, its motion is not.
@pytest.mark.parametrize("name", [name for name in CAN_VANISH if name != "rudder_backlash"])
@settings(max_examples=4, deadline=None)
@given(share=st.tuples(*[st.floats(-1, 1)] * 6))
def test_an_absent_effect_changes_neither_rates_nor_readings(name: str, share: tuple[float, ...]) -> None:
    u, v, r, psi, delta, order = share
    at = {"motion.u": 6.0 + 2 * u, "motion.v": v, "motion.r": 0.01 * r, "motion.psi": 3 * psi, "motion.x": 90.0}
    at |= {"rudder.angle": 0.5 * delta, "rudder.command": 0.5 * order, "propeller.speed": N0 * order}
    np.testing.assert_allclose(seen_of(vanishing(name), at), seen_of(SHIP, at), rtol=1e-9, atol=1e-12)


def test_what_never_vanishes_replaces_something_or_needs_depth() -> None:
    never = set(EFFECTS) - set(CAN_VANISH)
    assert never == {
        "loaded_rudder",
        "rudder_rate_limit",
        "rudder_lag",
        "telemotor_lag",
        "engine_lag",
        "engine_telegraph",
        "controllable_pitch",
        "water_depth",
        "finite_depth",
        "propeller_astern",
        "loading",
    }


def test_what_trials_show_is_tried_and_only_required_parameters_and_those_with_a_spread_are_free() -> None:
    card = card_with()
    assert [name for name, effect in EFFECTS.items() if effect.sought and not effect.tried(card)] == [
        "engine_lag",
        "water_depth",
    ]
    coefficients = ("surge_coefficient", "sway_coefficient", "yaw_coefficient")
    expected = ("speed_mps", "direction_rad", *coefficients, "centroid_forward_m", "still_air")
    assert EFFECTS["wind"].free(card) == expected
    assert EFFECTS["roll_coupling"].required() == ("Yphi", "Nphi")
    assert EFFECTS["roll_coupling"].free(card) == ("Yphi", "Nphi", "roll_period_s", "damping")
    for effect in EFFECTS.values():
        for one in effect.parameters:
            assert (one.spread_value(card) is None) or (one.default is not None and one.spread_value(card) > 0)


@pytest.mark.parametrize("length", [1.5, 7.0, 160.0, 400.0])
def test_sizes_lie_within_bounds_on_small_models_and_large_ships(length: float) -> None:
    card = smaller(L / length)
    for effect in EFFECTS.values():
        for one in effect.parameters:
            default = () if one.default is None else (one.value({}, card),)
            absent = () if one.absent is None else (one.absent,)
            for value in (*one.typical_values(card), *default, *absent):
                assert one.minimum <= value <= one.maximum, (effect.name, one.name, value)
            assert one.absent is None or 0 not in one.typical_values(card)
            # an amplitude is sought from one value, a shape from several, or from the one that is known
            if one.absent is not None and one.default is None:
                assert len(one.typical_values(card)) == 1


@pytest.mark.parametrize("name", EFFECTS)
def test_sizes_of_a_model_are_those_of_its_ship_by_froudes_law(name: str) -> None:
    powers = {"N": 3.0, "m": 1.0, "s": 0.5, "mps": 0.5, "radps": -0.5}
    ship, model = card_with(), smaller()
    for one in EFFECTS[name].parameters:
        factor = FROUDE ** powers.get(one.name.rpartition("_")[2], 0.0)
        np.testing.assert_allclose(one.typical_values(ship), np.multiply(factor, one.typical_values(model)), rtol=1e-12)
        if one.default is not None:
            assert one.value({}, ship) == pytest.approx(factor * one.value({}, model))
        if (spread := one.spread_value(ship)) is not None:
            assert spread == pytest.approx(factor * one.spread_value(model))


def driven(model: Model, seconds: float) -> np.ndarray:
    """Readings and rudder of a ship that goes straight, 35 deg to starboard, 20 to port, and astern: (n, 7)."""
    step, p, h = runge_kutta_step(model), model.parameter_values(), 2 * model.step_s
    count = round(seconds / h)
    share = np.arange(count) / count
    orders = np.where(share < 0.05, 0.0, np.where(share < 0.5, 0.61, -0.35))
    inputs = np.tile(model.input_values()[:, None], count)
    inputs[model.input_names.index("rudder.command")] = orders
    inputs[model.input_names.index("propeller.speed"), share > 0.8] *= -1
    x = np.array(model.initial(p)).ravel()
    track = np.array(step.mapaccum(count)(x, inputs, np.tile(p[:, None], count), np.full((1, count), h)))
    names = [*readings(model), "rudder.angle"]
    shown = ca.Function("shown", [model.x, model.p], [model.expand(ca.vcat([model.symbol(name) for name in names]))])
    every = round(seconds / 100 / h)
    return np.array(shown(track, p))[:, every - 1 :: every].T


@functools.cache
def bare_track() -> np.ndarray:
    return driven(SHIP, 200.0)


@pytest.mark.parametrize(
    "name", [name for name in EFFECTS if name not in ("rudder_time_offset", "water_depth", "engine_lag", *GIVEN)]
)
def test_an_effect_of_usual_size_shows_in_a_manoeuvre_but_is_no_other_ship(name: str) -> None:
    card = card_with()
    nominal = np.array([7.7, 0.77, 0.048, 1.0, 160.0, 160.0, 0.35])
    change = np.abs(driven(with_values(name, first_values(name, card), card), 200.0) - bare_track()) / nominal
    assert np.all(np.isfinite(change))
    assert np.max(change) > 1e-3, name
    assert np.max(change[:50]) < 2.0, name


def test_a_late_rudder_of_usual_size_shows_in_its_record() -> None:
    card, time = card_with(), np.arange(0.0, 60.0, 0.1)
    order = np.where(time < 20, 0.0, 0.6)
    effect = EFFECTS["rudder_time_offset"]
    late = correct_reading(time, {"delta_order_rad": order}, effect, first_values("rudder_time_offset", card))
    assert np.sum(late["delta_order_rad"] != order) == 11  # 0.05 L/u0 = 1.04 s: the last of them asks for 19.96 s


@pytest.mark.parametrize(("name", "seconds"), [("rudder_lag", (2.0, 1.0, 4.0)), ("telemotor_lag", (1.0, 0.5, 2.0))])
def test_lags_of_a_gear_begin_at_seconds_where_a_length_takes_twenty(name: str, seconds: tuple[float, ...]) -> None:
    (lag,) = EFFECTS[name].parameters
    found = lag.typical_values(card_with(text=mariner_text(length_m="length_m = 160.0", speed_mps="speed_mps = 8.0")))
    assert found == pytest.approx(seconds)
    assert (lag.minimum, lag.maximum) == (0.01, 100.0)
