"""What a ship with effects would do along a motion, against her equations typed by hand and integrated by scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.inference.batch import MEASURED_STATES, MeasuredBatch
from tank2sim.gap.inference.hypothesis import CLOCK, Hypothesis
from tank2sim.gap.inference.prior import candidate_explanations, with_executes
from tests.identification.trials import made_up_ship
from tests.identification.trials.made_up_ship import SPEED, TRUTH, accelerations

STEP, FINE, BLOCKS = 0.1, 25, 40
LAG = 0.5
NOTHING = np.zeros(0)
SEEN = ("motion.psi", "motion.u", "motion.v", "motion.r", "motion.x", "motion.y")


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


@pytest.fixture(scope="module")
def limited() -> ManoeuvringCard:
    """The same ship with a largest rate of her gear."""
    text = made_up_ship.CARD.replace("time_constant_s = 0.5", "time_constant_s = 0.5\nmax_rate_degps = 3.0")
    read = parse_card(text, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


def order(t):
    """A slow wave, so that the order's mean over a step is its value in the middle; it begins at rest."""
    return 0.3 * np.cos(np.asarray(t) / 8) - 0.28


def behind(t, T=LAG):
    """The rudder behind a gear of first order that stood still at the first order: exact."""
    w = 1 / 8
    gain = 1 / (1 + (w * T) ** 2)
    return -0.28 + 0.3 * gain * (np.cos(w * t) + w * T * np.sin(w * t)) + 0.3 * (1 - gain) * np.exp(-t / T)


def rates(t, x, rudder, current=(0.0, 0.0)):
    u, v, r, psi = x[:4]
    north = u * np.cos(psi) - v * np.sin(psi) + current[0]
    east = u * np.sin(psi) + v * np.cos(psi) + current[1]
    return [*accelerations(u, v, r, rudder(t), TRUTH), r, north, east]


def simulated(rudder, given, current=(0.0, 0.0)) -> MeasuredBatch:
    """Two runs without noise, one from a straight course and one from a turn; `given` of the rudder was recorded."""
    n = FINE * BLOCKS
    t = STEP * np.arange(n)
    starts = ([SPEED, 0, 0, 0.3, 0, 0], [4.5, -0.3, 0.01, -1.0, 50, 20])
    solved = [
        solve_ivp(rates, (0, t[-1]), start, args=(rudder, current), t_eval=t, rtol=1e-9, atol=1e-10, max_step=1.0).y.T
        for start in starts
    ]
    inputs = np.tile(given(t[:-1] + STEP / 2)[:, None], (2, 1, 1))
    measured = np.zeros((2, BLOCKS, 6))
    lengths = np.full(2, BLOCKS)
    return MeasuredBatch(
        names=("a", "b"),
        seen=SEEN,
        step_s=STEP,
        fine=FINE,
        begin_s=np.zeros(2),
        lengths=lengths,
        states=np.array(solved),
        inputs=inputs,
        measured=measured,
        noise=np.ones(6),
        unsure_s=np.zeros(2),
        at_execute=np.zeros(2, dtype=bool),
    )


@pytest.fixture(scope="module")
def by_angle() -> MeasuredBatch:
    return simulated(order, order)


@pytest.fixture(scope="module")
def by_order() -> MeasuredBatch:
    return simulated(behind, order)


def true_rates(motion: MeasuredBatch) -> np.ndarray:
    """Mean rates from the middle of each block to that of the next."""
    return np.diff(motion.states[:, FINE // 2 :: FINE], axis=1) / (STEP * FINE)


SIZES = np.array([0.05, 0.05, 1e-3, 0.02, 5.0, 5.0])
"""Of the rates in these manoeuvres."""


def test_fine_rates_are_the_derivatives_of_the_true_motion(card, by_angle, by_order) -> None:
    for driven_by, motion in (("angle", by_angle), ("order", by_order)):
        found = Hypothesis(card, driven_by).fine_rates(motion, NOTHING)
        assert np.abs(found - true_rates(motion)).max(axis=(0, 1)) / SIZES == pytest.approx(0, abs=4e-4), driven_by


def test_rates_are_the_equations_at_the_mean_states_of_a_block(card, by_angle) -> None:
    hypothesis = Hypothesis(card, "angle")
    x, rudder = by_angle.block_states, by_angle.block_inputs[..., 0]
    u, v, r, psi = (x[..., place] for place in range(4))
    by_hand = [*accelerations(u, v, r, rudder, TRUTH), r, u * np.cos(psi) - v * np.sin(psi)]
    by_hand.append(u * np.sin(psi) + v * np.cos(psi))
    assert hypothesis.rates(by_angle, NOTHING) == pytest.approx(np.stack(by_hand, axis=-1), rel=1e-9, abs=1e-12)
    assert hypothesis.unmeasured_states(by_angle, NOTHING).shape == (2, FINE * BLOCKS, 0)


def test_a_current_carries_the_ship(card) -> None:
    speed, direction = 0.7, 2.0
    motion = simulated(order, order, (speed * np.cos(direction), speed * np.sin(direction)))
    hypothesis = Hypothesis(card, "angle", ["current"])
    assert [estimate.parameter.name for estimate in hypothesis.estimated] == ["speed_mps", "direction_rad"]
    found = hypothesis.fine_rates(motion, np.array([speed, direction]))
    assert np.abs(found - true_rates(motion)).max(axis=(0, 1)) / SIZES == pytest.approx(0, abs=2e-4)
    away = hypothesis.fine_rates(motion, np.array([0.0, direction])) - true_rates(motion)
    assert away[..., 4:] == pytest.approx(
        np.broadcast_to(-speed * np.array([np.cos(2), np.sin(2)]), (2, 39, 2)), abs=2e-3
    )


def test_the_rudder_follows_its_order_as_the_gear_does(card, by_order) -> None:
    hypothesis = Hypothesis(card, "order")
    t = STEP * np.arange(FINE * BLOCKS)
    assert hypothesis.unmeasured == ("rudder.angle",)
    for run in range(2):
        assert hypothesis.unmeasured_states(by_order, NOTHING)[run, :, 0] == pytest.approx(behind(t), abs=1e-4)


def stepped(motion: MeasuredBatch, at: float, size: float) -> MeasuredBatch:
    """The same motion with an order of `size` from a time on."""
    begins = STEP * np.arange(motion.inputs.shape[1])
    held = np.where(begins > at - 1e-9, size, 0.0)
    return replace(motion, inputs=np.tile(held[:, None], (2, 1, 1)))


def test_a_lag_and_a_limit_of_the_gear(card, by_order) -> None:
    t, kicked = STEP * np.arange(FINE * BLOCKS), stepped(by_order, 20.0, 0.3)
    after = np.maximum(t - 20.0, 0)
    lagging = Hypothesis(card, "order", ["rudder_lag"]).unmeasured_states(kicked, np.array([3.0]))
    assert lagging[0, :, 0] == pytest.approx(0.3 * (1 - np.exp(-after / 3.0)), abs=1e-5)
    limited = Hypothesis(card, "order", ["rudder_rate_limit"]).unmeasured_states(kicked, np.array([0.05]))
    running = 0.05 * after  # until the lag of the gear asks for less
    slow = running < 0.3 - 0.05 * LAG - 0.01
    assert limited[0, slow, 0] == pytest.approx(running[slow], abs=1e-6)
    assert limited[0, -1, 0] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("delay", [1.3, 0.04, 2.0, -1.3])
def test_a_time_offset_moves_the_rudder_by_the_delay(card, by_angle, by_order, delay: float) -> None:
    hypothesis = Hypothesis(card, "angle", ["rudder_time_offset"])
    middles = STEP * (np.arange(FINE * BLOCKS - 1) + 0.5)
    inside = (middles > 3) & (middles < middles[-1] - 3)
    found = hypothesis.inputs(by_angle, np.array([delay]))
    assert found[0, inside, 0] == pytest.approx(order(middles - delay)[inside], abs=1e-5)
    # an order reaches the ship through the gear: its angle is late
    hypothesis = Hypothesis(card, "order", ["rudder_time_offset"])
    t = STEP * np.arange(FINE * BLOCKS)
    inside = (t > 6) & (t < t[-1] - 3)
    states = hypothesis.unmeasured_states(by_order, np.array([delay]))
    assert states[1, inside, 0] == pytest.approx(behind(t - delay)[inside], abs=1e-4)
    assert hypothesis.inputs(by_order, np.array([delay]))[0, :, 0] == pytest.approx(by_order.inputs[0, :, 0])


def test_a_late_step_of_the_order_keeps_its_shape(card, by_order) -> None:
    """An order at 20 s that acts 0.44 s later: nothing before 20.44 s, and the lag from there."""
    kicked, t = stepped(by_order, 20.0, 0.3), STEP * np.arange(FINE * BLOCKS)
    states = Hypothesis(card, "order", ["rudder_time_offset"]).unmeasured_states(kicked, np.array([0.44]))
    exact = 0.3 * (1 - np.exp(-np.maximum(t - 20.44, 0) / LAG))
    assert states[0, :, 0] == pytest.approx(exact, abs=0.3 * STEP / LAG * 0.3)
    assert np.all(states[0, t < 20.35, 0] == 0)


def by_hand(name: str, theta, x):
    u, v, r, psi, north, east = (x[..., place] for place in range(6))
    (a, *offsets) = theta
    changed = {
        "gyro_bias": lambda: {"r": r + a},
        "gyro_scale": lambda: {"r": (1 + a) * r},
        "heading_offset": lambda: {"psi": psi + a},
        "antenna_lever_arm": lambda: {
            "x": north + a * np.cos(psi) - offsets[0] * np.sin(psi),
            "y": east + a * np.sin(psi) + offsets[0] * np.cos(psi),
        },
        "log_scale": lambda: {"u": (1 + a) * u, "v": (1 + a) * v},
        "log_misalignment": lambda: {"u": u * np.cos(a) + v * np.sin(a), "v": v * np.cos(a) - u * np.sin(a)},
        "log_lever_arm": lambda: {"v": v + a * r},
    }[name]()
    plain = {"u": u, "v": v, "r": r, "psi": psi, "x": north, "y": east}
    return np.stack([(plain | changed)[name.removeprefix("motion.")] for name in SEEN], axis=-1)


SENSORS = {
    "gyro_bias": (0.004,),
    "gyro_scale": (-0.1,),
    "heading_offset": (0.05,),
    "antenna_lever_arm": (-40.0, 7.0),
    "log_scale": (0.08,),
    "log_misalignment": (0.1,),
    "log_lever_arm": (30.0,),
}


@pytest.mark.parametrize("name", SENSORS)
def test_readings_of_faulty_sensors(card, by_angle, name: str) -> None:
    theta = np.array(SENSORS[name])
    hypothesis = Hypothesis(card, "angle", [name])
    means = by_angle.states.reshape(2, BLOCKS, FINE, 6).mean(axis=2)
    assert hypothesis.readings(by_angle, theta) == pytest.approx(by_hand(name, theta, means))
    assert hypothesis.readings(by_angle, 0 * theta) == pytest.approx(
        means[..., [MEASURED_STATES.index(name) for name in SEEN]]
    )
    assert hypothesis.rates(by_angle, theta) == pytest.approx(Hypothesis(card, "angle").rates(by_angle, NOTHING))


def test_slopes_are_difference_quotients(card, by_angle) -> None:
    hypothesis = Hypothesis(card, "angle", ["antenna_lever_arm", "log_misalignment"])
    theta = np.array([-40.0, 7.0, 0.1])
    by_state, seen = hypothesis.slopes(by_angle, theta)
    for column, size in enumerate((1e-3, 1e-3, 1e-6, 1e-4, 1e-2, 1e-2)):
        forward, back = (
            replace(by_angle, states=by_angle.states + sign * size * np.eye(6)[column]) for sign in (1.0, -1.0)
        )
        for whole, of in ((by_state, hypothesis.rates), (seen, hypothesis.readings)):
            quotient = (of(forward, theta) - of(back, theta)) / (2 * size)
            scale = np.abs(whole[..., column]).max() + 1e-9
            assert whole[..., column] / scale == pytest.approx(quotient / scale, abs=1e-5)


def test_slopes_in_the_coefficients_are_those_of_the_equations(card, by_angle) -> None:
    names = ("Nv", "Yr", "Xvv", "Nrdot")
    found = Hypothesis(card, "angle").coefficient_slopes(by_angle, NOTHING, [f"derivatives.{name}" for name in names])
    x, rudder = by_angle.block_states, by_angle.block_inputs[..., 0]
    for column, name in enumerate(names):
        step = 1e-4 * abs(TRUTH[name])
        forward, back = (
            np.stack(
                accelerations(*np.moveaxis(x[..., :3], -1, 0), rudder, {**TRUTH, name: TRUTH[name] + sign * step}), -1
            )
            for sign in (1, -1)
        )
        quotient = (forward - back) / (2 * step)
        assert found[..., :3, column] == pytest.approx(quotient, rel=1e-5, abs=1e-7 * np.abs(quotient).max())
        assert np.all(found[..., 3:, column] == 0)


def accelerated(motion: MeasuredBatch, rudder: np.ndarray) -> np.ndarray:
    """Accelerations (R, T - 1, 3) by hand at the mean states of the blocks; `rudder` (n,) at the fine instants."""
    mean = motion.over_blocks(np.tile(0.5 * (rudder[1:] + rudder[:-1])[:, None], (2, 1, 1)))[..., 0]
    return np.stack(accelerations(*np.moveaxis(motion.block_states[..., :3], -1, 0), mean, TRUTH), axis=-1)


def quotient(motion: MeasuredBatch, rudder, h: float) -> np.ndarray:
    """By whatever ``rudder(h)`` (n,) depends on."""
    return (accelerated(motion, rudder(h)) - accelerated(motion, rudder(-h))) / (2 * h)


T_FINE = STEP * np.arange(FINE * BLOCKS)


def test_own_states_at_other_parameters_of_the_ship(card, by_order) -> None:
    hypothesis = Hypothesis(card, "order")
    p = hypothesis.parameters(NOTHING)
    p[hypothesis.model.parameter_names.index("steering.time_constant")] = 3 * LAG
    assert hypothesis.unmeasured_states(by_order, NOTHING, p)[1, :, 0] == pytest.approx(
        behind(T_FINE, 3 * LAG), abs=1e-4
    )
    assert hypothesis.unmeasured_states(by_order, NOTHING)[1, :, 0] == pytest.approx(behind(T_FINE), abs=1e-4)


def test_slopes_in_the_gear_s_time_constant_come_through_the_rudder(card, by_order) -> None:
    names = ("steering.time_constant", "derivatives.Nd")
    found = Hypothesis(card, "order").coefficient_slopes(by_order, NOTHING, names)
    by_hand = quotient(by_order, lambda h: behind(T_FINE, LAG + h), 1e-4)
    size = np.abs(by_hand).max(axis=(0, 1))
    assert np.all(size > 0)
    assert found[..., :3, 0] / size == pytest.approx(by_hand / size, abs=0.02)
    assert np.all(found[..., 3:, 0] == 0)
    alone = Hypothesis(card, "order").coefficient_slopes(by_order, NOTHING, names[1:])
    assert found[..., 1] == pytest.approx(alone[..., 0])


def test_slopes_in_the_gear_s_rate_are_the_time_for_which_it_runs(limited, by_order) -> None:
    kicked, hypothesis = stepped(by_order, 20.0, 0.3), Hypothesis(limited, "order")
    rate = np.deg2rad(3.0)
    found = hypothesis.coefficient_slopes(kicked, NOTHING, ("steering.max_rate",))
    running = np.clip(T_FINE - 20.0, 0, None)
    by_hand = quotient(kicked, lambda h: (rate + h) * running, 1e-4)
    middles = STEP * FINE * (np.arange(BLOCKS - 1) + 1)
    # until the lag asks for less than the largest rate
    whole = (middles - 1.5 > 20.0) & (middles + 1.5 < 20.0 + 0.3 / rate - LAG)
    before = middles + 1.5 < 20.0
    size = np.abs(by_hand[:, whole]).max(axis=(0, 1))
    assert whole.any() and np.all(size > 0)
    assert found[:, whole][..., :3, 0] / size == pytest.approx(by_hand[:, whole] / size, abs=0.02)
    assert np.all(found[:, before] == 0)
    assert np.abs(found[:, -1, :3, 0] / size).max() < 1e-3  # it has come to rest all the same


@pytest.mark.parametrize("driven_by", ["angle", "order"])
def test_slopes_in_the_clock_are_those_of_a_later_rudder(card, by_angle, by_order, driven_by: str) -> None:
    motion, rudder = (by_angle, order) if driven_by == "angle" else (by_order, behind)
    found = Hypothesis(card, driven_by).coefficient_slopes(motion, NOTHING, ("derivatives.Yr", CLOCK))
    by_hand = quotient(motion, lambda h: rudder(T_FINE - h), 1e-3)
    size = np.abs(by_hand).max(axis=(0, 1))
    # the first block begins with what was held before; a step of the record is the quotient's own
    assert found[:, 1:, :3, 1] / size == pytest.approx(by_hand[:, 1:] / size, abs=0.02)
    assert np.all(found[..., 3:, 1] == 0)


def test_of_what_an_effect_replaced_nothing_is_asked(limited, by_order) -> None:
    hypothesis, kicked = Hypothesis(limited, "order", ["rudder_rate_limit"]), stepped(by_order, 20.0, 0.3)
    names = ("steering.max_rate", "derivatives.Yd")
    found = hypothesis.coefficient_slopes(kicked, np.array([0.03]), names)
    assert np.all(found[..., 0] == 0) and np.abs(found[..., 1]).max() > 0
    assert np.abs(Hypothesis(limited, "order").coefficient_slopes(kicked, NOTHING, names)[..., 0]).max() > 0


@pytest.mark.parametrize("name", ["current", "wind", "wave_drift", "rudder_bias", "cross_flow_drag", "gyro_bias"])
def test_what_comes_from_the_compass_is_directed(mariner_card, name: str) -> None:
    assert Hypothesis(mariner_card, "order", [name]).directed == (name in {"current", "wind", "wave_drift"})
    assert Hypothesis(mariner_card, "order", ["hull_fouling", name]).directed == (
        name in {"current", "wind", "wave_drift"}
    )


def test_an_effect_at_nothing_is_the_ship_as_she_was(card, by_angle) -> None:
    plain = Hypothesis(card, "angle").rates(by_angle, NOTHING)
    for name in ("linear_yaw_damping", "cubic_yaw_damping", "rudder_bias", "gyro_bias", "current"):
        hypothesis = Hypothesis(card, "angle", [name])
        assert hypothesis.rates(by_angle, np.zeros(len(hypothesis.estimated))) == pytest.approx(plain)


TOUCHED = {"gyro_bias": (False, False, True), "current": (False, True, True), "rudder_bias": (False, True, False)}


@pytest.mark.parametrize(
    "name", [*TOUCHED, "rudder_lag", "telemotor_lag", "rudder_time_offset", "flow_memory", "antenna_lever_arm"]
)
def test_what_an_effect_does_not_touch_is_as_without_it(card, by_order, name: str) -> None:
    hypothesis, plain = Hypothesis(card, "order", [name]), Hypothesis(card, "order")
    states, rates_too, readings = hypothesis.influences
    assert TOUCHED.get(name, hypothesis.influences) == hypothesis.influences
    theta = np.array([estimate.parameter.typical_values(card)[0] for estimate in hypothesis.estimated])
    place = hypothesis.unmeasured.index("rudder.angle")
    pairs = (
        (
            states,
            hypothesis.unmeasured_states(by_order, theta)[..., place],
            plain.unmeasured_states(by_order, NOTHING)[..., 0],
        ),
        (rates_too, hypothesis.rates(by_order, theta), plain.rates(by_order, NOTHING)),
        (readings, hypothesis.readings(by_order, theta), plain.readings(by_order, NOTHING)),
    )
    assert any(touched for touched, *_ in pairs)
    for touched, with_it, without in pairs:
        assert touched or with_it == pytest.approx(without)


def test_parameters_that_are_known_a_little_are_asked_for_with_what_is_known(card) -> None:
    hypothesis = Hypothesis(card, "angle", ["wave_drift", "rudder_bias"])
    mean, precision = hypothesis.prior
    known = {estimate.parameter.name: place for place, estimate in enumerate(hypothesis.estimated)}
    assert (mean[known["surge_coefficient"]], precision[known["surge_coefficient"]]) == pytest.approx((2 / 3, 1 / 0.09))
    assert precision[known["height_m"]] == precision[known["angle_rad"]] == 0
    low, high = hypothesis.bounds
    assert np.all(low < high) and np.all(hypothesis.steps > 0)
    assert hypothesis.estimated[known["angle_rad"]].effect == "rudder_bias"


@pytest.mark.parametrize("name", ["rudder_lag", "telemotor_lag", "roll_coupling", "flow_memory"])
def test_the_shortest_time_that_is_tried_is_integrated(card, by_order, name: str) -> None:
    hypothesis = Hypothesis(card, "order", [name])
    theta = np.clip([0.1, 0.1, 0.0, 0.1][: len(hypothesis.estimated)], *hypothesis.bounds)
    for place, estimate in enumerate(hypothesis.estimated):
        if estimate.parameter.name.endswith("_s"):
            theta[place] = hypothesis.bounds[0][place]
            assert 0 < theta[place] < 1.0
    assert np.abs(hypothesis.unmeasured_states(stepped(by_order, 20.0, 0.3), theta)).max() < 10.0
    low, _ = Hypothesis(card, "order", ["rudder_time_offset"]).bounds
    assert low == [-60.0]


def test_steps_of_two_motions_are_each_motion_s_own(card, by_order) -> None:
    """The same rudder over steps twice as long."""
    hypothesis = Hypothesis(card, "order")
    fine = hypothesis.unmeasured_states(by_order, NOTHING)
    inputs = 0.5 * (by_order.inputs[:, :-1:2] + by_order.inputs[:, 1::2])
    states = by_order.states[:, : 2 * len(inputs[0]) + 1 : 2]
    coarse = replace(by_order, step_s=2 * STEP, states=states, inputs=inputs)
    assert hypothesis.unmeasured_states(coarse, NOTHING)[:, :, 0] == pytest.approx(
        fine[:, : 2 * len(inputs[0]) + 1 : 2, 0], abs=2e-3
    )


GEAR = {"rudder_rate_limit", "rudder_lag", "rudder_backlash", "rudder_dead_band", "telemotor_lag"}


def test_of_a_measured_angle_nothing_of_the_gear_is_asked(mariner_card) -> None:
    by_order, by_angle = (set(candidate_explanations(mariner_card, driven_by)) for driven_by in ("order", "angle"))
    assert by_order - by_angle == GEAR and by_angle < by_order
    assert {"rudder_bias", "rudder_time_offset", "current", "gyro_bias"} < by_angle


def test_effects_of_the_card_are_not_asked_for_again(card) -> None:
    text = made_up_ship.CARD + '\n[[effects]]\nname = "rudder_bias"\nparameters = { angle_deg = 1.0 }\n'
    without = candidate_explanations(parse_card(text, "made_up.toml"), "order")
    assert set(candidate_explanations(card, "order")) - set(without) == {"rudder_bias"}


@pytest.mark.parametrize(
    ("rudder", "expected"),
    [(lambda t: 0.3 + 0.0 * np.asarray(t), False), (lambda t: 0.3 - 0.3 * np.exp(-np.asarray(t) / LAG), True)],
    ids=["settled", "leaves amidships"],
)
def test_a_run_that_begins_at_the_execute_is_told_from_one_with_a_settled_rudder(card, rudder, expected) -> None:
    explained = Hypothesis(card, "order")
    motion = with_executes(explained, simulated(rudder, lambda t: np.full((len(t)), 0.3)))
    assert motion.at_execute.tolist() == [expected, expected]
    angle = explained.unmeasured_states(motion, NOTHING)[:, :, explained.unmeasured.index("rudder.angle")]
    times = STEP * np.arange(angle.shape[1])
    np.testing.assert_allclose(angle, [rudder(times)] * 2, atol=1e-3)
