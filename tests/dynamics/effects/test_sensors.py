"""Faults of sensors against plain formulas, and records mended against the motion that was hidden behind them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.dynamics import Model
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.sensors import correct_reading
from tank2sim.fmu.interface import interface

from .ships import TYPICAL, ship, values

SENSORS = [name for name, effect in EFFECTS.items() if effect.acts_on == "sensor"]
DEG = np.pi / 180
NAMES = ("u_mps", "v_mps", "r_radps", "psi_rad", "x_m", "y_m")


def shown(effect: str, given: dict[str, float], true: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What a record shows, from the meaning of each fault, with complex numbers for vectors in the plane."""
    u, v, r, psi, x, y = (np.asarray(true[name], float) for name in NAMES)
    if effect == "gyro_bias":
        r = r + given["rate_radps"]
    elif effect == "gyro_scale":
        r = r + given["factor"] * r
    elif effect == "heading_offset":
        psi = psi + given["angle_rad"]
    elif effect == "antenna_lever_arm":
        antenna = x + 1j * y + (given["forward_m"] + 1j * given["starboard_m"]) * np.exp(1j * psi)
        x, y = antenna.real, antenna.imag
    elif effect == "log_scale":
        u, v = u + given["factor"] * u, v + given["factor"] * v
    elif effect == "log_misalignment":
        seen = (u + 1j * v) * np.exp(-1j * given["angle_rad"])
        u, v = seen.real, seen.imag
    elif effect == "log_lever_arm":
        v = v + given["forward_m"] * r
    else:
        raise AssertionError(effect)
    return dict(zip(NAMES, (u, v, r, psi, x, y), strict=True))


def in_si(name: str) -> dict[str, float]:
    from tank2sim.units import to_si

    return dict(to_si(key, value) for key, value in TYPICAL[name].items())


AT = {
    "motion.u": 6.1, "motion.v": -0.7, "motion.r": 0.011, "motion.psi": 2.3, "motion.x": 400.0, "motion.y": -150.0,
}  # fmt: skip
TRUE = {name: np.array([value]) for name, value in zip(NAMES, AT.values(), strict=True)}


def readings(model: Model) -> dict[str, float]:
    variables = [name.replace("motion.", "sensor.") for name in AT]
    names = [one if one in model else one.replace("sensor.", "motion.") for one in variables]
    return dict(zip(NAMES, values(model, names, AT), strict=True))


@pytest.mark.parametrize("name", [name for name in SENSORS if name != "rudder_time_offset"])
def test_a_sensor_shows_what_its_fault_means(name: str) -> None:
    model = ship({name: TYPICAL[name]})
    found, expected = readings(model), shown(name, in_si(name), TRUE)
    for signal in NAMES:
        assert found[signal] == pytest.approx(float(expected[signal][0]), rel=1e-13)
    assert found != pytest.approx({key: float(one[0]) for key, one in TRUE.items()}, rel=1e-4)


def test_signs_of_faults_in_plain_words() -> None:
    north = {"u_mps": 5.0, "v_mps": 0.0, "r_radps": 0.01, "psi_rad": 0.0, "x_m": 0.0, "y_m": 0.0}
    at = dict(zip(AT, north.values(), strict=True))

    def seen(name: str, variable: str, **given: float) -> float:
        return float(values(ship({name: given}), [variable], at)[0])

    # A ship heading north: an antenna forward lies to the north of midships, one to starboard to the east.
    assert seen("antenna_lever_arm", "sensor.x", forward_m=30.0, starboard_m=4.0) == pytest.approx(30.0)
    assert seen("antenna_lever_arm", "sensor.y", forward_m=30.0, starboard_m=4.0) == pytest.approx(4.0)
    # A log that points to starboard takes headway for water from starboard: leeway to port.
    assert seen("log_misalignment", "sensor.v", angle_deg=2.0) < 0
    # The bow of a ship that turns to starboard goes to starboard.
    assert seen("log_lever_arm", "sensor.v", forward_m=30.0) == pytest.approx(0.3)
    assert seen("gyro_bias", "sensor.r", rate_degps=0.1) == pytest.approx(0.01 + 0.1 * DEG)
    assert seen("heading_offset", "sensor.psi", angle_deg=2.0) == pytest.approx(2 * DEG)


@pytest.mark.parametrize("name", SENSORS)
def test_a_fault_of_a_sensor_is_no_business_of_the_ship(name: str) -> None:
    model, bare = ship({name: TYPICAL[name]}), ship()
    assert model.outputs == bare.outputs and model.state_names == bare.state_names
    assert model.input_names == bare.input_names and model.step_s == bare.step_s
    at = {**AT, "rudder.angle": 0.2, "rudder.command": 0.3}
    np.testing.assert_array_equal(values(model, list(model.outputs), at), values(bare, list(bare.outputs), at))
    declared = [one.name for one in interface(model).variables]
    assert not [one for one in declared if one.startswith("sensor.")]


@pytest.mark.slow
def test_a_second_fault_acts_on_what_the_first_shows() -> None:
    pairs = itertools.permutations([one for one in SENSORS if one != "rudder_time_offset"], 2)
    for first, second in pairs:
        earlier = shown(first, in_si(first), TRUE)
        # Only of its own variables does a sensor see the fault of another: an antenna swings with the true heading.
        both = shown(second, in_si(second), {**TRUE, **{name: earlier[name] for name in mixed(second)}})
        expected = {name: both[name] if name in mixed(second) else earlier[name] for name in NAMES}
        found = readings(ship({first: TYPICAL[first], second: TYPICAL[second]}))
        for name in NAMES:
            assert found[name] == pytest.approx(float(expected[name][0]), rel=1e-13), (first, second, name)


def mixed(effect: str) -> tuple[str, ...]:
    return {"gyro": ("r_radps",), "head": ("psi_rad",), "ante": ("x_m", "y_m")}.get(
        effect[:4], ("v_mps",) if effect == "log_lever_arm" else ("u_mps", "v_mps")
    )


@pytest.mark.parametrize("name", [name for name in SENSORS if name != "rudder_time_offset"])
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.floats(-0.9, 0.9))
def test_a_record_is_corrected_to_what_was_measured(name: str, seed: int, size: float) -> None:
    effect, random = EFFECTS[name], np.random.default_rng(seed)
    given = {one.name: size * min(one.maximum, -one.minimum) for one in effect.parameters}
    true = dict(zip(NAMES, random.normal(size=(6, 40)) * [[8], [1], [0.02], [3], [900], [900]], strict=True))
    record = {**shown(name, given, true), "phi_rad": true["psi_rad"]}
    found = correct_reading(np.arange(40.0), record, effect, given)
    assert set(found) == set(record)
    for signal, column in true.items():
        scale = np.max(np.abs(column)) + (abs(given.get("forward_m", 0.0)) if signal in ("v_mps", "x_m", "y_m") else 0)
        np.testing.assert_allclose(found[signal], column, atol=1e-12 * scale)
    np.testing.assert_array_equal(found["phi_rad"], true["psi_rad"])


def test_gaps_stay_gaps_and_signals_that_were_not_recorded_are_not_needed_or_named() -> None:
    time, gap = np.arange(3.0), np.array([5.0, np.nan, 6.0])
    mended = correct_reading(time, {"u_mps": gap}, EFFECTS["log_scale"], {"factor": 0.25})
    np.testing.assert_allclose(mended["u_mps"], [4.0, np.nan, 4.8])
    still = {"psi_rad": np.ones(3)}
    assert correct_reading(time, still, EFFECTS["gyro_bias"], {"rate_radps": 0.1}).keys() == still.keys()
    with pytest.raises(ValueError, match="log_misalignment cannot be corrected without v_mps"):
        correct_reading(time, {"u_mps": gap}, EFFECTS["log_misalignment"], {"angle_rad": 0.1})
    with pytest.raises(ValueError, match="antenna_lever_arm cannot be corrected without psi_rad"):
        correct_reading(time, {"x_m": gap}, EFFECTS["antenna_lever_arm"], {"forward_m": 9.0, "starboard_m": 0.0})


def steps(time: np.ndarray) -> np.ndarray:
    """Orders as they reached the ship: 0, then 20 deg from 3 s, then -10 deg from 7.5 s."""
    return np.select([time < 3.0 - 1e-9, time < 7.5 - 1e-9], [0.0, 20 * DEG], -10 * DEG)


@pytest.mark.parametrize("delay", [0.5, 1.3, 0.1, 0.0, -0.7])
def test_the_ship_answers_late_to_the_record_of_its_orders(delay: float) -> None:
    """The record shows at t what the ship got at t + delay: orders come back exactly, sample for sample."""
    time = 0.1 * np.arange(120)
    record = {"delta_order_rad": steps(time + delay), "delta_rad": np.sin(time + delay), "n_radps": time}
    found = correct_reading(time, record, EFFECTS["rudder_time_offset"], {"delay_s": delay})
    np.testing.assert_array_equal(found["delta_order_rad"], steps(time))
    inner = (time - delay >= 0) & (time - delay <= time[-1])
    np.testing.assert_allclose(found["delta_rad"][inner], np.sin(time)[inner], atol=1e-12)
    np.testing.assert_array_equal(found["n_radps"], time)


def test_an_order_is_held_between_samples_and_never_interpolated() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    record = {"delta_order_rad": np.array([0.0, 0.0, 0.3, 0.3, -0.3])}
    found = correct_reading(time, record, EFFECTS["rudder_time_offset"], {"delay_s": 0.4})["delta_order_rad"]
    np.testing.assert_array_equal(found, [0.0, 0.0, 0.0, 0.3, 0.3])
    early = correct_reading(time, record, EFFECTS["rudder_time_offset"], {"delay_s": -1.4})["delta_order_rad"]
    np.testing.assert_array_equal(early, [0.0, 0.3, 0.3, -0.3, -0.3])


def test_the_delay_is_that_of_the_rudders_order() -> None:
    assert EFFECTS["rudder_time_offset"].delays == {"rudder.command": "delay_s"}
    assert not [name for name, effect in EFFECTS.items() if effect.delays and name != "rudder_time_offset"]
