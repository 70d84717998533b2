"""Motion under recorded inputs and its derivatives: against the closed form of a first-order system and differences."""

import numpy as np
import pytest

from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State
from tank2sim.simulation.sensitivity import Sensitivity

GAIN, LAG = 0.4, 6.0


@pytest.fixture(params=["machine code", "numpy"])
def compiler(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setenv("CC", "no-such-compiler")
    return request.param


@pytest.fixture
def first_order(compiler) -> Model:
    """T dr/dt + r = K delta (Nomoto)."""
    gain = Parameter(name="gain", unit="1", description="K, 1/s", start=GAIN)
    lag = Parameter(name="lag", unit="s", description="T", start=LAG)
    rudder = Input(name="rudder", unit="rad", description="delta")
    rate = State(name="rate", unit="rad/s", description="r", derivative="rate.dot", start=0.0)
    change = Quantity(
        name="rate.dot",
        unit="rad/s2",
        description="dr/dt",
        value=(gain.symbol * rudder.symbol - rate.symbol) / lag.symbol,
    )
    double = Quantity(name="double", unit="rad/s", description="2 r + K", value=2 * rate.symbol + gain.symbol)
    return Model(
        name="nomoto",
        description="first order",
        states=(rate,),
        inputs=(rudder,),
        parameters=(gain, lag),
        quantities=(change, double),
        outputs=("double",),
        step_s=0.1,
    )


def exact(time, start, rudder, gain=GAIN, lag=LAG):
    """r and its derivatives by r0, K and T under a held rudder."""
    fade = np.exp(-time / lag)
    by_lag = (start - gain * rudder) * fade * time / lag**2
    return gain * rudder + (start - gain * rudder) * fade, fade, rudder * (1 - fade), by_lag


def test_motion_and_derivatives_are_those_of_the_closed_form(first_order, compiler):
    sensitivity = Sensitivity(first_order, ("gain", "lag"), ("rate", "double"))
    assert (sensitivity._library is None) == (compiler == "numpy")
    h, n, p = 0.1, 100, first_order.parameter_values()
    starts, rudders = np.array([0.0, 0.3, -0.2]), np.array([0.2, 0.0, -0.5])
    inputs = np.repeat(rudders[:, None, None], n + 1, axis=1)
    motions = [sensitivity.motion(np.array([s]), one[:-1], p, h) for s, one in zip(starts, inputs, strict=True)]
    states = np.stack(motions)
    seen, by, end_by = sensitivity.derivatives(states, inputs, p, h)
    time = h * np.arange(n + 1)
    for piece, (start, rudder) in enumerate(zip(starts, rudders, strict=True)):
        rate, by_start, by_gain, by_lag = exact(time, start, rudder)
        np.testing.assert_allclose(states[piece, :, 0], rate, atol=1e-8)
        np.testing.assert_allclose(seen[piece], np.column_stack([rate, 2 * rate + GAIN]), atol=1e-8)
        np.testing.assert_allclose(by[piece, :, 0], np.column_stack([by_start, by_gain, by_lag]), atol=1e-7)
        own = np.column_stack([2 * by_start, 2 * by_gain + 1, 2 * by_lag])  # K acts directly too
        np.testing.assert_allclose(by[piece, :, 1], own, atol=1e-7)
        np.testing.assert_allclose(end_by[piece, 0], by[piece, -1, 0], atol=1e-12)


def test_an_input_acts_from_its_row_to_the_next(first_order):
    sensitivity = Sensitivity(first_order, ("gain",), ("rate",))
    inputs = np.zeros((20, 1))
    inputs[10] = 0.5
    states = sensitivity.motion(np.zeros(1), inputs, first_order.parameter_values(), 0.1)
    assert np.all(states[:11] == 0)
    assert states[11, 0] == pytest.approx(exact(0.1, 0.0, 0.5)[0], rel=1e-6)


def test_derivatives_of_a_ship_are_those_of_differences(mariner):
    free, seen = ("derivatives.Nr", "derivatives.Yvvr", "steering.time_constant"), ("motion.r", "motion.v", "motion.x")
    sensitivity = Sensitivity(mariner, free, seen)
    rng, h = np.random.default_rng(1), 0.5
    inputs = np.repeat(mariner.input_values()[None], 61, axis=0)
    inputs[:, mariner.input_names.index("rudder.command")] = 0.3 * np.sign(rng.standard_normal(61))
    start = np.array(mariner.initial(mariner.parameter_values())).ravel()

    def shown(change=(0.0, 0.0, 0.0), turned=0.0):
        values = dict(zip(mariner.parameter_names, mariner.parameter_values(), strict=True))
        p = mariner.parameter_values({name: values[name] + by for name, by in zip(free, change, strict=True)})
        other = start + turned * np.eye(len(start))[mariner.state_names.index("motion.r")]
        states = sensitivity.motion(other, inputs[:-1], p, h)
        return states, sensitivity.shown(states, inputs, p)

    states, _ = shown()
    by = sensitivity.derivatives(states[None], inputs[None], mariner.parameter_values(), h)[1][0]
    for place, size in enumerate((1e-6, 1e-4, 1e-4)):
        change = size * np.eye(3)[place]
        difference = (shown(change)[1] - shown(-change)[1]) / (2 * size)
        scale = np.abs(difference).max(axis=0)
        np.testing.assert_allclose(by[:, :, len(start) + place] / scale, difference / scale, atol=1e-4)
    difference = (shown(turned=1e-6)[1] - shown(turned=-1e-6)[1]) / 2e-6
    own = by[:, :, mariner.state_names.index("motion.r")]
    np.testing.assert_allclose(
        own / np.abs(difference).max(axis=0), difference / np.abs(difference).max(axis=0), atol=1e-5
    )


def test_without_parameters_the_derivatives_are_those_by_the_initial_state(first_order):
    inputs, p = np.full((1, 21, 1), 0.2), first_order.parameter_values()
    with_gain, without = (Sensitivity(first_order, free, ("rate", "double")) for free in (("gain",), ()))
    states = with_gain.motion(np.zeros(1), inputs[0, :-1], p, 0.1)[None]
    by = without.derivatives(states, inputs, p, 0.1)[1]
    assert by.shape == (1, 21, 2, 1)
    np.testing.assert_array_equal(by, with_gain.derivatives(states, inputs, p, 0.1)[1][..., :1])


def test_a_change_of_a_state_fades_as_the_closed_form_does(first_order, compiler):
    sensitivity = Sensitivity(first_order, (), ("double", "rate"))
    h, n, p = 0.1, 40, first_order.parameter_values()
    inputs = np.full((n, 1), 0.2)
    states = sensitivity.motion(np.array([0.1]), inputs, p, h)
    by = np.zeros((n + 1, 1, 2))
    by[0, 0, 0], by[15, 0, 1] = 1.0, 3.0
    sensitivity.propagate(by, sensitivity.tangents(states[:-1], inputs, p, h))
    time = h * np.arange(n + 1)
    assert by[:, 0, 0] == pytest.approx(np.exp(-time / LAG))
    assert by[:, 0, 1] == pytest.approx(3 * np.where(time >= 1.45, np.exp(-(time - 1.5) / LAG), 0.0))
    assert sensitivity.rates(states[:-1], inputs, p)[:, 0] == pytest.approx((GAIN * 0.2 - states[:-1, 0]) / LAG)
    assert sensitivity.shown_by_states(states[:-1], inputs, p) == pytest.approx(np.tile([[2.0], [1.0]], (n, 1, 1)))
